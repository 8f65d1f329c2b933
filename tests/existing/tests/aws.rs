//! A client of the AWS SDK, and a server of HTTP that knows one call.

use aws_credential_types::Credentials;
use aws_sdk_sts::config::{BehaviorVersion, Region};
use aws_sdk_sts::{Client, Config};
use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::{TcpListener, TcpStream};

const ANSWER: &str = "<GetCallerIdentityResponse xmlns=\"https://sts.amazonaws.com/doc/2011-06-15/\"><GetCallerIdentityResult>\
     <Arn>arn:aws:iam::1:user/bed</Arn><UserId>bed</UserId><Account>1</Account></GetCallerIdentityResult></GetCallerIdentityResponse>";

async fn serve(stream: TcpStream) -> std::io::Result<()> {
    let (mut stream, mut line) = (BufReader::new(stream), String::new());
    loop {
        let mut length = 0;
        while line != "\r\n" {
            line.clear();
            if stream.read_line(&mut line).await? == 0 {
                return Ok(());
            }
            if let Some(("content-length", value)) = line.split_once(": ") {
                length = value.trim().parse().unwrap();
            }
        }
        line.clear();
        let mut body = vec![0; length];
        stream.read_exact(&mut body).await?;
        assert!(body.starts_with(b"Action=GetCallerIdentity"));
        let answer = format!("HTTP/1.1 200 OK\r\ncontent-type: text/xml\r\ncontent-length: {}\r\n\r\n{ANSWER}", ANSWER.len());
        stream.write_all(answer.as_bytes()).await?;
    }
}

#[test]
fn calls_are_answered() {
    // Calls have the time of day and numbers drawn from the system, so that the contents of packets differ.
    crate::over_lossy_links(
        |bed| bed.without_digests(),
        async |bed| {
            bed.host("server").spawn(async {
                let listener = TcpListener::bind("[::]:80").await.unwrap();
                loop {
                    tokio::spawn(serve(listener.accept().await.unwrap().0));
                }
            });
            let client = bed.host("client").spawn(async {
                let config = Config::builder()
                    .behavior_version(BehaviorVersion::latest())
                    .region(Region::new("eu-central-1"))
                    .credentials_provider(Credentials::new("id", "secret", None, None, "test"))
                    .endpoint_url("http://server")
                    .http_client(aws_smithy_http_client::Builder::new().build_http())
                    .build();
                let client = Client::from_conf(config);
                for _ in 0..10 {
                    assert_eq!(client.get_caller_identity().send().await.unwrap().account(), Some("1"));
                }
            });
            client.await.unwrap();
        },
    );
}

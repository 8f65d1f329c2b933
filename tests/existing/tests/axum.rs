//! axum, and a client of hyper over a stream of tokio.

use std::io;
use std::time::Duration;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::routing::{get, post};
use bytes::Bytes;
use cohaptic_testkit::{Bed, Testbed};
use http_body_util::{BodyExt, Full};
use hyper::Request;
use hyper_util::rt::TokioIo;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::sleep;

/// Listens as the tests of axum itself do.
async fn serve(app: Router) {
    let listener = std::net::TcpListener::bind("0.0.0.0:80").unwrap();
    listener.set_nonblocking(true).unwrap();
    axum::serve(TcpListener::from_std(listener).unwrap(), app).await.unwrap();
}

#[test]
fn requests_are_answered() {
    // Servers of hyper write the time of day into `Date`.
    crate::over_lossy_links(
        |bed| bed.without_digests(),
        async |bed| {
            bed.host("server").spawn(async {
                let app = Router::new().route("/", get(async || "hello")).route("/length", post(async |body: Bytes| body.len().to_string()));
                serve(app).await;
            });
            let client = bed.host("client").spawn(async {
                let stream = TcpStream::connect(("server", 80)).await.unwrap();
                let (mut sender, connection) = hyper::client::conn::http1::handshake(TokioIo::new(stream)).await.unwrap();
                tokio::spawn(connection);
                for size in [0, 1, 100_000] {
                    let request = Request::post("/length").header("host", "server").body(Full::new(Bytes::from(vec![7; size]))).unwrap();
                    let answer = sender.send_request(request).await.unwrap();
                    assert_eq!(answer.into_body().collect().await.unwrap().to_bytes(), size.to_string());
                    let request = Request::get("/").header("host", "server").body(Full::default()).unwrap();
                    assert_eq!(sender.send_request(request).await.unwrap().into_body().collect().await.unwrap().to_bytes(), "hello");
                }
            });
            client.await.unwrap();
        },
    );
}

/// Sends a request that is larger than the server allows, and reads the beginning of the answer meanwhile.
async fn answer_to_a_large_request() -> io::Result<String> {
    let mut stream = TcpStream::connect(("server", 80)).await?;
    stream.write_all(b"POST / HTTP/1.1\r\nhost: server\r\ncontent-length: 1000000\r\n\r\n").await?;
    let (mut read, mut write) = stream.into_split();
    tokio::spawn(async move {
        while write.write_all(&[7; 1000]).await.is_ok() {
            sleep(Duration::from_millis(10)).await;
        }
    });
    let mut answer = [0; 12];
    read.read_exact(&mut answer).await?;
    Ok(String::from_utf8_lossy(&answer).into_owned())
}

/// The server answers before the end of the request and closes the connection, so that the rest of the request is met by a reset. TCP then sends the answer no
/// more, if the packet of the answer was lost (RFC 9112, section 9.6). Tests of axum for limits of requests fail in this way over lossy links.
#[test]
fn an_early_answer_is_lost_with_its_packet() {
    let answer = |prepare: fn(Testbed) -> Testbed| {
        prepare(Testbed::new(["client", "server"]).links("delay 30ms").on_tokio()).run(async |bed: Bed| {
            bed.host("server").spawn(serve(Router::new().route("/", post(async |_: Bytes| ())).layer(DefaultBodyLimit::max(1000))));
            bed.host("client").spawn(answer_to_a_large_request()).await.unwrap()
        })
    };
    assert_eq!(answer(|bed| bed).unwrap(), "HTTP/1.1 413");
    let error = answer(|bed| bed.hit("server", "client", "drop first packet with \"413\"")).unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::ConnectionReset);
}

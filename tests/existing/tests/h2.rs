//! h2: both ends of HTTP/2, several requests at once.

use bytes::Bytes;
use http::{Request, Response};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;

async fn serve() {
    let listener = TcpListener::bind("0.0.0.0:80").await.unwrap();
    loop {
        let (stream, _) = listener.accept().await.unwrap();
        tokio::spawn(async move {
            let mut connection = h2::server::handshake(stream).await.unwrap();
            while let Some(request) = connection.accept().await {
                let (request, mut respond) = request.unwrap();
                let mut body = respond.send_response(Response::new(()), false).unwrap();
                body.send_data(Bytes::from(request.uri().path().to_owned()), true).unwrap();
            }
        });
    }
}

#[test]
fn requests_share_a_connection() {
    crate::over_lossy_links(
        |bed| bed,
        async |bed| {
            bed.host("server").spawn(serve());
            let client = bed.host("client").spawn(async {
                let stream = TcpStream::connect("server:80").await.unwrap();
                let (sender, connection) = h2::client::handshake(stream).await.unwrap();
                tokio::spawn(connection);
                let mut requests = JoinSet::new();
                for number in 0..20 {
                    let sender = sender.clone();
                    requests.spawn(async move {
                        let path = format!("/{number}");
                        let request = Request::get(format!("http://server{path}")).body(()).unwrap();
                        let (answer, _) = sender.ready().await.unwrap().send_request(request, true).unwrap();
                        let mut body = answer.await.unwrap().into_body();
                        let mut said = Vec::new();
                        while let Some(data) = body.data().await {
                            said.extend_from_slice(&data.unwrap());
                        }
                        assert_eq!(said, path.as_bytes());
                    });
                }
                assert_eq!(requests.join_all().await.len(), 20);
            });
            client.await.unwrap();
        },
    );
}

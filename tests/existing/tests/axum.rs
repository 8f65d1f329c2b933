//! axum, and a client of hyper over a stream of tokio.

use axum::Router;
use axum::routing::{get, post};
use bytes::Bytes;
use http_body_util::{BodyExt, Full};
use hyper::Request;
use hyper_util::rt::TokioIo;
use tokio::net::{TcpListener, TcpStream};

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

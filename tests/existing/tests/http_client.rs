//! The connector of hyper-util, on which reqwest stands, and reqwest: both make their sockets with `socket2`, and look names up with the standard library.

use std::time::Duration;

use axum::Router;
use axum::routing::{get, post};
use bytes::Bytes;
use cohaptic_testkit::Bed;
use http_body_util::{BodyExt, Full};
use hyper::Request;
use hyper_util::client::legacy::Client;
use hyper_util::client::legacy::connect::HttpConnector;
use hyper_util::rt::TokioExecutor;
use tokio::net::TcpListener;

fn serve(bed: &Bed) {
    bed.host("server").spawn(async {
        let app = Router::new().route("/", get(async || "hello")).route("/length", post(async |body: Bytes| body.len().to_string()));
        axum::serve(TcpListener::bind("0.0.0.0:80").await.unwrap(), app).await.unwrap();
    });
}

#[test]
fn the_connector_of_hyper_util() {
    // Servers of hyper write the time of day into `Date`.
    crate::over_lossy_links(
        |bed| bed.without_digests(),
        async |bed| {
            serve(&bed);
            let client = bed.host("client").spawn(async {
                let mut connector = HttpConnector::new();
                connector.set_nodelay(true);
                connector.set_keepalive(Some(Duration::from_secs(30)));
                connector.set_keepalive_interval(Some(Duration::from_secs(5)));
                connector.set_reuse_address(true);
                connector.set_recv_buffer_size(Some(100_000));
                connector.set_connect_timeout(Some(Duration::from_secs(60)));
                let client = Client::builder(TokioExecutor::new()).build(connector);
                for size in [1, 50_000] {
                    let request = Request::post("http://server/length").body(Full::new(Bytes::from(vec![7; size]))).unwrap();
                    let answer = client.request(request).await.unwrap();
                    assert_eq!(answer.into_body().collect().await.unwrap().to_bytes(), size.to_string());
                }
            });
            client.await.unwrap();
        },
    );
}

#[test]
fn reqwest_asks_and_is_answered() {
    crate::over_lossy_links(
        |bed| bed.without_digests(),
        async |bed| {
            serve(&bed);
            let client = bed.host("client").spawn(async {
                let client = reqwest::Client::builder().tcp_keepalive(Duration::from_secs(30)).no_proxy().build().unwrap();
                for size in [1, 50_000] {
                    let answer = client.post("http://server/length").body(vec![7; size]).send().await.unwrap();
                    assert_eq!(answer.text().await.unwrap(), size.to_string());
                }
                assert_eq!(client.get("http://server/").send().await.unwrap().text().await.unwrap(), "hello");
            });
            client.await.unwrap();
        },
    );
}

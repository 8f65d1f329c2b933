//! axum, by `axum::serve`.

use axum::Router;
use axum::body::Bytes;
use axum::extract::ConnectInfo;
use axum::http::{HeaderValue, Response};
use axum::middleware::map_response;
use axum::routing::{get, post};
use cohaptic_testkit::axum::ClientAddress;
use cohaptic_testkit::hyper::{Connector, Executor};
use cohaptic_testkit::{Bed, TcpListener};
use http_body_util::{BodyExt, Full};
use hyper_util::client::legacy::Client;

use crate::{octets, over_a_bad_link};

/// hyper sets the time of day where there is no date.
async fn dated<B>(mut response: Response<B>) -> Response<B> {
    response.headers_mut().insert("date", HeaderValue::from_static("Fri, 01 Jan 2027 00:00:00 GMT"));
    response
}

async fn service() {
    let app = Router::new()
        .route("/echo", post(|body: Bytes| async { body }))
        .route("/me", get(|ConnectInfo(ClientAddress(address)): ConnectInfo<ClientAddress>| async move { address.to_string() }))
        .layer(map_response(dated));
    let listener = TcpListener::bind("0.0.0.0:80").await.unwrap();
    axum::serve(listener, app.into_make_service_with_connect_info::<ClientAddress>()).await.unwrap();
}

#[test]
fn a_service_of_axum() {
    over_a_bad_link(
        |bed| bed.on_tokio(),
        |bed: Bed| async move {
            bed.host("server").start(service);
            cohaptic_testkit::time::yield_now().await;
            let host = bed.host("client");
            let client = Client::builder(Executor::new(&host)).build::<_, Full<Bytes>>(Connector::new(&host));
            let body = octets(20_000);
            let request = hyper::Request::post("http://server/echo").body(body.clone().into()).unwrap();
            assert_eq!(client.request(request).await.unwrap().into_body().collect().await.unwrap().to_bytes(), body);
            let answer = client.get("http://server/me".parse().unwrap()).await.unwrap().into_body().collect().await.unwrap().to_bytes();
            assert_eq!(answer, "10.0.0.1:49152");
        },
    );
}

#[test]
fn tasks_of_a_service_end_when_its_host_crashes() {
    let bed = cohaptic_testkit::Testbed::new(["client", "server"]).links("delay 10ms").on_tokio();
    bed.run(|bed| async move {
        let server = bed.host("server");
        server.start(service);
        cohaptic_testkit::time::yield_now().await;
        let ask = async || {
            let host = bed.host("client");
            let client = Client::builder(Executor::new(&host)).build::<_, Full<Bytes>>(Connector::new(&host));
            client.get("http://server/me".parse().unwrap()).await.map(|response| response.status().is_success())
        };
        assert!(ask().await.unwrap());
        server.crash();
        assert!(ask().await.is_err(), "after 131 s");
        server.restart();
        cohaptic_testkit::time::yield_now().await;
        assert!(ask().await.unwrap());
    });
}

//! The blocks of docs/testing.md that use axum, as they stand there, and what the first one comes to.

use std::time::Duration;

use axum::body::{Body, Bytes, to_bytes};
use axum::http::{Request, StatusCode};
use axum::{Router, routing::post};
use cohaptic_testkit::hyper::{Connector, Executor};
use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::proptest::test_runner::{RngAlgorithm, TestError, TestRng, TestRunner};
use cohaptic_testkit::strategies::{ImpairedLink, LinkBounds, links_like};
use cohaptic_testkit::{TcpListener, Testbed, time};
use http_body_util::{BodyExt, Full};
use hyper_util::client::legacy::Client;
use tokio::time::timeout;

async fn photo_within_five_seconds(photo: Body) -> StatusCode {
    timeout(Duration::from_secs(5), to_bytes(photo, 1 << 20)).await.map_or(StatusCode::REQUEST_TIMEOUT, |_| StatusCode::OK)
}

fn phones() -> impl Strategy<Value = ImpairedLink> {
    links_like(LinkBounds::ideal().delay(Duration::ZERO..=Duration::from_millis(100)).rate(64_000..=20_000_000))
}

/// What a phone is told that sends a photo of 100 kB.
fn answer(link: ImpairedLink, service: fn() -> Router) -> StatusCode {
    Testbed::new(["phone", "server"]).links(link).on_tokio().run(move |bed| async move {
        bed.host("server").spawn(async move { axum::serve(TcpListener::bind("0.0.0.0:80").await.unwrap(), service()).await });
        time::yield_now().await;
        let phone = bed.host("phone");
        let client = Client::builder(Executor::new(&phone)).build::<_, Full<Bytes>>(Connector::new(&phone));
        client.request(Request::post("http://server/").body(vec![7; 100_000].into()).unwrap()).await.unwrap().status()
    })
}

async fn photo_as_long_as_it_comes(mut photo: Body) -> StatusCode {
    while let Ok(part) = timeout(Duration::from_secs(5), photo.frame()).await {
        if part.is_none() {
            return StatusCode::OK;
        }
    }
    StatusCode::REQUEST_TIMEOUT
}

proptest! {
    #[test]
    fn a_phone_sends_a_photo(link in phones()) {
        prop_assert_eq!(answer(link, || Router::new().route("/", post(photo_as_long_as_it_comes))), StatusCode::OK);
    }
}

#[test]
fn a_limit_for_the_whole_photo_comes_down_to_a_slow_link() {
    const CHAPTER: &str = include_str!("../../../../docs/testing.md");
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let failed = runner.run(&phones(), |link| {
        prop_assert_eq!(answer(link, || Router::new().route("/", post(photo_within_five_seconds))), StatusCode::OK);
        Ok(())
    });
    let Err(TestError::Fail(_, least)) = failed else { panic!("{failed:?}") };
    assert!(CHAPTER.contains(&format!("minimal failing input: link = {least:?}")), "{least:?}");
}

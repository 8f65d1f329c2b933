//! The service that docs/testing.md begins with, and its test, which fails.

use std::time::Duration;

use axum::body::{Body, to_bytes};
use axum::http::{Request, StatusCode};
use axum::{Router, routing::post};
use cohaptic_testkit::Testbed;
use cohaptic_testkit::axum::serve;
use cohaptic_testkit::hyper::client;
use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::proptest::test_runner::{RngAlgorithm, TestError, TestRng, TestRunner};
use cohaptic_testkit::strategies::{LinkBounds, links_like};
use tokio::time::timeout;

async fn photo(photo: Body) -> StatusCode {
    timeout(Duration::from_secs(5), to_bytes(photo, 1 << 20)).await.map_or(StatusCode::REQUEST_TIMEOUT, |_| StatusCode::OK)
}

#[should_panic(expected = "minimal failing input: link = ImpairedLink::words(\"rate ")]
#[test]
fn a_phone_sends_a_photo() {
    proptest!(|(link in links_like(LinkBounds::phone()))| Testbed::new(["phone", "server"]).links(link).on_tokio().run(async |bed| {
        serve(&bed.host("server"), "0.0.0.0:80", Router::new().route("/", post(photo))).unwrap();
        assert_eq!(client(&bed.host("phone")).request(Request::post("http://server/").body("photo".repeat(200_000)).unwrap()).await.unwrap().status(), 200);
    }));
}

#[test]
fn a_limit_for_the_whole_photo_comes_down_to_a_slow_link() {
    const CHAPTER: &str = include_str!("../../../../docs/testing.md");
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let failed = runner.run(&links_like(LinkBounds::phone()), |link| {
        let status = Testbed::new(["phone", "server"]).links(link).on_tokio().run(async |bed| {
            serve(&bed.host("server"), "0.0.0.0:80", Router::new().route("/", post(photo))).unwrap();
            let photo = Request::post("http://server/").body("photo".repeat(200_000)).unwrap();
            client(&bed.host("phone")).request(photo).await.unwrap().status()
        });
        prop_assert_eq!(status, StatusCode::OK);
        Ok(())
    });
    let Err(TestError::Fail(_, least)) = failed else { panic!("{failed:?}") };
    assert!(CHAPTER.contains(&format!("minimal failing input: link = {least:?}")), "{least:?}");
}

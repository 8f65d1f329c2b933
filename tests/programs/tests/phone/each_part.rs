//! The service mended.

use std::time::Duration;

use axum::body::Body;
use axum::http::{Request, StatusCode};
use axum::{Router, routing::post};
use cohaptic_testkit::Testbed;
use cohaptic_testkit::axum::serve;
use cohaptic_testkit::hyper::client;
use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::{LinkBounds, links_like};
use http_body_util::BodyExt;
use tokio::time::timeout;

async fn photo(mut photo: Body) -> StatusCode {
    while let Ok(part) = timeout(Duration::from_secs(5), photo.frame()).await {
        if part.is_none() {
            return StatusCode::OK;
        }
    }
    StatusCode::REQUEST_TIMEOUT
}

#[test]
fn a_phone_sends_a_photo() {
    proptest!(|(link in links_like(LinkBounds::phone()))| Testbed::new(["phone", "server"]).links(link).on_tokio().run(async |bed| {
        serve(&bed.host("server"), "0.0.0.0:80", Router::new().route("/", post(photo))).unwrap();
        assert_eq!(client(&bed.host("phone")).request(Request::post("http://server/").body("photo".repeat(200_000)).unwrap()).await.unwrap().status(), 200);
    }));
}

//! Reads bodies of requests, with limits of length and time.

use axum::body::{Body, Bytes, to_bytes};
use axum::http::StatusCode;
use tokio::time::timeout;

use super::{App, Refusal};

/// Reads a body of at most `most` bytes within the server's patience.
pub(super) async fn read(app: &App, body: Body, most: usize) -> Result<Bytes, Refusal> {
    // Reading stops at the limit, so that a long body cannot fill the memory.
    let whole = timeout(app.patience, to_bytes(body, most)).await;
    let late = |_| Refusal::new(StatusCode::REQUEST_TIMEOUT, format!("expected the whole body within {:?}", app.patience));
    let broken = |_| Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, format!("expected a body of at most {most} bytes that arrives whole"));
    whole.map_err(late)?.map_err(broken)
}

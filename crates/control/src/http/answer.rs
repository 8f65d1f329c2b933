//! Answers that say no, as JSON: `{"error": "…"}`.

use axum::http::{HeaderValue, Method, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};

/// A refusal with its reason, as it is shown to the user.
#[derive(Debug)]
pub(super) struct Refusal {
    pub(super) status: StatusCode,
    pub(super) reason: String,
}

impl Refusal {
    pub(super) fn new(status: StatusCode, reason: impl Into<String>) -> Self {
        Self { status, reason: reason.into() }
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.status, json(&json!({ "error": self.reason }))).into_response()
    }
}

/// A value as the body of an answer.
pub(super) fn json(value: &Value) -> Response {
    ([(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))], format!("{value}\n")).into_response()
}

/// There is no such path.
pub(super) async fn not_found(uri: Uri) -> Refusal {
    Refusal::new(
        StatusCode::NOT_FOUND,
        format!(
            "there is no {}: expected /, /api/state, /api/links, /api/links/NUMBER, /api/histograms, /api/events or /metrics",
            uri.path().escape_debug()
        ),
    )
}

/// There is such a path, but not for this method.
pub(super) async fn method_not_allowed(method: Method, uri: Uri) -> Refusal {
    let expected = if uri.path().starts_with("/api/links") { "GET or PATCH" } else { "GET" };
    Refusal::new(StatusCode::METHOD_NOT_ALLOWED, format!("{method} is nothing that {} does: expected {expected}", uri.path().escape_debug()))
}

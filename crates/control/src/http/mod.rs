//! The routes and their answers.

mod apart;
mod body;
mod change;
mod connection;
mod frames;
mod guard;
pub(crate) mod hand;
mod pace;
mod page;
mod patient;
mod places;
mod play;
mod read;
mod shown;
#[cfg(test)]
mod tests;

use core::time::Duration;
use std::sync::Arc;

use axum::Router;
use axum::http::{HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde_json::{Value, json};
use tokio::sync::{Mutex, OwnedMutexGuard, Semaphore};

use crate::ticket::Ticket;
use crate::{Board, LinkEditor, Stage, Token};

#[cfg(fuzzing)]
pub(crate) use connection::answer_bytes;
pub(crate) use connection::{PATIENCE, answer_all};
pub(crate) use pace::Pace;
pub(crate) use shown::Shown;

/// What all answers are made from.
pub(crate) struct App {
    pub(crate) board: Arc<Board>,
    /// The last snapshot as text.
    pub(crate) shown: Shown,
    /// Waited for without keeping the thread: a change may read files.
    pub(crate) editor: Arc<Mutex<Box<dyn LinkEditor>>>,
    pub(crate) token: Token,
    pub(crate) ticket: Arc<Ticket>,
    /// That of those to whom a link was handed out.
    pub(crate) guests: Option<Token>,
    pub(crate) hosts: Vec<String>,
    /// If people take part from a page.
    pub(crate) stage: Option<Arc<dyn Stage>>,
    /// One comparison takes a core.
    pub(crate) comparing: Semaphore,
    /// The turns of guests' requests.
    pub(crate) pace: Pace,
    /// How long a body may take.
    pub(crate) patience: Duration,
}

impl App {
    /// The editor, as soon as no change is being made.
    async fn editor(&self) -> OwnedMutexGuard<Box<dyn LinkEditor>> {
        Arc::clone(&self.editor).lock_owned().await
    }

    /// The number of the link that a path names, if there is one.
    fn link(&self, text: &str) -> Option<usize> {
        // Written in one way only: no sign, no leading zeros.
        text.parse::<usize>().ok().filter(|link| *link < self.board.description().links.len() && link.to_string() == text)
    }
}

/// The routes, behind the guard.
pub(crate) fn router(app: App) -> Router {
    let app = Arc::new(app);
    let pages = if app.stage.is_some() { play::routes() } else { Router::new().route("/", get(page::page)) };
    pages
        .route("/api/state", get(read::state))
        .route("/api/links", get(read::links).patch(change::all))
        .route("/api/links/{link}", get(read::link).patch(change::one))
        .route("/api/histograms", get(read::histograms))
        .route("/api/events", get(read::events))
        .route("/metrics", get(read::metrics))
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(from_fn_with_state(Arc::clone(&app), guard::guard))
        .with_state(app)
}

/// A refusal with its reason, as it is shown to the user: `{"error": "…"}`.
#[derive(Debug)]
struct Refusal {
    status: StatusCode,
    reason: String,
}

impl Refusal {
    fn new(status: StatusCode, reason: impl Into<String>) -> Self {
        Self { status, reason: reason.into() }
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.status, json(&json!({ "error": self.reason }))).into_response()
    }
}

/// A value as the body of an answer.
fn json(value: &Value) -> Response {
    ([(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))], format!("{value}\n")).into_response()
}

/// There is no such path.
async fn not_found(uri: Uri) -> Refusal {
    Refusal::new(
        StatusCode::NOT_FOUND,
        format!(
            "there is no {}: expected /, /api/state, /api/links, /api/links/NUMBER, /api/histograms, /api/events or /metrics",
            uri.path().escape_debug()
        ),
    )
}

/// There is such a path, but not for this method.
async fn method_not_allowed(method: Method, uri: Uri) -> Refusal {
    let expected = match uri.path() {
        path if path.starts_with("/api/links") => "GET or PATCH",
        "/api/play" => "GET or POST",
        "/api/compare" => "POST",
        _ => "GET",
    };
    Refusal::new(StatusCode::METHOD_NOT_ALLOWED, format!("{method} is nothing that {} does: expected {expected}", uri.path().escape_debug()))
}

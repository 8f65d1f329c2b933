//! Routes of the server and the state shared by their answers.

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

use crate::token::Ticket;
use crate::{Board, LinkEditor, Stage, Token};

#[cfg(fuzzing)]
pub(crate) use connection::answer_bytes;
pub(crate) use connection::{PATIENCE, answer_all};
pub(crate) use pace::Pace;
pub(crate) use shown::Shown;

/// State shared by all requests.
pub(crate) struct App {
    pub(crate) board: Arc<Board>,
    /// Newest snapshot as text.
    pub(crate) shown: Shown,
    /// Editor of the links. An asynchronous lock, because a change may read files while others wait.
    pub(crate) editor: Arc<Mutex<Box<dyn LinkEditor>>>,
    pub(crate) token: Token,
    pub(crate) ticket: Arc<Ticket>,
    /// Token of guests; `None` for a run without guests.
    pub(crate) guests: Option<Token>,
    pub(crate) hosts: Vec<String>,
    /// Run in which people take part; `None` for other runs.
    pub(crate) stage: Option<Arc<dyn Stage>>,
    /// Permit of the only comparison at a time, since a comparison keeps a core busy.
    pub(crate) comparing: Semaphore,
    /// Turns of guests' requests.
    pub(crate) pace: Pace,
    /// Time limit of a request's body.
    pub(crate) patience: Duration,
}

impl App {
    /// Locks the editor, after waiting for the present change.
    async fn editor(&self) -> OwnedMutexGuard<Box<dyn LinkEditor>> {
        Arc::clone(&self.editor).lock_owned().await
    }

    /// Returns the run in which people take part; refuses a request to any other run.
    fn stage(&self) -> Result<Arc<dyn Stage>, Refusal> {
        self.stage.clone().ok_or_else(|| Refusal::new(StatusCode::NOT_FOUND, "nobody takes part from a page here"))
    }

    /// Parses the number of a link; `None` if no link has the number.
    fn link(&self, text: &str) -> Option<usize> {
        // Each link has a single address: signs and leading zeros are refused.
        text.parse::<usize>().ok().filter(|link| *link < self.board.description().links.len() && link.to_string() == text)
    }
}

/// Builds the routes, all protected by the guard.
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
        // Layers added last run first: the guard sees every request, also for unknown paths.
        .layer(from_fn_with_state(Arc::clone(&app), guard::guard))
        .with_state(app)
}

/// A refusal with its reason for the user, sent as `{"error": "…"}`.
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

/// Answers with JSON.
fn json(value: &Value) -> Response {
    // The final line feed is for people who ask from a shell.
    ([(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))], format!("{value}\n")).into_response()
}

/// Refuses an unknown path.
async fn not_found(uri: Uri) -> Refusal {
    Refusal::new(
        StatusCode::NOT_FOUND,
        format!(
            "there is no {}: expected /, /api/state, /api/links, /api/links/NUMBER, /api/histograms, /api/events or /metrics",
            uri.path().escape_debug()
        ),
    )
}

/// Refuses a known path with a wrong method.
async fn method_not_allowed(method: Method, uri: Uri) -> Refusal {
    let expected = match uri.path() {
        path if path.starts_with("/api/links") => "GET or PATCH",
        "/api/play" => "GET or POST",
        "/api/compare" => "POST",
        _ => "GET",
    };
    Refusal::new(StatusCode::METHOD_NOT_ALLOWED, format!("{method} is nothing that {} does: expected {expected}", uri.path().escape_debug()))
}

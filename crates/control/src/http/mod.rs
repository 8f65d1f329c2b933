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
mod play;
mod read;
mod round_trips;
mod shown;
mod slots;
mod study;
#[cfg(test)]
mod tests;

use core::time::Duration;
use std::sync::Arc;

use axum::Router;
use axum::http::{HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::{from_fn, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde_json::{Value, json};
use tokio::sync::{Mutex, OwnedMutexGuard, Semaphore};

use crate::token::Ticket;
use crate::{Board, Guests, Hands, LinkEditor, Stage, Study, Token};

#[cfg(fuzzing)]
pub(crate) use connection::answer_bytes;
pub(crate) use connection::{PATIENCE, answer_all};
pub(crate) use pace::Pace;
pub(crate) use shown::Shown;

/// Part of people in a run, by pages.
#[derive(Clone)]
pub(crate) enum People {
    Nobody,
    Stage(Arc<dyn Stage>),
    Study(Arc<dyn Study>),
}

/// State shared by all requests.
pub(crate) struct App {
    pub(crate) board: Arc<Board>,
    /// Newest snapshot as text.
    pub(crate) shown: Shown,
    /// Editor of the links. An asynchronous lock, because a change may read files while others wait.
    pub(crate) editor: Arc<Mutex<Box<dyn LinkEditor>>>,
    pub(crate) token: Token,
    pub(crate) ticket: Arc<Ticket>,
    /// Tokens of guests. Empty for a run without guests.
    pub(crate) guests: Guests,
    pub(crate) hosts: Vec<String>,
    pub(crate) people: People,
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

    /// Returns the stage; refuses a request to any other run.
    fn stage(&self) -> Result<Arc<dyn Stage>, Refusal> {
        if let People::Stage(stage) = &self.people { Ok(Arc::clone(stage)) } else { Err(nobody()) }
    }

    /// Returns the study; refuses a request to any other run.
    fn study(&self) -> Result<Arc<dyn Study>, Refusal> {
        if let People::Study(study) = &self.people { Ok(Arc::clone(study)) } else { Err(nobody()) }
    }

    /// Returns the hands of the run; refuses a request to a run without hands.
    fn hands(&self) -> Result<Arc<dyn Hands>, Refusal> {
        match &self.people {
            People::Stage(stage) => Ok(Arc::clone(stage) as _),
            People::Study(study) => Ok(Arc::clone(study) as _),
            People::Nobody => Err(nobody()),
        }
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
    let pages = match app.people {
        People::Nobody => Router::new().route("/", get(page::page)),
        People::Stage(_) => play::routes(),
        People::Study(_) => study::routes(),
    };
    let counters = Router::new()
        .route("/api/state", get(read::state))
        .route("/api/links", get(read::links).patch(change::all))
        .route("/api/links/{link}", get(read::link).patch(change::one))
        .route("/api/histograms", get(read::histograms))
        .route("/api/events", get(read::events))
        .route("/metrics", get(read::metrics));
    // The links of a study tell its condition, which people must not know.
    let counters = if matches!(app.people, People::Study(_)) { counters.route_layer(from_fn(guard::host_only)) } else { counters };
    pages
        .merge(counters)
        .fallback(not_found)
        .method_not_allowed_fallback(method_not_allowed)
        // Layers added last run first: the guard sees every request, also for unknown paths.
        .layer(from_fn_with_state(Arc::clone(&app), guard::guard))
        .with_state(app)
}

fn nobody() -> Refusal {
    Refusal::new(StatusCode::NOT_FOUND, "nobody takes part from a page here")
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
        "/api/study" => "GET or POST",
        "/api/compare" | "/api/person" => "POST",
        _ => "GET",
    };
    Refusal::new(StatusCode::METHOD_NOT_ALLOWED, format!("{method} is nothing that {} does: expected {expected}", uri.path().escape_debug()))
}

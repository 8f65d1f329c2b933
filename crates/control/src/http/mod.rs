//! The routes and their answers.

mod change;
mod guard;
mod hand;
mod page;
mod play;
mod read;
#[cfg(test)]
mod tests;

use core::time::Duration;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::Router;
use axum::http::{HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use hyper::server::conn::http1::Builder;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde_json::{Value, json};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::ticket::Ticket;
use crate::{Board, LinkEditor, Stage, Token};

/// What all answers are made from.
pub(crate) struct App {
    pub(crate) board: Arc<Board>,
    pub(crate) editor: Mutex<Box<dyn LinkEditor>>,
    pub(crate) token: Token,
    pub(crate) ticket: Arc<Ticket>,
    /// That of those to whom a link was handed out.
    pub(crate) guests: Option<Token>,
    pub(crate) hosts: Vec<String>,
    /// If people take part from a page.
    pub(crate) stage: Option<Arc<dyn Stage>>,
    /// The pages that take part.
    pub(crate) hands: Arc<Semaphore>,
    /// One comparison takes a core.
    pub(crate) comparing: Semaphore,
}

impl App {
    /// The editor. One that panicked was asked too much once; it is asked again all the same.
    fn editor(&self) -> MutexGuard<'_, Box<dyn LinkEditor>> {
        self.editor.lock().unwrap_or_else(PoisonError::into_inner)
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

/// How many connections may be open. The others wait: the real-time side shares the limit of open files with them.
pub(crate) const MOST: usize = 64;
/// How long a request head may take, from its connection or from the answer before it.
const PATIENCE: Duration = Duration::from_secs(10);
/// When no connection can be taken, because there are too many open files, it is tried again after this.
const RETRY: Duration = Duration::from_secs(1);

/// Takes connections for ever.
pub(crate) async fn answer_all(listener: TcpListener, router: Router) {
    let places = Arc::new(Semaphore::new(MOST));
    // It is never closed.
    while let Ok(place) = Arc::clone(&places).acquire_owned().await {
        match listener.accept().await {
            Ok((stream, _)) => {
                tokio::spawn(answer(stream, router.clone(), place));
            }
            // It was given up before it was taken.
            Err(error) if matches!(error.kind(), io::ErrorKind::ConnectionAborted | io::ErrorKind::ConnectionReset) => {}
            Err(_) => tokio::time::sleep(RETRY).await,
        }
    }
}

/// Answers what one connection asks, until it ends.
async fn answer(stream: TcpStream, router: Router, place: OwnedSemaphorePermit) {
    // Events are small and should not wait for one another.
    let _set: io::Result<()> = stream.set_nodelay(true);
    let mut builder = Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(PATIENCE);
    // The program at the other end has gone, or spoke no HTTP: nobody is left to be told.
    let _ended: hyper::Result<()> = builder.serve_connection(TokioIo::new(stream), TowerToHyperService::new(router)).with_upgrades().await;
    drop(place);
}

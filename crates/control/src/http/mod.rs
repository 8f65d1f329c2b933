//! The routes and their answers.

mod answer;
mod change;
mod connections;
mod events;
mod guard;
mod page;
mod read;
#[cfg(test)]
mod tests;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::Router;
use axum::middleware::from_fn_with_state;
use axum::routing::get;

use crate::{Board, LinkEditor, Token};

pub(crate) use connections::answer_all;

/// What all answers are made from.
pub(crate) struct App {
    pub(crate) board: Arc<Board>,
    pub(crate) editor: Mutex<Box<dyn LinkEditor>>,
    pub(crate) token: Token,
    pub(crate) hosts: Vec<String>,
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
    Router::new()
        .route("/", get(page::page))
        .route("/api/state", get(read::state))
        .route("/api/links", get(read::links).patch(change::all))
        .route("/api/links/{link}", get(read::link).patch(change::one))
        .route("/api/histograms", get(read::histograms))
        .route("/api/events", get(events::events))
        .route("/metrics", get(read::metrics))
        .fallback(answer::not_found)
        .method_not_allowed_fallback(answer::method_not_allowed)
        .layer(from_fn_with_state(Arc::clone(&app), guard::guard))
        .with_state(app)
}

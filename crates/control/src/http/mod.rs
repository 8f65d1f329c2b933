//! What is answered to whom.

use std::sync::{Arc, Mutex};

use axum::Router;

use crate::{Board, LinkEditor, Token};

/// What all answers are made from.
pub(crate) struct App {
    pub(crate) board: Arc<Board>,
    pub(crate) editor: Mutex<Box<dyn LinkEditor>>,
    pub(crate) token: Token,
    pub(crate) hosts: Vec<String>,
}

/// The routes.
pub(crate) fn router(app: App) -> Router {
    Router::new().with_state(Arc::new(app))
}

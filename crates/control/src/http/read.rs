//! Answers that change nothing.

use std::sync::Arc;

use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use serde_json::{Map, Value, json};

use super::App;
use super::answer::{Refusal, json as answer};
use crate::{metrics, typed, views};

/// Everything that changes by itself.
pub(super) async fn state(State(app): State<Arc<App>>) -> Response {
    answer(&views::state(app.board.description(), &app.board.latest()))
}

/// Every link with its counters and keys.
pub(super) async fn links(State(app): State<Arc<App>>) -> Response {
    let all: Vec<usize> = (0..app.board.description().links.len()).collect();
    answer(&json!({ "links": with_keys(&app, &all) }))
}

/// One link with its counters and keys.
pub(super) async fn link(State(app): State<Arc<App>>, path: Result<Path<String>, PathRejection>) -> Result<Response, Refusal> {
    let link = named(&app, path)?;
    Ok(answer(&with_keys(&app, &[link]).pop().unwrap_or_default()))
}

/// Distributions of lateness and of delay.
pub(super) async fn histograms(State(app): State<Arc<App>>) -> Response {
    answer(&views::histograms(app.board.description(), &app.board.latest()))
}

/// All counters as Prometheus reads them.
pub(super) async fn metrics(State(app): State<Arc<App>>) -> Response {
    let text = metrics::text(app.board.description(), &app.board.latest());
    ([(header::CONTENT_TYPE, HeaderValue::from_static("text/plain; version=0.0.4; charset=utf-8"))], text).into_response()
}

/// The link that a path names.
pub(super) fn named(app: &App, path: Result<Path<String>, PathRejection>) -> Result<usize, Refusal> {
    // A path that is not UTF-8 names no link either.
    let text = path.map(|Path(text)| text).unwrap_or_default();
    app.link(&text).ok_or_else(|| {
        let expected = match app.board.description().links.len() {
            0 => "there is none".to_owned(),
            1 => "there is link 0 alone".to_owned(),
            count => format!("expected 0 to {}", count - 1),
        };
        Refusal::new(StatusCode::NOT_FOUND, format!("there is no link {text:?}: {expected}"))
    })
}

/// Links with their counters and keys.
pub(super) fn with_keys(app: &App, links: &[usize]) -> Vec<Value> {
    let latest = app.board.latest();
    let editor = app.editor();
    let view = |link: &usize| {
        let mut view = views::link(app.board.description(), &latest.snapshot, *link);
        let keys: Map<String, Value> = editor.keys(*link).into_iter().map(|(key, value)| (key, typed::shown(&value).into())).collect();
        view["keys"] = keys.into();
        view
    };
    links.iter().map(view).collect()
}

//! Answers that change nothing: JSON, metrics, and server-sent events with the state whenever a new one was published.

use core::convert::Infallible;
use core::time::Duration;
use std::sync::Arc;

use axum::body::{Body, Bytes};
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use futures_util::stream::unfold;
use serde_json::{Map, Value, json};
use tokio::time::{Interval, MissedTickBehavior, interval};

use super::{App, Refusal, json as answer};
use crate::{metrics, typed, views};

/// Everything that changes by itself.
pub(super) async fn state(State(app): State<Arc<App>>) -> Response {
    let shown = app.shown.latest(&app.board);
    ([(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))], shown.json.clone()).into_response()
}

/// Every link with its counters and keys.
pub(super) async fn links(State(app): State<Arc<App>>) -> Response {
    let all: Vec<usize> = (0..app.board.description().links.len()).collect();
    answer(&json!({ "links": with_keys(&app, &all).await }))
}

/// One link with its counters and keys.
pub(super) async fn link(State(app): State<Arc<App>>, path: Result<Path<String>, PathRejection>) -> Result<Response, Refusal> {
    let link = named(&app, path)?;
    Ok(answer(&with_keys(&app, &[link]).await.pop().unwrap_or_default()))
}

/// Distributions of lateness and of delay.
pub(super) async fn histograms(State(app): State<Arc<App>>) -> Response {
    answer(&views::histograms(&app.board.latest()))
}

/// All counters as Prometheus reads them.
pub(super) async fn metrics(State(app): State<Arc<App>>) -> Response {
    let latest = app.board.latest();
    let text = metrics::text(&latest.description, &latest);
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
pub(super) async fn with_keys(app: &App, links: &[usize]) -> Vec<Value> {
    let editor = app.editor().await;
    let latest = app.board.latest();
    let view = |link: &usize| {
        let mut view = views::link(&latest.description, &latest.snapshot, *link);
        let keys: Map<String, Value> = editor.keys(*link).into_iter().map(|(key, value)| (key, typed::shown(&value).into())).collect();
        view["keys"] = keys.into();
        view
    };
    // Another run, with fewer links, may have taken the place of the one that was asked about.
    links.iter().filter(|link| **link < latest.description.links.len()).map(view).collect()
}

/// How often it is looked whether there is something new.
const EVERY: Duration = Duration::from_millis(100);
/// After this number of looks without anything new a comment says that the server is still there: 1 s.
const QUIET: u32 = 10;

struct Listener {
    app: Arc<App>,
    ticks: Interval,
    sent: Option<u64>,
    quiet: u32,
}

/// The state at once, then each time that it was published anew, at most ten times a second.
pub(super) async fn events(State(app): State<Arc<App>>) -> Response {
    let mut ticks = interval(EVERY);
    // A slow reader gets less, not the past.
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let listener = Listener { app, ticks, sent: None, quiet: 0 };
    let events = unfold(listener, |mut listener| async {
        let event = listener.next().await;
        Some((Ok::<Bytes, Infallible>(event), listener))
    });
    ([(header::CONTENT_TYPE, HeaderValue::from_static("text/event-stream"))], Body::from_stream(events)).into_response()
}

impl Listener {
    async fn next(&mut self) -> Bytes {
        loop {
            self.ticks.tick().await;
            let shown = self.app.shown.latest(&self.app.board);
            if self.sent != Some(shown.number) {
                self.sent = Some(shown.number);
                self.quiet = 0;
                return shown.event.clone();
            }
            self.quiet += 1;
            if self.quiet >= QUIET {
                self.quiet = 0;
                return Bytes::from_static(b": nothing new\n\n");
            }
        }
    }
}

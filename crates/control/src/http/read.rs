//! Routes without changes: state, links, histograms and metrics, and a stream of events with each new state.

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

/// `GET /api/state`: the whole state.
pub(super) async fn state(State(app): State<Arc<App>>) -> Response {
    let shown = app.shown.latest(&app.board);
    ([(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))], shown.json.clone()).into_response()
}

/// `GET /api/links`: all links with counters and keys.
pub(super) async fn links(State(app): State<Arc<App>>) -> Response {
    let all: Vec<usize> = (0..app.board.description().links.len()).collect();
    answer(&json!({ "links": with_keys(&app, &all).await }))
}

/// `GET /api/links/{link}`: a link with counters and keys.
pub(super) async fn link(State(app): State<Arc<App>>, path: Result<Path<String>, PathRejection>) -> Result<Response, Refusal> {
    let link = named(&app, path)?;
    Ok(answer(&with_keys(&app, &[link]).await.pop().unwrap_or_default()))
}

/// `GET /api/histograms`: distributions of clock lateness and of link delay.
pub(super) async fn histograms(State(app): State<Arc<App>>) -> Response {
    answer(&views::histograms(&app.board.latest()))
}

/// `GET /metrics`: all counters in Prometheus' text format.
pub(super) async fn metrics(State(app): State<Arc<App>>) -> Response {
    let latest = app.board.latest();
    let text = metrics::text(&latest.description, &latest);
    ([(header::CONTENT_TYPE, HeaderValue::from_static("text/plain; version=0.0.4; charset=utf-8"))], text).into_response()
}

/// Returns the number of the link named by a path, or a refusal for an unknown link.
pub(super) fn named(app: &App, path: Result<Path<String>, PathRejection>) -> Result<usize, Refusal> {
    // A path with bytes outside UTF-8 becomes the empty text, which is no number.
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

/// Returns the links with counters and keys, in the given order.
pub(super) async fn with_keys(app: &App, links: &[usize]) -> Vec<Value> {
    // The wait for a change may be long, so the snapshot is taken after the lock, and is new.
    let editor = app.editor().await;
    let latest = app.board.latest();
    let view = |link: &usize| {
        let mut view = views::link(&latest.description, &latest.snapshot, *link);
        let keys: Map<String, Value> = editor.keys(*link).into_iter().map(|(key, value)| (key, typed::shown(&value).into())).collect();
        view["keys"] = keys.into();
        view
    };
    // A run with fewer links may have replaced the run of the request.
    links.iter().filter(|link| **link < latest.description.links.len()).map(view).collect()
}

/// Time between two checks for a new snapshot.
const EVERY: Duration = Duration::from_millis(100);
/// Number of checks without a new snapshot, after which a comment line shows that the server is alive: 1 s.
const QUIET: u32 = 10;

/// State of one answer to `GET /api/events`.
struct Listener {
    app: Arc<App>,
    ticks: Interval,
    /// Number of the snapshot sent last; `None` before the first.
    sent: Option<u64>,
    /// Checks without a new snapshot since the last line sent.
    quiet: u32,
}

/// `GET /api/events`: a stream of server-sent events. Sends the state at once, and then each new state, at most ten per second.
pub(super) async fn events(State(app): State<Arc<App>>) -> Response {
    let mut ticks = interval(EVERY);
    // A slow reader gets fewer states, and always the newest.
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

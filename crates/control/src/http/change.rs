//! Routes that change links.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::Response;
use serde_json::{Map, Value, json};

use super::App;
use super::apart::apart;
use super::read::{named, with_keys};
use super::{Refusal, body as bodies, json as answer};
use crate::typed;

/// Length of the longest accepted body \[byte\]. All keys of a link at their longest fill about a hundredth.
const LARGEST_BODY: usize = 64 * 1024;

/// `PATCH /api/links/{link}`: sets keys of a single link.
pub(super) async fn one(State(app): State<Arc<App>>, path: Result<Path<String>, PathRejection>, body: Body) -> Result<Response, Refusal> {
    let link = named(&app, path)?;
    let keys = keys(&app, body).await?;
    change(&app, vec![link], keys).await?;
    // A run with fewer links may have replaced the run meanwhile. Then there is no link to show.
    Ok(answer(&with_keys(&app, &[link]).await.pop().unwrap_or_default()))
}

/// `PATCH /api/links`: sets keys of all links, or changes no link at all if a link refuses the keys.
pub(super) async fn all(State(app): State<Arc<App>>, body: Body) -> Result<Response, Refusal> {
    let keys = keys(&app, body).await?;
    let links: Vec<usize> = (0..app.board.description().links.len()).collect();
    // The editor may rely on at least one link.
    if links.is_empty() {
        return Err(unprocessable("there is no link to be changed"));
    }
    change(&app, links.clone(), keys).await?;
    Ok(answer(&json!({ "links": with_keys(&app, &links).await })))
}

/// Passes keys to the editor on another thread, because the editor may read files. The lock on the editor is held until the end, so that changes stay in order.
async fn change(app: &App, links: Vec<usize>, keys: Vec<(String, String)>) -> Result<(), Refusal> {
    let mut editor = app.editor().await;
    let changed = apart(move || editor.change(&links, &keys)).await;
    changed.map_err(|_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "the change broke off"))?.map_err(unprocessable)
}

/// Reads the keys of a body, with their values as TOML text.
async fn keys(app: &App, body: Body) -> Result<Vec<(String, String)>, Refusal> {
    let body = bodies::read(app, body, LARGEST_BODY).await?;
    let keys: Map<String, Value> = serde_json::from_slice(&body)
        .map_err(|error| unprocessable(format!("expected a JSON object of link keys, such as {{\"delay\": \"40ms\", \"loss\": \"1%\"}}: {error}")))?;
    if keys.is_empty() {
        return Err(unprocessable("no keys: expected at least one, such as {\"delay\": \"40ms\"}"));
    }
    keys.into_iter().map(|(key, value)| pair(key, &value)).collect()
}

/// Checks a key's name and converts its value.
fn pair(key: String, value: &Value) -> Result<(String, String), Refusal> {
    // The bare keys of TOML: other names cannot be link keys, and bare keys need no quotes.
    let bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    if key.is_empty() || !key.chars().all(bare) {
        return Err(unprocessable(format!("{key:?} is not a name of a link key: expected letters, digits, \"-\" and \"_\"")));
    }
    let value = typed::from_json(value).map_err(|reason| unprocessable(format!("{key}: {reason}")))?;
    Ok((key, value))
}

fn unprocessable(reason: impl Into<String>) -> Refusal {
    Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, reason)
}

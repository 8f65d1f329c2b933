//! The routes of a run in which people take part from a page.

use std::sync::Arc;

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::extract::{Path, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use axum::routing::{get, post};
use serde_json::Value;

use super::{App, Refusal, hand, json as answer, page};
use crate::{Role, Stage};

/// A wish is a few words.
const LARGEST_WISH: usize = 4096;

/// The routes. The page of a run that nobody takes part in is here at `/details`.
pub(super) fn routes() -> Router<Arc<App>> {
    Router::new()
        .route("/", get(page::play))
        .route("/join", get(page::play))
        .route("/details", get(page::page))
        .route("/api/play", get(facts).post(begin_anew))
        .route("/api/hand", get(hand::connect))
        .route("/api/compare", post(compare))
        .route("/api/files/{name}", get(file))
}

pub(super) fn stage(app: &App) -> Result<Arc<dyn Stage>, Refusal> {
    app.stage.clone().ok_or_else(|| Refusal::new(StatusCode::NOT_FOUND, "nobody takes part from a page here"))
}

async fn facts(State(app): State<Arc<App>>, axum::Extension(role): axum::Extension<Role>) -> Result<Response, Refusal> {
    Ok(answer(&stage(&app)?.facts(role)))
}

async fn begin_anew(State(app): State<Arc<App>>, body: Body) -> Result<Response, Refusal> {
    let unprocessable = |reason: String| Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, reason);
    let body = to_bytes(body, LARGEST_WISH)
        .await
        .map_err(|_| Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, format!("expected a body of at most {LARGEST_WISH} bytes that arrives whole")))?;
    let wish: Value = serde_json::from_slice(&body).map_err(|error| unprocessable(format!("expected a JSON object: {error}")))?;
    let stage = stage(&app)?;
    stage.begin_anew(&wish).map_err(unprocessable)?;
    Ok(answer(&stage.facts(Role::Host)))
}

/// Takes a while: others are answered meanwhile, on the thread of the server.
async fn compare(State(app): State<Arc<App>>) -> Result<Response, Refusal> {
    let stage = stage(&app)?;
    let _one = app.comparing.try_acquire().map_err(|_| Refusal::new(StatusCode::CONFLICT, "a comparison is running: wait for its result"))?;
    let compared = tokio::task::spawn_blocking(move || stage.compare()).await;
    let compared = compared.map_err(|_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "the comparison broke off"))?;
    Ok(answer(&compared.map_err(|reason| Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, reason))?))
}

async fn file(State(app): State<Arc<App>>, Path(name): Path<String>) -> Result<Response, Refusal> {
    let stage = stage(&app)?;
    let read = tokio::task::spawn_blocking(move || stage.file(&name)).await;
    let Ok(Some(file)) = read else { return Err(Refusal::new(StatusCode::NOT_FOUND, "there is no such file: compare first")) };
    let headers =
        [(header::CONTENT_TYPE, HeaderValue::from_static(file.kind)), (header::CONTENT_DISPOSITION, HeaderValue::from_static("attachment"))];
    Ok((headers, file.bytes).into_response())
}

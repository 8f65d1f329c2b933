//! Routes of a run in which people take part from a page.

use std::sync::Arc;

use axum::Router;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use axum::routing::{get, post};
use serde_json::Value;

use super::apart::apart;
use super::{App, Refusal, body as bodies, hand, json as answer, page};
use crate::Role;

/// Length of the longest accepted wish \[byte\]: a small JSON object.
const LARGEST_WISH: usize = 4096;

/// Returns the routes. The page of counters, which has the path `/` in other runs, has the path `/details` here.
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

async fn facts(State(app): State<Arc<App>>, axum::Extension(role): axum::Extension<Role>) -> Result<Response, Refusal> {
    Ok(answer(&app.stage()?.facts(role)))
}

async fn begin_anew(State(app): State<Arc<App>>, body: Body) -> Result<Response, Refusal> {
    let unprocessable = |reason: String| Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, reason);
    let body = bodies::read(&app, body, LARGEST_WISH).await?;
    let wish: Value = serde_json::from_slice(&body).map_err(|error| unprocessable(format!("expected a JSON object: {error}")))?;
    let stage = app.stage()?;
    // The restart reads the scene and its files, which may take long.
    let begun = apart(move || stage.begin_anew(&wish).map(|()| stage.facts(Role::Host))).await;
    let begun = begun.map_err(|_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "the new part broke off"))?;
    Ok(answer(&begun.map_err(unprocessable)?))
}

/// `POST /api/compare`: runs the comparison on another thread, because a comparison takes a while. A second comparison at the same time is refused.
async fn compare(State(app): State<Arc<App>>) -> Result<Response, Refusal> {
    let stage = app.stage()?;
    // The permit ends with this request, also if the client goes away before the comparison has ended.
    let _one = app.comparing.try_acquire().map_err(|_| Refusal::new(StatusCode::CONFLICT, "a comparison is running: wait for its result"))?;
    let compared = apart(move || stage.compare()).await;
    let compared = compared.map_err(|_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "the comparison broke off"))?;
    Ok(answer(&compared.map_err(|reason| Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, reason))?))
}

/// `GET /api/files/{name}`: sends a file to the host. Guests are refused, because many guests asking for a large recording at once would fill the memory.
async fn file(State(app): State<Arc<App>>, axum::Extension(role): axum::Extension<Role>, Path(name): Path<String>) -> Result<Response, Refusal> {
    if role != Role::Host {
        return Err(Refusal::new(StatusCode::FORBIDDEN, "only the person who started the run may have its record: this token is that of a guest"));
    }
    let stage = app.stage()?;
    let read = apart(move || stage.file(&name)).await;
    let Ok(Some(file)) = read else { return Err(Refusal::new(StatusCode::NOT_FOUND, "there is no such file: compare first")) };
    let headers =
        [(header::CONTENT_TYPE, HeaderValue::from_static(file.kind)), (header::CONTENT_DISPOSITION, HeaderValue::from_static("attachment"))];
    Ok((headers, file.bytes).into_response())
}

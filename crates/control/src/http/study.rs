//! Routes of a study: a page and requests of the experimenter, and a page and requests of each person.

use std::sync::Arc;

use axum::Router;
use axum::body::Body;
use axum::extract::State;
use axum::http::StatusCode;
use axum::middleware::from_fn;
use axum::response::Response;
use axum::routing::{get, post};
use serde_json::{Value, json};

use super::apart::apart;
use super::guard::{Visitor, host_only};
use super::{App, Refusal, body as bodies, hand, json as answer, page};

/// Length of the longest accepted request \[byte\]: answers to some hundred questions.
const LARGEST: usize = 16 * 1024;

/// Returns the routes. The page of counters has the path `/details`, as in other runs in which people take part.
pub(super) fn routes() -> Router<Arc<App>> {
    let of_experimenter =
        Router::new().route("/details", get(page::page)).route("/api/study", get(overview).post(command)).route_layer(from_fn(host_only));
    Router::new()
        .merge(of_experimenter)
        .route("/", get(own_page))
        .route("/join", get(page::person))
        .route("/api/hand", get(hand::connect))
        .route("/api/person", post(tell))
}

/// `GET /`: the page of the experimenter, or of the person with the shown token.
async fn own_page(axum::Extension(visitor): axum::Extension<Visitor>) -> Response {
    match visitor {
        Visitor::Host => page::experimenter().await,
        Visitor::Guest(_) => page::person().await,
    }
}

async fn overview(State(app): State<Arc<App>>) -> Result<Response, Refusal> {
    Ok(answer(&app.study()?.overview()))
}

/// `POST /api/study`: carries out a command of the experimenter, and answers with the new overview.
async fn command(State(app): State<Arc<App>>, body: Body) -> Result<Response, Refusal> {
    let wish = read(&app, body).await?;
    let study = app.study()?;
    run(move || study.command(&wish).map(|()| study.overview())).await
}

/// `POST /api/person`: takes a word or answers of a person. The new page of the person comes over the WebSocket.
async fn tell(State(app): State<Arc<App>>, axum::Extension(visitor): axum::Extension<Visitor>, body: Body) -> Result<Response, Refusal> {
    let Visitor::Guest(person) = visitor else {
        return Err(Refusal::new(StatusCode::FORBIDDEN, "only a participant may say this: this token is that of the experimenter"));
    };
    let said = read(&app, body).await?;
    let study = app.study()?;
    run(move || study.tell(person, &said).map(|()| json!({}))).await
}

async fn read(app: &App, body: Body) -> Result<Value, Refusal> {
    let body = bodies::read(app, body, LARGEST).await?;
    serde_json::from_slice(&body).map_err(|error| Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, format!("expected a JSON object: {error}")))
}

/// Runs work that may write to a disk, and answers with its result.
async fn run(work: impl FnOnce() -> Result<Value, String> + Send + 'static) -> Result<Response, Refusal> {
    let done = apart(work).await.map_err(|_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "the study broke off"))?;
    Ok(answer(&done.map_err(|reason| Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, reason))?))
}

//! What all requests of the page share: the check of the token, errors in one line, work off the asynchronous threads.

use std::sync::Arc;

use axum::Json;
use axum::body::Bytes;
use axum::extract::{FromRequestParts, State};
use axum::http::StatusCode;
use axum::http::request::Parts;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use super::jobs::{Job, JobError};
use super::parts::Panel;

/// Why a request failed: one line for the person.
pub struct ApiError(pub StatusCode, pub String);

impl<E: std::fmt::Display> From<E> for ApiError {
    fn from(error: E) -> Self {
        ApiError(StatusCode::UNPROCESSABLE_ENTITY, error.to_string())
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        (self.0, Json(json!({ "error": self.1 }))).into_response()
    }
}

/// The answer to a request: JSON.
pub type Answer = Result<Json<Value>, ApiError>;
/// The panel, as an argument of a handler.
pub type Shared = State<Arc<Panel>>;

/// The token has been checked. As an argument of every handler it comes before the body is read.
pub struct Admitted;

impl FromRequestParts<Arc<Panel>> for Admitted {
    type Rejection = StatusCode;

    async fn from_request_parts(parts: &mut Parts, panel: &Arc<Panel>) -> Result<Self, StatusCode> {
        panel.gate.check_token(&parts.headers).map(|()| Admitted)
    }
}

/// A body of JSON; its errors are one line.
pub fn parsed<T: DeserializeOwned>(body: &Bytes) -> Result<T, ApiError> {
    serde_json::from_slice(body).map_err(|error| ApiError(StatusCode::BAD_REQUEST, format!("request: {error}")))
}

/// Runs a computation off the async threads.
pub async fn blocking<T: Send + 'static>(work: impl FnOnce() -> Result<T, ApiError> + Send + 'static) -> Result<T, ApiError> {
    tokio::task::spawn_blocking(work).await?
}

/// Starts a job and notes the command that does the same in a shell. `uses_stand`: see [`super::jobs::Jobs::start`].
pub fn start_job(
    panel: &Arc<Panel>,
    kind: &str,
    command: &str,
    uses_stand: bool,
    work: impl FnOnce(&Arc<Panel>, &Job) -> Result<String, JobError> + Send + 'static,
) -> Answer {
    start_claiming_job(panel, kind, command, uses_stand, || Ok(()), work)
}

/// The same for a job with a claim.
pub fn start_claiming_job(
    panel: &Arc<Panel>,
    kind: &str,
    command: &str,
    uses_stand: bool,
    claim: impl FnOnce() -> Result<(), String>,
    work: impl FnOnce(&Arc<Panel>, &Job) -> Result<String, JobError> + Send + 'static,
) -> Answer {
    let shared = panel.clone();
    let work = move |job: &Job| work(&shared, job);
    let number = panel.jobs.start(kind, uses_stand, claim, work)?;
    panel.hub.note(command, &[], &[]);
    panel.session.note_command(command);
    Ok(Json(json!({"job": number})))
}

/// The name of a file of the session or of an effect, in the address.
#[derive(Deserialize)]
pub struct Name {
    pub name: String,
}

//! The laboratory works of the session: instructions, answers as a form, check and report. The true values of a work never reach the page,
//! and it has no judgement.
//!
//! In: the name of a work in the session. Out: what `stand lab check` and `stand lab report` give, by the same functions.

use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::{Query, State};
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use serde::Deserialize;
use serde_json::json;

use super::parts::Panel;
use super::request::{Admitted, Answer, ApiError, Name, Shared, blocking, parsed};
use super::session::Session;
use stand_lab::LabError;
use stand_lab::check::{check as check_work, read_answers};
use stand_lab::course::Language;
use stand_lab::form::{AnswersForm, load, save};
use stand_lab::journal::Journal;
use stand_lab::measurement::LOGS_FOLDER;
use stand_lab::work::{MODEL_FILE, Work};
use stand_report::{lab as report, lab_view};

/// The routes below `/api`.
pub fn routes() -> Router<Arc<Panel>> {
    Router::new()
        .route("/works", get(works))
        .route("/work", get(work))
        .route("/lab-answers", get(answers).post(save_answers))
        .route("/lab-check", post(check))
        .route("/lab-report", get(lab_report))
}

async fn works(_: Admitted, State(panel): Shared) -> Answer {
    blocking(move || Ok(Json(json!({"works": panel.session.works()})))).await
}

/// A work, its logs, and the model of a hunt, by their names in the session.
async fn work(_: Admitted, State(panel): Shared, Query(Name { name }): Query<Name>) -> Answer {
    blocking(move || {
        let work = Work::read(&panel.session.work(&name)?)?;
        let lab = work.lab()?;
        let folder = Session::name_in(&name, LOGS_FOLDER);
        let logs = panel.session.logs().into_iter().map(|file| file.name);
        let logs: Vec<String> = logs.filter(|log| log.rsplit_once('/').is_some_and(|(of, _)| of == folder)).collect();
        let mut answer = lab_view::work_json(&work, &lab);
        answer["name"] = name.as_str().into();
        answer["logs"] = logs.into();
        answer["model"] = lab.hunt().map(|_| Session::name_in(&name, MODEL_FILE)).into();
        Ok(Json(answer))
    })
    .await
}

async fn answers(_: Admitted, State(panel): Shared, Query(Name { name }): Query<Name>) -> Answer {
    blocking(move || Ok(Json(serde_json::to_value(load(&panel.session.work(&name)?)?)?))).await
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SaveRequest {
    name: String,
    /// SHA-256 of the file from which the form was loaded.
    sha256: String,
    answers: AnswersForm,
}

async fn save_answers(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let SaveRequest { name, sha256, answers } = parsed(&body)?;
    blocking(move || match save(&panel.session.work(&name)?, &answers, &sha256) {
        Ok(sha256) => Ok(Json(json!({"sha256": sha256}))),
        Err(error @ LabError::AnswersChanged { .. }) => Err(ApiError(StatusCode::CONFLICT, error.to_string())),
        Err(error) => Err(error.into()),
    })
    .await
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CheckRequest {
    name: String,
    /// Language of the page.
    language: Language,
}

/// `stand lab check`.
async fn check(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let CheckRequest { name, language } = parsed(&body)?;
    blocking(move || {
        let folder = panel.session.work(&name)?;
        let work = Work { language, ..Work::read(&folder)? };
        let checked = check_work(&folder)?;
        let command = format!("stand lab check {name}");
        panel.hub.note(&command, &[], &[]);
        panel.session.note_command(&command);
        let mut answer = report::checked_json(&checked, &work);
        answer["text"] = report::checked_text(&checked, &work.lab()?, &work).into();
        Ok(Json(answer))
    })
    .await
}

/// The page of `stand lab report`.
async fn lab_report(_: Admitted, State(panel): Shared, Query(Name { name }): Query<Name>) -> Result<Response, ApiError> {
    let page = blocking(move || {
        let folder = panel.session.work(&name)?;
        let work = Work::read(&folder)?;
        Ok(report::report_html(&work, &work.lab()?, &read_answers(&folder)?, &Journal::read(&folder)?))
    })
    .await?;
    Ok(([(CONTENT_TYPE, "application/octet-stream")], page).into_response())
}

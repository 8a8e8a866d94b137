//! The requests for compensation and the other measurements: each checks its parameters and starts a job.

use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::{Query, State};
use axum::routing::{get, post};
use axum::{Json, Router};
use serde::Deserialize;
use serde_json::{Value, json};

use super::compensation::{self, CompensateRequest};
use super::measure::{self, AllanRequest, CalibrateRequest, DriftRequest, Prepared, PreparedCalibration, ResumeRequest};
use super::parts::Panel;
use super::request::{Admitted, Answer, Name, Shared, blocking, parsed, start_job};
use identification::log::Log;
use stand_acquire::calibration_session::DutKind;
use stand_report::plot_files::plots_of;

/// Longest remark of a person to a step of a session, characters.
const MAX_REPLY: usize = 200;

/// The routes.
pub fn routes() -> Router<Arc<Panel>> {
    Router::new()
        .route("/reply", post(reply))
        .route("/compensate", post(compensate))
        .route("/allan", post(allan))
        .route("/drift", post(drift))
        .route("/calibrate", post(calibrate))
        .route("/resume", post(resume))
        .route("/steps", get(steps))
        .route("/columns", get(columns))
        .route("/pictures", get(pictures))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReplyRequest {
    text: String,
}

async fn reply(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let request: ReplyRequest = parsed(&body)?;
    panel.jobs.reply(request.text.chars().filter(|c| !c.is_control()).take(MAX_REPLY).collect());
    Ok(Json(json!({})))
}

async fn compensate(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let request: CompensateRequest = parsed(&body)?;
    let command = request.command(&panel)?;
    start_job(&panel, "compensate", &command, true, move |panel, job| compensation::run(panel, &request, job))
}

async fn allan(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let prepared = parsed::<AllanRequest>(&body)?.prepare(&panel)?;
    start_job(&panel, "allan", &prepared.command.clone(), false, move |panel, job| measure::allan(panel, prepared, job))
}

async fn drift(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let prepared = parsed::<DriftRequest>(&body)?.prepare(&panel)?;
    start_job(&panel, "drift", &prepared.command.clone(), prepared.uses_stand, move |panel, job| measure::drift(panel, &prepared, job))
}

async fn calibrate(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    start_calibration(&panel, parsed::<CalibrateRequest>(&body)?.prepare(&panel)?)
}

async fn resume(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    start_calibration(&panel, parsed::<ResumeRequest>(&body)?.prepare(&panel)?)
}

fn start_calibration(panel: &Arc<Panel>, prepared: Prepared<PreparedCalibration>) -> Answer {
    start_job(panel, "calibrate", &prepared.command.clone(), prepared.uses_stand, move |panel, job| {
        measure::calibrate(panel, &prepared, job)
    })
}

#[derive(Deserialize)]
struct Kind {
    kind: DutKind,
}

/// The steps of the default calibration session of a kind of device.
async fn steps(_: Admitted, Query(Kind { kind }): Query<Kind>) -> Answer {
    let steps: Vec<Value> = measure::steps(kind)?.into_iter().map(|(name, seconds)| json!({"name": name, "seconds": seconds})).collect();
    Ok(Json(json!({"steps": steps})))
}

/// The names of the columns of a log.
async fn columns(_: Admitted, State(panel): Shared, Query(Name { name }): Query<Name>) -> Answer {
    blocking(move || {
        let log = Log::read_all(panel.session.existing(&name)?)?;
        let names: Vec<&str> = log.columns().iter().map(|column| column.name.as_str()).collect();
        Ok(Json(json!({"columns": names})))
    })
    .await
}

/// The pictures of a report of the session, SVG.
async fn pictures(_: Admitted, State(panel): Shared, Query(Name { name }): Query<Name>) -> Answer {
    blocking(move || {
        let page = std::fs::read_to_string(panel.session.existing(&name)?)?;
        let plots: Vec<Value> = plots_of(&page).into_iter().map(|plot| json!({"name": plot.name, "svg": plot.svg})).collect();
        Ok(Json(json!({"plots": plots})))
    })
    .await
}

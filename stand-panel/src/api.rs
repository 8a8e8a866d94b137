//! The requests of the page other than its WebSocket: JSON in, JSON out, columns of a log as float64.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Query, State};
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use drive_model::card;
use serde::Deserialize;
use serde_json::{Value, json};
use stand_firmware::profile::{PARAMETERS, ProfileKind};

use super::analysis::{self, SignatureRequest};
use super::control::ClientId;
use super::jobs::{Job, message};
use super::line::LineError;
use super::measure;
use super::measure_routes;
use super::parts::Panel;
use super::recording::{self, RecordRequest};
use super::request::{Admitted, Answer, ApiError, Name, Shared, blocking, parsed, start_claiming_job, start_job};
use super::session::quoted;
use super::{export, import, laboratory};
use identification::files;
use identification::log::Log;
use identification::log::import::ENDINGS;
use identification::model::{Model, SummingPoint};
use stand_acquire::link::{REPLY_TIMEOUT, is_harmless, supervises};
use stand_lab::check::begin_explain;
use stand_report as report;

/// Longest body, bytes.
const MAX_BODY: usize = 1 << 20;
/// Longest expression of a user's effect, characters.
const MAX_EXPRESSION: usize = 1000;

/// The routes below `/api`.
pub fn routes(panel: Arc<Panel>) -> Router<Arc<Panel>> {
    Router::new()
        .route("/session", get(session))
        .route("/stop", post(stop))
        .route("/command", post(command))
        .route("/record", post(record))
        .route("/cancel", post(cancel))
        .route("/compare", post(compare))
        .route("/explain", post(explain))
        .route("/signature", post(signature))
        .route("/answer", get(answer))
        .route("/log", get(log))
        .route("/model", get(model).post(edit_model))
        .route("/effects", get(effects))
        .route("/effect", get(effect))
        .route("/profiles", get(profiles))
        .merge(import::routes())
        .merge(export::routes())
        .merge(measure_routes::routes())
        .merge(laboratory::routes())
        .fallback(|_: Admitted| async { StatusCode::NOT_FOUND })
        .layer(DefaultBodyLimit::max(MAX_BODY))
        .with_state(panel)
}

async fn session(_: Admitted, State(panel): Shared) -> Answer {
    blocking(move || {
        let session = &panel.session;
        let answers = session.files(&[".json"]);
        // The one that runs is not interrupted.
        let job = panel.jobs.state();
        let is_calibrating = job.is_running && job.kind == "calibrate";
        let interrupted = if is_calibrating { Vec::new() } else { measure::interrupted(session) };
        Ok(Json(json!({
            "folder": session.folder(), "logs": session.logs(), "models": session.models(), "answers": answers,
            "interrupted": interrupted, "max_upload_bytes": import::MAX_UPLOAD, "log_endings": ENDINGS
        })))
    })
    .await
}

#[derive(Deserialize)]
struct StopRequest {
    /// Number of the press.
    press: u64,
}

/// A body that is not understood does not keep a stop from stopping.
async fn stop(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    panel.press_stop(serde_json::from_slice::<StopRequest>(&body).ok().map(|request| request.press));
    Ok(Json(json!({})))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CommandRequest {
    client: ClientId,
    line: String,
}

async fn command(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let request: CommandRequest = parsed(&body)?;
    blocking(move || {
        let line = request.line.trim();
        check_line(line).inspect_err(|error| panel.hub.note(line, &[], std::slice::from_ref(&error.1)))?;
        if line.eq_ignore_ascii_case("STOP") {
            panel.press_stop(None);
            return Ok(Json(json!({"replies": [], "errors": []})));
        }
        if panel.jobs.has_stream() && !is_harmless(line) {
            let refusal = "a recording or a session uses the stand: cancel it first, or STOP".to_owned();
            panel.hub.note(line, &[], std::slice::from_ref(&refusal));
            return Err(ApiError(StatusCode::CONFLICT, refusal));
        }
        let reply = panel.line.exchange(request.client, line, REPLY_TIMEOUT).map_err(|error| {
            panel.hub.note(line, &[], &[error.to_string()]);
            ApiError(if matches!(error, LineError::Control(_)) { StatusCode::CONFLICT } else { StatusCode::BAD_GATEWAY }, error.to_string())
        })?;
        panel.hub.note(line, &reply.lines, &reply.errors);
        panel.session.note_command(&format!("printf '%s\\n' {} | stand console --port {}", quoted(line), panel.line.name()));
        Ok(Json(json!({"replies": reply.lines, "errors": reply.errors})))
    })
    .await
}

/// A line is one line of text, and leaves the supervision of the host to the panel.
fn check_line(line: &str) -> Result<(), ApiError> {
    if line.is_empty() || !line.bytes().all(|byte| matches!(byte, b' '..=b'~')) || line.contains('~') {
        return Err("a command is one line of ASCII without `~`".into());
    }
    if supervises(line) {
        return Err("HOST: the panel supervises itself; an unattended run is a recording with its check mark".into());
    }
    Ok(())
}

async fn record(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let request: RecordRequest = parsed(&body)?;
    let prepared = request.prepare(&panel).map_err(ApiError::from)?;
    let (command, prepared) = (prepared.command.clone(), Arc::new(prepared));
    let claiming = (panel.clone(), prepared.clone());
    let claim = move || recording::claim(&claiming.0, &claiming.1);
    start_claiming_job(&panel, "record", &command, true, claim, move |panel, job| recording::run(panel, &prepared, job))
}

async fn cancel(_: Admitted, State(panel): Shared) -> Answer {
    panel.jobs.cancel();
    Ok(Json(json!({})))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AnalysisRequest {
    log: String,
    model: String,
    #[serde(default)]
    fit: bool,
}

async fn compare(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let request: AnalysisRequest = parsed(&body)?;
    let kind = if request.fit { "fit" } else { "compare" };
    let command = analysis::command(&panel, kind, &request.log, &request.model)?;
    start_job(&panel, kind, &command, false, move |panel, job| analysis::compare(panel, &request.log, &request.model, request.fit, job))
}

async fn explain(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let request: AnalysisRequest = parsed(&body)?;
    blocking(move || {
        let command = analysis::command(&panel, "explain", &request.log, &request.model)?;
        let (log, model) = (panel.session.existing(&request.log)?, panel.session.existing(&request.model)?);
        // As the command does: a model that is wrong explains nothing, and is not recorded in the journal of a laboratory work.
        let claim = || {
            Model::read(model).map_err(message)?;
            begin_explain(&[log]).map_err(message)
        };
        let work = move |panel: &Arc<Panel>, job: &Job| analysis::explain(panel, &request.log, &request.model, job);
        start_claiming_job(&panel, "explain", &command, false, claim, work)
    })
    .await
}

async fn signature(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let request: SignatureRequest = parsed(&body)?;
    let command = request.command(&panel)?;
    start_job(&panel, "signature", &command, false, move |panel, job| analysis::signature(panel, &request, job))
}

async fn answer(_: Admitted, State(panel): Shared, Query(Name { name }): Query<Name>) -> Answer {
    blocking(move || {
        let text = std::fs::read(panel.session.existing(&name)?)?;
        Ok(Json(serde_json::from_slice(&text)?))
    })
    .await
}

/// All columns of a log: the length of the head (u32), the head (`{"columns": […], "rows": n}`), padding to eight bytes, then the columns
/// as float64, little-endian.
async fn log(_: Admitted, State(panel): Shared, Query(Name { name }): Query<Name>) -> Result<Response, ApiError> {
    let bytes = blocking(move || {
        let log = Log::read_all(panel.session.existing(&name)?)?;
        let names: Vec<&str> = log.columns().iter().map(|column| column.name.as_str()).collect();
        let mut head = serde_json::to_vec(&json!({"columns": names, "rows": log.len()}))?;
        head.resize((head.len() + 4).next_multiple_of(8) - 4, b' ');
        let mut bytes = (head.len() as u32).to_le_bytes().to_vec();
        bytes.extend(head);
        log.columns().iter().flat_map(|column| &column.values).for_each(|value| bytes.extend(value.to_le_bytes()));
        Ok(bytes)
    })
    .await?;
    Ok(([(CONTENT_TYPE, "application/octet-stream")], bytes).into_response())
}

async fn model(_: Admitted, State(panel): Shared, Query(Name { name }): Query<Name>) -> Answer {
    blocking(move || {
        let model = Model::read(panel.session.existing(&name)?)?;
        let mut answer = report::model::json(&model);
        answer["text"] = model.to_toml().into();
        Ok(Json(answer))
    })
    .await
}

/// An edit of a model file: one of the changes. Not a flattened enum, whose numbers serde cannot read with arbitrary precision.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelEdit {
    name: String,
    /// Add an effect of the catalogue.
    add: Option<String>,
    /// Add an effect by a torque as an expression.
    add_expression: Option<OwnEffect>,
    /// Remove an effect.
    remove: Option<String>,
    /// Values of parameters.
    set: Option<BTreeMap<String, f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OwnEffect {
    name: String,
    torque_N_m: String,
    #[serde(default)]
    parameters: BTreeMap<String, f64>,
}

async fn edit_model(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let ModelEdit { name, add, add_expression, remove, set } = parsed(&body)?;
    blocking(move || {
        let path = panel.session.existing(&name)?;
        let _locked = files::lock(&path)?;
        let mut model = Model::read(&path)?;
        let mut commands = Vec::new();
        if let Some(effect) = add {
            model.add(&effect)?;
            commands.push(format!("stand model add {name} {effect}"));
        }
        if let Some(effect) = remove {
            model.remove(&effect)?;
            commands.push(format!("stand model remove {name} {effect}"));
        }
        if let Some(own) = add_expression {
            if own.torque_N_m.len() > MAX_EXPRESSION {
                return Err(format!("the expression is longer than {MAX_EXPRESSION} characters").into());
            }
            let parameters: Vec<(&str, f64)> = own.parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
            model.add_user_effect(&own.name, SummingPoint::Torque, &own.torque_N_m, &parameters)?;
        }
        if let Some(values) = set {
            model.set_all(values.iter().map(|(name, value)| (name.as_str(), *value)))?;
            commands.extend(values.iter().map(|(parameter, value)| format!("stand model set {name} {parameter} {value}")));
        }
        model.write(&path)?;
        for command in commands {
            panel.hub.note(&command, &[], &[]);
            panel.session.note_command(&command);
        }
        let mut answer = report::model::json(&model);
        answer["text"] = model.to_toml().into();
        Ok(Json(answer))
    })
    .await
}

async fn effects(_: Admitted) -> Answer {
    Ok(Json(report::effects::list_json()))
}

/// The card of an effect and its pictures, SVG.
async fn effect(_: Admitted, Query(Name { name }): Query<Name>) -> Answer {
    blocking(move || {
        let id = name.split('#').next().unwrap_or_default();
        let card =
            card(id).ok_or_else(|| ApiError(StatusCode::NOT_FOUND, format!("{}: no effect of the catalogue", id.escape_default())))?;
        let page = report::effects::effect_html(card);
        let plots: Vec<String> = report::plot_files::plots_of(&page).into_iter().map(|plot| plot.svg).collect();
        Ok(Json(json!({"card": report::effects::effect_json(card), "plots": plots})))
    })
    .await
}

async fn profiles(_: Admitted) -> Answer {
    let parameters = |kind: ProfileKind| -> Vec<&str> {
        PARAMETERS
            .iter()
            .map(|p| p.name)
            .filter(|name| kind.parameters().contains(name) && !matches!(*name, "seed" | "amplitude"))
            .collect()
    };
    let all: Vec<Value> = ProfileKind::ALL
        .into_iter()
        .map(|kind| json!({"name": kind.name(), "description": kind.description(), "parameters": parameters(kind)}))
        .collect();
    Ok(Json(json!({"profiles": all})))
}

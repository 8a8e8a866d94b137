//! Misfits of a fitted model.

use identification::recording;
use std::path::Path;

use crate::foreign::Case;
use identification::identify::fit;
use identification::identify::residual::{self, Misfit};
use identification::log::Log;
use identification::model::Model;

/// Misfits of `model`, fitted to the log.
pub fn fitted(log: &Log, model: &Model, rate_from_encoder: bool) -> Vec<Misfit> {
    let (mut record, _) = recording::prepare(log, model, true).expect("the columns");
    record.rate_from_encoder |= rate_from_encoder;
    let (system, parameters) = fit::build::system(model, record.temp_C.is_some());
    let fit_result = fit::fit(&system, &parameters, &record).expect("a fit");
    residual::misfits(log, &record, &fit_result)
}

/// The user's model of a case.
pub fn user_model(case: &Case) -> Model {
    Model::parse(&toml::to_string(&case.user_model_table).expect("a table"), "user model").expect("a model")
}

/// The coordinate stated by the case.
pub fn stated(data: &Path, case: &Case) -> Option<String> {
    let text = std::fs::read_to_string(data.join("cases").join(&case.name).join("truth.json")).expect("the answer");
    let answer: serde_json::Value = serde_json::from_str(&text).expect("the answer");
    answer["coordinate"].as_str().map(str::to_owned)
}

//! JSON schemas of the answers (draft 2020-12), by the command that gives them.
//!
//! A number that is not finite is written as `null`: each number may be `null`.

use serde_json::Value;

use crate::{
    allan, bad_log, calibration, certificate, comparison, compensation, conversion, drift, effects, equation_error, explanation, fleet,
    inspection, lab, model, observer, recording, settings, simulation, stability,
};

/// The schemas by command, as `stand schema` lists them.
pub fn all() -> Vec<(&'static str, Value)> {
    [
        simulation::schemas(),
        comparison::schemas(),
        equation_error::schemas(),
        bad_log::schemas(),
        explanation::schemas(),
        fleet::schemas(),
        calibration::archive::schemas(),
        calibration::trend::schemas(),
        calibration::evaluated::schemas(),
        certificate::schemas(),
        compensation::schemas(),
        settings::schemas(),
        recording::schemas(),
        drift::schemas(),
        allan::schemas(),
        stability::schemas(),
        inspection::schemas(),
        conversion::schemas(),
        model::schemas(),
        observer::schemas(),
        observer::track::schemas(),
        lab::schemas(),
        effects::schemas(),
    ]
    .concat()
}

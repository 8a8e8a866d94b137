//! Answer of `stand stability --json`.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::words::{STANDARD, scales, width};
use crate::json::schema_of;
use crate::json::value;
use crate::uncertainty::{EstimateJson, QuantityJson};
use crate::units::Units;
use stand_analysis::stability::{PlateauStability, Verdict, Width, WidthResult};

#[derive(Serialize, JsonSchema)]
struct AnswerJson<'a> {
    log: &'a str,
    plateaus: Vec<PlateauJson>,
}

#[derive(Serialize, JsonSchema)]
struct PlateauJson {
    start_s: f64,
    duration_s: f64,
    turns: usize,
    rate_cmd_rad_s: Option<f64>,
    rate_rad_s: EstimateJson,
    widths: Vec<WidthJson>,
    quantities: Vec<QuantityJson>,
}

#[derive(Serialize, JsonSchema)]
struct WidthJson {
    /// `null` for whole turns from index to index.
    width_deg: Option<f64>,
    windows: usize,
    sigma_relative: EstimateJson,
    resolution_relative: f64,
    resolved: bool,
    within_limit: Option<&'static str>,
}

/// The answer.
pub fn json(log: &str, plateaus: &[PlateauStability], units: Units) -> Value {
    let (rate, ratio) = scales(units);
    let width_json = |found: &WidthResult| WidthJson {
        width_deg: if let Width::Degrees(degrees) = found.width { Some(degrees) } else { None },
        windows: found.deviations.len(),
        sigma_relative: EstimateJson::new(&found.sigma, 1.0),
        resolution_relative: found.resolution,
        resolved: found.is_resolved(),
        within_limit: found.verdict.map(|verdict| match verdict {
            Verdict::Within => "yes",
            Verdict::Exceeds => "no",
            Verdict::Undecided => "undecided",
        }),
    };
    let plateau_json = |plateau: &PlateauStability| PlateauJson {
        start_s: plateau.start_s,
        duration_s: plateau.duration_s,
        turns: plateau.turns,
        rate_cmd_rad_s: plateau.command_rad_s,
        rate_rad_s: EstimateJson::new(&plateau.mean_rad_s, 1.0),
        widths: plateau.widths.iter().map(width_json).collect(),
        quantities: std::iter::once(QuantityJson::new("mean rate", STANDARD, &plateau.mean_rad_s, &rate))
            .chain(
                plateau
                    .widths
                    .iter()
                    .map(|found| QuantityJson::new(format!("rate stability over {}", width(found.width)), STANDARD, &found.sigma, &ratio)),
            )
            .collect(),
    };
    value(&AnswerJson { log, plateaus: plateaus.iter().map(plateau_json).collect() })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("stability", schema_of::<AnswerJson<'_>>())]
}

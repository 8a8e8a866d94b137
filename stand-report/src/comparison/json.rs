//! A comparison or a fit as JSON.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::Comparison;
use super::parameters::{Determination, parameters};
use crate::json::schema_of;
use crate::json::{Entries, is_false, value};
use crate::misfits::MisfitJson;
use crate::{column, unit};
use identification::identify::fit::ChannelFit;
use identification::log::Axis;
use identification::recording::prepared_log::ANGLE_INCREMENT_S;

/// Answer of `stand compare`.
#[derive(Serialize, JsonSchema)]
struct ComparisonJson<'a> {
    log: String,
    model: &'a str,
    samples: usize,
    duration_s: f64,
    outputs: Entries<OutputJson>,
    failures: Vec<MisfitJson>,
    remarks: Vec<String>,
    warnings: Vec<String>,
    seconds: f64,
}

/// Answer of `stand fit`: the parameters, and the keys of a comparison.
#[derive(Serialize, JsonSchema)]
struct FitJson<'a> {
    parameters: Entries<ParameterJson>,
    not_identifiable: Vec<&'a str>,
    not_identifiable_details: Vec<NotIdentifiableJson<'a>>,
    /// The model leaves more than noise: `sigma` does not contain what it lacks.
    sigma_is_lower_bound: bool,
    converged: bool,
    steps: usize,
    #[serde(flatten)]
    comparison: ComparisonJson<'a>,
}

#[derive(Serialize, JsonSchema)]
struct OutputJson {
    rms: f64,
    noise: f64,
    ratio: f64,
    fit_percent: f64,
    white: bool,
    chi2_per_n: f64,
    heldout_rms: Option<f64>,
    rows: usize,
    unit: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    compared: Option<String>,
}

#[derive(Serialize, JsonSchema)]
struct ParameterJson {
    value: f64,
    sigma: Option<f64>,
    unit: &'static str,
    fixed: bool,
    start: f64,
    #[serde(skip_serializing_if = "is_false")]
    at_bound: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    bound_excess_sigmas: Option<f64>,
    #[serde(skip_serializing_if = "is_false")]
    out_of_range: bool,
}

#[derive(Serialize, JsonSchema)]
struct NotIdentifiableJson<'a> {
    parameter: &'a str,
    with: Option<&'a str>,
    correlation: Option<f64>,
}

/// The answer of `stand compare --json`.
pub fn compare_json(c: &Comparison) -> Value {
    value(&comparison(c))
}

/// The answer of `stand fit --json`: that of a comparison, and the parameters.
pub fn fit_json(c: &Comparison) -> Value {
    let rows = parameters(c).into_iter().map(|row| {
        let sigma = (row.determination == Determination::Determined && !row.at_bound).then_some(row.sigma);
        let parameter = ParameterJson {
            value: row.value,
            sigma,
            unit: row.unit,
            fixed: row.fixed,
            start: row.start,
            at_bound: row.at_bound,
            bound_excess_sigmas: row.bound_excess_sigmas,
            out_of_range: row.out_of_range,
        };
        (row.name, parameter)
    });
    let undetermined = &c.result.unidentifiable;
    value(&FitJson {
        parameters: Entries(rows.collect()),
        not_identifiable: undetermined.iter().map(|u| u.parameter.as_str()).collect(),
        not_identifiable_details: undetermined
            .iter()
            .map(|u| NotIdentifiableJson {
                parameter: &u.parameter,
                with: u.partner.as_ref().map(|(other, _)| other.as_str()),
                correlation: u.partner.as_ref().map(|(_, r)| *r),
            })
            .collect(),
        sigma_is_lower_bound: c.result.sigma_is_lower_bound(),
        converged: c.result.converged,
        steps: c.result.steps,
        comparison: comparison(c),
    })
}

fn comparison<'a>(c: &'a Comparison) -> ComparisonJson<'a> {
    ComparisonJson {
        log: c.log.path().display().to_string(),
        model: c.model.name(),
        samples: c.log.len(),
        duration_s: c.log.duration_s(),
        outputs: Entries(
            c.result.channels.iter().map(|f| (column(c.model.axis(), f.channel).to_owned(), output(f, c.model.axis()))).collect(),
        ),
        failures: c.misfits.iter().map(|m| MisfitJson::of(c.model.axis(), m)).collect(),
        remarks: c.all_remarks(),
        warnings: c.all_warnings(),
        seconds: c.seconds,
    }
}

fn output(f: &ChannelFit, axis: Axis) -> OutputJson {
    OutputJson {
        rms: f.rms,
        noise: f.noise,
        ratio: f.rms / f.noise,
        fit_percent: f.fit_percent,
        white: f.white(),
        chi2_per_n: f.chi2_per_n(),
        heldout_rms: f.heldout_rms,
        rows: f.rows,
        unit: unit(axis, f.channel),
        compared: f.is_increment.then(|| format!("increments over {} ms", (ANGLE_INCREMENT_S * 1e3).round())),
    }
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("compare", schema_of::<ComparisonJson<'_>>()), ("fit", schema_of::<FitJson<'_>>())]
}

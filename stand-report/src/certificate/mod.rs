//! A calibration certificate as a page for print and as a Digital Calibration Certificate (DCC).

mod d_si;
mod dcc;
mod html;
mod names;

pub use dcc::dcc;
pub use html::html;

use crate::json::schema_of;
use crate::json::value;
use crate::significant;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use stand_records::certificate::{Certificate, Conformity, DecisionRule, Limit};

/// Said on every certificate.
const STATEMENT: &str = "This certificate is not issued under an accreditation. The results refer to the calibrated item at the time of the calibration only. \
                         It must not be reproduced except in full without the approval of the laboratory.";

/// Said on every page of a certificate of a simulated stand.
const SIMULATED: &str = "Simulated stand: no device was calibrated, this is an example.";

fn rule(rule: DecisionRule) -> &'static str {
    match rule {
        DecisionRule::SimpleAcceptance => "simple acceptance: within the limits, whatever the uncertainty (ILAC-G8:09/2019, 4.2.1)",
        DecisionRule::GuardBand => {
            "guard band w = U: pass within the limits reduced by U, fail beyond the limits enlarged by U, else undecided (ILAC-G8:09/2019, 4.2.3)"
        }
    }
}

fn conformity(conformity: Conformity) -> &'static str {
    match conformity {
        Conformity::Pass => "pass",
        Conformity::Fail => "fail",
        Conformity::Undecided => "undecided",
    }
}

fn limits(limit: &Limit) -> String {
    match (limit.lowest, limit.greatest) {
        (Some(low), Some(high)) => format!("{} … {}", significant(low, 6), significant(high, 6)),
        (Some(low), None) => format!("≥ {}", significant(low, 6)),
        (None, Some(high)) => format!("≤ {}", significant(high, 6)),
        (None, None) => String::new(),
    }
}

#[derive(Serialize, JsonSchema)]
struct DecisionEntry<'a> {
    quantity: &'a str,
    lowest: Option<f64>,
    greatest: Option<f64>,
    decision: &'static str,
}

#[derive(Serialize, JsonSchema)]
struct Answer<'a> {
    number: &'a str,
    issued: String,
    serial: &'a str,
    results: usize,
    decisions: Vec<DecisionEntry<'a>>,
}

/// The answer of `stand certificate --json`.
pub fn json(certificate: &Certificate) -> Value {
    let decisions = certificate.decisions().into_iter().map(|(limit, q, decided)| DecisionEntry {
        quantity: &q.name,
        lowest: limit.lowest,
        greatest: limit.greatest,
        decision: conformity(decided),
    });
    value(&Answer {
        number: &certificate.details.number,
        issued: certificate.details.issued.to_string(),
        serial: certificate.serial(),
        results: certificate.record.quantities.len(),
        decisions: decisions.collect(),
    })
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("certificate", schema_of::<Answer<'_>>())]
}

//! Results of the drift measurement: text for a terminal, HTML pages, JSON.

mod html;
mod json;
mod text;

pub use html::{advice_html, html};
pub use json::{advice_json, json, platform_json};
pub use text::{advice_text, platform_text, text};

use crate::drift::error_budget::ErrorSource;
use crate::drift::measurement::DriftWarning;
use crate::report::log_warning;

/// Name of a source of uncertainty.
fn source(source: ErrorSource) -> &'static str {
    match source {
        ErrorSource::CycleScatter => "scatter of the cycles",
        ErrorSource::Turn => "turn between the positions",
        ErrorSource::Level => "level",
        ErrorSource::AngleGain => "gain of the angle sensor",
        ErrorSource::PulseInequality => "unequal pulses, by two amplitudes",
    }
}

fn warning(warning: &DriftWarning) -> String {
    match warning {
        DriftWarning::NoTorquerGain => "K_m/H is not known (note torquer_gain_rad_s_A): no correction by the current".to_owned(),
        DriftWarning::Log(warning) => log_warning(warning),
    }
}

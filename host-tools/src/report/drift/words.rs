//! Words for the enums of the drift measurement.

use crate::drift::DriftError;
use crate::drift::cycle::CycleDefect;
use crate::drift::error::{NoCycleReason, PositionParameter};
use crate::drift::error_budget::ErrorSource;
use crate::drift::measurement::DriftWarning;
use crate::report::log_warning;

/// Name of a source of uncertainty.
pub(super) fn source(source: ErrorSource) -> &'static str {
    match source {
        ErrorSource::CycleScatter => "scatter of the cycles",
        ErrorSource::Turn => "turn between the positions",
        ErrorSource::Level => "level",
        ErrorSource::AngleGain => "gain of the angle sensor",
        ErrorSource::PulseInequality => "unequal pulses, by two amplitudes",
    }
}

/// A remark on the input.
pub(super) fn warning(warning: &DriftWarning) -> String {
    match warning {
        DriftWarning::NoTorquerGain => "K_m/H is not known (note torquer_gain_rad_s_A): no correction by the current".to_owned(),
        DriftWarning::Log(warning) => log_warning(warning),
    }
}

/// Why a cycle is not used.
pub(super) fn defect(defect: &CycleDefect) -> &str {
    match defect {
        CycleDefect::CutShort => "cut short",
        CycleDefect::SampleLost => "sample lost",
        CycleDefect::SensorSaturated => "angle sensor saturated",
        CycleDefect::CurrentLimited => "current limited",
        CycleDefect::Firmware(text) => text,
    }
}

fn no_cycle(reason: NoCycleReason) -> &'static str {
    match reason {
        NoCycleReason::ConstantCurrent => ": the current of the torquer is constant",
        NoCycleReason::OneRow => ": the log has one row",
        NoCycleReason::NoPlatformPulses => " (rate +w, then −w for the same time)",
    }
}

fn parameter(parameter: &PositionParameter) -> &'static str {
    match parameter {
        PositionParameter::OwnDrift => "own drift",
        PositionParameter::AzimuthCosine => "C = ω_h cos A",
        PositionParameter::AzimuthSine => "S = ω_h sin A",
        PositionParameter::GSensitive => "drift by g along the sensitive axis",
        PositionParameter::GOutput => "drift by g along the output axis",
        PositionParameter::GSpin => "drift by g along the spin axis",
    }
}

/// Why the input gives no drift, with the reason.
pub fn error_text(error: &DriftError) -> String {
    match error {
        DriftError::NoCycle { reason: Some(reason), .. } => format!("{error}{}", no_cycle(*reason)),
        DriftError::NoValidCycle { defect: Some(first), .. } => format!("{error}: {}", defect(first)),
        DriftError::NotSeparable { parameters, .. } => {
            format!("{error}; not separated: {}", parameters.iter().map(parameter).collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

//! Words for the enums of the drift measurement.

use schemars::JsonSchema;
use serde::Serialize;

use crate::uncertainty::with_expanded;
use crate::units::Scale;
use crate::{listed, log_warning, plain, significant};
use stand_analysis::drift::cycle::CycleDefect;
use stand_analysis::drift::error::{NoCycleReason, PositionParameter};
use stand_analysis::drift::error_budget::ErrorSource;
use stand_analysis::drift::measurement::{DriftWarning, SetupPart};
use stand_analysis::drift::platform::PlatformSource;
use stand_analysis::drift::{DEG_H, DriftError};

/// Seconds of an hour.
const HOUR_S: f64 = 3600.0;

/// Remark of the platform method.
pub(super) const QUIET: &str = "the reading at rest is constant: the gyro's noise is below its resolution, and constant readings in the pulses do not show whether it is clipped";

/// Name of a source of uncertainty.
pub(super) fn source(source: ErrorSource) -> &'static str {
    match source {
        ErrorSource::CycleScatter => "scatter of the cycles and visits, with the movement of the drift",
        ErrorSource::Turn => "turn between the positions",
        ErrorSource::Level => "level",
        ErrorSource::AngleGain => "gain of the angle sensor",
        ErrorSource::TorquerGain => "gain of the torquer, in the correction by the current",
        ErrorSource::Latitude => "latitude",
        ErrorSource::TorquerAsymmetry => "asymmetry of the torquer, by its stated bound",
    }
}

/// A remark on the input.
pub(super) fn warning(warning: &DriftWarning) -> String {
    match warning {
        DriftWarning::NoTorquerGain => "K_m/H is not known (note torquer_gain_rad_s_A): no correction by the current".to_owned(),
        DriftWarning::Log(warning) => log_warning(warning),
        DriftWarning::UnknownTimesBetweenLogs => {
            "several logs: the times between them are not known; they are taken as following each other without a pause".to_owned()
        }
        DriftWarning::Pole => "at a pole the Earth's rotation has no horizontal component: the azimuth is undefined".to_owned(),
        DriftWarning::Trend { axis, rad_s2 } => format!(
            "the drift{} changes linearly by {} per hour (significant at 1 %): the own drift is the mean of the session",
            about(*axis),
            with_expanded(rad_s2, &Scale { factor: HOUR_S / DEG_H, unit: "°/h".to_owned() })
        ),
        DriftWarning::Walk { axis, walk_rad_s_sqrt_s } => format!(
            "the drift{} moves as a random walk of about {} °/h/√h (significant at 1 %): the uncertainties follow it, and the own drift is the mean of the session",
            about(*axis),
            significant(walk_rad_s_sqrt_s * HOUR_S.sqrt() / DEG_H, 2)
        ),
        DriftWarning::Visits { axis, sigma_rad_s } => format!(
            "visits of one position{} differ by {} °/h (standard deviation) more than their cycles explain (significant at 1 %): the difference is in the budget",
            about(*axis),
            significant(sigma_rad_s / DEG_H, 2)
        ),
        DriftWarning::FewVisits { contrasts: 0 } => {
            "each position was visited once: an offset of a visit (turn, level) is not distinguishable from the position and not measured; only --turn-error and --level-error allow for it (drift run --rounds 2 measures it)".to_owned()
        }
        DriftWarning::FewVisits { .. } => {
            "the offsets of the visits (turn, level) show in one difference only: an offset of the only visit to a position is not found, and one that is found widens the uncertainty by Student's t of one degree of freedom (drift run --rounds 2 measures them)".to_owned()
        }
        DriftWarning::OneAmplitude { asymmetry_bound } => format!(
            "pulses of one amplitude do not show an asymmetry of the torquer; up to {} % is in the budget (--torquer-asymmetry); two amplitudes measure it",
            plain(100.0 * asymmetry_bound, 3)
        ),
        DriftWarning::TakenAsExact(parts) => {
            let parts: Vec<String> = parts.iter().map(|part| setup_part(*part).to_owned()).collect();
            format!("taken as exact, without a line in the budget: {}", listed(&parts))
        }
    }
}

/// A remark on the drift, for programs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum NoteKind {
    /// The gain of the torquer is unknown.
    NoTorquerGain,
    /// A remark on the log.
    Log {
        /// The sentence of the program.
        says: String,
    },
    /// The time between the logs is unknown.
    UnknownTimesBetweenLogs,
    /// Near a pole.
    Pole,
    /// The drift has a trend.
    Trend {
        /// The axis: x, y or z; none: there is one.
        axis: Option<&'static str>,
        /// °/h per hour.
        trend_deg_h_h: f64,
    },
    /// The drift walks.
    Walk {
        /// The axis: x, y or z; none: there is one.
        axis: Option<&'static str>,
        /// °/h/√h.
        walk_deg_h_sqrt_h: f64,
    },
    /// Visits to a position differ.
    Visits {
        /// The axis: x, y or z; none: there is one.
        axis: Option<&'static str>,
        /// Standard deviation, °/h.
        sigma_deg_h: f64,
    },
    /// Each position was visited once.
    SingleVisits,
    /// One difference between visits.
    FewVisits,
    /// Pulses of one amplitude.
    OneAmplitude {
        /// %.
        percent: f64,
    },
    /// Parts of the setup were taken as exact.
    TakenAsExact {
        /// The parts.
        parts: Vec<SetupPartKind>,
    },
}

/// A part of the setup, for programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SetupPartKind {
    /// The turn between positions.
    Turn,
    /// The level.
    Level,
    /// The gain of the angle sensor.
    AngleGain,
}

/// A remark on the input, for programs.
pub(super) fn warning_kind(warning: &DriftWarning) -> NoteKind {
    let name = |axis: &Option<usize>| axis.and_then(|axis| ["x", "y", "z"].get(axis).copied());
    match warning {
        DriftWarning::NoTorquerGain => NoteKind::NoTorquerGain,
        DriftWarning::Log(warning) => NoteKind::Log { says: log_warning(warning) },
        DriftWarning::UnknownTimesBetweenLogs => NoteKind::UnknownTimesBetweenLogs,
        DriftWarning::Pole => NoteKind::Pole,
        DriftWarning::Trend { axis, rad_s2 } => NoteKind::Trend { axis: name(axis), trend_deg_h_h: rad_s2.value * HOUR_S / DEG_H },
        DriftWarning::Walk { axis, walk_rad_s_sqrt_s } => {
            NoteKind::Walk { axis: name(axis), walk_deg_h_sqrt_h: walk_rad_s_sqrt_s * HOUR_S.sqrt() / DEG_H }
        }
        DriftWarning::Visits { axis, sigma_rad_s } => NoteKind::Visits { axis: name(axis), sigma_deg_h: sigma_rad_s / DEG_H },
        DriftWarning::FewVisits { contrasts: 0 } => NoteKind::SingleVisits,
        DriftWarning::FewVisits { .. } => NoteKind::FewVisits,
        DriftWarning::OneAmplitude { asymmetry_bound } => NoteKind::OneAmplitude { percent: 100.0 * asymmetry_bound },
        DriftWarning::TakenAsExact(parts) => NoteKind::TakenAsExact { parts: parts.iter().map(|part| setup_part_kind(*part)).collect() },
    }
}

fn setup_part_kind(part: SetupPart) -> SetupPartKind {
    match part {
        SetupPart::Turn => SetupPartKind::Turn,
        SetupPart::Level => SetupPartKind::Level,
        SetupPart::AngleGain => SetupPartKind::AngleGain,
    }
}

fn about(axis: Option<usize>) -> &'static str {
    axis.and_then(|axis| [" about x", " about y", " about z"].get(axis).copied()).unwrap_or_default()
}

fn setup_part(part: SetupPart) -> &'static str {
    match part {
        SetupPart::Turn => "the turn between positions (--turn-error)",
        SetupPart::Level => "the level (--level-error)",
        SetupPart::AngleGain => "the gain of the angle sensor (--gain-error)",
    }
}

/// Name of a source of uncertainty of the platform method.
pub(super) fn platform_source(source: PlatformSource) -> &'static str {
    match source {
        PlatformSource::Cycles => "scatter of the cycles, with the movement of the bias",
        PlatformSource::Crystal => "crystal, ± 50 ppm",
        PlatformSource::Misalignment => "angle of up to 0.5° between the axes of gyro and platform",
        PlatformSource::EarthRate => "Earth rate along the axis, because no latitude is given",
    }
}

/// Why a cycle is not used.
pub(super) fn defect(defect: &CycleDefect) -> String {
    match defect {
        CycleDefect::CutShort => "cut short".to_owned(),
        CycleDefect::SampleLost => "sample lost".to_owned(),
        CycleDefect::SensorSaturated => "angle sensor saturated".to_owned(),
        CycleDefect::FlatTop => "the reading is flat near the end of its range: the sensor is clipped".to_owned(),
        CycleDefect::Reference { ratio } => format!(
            "the angle follows the current by {} of the torquer's gain: the sensor is clipped, or K_k or K_m/H is wrong",
            significant(*ratio, 3)
        ),
        CycleDefect::CurrentLimited => "current limited".to_owned(),
        CycleDefect::Disturbed { deviation_rad_s } => format!(
            "its rate is {} °/h off the others, which their scatter explains with a probability below 1e-3 only: disturbed",
            significant(deviation_rad_s / DEG_H, 3)
        ),
        CycleDefect::Firmware(text) => text.clone(),
    }
}

fn no_cycle(reason: NoCycleReason) -> &'static str {
    match reason {
        NoCycleReason::ConstantCurrent => ": the current of the torquer is constant",
        NoCycleReason::OneRow => ": the log has one row",
        NoCycleReason::NoPlatformPulses => ": the platform must turn at +w and −w in turn, for the same time (profile alternating or abba)",
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

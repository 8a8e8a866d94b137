//! Terms of the standards for the quantities of a calibration.
//!
//! IEEE Std 528 (definitions of inertial sensors) and IEEE Std 2700 (performance parameters of MEMS sensors) are named by their terms, IEEE
//! Std 952 by its annex C (Allan variance), ISO 16063-23 for the angular calibration by comparison with a reference.

use stand_analysis::calibrate::Meaning;

/// Standard and term of a quantity; `None` where these standards have none.
pub(super) fn standard(meaning: &Meaning) -> Option<&'static str> {
    Some(match meaning {
        Meaning::LineSlope | Meaning::WholeTurnScale { .. } | Meaning::ScaleByTwoRadii | Meaning::ScaleAtGivenRadius => {
            "IEEE Std 528: scale factor"
        }
        Meaning::BiasWithoutEarthRate | Meaning::BiasWithEarthRate | Meaning::AccelerometerBias => {
            "IEEE Std 528: bias; IEEE Std 2700: zero offset"
        }
        Meaning::HandScale => "IEEE Std 528: scale factor",
        Meaning::HandCrossAxis => "IEEE Std 528: misalignment, cross-axis sensitivity",
        Meaning::TumbleK0 => "IEEE Std 1293: bias K₀",
        Meaning::TumbleK1 => "IEEE Std 1293: scale factor K₁",
        Meaning::TumbleK2 => "IEEE Std 1293: second-order coefficient K₂",
        Meaning::TumbleK3 => "IEEE Std 1293: third-order coefficient K₃",
        Meaning::Nonlinearity => "IEEE Std 528: nonlinearity",
        Meaning::Asymmetry => "IEEE Std 528: asymmetry error",
        Meaning::Hysteresis => "IEEE Std 528: hysteresis error",
        Meaning::Repeatability => "IEEE Std 528: repeatability",
        Meaning::RateDeadBand => "IEEE Std 528: dead band",
        Meaning::Threshold => "IEEE Std 528: threshold, resolution",
        Meaning::WarmUpChange { .. } => "IEEE Std 528: warm-up",
        Meaning::WarmUpTime { .. } => "IEEE Std 528: warm-up time; IEEE Std 952 and 1431: warm-up time",
        Meaning::TurnOnRepeatability { .. } => "IEEE Std 528: repeatability; IEEE Std 1554: turn-on to turn-on, here by re-initialisation",
        Meaning::InRunStability { .. } => "IEEE Std 952, annex C: Allan variance; IEEE Std 528: stability",
        Meaning::BiasTemperature => "IEEE Std 2700: offset change with temperature",
        Meaning::ScaleTemperature => "IEEE Std 2700: sensitivity change with temperature",
        Meaning::GSensitivityByTilt | Meaning::GSensitivityByRadius => "IEEE Std 528: acceleration-sensitive drift rate",
        Meaning::CrossAxis => "IEEE Std 528: cross-axis sensitivity",
        Meaning::MountingError | Meaning::MountingAngle => "IEEE Std 528: misalignment",
        Meaning::Bandwidth { .. } | Meaning::Delay { .. } | Meaning::Damping { .. } | Meaning::DynamicScale { .. } => {
            "ISO 16063-23: angular calibration by comparison"
        }
        _ => return None,
    })
}

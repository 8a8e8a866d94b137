//! Sentences about observers: warnings, poles, inputs.

use nalgebra::Complex;

use crate::digits;
use stand_analysis::observer::bode::Excitation;
use stand_analysis::observer::vibration::VibrationSource;
use stand_analysis::observer::{Moment, Warning};

/// Poles as a list; equal poles once, with their number.
pub(super) fn pole_list(poles: &[Complex<f64>]) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut k = 0;
    while let Some(pole) = poles.get(k) {
        let count = poles[k..].iter().take_while(|z| *z == pole).count();
        let one = if pole.im.abs() < 1e-9 * pole.norm() {
            digits(pole.re)
        } else {
            format!("{} {} {}i", digits(pole.re), if pole.im < 0.0 { "−" } else { "+" }, digits(pole.im.abs()))
        };
        words.push(if count > 1 { format!("{one} ({count} times)") } else { one });
        k += count;
    }
    words.join(", ")
}

/// The moment of a simulation.
pub(super) fn moment(moment: &Moment) -> String {
    let mut parts = vec![format!("moment {} N m", digits(moment.constant_N_m))];
    if let Some(h) = moment.harmonic {
        parts.push(format!("harmonic {} N m at {} Hz", digits(h.amplitude_N_m), digits(h.frequency_Hz)));
    }
    if let Some(r) = moment.random {
        parts.push(format!("random {} N m (1σ), correlated over {} s", digits(r.sigma_N_m), digits(r.correlation_s)));
    }
    parts.join(" + ")
}

/// The input of the object's frequency response.
pub(super) fn excitation(excitation: Excitation) -> &'static str {
    match excitation {
        Excitation::OverloadAlongRotor => "overload along the rotor, in g",
        Excitation::VerticalMoment => "moment about the vertical, in N m",
    }
}

/// Source of an uncertainty of the vibration correction.
pub(super) fn vibration_source(source: VibrationSource) -> &'static str {
    match source {
        VibrationSource::Periods => "scatter and movement of the periods",
        VibrationSource::GammaGain => "γ: gain",
        VibrationSource::GammaDelay => "γ: delay",
        VibrationSource::GammaMisalignment => "γ: rotation of its sensor about the vertical",
        VibrationSource::GammaOffset => "γ: offset",
        VibrationSource::Element => "H/k and (Jx − Jz)/k of the element",
    }
}

/// A warning about a design.
pub fn warning(warning: &Warning) -> String {
    match *warning {
        Warning::PolesBelowNutation { poles_1_s, nutation_rad_s } => format!(
            "The poles at {poles_1_s:.4} 1/s are below 3 × the nutation frequency of {nutation_rad_s:.4} rad/s: the estimated rate is distorted (`stand observer bode` shows from which frequency)."
        ),
        Warning::PolesBelowVibration { poles_1_s, vibration_Hz } => format!(
            "The poles at {poles_1_s:.4} 1/s are below 3 × the vibration of {vibration_Hz:.4} Hz ({:.4} rad/s): a correction by this rate removes too little or increases the error.",
            std::f64::consts::TAU * vibration_Hz
        ),
        Warning::SlowIntegralPole { pole_1_s } => format!(
            "The integral channel leaves a slow pole at {pole_1_s:+.4} 1/s with a time constant of {:.3} s; the augmented kind has no such pole.",
            -1.0 / pole_1_s
        ),
        Warning::FewSamplesPerPole { step_s, poles_1_s } => format!(
            "The step of {step_s} s gives fewer than 10 samples per period of the poles ({poles_1_s:.4} 1/s): noise and motion between the samples are not filtered."
        ),
        Warning::ModeAboveNyquist { mode_rad_s, step_s } => format!(
            "The fastest mode of {mode_rad_s:.4} rad/s lies above half the sampling rate ({:.1} rad/s) and is aliased: use a step below {:.3} ms.",
            std::f64::consts::PI / step_s,
            1e3 * std::f64::consts::PI / mode_rad_s
        ),
        Warning::ShorterThanPrecession { window_s, precession_s } => format!(
            "The means over {window_s:.4} s are shorter than a precession of {precession_s:.4} s: the azimuth contains where the precession stands; the part by vibration does not."
        ),
        Warning::SinglePrecision { moment_error, rate_error_rad_s } => format!(
            "In single precision the moment would be wrong by {:.2} % and the rate by {rate_error_rad_s:.1e} rad/s: the firmware uses double precision.",
            100.0 * moment_error
        ),
    }
}

//! Warnings about a design that is valid but may not do what its user expects.

use super::single::single;
use super::{Design, Element, Kind};
use identification::statistics::Extremes;
use std::f64::consts::{PI, TAU};

/// Required ratio of the observer's poles to nutation and vibration frequency (docs/theory.md §2.2).
const MIN_POLE_RATIO: f64 = 3.0;
/// Required samples per period of the observer's poles (docs/theory.md §2.2).
const MIN_SAMPLES_PER_PERIOD: f64 = 10.0;
/// Smallest ratio of an integral channel's slowest pole to the placed poles that causes no slow tail.
const MIN_INTEGRAL_POLE_RATIO: f64 = 0.3;
/// Relative moment error in single precision above which a warning is given.
const MAX_SINGLE_PRECISION_ERROR: f64 = 1e-3;

/// A property of a design of which its user should know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Warning {
    /// The poles are below three times the nutation frequency.
    PolesBelowNutation {
        /// Slowest placed pole, 1/s.
        poles_1_s: f64,
        /// Nutation frequency, rad/s.
        nutation_rad_s: f64,
    },
    /// The poles are below three times the vibration frequency.
    PolesBelowVibration {
        /// Slowest placed pole, 1/s.
        poles_1_s: f64,
        /// Vibration frequency, Hz.
        vibration_Hz: f64,
    },
    /// The integral channel leaves a slow pole.
    SlowIntegralPole {
        /// Real part of the pole, 1/s.
        pole_1_s: f64,
    },
    /// Fewer than ten samples per period of the poles.
    FewSamplesPerPole {
        /// Step of the discrete form, s.
        step_s: f64,
        /// Slowest placed pole, 1/s.
        poles_1_s: f64,
    },
    /// The fastest mode lies above half the sampling rate.
    ModeAboveNyquist {
        /// Fastest mode, rad/s.
        mode_rad_s: f64,
        /// Step of the discrete form, s.
        step_s: f64,
    },
    /// The record is shorter than a precession, which its mean contains.
    ShorterThanPrecession {
        /// Duration of the means, s.
        window_s: f64,
        /// Duration of a precession, s.
        precession_s: f64,
    },
    /// Single precision would not be sufficient.
    SinglePrecision {
        /// Relative error of the estimated moment.
        moment_error: f64,
        /// Error of the estimated rate, rad/s.
        rate_error_rad_s: f64,
    },
}

impl Design {
    /// Warnings about this design.
    pub fn warnings(&self) -> Vec<Warning> {
        let mut found = Vec::new();
        let poles_1_s = self.request.slowest_placed_pole_1_s();
        let fastest_rad_s = self.request.plant.fastest_rad_s();
        if let Element::Four(_) = self.request.plant.element
            && poles_1_s < MIN_POLE_RATIO * fastest_rad_s
        {
            found.push(Warning::PolesBelowNutation { poles_1_s, nutation_rad_s: fastest_rad_s });
        }
        if let Some(vibration_Hz) = self.request.vibration_Hz
            && poles_1_s < MIN_POLE_RATIO * (TAU * vibration_Hz)
        {
            found.push(Warning::PolesBelowVibration { poles_1_s, vibration_Hz });
        }
        if let (Kind::Integral { .. }, Some(pole)) = (self.request.kind, self.poles.first())
            && pole.re > -MIN_INTEGRAL_POLE_RATIO * poles_1_s
        {
            found.push(Warning::SlowIntegralPole { pole_1_s: pole.re });
        }
        if let Some(step_s) = self.request.step_s {
            if poles_1_s * step_s * MIN_SAMPLES_PER_PERIOD > TAU {
                found.push(Warning::FewSamplesPerPole { step_s, poles_1_s });
            }
            if fastest_rad_s * step_s > PI {
                found.push(Warning::ModeAboveNyquist { mode_rad_s: fastest_rad_s, step_s });
            }
        }
        if let Some(single) = self.discrete.as_ref().and_then(single)
            && single.moment > MAX_SINGLE_PRECISION_ERROR
        {
            found.push(Warning::SinglePrecision { moment_error: single.moment, rate_error_rad_s: single.rate_rad_s });
        }
        found
    }
}

impl super::Request {
    /// Magnitude of the slowest requested pole, 1/s.
    pub(super) fn slowest_placed_pole_1_s(&self) -> f64 {
        match &self.poles {
            super::Poles::Binomial(omega) => *omega,
            super::Poles::Given(poles) => poles.iter().map(|z| -z.re).min_or_infinity(),
        }
    }
}

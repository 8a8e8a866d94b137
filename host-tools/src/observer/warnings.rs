//! What to beware of: where theory says that an observer, as designed, will not do what its user expects.

use super::single::single;
use super::{Design, Element, Kind};
use crate::statistics::Extremes;

/// The observer's rates must be so much above nutation and vibration (theory §2.2).
const ABOVE: f64 = 3.0;
/// Samples in a turn of the observer's poles (theory §2.2).
const SAMPLES: f64 = 10.0;
/// A rate or a moment that single precision spoils by more is said.
const SPOILT: f64 = 1e-3;

impl Design {
    /// Each warning a line.
    pub fn warnings(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let slowest = self.request.poles_size();
        let fastest_rad_s = self.request.plant.fastest_rad_s();
        if let Element::Four(_) = self.request.plant.element
            && slowest < ABOVE * fastest_rad_s
        {
            lines.push(format!(
                "the poles at {slowest:.4} 1/s are below 3 × the nutation of {fastest_rad_s:.4} rad/s: the estimated rate is distorted (`stand observer bode` shows where)"
            ));
        }
        if let Some(vibration_Hz) = self.request.vibration_Hz {
            let vibration_rad_s = std::f64::consts::TAU * vibration_Hz;
            if slowest < ABOVE * vibration_rad_s {
                lines.push(format!(
                    "the poles at {slowest:.4} 1/s are below 3 × the vibration of {vibration_Hz:.4} Hz ({vibration_rad_s:.4} rad/s): a correction made of this rate takes off too little, or makes it worse"
                ));
            }
        }
        if let (Kind::Integral { .. }, Some(pole)) = (self.request.kind, self.poles.first())
            && pole.re > -0.3 * slowest
        {
            lines.push(format!(
                "the integral channel leaves a slow pole at {:+.4} 1/s: a tail with a time constant of {:.3} s; the augmented kind has none",
                pole.re,
                -1.0 / pole.re
            ));
        }
        if let Some(step_s) = self.request.step_s {
            if slowest * step_s * SAMPLES > std::f64::consts::TAU {
                lines.push(format!(
                    "the step of {step_s} s gives fewer than 10 samples to a turn of the poles ({slowest:.4} 1/s): noise and what is between the samples go unfiltered"
                ));
            }
            if fastest_rad_s * step_s > std::f64::consts::PI {
                lines.push(format!(
                    "the fastest mode of {fastest_rad_s:.4} rad/s lies above half the rate of the samples ({:.1} rad/s): it is seen as a slower one; take a step below {:.3} ms",
                    std::f64::consts::PI / step_s,
                    1e3 * std::f64::consts::PI / fastest_rad_s
                ));
            }
        }
        if let Some(single) = self.discrete.as_ref().and_then(single)
            && single.moment > SPOILT
        {
            lines.push(format!(
                "single precision would be off by {:.2} % in the moment and {:.1e} rad/s in the rate: the firmware runs it in double",
                100.0 * single.moment,
                single.rate_rad_s
            ));
        }
        lines
    }
}

impl super::Request {
    /// Size of the slowest pole that was placed, 1/s.
    pub(super) fn poles_size(&self) -> f64 {
        match &self.poles {
            super::Poles::Binomial(omega) => *omega,
            super::Poles::Given(poles) => poles.iter().map(|z| -z.re).min_or_infinity(),
        }
    }
}

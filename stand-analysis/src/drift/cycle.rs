//! One cycle of the measurement: two pulses of opposite sign in one position of the gyroscope.

use super::clipping::{Clipping, clipping};
use super::integral::{Integral, amplitude_rad_s};
use hal_sim::gyro::Orientation;
use stand_acquire::drift_session::{GyroscopeScales, ReportedCycle};
use std::f64::consts::TAU;

/// Largest difference of angles in one position, rad: 2″.
const POSITION_TOLERANCE_RAD: f64 = 1e-5;

/// Why a cycle is not used.
#[derive(Debug, Clone, PartialEq)]
pub enum CycleDefect {
    /// The cycle ended early.
    CutShort,
    /// A sample is missing.
    SampleLost,
    /// The angle sensor reached the end of its range.
    SensorSaturated,
    /// The angle is flat near an end of its range.
    FlatTop,
    /// The swing of the angle differs from that by the current.
    Reference {
        /// Measured over expected swing.
        ratio: f64,
    },
    /// The currents of the two pulses differ in size.
    CurrentLimited,
    /// The rate is off by more than the scatter of the other cycles explains.
    Disturbed {
        /// Deviation from the fit of the others, rad/s.
        deviation_rad_s: f64,
    },
    /// The firmware rejected the cycle, with this text.
    Firmware(String),
}

/// One cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    /// Its number, from 1.
    pub number: u32,
    /// Position of the gyroscope.
    pub position: Orientation,
    /// Axis of the platform, 0 to 2; 0 for a single-axis gyroscope.
    pub axis: usize,
    /// Sign of the first pulse.
    pub sign: i8,
    /// Begin since the start of the session, s.
    pub start_s: f64,
    /// Sums over the cycle.
    pub integral: Integral,
    /// Magnitude of the pulses, rad/s: by the angles that of a rectangular pulse with the same rotation.
    pub amplitude_rad_s: f64,
    /// Inequality of the pulses by the measured current, rad/s; `None` where the current or K_m/H is not known.
    pub residual_rad_s: Option<f64>,
    /// Why the cycle is not used.
    pub defect: Option<CycleDefect>,
}

impl From<Clipping> for CycleDefect {
    fn from(clipping: Clipping) -> Self {
        match clipping {
            Clipping::FlatTop => Self::FlatTop,
            Clipping::Reference { ratio } => Self::Reference { ratio },
        }
    }
}

impl Cycle {
    /// The cycle that the firmware reports.
    pub fn of_report(report: &ReportedCycle, scales: &GyroscopeScales) -> Self {
        let pulse_s = report.pulse_s();
        let angles_rad: Vec<f64> = report.trace.angle_V.iter().map(|volts| volts / scales.angle_gain_V_rad).collect();
        // By the angles: the converter of the torquer rounds the setpoint, and small pulses relatively more than large ones.
        let amplitude_rad_s = match (angles_rad.is_empty(), pulse_s > 0.0) {
            (false, true) => amplitude_rad_s(&angles_rad, pulse_s),
            (true, true) => report.span_rad(scales) / pulse_s,
            _ => report.rate_rad_s,
        };
        Self {
            number: report.number,
            position: report.position,
            axis: 0,
            sign: report.sign,
            start_s: report.start_s,
            integral: Integral {
                pulse_s,
                switched_rad_s: -report.drift_rad_s * pulse_s * pulse_s,
                sum_rad_s: report.sum_rad_s(scales),
                slope_rad_s: report.slope_rad_s(scales),
                span_rad: report.span_rad(scales),
            },
            amplitude_rad_s,
            residual_rad_s: Some(report.drift_rad_s - report.corrected_rad_s),
            defect: report.rejection.clone().map(CycleDefect::Firmware).or_else(|| {
                clipping(&angles_rad, &report.trace.current_A, pulse_s, Some(scales.torquer_gain_rad_s_A)).map(CycleDefect::from)
            }),
        }
    }

    /// Drift rate, corrected by the inequality of the current, rad/s.
    pub fn rate_rad_s(&self) -> f64 {
        self.integral.drift_rad_s() - self.residual_rad_s.unwrap_or(0.0)
    }
}

/// The positions agree within 2″.
pub fn is_same_position(a: &Orientation, b: &Orientation) -> bool {
    let turned = (a.turned_rad - b.turned_rad).rem_euclid(TAU);
    turned.min(TAU - turned) < POSITION_TOLERANCE_RAD
        && (a.raised_rad - b.raised_rad).abs() < POSITION_TOLERANCE_RAD
        && (a.rolled_rad - b.rolled_rad).abs() < POSITION_TOLERANCE_RAD
}

#[cfg(test)]
mod tests {
    use super::*;
    use stand_acquire::drift_session::CycleTrace;

    #[test]
    fn reported_cycle_has_the_rates_of_the_report() {
        let scales = GyroscopeScales { angle_V_per_code: 1e-3, angle_gain_V_rad: 100.0, torquer_gain_rad_s_A: 0.02, angle_limit_V: 1.6 };
        let report = ReportedCycle {
            number: 3,
            position: Orientation::default(),
            sign: -1,
            start_s: 10.0,
            rate_rad_s: 1e-3,
            samples: 5000.0,
            doubled_sum_codes: 82.0,
            moment_codes: 5.0,
            span_codes: 404.0,
            drift_rad_s: 1.5e-6,
            corrected_rad_s: 1.25e-6,
            rejection: Some("emergency stop".to_owned()),
            trace: CycleTrace::default(),
        };
        let cycle = Cycle::of_report(&report, &scales);
        assert!((cycle.integral.drift_rad_s() - 1.5e-6).abs() < 1e-15 && (cycle.rate_rad_s() - 1.25e-6).abs() < 1e-15);
        assert!((cycle.integral.span_rad - 404e-5).abs() < 1e-12);
        assert_eq!(cycle.defect, Some(CycleDefect::Firmware("emergency stop".to_owned())));
    }
}

//! Mean outputs over plateaus, with the temperature of the device under test.

use super::{GyroSettings, dut_output};
use crate::calibrate::Step;
use crate::calibrate::plateaus::{Plateau, plateaus};
use identification::statistics::Extremes;

/// Length of a piece of a log at rest that counts as a plateau, s.
const REST_PIECE_S: f64 = 2.0;
/// Greatest change of the angle of a platform at rest, rad.
pub(super) const MAX_REST_ANGLE_RAD: f64 = 0.01;

/// Mean output over one plateau.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The plateau.
    pub plateau: Plateau,
    /// Mean output.
    pub output: f64,
    /// Slope of the output within the plateau, per second.
    pub slope: f64,
    /// Mean temperature of the device under test, °C; NaN without the column `sensor_C`.
    pub temperature_C: f64,
    /// Index of the log.
    pub log: usize,
    /// Time from the middle of the log, s.
    pub from_middle_s: f64,
}

fn point(step: &Step, output: &[f64], plateau: Plateau, log: usize) -> Point {
    let t_s = step.log.t_s();
    let middle_s = 0.5 * (t_s.first().unwrap_or(&0.0) + t_s.last().unwrap_or(&0.0));
    let temperature_C = step.log.column("sensor_C").map_or(f64::NAN, |celsius| plateau.mean(celsius));
    let (mean, slope, from_middle_s) = (plateau.mean(output), plateau.slope(t_s, output), plateau.mid_s - middle_s);
    Point { plateau, output: mean, slope, temperature_C, log, from_middle_s }
}

/// Mean outputs of all plateaus of the steps.
pub(super) fn points(steps: &[&Step], settings: &GyroSettings) -> Vec<Point> {
    let mut points = Vec::new();
    for (log, step) in steps.iter().enumerate() {
        let Some(output) = dut_output(&step.log, settings) else { continue };
        let found = plateaus(&step.log, "rate_cmd_rad_s", settings.settle_s);
        points.extend(found.into_iter().map(|plateau| point(step, output, plateau, log)));
    }
    points
}

/// Logs in which the platform rests, in pieces.
pub(super) fn rest_points(steps: &[&Step], settings: &GyroSettings) -> Vec<Point> {
    let mut points = Vec::new();
    for (log, step) in steps.iter().enumerate() {
        let (Some(output), Some(theta)) = (dut_output(&step.log, settings), step.log.column("theta_rad")) else { continue };
        let (low, high) = theta.iter().copied().min_max();
        if high - low > MAX_REST_ANGLE_RAD {
            continue;
        }
        let t_s = step.log.t_s();
        let size = ((REST_PIECE_S / step.log.median_dt_s().max(1e-9)) as usize).max(1);
        for segment in step.log.segments() {
            for from in segment.clone().step_by(size).filter(|from| from + size < segment.end) {
                let plateau = Plateau {
                    rows: from..from + size,
                    shifts: 1,
                    setpoint: 0.0,
                    previous_setpoint: None,
                    rate_rad_s: 0.0,
                    mid_s: 0.5 * (t_s[from] + t_s[from + size]),
                    duration_s: t_s[from + size] - t_s[from],
                    turns: 0,
                };
                points.push(point(step, output, plateau, log));
            }
        }
    }
    points
}

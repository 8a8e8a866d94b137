//! Plateaus: stretches of constant setpoint after settling, cut to whole turns.
//!
//! Over whole turns, effects periodic in the angle (eccentricity of the encoder disc, gravity on a tilted stand, cogging) have no mean. The
//! reference rate is the encoder's angle over the crystal's time.

use identification::log::Log;
use identification::statistics::Extremes;
use std::f64::consts::TAU;
use std::ops::Range;

/// Shortest plateau after settling, s.
const MIN_DURATION_S: f64 = 0.2;
/// Greatest number of rows by which a plateau is shifted. The mean over all shifts, each over the same whole turns, reduces the
/// quantisation of the encoder by the square root of their number.
const MAX_SHIFTS: usize = 200;
/// Rows of a plateau per shift.
const ROWS_PER_SHIFT: usize = 10;
/// Setpoints agree within this fraction of the greatest: they are transmitted in single precision.
const SETPOINT_TOLERANCE: f64 = 1e-6;

/// One plateau.
#[derive(Debug, Clone, PartialEq)]
pub struct Plateau {
    /// Rows of one average; the row after them exists too.
    pub rows: Range<usize>,
    /// Number of averages, each shifted by one row.
    pub shifts: usize,
    /// Setpoint, in the unit of the setpoint column.
    pub setpoint: f64,
    /// Setpoint of the plateau before; `None` for the first.
    pub previous_setpoint: Option<f64>,
    /// Mean rate by the encoder, rad/s.
    pub rate_rad_s: f64,
    /// Time of the middle, s.
    pub mid_s: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Whole turns to which the plateau was cut; 0 for less than one turn.
    pub turns: u32,
}

impl Plateau {
    /// Mean of a column over the plateau.
    pub fn mean(&self, column: &[f64]) -> f64 {
        let Some(part) = column.get(self.rows.start..self.rows.end + self.shifts - 1) else { return f64::NAN };
        let n = self.rows.len();
        // Number of shifted averages that contain a row.
        let times = |k: usize| (k + 1).min(self.shifts).min(n).min(part.len() - k) as f64;
        part.iter().enumerate().map(|(k, value)| value * times(k)).sum::<f64>() / (n * self.shifts) as f64
    }

    /// Slope of a column over the plateau, per second.
    pub fn slope(&self, t_s: &[f64], column: &[f64]) -> f64 {
        let (mut cross, mut square) = (0.0, 0.0);
        let mean = self.mean(column);
        let mid_s = self.mean(t_s);
        for k in self.rows.clone() {
            cross += (t_s[k] - mid_s) * (column[k] - mean);
            square += (t_s[k] - mid_s).powi(2);
        }
        if square > 0.0 { cross / square } else { 0.0 }
    }

    /// Approached from below: +1, from above: −1, first plateau: 0.
    pub fn direction(&self) -> f64 {
        self.previous_setpoint.map_or(0.0, |previous| if self.setpoint > previous { 1.0 } else { -1.0 })
    }
}

/// The plateaus of a log by its setpoint column; the first `settle_s` of each are left out. A gap in time ends a plateau.
pub fn plateaus(log: &Log, setpoint_column: &str, settle_s: f64) -> Vec<Plateau> {
    let (Some(setpoints), Some(theta)) = (log.column(setpoint_column), log.column("theta_rad")) else { return Vec::new() };
    let t_s = log.t_s();
    let (low, high) = setpoints.iter().copied().min_max();
    let tolerance = SETPOINT_TOLERANCE * low.abs().max(high.abs());
    let mut found: Vec<Plateau> = Vec::new();
    let mut previous = None;
    for segment in log.segments() {
        let mut from = segment.start;
        while from < segment.end {
            let level = setpoints[from];
            let end = (from..segment.end).find(|k| (setpoints[*k] - level).abs() > tolerance).unwrap_or(segment.end);
            let constant = from..end;
            from = end;
            if t_s[end - 1] - t_s[constant.start] < settle_s + MIN_DURATION_S {
                continue;
            }
            if let Some(plateau) = cut_to_turns(t_s, theta, constant, settle_s, level, previous) {
                found.push(plateau);
            }
            previous = Some(level);
        }
    }
    found
}

fn cut_to_turns(
    t_s: &[f64],
    theta: &[f64],
    constant: Range<usize>,
    settle_s: f64,
    setpoint: f64,
    previous_setpoint: Option<f64>,
) -> Option<Plateau> {
    let from = constant.clone().find(|k| t_s[*k] - t_s[constant.start] >= settle_s)?;
    let shifts = ((constant.end - from) / ROWS_PER_SHIFT).clamp(1, MAX_SHIFTS);
    let last = constant.end - shifts;
    if last <= from {
        return None;
    }
    let angle = (theta[last] - theta[from]).abs();
    let turns = (angle / TAU).floor();
    let to = if turns >= 1.0 { (from..=last).find(|k| (theta[*k] - theta[from]).abs() >= turns * TAU).unwrap_or(last) } else { last };
    let duration_s = t_s[to] - t_s[from];
    let rate = |shift: usize| (theta[to + shift] - theta[from + shift]) / (t_s[to + shift] - t_s[from + shift]);
    (duration_s >= MIN_DURATION_S).then(|| Plateau {
        rows: from..to,
        shifts,
        setpoint,
        previous_setpoint,
        rate_rad_s: (0..shifts).map(rate).sum::<f64>() / shifts as f64,
        mid_s: 0.5 * (t_s[to] + t_s[from]),
        duration_s,
        turns: turns as u32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::log::Column;

    fn log(levels: &[f64]) -> Log {
        let column = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
        let setpoints: Vec<f64> = levels.iter().flat_map(|level| [*level; 2000]).collect();
        let t_s: Vec<f64> = (0..setpoints.len()).map(|k| k as f64 * 1e-3).collect();
        let mut angle = 0.0;
        let theta = setpoints
            .iter()
            .map(|rate| {
                let here = angle;
                angle += rate * 1e-3;
                here
            })
            .collect();
        Log::new("x.csv", vec![column("t_s", t_s), column("rate_cmd_rad_s", setpoints), column("theta_rad", theta)], Vec::new()).unwrap()
    }

    #[test]
    fn plateaus_are_settled_whole_turns() {
        let found = plateaus(&log(&[0.0, 10.0, 1.0, -10.0]), "rate_cmd_rad_s", 0.5);
        assert_eq!(found.len(), 4);
        assert_eq!(found.iter().map(|p| p.turns).collect::<Vec<_>>(), [0, 2, 0, 2]);
        assert!((found[1].duration_s - 2.0 * TAU / 10.0).abs() <= 1e-3, "two turns, to a row");
        assert!(found.iter().all(|p| (p.rate_rad_s - p.setpoint).abs() < 1e-9));
        assert_eq!(found.iter().map(Plateau::direction).collect::<Vec<_>>(), [0.0, 1.0, -1.0, -1.0]);
        assert!(found[0].rows.start == 500 && found[2].rows.start == 4500);
        // The mean of a rate column is the rate of the plateau, whatever its shape: both are over the same shifts.
        let log = log(&[3.0, -7.0, 2.0]);
        let rate: Vec<f64> = log.column("theta_rad").unwrap().windows(2).map(|w| (w[1] - w[0]) / 1e-3).chain([2.0]).collect();
        for plateau in plateaus(&log, "rate_cmd_rad_s", 0.3) {
            assert!((plateau.mean(&rate) - plateau.rate_rad_s).abs() < 1e-9, "{plateau:?}");
        }
    }

    #[test]
    fn short_plateaus_are_ignored() {
        assert!(plateaus(&log(&[1.0, 2.0]), "rate_cmd_rad_s", 1.9).is_empty());
        assert!(plateaus(&log(&[1.0]), "i_A", 0.1).is_empty());
    }
}

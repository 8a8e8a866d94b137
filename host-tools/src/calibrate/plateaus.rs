//! Stretches of constant command, settled, cut to whole turns.
//!
//! Over whole turns what comes round with the angle (eccentricity of the encoder's disc, gravity on a tilted stand, cogging) has no mean; the
//! reference rate is the encoder's angle over the crystal's time.

use crate::log::Log;
use crate::statistics::Extremes;
use std::f64::consts::TAU;
use std::ops::Range;

/// Least duration of what is left of a plateau, s.
const LEAST_S: f64 = 0.2;
/// Most rows by which a plateau is shifted, and the least part of it that they are: the mean over all shifts, each of the same whole turns, has an
/// encoder's step divided by the square root of their number.
const SHIFTS: usize = 200;
const PART: usize = 10;

/// One plateau.
#[derive(Debug, Clone, PartialEq)]
pub struct Plateau {
    /// Rows over which is averaged; the row behind them is there too.
    pub rows: Range<usize>,
    /// So many times, each a row later.
    pub shifts: usize,
    /// What was asked for, in the command's unit.
    pub asked: f64,
    /// What was asked for before; `None` for the first.
    pub before: Option<f64>,
    /// Mean rate by the encoder, rad/s.
    pub rate_rad_s: f64,
    /// Its middle, s.
    pub mid_s: f64,
    /// Its duration, s.
    pub duration_s: f64,
    /// Whole turns that it was cut to; 0: it has none.
    pub turns: u32,
}

impl Plateau {
    /// Mean of a column over it.
    pub fn mean(&self, column: &[f64]) -> f64 {
        let Some(part) = column.get(self.rows.start..self.rows.end + self.shifts - 1) else { return f64::NAN };
        let n = self.rows.len();
        // A row is in as many of the shifted stretches as its place allows.
        let times = |k: usize| (k + 1).min(self.shifts).min(n).min(part.len() - k) as f64;
        part.iter().enumerate().map(|(k, value)| value * times(k)).sum::<f64>() / (n * self.shifts) as f64
    }

    /// Slope of a column over it, per second.
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

    /// It was come to from below (+1), from above (−1), or is the first (0).
    pub fn direction(&self) -> f64 {
        self.before.map_or(0.0, |before| if self.asked > before { 1.0 } else { -1.0 })
    }
}

/// The plateaus of a log by the column `command`; of each the first `settle_s` are left out. Gaps end a plateau.
pub fn plateaus(log: &Log, command: &str, settle_s: f64) -> Vec<Plateau> {
    let (Some(asked), Some(theta)) = (log.column(command), log.column("theta_rad")) else { return Vec::new() };
    let t_s = log.t_s();
    let (low, high) = asked.iter().copied().min_max();
    // What is asked for comes in single precision.
    let same = 1e-6 * low.abs().max(high.abs());
    let mut found: Vec<Plateau> = Vec::new();
    let mut before = None;
    for segment in log.segments() {
        let mut from = segment.start;
        while from < segment.end {
            let level = asked[from];
            let end = (from..segment.end).find(|k| (asked[*k] - level).abs() > same).unwrap_or(segment.end);
            let held = from..end;
            from = end;
            if t_s[end - 1] - t_s[held.start] < settle_s + LEAST_S {
                continue;
            }
            if let Some(plateau) = cut(t_s, theta, held, settle_s, level, before) {
                found.push(plateau);
            }
            before = Some(level);
        }
    }
    found
}

fn cut(t_s: &[f64], theta: &[f64], held: Range<usize>, settle_s: f64, asked: f64, before: Option<f64>) -> Option<Plateau> {
    let from = held.clone().find(|k| t_s[*k] - t_s[held.start] >= settle_s)?;
    let shifts = ((held.end - from) / PART).clamp(1, SHIFTS);
    let last = held.end - shifts;
    if last <= from {
        return None;
    }
    let went = (theta[last] - theta[from]).abs();
    let turns = (went / TAU).floor();
    let to = if turns >= 1.0 { (from..=last).find(|k| (theta[*k] - theta[from]).abs() >= turns * TAU).unwrap_or(last) } else { last };
    let duration_s = t_s[to] - t_s[from];
    let rate = |shift: usize| (theta[to + shift] - theta[from + shift]) / (t_s[to + shift] - t_s[from + shift]);
    (duration_s >= LEAST_S).then(|| Plateau {
        rows: from..to,
        shifts,
        asked,
        before,
        rate_rad_s: (0..shifts).map(rate).sum::<f64>() / shifts as f64,
        mid_s: 0.5 * (t_s[to] + t_s[from]),
        duration_s,
        turns: turns as u32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Column;

    fn log(levels: &[f64]) -> Log {
        let column = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
        let asked: Vec<f64> = levels.iter().flat_map(|level| [*level; 2000]).collect();
        let t_s: Vec<f64> = (0..asked.len()).map(|k| k as f64 * 1e-3).collect();
        let mut angle = 0.0;
        let theta = asked
            .iter()
            .map(|rate| {
                let here = angle;
                angle += rate * 1e-3;
                here
            })
            .collect();
        Log::new("x.csv", vec![column("t_s", t_s), column("rate_cmd_rad_s", asked), column("theta_rad", theta)], Vec::new()).unwrap()
    }

    #[test]
    fn they_are_settled_and_whole_turns() {
        let found = plateaus(&log(&[0.0, 10.0, 1.0, -10.0]), "rate_cmd_rad_s", 0.5);
        assert_eq!(found.len(), 4);
        assert_eq!(found.iter().map(|p| p.turns).collect::<Vec<_>>(), [0, 2, 0, 2]);
        assert!((found[1].duration_s - 2.0 * TAU / 10.0).abs() <= 1e-3, "two turns, to a row");
        assert!(found.iter().all(|p| (p.rate_rad_s - p.asked).abs() < 1e-9));
        assert_eq!(found.iter().map(Plateau::direction).collect::<Vec<_>>(), [0.0, 1.0, -1.0, -1.0]);
        assert!(found[0].rows.start == 500 && found[2].rows.start == 4500);
        // The mean of what is the rate is the rate, whatever shape it has: both are over the same shifts.
        let log = log(&[3.0, -7.0, 2.0]);
        let rate: Vec<f64> = log.column("theta_rad").unwrap().windows(2).map(|w| (w[1] - w[0]) / 1e-3).chain([2.0]).collect();
        for plateau in plateaus(&log, "rate_cmd_rad_s", 0.3) {
            assert!((plateau.mean(&rate) - plateau.rate_rad_s).abs() < 1e-9, "{plateau:?}");
        }
    }

    #[test]
    fn what_is_too_short_is_none() {
        assert!(plateaus(&log(&[1.0, 2.0]), "rate_cmd_rad_s", 1.9).is_empty());
        assert!(plateaus(&log(&[1.0]), "i_A", 0.1).is_empty());
    }
}

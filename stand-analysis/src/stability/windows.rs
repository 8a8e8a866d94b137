//! Mean rates over windows of a plateau, and their scatter.
//!
//! Input: the angle at the rows. Output: for each width the relative standard deviation of the mean rates over consecutive windows. The
//! time at which the angle passes the end of a window is interpolated between rows. Windows cover whole turns where the plateau has one, so
//! that a pattern that repeats with the angle enters with its whole period; the scatter of the variances from turn to turn gives the
//! uncertainty, for less than two turns the number of windows. Whole turns are those of `turn_s`: index to index, timed by the crystal.
//!
//! Resolution: both ends of a window have the standard deviation LSB/√12 of a quantised angle: LSB/√6 over the width, relative.

use super::PlateauStability;
use super::plateaus::Plateau;
use identification::log::Log;
use identification::statistics::uncertainty::{Contribution, Estimate, Quantity, Uncertainty, u_of_standard_deviation};
use stand_acquire::calibration_session::Assumptions;
use std::f64::consts::TAU;

/// Widths by the encoder, degrees.
const WIDTHS_DEG: [f64; 3] = [1.0, 10.0, 360.0];
/// Standard deviation, relative to the resolution, from which it is that of the rate.
const MIN_RESOLVED: f64 = 1.5;

/// Width of a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Width {
    /// Degrees, by the encoder.
    Degrees(f64),
    /// A whole turn, from index to index.
    Turn,
}

/// Comparison with the limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Below the limit with its uncertainty.
    Within,
    /// Above the limit with its uncertainty.
    Exceeds,
    /// The limit lies within the uncertainty, or below the resolution.
    Undecided,
}

/// Scatter over windows of one width.
#[derive(Debug, Clone, PartialEq)]
pub struct WidthResult {
    /// The width.
    pub width: Width,
    /// Standard deviation of the rates, relative to their mean.
    pub sigma: Estimate,
    /// Standard deviation by the resolution of the encoder, relative; 0 for whole turns.
    pub resolution: f64,
    /// Begin of each window, s, and its relative deviation from the mean rate.
    pub deviations: Vec<(f64, f64)>,
    /// Comparison with the limit, where one is given.
    pub verdict: Option<Verdict>,
}

impl WidthResult {
    /// The scatter exceeds the resolution.
    pub fn is_resolved(&self) -> bool {
        self.sigma.value > MIN_RESOLVED * self.resolution
    }
}

/// Evaluates a plateau; `None` if it contains fewer than two windows of 1°.
pub(super) fn evaluate(log: &Log, theta_rad: &[f64], plateau: &Plateau, limit: Option<f64>) -> Option<PlateauStability> {
    let t_s = log.t_s();
    let rows = plateau.rows.clone();
    let turned = theta_rad[rows.end - 1] - theta_rad[rows.start];
    let direction = turned.signum();
    let turns = (turned.abs() / TAU).floor() as usize;
    // Whole turns where there is one.
    let span_deg = if turns > 0 { 360.0 * turns as f64 } else { turned.abs().to_degrees() };
    let angle_deg = |k: usize| (direction * (theta_rad[k] - theta_rad[rows.start])).to_degrees();
    let passes = |width_deg: f64| {
        let count = (span_deg / width_deg + 1e-9).floor() as usize;
        let mut row = rows.start;
        let mut times = vec![t_s[rows.start]];
        for window in 1..=count {
            let end_deg = window as f64 * width_deg;
            while row + 1 < rows.end && angle_deg(row + 1) < end_deg {
                row += 1;
            }
            if row + 1 >= rows.end {
                break;
            }
            let (before, after) = (angle_deg(row), angle_deg(row + 1));
            let share = if after > before { ((end_deg - before) / (after - before)).clamp(0.0, 1.0) } else { 0.0 };
            times.push(t_s[row] + share * (t_s[row + 1] - t_s[row]));
        }
        times
    };
    let end_s = *passes(span_deg).last()?;
    let duration_s = end_s - t_s[rows.start];
    if duration_s.is_nan() || duration_s <= 0.0 {
        return None;
    }
    let mean_rad_s = span_deg.to_radians() / duration_s;
    let lsb_deg = log.notes().number("theta_lsb_rad").map_or(0.0, f64::to_degrees);
    let mut widths = Vec::new();
    for width_deg in WIDTHS_DEG {
        let times = passes(width_deg);
        let rates = times.windows(2).map(|w| (w[0], width_deg.to_radians() / (w[1] - w[0])));
        let deviations: Vec<(f64, f64)> = rates.map(|(start_s, rate)| (start_s, rate / mean_rad_s - 1.0)).collect();
        let per_turn = (turns > 1).then_some((360.0 / width_deg).round() as usize);
        let resolution = lsb_deg / 6_f64.sqrt() / width_deg;
        widths.extend(scatter(Width::Degrees(width_deg), deviations, per_turn, resolution, limit));
    }
    if widths.is_empty() {
        return None;
    }
    let whole = whole_turns(log, plateau);
    let mut mean = mean_rad_s;
    if whole.len() > 1 {
        let total: f64 = whole.iter().map(|(_, seconds)| seconds).sum();
        mean = TAU * whole.len() as f64 / total;
        let deviations = whole.iter().map(|(end_s, seconds)| (end_s - seconds, TAU / seconds / mean - 1.0)).collect();
        widths.extend(scatter(Width::Turn, deviations, None, 0.0, limit));
    }
    // Scatter of the mean: of whole turns, else of the widest windows.
    let widest = widths.last()?;
    let count = widest.deviations.len() as f64;
    let contributions = vec![
        Contribution::type_a("", widest.sigma.value / count.sqrt(), count - 1.0, ()),
        Contribution::rectangular("", Assumptions::default().crystal_ppm * 1e-6, "", 1.0, ()),
        Contribution::rectangular("", if whole.len() > 1 { 0.0 } else { lsb_deg / span_deg }, "", 1.0, ()),
    ];
    let relative = Quantity::<(), ()>::new("mean rate", "1", 1.0, contributions).estimate();
    Some(PlateauStability {
        start_s: t_s[rows.start],
        duration_s,
        turns,
        command_rad_s: plateau.command_rad_s,
        mean_rad_s: relative.scaled(direction * mean),
        widths,
    })
}

/// Scatter of the windows; `None` for fewer than two.
fn scatter(width: Width, deviations: Vec<(f64, f64)>, per_turn: Option<usize>, resolution: f64, limit: Option<f64>) -> Option<WidthResult> {
    let count = deviations.len() as f64;
    if deviations.len() < 2 {
        return None;
    }
    let mean = deviations.iter().map(|(_, d)| d).sum::<f64>() / count;
    let squares: Vec<f64> = deviations.iter().map(|(_, d)| (d - mean).powi(2)).collect();
    let variance = squares.iter().sum::<f64>() / (count - 1.0);
    let sigma = variance.sqrt();
    let turns: Vec<f64> = match per_turn {
        Some(windows) if windows > 1 => squares.chunks_exact(windows).map(|turn| turn.iter().sum::<f64>() / windows as f64).collect(),
        _ => Vec::new(),
    };
    let uncertainty = if turns.len() > 1 {
        let n = turns.len() as f64;
        let middle = turns.iter().sum::<f64>() / n;
        let spread = (turns.iter().map(|v| (v - middle).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        Uncertainty::student(if sigma > 0.0 { spread / (2.0 * sigma) } else { 0.0 }, n - 1.0)
    } else {
        Uncertainty::student(u_of_standard_deviation(sigma, count - 1.0), count - 1.0)
    };
    let found =
        WidthResult { width, sigma: Estimate { value: sigma, uncertainty: Some(uncertainty) }, resolution, deviations, verdict: None };
    let verdict = limit.map(|limit| match () {
        () if sigma + uncertainty.expanded() <= limit => Verdict::Within,
        () if !found.is_resolved() || sigma - uncertainty.expanded() <= limit => Verdict::Undecided,
        () => Verdict::Exceeds,
    });
    Some(WidthResult { verdict, ..found })
}

/// End, s, and duration, s, of each whole turn within the plateau, from the column `turn_s`.
fn whole_turns(log: &Log, plateau: &Plateau) -> Vec<(f64, f64)> {
    let Some(turn_s) = log.column("turn_s") else { return Vec::new() };
    let t_s = log.t_s();
    let begin_s = t_s[plateau.rows.start];
    let mut found = Vec::new();
    for k in plateau.rows.clone().skip(1) {
        let seconds = turn_s[k];
        // A new value, of a turn that began within the plateau.
        if seconds > 0.0 && seconds != turn_s[k - 1] && t_s[k] - seconds >= begin_s {
            found.push((t_s[k], seconds));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::{StabilitySettings, of_log};
    use identification::log::Column;

    /// Ten turns at 1 rad/s with a ripple of 0.5 % of the rate in order 9.
    fn log(depth: f64) -> Log {
        let step_s = 1e-3;
        let rows = (10.2 * TAU / step_s) as usize;
        let t_s: Vec<f64> = (0..rows).map(|k| k as f64 * step_s).collect();
        let theta: Vec<f64> = t_s.iter().map(|t| t + depth / 9.0 * (9.0 * t).sin()).collect();
        let columns = [("t_s", t_s), ("theta_rad", theta)].map(|(name, values)| Column { name: name.to_owned(), values });
        Log::new("log.csv", columns.into(), Vec::new()).unwrap()
    }

    /// Windows of width w keep sin(x)/x of the ripple, x = 9 w/2; a whole turn keeps nothing.
    #[test]
    fn ripple_is_averaged_over_the_window() {
        let depth = 5e-3;
        let found = of_log(&log(depth), StabilitySettings { settle_s: 0.0, limit: Some(4e-3) }).unwrap();
        let [plateau] = found.as_slice() else { panic!("{found:?}") };
        let kept = |width_deg: f64| {
            let x = 4.5 * width_deg.to_radians();
            depth / 2_f64.sqrt() * x.sin() / x
        };
        for (width, expected) in plateau.widths.iter().zip([kept(1.0), kept(10.0), 0.0]) {
            assert!((width.sigma.value - expected).abs() < 0.01 * expected + 1e-6, "{:?} {} {expected}", width.width, width.sigma.value);
        }
        // 0.354 % at 1°, 0.319 % at 10°.
        assert_eq!(plateau.widths.iter().map(|w| w.verdict).collect::<Vec<_>>(), [Some(Verdict::Within); 3]);
        assert!(plateau.mean_rad_s.covers(1.0) && plateau.turns == 10, "{:?}", plateau.mean_rad_s);
    }

    #[test]
    fn limit_is_exceeded_or_undecided() {
        let with = |limit: f64| {
            let found = of_log(&log(5e-3), StabilitySettings { settle_s: 0.0, limit: Some(limit) }).unwrap();
            found[0].widths[0].verdict
        };
        assert_eq!((with(3e-3), with(4e-3)), (Some(Verdict::Exceeds), Some(Verdict::Within)));
        assert!(matches!(
            of_log(&log(0.0), StabilitySettings { settle_s: -1.0, limit: None }),
            Err(crate::stability::StabilityError::Settle(_))
        ));
    }
}

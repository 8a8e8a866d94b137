//! Lines of a series over a phase (angle, or 2π × time) that are no whole parts of a turn: its Fourier transform at all orders up to a
//! highest one.
//!
//! Each value is shared between the two nearest bins of the phase, and the sums of the bins are transformed. With one bin for each value,
//! rows that beat with the bins would leave images of a strong line at other orders. Over the time the rows are even; the spacing of rows
//! and bins has a whole ratio there, which leaves no images.

use std::borrow::Cow;
use std::f64::consts::TAU;

use realfft::num_complex::Complex;

use crate::recording::PreparedLog;
use crate::statistics::Extremes;
use crate::statistics::fourier::transform;

/// Bins per period of the highest order: sharing a value by two bins takes 5 % of its amplitude there.
const BINS_PER_PERIOD: f64 = 8.0;
/// Zero-padding: a line is at most an eighth of its width from a value that is tried.
const PADDING: usize = 4;
/// Largest number of bins; it limits the highest order on a log of many turns.
const MAX_BINS: f64 = 524_288.0;

/// A phase in each row.
pub struct Phase<'p> {
    /// Its values, rad.
    pub rad: Cow<'p, [f64]>,
    /// Rows per turn, where the rows are even in the phase.
    rows_per_turn: Option<f64>,
}

impl<'p> Phase<'p> {
    /// An angle, rad.
    pub fn of_angle(theta_rad: &'p [f64]) -> Self {
        Phase { rad: theta_rad.into(), rows_per_turn: None }
    }
}

impl Phase<'static> {
    /// 2π × time from the begin of each log: an order is a frequency in Hz.
    pub fn of_time(data: &PreparedLog) -> Self {
        let rad = data.t_s.iter().enumerate().map(|(row, t)| TAU * (t - data.run_start_s(row)));
        Phase { rad: rad.collect(), rows_per_turn: Some(1.0 / data.dt_s) }
    }
}

/// The lines of a series.
pub struct PhaseLines {
    /// Σ value e^{i order phase} by line, up to a factor of modulus one.
    pub transform: Vec<Complex<f64>>,
    lowest: f64,
    highest: f64,
    orders_per_line: f64,
    /// Turns of the phase.
    turns: f64,
}

impl PhaseLines {
    /// Lines of the `values` over the `phase`, from `min_periods` periods in all up to the order `highest`, in periods per turn; `None`
    /// where no order is between these limits. Rows whose phase or value is not finite are ignored.
    pub fn of(phase: &Phase, values: &[f64], min_periods: f64, highest: f64) -> Option<Self> {
        let (from, to) = phase.rad.iter().copied().min_max();
        let turns = (to - from) / TAU;
        if turns.is_nan() || turns <= 0.0 {
            return None;
        }
        let (lowest, highest) = (min_periods / turns, highest.min(MAX_BINS / (turns * BINS_PER_PERIOD)));
        if highest.is_nan() || highest <= lowest {
            return None;
        }
        let needed = highest * BINS_PER_PERIOD;
        let bins_per_turn = match phase.rows_per_turn {
            Some(rows) if rows > needed => rows / (rows / needed).floor(),
            Some(rows) => rows * (needed / rows).ceil(),
            None => needed,
        };
        let mut sums = vec![0.0; (PADDING * (turns * bins_per_turn).ceil() as usize).next_power_of_two().max(2)];
        for (phase, value) in phase.rad.iter().zip(values) {
            let position = (phase - from) / TAU * bins_per_turn;
            if !(position.is_finite() && value.is_finite()) {
                continue;
            }
            let part = position.fract();
            for (bin, part) in [(position as usize, 1.0 - part), (position as usize + 1, part)] {
                if let Some(sum) = sums.get_mut(bin) {
                    *sum += part * value;
                }
            }
        }
        let orders_per_line = bins_per_turn / sums.len() as f64;
        Some(PhaseLines { transform: transform(sums), lowest, highest, orders_per_line, turns })
    }

    /// Order of a line, periods per turn.
    pub fn order(&self, line: usize) -> f64 {
        line as f64 * self.orders_per_line
    }

    /// The least and the highest order.
    pub fn range(&self) -> (f64, f64) {
        (self.lowest, self.highest)
    }

    /// Number of orders that the phase distinguishes.
    pub fn distinguishable(&self) -> usize {
        ((self.highest - self.lowest) * self.turns) as usize
    }

    /// Orders of the `count` highest peaks of a `power` by line, without those `known`; the peaks are ranked by their `score`.
    pub fn best(&self, power: &[f64], score: impl Fn(usize) -> f64, known: &[f64], count: usize) -> Vec<f64> {
        let inside = |k: &usize| (self.lowest..=self.highest).contains(&self.order(*k));
        let is_peak = |k: &usize| power[*k] > power[*k - 1] && power[*k] >= power[*k + 1];
        let peaks = (1..power.len().saturating_sub(1)).filter(inside).filter(is_peak);
        let mut peaks: Vec<(f64, f64)> = peaks.map(|k| (self.order(k), score(k))).collect();
        peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut found: Vec<f64> = Vec::new();
        for (order, _) in peaks {
            // One period more or less in all is the same line.
            if found.len() < count && known.iter().chain(&found).all(|other| (other - order).abs() * self.turns > 1.0) {
                found.push(order);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 200 rows per second, 20 s.
    fn phase(rows_per_turn: Option<f64>) -> Phase<'static> {
        Phase { rad: (0..4000).map(|k| TAU * k as f64 / 200.0).collect(), rows_per_turn }
    }

    #[test]
    fn strong_line_leaves_no_images() {
        // Three rows for each bin.
        let at_1_kHz = Phase { rad: (0..20_000).map(|k| TAU * f64::from(k) / 1000.0).collect(), rows_per_turn: Some(1000.0) };
        // The side lobes of a line at 0.3 Hz in 20 s are below 1/(π · 20 s · 35 Hz) there. With 320 bins per second the 15th multiple of 40
        // Hz is shared with sinc² 1.875.
        for (phase, limit) in [(phase(Some(200.0)), 1e-3), (at_1_kHz, 1e-3), (phase(None), 1e-2)] {
            let values: Vec<f64> = phase.rad.iter().map(|p| (0.3 * p).sin()).collect();
            let lines = PhaseLines::of(&phase, &values, 2.0, 40.0).unwrap();
            let largest = |from: f64, to: f64| {
                let inside = (0..lines.transform.len()).filter(|k| (from..to).contains(&lines.order(*k)));
                inside.map(|k| lines.transform[k].norm()).max_or_zero()
            };
            assert!(largest(35.0, 40.0) < limit * largest(0.1, 0.5), "{}", largest(35.0, 40.0) / largest(0.1, 0.5));
        }
    }

    #[test]
    fn best_lines_are_found_but_for_the_known_ones() {
        let phase = phase(None);
        let mut values: Vec<f64> = phase.rad.iter().map(|p| (3.137 * p).sin() + 0.5 * (17.61 * p).cos()).collect();
        values[100] = f64::NAN;
        let lines = PhaseLines::of(&phase, &values, 2.0, 40.0).unwrap();
        let power: Vec<f64> = lines.transform.iter().map(|z| z.norm_sqr()).collect();
        let best = |known: &[f64]| lines.best(&power, |k| power[k], known, 1)[0];
        assert!((best(&[]) - 3.137).abs() < 0.01, "{}", best(&[]));
        assert!((best(&[3.137]) - 17.61).abs() < 0.01, "{}", best(&[3.137]));
        assert_eq!(lines.distinguishable(), 797);
    }

    #[test]
    fn no_lines_where_the_phase_stands_still() {
        assert!(PhaseLines::of(&Phase::of_angle(&[1.0; 10]), &[1.0; 10], 2.0, 40.0).is_none());
        assert!(PhaseLines::of(&Phase::of_angle(&[]), &[], 2.0, 40.0).is_none());
    }
}

//! Search for periods of a torque that are no whole parts of a turn: over the angle or over time, in one transform.
//!
//! A torque e^{iρφ} with the phase φ (angle, or 2π × time) is correlated with the residual by the adjoint of the recursion of [`Scan`]: the
//! sensitivities g of the weighted residuals to a torque in each row are computed once, backwards, and Σ g e^{iρφ} follows for all ρ by a
//! Fourier transform ([`super::phase_lines`]). The power of the response is that of a constant local frequency in each row. As for whole
//! orders the score only ranks.

use drive_model::{PeriodOf, Screening};
use realfft::num_complex::Complex;

use super::phase_lines::{Phase, PhaseLines};
use super::{Scan, ScannedQuantity, angle};
use crate::identify::explain::criteria::HarmonicCriteria;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::stiffness::shaft_resonances_Hz;
use crate::model::Input;
use crate::statistics::robust::median;

/// Periods that are worth an exact screening, the best first.
#[derive(Debug, Clone, Default)]
pub struct Periods {
    /// Numbers of periods per turn.
    per_turn: Vec<f64>,
    /// Frequencies, Hz.
    frequencies_Hz: Vec<f64>,
    /// Number of distinguishable periods among which these were chosen.
    pub tested: usize,
}

impl Periods {
    /// These numbers of periods per turn and frequencies.
    pub fn new(per_turn: Vec<f64>, frequencies_Hz: Vec<f64>, tested: usize) -> Self {
        Periods { per_turn, frequencies_Hz, tested }
    }

    /// The periods of one kind.
    pub fn of(&self, period: PeriodOf) -> &[f64] {
        match period {
            PeriodOf::Angle => &self.per_turn,
            PeriodOf::Time => &self.frequencies_Hz,
        }
    }
}

/// The best periods that neither the model nor the excitation has.
pub fn search_periods(base: &FittedModel) -> Periods {
    let (data, criteria) = (&base.data, &base.context.criteria.harmonics);
    let mut periods = Periods::default();
    if data.driven == Input::Motion {
        return periods;
    }
    if let Some(theta) = angle(data) {
        let (phase, scan) = (Phase::of_angle(theta), Scan::new(base, theta));
        let highest = scan.highest_order(criteria) as f64;
        (periods.per_turn, periods.tested) = scan.best_periods(&phase, highest, &known(base, PeriodOf::Angle), criteria);
    }
    let phase = Phase::of_time(data);
    let highest_Hz = criteria.max_frequency_Hz.min(criteria.max_frequency_per_row / data.dt_s);
    let mut taken = known(base, PeriodOf::Time);
    taken.extend(excitation_lines(base, &phase, highest_Hz));
    taken.extend(resonance_lines(base));
    let (found, tested) = Scan::new(base, &phase.rad).best_periods(&phase, highest_Hz, &taken, criteria);
    periods.frequencies_Hz = found;
    periods.tested += tested;
    periods
}

/// Commands of a loop: what they contain was asked for. The voltage of a loop also has what the loop answers to a torque.
const COMMANDS: [&str; 2] = ["rate_cmd_rad_s", "theta_cmd_rad"];
/// Power of a line over the median around it, from which on it is a line. In noise or a continuous spectrum such a ratio does not occur; the
/// leakage of a line by the ends of the log is about a six-hundredth.
const MIN_LINE_RATIO: f64 = 100.0;
/// Lines of the transform on each side for that median.
const LINE_NEIGHBOURS: usize = 64;
/// Lines of a voltage from which on it is a periodic excitation: one or two may be what a loop answers to a periodic torque.
const MIN_VOLTAGE_LINES: usize = 3;

/// Frequencies of a periodic excitation, Hz. What the model leaves there is the excitation's: its course within the rows, a delay. A torque
/// of just this frequency cannot be told from it.
fn excitation_lines(base: &FittedModel, phase: &Phase, highest_Hz: f64) -> Vec<f64> {
    let varies = |column: &&[f64]| column.windows(2).any(|w| w[0] != w[1]);
    let command = COMMANDS.into_iter().filter_map(|name| base.context.log.column(name)).find(varies);
    let excitation = command.unwrap_or(&base.data.input);
    let mean = excitation.iter().sum::<f64>() / excitation.len().max(1) as f64;
    let centred: Vec<f64> = excitation.iter().map(|v| v - mean).collect();
    let Some(lines) = PhaseLines::of(phase, &centred, base.context.criteria.harmonics.min_periods_in_log, highest_Hz) else {
        return Vec::new();
    };
    let power: Vec<f64> = lines.transform.iter().map(|sum| sum.norm_sqr()).collect();
    let is_line = |k: &usize| {
        let around = &power[k.saturating_sub(LINE_NEIGHBOURS)..(k + LINE_NEIGHBOURS + 1).min(power.len())];
        let is_peak = power[*k] > power[k - 1] && power[*k] >= power[k + 1];
        is_peak && power[*k] > MIN_LINE_RATIO * median(around.iter().copied()).unwrap_or(f64::INFINITY)
    };
    let found: Vec<f64> = (1..power.len().saturating_sub(1)).filter(is_line).map(|k| lines.order(k)).collect();
    if command.is_some() || found.len() >= MIN_VOLTAGE_LINES { found } else { Vec::new() }
}

/// Frequencies at which a shaft of the model resonates, a line of the log apart, Hz. Every small error of the model excites the resonance, so
/// that a torque of that frequency cannot be told from one.
fn resonance_lines(base: &FittedModel) -> Vec<f64> {
    let (from_s, to_s) = base.data.time_range_s();
    let line_Hz = 1.0 / (to_s - from_s).max(base.data.dt_s);
    let lines = |(from_Hz, to_Hz): (f64, f64)| {
        let count = ((to_Hz - from_Hz) / line_Hz).ceil().min(MAX_RESONANCE_LINES) as usize;
        (0..=count).map(move |k| from_Hz + (to_Hz - from_Hz) * k as f64 / count.max(1) as f64)
    };
    shaft_resonances_Hz(&base.model).into_iter().flat_map(lines).collect()
}

/// Lines of a resonance at most.
const MAX_RESONANCE_LINES: f64 = 10_000.0;

/// The periods that the model has.
pub fn known(base: &FittedModel, of: PeriodOf) -> Vec<f64> {
    let uses = base.model.effects().iter().filter(|e| e.card.screening == Screening::Periodicities(of));
    let periods = uses.filter_map(|e| e.parameters.get(e.card.periodicity_index()?));
    periods.map(|&k| base.model.parameters()[k].value).collect()
}

impl Scan<'_> {
    /// The best orders over the `phase` of the rows up to `highest`, without those `known`, and the number of distinguishable orders.
    fn best_periods(&self, phase: &Phase, highest: f64, known: &[f64], criteria: &HarmonicCriteria) -> (Vec<f64>, usize) {
        let lines = PhaseLines::of(phase, &self.sensitivities(ScannedQuantity::Torque), criteria.min_periods_in_log, highest);
        let Some(lines) = lines else { return (Vec::new(), 0) };
        let (lowest, highest) = lines.range();
        let power = self.response_power(ScannedQuantity::Torque, lowest, highest);
        let score = |line: usize, sum: &Complex<f64>| {
            let order = lines.order(line);
            if (lowest..=highest).contains(&order) { sum.norm_sqr() / power.at(order) } else { 0.0 }
        };
        let scores: Vec<f64> = lines.transform.iter().enumerate().map(|(line, sum)| score(line, sum)).collect();
        (lines.best(&scores, |line| scores[line], known, criteria.periods), lines.distinguishable())
    }

    /// Sensitivity of the sum of weighted residuals to the quantity in each row, by the adjoint of the recursion of [`Scan::scores`].
    pub(super) fn sensitivities(&self, quantity: ScannedQuantity) -> Vec<f64> {
        let mut sensitivities = vec![0.0; self.rows.len()];
        for rows in self.segments {
            let segment = &self.rows[rows.clone()];
            let angle = |k: usize| segment.get(k).filter(|_| k >= self.lag).map_or(0.0, |row| row.residuals.2);
            // Sensitivities to the sum of the rate and to the rate, after the row.
            let (mut to_sum, mut to_rate) = (0.0, 0.0);
            for (k, row) in segment.iter().enumerate().rev() {
                let (torque, at_once) = self.acts(row, quantity);
                sensitivities[rows.start + k] = at_once * row.residuals.1 + self.rate_per_torque * torque * to_rate;
                to_rate = row.residuals.0 + self.current_per_rate * row.residuals.1 + self.decay * to_rate + self.dt_s * to_sum;
                to_sum += angle(k) - angle(k + self.lag);
            }
        }
        sensitivities
    }

    /// Power of the weighted response to the quantity with unit amplitude, over the order.
    pub(super) fn response_power(&self, quantity: ScannedQuantity, lowest: f64, highest: f64) -> Power {
        let stride = (self.rows.len() / POWER_ROWS).max(1);
        let rows: Vec<&super::ScanRow> = self.rows.iter().step_by(stride).filter(|row| row.fitted).collect();
        let step = (highest / lowest).ln() / (POWER_ORDERS - 1) as f64;
        let window_s = self.lag as f64 * self.dt_s;
        let of_order = |order: f64| -> f64 {
            let of_row = |row: &&super::ScanRow| {
                let w = order * row.motion.0.abs();
                let (sin, cos) = (w * self.dt_s).sin_cos();
                // Response of the rate: gain / (e^{iωΔt} − decay).
                let (re, im) = (cos - self.decay, sin);
                let square = (re * re + im * im).max(1e-30);
                let (torque, at_once) = self.acts(row, quantity);
                let gain = self.rate_per_torque * torque / square;
                let (rate_re, rate_im) = (gain * re, -gain * im);
                let rate = rate_re * rate_re + rate_im * rate_im;
                let drive = (self.current_per_rate * rate_re + at_once).powi(2) + (self.current_per_rate * rate_im).powi(2);
                let increment_s = if w * window_s > 1e-6 { 2.0 * (0.5 * w * window_s).sin() / w } else { window_s };
                self.weights.0 * rate + self.weights.1 * drive + self.weights.2 * rate * increment_s * increment_s
            };
            rows.iter().map(of_row).sum::<f64>() * stride as f64
        };
        let ln = (0..POWER_ORDERS).map(|k| of_order(lowest * (step * k as f64).exp()).max(f64::MIN_POSITIVE).ln()).collect();
        Power { lowest, step, ln }
    }
}

/// Rows and orders by which the power of the response is computed.
const POWER_ROWS: usize = 2000;
const POWER_ORDERS: usize = 48;

/// A power over the order, interpolated in its logarithm.
pub(super) struct Power {
    lowest: f64,
    step: f64,
    ln: Vec<f64>,
}

impl Power {
    pub(super) fn at(&self, order: f64) -> f64 {
        let position = ((order / self.lowest).ln() / self.step).clamp(0.0, (self.ln.len() - 1) as f64);
        let k = (position as usize).min(self.ln.len().saturating_sub(2));
        let part = position - k as f64;
        (self.ln[k] + (self.ln[k + 1] - self.ln[k]) * part).exp()
    }
}

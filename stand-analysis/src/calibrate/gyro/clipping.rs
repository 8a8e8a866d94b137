//! Clipped outputs: a converter at its limit shows one constant value (a flat top) while the rate goes on.
//!
//! A step is clipped if its output stays at the extreme of the session for [`MIN_FLAT_ROWS`] rows in succession, and either the rate of the
//! platform varies meanwhile by more than the output resolves, or the output, which is noisy elsewhere, never repeats a value for a
//! comparable time. Clipped steps give wrong numbers with a small uncertainty, so they are left out as a whole.

use super::{GyroSettings, dut_output};
use crate::calibrate::{Remark, Step};
use identification::statistics::{Extremes, least_squares};

/// Fewest rows in succession at the extreme.
const MIN_FLAT_ROWS: usize = 20;
/// Run at the extreme over the longest run of one value elsewhere.
const MIN_RUN_RATIO: usize = 4;
/// Change of the expected output during a flat top, in standard deviations of the output about a straight line over the rate.
const MIN_CHANGE_SIGMAS: f64 = 6.0;
/// Relative tolerance of the extreme: logs have single precision, and both ends of a converter differ by one code.
const TOLERANCE: f64 = 1e-4;
/// Rows before and after a row over which the rate is the slope of the angle.
const HALF_WINDOW: usize = 10;
/// Every how many rows the straight line is fitted.
const STRIDE: usize = 16;

/// Splits the steps into those that can be used and the remarks on the clipped ones.
pub(super) fn without_clipped<'s>(steps: &[&'s Step], settings: &GyroSettings) -> (Vec<&'s Step>, Vec<Remark>) {
    let outputs = |step: &&'s Step| dut_output(&step.log, settings).into_iter().flatten().copied().min_max();
    let (low, high) = steps.iter().map(outputs).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (a, b)| (l.min(a), h.max(b)));
    let (mut used, mut remarks) = (Vec::new(), Vec::new());
    for step in steps {
        let flat = dut_output(&step.log, settings)
            .and_then(|output| [high, low].into_iter().find_map(|limit| flat_top(step, output, limit, [low, high])));
        match flat {
            Some((limit_rad_s, rows)) => remarks.push(Remark::Clipped { step: step.name.clone(), limit_rad_s, rows }),
            None => used.push(*step),
        }
    }
    (used, remarks)
}

/// Limit and number of rows of a flat top at `limit`, one of the extremes of the session.
fn flat_top(step: &Step, output: &[f64], limit: f64, extremes: [f64; 2]) -> Option<(f64, usize)> {
    let is_at = |value: f64, extreme: f64| (value - extreme).abs() <= TOLERANCE * extreme.abs();
    let is_flat: Vec<bool> = output.iter().map(|y| is_at(*y, limit)).collect();
    let at_limit: Vec<usize> = (0..output.len()).filter(|k| is_flat[*k]).collect();
    let longest_flat = longest_run(output, |k| is_flat[k]);
    if limit == 0.0 || longest_flat < MIN_FLAT_ROWS || at_limit.len() == output.len() {
        return None;
    }
    // A step that is clipped in both directions has equally long runs at both ends.
    let longest_elsewhere = longest_run(output, |k| !extremes.iter().any(|extreme| is_at(output[k], *extreme)));
    let is_silent = longest_flat > MIN_RUN_RATIO * longest_elsewhere.max(1);
    (is_silent || rate_goes_on(step, output, &is_flat)).then_some((limit, at_limit.len()))
}

/// Longest run of one value among the rows that are selected.
fn longest_run(output: &[f64], is_selected: impl Fn(usize) -> bool) -> usize {
    let (mut longest, mut run, mut last) = (0, 0, f64::NAN);
    for (k, value) in output.iter().enumerate() {
        if !is_selected(k) {
            (run, last) = (0, f64::NAN);
            continue;
        }
        run = if (value - last).abs() <= f64::EPSILON * value.abs() { run + 1 } else { 1 };
        last = *value;
        longest = longest.max(run);
    }
    longest
}

/// The output that the rates of the flat top predict varies by more than the output scatters.
fn rate_goes_on(step: &Step, output: &[f64], is_flat: &[bool]) -> bool {
    let Some(theta) = step.log.column("theta_rad") else { return false };
    let t_s = step.log.t_s();
    let rate = |k: usize| (theta[k + HALF_WINDOW] - theta[k - HALF_WINDOW]) / (t_s[k + HALF_WINDOW] - t_s[k - HALF_WINDOW]);
    let inner = HALF_WINDOW..output.len().saturating_sub(HALF_WINDOW);
    let free: Vec<usize> = inner.clone().step_by(STRIDE).filter(|k| !is_flat[*k]).collect();
    let rows: Vec<Vec<f64>> = free.iter().map(|k| vec![1.0, rate(*k)]).collect();
    let y: Vec<f64> = free.iter().map(|k| output[*k]).collect();
    let Some(line) = least_squares(&rows, &y) else { return false };
    // The middle 90 % of the rates: the edges of a flat top belong to both sides.
    let mut predicted: Vec<f64> = inner.filter(|k| is_flat[*k]).map(|k| line.coefficients[1] * rate(k)).collect();
    if predicted.len() < MIN_FLAT_ROWS {
        return false;
    }
    predicted.sort_by(f64::total_cmp);
    let at = |part: f64| predicted[((predicted.len() - 1) as f64 * part) as usize];
    at(0.95) - at(0.05) > MIN_CHANGE_SIGMAS * line.residual_sd.max(TOLERANCE * at(0.5).abs())
}

//! Outliers of the measured channels: single readings that neither a motion nor usual noise explains.
//!
//! A row is an outlier if its residual differs from each of its two neighbours on either side, in the same direction, by more than
//! [`MIN_SIGMAS`] standard deviations of the noise. What a model lacks changes over several rows; a step differs from one side only. Rows
//! near a jump of the input are never outliers: fast dynamics that a model lacks may last one row there. Neither is a current that differs
//! by no more than the change of the voltage beside it can make. An outlier has the weight zero (a redescending M-estimator: Hampel et al.,
//! Robust Statistics, 1986, section 2.6), in every model that is compared on the log.

use crate::model::{Channel, Input};
use crate::recording::prepared_log::{ComparedChannel, PreparedLog};
use crate::statistics::Extremes;

/// Distance from all neighbours, standard deviations of the noise. Of normal noise a difference of 8 σ, √2 σ in size, occurs once in 10⁸
/// pairs; four of them in one row hardly ever.
pub const MIN_SIGMAS: f64 = 8.0;
/// Fraction of a channel's rows above which isolated values are a property of the channel and not outliers.
const MAX_FRACTION: f64 = 0.02;
/// Change of the input from row to row, part of its range, that is a jump.
const JUMP_FRACTION: f64 = 0.05;
/// Rows before and after a jump of the input in which there are no outliers.
const ROWS_AROUND_JUMP: (usize, usize) = (2, 6);

/// Outliers of each channel, from its residuals and the standard deviation of its noise.
pub fn find(data: &PreparedLog, residuals: &[&[f64]], noise: &[f64]) -> Vec<Vec<usize>> {
    let near_jump = near_jumps(data);
    residuals.iter().zip(noise).enumerate().map(|(c, (residual, sigma))| of_channel(data, c, residual, *sigma, &near_jump)).collect()
}

fn of_channel(data: &PreparedLog, channel: usize, residual: &[f64], sigma: f64, near_jump: &[bool]) -> Vec<usize> {
    let quantum = data.channels[channel].quantum.unwrap_or(0.0);
    let by_input = current_by_voltage_step(data, channel);
    // A coarse channel jumps by whole counts.
    let limit = (MIN_SIGMAS * sigma).max(4.0 * quantum);
    let mut found = Vec::new();
    for rows in data.segments.iter().filter(|rows| rows.len() > 4) {
        for row in rows.start + 2..rows.end - 2 {
            if near_jump[row] || !residual[row].is_finite() {
                continue;
            }
            let differences = [row - 2, row - 1, row + 1, row + 2].map(|other| residual[row] - residual[other]);
            let all = differences.iter().filter(|d| d.is_finite());
            let one_sided = all.clone().all(|d| *d > limit) || all.clone().all(|d| *d < -limit);
            let least = all.map(|d| d.abs()).fold(f64::INFINITY, f64::min);
            let steps = data.input[row - 2..=row + 2].windows(2).map(|w| (w[1] - w[0]).abs());
            if one_sided && least > by_input * steps.fold(0.0, f64::max) {
                found.push(row);
            }
        }
    }
    if found.len() as f64 > MAX_FRACTION * residual.len() as f64 {
        found.clear();
    }
    found
}

/// Change of the current by a change of the voltage from row to row, A/V, by regression of the measured differences: 1/R for a winding that
/// is fast beside the rows. 0 for other channels and inputs.
fn current_by_voltage_step(data: &PreparedLog, channel: usize) -> f64 {
    let channel = &data.channels[channel];
    if channel.channel != Channel::Current || data.driven != Input::Voltage {
        return 0.0;
    }
    let (mut product, mut square) = (0.0, 0.0);
    for rows in &data.segments {
        for (u, i) in data.input[rows.clone()].windows(2).zip(channel.measured[rows.clone()].windows(2)) {
            let (du, di) = (u[1] - u[0], i[1] - i[0]);
            (product, square) = (product + du * di, square + du * du);
        }
    }
    if square > 0.0 { (product / square).max(0.0) } else { 0.0 }
}

/// Rows near a jump of the input.
fn near_jumps(data: &PreparedLog) -> Vec<bool> {
    let mut near = vec![false; data.len()];
    if data.driven == Input::Motion {
        return near;
    }
    let (low, high) = data.input.iter().copied().min_max();
    for rows in &data.segments {
        let steps = data.input[rows.clone()].windows(2).map(|w| w[1] - w[0]);
        for (k, _) in steps.enumerate().filter(|(_, step)| step.abs() > JUMP_FRACTION * (high - low)) {
            let at = rows.start + k + 1;
            near[at.saturating_sub(ROWS_AROUND_JUMP.0).max(rows.start)..(at + ROWS_AROUND_JUMP.1).min(rows.end)].fill(true);
        }
    }
    near
}

/// Number of outliers of each channel that has some.
pub fn count(data: &PreparedLog) -> Vec<(Channel, usize)> {
    let excluded = |mask: &std::sync::Arc<[bool]>| mask.iter().filter(|m| **m).count();
    let of_channel = |c: &ComparedChannel| Some((c.channel, excluded(c.outliers.as_ref()?).saturating_sub(c.limited_rows)));
    data.channels.iter().filter_map(of_channel).filter(|(_, rows)| *rows > 0).collect()
}

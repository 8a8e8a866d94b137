//! Search for jumps of the angle reading, as lost counts leave them.
//!
//! A jump δ shifts the increments of the angle over the next [`PreparedLog::angle_lag`] rows by δ. The residual is summed over as many
//! rows: the best estimate of a jump at the first of them is the mean, and the square of the sum over the number of rows is the fall of χ².

use drive_model::{Card, Screening};

use crate::identify::explain::fitted::FittedModel;
use crate::model::Channel;
use crate::recording::PreparedLog;

/// The jump of an effect that lets the angle jump, rad, is less than a count of the encoder.
pub fn is_less_than_a_count(base: &FittedModel, card: &Card, jump_rad: f64) -> bool {
    let least_rad = base.context.criteria.evidence.min_lost_counts * base.data.theta_quantum;
    matches!(card.screening, Screening::AngleJumps(_)) && jump_rad.abs() < least_rad
}

/// Times at which the angle may have jumped, the best first, at most `count`: each lies between two rows.
pub fn search_jumps(base: &FittedModel, count: usize) -> Vec<f64> {
    let data = &base.data;
    let Some(angle) = data.channels.iter().position(|c| c.channel == Channel::Angle) else { return Vec::new() };
    let residual = &base.fit.channels[angle].residual;
    let lag = data.angle_lag();
    let mut sums = squares_of_sums(data, residual, lag);
    sums.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut found: Vec<usize> = Vec::new();
    for (row, _) in sums {
        if found.len() == count {
            break;
        }
        // Sums over common rows belong to one jump.
        if found.iter().all(|other| other.abs_diff(row) >= lag) {
            found.push(row);
        }
    }
    found.into_iter().map(|row| 0.5 * (data.t_s[row - 1] + data.t_s[row])).collect()
}

/// Rows that have a row before them in their segment, each with the square of the sum of the residual over `lag` rows from there.
fn squares_of_sums(data: &PreparedLog, residual: &[f64], lag: usize) -> Vec<(usize, f64)> {
    let mut list = Vec::new();
    for rows in &data.segments {
        let mut sums = vec![0.0];
        for row in rows.clone() {
            let next = sums[sums.len() - 1] + if residual[row].is_finite() { residual[row] } else { 0.0 };
            sums.push(next);
        }
        for first in rows.start + 1..rows.end {
            let (from, to) = (first - rows.start, (first + lag).min(rows.end) - rows.start);
            list.push((first, (sums[to] - sums[from]).powi(2)));
        }
    }
    list
}

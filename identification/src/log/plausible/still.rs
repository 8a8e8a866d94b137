//! Checks of single columns: motion, a varying input, decimals.

use super::windows::{Windows, mean, sd};
use super::{Defect, fault_that_ended, response};
use crate::log::{Log, known};
use crate::statistics::Extremes;

/// A column whose range is below this fraction of its largest magnitude is constant.
const CONSTANT_FRACTION: f64 = 1e-9;
/// Rows of a block whose mean is compared with the noise.
const BLOCK_ROWS: usize = 25;
/// Channels that come from a converter or a calculation: never whole numbers in the units of the log.
const MEASURED: [&str; 3] = ["i_A", "theta_rad", "omega_rad_s"];

/// Defects of single columns.
pub(super) fn check(log: &Log, input: &str) -> Vec<Defect> {
    let mut defects = Vec::new();
    let Some(input_values) = log.column(input) else {
        return vec![Defect::MissingInput { input: input.to_owned() }];
    };
    let input = known(input).map_or("t_s", |c| c.name);
    // A current that is commanded may well be whole: a profile of ± 4 A.
    let is_command = |column: &str| column == input && column == "i_A";
    let whole: Vec<&'static str> = MEASURED.into_iter().filter(|c| !is_command(c) && log.column(c).is_some_and(is_whole)).collect();
    if !whole.is_empty() {
        defects.push(Defect::WholeNumbers { columns: whole });
    }
    if !moves(log) {
        let columns: Vec<&'static str> = ["theta_rad", "omega_rad_s"].into_iter().filter(|c| log.column(c).is_some()).collect();
        if !columns.is_empty() {
            defects.push(Defect::NoMotion { columns, fault: fault_that_ended(log) });
        }
    }
    if is_constant(input_values) && input != "theta_rad" && !responds(log, input_values[0]) {
        defects.push(Defect::ConstantInput { input, value: input_values[0], fault: fault_that_ended(log) });
    }
    for column in MEASURED {
        let stands = column != input && log.column(column).is_some_and(|c| c.len() > 2 && is_constant(c));
        if stands && !defects.iter().any(|d| d.columns().contains(&column)) {
            defects.push(Defect::ConstantChannel { column, fault: fault_that_ended(log) });
        }
    }
    defects
}

fn is_constant(values: &[f64]) -> bool {
    let (low, high) = range(values);
    high - low <= CONSTANT_FRACTION * low.abs().max(high.abs())
}

fn is_whole(values: &[f64]) -> bool {
    values.iter().all(|v| v.fract() == 0.0) && !is_constant(values)
}

fn range(values: &[f64]) -> (f64, f64) {
    values.iter().copied().min_max()
}

/// The motion of each run is one response to a constant input: after a step, or coasting.
fn responds(log: &Log, input: f64) -> bool {
    log.runs().iter().all(|run| {
        let of_run = |column: &str| log.column(column).map(|values| &values[run.rows.clone()]);
        match (of_run("omega_rad_s"), of_run("theta_rad")) {
            (Some(rate), _) => response::is_one(rate, input != 0.0),
            (None, Some(theta)) => response::is_one(&response::rate_of(&log.t_s()[run.rows.clone()], theta), input != 0.0),
            (None, None) => false,
        }
    })
}

/// The angle exceeds its quantum, or the rate its noise. True without either column.
fn moves(log: &Log) -> bool {
    let theta = log.column("theta_rad").map(|theta| {
        let (low, high) = range(theta);
        high - low > 3.0 * log.quantization_step("theta_rad").unwrap_or(0.0)
    });
    let omega = log.column("omega_rad_s");
    match theta {
        // A continuous angle of a standing drive is noise: tested as the rate is.
        Some(true) if log.quantization_step("theta_rad").is_none() => log.column("theta_rad").is_some_and(|t| exceeds_noise(log, t, false)),
        Some(moves) => moves,
        None => omega.is_none_or(|omega| exceeds_noise(log, omega, true)),
    }
}

/// Block means vary more than white noise of the rows explains, or (with `by_mean`) are far from zero.
fn exceeds_noise(log: &Log, values: &[f64], by_mean: bool) -> bool {
    if values.len() < 4 * BLOCK_ROWS {
        return !is_constant(values);
    }
    let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let noise = sd(&steps) / std::f64::consts::SQRT_2;
    let blocks = Windows::of_rows(log, BLOCK_ROWS).means(values);
    let spread = sd(&blocks);
    spread > 2.0 * noise / (BLOCK_ROWS as f64).sqrt() || (by_mean && mean(values).abs() > 3.0 * noise.max(spread))
}

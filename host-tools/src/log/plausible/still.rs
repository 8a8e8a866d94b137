//! Does anything move, does the input change, are there decimals at all?

use super::windows::{Windows, mean, sd};
use super::{Code, Finding, fault_that_ended};
use crate::log::{Log, known};
use crate::statistics::Extremes;

/// A range below this part of the largest value is constant.
const CONSTANT: f64 = 1e-9;
/// Rows of a block whose mean is compared with the noise.
const BLOCK: usize = 25;
/// Channels that a converter or a calculation makes: never whole numbers in the units of the log.
const MEASURED: [&str; 3] = ["i_A", "theta_rad", "omega_rad_s"];

/// Findings about single columns.
pub(super) fn check(log: &Log, input: &str) -> Vec<Finding> {
    let mut findings = Vec::new();
    let Some(driven_by) = log.column(input) else {
        let says = format!("the model's input {input} is no column of the log: record it, or choose another input in [drive]");
        return vec![Finding::new(Code::MissingInput, &[], says)];
    };
    let input = known(input).map_or("t_s", |c| c.name);
    let whole: Vec<&'static str> = MEASURED.into_iter().filter(|c| log.column(c).is_some_and(is_whole)).collect();
    if !whole.is_empty() {
        let says = format!("{} holds whole numbers only: were decimals lost (a decimal comma?), or are these counts?", whole.join(" and "));
        findings.push(Finding::new(Code::WholeNumbers, &whole, says));
    }
    if !moves(log) {
        let columns: Vec<&'static str> = ["theta_rad", "omega_rad_s"].into_iter().filter(|c| log.column(c).is_some()).collect();
        if !columns.is_empty() {
            let says = match fault_that_ended(log) {
                Some(fault) => format!("nothing moves in this log: a fault ended it ({fault}) before anything could"),
                None => {
                    "nothing moves in this log: the drive was off, too weak for its friction, or the sensor is not connected".to_owned()
                }
            };
            findings.push(Finding::new(Code::NoMotion, &columns, says));
        }
    }
    if is_constant(driven_by) && input != "theta_rad" {
        let hint =
            fault_that_ended(log).map_or("use a profile that changes".to_owned(), |fault| format!("a fault ended the log early ({fault})"));
        let says = format!("the input {input} is {} in all rows: a model cannot be told from it; {hint}", driven_by[0]);
        findings.push(Finding::new(Code::ConstantInput, &[input], says));
    }
    for channel in MEASURED {
        let stands = channel != input && log.column(channel).is_some_and(|c| c.len() > 2 && is_constant(c));
        if stands && !findings.iter().any(|f| f.columns.contains(&channel)) {
            let hint = fault_that_ended(log)
                .map_or("is the sensor connected?".to_owned(), |fault| format!("a fault ended the log early ({fault})"));
            let says = format!("{channel} never changes: {hint}");
            findings.push(Finding::new(Code::ConstantChannel, &[channel], says));
        }
    }
    findings
}

fn is_constant(values: &[f64]) -> bool {
    let (low, high) = range(values);
    high - low <= CONSTANT * low.abs().max(high.abs())
}

fn is_whole(values: &[f64]) -> bool {
    values.iter().all(|v| v.fract() == 0.0) && !is_constant(values)
}

fn range(values: &[f64]) -> (f64, f64) {
    values.iter().copied().min_max()
}

/// The angle leaves its quantum, or the rate leaves its noise. Without either column nothing can be said: true.
fn moves(log: &Log) -> bool {
    let theta = log.column("theta_rad").map(|theta| {
        let (low, high) = range(theta);
        high - low > 3.0 * log.quantum("theta_rad").unwrap_or(0.0)
    });
    let omega = log.column("omega_rad_s");
    match theta {
        // A continuous angle of a standing drive is noise; the same test as for the rate.
        Some(true) if log.quantum("theta_rad").is_none() => log.column("theta_rad").is_some_and(|t| leaves_noise(log, t, false)),
        Some(moves) => moves,
        None => omega.is_none_or(|omega| leaves_noise(log, omega, true)),
    }
}

/// Means over blocks vary more than white noise of the rows would make them, or (of a rate) are far from zero.
fn leaves_noise(log: &Log, values: &[f64], by_mean: bool) -> bool {
    if values.len() < 4 * BLOCK {
        return !is_constant(values);
    }
    let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let noise = sd(&steps) / std::f64::consts::SQRT_2;
    let blocks = Windows::of_rows(log, BLOCK).means(values);
    let spread = sd(&blocks);
    spread > 2.0 * noise / (BLOCK as f64).sqrt() || (by_mean && mean(values).abs() > 3.0 * noise.max(spread))
}

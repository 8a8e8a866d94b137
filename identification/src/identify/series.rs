//! Measured and modelled series of a fit, row by row, for other programs.

use super::fit::FitResult;
use crate::log::{Axis, Column, Log, LogError};
use crate::recording::PreparedLog;

/// The rows in which every channel is compared, as a log: time (of several logs one after the other), input, and for each channel the
/// measured column and, with the suffix `_model`, the modelled one; `held_out` is 1 where the fit did not use the row. An angle is compared
/// by its increments (`theta_increment_rad`) where its note does not state otherwise.
///
/// # Errors
/// No row is compared.
pub fn series(log: &Log, data: &PreparedLog, fit: &FitResult) -> Result<Log, LogError> {
    let axis = log.axis();
    let rows = compared_rows(data, fit);
    let pick = |values: &[f64]| rows.iter().map(|&row| values[row]).collect::<Vec<f64>>();
    let mut columns = vec![
        Column { name: "t_s".to_owned(), values: pick(log.t_s()) },
        Column { name: axis.column(data.driven.column()).to_owned(), values: pick(&data.input) },
    ];
    for (c, (channel, fitted)) in data.channels.iter().zip(&fit.channels).enumerate() {
        let (name, lag) = (name_of(axis, data, fit, c), data.angle_lag());
        let measured: Vec<f64> = if fitted.is_increment {
            rows.iter().map(|&row| channel.measured[row] - channel.measured[row - lag]).collect()
        } else {
            pick(channel.measured)
        };
        let modelled = measured.iter().zip(&rows).map(|(y, &row)| y - fitted.residual[row]).collect();
        columns.push(Column { name: name.to_owned(), values: measured });
        columns.push(Column { name: format!("{name}_model"), values: modelled });
    }
    columns.push(Column { name: "held_out".to_owned(), values: rows.iter().map(|&row| f64::from(u8::from(data.held_out(row)))).collect() });
    let notes = vec![("series_of".to_owned(), log.path().display().to_string())];
    Log::new(log.path(), columns, notes)
}

/// The rows in which every channel is compared.
pub(super) fn compared_rows(data: &PreparedLog, fit: &FitResult) -> Vec<usize> {
    (0..data.len()).filter(|&row| fit.channels.iter().all(|c| c.residual[row].is_finite())).collect()
}

/// Name of a channel's measured series.
pub(super) fn name_of(axis: Axis, data: &PreparedLog, fit: &FitResult, channel: usize) -> &'static str {
    match (fit.channels[channel].is_increment, axis) {
        (true, Axis::Linear) => "x_increment_m",
        (true, Axis::Rotary) => "theta_increment_rad",
        (false, axis) => axis.column(data.channels[channel].channel.column()),
    }
}

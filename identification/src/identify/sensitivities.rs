//! Sensitivities of a model's outputs, row by row: derivatives by its free parameters along a log.
//!
//! In: a compared or fitted model. Out: columns `d_OUTPUT_d_PARAMETER`, unit of the output per unit of the parameter, at the initial states
//! of the comparison. The derivatives are exact (forward-mode), not differences.

use super::fit::parameters::{DerivativeScalar, Dual};
use super::fit::simulate::run;
use super::fit::{FitResult, build};
use super::series::{compared_rows, name_of, series};
use crate::log::{Column, Log, LogError};
use crate::model::Model;
use crate::recording::PreparedLog;
use drive_model::ParameterKind;

/// Derivatives that one simulation carries, and how many of them are by parameters: the others are by initial states.
const DERIVATIVES: usize = 16;
const PARAMETERS_AT_ONCE: usize = 8;

/// The series of a comparison ([`series`]) and the sensitivities beside them.
///
/// # Errors
/// No row is compared.
pub fn with_sensitivities(log: &Log, model: &Model, data: &PreparedLog, fit: &FitResult) -> Result<Log, LogError> {
    let (system, _) = build::system(model, data.temp_C.is_some());
    let mut at = fit.parameters.clone();
    for parameter in &mut at.list {
        // The derivative is by the value itself; that by a harmonic order has no use, since the order is a whole number.
        parameter.fixed |= parameter.kind == ParameterKind::HarmonicOrder;
        parameter.kind = ParameterKind::Signed;
        parameter.polar = None;
    }
    let rows = compared_rows(data, fit);
    let mut columns = series(log, data, fit)?.columns().to_vec();
    for block in at.free().chunks(PARAMETERS_AT_ONCE) {
        let mut some = at.clone();
        some.list.iter_mut().enumerate().for_each(|(k, p)| p.fixed = !block.contains(&k));
        let rig = system.rig::<Dual<DERIVATIVES>>(&some, data.driven);
        let mut slopes = vec![vec![vec![f64::NAN; data.len()]; block.len()]; data.channels.len()];
        for (segment, states) in fit.initial_states.values.iter().enumerate() {
            run(&rig, data, segment, (&fit.initial_states.kinds, states), block.len(), &mut |channel, row, value: &Dual<DERIVATIVES>| {
                for (slope, index) in slopes[channel].iter_mut().zip(0..) {
                    slope[row] = value.slope(index);
                }
                true
            });
        }
        for (c, of_channel) in slopes.iter().enumerate() {
            for (k, slope) in block.iter().zip(of_channel) {
                columns.push(Column {
                    name: format!("d_{}_d_{}", name_of(log.axis(), data, fit, c), log.axis().parameter(&at.list[*k].name)),
                    values: rows.iter().map(|row| slope[*row]).collect(),
                });
            }
        }
    }
    Log::new(log.path(), columns, vec![("series_of".to_owned(), log.path().display().to_string())])
}

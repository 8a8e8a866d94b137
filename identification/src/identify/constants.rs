//! Physical constants that a fit shifts far from their start values: a wrong unit of a column, or of a start value.
//!
//! Judged are the base parameters resistance, motor constant and inertia. A data sheet gives the first two within some ten per cent, a mass
//! and a radius the third within a factor of two or three. Friction and the amplitudes of effects are not judged: they differ by decades
//! between stands of one type, and they compensate for missing effects.
//!
//! A fit may also keep the constants near their start values and leave a whole channel unexplained. Then the measured channel is a multiple
//! of the modelled one.
//!
//! In: the model with its start values, and a fit. Out: the constants that are a decade or more from their start values, and the defect of
//! the log if the shifts have the pattern of columns in thousandths of their unit. Exempt are constants that are fixed, not determined, or
//! without a start value in the file.

use super::fit::{self, FitResult};
use crate::log::plausible::{Defect, ShiftedConstant};
use crate::model::{BaseParameter, Channel, Input, Model, ModelParameter};
use crate::recording::PreparedLog;

/// Shift that is questioned, decades. A start value from a data sheet or from dimensions is within a factor of three.
const QUESTIONED_DECADES: f64 = 1.0;
/// Shift by a column in thousandths of its unit (mV, mA, mN m), decades.
const THOUSANDTHS_DECADES: f64 = 3.0;
/// Largest distance of a shift from the pattern of a column in thousandths, decades: the uncertainty of a start value, a factor of three. A
/// factor of 1000 may thus appear as 320 to 3200, and no other prefix of a unit is as near.
const MAX_DEVIATION_DECADES: f64 = 0.5;
/// Least squared correlation of a measured with a modelled channel that differ by a unit only.
const MIN_UNIT_CORRELATION: f64 = 0.5;
/// Fit of a channel, per cent, above which the model with its start values describes the log, so that no unit is wrong by a decade.
const MIN_DESCRIBING_FIT_PERCENT: f64 = 50.0;

/// The constants that the fit `result` of `model` shifts by a decade or more.
pub fn shifted(model: &Model, result: &FitResult) -> Vec<ShiftedConstant> {
    let determined = |p: &BaseParameter| result.unidentifiable.iter().all(|u| u.parameter != p.name());
    let shifts = BaseParameter::ALL.into_iter().filter(determined).filter_map(|p| Shift::of(model, result, p));
    shifts.filter(|s| s.decades.abs() >= QUESTIONED_DECADES).map(|s| s.constant).collect()
}

/// The columns that are in thousandths of their unit, by the fit or comparison `result` of `model` with `data`.
pub fn columns_in_thousandths(model: &Model, data: &PreparedLog, result: &FitResult) -> Option<Defect> {
    by_multiple(model, data, result).or_else(|| by_shifts(model, result))
}

/// The columns that are in thousandths of their unit, by a fit of `model`. A fit to a column in another unit may end anywhere: where it
/// describes a channel badly, the start values show what the column is a multiple of.
pub fn columns_in_thousandths_by_fit(model: &Model, data: &PreparedLog, fitted: &FitResult) -> Option<Defect> {
    let at_start = || {
        let (system, start) = fit::build::system(model, data.temp_C.is_some());
        columns_in_thousandths(model, data, &fit::compare(&system, &start, data).ok()?)
    };
    columns_in_thousandths(model, data, fitted).or_else(|| may_have_wrong_unit(fitted).then(at_start).flatten())
}

/// A measured current, voltage or torque that is about 1000 × the modelled one.
fn by_multiple(model: &Model, data: &PreparedLog, result: &FitResult) -> Option<Defect> {
    let (found, multiple) = result.channels.iter().zip(&data.channels).find_map(|(fit, data)| {
        let judged = matches!(fit.channel, Channel::Current | Channel::Voltage | Channel::Torque);
        let multiple = multiple(data.measured, &fit.residual).filter(|_| judged)?;
        ((multiple.log10() - THOUSANDTHS_DECADES).abs() <= MAX_DEVIATION_DECADES).then_some((fit.channel, multiple))
    })?;
    let resistance = BaseParameter::Resistance.info();
    let given = model.base(BaseParameter::Resistance).filter(|_| found == Channel::Current && model.input() == Input::Voltage);
    // The same voltage drives a current with another unit.
    let evidence =
        given.map(|start| ShiftedConstant { parameter: resistance.name, unit: resistance.unit, start, fitted: start / multiple });
    Some(Defect::Thousandths { columns: vec![found.column()], evidence: evidence.into_iter().collect() })
}

/// Slope of the measured over the modelled channel; `None` where the two are not correlated.
fn multiple(measured: &[f64], residual: &[f64]) -> Option<f64> {
    let pairs = measured.iter().zip(residual).filter(|(_, r)| r.is_finite()).map(|(m, r)| (*m, m - r));
    let (mm, nn, mn) = pairs.fold((0.0, 0.0, 0.0), |(mm, nn, mn), (m, n)| (mm + m * m, nn + n * n, mn + m * n));
    (mn > 0.0 && mn * mn >= MIN_UNIT_CORRELATION * mm * nn).then(|| mn / nn)
}

/// The columns in thousandths of their unit by the pattern of the shifts; `None` where the shifts have no such pattern.
fn by_shifts(model: &Model, result: &FitResult) -> Option<Defect> {
    let shift = |p: BaseParameter| Shift::of(model, result, p);
    let alone = |p: BaseParameter| shift(p).filter(|s| result.unidentifiable.iter().all(|u| u.parameter != s.constant.parameter));
    let (inertia, motor_constant) = (BaseParameter::Inertia, BaseParameter::MotorConstant);
    let (columns, observed): (&[&'static str], Vec<Observed>) = match model.input() {
        // u = R i + K ω, J ω' = K i.
        Input::Voltage => {
            let own = [(BaseParameter::Resistance, [1.0, -1.0]), (motor_constant, [1.0, 0.0]), (inertia, [1.0, 1.0])];
            let observed = own.into_iter().filter_map(|(p, by)| alone(p).map(|s| Observed::one(s, by)));
            let compares_current = result.channels.iter().any(|c| c.channel == Channel::Current);
            (if compares_current { &["u_V", "i_A"] } else { &["u_V"] }, observed.collect())
        }
        // J ω' = K i: only K/J is determined where both are free.
        Input::Current => {
            let (shift_J, shift_K) = (shift(inertia), shift(motor_constant));
            let decades = |s: &Option<Shift>| s.as_ref().map_or(0.0, |s| s.decades);
            let ratio = decades(&shift_J) - decades(&shift_K);
            let shifts: Vec<Shift> = shift_J.into_iter().chain(shift_K).collect();
            (&["i_A"], if shifts.is_empty() { Vec::new() } else { vec![Observed { decades: ratio, shifts, by: [1.0, 0.0] }] })
        }
        Input::Torque => (&["torque_N_m"], alone(inertia).into_iter().map(|s| Observed::one(s, [1.0, 0.0])).collect()),
        Input::Motion | Input::Setpoint => return None,
    };
    let patterns: &[[f64; 2]] = if columns.len() == 1 { &[[1.0, 0.0]] } else { &[[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] };
    let expected = |pattern: &[f64; 2], by: &[f64; 2]| THOUSANDTHS_DECADES * (pattern[0] * by[0] + pattern[1] * by[1]);
    let found = patterns.iter().find(|pattern| {
        observed.iter().all(|o| (o.decades - expected(pattern, &o.by)).abs() <= MAX_DEVIATION_DECADES)
            && observed.iter().any(|o| expected(pattern, &o.by) != 0.0)
    })?;
    // One constant that begins at the default of the catalogue may belong to another drive.
    if observed.len() == 1 && observed[0].shifts.iter().all(|s| s.begins_at_default) {
        return None;
    }
    let evidence = observed.into_iter().flat_map(|o| o.shifts).filter(|s| s.decades.abs() >= QUESTIONED_DECADES);
    Some(Defect::Thousandths {
        columns: columns.iter().zip(found).filter(|(_, wrong)| **wrong > 0.0).map(|(column, _)| *column).collect(),
        evidence: evidence.map(|s| s.constant).collect(),
    })
}

/// The model with the values of `result`, which are not fitted, describes no channel of the log: a unit may be wrong.
pub fn may_have_wrong_unit(result: &FitResult) -> bool {
    result.channels.iter().any(|c| c.fit_percent < MIN_DESCRIBING_FIT_PERCENT)
}

/// Shift of a constant by a fit.
struct Shift {
    constant: ShiftedConstant,
    /// Decimal logarithm of fitted over start value.
    decades: f64,
    /// The start value is that of the catalogue.
    begins_at_default: bool,
}

/// A shift that the log determines: of one constant, or of the ratio of two.
struct Observed {
    decades: f64,
    shifts: Vec<Shift>,
    /// Change by a factor of ten in the first and in the second column, decades.
    by: [f64; 2],
}

impl Observed {
    fn one(shift: Shift, by: [f64; 2]) -> Self {
        Observed { decades: shift.decades, shifts: vec![shift], by }
    }
}

impl Shift {
    fn of(model: &Model, result: &FitResult, parameter: BaseParameter) -> Option<Shift> {
        let given: &ModelParameter = model.parameter(parameter.name())?;
        let fitted = result.parameters.list.iter().find(|p| p.name == given.name)?;
        let info = parameter.info();
        let known = given.value > 0.0 && !given.filled_in && !given.fixed;
        let decades = (fitted.value / given.value).log10();
        (known && decades.is_finite()).then_some(Shift {
            constant: ShiftedConstant { parameter: info.name, unit: info.unit, start: given.value, fitted: fitted.value },
            decades,
            begins_at_default: given.value == info.start,
        })
    }
}

#[cfg(test)]
mod tests;

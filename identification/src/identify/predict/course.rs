//! Uncertainty of the parameters by the unknown course of the input within the rows.
//!
//! In: a fit and its log. Out: the covariance of the parameters over the courses that the log does not exclude. It is added to the
//! covariance by the noise. There are two cases:
//!
//! * the column has means over the row: the voltage may move within the row ([`by_course`]);
//! * the column has values at t: a converter may hold each of them for a part of the row ([`by_hold`]).

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

use crate::identify::fit::{self, FitResult, Iterate, System};
use crate::identify::recording_conventions::MIN_GAIN;
use crate::log::Log;
use crate::recording::Convention;
use crate::recording::PreparedLog;
use crate::recording::convention::apply;
use crate::recording::voltage::{InputTiming, Known};

/// Courses of the voltage that are drawn: their standard deviation is then known to a quarter.
const COURSES: usize = 10;

/// The data with a voltage that moves within the rows; `None` where the log leaves nothing open: no voltage, its values at t, or a note
/// that it is held.
pub fn with_course<'d, 'l>(log: &'l Log, data: &'d PreparedLog<'l>) -> Option<Cow<'d, PreparedLog<'l>>> {
    if let Some(course) = &data.voltage_course {
        return (course.known != Known::Values).then_some(Cow::Borrowed(data));
    }
    apply(Convention::InputMoves, log, data).map(|(moving, _)| Cow::Owned(moving))
}

/// Covariance of the free coordinates over drawn courses of the voltage: each is a random walk with the means, or means and moments, of the
/// log. It is that of the steps from `iterate` to the minima with these courses (multiple imputation: Rubin, Multiple Imputation for
/// Nonresponse in Surveys, 1987). `open`: the data [`with_course`]. `None` where no course can be drawn, or the equations are singular.
pub fn by_course(system: &System, open: &PreparedLog, iterate: &Iterate, weights: &[f64]) -> Option<DMatrix<f64>> {
    let here = step(iterate, weights)?;
    let differences: Option<Vec<DVector<f64>>> = drawn_courses(open)?
        .iter()
        .map(|other| Some(step(&Iterate::new(system, &iterate.parameters, other, &iterate.initial_states), weights)? - &here))
        .collect();
    Some(covariance_of(&differences?))
}

/// The data with each of the drawn courses; the same ones at each call. `None` where no course can be drawn.
pub fn drawn_courses<'l>(open: &PreparedLog<'l>) -> Option<Vec<PreparedLog<'l>>> {
    let course = open.voltage_course.as_ref()?;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
    (0..COURSES)
        .map(|_| {
            let drawn = course.drawn(&open.input, &open.segments, &mut random)?;
            Some(open.with_voltage_course(drawn))
        })
        .collect()
}

/// Covariance of an estimate that differs by so much with each of the [`drawn_courses`].
pub fn covariance_of(differences: &[DVector<f64>]) -> DMatrix<f64> {
    let count = differences.len() as f64;
    let size = differences.first().map_or(0, DVector::len);
    let sum = differences.iter().fold(DMatrix::zeros(size, size), |sum, d| sum + d * d.transpose());
    sum * ((1.0 + 1.0 / count) / count)
}

/// Covariance of the parameters by the course of the input, at `iterate`, which is linearised along `data`. `None` where the course is
/// known, or the likelihood refutes that a voltage moved which was taken as constant within the rows.
pub fn course_covariance(system: &System, log: &Log, data: &PreparedLog, iterate: &Iterate, weights: &[f64]) -> Option<DMatrix<f64>> {
    if hold_is_open(log, data) {
        return Some(iterate.parameters.full_covariance(&by_hold(system, log, data, iterate, weights)?));
    }
    let open = with_course(log, data)?;
    if matches!(open, Cow::Owned(_)) && is_refuted(system, &open, iterate, weights) {
        return None;
    }
    Some(iterate.parameters.full_covariance(&by_course(system, &open, iterate, weights)?))
}

/// The input was taken as its values at t or those of the row before, which no note states.
fn hold_is_open(log: &Log, data: &PreparedLog) -> bool {
    data.input_timing != InputTiming::OverRow && !log.notes().states_timing(data.driven.column())
}

/// Covariance of the free coordinates by the time for which a converter holds each value of the input. No note states that time: it is
/// taken as even between 0, for which the model was fitted, and a row. The input then comes later by up to half a row, or by up to a row
/// where values of the row before were assumed.
fn by_hold(system: &System, log: &Log, data: &PreparedLog, iterate: &Iterate, weights: &[f64]) -> Option<DMatrix<f64>> {
    let mut held_values = data.clone();
    held_values.input = log.column(data.driven.column())?.into();
    held_values.voltage_course = None;
    let difference =
        step(&Iterate::new(system, &iterate.parameters, &held_values, &iterate.initial_states), weights)? - step(iterate, weights)?;
    Some(&difference * difference.transpose() / 3.0)
}

/// Adds the covariance by the course of the voltage, which is independent of that by the noise.
pub fn add_course(fit: &mut FitResult, by_course: &DMatrix<f64>) {
    fit.covariance += by_course;
    for (k, sigma) in fit.sigmas.iter_mut().enumerate() {
        let course = by_course[(k, k)].max(0.0).sqrt();
        fit.rests_on_course |= course > *sigma;
        *sigma = sigma.hypot(course);
    }
}

/// A free run with the covariance by the course, where it leaves only noise or its values at t may be held. The stand's own moments of an
/// open loop determine the course.
pub fn with_course_of_free_run(system: &System, log: &Log, data: &PreparedLog, mut fit: FitResult) -> FitResult {
    let is_known = data.voltage_course.as_ref().is_some_and(|course| course.known == Known::Moments);
    if is_known || data.budget.is_exhausted() || !(fit.leaves_noise_only() || hold_is_open(log, data)) {
        return fit;
    }
    let weights = fit::weights(&fit.channels.iter().map(|c| c.noise).collect::<Vec<_>>());
    let iterate = Iterate::new(system, &fit.parameters, data, &fit.initial_states);
    if let Some(by_course) = course_covariance(system, log, data, &iterate, &weights) {
        add_course(&mut fit, &by_course);
    }
    fit
}

/// With the expected course the model fits clearly worse than with a constant voltage.
fn is_refuted(system: &System, open: &PreparedLog, iterate: &Iterate, weights: &[f64]) -> bool {
    let moving = Iterate::new(system, &iterate.parameters, open, &iterate.initial_states).normal_equations(weights);
    let decrease = moving.step(0.0, &held(iterate)).map_or(0.0, |step| step.predicted_decrease);
    let by_course = moving.cost - decrease;
    // NaN where the simulation with the course diverges.
    by_course.is_nan() || by_course > iterate.normal_equations(weights).cost + MIN_GAIN
}

/// Step of the free coordinates to the minimum; parameters at a bound stay.
fn step(iterate: &Iterate, weights: &[f64]) -> Option<DVector<f64>> {
    Some(DVector::from_vec(iterate.normal_equations(weights).step(0.0, &held(iterate))?.parameters))
}

/// Coordinates of the parameters at a bound.
fn held(iterate: &Iterate) -> Vec<usize> {
    let (free, at_bounds) = (iterate.parameters.free(), iterate.parameters.at_bounds());
    (0..free.len()).filter(|&k| at_bounds.contains(&free[k])).collect()
}

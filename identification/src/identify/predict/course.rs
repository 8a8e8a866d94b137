//! Standard errors by what a log leaves open of the voltage within its rows.
//!
//! In: a fit. Out: the covariance of its parameters by the courses of the voltage that the log does not exclude, beside that by the noise.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

use crate::identify::fit::voltage::Known;
use crate::identify::fit::{self, FitResult, Iterate, PreparedLog, System};
use crate::identify::recording_conventions::{Convention, MIN_GAIN, apply};
use crate::log::Log;

/// Courses of the voltage that are drawn: their standard deviation is then known to a quarter.
const COURSES: usize = 10;

/// The data with a voltage that moves within the rows; `None` where the log leaves nothing open: no voltage, its values at t, or a note that it is held.
pub fn with_course<'d, 'l>(log: &'l Log, data: &'d PreparedLog<'l>) -> Option<Cow<'d, PreparedLog<'l>>> {
    if let Some(course) = &data.voltage_course {
        return (course.known != Known::Values).then_some(Cow::Borrowed(data));
    }
    let mut moving = data.clone();
    apply(Convention::InputMoves, log, &mut moving)?;
    Some(Cow::Owned(moving))
}

/// Covariance of the free coordinates by what the log leaves open of the voltage within its rows: of the steps from `iterate` to the minima with drawn courses (multiple imputation: Rubin,
/// Multiple Imputation for Nonresponse in Surveys, 1987). `open`: the data [`with_course`]. `None` where no course can be drawn, or the equations are singular.
pub fn by_course(system: &System, open: &PreparedLog, iterate: &Iterate, weights: &[f64]) -> Option<DMatrix<f64>> {
    let course = open.voltage_course.as_ref()?;
    let here = step(iterate, weights)?;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
    let mut sum = DMatrix::zeros(here.len(), here.len());
    for _ in 0..COURSES {
        let mut other = open.clone();
        other.voltage_course = Some(course.drawn(&open.input, &open.segments, &mut random)?);
        let difference = step(&Iterate::new(system, &iterate.parameters, &other, &iterate.initial_states), weights)? - &here;
        sum += &difference * difference.transpose();
    }
    Some(sum * ((1.0 + 1.0 / COURSES as f64) / COURSES as f64))
}

/// Covariance of the parameters by the course of the voltage, at `iterate`, which is linearised along `data`. `None` where nothing is open: a voltage that was taken as constant within the rows
/// may have moved, unless the likelihood refutes that; values that were taken as those of a smooth voltage may be held.
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

/// The input was taken as its values at t, which no note states.
fn hold_is_open(log: &Log, data: &PreparedLog) -> bool {
    data.input_at_t && !log.notes().has_provenance(data.driven.column())
}

/// Covariance of the free coordinates by how long the values of the input at t are held, which no note tells: a digital converter holds each for up to a row, so that the input comes later, by up to half a row. The part
/// of the row is even between 0, where the smooth input was fitted, and 1.
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

/// Adds the covariance by the course to that of a free run that leaves only noise, or whose values at t may be held. The stand's own moments of an open loop determine the course.
pub fn add_course_to_free_run(fit: &mut FitResult, system: &System, log: &Log, data: &PreparedLog) {
    let is_known = data.voltage_course.as_ref().is_some_and(|course| course.known == Known::Moments);
    if is_known || !(fit.leaves_noise_only() || hold_is_open(log, data)) {
        return;
    }
    let weights = fit::weights(&fit.channels.iter().map(|c| c.noise).collect::<Vec<_>>());
    let iterate = Iterate::new(system, &fit.parameters, data, &fit.initial_states);
    if let Some(by_course) = course_covariance(system, log, data, &iterate, &weights) {
        add_course(fit, &by_course);
    }
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

//! The shapes that are searched over each coordinate: few, to avoid over-fitting, and typical of missing physics.

use std::sync::Arc;

use drive_model::Coordinate;
use drive_model::effects::{coulomb, viscous};

use super::rows::{Disturbance, ResidualRows};
use crate::identify::fit::FitResult;
use crate::model::{BaseParameter, Channel, Input};
use crate::statistics::Extremes;

/// Where a shape enters the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Entry {
    /// As a torque.
    Torque,
    /// As a voltage.
    Voltage,
    /// As a relative change of the motor constant: torque and back-EMF.
    MotorConstant,
    /// As an error of a channel (index).
    Reading(usize),
    /// As an error of the encoder: in the angle and in a rate derived from it.
    Encoder,
}

/// Shapes that are added or omitted together.
#[derive(Debug, Clone)]
pub struct Family {
    /// The coordinate.
    pub coordinate: Coordinate,
    /// Where they enter.
    pub entry: Entry,
    /// Kind of the shapes.
    pub shape: ShapeKind,
    /// Responses of all channels; one column per shape. Shared with the candidates of each round.
    pub columns: Arc<[Vec<f64>]>,
}

/// Kind of a family of shapes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShapeKind {
    /// A smooth function of the coordinate.
    Smooth,
    /// A constant.
    Constant,
    /// A function of the angle times the sign of the rate.
    AngleFriction,
    /// A harmonic of the angle: periods per revolution.
    Harmonic(u32),
    /// A step in time.
    Step {
        /// Time of the step, s.
        t_s: f64,
    },
    /// A value of its own for each log.
    ByLog(Difference),
    /// A line of the spectrum.
    Line {
        /// Frequency, Hz.
        frequency_hz: f64,
    },
}

/// What differs from log to log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Difference {
    /// A constant.
    Offset,
    /// A factor of the voltage, or of the reading.
    Scale,
    /// Coulomb and viscous friction.
    Friction,
    /// Resistance of the winding: it is as warm as the runs before left it.
    Resistance,
}

/// Product of two columns, row by row.
pub fn times(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

/// Function of a column, row by row.
pub fn map(a: &[f64], f: impl Fn(f64) -> f64) -> Vec<f64> {
    a.iter().map(|v| f(*v)).collect()
}

fn largest(a: &[f64]) -> f64 {
    a.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()))
}

/// Rate, relative to the largest, over which the sign function is smoothed.
const SIGN_WIDTH: f64 = 0.003;
/// Intervals between the steps in time that are tried.
const STEPS: usize = 32;

/// Response of all channels to a shape.
pub fn response(rows: &ResidualRows, entry: Entry, shape: &[f64]) -> Vec<f64> {
    let none = Disturbance::default();
    match entry {
        Entry::Torque => rows.response(Disturbance { torque: Some(shape), ..none }),
        Entry::Voltage => rows.response(Disturbance { voltage: Some(shape), ..none }),
        Entry::MotorConstant => {
            let (torque, back) = (times(shape, &rows.current), map(&times(shape, &rows.omega), |v| -v));
            rows.response(Disturbance { torque: Some(&torque), voltage: (rows.driven == Input::Voltage).then_some(&back), ..none })
        }
        Entry::Reading(c) => rows.response(Disturbance { reading: Some((c, shape)), ..none }),
        Entry::Encoder => rows.response(Disturbance { encoder: Some(shape), ..none }),
    }
}

/// Sign of the rate, smoothed at zero.
pub fn direction(rows: &ResidualRows) -> Vec<f64> {
    let small = SIGN_WIDTH * largest(&rows.omega);
    map(&rows.omega, |w| (w / small).tanh())
}

/// Directions that the fitted parameters and initial states have already removed from the residual.
pub fn fitted_directions(rows: &ResidualRows, fit: &FitResult) -> Vec<Vec<f64>> {
    let mut list = Vec::new();
    if rows.drive.is_none() {
        return list;
    }
    let n = rows.len();
    for (k, _) in rows.begins.iter().enumerate().filter(|(_, b)| **b).take(8) {
        let mut impulse = vec![0.0; n];
        impulse[k] = 1.0;
        list.push(response(rows, Entry::Torque, &impulse));
    }
    let fitted = |name: &str| fit.parameters.list.iter().zip(&fit.sigmas).any(|(p, s)| p.name == name && !p.fixed && *s > 0.0);
    if rows.omega.is_empty() {
        return list;
    }
    let ones = vec![1.0; n];
    let minus = |a: &[f64]| map(a, |v| -v);
    if fitted(BaseParameter::Inertia.name()) {
        list.push(response(rows, Entry::Torque, &acceleration(rows)));
    }
    if fitted(viscous::CARD.parameters[0].name) {
        list.push(response(rows, Entry::Torque, &rows.omega));
    }
    if fitted(coulomb::CARD.parameters[0].name) {
        list.push(response(rows, Entry::Torque, &direction(rows)));
    }
    if rows.current.len() == n {
        if fitted(BaseParameter::MotorConstant.name()) {
            list.push(response(rows, Entry::MotorConstant, &ones));
        }
        if fitted(BaseParameter::Resistance.name()) && rows.driven == Input::Voltage {
            list.push(response(rows, Entry::Voltage, &minus(&rows.current)));
        }
    }
    list
}

/// Modelled acceleration, rad/s².
fn acceleration(rows: &ResidualRows) -> Vec<f64> {
    (0..rows.len()).map(|k| rows.slope(&rows.omega, k)).collect()
}

/// All families except harmonics and lines, which the spectra give.
pub fn families(rows: &ResidualRows) -> Vec<Family> {
    let mut list = Vec::new();
    let n = rows.len();
    let mut add = |coordinate, entry, shape, shapes: &[Vec<f64>]| {
        let columns = shapes.iter().map(|s| response(rows, entry, s)).collect();
        list.push(Family { coordinate, entry, shape, columns });
    };
    let mut entries: Vec<Entry> = (0..rows.channels.len()).map(Entry::Reading).collect();
    if rows.drive.is_some() {
        entries.push(Entry::Torque);
    }
    let voltage = rows.drive.is_some() && rows.driven == Input::Voltage;
    let reads = |entry: Entry, channel: Channel| matches!(entry, Entry::Reading(c) if rows.channels[c].channel == channel);
    let ones = vec![1.0; n];
    let varies = |a: &[f64]| a.len() == n && a.iter().all(|v| v.is_finite()) && a.iter().any(|v| *v != a[0]);
    let moving = varies(&rows.omega);
    let (w, i) = (scaled(&rows.omega), scaled(&rows.current));
    let s = if moving { direction(rows) } else { Vec::new() };
    let bump = |width: f64| times(&s, &map(&w, |w| (-(w / width).powi(2)).exp()));
    if moving {
        let shapes = vec![
            ones.clone(),
            s.clone(),
            w.clone(),
            map(&w, f64::abs),
            map(&w, |w| w * w.abs()),
            map(&w, |w| w.powi(3)),
            bump(0.04),
            bump(0.12),
        ];
        // A delay of the angle adds the rate to the angle, the acceleration to its increments.
        for &entry in entries.iter().filter(|a| !reads(**a, Channel::Angle)) {
            add(Coordinate::Omega, entry, ShapeKind::Smooth, &shapes);
        }
        let a = scaled(&acceleration(rows));
        for &entry in entries.iter().filter(|a| **a != Entry::Torque) {
            let a = if reads(entry, Channel::Angle) { &w } else { &a };
            add(Coordinate::Acceleration, entry, ShapeKind::Smooth, &[a.clone(), map(a, |a| a * a.abs())]);
        }
        let (angle, time) = since_reversal(rows);
        let decaying = |x: &[f64], over: f64| times(&s, &map(x, |x| (-x / over).exp()));
        let shapes: Vec<Vec<f64>> =
            [0.02, 0.1, 0.5].iter().map(|d| decaying(&angle, *d)).chain([0.03, 0.15, 0.6].iter().map(|d| decaying(&time, *d))).collect();
        for &entry in &entries {
            add(Coordinate::History, entry, ShapeKind::Smooth, &shapes);
        }
    }
    if varies(&rows.current) {
        let small = 0.01;
        let sign = map(&i, |i| (i / small).tanh());
        let shapes = vec![ones.clone(), sign, i.clone(), map(&i, f64::abs), map(&i, |i| i * i.abs()), map(&i, |i| i.powi(3))];
        for &entry in entries.iter().filter(|a| !reads(**a, Channel::Rate)) {
            add(Coordinate::Current, entry, ShapeKind::Smooth, &shapes);
        }
        if voltage {
            add(Coordinate::Current, Entry::Voltage, ShapeKind::Smooth, &shapes);
        }
        if moving && rows.drive.is_some() {
            add(Coordinate::Current, Entry::MotorConstant, ShapeKind::Smooth, &[map(&i, f64::abs), map(&i, |i| i * i)]);
        }
    }
    if varies(&rows.temp_C) {
        let smooth = smoothed(&rows.temp_C, (1.0 / rows.dt_s) as usize);
        let t = scaled(&centred(&smooth));
        for &entry in &entries {
            let mut shapes = vec![ones.clone(), t.clone()];
            if moving {
                shapes.push(times(&t, &w));
                shapes.push(times(&t, &s));
            }
            if reads(entry, Channel::Current) && varies(&rows.current) {
                shapes.push(times(&t, &i));
            }
            add(Coordinate::Temperature, entry, ShapeKind::Smooth, &shapes);
        }
        if voltage && varies(&rows.current) {
            add(Coordinate::Temperature, Entry::Voltage, ShapeKind::Smooth, &[times(&t, &i), times(&t, &w)]);
        }
    }
    // A constant torque is listed with friction (coordinate rate), a constant error of a reading with time.
    if rows.drive.is_some() {
        add(Coordinate::Omega, Entry::Torque, ShapeKind::Constant, std::slice::from_ref(&ones));
    }
    for &entry in entries.iter().filter(|a| reads(**a, Channel::Rate) || reads(**a, Channel::Current)) {
        add(Coordinate::Time, entry, ShapeKind::Constant, std::slice::from_ref(&ones));
    }
    let t = scaled(&centred(&rows.t_s));
    for &entry in &entries {
        add(Coordinate::Time, entry, ShapeKind::Smooth, &[ones.clone(), t.clone(), map(&t, |t| t * t)]);
    }
    let (first_s, last_s) = rows.t_s.iter().copied().min_max();
    for k in 1..STEPS {
        // Of several logs, a time of each.
        let t_s = if rows.runs > 1 { first_s + (last_s - first_s) * k as f64 / STEPS as f64 } else { rows.t_s[n * k / STEPS] };
        let step = rows.t_s.iter().map(|t| f64::from(u8::from(*t >= t_s))).collect();
        let entry = if rows.drive.is_some() { Entry::Torque } else { Entry::Reading(0) };
        add(Coordinate::Time, entry, ShapeKind::Step { t_s }, &[step]);
    }
    by_log(rows, &entries, voltage, &mut add);
    if varies(&rows.theta) {
        let turned = scaled(&centred(&rows.theta));
        let waves = |orders: std::ops::RangeInclusive<u32>| -> Vec<Vec<f64>> {
            orders
                .flat_map(|n| {
                    let n = f64::from(n);
                    [map(&rows.theta, |x| (n * x).cos()), map(&rows.theta, |x| (n * x).sin())]
                })
                .collect()
        };
        for &entry in entries.iter().filter(|a| !reads(**a, Channel::Angle)) {
            add(Coordinate::Theta, entry, ShapeKind::Smooth, &[ones.clone(), turned.clone(), map(&turned, |t| t * t)]);
        }
        if moving && rows.drive.is_some() {
            let shapes: Vec<Vec<f64>> = waves(1..=3).iter().map(|wave| times(wave, &s)).collect();
            add(Coordinate::Theta, Entry::Torque, ShapeKind::AngleFriction, &shapes);
        }
    }
    list
}

/// Length of the path of the motion, forth and back, turns.
pub fn travelled_turns(rows: &ResidualRows) -> f64 {
    rows.omega.iter().map(|w| w.abs() * rows.dt_s).sum::<f64>() / std::f64::consts::TAU
}

/// Takes a shape by its columns.
type AddShape<'a> = dyn FnMut(Coordinate, Entry, ShapeKind, &[Vec<f64>]) + 'a;

/// Offsets and scales that differ from log to log: of the torque, the voltage and each reading. The fit has removed the mean over the logs,
/// so that the values of all logs are one more than can be told apart; the orthonormal columns leave one out.
fn by_log(rows: &ResidualRows, entries: &[Entry], voltage: bool, add: &mut AddShape) {
    if rows.runs < 2 {
        return;
    }
    let in_each = |column: &[f64]| -> Vec<Vec<f64>> {
        let only = |run: usize| column.iter().zip(&rows.run).map(|(v, r)| if *r == run as f64 { *v } else { 0.0 }).collect();
        (0..rows.runs).map(only).collect()
    };
    let ones = vec![1.0; rows.len()];
    let moving = rows.omega.len() == rows.len();
    let offset = ShapeKind::ByLog(Difference::Offset);
    let scale = ShapeKind::ByLog(Difference::Scale);
    for &entry in entries {
        match entry {
            Entry::Torque => {
                add(Coordinate::Log, entry, offset, &in_each(&ones));
                if moving {
                    let shapes = [in_each(&direction(rows)), in_each(&rows.omega)].concat();
                    add(Coordinate::Log, entry, ShapeKind::ByLog(Difference::Friction), &shapes);
                }
            }
            Entry::Reading(c) => {
                let reading = match rows.channels[c].channel {
                    Channel::Rate => &rows.omega,
                    Channel::Current => &rows.current,
                    Channel::Angle => &rows.theta,
                    Channel::Voltage | Channel::Torque => &rows.input,
                };
                // A constant offset of an angle does not appear in its increments.
                if rows.channels[c].channel != Channel::Angle {
                    add(Coordinate::Log, entry, offset, &in_each(&ones));
                }
                if reading.len() == rows.len() {
                    add(Coordinate::Log, entry, scale, &in_each(reading));
                }
            }
            Entry::Voltage | Entry::MotorConstant | Entry::Encoder => {}
        }
    }
    if voltage {
        add(Coordinate::Log, Entry::Voltage, offset, &in_each(&ones));
        add(Coordinate::Log, Entry::Voltage, scale, &in_each(&rows.input));
        if rows.current.len() == rows.len() {
            let minus: Vec<f64> = map(&rows.current, |i| -i);
            add(Coordinate::Log, Entry::Voltage, ShapeKind::ByLog(Difference::Resistance), &in_each(&minus));
        }
    }
}

fn scaled(a: &[f64]) -> Vec<f64> {
    let most = largest(a);
    map(a, |v| v / most)
}

fn centred(a: &[f64]) -> Vec<f64> {
    let (low, high) = a.iter().copied().min_max();
    map(a, |v| v - 0.5 * (low + high))
}

/// Running mean over `width` rows.
fn smoothed(a: &[f64], width: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    for v in a {
        sums.push(sums[sums.len() - 1] + v);
    }
    let half = width / 2;
    (0..a.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(half), (k + half + 1).min(a.len()));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}

/// Angle, rad, and time, s, since the last reversal or start of the modelled rate.
pub fn since_reversal(rows: &ResidualRows) -> (Vec<f64>, Vec<f64>) {
    let threshold = 0.01 * largest(&rows.omega);
    let (mut angle, mut time) = (Vec::with_capacity(rows.len()), Vec::with_capacity(rows.len()));
    let (mut sign, mut turned, mut passed) = (0.0, f64::INFINITY, f64::INFINITY);
    for (k, w) in rows.omega.iter().enumerate() {
        if rows.begins[k] {
            (sign, turned, passed) = (w.signum(), f64::INFINITY, f64::INFINITY);
        }
        // Leaving zero counts as a start; a rate within the band keeps its last direction.
        let now = if *w == 0.0 {
            0.0
        } else if w.abs() > threshold || w.signum() == sign {
            w.signum()
        } else {
            sign
        };
        if now != sign {
            (sign, turned, passed) = (now, 0.0, 0.0);
        }
        turned += w.abs() * rows.dt_s;
        passed += rows.dt_s;
        angle.push(turned);
        time.push(passed);
    }
    (angle, time)
}

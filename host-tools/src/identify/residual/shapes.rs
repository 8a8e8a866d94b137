//! The shapes that are sought over each coordinate: few, so that noise is not learnt, and such as missing physics leaves.

use drive_model::Coordinate;

use super::rows::{Missing, Rows};
use crate::identify::fit::FitResult;
use crate::model::{Channel, Input};
use crate::statistics::Extremes;

/// How a shape enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acts {
    /// As a torque.
    Torque,
    /// As a voltage.
    Voltage,
    /// As a factor of the motor constant: torque and back-EMF.
    Constant,
    /// As what a channel (index) reads.
    Reading(usize),
    /// As an error of the encoder, in the angle and in a rate that is made from it.
    Encoder,
}

/// Shapes that stand and fall together.
#[derive(Debug, Clone)]
pub struct Family {
    /// Over what.
    pub coordinate: Coordinate,
    /// How.
    pub acts: Acts,
    /// What tells it from others of the same coordinate, for the words.
    pub kind: Kind,
    /// Responses of all channels, a column each.
    pub columns: Vec<Vec<f64>>,
}

/// What tells families of one coordinate apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A smooth function of the coordinate.
    Smooth,
    /// The same at all times.
    Constant,
    /// Friction that depends on the angle: times the sign of the rate.
    Friction,
    /// An order of the angle.
    Order(u32),
    /// A step at a time, s.
    Step(f64),
    /// A line at a frequency, Hz.
    Line(f64),
}

/// A function of the row.
pub type Along = Vec<f64>;

/// Product, row by row.
pub fn times(a: &[f64], b: &[f64]) -> Along {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

/// Function of a column.
pub fn of(a: &[f64], f: impl Fn(f64) -> f64) -> Along {
    a.iter().map(|v| f(*v)).collect()
}

fn largest(a: &[f64]) -> f64 {
    a.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()))
}

/// A rate below this part of the largest has no sign yet.
const SIGN: f64 = 0.003;
/// Steps in time that are tried.
const STEPS: usize = 32;

/// The column's response to a shape.
pub fn response(rows: &Rows, acts: Acts, shape: &[f64]) -> Vec<f64> {
    let none = Missing::default();
    match acts {
        Acts::Torque => rows.respond(Missing { torque: Some(shape), ..none }),
        Acts::Voltage => rows.respond(Missing { voltage: Some(shape), ..none }),
        Acts::Constant => {
            let (torque, back) = (times(shape, &rows.current), of(&times(shape, &rows.omega), |v| -v));
            rows.respond(Missing { torque: Some(&torque), voltage: (rows.driven == Input::Voltage).then_some(&back), ..none })
        }
        Acts::Reading(c) => rows.respond(Missing { reading: Some((c, shape)), ..none }),
        Acts::Encoder => rows.respond(Missing { encoder: Some(shape), ..none }),
    }
}

/// Sign of the rate, rounded a little at zero.
pub fn direction(rows: &Rows) -> Along {
    let small = SIGN * largest(&rows.omega);
    of(&rows.omega, |w| (w / small).tanh())
}

/// What fitted parameters and initial states already took out of the residual: shapes that are no finding.
pub fn taken(rows: &Rows, held: &FitResult) -> Vec<Vec<f64>> {
    let mut list = Vec::new();
    if rows.drive.is_none() {
        return list;
    }
    let n = rows.len();
    for (k, _) in rows.begins.iter().enumerate().filter(|(_, b)| **b).take(8) {
        let mut push = vec![0.0; n];
        push[k] = 1.0;
        list.push(response(rows, Acts::Torque, &push));
    }
    let fitted = |name: &str| held.parameters.list.iter().zip(&held.sigmas).any(|(p, s)| p.name == name && !p.fixed && *s > 0.0);
    if rows.omega.is_empty() {
        return list;
    }
    let ones = vec![1.0; n];
    let minus = |a: &[f64]| of(a, |v| -v);
    if fitted("inertia_kg_m2") {
        list.push(response(rows, Acts::Torque, &acceleration(rows)));
    }
    if fitted("viscous_N_m_s") {
        list.push(response(rows, Acts::Torque, &rows.omega));
    }
    if fitted("coulomb_N_m") {
        list.push(response(rows, Acts::Torque, &direction(rows)));
    }
    if rows.current.len() == n {
        if fitted("motor_constant_N_m_A") {
            list.push(response(rows, Acts::Constant, &ones));
        }
        if fitted("resistance_ohm") && rows.driven == Input::Voltage {
            list.push(response(rows, Acts::Voltage, &minus(&rows.current)));
        }
    }
    list
}

/// Modelled acceleration, rad/s².
fn acceleration(rows: &Rows) -> Along {
    (0..rows.len()).map(|k| rows.slope(&rows.omega, k)).collect()
}

/// All families but orders and lines, which are looked for by their spectra.
pub fn families(rows: &Rows) -> Vec<Family> {
    let mut list = Vec::new();
    let n = rows.len();
    let mut add = |coordinate, acts, kind, shapes: Vec<Along>| {
        let columns = shapes.iter().map(|s| response(rows, acts, s)).collect();
        list.push(Family { coordinate, acts, kind, columns });
    };
    let mut acting: Vec<Acts> = (0..rows.channels.len()).map(Acts::Reading).collect();
    if rows.drive.is_some() {
        acting.push(Acts::Torque);
    }
    let voltage = rows.drive.is_some() && rows.driven == Input::Voltage;
    let reads = |acts: Acts, channel: Channel| matches!(acts, Acts::Reading(c) if rows.channels[c].channel == channel);
    let ones = vec![1.0; n];
    let known = |a: &[f64]| a.len() == n && a.iter().all(|v| v.is_finite()) && a.iter().any(|v| *v != a[0]);
    let moving = known(&rows.omega);
    let (w, i) = (scaled(&rows.omega), scaled(&rows.current));
    let s = if moving { direction(rows) } else { Vec::new() };
    let bump = |width: f64| times(&s, &of(&w, |w| (-(w / width).powi(2)).exp()));
    if moving {
        let shapes = vec![
            ones.clone(),
            s.clone(),
            w.clone(),
            of(&w, f64::abs),
            of(&w, |w| w * w.abs()),
            of(&w, |w| w.powi(3)),
            bump(0.04),
            bump(0.12),
        ];
        // An angle that is read with the rate in it is late: its increments show the acceleration.
        for &acts in acting.iter().filter(|a| !reads(**a, Channel::Angle)) {
            add(Coordinate::Omega, acts, Kind::Smooth, shapes.clone());
        }
        let a = scaled(&acceleration(rows));
        for &acts in acting.iter().filter(|a| **a != Acts::Torque) {
            let a = if reads(acts, Channel::Angle) { &w } else { &a };
            add(Coordinate::Acceleration, acts, Kind::Smooth, vec![a.clone(), of(a, |a| a * a.abs())]);
        }
        let (angle, time) = since_reversal(rows);
        let fading = |x: &[f64], over: f64| times(&s, &of(x, |x| (-x / over).exp()));
        let shapes: Vec<Along> =
            [0.02, 0.1, 0.5].iter().map(|d| fading(&angle, *d)).chain([0.03, 0.15, 0.6].iter().map(|d| fading(&time, *d))).collect();
        for &acts in &acting {
            add(Coordinate::History, acts, Kind::Smooth, shapes.clone());
        }
    }
    if known(&rows.current) {
        let small = 0.01;
        let sign = of(&i, |i| (i / small).tanh());
        let shapes = vec![ones.clone(), sign, i.clone(), of(&i, f64::abs), of(&i, |i| i * i.abs()), of(&i, |i| i.powi(3))];
        for &acts in acting.iter().filter(|a| !reads(**a, Channel::Rate)) {
            add(Coordinate::Current, acts, Kind::Smooth, shapes.clone());
        }
        if voltage {
            add(Coordinate::Current, Acts::Voltage, Kind::Smooth, shapes);
        }
        if moving && rows.drive.is_some() {
            add(Coordinate::Current, Acts::Constant, Kind::Smooth, vec![of(&i, f64::abs), of(&i, |i| i * i)]);
        }
    }
    if known(&rows.temp_C) {
        let smooth = smoothed(&rows.temp_C, (1.0 / rows.dt_s) as usize);
        let t = scaled(&centred(&smooth));
        for &acts in &acting {
            let mut shapes = vec![ones.clone(), t.clone()];
            if moving {
                shapes.push(times(&t, &w));
                shapes.push(times(&t, &s));
            }
            if reads(acts, Channel::Current) && known(&rows.current) {
                shapes.push(times(&t, &i));
            }
            add(Coordinate::Temperature, acts, Kind::Smooth, shapes);
        }
        if voltage && known(&rows.current) {
            add(Coordinate::Temperature, Acts::Voltage, Kind::Smooth, vec![times(&t, &i), times(&t, &w)]);
        }
    }
    // A constant torque is friction's to the reader, a constant reading an offset that was always there.
    if rows.drive.is_some() {
        add(Coordinate::Omega, Acts::Torque, Kind::Constant, vec![ones.clone()]);
    }
    for &acts in acting.iter().filter(|a| reads(**a, Channel::Rate) || reads(**a, Channel::Current)) {
        add(Coordinate::Time, acts, Kind::Constant, vec![ones.clone()]);
    }
    let t = scaled(&centred(&rows.t_s));
    for &acts in &acting {
        add(Coordinate::Time, acts, Kind::Smooth, vec![ones.clone(), t.clone(), of(&t, |t| t * t)]);
    }
    for k in 1..STEPS {
        let from = n * k / STEPS;
        let step = (0..n).map(|row| f64::from(u8::from(row >= from))).collect();
        let acts = if rows.drive.is_some() { Acts::Torque } else { Acts::Reading(0) };
        add(Coordinate::Time, acts, Kind::Step(rows.t_s[from]), vec![step]);
    }
    if known(&rows.theta) {
        let turned = scaled(&centred(&rows.theta));
        let waves = |orders: std::ops::RangeInclusive<u32>| -> Vec<Along> {
            orders
                .flat_map(|n| {
                    let n = f64::from(n);
                    [of(&rows.theta, |x| (n * x).cos()), of(&rows.theta, |x| (n * x).sin())]
                })
                .collect()
        };
        for &acts in acting.iter().filter(|a| !reads(**a, Channel::Angle)) {
            add(Coordinate::Theta, acts, Kind::Smooth, vec![ones.clone(), turned.clone(), of(&turned, |t| t * t)]);
        }
        if moving && rows.drive.is_some() {
            let shapes = waves(1..=3).iter().map(|wave| times(wave, &s)).collect();
            add(Coordinate::Theta, Acts::Torque, Kind::Friction, shapes);
        }
    }
    list
}

fn scaled(a: &[f64]) -> Along {
    let most = largest(a);
    of(a, |v| v / most)
}

fn centred(a: &[f64]) -> Along {
    let (low, high) = a.iter().copied().min_max();
    of(a, |v| v - 0.5 * (low + high))
}

/// Running mean over `width` rows.
fn smoothed(a: &[f64], width: usize) -> Along {
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

/// Angle turned and time passed since the modelled rate last changed its sign or left rest.
pub fn since_reversal(rows: &Rows) -> (Along, Along) {
    let moves = 0.01 * largest(&rows.omega);
    let (mut angle, mut time) = (Vec::with_capacity(rows.len()), Vec::with_capacity(rows.len()));
    let (mut sign, mut turned, mut passed) = (0.0, f64::INFINITY, f64::INFINITY);
    for (k, w) in rows.omega.iter().enumerate() {
        if rows.begins[k] {
            (sign, turned, passed) = (w.signum(), f64::INFINITY, f64::INFINITY);
        }
        // Leaving zero is what counts; a rate within the band keeps its last direction.
        let now = if *w == 0.0 {
            0.0
        } else if w.abs() > moves || w.signum() == sign {
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

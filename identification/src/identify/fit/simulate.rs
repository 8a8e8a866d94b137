//! Simulation of the model along a log.

use std::ops::Range;

use drive_model::{Reading, Scalar};
use drive_rig::{DriveState, Rig, RowInput};

use super::initial_states::{InitialStateKind, state};
use super::measurement::{MeasurementChain, Row};
use super::parameters::DerivativeScalar;
use crate::model::{Channel, Input};
use crate::recording::predictor::Predictor;
use crate::recording::prepare::is_of_sensor;
use crate::recording::prepared_log::{ComparedChannel, PreparedLog};

/// Simulates one segment and calls `visit(channel, row, value)` with each compared value, until it returns false. Counts the rows in the
/// budget of the data.
///
/// `kinds` and `values` are the initial states; `free` is the number of free parameters, whose derivatives precede those of the states.
pub fn run<S: DerivativeScalar>(
    rig: &Rig<S>,
    data: &PreparedLog,
    segment: usize,
    (kinds, values): (&[InitialStateKind], &[f64]),
    free: usize,
    visit: &mut impl FnMut(usize, usize, &S) -> bool,
) {
    let begin = data.segments[segment].start;
    let mut end = begin;
    run_uncounted(rig, data, segment, (kinds, values), free, &mut |channel, row, value| {
        end = row + 1;
        visit(channel, row, value)
    });
    data.budget.spend(end - begin, 1 + S::DERIVATIVES);
}

fn run_uncounted<S: DerivativeScalar>(
    rig: &Rig<S>,
    data: &PreparedLog,
    segment: usize,
    starts: (&[InitialStateKind], &[f64]),
    free: usize,
    visit: &mut impl FnMut(usize, usize, &S) -> bool,
) {
    if data.driven == Input::Motion {
        return prescribed_motion(rig, data, segment, visit);
    }
    let end = data.segments[segment].end;
    Simulation::new(rig, data, segment, starts, free).advance(end, visit);
}

/// A simulation of one segment, which can be advanced in parts: of a drive, not of a prescribed motion.
pub struct Simulation<'r, 'd, 'l, S: DerivativeScalar> {
    rig: &'r Rig<S>,
    data: &'d PreparedLog<'l>,
    rows: Range<usize>,
    /// The next row.
    row: usize,
    chains: Vec<MeasurementChain<S>>,
    state: DriveState<S>,
    /// The current is compared at the time of the row.
    instant: bool,
    needs_current_slope: bool,
    /// The state is no longer finite, or the rows do not resolve the model: all further values are NaN, which makes χ² infinite.
    diverged: bool,
}

impl<'r, 'd, 'l, S: DerivativeScalar> Simulation<'r, 'd, 'l, S> {
    /// The simulation before its first row. `kinds` and `values` are the initial states; `free` is the number of free parameters, whose
    /// derivatives precede those of the states.
    pub fn new(
        rig: &'r Rig<S>,
        data: &'d PreparedLog<'l>,
        segment: usize,
        (kinds, values): (&[InitialStateKind], &[f64]),
        free: usize,
    ) -> Self {
        let rows = data.segments[segment].clone();
        let chains: Vec<MeasurementChain<S>> = (0..data.channels.len()).map(|c| MeasurementChain::new(data, c, rig.structure())).collect();
        let theta = data.theta.map_or(0.0, |theta| theta[rows.start]);
        let needs_current_slope = chains.iter().any(MeasurementChain::needs_current_slope);
        let instant = data.channels.iter().any(|c| c.instant && c.channel == Channel::Current);
        let state = state::<S>(kinds, values, free, theta);
        let diverged = !rig.resolves(data.dt_s);
        Simulation { rig, data, row: rows.start, rows, chains, state, instant, needs_current_slope, diverged }
    }

    /// Simulates the rows before `end` and calls `visit(channel, row, value)` with each compared value, until it returns false; whether it
    /// never did.
    pub fn advance(&mut self, end: usize, visit: &mut impl FnMut(usize, usize, &S) -> bool) -> bool {
        while self.row < end {
            let row = self.row;
            self.row += 1;
            if self.diverged {
                if !(0..self.chains.len()).all(|c| visit(c, row, &S::from(f64::NAN))) {
                    return false;
                }
                continue;
            }
            let goes_on = match self.data.predictor.as_deref() {
                Some(predictor) => self.follow(predictor, row, visit),
                None => self.run_free(row, visit),
            };
            if !goes_on {
                return false;
            }
            self.diverged = !self.state.omega.re().is_finite();
        }
        true
    }

    /// One row of a free run.
    #[inline]
    fn run_free(&mut self, row: usize, visit: &mut impl FnMut(usize, usize, &S) -> bool) -> bool {
        let span = self.data.row_input(row, self.rows.end);
        let (before, reading, current_slope_A_s) = self.step(&span);
        let read = Row { input: &span, omega: before.0, theta: before.1, reading: &reading, current_slope_A_s };
        for (c, chain) in self.chains.iter_mut().enumerate() {
            if let Some(value) = chain.push(&read)
                && !visit(c, row, &value)
            {
                return false;
            }
        }
        true
    }

    /// One row that follows the measurement: the state is corrected by each innovation; values are predictions from all earlier values.
    fn follow(&mut self, predictor: &Predictor, row: usize, visit: &mut impl FnMut(usize, usize, &S) -> bool) -> bool {
        let data = self.data;
        let begin = self.rows.start;
        let of_motion = |c: usize| matches!(data.channels[c].channel, Channel::Rate | Channel::Angle);
        let span = data.row_input(row, self.rows.end);
        for c in (0..self.chains.len()).filter(|&c| of_motion(c)) {
            let state = &self.state;
            let reading = self.rig.read((state.omega, state.theta, state.heat_K), &span, state.current);
            let read = Row { input: &span, omega: state.omega, theta: state.theta, reading: &reading, current_slope_A_s: S::zero() };
            let Some(value) = self.chains[c].push(&read) else { continue };
            if !visit(c, row, &value) {
                return false;
            }
            if let Some(target) = data.target(c, row, begin) {
                predictor.correct(c, -value + target, &mut self.state);
            }
        }
        let (before, reading, current_slope_A_s) = self.step(&span);
        for (c, chain) in self.chains.iter_mut().enumerate() {
            if of_motion(c) {
                chain.correct(before.0, before.1, &reading);
                continue;
            }
            let read = Row { input: &span, omega: before.0, theta: before.1, reading: &reading, current_slope_A_s };
            let Some(value) = chain.push(&read) else { continue };
            if !visit(c, row, &value) {
                return false;
            }
            if let Some(target) = data.target(c, row, begin) {
                predictor.correct(c, -value + target, &mut self.state);
            }
        }
        true
    }

    /// Advances the state over a row. Returns rate, angle and temperature rise before it, the readings of the row, and the slope of the
    /// current within it, A/s.
    #[inline]
    fn step(&mut self, span: &RowInput) -> ((S, S, S), Reading<S>, S) {
        let (rig, state) = (self.rig, &mut self.state);
        let before = (state.omega, state.theta, state.heat_K);
        let now = self.instant.then(|| rig.current_now(state, span));
        let mean = rig.advance(state, span);
        let reading = rig.read(before, span, now.unwrap_or(mean));
        let current_slope_A_s = match now.filter(|_| self.needs_current_slope) {
            Some(now) => (rig.current_now(state, span) - now) / span.dt_s,
            None => S::zero(),
        };
        (before, reading, current_slope_A_s)
    }
}

/// Half of the window for the differentiation of a prescribed motion, s.
const MOTION_HALF_WINDOW_S: f64 = 0.1;
/// Rows on each side of it at least.
const MIN_ROWS_BESIDE: usize = 2;

/// Prescribed motion: rate and acceleration from a local polynomial, then the required torque, current or voltage, or the reading of a
/// sensor of rate or angle.
fn prescribed_motion<S: Scalar>(rig: &Rig<S>, data: &PreparedLog, segment: usize, visit: &mut impl FnMut(usize, usize, &S) -> bool) {
    let rows = data.segments[segment].clone();
    let quantum = data.channels.iter().find_map(|c| c.quantum.filter(|_| c.channel == Channel::Angle)).unwrap_or(0.0);
    // Below half a count per window the sign of the rate is not resolved.
    let resolved_rate = (0.5 * quantum / MOTION_HALF_WINDOW_S).max(1e-6);
    let is_sensor = |c: &ComparedChannel| is_of_sensor(c.channel);
    let mut chains: Vec<Option<MeasurementChain<S>>> = data
        .channels
        .iter()
        .enumerate()
        .map(|(c, channel)| is_sensor(channel).then(|| MeasurementChain::new(data, c, rig.structure())))
        .collect();
    let mut demands = Window::new(data, rows.clone());
    for row in rows.clone() {
        let mut span = data.row_input(row, rows.end);
        let required = (!data.channels.iter().all(is_sensor)).then(|| {
            let [at, omega, alpha] = demands.motion(row);
            span.theta = Some((at, at));
            let measured = data.current.map_or(0.0, |i| i[row]);
            rig.demand(&span, omega, alpha, (omega / resolved_rate).clamp(-1.0, 1.0), measured)
        });
        let known = data.known_motion.as_ref().map(|motion| motion[row]);
        for (c, channel) in data.channels.iter().enumerate() {
            let value = match (channel.channel, &required, known) {
                (Channel::Current, Some(required), _) => required.current,
                (Channel::Voltage, Some(required), _) => required.voltage,
                (Channel::Torque, Some(required), _) => required.torque,
                (Channel::Rate | Channel::Angle, _, Some(motion)) => {
                    // The angle itself is known to its noise; the cubic through it would round it where the acceleration jumps.
                    let theta = if channel.channel == Channel::Angle { data.input[row] } else { motion.theta_rad };
                    let (omega, theta) = (S::from(motion.omega_rad_s), S::from(theta));
                    let reading = rig.read((omega, theta, S::zero()), &span, S::zero());
                    let read = Row { input: &span, omega, theta, reading: &reading, current_slope_A_s: S::zero() };
                    match chains[c].as_mut().and_then(|chain| chain.push(&read)) {
                        // The chain has its time constants in evenly spaced rows; the age changes from row to row.
                        Some(value) if channel.channel == Channel::Angle => value,
                        Some(value) if motion.is_resolved => value + motion.aged_rad_s,
                        _ => continue,
                    }
                }
                _ => continue,
            };
            if !visit(c, row, &value) {
                return;
            }
        }
    }
}

/// A window that moves along the rows of a segment.
struct Window<'d> {
    t_s: &'d [f64],
    theta: &'d [f64],
    begin: usize,
    from: usize,
    to: usize,
}

impl<'d> Window<'d> {
    fn new(data: &'d PreparedLog, rows: std::ops::Range<usize>) -> Self {
        Window { t_s: &data.t_s[rows.clone()], theta: &data.input[rows.clone()], begin: rows.start, from: 0, to: 0 }
    }

    /// Angle, rate and acceleration at a row, by a parabola through the points of the window; the rows must not decrease.
    fn motion(&mut self, row: usize) -> [f64; 3] {
        let (t, k) = (self.t_s, row - self.begin);
        while t[k] - t[self.from] > MOTION_HALF_WINDOW_S {
            self.from += 1;
        }
        while self.to + 1 < t.len() && t[self.to + 1] - t[k] <= MOTION_HALF_WINDOW_S {
            self.to += 1;
        }
        let (a, b) = (self.from.min(k.saturating_sub(MIN_ROWS_BESIDE)), self.to.max((k + MIN_ROWS_BESIDE).min(t.len() - 1)));
        parabola(&t[a..=b], &self.theta[a..=b], t[k])
    }
}

/// Value, slope and curvature at `at` of the least-squares parabola through the points.
fn parabola(t: &[f64], y: &[f64], at: f64) -> [f64; 3] {
    let (mut s, mut b) = ([0.0; 5], [0.0; 3]);
    let y0 = y[0];
    for (&t, &y) in t.iter().zip(y) {
        let x = t - at;
        let mut power = 1.0;
        for (k, s) in s.iter_mut().enumerate() {
            *s += power;
            if k < 3 {
                b[k] += power * (y - y0);
            }
            power *= x;
        }
    }
    let m = nalgebra::Matrix3::new(s[0], s[1], s[2], s[1], s[2], s[3], s[2], s[3], s[4]);
    match m.lu().solve(&nalgebra::Vector3::new(b[0], b[1], b[2])) {
        Some(c) => [y0 + c[0], c[1], 2.0 * c[2]],
        None => [y0, 0.0, 0.0],
    }
}

//! The model runs along a log.

use std::sync::Arc;

use drive_model::{Law, Scalar};
use drive_rig::{Base, Rig, State};

use super::measurement::{MeasurementChain, Row};
use super::parameters::{DerivativeScalar, Parameters};
use super::prepared_log::PreparedLog;
use crate::model::{Channel, Input};

/// Where the law of an effect comes from: it must be there for every scalar.
pub trait LawSource: Send + Sync {
    /// The law in `f64`.
    fn plain(&self) -> Box<dyn Law<f64>>;
    /// The law with eight derivatives.
    fn dual8(&self) -> Box<dyn Law<super::parameters::Dual<8>>>;
    /// The law with twelve derivatives.
    fn dual12(&self) -> Box<dyn Law<super::parameters::Dual<12>>>;
    /// The law with sixteen derivatives.
    fn dual16(&self) -> Box<dyn Law<super::parameters::Dual<16>>>;
    /// The law with thirty-two derivatives.
    fn dual32(&self) -> Box<dyn Law<super::parameters::Dual<32>>>;
}

/// A scalar in which every source gives its law.
pub trait LawScalar: DerivativeScalar {
    /// The law of `source` in this scalar.
    fn law(source: &dyn LawSource) -> Box<dyn Law<Self>>;
}
impl LawScalar for f64 {
    fn law(source: &dyn LawSource) -> Box<dyn Law<f64>> {
        source.plain()
    }
}
macro_rules! sourced {
    ($($n:literal $make:ident),*) => {$(
        impl LawScalar for super::parameters::Dual<$n> {
            fn law(source: &dyn LawSource) -> Box<dyn Law<Self>> {
                source.$make()
            }
        }
    )*};
}
sourced!(8 dual8, 12 dual12, 16 dual16, 32 dual32);

/// An effect of the model: its law and where its parameters stand in the list.
#[derive(Clone)]
pub struct Effect {
    /// Name in the model, e.g. `cogging#2`.
    pub name: String,
    /// The law.
    pub source: Arc<dyn LawSource>,
    /// Indices of its parameters, in the law's order.
    pub parameters: Vec<usize>,
}

/// The model of a fit: parameters, which of them are the base, and effects.
#[derive(Clone)]
pub struct System {
    /// Index of the inertia; a slow prescribed motion may do without.
    pub inertia: Option<usize>,
    /// Index of the motor constant, where the input needs one.
    pub motor_constant: Option<usize>,
    /// Index of the resistance, where the input needs one.
    pub resistance: Option<usize>,
    /// The effects.
    pub effects: Vec<Effect>,
}

impl System {
    /// The rig at these parameters.
    pub fn rig<S: LawScalar>(&self, parameters: &Parameters, driven: Input) -> Rig<S> {
        let values: Vec<S> = parameters.seeded();
        let one = S::one();
        let base = Base {
            inertia: self.inertia.map_or(S::zero(), |k| values[k]),
            motor_constant: self.motor_constant.map_or(one, |k| values[k]),
            resistance: self.resistance.map_or(one, |k| values[k]),
        };
        let input = match driven {
            Input::Voltage => drive_rig::Input::Voltage,
            Input::Current => drive_rig::Input::Current,
            Input::Torque | Input::Motion => drive_rig::Input::Torque,
        };
        let effects = self.effects.iter().map(|e| (S::law(e.source.as_ref()), e.parameters.iter().map(|&k| values[k]).collect())).collect();
        Rig::new(base, input, effects)
    }
}

/// Which initial states a segment has besides the rate; a lane of the fit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InitialStateKind {
    /// Rate, rad/s.
    Rate,
    /// Current, A.
    Current,
    /// Twist of the shaft, rad.
    Twist,
    /// Deflection of the bristle, rad.
    Bristle,
    /// Winding temperature above 25 °C, K.
    Heat,
}

/// The initial states that this model has.
pub fn initial_state_kinds(rig: &Rig<f64>, record: &PreparedLog) -> Vec<InitialStateKind> {
    let mut list = Vec::new();
    if record.driven == Input::Motion {
        return list;
    }
    list.push(InitialStateKind::Rate);
    let structure = rig.structure();
    if structure.inductance_H.is_some() && record.driven == Input::Voltage {
        list.push(InitialStateKind::Current);
    }
    if structure.shaft.is_some() {
        list.push(InitialStateKind::Twist);
    }
    if structure.bristle_N_m_rad.is_some() {
        list.push(InitialStateKind::Bristle);
    }
    if structure.thermal.is_some() && record.temp_C.is_none() {
        list.push(InitialStateKind::Heat);
    }
    list
}

/// The state at the begin of a segment, seeded behind the `free` parameter lanes.
fn begin<S: DerivativeScalar>(kinds: &[InitialStateKind], values: &[f64], free: usize, theta: f64) -> State<S> {
    let mut state = State::turning(S::zero(), S::from(theta));
    for (k, (kind, &value)) in kinds.iter().zip(values).enumerate() {
        let seeded = S::seeded(value, free + k, 1.0);
        match kind {
            InitialStateKind::Rate => {
                state.omega = seeded;
                state.motor_omega = seeded;
            }
            InitialStateKind::Current => state.current = seeded,
            InitialStateKind::Twist => state.twist = seeded,
            InitialStateKind::Bristle => state.bristle = seeded,
            InitialStateKind::Heat => state.heat_K = seeded,
        }
    }
    state
}

/// Runs the model along one segment and hands every compared value to `visit(channel, row, value)`, for as long as it says to go on.
pub fn run<S: DerivativeScalar>(
    rig: &Rig<S>,
    record: &PreparedLog,
    segment: usize,
    (kinds, values): (&[InitialStateKind], &[f64]),
    free: usize,
    visit: &mut impl FnMut(usize, usize, &S) -> bool,
) {
    let rows = record.segments[segment].clone();
    if record.driven == Input::Motion {
        return demand(rig, record, segment, visit);
    }
    if !rig.resolves(record.dt_s) {
        for row in rows {
            for c in 0..record.channels.len() {
                if !visit(c, row, &S::from(f64::NAN)) {
                    return;
                }
            }
        }
        return;
    }
    let mut chains: Vec<MeasurementChain<S>> =
        (0..record.channels.len()).map(|c| MeasurementChain::new(record, c, rig.structure())).collect();
    let theta = record.theta.map_or(0.0, |theta| theta[rows.start]);
    let follows_current = chains.iter().any(MeasurementChain::follows_current);
    let instant = record.channels.iter().any(|c| c.instant && c.channel == Channel::Current);
    let mut state = begin::<S>(kinds, values, free, theta);
    for row in rows.clone() {
        let span = record.span(row, rows.end);
        let before = (state.omega, state.theta, state.heat_K);
        let now = instant.then(|| rig.current_now(&state, &span));
        let mean = rig.advance(&mut state, &span);
        let reading = rig.read(before, &span, now.unwrap_or(mean));
        let current_slope_A_s = match now.filter(|_| follows_current) {
            Some(now) => (rig.current_now(&state, &span) - now) / span.dt_s,
            None => S::zero(),
        };
        let read = Row { span: &span, omega: before.0, theta: before.1, reading: &reading, current_slope_A_s };
        for (c, chain) in chains.iter_mut().enumerate() {
            if let Some(value) = chain.push(&read)
                && !visit(c, row, &value)
            {
                return;
            }
        }
        // A diverging step is no use further on; the cost of what is left is infinite and the step is refused.
        if !state.omega.re().is_finite() {
            for rest in row + 1..rows.end {
                for c in 0..chains.len() {
                    if !visit(c, rest, &S::from(f64::NAN)) {
                        return;
                    }
                }
            }
            return;
        }
    }
}

/// Half of the window over which a prescribed motion is differentiated, s.
const MOTION_HALF_WINDOW_S: f64 = 0.1;

/// The prescribed motion: rate and acceleration by a local parabola, then what they need of the drive.
fn demand<S: Scalar>(rig: &Rig<S>, record: &PreparedLog, segment: usize, visit: &mut impl FnMut(usize, usize, &S) -> bool) {
    let rows = record.segments[segment].clone();
    let theta = &record.input[rows.clone()];
    let t = &record.t_s[rows.clone()];
    let quantum = record.channels.iter().find_map(|c| c.quantum.filter(|_| c.channel == Channel::Angle)).unwrap_or(0.0);
    // A rate below half a count per window has no sign that the encoder could tell.
    let still = (0.5 * quantum / MOTION_HALF_WINDOW_S).max(1e-6);
    let (mut from, mut to) = (0, 0);
    for k in 0..t.len() {
        while t[k] - t[from] > MOTION_HALF_WINDOW_S {
            from += 1;
        }
        while to + 1 < t.len() && t[to + 1] - t[k] <= MOTION_HALF_WINDOW_S {
            to += 1;
        }
        // At least five points, so that the parabola is determined.
        let (a, b) = (from.min(k.saturating_sub(2)), to.max((k + 2).min(t.len() - 1)));
        let (at, omega, alpha) = parabola(&t[a..=b], &theta[a..=b], t[k]);
        let row = rows.start + k;
        let mut span = record.span(row, rows.end);
        span.theta = Some((at, at));
        let measured = record.current.map_or(0.0, |i| i[row]);
        let need = rig.demand(&span, omega, alpha, (omega / still).clamp(-1.0, 1.0), measured);
        for (c, channel) in record.channels.iter().enumerate() {
            let value = match channel.channel {
                Channel::Current => need.current,
                Channel::Voltage => need.voltage,
                Channel::Torque => need.torque,
                _ => continue,
            };
            if !visit(c, row, &value) {
                return;
            }
        }
    }
}

/// Value, slope and curvature at `at` of the least-squares parabola through the points.
fn parabola(t: &[f64], y: &[f64], at: f64) -> (f64, f64, f64) {
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
        Some(c) => (y0 + c[0], c[1], 2.0 * c[2]),
        None => (y0, 0.0, 0.0),
    }
}

//! The inverse model as a linear regression: one column for each free parameter.
//!
//! The columns are differences of [`Rig::demand`](drive_rig::Rig::demand), so that any effect that is linear in its parameters works, also
//! a user's own, and no equation exists twice. The coordinates of an amplitude with its phase are a·cos φ and a·sin φ. The linearity of the
//! model is tested.

use drive_model::{ParameterKind, Structure};
use nalgebra::DMatrix;

use super::InverseModelCause;
use super::motion::Motion;
use crate::identify::fit::{Parameters, System};
use crate::model::{Channel, Input, Model, SummingPoint};
use crate::recording::PreparedLog;
use crate::statistics::Extremes;

/// An inverse model along measured motions.
pub(super) struct Inverse<'a> {
    pub system: &'a System,
    pub data: &'a PreparedLog<'a>,
    pub motions: &'a [Motion],
    /// The explained channel: the input of the model, or for a prescribed motion its first output.
    pub explained: Channel,
    /// Rate below which the encoder does not resolve the sign, rad/s.
    pub resolved_rate_rad_s: f64,
}

/// Values of all motions, one after the other.
pub(super) type Series = Vec<f64>;

/// Relative rounding error after some thousand operations.
const ROUNDING: f64 = 1e-7;
/// Relative rounding error with respect to much larger terms.
const CANCELLATION: f64 = 1e-13;
/// Least number of rows for the test of linearity.
const TEST_ROWS: usize = 500;

impl Inverse<'_> {
    /// Torque, current or voltage that the model requires with these parameters, at every `stride`-th point.
    pub fn required(&self, parameters: &Parameters, stride: usize) -> Series {
        let rig = self.system.rig::<f64>(parameters, self.data.driven);
        let mut series = Series::new();
        for motion in self.motions {
            for k in (0..motion.t_s.len()).step_by(stride) {
                let row = motion.row[k];
                let mut span = self.data.row_input(row, row + 1);
                span.t_s = motion.t_s[k];
                span.theta = Some((motion.theta[k], motion.theta[k]));
                let direction = (motion.omega[k] / self.resolved_rate_rad_s).clamp(-1.0, 1.0);
                let current = self.data.current.map_or(0.0, |i| i[row]);
                let required = rig.demand(&span, motion.omega[k], motion.alpha[k], direction, current);
                series.push(match self.explained {
                    Channel::Current => required.current,
                    Channel::Voltage => required.voltage,
                    _ => required.torque,
                });
            }
        }
        series
    }

    /// Number of points of all motions.
    pub fn len(&self) -> usize {
        self.motions.iter().map(|m| m.t_s.len()).sum()
    }

    /// Required values with all free parameters zero, and the column of each free parameter.
    pub fn columns(&self, parameters: &Parameters) -> Result<(Series, Vec<Series>), InverseModelCause> {
        let here = coordinates(parameters);
        let rest = self.required(&moved(parameters, &vec![0.0; here.len()]), 1);
        let steps: Vec<f64> = here.iter().map(|&c| if c == 0.0 { 1.0 } else { c }).collect();
        let mut columns = Vec::with_capacity(here.len());
        for index in 0..here.len() {
            let mut one = vec![0.0; here.len()];
            one[index] = steps[index];
            let with = self.required(&moved(parameters, &one), 1);
            columns.push(with.iter().zip(&rest).map(|(with, rest)| (with - rest) / steps[index]).collect::<Series>());
        }
        self.check_linear(parameters, &here, &steps, &columns)?;
        Ok((rest, columns))
    }

    /// Tests at steps of one parameter at a time that the columns describe the model, and that no column is zero.
    fn check_linear(&self, parameters: &Parameters, here: &[f64], steps: &[f64], columns: &[Series]) -> Result<(), InverseModelCause> {
        let stride = (self.len() / TEST_ROWS).max(1);
        let start = self.required(parameters, stride);
        let (mut nonlinear, mut coupled, mut zero) = (Vec::new(), Vec::new(), Vec::new());
        for index in 0..here.len() {
            let away = |by: f64| {
                let mut there = here.to_vec();
                there[index] += by * steps[index];
                self.required(&moved(parameters, &there), stride)
            };
            let (one, two) = (away(1.0), away(2.0));
            // Relative to the influence of this parameter, so that the nonlinearity of a small effect is found beside a large inertia.
            let own = one.iter().zip(&start).map(|(o, s)| o - s).max_abs();
            let all = start.iter().chain(&two).copied().max_abs();
            let linear = |off: f64| off.abs() <= ROUNDING * own + CANCELLATION * all;
            let column = self.strided(&columns[index], stride);
            let name = || parameters.list[parameters.free()[index]].name.clone();
            if !(0..start.len()).all(|k| linear(two[k] - 2.0 * one[k] + start[k])) {
                nonlinear.push(name());
            } else if !(0..start.len()).all(|k| linear(one[k] - start[k] - column[k] * steps[index])) {
                coupled.push(name());
            }
            if columns[index].iter().all(|c| *c == 0.0) {
                zero.push(name());
            }
        }
        // A product of two parameters is linear in each of them: both are named if none is nonlinear alone.
        let nonlinear = if nonlinear.is_empty() { coupled } else { nonlinear };
        match (nonlinear.is_empty(), zero.is_empty()) {
            (false, _) => Err(InverseModelCause::NotLinear(nonlinear.join(", "))),
            (_, false) => Err(InverseModelCause::NoInfluence(zero.join(", "))),
            _ => Ok(()),
        }
    }

    /// Every `stride`-th point of each motion.
    fn strided(&self, series: &[f64], stride: usize) -> Series {
        let mut from = 0;
        let mut picked = Series::new();
        for motion in self.motions {
            picked.extend(series[from..from + motion.t_s.len()].iter().step_by(stride));
            from += motion.t_s.len();
        }
        picked
    }
}

/// Refuses effects that change the structure, change a reading, or have a state.
pub(super) fn check_effects(
    model: &Model,
    system: &System,
    parameters: &Parameters,
    temperature_is_measured: bool,
) -> Result<(), InverseModelCause> {
    for effect in &system.effects {
        let law = effect.source.plain();
        let mut structure = Structure::default();
        let values: Vec<f64> = effect.parameters.iter().map(|&k| parameters.list[k].value).collect();
        law.configure(&values, &mut structure);
        if law.has_no_contribution() || (structure.thermal.is_some() && !temperature_is_measured) {
            return Err(InverseModelCause::NotInvertible(effect.name.clone()));
        }
    }
    let is_reading = |place: SummingPoint| matches!(place, SummingPoint::Rate | SummingPoint::Angle | SummingPoint::Current);
    match model.user_effects().iter().find(|own| is_reading(own.summing_point)) {
        Some(own) => Err(InverseModelCause::NotInvertible(own.name.clone())),
        None => Ok(()),
    }
}

/// The explained channel: the input, or for a prescribed motion the first output.
pub(super) fn explained(data: &PreparedLog) -> Channel {
    match data.driven {
        Input::Torque => Channel::Torque,
        Input::Current => Channel::Current,
        Input::Voltage => Channel::Voltage,
        Input::Motion | Input::Setpoint => data.channels.first().map_or(Channel::Torque, |c| c.channel),
    }
}

/// Indices of (amplitude, phase) of the pair that contains `k`, if both are free.
fn pair(parameters: &Parameters, k: usize) -> Option<(usize, usize)> {
    let partner = parameters.list[k].polar.filter(|p| parameters.free().contains(p))?;
    Some(if parameters.list[k].kind == ParameterKind::Phase { (partner, k) } else { (k, partner) })
}

/// Coordinates of the free parameters in which the inverse model is linear.
pub(super) fn coordinates(parameters: &Parameters) -> Vec<f64> {
    let value = |k: usize| parameters.list[k].value;
    let of = |&k: &usize| match pair(parameters, k) {
        Some((amplitude, phase)) if k == amplitude => value(amplitude) * value(phase).cos(),
        Some((amplitude, phase)) => value(amplitude) * value(phase).sin(),
        None => value(k),
    };
    parameters.free().iter().map(of).collect()
}

/// The parameters at these coordinates.
pub(super) fn moved(parameters: &Parameters, coordinates: &[f64]) -> Parameters {
    let mut next = parameters.clone();
    let free = parameters.free();
    let at = |k: usize| free.iter().position(|&f| f == k).map_or(0.0, |index| coordinates[index]);
    for &k in &free {
        next.list[k].value = match pair(parameters, k) {
            Some((amplitude, phase)) if k == amplitude => at(amplitude).hypot(at(phase)),
            Some((amplitude, phase)) => at(phase).atan2(at(amplitude)).rem_euclid(std::f64::consts::TAU),
            None => at(k),
        };
    }
    next
}

/// Standard errors of all parameters from the covariance of the coordinates.
pub(super) fn sigmas(parameters: &Parameters, covariance: &DMatrix<f64>) -> Vec<f64> {
    // `Parameters::sigmas` expects logarithms and logits as coordinates.
    let slope: Vec<f64> = parameters
        .free()
        .iter()
        .map(|&k| match parameters.list[k].kind {
            ParameterKind::Positive => parameters.list[k].value,
            ParameterKind::Fraction => parameters.list[k].value * (1.0 - parameters.list[k].value),
            _ => 1.0,
        })
        .collect();
    let own = DMatrix::from_fn(slope.len(), slope.len(), |a, b| covariance[(a, b)] / (slope[a] * slope[b]));
    parameters.sigmas(&own)
}

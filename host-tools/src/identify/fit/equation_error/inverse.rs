//! The inverse model as a linear one: a column for each free parameter.
//!
//! Columns are differences of [`Rig::demand`] itself, so that any effect that is linear in its parameters works, the user's own too, and
//! no equation is written twice. An amplitude with its phase has the coordinates a·cos φ and a·sin φ. Whether the model is linear is
//! tried, not believed.

use drive_model::{ParameterKind, Structure};
use nalgebra::DMatrix;

use super::InverseModelCause as Trouble;
use super::motion::Motion;
use crate::identify::fit::{Parameters, PreparedLog, System};
use crate::model::{Channel, Input, Model, SummingPoint};
use crate::statistics::Extremes;

/// A model along measured motions.
pub(super) struct Inverse<'a> {
    pub system: &'a System,
    pub record: &'a PreparedLog<'a>,
    pub motions: &'a [Motion],
    /// What is explained: the input of the model, or what the prescribed motion needs.
    pub explained: Channel,
    /// Rate below which the encoder cannot tell its sign, rad/s.
    pub still_rad_s: f64,
}

/// Numbers of all motions, one after the other.
pub(super) type Series = Vec<f64>;

/// What is left of an identity in doubles after some thousand operations.
const ROUNDING: f64 = 1e-7;
/// The same beside numbers that are larger by far.
const SMALLEST: f64 = 1e-13;
/// Rows at which linearity is tried, at least.
const TRIED_ROWS: usize = 500;

impl Inverse<'_> {
    /// What the model needs at these parameters, at every `stride`th point.
    pub fn need(&self, parameters: &Parameters, stride: usize) -> Series {
        let rig = self.system.rig::<f64>(parameters, self.record.driven);
        let mut series = Series::new();
        for motion in self.motions {
            for k in (0..motion.t_s.len()).step_by(stride) {
                let row = motion.row[k];
                let mut span = self.record.span(row, row + 1);
                span.t_s = motion.t_s[k];
                span.theta = Some((motion.theta[k], motion.theta[k]));
                let direction = (motion.omega[k] / self.still_rad_s).clamp(-1.0, 1.0);
                let current = self.record.current.map_or(0.0, |i| i[row]);
                let need = rig.demand(&span, motion.omega[k], motion.alpha[k], direction, current);
                series.push(match self.explained {
                    Channel::Current => need.current,
                    Channel::Voltage => need.voltage,
                    _ => need.torque,
                });
            }
        }
        series
    }

    /// Points of all motions.
    pub fn len(&self) -> usize {
        self.motions.iter().map(|m| m.t_s.len()).sum()
    }

    /// What the model needs with all free parameters zero, and a column for each.
    pub fn columns(&self, parameters: &Parameters) -> Result<(Series, Vec<Series>), Trouble> {
        let here = coordinates(parameters);
        let rest = self.need(&moved(parameters, &vec![0.0; here.len()]), 1);
        let steps: Vec<f64> = here.iter().map(|&c| if c == 0.0 { 1.0 } else { c }).collect();
        let mut columns = Vec::with_capacity(here.len());
        for lane in 0..here.len() {
            let mut one = vec![0.0; here.len()];
            one[lane] = steps[lane];
            let with = self.need(&moved(parameters, &one), 1);
            columns.push(with.iter().zip(&rest).map(|(with, rest)| (with - rest) / steps[lane]).collect::<Series>());
        }
        self.check_linear(parameters, &here, &steps, &columns)?;
        Ok((rest, columns))
    }

    /// Steps away from the start, by one parameter at a time, do what the columns say; each column does something.
    fn check_linear(&self, parameters: &Parameters, here: &[f64], steps: &[f64], columns: &[Series]) -> Result<(), Trouble> {
        let stride = (self.len() / TRIED_ROWS).max(1);
        let start = self.need(parameters, stride);
        let (mut bent, mut mixed, mut idle) = (Vec::new(), Vec::new(), Vec::new());
        for lane in 0..here.len() {
            let away = |by: f64| {
                let mut there = here.to_vec();
                there[lane] += by * steps[lane];
                self.need(&moved(parameters, &there), stride)
            };
            let (one, two) = (away(1.0), away(2.0));
            // Against what this parameter itself does, so that a small effect's bend is not lost beside a large inertia.
            let most = |series: &mut dyn Iterator<Item = f64>| series.max_abs();
            let own = most(&mut one.iter().zip(&start).map(|(o, s)| o - s));
            let all = most(&mut start.iter().chain(&two).copied());
            let linear = |off: f64| off.abs() <= ROUNDING * own + SMALLEST * all;
            let column = self.strided(&columns[lane], stride);
            let name = || parameters.list[parameters.free()[lane]].name.clone();
            if !(0..start.len()).all(|k| linear(two[k] - 2.0 * one[k] + start[k])) {
                bent.push(name());
            } else if !(0..start.len()).all(|k| linear(one[k] - start[k] - column[k] * steps[lane])) {
                mixed.push(name());
            }
            if columns[lane].iter().all(|c| *c == 0.0) {
                idle.push(name());
            }
        }
        // A product of two parameters bends with neither alone: where none bends by itself, both are named.
        let curved = if bent.is_empty() { mixed } else { bent };
        match (curved.is_empty(), idle.is_empty()) {
            (false, _) => Err(Trouble::NotLinear(curved.join(", "))),
            (_, false) => Err(Trouble::NoPart(idle.join(", "))),
            _ => Ok(()),
        }
    }

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

/// Refuses what a prescribed motion cannot show: a change of structure, of what a channel shows, a state of its own.
pub(super) fn check_effects(model: &Model, system: &System, parameters: &Parameters, temperature_is_measured: bool) -> Result<(), Trouble> {
    for effect in &system.effects {
        let law = effect.source.plain();
        let mut structure = Structure::default();
        let values: Vec<f64> = effect.parameters.iter().map(|&k| parameters.list[k].value).collect();
        law.configure(&values, &mut structure);
        if law.has_no_contribution() || (structure.thermal.is_some() && !temperature_is_measured) {
            return Err(Trouble::NotInverse(effect.name.clone()));
        }
    }
    let shows = |place: SummingPoint| matches!(place, SummingPoint::Rate | SummingPoint::Angle | SummingPoint::Current);
    match model.user_effects().iter().find(|own| shows(own.summing_point)) {
        Some(own) => Err(Trouble::NotInverse(own.name.clone())),
        None => Ok(()),
    }
}

/// What is explained: the input column, or of a prescribed motion the first output.
pub(super) fn explained(record: &PreparedLog) -> Channel {
    match record.driven {
        Input::Torque => Channel::Torque,
        Input::Current => Channel::Current,
        Input::Voltage => Channel::Voltage,
        Input::Motion => record.channels.first().map_or(Channel::Torque, |c| c.channel),
    }
}

/// (amplitude, phase) of the pair that `k` belongs to, where both are free.
fn pair(parameters: &Parameters, k: usize) -> Option<(usize, usize)> {
    let partner = parameters.list[k].polar.filter(|p| parameters.free().contains(p))?;
    Some(if parameters.list[k].kind == ParameterKind::Phase { (partner, k) } else { (k, partner) })
}

/// The coordinates in which the model may be linear, of every free parameter.
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
    let at = |k: usize| free.iter().position(|&f| f == k).map_or(0.0, |lane| coordinates[lane]);
    for &k in &free {
        next.list[k].value = match pair(parameters, k) {
            Some((amplitude, phase)) if k == amplitude => at(amplitude).hypot(at(phase)),
            Some((amplitude, phase)) => at(phase).atan2(at(amplitude)).rem_euclid(std::f64::consts::TAU),
            None => at(k),
        };
    }
    next
}

/// Standard errors of the parameters, in the list's order, from the covariance of the coordinates.
pub(super) fn sigmas(parameters: &Parameters, covariance: &DMatrix<f64>) -> Vec<f64> {
    // The list's own rule takes a positive parameter's logarithm for its coordinate.
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

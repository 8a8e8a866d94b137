//! Trials: the effects of the catalogue that can be tried on these logs, at the values from which they are tried.
//!
//! The card of an effect states how it is screened ([`Screening`]). An effect that is absent at zero is screened by its sensitivity there,
//! many effects at once. An effect whose zero is singular is screened at a few finite values, each simulated alone. The values follow from
//! the model and the logs (resonances that the sampling resolves, a fraction of the largest current), not from one stand.

use drive_model::{Card, ParameterKind, Screening, cards};

use super::harmonics::HarmonicOrders;
use super::harmonics::periods::Periods;
use super::visibility::not_visible;
use crate::identify::explain::criteria::TrialCriteria;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::motion::{angle, measured_current, turns};
use crate::identify::explain::fitted::stiffness::{max_bristle_stiffness, shaft_ranges};
use crate::identify::explain::fitted::trial::{Invisible, Trial};
use crate::identify::residual;
use crate::log::RateSource;
use crate::model::{BaseParameter, Channel, Input, Model};
use crate::recording::PreparedLog;
use crate::statistics::Extremes;

/// Values of nonlinear parameters that a search of the residual found.
#[derive(Debug, Clone, Default)]
pub struct Starts {
    /// Whole orders over the angle.
    pub orders: HarmonicOrders,
    /// Periods over the angle or over time that need not be whole parts of a turn.
    pub periods: Periods,
    /// Times at which the angle may have jumped, s, the best first.
    pub jumps_s: Vec<f64>,
}

/// All trials beside a model, and the effects that the logs cannot show.
pub fn list(base: &FittedModel, starts: &Starts) -> (Vec<Trial>, Vec<Invisible>) {
    let (mut trials, mut invisible) = (Vec::new(), Vec::new());
    for card in cards().iter().copied().filter(|card| may_be_added(&base.model, card)) {
        match not_visible(card, base) {
            Some(reason) => invisible.push(Invisible { card, reason }),
            None => trials.extend(trials_of(card, base, starts)),
        }
    }
    (trials, invisible)
}

/// The model lacks the effect, or a drive may have several of it, each of an order of its own.
pub fn may_be_added(model: &Model, card: &Card) -> bool {
    card.repeatable || !model.effects().iter().any(|e| e.card.id == card.id)
}

/// Another effect of the model modifies that of this card.
pub fn is_modified_by_another(model: &Model, card: &Card) -> bool {
    model.effects().iter().any(|e| e.card.rests_on.first() == Some(&card.id))
}

/// The trials of one effect.
fn trials_of(card: &'static Card, base: &FittedModel, found: &Starts) -> Vec<Trial> {
    let Starts { orders, periods, jumps_s } = found;
    let (model, data, criteria) = (&base.model, &base.data, &base.context.criteria.trials);
    let starts: Vec<f64> = card.parameters.iter().map(|p| p.start).collect();
    let trial = |values: Vec<f64>, screened: Vec<bool>, fitted: Vec<bool>, absent: bool| Trial {
        card,
        values,
        ranges: card.parameters.iter().map(|p| p.range).collect(),
        screened,
        fitted,
        absent,
        rate_from_encoder: None,
    };
    let turns = turns(data);
    let harmonic = |orders: &[u32]| -> Vec<Trial> {
        let covered = orders.iter().filter(|o| f64::from(**o) * turns >= criteria.min_periods);
        let (absent, free) = (criteria.absent_amplitude, vec![true, false, true]);
        covered.map(|&o| trial(vec![absent, f64::from(o), 0.0], free.clone(), free.clone(), true)).collect()
    };
    match card.screening {
        Screening::AtZero => coefficient_trials(card, criteria.absent_amplitude, trial),
        Screening::FirstAtZero => {
            let first: Vec<bool> = (0..starts.len()).map(|k| k == 0).collect();
            vec![trial(vec![0.0; starts.len()], first.clone(), first, true)]
        }
        Screening::Harmonics(source) => {
            let list = harmonic(orders.of(source));
            if card.uses_rate_source && rate_source_is_unknown(base) { for_both_rate_sources(list) } else { list }
        }
        Screening::Periodicities(period) => {
            let (low, high) = card.parameters[1].range;
            let inside = periods.of(period).iter().filter(|p| (low..=high).contains(*p));
            let values = inside.map(|&p| vec![criteria.absent_amplitude, p, 0.0]);
            values.map(|v| trial(v, vec![true, false, true], vec![true; 3], true)).collect()
        }
        Screening::LogFractions(fractions) => {
            let length_s = data.longest_run_s();
            let at = |fraction: f64| {
                coefficient_trials(card, criteria.absent_amplitude, |mut values, screened, mut fitted, absent| {
                    if let (Some(time), Some(free)) = (values.last_mut(), fitted.last_mut()) {
                        (*time, *free) = (fraction * length_s, true);
                    }
                    trial(values, screened, fitted, absent)
                })
            };
            fractions.iter().copied().flat_map(at).collect()
        }
        Screening::AngleJumps(count) => {
            let times = jumps_s.iter().copied().take(count);
            // The time of a jump is known to a row: a fit cannot improve it.
            times.map(|time| trial(vec![0.0, time], vec![true, false], vec![true, false], true)).collect()
        }
        Screening::RateFractions(fractions) => {
            let largest = largest_rate(data, criteria);
            let (low, high) = card.parameters[1].range;
            let rates = fractions.iter().map(|fraction| (fraction * largest).clamp(low, high));
            rates.map(|rate| trial(vec![0.0, rate], vec![true, false], vec![true, true], true)).collect()
        }
        Screening::EventTimes(count) => {
            let (from, to) = data.time_range_s();
            (1..=count)
                .map(|k| from + (to - from) * k as f64 / (count + 1) as f64)
                .map(|time| trial(vec![0.0, time], vec![true, false], vec![true, true], true))
                .collect()
        }
        Screening::HeatCapacities(multiples) => {
            if data.temp_C.is_some() {
                return vec![trial(vec![0.0, starts[1], starts[2]], vec![true, false, false], vec![true, false, false], true)];
            }
            let capacities = multiples.iter().map(|multiple| starts[1] * multiple);
            capacities.map(|c| trial(vec![0.0, c, starts[2]], vec![true, false, false], vec![true, true, false], true)).collect()
        }
        Screening::WindingTimeConstants(rows) => {
            let resistance = model.base(BaseParameter::Resistance).unwrap_or(1.0);
            let inductances = rows.iter().map(|rows| resistance * rows * data.dt_s.min(criteria.max_winding_interval_s));
            inductances.map(|inductance| trial(vec![inductance], vec![true], vec![true], false)).collect()
        }
        Screening::CurrentMultiple { multiple, limits_A: (low, high) } => {
            let current = multiple * largest_current(model, data);
            vec![trial(vec![current.clamp(low, high)], vec![true], vec![true], false)]
        }
        Screening::BristleDeflections(deflections_rad) => {
            let coulomb_torque = coulomb_torque(card, model);
            let (low, high) = card.parameters[0].range;
            let range = (low, high.min(max_bristle_stiffness(model, data.dt_s, criteria)));
            if !is_range(range) {
                return Vec::new();
            }
            let list = deflections_rad.iter().map(|rad| trial(vec![coulomb_torque / rad], vec![true], vec![true], false));
            list.map(|t| Trial { ranges: vec![range], ..t }).collect()
        }
        Screening::ShaftResonances { resonances_Hz, damping_ratio } => {
            let ranges = shaft_ranges(model, data.dt_s, criteria);
            if !ranges.iter().copied().all(is_range) {
                return Vec::new();
            }
            // The residual rings at the resonance: its strongest lines are tried besides the usual frequencies.
            let rings = ringing_Hz(base, criteria);
            let resolved = resonances_Hz.iter().copied().chain(rings).filter(|hz| hz * data.dt_s < criteria.max_resonance_per_row);
            let list = resolved.filter_map(|hz| shaft(card, base, hz, damping_ratio));
            list.map(|s| Trial { ranges: ranges.to_vec(), ..trial(s.to_vec(), vec![true; 3], vec![true; 3], false) }).collect()
        }
        Screening::Gaps { gaps_rad, resonance_Hz, damping_ratio } => {
            let Some(flank) = shaft(card, base, resonance_Hz, damping_ratio) else { return Vec::new() };
            let mut ranges = vec![card.parameters[0].range];
            ranges.extend(shaft_ranges(model, data.dt_s, criteria));
            if !ranges.iter().copied().all(is_range) {
                return Vec::new();
            }
            let list = gaps_rad
                .iter()
                .map(|gap| trial(vec![*gap, flank[0], flank[1], flank[2]], vec![true, false, false, false], vec![true; 4], false));
            list.map(|t| Trial { ranges: ranges.clone(), ..t }).collect()
        }
    }
}

/// The limits are in order: long rows may resolve no value of a physical range.
fn is_range((low, high): (f64, f64)) -> bool {
    low <= high
}

/// Frequencies of the strongest line in the residual of each channel, above the slow misfits, Hz.
fn ringing_Hz(base: &FittedModel, criteria: &TrialCriteria) -> Vec<f64> {
    let dt_s = base.data.dt_s;
    let list = base.residuals().into_iter().filter_map(|residual| {
        // Second differences let the slow misfit of a missing torque fall behind the ringing.
        let series: Vec<f64> = residual.windows(3).map(|w| w[2] - 2.0 * w[1] + w[0]).map(|d| if d.is_finite() { d } else { 0.0 }).collect();
        let peaks = residual::harmonics::frequencies(&series, dt_s, LINES_PER_CHANNEL);
        peaks.into_iter().find(|hz| *hz > criteria.min_shaft_resonance_Hz && hz * dt_s < criteria.max_shaft_resonance_per_row)
    });
    let mut found: Vec<f64> = Vec::new();
    for hz in list {
        if found.iter().all(|other| (other / hz - 1.0).abs() > SAME_LINE) {
            found.push(hz);
        }
    }
    found
}

/// Lines of a channel's residual among which the strongest possible resonance is chosen.
const LINES_PER_CHANNEL: usize = 40;
/// Relative distance of two lines that are one.
const SAME_LINE: f64 = 0.05;

/// The log has a rate and does not state its source.
fn rate_source_is_unknown(base: &FittedModel) -> bool {
    base.data.driven != Input::Motion
        && base.context.log.provenance(Channel::Rate.column()).source == RateSource::Unknown
        && base.data.channels.iter().any(|c| c.channel == Channel::Rate)
}

/// Each trial with a rate from the sensor, then each with a rate from the encoder.
fn for_both_rate_sources(list: Vec<Trial>) -> Vec<Trial> {
    let with = |from_encoder: bool| list.iter().map(move |t| Trial { rate_from_encoder: Some(from_encoder), ..t.clone() });
    with(false).chain(with(true)).collect()
}

/// Trials of an effect of one or more coefficients: all at zero; where there are several, each also alone.
fn coefficient_trials(
    card: &'static Card,
    absent_amplitude: f64,
    trial: impl Fn(Vec<f64>, Vec<bool>, Vec<bool>, bool) -> Trial,
) -> Vec<Trial> {
    let amplitude = |kind: ParameterKind| matches!(kind, ParameterKind::NonNegative | ParameterKind::Signed);
    let zero: Vec<f64> = card
        .parameters
        .iter()
        .map(|p| match p.kind {
            ParameterKind::NonNegative if card.polar => absent_amplitude,
            ParameterKind::NonNegative | ParameterKind::Signed | ParameterKind::Phase => 0.0,
            _ => p.start,
        })
        .collect();
    let all: Vec<bool> = card.parameters.iter().map(|p| amplitude(p.kind) || p.kind == ParameterKind::Phase).collect();
    let mut list = vec![trial(zero.clone(), all.clone(), all, true)];
    let amplitudes: Vec<usize> = (0..zero.len()).filter(|&k| amplitude(card.parameters[k].kind)).collect();
    if amplitudes.len() > 1 {
        for &alone in &amplitudes {
            let one: Vec<bool> = (0..zero.len()).map(|k| k == alone).collect();
            list.push(trial(zero.clone(), one.clone(), one, true));
        }
    }
    list
}

/// Coulomb torque of a model, N m: the first parameter of the first effect on which the card's effect rests and that the model has.
fn coulomb_torque(card: &Card, model: &Model) -> f64 {
    let torque = card.rests_on.iter().filter_map(|id| drive_model::card(id)).find_map(|c| model.value(c.parameters[0].name));
    torque.unwrap_or(1e-3).abs().max(1e-9)
}

/// Stiffness, damping and share of a shaft that resonates at `hz`: k = J_red (2π f)², with J_red = J r (1 − r).
fn shaft(card: &Card, base: &FittedModel, hz: f64, damping: f64) -> Option<[f64; 3]> {
    // The start value of the card: the share is a shaft's last parameter.
    let share = card.parameters.last()?.start;
    let reduced = base.model.base(BaseParameter::Inertia)? * share * (1.0 - share);
    let w = std::f64::consts::TAU * hz;
    Some([reduced * w * w, 2.0 * damping * reduced * w, share])
}

/// Largest rate, measured or from the angle, rad/s.
fn largest_rate(data: &PreparedLog, criteria: &TrialCriteria) -> f64 {
    if let Some(c) = data.channels.iter().find(|c| c.channel == Channel::Rate) {
        return c.measured.iter().copied().max_abs().max(criteria.min_largest_rate_rad_s);
    }
    let Some(theta) = angle(data) else { return 1.0 };
    let lag = data.angle_lag();
    let rates = theta.windows(lag + 1).map(|w| (w[lag] - w[0]).abs() / (lag as f64 * data.dt_s));
    rates.max_or_zero().max(criteria.min_largest_rate_rad_s)
}

/// Largest current, measured or from the voltage, A.
fn largest_current(model: &Model, data: &PreparedLog) -> f64 {
    match (measured_current(data), model.base(BaseParameter::Resistance)) {
        (Some(i), _) => i.iter().copied().max_abs(),
        (None, Some(resistance)) if data.driven == Input::Voltage => data.input.iter().copied().max_abs() / resistance,
        (None, Some(resistance)) if data.driven == Input::Setpoint => model.base(BaseParameter::ServoLimit).unwrap_or(1.0) / resistance,
        _ => data.input.iter().copied().max_abs(),
    }
}

//! Structures that no effect of the catalogue has.
//!
//! Piecewise linear laws over every coordinate ([`super::piecewise_linear`]), of a torque, a voltage or the reading of a channel, and a
//! torque or voltage that oscillates in time, are fitted like effects and compared by the same evidence. For the best of them expressions
//! with few parameters are searched ([`super::symbolic`]), fitted and compared on held-out rows; the best can be pasted into the model
//! file.

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use drive_model::Coordinate;
use rayon::prelude::*;

use super::piecewise_linear::PiecewiseLinear;
use super::symbolic::{self, Proposal};
use crate::identify::explain::answer::{Shape, ShapeForm};
use crate::identify::explain::candidates::harmonics::search_frequencies;
use crate::identify::explain::criteria::{Criteria, worst};
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::descent::Goal;
use crate::identify::explain::fitted::likelihood::{Whitener, delta_bic};
use crate::identify::explain::fitted::motion::turns;
use crate::identify::fit::build::{self, append_linear};
use crate::identify::fit::normal_equations::{MAX_UNKNOWNS, linearize};
use crate::identify::fit::parameters::Parameters;
use crate::identify::fit::solve::Iterate;
use crate::identify::fit::system::System;
use crate::model::{Channel, Input, SummingPoint};
use crate::statistics::Extremes;
use crate::statistics::bins::Bin;
use crate::statistics::distributions::ln_chi_squared_tail;
use crate::statistics::robust::median;

/// Name of the proposed effect in the model file.
pub const NAME: &str = "unknown";

/// A structure that no effect of the catalogue has, fitted beside a model.
pub struct Unknown {
    /// The structure, for the answer.
    pub shape: Shape,
    /// χ²/n of the worst channel with it.
    pub chi2_per_n: f64,
}

/// The best unknown structure beside a model; `None` where none is significant.
pub fn best(base: &FittedModel) -> Option<Unknown> {
    let criteria = base.context.criteria;
    let mut laws: Vec<(PiecewiseLinear, f64)> = laws(base).into_par_iter().map(|law| (law.clone(), score(base, &law))).collect();
    laws.sort_by(|a, b| b.1.total_cmp(&a.1));
    let best = laws.into_par_iter().take(criteria.unknown.max_fitted);
    let fitted: Vec<FittedLaw> = best.filter_map(|(law, _)| fit_piecewise_linear(base, law)).collect();
    let law = fitted.into_iter().min_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
    let found = law.map(|law| law.with_expression(base)).into_iter().chain(oscillations(base));
    let best = found.min_by(|a, b| a.shape.delta_bic.total_cmp(&b.shape.delta_bic));
    best.filter(|u| u.shape.delta_bic < -criteria.evidence.min_bic_difference)
}

/// Piecewise linear laws over the coordinates of these logs.
fn laws(base: &FittedModel) -> Vec<PiecewiseLinear> {
    let (data, criteria) = (&base.data, &base.context.criteria.unknown);
    let count = criteria.max_knots.min(MAX_UNKNOWNS.saturating_sub(base.free_parameters() + base.fit.initial_states.kinds.len()));
    if count < criteria.min_knots {
        return Vec::new();
    }
    let span = |values: &mut dyn Iterator<Item = f64>| values.min_max();
    let mut list = Vec::new();
    let mut add = |coordinate, acts_on, range: (f64, f64), count| {
        if range.1 > range.0 {
            list.push(PiecewiseLinear { coordinate, acts_on, range, count });
        }
    };
    if turns(data) >= criteria.min_turns {
        add(Coordinate::Theta, SummingPoint::Dry, (0.0, TAU), count);
        add(Coordinate::Theta, SummingPoint::Torque, (0.0, TAU), count);
        if data.channels.iter().any(|c| c.channel == Channel::Angle) {
            add(Coordinate::Theta, SummingPoint::Angle, (0.0, TAU), count);
        }
    }
    let modelled = |channel: Channel| {
        let k = data.channels.iter().position(|c| c.channel == channel)?;
        let residual = &base.fit.channels[k].residual;
        Some(span(&mut data.channels[k].measured.iter().zip(residual).map(|(y, r)| if r.is_finite() { y - r } else { *y })))
    };
    let few = count.min(criteria.max_knots_rate);
    if let Some(range) = modelled(Channel::Rate) {
        add(Coordinate::Omega, SummingPoint::Torque, range, few);
        add(Coordinate::Omega, SummingPoint::Rate, range, few);
    }
    if data.driven == Input::Voltage
        && let Some(range) = modelled(Channel::Current)
    {
        add(Coordinate::Current, SummingPoint::Torque, range, few);
        add(Coordinate::Current, SummingPoint::Voltage, range, few);
    }
    if let Some(t) = &data.temp_C {
        add(Coordinate::Temperature, SummingPoint::Torque, span(&mut t.iter().copied()), few.min(criteria.max_knots_temperature));
    }
    let time = data.time_range_s();
    add(Coordinate::Time, SummingPoint::Torque, time, count);
    if data.driven == Input::Voltage {
        add(Coordinate::Time, SummingPoint::Voltage, time, count);
    }
    list
}

/// Adds a law to the model; the positions of its heights. Increments do not show a constant error of the angle: its first height stays
/// zero.
fn append(system: &mut System, parameters: &mut Parameters, law: &PiecewiseLinear) -> Range<usize> {
    let own = append_linear(system, parameters, NAME, Arc::new(law.clone()), law.count);
    parameters.list[own.start].fixed = law.acts_on == SummingPoint::Angle;
    own
}

/// Damping of the one step that predicts the decrease of χ².
const SCORE_DAMPING: f64 = 1e-6;

/// Decrease of χ² that the linear model predicts for a law.
fn score(base: &FittedModel, law: &PiecewiseLinear) -> f64 {
    let (mut system, mut parameters) = (base.system.clone(), base.fit.parameters.clone());
    append(&mut system, &mut parameters, law);
    let states = base.initial_states_for(&system, &parameters, &base.data);
    let equations = linearize(&system, &parameters, &base.data, &states).weighted(&states, &base.weights);
    equations.step(SCORE_DAMPING, &[]).map_or(0.0, |s| if s.predicted_decrease.is_finite() { s.predicted_decrease } else { 0.0 })
}

/// Half-width of the 95 % interval, standard errors.
pub const CONFIDENCE_SIGMAS: f64 = 1.96;

/// Goal of the descents. Near the noise they go to the minimum; a structure that leaves much is compared at an approximate χ².
const GOAL: Goal = Goal::Compare(f64::INFINITY);

/// A law, fitted and compared.
struct FittedLaw {
    law: PiecewiseLinear,
    /// Heights of its knots, and the half-widths of their 95 % intervals.
    heights: Vec<f64>,
    confidence: Vec<f64>,
    bins: Vec<Bin>,
    delta_bic: f64,
    chi2_per_n: f64,
}

fn fit_piecewise_linear(base: &FittedModel, law: PiecewiseLinear) -> Option<FittedLaw> {
    let (mut system, mut parameters) = (base.system.clone(), base.fit.parameters.clone());
    let own = append(&mut system, &mut parameters, &law);
    let states = base.initial_states_for(&system, &parameters, &base.data);
    let end = base.minimize(&system, &parameters, &base.data, &states, GOAL);
    let equations = end.normal_equations(&base.weights);
    if !equations.cost.is_finite() {
        return None;
    }
    let free = end.parameters.free();
    let covariance = equations.profiled().0.try_inverse();
    let sigma = |k: usize| {
        let lane = free.iter().position(|f| *f == k);
        lane.zip(covariance.as_ref()).map_or(f64::NAN, |(l, m)| m[(l, l)].max(0.0).sqrt())
    };
    let heights: Vec<f64> = own.clone().map(|k| end.parameters.list[k].value).collect();
    let confidence: Vec<f64> = own.clone().map(|k| CONFIDENCE_SIGMAS * sigma(k)).collect();
    let bins = bins(base.context.criteria, &law, &heights, &confidence);
    if !bins.iter().any(|b| b.mean.abs() > b.confidence) {
        // The model's own parameters explain what the law seemed to explain.
        return None;
    }
    let (delta_bic, chi2_per_n) = compare(base, &system, &end, free.len() - base.free_parameters());
    Some(FittedLaw { law, heights, confidence, bins, delta_bic, chi2_per_n })
}

impl FittedLaw {
    /// The law with the expression that describes it.
    fn with_expression(self, base: &FittedModel) -> Unknown {
        let FittedLaw { law, heights, confidence, bins, delta_bic, chi2_per_n } = self;
        let unknown = &base.context.criteria.unknown;
        let expressions = symbolic::proposals(unknown, &law, &heights, &confidence, unknown.max_expressions);
        let fitted: Vec<FittedExpression> = expressions.par_iter().filter_map(|proposal| fit_expression(base, proposal)).collect();
        let expression = fitted.into_iter().min_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
        let shape = Shape {
            acts_on: law.acts_on,
            coordinate: law.coordinate,
            form: ShapeForm::PiecewiseLinear { largest: bins.iter().map(|b| b.mean).max_abs() },
            bins,
            expression: expression.as_ref().map(FittedExpression::to_toml),
            delta_bic,
        };
        match expression {
            // The expression describes the same structure with fewer parameters: its fit gives the evidence, the knots only the plot.
            Some(e) if e.delta_bic < delta_bic => Unknown { shape: Shape { delta_bic: e.delta_bic, ..shape }, chi2_per_n: e.chi2_per_n },
            _ => Unknown { shape, chi2_per_n },
        }
    }
}

/// The knots relative to their median, without those that few rows determine.
pub fn bins(criteria: &Criteria, law: &PiecewiseLinear, heights: &[f64], confidence: &[f64]) -> Vec<Bin> {
    let middle = median(heights.iter().copied()).unwrap_or(0.0);
    let usual = median(confidence.iter().copied().filter(|c| c.is_finite() && *c > 0.0)).unwrap_or(0.0);
    law.knots()
        .iter()
        .zip(heights)
        .zip(confidence)
        .filter(|(_, c)| **c > 0.0 && **c < criteria.unknown.max_confidence_ratio * usual)
        .map(|((at, height), confidence)| Bin { at: *at, mean: height - middle, confidence: *confidence })
        .collect()
}

/// BIC with a structure minus that without it (0 where it is not significant), and χ²/n of the worst channel with it.
fn compare(base: &FittedModel, system: &System, end: &Iterate, extra_parameters: usize) -> (f64, f64) {
    let criteria = base.context.criteria;
    let residuals = &end.linearization.residuals;
    let with: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
    let whitener = Whitener::of(&base.data, &with, &criteria.whitening);
    let without = base.whitened_sums(&whitener);
    let with = whitener.sums(system, &end.parameters, &end.initial_states, &base.data, base.context.log_rows);
    let gain = without.gain(&with);
    let significant = ln_chi_squared_tail(gain, extra_parameters as f64) + criteria.unknown.tests.ln()
        < criteria.evidence.max_familywise_p.ln()
        && without.held_out_gain(&with) > -criteria.evidence.min_bic_difference;
    let bic = if significant { delta_bic(gain, extra_parameters as f64, without.effective_samples()) } else { 0.0 };
    let chi2_per_n = residuals.iter().zip(&base.fit.channels).map(|(r, f)| {
        let (sum, n) = r.iter().filter(|r| r.is_finite()).fold((0.0, 0usize), |(s, n), r| (s + r * r, n + 1));
        sum / n.max(1) as f64 / (f.noise * f.noise)
    });
    (bic, worst(chi2_per_n))
}

/// Knots with which an oscillation is drawn over one period.
const DRAWN_INTERVALS: usize = 24;

/// A torque and a voltage that oscillate, each at its best frequency.
fn oscillations(base: &FittedModel) -> Vec<Unknown> {
    let frequencies = search_frequencies(base);
    let tried = [(frequencies.torque_Hz, SummingPoint::Torque, ""), (frequencies.voltage_Hz, SummingPoint::Voltage, "u * ")];
    let fitted = |(hz, acts_on, factor): (Option<f64>, SummingPoint, &str)| {
        let text = format!("{factor}(a * sin(2 * pi * f * t) + b * cos(2 * pi * f * t))");
        let found = fit_expression(base, &Proposal { acts_on, text, starts: vec![("a", 0.0), ("b", 0.0), ("f", hz?)] })?;
        let [a, b, f] = found.written_values()[..] else { return None };
        let shape = oscillation(acts_on, (a, b, f), found.to_toml(), found.delta_bic);
        Some(Unknown { shape, chi2_per_n: found.chi2_per_n })
    };
    tried.into_iter().filter_map(fitted).collect()
}

/// A fitted expression.
struct FittedExpression {
    acts_on: SummingPoint,
    text: String,
    /// Names of its parameters with their values.
    values: Vec<(&'static str, f64)>,
    delta_bic: f64,
    chi2_per_n: f64,
}

impl FittedExpression {
    fn written(value: f64) -> String {
        format!("{value:.6e}")
    }

    /// Values as the model file has them, rounded.
    fn written_values(&self) -> Vec<f64> {
        self.values.iter().filter_map(|(_, value)| Self::written(*value).parse().ok()).collect()
    }

    /// An `[effect.NAME]` table for the model file.
    fn to_toml(&self) -> String {
        expression_table(self.acts_on, &self.text, &self.values)
    }
}

/// An expression as an `[effect.NAME]` table for the model file, with the values of its parameters.
pub fn expression_table(acts_on: SummingPoint, text: &str, values: &[(&str, f64)]) -> String {
    let numbers: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {}", FittedExpression::written(*value))).collect();
    format!("[effect.{NAME}]\n{} = \"{text}\"\nparameters = {{ {} }}\n", acts_on.key(), numbers.join(", "))
}

/// The shape a sin(2π f t) + b cos(2π f t), drawn over one period; `values` are a, b and f in Hz.
pub fn oscillation(acts_on: SummingPoint, values: (f64, f64, f64), expression: String, delta_bic: f64) -> Shape {
    let (a, b, frequency_Hz) = values;
    let at = (0..=DRAWN_INTERVALS).map(|k| k as f64 / DRAWN_INTERVALS as f64 / frequency_Hz);
    let mean = |t: f64| a * (TAU * frequency_Hz * t).sin() + b * (TAU * frequency_Hz * t).cos();
    Shape {
        acts_on,
        coordinate: Coordinate::Time,
        form: ShapeForm::Oscillation { frequency_Hz, amplitude: a.hypot(b) },
        bins: at.map(|t| Bin { at: t, mean: mean(t), confidence: 0.0 }).collect(),
        expression: Some(expression),
        delta_bic,
    }
}

/// A model with an expression in it, fitted and compared; `None` where the fit leaves the expression's parameters at their start.
fn fit_expression(base: &FittedModel, proposal: &Proposal) -> Option<FittedExpression> {
    let Proposal { acts_on, text, starts } = proposal;
    let mut model = base.model.clone();
    model.add_user_effect(NAME, *acts_on, text, starts).ok()?;
    let (system, parameters) = build::system(&model, base.data.temp_C.is_some());
    if parameters.free().len() + base.fit.initial_states.kinds.len() > MAX_UNKNOWNS {
        return None;
    }
    let states = base.initial_states_for(&system, &parameters, &base.data);
    let end = base.minimize(&system, &parameters, &base.data, &states, GOAL);
    if !end.normal_equations(&base.weights).cost.is_finite() {
        return None;
    }
    let mut values = Vec::new();
    for (name, _) in starts {
        let p = end.parameters.list.iter().find(|p| p.name == format!("{NAME}.{name}"))?;
        values.push((*name, p.value));
    }
    if values.iter().zip(starts).all(|((_, value), (_, start))| value == start) {
        return None;
    }
    let (delta_bic, chi2_per_n) = compare(base, &system, &end, starts.len());
    Some(FittedExpression { acts_on: *acts_on, text: text.clone(), values, delta_bic, chi2_per_n })
}

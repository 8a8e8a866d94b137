//! None of these: what is left belongs to no effect of the catalogue.
//!
//! Free-form laws over every coordinate ([`super::shape`]), and a torque or supply that swings in time, are tried like the built-in effects and
//! judged by the same evidence. For the best of them an expression is sought that says the same with few parameters and can be pasted into
//! the model file.

use std::f64::consts::TAU;
use std::sync::Arc;

use drive_model::Coordinate;
use rayon::prelude::*;

use super::Shape;
use super::evidence::{Whitener, delta_bic, ln_chance};
use super::fitted::{APART, FAMILYWISE};
use super::ground::{Goal, Ground, misfit};
use super::orders::swings;
use super::shape::Hats;
use super::trial::turns;
use crate::identify::fit::build::{GenericLaw, append_linear};
use crate::identify::fit::normal_equations::{MAX_UNKNOWNS, linearize};
use crate::identify::fit::simulate::System;
use crate::identify::fit::solve::Iterate;
use crate::model::{Channel, Input, Model, SummingPoint};
use crate::statistics::Extremes;
use crate::statistics::bins::Bin;
use crate::statistics::robust::median;

/// χ²/n from which on something is left that a person would see: rms 1.04 × the noise.
pub const LEFT: f64 = 1.08;
/// Heights of a free-form law, at most.
const HEIGHTS: usize = 22;
/// Free-form laws that are fitted in full.
const FITTED: usize = 2;
/// Free-form laws, and frequencies, that chance may choose from.
const TESTS: f64 = 4000.0;
/// A height whose confidence interval is this much wider than the usual was hardly visited, and is not drawn.
const SELDOM: f64 = 8.0;
/// Name of the suggested effect.
const NAME: &str = "unknown";
/// Steepness of the edges of a sector, in cos θ.
const EDGE: f64 = 80.0;

/// A structure that no effect of the catalogue has, fitted beside a model.
pub struct Unknown {
    /// As the answer shows it.
    pub shape: Shape,
    /// Largest χ²/n of the channels with it.
    pub misfit: f64,
    /// Whitened residual's evidence: BIC with it minus that without.
    pub delta_bic: f64,
}

/// The best structure of no name beside this model; `None` where nothing of the kind is seen.
pub fn best(ground: &Ground, logs: &[std::ops::Range<usize>]) -> Option<Unknown> {
    let mut forms: Vec<(Hats, f64)> = hats(ground).into_par_iter().map(|h| (h.clone(), score(ground, &h))).collect();
    forms.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut found: Vec<Unknown> = forms.into_par_iter().take(FITTED).filter_map(|(h, _)| free_form(ground, logs, &h)).collect();
    found.extend(swinging(ground, logs));
    found.into_iter().min_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic)).filter(|u| u.delta_bic < -APART)
}

/// Free-form laws that this log can show.
fn hats(ground: &Ground) -> Vec<Hats> {
    let record = &ground.record;
    let room = MAX_UNKNOWNS.saturating_sub(ground.held.parameters.free().len() + ground.held.starts.kinds.len());
    let count = HEIGHTS.min(room);
    if count < 6 {
        return Vec::new();
    }
    let span = |values: &mut dyn Iterator<Item = f64>| values.min_max();
    let mut list = Vec::new();
    let mut add = |coordinate, place, range: (f64, f64), count| {
        if range.1 > range.0 {
            list.push(Hats { coordinate, place, range, count });
        }
    };
    if turns(record) >= 1.0 {
        add(Coordinate::Theta, SummingPoint::Dry, (0.0, TAU), count);
        add(Coordinate::Theta, SummingPoint::Torque, (0.0, TAU), count);
    }
    let modelled = |shows: Channel| {
        let k = record.channels.iter().position(|c| c.channel == shows)?;
        let residual = &ground.held.channels[k].residual;
        let (low, high) = span(&mut record.channels[k].measured.iter().zip(residual).map(|(y, r)| if r.is_finite() { y - r } else { *y }));
        Some((low, high))
    };
    let few = count.min(14);
    if let Some(range) = modelled(Channel::Rate) {
        add(Coordinate::Omega, SummingPoint::Torque, range, few);
    }
    if record.driven == Input::Voltage
        && let Some(range) = modelled(Channel::Current)
    {
        add(Coordinate::Current, SummingPoint::Torque, range, few);
        add(Coordinate::Current, SummingPoint::Voltage, range, few);
    }
    if let Some(t) = &record.temp_C {
        add(Coordinate::Temperature, SummingPoint::Torque, span(&mut t.iter().copied()), few.min(8));
    }
    let time = (record.t_s[0], record.t_s[record.len() - 1]);
    add(Coordinate::Time, SummingPoint::Torque, time, count);
    if record.driven == Input::Voltage {
        add(Coordinate::Time, SummingPoint::Voltage, time, count);
    }
    list
}

/// Fall of χ² that a free-form law promises.
fn score(ground: &Ground, hats: &Hats) -> f64 {
    let (mut system, mut parameters) = (ground.system.clone(), ground.held.parameters.clone());
    append_linear(&mut system, &mut parameters, NAME, Arc::new(GenericLaw(hats.clone())), hats.count);
    let starts = ground.starts_for(&system, &parameters, &ground.record);
    let linear = linearize(&system, &parameters, &ground.record, &starts).weighted(&starts, &ground.weights);
    linear.step(1e-6, &[]).map_or(0.0, |s| if s.promised.is_finite() { s.promised } else { 0.0 })
}

/// A free-form law, fitted and judged, with the expression that says it shortly.
fn free_form(ground: &Ground, logs: &[std::ops::Range<usize>], hats: &Hats) -> Option<Unknown> {
    let (mut system, mut parameters) = (ground.system.clone(), ground.held.parameters.clone());
    let own = append_linear(&mut system, &mut parameters, NAME, Arc::new(GenericLaw(hats.clone())), hats.count);
    let starts = ground.starts_for(&system, &parameters, &ground.record);
    let place = ground.minimize(&system, &parameters, &ground.record, &starts, Goal::End);
    let linear = place.normal_equations(&ground.weights);
    if !linear.cost.is_finite() {
        return None;
    }
    let free = place.parameters.free().len();
    let sigma = |k: usize| {
        let lane = place.parameters.free().iter().position(|f| *f == k);
        let inverse = linear.profiled().0.try_inverse();
        lane.zip(inverse).map_or(f64::NAN, |(l, m)| m[(l, l)].max(0.0).sqrt())
    };
    let heights: Vec<f64> = own.clone().map(|k| place.parameters.list[k].value).collect();
    let confidence: Vec<f64> = own.clone().map(|k| 1.96 * sigma(k)).collect();
    let mean = median(heights.iter().copied())?;
    let usual = median(confidence.iter().copied().filter(|c| c.is_finite() && *c > 0.0)).unwrap_or(0.0);
    let bins: Vec<Bin> = hats
        .knots()
        .iter()
        .zip(&heights)
        .zip(&confidence)
        .filter(|(_, c)| **c > 0.0 && **c < SELDOM * usual)
        .map(|((at, height), confidence)| Bin { at: *at, mean: height - mean, confidence: *confidence })
        .collect();
    if !bins.iter().any(|b| b.mean.abs() > b.confidence) {
        // What helped was another place of the model's own parameters.
        return None;
    }
    let judged = judge(ground, logs, &system, &place, free - ground.held.parameters.free().len());
    let by_words = expression(hats, &heights).and_then(|(place, text, starts)| fitted_expression(ground, logs, place, &text, &starts));
    let along = match hats.coordinate {
        Coordinate::Theta => "angle within the turn, rad",
        Coordinate::Omega => "rate, rad/s",
        Coordinate::Current => "current, A",
        Coordinate::Temperature => "winding temperature, °C",
        _ => "time, s",
    };
    let unit = if hats.place == SummingPoint::Voltage { "V" } else { "N m" };
    let what = match hats.place {
        SummingPoint::Voltage => "a voltage",
        SummingPoint::Dry => "a dry friction",
        _ => "a torque",
    };
    let size = bins.iter().fold(0.0_f64, |m, b| m.max(b.mean.abs()));
    let says = format!(
        "What is left looks like {what} that depends on the {}: up to {size:.2e} {unit} from its middle.",
        coordinate_word(hats.coordinate)
    );
    let whole = Unknown {
        shape: Shape {
            acts_on: hats.place.key(),
            coordinate: hats.coordinate,
            along,
            bins,
            expression: by_words.as_ref().and_then(|u| u.shape.expression.clone()),
            delta_bic: judged.0,
            says,
        },
        misfit: judged.1,
        delta_bic: judged.0,
    };
    match by_words {
        // The expression is the better model of the same thing: the free form draws it, the expression stands for it.
        Some(words) if words.delta_bic < whole.delta_bic => {
            Some(Unknown { shape: Shape { delta_bic: words.delta_bic, ..whole.shape }, ..words })
        }
        _ => Some(whole),
    }
}

fn coordinate_word(coordinate: Coordinate) -> &'static str {
    match coordinate {
        Coordinate::Theta => "angle",
        Coordinate::Omega => "rate",
        Coordinate::Current => "current",
        Coordinate::Temperature => "temperature",
        _ => "time",
    }
}

/// BIC and largest χ²/n of residuals against the model without; BIC is 0 where chance would do as well.
fn judge(ground: &Ground, logs: &[std::ops::Range<usize>], system: &System, at: &Iterate, more: usize) -> (f64, f64) {
    let residuals = &at.linearization.residuals;
    let with: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
    let whitener = Whitener::of(&ground.record, &with);
    let without = ground.squares(&whitener, logs);
    let squares = whitener.squares(system, &at.parameters, &at.starts, &ground.record, logs);
    let gain = without.gain(&squares);
    let seen = ln_chance(gain, more) + TESTS.ln() < FAMILYWISE.ln() && without.held_out_gain(&squares) > -APART;
    let bic = if seen { delta_bic(gain, more, without.witnesses()) } else { 0.0 };
    let chi2 = residuals.iter().zip(&ground.held.channels).map(|(r, f)| {
        let (sum, n) = r.iter().filter(|r| r.is_finite()).fold((0.0, 0usize), |(s, n), r| (s + r * r, n + 1));
        sum / n.max(1) as f64 / (f.noise * f.noise)
    });
    (bic, misfit(chi2))
}

/// An expression: where it acts, its text, its parameters with their start values.
type Suggestion = (SummingPoint, String, Vec<(&'static str, f64)>);

/// An expression with few parameters that has the shape of these heights, and where its fit begins.
fn expression(hats: &Hats, heights: &[f64]) -> Option<Suggestion> {
    let n = heights.len();
    let largest = hats.range.0.abs().max(hats.range.1.abs());
    match hats.coordinate {
        Coordinate::Theta => {
            // A sector: its middle, half its width, its height above the rest.
            let rest = median(heights.iter().copied()).unwrap_or(0.0);
            let (low, high) = heights.iter().copied().min_max();
            let sign = if high - rest >= rest - low { 1.0 } else { -1.0 };
            let top = if sign > 0.0 { high } else { low };
            let inside: Vec<usize> = (0..n).filter(|&k| (heights[k] - rest) * sign > 0.5 * (top - rest) * sign).collect();
            let (mut x, mut y) = (0.0, 0.0);
            for &k in &inside {
                let (s, c) = (TAU * k as f64 / n as f64).sin_cos();
                x += c * (heights[k] - rest).abs();
                y += s * (heights[k] - rest).abs();
            }
            let middle = y.atan2(x).rem_euclid(TAU);
            let half = (0.5 * TAU * inside.len() as f64 / n as f64).clamp(0.1, 3.0);
            let text = format!("a / (1 + exp({EDGE} * (cos(h) - cos(theta - c))))");
            Some((hats.place, text, vec![("a", top - rest), ("c", middle), ("h", half)]))
        }
        Coordinate::Omega => {
            let text = format!("a + b * omega * abs(omega) + d * tanh(omega / {:.3e})", 0.1 * largest);
            Some((hats.place, text, vec![("a", 0.0), ("b", 0.0), ("d", 0.0)]))
        }
        Coordinate::Current => Some((hats.place, "a * i + b * i * abs(i) + d * i^3".to_owned(), vec![("a", 0.0), ("b", 0.0), ("d", 0.0)])),
        Coordinate::Temperature => Some((hats.place, "a * (T - 25)".to_owned(), vec![("a", 0.0)])),
        _ => None,
    }
}

/// A torque or a supply that swings, at the frequency that promises most.
fn swinging(ground: &Ground, logs: &[std::ops::Range<usize>]) -> Vec<Unknown> {
    let (torque, supply) = swings(&ground.model, &ground.record, &ground.residuals(), &ground.weights);
    let tried =
        [(torque, SummingPoint::Torque, "", "a torque"), (supply, SummingPoint::Voltage, "u * ", "a part of the voltage asked for")];
    tried
        .into_iter()
        .filter_map(|(hz, place, factor, what)| {
            let text = format!("{factor}(a * sin(2 * pi * f * t) + b * cos(2 * pi * f * t))");
            let mut found = fitted_expression(ground, logs, place, &text, &[("a", 0.0), ("b", 0.0), ("f", hz?)])?;
            let value = |name: &str| found.shape.bins.is_empty().then_some(name).and_then(|_| found_value(&found, name));
            let (a, b, f) = (value("a")?, value("b")?, value("f")?);
            let size = a.hypot(b);
            let steps = 24;
            // One period, at the fitted phase.
            found.shape.bins = (0..=steps)
                .map(|k| k as f64 / steps as f64 / f)
                .map(|t| Bin { at: t, mean: a * (TAU * f * t).sin() + b * (TAU * f * t).cos(), confidence: 0.0 })
                .collect();
            found.shape.along = "time within a period, s";
            found.shape.says = format!("What is left looks like {what} that swings at {f:.3} Hz, with the amplitude {size:.2e}.");
            Some(found)
        })
        .collect()
}

/// Value of a parameter of the suggested expression.
fn found_value(found: &Unknown, name: &str) -> Option<f64> {
    let text = found.shape.expression.as_ref()?;
    let model = Model::parse(&format!("[drive]\ninput = \"torque_N_m\"\n[parameters]\ninertia_kg_m2 = 1.0\n{text}"), "suggestion").ok()?;
    model.value(&format!("{NAME}.{name}"))
}

/// The model with an expression in it, fitted and judged.
fn fitted_expression(
    ground: &Ground,
    logs: &[std::ops::Range<usize>],
    place: SummingPoint,
    text: &str,
    starts: &[(&str, f64)],
) -> Option<Unknown> {
    let mut model = ground.model.clone();
    model.add_user_effect(NAME, place, text, starts).ok()?;
    let (system, parameters) = crate::identify::fit::build::system(&model, ground.record.temp_C.is_some());
    if parameters.free().len() + ground.held.starts.kinds.len() > MAX_UNKNOWNS {
        return None;
    }
    let begin = ground.starts_for(&system, &parameters, &ground.record);
    let at: Iterate = ground.minimize(&system, &parameters, &ground.record, &begin, Goal::End);
    if !at.normal_equations(&ground.weights).cost.is_finite() {
        return None;
    }
    let mut values = Vec::new();
    for (name, _) in starts {
        let p = at.parameters.list.iter().find(|p| p.name == format!("{NAME}.{name}"))?;
        values.push((*name, p.value));
    }
    if values.iter().zip(starts).all(|((_, value), (_, start))| value == start) {
        return None;
    }
    let (bic, left) = judge(ground, logs, &system, &at, starts.len());
    let numbers = values.iter().map(|(n, v)| format!("{n} = {v:.6e}")).collect::<Vec<_>>().join(", ");
    let table = format!("[effect.{NAME}]\n{} = \"{text}\"\nparameters = {{ {numbers} }}\n", place.key());
    Some(Unknown {
        shape: Shape {
            acts_on: place.key(),
            coordinate: Coordinate::Time,
            along: "",
            bins: Vec::new(),
            expression: Some(table),
            delta_bic: bic,
            says: String::new(),
        },
        misfit: left,
        delta_bic: bic,
    })
}

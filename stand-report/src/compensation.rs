//! A compensation written into a stand, as text and JSON.

use crate::json::schema_of;
use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use stand_firmware::compensation::{Compensation, MAX_HARMONICS};

use super::json::value;
use stand_analysis::compensate::serial_stand::InForce;
use stand_analysis::compensate::simulated_stand::RateChange;
use stand_analysis::compensate::trial::Trial;
use stand_analysis::compensate::{NotCompensated, OrderChange, OrderSpectrum, Ripple};

/// Reason of a withdrawn compensation.
pub const WITHDRAWN: &str =
    "the compensation makes the ripple of the rate larger; model and log may be of another stand, or of another index";

/// A compensation written into the file of a simulated stand, with its effect on the ripple.
pub struct FileCompensation<'a> {
    /// The stand's file.
    pub path: &'a Path,
    /// The orders that it makes larger, if that is why it was not written.
    pub withdrawn: Option<&'a [RateChange]>,
    /// Source of the compensation: `model` or `measured`.
    pub source: &'static str,
    /// The compensation.
    pub compensation: &'a Compensation,
    /// What is not compensated.
    pub not_compensated: &'a [NotCompensated],
    /// Ripple before and after, for each rate.
    pub ripple: &'a [[Ripple; 2]],
}

impl FileCompensation<'_> {
    /// The result as text.
    pub fn text(&self) -> String {
        let c = self.compensation;
        let outcome = if self.withdrawn.is_some() { "nothing was written; it was tried with" } else { "[firmware.compensation] written" };
        let mut text = format!("{}: {outcome}\n", self.path.display());
        text += &format!("  Coulomb friction {} N m, viscous friction {} N m s/rad\n", short(c.coulomb_N_m), short(c.viscous_N_m_s));
        for harmonic in c.harmonics.as_slice() {
            let (order, torque, phase) = (harmonic.order, short(harmonic.torque_N_m), harmonic.phase_rad);
            text += &format!("  harmonic {order:>3}: {torque} N m, phase {phase:.4} rad from the index\n");
        }
        for torque in self.not_compensated {
            text += &format!("  not compensated: {}\n", not_compensated(torque));
        }
        text += "\nRipple of the true rate of the simulated stand (amplitude of each harmonic; standard deviation over 1°):\n";
        text += "     rate                        before       after   reduction\n";
        for [before, after] in self.ripple {
            let degrees = before.rate_rad_s.to_degrees();
            for harmonic in c.harmonics.as_slice() {
                text += &order_line(degrees, harmonic.order, &before.spectrum, &after.spectrum);
            }
            let (was, is) = (before.one_degree, after.one_degree);
            let percent = |ripple: f64| short(100.0 * ripple);
            text += &format!("{degrees:>5.0} °/s  over 1°       {:>9} %     {:>11} {:>8} ×\n", percent(was), percent(is), factor(was / is));
        }
        for RateChange { rate_rad_s, change } in self.withdrawn.unwrap_or_default() {
            text += &grown_line(*rate_rad_s, change);
        }
        if self.withdrawn.is_some() {
            text += &self.ripple.first().map_or(String::new(), |[before, _]| largest_line(before.rate_rad_s, &before.spectrum));
        }
        text
    }

    /// The result as JSON.
    pub fn json(&self) -> Value {
        value(&FileCompensationJson {
            stand: self.path.display().to_string(),
            written: self.withdrawn.is_none(),
            source: self.source,
            compensation: self.compensation,
            left_out: self.not_compensated.iter().map(not_compensated).collect(),
            ripple: self.ripple.iter().map(|pair| ripple(self.compensation, pair)).collect(),
        })
    }
}

#[derive(Serialize, JsonSchema)]
struct FileCompensationJson<'a> {
    stand: String,
    written: bool,
    source: &'static str,
    /// Settings of the compensation by name.
    #[schemars(with = "Value")]
    compensation: &'a Compensation,
    left_out: Vec<String>,
    ripple: Vec<RippleJson>,
}

#[derive(Serialize, JsonSchema)]
struct RippleJson {
    rate_rad_s: f64,
    orders: Vec<HarmonicJson>,
    one_degree: OneDegreeJson,
}

#[derive(Serialize, JsonSchema)]
struct HarmonicJson {
    order: u16,
    before_rad_s: f64,
    after_rad_s: f64,
    factor: f64,
}

#[derive(Serialize, JsonSchema)]
struct OneDegreeJson {
    before: f64,
    after: f64,
}

fn ripple(compensation: &Compensation, [before, after]: &[Ripple; 2]) -> RippleJson {
    let orders = compensation.harmonics.as_slice().iter().map(|harmonic| harmonic.order);
    RippleJson {
        rate_rad_s: before.rate_rad_s,
        orders: orders.map(|order| harmonic(order, &before.spectrum, &after.spectrum)).collect(),
        one_degree: OneDegreeJson { before: before.one_degree, after: after.one_degree },
    }
}

fn harmonic(order: u16, before: &OrderSpectrum, after: &OrderSpectrum) -> HarmonicJson {
    let [before_rad_s, after_rad_s] = [before, after].map(|spectrum| spectrum.amplitude(order));
    HarmonicJson { order, before_rad_s, after_rad_s, factor: before_rad_s / after_rad_s }
}

/// A row of the table: an order at a rate before and after.
fn order_line(degrees: f64, order: u16, before: &OrderSpectrum, after: &OrderSpectrum) -> String {
    let [was, is] = [before, after].map(|spectrum| spectrum.amplitude(order));
    format!("{degrees:>5.0} °/s  harmonic {order:>3}  {:>9} rad/s {:>11} {:>8} ×\n", short(was), short(is), factor(was / is))
}

/// A factor below ten with one digit more.
fn factor(factor: f64) -> String {
    if factor < 0.1 { format!("{factor:.3}") } else { format!("{factor:.*}", usize::from(factor < 10.0)) }
}

fn grown_line(rate_rad_s: f64, change: &OrderChange) -> String {
    let OrderChange { order, before_rad_s, after_rad_s } = *change;
    let degrees = rate_rad_s.to_degrees();
    format!("larger at {degrees:.0} °/s: order {order}, from {} to {} rad/s\n", short(before_rad_s), short(after_rad_s))
}

/// The largest order without the compensation.
fn largest_line(rate_rad_s: f64, before: &OrderSpectrum) -> String {
    before.largest().map_or(String::new(), |order| {
        let degrees = rate_rad_s.to_degrees();
        format!("the largest order of this stand before, at {degrees:.0} °/s: {order}, {} rad/s\n", short(before.amplitude(order)))
    })
}

/// The reason why a torque is not compensated.
fn not_compensated(torque: &NotCompensated) -> String {
    match torque {
        NotCompensated::Effect(name) => format!("{name}: the firmware has no compensation for it"),
        NotCompensated::UserEffect(name) => format!("{name}: the firmware has no compensation for user-defined effects"),
        NotCompensated::WeakHarmonic(order) => format!("harmonic order {order}: the firmware holds the {MAX_HARMONICS} largest"),
        NotCompensated::NoHarmonic { threshold_N_m } => format!("no harmonic is above the noise threshold of {threshold_N_m:.2e} N m"),
    }
}

/// A torque that is not compensated, for programs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum LeftOutKind {
    /// An effect that the firmware does not compensate.
    Effect {
        /// The effect.
        effect: String,
    },
    /// An effect of the user's own.
    UserEffect {
        /// The effect.
        effect: String,
    },
    /// A harmonic beyond those that the firmware holds.
    WeakHarmonic {
        /// Its order.
        order: u16,
        /// Harmonics that the firmware holds.
        most: usize,
    },
    /// No harmonic above the noise.
    NoHarmonic {
        /// The threshold, N m.
        threshold_N_m: f64,
    },
}

/// What is not compensated, for programs.
fn left_out_kind(torque: &NotCompensated) -> LeftOutKind {
    match torque {
        NotCompensated::Effect(name) => LeftOutKind::Effect { effect: name.clone() },
        NotCompensated::UserEffect(name) => LeftOutKind::UserEffect { effect: name.clone() },
        NotCompensated::WeakHarmonic(order) => LeftOutKind::WeakHarmonic { order: *order, most: MAX_HARMONICS },
        NotCompensated::NoHarmonic { threshold_N_m } => LeftOutKind::NoHarmonic { threshold_N_m: *threshold_N_m },
    }
}

/// A compensation in force on the stand behind `port`, as text; `save`: it was to be saved in the flash.
pub fn serial_text(port: &str, result: &InForce, save: bool) -> String {
    let outcome = match (&result.withdrawn, save) {
        (Some(_), _) => "the new compensation was withdrawn; the previous one is in force",
        (None, true) => "the compensation is in force and saved in its flash",
        (None, false) => "the compensation is in force; SETTings:SAVE saves it",
    };
    let mut text = format!("{port}: {outcome}\n");
    result.lines.iter().for_each(|line| text += &format!("  {line}\n"));
    result.not_compensated.iter().for_each(|torque| text += &format!("  not compensated: {}\n", not_compensated(torque)));
    let Some(trial) = &result.trial else { return text };
    let degrees = trial.rate_rad_s.to_degrees();
    text += "\nRipple of the rate by the encoder of the stand (amplitude of each order of the old and the new compensation):\n";
    text += "     rate                        before       after   reduction\n";
    trial.orders.iter().for_each(|order| text += &order_line(degrees, *order, &trial.before, &trial.after));
    if let Some(grown) = &result.withdrawn {
        grown.iter().for_each(|change| text += &grown_line(trial.rate_rad_s, change));
        text += &largest_line(trial.rate_rad_s, &trial.before);
    }
    text
}

#[derive(Serialize, JsonSchema)]
struct SerialCompensationJson<'a> {
    port: &'a str,
    source: &'a str,
    in_force: &'a [String],
    withdrawn: bool,
    saved: bool,
    left_out: Vec<String>,
    /// The same: kind and numbers.
    left_out_reasons: Vec<LeftOutKind>,
    ripple: Option<TrialJson>,
}

#[derive(Serialize, JsonSchema)]
struct TrialJson {
    rate_rad_s: f64,
    orders: Vec<HarmonicJson>,
}

/// A compensation in force on the stand behind `port`, as JSON; `source`: `model` or `measured`; `save`: it was to be saved in the flash.
pub fn serial_json(port: &str, source: &str, result: &InForce, save: bool) -> Value {
    let left_out = result.not_compensated.iter().map(not_compensated).collect();
    let left_out_reasons = result.not_compensated.iter().map(left_out_kind).collect();
    let withdrawn = result.withdrawn.is_some();
    let trial = |trial: &Trial| TrialJson {
        rate_rad_s: trial.rate_rad_s,
        orders: trial.orders.iter().map(|order| harmonic(*order, &trial.before, &trial.after)).collect(),
    };
    let ripple = result.trial.as_ref().map(trial);
    value(&SerialCompensationJson {
        port,
        source,
        in_force: &result.lines,
        withdrawn,
        saved: save && !withdrawn,
        left_out,
        left_out_reasons,
        ripple,
    })
}

/// A number with three digits.
fn short(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e4).contains(&x.abs()) { format!("{x:.2e}") } else { format!("{x:.4}") }
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("compensate --stand", schema_of::<FileCompensationJson<'_>>()), ("compensate --port", schema_of::<SerialCompensationJson<'_>>())]
}

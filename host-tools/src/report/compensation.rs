//! A compensation written into a stand, as text and JSON.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;
use stand_firmware::compensation::{Compensation, MAX_HARMONICS};

use super::json::value;
use crate::compensate::serial_stand::InForce;
use crate::compensate::{NotCompensated, Ripple};

/// A compensation written into the file of a simulated stand, with its effect on the ripple.
pub struct FileCompensation<'a> {
    /// The stand's file.
    pub path: &'a Path,
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
        let mut text = format!("{}: [firmware.compensation] written\n", self.path.display());
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
            for ((order, was), (_, is)) in before.orders.iter().zip(&after.orders) {
                text +=
                    &format!("{degrees:>5.0} °/s  harmonic {order:>3}  {:>9} rad/s {:>11} {:>8.0} ×\n", short(*was), short(*is), was / is);
            }
            let (was, is) = (before.one_degree, after.one_degree);
            text += &format!(
                "{degrees:>5.0} °/s  over 1°       {:>9} %     {:>11} {:>8.1} ×\n",
                short(100.0 * was),
                short(100.0 * is),
                was / is
            );
        }
        text
    }

    /// The result as JSON.
    pub fn json(&self) -> Value {
        value(&FileCompensationJson {
            stand: self.path.display().to_string(),
            source: self.source,
            compensation: self.compensation,
            left_out: self.not_compensated.iter().map(not_compensated).collect(),
            ripple: self.ripple.iter().map(ripple).collect(),
        })
    }
}

#[derive(Serialize)]
struct FileCompensationJson<'a> {
    stand: String,
    source: &'static str,
    compensation: &'a Compensation,
    left_out: Vec<String>,
    ripple: Vec<RippleJson>,
}

#[derive(Serialize)]
struct RippleJson {
    rate_rad_s: f64,
    orders: Vec<HarmonicJson>,
    one_degree: OneDegreeJson,
}

#[derive(Serialize)]
struct HarmonicJson {
    order: u16,
    before_rad_s: f64,
    after_rad_s: f64,
    factor: f64,
}

#[derive(Serialize)]
struct OneDegreeJson {
    before: f64,
    after: f64,
}

fn ripple([before, after]: &[Ripple; 2]) -> RippleJson {
    let orders = before.orders.iter().zip(&after.orders);
    let harmonic = |(&(order, before_rad_s), &(_, after_rad_s)): (&(u16, f64), &(u16, f64))| HarmonicJson {
        order,
        before_rad_s,
        after_rad_s,
        factor: before_rad_s / after_rad_s,
    };
    RippleJson {
        rate_rad_s: before.rate_rad_s,
        orders: orders.map(harmonic).collect(),
        one_degree: OneDegreeJson { before: before.one_degree, after: after.one_degree },
    }
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

/// A compensation in force on the stand behind `port`, as text.
pub fn serial_text(port: &str, result: &InForce, saved: bool) -> String {
    let flash = if saved { " and saved in its flash" } else { "; SETTings:SAVE saves it" };
    let mut text = format!("{port}: the compensation is in force{flash}\n");
    result.lines.iter().for_each(|line| text += &format!("  {line}\n"));
    result.not_compensated.iter().for_each(|torque| text += &format!("  not compensated: {}\n", not_compensated(torque)));
    text
}

#[derive(Serialize)]
struct SerialCompensationJson<'a> {
    port: &'a str,
    source: &'a str,
    in_force: &'a [String],
    saved: bool,
    left_out: Vec<String>,
}

/// A compensation in force on the stand behind `port`, as JSON; `source`: `model` or `measured`.
pub fn serial_json(port: &str, source: &str, result: &InForce, saved: bool) -> Value {
    let left_out = result.not_compensated.iter().map(not_compensated).collect();
    value(&SerialCompensationJson { port, source, in_force: &result.lines, saved, left_out })
}

/// A number with three digits.
fn short(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e4).contains(&x.abs()) { format!("{x:.2e}") } else { format!("{x:.4}") }
}

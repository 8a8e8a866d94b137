//! The model's parameters by output error, from the record that moves most; and the inertia by an added one, which needs no motor constant.

use super::{orders, readings};
use crate::calibrate::session::Session;
use crate::calibrate::{Findings, Step};
use crate::identify::fit::{self, FitResult};
use crate::model::{Input, Model};
use crate::statistics::Extremes;
use crate::statistics::uncertainty::{Part, Quantity};

/// The effects of a plain drive.
const EFFECTS: [&str; 3] = ["viscous", "coulomb", "inductance"];
/// Worse than this many times the noise, something is missing.
const MISFIT: f64 = 1.1;

/// What the model's fit gives to the other ways.
pub(super) struct Drive {
    /// J.
    pub inertia_kg_m2: (f64, f64),
    /// K.
    pub motor_constant_N_m_A: (f64, f64),
    /// b.
    pub viscous_N_m_s: (f64, f64),
}

impl Drive {
    fn of(held: &FitResult, misfit: f64) -> Option<Self> {
        // Where the model lacks something, its own uncertainties are too small by as much at the least.
        let wide = |(value, sigma): (f64, f64)| (value, sigma * misfit.max(1.0));
        Some(Self {
            inertia_kg_m2: wide(get(held, "inertia_kg_m2")?),
            motor_constant_N_m_A: wide(get(held, "motor_constant_N_m_A")?),
            viscous_N_m_s: wide(get(held, "viscous_N_m_s").unwrap_or((0.0, 0.0))),
        })
    }
}

/// Profiles that excite all parameters.
pub(super) fn is_rich(step: &Step) -> bool {
    let says = |key: &str, words: &[&str]| step.log.note(key).is_some_and(|v| words.contains(&v));
    says("mode", &["voltage"]) && says("profile", &["multi-step", "prbs", "multisine"])
}

/// What comes round with the angle: order, amplitude in N m, phase, as the slow turn has it.
type Waves = [(usize, f64, f64)];

fn fitted(step: &Step, waves: &Waves) -> Result<(FitResult, f64), String> {
    let mut model = Model::new(Input::Voltage, "drive").map_err(|e| e.to_string())?;
    for effect in EFFECTS {
        model.add(effect).map_err(|e| e.to_string())?;
    }
    for (k, (order, amplitude_N_m, phase_rad)) in waves.iter().enumerate() {
        let mark = if k == 0 { String::new() } else { format!("#{}", k + 1) };
        model.add(&format!("cogging{mark}")).map_err(|e| e.to_string())?;
        for (name, value) in [("N_m", *amplitude_N_m), ("order", *order as f64), ("phase_rad", *phase_rad)] {
            model.set(&format!("cogging_{name}{mark}"), value).map_err(|e| e.to_string())?;
        }
    }
    let (record, _) = fit::prepare::prepare(&step.log, &model, false).map_err(|e| e.to_string())?;
    let (system, parameters) = fit::build::system(&model, record.temp_C.is_some());
    let held = fit::fit(&system, &parameters, &record).map_err(|e| e.to_string())?;
    let misfit = held.channels.iter().map(|c| c.rms / c.noise).max_or_zero();
    Ok((held, misfit))
}

fn get(held: &FitResult, name: &str) -> Option<(f64, f64)> {
    let k = held.parameters.list.iter().position(|p| p.name == name)?;
    Some((held.parameters.list[k].value, *held.sigmas.get(k)?)).filter(|(_, sigma)| sigma.is_finite())
}

/// Adds the parameters.
pub(super) fn add(steps: &[Step], session: &Session, findings: &mut Findings) -> Option<Drive> {
    let lacks = |findings: &mut Findings, why: &str| {
        for name in ["inertia_kg_m2", "motor_constant_N_m_A", "resistance_ohm", "inductance_H", "viscous_N_m_s", "coulomb_N_m"] {
            findings.lacks(name, why);
        }
    };
    let Some(step) = steps.iter().find(|s| is_rich(s) && s.added_inertia_kg_m2.is_none()) else {
        lacks(findings, "it takes a step in voltage mode with the profile multi-step, prbs or multisine");
        return None;
    };
    let (mut held, mut misfit) = match fitted(step, &[]) {
        Ok(found) => found,
        Err(why) => {
            lacks(findings, &why);
            return None;
        }
    };
    // A torque that comes round with the angle bends the other parameters: what the slow turn shows of it goes into the model.
    let mut waves = Vec::new();
    if misfit > MISFIT
        && let Some(rough) = Drive::of(&held, misfit)
    {
        waves = orders::strongest(steps, &rough, session);
        match fitted(step, &waves) {
            Ok((with, left)) if !waves.is_empty() && left < misfit => {
                (held, misfit) = (with, left);
                let orders: Vec<String> = waves.iter().map(|(order, ..)| order.to_string()).collect();
                findings.says.push(format!("the model has cogging of order {} beside its friction", orders.join(", ")));
            }
            _ => waves.clear(),
        }
    }
    if misfit > MISFIT {
        findings.says.push(format!(
            "step `{}`: the model of {} leaves {misfit:.2} × the noise: it lacks something, and its parameters bend to make up for it; `stand explain` says what",
            step.name,
            EFFECTS.join(", ")
        ));
    }
    // The powers with which the readings of voltage and current enter: K is V s/rad, R is V/A, torques are K times A.
    let table = [
        ("inertia_kg_m2", "kg m²", [1, 1]),
        ("motor_constant_N_m_A", "N m/A", [1, 0]),
        ("resistance_ohm", "Ω", [1, -1]),
        ("inductance_H", "H", [1, -1]),
        ("viscous_N_m_s", "N m s/rad", [1, 1]),
        ("coulomb_N_m", "N m", [1, 1]),
    ];
    for (name, unit, by) in table {
        match get(&held, name) {
            Some((value, sigma)) => {
                let mut parts = vec![Part {
                    dof: f64::INFINITY,
                    ..Part::measured(
                        "noise and regression",
                        sigma * misfit.max(1.0),
                        0.0,
                        "output error, all rows; colour taken into account",
                    )
                }];
                parts.extend(readings(session, value, by));
                findings.quantities.push(Quantity::new(name, unit, value, parts).saying("by output error, as `stand fit`"));
            }
            None => findings.lacks(name, "this record does not determine it"),
        }
    }
    let (j, k, r) = (get(&held, "inertia_kg_m2")?, get(&held, "motor_constant_N_m_A")?, get(&held, "resistance_ohm")?);
    let b = get(&held, "viscous_N_m_s").unwrap_or((0.0, 0.0));
    time_constants(findings, &held, j, k, r, b);
    added(steps, &held, &waves, findings);
    Drive::of(&held, misfit)
}

/// τ_m = J R/(K² + R b), τ_e = L/R. Voltage and current scales fall out of both but for b's small part.
fn time_constants(findings: &mut Findings, held: &FitResult, j: (f64, f64), k: (f64, f64), r: (f64, f64), b: (f64, f64)) {
    let below = k.0 * k.0 + r.0 * b.0;
    let value = j.0 * r.0 / below;
    // The fit's parameters are correlated; the sum of all is never too small (GUM 5.2.2, note 1).
    let u = value * (j.1 / j.0 + (r.1 / r.0) * (1.0 - r.0 * b.0 / below) + 2.0 * k.1 * k.0 / below + r.0 * b.1 / below);
    let part = |u: f64| Part {
        dof: f64::INFINITY,
        ..Part::measured("regression", u, 0.0, "the parameters' own uncertainties, as if wholly correlated")
    };
    findings.quantities.push(Quantity::new("mechanical_time_constant_s", "s", value, vec![part(u)]).saying("J R/(K² + R b)"));
    if let Some(l) = get(held, "inductance_H").filter(|l| l.0 > 0.0) {
        let value = l.0 / r.0;
        findings
            .quantities
            .push(Quantity::new("electrical_time_constant_s", "s", value, vec![part(value * (l.1 / l.0 + r.1 / r.0))]).saying("L/R"));
    }
}

/// Two fits, with and without a known inertia: their difference is known, so their ratio gives J whatever the scales of current and voltage.
fn added(steps: &[Step], held: &FitResult, waves: &Waves, findings: &mut Findings) {
    let name = "inertia_by_added_kg_m2";
    let Some(step) = steps.iter().find(|s| is_rich(s) && s.added_inertia_kg_m2.is_some()) else {
        return findings.lacks(name, "it takes the same step again with a known inertia on the platform (added_inertia_kg_m2)");
    };
    let more = step.added_inertia_kg_m2.unwrap_or(0.0);
    let with = match fitted(step, waves) {
        Ok((with, _)) => with,
        Err(why) => return findings.lacks(name, why),
    };
    // Per torque, as both fits have the same K: in units of K, J/K.
    let ratio = |held: &FitResult| Some((get(held, "inertia_kg_m2")?, get(held, "motor_constant_N_m_A")?));
    let (Some(((j1, u1), (k1, _))), Some(((j2, u2), (k2, _)))) = (ratio(held), ratio(&with)) else { return };
    let (a1, a2) = (j1 / k1, j2 / k2);
    let (ua1, ua2) = (u1 / k1, u2 / k2);
    if (a2 - a1).is_nan() || a2 - a1 <= 5.0 * ua1.hypot(ua2) {
        return findings.lacks(name, "the inertia that was added does not show: is it on the platform?");
    }
    let value = more * a1 / (a2 - a1);
    let per = more / (a2 - a1).powi(2);
    let parts = vec![
        Part { dof: f64::INFINITY, ..Part::measured("without it", per * a2 * ua1, 0.0, "J/K by output error") },
        Part { dof: f64::INFINITY, ..Part::measured("with it", per * a1 * ua2, 0.0, "J/K by output error") },
    ];
    findings.quantities.push(
        Quantity::new(name, "kg m²", value, parts)
            .saying("by the inertia that was added, which is believed: no scale of voltage or current enters"),
    );
}

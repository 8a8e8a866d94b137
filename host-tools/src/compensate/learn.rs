//! Compensation from a fitted model.
//!
//! Friction (`coulomb`, `viscous`) is used unchanged. Angle-dependent torques (`cogging`, `unbalance`, repeated or not) become harmonics; those of
//! equal harmonic order are added. Their phases refer to the zero of the log's angle, so a log whose angle zero is not the index is refused.
//! The firmware converts torque to voltage with its own R/K; the model's torques are scaled so that the voltage equals the model's. Other torques
//! (for example a ripple proportional to the current) are not compensated and are listed.

use std::f64::consts::TAU;

use drive_model::{Compensation as Rule, Domain};
use stand_firmware::compensation::{Compensation, Harmonic, Harmonics, MAX_HARMONICS};
use stand_firmware::speed_loop::Settings;

use crate::log::Log;
use crate::model::{Model, ModelEffect};

/// The compensation of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Learnt {
    /// Compensation for the firmware settings.
    pub compensation: Compensation,
    /// Torques of the model that are not compensated, one line each.
    pub left_out: Vec<String>,
}

/// Reasons why a model gives no compensation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LearnError {
    /// The angle zero is unknown.
    #[error(
        "{model}: the phases of {orders} need a known angle zero; give the log of the fit with --log (it must have the note \
         `theta_zero: index`)"
    )]
    ZeroUnknown {
        /// File name of the model.
        model: String,
        /// The effects.
        orders: String,
    },
    /// The angle zero is not the index.
    #[error(
        "{log}: the angle is not counted from the index ({note}), so the phases of {model} cannot be used; record a log with \
         `theta_zero: index` and fit the model to it, or let the stand measure its cogging (--measure-cogging)"
    )]
    ZeroElsewhere {
        /// File name of the log.
        log: String,
        /// Its note on the angle zero.
        note: String,
        /// File name of the model.
        model: String,
    },
    /// The log has no angle.
    #[error("{log}: there is no column theta_rad, so the harmonics of {model} cannot have been fitted to this log")]
    NoAngle {
        /// File name of the log.
        log: String,
        /// File name of the model.
        model: String,
    },
    /// There is nothing to compensate.
    #[error("{model}: the model has none of the effects coulomb, viscous, cogging, unbalance; there is nothing to compensate")]
    Nothing {
        /// File name of the model.
        model: String,
    },
}

/// Compensation of `model` for a firmware with `settings`; `log` is the log of the fit.
///
/// # Errors
/// Harmonics without a known angle zero; nothing to compensate.
pub fn learn(model: &Model, log: Option<&Log>, settings: &Settings) -> Result<Learnt, LearnError> {
    let scale = torque_scale(model, settings);
    let mut compensation = settings.compensation;
    (compensation.coulomb_N_m, compensation.viscous_N_m_s) = (0.0, 0.0);
    let mut orders: Vec<(u16, [f64; 2])> = Vec::new();
    let (mut left_out, mut angle_dependent) = (Vec::new(), Vec::new());
    let mut found = false;
    for effect in model.effects() {
        let value = |k: usize| effect.parameters.get(k).map_or(0.0, |p| model.parameters()[*p].value);
        match effect.card.compensation {
            Some(Rule::CoulombTorque) => compensation.coulomb_N_m += scale * value(0),
            Some(Rule::ViscousCoefficient) => compensation.viscous_N_m_s += scale * value(0),
            Some(Rule::Harmonic) => add(&mut orders, value(1) as u16, scale * value(0), value(2)),
            Some(Rule::FirstHarmonic) => add(&mut orders, 1, scale * value(0), value(1)),
            Some(Rule::WindingTimeConstant) => {
                compensation.winding_lag_s = value(0) / model.value("resistance_ohm").unwrap_or(settings.resistance_ohm);
                continue;
            }
            None => {
                if effect.card.domain == Domain::Torque {
                    left_out.push(format!("{}: the firmware has no compensation for it", effect.name()));
                }
                continue;
            }
        }
        found = true;
        if matches!(effect.card.compensation, Some(Rule::Harmonic | Rule::FirstHarmonic)) {
            angle_dependent.push(effect);
        }
    }
    left_out
        .extend(model.user_effects().iter().map(|own| format!("{}: the firmware has no compensation for user-defined effects", own.name)));
    if !found {
        return Err(LearnError::Nothing { model: model.name().to_owned() });
    }
    check_zero(model, log, &angle_dependent)?;
    let mut harmonics: Vec<Harmonic> = orders.into_iter().map(|(order, sum)| harmonic(order, sum)).collect();
    harmonics.sort_by(|a, b| b.torque_N_m.total_cmp(&a.torque_N_m));
    for weak in harmonics.drain(MAX_HARMONICS.min(harmonics.len())..) {
        left_out.push(format!("harmonic order {}: the firmware holds the {MAX_HARMONICS} largest", weak.order));
    }
    compensation.harmonics = Harmonics::of(harmonics).unwrap_or_default();
    Ok(Learnt { compensation, left_out })
}

/// Scale from model torque to firmware torque for equal voltage (R/K of either).
fn torque_scale(model: &Model, settings: &Settings) -> f64 {
    let constant = model.value("motor_constant_N_m_A").unwrap_or(settings.motor_constant_N_m_A);
    let resistance = model.value("resistance_ohm").unwrap_or(settings.resistance_ohm);
    resistance / constant * settings.motor_constant_N_m_A / settings.resistance_ohm
}

/// Adds a sin(nθ + φ) to the harmonic of order n.
fn add(orders: &mut Vec<(u16, [f64; 2])>, order: u16, torque_N_m: f64, phase_rad: f64) {
    let [sine, cosine] = [torque_N_m * phase_rad.cos(), torque_N_m * phase_rad.sin()];
    match orders.iter_mut().find(|(n, _)| *n == order) {
        Some((_, sum)) => *sum = [sum[0] + sine, sum[1] + cosine],
        None => orders.push((order, [sine, cosine])),
    }
}

fn harmonic(order: u16, [sine, cosine]: [f64; 2]) -> Harmonic {
    Harmonic { order, torque_N_m: sine.hypot(cosine), phase_rad: cosine.atan2(sine).rem_euclid(TAU) }
}

fn check_zero(model: &Model, log: Option<&Log>, angle_dependent: &[&ModelEffect]) -> Result<(), LearnError> {
    if angle_dependent.is_empty() {
        return Ok(());
    }
    let name = model.name().to_owned();
    let Some(log) = log else {
        let orders = angle_dependent.iter().map(|e| e.name()).collect::<Vec<_>>().join(", ");
        return Err(LearnError::ZeroUnknown { model: name, orders });
    };
    let path = log.path().display().to_string();
    if log.column("theta_rad").is_none() {
        return Err(LearnError::NoAngle { log: path, model: name });
    }
    match log.note("theta_zero") {
        Some(note) if note.trim().eq_ignore_ascii_case("index") => Ok(()),
        other => {
            let note = other.map_or("there is no note theta_zero".to_owned(), |note| format!("theta_zero: {note}"));
            Err(LearnError::ZeroElsewhere { log: path, note, model: name })
        }
    }
}

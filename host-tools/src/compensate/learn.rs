//! From a fitted model to a compensation.
//!
//! Friction (`coulomb`, `viscous`) is taken as it is; torques of the angle (`cogging`, `unbalance`, repeated or not) become harmonics, those of
//! one order in one. Their phases count from the log's zero of the angle, so a log that does not begin its angle at the index is refused.
//! The firmware makes volts of torque by its own R/K; the model's torques are scaled so that the volts are the model's. What else of the
//! model is a torque (ripple that grows with the current, say) is not compensated, and named.

use std::f64::consts::TAU;

use drive_model::{Compensation as Rule, Domain};
use stand_firmware::compensation::{Compensation, Harmonic, Harmonics, MOST_HARMONICS};
use stand_firmware::speed_loop::Settings;

use crate::log::Log;
use crate::model::{Model, ModelEffect};

/// What was taken from a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Learnt {
    /// For the firmware's settings.
    pub compensation: Compensation,
    /// What of the model is not compensated, a line each.
    pub left_out: Vec<String>,
}

/// Why a model teaches nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LearnError {
    /// The angle's zero is not known.
    #[error(
        "{model}: its orders ({orders}) have phases, and nobody said from where they count; give the log that it was fitted to with --log (it \
         must have the note `theta_zero: index`)"
    )]
    ZeroUnknown {
        /// The model's file.
        model: String,
        /// The effects.
        orders: String,
    },
    /// The angle's zero is not the index.
    #[error(
        "{log}: its angle does not count from the index ({note}), so the orders of {model} have no phase that the stand could use; record a log \
         that says `theta_zero: index` and fit to it, or let the stand measure its cogging itself (--measure-cogging)"
    )]
    ZeroElsewhere {
        /// The log's file.
        log: String,
        /// What it says of its zero.
        note: String,
        /// The model's file.
        model: String,
    },
    /// The log has no angle.
    #[error("{log}: it has no column theta_rad, so the orders of {model} cannot have been fitted to it")]
    NoAngle {
        /// The log's file.
        log: String,
        /// The model's file.
        model: String,
    },
    /// There is nothing to compensate.
    #[error("{model}: it has none of coulomb, viscous, cogging, unbalance: there is nothing that the firmware could compensate")]
    Nothing {
        /// The model's file.
        model: String,
    },
}

/// Takes the compensation out of `model`, for a firmware with these settings; `log` is what the model was fitted to.
///
/// # Errors
/// Orders without a zero of the angle; nothing to compensate.
pub fn learn(model: &Model, log: Option<&Log>, settings: &Settings) -> Result<Learnt, LearnError> {
    let scale = torque_scale(model, settings);
    let mut compensation = settings.compensation;
    (compensation.coulomb_N_m, compensation.viscous_N_m_s) = (0.0, 0.0);
    let mut orders: Vec<(u16, [f64; 2])> = Vec::new();
    let (mut left_out, mut of_the_angle) = (Vec::new(), Vec::new());
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
            of_the_angle.push(effect);
        }
    }
    left_out
        .extend(model.user_effects().iter().map(|own| format!("{}: the firmware has no compensation for an effect of your own", own.name)));
    if !found {
        return Err(LearnError::Nothing { model: model.name().to_owned() });
    }
    check_zero(model, log, &of_the_angle)?;
    let mut harmonics: Vec<Harmonic> = orders.into_iter().map(|(order, sum)| harmonic(order, sum)).collect();
    harmonics.sort_by(|a, b| b.torque_N_m.total_cmp(&a.torque_N_m));
    for weak in harmonics.drain(MOST_HARMONICS.min(harmonics.len())..) {
        left_out.push(format!("order {}: the firmware has room for the {MOST_HARMONICS} strongest", weak.order));
    }
    compensation.harmonics = Harmonics::of(harmonics).unwrap_or_default();
    Ok(Learnt { compensation, left_out })
}

/// Torque in the firmware's terms of one N m of the model: the same voltage by R/K of either.
fn torque_scale(model: &Model, settings: &Settings) -> f64 {
    let constant = model.value("motor_constant_N_m_A").unwrap_or(settings.motor_constant_N_m_A);
    let resistance = model.value("resistance_ohm").unwrap_or(settings.resistance_ohm);
    resistance / constant * settings.motor_constant_N_m_A / settings.resistance_ohm
}

/// Adds a sin(nθ + φ) to what there is of order n.
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

fn check_zero(model: &Model, log: Option<&Log>, of_the_angle: &[&ModelEffect]) -> Result<(), LearnError> {
    if of_the_angle.is_empty() {
        return Ok(());
    }
    let name = model.name().to_owned();
    let Some(log) = log else {
        let orders = of_the_angle.iter().map(|e| e.name()).collect::<Vec<_>>().join(", ");
        return Err(LearnError::ZeroUnknown { model: name, orders });
    };
    let path = log.path().display().to_string();
    if log.column("theta_rad").is_none() {
        return Err(LearnError::NoAngle { log: path, model: name });
    }
    match log.note("theta_zero") {
        Some(note) if note.trim().eq_ignore_ascii_case("index") => Ok(()),
        other => {
            let note = other.map_or("it has no note theta_zero".to_owned(), |note| format!("theta_zero: {note}"));
            Err(LearnError::ZeroElsewhere { log: path, note, model: name })
        }
    }
}

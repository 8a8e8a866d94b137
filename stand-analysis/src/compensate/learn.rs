//! Compensation from a fitted model.
//!
//! Friction is used unchanged. Angle-dependent torques (cogging, unbalance, repeated or not) become harmonics; those of equal harmonic
//! order are added. The card of an effect states its rule ([`drive_model::Compensation`]). Their phases refer to the zero of the log's
//! angle, so a log whose angle zero is not the index is refused. The firmware converts torque to voltage with its own R/K; the model's
//! torques are scaled so that the voltage equals the model's. Other torques (for example a ripple proportional to the current) are not
//! compensated and are listed.

use identification::parameters::NamesParameters;
use std::f64::consts::TAU;

use drive_model::{Compensation as Rule, Domain, cards};
use stand_firmware::compensation::{Compensation, Harmonic, Harmonics, MAX_HARMONICS};
use stand_firmware::speed_loop::Settings;

use identification::log::Log;
use identification::model::{BaseParameter, Model, ModelEffect};

/// A compensation from a model or from the stand's own measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Learnt {
    /// Compensation for the firmware settings.
    pub compensation: Compensation,
    /// What is not compensated.
    pub not_compensated: Vec<NotCompensated>,
}

/// A torque that is not compensated.
#[derive(Debug, Clone, PartialEq)]
pub enum NotCompensated {
    /// An effect of the catalogue for which the firmware has no compensation: its name in the model.
    Effect(String),
    /// A user-defined effect: its name in the model.
    UserEffect(String),
    /// A harmonic beyond the number that the firmware holds: its harmonic order.
    WeakHarmonic(u16),
    /// The stand measured no harmonic above its noise threshold, N m.
    NoHarmonic {
        /// The threshold, N m.
        threshold_N_m: f64,
    },
}

/// Reasons why a model gives no compensation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LearnError {
    /// The angle zero is unknown.
    #[error(
        "{model}: the phases of {} need a known angle zero; give the log of the fit (it must have the note \
         `theta_zero: index`)",
        .effects.join(", ")
    )]
    ZeroUnknown {
        /// File name of the model.
        model: String,
        /// Names of the effects with a phase.
        effects: Vec<String>,
    },
    /// The angle zero is not the index.
    #[error(
        "{log}: the angle is not counted from the index ({}), so the phases of {model} cannot be used; record a log with \
         `theta_zero: index` and fit the model to it, or let the stand measure its cogging",
        .note.as_ref().map_or("there is no note theta_zero".to_owned(), |note| format!("theta_zero: {note}"))
    )]
    ZeroElsewhere {
        /// File name of the log.
        log: String,
        /// Its note on the angle zero; `None`: there is none.
        note: Option<String>,
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
    #[error("{model}: the model has none of the effects {}; there is nothing to compensate", compensated_effects().join(", "))]
    Nothing {
        /// File name of the model.
        model: String,
    },
}

impl NamesParameters for LearnError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            LearnError::ZeroUnknown { .. } => vec!["log"],
            LearnError::ZeroElsewhere { .. } => vec!["measure_cogging"],
            _ => Vec::new(),
        }
    }
}

/// Effects whose torque the firmware compensates.
fn compensated_effects() -> Vec<&'static str> {
    let torques = cards().iter().filter(|card| card.compensation.is_some_and(|rule| rule != Rule::WindingTimeConstant));
    torques.map(|card| card.id).collect()
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
    let (mut not_compensated, mut angle_dependent) = (Vec::new(), Vec::new());
    let mut found = false;
    for effect in model.effects() {
        let value = |k: usize| effect.parameters.get(k).map_or(0.0, |p| model.parameters()[*p].value);
        match effect.card.compensation {
            Some(Rule::CoulombTorque) => compensation.coulomb_N_m += scale * value(0),
            Some(Rule::ViscousCoefficient) => compensation.viscous_N_m_s += scale * value(0),
            Some(Rule::Harmonic) => add(&mut orders, value(1) as u16, scale * value(0), value(2)),
            Some(Rule::FirstHarmonic) => add(&mut orders, 1, scale * value(0), value(1)),
            Some(Rule::WindingTimeConstant) => {
                compensation.winding_lag_s = value(0) / model.base(BaseParameter::Resistance).unwrap_or(settings.resistance_ohm);
                continue;
            }
            None => {
                if effect.card.domain == Domain::Torque {
                    not_compensated.push(NotCompensated::Effect(effect.name()));
                }
                continue;
            }
        }
        found = true;
        if matches!(effect.card.compensation, Some(Rule::Harmonic | Rule::FirstHarmonic)) {
            angle_dependent.push(effect);
        }
    }
    not_compensated.extend(model.user_effects().iter().map(|own| NotCompensated::UserEffect(own.name.clone())));
    if !found {
        return Err(LearnError::Nothing { model: model.name().to_owned() });
    }
    check_zero(model, log, &angle_dependent)?;
    let mut harmonics: Vec<Harmonic> = orders.into_iter().map(|(order, sum)| harmonic(order, sum)).collect();
    harmonics.sort_by(|a, b| b.torque_N_m.total_cmp(&a.torque_N_m));
    for weak in harmonics.drain(MAX_HARMONICS.min(harmonics.len())..) {
        not_compensated.push(NotCompensated::WeakHarmonic(weak.order));
    }
    compensation.harmonics = Harmonics::of(harmonics).unwrap_or_default();
    Ok(Learnt { compensation, not_compensated })
}

/// Scale from model torque to firmware torque for equal voltage (R/K of either).
fn torque_scale(model: &Model, settings: &Settings) -> f64 {
    let constant = model.base(BaseParameter::MotorConstant).unwrap_or(settings.motor_constant_N_m_A);
    let resistance = model.base(BaseParameter::Resistance).unwrap_or(settings.resistance_ohm);
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
        return Err(LearnError::ZeroUnknown { model: name, effects: angle_dependent.iter().map(|e| e.name()).collect() });
    };
    let path = log.path().display().to_string();
    if log.column("theta_rad").is_none() {
        return Err(LearnError::NoAngle { log: path, model: name });
    }
    if log.theta_zero_is_index() {
        return Ok(());
    }
    Err(LearnError::ZeroElsewhere { log: path, note: log.note("theta_zero").map(str::to_owned), model: name })
}

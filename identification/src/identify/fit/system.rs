//! The system of a fit: base parameters and effects, and the rig that they make.

use std::sync::Arc;

use drive_model::{LawScalar, LawSource};
use drive_rig::{Base, Rig, Servo};

use super::parameters::{DerivativeScalar, Parameters};
use crate::model::Input;

/// A scalar of the fit: every effect has its law in it.
pub trait FitScalar: DerivativeScalar + LawScalar {}
impl<S: DerivativeScalar + LawScalar> FitScalar for S {}

/// An effect of the model.
#[derive(Clone)]
pub struct Effect {
    /// Name in the model, e.g. `cogging#2`.
    pub name: String,
    /// The law.
    pub source: Arc<dyn LawSource>,
    /// Indices of its parameters, in the order of the law.
    pub parameters: Vec<usize>,
}

/// The model of a fit: positions of the base parameters in the parameter list, and effects.
#[derive(Clone)]
pub struct System {
    /// Index of the inertia; optional for a prescribed motion.
    pub inertia: Option<usize>,
    /// Index of the motor constant, if the input needs one.
    pub motor_constant: Option<usize>,
    /// Index of the resistance, if the input needs one.
    pub resistance: Option<usize>,
    /// Indices of gain, damping and limit of the regulator of a position servo.
    pub servo: Option<[usize; 3]>,
    /// The effects.
    pub effects: Vec<Effect>,
}

impl System {
    /// The simulated rig with these parameters.
    pub fn rig<S: FitScalar>(&self, parameters: &Parameters, driven: Input) -> Rig<S> {
        let values: Vec<S> = parameters.seeded();
        let one = S::one();
        let base = Base {
            inertia: self.inertia.map_or(S::zero(), |k| values[k]),
            motor_constant: self.motor_constant.map_or(one, |k| values[k]),
            resistance: self.resistance.map_or(one, |k| values[k]),
            servo: self.servo.map(|[gain, damping, limit]| Servo {
                gain_V_rad: values[gain],
                damping_V_s_rad: values[damping],
                limit_V: values[limit],
            }),
        };
        let input = match driven {
            Input::Voltage => drive_rig::Input::Voltage,
            Input::Current => drive_rig::Input::Current,
            Input::Torque | Input::Motion => drive_rig::Input::Torque,
            Input::Setpoint => drive_rig::Input::Setpoint,
        };
        let effects = self.effects.iter().map(|e| (S::law(e.source.as_ref()), e.parameters.iter().map(|&k| values[k]).collect())).collect();
        Rig::new(base, input, effects)
    }
}

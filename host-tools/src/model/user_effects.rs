//! An effect of the user's own: an expression in the same places as the catalogue's laws.

use drive_model::{Contributions, Law, Point, Reading, Scalar};

use crate::model::expression::{Expression, Variables};

/// Where an own effect acts; what its expression gives is added there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SummingPoint {
    /// `torque_N_m`: on the rotor.
    Torque,
    /// `dry_N_m`: to the dry level, which holds at rest and opposes while sliding.
    Dry,
    /// `voltage_V`: to the voltage asked for.
    Voltage,
    /// `omega_rad_s`: to what the rate channel shows.
    Rate,
    /// `theta_rad`: to what the angle channel shows.
    Angle,
    /// `i_A`: to what the current channel shows.
    Current,
}

impl SummingPoint {
    /// All of them.
    pub const ALL: [SummingPoint; 6] =
        [SummingPoint::Torque, SummingPoint::Dry, SummingPoint::Voltage, SummingPoint::Rate, SummingPoint::Angle, SummingPoint::Current];

    /// The key in the model file.
    pub fn key(self) -> &'static str {
        match self {
            SummingPoint::Torque => "torque_N_m",
            SummingPoint::Dry => "dry_N_m",
            SummingPoint::Voltage => "voltage_V",
            SummingPoint::Rate => "omega_rad_s",
            SummingPoint::Angle => "theta_rad",
            SummingPoint::Current => "i_A",
        }
    }
}

/// One effect of the user's own. As a [`Law`] it takes its parameters in the order of [`UserEffect::parameters`].
#[derive(Debug, Clone)]
pub struct UserEffect {
    /// Name in the file.
    pub name: String,
    /// Where it acts.
    pub summing_point: SummingPoint,
    /// What it adds there.
    pub expression: Expression,
    /// Indices into the model's parameters, in the order in which the expression takes them.
    pub parameters: Vec<usize>,
}

impl UserEffect {
    fn value<S: Scalar>(&self, p: &[S], x: &Point<S>) -> S {
        let t = S::from(0.5 * (x.from_s + x.to_s));
        let env = Variables { t, theta: x.theta, omega: x.omega, i: x.current, u: x.voltage, temp_C: x.temp_C };
        self.expression.eval(&env, p)
    }
}

impl<S: Scalar> Law<S> for UserEffect {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        match self.summing_point {
            SummingPoint::Torque => a.torque += self.value(p, x),
            SummingPoint::Dry => a.coulomb_torque += self.value(p, x),
            SummingPoint::Voltage => a.voltage += self.value(p, x),
            _ => {}
        }
    }

    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        match self.summing_point {
            SummingPoint::Rate => y.omega += self.value(p, x),
            SummingPoint::Angle => y.theta += self.value(p, x),
            SummingPoint::Current => y.current += self.value(p, x),
            _ => {}
        }
    }
}

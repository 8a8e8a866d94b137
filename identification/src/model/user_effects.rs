//! User effects: an expression of the model file, added at the same points as the laws of the catalogue.

use drive_model::{Contributions, Law, Point, Reading, Scalar};

use crate::log::Axis;
use crate::model::expression::{Expression, Variables};

/// Summing point of a user effect: the quantity that its expression is added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SummingPoint {
    /// `torque_N_m`: torque on the rotor.
    Torque,
    /// `dry_N_m`: Coulomb friction torque, which holds at rest and opposes the motion.
    Dry,
    /// `voltage_V`: commanded voltage.
    Voltage,
    /// `omega_rad_s`: reading of the rate channel.
    Rate,
    /// `theta_rad`: reading of the angle channel.
    Angle,
    /// `i_A`: reading of the current channel.
    Current,
}

impl SummingPoint {
    /// All summing points.
    pub const ALL: [SummingPoint; 6] =
        [SummingPoint::Torque, SummingPoint::Dry, SummingPoint::Voltage, SummingPoint::Rate, SummingPoint::Angle, SummingPoint::Current];

    /// Key in the model file of a drive with this axis.
    pub fn key_on(self, axis: Axis) -> &'static str {
        match (self, axis) {
            (SummingPoint::Dry, Axis::Linear) => "dry_N",
            (point, axis) => axis.column(point.key()),
        }
    }

    /// Key in the model file of a rotary drive.
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

/// A user effect. As a [`Law`] it takes its parameters in the order of [`UserEffect::parameters`].
#[derive(Debug, Clone)]
pub struct UserEffect {
    /// Name in the file.
    pub name: String,
    /// Quantity that the expression is added to.
    pub summing_point: SummingPoint,
    /// The expression.
    pub expression: Expression,
    /// Indices into the model's parameters, in the order of the expression.
    pub parameters: Vec<usize>,
    /// Number of the log's columns among the names of the expression, after the parameters.
    pub columns: usize,
    /// Parameters of the rest of the model in the expression: position among its names, and index into the model's parameters.
    pub shared: Vec<(usize, usize)>,
}

/// Names that an expression can use at most besides the variables.
pub(super) const MAX_VISIBLE: usize = 64;

impl UserEffect {
    fn value<S: Scalar>(&self, p: &[S], x: &Point<S>) -> S {
        let t = S::from(0.5 * (x.from_s + x.to_s));
        let variables = Variables { t, theta: x.theta, omega: x.omega, i: x.current, u: x.voltage, temp_C: x.temp_C };
        let own = self.parameters.len();
        if self.columns == 0 && self.shared.is_empty() {
            return self.expression.eval(&variables, p);
        }
        let mut values = [S::zero(); MAX_VISIBLE];
        for (value, p) in values.iter_mut().zip(&p[..own.min(p.len())]) {
            *value = *p;
        }
        for (value, column) in values[own..].iter_mut().zip(&x.columns[..self.columns]) {
            *value = S::from(*column);
        }
        for ((at, _), p) in self.shared.iter().zip(p.iter().skip(own)) {
            values[*at] = *p;
        }
        self.expression.eval(&variables, &values)
    }
}

impl<S: Scalar> Law<S> for UserEffect {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        match self.summing_point {
            SummingPoint::Torque => out.torque += self.value(p, x),
            SummingPoint::Dry => out.coulomb_torque += self.value(p, x),
            SummingPoint::Voltage => out.voltage += self.value(p, x),
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

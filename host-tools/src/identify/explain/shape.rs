//! A free-form law: heights over a coordinate, linear between them. It claims nothing but that something depends on that coordinate there.

use drive_model::{Contributions, Coordinate, Law, Point, Scalar, Structure};

use crate::model::SummingPoint;

/// Heights over a coordinate, added to a torque, the dry level or the voltage.
#[derive(Debug, Clone)]
pub struct Hats {
    /// Over what: angle, rate, current, temperature or time.
    pub coordinate: Coordinate,
    /// Where it acts.
    pub place: SummingPoint,
    /// Least and greatest value of the coordinate; for the angle one turn.
    pub range: (f64, f64),
    /// Heights.
    pub count: usize,
}

impl Hats {
    /// Where the heights stand.
    pub fn knots(&self) -> Vec<f64> {
        let parts = if self.is_periodic() { self.count } else { self.count - 1 };
        (0..self.count).map(|k| self.range.0 + (self.range.1 - self.range.0) * k as f64 / parts.max(1) as f64).collect()
    }

    fn is_periodic(&self) -> bool {
        self.coordinate == Coordinate::Theta
    }

    fn value<S: Scalar>(&self, p: &[S], x: &Point<S>) -> S {
        let at = match self.coordinate {
            Coordinate::Theta => x.theta,
            Coordinate::Omega => x.omega,
            Coordinate::Current => x.current,
            Coordinate::Temperature => x.temp_C,
            _ => S::from(0.5 * (x.from_s + x.to_s)),
        };
        let length = self.range.1 - self.range.0;
        let parts = if self.is_periodic() { self.count } else { self.count - 1 } as f64;
        let mut along = (at - self.range.0) * (parts / length);
        if self.is_periodic() {
            along -= (along.re() / parts).floor() * parts;
        } else if along.re() <= 0.0 {
            return p[0];
        } else if along.re() >= parts {
            return p[self.count - 1];
        }
        let first = (along.re().floor() as usize).min(self.count - 1);
        let part = along - first as f64;
        let next = (first + 1) % self.count;
        p[first] + (p[next] - p[first]) * part
    }
}

impl<S: Scalar> Law<S> for Hats {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        match self.place {
            SummingPoint::Torque => a.torque += self.value(p, x),
            SummingPoint::Dry => a.coulomb_torque += self.value(p, x),
            SummingPoint::Voltage => a.voltage += self.value(p, x),
            _ => {}
        }
    }

    fn configure(&self, _p: &[S], structure: &mut Structure<S>) {
        structure.needs_current |= self.coordinate == Coordinate::Current;
    }
}

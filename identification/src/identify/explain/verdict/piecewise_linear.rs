//! A piecewise linear law over one coordinate: it states only that something depends on that coordinate.

use drive_model::{Contributions, Coordinate, Law, Point, Reading, Scalar, Structure};

use crate::model::SummingPoint;

/// A function given by its values at equidistant knots, added to a torque, the Coulomb level, the voltage, or the reading of rate or angle.
#[derive(Debug, Clone)]
pub struct PiecewiseLinear {
    /// Its coordinate: angle, rate, current, temperature or time.
    pub coordinate: Coordinate,
    /// What it is added to.
    pub acts_on: SummingPoint,
    /// Smallest and largest value of the coordinate; for the angle one turn.
    pub range: (f64, f64),
    /// Number of knots.
    pub count: usize,
}

impl PiecewiseLinear {
    /// Coordinates of the knots.
    pub fn knots(&self) -> Vec<f64> {
        let parts = self.intervals();
        (0..self.count).map(|k| self.range.0 + (self.range.1 - self.range.0) * k as f64 / parts.max(1) as f64).collect()
    }

    fn intervals(&self) -> usize {
        if self.is_periodic() { self.count } else { self.count - 1 }
    }

    fn is_periodic(&self) -> bool {
        self.coordinate == Coordinate::Theta
    }

    /// Value at a point, by the values `p` at the knots; constant outside the range.
    fn value<S: Scalar>(&self, p: &[S], x: &Point<S>) -> S {
        let at = match self.coordinate {
            Coordinate::Theta => x.theta,
            Coordinate::Omega => x.omega,
            Coordinate::Current => x.current,
            Coordinate::Temperature => x.temp_C,
            _ => S::from(0.5 * (x.from_s + x.to_s)),
        };
        let length = self.range.1 - self.range.0;
        let intervals = self.intervals() as f64;
        let mut along = (at - self.range.0) * (intervals / length);
        if self.is_periodic() {
            along -= (along.re() / intervals).floor() * intervals;
        } else if along.re() <= 0.0 {
            return p[0];
        } else if along.re() >= intervals {
            return p[self.count - 1];
        }
        let first = (along.re().floor() as usize).min(self.count - 1);
        let fraction = along - first as f64;
        let next = (first + 1) % self.count;
        p[first] + (p[next] - p[first]) * fraction
    }
}

impl<S: Scalar> Law<S> for PiecewiseLinear {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        match self.acts_on {
            SummingPoint::Torque => out.torque += self.value(p, x),
            SummingPoint::Dry => out.coulomb_torque += self.value(p, x),
            SummingPoint::Voltage => out.voltage += self.value(p, x),
            _ => {}
        }
    }

    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        match self.acts_on {
            SummingPoint::Rate => y.omega += self.value(p, x),
            SummingPoint::Angle => y.theta += self.value(p, x),
            _ => {}
        }
    }

    fn has_no_contribution(&self) -> bool {
        matches!(self.acts_on, SummingPoint::Rate | SummingPoint::Angle)
    }

    fn configure(&self, _p: &[S], structure: &mut Structure<S>) {
        structure.needs_current |= self.coordinate == Coordinate::Current;
    }
}

//! Where an uncertainty comes from: scatter, turn, level, gain (theory.md §3.3), and the torquer's inequality where two amplitudes tell it.

use super::answer::{Measured, Separated};

/// One part of an uncertainty, rad/s and rad; `None` where it does not act or nobody knows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Of what.
    pub of: &'static str,
    /// In the own drift.
    pub own_rad_s: Option<f64>,
    /// In the apparent drift.
    pub apparent_rad_s: Option<f64>,
    /// In the azimuth.
    pub azimuth_rad: Option<f64>,
}

/// All parts together. The first is the scatter, and without it nobody knows.
pub fn together(parts: &[Part], of: fn(&Part) -> Option<f64>) -> Option<f64> {
    of(parts.first()?)?;
    Some(parts.iter().filter_map(of).map(|x| x * x).sum::<f64>().sqrt())
}

impl Measured {
    /// What each does to the answer of an axis; `found` has the scatter in its sigmas, `earth` are the horizontal and vertical rates.
    pub(super) fn parts(&self, axis: usize, earth: Option<(f64, f64)>, found: &Separated) -> Vec<Part> {
        let by_error = if self.has_three_axes { self.of_three(axis, earth, found) } else { self.of_one(earth, found) };
        let scatter = Part {
            of: "scatter of the cycles",
            own_rad_s: found.own_rad_s[axis].sigma,
            apparent_rad_s: found.apparent_rad_s[axis].sigma,
            azimuth_rad: found.azimuth_rad.and_then(|a| a.sigma),
        };
        let names = ["turn between the positions", "level", "gain of the angle sensor"];
        let others = names.into_iter().zip(by_error).map(|(of, [own_rad_s, apparent_rad_s, azimuth_rad])| Part {
            of,
            own_rad_s,
            apparent_rad_s,
            azimuth_rad,
        });
        let common = found.unequal.get(axis).map(|unequal| Part {
            of: "unequal pulses, by two amplitudes",
            own_rad_s: unequal.common_rad_s,
            apparent_rad_s: Some(0.0),
            azimuth_rad: found.azimuth_rad.map(|_| 0.0),
        });
        std::iter::once(scatter).chain(others).chain(common).collect()
    }

    fn of_one(&self, earth: Option<(f64, f64)>, found: &Separated) -> [[Option<f64>; 3]; 3] {
        let (horizontal, vertical) = earth.unwrap_or((0.0, 0.0));
        let azimuth = found.azimuth_rad.map(|azimuth| azimuth.value);
        let sin = azimuth.map_or(1.0, |azimuth| azimuth.sin().abs());
        let per_azimuth = |rad_s: f64| azimuth.filter(|_| horizontal > 0.0).map(|_| rad_s / (horizontal * sin.max(1e-6)));
        // Half of the error is the azimuth's, and its sine goes to the drift.
        let turned = Some(horizontal * sin * self.turn_error_rad / 2.0);
        // Turned with the platform it goes to the drift, fixed to the base to the azimuth.
        let level = vertical * self.level_error_rad;
        let [own, apparent] = [found.own_rad_s[0], found.apparent_rad_s[0]].map(|v| v.value.abs() * self.gain_error);
        [
            [turned, turned, azimuth.map(|_| self.turn_error_rad / 2.0)],
            [Some(level), Some(level), per_azimuth(level)],
            [Some(own), Some(apparent), per_azimuth(apparent)],
        ]
    }

    /// Of three the azimuth is an arctangent, and the apparent drift follows from it.
    fn of_three(&self, axis: usize, earth: Option<(f64, f64)>, found: &Separated) -> [[Option<f64>; 3]; 3] {
        let (horizontal, vertical) = earth.unwrap_or((0.0, 0.0));
        let (cos, sin) = (found.apparent_rad_s[0].value.abs() / horizontal, found.apparent_rad_s[2].value.abs() / horizontal);
        let lever = [horizontal * sin, 0.0, horizontal * cos][axis];
        let with = |own: f64, azimuth: f64| [Some(own), (axis != 1).then_some(lever * azimuth), Some(azimuth)];
        let measured = found.own_rad_s[axis].value - if axis == 1 { vertical } else { 0.0 };
        [
            with(lever * self.turn_error_rad / 2.0, self.turn_error_rad / 2.0),
            with([vertical, horizontal, vertical][axis] * self.level_error_rad, vertical / horizontal * self.level_error_rad),
            // Sensors of their own: what both have in common the arctangent does not feel.
            with(measured.abs() * self.gain_error, std::f64::consts::SQRT_2 * sin * cos * self.gain_error),
        ]
    }
}

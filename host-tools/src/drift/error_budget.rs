//! Uncertainty budget of the drift: scatter, turn, level, gain (docs/theory.md §3), and the inequality of the pulses by two amplitudes.

use super::measurement::{Measurement, SeparatedDrift};

/// Source of an uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorSource {
    /// Scatter of the cycles.
    CycleScatter,
    /// Turn between the positions.
    Turn,
    /// Level.
    Level,
    /// Gain of the angle sensor.
    AngleGain,
    /// Inequality of the pulses, by two amplitudes.
    PulseInequality,
}

/// One line of the budget: standard uncertainties; `None` where the source does not act or is not known.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorContribution {
    /// The source.
    pub source: ErrorSource,
    /// Of the own drift, rad/s.
    pub own_rad_s: Option<f64>,
    /// Of the apparent drift, rad/s.
    pub apparent_rad_s: Option<f64>,
    /// Of the azimuth, rad.
    pub azimuth_rad: Option<f64>,
}

/// Combined standard uncertainty; `None` without the scatter, which is the first line.
pub fn combined(budget: &[ErrorContribution], of: fn(&ErrorContribution) -> Option<f64>) -> Option<f64> {
    of(budget.first()?)?;
    Some(budget.iter().filter_map(of).map(|x| x * x).sum::<f64>().sqrt())
}

impl Measurement {
    /// Budget of an axis. The sigmas of `found` are those of the scatter; `earth` are the horizontal and vertical Earth rate, rad/s.
    pub(super) fn error_budget(&self, axis: usize, earth: Option<(f64, f64)>, found: &SeparatedDrift) -> Vec<ErrorContribution> {
        let systematic =
            if self.has_three_axes { self.three_axis_errors(axis, earth, found) } else { self.single_axis_errors(earth, found) };
        let scatter = ErrorContribution {
            source: ErrorSource::CycleScatter,
            own_rad_s: found.own_rad_s[axis].sigma,
            apparent_rad_s: found.apparent_rad_s[axis].sigma,
            azimuth_rad: found.azimuth_rad.and_then(|a| a.sigma),
        };
        let sources = [ErrorSource::Turn, ErrorSource::Level, ErrorSource::AngleGain];
        let others = sources.into_iter().zip(systematic).map(|(source, [own_rad_s, apparent_rad_s, azimuth_rad])| ErrorContribution {
            source,
            own_rad_s,
            apparent_rad_s,
            azimuth_rad,
        });
        let common = found.inequality.get(axis).map(|inequality| ErrorContribution {
            source: ErrorSource::PulseInequality,
            own_rad_s: inequality.common_rad_s,
            apparent_rad_s: Some(0.0),
            azimuth_rad: found.azimuth_rad.map(|_| 0.0),
        });
        std::iter::once(scatter).chain(others).chain(common).collect()
    }

    /// Turn, level and gain: uncertainties of own drift, apparent drift, azimuth.
    fn single_axis_errors(&self, earth: Option<(f64, f64)>, found: &SeparatedDrift) -> [[Option<f64>; 3]; 3] {
        let (horizontal, vertical) = earth.unwrap_or((0.0, 0.0));
        let azimuth = found.azimuth_rad.map(|azimuth| azimuth.value);
        let sin = azimuth.map_or(1.0, |azimuth| azimuth.sin().abs());
        let per_azimuth = |rad_s: f64| azimuth.filter(|_| horizontal > 0.0).map(|_| rad_s / (horizontal * sin.max(1e-6)));
        // Half of the error of the turn is an error of the azimuth; its sine acts on the drift.
        let turned = Some(horizontal * sin * self.uncertainties.turn_error_rad / 2.0);
        // A level error that turns with the platform acts on the drift, one of the base on the azimuth.
        let level = vertical * self.uncertainties.level_error_rad;
        let [own, apparent] = [found.own_rad_s[0], found.apparent_rad_s[0]].map(|v| v.value.abs() * self.uncertainties.gain_error);
        [
            [turned, turned, azimuth.map(|_| self.uncertainties.turn_error_rad / 2.0)],
            [Some(level), Some(level), per_azimuth(level)],
            [Some(own), Some(apparent), per_azimuth(apparent)],
        ]
    }

    /// Turn, level and gain of three axes: the azimuth is an arctangent, and the apparent drift follows from it.
    fn three_axis_errors(&self, axis: usize, earth: Option<(f64, f64)>, found: &SeparatedDrift) -> [[Option<f64>; 3]; 3] {
        let (horizontal, vertical) = earth.unwrap_or((0.0, 0.0));
        let (cos, sin) = (found.apparent_rad_s[0].value.abs() / horizontal, found.apparent_rad_s[2].value.abs() / horizontal);
        let lever = [horizontal * sin, 0.0, horizontal * cos][axis];
        let with = |own: f64, azimuth: f64| [Some(own), (axis != 1).then_some(lever * azimuth), Some(azimuth)];
        let measured = found.own_rad_s[axis].value - if axis == 1 { vertical } else { 0.0 };
        [
            with(lever * self.uncertainties.turn_error_rad / 2.0, self.uncertainties.turn_error_rad / 2.0),
            with(
                [vertical, horizontal, vertical][axis] * self.uncertainties.level_error_rad,
                vertical / horizontal * self.uncertainties.level_error_rad,
            ),
            // Each axis has its own sensor; a common gain error cancels in the arctangent.
            with(measured.abs() * self.uncertainties.gain_error, std::f64::consts::SQRT_2 * sin * cos * self.uncertainties.gain_error),
        ]
    }
}

//! Uncertainty budgets of a drift measurement: scatter and movement of the cycles, turn, level, gains, latitude, asymmetry of the torquer
//! (docs/theory.md §3).
//!
//! Input: the fit of an axis and the uncertainties of the setup. Output: an [`AxisBudget`]: own drift, apparent drift and azimuth as
//! quantities with their contributions, rad/s and rad.

use super::latitude::EarthRate;
use super::measurement::{Measurement, SeparatedDrift};
use super::session_fit::SessionFit;
use identification::statistics::uncertainty::{Contribution, Quantity, Uncertainty};

/// Smallest sine of an azimuth by its cosine in the linear propagation of uncertainty.
pub(super) const MIN_AZIMUTH_SINE: f64 = 1e-6;

/// Source of an uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorSource {
    /// Scatter of the cycles and between the visits, with the movement of the drift and the extrapolation to amplitude zero.
    CycleScatter,
    /// Turn between the positions.
    Turn,
    /// Level.
    Level,
    /// Gain of the angle sensor.
    AngleGain,
    /// Gain of the torquer, in the correction by the current.
    TorquerGain,
    /// Latitude.
    Latitude,
    /// Asymmetry of the torquer, within its stated bound.
    TorquerAsymmetry,
}

impl ErrorSource {
    /// All sources, in the order of a budget.
    pub const ALL: [Self; 7] =
        [Self::CycleScatter, Self::Turn, Self::Level, Self::AngleGain, Self::TorquerGain, Self::Latitude, Self::TorquerAsymmetry];
}

/// A quantity of the drift with its budget.
pub type DriftQuantity = Quantity<ErrorSource, ()>;

/// Budgets of one axis; `None` without an uncertainty of the scatter.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisBudget {
    /// Own drift, rad/s.
    pub own: Option<DriftQuantity>,
    /// Apparent drift, rad/s.
    pub apparent: Option<DriftQuantity>,
    /// Azimuth, rad.
    pub azimuth: Option<DriftQuantity>,
}

/// Sensitivities of the results of an axis to the fitted parameters.
pub struct Levers {
    /// Combination of the parameters that is the own drift.
    pub own: Vec<f64>,
    /// Combinations that are the apparent drift, each of one fit.
    pub apparent: Vec<(usize, Vec<f64>)>,
    /// Combinations that are the azimuth.
    pub azimuth: Vec<(usize, Vec<f64>)>,
    /// Standard uncertainties by turn, level, gain of the angle sensor, latitude: of own drift, apparent drift, azimuth.
    pub setup: [(ErrorSource, [f64; 3]); 4],
}

impl Measurement {
    /// Budget of an axis; `fits` are those of all axes.
    pub(super) fn budget(&self, axis: usize, fits: &[SessionFit], found: &SeparatedDrift, levers: &Levers) -> AxisBudget {
        let mut own = scatter(fits, &[(axis, levers.own.clone())]);
        let mut apparent = scatter(fits, &levers.apparent);
        let mut azimuth = scatter(fits, &levers.azimuth);
        for (source, [of_own, of_apparent, of_azimuth]) in levers.setup {
            add(&mut own, Contribution::type_b("", of_own, "", 1.0, source));
            add(&mut apparent, Contribution::type_b("", of_apparent, "", 1.0, source));
            add(&mut azimuth, Contribution::type_b("", of_azimuth, "", 1.0, source));
        }
        let cycles: Vec<_> = self.valid_cycles().into_iter().filter(|cycle| cycle.axis == axis).collect();
        let mean = |of: &dyn Fn(&super::Cycle) -> f64| cycles.iter().map(|cycle| of(cycle)).sum::<f64>() / cycles.len().max(1) as f64;
        let residual = mean(&|cycle| cycle.residual_rad_s.unwrap_or(0.0));
        let gain = self.uncertainties.torquer_gain_error;
        add(&mut own, Contribution::type_b("", residual.abs() * gain, "", 1.0, ErrorSource::TorquerGain));
        if found.inequality.get(axis).is_none() {
            let bound = self.uncertainties.torquer_asymmetry * mean(&|cycle| cycle.amplitude_rad_s) / 2.0;
            add(&mut own, Contribution::rectangular("", bound, "", 1.0, ErrorSource::TorquerAsymmetry));
        }
        let quantity = |name: &str, unit: &str, value: Option<f64>, contributions: Option<Vec<Contribution<ErrorSource>>>| {
            Some(Quantity::new(name, unit, value?, contributions?))
        };
        AxisBudget {
            own: quantity("own_drift", "rad/s", found.own_rad_s.get(axis).map(|e| e.value), own),
            apparent: quantity("apparent_drift", "rad/s", found.apparent_rad_s.get(axis).map(|e| e.value), apparent),
            azimuth: quantity("azimuth", "rad", found.azimuth_rad.map(|e| e.value), azimuth),
        }
    }
}

/// Adds a line that contributes.
fn add(budget: &mut Option<Vec<Contribution<ErrorSource>>>, line: Contribution<ErrorSource>) {
    if line.u > 0.0
        && let Some(lines) = budget
    {
        lines.push(line);
    }
}

/// Scatter of the cycles in combinations of several fits; `None` where one has no uncertainty.
fn scatter(fits: &[SessionFit], combinations: &[(usize, Vec<f64>)]) -> Option<Vec<Contribution<ErrorSource>>> {
    let mut lines = Vec::new();
    for (axis, combination) in combinations {
        let fit = fits.get(*axis)?;
        let Uncertainty { u, dof, .. } = fit.estimate(combination).uncertainty?;
        lines.push(Contribution::type_a("", u, dof, ErrorSource::CycleScatter));
    }
    (!lines.is_empty()).then_some(lines)
}

impl Measurement {
    /// Turn, level, gain and latitude of a single axis.
    pub(super) fn single_axis_setup(
        &self,
        earth: Option<&EarthRate>,
        found: &SeparatedDrift,
        has_sine: bool,
    ) -> [(ErrorSource, [f64; 3]); 4] {
        let (horizontal, vertical) = earth.map_or((0.0, 0.0), |earth| (earth.horizontal_rad_s, earth.vertical_rad_s));
        let azimuth = found.azimuth_rad.map(|azimuth| azimuth.value);
        let (sin, cos) = azimuth.map_or((1.0, 0.0), |azimuth| (azimuth.sin().abs(), azimuth.cos().abs()));
        let setup = &self.uncertainties;
        // Without a sine the azimuth follows from the cosine.
        let per_azimuth =
            |rad_s: f64| if horizontal > 0.0 && azimuth.is_some() { rad_s / (horizontal * sin.max(MIN_AZIMUTH_SINE)) } else { 0.0 };
        // Half of the error of the turn is an error of the azimuth; its sine acts on the drift.
        let turned = horizontal * sin * setup.turn_error_rad / 2.0;
        // A level error that turns with the platform acts on the drift, one of the base on the azimuth.
        let level = vertical.abs() * setup.level_error_rad;
        let [own, apparent] = [found.own_rad_s[0], found.apparent_rad_s[0]].map(|v| v.value.abs() * setup.gain_error);
        let raised = self.positions().iter().map(|position| position.raised_rad.sin().abs()).fold(0.0, f64::max);
        let (u_horizontal, u_vertical) = earth.map_or((0.0, 0.0), |earth| (earth.u_horizontal_rad_s, earth.u_vertical_rad_s));
        let latitude = if has_sine { 0.0 } else { per_azimuth(cos * u_horizontal) };
        [
            (ErrorSource::Turn, [turned, turned, setup.turn_error_rad / 2.0]),
            (ErrorSource::Level, [level, level, per_azimuth(level)]),
            (ErrorSource::AngleGain, [own, apparent, if has_sine { 0.0 } else { per_azimuth(apparent) }]),
            (ErrorSource::Latitude, [u_vertical * raised, 0.0, latitude]),
        ]
    }

    /// Turn, level, gain and latitude of an axis of three: the azimuth is an arctangent, and the apparent drift follows from it and the
    /// latitude.
    pub(super) fn three_axis_setup(&self, axis: usize, earth: &EarthRate, found: &SeparatedDrift) -> [(ErrorSource, [f64; 3]); 4] {
        let (horizontal, vertical) = (earth.horizontal_rad_s, earth.vertical_rad_s);
        let relative = |axis: usize| (found.apparent_rad_s[axis].value / horizontal).abs();
        let (cos, sin) = (relative(0), relative(2));
        let lever = [horizontal * sin, 0.0, horizontal * cos][axis];
        let with = |own: f64, azimuth: f64| [own, lever * azimuth, azimuth];
        let setup = &self.uncertainties;
        let measured = found.own_rad_s[axis].value - if axis == 1 { vertical } else { 0.0 };
        let level = [vertical, horizontal, vertical][axis].abs() * setup.level_error_rad;
        let apparent = [earth.u_horizontal_rad_s * cos, earth.u_vertical_rad_s, earth.u_horizontal_rad_s * sin][axis];
        [
            (ErrorSource::Turn, with(lever * setup.turn_error_rad / 2.0, setup.turn_error_rad / 2.0)),
            (ErrorSource::Level, with(level, (vertical / horizontal).abs() * setup.level_error_rad)),
            // Each axis has its own sensor; a common gain error cancels in the arctangent.
            (ErrorSource::AngleGain, with(measured.abs() * setup.gain_error, std::f64::consts::SQRT_2 * sin * cos * setup.gain_error)),
            (ErrorSource::Latitude, [if axis == 1 { earth.u_vertical_rad_s } else { 0.0 }, apparent, 0.0]),
        ]
    }
}

//! Quantities of the static characteristic, and its curve.

use super::GyroSettings;
use super::characteristic::{Characteristic, MIN_RANGE_K, characteristic};
use super::encoder::EncoderAmplitudes;
use super::influences::{STANDARD_GRAVITY_M_S2, clock, g_sensitivity, misalignment, misalignment_factor, thermometer};
use super::points::{Point, points, rest_points};
use crate::calibrate::response_function::ResponseFunction;
use crate::calibrate::{
    AbsenceReason, Assumptions, Basis, CalibrateError, Contribution, Curve, CurveKind, Findings, Meaning, Quantity, Remark, Step,
};
use identification::statistics::Extremes;
use identification::statistics::uncertainty::{Conditions, u_of_standard_deviation};
use stand_acquire::calibration_session::EARTH_RAD_S;

/// Fraction of the greatest rate below which a log serves thresholds and not the characteristic.
const SMALL_RATE_FRACTION: f64 = 0.05;
/// Fewest degrees of freedom of the characteristic.
const MIN_DOF: f64 = 2.0;
/// Points of the curve on each side of rest.
const CURVE_POINTS: i32 = 50;

fn scaled(contributions: Vec<Contribution>, factor: f64) -> Vec<Contribution> {
    contributions.into_iter().map(|c| c.scaled(factor)).collect()
}

impl Characteristic {
    fn quantity(&self, name: &str, unit: &str, value: f64, contributions: Vec<Contribution>, meaning: Meaning) -> Quantity {
        let conditions = Conditions { temperature: self.temperature, instability: None };
        Quantity::new(name, unit, value, contributions).meaning(meaning).conditions(conditions)
    }

    /// Factor from an output to per cent of full scale.
    fn percent(&self) -> f64 {
        100.0 / (self.coefficient(1).abs() * self.full_scale_rad_s)
    }

    /// Scale: slope of the least-squares line over ± full scale.
    fn scale(&self, assumed: &Assumptions) -> Quantity {
        let fs = self.full_scale_rad_s;
        // ∫ x·x³ / ∫ x·x over ± 1 is 3/5.
        let (sum, contributions) = self.combination(&[0.0, 1.0, 0.0, 0.6]);
        let factor = misalignment_factor(assumed);
        let scale = sum / fs * factor;
        let mut contributions = scaled(contributions, factor / fs);
        contributions.extend([clock(assumed, scale), misalignment(assumed, -scale)]);
        if let Some((per_K, _)) = self.slope_per_kelvin() {
            contributions.push(thermometer(assumed, per_K / fs));
        }
        self.quantity("scale", "1", scale, contributions, Meaning::LineSlope)
    }

    /// Bias: output at rest, without the Earth's rotation where the latitude is assumed.
    fn bias(&self, assumed: &Assumptions) -> Quantity {
        let (mut bias, mut contributions) = self.combination(&[1.0]);
        let scale = self.coefficient(1);
        let level_rad = assumed.level_deg.to_radians();
        let meaning = match assumed.latitude_deg {
            Some(latitude_deg) => {
                let latitude = latitude_deg.to_radians();
                bias -= scale * EARTH_RAD_S * latitude.sin();
                contributions.push(Contribution::rectangular(
                    "tilt",
                    level_rad,
                    "rad",
                    -scale * EARTH_RAD_S * latitude.cos(),
                    Basis::LevelForEarthRate { half_width_deg: assumed.level_deg },
                ));
                Meaning::BiasWithoutEarthRate
            }
            None => {
                contributions.push(Contribution::rectangular("Earth rate", EARTH_RAD_S, "rad/s", scale, Basis::LatitudeUnknown));
                Meaning::BiasWithEarthRate
            }
        };
        // A tilted axis has a component of gravity across it.
        contributions.push(g_sensitivity(assumed, level_rad.sin() / 3_f64.sqrt()));
        if let Some((per_K, _)) = self.per_kelvin() {
            contributions.push(thermometer(assumed, per_K));
        }
        self.quantity("bias_rad_s", "rad/s", bias, contributions, meaning)
    }

    /// The centripetal acceleration Ω²r across the axis is proportional to Ω²: change of c₂, in units of full scale, per rad/s/g.
    fn quadratic_per_g(&self, radius_m: f64) -> f64 {
        -self.full_scale_rad_s.powi(2) * radius_m / STANDARD_GRAVITY_M_S2
    }

    /// Nonlinearity: greatest departure of the curve from its least-squares line, % of full scale; ⅔|c₂| + ⅖|c₃| at one end, in units of
    /// full scale.
    fn nonlinearity(&self, radius_m: f64, assumed: &Assumptions) -> Option<Quantity> {
        if self.powers() < 3 {
            return None;
        }
        let sign = |k: usize| if k < self.powers() { self.coefficient(k).signum() } else { 0.0 };
        let gradient = [0.0, 0.0, 2.0 / 3.0 * sign(2), 0.4 * sign(3)];
        let (value, contributions) = self.combination(&gradient);
        let mut contributions = scaled(contributions, self.percent());
        contributions.push(g_sensitivity(assumed, gradient[2] * self.quadratic_per_g(radius_m) * self.percent()));
        Some(self.quantity("nonlinearity_percent_fs", "%", value * self.percent(), contributions, Meaning::Nonlinearity))
    }

    /// Coefficient of Ω² over the scale, s; nonlinearity and g-sensitivity at a radius both contribute.
    pub(super) fn quadratic(&self) -> Option<Quantity> {
        if self.powers() < 3 {
            return None;
        }
        let per = 1.0 / (self.coefficient(1) * self.full_scale_rad_s.powi(2));
        let (value, contributions) = self.combination(&[0.0, 0.0, 1.0]);
        Some(self.quantity("quadratic_s", "s", value * per, scaled(contributions, per), Meaning::Quadratic))
    }

    /// Hysteresis: output approached from below minus from above, % of full scale.
    fn hysteresis(&self) -> Option<Quantity> {
        let (value, contributions) = self.direction()?;
        let contributions = scaled(contributions, self.percent());
        Some(self.quantity("hysteresis_percent_fs", "%", value * self.percent(), contributions, Meaning::Hysteresis))
    }

    /// Asymmetry: slope at positive minus slope at negative rates, % of their mean, of two lines that meet at rest. The least-squares line
    /// of x² over 0 … 1 has the slope 1, so the difference is 2c₂ in units of full scale; odd terms contribute equally to both slopes.
    fn asymmetry(&self, radius_m: f64, assumed: &Assumptions) -> Option<Quantity> {
        if self.powers() < 3 {
            return None;
        }
        let (slope, _) = self.combination(&[0.0, 1.0, 0.0, 0.6]);
        let per = 100.0 / slope;
        let (value, contributions) = self.combination(&[0.0, 0.0, 2.0]);
        let mut contributions = scaled(contributions, per);
        contributions.push(g_sensitivity(assumed, 2.0 * self.quadratic_per_g(radius_m) * per));
        Some(self.quantity("asymmetry_percent", "%", value * per, contributions, Meaning::Asymmetry))
    }

    /// Repeatability: standard deviation of a repeated plateau, % of full scale.
    fn repeatability(&self) -> Option<Quantity> {
        let mut groups: Vec<((u64, i8), Vec<f64>)> = Vec::new();
        for (p, residual) in self.points.iter().zip(&self.fit.residuals) {
            let key = (p.plateau.setpoint.to_bits(), p.plateau.direction() as i8);
            match groups.iter_mut().find(|(k, _)| *k == key) {
                Some((_, values)) => values.push(*residual),
                None => groups.push((key, vec![*residual])),
            }
        }
        let (mut sum, mut dof) = (0.0, 0.0);
        for (_, values) in groups.iter().filter(|(_, values)| values.len() > 1) {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            sum += values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
            dof += values.len() as f64 - 1.0;
        }
        if dof < 2.0 {
            return None;
        }
        let value = (sum / dof).sqrt() * self.percent();
        let repeats = Contribution::type_a("number of repeats", u_of_standard_deviation(value, dof), dof, Basis::OfStandardDeviation);
        Some(self.quantity("repeatability_percent_fs", "%", value, vec![repeats], Meaning::Repeatability))
    }

    /// Change of the bias and, relative, of the scale per kelvin, by the surface over rate and temperature.
    fn temperature_coefficients(&self, assumed: &Assumptions) -> [Option<Quantity>; 2] {
        let Some(range_K) = self.temperature.map(|t| t.high_C - t.low_C) else { return [None, None] };
        // A slope error of the thermometer is its error divided by the range.
        let over_range = |value: f64| {
            let half_width_K = assumed.temperature_K;
            Contribution::rectangular("thermometer slope", half_width_K, "K", value / range_K, Basis::ThermometerHalfWidth { half_width_K })
        };
        let of = |(value, contributions): (f64, Vec<Contribution>), per: f64, name: &str, unit: &str, meaning: Meaning| {
            let mut contributions = scaled(contributions, per);
            contributions.push(over_range(value * per));
            self.quantity(name, unit, value * per, contributions, meaning)
        };
        let per_scale = 1.0 / self.combination(&[0.0, 1.0, 0.0, 0.6]).0;
        [
            self.per_kelvin().map(|c| of(c, 1.0, "bias_per_K_rad_s", "rad/s/K", Meaning::BiasTemperature)),
            self.slope_per_kelvin().map(|c| of(c, per_scale, "scale_per_K", "1/K", Meaning::ScaleTemperature)),
        ]
    }

    /// Departure from the least-squares line, % of full scale.
    fn curve(&self) -> Curve {
        let fs = self.full_scale_rad_s;
        let slope = self.coefficient(1) + 0.6 * self.coefficient(3) * fs.powi(2);
        let level = self.coefficient(0) + self.coefficient(2) * fs.powi(2) / 3.0;
        let departure = |rate: f64, output: f64| (output - level - slope * rate) * self.percent();
        let points = self.points.iter().map(|p| (p.plateau.rate_rad_s, departure(p.plateau.rate_rad_s, p.output))).collect();
        let rates = (-CURVE_POINTS..=CURVE_POINTS).map(|k| f64::from(k) / f64::from(CURVE_POINTS) * fs);
        let line = rates.map(|rate| (rate, departure(rate, self.at(rate)))).collect();
        Curve::new(CurveKind::LineDeparture, points, line)
    }

    /// The output as a function of the rate with its uncertainty.
    fn response_function(&self, bias: &Quantity, radius_m: f64, assumed: &Assumptions) -> ResponseFunction {
        let fs = self.full_scale_rad_s;
        let basis = Basis::PlateausAboutCurve { count: self.points.len() };
        let noise = |power: usize| {
            let mut gradient = vec![0.0; self.powers()];
            gradient[power] = fs.powi(-(power as i32));
            let (_, contributions) = self.combination(&gradient);
            contributions.into_iter().next().and_then(|c| c.loadings).map_or_else(Vec::new, |l| l.components)
        };
        let mut coefficients: Vec<f64> = (0..self.powers()).map(|k| self.coefficient(k)).collect();
        coefficients[0] = bias.value;
        let derivative_times_rate: Vec<f64> = coefficients.iter().enumerate().map(|(k, c)| k as f64 * c).collect();
        let mut function = ResponseFunction::new(fs, coefficients, self.temperature);
        function.add_fit("noise and repeatability", self.fit.dof, &basis, (0..self.powers()).map(noise).collect());
        // A relative error of the reference rate acts as the slope times the rate.
        function.add(&clock(assumed, 1.0), &derivative_times_rate);
        function.add(&misalignment(assumed, 1.0), &derivative_times_rate);
        function.add(&g_sensitivity(assumed, 1.0), &[0.0, 0.0, -radius_m / STANDARD_GRAVITY_M_S2]);
        for c in bias.contributions.iter().filter(|c| ["tilt", "Earth rate"].contains(&c.source.as_str())) {
            function.add(c, &[c.sensitivity]);
        }
        if let Some((per_K, _)) = self.per_kelvin() {
            let slope_per_K = self.slope_per_kelvin().map_or(0.0, |(value, _)| value / fs);
            function.add(&thermometer(assumed, 1.0), &[per_K, slope_per_K]);
        }
        function
    }
}

/// Adds the quantities of the static characteristic; returns the characteristic.
///
/// # Errors
/// No log has plateaus of both signs, or enough of them.
pub(super) fn add(
    steps: &[&Step],
    radius_m: f64,
    encoder: Option<EncoderAmplitudes>,
    settings: &GyroSettings,
    findings: &mut Findings,
) -> Result<Characteristic, CalibrateError> {
    let all = points(steps, settings);
    let greatest = all.iter().map(|p| p.plateau.rate_rad_s.abs()).max_or_zero();
    let full_scale = settings.full_scale_rad_s.unwrap_or(greatest);
    let is_large = |log: usize| all.iter().any(|p| p.log == log && p.plateau.rate_rad_s.abs() > SMALL_RATE_FRACTION * greatest);
    let has_two = |log: usize| {
        let of_log = || all.iter().filter(move |p| p.log == log).map(|p| p.plateau.setpoint);
        of_log().any(|l| l > 0.0) && of_log().any(|l| l < 0.0)
    };
    let mut used: Vec<Point> = all.iter().filter(|p| is_large(p.log) && has_two(p.log)).cloned().collect();
    // While the device warms, its output at rest shows the temperature coefficient of the bias best.
    let at_rest = rest_points(steps, settings);
    if !used.is_empty() && covers_a_range(used.iter().chain(&at_rest).map(|p| p.temperature_C)) {
        used.extend(at_rest);
    }
    let clipped = || findings.remarks.iter().find(|r| matches!(r, Remark::Clipped { .. })).cloned();
    let Some(found) = characteristic(used, full_scale).map(|found| found.with_encoder_error(encoder)) else {
        return Err(clipped().map_or(CalibrateError::NoPlateaus, CalibrateError::of_clipped));
    };
    if found.fit.dof < MIN_DOF {
        return Err(CalibrateError::TooFewPlateaus { count: found.points.len() });
    }
    let assumed = &settings.assumptions;
    let bias = found.bias(assumed);
    findings.response_function = Some(found.response_function(&bias, radius_m, assumed));
    findings.quantities.extend([found.scale(assumed), bias]);
    findings.quantities.extend(found.temperature_coefficients(assumed).into_iter().flatten());
    for (name, quantity, reason) in [
        ("nonlinearity_percent_fs", found.nonlinearity(radius_m, assumed), AbsenceReason::NeedsThreeRates),
        ("asymmetry_percent", found.asymmetry(radius_m, assumed), AbsenceReason::NeedsThreeRates),
        ("hysteresis_percent_fs", found.hysteresis(), AbsenceReason::NeedsBothApproaches),
        ("quadratic_s", found.quadratic(), AbsenceReason::NeedsThreeRates),
        ("repeatability_percent_fs", found.repeatability(), AbsenceReason::NeedsRepeatedPlateaus),
    ] {
        match quantity {
            Some(quantity) => findings.quantities.push(quantity),
            None => findings.add_absent(name, reason),
        }
    }
    if !found.drift_sensitivity.is_empty() {
        findings.remarks.push(Remark::DriftNotSeparable);
    }
    findings.curves.push(found.curve());
    Ok(found)
}

/// Whether temperatures cover the range of a surface.
fn covers_a_range(temperatures_C: impl Iterator<Item = f64>) -> bool {
    let (low, high) = temperatures_C.filter(|t| t.is_finite()).min_max();
    high - low >= MIN_RANGE_K
}

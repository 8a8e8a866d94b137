//! Static characteristic: a cubic through plateaus of many rates, approached from both sides, of both signs.

use super::{GyroSettings, dut_output};
use crate::acquire::calibration_session::EARTH_RAD_S;
use crate::calibrate::plateaus::{Plateau, plateaus};
use crate::calibrate::{
    AbsenceReason, Assumptions, Basis, CalibrateError, Contribution, Curve, CurveKind, Findings, Meaning, Quantity, Remark, Step,
};
use crate::statistics::Extremes;
use crate::statistics::uncertainty::Evaluation;
use crate::statistics::{LeastSquares, least_squares};

/// Fraction of the greatest rate below which a log serves thresholds and not the characteristic.
const SMALL_RATE_FRACTION: f64 = 0.05;
/// Fraction of the time explained by the other regressors from which drift is not fitted.
const MAX_TIME_EXPLAINED: f64 = 0.9;
/// Fewest degrees of freedom of the characteristic.
const MIN_DOF: f64 = 2.0;

/// Mean output over one plateau.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The plateau.
    pub plateau: Plateau,
    /// Mean output.
    pub output: f64,
    /// Slope of the output within the plateau, per second.
    pub slope: f64,
    /// Index of the log.
    pub log: usize,
    /// Time from the middle of the log, s.
    pub from_middle_s: f64,
}

/// The curve b + sΩ + c₂Ω² + c₃Ω³ through plateaus.
#[derive(Debug, Clone)]
pub struct Characteristic {
    /// Its points.
    pub points: Vec<Point>,
    fit: LeastSquares,
    /// Change of each coefficient by a drift of 1 per second that is not fitted; empty where drift is fitted.
    drift_sensitivity: Vec<f64>,
    /// Drift within plateaus, per second, and its standard uncertainty.
    drift: (f64, f64),
    powers: usize,
    has_direction: bool,
    /// Full scale, rad/s.
    pub full_scale_rad_s: f64,
}

/// Fits the curve; `None` for too few plateaus.
pub fn characteristic(points: Vec<Point>, full_scale_rad_s: f64) -> Option<Characteristic> {
    let mut levels: Vec<f64> = points.iter().map(|p| p.plateau.setpoint).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let powers = match levels.len() {
        0 | 1 => return None,
        2 => 2,
        3 | 4 => 3,
        _ => 4,
    };
    // Hysteresis is visible only where a level is approached from both sides.
    let both_ways = levels.iter().filter(|level| {
        let approached = |sign: f64| points.iter().any(|p| p.plateau.setpoint == **level && p.plateau.direction() == sign);
        approached(1.0) && approached(-1.0)
    });
    let has_direction = both_ways.count() >= 2;
    let unit = full_scale_rad_s;
    let row = |p: &Point| {
        let x = p.plateau.rate_rad_s / unit;
        let mut row: Vec<f64> = (0..powers).map(|k| x.powi(k as i32)).collect();
        if has_direction {
            row.push(0.5 * p.plateau.direction());
        }
        row
    };
    let rows: Vec<Vec<f64>> = points.iter().map(row).collect();
    let output: Vec<f64> = points.iter().map(|p| p.output).collect();
    let time: Vec<f64> = points.iter().map(|p| p.from_middle_s).collect();
    let of_time = least_squares(&rows, &time);
    let spread: f64 = time.iter().map(|t| t * t).sum();
    let is_separable =
        of_time.as_ref().is_some_and(|f| f.residuals.iter().map(|r| r * r).sum::<f64>() > (1.0 - MAX_TIME_EXPLAINED) * spread);
    let with_time = || -> Option<LeastSquares> {
        let rows: Vec<Vec<f64>> = rows.iter().zip(&time).map(|(row, t)| row.iter().copied().chain([*t]).collect()).collect();
        least_squares(&rows, &output).filter(|fit| fit.dof >= 1.0)
    };
    let (fit, drift_sensitivity) = match is_separable.then(with_time).flatten() {
        Some(fit) => (fit, Vec::new()),
        None => (least_squares(&rows, &output)?, of_time.map(|f| f.coefficients).unwrap_or_else(|| vec![0.0; rows[0].len()])),
    };
    let drift = drift_within(&points);
    Some(Characteristic { points, fit, drift_sensitivity, drift, powers, has_direction, full_scale_rad_s })
}

/// Weighted mean of the slopes within the plateaus and its standard uncertainty by their scatter.
fn drift_within(points: &[Point]) -> (f64, f64) {
    // The variance of a slope is inverse to the cube of the duration.
    let weights: Vec<f64> = points.iter().map(|p| p.plateau.duration_s.powi(3)).collect();
    let total: f64 = weights.iter().sum();
    let mean = points.iter().zip(&weights).map(|(p, w)| w * p.slope).sum::<f64>() / total;
    let scatter: f64 = points.iter().zip(&weights).map(|(p, w)| w * (p.slope - mean).powi(2)).sum::<f64>() / total;
    (mean, (scatter / (points.len() as f64 - 1.0).max(1.0)).sqrt())
}

impl Characteristic {
    fn coefficient(&self, k: usize) -> f64 {
        if k < self.powers { self.fit.coefficients[k] / self.full_scale_rad_s.powi(k as i32) } else { 0.0 }
    }

    /// The curve at a rate.
    pub fn at(&self, rate_rad_s: f64) -> f64 {
        (0..self.powers).map(|k| self.coefficient(k) * rate_rad_s.powi(k as i32)).sum()
    }

    /// Σ gradient·coefficient in units of full scale, with its type A contributions: scatter, and drift where it is not fitted.
    fn combination(&self, gradient: &[f64]) -> (f64, Vec<Contribution>) {
        let value = gradient.iter().zip(&self.fit.coefficients).map(|(g, c)| g * c).sum();
        let basis = Basis::PlateausAboutCurve { count: self.points.len() };
        let mut contributions = vec![Contribution::type_a("noise and repeatability", self.fit.sigma_of(gradient), self.fit.dof, basis)];
        if !self.drift_sensitivity.is_empty() {
            let sensitivity: f64 = gradient.iter().zip(&self.drift_sensitivity).map(|(g, c)| g * c).sum();
            let (drift, u) = self.drift;
            contributions.push(Contribution {
                evaluation: Evaluation::A,
                dof: self.points.len() as f64 - 1.0,
                ..Contribution::type_b("drift", drift.hypot(u), "1/s", sensitivity, Basis::DriftWithinPlateaus)
            });
        }
        (value, contributions)
    }

    /// Scale: slope of the least-squares line over ± full scale.
    pub fn scale(&self, assumed: &Assumptions) -> Quantity {
        let fs = self.full_scale_rad_s;
        // ∫ x·x³ / ∫ x·x over ± 1 is 3/5.
        let (sum, contributions) = self.combination(&[0.0, 1.0, 0.0, if self.powers > 3 { 0.6 } else { 0.0 }]);
        let scale = sum / fs;
        let mut contributions: Vec<Contribution> =
            contributions.into_iter().map(|c| Contribution { sensitivity: c.sensitivity / fs, ..c }).collect();
        contributions[0].unit = "rad/s".into();
        let basis = Basis::Crystal { half_width_ppm: assumed.crystal_ppm };
        contributions.push(Contribution::rectangular("clock", assumed.crystal_ppm * 1e-6, "1", scale, basis));
        // The cosine of an angle uniform within ± m has the mean 1 − m²/6 and the standard deviation m²/2 √(4/45) (GUM F.2.4.4).
        let m_2 = assumed.misalignment_deg.to_radians().powi(2);
        let scale = scale * (1.0 + m_2 / 6.0);
        let basis = Basis::Misalignment { half_width_deg: assumed.misalignment_deg };
        contributions.push(Contribution::type_b("misalignment", 0.5 * m_2 * (4.0_f64 / 45.0).sqrt(), "1", scale, basis));
        Quantity::new("scale", "1", scale, contributions).meaning(Meaning::LineSlope)
    }

    /// Bias: output at rest, without the Earth's rotation where the latitude is assumed.
    pub fn bias(&self, assumed: &Assumptions) -> Quantity {
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
                    EARTH_RAD_S * latitude.cos(),
                    Basis::LevelForEarthRate { half_width_deg: assumed.level_deg },
                ));
                Meaning::BiasWithoutEarthRate
            }
            None => {
                contributions.push(Contribution::rectangular("Earth rate", EARTH_RAD_S, "rad/s", scale, Basis::LatitudeUnknown));
                Meaning::BiasWithEarthRate
            }
        };
        Quantity::new("bias_rad_s", "rad/s", bias, contributions).meaning(meaning)
    }

    /// Nonlinearity: greatest departure of the curve from its least-squares line, % of full scale; ⅔|c₂| + ⅖|c₃| at one end, in units of full scale.
    pub fn nonlinearity(&self) -> Option<Quantity> {
        if self.powers < 3 {
            return None;
        }
        let sign = |k: usize| self.fit.coefficients.get(k).filter(|_| k < self.powers).map_or(0.0, |c| c.signum());
        let percent = 100.0 / (self.coefficient(1).abs() * self.full_scale_rad_s);
        let (value, contributions) = self.combination(&[0.0, 0.0, 2.0 / 3.0 * sign(2), 0.4 * sign(3)]);
        let contributions = contributions.into_iter().map(|c| Contribution { sensitivity: c.sensitivity * percent, ..c }).collect();
        Some(Quantity::new("nonlinearity_percent_fs", "%", value * percent, contributions).meaning(Meaning::Nonlinearity))
    }

    /// Coefficient of Ω² over the scale, s; nonlinearity and g-sensitivity at a radius both contribute.
    pub fn quadratic(&self) -> Option<Quantity> {
        if self.powers < 3 {
            return None;
        }
        let per = 1.0 / (self.coefficient(1) * self.full_scale_rad_s.powi(2));
        let (value, contributions) = self.combination(&[0.0, 0.0, 1.0]);
        let contributions = contributions.into_iter().map(|c| Contribution { sensitivity: c.sensitivity * per.abs(), ..c }).collect();
        Some(Quantity::new("quadratic_s", "s", value * per, contributions).meaning(Meaning::Quadratic))
    }

    /// Hysteresis: output approached from below minus from above, % of full scale.
    pub fn hysteresis(&self) -> Option<Quantity> {
        if !self.has_direction {
            return None;
        }
        let mut gradient = vec![0.0; self.powers];
        gradient.push(1.0);
        let percent = 100.0 / (self.coefficient(1).abs() * self.full_scale_rad_s);
        let (value, contributions) = self.combination(&gradient);
        let contributions = contributions.into_iter().map(|c| Contribution { sensitivity: c.sensitivity * percent, ..c }).collect();
        Some(Quantity::new("hysteresis_percent_fs", "%", value * percent, contributions).meaning(Meaning::Hysteresis))
    }

    /// Asymmetry: slope at positive minus slope at negative rates, % of their mean.
    pub fn asymmetry(&self) -> Option<Quantity> {
        let has = |sign: f64| self.points.iter().filter(|p| p.plateau.rate_rad_s * sign > 1e-3 * self.full_scale_rad_s).count() >= 2;
        if !(has(1.0) && has(-1.0)) {
            return None;
        }
        let rows: Vec<Vec<f64>> = self
            .points
            .iter()
            .map(|p| {
                let x = p.plateau.rate_rad_s;
                let mut row = vec![1.0, x.max(0.0), x.min(0.0), p.from_middle_s];
                if !self.drift_sensitivity.is_empty() {
                    row.pop();
                }
                row
            })
            .collect();
        let output: Vec<f64> = self.points.iter().map(|p| p.output).collect();
        let fit = least_squares(&rows, &output)?;
        let (plus, minus) = (fit.coefficients[1], fit.coefficients[2]);
        let mean = 0.5 * (plus + minus);
        let u = fit.sigma_of(&[0.0, 100.0 / mean, -100.0 / mean]);
        let scatter = Contribution::type_a("noise and repeatability", u, fit.dof, Basis::LinesMeetingAtRest);
        Some(Quantity::new("asymmetry_percent", "%", 100.0 * (plus - minus) / mean, vec![scatter]).meaning(Meaning::Asymmetry))
    }

    /// Repeatability: standard deviation of a repeated plateau, % of full scale.
    pub fn repeatability(&self) -> Option<Quantity> {
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
        let percent = 100.0 / (self.coefficient(1).abs() * self.full_scale_rad_s);
        let value = (sum / dof).sqrt() * percent;
        let repeats = Contribution::type_a("number of repeats", value / (2.0 * dof).sqrt(), dof, Basis::OfStandardDeviation);
        Some(Quantity::new("repeatability_percent_fs", "%", value, vec![repeats]).meaning(Meaning::Repeatability))
    }

    /// Departure from the least-squares line, % of full scale.
    fn curve(&self) -> Curve {
        let slope = self.coefficient(1) + if self.powers > 3 { 0.6 * self.coefficient(3) * self.full_scale_rad_s.powi(2) } else { 0.0 };
        let level = self.coefficient(0) + if self.powers > 2 { self.coefficient(2) * self.full_scale_rad_s.powi(2) / 3.0 } else { 0.0 };
        let percent = 100.0 / (self.coefficient(1).abs() * self.full_scale_rad_s);
        let departure = |rate: f64, output: f64| (output - level - slope * rate) * percent;
        let points = self.points.iter().map(|p| (p.plateau.rate_rad_s, departure(p.plateau.rate_rad_s, p.output))).collect();
        let line =
            (-50..=50).map(|k| f64::from(k) / 50.0 * self.full_scale_rad_s).map(|rate| (rate, departure(rate, self.at(rate)))).collect();
        Curve::new(CurveKind::LineDeparture, points, line)
    }
}

/// Mean outputs of all plateaus of the steps.
pub(super) fn points(steps: &[&Step], settings: &GyroSettings) -> Vec<Point> {
    let mut points = Vec::new();
    for (log, step) in steps.iter().enumerate() {
        let Some(output) = dut_output(&step.log, settings) else { continue };
        let t_s = step.log.t_s();
        let middle_s = 0.5 * (t_s.first().unwrap_or(&0.0) + t_s.last().unwrap_or(&0.0));
        for plateau in plateaus(&step.log, "rate_cmd_rad_s", settings.settle_s) {
            let (mean, slope, from_middle_s) = (plateau.mean(output), plateau.slope(t_s, output), plateau.mid_s - middle_s);
            points.push(Point { plateau, output: mean, slope, log, from_middle_s });
        }
    }
    points
}

/// Adds the quantities of the static characteristic; returns full scale, rad/s.
///
/// # Errors
/// No log has plateaus of both signs, or enough of them.
pub(super) fn add(steps: &[&Step], settings: &GyroSettings, findings: &mut Findings) -> Result<f64, CalibrateError> {
    let all = points(steps, settings);
    let greatest = all.iter().map(|p| p.plateau.rate_rad_s.abs()).max_or_zero();
    let full_scale = settings.full_scale_rad_s.unwrap_or(greatest);
    let is_large = |log: usize| all.iter().any(|p| p.log == log && p.plateau.rate_rad_s.abs() > SMALL_RATE_FRACTION * greatest);
    let has_two = |log: usize| {
        let mut levels: Vec<f64> = all.iter().filter(|p| p.log == log).map(|p| p.plateau.setpoint).collect();
        levels.dedup();
        levels.iter().any(|l| *l > 0.0) && levels.iter().any(|l| *l < 0.0)
    };
    let used: Vec<Point> = all.iter().filter(|p| is_large(p.log) && has_two(p.log)).cloned().collect();
    let Some(found) = characteristic(used, full_scale) else {
        return Err(CalibrateError::NoPlateaus);
    };
    if found.fit.dof < MIN_DOF {
        return Err(CalibrateError::TooFewPlateaus { count: found.points.len() });
    }
    findings.quantities.extend([found.scale(&settings.assumptions), found.bias(&settings.assumptions)]);
    for (name, quantity, reason) in [
        ("nonlinearity_percent_fs", found.nonlinearity(), AbsenceReason::NeedsThreeRates),
        ("asymmetry_percent", found.asymmetry(), AbsenceReason::NeedsPlateausOfBothSigns),
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
    Ok(full_scale)
}

//! The static characteristic: plateaus of many rates, both ways and signs, and the curve through them.

use super::{Given, samples};
use crate::calibrate::plateaus::{Plateau, plateaus};
use crate::calibrate::{CalibrateError, Curve, EARTH_RAD_S, Findings, Known, Step};
use crate::statistics::Extremes;
use crate::statistics::uncertainty::{Kind, Part, Quantity};
use crate::statistics::{LeastSquares, least_squares};

/// Logs below this part of the greatest rate are for thresholds, not for the characteristic.
const SMALL: f64 = 0.05;
/// The time counts as a column of its own unless the others explain this much of it.
const COLLINEAR: f64 = 0.9;

/// One mean of the sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// The plateau.
    pub plateau: Plateau,
    /// Mean of the sensor.
    pub shown: f64,
    /// Slope of the sensor within the plateau, per second.
    pub slope: f64,
    /// Which log, and the time from that log's middle, s.
    pub log: usize,
    /// Time from the log's middle, s.
    pub from_middle_s: f64,
}

/// A curve b + sΩ + c₂Ω² + c₃Ω³ through plateaus.
#[derive(Debug, Clone)]
pub struct Characteristic {
    /// Its points.
    pub points: Vec<Point>,
    fit: LeastSquares,
    /// Of each coefficient, how much it would be moved by a drift of 1 per second that is not fitted; empty where drift is fitted.
    by_drift: Vec<f64>,
    /// Drift seen within plateaus, per second, and its standard uncertainty.
    drift: (f64, f64),
    powers: usize,
    has_direction: bool,
    /// Rate to which per cents refer, rad/s.
    pub full_scale_rad_s: f64,
}

/// Fits the curve; `None` where there are too few plateaus.
pub fn characteristic(points: Vec<Point>, full_scale_rad_s: f64) -> Option<Characteristic> {
    let mut levels: Vec<f64> = points.iter().map(|p| p.plateau.asked).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let powers = match levels.len() {
        0 | 1 => return None,
        2 => 2,
        3 | 4 => 3,
        _ => 4,
    };
    // A direction is seen only where a level is come to from both sides.
    let both_ways = levels.iter().filter(|level| {
        let way = |sign: f64| points.iter().any(|p| p.plateau.asked == **level && p.plateau.direction() == sign);
        way(1.0) && way(-1.0)
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
    let shown: Vec<f64> = points.iter().map(|p| p.shown).collect();
    let time: Vec<f64> = points.iter().map(|p| p.from_middle_s).collect();
    let of_time = least_squares(&rows, &time);
    let spread: f64 = time.iter().map(|t| t * t).sum();
    let told_apart = of_time.as_ref().is_some_and(|f| f.residuals.iter().map(|r| r * r).sum::<f64>() > (1.0 - COLLINEAR) * spread);
    let with_time = || -> Option<LeastSquares> {
        let rows: Vec<Vec<f64>> = rows.iter().zip(&time).map(|(row, t)| row.iter().copied().chain([*t]).collect()).collect();
        least_squares(&rows, &shown).filter(|fit| fit.dof >= 1.0)
    };
    let (fit, by_drift) = match told_apart.then(with_time).flatten() {
        Some(fit) => (fit, Vec::new()),
        None => (least_squares(&rows, &shown)?, of_time.map(|f| f.coefficients).unwrap_or_else(|| vec![0.0; rows[0].len()])),
    };
    let drift = drift_within(&points);
    Some(Characteristic { points, fit, by_drift, drift, powers, has_direction, full_scale_rad_s })
}

/// Weighted mean of the slopes within the plateaus, and its standard uncertainty from their scatter.
fn drift_within(points: &[Point]) -> (f64, f64) {
    // A slope's variance falls with the cube of the duration.
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

    /// Σ gradient·coefficient in units of full scale, with what of its uncertainty this log shows: scatter, and drift where it could not be fitted.
    fn of(&self, gradient: &[f64]) -> (f64, Vec<Part>) {
        let value = gradient.iter().zip(&self.fit.coefficients).map(|(g, c)| g * c).sum();
        let says = format!("scatter of {} plateaus about the curve", self.points.len());
        let mut parts = vec![Part::measured("noise and repeatability", self.fit.sigma_of(gradient), self.fit.dof, says)];
        if !self.by_drift.is_empty() {
            let moved: f64 = gradient.iter().zip(&self.by_drift).map(|(g, c)| g * c).sum();
            let (drift, u) = self.drift;
            let says = "the order of the plateaus does not tell drift from rate; as large as it is seen within them";
            // Seen in this log, and of this log alone.
            let seen =
                Part { kind: Kind::A, dof: self.points.len() as f64 - 1.0, ..Part::known("drift", drift.hypot(u), "1/s", moved, says) };
            parts.push(seen);
        }
        (value, parts)
    }

    /// Slope of the straight line of least squares over ± full scale.
    pub fn scale(&self, known: &Known) -> Quantity {
        let fs = self.full_scale_rad_s;
        // ∫ x·x³ / ∫ x·x over ± 1 is 3/5.
        let (sum, parts) = self.of(&[0.0, 1.0, 0.0, if self.powers > 3 { 0.6 } else { 0.0 }]);
        let scale = sum / fs;
        let mut parts: Vec<Part> = parts.into_iter().map(|p| Part { sensitivity: p.sensitivity / fs, ..p }).collect();
        parts[0].unit = "rad/s".into();
        parts.push(Part::within("clock", known.crystal_ppm * 1e-6, "1", scale, format!("crystal, ± {} ppm", known.crystal_ppm)));
        // The cosine of an angle that lies anywhere within ± m is 1 − m²/6 in the mean, and scatters by m²/2 √(4/45) (GUM F.2.4.4).
        let m_2 = known.misalignment_deg.to_radians().powi(2);
        let scale = scale * (1.0 + m_2 / 6.0);
        let says = format!("cosine of up to {}° between the part's axis and the platform's; its mean is taken off", known.misalignment_deg);
        parts.push(Part::known("misalignment", 0.5 * m_2 * (4.0_f64 / 45.0).sqrt(), "1", scale, says));
        Quantity::new("scale", "1", scale, parts).saying("slope of the straight line of least squares over ± full scale")
    }

    /// What is shown at rest, the Earth's rotation taken off where the latitude is known.
    pub fn bias(&self, known: &Known) -> Quantity {
        let (mut bias, mut parts) = self.of(&[1.0]);
        let scale = self.coefficient(1);
        let level_rad = known.level_deg.to_radians();
        let says = match known.latitude_deg {
            Some(latitude_deg) => {
                let latitude = latitude_deg.to_radians();
                bias -= scale * EARTH_RAD_S * latitude.sin();
                parts.push(Part::within(
                    "tilt",
                    level_rad,
                    "rad",
                    EARTH_RAD_S * latitude.cos(),
                    format!("level to ± {}°: the Earth's rotation seen along the axis", known.level_deg),
                ));
                "without the Earth's rotation along the axis"
            }
            None => {
                parts.push(Part::within("Earth rate", EARTH_RAD_S, "rad/s", scale, "no latitude was given"));
                "with the Earth's rotation along the axis: give the latitude to take it off"
            }
        };
        Quantity::new("bias_rad_s", "rad/s", bias, parts).saying(says)
    }

    /// Greatest departure of the curve from its straight line, per cent of full scale: at one of its ends ⅔|c₂| + ⅖|c₃|, in units of full scale.
    pub fn nonlinearity(&self) -> Option<Quantity> {
        if self.powers < 3 {
            return None;
        }
        let sign = |k: usize| self.fit.coefficients.get(k).filter(|_| k < self.powers).map_or(0.0, |c| c.signum());
        let per_cent = 100.0 / (self.coefficient(1).abs() * self.full_scale_rad_s);
        let (value, parts) = self.of(&[0.0, 0.0, 2.0 / 3.0 * sign(2), 0.4 * sign(3)]);
        let parts = parts.into_iter().map(|p| Part { sensitivity: p.sensitivity * per_cent, ..p }).collect();
        Some(Quantity::new("nonlinearity_percent_fs", "%", value * per_cent, parts).saying(
            "greatest departure of the curve from its straight line, at one end of ± full scale; never below 0, so noise alone makes some",
        ))
    }

    /// The coefficient of Ω² over the scale, s: what a linearity defect and g-sensitivity at a radius have in common.
    pub fn quadratic(&self) -> Option<Quantity> {
        if self.powers < 3 {
            return None;
        }
        let per = 1.0 / (self.coefficient(1) * self.full_scale_rad_s.powi(2));
        let (value, parts) = self.of(&[0.0, 0.0, 1.0]);
        let parts = parts.into_iter().map(|p| Part { sensitivity: p.sensitivity * per.abs(), ..p }).collect();
        Some(Quantity::new("quadratic_s", "s", value * per, parts).saying(
            "at one radius the square of the rate is also the centripetal acceleration: a second radius tells g-sensitivity from nonlinearity",
        ))
    }

    /// Shown when come to from below less from above, per cent of full scale.
    pub fn hysteresis(&self) -> Option<Quantity> {
        if !self.has_direction {
            return None;
        }
        let mut gradient = vec![0.0; self.powers];
        gradient.push(1.0);
        let per_cent = 100.0 / (self.coefficient(1).abs() * self.full_scale_rad_s);
        let (value, parts) = self.of(&gradient);
        let parts = parts.into_iter().map(|p| Part { sensitivity: p.sensitivity * per_cent, ..p }).collect();
        Some(Quantity::new("hysteresis_percent_fs", "%", value * per_cent, parts).saying("rising less falling"))
    }

    /// Slope at positive less slope at negative rates, per cent of their mean.
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
                if !self.by_drift.is_empty() {
                    row.pop();
                }
                row
            })
            .collect();
        let shown: Vec<f64> = self.points.iter().map(|p| p.shown).collect();
        let fit = least_squares(&rows, &shown)?;
        let (plus, minus) = (fit.coefficients[1], fit.coefficients[2]);
        let mean = 0.5 * (plus + minus);
        let u = fit.sigma_of(&[0.0, 100.0 / mean, -100.0 / mean]);
        let part = Part::measured("noise and repeatability", u, fit.dof, "scatter about two straight lines that meet at rest");
        Some(
            Quantity::new("asymmetry_percent", "%", 100.0 * (plus - minus) / mean, vec![part])
                .saying("slope at positive less slope at negative rates"),
        )
    }

    /// Scatter of a plateau that is run again, per cent of full scale.
    pub fn repeatability(&self) -> Option<Quantity> {
        let mut groups: Vec<((u64, i8), Vec<f64>)> = Vec::new();
        for (p, residual) in self.points.iter().zip(&self.fit.residuals) {
            let key = (p.plateau.asked.to_bits(), p.plateau.direction() as i8);
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
        let per_cent = 100.0 / (self.coefficient(1).abs() * self.full_scale_rad_s);
        let value = (sum / dof).sqrt() * per_cent;
        let part = Part::measured(
            "number of repeats",
            value / (2.0 * dof).sqrt(),
            dof,
            "standard uncertainty of a standard deviation (GUM E.4.3)",
        );
        Some(Quantity::new("repeatability_percent_fs", "%", value, vec![part]).saying("standard deviation of one plateau, run again"))
    }

    /// Residuals of the straight line, per cent of full scale, for a picture.
    fn curve(&self) -> Curve {
        let slope = self.coefficient(1) + if self.powers > 3 { 0.6 * self.coefficient(3) * self.full_scale_rad_s.powi(2) } else { 0.0 };
        let level = self.coefficient(0) + if self.powers > 2 { self.coefficient(2) * self.full_scale_rad_s.powi(2) / 3.0 } else { 0.0 };
        let per_cent = 100.0 / (self.coefficient(1).abs() * self.full_scale_rad_s);
        let off = |rate: f64, shown: f64| (shown - level - slope * rate) * per_cent;
        let points = self.points.iter().map(|p| (p.plateau.rate_rad_s, off(p.plateau.rate_rad_s, p.shown))).collect();
        let line = (-50..=50).map(|k| f64::from(k) / 50.0 * self.full_scale_rad_s).map(|rate| (rate, off(rate, self.at(rate)))).collect();
        Curve {
            title: "Static characteristic: departure from the straight line".into(),
            x: "rate by the encoder, rad/s".into(),
            y: "departure, % of full scale".into(),
            is_log: false,
            points,
            line,
            ..Curve::default()
        }
    }
}

/// The points of these steps' plateaus.
pub(super) fn points(steps: &[&Step], given: &Given) -> Vec<Point> {
    let mut points = Vec::new();
    for (log, step) in steps.iter().enumerate() {
        let Some(shown) = samples(&step.log, given) else { continue };
        let t_s = step.log.t_s();
        let middle_s = 0.5 * (t_s.first().unwrap_or(&0.0) + t_s.last().unwrap_or(&0.0));
        for plateau in plateaus(&step.log, "rate_cmd_rad_s", given.settle_s) {
            let (mean, slope, from_middle_s) = (plateau.mean(shown), plateau.slope(t_s, shown), plateau.mid_s - middle_s);
            points.push(Point { plateau, shown: mean, slope, log, from_middle_s });
        }
    }
    points
}

/// Adds what the characteristic shows; gives full scale.
pub(super) fn add(steps: &[&Step], given: &Given, findings: &mut Findings) -> Result<f64, CalibrateError> {
    let all = points(steps, given);
    let greatest = all.iter().map(|p| p.plateau.rate_rad_s.abs()).max_or_zero();
    let full_scale = given.full_scale_rad_s.unwrap_or(greatest);
    let is_large = |log: usize| all.iter().any(|p| p.log == log && p.plateau.rate_rad_s.abs() > SMALL * greatest);
    let has_two = |log: usize| {
        let mut levels: Vec<f64> = all.iter().filter(|p| p.log == log).map(|p| p.plateau.asked).collect();
        levels.dedup();
        levels.iter().any(|l| *l > 0.0) && levels.iter().any(|l| *l < 0.0)
    };
    let used: Vec<Point> = all.iter().filter(|p| is_large(p.log) && has_two(p.log)).cloned().collect();
    let Some(found) = characteristic(used, full_scale) else {
        return Err(CalibrateError::TooLittle {
            what: "gyro",
            says: "no log has plateaus of both signs; record a staircase in rate mode (profile staircase)".into(),
        });
    };
    if found.fit.dof < 2.0 {
        return Err(CalibrateError::TooLittle {
            what: "gyro",
            says: format!("{} plateaus are too few; record longer", found.points.len()),
        });
    }
    findings.quantities.extend([found.scale(&given.known), found.bias(&given.known)]);
    for (name, quantity, why) in [
        ("nonlinearity_percent_fs", found.nonlinearity(), "it takes three rates or more"),
        ("asymmetry_percent", found.asymmetry(), "it takes two plateaus of each sign"),
        ("hysteresis_percent_fs", found.hysteresis(), "it takes plateaus that are come to from both sides (profile staircase)"),
        ("quadratic_s", found.quadratic(), "it takes three rates or more"),
        ("repeatability_percent_fs", found.repeatability(), "it takes plateaus that are run again: a longer staircase, or ABBA"),
    ] {
        match quantity {
            Some(quantity) => findings.quantities.push(quantity),
            None => findings.lacks(name, why),
        }
    }
    if !found.by_drift.is_empty() {
        findings.says.push("the order of the plateaus does not tell a drift from the scale: ABBA or a staircase does".into());
    }
    findings.curves.push(found.curve());
    Ok(full_scale)
}

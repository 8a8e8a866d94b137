//! Static characteristic: a cubic through plateaus of many rates, approached from both sides, of both signs; where the device under test
//! warms, a surface over rate and temperature.
//!
//! y = b + sΩ + c₂Ω² + c₃Ω³ + h·direction/2 + (T − T₀)(b_T + s_TΩ) + d·t: hysteresis h, temperature coefficients and drift d are fitted as
//! far as the plateaus separate them. All quantities of the characteristic come from this one fit, so their covariance is known. T₀ is the
//! mean temperature of the plateaus.

use super::encoder::EncoderAmplitudes;
use super::points::Point;
use crate::calibrate::{Basis, Contribution};
use identification::statistics::Extremes;
use identification::statistics::uncertainty::{Evaluation, Loadings, TemperatureRange};
use identification::statistics::{LeastSquares, least_squares};

/// Part of the variance of a regressor explained by the others from which it is not fitted.
const MAX_EXPLAINED: f64 = 0.9;
/// Smallest temperature range of a surface over rate and temperature, K.
pub(super) const MIN_RANGE_K: f64 = 1.0;
/// Name of the fit in the loadings of its quantities.
pub(super) const FIT: &str = "characteristic";

/// A regressor of the characteristic; powers are those of the rate over full scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Term {
    Power(i32),
    Direction,
    Temperature,
    TemperatureTimesRate,
    Time,
}

/// A fitted static characteristic.
#[derive(Debug, Clone)]
pub struct Characteristic {
    /// Its points.
    pub points: Vec<Point>,
    terms: Vec<Term>,
    pub(super) fit: LeastSquares,
    /// Change of each coefficient by a drift of 1 per second that is not fitted; empty where drift is fitted.
    pub(super) drift_sensitivity: Vec<f64>,
    /// Drift within plateaus, per second, and its standard uncertainty.
    drift: (f64, f64),
    /// Amplitude of the encoder's error within a turn, rad, and the change of each coefficient by the standard deviation of that error in
    /// each plateau.
    encoder: Option<(f64, Vec<Vec<f64>>)>,
    /// Full scale, rad/s.
    pub full_scale_rad_s: f64,
    /// Temperature of the device under test; `None` without a thermometer.
    pub temperature: Option<TemperatureRange>,
}

impl Term {
    fn value(self, p: &Point, full_scale_rad_s: f64, reference_C: f64) -> f64 {
        let x = p.plateau.rate_rad_s / full_scale_rad_s;
        match self {
            Term::Power(k) => x.powi(k),
            Term::Direction => 0.5 * p.plateau.direction(),
            Term::Temperature => p.temperature_C - reference_C,
            Term::TemperatureTimesRate => (p.temperature_C - reference_C) * x,
            Term::Time => p.from_middle_s,
        }
    }
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
    let mut terms: Vec<Term> = (0..powers).map(Term::Power).collect();
    // Hysteresis is visible only where a level is approached from both sides.
    let both_ways = levels.iter().filter(|level| {
        let approached = |sign: f64| points.iter().any(|p| p.plateau.setpoint == **level && p.plateau.direction() == sign);
        approached(1.0) && approached(-1.0)
    });
    if both_ways.count() >= 2 {
        terms.push(Term::Direction);
    }
    let temperature = temperature(&points);
    let reference_C = temperature.map_or(0.0, |t| t.at_C);
    let column = |term: Term| points.iter().map(|p| term.value(p, full_scale_rad_s, reference_C)).collect::<Vec<f64>>();
    let rows = |terms: &[Term]| -> Vec<Vec<f64>> {
        points.iter().map(|p| terms.iter().map(|term| term.value(p, full_scale_rad_s, reference_C)).collect()).collect()
    };
    let is_separable = |terms: &[Term], term: Term| {
        let (values, spread) = (column(term), column(term).iter().map(|v| v * v).sum::<f64>());
        points.len() > terms.len() + 2
            && least_squares(&rows(terms), &values)
                .is_some_and(|f| f.residuals.iter().map(|r| r * r).sum::<f64>() > (1.0 - MAX_EXPLAINED) * spread)
    };
    if temperature.is_some_and(|t| t.high_C - t.low_C >= MIN_RANGE_K) {
        for term in [Term::Temperature, Term::TemperatureTimesRate] {
            if is_separable(&terms, term) {
                terms.push(term);
            }
        }
    }
    let drift_is_fitted = is_separable(&terms, Term::Time);
    if drift_is_fitted {
        terms.push(Term::Time);
    }
    let output: Vec<f64> = points.iter().map(|p| p.output).collect();
    let all = rows(&terms);
    let fit = least_squares(&all, &output)?;
    let drift_sensitivity = if drift_is_fitted {
        Vec::new()
    } else {
        least_squares(&all, &column(Term::Time)).map_or_else(|| vec![0.0; terms.len()], |f| f.coefficients)
    };
    let drift = drift_within(&points);
    Some(Characteristic { points, terms, fit, drift_sensitivity, drift, encoder: None, full_scale_rad_s, temperature })
}

/// Standard deviation of the rate of a plateau by an error of the encoder of these amplitudes at an unknown angle, rad/s; none over whole
/// turns.
fn rate_error_rad_s(point: &Point, amplitudes: &EncoderAmplitudes) -> f64 {
    let plateau = &point.plateau;
    if plateau.turns > 0 {
        return 0.0;
    }
    amplitudes.difference_rad(plateau.rate_rad_s * plateau.duration_s) / plateau.duration_s
}

/// Mean, smallest and greatest temperature.
fn temperature(points: &[Point]) -> Option<TemperatureRange> {
    let (low_C, high_C) = points.iter().map(|p| p.temperature_C).min_max();
    let at_C = points.iter().map(|p| p.temperature_C).sum::<f64>() / points.len() as f64;
    at_C.is_finite().then_some(TemperatureRange { at_C, low_C, high_C })
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
    /// With the amplitudes of the encoder's error within a turn in the budgets.
    pub(super) fn with_encoder_error(mut self, amplitudes: Option<EncoderAmplitudes>) -> Self {
        let reference_C = self.temperature.map_or(0.0, |t| t.at_C);
        let value = |p: &Point| -> Vec<f64> { self.terms.iter().map(|term| term.value(p, self.full_scale_rad_s, reference_C)).collect() };
        let rows: Vec<Vec<f64>> = self.points.iter().map(value).collect();
        self.encoder = amplitudes.map(|amplitudes| {
            let by_plateau = (0..rows.len()).filter_map(|k| {
                let mut output = vec![0.0; rows.len()];
                output[k] = self.coefficient(1) * rate_error_rad_s(&self.points[k], &amplitudes);
                if output[k] == 0.0 { None } else { least_squares(&rows, &output).map(|fit| fit.coefficients) }
            });
            (amplitudes.total_rad(), by_plateau.collect())
        });
        self
    }

    fn place(&self, term: Term) -> Option<usize> {
        self.terms.iter().position(|t| *t == term)
    }

    /// Number of powers of the rate.
    pub(super) fn powers(&self) -> usize {
        self.terms.iter().filter(|t| matches!(t, Term::Power(_))).count()
    }

    /// Coefficient of Ωᵏ; 0 where it is not fitted.
    pub fn coefficient(&self, k: usize) -> f64 {
        self.place(Term::Power(k as i32)).map_or(0.0, |at| self.fit.coefficients[at] / self.full_scale_rad_s.powi(k as i32))
    }

    /// The curve at a rate.
    pub fn at(&self, rate_rad_s: f64) -> f64 {
        (0..self.powers()).map(|k| self.coefficient(k) * rate_rad_s.powi(k as i32)).sum()
    }

    /// Rate at which the curve has this output.
    pub fn rate_of(&self, output: f64) -> f64 {
        let slope = |x: f64| (1..self.powers()).map(|k| k as f64 * self.coefficient(k) * x.powi(k as i32 - 1)).sum::<f64>();
        let mut rate = (output - self.coefficient(0)) / self.coefficient(1);
        // Newton's method: three steps for a departure of some per cent from the straight line.
        for _ in 0..3 {
            rate -= (self.at(rate) - output) / slope(rate);
        }
        rate
    }

    /// Slope of the output by a sine of this amplitude about a mean rate, rad/s: s + 2c₂Ω + 3c₃(Ω² + A²/4).
    pub fn slope_at(&self, mean_rad_s: f64, amplitude_rad_s: f64) -> (f64, Vec<f64>) {
        let (x, a) = (mean_rad_s / self.full_scale_rad_s, amplitude_rad_s / self.full_scale_rad_s);
        let gradient: Vec<f64> = [0.0, 1.0, 2.0 * x, 3.0 * (x * x + 0.25 * a * a)].map(|g| g / self.full_scale_rad_s).to_vec();
        (self.value_of(&self.powers_gradient(&gradient)), gradient)
    }

    /// Gradient over all coefficients from one over the powers of the rate; missing powers are left out.
    fn powers_gradient(&self, powers: &[f64]) -> Vec<f64> {
        self.terms
            .iter()
            .map(|term| if let Term::Power(k) = term { powers.get(*k as usize).copied().unwrap_or(0.0) } else { 0.0 })
            .collect()
    }

    fn value_of(&self, gradient: &[f64]) -> f64 {
        gradient.iter().zip(&self.fit.coefficients).map(|(g, c)| g * c).sum()
    }

    /// Σ gradient·coefficient with its type A contributions: scatter, and drift where it is not fitted. `powers` is the gradient over the
    /// powers of the rate over full scale.
    pub(super) fn combination(&self, powers: &[f64]) -> (f64, Vec<Contribution>) {
        self.of_gradient(&self.powers_gradient(powers))
    }

    fn of_gradient(&self, gradient: &[f64]) -> (f64, Vec<Contribution>) {
        let basis = Basis::PlateausAboutCurve { count: self.points.len() };
        let loadings = Loadings { fit: FIT, components: self.fit.factors_of(gradient) };
        let noise = Contribution::type_a("noise and repeatability", self.fit.sigma_of(gradient), self.fit.dof, basis);
        let mut contributions = vec![noise.with_loadings(loadings)];
        if !self.drift_sensitivity.is_empty() {
            let sensitivity: f64 = gradient.iter().zip(&self.drift_sensitivity).map(|(g, c)| g * c).sum();
            let (drift, u) = self.drift;
            let dof = self.points.len() as f64 - 1.0;
            let drift = drift.hypot(u);
            contributions.push(Contribution {
                evaluation: Evaluation::A,
                dof,
                loadings: Some(Loadings { fit: "drift", components: vec![drift * sensitivity] }),
                ..Contribution::type_b("drift", drift, "1/s", sensitivity, Basis::DriftWithinPlateaus)
            });
        }
        if let Some((amplitude_rad, by_plateau)) = &self.encoder {
            let components: Vec<f64> = by_plateau.iter().map(|changes| gradient.iter().zip(changes).map(|(g, c)| g * c).sum()).collect();
            let u = components.iter().map(|part| part * part).sum::<f64>().sqrt();
            if u > 0.0 {
                let basis = Basis::EncoderWithinTurn { amplitude_rad: *amplitude_rad };
                let line = Contribution::type_b("encoder within a turn", *amplitude_rad, "rad", u / amplitude_rad, basis);
                contributions.push(line.with_loadings(Loadings { fit: "encoder", components }));
            }
        }
        (self.value_of(gradient), contributions)
    }

    /// Coefficient of one term that is not a power of the rate.
    fn of_term(&self, term: Term) -> Option<(f64, Vec<Contribution>)> {
        let at = self.place(term)?;
        let mut gradient = vec![0.0; self.terms.len()];
        gradient[at] = 1.0;
        Some(self.of_gradient(&gradient))
    }

    /// Approached from below minus from above.
    pub(super) fn direction(&self) -> Option<(f64, Vec<Contribution>)> {
        self.of_term(Term::Direction)
    }

    /// Change of the output at rest per kelvin.
    pub(super) fn per_kelvin(&self) -> Option<(f64, Vec<Contribution>)> {
        self.of_term(Term::Temperature)
    }

    /// Change of the slope over the rate per kelvin, times full scale.
    pub(super) fn slope_per_kelvin(&self) -> Option<(f64, Vec<Contribution>)> {
        self.of_term(Term::TemperatureTimesRate)
    }
}

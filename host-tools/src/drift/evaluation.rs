//! Evaluation of many cycles: own drift, apparent drift and azimuth with uncertainties, corrected and uncorrected.

use super::cycle::{Cycle, is_same_position};
use super::error::DriftError;
use super::error_budget::{ErrorContribution, combined};
use super::estimate::Estimate;
use super::inequality::{MIN_AMPLITUDE_RATIO, PulseInequality, mean};
use super::integral::{Integral, reference_rad_s};
use super::measurement::{Measurement, SeparatedDrift};
use super::positions::{self, PositionRate};
use super::separation::{self, PlatformDrift};
use hal_sim::gyro::Orientation;

/// Result of a drift measurement.
#[derive(Debug, Clone)]
pub struct DriftResult {
    /// The input.
    pub measurement: Measurement,
    /// With all corrections.
    pub corrected: SeparatedDrift,
    /// By formulas (13) to (16) only.
    pub uncorrected: SeparatedDrift,
    /// K_m i/H by the unswitched sums, rad/s, where both polarities were used.
    pub reference_rad_s: Option<f64>,
    /// Uncertainty budget of each axis.
    pub budgets: Vec<Vec<ErrorContribution>>,
}

impl Measurement {
    /// Inequality of the pulses of an axis.
    fn inequality(&self, axis: usize, rate: &dyn Fn(&Cycle) -> f64) -> Option<PulseInequality> {
        PulseInequality::from_cycles(&self.valid_cycles().into_iter().filter(|c| c.axis == axis).collect::<Vec<_>>(), rate)
    }

    /// Mean rates of an axis in all positions.
    fn position_rates(&self, axis: usize, rate: &dyn Fn(&Cycle) -> f64, inequality: Option<&PulseInequality>) -> Vec<PositionRate> {
        let mean_in = |position: &Orientation| {
            let cycles: Vec<&Cycle> =
                self.valid_cycles().into_iter().filter(|c| c.axis == axis && is_same_position(&c.position, position)).collect();
            (!cycles.is_empty()).then(|| mean(&cycles, rate, inequality))
        };
        let positions = self.positions();
        let rates = positions.iter().filter_map(|position| {
            let (rate_rad_s, sigma_rad_s) = mean_in(position)?;
            Some(PositionRate { position: *position, rate_rad_s, sigma_rad_s })
        });
        rates.collect()
    }

    /// Evaluates the measurement.
    ///
    /// # Errors
    /// No valid cycle, one position only, a pole, positions that do not separate the parameters.
    pub fn evaluate(self) -> Result<DriftResult, DriftError> {
        if self.valid_cycles().is_empty() {
            let defect = self.cycles.first().and_then(|cycle| cycle.defect.clone());
            return Err(DriftError::NoValidCycle { log: self.name, count: self.cycles.len(), defect });
        }
        let earth = self.latitude_deg.map(separation::earth_rad_s).transpose()?;
        let (mut corrected, uncorrected) = if self.has_three_axes {
            (self.separate_three(earth, &Cycle::rate_rad_s, true)?, self.separate_three(earth, &|c| c.integral.drift_rad_s(), false)?)
        } else {
            (self.separate_single(earth, &Cycle::rate_rad_s, true)?, self.separate_single(earth, &|c| c.integral.drift_rad_s(), false)?)
        };
        let reference_rad_s = self.reference_rad_s();
        let budgets: Vec<Vec<ErrorContribution>> =
            (0..corrected.own_rad_s.len()).map(|axis| self.error_budget(axis, earth, &corrected)).collect();
        for (axis, budget) in budgets.iter().enumerate() {
            corrected.own_rad_s[axis].sigma = combined(budget, |c| c.own_rad_s);
            corrected.apparent_rad_s[axis].sigma = combined(budget, |c| c.apparent_rad_s);
        }
        if let Some(azimuth) = &mut corrected.azimuth_rad {
            azimuth.sigma = combined(&budgets[0], |c| c.azimuth_rad);
        }
        Ok(DriftResult { measurement: self, corrected, uncorrected, reference_rad_s, budgets })
    }

    /// Separation for one axis; `has_inequality` applies the correction by two amplitudes.
    fn separate_single(
        &self,
        earth: Option<(f64, f64)>,
        rate: &dyn Fn(&Cycle) -> f64,
        is_corrected: bool,
    ) -> Result<SeparatedDrift, DriftError> {
        let inequality: Vec<PulseInequality> = self.inequality(0, rate).filter(|_| is_corrected).into_iter().collect();
        let rates = self.position_rates(0, rate, inequality.first());
        let is_raised = rates.iter().any(|rate| rate.position.raised_rad.sin().abs() > 1e-9);
        if is_raised && earth.is_none() {
            return Err(DriftError::RaisedWithoutLatitude);
        }
        let fit = positions::fit(&rates, earth.map_or(0.0, |(_, vertical)| vertical))?;
        let azimuth_rad = match (fit.sine, earth) {
            (Some(sine), _) => {
                let (c, s) = (fit.cosine.value, sine.value);
                let horizontal = c.hypot(s);
                let sigma = fit.cosine.sigma.zip(sine.sigma).map(|(of_c, of_s)| (s * of_c).hypot(c * of_s) / (horizontal * horizontal));
                Some(Estimate { value: s.atan2(c), sigma })
            }
            (None, Some((horizontal, _))) => separation::azimuth_rad(-fit.cosine.value, horizontal)
                .map(|value| Estimate { value, sigma: fit.cosine.sigma.map(|sigma| sigma / (horizontal * value.sin().abs().max(1e-6))) }),
            (None, None) => None,
        };
        let apparent = Estimate { value: -fit.cosine.value, sigma: fit.cosine.sigma };
        Ok(SeparatedDrift { own_rad_s: vec![fit.own], apparent_rad_s: vec![apparent], azimuth_rad, position_fit: Some(fit), inequality })
    }

    /// Separation for three axes.
    fn separate_three(
        &self,
        earth: Option<(f64, f64)>,
        rate: &dyn Fn(&Cycle) -> f64,
        is_corrected: bool,
    ) -> Result<SeparatedDrift, DriftError> {
        let log = || self.name.clone();
        let (horizontal, vertical) = earth.ok_or_else(|| DriftError::Note { log: log(), note: "latitude_deg", option: "--latitude" })?;
        // For all axes, or for none.
        let inequality: Vec<PulseInequality> = (0..3).map_while(|axis| self.inequality(axis, rate).filter(|_| is_corrected)).collect();
        let inequality = if inequality.len() == 3 { inequality } else { Vec::new() };
        let axes: [Vec<PositionRate>; 3] = std::array::from_fn(|axis| self.position_rates(axis, rate, inequality.get(axis)));
        let positions = self.positions();
        let [first, turned] = match positions.as_slice() {
            [first] => {
                let [turned_deg, raised_deg, rolled_deg] = [first.turned_rad, first.raised_rad, first.rolled_rad].map(f64::to_degrees);
                return Err(DriftError::OnePosition { turned_deg, raised_deg, rolled_deg });
            }
            [first, turned] if ((turned.turned_rad - first.turned_rad).cos() + 1.0).abs() < 1e-3 => [first, turned],
            _ => return Err(DriftError::ThreeAxisPositions),
        };
        let mut rates = [[0.0; 3]; 2];
        let mut sigmas = [[None; 3]; 2];
        for (k, position) in [first, turned].into_iter().enumerate() {
            for axis in 0..3 {
                let mean = axes[axis].iter().find(|rate| is_same_position(&rate.position, position));
                let mean = mean.ok_or_else(|| DriftError::AxisMissing { log: log(), axis: ["x", "y", "z"][axis] })?;
                (rates[k][axis], sigmas[k][axis]) = (mean.rate_rad_s, mean.sigma_rad_s);
            }
        }
        let pulse_s = self.valid_cycles()[0].integral.pulse_s;
        let PlatformDrift { own_rad_s, azimuth_rad } =
            if is_corrected { separation::three(&rates, vertical, pulse_s) } else { separation::three_uncorrected(&rates, vertical) };
        let half = |axis: usize| sigmas[0][axis].zip(sigmas[1][axis]).map(|(a, b): (f64, f64)| a.hypot(b) / 2.0);
        let (sin, cos) = azimuth_rad.sin_cos();
        let sigma = half(0).zip(half(2)).map(|(x, z)| (sin * x).hypot(cos * z) / horizontal);
        let apparent = [-horizontal * cos, -vertical, horizontal * sin];
        // The apparent drift follows from azimuth and latitude; about the vertical, from the latitude only.
        let lever = [Some(horizontal * sin.abs()), None, Some(horizontal * cos.abs())];
        let of_azimuth =
            |axis: usize| Estimate { value: apparent[axis], sigma: sigma.zip(lever[axis]).map(|(sigma, lever)| sigma * lever) };
        Ok(SeparatedDrift {
            own_rad_s: (0..3).map(|axis| Estimate { value: own_rad_s[axis], sigma: half(axis) }).collect(),
            apparent_rad_s: (0..3).map(of_azimuth).collect(),
            azimuth_rad: Some(Estimate { value: azimuth_rad - first.turned_rad, sigma }),
            position_fit: None,
            inequality,
        })
    }

    /// K_m i/H by the sums of both polarities, rad/s.
    fn reference_rad_s(&self) -> Option<f64> {
        // With several amplitudes: that of the first cycle.
        let first = self.valid_cycles().first()?.amplitude_rad_s;
        let cycles: Vec<&Cycle> = self
            .valid_cycles()
            .into_iter()
            .filter(|c| (c.amplitude_rad_s / first - 1.0).abs() < (MIN_AMPLITUDE_RATIO - 1.0) / 2.0)
            .collect();
        let of = |sign: i8| -> Option<Integral> {
            let of_sign: Vec<_> = cycles
                .iter()
                .filter(|c| c.sign == sign && c.axis == cycles[0].axis && is_same_position(&c.position, &cycles[0].position))
                .collect();
            let sum = of_sign.iter().map(|c| c.integral.sum_rad_s).sum::<f64>() / of_sign.len() as f64;
            of_sign.first().map(|c| Integral { sum_rad_s: sum, ..c.integral })
        };
        Some(reference_rad_s(&of(1)?, &of(-1)?))
    }
}

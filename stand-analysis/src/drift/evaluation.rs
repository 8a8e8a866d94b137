//! Evaluation of many cycles: own drift, apparent drift and azimuth with uncertainties, corrected and uncorrected.

use super::cycle::{Cycle, CycleDefect, is_same_position};
use super::disturbed_cycles::disturbed;
use super::error::DriftError;
use super::error_budget::{AxisBudget, DriftQuantity, ErrorSource, Levers, MIN_AZIMUTH_SINE};
use super::inequality::MIN_AMPLITUDE_RATIO;
use super::integral::{Integral, reference_rad_s};
use super::latitude::EarthRate;
use super::measurement::{AzimuthLimit, DriftWarning, Measurement, Movement, SeparatedDrift};
use super::positions::{PositionFit, PositionModel};
use super::separation::{self, PlatformDrift};
use super::session_fit::{FitRow, LOG10_SIGNIFICANCE, SessionFit};
use hal_sim::gyro::Orientation;
use identification::deadline::Deadline;
use identification::statistics::uncertainty::{Estimate, Uncertainty};
use std::f64::consts::PI;

/// Result of a drift measurement.
#[derive(Debug, Clone)]
pub struct DriftResult {
    /// The input.
    pub measurement: Measurement,
    /// With all corrections.
    pub corrected: SeparatedDrift,
    /// By formulas (13) to (16) only; without uncertainties.
    pub uncorrected: SeparatedDrift,
    /// K_m i/H by the unswitched sums, rad/s, where both polarities were used.
    pub reference_rad_s: Option<f64>,
    /// Uncertainty budget of each axis.
    pub budgets: Vec<AxisBudget>,
    /// What the user should know about the result.
    pub warnings: Vec<DriftWarning>,
}

/// Separated drifts with the fits that they follow from.
struct Separation {
    drift: SeparatedDrift,
    fits: Vec<SessionFit>,
    levers: Vec<Levers>,
}

type Rate<'a> = &'a dyn Fn(&Cycle) -> f64;

impl Measurement {
    /// Evaluates the measurement.
    ///
    /// # Errors
    /// No valid cycle, one position only, positions that do not separate the parameters, a latitude that the measured Earth rate
    /// contradicts.
    pub fn evaluate(self) -> Result<DriftResult, DriftError> {
        self.evaluate_until(Deadline::NEVER)
    }

    /// As [`Measurement::evaluate`], ended by a deadline between the fits.
    ///
    /// # Errors
    /// As [`Measurement::evaluate`]; [`DriftError::Interrupted`] after the deadline.
    pub fn evaluate_until(mut self, deadline: Deadline) -> Result<DriftResult, DriftError> {
        let check = || if deadline.has_passed() { Err(DriftError::Interrupted) } else { Ok(()) };
        check()?;
        if self.valid_cycles().is_empty() {
            let defect = self.cycles.first().and_then(|cycle| cycle.defect.clone());
            return Err(DriftError::NoValidCycle { log: self.name, count: self.cycles.len(), defect });
        }
        let earth = self.latitude_deg.map(|latitude| EarthRate::at(latitude, self.uncertainties.latitude_error_rad)).transpose()?;
        self.leave_out_disturbed();
        check()?;
        let raw: Rate<'_> = &|cycle| cycle.integral.drift_rad_s();
        let (corrected, uncorrected) = if self.has_three_axes {
            let earth = earth.ok_or_else(|| DriftError::Note { log: self.name.clone(), note: "latitude_deg" })?;
            (self.separate_three(&earth, &Cycle::rate_rad_s, true)?, check().and_then(|()| self.separate_three(&earth, raw, false))?)
        } else {
            (
                self.separate_single(earth.as_ref(), &Cycle::rate_rad_s, true)?,
                check().and_then(|()| self.separate_single(earth.as_ref(), raw, false))?,
            )
        };
        let Separation { drift: mut corrected, fits, levers } = corrected;
        let budgets: Vec<AxisBudget> =
            levers.iter().enumerate().map(|(axis, levers)| self.budget(axis, &fits, &corrected, levers)).collect();
        let combined = |quantity: &Option<DriftQuantity>| quantity.as_ref().and_then(|quantity| quantity.estimate().uncertainty);
        for (axis, budget) in budgets.iter().enumerate() {
            corrected.own_rad_s[axis].uncertainty = combined(&budget.own);
            corrected.apparent_rad_s[axis].uncertainty = combined(&budget.apparent);
        }
        self.check_latitude(earth.as_ref(), &corrected, &fits)?;
        let cosine_only = corrected.position_fit.as_ref().is_some_and(|fit| fit.sine.is_none());
        if let Some(azimuth) = &mut corrected.azimuth_rad {
            azimuth.uncertainty = combined(&budgets[0].azimuth);
            if let (true, Some(earth)) = (cosine_only, &earth) {
                let turn_rad = self.uncertainties.turn_error_rad / 2.0;
                let cosine = -corrected.apparent_rad_s[0].value / earth.horizontal_rad_s;
                azimuth.uncertainty = azimuth.uncertainty.map(|linear| of_cosine(azimuth.value, cosine, turn_rad, linear));
            }
        }
        if let (None, Some(earth)) = (&corrected.azimuth_rad, earth.as_ref().filter(|earth| !earth.is_pole())) {
            let known = |uncertainty: Uncertainty| uncertainty.with_known(earth.u_horizontal_rad_s);
            let apparent = corrected.apparent_rad_s[0];
            let apparent = Estimate { uncertainty: apparent.uncertainty.map(known), ..apparent };
            corrected.azimuth_limit = AzimuthLimit::of(apparent, earth.horizontal_rad_s);
        }
        let warnings = self.result_warnings(earth.as_ref(), &corrected);
        let reference_rad_s = self.reference_rad_s();
        Ok(DriftResult { measurement: self, corrected, uncorrected: uncorrected.drift, reference_rad_s, budgets, warnings })
    }

    /// The valid cycles of an axis by time.
    fn cycles_of(&self, axis: usize) -> Vec<&Cycle> {
        let mut cycles: Vec<&Cycle> = self.valid_cycles().into_iter().filter(|cycle| cycle.axis == axis).collect();
        cycles.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
        cycles
    }

    /// Marks the cycles whose rates the others refute.
    fn leave_out_disturbed(&mut self) {
        let mut found: Vec<(u32, usize, f64)> = Vec::new();
        for axis in 0..if self.has_three_axes { 3 } else { 1 } {
            let positions = self.positions();
            let indicator = |position: &Orientation| {
                let known = positions.iter().map(|other| f64::from(u8::from(is_same_position(position, other))));
                (known.collect(), 0.0)
            };
            let numbers: Vec<u32> = self.cycles_of(axis).iter().map(|cycle| cycle.number).collect();
            let rows = self.rows(axis, &Cycle::rate_rad_s, true, &indicator);
            found.extend(disturbed(&rows).into_iter().map(|(row, deviation)| (numbers[row], axis, deviation)));
        }
        for (number, axis, deviation_rad_s) in found {
            if let Some(cycle) = self.cycles.iter_mut().find(|cycle| cycle.number == number && cycle.axis == axis) {
                cycle.defect = Some(CycleDefect::Disturbed { deviation_rad_s });
            }
        }
    }

    /// The rows of an axis. `offset` is added to the rate of a cycle in a position.
    fn rows(&self, axis: usize, rate: Rate<'_>, is_corrected: bool, regressors: &dyn Fn(&Orientation) -> (Vec<f64>, f64)) -> Vec<FitRow> {
        let cycles = self.cycles_of(axis);
        let mut visit = 0;
        let mut rows: Vec<FitRow> = Vec::with_capacity(cycles.len());
        for (k, cycle) in cycles.iter().enumerate() {
            visit += usize::from(k > 0 && !is_same_position(&cycles[k - 1].position, &cycle.position));
            let (regressors, offset) = regressors(&cycle.position);
            rows.push(FitRow {
                time_s: cycle.start_s + cycle.integral.pulse_s,
                reading: rate(cycle) + offset,
                sign: cycle.sign,
                // Equal amplitudes: no correction of unequal pulses.
                amplitude_rad_s: if is_corrected { mean_amplitude_rad_s(&cycles, cycle.amplitude_rad_s) } else { 1.0 },
                regressors,
                visit,
                weight: 1.0,
            });
        }
        rows
    }

    /// Separation for one axis; `is_corrected` applies the correction by two amplitudes.
    fn separate_single(&self, earth: Option<&EarthRate>, rate: Rate<'_>, is_corrected: bool) -> Result<Separation, DriftError> {
        let positions = self.positions();
        if earth.is_none() && positions.iter().any(|position| position.raised_rad.sin().abs() > 1e-9) {
            return Err(DriftError::RaisedWithoutLatitude);
        }
        let model = PositionModel::new(&positions)?;
        let vertical = earth.map_or(0.0, |earth| earth.vertical_rad_s);
        let rows = self.rows(0, rate, is_corrected, &|position| (model.regressors(position), vertical * position.raised_rad.sin()));
        let fit = SessionFit::new(&rows).ok_or_else(|| model.not_separable(positions.len()))?;
        let sine = model.sine();
        let position_fit = PositionFit {
            own: fit.estimate(&model.own()),
            g_dependent: model.g_dependent().map(|parameter| parameter.map(|combination| fit.estimate(&combination))),
            cosine: fit.estimate(&model.cosine()),
            sine: sine.as_ref().map(|combination| fit.estimate(combination)),
        };
        let c = position_fit.cosine.value;
        let add = |a: &[f64], x: f64, b: &[f64], y: f64| a.iter().zip(b).map(|(a, b)| x * a + y * b).collect::<Vec<f64>>();
        let none = Estimate { value: 0.0, uncertainty: None };
        let (azimuth_rad, of_azimuth) = match (&sine, position_fit.sine, earth) {
            (_, _, Some(earth)) if earth.is_pole() => (None, Vec::new()),
            (Some(sine), Some(s), _) => {
                let square = c * c + s.value * s.value;
                let gradient = add(sine, c / square, &model.cosine(), -s.value / square);
                (Some(Estimate { value: s.value.atan2(c), ..none }), vec![(0, gradient)])
            }
            (_, _, Some(earth)) => {
                let horizontal = earth.horizontal_rad_s;
                let azimuth = separation::azimuth_rad(-c, horizontal);
                let slope = |azimuth: f64| 1.0 / (horizontal * azimuth.sin().abs().max(MIN_AZIMUTH_SINE));
                let gradient = azimuth.map(|a| model.cosine().iter().map(|x| -x * slope(a)).collect::<Vec<f64>>());
                (azimuth.map(|value| Estimate { value, ..none }), gradient.map(|gradient| (0, gradient)).into_iter().collect())
            }
            _ => (None, Vec::new()),
        };
        let apparent = Estimate { value: -c, ..none };
        let drift = SeparatedDrift {
            own_rad_s: vec![Estimate { value: position_fit.own.value, ..none }],
            apparent_rad_s: vec![apparent],
            azimuth_rad,
            azimuth_limit: None,
            position_fit: Some(position_fit),
            inequality: inequality(&[&fit], self),
            movement: vec![movement(&fit)],
        };
        let setup = self.single_axis_setup(earth, &drift, sine.is_some());
        let minus = model.cosine().iter().map(|x| -x).collect();
        let levers = Levers { own: model.own(), apparent: vec![(0, minus)], azimuth: of_azimuth, setup };
        Ok(Separation { drift, fits: vec![fit], levers: vec![levers] })
    }

    /// Separation for three axes.
    fn separate_three(&self, earth: &EarthRate, rate: Rate<'_>, is_corrected: bool) -> Result<Separation, DriftError> {
        let (horizontal, vertical) = (earth.horizontal_rad_s, earth.vertical_rad_s);
        let positions = self.positions();
        let first = match positions.as_slice() {
            [first] => {
                let [turned_deg, raised_deg, rolled_deg] = [first.turned_rad, first.raised_rad, first.rolled_rad].map(f64::to_degrees);
                return Err(DriftError::OnePosition { turned_deg, raised_deg, rolled_deg });
            }
            [first, turned] if ((turned.turned_rad - first.turned_rad).cos() + 1.0).abs() < 1e-3 => first,
            _ => return Err(DriftError::ThreeAxisPositions),
        };
        let indicator = |position: &Orientation| {
            let is_first = is_same_position(position, first);
            (vec![f64::from(u8::from(is_first)), f64::from(u8::from(!is_first))], 0.0)
        };
        let mut fits = Vec::new();
        let mut rates = [[0.0; 3]; 2];
        for axis in 0..3 {
            let rows = self.rows(axis, rate, is_corrected, &indicator);
            let missing = || DriftError::AxisMissing { log: self.name.clone(), axis: ["x", "y", "z"][axis] };
            let fit = SessionFit::new(&rows).ok_or_else(missing)?;
            rates[0][axis] = fit.estimate(&[1.0, 0.0]).value;
            rates[1][axis] = fit.estimate(&[0.0, 1.0]).value;
            fits.push(fit);
        }
        let pulse_s = self.valid_cycles()[0].integral.pulse_s;
        let PlatformDrift { own_rad_s, azimuth_rad } =
            if is_corrected { separation::three(&rates, vertical, pulse_s) } else { separation::three_uncorrected(&rates, vertical) };
        let (sin, cos) = azimuth_rad.sin_cos();
        let apparent = [-horizontal * cos, -vertical, horizontal * sin];
        let value = |value: f64| Estimate { value, uncertainty: None };
        // dA = (−sin A dC + cos A dS)/ω_h, with C by half the difference of x and S by that of z.
        let half = |factor: f64| vec![0.5 * factor, -0.5 * factor];
        let of_azimuth = |lever: f64| vec![(0, half(sin / horizontal * lever)), (2, half(cos / horizontal * lever))];
        let inequality = inequality(&fits.iter().collect::<Vec<_>>(), self);
        let drift = SeparatedDrift {
            own_rad_s: own_rad_s.map(value).to_vec(),
            apparent_rad_s: apparent.map(value).to_vec(),
            azimuth_rad: (!earth.is_pole()).then(|| value(azimuth_rad - first.turned_rad)),
            azimuth_limit: None,
            position_fit: None,
            inequality,
            movement: fits.iter().map(movement).collect(),
        };
        // The apparent drift follows from azimuth and latitude; about the vertical, from the latitude only.
        let lever = [horizontal * sin.abs(), 0.0, horizontal * cos.abs()];
        let levers = (0..3).map(|axis| Levers {
            own: vec![0.5, 0.5],
            apparent: if axis == 1 { Vec::new() } else { of_azimuth(lever[axis]) },
            azimuth: if earth.is_pole() { Vec::new() } else { of_azimuth(1.0) },
            setup: self.three_axis_setup(axis, earth, &drift),
        });
        let levers = levers.collect();
        Ok(Separation { drift, fits, levers })
    }

    /// Compares the measured horizontal Earth rate with the latitude.
    fn check_latitude(&self, earth: Option<&EarthRate>, found: &SeparatedDrift, fits: &[SessionFit]) -> Result<(), DriftError> {
        let Some(earth) = earth else { return Ok(()) };
        // Level and gain act on each component; the apparent drift has them in its budget.
        let systematic = |value: f64| {
            let level = earth.vertical_rad_s.abs() * self.uncertainties.level_error_rad;
            level.hypot(value * self.uncertainties.gain_error)
        };
        let with_setup = |estimate: Estimate| Estimate {
            uncertainty: estimate.uncertainty.map(|u| u.with_known(systematic(estimate.value))),
            ..estimate
        };
        match (&found.position_fit, fits) {
            (Some(PositionFit { cosine, sine: Some(sine), .. }), [fit]) => {
                let model = PositionModel::new(&self.positions())?;
                let (c, s) = (cosine.value, sine.value);
                let horizontal = c.hypot(s);
                let (of_c, of_s) = (model.cosine(), model.sine().unwrap_or_default());
                let along: Vec<f64> = of_c.iter().zip(&of_s).map(|(x, y)| (c * x + s * y) / horizontal).collect();
                earth.agrees_with(with_setup(Estimate { value: horizontal, ..fit.estimate(&along) }))
            }
            (Some(_), _) => earth.is_at_least(found.apparent_rad_s[0]),
            (None, [x, _, z]) => {
                let half = [x, z].map(|fit| fit.estimate(&[0.5, -0.5]));
                let [c, s] = half.map(|estimate| estimate.value);
                let horizontal = c.hypot(s);
                let uncertainty = half[0].uncertainty.zip(half[1].uncertainty).map(|(of_c, of_s)| {
                    let u = (c * of_c.u).hypot(s * of_s.u) / horizontal;
                    Uncertainty::student(u, of_c.dof.min(of_s.dof))
                });
                // The rotation of the platform within a cycle changes the components by ω_y T, which the azimuth is corrected for.
                let within_cycle = earth.vertical_rad_s.abs() * self.valid_cycles()[0].integral.pulse_s * horizontal;
                let measured = with_setup(Estimate { value: horizontal, uncertainty });
                earth.agrees_with(Estimate { uncertainty: measured.uncertainty.map(|u| u.with_known(within_cycle)), ..measured })
            }
            _ => Ok(()),
        }
    }

    /// Remarks on the result.
    fn result_warnings(&self, earth: Option<&EarthRate>, found: &SeparatedDrift) -> Vec<DriftWarning> {
        let mut warnings = self.warnings.clone();
        if earth.is_some_and(EarthRate::is_pole) {
            warnings.push(DriftWarning::Pole);
        }
        for (axis, movement) in found.movement.iter().enumerate() {
            let axis = self.has_three_axes.then_some(axis);
            warnings.extend(movement.trend.filter(|_| movement.has_trend).map(|rad_s2| DriftWarning::Trend { axis, rad_s2 }));
            warnings.extend(movement.walk_rad_s_sqrt_s.map(|walk_rad_s_sqrt_s| DriftWarning::Walk { axis, walk_rad_s_sqrt_s }));
            let visits = movement.visit_sigma_rad_s.filter(|_| movement.log10_p_visits.is_some_and(|p| p < LOG10_SIGNIFICANCE));
            warnings.extend(visits.map(|sigma_rad_s| DriftWarning::Visits { axis, sigma_rad_s }));
        }
        let contrasts = found.movement.iter().map(|movement| movement.free_visits).min().unwrap_or(0);
        if contrasts < 2 {
            warnings.push(DriftWarning::FewVisits { contrasts });
        }
        if found.inequality.is_empty() {
            warnings.push(DriftWarning::OneAmplitude { asymmetry_bound: self.uncertainties.torquer_asymmetry });
        }
        let exact = self.uncertainties.taken_as_exact();
        if !exact.is_empty() {
            warnings.push(DriftWarning::TakenAsExact(exact));
        }
        warnings
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

/// Mean amplitude of the cycles whose amplitude is about this one: the noise of a single cycle's amplitude is none of its pulses.
fn mean_amplitude_rad_s(cycles: &[&Cycle], about_rad_s: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for cycle in cycles.iter().filter(|cycle| (cycle.amplitude_rad_s / about_rad_s - 1.0).abs() < 0.5 * (MIN_AMPLITUDE_RATIO - 1.0)) {
        sum += cycle.amplitude_rad_s;
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { about_rad_s }
}

/// Inequality of the pulses for each axis; for all axes, or for none: relative excess ε of a negative pulse. Relative to the mean of both
/// pulses the even part is −q = −ε/(2 + ε).
fn inequality(fits: &[&SessionFit], measurement: &Measurement) -> Vec<Estimate> {
    let amplitude = |axis: usize| {
        let cycles: Vec<_> = measurement.valid_cycles().into_iter().filter(|cycle| cycle.axis == axis).collect();
        cycles.iter().map(|cycle| cycle.amplitude_rad_s).sum::<f64>() / cycles.len().max(1) as f64
    };
    let found: Vec<Estimate> =
        fits.iter().enumerate().map_while(|(axis, fit)| fit.even().map(|even| excess(even.scaled(-1.0 / amplitude(axis))))).collect();
    if found.len() == fits.len() { found } else { Vec::new() }
}

/// ε = 2 q/(1 − q).
fn excess(q: Estimate) -> Estimate {
    let free = 1.0 - q.value;
    Estimate { value: 2.0 * q.value / free, uncertainty: q.uncertainty.map(|uncertainty| uncertainty.scaled(2.0 / (free * free))) }
}

fn movement(fit: &SessionFit) -> Movement {
    Movement {
        trend: fit.trend(),
        has_trend: fit.has_trend(),
        walk_rad_s_sqrt_s: fit.walk_rad_s_sqrt_s(),
        log10_p_visits: fit.visits().map(|visits| visits.log10_p),
        visit_sigma_rad_s: fit.visits().map(|visits| visits.sigma_rad_s),
        free_visits: fit.free_visits(),
    }
}

/// Uncertainty of an azimuth that follows from its cosine, and of the turn: near 0° and 180° the linear part does not describe the interval
/// of the cosine. `linear` is that of the budget: the uncertainty of the cosine over the sine, and that of the turn.
fn of_cosine(azimuth_rad: f64, cosine: f64, turn_rad: f64, linear: Uncertainty) -> Uncertainty {
    let of_cosine = linear.k * (linear.u * linear.u - turn_rad * turn_rad).max(0.0).sqrt() * azimuth_rad.sin().abs().max(MIN_AZIMUTH_SINE);
    let reach = |cosine: f64| (cosine.clamp(-1.0, 1.0).acos() - azimuth_rad).abs();
    let farthest = reach(cosine + of_cosine).max(reach(cosine - of_cosine)).hypot(linear.k * turn_rad).min(PI);
    // The linear part divides by the sine, which vanishes.
    let u = linear.u.min(farthest);
    if u > 0.0 { Uncertainty { u, k: farthest / u, ..linear } } else { linear }
}

/// The sources of a budget, in their order.
pub fn sources(budget: &AxisBudget) -> Vec<ErrorSource> {
    let quantities = || [&budget.own, &budget.apparent, &budget.azimuth].into_iter().flatten();
    let has = |source: &ErrorSource| quantities().any(|quantity| quantity.contributions.iter().any(|line| line.basis == *source));
    ErrorSource::ALL.into_iter().filter(has).collect()
}

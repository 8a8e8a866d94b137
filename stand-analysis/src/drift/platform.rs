//! The pulse method with a rate gyro on the turning platform (docs/theory.md §3): the platform turns at +w for T and at −w for T, and the
//! integral of the rate gyro is switched.
//!
//! bias = −I/T² and scale = (S/T² − 2 bias)/w for pulses without ramps. Ramps of a real platform are corrected by the rate of its encoder,
//! weighted as the current of a torquer: ∫ W Ω du and ∫∫ Ω. A *cycle* extends by T to both sides of a reversal; reversals alternate in
//! sign. A lag of the gyro adds ± 2 s w lag/T to the bias of a cycle, with the sign of its first pulse: cycles of both signs are averaged
//! by [`SessionFit`], which also gives the lag, and accounts for a bias that moves. Adjacent cycles share a pulse: for white noise their
//! correlation is ¼, which increases the standard uncertainty by √1.5.
//!
//! The bias is the zero of the line through both rates ± w. An asymmetry of the scale changes it by half of the asymmetry times w;
//! amplitudes that differ by a fifth separate it. Without a latitude the bias contains the Earth rate along the axis.

use super::cycle::CycleDefect;
use super::error::{DriftError, NoCycleReason, within};
use super::integral::{Integral, residual_rad_s};
use super::session_fit::{FitRow, SessionFit};
use hal_sim::gyro::earth::EARTH_RAD_S;
use identification::log::Log;
use identification::statistics::robust::{median, quantile};
use identification::statistics::uncertainty::{Contribution, Estimate, Quantity, Uncertainty, rectangular_u};
use stand_acquire::calibration_session::Assumptions;
use std::ops::Range;

/// Time over which the encoder's angle is differenced to find the reversals, s.
const SLOPE_S: f64 = 0.05;
/// Rate, relative to that of the pulses, beyond which the platform turns.
const MIN_RELATIVE_RATE: f64 = 0.5;
/// Shortest pulse beside a reversal, relative to T.
const MIN_PULSE_RATIO: f64 = 0.9;
/// Increase of the standard uncertainty by the correlation of ¼ between adjacent cycles: √(1 + 2/4).
const OVERLAP_FACTOR: f64 = 1.224_744_871_391_589;
/// Fewest rows at rest that show whether the gyro has noise.
const MIN_ROWS_AT_REST: usize = 20;
/// Part of a pulse's rows at the extreme reading from which the gyro counts as clipped.
const MAX_EXTREME_ROWS: f64 = 0.3;

/// Source of an uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlatformSource {
    /// Scatter of the cycles.
    Cycles,
    /// Frequency of the crystal, half-width in ppm of the assumptions.
    Crystal,
    /// Angle between the gyro's axis and that of the platform.
    Misalignment,
    /// The Earth rate along the axis, because no latitude is given.
    EarthRate,
}

/// One cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformCycle {
    /// Begin, s.
    pub start_s: f64,
    /// Sign of the first rotation.
    pub sign: i8,
    /// Rate of the platform: half the difference of its means in both pulses, rad/s.
    pub rate_rad_s: f64,
    /// Bias with the effect of the gyro's lag, rad/s.
    pub bias_rad_s: f64,
    /// Scale.
    pub scale: f64,
    /// Bias, rad/s, and scale by −I/T² and (S/T² − 2 bias)/w, without the correction of the ramps.
    pub uncorrected: [f64; 2],
    /// Why the cycle is not used.
    pub defect: Option<CycleDefect>,
    /// −I/T² and S/T² of the gyro; ∫ W Ω du and S/T² of the platform, rad/s.
    parts: [f64; 4],
}

impl PlatformCycle {
    /// The cycle with a scale and a bias of all cycles: the lag of the gyro acts on −I/T², and so on the scale of a single cycle.
    fn with(mut self, bias_rad_s: f64, scale: f64) -> Self {
        let [drift, sum, residual, platform] = self.parts;
        self.bias_rad_s = drift - scale * residual;
        self.scale = (sum - 2.0 * bias_rad_s) / platform;
        self
    }
}

/// Bias and scale over all cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformResult {
    /// Duration T of a pulse, s.
    pub pulse_s: f64,
    /// The cycles.
    pub cycles: Vec<PlatformCycle>,
    /// Bias, rad/s.
    pub bias_rad_s: Estimate,
    /// Scale.
    pub scale: Estimate,
    /// Lag of the gyro, s; `None` without cycles of both signs.
    pub lag_s: Option<Estimate>,
    /// Budgets of bias and scale; `None` without enough cycles.
    pub budgets: Option<[Quantity<PlatformSource, ()>; 2]>,
    /// The Earth rate was subtracted.
    pub without_earth_rate: bool,
    /// The reading at rest is constant: constant readings in the pulses do not show that the gyro is clipped.
    pub is_quiet: bool,
}

/// Options of the evaluation.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlatformSettings {
    /// Duration of a pulse, s; by default the median time between reversals.
    pub pulse_s: Option<f64>,
    /// Latitude, degrees; by default the Earth rate stays in the bias.
    pub latitude_deg: Option<f64>,
}

/// Evaluates a cycle: 2 N + 1 rates of the gyro, rad/s, and angles of the platform, rad; rates are interpolated linearly. `None` for other
/// lengths.
pub fn cycle(start_s: f64, gyro_rad_s: &[f64], theta_rad: &[f64], pulse_s: f64) -> Option<PlatformCycle> {
    let n = gyro_rad_s.len().checked_sub(1)? / 2;
    let dt_s = pulse_s / n as f64;
    let mut angle = 0.0;
    let angles: Vec<f64> = std::iter::once(0.0)
        .chain(gyro_rad_s.windows(2).map(|w| {
            angle += (w[0] + w[1]) / 2.0 * dt_s;
            angle
        }))
        .collect();
    let of_gyro = Integral::of(&angles, pulse_s)?;
    let turned: Vec<f64> = theta_rad.iter().map(|theta| theta - theta_rad[0]).collect();
    let of_platform = Integral::of(&turned, pulse_s)?;
    // θ_gyro = s θ + b t: −I/T² = b + s r with r = ∫ W Ω du; S/T² = 2 b + s S_p/T².
    let residual = residual_rad_s(&theta_rad.windows(2).map(|w| (w[1] - w[0]) / dt_s).collect::<Vec<_>>());
    let (drift, sum, platform) =
        (of_gyro.drift_rad_s(), of_gyro.sum_rad_s / (pulse_s * pulse_s), of_platform.sum_rad_s / (pulse_s * pulse_s));
    let scale = (sum - 2.0 * drift) / (platform - 2.0 * residual);
    let uncorrected_scale = (sum - 2.0 * drift) / platform;
    let swing_rad_s = (2.0 * turned[n] - turned[0] - turned[2 * n]) / (2.0 * pulse_s);
    scale.is_finite().then_some(PlatformCycle {
        start_s,
        sign: if swing_rad_s < 0.0 { -1 } else { 1 },
        rate_rad_s: swing_rad_s.abs(),
        bias_rad_s: drift - scale * residual,
        scale,
        uncorrected: [drift, uncorrected_scale],
        defect: None,
        parts: [drift, sum, residual, platform],
    })
}

/// Evaluates all cycles of a log with `theta_rad` and `gyro_rad_s`.
///
/// # Errors
/// A column is missing; the log has no cycle, or no valid one.
pub fn of_log(log: &Log, settings: PlatformSettings) -> Result<PlatformResult, DriftError> {
    let name = || log.path().display().to_string();
    if let Some(pulse_s) = settings.pulse_s {
        within("pulse_s", pulse_s, 1e-3, 1e5)?;
    }
    let earth_rad_s = settings.latitude_deg.map(|latitude| within("latitude_deg", latitude, -90.0, 90.0)).transpose()?;
    let earth_rad_s = earth_rad_s.map(|latitude| EARTH_RAD_S * latitude.to_radians().sin());
    let column = |column: &'static str| log.column(column).ok_or_else(|| DriftError::PlatformColumn { log: name(), column });
    let (gyro, theta) = (column("gyro_rad_s")?, column("theta_rad")?);
    let dt_s = log.median_dt_s();
    let none = |pulse_s: f64, reason| DriftError::NoCycle { log: name(), pulse_s, reason: Some(reason) };
    if dt_s <= 0.0 || theta.len() < 3 {
        return Err(none(settings.pulse_s.unwrap_or(0.0), NoCycleReason::OneRow));
    }
    let stretches: Vec<(Range<usize>, Vec<usize>)> = log
        .segments()
        .into_iter()
        .map(|rows| (rows.clone(), reversals(&theta[rows.clone()], dt_s).iter().map(|k| rows.start + k).collect()))
        .collect();
    let times = stretches.iter().flat_map(|(_, ends)| ends.windows(2).map(|w| (w[1] - w[0]) as f64 * dt_s));
    let pulse_s = settings.pulse_s.or_else(|| median(times)).unwrap_or(0.0);
    let samples = (pulse_s / dt_s).round() as usize;
    if samples == 0 {
        return Err(none(pulse_s, NoCycleReason::NoPlatformPulses));
    }
    let pulse_s = samples as f64 * dt_s;
    let shortest = (MIN_PULSE_RATIO * samples as f64) as usize;
    let is_quiet = is_quiet(gyro, &stretches, (SLOPE_S / dt_s).ceil() as usize);
    let mut cycles = Vec::new();
    for (rows, ends) in &stretches {
        for three in ends.windows(3) {
            let middle = three[1];
            let is_between_pulses = middle - three[0] >= shortest && three[2] - middle >= shortest;
            if !is_between_pulses || middle < rows.start + samples || middle + samples >= rows.end {
                continue;
            }
            let window = middle - samples..middle + samples + 1;
            let Some(found) = cycle(log.t_s()[window.start], &gyro[window.clone()], &theta[window.clone()], pulse_s) else { continue };
            let defect = (!is_quiet && is_clipped(&gyro[window], samples)).then_some(CycleDefect::FlatTop);
            cycles.push(PlatformCycle { defect, ..found });
        }
    }
    if cycles.is_empty() {
        return Err(none(pulse_s, NoCycleReason::NoPlatformPulses));
    }
    if cycles.iter().all(|cycle| cycle.defect.is_some()) {
        return Err(DriftError::NoValidCycle { log: name(), count: cycles.len(), defect: cycles[0].defect.clone() });
    }
    Ok(PlatformResult { is_quiet, ..evaluated(cycles, pulse_s, earth_rad_s) })
}

/// Rows at which the platform begins to turn, reverses, and ends to turn.
fn reversals(theta_rad: &[f64], dt_s: f64) -> Vec<usize> {
    let half = ((0.5 * SLOPE_S / dt_s).round() as usize).max(1);
    if theta_rad.len() < 4 * half {
        return Vec::new();
    }
    let rate = |k: usize| {
        let (from, to) = (k.saturating_sub(half), (k + half).min(theta_rad.len() - 1));
        (theta_rad[to] - theta_rad[from]) / ((to - from) as f64 * dt_s)
    };
    let rates: Vec<f64> = (0..theta_rad.len()).map(rate).collect();
    let size = quantile(rates.iter().map(|rate| rate.abs()), 0.75).unwrap_or(0.0);
    let threshold = MIN_RELATIVE_RATE * size;
    if !(threshold > 0.0 && threshold.is_finite()) {
        return Vec::new();
    }
    let mut ends = Vec::new();
    // Direction of the last rotation, and the last row at which the platform turned so.
    let mut last: Option<(f64, usize)> = None;
    for (k, rate) in rates.iter().enumerate().filter(|(_, rate)| rate.abs() > threshold) {
        match last {
            None => ends.push(k),
            Some((direction, row)) if direction != rate.signum() => {
                // The rate passes zero between both rows.
                ends.push((row..k).min_by(|a, b| rates[*a].abs().total_cmp(&rates[*b].abs())).unwrap_or(k));
            }
            _ => {}
        }
        last = Some((rate.signum(), k));
    }
    ends.extend(last.map(|(_, row)| row));
    ends
}

/// The readings before the platform turns and after it are equal: their noise is below the resolution of the gyro.
fn is_quiet(gyro_rad_s: &[f64], stretches: &[(Range<usize>, Vec<usize>)], margin: usize) -> bool {
    let mut at_rest: Vec<f64> = Vec::new();
    for (rows, ends) in stretches {
        if let (Some(first), Some(last)) = (ends.first(), ends.last()) {
            at_rest.extend(&gyro_rad_s[rows.start..first.saturating_sub(margin).max(rows.start)]);
            at_rest.extend(&gyro_rad_s[(last + margin).min(rows.end)..rows.end]);
        }
    }
    at_rest.sort_by(f64::total_cmp);
    let most = at_rest.chunk_by(|a, b| a == b).map(<[f64]>::len).max().unwrap_or(0);
    at_rest.len() >= MIN_ROWS_AT_REST && most as f64 > MAX_EXTREME_ROWS * at_rest.len() as f64
}

/// Many readings of one pulse are equal to its extreme: the gyro is at the end of its range.
fn is_clipped(gyro_rad_s: &[f64], samples: usize) -> bool {
    [&gyro_rad_s[..samples], &gyro_rad_s[samples..]].into_iter().any(|pulse| {
        let extreme = pulse.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
        pulse.iter().filter(|rate| **rate == extreme).count() as f64 > MAX_EXTREME_ROWS * pulse.len() as f64
    })
}

/// Repetitions that make bias and scale consistent; each reduces the error by the lag over T.
const ITERATIONS: usize = 4;

/// Bias, scale and lag of the valid cycles; without the contributions of type B.
fn fitted(cycles: &[PlatformCycle], pulse_s: f64) -> (Estimate, Estimate, Option<Estimate>) {
    let valid: Vec<&PlatformCycle> = cycles.iter().filter(|cycle| cycle.defect.is_none()).collect();
    let fit = |of: &dyn Fn(&PlatformCycle) -> f64| {
        let row = |cycle: &&PlatformCycle| FitRow {
            time_s: cycle.start_s + pulse_s,
            reading: of(cycle),
            sign: cycle.sign,
            amplitude_rad_s: cycle.rate_rad_s,
            regressors: vec![1.0],
            visit: 0,
            weight: 1.0,
        };
        SessionFit::new(&valid.iter().map(row).collect::<Vec<_>>())
    };
    let none = Estimate { value: f64::NAN, uncertainty: None };
    // Of three pulses in a row, one belongs to two cycles.
    let overlapping = |estimate: Estimate| Estimate {
        uncertainty: estimate.uncertainty.map(|u| Uncertainty::student(OVERLAP_FACTOR * u.u, (u.dof / OVERLAP_FACTOR.powi(2)).max(1.0))),
        ..estimate
    };
    let (bias_fit, scale_fit) = (fit(&|cycle| cycle.bias_rad_s), fit(&|cycle| cycle.scale));
    let of = |fit: &Option<SessionFit>| fit.as_ref().map_or(none, |fit| overlapping(fit.estimate(&[1.0])));
    let (bias, scale) = (of(&bias_fit), of(&scale_fit));
    let rate_rad_s = valid.iter().map(|cycle| cycle.rate_rad_s).sum::<f64>() / valid.len().max(1) as f64;
    // odd = 2 s w lag/T.
    let lag = bias_fit.as_ref().and_then(SessionFit::odd);
    (bias, scale, lag.map(|odd| overlapping(odd).scaled(pulse_s / (2.0 * scale.value * rate_rad_s))))
}

fn evaluated(mut cycles: Vec<PlatformCycle>, pulse_s: f64, earth_rad_s: Option<f64>) -> PlatformResult {
    for _ in 0..ITERATIONS {
        let (bias, scale, _) = fitted(&cycles, pulse_s);
        cycles = cycles.into_iter().map(|cycle| cycle.with(bias.value, scale.value)).collect();
    }
    let (bias, scale, lag_s) = fitted(&cycles, pulse_s);
    let assumed = Assumptions::default();
    let bias_value = bias.value - earth_rad_s.map_or(0.0, |earth| earth * scale.value);
    let lines = |uncertainty: Uncertainty| vec![Contribution::type_a("", uncertainty.u, uncertainty.dof, PlatformSource::Cycles)];
    let budgets = bias.uncertainty.zip(scale.uncertainty).map(|(of_bias, of_scale)| {
        let mut bias_lines = lines(of_bias);
        if earth_rad_s.is_none() {
            bias_lines.push(Contribution::rectangular("", EARTH_RAD_S, "", scale.value, PlatformSource::EarthRate));
        }
        let mut scale_lines = lines(of_scale);
        scale_lines.push(Contribution::rectangular("", assumed.crystal_ppm * 1e-6, "", scale.value, PlatformSource::Crystal));
        // The cosine of an angle within the half-width: between 1 and 1 − a²/2.
        let cosine = 0.5 * assumed.misalignment_deg.to_radians().powi(2);
        scale_lines.push(Contribution::type_b("", rectangular_u(cosine), "", scale.value, PlatformSource::Misalignment));
        [Quantity::new("bias_rad_s", "rad/s", bias_value, bias_lines), Quantity::new("scale", "1", scale.value, scale_lines)]
    });
    let total = |k: usize, value: f64| {
        budgets.as_ref().map_or(Estimate { value, uncertainty: None }, |budgets: &[Quantity<PlatformSource, ()>; 2]| budgets[k].estimate())
    };
    PlatformResult {
        pulse_s,
        bias_rad_s: total(0, bias_value),
        scale: total(1, scale.value),
        lag_s,
        without_earth_rate: earth_rad_s.is_some(),
        is_quiet: false,
        cycles,
        budgets,
    }
}

//! The device under test after it is switched on: warm-up time and turn-on repeatability.
//!
//! * *warm-up time*: time since power-on from which the output at rest stays within a stated band about its final level. The longest log at
//!   rest is fitted by b + A exp(−t/τ); the time is τ ln(|A|/band). The final level is the asymptote b, not the end of the log.
//! * *turn-on repeatability*: standard deviation of the mean output at rest from one start of the device to the next. The stand has no
//!   switch for the supply of the device: a start is a re-initialisation (software reset and new set-up by the driver) before each step
//!   with `restart_sensor`.

use super::GyroSettings;
use super::still::{ALLAN_INTERVAL_S, LongestRest, MIN_AVERAGES, is_at_rest};
use crate::allan::deviation::Series;
use crate::calibrate::{AbsenceReason, Basis, Contribution, Findings, Meaning, Quantity, Step};
use identification::statistics::uncertainty::u_of_standard_deviation;
use identification::statistics::{LeastSquares, clustered_least_squares, least_squares};
use stand_acquire::calibration_session::RESTART_NOTE;
use std::f64::consts::SQRT_2;

/// Means that are averaged before the fit of the warm-up.
const MEANS_PER_BLOCK: usize = 5;
/// Clusters of blocks in time, for residuals that are correlated.
const CLUSTERS: usize = 24;
/// Time constants that are tried per factor of two, and iterations of their refinement.
const TRIALS_PER_OCTAVE: f64 = 6.0;
const REFINEMENTS: usize = 40;
/// Shortest time constant, blocks; longest, durations of the log.
const MIN_BLOCKS: f64 = 3.0;
const MAX_DURATIONS: f64 = 1.0;
/// Ratio of A to its standard uncertainty from which there is a warm-up.
const MIN_SIGNIFICANCE: f64 = 5.0;
/// Greatest ratio of the residuals' standard deviation over parts of the log to that of white noise: beyond it the warm-up is not
/// exponential.
const MAX_MISFIT: f64 = 3.0;
/// Fewest starts.
const MIN_STARTS: usize = 4;

/// Adds warm-up time and turn-on repeatability.
pub(super) fn add(steps: &[&Step], settings: &GyroSettings, findings: &mut Findings) {
    match warm_up_time(steps, settings) {
        Ok(time) => findings.quantities.push(time),
        Err(reason) => findings.add_absent("warm_up_time_s", reason),
    }
    match repeatability(steps, settings) {
        Some(deviation) => findings.quantities.push(deviation),
        None => findings.add_absent("turn_on_repeatability_rad_s", AbsenceReason::NeedsRestarts { minimum: MIN_STARTS }),
    }
}

/// b + A exp(−t/τ), fitted to blocks.
struct WarmUp {
    time_constant_s: f64,
    amplitude: f64,
    /// Fit of the changes of b, A and τ at the solution.
    tangent: LeastSquares,
}

impl WarmUp {
    fn fit(t_s: &[f64], y: &[f64], block_s: f64) -> Option<Self> {
        let duration_s = t_s.last()? - t_s.first()?;
        let (shortest_s, longest_s) = (MIN_BLOCKS * block_s, MAX_DURATIONS * duration_s);
        if longest_s.is_nan() || longest_s <= shortest_s {
            return None;
        }
        let of = |time_constant_s: f64| {
            let rows: Vec<Vec<f64>> = t_s.iter().map(|t| vec![1.0, (-t / time_constant_s).exp()]).collect();
            least_squares(&rows, y).map(|fit| (fit.residual_sd, fit.coefficients[1]))
        };
        let count = ((longest_s / shortest_s).log2() * TRIALS_PER_OCTAVE).ceil();
        let trial_s = |k: f64| shortest_s * (longest_s / shortest_s).powf(k / count);
        let scatter = |time_constant_s: f64| of(time_constant_s).map_or(f64::INFINITY, |(scatter, _)| scatter);
        let best = (0..=count as usize).map(|k| k as f64).min_by(|a, b| scatter(trial_s(*a)).total_cmp(&scatter(trial_s(*b))))?;
        // Ternary search between the neighbours.
        let (mut low, mut high) = ((best - 1.0).max(0.0), (best + 1.0).min(count));
        for _ in 0..REFINEMENTS {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if scatter(trial_s(a)) < scatter(trial_s(b)) { high = b } else { low = a }
        }
        let time_constant_s = trial_s(0.5 * (low + high));
        let (_, amplitude) = of(time_constant_s)?;
        let curve: Vec<f64> = t_s.iter().map(|t| amplitude * (-t / time_constant_s).exp()).collect();
        let rows: Vec<Vec<f64>> = t_s
            .iter()
            .zip(&curve)
            .map(|(t, curve)| vec![1.0, curve / amplitude, curve * t / (time_constant_s * time_constant_s)])
            .collect();
        let residuals: Vec<f64> = y.iter().zip(&curve).map(|(y, curve)| y - curve).collect();
        let clusters: Vec<usize> = (0..t_s.len()).map(|k| k * CLUSTERS / t_s.len()).collect();
        let tangent = clustered_least_squares(&rows, &residuals, &vec![1.0; t_s.len()], &clusters)?;
        Some(Self { time_constant_s, amplitude, tangent })
    }

    /// Smallest Allan deviation of the residuals over averaging times up to a quarter of the log, and its averaging time, s.
    fn floor(&self, block_s: f64) -> Option<(f64, f64)> {
        let count = self.tangent.residuals.len();
        let factors: Vec<usize> = (0..).map(|k| 1_usize << k).take_while(|m| m * MIN_AVERAGES <= count).collect();
        let whole = 0..count;
        let variances = Series::of_rates(self.tangent.residuals.clone(), &[whole]).overlapping(&factors);
        let least = variances.into_iter().min_by(|a, b| a.variance.total_cmp(&b.variance))?;
        Some((least.variance.sqrt(), least.factor as f64 * block_s))
    }

    /// Standard deviation of the means of the residuals over the clusters, relative to what their white noise predicts.
    fn misfit(&self) -> f64 {
        let residuals = &self.tangent.residuals;
        let size = residuals.len() / CLUSTERS;
        let white = residuals.windows(2).map(|pair| 0.5 * (pair[1] - pair[0]).powi(2)).sum::<f64>() / (residuals.len() - 1) as f64;
        let means: Vec<f64> = residuals.chunks_exact(size).map(|part| part.iter().sum::<f64>() / size as f64).collect();
        (means.iter().map(|m| m * m).sum::<f64>() / means.len() as f64 / (white / size as f64)).sqrt()
    }
}

fn warm_up_time(steps: &[&Step], settings: &GyroSettings) -> Result<Quantity, AbsenceReason> {
    let band_rad_s = settings.warm_up_band_rad_s.ok_or(AbsenceReason::NeedsWarmUpBand)?;
    let LongestRest { log, size, means } = LongestRest::of(steps, settings).ok_or(AbsenceReason::NeedsRest)?;
    let interval_s = size as f64 * log.median_dt_s();
    let block_s = MEANS_PER_BLOCK as f64 * interval_s;
    let since_power_on_s = log.notes().number("since_power_on_s");
    let begin_s = since_power_on_s.unwrap_or(0.0);
    let y: Vec<f64> = means.chunks_exact(MEANS_PER_BLOCK).map(|block| block.iter().sum::<f64>() / MEANS_PER_BLOCK as f64).collect();
    // From the beginning of the log: with the time since power-on A of a late log would be extrapolated.
    let t_s: Vec<f64> = (0..y.len()).map(|k| (k as f64 + 0.5) * block_s).collect();
    if y.len() < 2 * CLUSTERS {
        return Err(AbsenceReason::NeedsRest);
    }
    let warm_up = WarmUp::fit(&t_s, &y, block_s).ok_or(AbsenceReason::NotDetermined)?;
    let (time_constant_s, amplitude, u_amplitude) = (warm_up.time_constant_s, warm_up.amplitude, warm_up.tangent.sigma(1));
    if amplitude.abs() + 2.0 * u_amplitude <= band_rad_s {
        return Err(AbsenceReason::WithinBandFromTheBeginning { band_rad_s, since_power_on_s: begin_s });
    }
    if amplitude.abs() < (MIN_SIGNIFICANCE * u_amplitude).max(band_rad_s) {
        return Err(AbsenceReason::NotDetermined);
    }
    let ratio = warm_up.misfit();
    if ratio > MAX_MISFIT {
        return Err(AbsenceReason::NotExponential { ratio });
    }
    let logarithm = (amplitude.abs() / band_rad_s).ln();
    let value_s = begin_s + time_constant_s * logarithm;
    let u = warm_up.tangent.sigma_of(&[0.0, time_constant_s / amplitude, logarithm]);
    let noise = Contribution::type_a("noise", u, warm_up.tangent.dof, Basis::WindowScatter { window_s: block_s });
    // The level at that time and the final level are two averages of a wandering output: their difference has √2 times the Allan deviation.
    let (floor_rad_s, averaging_s) = warm_up.floor(block_s).ok_or(AbsenceReason::NotDetermined)?;
    let basis = Basis::AllanFloor { averaging_s };
    let instability = Contribution::type_b("in-run instability", SQRT_2 * floor_rad_s, "rad/s", time_constant_s / band_rad_s, basis);
    let meaning = Meaning::WarmUpTime { band_rad_s, time_constant_s, from_power_on: since_power_on_s.is_some() };
    Ok(Quantity::new("warm_up_time_s", "s", value_s, vec![noise, instability]).meaning(meaning))
}

/// Standard deviation of the mean output at rest over the starts. Its U reaches the upper end of the χ² interval, which is not symmetric.
fn repeatability(steps: &[&Step], settings: &GyroSettings) -> Option<Quantity> {
    let starts = steps.iter().filter(|step| is_at_rest(step) && step.log.note(RESTART_NOTE).is_some());
    let (mut means, mut variances) = (Vec::new(), Vec::new());
    for step in starts {
        let Some(LongestRest { size, means: of_start, log }) = LongestRest::of(&[step], settings) else { continue };
        let settled = ((settings.settle_s / (size as f64 * log.median_dt_s())).ceil() as usize).min(of_start.len() / 2);
        let rest = &of_start[settled..];
        let n = rest.len() as f64;
        means.push(rest.iter().sum::<f64>() / n);
        variances.push(rest.windows(2).map(|pair| 0.5 * (pair[1] - pair[0]).powi(2)).sum::<f64>() / (n - 1.0) / n);
    }
    let count = means.len();
    if count < MIN_STARTS {
        return None;
    }
    let dof = count as f64 - 1.0;
    let mean = means.iter().sum::<f64>() / count as f64;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / dof;
    let value = variance.sqrt();
    let white = variances.iter().sum::<f64>() / count as f64;
    let noise = value - (variance - white).max(0.0).sqrt();
    let contributions = vec![
        Contribution::type_a("number of starts", u_of_standard_deviation(value, dof), dof, Basis::OfStandardDeviation),
        Contribution::rectangular("noise of the means", noise, "rad/s", 1.0, Basis::WindowScatter { window_s: ALLAN_INTERVAL_S }),
    ];
    let quantity = Quantity::new("turn_on_repeatability_rad_s", "rad/s", value, contributions);
    Some(quantity.meaning(Meaning::TurnOnRepeatability { starts: count }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Mounting;
    use hal_sim::peripherals::Noise;
    use identification::log::{Column, Log, Note, Notes};

    fn rest(output: &dyn Fn(f64) -> f64, seconds: f64, seed: u64, notes: Notes) -> Step {
        let mut noise = Noise::new(seed, 0, 2e-3);
        let t_s: Vec<f64> = (0..(seconds * 100.0) as u32).map(|k| f64::from(k) * 0.01).collect();
        let output = t_s.iter().map(|t| output(*t) + noise.draw()).collect();
        let columns = [("theta_rad", vec![0.5; t_s.len()]), ("t_s", t_s), ("gyro_rad_s", output)];
        let columns = columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
        let log = Log::new("rest.csv", columns, notes).unwrap();
        Step { name: "rest".to_owned(), log, mounting: Mounting::default(), added_inertia_kg_m2: None }
    }

    fn settings(band_rad_s: f64) -> GyroSettings {
        GyroSettings { warm_up_band_rad_s: Some(band_rad_s), ..GyroSettings::default() }
    }

    /// A warm-up of 5e-3 rad/s with a time constant of 30 s is within 5e-4 rad/s after 30 ln 10 s. The log begins 4 s after power-on.
    #[test]
    fn the_warm_up_time_is_covered() {
        let truth_s = 30.0 * 10_f64.ln();
        let mut covered = 0;
        for seed in 0..60 {
            let notes = Notes::from_iter([Note::Number("since_power_on_s", 4.0)]);
            let step = rest(&|t| 0.01 - 5e-3 * (-(t + 4.0) / 30.0).exp(), 200.0, seed, notes);
            let found = warm_up_time(&[&step], &settings(5e-4)).unwrap();
            covered += u32::from(found.covers(truth_s));
            assert!(found.expanded_u() < 12.0, "{found:?}");
        }
        // 95 % of 60 less three standard errors.
        assert!(covered >= 52, "{covered}");
    }

    #[test]
    fn a_warm_device_and_another_shape_have_no_warm_up_time() {
        let step = rest(&|_| 0.01, 120.0, 1, Notes::default());
        assert!(matches!(warm_up_time(&[&step], &settings(2e-3)), Err(AbsenceReason::WithinBandFromTheBeginning { .. })));
        assert_eq!(warm_up_time(&[&step], &GyroSettings::default()), Err(AbsenceReason::NeedsWarmUpBand));
        let step = rest(&|t| 0.01 + 5e-3 * (-t / 20.0).exp() + 2e-3 * (t / 8.0).sin(), 120.0, 1, Notes::default());
        assert!(matches!(warm_up_time(&[&step], &settings(5e-4)), Err(AbsenceReason::NotExponential { .. })));
    }

    /// Biases of eight starts with a standard deviation of 1e-3 rad/s.
    #[test]
    fn the_turn_on_repeatability_is_covered() {
        let mut covered = 0;
        for seed in 0..60 {
            let mut bias = Noise::new(1000 + seed, 1, 1e-3);
            let steps: Vec<Step> = (0..8)
                .map(|k| {
                    let (bias, notes) = (bias.draw(), Notes::from_iter([Note::Text(RESTART_NOTE, "reset".to_owned())]));
                    rest(&|_| bias, 8.0, 100 * seed + k, notes)
                })
                .collect();
            let found = repeatability(&steps.iter().collect::<Vec<_>>(), &GyroSettings::default()).unwrap();
            covered += u32::from(found.covers(1e-3));
            assert!(found.expanded_u() < 1.5 * found.value, "{found:?}");
            assert!(repeatability(&steps[..3].iter().collect::<Vec<_>>(), &GyroSettings::default()).is_none());
        }
        assert!(covered >= 52, "{covered}");
    }
}

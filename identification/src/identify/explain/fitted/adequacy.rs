//! Is what a model leaves noise? A model is adequate if its residual is independent of what was put in, whatever the colour of the
//! residual.
//!
//! In: a fitted model whose residual exceeds the white noise of its channels. Out: whether the residual depends on anything that an effect
//! could depend on. Tested are
//!
//! * the correlation time, of which the log must contain many, unless another sensor shows that the platform did not move so: a slower
//!   residual is not known to be independent of anything;
//! * the coordinates: angle, rate, current, temperature, time, acceleration, history ([`residual::misfits`], against noise of the
//!   residual's own colour);
//! * the past of the input: the innovations of the residual against the prewhitened input, N Σ r²(τ) ~ χ² (Söderström and Stoica, System
//!   Identification, 1989, section 11.2);
//! * the other channels, fast and slow: a torque that the model lacks moves rate, angle and current together, noise of one sensor does not;
//! * for the angle: the place within the turn, for errors of its reading that are narrower than the coordinates show;
//! * for a rate sensor against a known motion: powers of the rate, the acceleration, and harmonics of the turn with and without the rate as
//!   a factor. The innovations against these quantities through the same filter, as generalised least squares weighs them.

use std::borrow::Cow;
use std::f64::consts::TAU;

use drive_model::Coordinate;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::FittedModel;
use super::likelihood::Whitener;
use super::motion::turns;
use crate::identify::explain::answer::reasons::Remark;
use crate::identify::explain::criteria::{AdequacyCriteria, MisfitClass};
use crate::identify::fit::ChannelFit;
use crate::identify::residual;
use crate::log::RateSource;
use crate::model::{Channel, Input};
use crate::recording::PreparedLog;
use crate::recording::prepare::is_of_sensor;
use crate::recording::voltage::{self, InputTiming};
use crate::statistics::Extremes;
use crate::statistics::distributions::chi_squared_tail;

/// What a model leaves.
pub enum Adequacy {
    /// White noise, or less than a person sees.
    WhiteNoise,
    /// Coloured noise of sensors, independent of the motion: a remark for each channel above its white noise.
    ColouredNoise(Vec<Remark>),
    /// Something that depends on the motion or moves the platform.
    Dependent,
}

/// What `model` leaves.
pub fn adequacy(model: &FittedModel) -> Adequacy {
    if model.misfit() <= MisfitClass::Invisible {
        return Adequacy::WhiteNoise;
    }
    let criteria = &model.context.criteria.adequacy;
    if may_be_motion(model, criteria) {
        return Adequacy::Dependent;
    }
    let left = Remainder::of(model);
    if depends_on_input(model, &left, criteria)
        || channels_are_coherent(model, &left, criteria)
        || depends_on_known_motion(model, &left, criteria)
        || angle_reading_depends_on_angle(model, &left, criteria)
    {
        return Adequacy::Dependent;
    }
    let mut fit = model.fit.clone();
    for (channel, residual) in fit.channels.iter_mut().zip(left.residuals) {
        channel.residual = residual;
    }
    if !residual::misfits(model.context.log, &model.data, &fit).is_empty() {
        return Adequacy::Dependent;
    }
    Adequacy::ColouredNoise(coloured_noise(model))
}

/// What a model leaves at the parameters that are best under the colour of the noise, and the filter that whitens it.
struct Remainder {
    whitener: Whitener,
    /// By channel, a value per row; NaN where the row is not compared.
    residuals: Vec<Vec<f64>>,
}

impl Remainder {
    fn of(model: &FittedModel) -> Remainder {
        let whitener = model.whitener();
        let best = model.residuals_at_best(&whitener);
        let residuals = best.unwrap_or_else(|| model.residuals().into_iter().map(<[f64]>::to_vec).collect());
        Remainder { whitener, residuals }
    }

    /// The innovations of a channel.
    fn innovations(&self, data: &PreparedLog, channel: usize) -> Vec<f64> {
        self.whitener.innovations(data, channel, &self.residuals[channel])
    }
}

/// A remark for each channel whose residual is above its white noise.
pub fn coloured_noise(model: &FittedModel) -> Vec<Remark> {
    above_white_noise(model)
        .map(|c| Remark::ColouredNoise {
            channel: c.channel,
            ratio: c.chi2_per_n().sqrt(),
            correlation_s: correlation_time_s(&c.residual, model.data.dt_s),
        })
        .collect()
}

/// The residual may be motion of the platform. No other sensor of the motion is at its noise, and the tests decide nothing: the residual is
/// correlated over much of the log, or so large that the motion of the model, on which the tests rest, may be far off.
fn may_be_motion(model: &FittedModel, criteria: &AdequacyCriteria) -> bool {
    let data = &model.data;
    let above: Vec<&ChannelFit> = above_white_noise(model).collect();
    let is_of_motion = |channel: Channel| matches!(channel, Channel::Rate | Channel::Angle);
    let motion_is_known = model.fit.channels.iter().any(|c| is_of_motion(c.channel) && above.iter().all(|a| a.channel != c.channel));
    if motion_is_known || data.driven == Input::Motion {
        return false;
    }
    let duration_s = data.len() as f64 * data.dt_s;
    let is_slow = |c: &ChannelFit| correlation_time_s(&c.residual, data.dt_s) * criteria.min_correlation_times > duration_s;
    let is_dominant = |c: &ChannelFit| model.context.criteria.noise.misfit(c.chi2_per_n()) == MisfitClass::Dominant;
    above.iter().any(|c| is_dominant(c) || is_slow(c))
}

fn above_white_noise<'m>(model: &'m FittedModel) -> impl Iterator<Item = &'m ChannelFit> {
    let noise = &model.context.criteria.noise;
    model.fit.channels.iter().filter(|c| noise.misfit(c.chi2_per_n()) > MisfitClass::Invisible)
}

/// Where the input holds values at t, what it did between them is not known: two ways to fill the gap, the monotone cubic and the last
/// value, leave different residuals. A misfit below that difference in every channel says nothing about the drive. The same holds where
/// values of the row before are assumed and no note states them: they may be values at t, of which a loop makes the next one by what the
/// drive did in between.
pub fn input_between_samples(model: &FittedModel) -> Option<Remark> {
    let data = &model.data;
    let log = model.context.log;
    let column = data.driven.column();
    let values = log.column(column)?;
    let other = match data.input_timing {
        InputTiming::AtT => Cow::Borrowed(values),
        InputTiming::OverRowBefore if !log.notes().is_of_row_before(column) => voltage::input(values, InputTiming::AtT, &data.segments),
        _ => return None,
    };
    let error: Vec<f64> = data.input.iter().zip(&*other).map(|(mean, other)| mean - other).collect();
    let excess = residual::excess_of_input_error(log, data, &model.fit, &error)?;
    let white = model.context.criteria.noise.invisible;
    let within = model.fit.channels.iter().zip(&excess).all(|(c, excess)| c.chi2_per_n() <= white + excess) && !depends_on_state(model);
    let rms = (error.iter().map(|e| e * e).sum::<f64>() / error.len().max(1) as f64).sqrt();
    within.then_some(Remark::InputBetweenSamples { column: data.driven.column(), rms })
}

/// Series of rounding errors that are drawn; their mean square response is averaged.
const ROUNDINGS: usize = 4;

/// Where the column of the input is rounded, the drive saw other values: even within a step of the column, others at each new value. A
/// misfit below the response to such errors in every channel, in which no effect has evidence, says nothing about the drive.
pub fn rounded_input(model: &FittedModel) -> Option<Remark> {
    let data = &model.data;
    let log = model.context.log;
    let column = data.driven.column();
    let step = log.quantization_step(column).or_else(|| step_of_few_levels(log.column(column)?))?;
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(0);
    let mut rounding = || {
        let mut error = 0.0;
        let mut before = f64::NAN;
        let mut draw = |value: &f64| {
            if *value != before {
                (before, error) = (*value, step * rounding_error(&mut generator));
            }
            error
        };
        data.input.iter().map(&mut draw).collect::<Vec<f64>>()
    };
    let mut excess = vec![0.0; data.channels.len()];
    for _ in 0..ROUNDINGS {
        let of_one = residual::excess_of_input_error(log, data, &model.fit, &rounding())?;
        excess.iter_mut().zip(of_one).for_each(|(sum, one)| *sum += one / ROUNDINGS as f64);
    }
    let white = model.context.criteria.noise.invisible;
    let within = model.fit.channels.iter().zip(&excess).all(|(c, excess)| c.chi2_per_n() <= white + excess) && !depends_on_state(model);
    within.then_some(Remark::InputRounded { column, step })
}

/// Changes of a value from which on its levels are those of a rounding.
const MIN_CHANGES: usize = 50;
/// Part of them by one step, at least: a rounded signal passes its levels in order, a setpoint jumps.
const MIN_BY_ONE_STEP: f64 = 0.9;
/// Part of a step by which levels may differ from whole steps.
const LEVEL_TOLERANCE: f64 = 1e-3;

/// Step of values that are rounded so coarsely that they have few levels; `None` for a setpoint.
fn step_of_few_levels(values: &[f64]) -> Option<f64> {
    let changes: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|change| *change > 0.0).collect();
    let step = changes.iter().copied().min_or_infinity();
    let is_whole = |change: &f64| (change / step - (change / step).round()).abs() < LEVEL_TOLERANCE;
    let by_one = changes.iter().filter(|change| **change < 1.5 * step).count();
    let is_rounded =
        changes.len() >= MIN_CHANGES && changes.iter().all(is_whole) && by_one as f64 >= MIN_BY_ONE_STEP * changes.len() as f64;
    let (low, high) = values.iter().copied().min_max();
    (is_rounded && high - low > 1.5 * step).then_some(step)
}

/// An error of rounding in steps: even between −½ and ½.
fn rounding_error(generator: &mut impl Rng) -> f64 {
    (generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}

/// A part of the residual depends on rate, angle or temperature. What an input does between its samples follows its changes, not these.
fn depends_on_state(model: &FittedModel) -> bool {
    let of_state = |c: Coordinate| matches!(c, Coordinate::Omega | Coordinate::Theta | Coordinate::Temperature);
    let max_fraction = model.context.criteria.adequacy.max_state_fraction;
    let misfits = residual::misfits(model.context.log, &model.data, &model.fit);
    misfits.iter().any(|m| of_state(m.coordinate) && m.explained_fraction > max_fraction)
}

/// Where a channel is the newest sample of a sensor with its own clock, the age of the sample is not known, only that it is below the
/// interval T: an error of slope × T/√12 rms. A misfit below that in every channel says nothing about the drive or the sensor.
pub fn sample_age(model: &FittedModel) -> Option<Remark> {
    let data = &model.data;
    let white = model.context.criteria.noise.invisible;
    let mut remark = None;
    for (fit, channel) in model.fit.channels.iter().zip(&data.channels) {
        let mut excess = 0.0;
        if let Some(interval_s) = channel.sample_interval_s {
            let modelled: Vec<f64> = channel.measured.iter().zip(&fit.residual).map(|(y, r)| y - r).collect();
            let slopes: Vec<f64> = modelled.windows(3).map(|w| (w[2] - w[0]) / (2.0 * data.dt_s)).filter(|s| s.is_finite()).collect();
            let mean_square = slopes.iter().map(|s| s * s).sum::<f64>() / slopes.len().max(1) as f64;
            let error = (mean_square / 12.0).sqrt() * interval_s;
            excess = (error / fit.noise).powi(2);
            remark = Some(Remark::SampleAge { channel: channel.channel, rms: error, interval_s });
        }
        if fit.chi2_per_n() > white + excess {
            return None;
        }
    }
    remark
}

/// The innovations of a channel's residual depend on the past of the input.
fn depends_on_input(model: &FittedModel, left: &Remainder, criteria: &AdequacyCriteria) -> bool {
    let data = &model.data;
    if data.driven == Input::Motion {
        return false;
    }
    (0..data.channels.len()).any(|c| {
        let stride = left.whitener.stride(c);
        let innovations = left.innovations(data, c);
        // The input of a row is its mean until the next one, so that it acts on the next row.
        let input = block_means(data, &data.input, stride);
        let input = prewhitened(&input);
        let lags = if stride > 1 { criteria.lags_of_increments } else { criteria.lags };
        let (fraction, p) = cross_correlation(&innovations, &input, lags);
        p * (data.channels.len() as f64) < criteria.max_familywise_p && fraction > criteria.min_input_fraction
    })
}

/// The residual of a sensor depends on the known motion.
fn depends_on_known_motion(model: &FittedModel, left: &Remainder, criteria: &AdequacyCriteria) -> bool {
    let data = &model.data;
    let Some(motion) = &data.known_motion else { return false };
    let Some(c) = data.channels.iter().position(|c| is_of_sensor(c.channel)) else { return false };
    let innovations = left.innovations(data, c);
    let omega: Vec<f64> = motion.iter().map(|m| m.omega_rad_s).collect();
    let alpha: Vec<f64> = (0..omega.len()).map(|k| omega[(k + 1).min(omega.len() - 1)] - omega[k.saturating_sub(1)]).collect();
    let harmonics = if turns(data) < criteria.min_turns { 0 } else { criteria.harmonics };
    let wave = |order: usize, by_rate: bool| -> [Vec<f64>; 2] {
        let factor = |row: usize| if by_rate { omega[row] } else { 1.0 };
        let sine =
            |quarter: f64| (0..omega.len()).map(|row| factor(row) * (order as f64 * data.input[row] + quarter).sin()).collect::<Vec<f64>>();
        [sine(0.0), sine(std::f64::consts::FRAC_PI_2)]
    };
    let power = |exponent: i32| omega.iter().map(|w| w.powi(exponent)).collect::<Vec<f64>>();
    let mut families = vec![[power(1), power(2)], [power(3), omega.iter().map(|w| w.abs()).collect()], [alpha, power(4)]];
    // A slope that varies with the angle, as that of a potentiometer.
    let theta = centred(&data.input);
    families.push([1, 2].map(|exponent| theta.iter().zip(&omega).map(|(theta, omega)| theta.powi(exponent) * omega).collect()));
    families.extend((1..=harmonics).flat_map(|order| [wave(order, false), wave(order, true)]));
    let tests = families.len();
    families.into_iter().any(|family| explains_residual(model, left, (c, &innovations), family, tests))
}

/// Places around the turn at which an error of the angle reading is sought, tents of 10° width.
const PLACES: usize = 72;

/// The residual of the angle has a part that is the same at each passage of a place within the turn, as bad lines of the encoder leave it.
/// A narrow error has little of each harmonic, so that the coordinates do not show it.
fn angle_reading_depends_on_angle(model: &FittedModel, left: &Remainder, criteria: &AdequacyCriteria) -> bool {
    let data = &model.data;
    let (Some(c), Some(theta)) = (data.channels.iter().position(|c| c.channel == Channel::Angle), data.theta) else { return false };
    if data.driven == Input::Motion || turns(data) < criteria.min_turns {
        return false;
    }
    let lag = data.angle_lag();
    let tent = |place: usize| {
        let height = |row: usize| {
            let away = (theta[row] / TAU * PLACES as f64 - place as f64).rem_euclid(PLACES as f64);
            (1.0 - away.min(PLACES as f64 - away)).max(0.0)
        };
        let mut increments = vec![f64::NAN; theta.len()];
        for rows in &data.segments {
            for row in rows.clone().skip(lag) {
                increments[row] = height(row) - height(row - lag);
            }
        }
        increments
    };
    let innovations = left.innovations(data, c);
    (0..PLACES).step_by(2).any(|place| explains_residual(model, left, (c, &innovations), [tent(place), tent(place + 1)], PLACES / 2))
}

/// Two series explain a significant part of the residual of a channel, where `tests` such pairs are tried. The innovations of the residual
/// are compared with the series through the same filter.
fn explains_residual(
    model: &FittedModel,
    left: &Remainder,
    (channel, innovations): (usize, &[f64]),
    pair: [Vec<f64>; 2],
    tests: usize,
) -> bool {
    let criteria = &model.context.criteria.adequacy;
    let whitened = pair.each_ref().map(|x| left.whitener.innovations(&model.data, channel, &centred(x)));
    let (statistic, _) = projection(innovations, &whitened);
    let (_, fraction) = projection(&left.residuals[channel], &pair.map(|x| centred(&x)));
    let noise_fraction = fraction * model.fit.channels[channel].chi2_per_n();
    chi_squared_tail(statistic, 2.0) * (tests as f64) < criteria.max_familywise_p && noise_fraction > criteria.min_input_fraction
}

/// A series less the mean of its finite values.
fn centred(series: &[f64]) -> Vec<f64> {
    let (sum, n) = series.iter().filter(|v| v.is_finite()).fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
    series.iter().map(|v| v - sum / n.max(1) as f64).collect()
}

/// Projection of a series on two others: χ² with two degrees of freedom if the series is white and independent of them, and the fraction of
/// its variance.
fn projection(series: &[f64], on: &[Vec<f64>; 2]) -> (f64, f64) {
    let [mut aa, mut ab, mut bb, mut ea, mut eb, mut ee, mut n] = [0.0; 7];
    for ((e, a), b) in series.iter().zip(&on[0]).zip(&on[1]) {
        if e.is_finite() && a.is_finite() && b.is_finite() {
            (aa, ab, bb, ea, eb, ee, n) = (aa + a * a, ab + a * b, bb + b * b, ea + e * a, eb + e * b, ee + e * e, n + 1.0);
        }
    }
    let determinant = aa * bb - ab * ab;
    if determinant <= 1e-12 * aa * bb || ee <= 0.0 {
        return (0.0, 0.0);
    }
    let explained = (bb * ea * ea - 2.0 * ab * ea * eb + aa * eb * eb) / determinant;
    (explained / (ee / n), explained / ee)
}

/// Means of a column over the `stride` rows before each compared row of every segment, segments separated by NaN.
fn block_means(data: &PreparedLog, values: &[f64], stride: usize) -> Vec<f64> {
    let mut means = Vec::new();
    for rows in &data.segments {
        for row in rows.clone().step_by(stride) {
            let from = row.saturating_sub(stride).max(rows.start);
            means.push(if row > from { values[from..row].iter().sum::<f64>() / (row - from) as f64 } else { values[row] });
        }
        means.push(f64::NAN);
    }
    means
}

/// The innovations of a series about its mean.
fn prewhitened(series: &[f64]) -> Vec<f64> {
    Whitener::innovations_of(&centred(series))
}

/// Fraction of the variance of `innovations` that the past of `input`, up to `lags` steps back, explains beyond chance, and its probability
/// by chance.
fn cross_correlation(innovations: &[f64], input: &[f64], lags: usize) -> (f64, f64) {
    let square = |v: &[f64]| v.iter().filter(|v| v.is_finite()).map(|v| v * v).sum::<f64>();
    let (e2, x2) = (square(innovations), square(input));
    if e2 <= 0.0 || x2 <= 0.0 {
        return (0.0, 1.0);
    }
    let n = innovations.iter().filter(|v| v.is_finite()).count() as f64;
    let mut statistic = 0.0;
    for lag in 0..lags {
        let (mut product, mut pairs) = (0.0, 0usize);
        for (e, x) in innovations[lag.min(innovations.len())..].iter().zip(input) {
            if e.is_finite() && x.is_finite() {
                product += e * x;
                pairs += 1;
            }
        }
        let variance = (e2 / n) * (x2 / n) * pairs as f64;
        statistic += if variance > 0.0 { product * product / variance } else { 0.0 };
    }
    ((statistic - lags as f64) / n, chi_squared_tail(statistic, lags as f64))
}

/// A torque moves the residuals of two channels together.
fn channels_are_coherent(model: &FittedModel, left: &Remainder, criteria: &AdequacyCriteria) -> bool {
    let data = &model.data;
    if data.driven == Input::Motion {
        return false;
    }
    let find = |channel: Channel| data.channels.iter().position(|c| c.channel == channel);
    let separate = model.context.log.provenance(Channel::Rate.column()).source == RateSource::RateSensor && !data.rate_from_encoder;
    let rate = find(Channel::Rate);
    let pairs = [(rate, find(Channel::Angle).filter(|_| separate)), (rate.or(find(Channel::Angle)), find(Channel::Current))];
    let stride = data.angle_lag();
    let blocks = |c: usize| -> Vec<f64> {
        let residual = &left.residuals[c];
        match data.channels[c].channel {
            // An increment is the mean rate over its interval.
            Channel::Angle => {
                let mut list = Vec::new();
                for rows in &data.segments {
                    list.extend(rows.clone().step_by(stride).map(|row| residual[row]));
                    list.push(f64::NAN);
                }
                list
            }
            _ => {
                let usable: Vec<f64> = residual.iter().map(|r| if r.is_finite() { *r } else { 0.0 }).collect();
                block_means(data, &usable, stride)
            }
        }
    };
    pairs.into_iter().filter_map(|(a, b)| Some((a?, b?))).any(|(a, b)| series_are_coherent(blocks(a), blocks(b), criteria))
}

/// The innovations of two series are correlated, in the series themselves or in means over two, four, … of their values: a slow motion is
/// hidden below the white noise of each value, and means over longer blocks show it.
fn series_are_coherent(mut a: Vec<f64>, mut b: Vec<f64>, criteria: &AdequacyCriteria) -> bool {
    // The same parts in both, so that their blocks are the same.
    for (a, b) in a.iter_mut().zip(&mut b).filter(|(a, b)| !a.is_finite() || !b.is_finite()) {
        (*a, *b) = (f64::NAN, f64::NAN);
    }
    loop {
        let innovations = (prewhitened(&a), prewhitened(&b));
        let pairs = pairs_after_first(&innovations.0, &innovations.1);
        if pairs.len() < criteria.min_coherence_blocks {
            return false;
        }
        let sum = |f: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>();
        let correlation = (sum(&|(a, b)| a * b) / (sum(&|(a, _)| a * a) * sum(&|(_, b)| b * b)).sqrt()).abs();
        if correlation > criteria.min_coherence && correlation * (pairs.len() as f64).sqrt() > criteria.min_coherence_sigmas {
            return true;
        }
        (a, b) = (means_of_two(&a), means_of_two(&b));
    }
}

/// Pairs of finite values but the first of each part. A segment begins with the initial states, and under coloured noise one step of the
/// linear model determines them: both channels begin with the error of that step.
fn pairs_after_first(a: &[f64], b: &[f64]) -> Vec<(f64, f64)> {
    let mut pairs = Vec::with_capacity(a.len());
    let mut is_first = true;
    for pair in a.iter().copied().zip(b.iter().copied()) {
        let is_finite = pair.0.is_finite() && pair.1.is_finite();
        if is_finite && !is_first {
            pairs.push(pair);
        }
        is_first = !is_finite;
    }
    pairs
}

/// Means of neighbouring pairs in each part of a series; NaN separates the parts.
fn means_of_two(series: &[f64]) -> Vec<f64> {
    let mut means = Vec::with_capacity(series.len() / 2 + 1);
    for part in series.split(|v| !v.is_finite()) {
        means.extend(part.chunks_exact(2).map(|pair| 0.5 * (pair[0] + pair[1])));
        means.push(f64::NAN);
    }
    means
}

/// Time over which the residual is correlated, s: where its autocorrelation falls below 1/e.
fn correlation_time_s(residual: &[f64], dt_s: f64) -> f64 {
    let square = residual.iter().filter(|r| r.is_finite()).map(|r| r * r).sum::<f64>();
    let correlation = |lag: usize| {
        let product: f64 = residual.iter().zip(&residual[lag..]).map(|(a, b)| a * b).filter(|p| p.is_finite()).sum();
        product / square
    };
    let most = residual.len() / 10;
    let lag = (1..most).find(|&lag| correlation(lag) < (-1.0_f64).exp()).unwrap_or(most);
    lag as f64 * dt_s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::explain::fitted::test_rotor::with_fit;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    /// An autoregression of unit variance: its value is `memory` times the one before, and noise.
    fn coloured(draw: &mut Xoshiro256PlusPlus, rows: usize, memory: f64) -> Vec<f64> {
        let mut at = 0.0;
        (0..rows)
            .map(|_| {
                let even: f64 = (0..12).map(|_| draw.next_u32() as f64 / f64::from(u32::MAX)).sum();
                at = memory * at + (1.0 - memory * memory).sqrt() * (even - 6.0);
                at
            })
            .collect()
    }

    /// What the true model leaves, and whether that may be motion, if `torque` is hidden and `error` is that of the sensor.
    fn left_of(torque: &[f64], error: &[f64]) -> (Adequacy, bool) {
        let rows = torque.iter().copied().zip(error.iter().copied());
        with_fit(rows, |fitted| (adequacy(&fitted), may_be_motion(&fitted, &AdequacyCriteria::default())))
    }

    #[test]
    fn slow_remainder_is_not_known_to_be_noise_of_a_sensor() {
        let mut draw = Xoshiro256PlusPlus::seed_from_u64(3);
        let scaled = |series: Vec<f64>, by: f64| series.into_iter().map(|v| by * v).collect::<Vec<f64>>();
        let white = scaled(coloured(&mut draw, 1200, 0.0), 0.05);
        let slow = scaled(coloured(&mut draw, 1200, 0.997), 3e-5);
        assert!(matches!(left_of(&slow, &white), (Adequacy::Dependent, true)), "a torque that wanders over seconds");
        let fast: Vec<f64> = scaled(coloured(&mut draw, 1200, 0.8), 0.1).iter().zip(&white).map(|(a, b)| a + b).collect();
        assert!(matches!(left_of(&[0.0; 1200], &fast), (Adequacy::ColouredNoise(_), false)), "noise over 50 ms");
        let smooth = scaled(coloured(&mut draw, 1200, 0.97), 0.1);
        assert!(matches!(left_of(&[0.0; 1200], &smooth), (Adequacy::Dependent, true)), "six times the white noise, by the only sensor");
    }

    #[test]
    fn slow_motion_below_the_noise_of_two_sensors_is_coherent() {
        let mut draw = Xoshiro256PlusPlus::seed_from_u64(1);
        let motion = coloured(&mut draw, 1500, 0.975);
        let mut sensor = || coloured(&mut draw, 1500, 0.0).into_iter().zip(&motion).map(|(n, m)| 3.0 * n + m).collect::<Vec<f64>>();
        let (a, b) = (sensor(), sensor());
        let values_alone = AdequacyCriteria { min_coherence_blocks: 1000, ..AdequacyCriteria::default() };
        assert!(!series_are_coherent(a.clone(), b.clone(), &values_alone), "only means over several values show it");
        assert!(series_are_coherent(a, b, &AdequacyCriteria::default()));
    }

    #[test]
    fn error_of_the_initial_states_is_not_coherent_motion() {
        let mut draw = Xoshiro256PlusPlus::seed_from_u64(5);
        let (mut a, mut b) = (coloured(&mut draw, 1500, 0.0), coloured(&mut draw, 1500, 0.0));
        (a[0], b[0]) = (20.0, 20.0);
        assert!(!series_are_coherent(a.clone(), b.clone(), &AdequacyCriteria::default()));
        (a[700], b[700]) = (20.0, 20.0);
        assert!(series_are_coherent(a, b, &AdequacyCriteria::default()), "the same pair within the log is coherent");
    }

    #[test]
    fn independent_noise_of_two_sensors_is_not_coherent_whatever_its_colour() {
        let found = (0..300).filter(|seed| {
            let mut draw = Xoshiro256PlusPlus::seed_from_u64(100 + seed);
            let (a, mut b) = (coloured(&mut draw, 1500, 0.9), coloured(&mut draw, 1500, 0.99));
            // A part without a reading does not shift the blocks of one series against the other.
            b[700] = f64::NAN;
            series_are_coherent(a, b, &AdequacyCriteria::default())
        });
        assert!(found.count() <= 2, "more than 1 % of the pairs");
    }
}

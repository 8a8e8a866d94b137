//! Is what a model leaves noise? A model is adequate if its residual is independent of what was put in, whatever the colour of the residual.
//!
//! In: a fitted model whose residual exceeds the white noise of its channels. Out: whether the residual depends on anything that an effect could
//! depend on. Tested are
//!
//! * the coordinates: angle, rate, current, temperature, time, acceleration, history ([`residual::misfits`], against noise of the residual's own colour);
//! * the past of the input: the innovations of the residual against the prewhitened input, N Σ r²(τ) ~ χ² (Söderström and Stoica, System
//!   Identification, 1989, section 11.2);
//! * the other channels: a torque that the model lacks moves rate, angle and current together, noise of one sensor does not.

use super::criteria::{AdequacyCriteria, MisfitClass};
use super::fitted_model::FittedModel;
use super::likelihood::Whitener;
use super::reasons::Remark;
use crate::identify::fit::PreparedLog;
use crate::identify::residual;
use crate::log::RateSource;
use crate::model::{Channel, Input};
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
    if depends_on_input(model, criteria) || channels_are_coherent(model, criteria) {
        return Adequacy::Dependent;
    }
    if !residual::misfits(model.context.log, &model.data, &model.fit).is_empty() {
        return Adequacy::Dependent;
    }
    Adequacy::ColouredNoise(coloured_noise(model))
}

/// A remark for each channel whose residual is above its white noise.
pub fn coloured_noise(model: &FittedModel) -> Vec<Remark> {
    let above = model.fit.channels.iter().filter(|c| model.context.criteria.noise.misfit(c.chi2_per_n()) > MisfitClass::Invisible);
    above
        .map(|c| Remark::ColouredNoise {
            channel: c.channel,
            ratio: c.chi2_per_n().sqrt(),
            correlation_s: correlation_time_s(&c.residual, model.data.dt_s),
        })
        .collect()
}

/// Where the input holds values at t, what it did between them is not known: two ways to fill the gap, the monotone cubic and the last value, leave
/// different residuals. A misfit below that difference in every channel says nothing about the drive.
pub fn input_between_samples(model: &FittedModel) -> Option<Remark> {
    let data = &model.data;
    let log = model.context.log;
    let held = log.column(data.driven.column()).filter(|_| data.input_at_t)?;
    let error: Vec<f64> = data.input.iter().zip(held).map(|(mean, held)| mean - held).collect();
    let excess = residual::excess_of_input_error(log, data, &model.fit, &error)?;
    let white = model.context.criteria.noise.invisible;
    let within = model.fit.channels.iter().zip(&excess).all(|(c, excess)| c.chi2_per_n() <= white + excess);
    let rms = (error.iter().map(|e| e * e).sum::<f64>() / error.len().max(1) as f64).sqrt();
    within.then_some(Remark::InputBetweenSamples { column: data.driven.column(), rms })
}

/// The innovations of a channel's residual depend on the past of the input.
fn depends_on_input(model: &FittedModel, criteria: &AdequacyCriteria) -> bool {
    let data = &model.data;
    if data.driven == Input::Motion {
        return false;
    }
    let whitener = model.whitener();
    (0..data.channels.len()).any(|c| {
        let stride = whitener.stride(c);
        let innovations = whitener.innovations(data, c, &model.fit.channels[c].residual);
        // The input of a row is its mean until the next one, so that it acts on the next row.
        let input = block_means(data, &data.input, stride);
        let input = prewhitened(&input);
        let lags = if stride > 1 { criteria.lags_of_increments } else { criteria.lags };
        let (fraction, p) = cross_correlation(&innovations, &input, lags);
        p * (data.channels.len() as f64) < criteria.max_familywise_p && fraction > criteria.min_input_fraction
    })
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
    let finite = series.iter().filter(|v| v.is_finite());
    let (sum, n) = finite.fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
    let mean = sum / n.max(1) as f64;
    let centred: Vec<f64> = series.iter().map(|v| v - mean).collect();
    Whitener::innovations_of(&centred)
}

/// Fraction of the variance of `innovations` that the past of `input`, up to `lags` steps back, explains beyond chance, and its probability by chance.
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
fn channels_are_coherent(model: &FittedModel, criteria: &AdequacyCriteria) -> bool {
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
        let residual = &model.fit.channels[c].residual;
        let series = match data.channels[c].channel {
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
        };
        prewhitened(&series)
    };
    pairs.into_iter().filter_map(|(a, b)| Some((a?, b?))).any(|(a, b)| {
        let (a, b) = (blocks(a), blocks(b));
        let pairs: Vec<(f64, f64)> = a.iter().zip(&b).filter(|(a, b)| a.is_finite() && b.is_finite()).map(|(a, b)| (*a, *b)).collect();
        let sum = |f: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>();
        let correlation = sum(&|(a, b)| a * b) / (sum(&|(a, _)| a * a) * sum(&|(_, b)| b * b)).sqrt();
        correlation.abs() > criteria.min_coherence && correlation.abs() * (pairs.len() as f64).sqrt() > criteria.min_coherence_sigmas
    })
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

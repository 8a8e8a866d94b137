//! Coloured noise of a sensor: a first-order Gauss–Markov process beside the white noise of a channel.
//!
//! It competes with the effects: where it is more likely than every effect, what the model leaves in a channel is noise of that sensor.

use super::model::PredictedModel;
use crate::identify::predict::PredictionFit;
use crate::identify::predict::fit::Prediction;
use crate::identify::predict::gain::ColouredNoise;
use crate::model::Channel;

/// Correlation of successive innovations below which a channel is white: more than a few per mille matter to nobody.
const MIN_CORRELATION: f64 = 0.02;
/// The same in standard errors.
const MIN_SIGMAS: f64 = 4.0;
/// Lags whose correlations are summed.
const LAGS: usize = 5;
/// Correlation times that are tried first, rows.
const TIMES_ROWS: [f64; 5] = [2.0, 6.0, 20.0, 60.0, 200.0];
/// Sizes that are tried first, parts of the innovations' standard deviation.
const SIZES: [f64; 3] = [0.3, 0.6, 0.9];
/// Factors by which both are refined.
const REFINEMENTS: [f64; 3] = [1.6, 1.25, 1.1];

/// Channels whose innovations are not white and that have no coloured noise yet.
pub fn coloured_channels(base: &PredictedModel) -> Vec<usize> {
    let fitted = &base.fitted;
    let candidates = (0..fitted.data.channels.len()).filter(|&c| {
        let counts = fitted.data.channels[c].channel == Channel::Angle && fitted.data.channels[c].quantum.is_some();
        !counts && base.prediction.noise.channels[c].coloured.is_none()
    });
    candidates
        .filter(|&c| {
            let residual = &fitted.fit.channels[c].residual;
            let (correlation, n) = mean_correlation(residual);
            correlation.abs() > MIN_CORRELATION && correlation.abs() * n.sqrt() > MIN_SIGMAS
        })
        .collect()
}

/// Mean of the first correlations of a series, scaled to the standard error 1/√n; and n.
fn mean_correlation(residual: &[f64]) -> (f64, f64) {
    let square = residual.iter().filter(|r| r.is_finite()).map(|r| r * r).sum::<f64>();
    let n = residual.iter().filter(|r| r.is_finite()).count() as f64;
    if square <= 0.0 || residual.len() <= LAGS {
        return (0.0, n);
    }
    let correlation =
        |lag: usize| residual.iter().zip(&residual[lag..]).map(|(a, b)| a * b).filter(|p| p.is_finite()).sum::<f64>() / square;
    ((1..=LAGS).map(correlation).sum::<f64>() / (LAGS as f64).sqrt(), n)
}

/// The model with coloured noise in some channels, fitted; `None` where it is not finite.
pub fn with_colour(base: &PredictedModel, channels: &[usize]) -> Option<PredictionFit> {
    let fitted = &base.fitted;
    let prediction = Prediction::new(&fitted.system, &fitted.data);
    let mut best = base.prediction.clone();
    for &channel in channels {
        best = with_colour_of(&prediction, &best, channel)?;
    }
    prediction.refine(&mut best);
    // The random torque may have taken the place of the noise.
    let lowered = prediction.lower(best.clone()).map(|mut p| {
        prediction.refine(&mut p);
        p
    });
    [Some(best), lowered].into_iter().flatten().min_by(|a, b| a.minus_2_ln_likelihood.total_cmp(&b.minus_2_ln_likelihood))
}

/// A fit with coloured noise in a channel, its time and size on a grid, then refined; the parameters stay.
fn with_colour_of(prediction: &Prediction, p: &PredictionFit, channel: usize) -> Option<PredictionFit> {
    let sigma = p.predictor.innovation_variances[channel].sqrt();
    let at = |times: f64, size: f64| {
        let mut noise = p.noise.clone();
        let coloured = ColouredNoise { sigma: sigma * size, decay: (-1.0 / times).exp() };
        let white = (1.0 - size * size).max(0.05).sqrt() * sigma;
        noise.channels[channel].white = white;
        noise.channels[channel].coloured = Some(coloured);
        prediction.at(&p.parameters, Some(p.initial_states.clone()), noise)
    };
    let tried = TIMES_ROWS.iter().flat_map(|t| SIZES.iter().map(move |s| (*t, *s)));
    let (mut best, mut fit) = tried
        .filter_map(|(t, s)| Some(((t, s), at(t, s)?)))
        .min_by(|a, b| a.1.minus_2_ln_likelihood.total_cmp(&b.1.minus_2_ln_likelihood))?;
    for factor in REFINEMENTS {
        for (ft, fs) in [(factor, 1.0), (1.0 / factor, 1.0), (1.0, factor), (1.0, 1.0 / factor)] {
            let next = (best.0 * ft, best.1 * fs);
            if let Some(found) = at(next.0, next.1)
                && found.minus_2_ln_likelihood < fit.minus_2_ln_likelihood
            {
                (best, fit) = (next, found);
            }
        }
    }
    Some(fit)
}

//! Plots of an explanation: residual by stage, harmonic orders before and after, the shape of an unexplained residual.

use super::{sentences, words};
use crate::plot::svg::{Anchor, Drawing, Svg};
use crate::plot::{Axis, Plot, WIDTH};
use crate::residual_plots::coordinate_axis;
use crate::{column, numbers, quantity, unit};
use identification::identify::explain::{Explanation, Shape};
use identification::identify::fit::ChannelFit;
use identification::identify::residual::harmonics::Spectrum;
use identification::recording::prepared_log::ComparedChannel;
use identification::statistics::Extremes;

/// Harmonic orders that are drawn; more are drawn only where one is significant.
const MIN_ORDERS: usize = 60;

/// One channel before and after.
pub(super) struct Pair<'a> {
    /// How it was measured.
    pub compared: &'a ComparedChannel<'a>,
    /// With the model as given, fitted.
    pub before: &'a ChannelFit,
    /// With the missing effects.
    pub after: &'a ChannelFit,
}

/// Amplitude of the residual by harmonic order, before and after, in the unit of the channel.
///
/// The spectra may weight the rows differently. Therefore each bar is the amplitude of a sine that has the order's share of the residual's
/// variance.
pub(super) fn order_spectrum(axis: identification::log::Axis, pair: &Pair, before: &Spectrum, after: &Spectrum) -> Option<Drawing> {
    let amplitudes = |s: &Spectrum, f: &ChannelFit| s.fraction.iter().map(|share| (2.0 * share).sqrt() * f.rms).collect::<Vec<f64>>();
    let (bars_before, bars_after) = (amplitudes(before, pair.before), amplitudes(after, pair.after));
    let last = before.amplitude.iter().zip(&before.level).rposition(|(a, l)| a > l).map_or(0, |k| k + 1);
    let shown = (last + last / 4).max(MIN_ORDERS).min(bars_before.len());
    if shown < 4 {
        return None;
    }
    let highest = bars_before.iter().take(shown).chain(bars_after.iter().take(shown)).copied().max_or_zero();
    let x = Axis::new((0.0, shown as f64 + 1.0), 12, "harmonic order (periods per turn)", "");
    let y = Axis::new((0.0, 1.08 * highest), 4, "amplitude of the residual", unit(axis, pair.before.channel));
    let mut plot = Plot::new(x, y, WIDTH, 220.0);
    for (k, (b, a)) in bars_before.iter().zip(&bars_after).take(shown).enumerate() {
        let order = (k + 1) as f64;
        plot.bar((order - 0.4, order + 0.05), *b, "bar");
        plot.bar((order + 0.05, order + 0.4), *a, "bar-after");
    }
    Some(plot.finish())
}

/// An unexplained residual over its coordinate, bin by bin.
pub(super) fn shape(axis: identification::log::Axis, s: &Shape) -> Option<Drawing> {
    let (first, last) = s.bins.first().zip(s.bins.last())?;
    let reach = s.bins.iter().map(|b| b.mean.abs() + b.confidence.min(2.0 * b.mean.abs())).max_or_zero();
    let (quantity, y_unit) = sentences::acts_on(axis, s.acts_on);
    let x = coordinate_axis(s.coordinate, sentences::along(axis, s), (first.at, last.at), 8);
    let mut plot = Plot::new(x, Axis::new((-1.1 * reach, 1.1 * reach), 4, quantity, y_unit), WIDTH, 260.0);
    plot.level(0.0, "zero");
    for b in &s.bins {
        plot.whisker(b.at, b.mean, b.confidence);
    }
    Some(plot.finish())
}

/// Height of a bar and of a channel's heading, px; left and right end of the bars, px.
const BAR_HEIGHT: f64 = 22.0;
const HEADING_HEIGHT: f64 = 26.0;
const BARS: (f64, f64) = (260.0, 900.0);
/// Height below the bars for ticks and label, px.
const FOOT: f64 = 34.0;

/// For each channel a bar per stage: rms over noise on a logarithmic scale that begins at 1.
pub(super) fn stages(e: &Explanation) -> Drawing {
    let channels = e.stages.first().map_or(0, |s| s.outputs.len());
    let height = channels as f64 * (HEADING_HEIGHT + BAR_HEIGHT * e.stages.len() as f64 + 8.0) + FOOT;
    let ratios = e.stages.iter().flat_map(|s| &s.outputs).map(|o| o.ratio()).filter(|r| r.is_finite());
    // At least one decade, and space for the number behind the longest bar.
    let decades = (1.2 * ratios.fold(1.0_f64, f64::max)).log10().max(1.0);
    let x_of = |ratio: f64| BARS.0 + (BARS.1 - BARS.0) * (ratio.max(1.0).log10() / decades).min(1.0);
    let mut svg = Svg::new(WIDTH, height, "rms over noise of each channel, stage by stage");
    let bottom = height - FOOT;
    for power in 0..=decades.floor() as i32 {
        for part in [1.0, 2.0, 5.0] {
            let ratio = part * 10f64.powi(power);
            if ratio > 10f64.powf(decades) * 1.001 {
                continue;
            }
            let x = x_of(ratio);
            svg.line((x, 0.0), (x, bottom), if ratio == 1.0 { "zero" } else { "grid" });
            svg.text((x, bottom + 14.0), Anchor::Middle, "tick", &numbers::plain(ratio, 2));
        }
    }
    svg.text(((BARS.0 + BARS.1) / 2.0, height - 4.0), Anchor::Middle, "label", "rms over noise (1: at noise level)");
    let mut y = 0.0;
    for channel in 0..channels {
        if let Some(o) = e.stages.first().and_then(|s| s.outputs.get(channel)) {
            svg.text(
                (4.0, y + 18.0),
                Anchor::Start,
                "label",
                &format!("{}, {}", column(e.model.axis(), o.channel), quantity(e.model.axis(), o.channel)),
            );
        }
        y += HEADING_HEIGHT;
        for (k, stage) in e.stages.iter().enumerate() {
            if let Some(o) = stage.outputs.get(channel) {
                let end = x_of(o.ratio()).max(BARS.0 + 2.0);
                let last = k + 1 == e.stages.len() && k > 0;
                svg.text((BARS.0 - 8.0, y + 14.5), Anchor::End, "tick", &words::stage(stage));
                svg.rect(BARS.0, y + 3.0, end - BARS.0, BAR_HEIGHT - 6.0, if last { "bar-after" } else { "bar" });
                svg.text((end + 6.0, y + 14.5), Anchor::Start, "label", &numbers::significant(o.ratio(), 3));
            }
            y += BAR_HEIGHT;
        }
        y += 8.0;
    }
    svg.finish()
}

//! Plots of systematic residuals: harmonic orders of the angle, the strongest order over rate and current, the residual after reversals.

use crate::html::{Class, Markup, Page};
use crate::plot::{Axis, HALF_WIDTH, Plot, WIDTH, with_margin};
use crate::unit;
use identification::identify::fit::ChannelFit;
use identification::identify::residual::harmonics::Spectrum;
use identification::identify::residual::plot_data::ResidualPlotData;
use identification::statistics::Extremes;
use identification::statistics::bins::{Bin, binned};

/// Orders that are always drawn; more are drawn only where one is significant.
const MIN_ORDERS: usize = 40;
/// Time after a reversal that is drawn, s, and its bins.
const AFTER_REVERSAL_S: f64 = 1.0;
const AFTER_REVERSAL_BINS: usize = 50;

/// All plots of channel `index`.
pub fn all(p: &ResidualPlotData, index: usize, axis: identification::log::Axis, f: &ChannelFit, page: &mut Page) {
    if let Some(s) = p.spectrum(index) {
        order_spectrum(&s, page);
        let (order, significant) = strongest(&s);
        if significant {
            strongest_order(p, index, order, axis, f, page);
        }
    }
    reversals(p, index, axis, f, page);
}

/// The order that exceeds the noise most, and whether it is significant.
pub(super) fn strongest(s: &Spectrum) -> (u32, bool) {
    let over = |k: usize| s.amplitude[k] > s.level[k];
    let best = (0..s.amplitude.len())
        .max_by(|&a, &b| (over(a), s.amplitude[a]).partial_cmp(&(over(b), s.amplitude[b])).unwrap_or(std::cmp::Ordering::Equal));
    best.map_or((1, false), |k| (k as u32 + 1, over(k)))
}

/// Share of the residual's variance, and the share at the level of significance, percent, by harmonic order from 1 on as far as they are
/// drawn; `None` for fewer than four.
pub(super) fn order_shares(s: &Spectrum) -> Option<(Vec<f64>, Vec<f64>)> {
    if s.amplitude.len() < 4 {
        return None;
    }
    let last = (0..s.amplitude.len()).rev().find(|&k| s.amplitude[k] > s.level[k]).map_or(0, |k| k + 1);
    let shown = (last + last / 4).max(MIN_ORDERS).min(s.amplitude.len());
    let percent: Vec<f64> = s.fraction[..shown].iter().map(|share| 100.0 * share).collect();
    let level = |k: usize| percent[k] * (s.level[k] / s.amplitude[k].max(f64::MIN_POSITIVE)).powi(2);
    let levels = (0..shown).map(level).collect();
    Some((percent, levels))
}

/// The residual in the direction of motion over the time since the last reversal or start, s.
pub(super) fn after_reversals(p: &ResidualPlotData, index: usize) -> Option<Vec<Bin>> {
    let (since, along) = p.after_reversals(index)?;
    let bins = binned(since.iter().copied(), along.iter().copied(), (0.0, AFTER_REVERSAL_S), AFTER_REVERSAL_BINS);
    (bins.len() >= 8).then_some(bins)
}

/// Share of the residual's variance by harmonic order, with the level of noise.
fn order_spectrum(s: &Spectrum, page: &mut Page) {
    let Some((percent, levels)) = order_shares(s) else { return };
    let shown = percent.len();
    let largest = percent.iter().copied().max_or_zero();
    page.heading("Harmonic orders");
    let mut plot = Plot::new(
        Axis::new((0.0, shown as f64 + 1.0), 14, "harmonic order (periods per turn)", ""),
        Axis::new((0.0, 1.08 * largest), 4, "share of the residual variance", "%"),
        WIDTH,
        220.0,
    );
    for (k, part) in percent.iter().enumerate() {
        let order = (k + 1) as f64;
        plot.bar((order - 0.35, order + 0.35), *part, if s.amplitude[k] > s.level[k] { "bar loud" } else { "bar" });
    }
    let line: Vec<(f64, f64)> = levels.iter().enumerate().map(|(k, level)| ((k + 1) as f64, level.min(1.08 * largest))).collect();
    plot.lines(&[line], "normal");
    let caption = ": noise exceeds it in one of 1000 such plots. Rows are weighted by the rate or its inverse where an order is then more significant. The lowest orders also contain slow changes.";
    page.figure(&plot.finish(), Markup::swatch("modelled", "significance level").then(caption));
}

/// Amplitude of the strongest order over the rate and over the current.
fn strongest_order(p: &ResidualPlotData, index: usize, order: u32, axis: identification::log::Axis, f: &ChannelFit, page: &mut Page) {
    let slices: [(&str, &str, Vec<Bin>); 2] =
        [("rate", "rad/s", p.over_rate(index, order)), ("current", "A", p.over_current(index, order))];
    if slices.iter().all(|s| s.2.len() < 4) {
        return;
    }
    page.heading(format!("Order {order} over rate and current"));
    page.paragraph(
        Class::Faint,
        "A torque that depends on the angle only: the amplitude falls with the rate. Encoder eccentricity: the amplitude of the angle increments rises with the rate. Torque ripple: the amplitude rises with the current.",
    );
    page.side_by_side(|page| {
        for (name, x_unit, bins) in slices {
            let Some(largest) = bins.iter().map(|b| b.mean + b.confidence.min(b.mean)).reduce(f64::max) else { continue };
            let (low, high) = bins.iter().map(|b| b.at).min_max();
            let mut plot = Plot::new(
                Axis::new(with_margin((low, high)), 6, name, x_unit),
                Axis::new((0.0, 1.1 * largest), 4, &format!("amplitude at order {order}"), unit(axis, f.channel)),
                HALF_WIDTH,
                230.0,
            );
            for b in &bins {
                plot.whisker(b.at, b.mean, b.confidence);
            }
            page.figure(&plot.finish(), "");
        }
    });
}

/// The residual in the direction of motion, over the time since the last reversal or start.
fn reversals(p: &ResidualPlotData, index: usize, axis: identification::log::Axis, f: &ChannelFit, page: &mut Page) {
    let Some(bins) = after_reversals(p, index) else { return };
    let reach = bins.iter().map(|b| b.mean.abs() + b.confidence.min(b.mean.abs() + f.noise)).max_or_zero().max(0.1 * f.noise);
    page.heading("After a reversal");
    let mut plot = Plot::new(
        Axis::new((0.0, AFTER_REVERSAL_S), 10, "time since the last reversal or start", "s"),
        Axis::new((-1.1 * reach, 1.1 * reach), 4, "mean residual in the direction of motion", unit(axis, f.channel)),
        WIDTH,
        210.0,
    );
    plot.level(0.0, "zero");
    for b in &bins {
        plot.whisker(b.at, b.mean, b.confidence);
    }
    page.figure(&plot.finish(), "Positive: the measured value leads the model in the direction of motion.");
}

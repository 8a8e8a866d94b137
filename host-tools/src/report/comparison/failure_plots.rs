//! ResidualPlotData of where a model fails: orders of the angle, how the strongest goes with rate and current, what follows a reversal.

use crate::identify::fit::ChannelFit;
use crate::identify::residual::harmonics::Spectrum;
use crate::identify::residual::plot_data::ResidualPlotData;
use crate::report::page::{Page, swatch};
use crate::report::plot::{Axis, Plot, with_room};
use crate::report::unit;
use crate::statistics::Extremes;
use crate::statistics::bins::{Bin, binned};

/// Width of a plot across the page and of one of a pair, px.
const WIDE: f64 = 980.0;
const HALF: f64 = 480.0;
/// Orders that are always drawn; more only where something stands out beyond.
const FEWEST_ORDERS: usize = 40;
/// Time after a reversal that is drawn, s.
const AFTER_S: f64 = 1.0;

/// The pictures of channel `index`: its order spectrum, the strongest order over rate and current, the residual after reversals.
pub fn pictures(p: &ResidualPlotData, index: usize, f: &ChannelFit, page: &mut Page) {
    if let Some(s) = p.orders(index) {
        orders(&s, page);
        two_way(p, index, strongest(&s), f, page);
    }
    reversals(p, index, f, page);
}

/// The order that stands out most against its level, and whether it does.
fn strongest(s: &Spectrum) -> (u32, bool) {
    let over = |k: usize| s.amplitude[k] > s.level[k];
    let best = (0..s.amplitude.len())
        .max_by(|&a, &b| (over(a), s.amplitude[a]).partial_cmp(&(over(b), s.amplitude[b])).unwrap_or(std::cmp::Ordering::Equal));
    best.map_or((1, false), |k| (k as u32 + 1, over(k)))
}

/// Amplitude by order, with the level that noise keeps below.
fn orders(s: &Spectrum, page: &mut Page) {
    if s.amplitude.len() < 4 {
        return;
    }
    let beyond = (0..s.amplitude.len()).rev().find(|&k| s.amplitude[k] > s.level[k]).map_or(0, |k| k + 1);
    let shown = (beyond + beyond / 4).max(FEWEST_ORDERS).min(s.amplitude.len());
    let percent: Vec<f64> = s.share.iter().map(|share| 100.0 * share).collect();
    let most = percent[..shown].iter().copied().max_or_zero();
    page.push("<h3>Orders: what repeats so many times per turn</h3>");
    let mut plot = Plot::new(
        Axis::new((0.0, shown as f64 + 1.0), 14, "order (periods per turn)", ""),
        Axis::new((0.0, 1.08 * most), 4, "part of the residual's variance", "%"),
        WIDE,
        220.0,
    );
    for (k, part) in percent[..shown].iter().enumerate() {
        let order = (k + 1) as f64;
        plot.bar((order - 0.35, order + 0.35), *part, if s.amplitude[k] > s.level[k] { "bar loud" } else { "bar" });
    }
    let chance = |k: usize| percent[k] * (s.level[k] / s.amplitude[k].max(f64::MIN_POSITIVE)).powi(2);
    let level: Vec<(f64, f64)> = (0..shown).map(|k| ((k + 1) as f64, chance(k).min(1.08 * most))).collect();
    plot.lines(&[level], "normal");
    page.figure(
        &plot.finish(),
        &format!(
            "{} reached by chance once in a thousand such pictures. Rows are weighted by the rate or its inverse where an order stands out more so. The lowest orders also collect what is slow.",
            swatch("modelled", "level of chance:")
        ),
    );
}

/// Amplitude of the strongest order over slices of the rate and of the current.
fn two_way(p: &ResidualPlotData, index: usize, (order, seen): (u32, bool), f: &ChannelFit, page: &mut Page) {
    let slices: Vec<(&str, &str, Vec<Bin>)> =
        vec![("rate", "rad/s", p.over_rate(index, order)), ("current", "A", p.over_current(index, order))];
    if !seen || slices.iter().all(|s| s.2.len() < 4) {
        return;
    }
    page.push(&format!("<h3>Order {order} over rate and current</h3>"));
    page.push("<p class=\"faint\">A torque that depends on the angle alone leaves less the faster the stand turns; an encoder that is off its centre leaves more in the angle's increments; torque ripple grows with the current.</p><div class=\"pair\">");
    for (name, x_unit, bins) in slices {
        let Some(most) = bins.iter().map(|b| b.mean + b.confidence.min(b.mean)).reduce(f64::max) else { continue };
        let (low, high) = bins.iter().map(|b| b.at).min_max();
        let mut plot = Plot::new(
            Axis::new(with_room((low, high)), 6, name, x_unit),
            Axis::new((0.0, 1.1 * most), 4, &format!("amplitude at order {order}"), unit(f.channel)),
            HALF,
            230.0,
        );
        for b in &bins {
            plot.whisker(b.at, b.mean, b.confidence);
        }
        page.figure(&plot.finish(), "");
    }
    page.push("</div>");
}

/// The residual in the direction of the motion, over the time since it last turned round or left rest.
fn reversals(p: &ResidualPlotData, index: usize, f: &ChannelFit, page: &mut Page) {
    let Some((since, along)) = p.after_reversals(index) else { return };
    let bins = binned(since.iter().copied(), along.iter().copied(), (0.0, AFTER_S), 50);
    if bins.len() < 8 {
        return;
    }
    let reach = bins.iter().map(|b| b.mean.abs() + b.confidence.min(b.mean.abs() + f.noise)).max_or_zero().max(0.1 * f.noise);
    page.push("<h3>After a reversal</h3>");
    let mut plot = Plot::new(
        Axis::new((0.0, AFTER_S), 10, "time since the rate changed its direction or left zero", "s"),
        Axis::new((-1.1 * reach, 1.1 * reach), 4, "mean residual along the motion", unit(f.channel)),
        WIDE,
        210.0,
    );
    plot.level(0.0, "zero");
    for b in &bins {
        plot.whisker(b.at, b.mean, b.confidence);
    }
    page.figure(&plot.finish(), "Positive: the measured value lies ahead of the model in the direction of the motion.");
}

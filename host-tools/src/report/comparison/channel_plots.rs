//! The plots of one channel: measured beside modelled, the residual, how it scatters, what it depends on.

use super::html;
use crate::identify::fit::prepared_log::ComparedChannel;
use crate::identify::fit::{ChannelFit, PreparedLog};
use crate::model::Channel;
use crate::report::page::{Page, swatch};
use crate::report::plot::envelope::{Pieces, envelope, extent};
use crate::report::plot::{Axis, Plot, with_room};
use crate::report::residual::{Along, rms_over_time};
use crate::report::{quantity, unit};
use crate::statistics::Extremes;
use crate::statistics::bins::binned;
use crate::statistics::series::{autocorrelation, histogram};
use drive_model::Coordinate;

/// Width of a plot across the page and of one of a pair, px.
const WIDE: f64 = 980.0;
const HALF: f64 = 480.0;
/// Columns into which a long series is gathered.
const COLUMNS: usize = 1500;
/// Length of the close-up, s.
const CLOSE_UP_S: f64 = 2.0;

/// The whole log.
pub(super) fn overview(record: &PreparedLog, compared: &ComparedChannel, f: &ChannelFit, page: &mut Page) {
    let Some((&first, &last)) = record.t_s.first().zip(record.t_s.last()) else { return };
    traces(record, compared, f, (first, last), page);
}

/// The 2 s in which the residual is largest, where the log is much longer than that.
pub(super) fn close_up(record: &PreparedLog, compared: &ComparedChannel, f: &ChannelFit, page: &mut Page) {
    let Some((&first, &last)) = record.t_s.first().zip(record.t_s.last()) else { return };
    if last - first < 3.0 * CLOSE_UP_S {
        return;
    }
    let windows = ((last - first) / CLOSE_UP_S).floor();
    let sizes = rms_over_time(record, &f.residual, windows as usize);
    let worst = sizes.iter().enumerate().filter_map(|(k, s)| s.map(|s| (k, s))).max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((worst, _)) = worst else { return };
    let length = (last - first) / windows;
    let from = first + worst as f64 * length;
    page.push("<h3>Close-up: where the residual is largest</h3>");
    traces(record, compared, f, (from, from + length), page);
}

/// Measured and modelled above, the residual below, over a stretch of time.
fn traces(record: &PreparedLog, compared: &ComparedChannel, f: &ChannelFit, range: (f64, f64), page: &mut Page) {
    let lag = if compared.channel == Channel::Angle { record.angle_lag() } else { 0 };
    let measured = |row: usize| -> f64 {
        let y = compared.measured.get(row).copied().unwrap_or(f64::NAN);
        match (lag, row.checked_sub(lag).and_then(|before| compared.measured.get(before))) {
            (0, _) => y,
            (_, Some(before)) => y - before,
            _ => f64::NAN,
        }
    };
    let gap = crate::log::GAP_INTERVALS * record.dt_s;
    let pieces = |value: &dyn Fn(usize, f64) -> f64| -> Pieces {
        let points =
            record.t_s.iter().zip(&f.residual).enumerate().map(|(row, (t, r))| (*t, if r.is_finite() { value(row, *r) } else { f64::NAN }));
        envelope(points, range, COLUMNS, gap)
    };
    let seen = pieces(&|row, _| measured(row));
    let model = pieces(&|row, r| measured(row) - r);
    let residual = pieces(&|_, r| r);
    let unit = unit(f.channel);
    let time = || Axis::new(range, 10, "time", "s");
    if let Some(extent) = extent([&seen, &model].into_iter()) {
        let mut plot = Plot::new(time(), Axis::new(with_room(extent), 5, quantity(f.channel), unit), WIDE, 260.0);
        held_out(record, range, &mut plot);
        plot.lines(&seen, "measured");
        plot.lines(&model, "modelled");
        page.figure(&plot.finish(), &html::two_traces());
    }
    if let Some((low, high)) = extent([&residual].into_iter()) {
        let reach = low.abs().max(high.abs()).max(2.2 * f.noise);
        let mut plot = Plot::new(time(), Axis::new((-1.06 * reach, 1.06 * reach), 4, "measured − modelled", unit), WIDE, 190.0);
        held_out(record, range, &mut plot);
        plot.level(0.0, "zero");
        plot.lines(&residual, "residual");
        plot.band(-2.0 * f.noise, 2.0 * f.noise, "band");
        // Its edges show through a residual that covers it.
        plot.level(-2.0 * f.noise, "edge");
        plot.level(2.0 * f.noise, "edge");
        let held = if record.hold_out { swatch("held", "held out of the fit") } else { String::new() };
        page.figure(
            &plot.finish(),
            &format!(
                "{} {} {held}",
                swatch("residual", "residual"),
                swatch("band", "± 2 × noise: 95 % of the rows, if the model lacks nothing")
            ),
        );
    }
}

/// Most blocks that are shaded one by one: more are narrower than a pixel or two.
const MOST_BLOCKS: f64 = 150.0;

/// Shades the blocks that the fit never saw.
fn held_out(record: &PreparedLog, (from, to): (f64, f64), plot: &mut Plot) {
    const BLOCK_S: f64 = 2.0;
    if !record.hold_out || (to - from) / (4.0 * BLOCK_S) > MOST_BLOCKS {
        return;
    }
    let mut begin: Option<f64> = None;
    let from_row = record.t_s.partition_point(|t| *t < from);
    for (row, t) in record.t_s.iter().enumerate().skip(from_row).take_while(|(_, t)| **t <= to) {
        match (begin, record.held_out(row)) {
            (None, true) => begin = Some(*t),
            (Some(b), false) => {
                plot.shade(b, *t, "held");
                begin = None;
            }
            _ => {}
        }
    }
    if let Some(b) = begin {
        plot.shade(b, to, "held");
    }
}

/// Lags of the autocorrelation.
const LAGS: usize = 100;

/// Distribution and memory of the residual.
pub(super) fn noise_like(record: &PreparedLog, f: &ChannelFit, page: &mut Page) {
    let unit = unit(f.channel);
    let finite: Vec<f64> = f.residual.iter().copied().filter(|r| r.is_finite()).collect();
    if finite.len() < 50 {
        return;
    }
    let spread = (finite.iter().map(|r| r * r).sum::<f64>() / finite.len() as f64).sqrt();
    let reach = 4.0 * spread.max(f.noise);
    let h = histogram(&finite, reach, 60);
    let normal = |x: f64| (-0.5 * (x / f.noise).powi(2)).exp() / (f.noise * std::f64::consts::TAU.sqrt());
    let most = h.density.iter().copied().max_or_zero().max(normal(0.0).min(6.0 * h.density.iter().copied().max_or_zero()));
    page.push("<div class=\"pair\">");
    let mut plot = Plot::new(
        Axis::new((-reach, reach), 6, "measured − modelled", unit),
        Axis::new((0.0, 1.06 * most), 4, "density", &format!("1/({unit})")),
        HALF,
        250.0,
    );
    for (k, density) in h.density.iter().enumerate() {
        let left = h.from + k as f64 * h.width;
        plot.bar((left, left + h.width), *density, "bar");
    }
    let curve: Vec<(f64, f64)> = (0..=240).map(|k| -reach + 2.0 * reach * f64::from(k) / 240.0).map(|x| (x, normal(x))).collect();
    plot.lines(&[curve], "normal");
    page.figure(&plot.finish(), &format!("How the residual scatters. {} the normal curve of the noise alone", swatch("modelled", "")));

    let memory = autocorrelation(&f.residual, LAGS);
    let ms = record.dt_s * 1e3;
    let (least, most) = memory.correlation.iter().fold((-2.0 * memory.band, 2.0 * memory.band), |(l, m), c| (l.min(*c), m.max(*c)));
    let mut plot = Plot::new(
        Axis::new((0.0, (memory.correlation.len() + 1) as f64 * ms), 6, "later by", "ms"),
        Axis::new(with_room((least, most)), 5, "correlation with itself", ""),
        HALF,
        250.0,
    );
    plot.level(0.0, "zero");
    for (k, c) in memory.correlation.iter().enumerate() {
        let lag = (k + 1) as f64 * ms;
        plot.bar((lag - 0.35 * ms, lag + 0.35 * ms), *c, "bar");
    }
    plot.band(-memory.band, memory.band, "band");
    let angle =
        if f.channel == Channel::Angle { " Increments that share a reading are correlated at 20 ms by themselves (−½)." } else { "" };
    page.figure(&plot.finish(), &format!("Does the residual remember? {}{angle}", swatch("band", "95 % of white noise")));
    page.push("</div>");
}

/// The residual over each coordinate: means of bins with their confidence.
pub(super) fn over_coordinates(f: &ChannelFit, along: &[Along], page: &mut Page) {
    page.push("<h3>What the residual depends on</h3>");
    page.push("<p class=\"faint\">Mean residual in each bin, with its 95 % interval. Of a complete model all lie on zero, but for one bin in twenty.</p><div class=\"pair\">");
    for a in along {
        let bins = binned(a.values(f.residual.len()), f.residual.iter().copied(), a.range, a.bins);
        if bins.is_empty() {
            continue;
        }
        let reach = bins.iter().map(|b| b.mean.abs() + b.confidence.min(b.mean.abs() + f.noise)).max_or_zero().max(0.1 * f.noise);
        let (name, x_unit) = a.label.rsplit_once(", ").unwrap_or((a.label, ""));
        let x = if a.coordinate == Coordinate::Theta { Axis::turn(a.label) } else { Axis::new(a.range, 6, name, x_unit) };
        let mut plot = Plot::new(x, Axis::new((-1.1 * reach, 1.1 * reach), 4, "mean residual", unit(f.channel)), HALF, 230.0);
        plot.level(0.0, "zero");
        for bin in &bins {
            plot.whisker(bin.at, bin.mean, bin.confidence);
        }
        page.figure(&plot.finish(), "");
    }
    page.push("</div>");
}

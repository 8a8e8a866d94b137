//! The pictures of an explanation: the model as it was given beside the one with what was missing.

use drive_model::Coordinate;

use super::{sentences, words};
use crate::identify::explain::{Explanation, Shape};
use crate::identify::fit::prepared_log::ComparedChannel;
use crate::identify::fit::{ChannelFit, PreparedLog};
use crate::identify::residual::harmonics::Spectrum;
use crate::model::Channel;
use crate::report::plot::envelope::{Pieces, envelope, extent};
use crate::report::plot::svg::{Anchor, Drawing, Svg};
use crate::report::plot::{Axis, Plot, with_room};
use crate::report::residual::Along;
use crate::report::residual::rms_over_time;
use crate::report::{numbers, quantity, unit};
use crate::statistics::Extremes;
use crate::statistics::bins::binned;

/// Width of a plot across the page and of one of a pair, px.
const WIDE: f64 = 980.0;
const HALF: f64 = 480.0;
/// Columns into which a long series is gathered.
const COLUMNS: usize = 1500;
/// Length of the close-up, s.
const CLOSE_UP_S: f64 = 2.0;
/// Orders that are drawn at most, where nothing stands out beyond.
const ORDERS: usize = 60;

/// One channel before and after.
pub(super) struct Pair<'a> {
    /// How it was measured.
    pub compared: &'a ComparedChannel<'a>,
    /// With the model as it was given, fitted.
    pub before: &'a ChannelFit,
    /// With what was missing.
    pub after: &'a ChannelFit,
}

impl Pair<'_> {
    /// What is compared at a row: the value, or an angle's increment.
    fn measured(&self, record: &PreparedLog, row: usize) -> f64 {
        let y = self.compared.measured.get(row).copied().unwrap_or(f64::NAN);
        if self.compared.channel != Channel::Angle {
            return y;
        }
        row.checked_sub(record.angle_lag()).and_then(|k| self.compared.measured.get(k)).map_or(f64::NAN, |before| y - before)
    }
}

/// A line over time; `value` takes row and residual.
fn line(record: &PreparedLog, f: &ChannelFit, range: (f64, f64), value: impl Fn(usize, f64) -> f64) -> Pieces {
    let gap = crate::log::GAP_INTERVALS * record.dt_s;
    let points = record.t_s.iter().zip(&f.residual).enumerate();
    envelope(points.map(|(row, (t, r))| (*t, if r.is_finite() { value(row, *r) } else { f64::NAN })), range, COLUMNS, gap)
}

/// Begin and end of the record.
pub(super) fn whole(record: &PreparedLog) -> Option<(f64, f64)> {
    record.t_s.first().copied().zip(record.t_s.last().copied()).filter(|(first, last)| last > first)
}

/// The stretch in which the given model is worst; `None` where the log is hardly longer.
pub(super) fn worst(record: &PreparedLog, before: &ChannelFit) -> Option<(f64, f64)> {
    let (first, last) = whole(record)?;
    if last - first < 3.0 * CLOSE_UP_S {
        return None;
    }
    let windows = ((last - first) / CLOSE_UP_S).floor();
    let sizes = rms_over_time(record, &before.residual, windows as usize);
    let (worst, _) = sizes.iter().enumerate().filter_map(|(k, s)| s.map(|s| (k, s))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let length = (last - first) / windows;
    let from = first + worst as f64 * length;
    Some((from, from + length))
}

/// Measured, modelled before and after.
pub(super) fn traces(record: &PreparedLog, pair: &Pair, range: (f64, f64)) -> Option<Drawing> {
    let seen = line(record, pair.before, range, |row, _| pair.measured(record, row));
    let before = line(record, pair.before, range, |row, r| pair.measured(record, row) - r);
    let after = line(record, pair.after, range, |row, r| pair.measured(record, row) - r);
    let extent = extent([&seen, &before, &after].into_iter())?;
    let shows = pair.before.channel;
    let y = Axis::new(with_room(extent), 5, quantity(shows), unit(shows));
    let mut plot = Plot::new(Axis::new(range, 10, "time", "s"), y, WIDE, 260.0);
    plot.lines(&seen, "measured");
    plot.lines(&before, "before");
    plot.lines(&after, "after");
    Some(plot.finish())
}

/// Both residuals over time, with the band of the noise.
pub(super) fn residuals(record: &PreparedLog, pair: &Pair, range: (f64, f64)) -> Option<Drawing> {
    let (before, after) = (line(record, pair.before, range, |_, r| r), line(record, pair.after, range, |_, r| r));
    let (low, high) = extent([&before, &after].into_iter())?;
    let noise = pair.after.noise;
    let reach = 1.06 * low.abs().max(high.abs()).max(2.2 * noise);
    let y = Axis::new((-reach, reach), 4, "measured − modelled", unit(pair.before.channel));
    let mut plot = Plot::new(Axis::new(range, 10, "time", "s"), y, WIDE, 190.0);
    plot.level(0.0, "zero");
    plot.lines(&before, "before");
    plot.lines(&after, "after");
    for edge in [-2.0 * noise, 2.0 * noise] {
        plot.level(edge, "zero");
    }
    Some(plot.finish())
}

/// Mean residual over a coordinate, before and after, with 95 % intervals.
pub(super) fn over(pair: &Pair, a: &Along) -> Option<Drawing> {
    let bins = |f: &ChannelFit| binned(a.values(f.residual.len()), f.residual.iter().copied(), a.range, a.bins);
    let (before, after) = (bins(pair.before), bins(pair.after));
    if before.is_empty() {
        return None;
    }
    let noise = pair.after.noise;
    let reach = before.iter().chain(&after).map(|b| b.mean.abs() + b.confidence.min(b.mean.abs() + noise)).fold(0.1 * noise, f64::max);
    let (name, x_unit) = a.label.rsplit_once(", ").unwrap_or((a.label, ""));
    let x = if a.coordinate == Coordinate::Theta { Axis::turn(a.label) } else { Axis::new(a.range, 6, name, x_unit) };
    let mut plot = Plot::new(x, Axis::new((-1.1 * reach, 1.1 * reach), 4, "mean residual", unit(pair.before.channel)), HALF, 230.0);
    plot.level(0.0, "zero");
    for b in &before {
        plot.whisker(b.at, b.mean, b.confidence);
    }
    for b in &after {
        plot.lines(&[vec![(b.at, b.mean - b.confidence), (b.at, b.mean + b.confidence)]], "after");
        plot.dot((b.at, b.mean), 2.2, "mean-after");
    }
    Some(plot.finish())
}

/// Size of what repeats so many times per turn, before and after, in the channel's unit.
///
/// The spectra weight the rows differently (a torque leaves less in a fast rate); what an order accounts for of the residual's power is the
/// same question in all, and the amplitude drawn is that of a sine of this power.
pub(super) fn order_spectrum(pair: &Pair, before: &Spectrum, after: &Spectrum) -> Option<Drawing> {
    let sizes = |s: &Spectrum, f: &ChannelFit| s.share.iter().map(|share| (2.0 * share).sqrt() * f.rms).collect::<Vec<f64>>();
    let (sizes_before, sizes_after) = (sizes(before, pair.before), sizes(after, pair.after));
    let loud = before.amplitude.iter().zip(&before.level).rposition(|(a, l)| a > l).map_or(0, |k| k + 1);
    let shown = (loud + loud / 4).max(ORDERS).min(sizes_before.len());
    if shown < 4 {
        return None;
    }
    let most = sizes_before.iter().take(shown).chain(sizes_after.iter().take(shown)).copied().max_or_zero();
    let x = Axis::new((0.0, shown as f64 + 1.0), 12, "order (periods per turn)", "");
    let y = Axis::new((0.0, 1.08 * most), 4, "amplitude of the residual", unit(pair.before.channel));
    let mut plot = Plot::new(x, y, WIDE, 220.0);
    for (k, (b, a)) in sizes_before.iter().zip(&sizes_after).take(shown).enumerate() {
        let order = (k + 1) as f64;
        plot.bar((order - 0.4, order + 0.05), *b, "bar");
        plot.bar((order + 0.05, order + 0.4), *a, "bar-after");
    }
    Some(plot.finish())
}

/// What is left over its coordinate, bin by bin.
pub(super) fn shape(s: &Shape) -> Option<Drawing> {
    let (first, last) = s.bins.first().zip(s.bins.last())?;
    let reach = s.bins.iter().map(|b| b.mean.abs() + b.confidence.min(2.0 * b.mean.abs())).max_or_zero();
    let along = sentences::along(s);
    let (name, x_unit) = along.rsplit_once(", ").unwrap_or((along, ""));
    let x = if s.coordinate == Coordinate::Theta { Axis::turn(along) } else { Axis::new((first.at, last.at), 8, name, x_unit) };
    let (quantity, y_unit) = sentences::acts_on(s.acts_on);
    let mut plot = Plot::new(x, Axis::new((-1.1 * reach, 1.1 * reach), 4, quantity, y_unit), WIDE, 260.0);
    plot.level(0.0, "zero");
    for b in &s.bins {
        plot.whisker(b.at, b.mean, b.confidence);
    }
    Some(plot.finish())
}

/// Height of a bar of the staircase and of its channel's heading, px; where its bars begin and end.
const STEP: f64 = 22.0;
const HEADING: f64 = 26.0;
const BARS: (f64, f64) = (260.0, 900.0);

/// The falling error: for each channel a bar per stage, rms over noise on a logarithmic scale that begins at 1, where only noise is left.
pub(super) fn staircase(e: &Explanation) -> Drawing {
    let channels = e.stages.first().map_or(0, |s| s.outputs.len());
    let height = channels as f64 * (HEADING + STEP * e.stages.len() as f64 + 8.0) + 34.0;
    let ratios = e.stages.iter().flat_map(|s| &s.outputs).map(|o| o.ratio()).filter(|r| r.is_finite());
    // A decade at least, and room for the figure behind the longest bar.
    let decades = (1.2 * ratios.fold(1.0_f64, f64::max)).log10().max(1.0);
    let place = |ratio: f64| BARS.0 + (BARS.1 - BARS.0) * (ratio.max(1.0).log10() / decades).min(1.0);
    let mut svg = Svg::new(WIDE, height, "rms over noise of each channel, stage by stage");
    let bottom = height - 34.0;
    for power in 0..=decades.floor() as i32 {
        for part in [1.0, 2.0, 5.0] {
            let ratio = part * 10f64.powi(power);
            if ratio > 10f64.powf(decades) * 1.001 {
                continue;
            }
            let x = place(ratio);
            svg.line((x, 0.0), (x, bottom), if ratio == 1.0 { "zero" } else { "grid" });
            svg.text((x, bottom + 14.0), Anchor::Middle, "tick", &numbers::plain(ratio, 2));
        }
    }
    svg.text(((BARS.0 + BARS.1) / 2.0, height - 4.0), Anchor::Middle, "label", "rms over noise (1: only noise is left)");
    let mut y = 0.0;
    for channel in 0..channels {
        if let Some(o) = e.stages.first().and_then(|s| s.outputs.get(channel)) {
            svg.text((4.0, y + 18.0), Anchor::Start, "label", &format!("{}, {}", o.channel.column(), quantity(o.channel)));
        }
        y += HEADING;
        for (k, stage) in e.stages.iter().enumerate() {
            if let Some(o) = stage.outputs.get(channel) {
                let end = place(o.ratio()).max(BARS.0 + 2.0);
                let last = k + 1 == e.stages.len() && k > 0;
                svg.text((BARS.0 - 8.0, y + 14.5), Anchor::End, "tick", &words::stage(stage));
                svg.rect(BARS.0, y + 3.0, end - BARS.0, STEP - 6.0, if last { "bar-after" } else { "bar" });
                svg.text((end + 6.0, y + 14.5), Anchor::Start, "label", &numbers::significant(o.ratio(), 3));
            }
            y += STEP;
        }
        y += 8.0;
    }
    svg.finish()
}

//! Plots of measured, modelled and residual series, for one model or several beside each other.

use drive_model::Coordinate;

use super::coordinates::{AxisLabel, CoordinateAxis};
use super::plot::envelope::{Pieces, envelope, extent};
use super::plot::svg::Drawing;
use super::plot::{Axis, HALF_WIDTH, Plot, WIDTH, with_margin};
use super::{fitted_quantity, unit};
use identification::identify::fit::ChannelFit;
use identification::model::Channel;
use identification::recording::PreparedLog;
use identification::recording::prepared_log::ComparedChannel;
use identification::statistics::bins::{Bin, binned};

/// Columns of pixels into which a long series is condensed.
const MAX_POINTS: usize = 1500;
/// Duration of the close-up, s.
const CLOSE_UP_S: f64 = 2.0;
/// Held-out blocks are shaded up to this number: more would be narrower than a pixel or two.
const MAX_SHADED_BLOCKS: f64 = 150.0;

/// The residual of one model, with the style-sheet class of its line.
#[derive(Clone, Copy)]
pub struct PlotLine<'a> {
    /// The channel as this model has it.
    pub fit: &'a ChannelFit,
    /// Class of the line.
    pub class: &'static str,
}

/// What is compared at a row: the measured value, or an angle's increment.
fn measured(data: &PreparedLog, compared: &ComparedChannel, row: usize) -> f64 {
    let value = |row: usize| compared.measured.get(row).copied();
    if compared.channel != Channel::Angle || data.angle_is_absolute() {
        return value(row).unwrap_or(f64::NAN);
    }
    let before = row.checked_sub(data.angle_lag()).and_then(value);
    value(row).zip(before).map_or(f64::NAN, |(y, before)| y - before)
}

/// A series over time; `value` takes the row and its residual. Rows that are not compared leave a gap.
fn series(data: &PreparedLog, f: &ChannelFit, range: (f64, f64), value: impl Fn(usize, f64) -> f64) -> Pieces {
    let longest_step = identification::log::GAP_INTERVALS * data.dt_s;
    let rows = data.t_s.iter().zip(&f.residual).enumerate();
    let points = rows.map(|(row, (t, r))| (*t, if r.is_finite() { value(row, *r) } else { f64::NAN }));
    envelope(points, range, MAX_POINTS, longest_step)
}

/// First and last time of the log, s; `None` where there is one row only.
pub fn whole_log(data: &PreparedLog) -> Option<(f64, f64)> {
    data.t_s.first().copied().zip(data.t_s.last().copied()).filter(|(first, last)| last > first)
}

/// The 2 s in which the residual is largest; `None` where the log is not much longer than that.
pub fn worst_interval(data: &PreparedLog, f: &ChannelFit) -> Option<(f64, f64)> {
    let (first, last) = whole_log(data)?;
    if last - first < 3.0 * CLOSE_UP_S {
        return None;
    }
    let intervals = ((last - first) / CLOSE_UP_S).floor();
    let rms = rms_over_time(data, &f.residual, intervals as usize);
    let (worst, _) = rms.iter().enumerate().filter_map(|(k, s)| s.map(|s| (k, s))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let length = (last - first) / intervals;
    let from = first + worst as f64 * length;
    Some((from, from + length))
}

/// The measured series, and those of the models; held-out blocks are shaded if `held_out`.
pub fn traces(data: &PreparedLog, compared: &ComparedChannel, models: &[PlotLine], range: (f64, f64), held_out: bool) -> Option<Drawing> {
    let first = models.first()?.fit;
    let seen = series(data, first, range, |row, _| measured(data, compared, row));
    let modelled: Vec<Pieces> = models.iter().map(|m| series(data, m.fit, range, |row, r| measured(data, compared, row) - r)).collect();
    let extent = extent(std::iter::once(&seen).chain(&modelled))?;
    let y = Axis::new(with_margin(extent), 5, fitted_quantity(data.axis, first), unit(data.axis, first.channel));
    let mut plot = Plot::new(Axis::new(range, 10, "time", "s"), y, WIDTH, 260.0);
    if held_out {
        shade_held_out(data, range, &mut plot);
    }
    plot.lines(&seen, "measured");
    for (line, model) in modelled.iter().zip(models) {
        plot.lines(line, model.class);
    }
    Some(plot.finish())
}

/// The residuals of the models, with a band of ± 2 × noise; held-out blocks are shaded if `held_out`.
pub fn residuals(data: &PreparedLog, models: &[PlotLine], range: (f64, f64), held_out: bool) -> Option<Drawing> {
    let last = models.last()?.fit;
    let lines: Vec<Pieces> = models.iter().map(|m| series(data, m.fit, range, |_, r| r)).collect();
    let (low, high) = extent(lines.iter())?;
    let reach = 1.06 * low.abs().max(high.abs()).max(2.2 * last.noise);
    let y = Axis::new((-reach, reach), 4, "measured − modelled", unit(data.axis, last.channel));
    let mut plot = Plot::new(Axis::new(range, 10, "time", "s"), y, WIDTH, 190.0);
    if held_out {
        shade_held_out(data, range, &mut plot);
    }
    plot.level(0.0, "zero");
    for (line, model) in lines.iter().zip(models) {
        plot.lines(line, model.class);
    }
    let width = 2.0 * last.noise;
    plot.band(-width, width, "band");
    // The edges stay visible through a residual that covers the band.
    plot.level(-width, "edge");
    plot.level(width, "edge");
    Some(plot.finish())
}

/// Shades the blocks that the fit did not use.
fn shade_held_out(data: &PreparedLog, (from, to): (f64, f64), plot: &mut Plot) {
    const BLOCK_S: f64 = 2.0;
    if data.held_out.is_none() || (to - from) / (4.0 * BLOCK_S) > MAX_SHADED_BLOCKS {
        return;
    }
    let mut begin: Option<f64> = None;
    let from_row = data.t_s.partition_point(|t| *t < from);
    for (row, t) in data.t_s.iter().enumerate().skip(from_row).take_while(|(_, t)| **t <= to) {
        match (begin, data.held_out(row)) {
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

/// Mean residual over a coordinate with 95 % intervals, for each model; `None` where too few rows were compared.
pub fn over_coordinate(models: &[PlotLine], along: &CoordinateAxis) -> Option<Drawing> {
    let bins = |f: &ChannelFit| binned(along.values(f.residual.len()), f.residual.iter().copied(), along.range, along.bins);
    let all: Vec<Vec<Bin>> = models.iter().map(|m| bins(m.fit)).collect();
    if all.first()?.is_empty() {
        return None;
    }
    let last = models.last()?.fit;
    let noise = last.noise;
    let reach = all.iter().flatten().map(|b| b.mean.abs() + b.confidence.min(b.mean.abs() + noise)).fold(0.1 * noise, f64::max);
    let y = Axis::new((-1.1 * reach, 1.1 * reach), 4, "mean residual", unit(along.axis, last.channel));
    let mut plot = Plot::new(coordinate_axis(along.coordinate, along.label, along.range, 6), y, HALF_WIDTH, 230.0);
    plot.level(0.0, "zero");
    for (k, bins) in all.iter().enumerate() {
        for b in bins {
            if k == 0 {
                plot.whisker(b.at, b.mean, b.confidence);
            } else {
                plot.lines(&[vec![(b.at, b.mean - b.confidence), (b.at, b.mean + b.confidence)]], "after");
                plot.dot((b.at, b.mean), 2.2, "mean-after");
            }
        }
    }
    Some(plot.finish())
}

/// Axis of a coordinate.
pub fn coordinate_axis(coordinate: Coordinate, label: AxisLabel, range: (f64, f64), ticks: usize) -> Axis {
    if coordinate == Coordinate::Theta { Axis::turn(&label.to_string()) } else { Axis::new(range, ticks, label.name, label.unit) }
}

/// Root mean square of the residual in `columns` equal intervals of time; `None` where no row was compared.
pub fn rms_over_time(data: &PreparedLog, residual: &[f64], columns: usize) -> Vec<Option<f64>> {
    let mut sums = vec![(0.0, 0usize); columns];
    let Some((&first, &last)) = data.t_s.first().zip(data.t_s.last()) else { return Vec::new() };
    let scale = columns as f64 / (last - first).max(f64::MIN_POSITIVE);
    for (t, r) in data.t_s.iter().zip(residual).filter(|(_, r)| r.is_finite()) {
        let column = (((t - first) * scale) as usize).min(columns.saturating_sub(1));
        if let Some((sum, n)) = sums.get_mut(column) {
            *sum += r * r;
            *n += 1;
        }
    }
    sums.into_iter().map(|(sum, n)| (n > 0).then(|| (sum / n as f64).sqrt())).collect()
}

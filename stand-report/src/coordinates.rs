//! The coordinates over which residuals are plotted, row by row, as far as the log has them.

use std::f64::consts::TAU;
use std::fmt;

use drive_model::Coordinate;

use identification::identify::fit::ChannelFit;
use identification::log::{Axis, Log};
use identification::model::Channel;
use identification::recording::PreparedLog;
use identification::statistics::Extremes;

/// Name and unit of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisLabel {
    /// Name of the quantity.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
}

impl fmt::Display for AxisLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.name, self.unit)
    }
}

/// One coordinate of a log.
pub struct CoordinateAxis<'a> {
    /// The coordinate.
    pub coordinate: Coordinate,
    /// Label of its axis.
    pub label: AxisLabel,
    /// The axis of the drive.
    pub axis: Axis,
    /// Smallest and largest value.
    pub range: (f64, f64),
    /// Number of bins.
    pub bins: usize,
    value: Box<dyn Fn(usize) -> f64 + 'a>,
}

impl CoordinateAxis<'_> {
    /// The coordinate, row by row.
    pub fn values(&self, rows: usize) -> impl Iterator<Item = f64> {
        (0..rows).map(|row| (self.value)(row))
    }
}

/// Range of a coordinate, relative to its largest value, below which the coordinate counts as constant.
const MIN_RELATIVE_RANGE: f64 = 1e-6;

/// The coordinates over which the residuals of `channels` can be plotted.
///
/// Rate and current are the modelled ones where they are compared: over a measured coordinate its own noise would produce a slope.
pub fn coordinates<'a>(log: &'a Log, data: &'a PreparedLog<'a>, channels: &'a [ChannelFit]) -> Vec<CoordinateAxis<'a>> {
    let modelled = |shows: Channel| {
        let measured = data.channels.iter().find(|c| c.channel == shows)?.measured;
        let residual = &channels.iter().find(|f| f.channel == shows)?.residual;
        Some(move |row: usize| match (measured.get(row), residual.get(row)) {
            (Some(y), Some(r)) if r.is_finite() => y - r,
            (Some(y), _) => *y,
            _ => f64::NAN,
        })
    };
    let column = |name: &str| {
        let values = log.column(name)?;
        Some(move |row: usize| values.get(row).copied().unwrap_or(f64::NAN))
    };
    let mut list = Vec::new();
    let mut along = |coordinate, label: AxisLabel, bins, range: Option<(f64, f64)>, value: Box<dyn Fn(usize) -> f64 + 'a>| {
        let range = range.unwrap_or_else(|| (0..data.len()).map(&value).filter(|v| v.is_finite()).min_max());
        if range.1 - range.0 > MIN_RELATIVE_RANGE * range.1.abs().max(range.0.abs()) {
            let label = AxisLabel { name: data.axis.quantity(label.name), unit: data.axis.unit(label.unit) };
            list.push(CoordinateAxis { coordinate, label, axis: data.axis, range, bins, value });
        }
    };
    if let Some(theta) = data.theta {
        let name = if log.theta_zero_is_index() { "angle within the turn from the index" } else { "angle within the turn" };
        let label = AxisLabel { name, unit: "rad" };
        let value = move |row: usize| theta.get(row).map_or(f64::NAN, |t| t.rem_euclid(TAU));
        along(Coordinate::Theta, label, 72, Some((0.0, TAU)), Box::new(value));
    }
    let label = AxisLabel { name: "rate", unit: "rad/s" };
    if let Some(value) = modelled(Channel::Rate) {
        along(Coordinate::Omega, label, 40, None, Box::new(value));
    } else if let Some(value) = column("omega_rad_s") {
        along(Coordinate::Omega, label, 40, None, Box::new(value));
    } else if let Some(theta) = data.theta {
        let lag = data.angle_lag();
        let value = move |row: usize| {
            let before = row.checked_sub(lag).and_then(|k| theta.get(k).zip(data.t_s.get(k)));
            match (before, theta.get(row).zip(data.t_s.get(row))) {
                (Some((a, t)), Some((b, u))) if u > t && u - t < 1.5 * lag as f64 * data.dt_s => (b - a) / (u - t),
                _ => f64::NAN,
            }
        };
        along(Coordinate::Omega, label, 40, None, Box::new(value));
    }
    if let Some(value) = modelled(Channel::Current) {
        along(Coordinate::Current, AxisLabel { name: "current", unit: "A" }, 40, None, Box::new(value));
    } else if let Some(value) = column("i_A") {
        along(Coordinate::Current, AxisLabel { name: "current", unit: "A" }, 40, None, Box::new(value));
    }
    if let Some(rate) = modelled(Channel::Rate) {
        // Over ± 20 ms within the same segment.
        let reach = data.angle_lag();
        let value = move |row: usize| {
            let (a, b) = (row.saturating_sub(reach), row + reach);
            match (data.t_s.get(a), data.t_s.get(b)) {
                (Some(t), Some(u)) if u > t && u - t < 1.5 * (b - a) as f64 * data.dt_s => (rate(b) - rate(a)) / (u - t),
                _ => f64::NAN,
            }
        };
        along(Coordinate::Acceleration, AxisLabel { name: "acceleration", unit: "rad/s²" }, 40, None, Box::new(value));
    }
    if let Some(value) = column("temp_C") {
        along(Coordinate::Temperature, AxisLabel { name: "winding temperature", unit: "°C" }, 30, None, Box::new(value));
    }
    if let Some(value) = column("t_s") {
        // Wide enough for several independent clusters of rows each.
        let bins = (data.len() / 1200).clamp(4, 60);
        along(Coordinate::Time, AxisLabel { name: "time", unit: "s" }, bins, None, Box::new(value));
    }
    let runs = log.runs();
    if runs.len() > 1 {
        let value = move |row: usize| runs.partition_point(|run| run.rows.end <= row) as f64 + 1.0;
        let range = (0.5, runs.len() as f64 + 0.5);
        along(Coordinate::Log, AxisLabel { name: "log", unit: "number" }, runs.len(), Some(range), Box::new(value));
    }
    list
}

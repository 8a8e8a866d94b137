//! The residual of each output over every coordinate and over the harmonic order, as numbers: the plots of the HTML report for other pages.

use drive_model::Coordinate;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::misfit_plots::{after_reversals, order_shares, strongest};
use crate::coordinates::{CoordinateAxis, coordinates};
use crate::json::{Entries, value};
use crate::{column, unit};
use identification::identify::fit::{ChannelFit, FitResult};
use identification::identify::residual::plot_data::ResidualPlotData;
use identification::log::Log;
use identification::recording::PreparedLog;
use identification::statistics::bins::{Bin, binned};

#[derive(Serialize, JsonSchema)]
struct Profiles {
    unit: &'static str,
    /// Standard deviation of the noise, in `unit`.
    noise: f64,
    coordinates: Vec<OverCoordinate>,
    /// `None`: less than one revolution.
    orders: Option<Orders>,
}

#[derive(Serialize, JsonSchema)]
struct OverCoordinate {
    coordinate: &'static str,
    name: &'static str,
    unit: &'static str,
    /// Middle of the bin, mean residual, half-width of its 95 % interval.
    bins: Vec<[f64; 3]>,
    /// Index of the bin whose mean exceeds its interval most; `None`: no bin does.
    worst: Option<usize>,
}

#[derive(Serialize, JsonSchema)]
struct Orders {
    /// Share of the residual variance by harmonic order from 1 on, %.
    percent: Vec<f64>,
    /// Share that noise exceeds in one of 1000 such spectra, %.
    level_percent: Vec<f64>,
    /// The order that exceeds the level most.
    strongest: u32,
    significant: bool,
}

/// The profiles of `result`, by output.
pub fn profiles_json(log: &Log, data: &PreparedLog, result: &FitResult) -> Value {
    let along = coordinates(log, data, &result.channels);
    let plot_data = ResidualPlotData::new(log, data, result);
    let of_output = |(index, fit): (usize, &ChannelFit)| {
        let mut coordinates: Vec<OverCoordinate> = along.iter().filter_map(|along| over(along, fit)).collect();
        if let Some(bins) = plot_data.as_ref().and_then(|p| after_reversals(p, index)) {
            coordinates.extend(profile(Coordinate::History.name(), "time since the last reversal or start", "s", &bins));
        }
        let orders = plot_data.as_ref().and_then(|p| p.spectrum(index)).and_then(|spectrum| {
            let (percent, level_percent) = order_shares(&spectrum)?;
            let (strongest, significant) = strongest(&spectrum);
            Some(Orders { percent, level_percent, strongest, significant })
        });
        let unit = unit(data.axis, fit.channel);
        (column(data.axis, fit.channel).to_owned(), Profiles { unit, noise: fit.noise, coordinates, orders })
    };
    value(&Entries(result.channels.iter().enumerate().map(of_output).collect()))
}

/// The mean residual over one coordinate; `None` where too few rows were compared.
fn over(along: &CoordinateAxis, fit: &ChannelFit) -> Option<OverCoordinate> {
    let bins = binned(along.values(fit.residual.len()), fit.residual.iter().copied(), along.range, along.bins);
    profile(along.coordinate.name(), along.label.name, along.label.unit, &bins)
}

fn profile(coordinate: &'static str, name: &'static str, unit: &'static str, bins: &[Bin]) -> Option<OverCoordinate> {
    let excess = |bin: &Bin| bin.mean.abs() - bin.confidence;
    let worst = bins.iter().enumerate().filter(|(_, bin)| excess(bin) > 0.0).max_by(|a, b| excess(a.1).total_cmp(&excess(b.1)));
    let worst = worst.map(|(k, _)| k);
    let bins: Vec<[f64; 3]> = bins.iter().map(|bin| [bin.at, bin.mean, bin.confidence]).collect();
    (!bins.is_empty()).then_some(OverCoordinate { coordinate, name, unit, bins, worst })
}

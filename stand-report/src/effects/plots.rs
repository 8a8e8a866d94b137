//! The plots of an effect: both traces over time, and their difference over the coordinate of the effect.

use drive_model::{Abscissa, Card, Coordinate};

use super::demonstration::{motion_text, output_label};
use super::simulate::{SimulatedPair, Trace};
use super::unit;
use crate::digits;
use crate::html::Markup;
use crate::plot::envelope::{envelope, extent};
use crate::plot::svg::Drawing;
use crate::plot::{Axis, Plot, WIDTH, with_margin};
use identification::statistics::Extremes;

/// Height of each plot, px.
const HEIGHT: f64 = 300.0;
/// Number of points of the difference that are drawn, at most.
const MAX_POINTS: usize = 2500;

/// Two plots with their captions.
pub(super) fn plots(card: &Card, pair: &SimulatedPair) -> [(Drawing, Markup); 2] {
    [traces(card, pair), difference(card, pair)]
}

fn traces(card: &Card, pair: &SimulatedPair) -> (Drawing, Markup) {
    let d = &pair.demonstration;
    let line = |trace: &Trace| {
        let points = trace.t_s.iter().copied().zip(trace.output.iter().copied());
        envelope(points, (0.0, d.duration_s), 1500, f64::INFINITY)
    };
    let (without, with) = (line(&pair.without), line(&pair.with));
    let (name, output_unit) = output_label(d.output);
    let extent = extent([&without, &with].into_iter()).unwrap_or((0.0, 1.0));
    let y = Axis::new(with_margin(extent), 5, name, output_unit);
    let mut plot = Plot::new(Axis::new((0.0, d.duration_s), 10, "time", "s"), y, WIDTH, HEIGHT);
    plot.level(0.0, "zero");
    plot.lines(&without, "measured");
    plot.lines(&with, "modelled");
    let values: Vec<String> = card
        .parameters
        .iter()
        .zip(&pair.parameters)
        .map(|(p, v)| format!("{} = {} {}", p.name, digits(*v), unit(p.unit)).trim_end().to_owned())
        .collect();
    let also: String =
        d.added.iter().map(|(effect, parameter, value)| format!(" Both contain {effect} ({parameter} = {}).", digits(*value))).collect();
    let caption = Markup::swatch("measured", "without")
        .then(" ")
        .then(Markup::swatch("modelled", &format!("with {}: {}", card.id, values.join(", "))))
        .then(format!(". Default stand, simulated without noise; {}.{also}", motion_text(d.motion)));
    (plot.finish(), caption)
}

fn difference(card: &Card, pair: &SimulatedPair) -> (Drawing, Markup) {
    let difference = pair.difference();
    let (_, output_unit) = output_label(pair.demonstration.output);
    let range = difference.iter().copied().chain([0.0]).min_max();
    let abscissa = &pair.with.abscissa;
    let span = with_margin(abscissa.iter().copied().min_max());
    let axis = |name: &str, unit: &str| Axis::new(span, 8, name, unit);
    let x = match pair.demonstration.abscissa {
        Abscissa::TotalAngle => axis("angle", "rad"),
        Abscissa::Coordinate(Coordinate::Theta) => Axis::turn("angle within the turn, rad"),
        Abscissa::Coordinate(Coordinate::Omega) => axis("rate", "rad/s"),
        Abscissa::Coordinate(Coordinate::Current) => axis("current", "A"),
        Abscissa::Coordinate(Coordinate::Temperature) => axis("winding temperature", "°C"),
        Abscissa::Coordinate(Coordinate::Time | Coordinate::Log) => axis("time", "s"),
        Abscissa::Coordinate(Coordinate::Acceleration) => axis("angular acceleration", "rad/s²"),
        Abscissa::Coordinate(Coordinate::History) => axis("time since the last reversal", "s"),
    };
    let mut plot = Plot::new(x, Axis::new(with_margin(range), 5, "with − without", output_unit), WIDTH, HEIGHT);
    plot.level(0.0, "zero");
    let stride = abscissa.len().div_ceil(MAX_POINTS).max(1);
    let points: Vec<Vec<(f64, f64)>> = abscissa.iter().copied().zip(difference.iter().copied()).step_by(stride).map(|p| vec![p]).collect();
    plot.lines(&points, "cloud");
    let caption = Markup::swatch("residual", "difference").then(format!(", row by row: the residual of a model that lacks {}.", card.id));
    (plot.finish(), caption)
}

//! The picture of an effect: both traces over time, and their difference over the coordinate in which it shows.

use drive_model::{Card, Coordinate};

use super::experiment::Over;
use super::simulate::Beside;
use super::unit;
use crate::report::digits;
use crate::report::page::swatch;
use crate::report::plot::envelope::{envelope, extent};
use crate::report::plot::svg::Drawing;
use crate::report::plot::{Axis, Plot, with_room};

/// Width of the plots, px.
const WIDTH: f64 = 980.0;
/// Most points of the cloud.
const MOST_POINTS: usize = 2500;

/// Two drawings, each with its caption in markup.
pub(super) fn drawings(card: &Card, beside: &Beside) -> Vec<(Drawing, String)> {
    vec![traces(card, beside), difference(card, beside)]
}

fn traces(card: &Card, beside: &Beside) -> (Drawing, String) {
    let seconds = beside.experiment.seconds;
    let line =
        |trace: &super::Trace| envelope(trace.t_s.iter().copied().zip(trace.shown.iter().copied()), (0.0, seconds), 1500, f64::INFINITY);
    let (without, with) = (line(&beside.without), line(&beside.with));
    let (name, shown_unit) = beside.experiment.shown.label();
    let extent = extent([&without, &with].into_iter()).unwrap_or((0.0, 1.0));
    let mut plot = Plot::new(Axis::new((0.0, seconds), 10, "time", "s"), Axis::new(with_room(extent), 5, name, shown_unit), WIDTH, 300.0);
    plot.level(0.0, "zero");
    plot.lines(&without, "measured");
    plot.lines(&with, "modelled");
    let sizes: Vec<String> = card
        .parameters
        .iter()
        .zip(&beside.parameters)
        .map(|(p, v)| format!("{} = {} {}", p.name, digits(*v), unit(p.unit)).trim_end().to_owned())
        .collect();
    let mut besides = String::new();
    for (effect, parameter, value) in beside.experiment.besides {
        besides.push_str(&format!(" Both have {effect} besides ({parameter} = {}).", digits(*value)));
    }
    let caption = format!(
        "{} {}. Simulated on the default stand, without noise: {}.{besides}",
        swatch("measured", "without"),
        swatch("modelled", &format!("with {}: {}", card.id, sizes.join(", "))),
        beside.experiment.motion.says(),
    );
    (plot.finish(), caption)
}

fn difference(card: &Card, beside: &Beside) -> (Drawing, String) {
    let difference = beside.difference();
    let (_, shown_unit) = beside.experiment.shown.label();
    let fold = |range: (f64, f64), v: &f64| (range.0.min(*v), range.1.max(*v));
    let range = difference.iter().fold((0.0, 0.0), fold);
    let over = &beside.with.over;
    let over_range = over.iter().fold((f64::INFINITY, f64::NEG_INFINITY), fold);
    let label = |name: &str, unit: &str| Axis::new(with_room(over_range), 8, name, unit);
    let x = match beside.experiment.over {
        Over::ManyTurns => label("angle", "rad"),
        Over::Coordinate(Coordinate::Theta) => Axis::turn("angle within the turn, rad"),
        Over::Coordinate(Coordinate::Omega) => label("rate", "rad/s"),
        Over::Coordinate(Coordinate::Current) => label("current", "A"),
        Over::Coordinate(Coordinate::Temperature) => label("winding temperature", "°C"),
        Over::Coordinate(Coordinate::Time) => label("time", "s"),
        Over::Coordinate(Coordinate::Acceleration) => label("angular acceleration", "rad/s²"),
        Over::Coordinate(Coordinate::History) => label("time since the last reversal", "s"),
    };
    let mut plot = Plot::new(x, Axis::new(with_room(range), 5, "with − without", shown_unit), WIDTH, 300.0);
    plot.level(0.0, "zero");
    let stride = over.len().div_ceil(MOST_POINTS).max(1);
    let points: Vec<Vec<(f64, f64)>> = over.iter().copied().zip(difference.iter().copied()).step_by(stride).map(|p| vec![p]).collect();
    plot.lines(&points, "cloud");
    (plot.finish(), format!("{}, row by row: what a model that lacks {} leaves over.", swatch("residual", "the difference"), card.id))
}

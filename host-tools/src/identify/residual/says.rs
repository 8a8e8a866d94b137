//! What was found, in sentences.

use std::collections::HashMap;

use drive_model::Coordinate;

use super::Misfit;
use super::search::{Found, InChannel, SEEN_LOG10};
use super::shapes::{Acts, Kind};
use crate::model::Channel;

/// One failure for each channel and coordinate, most telling first: in the order in which the coordinates were found, and within one the
/// channel that shows it best.
pub fn misfits(found: Vec<Found>) -> Vec<Misfit> {
    let mut coordinates: Vec<Coordinate> = Vec::new();
    let mut gains: HashMap<&'static str, f64> = HashMap::new();
    for f in &found {
        if !coordinates.contains(&f.coordinate) {
            coordinates.push(f.coordinate);
        }
        *gains.entry(f.coordinate.name()).or_default() += f.gain;
    }
    let gain = |c: &Coordinate| gains.get(c.name()).copied().unwrap_or(0.0);
    coordinates.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let mut list = Vec::new();
    for coordinate in coordinates {
        let all: Vec<&Found> = found.iter().filter(|f| f.coordinate == coordinate).collect();
        let mut here: Vec<Misfit> = Vec::new();
        for shows in [Channel::Rate, Channel::Angle, Channel::Current, Channel::Voltage, Channel::Torque] {
            let parts: Vec<(&Found, &InChannel)> =
                all.iter().filter_map(|f| f.channels.iter().find(|c| c.channel == shows).map(|c| (*f, c))).collect();
            let Some((main, _)) = parts.iter().max_by(|a, b| a.1.share.total_cmp(&b.1.share)) else { continue };
            let share = parts.iter().map(|p| p.1.share).sum::<f64>().min(1.0);
            let log10_p = parts.iter().filter(|p| p.1.share > 0.0).map(|p| p.1.log10_p).fold(0.0, f64::min);
            if share <= 0.0 || log10_p >= SEEN_LOG10 {
                continue;
            }
            let parts: Vec<_> = parts.iter().filter(|p| p.1.share > 0.0 && p.1.log10_p < SEEN_LOG10).collect();
            let orders: Vec<u32> = orders(&parts.iter().map(|p| p.0).collect::<Vec<_>>());
            here.push(Misfit {
                output: shows,
                coordinate,
                share,
                order: orders.first().copied(),
                p_value: 10f64.powf(log10_p),
                log10_p,
                says: sentence(shows, share, main, &orders),
            });
        }
        here.sort_by(|a, b| b.share.total_cmp(&a.share));
        list.extend(here);
    }
    list
}

/// Orders of the findings, the strongest first.
fn orders(found: &[&Found]) -> Vec<u32> {
    let mut list: Vec<(u32, f64)> = Vec::new();
    for f in found {
        if let Kind::Order(n) = f.kind {
            match list.iter_mut().find(|o| o.0 == n) {
                Some(o) => o.1 += f.gain,
                None => list.push((n, f.gain)),
            }
        }
    }
    list.sort_by(|a, b| b.1.total_cmp(&a.1));
    list.into_iter().map(|o| o.0).collect()
}

/// Part of a residual below which the rest of it, imitated badly, decides what the piece looks like.
const TELLING: f64 = 0.02;

fn sentence(channel: Channel, share: f64, f: &Found, orders: &[u32]) -> String {
    let part = if share >= 0.0095 { format!("{:.0} %", 100.0 * share) } else { format!("{:.1} %", 100.0 * share) };
    let what = if share < TELLING { "too little beside the rest to say what leaves it".to_owned() } else { what(f) };
    let over = match f.coordinate {
        Coordinate::Theta => "the angle",
        Coordinate::Omega => "the rate",
        Coordinate::Current => "the current",
        Coordinate::Temperature => "the winding's temperature",
        Coordinate::Time => "time",
        Coordinate::Acceleration => "the acceleration",
        Coordinate::History => "what went before: reversals and starts",
    };
    let detail = match f.coordinate {
        Coordinate::Theta => harmonics(orders),
        _ => String::new(),
    };
    format!("{}: {part} of the residual goes with {over}{detail}, {what}.", channel.column())
}

/// The orders in words.
fn harmonics(orders: &[u32]) -> String {
    let Some(first) = orders.first() else { return String::new() };
    let mut sorted = orders.to_vec();
    sorted.sort_unstable();
    let base = sorted[0];
    let list = orders.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    match orders.len() {
        1 => format!(", order {first} ({first} × per turn)"),
        _ if base > 1 && sorted.iter().all(|n| n % base == 0) => format!(", orders {list}: harmonics of {base}"),
        _ => format!(", orders {list}"),
    }
}

/// What the missing piece looks like, as far as the channels tell.
fn what(f: &Found) -> String {
    match (f.kind, f.acts) {
        (Kind::Order(_), Acts::Reading(_)) if f.prescribed => {
            "the same at every rate: a torque that depends on the angle alone, or the sensor".into()
        }
        (Kind::Smooth, Acts::Reading(_)) if f.prescribed => "as a missing torque or the sensor leaves it".into(),
        (Kind::Order(_), Acts::Torque) => "as a torque leaves it that depends on the angle alone: it shrinks as the rate grows".into(),
        (Kind::Order(_), Acts::Constant) => "and grows with the current: torque ripple".into(),
        (Kind::Order(_), Acts::Encoder) => {
            "and grows with the rate: the encoder's eccentricity, in the angle and in the rate made from it, rather than a torque".into()
        }
        (Kind::Order(_), Acts::Reading(_)) if f.reads == Some(Channel::Angle) => {
            "in the angle alone, growing with the rate: the encoder's eccentricity rather than a torque".into()
        }
        (Kind::Order(_), Acts::Reading(_)) => "the same at every rate and in this channel alone: the sensor rather than a torque".into(),
        (Kind::Constant, Acts::Torque) => "as a torque leaves it that always turns the same way, so that the two directions differ".into(),
        (Kind::Constant, _) => "a constant offset".into(),
        (Kind::Friction, _) => "as friction leaves it that is not the same all around the turn".into(),
        (Kind::Step(at), _) => format!("as a torque leaves it that sets in near {at:.1} s"),
        (Kind::Line(hz), Acts::Voltage) => format!("as the voltage leaves it when it swings at {hz:.3} Hz with what was asked for"),
        (Kind::Line(hz), _) => format!("swinging at {hz:.3} Hz"),
        (_, Acts::Torque) => "as a missing torque leaves it".into(),
        (_, Acts::Voltage) => "as a missing voltage leaves it".into(),
        (_, Acts::Constant) => "as a motor constant leaves it that is not constant".into(),
        (_, Acts::Encoder) => "as an error of the encoder leaves it".into(),
        (_, Acts::Reading(_)) => format!("in what {} reads and not in the motion", f.reads.map_or("a channel", Channel::column)),
    }
}

//! The components of the search, summed for each channel and coordinate.

use std::collections::HashMap;

use drive_model::Coordinate;

use super::search::{ChannelShare, Component, MAX_LOG10_P};
use super::shapes::{Entry, ShapeKind};
use super::{Misfit, Signature};
use crate::model::Channel;

/// Explained fraction below which imperfections of the other components determine the form of this one.
const MIN_ATTRIBUTABLE_FRACTION: f64 = 0.02;

/// One misfit for each channel and coordinate, sorted by the coordinate's gain, then by the explained fraction of the channel.
pub fn by_channel(components: Vec<Component>) -> Vec<Misfit> {
    let mut coordinates: Vec<Coordinate> = Vec::new();
    let mut gains: HashMap<&'static str, f64> = HashMap::new();
    for c in &components {
        if !coordinates.contains(&c.coordinate) {
            coordinates.push(c.coordinate);
        }
        *gains.entry(c.coordinate.name()).or_default() += c.gain;
    }
    let gain = |c: &Coordinate| gains.get(c.name()).copied().unwrap_or(0.0);
    coordinates.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let mut list = Vec::new();
    for coordinate in coordinates {
        let all: Vec<&Component> = components.iter().filter(|c| c.coordinate == coordinate).collect();
        let channels = [Channel::Rate, Channel::Angle, Channel::Current, Channel::Voltage, Channel::Torque];
        let mut misfits: Vec<Misfit> = channels.into_iter().filter_map(|channel| misfit(&all, coordinate, channel)).collect();
        misfits.sort_by(|a, b| b.explained_fraction.total_cmp(&a.explained_fraction));
        list.extend(misfits);
    }
    list
}

/// The misfit of one channel over one coordinate; `None` if it is not significant.
fn misfit(components: &[&Component], coordinate: Coordinate, channel: Channel) -> Option<Misfit> {
    let parts: Vec<(&Component, &ChannelShare)> =
        components.iter().filter_map(|c| c.channels.iter().find(|s| s.channel == channel).map(|s| (*c, s))).collect();
    let (main, _) = parts.iter().max_by(|a, b| a.1.fraction.total_cmp(&b.1.fraction))?;
    let explained_fraction = parts.iter().map(|p| p.1.fraction).sum::<f64>().min(1.0);
    let log10_p = parts.iter().filter(|p| p.1.fraction > 0.0).map(|p| p.1.log10_p).fold(0.0, f64::min);
    if explained_fraction <= 0.0 || log10_p >= MAX_LOG10_P {
        return None;
    }
    let significant: Vec<&Component> = parts.iter().filter(|p| p.1.fraction > 0.0 && p.1.log10_p < MAX_LOG10_P).map(|p| p.0).collect();
    Some(Misfit {
        channel,
        coordinate,
        explained_fraction,
        harmonic_orders: harmonic_orders(&significant),
        p_value: 10f64.powf(log10_p),
        log10_p,
        signature: (explained_fraction >= MIN_ATTRIBUTABLE_FRACTION).then(|| signature(main)),
    })
}

/// Harmonic orders of the components, the strongest first.
fn harmonic_orders(components: &[&Component]) -> Vec<u32> {
    let mut list: Vec<(u32, f64)> = Vec::new();
    for c in components {
        if let ShapeKind::Harmonic(n) = c.shape {
            match list.iter_mut().find(|o| o.0 == n) {
                Some(o) => o.1 += c.gain,
                None => list.push((n, c.gain)),
            }
        }
    }
    list.sort_by(|a, b| b.1.total_cmp(&a.1));
    list.into_iter().map(|o| o.0).collect()
}

fn signature(c: &Component) -> Signature {
    match (c.shape, c.entry) {
        (ShapeKind::ByLog(difference), entry) => Signature::ByLog { difference, channel: c.reading, is_voltage: entry == Entry::Voltage },
        (ShapeKind::Harmonic(_), Entry::Reading(_)) if c.prescribed_motion => Signature::HarmonicTorqueOrSensor,
        (ShapeKind::Smooth, Entry::Reading(_)) if c.prescribed_motion => Signature::TorqueOrSensor,
        (ShapeKind::Harmonic(_), Entry::Torque) => Signature::AngleTorque,
        (ShapeKind::Harmonic(_), Entry::MotorConstant) => Signature::TorqueRipple,
        (ShapeKind::Harmonic(_), Entry::Encoder) => Signature::EncoderEccentricity,
        (ShapeKind::Harmonic(_), Entry::Reading(_)) if c.reading == Some(Channel::Angle) => Signature::AngleHarmonic,
        (ShapeKind::Harmonic(_), Entry::Reading(_)) => Signature::SensorHarmonic,
        (ShapeKind::Constant, Entry::Torque) => Signature::ConstantTorque,
        (ShapeKind::Constant, _) => Signature::Offset,
        (ShapeKind::AngleFriction, _) => Signature::AngleFriction,
        (ShapeKind::Step { t_s }, _) => Signature::TorqueStep { t_s },
        (ShapeKind::Line { frequency_hz }, Entry::Voltage) => Signature::VoltageLine { frequency_hz },
        (ShapeKind::Line { frequency_hz }, _) => Signature::Line { frequency_hz },
        (_, Entry::Torque) => Signature::Torque,
        (_, Entry::Voltage) => Signature::Voltage,
        (_, Entry::MotorConstant) => Signature::MotorConstant,
        (_, Entry::Encoder) => Signature::EncoderError,
        (_, Entry::Reading(_)) => Signature::Sensor { channel: c.reading },
    }
}

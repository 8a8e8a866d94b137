//! Misfits of a model as sentences and as JSON, for comparisons and explanations.

use drive_model::Coordinate;
use serde::Serialize;

use super::html::{Cell, Class, Page, Table};
use super::{listed, numbers};
use crate::identify::residual::{Misfit, Signature};
use crate::model::Channel;

/// Smallest p-value that JSON gives as a number; smaller ones are 0, and `log10_p` has the magnitude.
const MIN_P: f64 = 1e-300;

/// A p-value for JSON.
pub fn p_value(p: f64) -> f64 {
    if p < MIN_P { 0.0 } else { p }
}

/// One sentence: channel, explained variance, coordinate and form of the missing term.
pub fn sentence(m: &Misfit) -> String {
    shared_sentence(&[m])
}

/// The sentence of misfits of the same coordinate and form in several channels.
fn shared_sentence(misfits: &[&Misfit]) -> String {
    let Some(first) = misfits.first() else { return String::new() };
    let channels: Vec<String> = misfits.iter().map(|m| m.channel.column().to_owned()).collect();
    let percents: Vec<String> = misfits.iter().map(|m| percent(m.explained_fraction)).collect();
    let correlate = if misfits.len() > 1 { "correlate" } else { "correlates" };
    let harmonics = misfits.iter().map(|m| harmonics(m)).find(|text| !text.is_empty()).unwrap_or_default();
    let form = form(first);
    let (channels, percents) = (listed(&channels), listed(&percents));
    format!("{channels}: {percents} of the residual variance {correlate} with {}{harmonics}: {form}.", coordinate(first.coordinate))
}

/// A fraction of the variance in percent.
fn percent(fraction: f64) -> String {
    let percent = 100.0 * fraction;
    if fraction >= 0.0095 {
        format!("{percent:.0} %")
    } else if fraction >= 0.0005 {
        format!("{percent:.1} %")
    } else {
        "less than 0.1 %".to_owned()
    }
}

/// A coordinate with its article.
pub fn coordinate(coordinate: Coordinate) -> &'static str {
    match coordinate {
        Coordinate::Theta => "the angle",
        Coordinate::Omega => "the rate",
        Coordinate::Current => "the current",
        Coordinate::Temperature => "the winding temperature",
        Coordinate::Time => "time",
        Coordinate::Acceleration => "the acceleration",
        Coordinate::History => "the time since the last reversal or start",
    }
}

/// The harmonic orders in words.
fn harmonics(m: &Misfit) -> String {
    let orders = if m.coordinate == Coordinate::Theta { &m.harmonic_orders[..] } else { &[] };
    let Some(fundamental) = orders.iter().min().copied() else { return String::new() };
    let list = orders.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    match orders {
        [1] => " (harmonic 1: once per revolution)".to_owned(),
        [order] => format!(" (harmonic {order}: {order} periods per revolution)"),
        _ if fundamental > 1 && orders.iter().all(|n| n % fundamental == 0) => format!(" (harmonics {list}: multiples of {fundamental})"),
        _ => format!(" (harmonics {list})"),
    }
}

/// Form of the missing term.
fn form(m: &Misfit) -> String {
    let Some(signature) = m.signature else { return "too weak to attribute".to_owned() };
    match signature {
        Signature::Torque => "looks like a missing torque".into(),
        Signature::ConstantTorque => "looks like a constant torque, which makes the directions of rotation differ".into(),
        Signature::TorqueStep { t_s } => format!("looks like a torque that starts near {t_s:.1} s"),
        Signature::AngleTorque => "looks like a torque that depends on the angle only: its effect decreases with the rate".into(),
        Signature::TorqueRipple => "increases with the current: looks like torque ripple".into(),
        Signature::AngleFriction => "looks like friction that depends on the angle".into(),
        Signature::Voltage => "looks like a missing voltage".into(),
        Signature::VoltageLine { frequency_hz } => {
            format!("looks like a voltage error at {frequency_hz:.3} Hz, proportional to the voltage command")
        }
        Signature::MotorConstant => "looks like a motor constant that varies".into(),
        Signature::Line { frequency_hz } => format!("oscillates at {frequency_hz:.3} Hz"),
        Signature::EncoderError => "looks like an error of the encoder".into(),
        Signature::EncoderEccentricity => {
            "increases with the rate, in the angle and in the rate derived from it: looks like encoder eccentricity, not a torque".into()
        }
        Signature::AngleHarmonic => "in the angle only, and increases with the rate: looks like encoder eccentricity, not a torque".into(),
        Signature::SensorHarmonic => "in this channel only, and independent of the rate: looks like the sensor, not a torque".into(),
        Signature::Offset => "a constant offset".into(),
        Signature::Sensor { channel } => {
            format!("looks like an error of {}, not of the motion", channel.map_or("the sensor", Channel::column))
        }
        Signature::TorqueOrSensor => "looks like a missing torque or a sensor error".into(),
        Signature::HarmonicTorqueOrSensor => {
            "independent of the rate: looks like a torque that depends on the angle, or a sensor error".into()
        }
    }
}

/// The misfits in sentences, in their order. Misfits of the same coordinate and form share a sentence; the weak ones share the last.
pub fn lines(misfits: &[Misfit]) -> Vec<String> {
    let mut groups: Vec<Vec<&Misfit>> = Vec::new();
    for m in misfits.iter().filter(|m| m.signature.is_some()) {
        match groups.iter_mut().find(|g| g[0].coordinate == m.coordinate && g[0].signature == m.signature) {
            Some(group) => group.push(m),
            None => groups.push(vec![m]),
        }
    }
    let mut lines: Vec<String> = groups.iter().map(|group| shared_sentence(group)).collect();
    let weak = misfits.iter().filter(|m| m.signature.is_none());
    let weak: Vec<String> =
        weak.map(|m| format!("{} over {} ({})", m.channel.column(), coordinate(m.coordinate), percent(m.explained_fraction))).collect();
    if !weak.is_empty() {
        lines.push(format!("Too weak to attribute: {}.", listed(&weak)));
    }
    lines
}

/// The misfits as a section with a table; nothing if there are none.
pub fn section(misfits: &[Misfit], page: &mut Page) {
    if misfits.is_empty() {
        return;
    }
    page.section("Where the model fails", |page| {
        page.paragraph(
            Class::Faint,
            "Sorted by share of the residual variance, largest first; each share is what the coordinate explains beyond those above it. Listed if p < 0.001 over all channels and coordinates.",
        );
        let mut table = Table::new(["channel", "coordinate", "share of the residual", "harmonic orders", "p", "form"]);
        for f in misfits {
            table.row([
                Cell::text(f.channel.column()),
                Cell::text(f.coordinate.name()),
                Cell::number(format!("{} %", numbers::significant(100.0 * f.explained_fraction, 2))),
                Cell::text(f.harmonic_orders.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")),
                Cell::number(numbers::p_value(f.log10_p)),
                Cell::text(form(f)),
            ]);
        }
        page.table(table);
    });
}

/// A misfit in a JSON answer.
#[derive(Serialize)]
pub struct MisfitJson {
    output: &'static str,
    coordinate: &'static str,
    share: f64,
    order: Option<u32>,
    p_value: f64,
    log10_p: f64,
    says: String,
}

impl From<&Misfit> for MisfitJson {
    fn from(f: &Misfit) -> Self {
        MisfitJson {
            output: f.channel.column(),
            coordinate: f.coordinate.name(),
            share: f.explained_fraction,
            order: f.harmonic_orders.first().copied(),
            p_value: p_value(f.p_value),
            log10_p: f.log10_p,
            says: sentence(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example(coordinate: Coordinate, harmonic_orders: Vec<u32>, signature: Option<Signature>) -> String {
        sentence(&Misfit {
            channel: Channel::Rate,
            coordinate,
            explained_fraction: 0.896,
            harmonic_orders,
            p_value: 1e-9,
            log10_p: -9.0,
            signature,
        })
    }

    #[test]
    fn sentence_names_channel_variance_coordinate_and_form() {
        assert_eq!(
            example(Coordinate::Current, Vec::new(), Some(Signature::Torque)),
            "omega_rad_s: 90 % of the residual variance correlates with the current: looks like a missing torque."
        );
        assert_eq!(
            example(Coordinate::Theta, vec![14, 7], None),
            "omega_rad_s: 90 % of the residual variance correlates with the angle (harmonics 14, 7: multiples of 7): too weak to attribute."
        );
        assert!(example(Coordinate::Theta, vec![7], None).contains("(harmonic 7: 7 periods per revolution)"));
    }

    #[test]
    fn misfits_of_the_same_form_share_a_sentence() {
        let misfit = |channel, explained_fraction, signature| Misfit {
            channel,
            coordinate: Coordinate::Omega,
            explained_fraction,
            harmonic_orders: Vec::new(),
            p_value: 0.0,
            log10_p: -400.0,
            signature,
        };
        let torque = Some(Signature::Torque);
        let all = [misfit(Channel::Rate, 0.9, torque), misfit(Channel::Current, 0.5, torque), misfit(Channel::Angle, 1e-4, None)];
        assert_eq!(
            lines(&all),
            [
                "omega_rad_s and i_A: 90 % and 50 % of the residual variance correlate with the rate: looks like a missing torque.",
                "Too weak to attribute: theta_rad over the rate (less than 0.1 %)."
            ]
        );
    }
}

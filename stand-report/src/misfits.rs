//! Misfits of a model as sentences and as JSON, for comparisons and explanations.

use drive_model::Coordinate;
use schemars::JsonSchema;
use serde::Serialize;

use super::html::{Cell, Class, Page, Table};
use super::{column, listed, numbers};
use identification::identify::residual::{Difference, Misfit, Signature};
use identification::log::Axis;
use identification::model::Channel;

/// Smallest p-value that JSON gives as a number; smaller ones are 0, and `log10_p` has the magnitude.
const MIN_P: f64 = 1e-300;

/// A p-value for JSON.
pub fn p_value(p: f64) -> f64 {
    if p < MIN_P { 0.0 } else { p }
}

/// One sentence: channel, explained variance, coordinate and form of the missing term.
pub fn sentence(axis: Axis, m: &Misfit) -> String {
    shared_sentence(axis, &[m])
}

/// The sentence of misfits of the same coordinate and form in several channels.
fn shared_sentence(axis: Axis, misfits: &[&Misfit]) -> String {
    let Some(first) = misfits.first() else { return String::new() };
    let channels: Vec<String> = misfits.iter().map(|m| column(axis, m.channel).to_owned()).collect();
    let percents: Vec<String> = misfits.iter().map(|m| percent(m.explained_fraction)).collect();
    let correlate = if misfits.len() > 1 { "correlate" } else { "correlates" };
    let harmonics = misfits.iter().map(|m| harmonics(axis, m)).find(|text| !text.is_empty()).unwrap_or_default();
    let form = form(axis, first);
    let (channels, percents) = (listed(&channels), listed(&percents));
    if first.coordinate == Coordinate::Log {
        let differ = if misfits.len() > 1 { "differ" } else { "differs" };
        return format!("{channels}: {percents} of the residual variance {differ} from log to log: {form}.");
    }
    format!("{channels}: {percents} of the residual variance {correlate} with {}{harmonics}: {form}.", coordinate(axis, first.coordinate))
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
pub fn coordinate(axis: Axis, coordinate: Coordinate) -> &'static str {
    match coordinate {
        Coordinate::Theta if axis == Axis::Linear => "the position",
        Coordinate::Omega if axis == Axis::Linear => "the velocity",
        Coordinate::Theta => "the angle",
        Coordinate::Omega => "the rate",
        Coordinate::Current => "the current",
        Coordinate::Temperature => "the winding temperature",
        Coordinate::Time => "time",
        Coordinate::Acceleration => "the acceleration",
        Coordinate::History => "the time since the last reversal or start",
        Coordinate::Log => "the log",
    }
}

/// The harmonic orders in words.
fn harmonics(axis: Axis, m: &Misfit) -> String {
    let orders = if m.coordinate == Coordinate::Theta { &m.harmonic_orders[..] } else { &[] };
    let Some(fundamental) = orders.iter().min().copied() else { return String::new() };
    let list = orders.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    match orders {
        [order] if axis == Axis::Linear => format!(" (harmonic {order}: a period of {:.4} m)", std::f64::consts::TAU / f64::from(*order)),
        [1] => " (harmonic 1: once per revolution)".to_owned(),
        [order] => format!(" (harmonic {order}: {order} periods per revolution)"),
        _ if fundamental > 1 && orders.iter().all(|n| n % fundamental == 0) => format!(" (harmonics {list}: multiples of {fundamental})"),
        _ => format!(" (harmonics {list})"),
    }
}

/// Form of the missing term.
fn form(axis: Axis, m: &Misfit) -> String {
    let Some(signature) = m.signature else { return "too weak to attribute".to_owned() };
    let [torque, rate] = ["torque", "rate"].map(|q| axis.quantity(q));
    let (angle, motion) = if axis == Axis::Linear { ("position", "motion") } else { ("angle", "rotation") };
    match signature {
        Signature::Torque => format!("looks like a missing {torque}"),
        Signature::ConstantTorque => format!("looks like a constant {torque}, which makes the directions of {motion} differ"),
        Signature::TorqueStep { t_s } => format!("looks like a {torque} that starts near {t_s:.1} s"),
        Signature::AngleTorque => format!("looks like a {torque} that depends on the {angle} only: its effect decreases with the {rate}"),
        Signature::TorqueRipple => "increases with the current: looks like torque ripple".into(),
        Signature::AngleFriction => format!("looks like friction that depends on the {angle}"),
        Signature::Voltage => "looks like a missing voltage".into(),
        Signature::VoltageLine { frequency_hz } => {
            format!("looks like a voltage error at {frequency_hz:.3} Hz, proportional to the voltage command")
        }
        Signature::MotorConstant => "looks like a motor constant that varies".into(),
        Signature::Line { frequency_hz } => format!("oscillates at {frequency_hz:.3} Hz"),
        Signature::EncoderError => "looks like an error of the encoder".into(),
        Signature::EncoderEccentricity => {
            format!(
                "increases with the rate, in the angle and in the rate derived from it: may be encoder eccentricity, or a {torque} over the {angle} such as gravity, as long as the model is far off"
            )
        }
        Signature::AngleHarmonic => {
            format!(
                "in the {angle} only, and increases with the {rate}: may be encoder eccentricity, or a {torque} over the {angle} such as gravity, as long as the model is far off"
            )
        }
        Signature::SensorHarmonic => "in this channel only, and independent of the rate: looks like the sensor rather than a torque".into(),
        Signature::ByLog { difference, channel, is_voltage } => by_log(axis, difference, channel, is_voltage),
        Signature::Offset => "a constant offset".into(),
        Signature::Sensor { channel } => {
            format!("looks like an error of {}, not of the motion", channel.map_or("the sensor", |c| column(axis, c)))
        }
        Signature::TorqueOrSensor => format!("looks like a missing {torque} or a sensor error"),
        Signature::HarmonicTorqueOrSensor => {
            format!("independent of the {rate}: looks like a {torque} that depends on the {angle}, or a sensor error")
        }
    }
}

/// Form of the missing term, for programs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum FormKind {
    /// A torque.
    Torque,
    /// A constant torque.
    ConstantTorque,
    /// A torque that begins.
    TorqueStep {
        /// Its time, s.
        t_s: f64,
    },
    /// A torque over the angle.
    AngleTorque,
    /// A ripple of the motor constant.
    TorqueRipple,
    /// Friction over the angle.
    AngleFriction,
    /// A voltage.
    Voltage,
    /// A voltage at one frequency.
    VoltageLine {
        /// Hz.
        frequency_Hz: f64,
    },
    /// An error of the motor constant.
    MotorConstant,
    /// A torque at one frequency.
    Line {
        /// Hz.
        frequency_Hz: f64,
    },
    /// An error of the encoder.
    EncoderError,
    /// An eccentric encoder.
    EncoderEccentricity,
    /// A harmonic over the angle.
    AngleHarmonic,
    /// A harmonic of a sensor.
    SensorHarmonic,
    /// The friction differs from log to log.
    FrictionByLog,
    /// The resistance differs from log to log.
    ResistanceByLog,
    /// An offset of the voltage within each log.
    VoltageOffsetByLog,
    /// An offset of the torque within each log.
    TorqueOffsetByLog,
    /// An offset of a reading within each log.
    OffsetByLog {
        /// Column of the channel.
        channel: Option<&'static str>,
    },
    /// A scale of the voltage within each log.
    VoltageScaleByLog,
    /// A scale of the torque within each log.
    TorqueScaleByLog,
    /// A scale of a reading within each log.
    ScaleByLog {
        /// Column of the channel.
        channel: Option<&'static str>,
    },
    /// An offset.
    Offset,
    /// An error of a sensor.
    SomeSensor,
    /// An error of the sensor of a channel.
    Sensor {
        /// Column of the channel.
        channel: Option<&'static str>,
    },
    /// A torque, or an error of a sensor.
    TorqueOrSensor,
    /// A harmonic torque, or an error of a sensor.
    HarmonicTorqueOrSensor,
}

/// Form of the missing term for programs: its kind and its numbers.
fn form_kind(axis: Axis, signature: Signature) -> FormKind {
    let column_of = |channel: Option<Channel>| channel.map(|channel| column(axis, channel));
    match signature {
        Signature::Torque => FormKind::Torque,
        Signature::ConstantTorque => FormKind::ConstantTorque,
        Signature::TorqueStep { t_s } => FormKind::TorqueStep { t_s },
        Signature::AngleTorque => FormKind::AngleTorque,
        Signature::TorqueRipple => FormKind::TorqueRipple,
        Signature::AngleFriction => FormKind::AngleFriction,
        Signature::Voltage => FormKind::Voltage,
        Signature::VoltageLine { frequency_hz } => FormKind::VoltageLine { frequency_Hz: frequency_hz },
        Signature::MotorConstant => FormKind::MotorConstant,
        Signature::Line { frequency_hz } => FormKind::Line { frequency_Hz: frequency_hz },
        Signature::EncoderError => FormKind::EncoderError,
        Signature::EncoderEccentricity => FormKind::EncoderEccentricity,
        Signature::AngleHarmonic => FormKind::AngleHarmonic,
        Signature::SensorHarmonic => FormKind::SensorHarmonic,
        Signature::ByLog { difference: Difference::Friction, .. } => FormKind::FrictionByLog,
        Signature::ByLog { difference: Difference::Resistance, .. } => FormKind::ResistanceByLog,
        Signature::ByLog { difference: Difference::Offset, channel: None, is_voltage: true } => FormKind::VoltageOffsetByLog,
        Signature::ByLog { difference: Difference::Offset, channel: None, is_voltage: false } => FormKind::TorqueOffsetByLog,
        Signature::ByLog { difference: Difference::Offset, channel, .. } => FormKind::OffsetByLog { channel: column_of(channel) },
        Signature::ByLog { difference: Difference::Scale, channel: None, is_voltage: true } => FormKind::VoltageScaleByLog,
        Signature::ByLog { difference: Difference::Scale, channel: None, is_voltage: false } => FormKind::TorqueScaleByLog,
        Signature::ByLog { difference: Difference::Scale, channel, .. } => FormKind::ScaleByLog { channel: column_of(channel) },
        Signature::Offset => FormKind::Offset,
        Signature::Sensor { channel: None } => FormKind::SomeSensor,
        Signature::Sensor { channel } => FormKind::Sensor { channel: column_of(channel) },
        Signature::TorqueOrSensor => FormKind::TorqueOrSensor,
        Signature::HarmonicTorqueOrSensor => FormKind::HarmonicTorqueOrSensor,
    }
}

/// What differs from log to log.
fn by_log(axis: Axis, difference: Difference, channel: Option<Channel>, is_voltage: bool) -> String {
    let place = match (channel, is_voltage) {
        (Some(channel), _) => format!("the reading of {}", column(axis, channel)),
        (None, true) => "the voltage".to_owned(),
        (None, false) => format!("the {}", axis.quantity("torque")),
    };
    match difference {
        Difference::Offset => format!("looks like an offset of {place} that is constant within each log"),
        Difference::Scale => format!("looks like a scale of {place} of its own in each log"),
        Difference::Friction => "looks like friction of its own in each log".to_owned(),
        Difference::Resistance => {
            "looks like a resistance of its own in each log, as of a winding that is warm from the run before".to_owned()
        }
    }
}

/// The misfits in sentences, in their order. Misfits of the same coordinate and form share a sentence; the weak ones share the last.
pub fn lines(axis: Axis, misfits: &[Misfit]) -> Vec<String> {
    let mut groups: Vec<Vec<&Misfit>> = Vec::new();
    for m in misfits.iter().filter(|m| m.signature.is_some()) {
        match groups.iter_mut().find(|g| g[0].coordinate == m.coordinate && g[0].signature == m.signature) {
            Some(group) => group.push(m),
            None => groups.push(vec![m]),
        }
    }
    let mut lines: Vec<String> = groups.iter().map(|group| shared_sentence(axis, group)).collect();
    let weak = misfits.iter().filter(|m| m.signature.is_none());
    let weak: Vec<String> = weak
        .map(|m| format!("{} over {} ({})", column(axis, m.channel), coordinate(axis, m.coordinate), percent(m.explained_fraction)))
        .collect();
    if !weak.is_empty() {
        lines.push(format!("Too weak to attribute: {}.", listed(&weak)));
    }
    lines
}

/// The misfits as a section with a table; nothing if there are none.
pub fn section(axis: Axis, misfits: &[Misfit], page: &mut Page) {
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
                Cell::text(column(axis, f.channel)),
                Cell::text(f.coordinate.name()),
                Cell::number(format!("{} %", numbers::significant(100.0 * f.explained_fraction, 2))),
                Cell::text(f.harmonic_orders.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")),
                Cell::number(numbers::p_value(f.log10_p)),
                Cell::text(form(axis, f)),
            ]);
        }
        page.table(table);
    });
}

/// A misfit in a JSON answer.
#[derive(Serialize, JsonSchema)]
pub struct MisfitJson {
    output: &'static str,
    coordinate: &'static str,
    share: f64,
    order: Option<u32>,
    p_value: f64,
    log10_p: f64,
    orders: Vec<u32>,
    /// Form of the missing term; `None`: too weak to attribute.
    form: Option<FormKind>,
    says: String,
}

impl MisfitJson {
    /// A misfit in the names of an axis.
    pub fn of(axis: Axis, f: &Misfit) -> Self {
        MisfitJson {
            output: column(axis, f.channel),
            coordinate: f.coordinate.name(),
            share: f.explained_fraction,
            order: f.harmonic_orders.first().copied(),
            p_value: p_value(f.p_value),
            log10_p: f.log10_p,
            orders: if f.coordinate == Coordinate::Theta { f.harmonic_orders.clone() } else { Vec::new() },
            form: f.signature.map(|signature| form_kind(axis, signature)),
            says: sentence(axis, f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example(coordinate: Coordinate, harmonic_orders: Vec<u32>, signature: Option<Signature>) -> String {
        sentence(
            Axis::Rotary,
            &Misfit {
                channel: Channel::Rate,
                coordinate,
                explained_fraction: 0.896,
                harmonic_orders,
                p_value: 1e-9,
                log10_p: -9.0,
                signature,
            },
        )
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
            lines(Axis::Rotary, &all),
            [
                "omega_rad_s and i_A: 90 % and 50 % of the residual variance correlate with the rate: looks like a missing torque.",
                "Too weak to attribute: theta_rad over the rate (less than 0.1 %)."
            ]
        );
    }
}

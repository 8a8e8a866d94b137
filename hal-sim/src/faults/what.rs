//! Kinds of faults by name, and the meaning of their magnitude.

use serde::{Deserialize, Serialize};

/// Kind of a fault. Its name in a file is in kebab case, for example `encoder-a-off`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum What {
    /// Encoder wire A is disconnected; its input is pulled up.
    EncoderAOff,
    /// Encoder wire B is disconnected; its input is pulled up.
    EncoderBOff,
    /// The index wire is disconnected.
    IndexOff,
    /// The wire of the current sensor is disconnected: its converter reads 0.
    CurrentSensorOff,
    /// The counter of the speed loop stands still, as if its timer had no clock.
    CounterStuck,
    /// The supply voltage falls to the magnitude, V.
    SupplyDip,
    /// Noise on current and rate, by the magnitude times the usual noise.
    NoiseBurst,
    /// The winding has the temperature of the magnitude, °C.
    WindingHot,
    /// The rate sensor does not respond, and the bus of the sensor under test is open.
    SensorSilent,
    /// The rate sensor delivers random codes, and on the bus of the sensor under test every second bit is wrong.
    SensorRubbish,
    /// The control interrupt does not occur.
    LostTicks,
    /// The controller loses its supply, and restarts afterwards.
    PowerCut,
    /// Bits are flipped on the serial line, both ways, in this fraction of the bytes.
    LineFlips,
    /// This fraction of the bytes on the serial line is lost, both ways.
    LineLoses,
    /// Foreign bytes are inserted on the serial line, after this fraction of its bytes, both ways.
    LineInserts,
    /// The serial line is unplugged.
    LineOff,
    /// The host sends a break at the start.
    LineBreak,
    /// The wire of the gyroscope's angle sensor is disconnected: its converter reads full scale.
    AngleSensorOff,
    /// The torquer amplifier is limited to the magnitude, A.
    TorquerLimit,
}

/// Magnitude of a kind of fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Meaning of the number, with its unit.
    pub says: &'static str,
    /// Default.
    pub usual: f64,
    /// Smallest and largest value.
    pub range: (f64, f64),
}

impl What {
    /// All kinds.
    pub const ALL: [What; 19] = [
        What::EncoderAOff,
        What::EncoderBOff,
        What::IndexOff,
        What::CurrentSensorOff,
        What::CounterStuck,
        What::SupplyDip,
        What::NoiseBurst,
        What::WindingHot,
        What::SensorSilent,
        What::SensorRubbish,
        What::LostTicks,
        What::PowerCut,
        What::LineFlips,
        What::LineLoses,
        What::LineInserts,
        What::LineOff,
        What::LineBreak,
        What::AngleSensorOff,
        What::TorquerLimit,
    ];

    /// Its bit in a set.
    pub(super) fn bit(self) -> u32 {
        1 << self as u8
    }

    /// Whether the kind concerns the serial line, which only the whole controller has.
    pub fn is_of_the_line(self) -> bool {
        matches!(self, What::LineFlips | What::LineLoses | What::LineInserts | What::LineOff | What::LineBreak)
    }

    /// Whether the kind concerns the gyroscope, which not every stand has.
    pub fn is_of_the_gyro(self) -> bool {
        matches!(self, What::AngleSensorOff | What::TorquerLimit)
    }

    /// The magnitude; `None` where the kind has none.
    pub fn size(self) -> Option<Size> {
        let size = |says, usual, range| Some(Size { says, usual, range });
        match self {
            What::SupplyDip => size("the supply that is left, V", 6.0, (0.0, 1e3)),
            What::NoiseBurst => size("multiples of the usual noise", 30.0, (0.0, 1e4)),
            What::WindingHot => size("the winding's temperature, °C", 160.0, (-100.0, 1e3)),
            What::TorquerLimit => size("the current that is left, A", 0.02, (0.0, 10.0)),
            What::LineFlips | What::LineLoses | What::LineInserts => size("share of the bytes", 0.01, (0.0, 1.0)),
            _ => None,
        }
    }
}

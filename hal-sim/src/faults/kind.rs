//! Kinds of faults by name, and the meaning of their magnitude.

use serde::{Deserialize, Serialize};

/// Kind of a fault. Its name in a file is in kebab case, for example `encoder-a-off`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum FaultKind {
    /// Encoder wire A is disconnected; its input is pulled up.
    EncoderAOff,
    /// Encoder wire B is disconnected; its input is pulled up.
    EncoderBOff,
    /// The index wire is disconnected.
    IndexOff,
    /// The wire of the current sensor is disconnected: its converter reads 0.
    CurrentSensorOff,
    /// The converter of current and supply stops: both readings keep their last value.
    ConverterStopped,
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
    /// The wire of the clock reference is disconnected.
    ReferenceOff,
    /// Interference on the wire of the clock reference: an edge in each control tick.
    ReferenceInterference,
}

/// Magnitude of a kind of fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Magnitude {
    /// Meaning of the number, with its unit.
    pub meaning: &'static str,
    /// Default.
    pub default: f64,
    /// Smallest and largest value.
    pub range: (f64, f64),
}

impl FaultKind {
    /// All kinds.
    pub const ALL: [FaultKind; 22] = [
        FaultKind::EncoderAOff,
        FaultKind::EncoderBOff,
        FaultKind::IndexOff,
        FaultKind::CurrentSensorOff,
        FaultKind::ConverterStopped,
        FaultKind::CounterStuck,
        FaultKind::SupplyDip,
        FaultKind::NoiseBurst,
        FaultKind::WindingHot,
        FaultKind::SensorSilent,
        FaultKind::SensorRubbish,
        FaultKind::LostTicks,
        FaultKind::PowerCut,
        FaultKind::LineFlips,
        FaultKind::LineLoses,
        FaultKind::LineInserts,
        FaultKind::LineOff,
        FaultKind::LineBreak,
        FaultKind::AngleSensorOff,
        FaultKind::TorquerLimit,
        FaultKind::ReferenceOff,
        FaultKind::ReferenceInterference,
    ];

    /// Its bit in a set.
    pub(super) fn bit(self) -> u32 {
        1 << self as u8
    }

    /// Whether the kind concerns the serial line, which only the whole controller has.
    pub fn affects_serial_line(self) -> bool {
        matches!(self, FaultKind::LineFlips | FaultKind::LineLoses | FaultKind::LineInserts | FaultKind::LineOff | FaultKind::LineBreak)
    }

    /// Whether the kind concerns the gyroscope, which not every stand has.
    pub fn affects_gyroscope(self) -> bool {
        matches!(self, FaultKind::AngleSensorOff | FaultKind::TorquerLimit)
    }

    /// Whether the kind concerns the clock reference, which not every stand has.
    pub fn affects_clock_reference(self) -> bool {
        matches!(self, FaultKind::ReferenceOff | FaultKind::ReferenceInterference)
    }

    /// The magnitude; `None` where the kind has none.
    pub fn magnitude(self) -> Option<Magnitude> {
        let magnitude = |meaning, default, range| Some(Magnitude { meaning, default, range });
        match self {
            FaultKind::SupplyDip => magnitude("the supply that is left, V", 6.0, (0.0, 1e3)),
            FaultKind::NoiseBurst => magnitude("multiples of the usual noise", 30.0, (0.0, 1e4)),
            FaultKind::WindingHot => magnitude("the winding's temperature, °C", 160.0, (-100.0, 1e3)),
            FaultKind::TorquerLimit => magnitude("the current that is left, A", 0.02, (0.0, 10.0)),
            FaultKind::LineFlips | FaultKind::LineLoses | FaultKind::LineInserts => magnitude("share of the bytes", 0.01, (0.0, 1.0)),
            _ => None,
        }
    }
}

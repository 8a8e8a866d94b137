//! What can be broken, by name; and what its size means.

use serde::{Deserialize, Serialize};

/// What is broken. In a file by its name in small letters with dashes, as `encoder-a-off`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum What {
    /// The encoder's wire A is off; its input is pulled up.
    EncoderAOff,
    /// The encoder's wire B is off; its input is pulled up.
    EncoderBOff,
    /// The index's wire is off.
    IndexOff,
    /// The current sensor's wire is off: its converter reads 0.
    CurrentSensorOff,
    /// The speed loop's counter counts no more, as when its timer lost its clock.
    CounterStuck,
    /// The supply falls to so many volts.
    SupplyDip,
    /// Sparks into the analog lines: so many times the usual noise on current and rate.
    NoiseBurst,
    /// The winding is this hot, °C.
    WindingHot,
    /// The rate sensor answers no more.
    SensorSilent,
    /// The rate sensor answers rubbish.
    SensorRubbish,
    /// The control interrupt does not come.
    LostTicks,
    /// The controller has no supply, and starts anew afterwards.
    PowerCut,
    /// Bits are flipped on the serial line, both ways: in this share of the bytes.
    LineFlips,
    /// This share of the bytes on the serial line is lost, both ways.
    LineLoses,
    /// Foreign bytes on the serial line, behind this share of its own, both ways.
    LineInserts,
    /// The serial line is unplugged.
    LineOff,
    /// The host sends a break at the beginning.
    LineBreak,
    /// The wire of the gyro's angle sensor is off: its converter reads its end.
    AngleSensorOff,
    /// The torquer's amplifier gives no more than so many amperes.
    TorquerLimit,
}

/// What the size of a fault is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// What the number means, with its unit.
    pub says: &'static str,
    /// Where a fault does not say it.
    pub usual: f64,
    /// Least and greatest.
    pub range: (f64, f64),
}

impl What {
    /// All there are.
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

    /// Whether it is about the serial line, which only the whole controller has.
    pub fn is_of_the_line(self) -> bool {
        matches!(self, What::LineFlips | What::LineLoses | What::LineInserts | What::LineOff | What::LineBreak)
    }

    /// Whether it is about the gyro beside the drive, which not every stand has.
    pub fn is_of_the_gyro(self) -> bool {
        matches!(self, What::AngleSensorOff | What::TorquerLimit)
    }

    /// What its size is; `None` where it has none.
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

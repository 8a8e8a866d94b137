//! Status of the drive: the latched fault, and the limits in force.
//!
//! A [`Fault`] has switched the drive off and stays latched until it is cleared. [`Limits`] are not faults: the drive runs and holds the
//! output back.

/// A reason to switch the drive off. Each latches: the first is kept until it is cleared, and that takes its cause to be gone. An emergency
/// stop replaces another fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Fault {
    /// It was not.
    #[default]
    None,
    /// The platform turned faster than the settings allow.
    Overspeed,
    /// The motor current was above what the settings allow.
    OverCurrent,
    /// The motor pushes and the platform does not turn.
    Stall,
    /// The platform did not follow: the ramp slipped for longer than the settings allow.
    Tracking,
    /// The motor's back-EMF says that it turns, and the encoder's count stays.
    EncoderLost,
    /// The bridge's supply was too low while it drove.
    SupplyLow,
    /// The bridge's supply was too high while it drove.
    SupplyHigh,
    /// A tick of the control interrupt was lost.
    Clock,
    /// Somebody asked for an emergency stop.
    EmergencyStop,
    /// The winding was too hot.
    Temperature,
    /// The sensor under test gave no reading for longer than the settings allow.
    SensorSilent,
    /// The host, which had asked to be watched, was not heard for longer than it had said.
    HostSilent,
    /// The index did not come where the counted turns say that it must.
    IndexLost,
    /// The converter of current and supply has stopped.
    ReadingsStale,
}

impl Fault {
    /// All but `None`, by their codes from 1 on.
    pub const ALL: [Self; 14] = [
        Self::Overspeed,
        Self::OverCurrent,
        Self::Stall,
        Self::Tracking,
        Self::EncoderLost,
        Self::SupplyLow,
        Self::SupplyHigh,
        Self::Clock,
        Self::EmergencyStop,
        Self::Temperature,
        Self::SensorSilent,
        Self::HostSilent,
        Self::IndexLost,
        Self::ReadingsStale,
    ];

    /// Its number: 0 for none, else from 1 on; the same for ever, as frames and logs carry it.
    #[inline]
    pub fn code(self) -> u32 {
        self as u32
    }

    /// The fault of a number; `None` for one that no fault has.
    pub fn of_code(code: u32) -> Self {
        Self::ALL.get((code as usize).wrapping_sub(1)).copied().unwrap_or_default()
    }

    /// The fault in a word or two, for logs and people.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Overspeed => "overspeed",
            Self::OverCurrent => "over-current",
            Self::Stall => "stall",
            Self::Tracking => "tracking error",
            Self::EncoderLost => "encoder lost",
            Self::SupplyLow => "supply low",
            Self::SupplyHigh => "supply high",
            Self::Clock => "clock",
            Self::EmergencyStop => "emergency stop",
            Self::Temperature => "temperature",
            Self::SensorSilent => "sensor silent",
            Self::HostSilent => "host silent",
            Self::IndexLost => "index lost",
            Self::ReadingsStale => "readings stale",
        }
    }

    /// What a person at the bench may do about it.
    pub fn advice(self) -> &'static str {
        match self {
            Self::None => "nothing is wrong",
            Self::Overspeed => "ask for a lower rate or voltage, or raise overspeed_rad_s",
            Self::OverCurrent => "look for a short or a blocked platform; resistance_ohm must be the motor's",
            Self::Stall => "free the platform, or ask for less torque",
            Self::Tracking => "ask for less acceleration or a lower rate, or look for what holds the platform back",
            Self::EncoderLost => "check the encoder's plug, supply and both channels",
            Self::SupplyLow => "check the bridge's supply under load",
            Self::SupplyHigh => "check the bridge's supply; braking feeds energy back into it",
            Self::Clock => "a control tick came late or was lost: a fault of the firmware or of its clock",
            Self::EmergencyStop => "release the stop, then FAULt:CLEar; the button does not clear it",
            Self::Temperature => "let the motor cool",
            Self::SensorSilent => "check the sensor's plug and supply, or run without it",
            Self::HostSilent => "the program that drives was silent: send HOST:ALIVe at least every 2 s, or HOST:UNATTended with a time",
            Self::IndexLost => "check the encoder's index channel and the counts per turn",
            Self::ReadingsStale => "the converter of current and supply has stopped: reset the controller",
        }
    }
}

/// Limits in force: why the output is less than the command. A set of flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits(pub u8);

impl Limits {
    /// How many there are.
    pub const COUNT: usize = 6;
    /// The current limit holds the voltage back.
    pub const CURRENT: Self = Self(1);
    /// The bridge has no more voltage.
    pub const VOLTAGE: Self = Self(2);
    /// The rate command follows its target at the acceleration limit.
    pub const ACCELERATION: Self = Self(4);
    /// The position ramp was left behind and has been anchored anew: the mean rate is not the crystal's here.
    pub const SLIPPED: Self = Self(8);
    /// A segment came late, or none came and the last value is held.
    pub const STARVED: Self = Self(16);
    /// An angle from the index is asked for, and the index was not seen: the platform is held where it is.
    pub const NO_INDEX: Self = Self(32);

    /// Their names, in the order of the bits.
    pub const NAMES: [&'static str; Self::COUNT] = ["current", "voltage", "acceleration", "slipped", "starved", "no index"];

    /// Whether all of `other` are set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    #[inline]
    pub(crate) fn set(&mut self, other: Self, when: bool) {
        if when {
            self.0 |= other.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_a_code_of_its_own_a_name_and_advice() {
        for (n, fault) in Fault::ALL.into_iter().enumerate() {
            assert_eq!((fault.code(), Fault::of_code(fault.code())), (n as u32 + 1, fault));
            assert!(!fault.name().is_empty() && !fault.advice().to_string().is_empty());
            assert!(Fault::ALL.iter().all(|other| *other == fault || other.name() != fault.name()));
        }
        assert_eq!(Fault::of_code(200), Fault::None);
    }
}

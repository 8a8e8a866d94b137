//! What the tasks ask of the speed loop: a straight piece of a profile, from a given tick on.
//!
//! Values are fixed point, 2⁻³² of a unit: encoder counts per tick in rate mode, compare counts in voltage mode. One
//! unit of the rate command is then 7·10⁻¹⁰ rad/s on the default stand, so rounding is far below the crystal.
//! A segment that nobody follows up ends by itself: its value is held and its slope is over.

use crate::board::{CONTROL_HZ, Hardware};
use crate::mailbox::{Words, join_u64, one_by_one, split_u64};
use crate::maths::to_i64;
use crate::status::Fault;

/// One unit of the fixed point.
pub const ONE: f64 = 4_294_967_296.0;

/// What is regulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Nothing: the bridge asks for no voltage.
    #[default]
    Off,
    /// Voltage is asked for as it is; limits hold.
    Voltage,
    /// Rate is held as an integrated position ramp.
    Rate,
    /// An angle is approached and held.
    Position,
}

impl Mode {
    /// Whether the platform follows a ramp.
    #[inline]
    pub fn follows(self) -> bool {
        matches!(self, Mode::Rate | Mode::Position)
    }

    /// Its name in logs and answers.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Off => "off",
            Mode::Voltage => "voltage",
            Mode::Rate => "rate",
            Mode::Position => "position",
        }
    }

    pub(crate) fn code(self) -> u32 {
        match self {
            Mode::Off => 0,
            Mode::Voltage => 1,
            Mode::Rate => 2,
            Mode::Position => 3,
        }
    }

    pub(crate) fn of_code(code: u32) -> Self {
        match code {
            1 => Mode::Voltage,
            2 => Mode::Rate,
            3 => Mode::Position,
            _ => Mode::Off,
        }
    }
}

/// What an angle is counted from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Zero {
    /// Where the counter was zero, at power-on.
    #[default]
    PowerOn,
    /// The index, as it was last seen.
    Index,
}

/// A straight piece: `value + slope · (n − start_tick)` at tick n, for `ticks` ticks, then held.
///
/// A voltage is followed from decision to decision, two ticks, and begins at any tick; rate and position are followed from millisecond to
/// millisecond, so their segments begin at whole milliseconds. An angle (position mode) has no slope and is held for ever.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Segment {
    /// The tick from which on it acts *on the motor*.
    pub start_tick: u64,
    /// Length, in ticks.
    pub ticks: u16,
    /// What is regulated.
    pub mode: Mode,
    /// Value at the start, 2⁻³² counts per tick, 2⁻³² compare counts, or 2⁻³² counts of angle, of which the whole ones wrap.
    pub value: i64,
    /// Its change per tick; for an angle the greatest rate on the way, 2⁻³² counts per tick, 0: the settings'.
    pub slope: i64,
    /// What an angle is counted from.
    pub zero: Zero,
}

impl Segment {
    /// A constant voltage, V, rounded to a compare count.
    pub fn voltage(hardware: &Hardware, start_tick: u64, ticks: u16, volts: f64) -> Self {
        let counts = crate::maths::round(volts / hardware.volt_per_duty());
        Self { start_tick, ticks, mode: Mode::Voltage, value: to_i64(counts * ONE), ..Self::default() }
    }

    /// A rate that goes straight from `from_rad_s` at the start to `to_rad_s` at the end.
    pub fn rate(hardware: &Hardware, start_tick: u64, ticks: u16, from_rad_s: f64, to_rad_s: f64) -> Self {
        let unit = rate_unit(hardware);
        let slope = (to_rad_s - from_rad_s) * unit / f64::from(ticks.max(1));
        Self {
            start_tick,
            ticks,
            mode: Mode::Rate,
            value: to_i64(crate::maths::round(from_rad_s * unit)),
            slope: to_i64(crate::maths::round(slope)),
            ..Self::default()
        }
    }

    /// An angle from `zero`, rad, several turns if it is to be, approached no faster than `fastest_rad_s`; `None`: the settings' rate.
    pub fn position(hardware: &Hardware, start_tick: u64, zero: Zero, angle_rad: f64, fastest_rad_s: Option<f64>) -> Self {
        let counts = angle_rad / hardware.rad_per_count();
        let whole = crate::maths::floor(counts);
        Self {
            start_tick,
            ticks: u16::MAX,
            mode: Mode::Position,
            // Whole counts wrap as the counter does.
            value: i64::from(to_i64(whole) as i32) << 32 | to_i64((counts - whole) * ONE),
            slope: fastest_rad_s.map_or(0, |rate| to_i64(crate::maths::round(rate.abs() * rate_unit(hardware))).max(1)),
            zero,
        }
    }

    /// Nothing, from `start_tick` on.
    pub fn off(start_tick: u64) -> Self {
        Self { start_tick, ..Self::default() }
    }

    /// The value at tick `n`: what the tick works out piece by piece.
    #[cfg(test)]
    pub(crate) fn at(&self, n: u64) -> i64 {
        let along = n.saturating_sub(self.start_tick).min(u64::from(self.ticks)) as i64;
        self.value.saturating_add(self.slope.saturating_mul(along))
    }
}

/// 2⁻³² counts per tick in one rad/s.
pub fn rate_unit(hardware: &Hardware) -> f64 {
    ONE / hardware.rad_per_count() / CONTROL_HZ as f64
}

/// What the tasks post to the interrupt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Order {
    /// What to do next.
    pub segment: Segment,
    /// A number that, when it changes, clears a latched fault whose cause is gone.
    pub clear: u16,
    /// A cause that the tasks see, for as long as it is there: it switches the drive off.
    pub trip: Fault,
}

/// Words of an [`Order`].
pub const ORDER_WORDS: usize = 8;

impl Words<ORDER_WORDS> for Order {
    one_by_one!(8: 0 1 2 3 4 5 6 7);

    #[inline]
    fn to_words(&self) -> [u32; ORDER_WORDS] {
        let [s0, s1] = split_u64(self.segment.start_tick);
        let [v0, v1] = split_u64(self.segment.value as u64);
        let [d0, d1] = split_u64(self.segment.slope as u64);
        let zero = u32::from(self.segment.zero == Zero::Index);
        let how = u32::from(self.segment.ticks) << 8 | zero << 7 | self.segment.mode.code();
        [s0, s1, v0, v1, d0, d1, how, u32::from(self.clear) | self.trip.code() << 16]
    }

    #[inline]
    fn from_words(&[s0, s1, v0, v1, d0, d1, how, clear]: &[u32; ORDER_WORDS]) -> Self {
        Self {
            segment: Segment {
                start_tick: join_u64(s0, s1),
                ticks: (how >> 8) as u16,
                mode: Mode::of_code(how & 0x7f),
                value: join_u64(v0, v1) as i64,
                slope: join_u64(d0, d1) as i64,
                zero: if how & 0x80 == 0 { Zero::PowerOn } else { Zero::Index },
            },
            clear: clear_of(clear),
            trip: trip_of(clear),
        }
    }
}

/// The number in an order's last word that clears a fault when it changes.
#[inline]
pub(super) fn clear_of(of_faults: u32) -> u16 {
    of_faults as u16
}

/// The cause in an order's last word.
#[inline]
pub(super) fn trip_of(of_faults: u32) -> Fault {
    Fault::of_code(of_faults >> 16)
}

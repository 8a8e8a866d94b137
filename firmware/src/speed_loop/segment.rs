//! Segments: linear pieces of a profile, each from a given tick on. A [`Command`] carries one from the tasks to the interrupt.
//!
//! Values are in fixed point, 2⁻³² of a unit: encoder counts per tick in rate mode, compare counts in voltage mode. One unit of the rate
//! command is 7·10⁻¹⁰ rad/s on the default stand, so that rounding is far below the crystal's error. After its end a segment without a
//! successor holds its last value.

use crate::board::{CONTROL_HZ, Hardware};
use crate::status::Fault;

/// One unit of the fixed point.
pub const ONE: f64 = 4_294_967_296.0;

/// What is regulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Nothing: no voltage.
    #[default]
    Off,
    /// Voltage, open loop; limits apply.
    Voltage,
    /// Rate, as an integrated position ramp.
    Rate,
    /// Angle, approached and held.
    Position,
}

impl Mode {
    /// Whether the platform follows a ramp.
    #[inline]
    pub fn follows(self) -> bool {
        matches!(self, Mode::Rate | Mode::Position)
    }

    /// Its name in logs and replies.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Off => "off",
            Mode::Voltage => "voltage",
            Mode::Rate => "rate",
            Mode::Position => "position",
        }
    }
}

/// Zero of an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Zero {
    /// The counter's zero, at power-on.
    #[default]
    PowerOn,
    /// The index, as it was last seen.
    Index,
}

/// A linear piece: `value + slope · (n − start_tick)` at tick n, for `ticks` ticks, then held.
///
/// A voltage acts tick by tick. The ramp of rate and position is planned by the millisecond, so these segments begin at whole milliseconds.
/// An angle (position mode) has no slope and is held without end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Segment {
    /// The tick from which it acts *on the motor*.
    pub start_tick: u64,
    /// Length, in ticks.
    pub ticks: u16,
    /// What is regulated.
    pub mode: Mode,
    /// Value at the start: 2⁻³² counts per tick, 2⁻³² compare counts, or 2⁻³² counts of angle (whole counts wrap).
    pub value: i64,
    /// Its change per tick; for an angle the greatest rate of the approach, 2⁻³² counts per tick (0: as in the settings).
    pub slope: i64,
    /// Zero of an angle.
    pub zero: Zero,
}

impl Segment {
    /// A constant voltage, V, rounded to a compare count.
    pub fn voltage(hardware: &Hardware, start_tick: u64, ticks: u16, volts: f64) -> Self {
        let counts = libm::round(volts / hardware.volt_per_duty());
        Self { start_tick, ticks, mode: Mode::Voltage, value: (counts * ONE) as i64, ..Self::default() }
    }

    /// A rate that changes linearly from `from_rad_s` at the start to `to_rad_s` at the end.
    pub fn rate(hardware: &Hardware, start_tick: u64, ticks: u16, from_rad_s: f64, to_rad_s: f64) -> Self {
        let unit = rate_unit(hardware);
        let slope = (to_rad_s - from_rad_s) * unit / f64::from(ticks.max(1));
        Self {
            start_tick,
            ticks,
            mode: Mode::Rate,
            value: libm::round(from_rad_s * unit) as i64,
            slope: libm::round(slope) as i64,
            ..Self::default()
        }
    }

    /// An angle from `zero`, rad, possibly several turns, approached at `max_rad_s` at most (`None`: as in the settings).
    pub fn position(hardware: &Hardware, start_tick: u64, zero: Zero, angle_rad: f64, max_rad_s: Option<f64>) -> Self {
        let counts = angle_rad / hardware.rad_per_count();
        let whole = libm::floor(counts);
        Self {
            start_tick,
            ticks: u16::MAX,
            mode: Mode::Position,
            // Whole counts wrap as the counter does.
            value: i64::from(whole as i64 as i32) << 32 | ((counts - whole) * ONE) as i64,
            slope: max_rad_s.map_or(0, |rate| (libm::round(rate.abs() * rate_unit(hardware)) as i64).max(1)),
            zero,
        }
    }

    /// Drive off from `start_tick` on.
    pub fn off(start_tick: u64) -> Self {
        Self { start_tick, ..Self::default() }
    }

    /// The value at tick `n`, in one step.
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

/// A fixed-point number (2⁻³² of a unit) in units, within one unit in the last place.
///
/// The FPU converts 32 bits in one instruction; the library's conversion of 64 bits takes 70, and a tick needs several.
#[inline]
pub(super) fn fixed_to_f32(value: i64) -> f32 {
    const UNIT: f32 = 1.0 / ONE as f32;
    let fraction = value as i32;
    if i64::from(fraction) == value {
        // Less than half a unit: one conversion, without cancellation.
        return fraction as f32 * UNIT;
    }
    (value >> 32) as i32 as f32 + value as u32 as f32 * UNIT
}

/// Units in fixed point, to 2⁻³¹ of a unit; beyond ±2³¹ units the limit.
#[inline]
pub(super) fn f32_to_fixed(value: f32) -> i64 {
    let whole = value as i32;
    let fraction = ((value - whole as f32) * (0.5 * ONE as f32)) as i32;
    (i64::from(whole) << 32).saturating_add(i64::from(fraction) << 1)
}

/// Message of the tasks to the interrupt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// The next segment.
    pub segment: Segment,
    /// Clears a latched fault, whose cause is gone, when this number changes.
    pub clear: u16,
    /// A fault that the tasks detect, for as long as it persists: it switches the drive off.
    pub trip: Fault,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_point_becomes_f32_within_one_unit_in_the_last_place() {
        for shift in 0..62 {
            for offset in [-3, -1, 0, 1, 5, 1 << 20] {
                for value in [(1_i64 << shift) + offset, -(1_i64 << shift) + offset, (0x5a5a_5a5a_5a5a_5a5a >> shift) + offset] {
                    let exact = value as f64 / ONE;
                    let error = (f64::from(fixed_to_f32(value)) - exact).abs();
                    assert!(error <= exact.abs() * f64::from(f32::EPSILON), "{value}: {error}");
                }
            }
        }
    }

    #[test]
    fn f32_becomes_fixed_point_to_half_a_unit_in_2_to_the_minus_31() {
        for value in [0.0_f32, 1e-9, 0.25, 0.999_999_94, 1.0, 3.7, 1_234.567, 2.0e9] {
            for value in [value, -value] {
                assert!((f32_to_fixed(value) - (f64::from(value) * ONE) as i64).abs() <= 1, "{value}");
            }
        }
        assert!(f32_to_fixed(1e20) > i64::MAX - 2 && f32_to_fixed(-1e20) < i64::MIN + 2);
        assert_eq!(f32_to_fixed(f32::NAN), 0);
    }
}

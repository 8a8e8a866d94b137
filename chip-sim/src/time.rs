//! Simulated time: steps of 1/720 MHz, a whole number of which makes a cycle of every clock of the chip (180, 90, 45, 16, 8 MHz; 32 kHz).

/// A time since power-on, or a duration, in steps of 1/720 MHz.
pub type Time = u64;

/// Steps per second.
pub const PER_S: Time = 720_000_000;
/// Steps per millisecond.
pub const PER_MS: Time = PER_S / 1000;
/// Steps per microsecond.
pub const PER_US: Time = PER_S / 1_000_000;
/// A time that never comes.
pub const NEVER: Time = Time::MAX;

/// Steps in `seconds`.
pub fn of_seconds(seconds: f64) -> Time {
    (seconds * PER_S as f64).round() as Time
}

/// Seconds of a time.
pub fn seconds(t: Time) -> f64 {
    t as f64 / PER_S as f64
}

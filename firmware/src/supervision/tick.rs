//! Supervision in the control interrupt: faults that must switch the drive off within milliseconds.
//!
//! Each tick: over-current, stopped converter and emergency stop. Each millisecond: overspeed, stall (the motor is driven and nothing
//! turns), encoder lost (the back-EMF shows rotation and no edge comes), supply, and the time for which the ramp slips. The first cause is
//! latched; it can be cleared once it is gone.

use super::Settings;
use crate::board::{Hardware, Sensed};
use crate::status::{Fault, Limits};

/// Consecutive conversions above the limit that count as over-current: a single one is a switching spike.
const OVER_CURRENT_TICKS: u32 = 3;
/// Consecutive ticks without a conversion that count as a stopped converter. The first ticks after a stall of the core have none.
const STALE_TICKS: u32 = 4;
/// Consecutive supply readings out of limits: a contact bounce is shorter.
const SUPPLY_MS: u32 = 5;
/// Counts around a count that are not motion.
const STILL_COUNTS: u32 = 2;
/// Fraction of R·i by which the resistance may be wrong (copper: 0.4 % per kelvin).
const RESISTANCE_TOLERANCE: f32 = 0.2;
/// Counts in a millisecond from which no motor comes to rest at once: 2.5 rad/s of the default encoder.
const MOVING_COUNTS: u32 = 8;
/// Brushes and dead time may look like the back-EMF of a motor that stopped slowly: there the threshold is multiplied by at least this,
/// 0.35 V.
const STILL_FACTOR: f32 = 3.0;
/// Weight of a new reading in the mean back-EMF: 8 ms.
const BACK_EMF_WEIGHT: f32 = 0.125;

/// Thresholds in the tick's units.
#[derive(Clone, Copy, Debug)]
pub struct Thresholds {
    /// Counts per tick.
    overspeed: f32,
    /// Valid current codes.
    current_min: i32,
    current_max: i32,
    zero_current: i32,
    /// Compare counts that drive one current code through the winding.
    duty_per_code: f32,
    stall_duty: f32,
    stall_ms: u32,
    /// Back-EMF, compare counts, at which edges must come.
    rotation_duty: f32,
    encoder_lost_ms: u32,
    /// Valid supply codes.
    supply_min: u32,
    supply_max: u32,
    tracking_ms: u32,
}

/// The drive's constants that the thresholds depend on.
pub struct DriveConstants {
    /// Rate at which the drive is switched off, rad/s.
    pub overspeed_rad_s: f64,
    /// Resistance of the winding, Ω.
    pub resistance_ohm: f64,
    /// Motor constant, N m/A.
    pub motor_constant_N_m_A: f64,
    /// One count per tick, rad/s.
    pub rad_s_per_count_tick: f64,
}

impl Thresholds {
    /// Checked settings in the tick's units.
    pub fn new(settings: &Settings, hardware: &Hardware, drive: &DriveConstants) -> Self {
        let duty_per_V = 1.0 / hardware.volt_per_duty();
        let duty_per_A = drive.resistance_ohm * duty_per_V;
        let supply_code = |share: f64| (share * hardware.supply_nominal_V / hardware.supply_V_per_code) as u32;
        let milliseconds = |seconds: f64| (libm::round(seconds * 1e3) as u32).max(1);
        let zero = hardware.current_zero_code;
        let over_codes = settings.trip_A(hardware) / hardware.current_A_per_code;
        Self {
            overspeed: (drive.overspeed_rad_s / drive.rad_s_per_count_tick) as f32,
            current_min: (zero - over_codes) as i32,
            current_max: (zero + over_codes) as i32,
            zero_current: zero as i32,
            duty_per_code: (hardware.current_A_per_code * duty_per_A) as f32,
            stall_duty: (settings.stall_current_A * duty_per_A) as f32,
            stall_ms: milliseconds(settings.stall_s),
            rotation_duty: (settings.encoder_lost_rad_s * drive.motor_constant_N_m_A * duty_per_V) as f32,
            encoder_lost_ms: milliseconds(settings.encoder_lost_s),
            supply_min: supply_code(settings.supply_low_share),
            supply_max: supply_code(settings.supply_high_share),
            tracking_ms: milliseconds(settings.tracking_s),
        }
    }

    #[inline]
    fn is_over_current(&self, code: i32) -> bool {
        code < self.current_min || code > self.current_max
    }

    fn is_supply_bad(&self, code: u32) -> bool {
        code < self.supply_min || code > self.supply_max
    }
}

/// State of the drive, once in a millisecond.
#[derive(Clone, Copy, Debug)]
pub struct DriveState {
    /// Newest conversion of the current.
    pub current: i32,
    /// Newest conversion of the supply.
    pub supply: u32,
    /// Voltage during the last tick, compare counts of the nominal supply.
    pub duty: f32,
    /// Whether the drive is on.
    pub is_on: bool,
    /// Encoder counts.
    pub counts: i32,
    /// Estimated rate, counts per tick.
    pub rate: f32,
    /// Limits in force within the last millisecond.
    pub limits: Limits,
}

/// The latched fault and the counters behind it.
#[derive(Clone, Copy, Debug, Default)]
pub struct TickSupervisor {
    /// The first fault since the last clearing.
    pub fault: Fault,
    /// The tick in which it was detected, low word.
    pub fault_tick: u32,
    over_current_ticks: u32,
    stale_ticks: u32,
    bad_supply_ms: u32,
    slipping_ms: u32,
    motion: Motion,
}

/// Does the platform turn, and should it?
#[derive(Clone, Copy, Debug, Default)]
struct Motion {
    stalled_ms: u32,
    rotating_ms: u32,
    /// Mean back-EMF, compare counts.
    back_emf: f32,
    /// The count around which the platform is still.
    still_at: i32,
    /// Counts in the last millisecond with motion; halved for each earlier one.
    pace: u32,
}

impl TickSupervisor {
    /// Latches a fault; the first stays.
    #[cold]
    pub fn trip(&mut self, fault: Fault, tick: u32) {
        if self.fault == Fault::None {
            self.fault = fault;
            self.fault_tick = tick;
        }
    }

    /// Latches an emergency stop. It replaces another fault, because clearing it takes more.
    #[cold]
    fn stop(&mut self, tick: u32) {
        if self.fault != Fault::EmergencyStop {
            self.fault = Fault::EmergencyStop;
            self.fault_tick = tick;
        }
    }

    /// Each tick: over-current, stopped converter and emergency stop.
    #[inline]
    pub fn each_tick(&mut self, thresholds: &Thresholds, sensed: &Sensed) {
        let tick = sensed.tick as u32;
        if sensed.stop {
            self.stop(tick);
        }
        if thresholds.is_over_current(sensed.current.0) {
            self.over_current_ticks = self.over_current_ticks.saturating_add(1);
            if self.over_current_ticks >= OVER_CURRENT_TICKS {
                self.trip(Fault::OverCurrent, tick);
            }
        } else {
            self.over_current_ticks = 0;
        }
        self.stale_ticks = if sensed.is_stale { self.stale_ticks.saturating_add(1) } else { 0 };
        if self.stale_ticks >= STALE_TICKS {
            self.trip(Fault::ReadingsStale, tick);
        }
    }

    /// Each millisecond: motion, rate, supply, and how long the ramp has been slipping.
    pub fn each_millisecond(&mut self, thresholds: &Thresholds, drive: &DriveState, tick: u32) {
        if drive.is_on {
            self.motion.update(thresholds, drive);
        } else {
            self.motion = Motion { still_at: drive.counts, ..Motion::default() };
        }
        let count = |is_so: bool, milliseconds: u32| if is_so { milliseconds.saturating_add(1) } else { 0 };
        self.bad_supply_ms = count(drive.is_on && thresholds.is_supply_bad(drive.supply), self.bad_supply_ms);
        self.slipping_ms = count(drive.limits.contains(Limits::SLIPPED), self.slipping_ms);
        if self.motion.rotating_ms >= thresholds.encoder_lost_ms {
            self.trip(Fault::EncoderLost, tick);
        }
        if self.motion.stalled_ms >= thresholds.stall_ms {
            self.trip(Fault::Stall, tick);
        }
        if drive.rate.abs() > thresholds.overspeed {
            self.trip(Fault::Overspeed, tick);
        }
        if self.bad_supply_ms >= SUPPLY_MS {
            self.trip(if drive.supply < thresholds.supply_min { Fault::SupplyLow } else { Fault::SupplyHigh }, tick);
        }
        if self.slipping_ms >= thresholds.tracking_ms {
            self.trip(Fault::Tracking, tick);
        }
    }

    /// Clears the latched fault if its cause is gone; `rate` in counts per tick.
    #[cold]
    pub fn clear(&mut self, thresholds: &Thresholds, sensed: &Sensed, rate: f32) {
        let supply = sensed.supply.0;
        let persists = match self.fault {
            Fault::EmergencyStop => sensed.stop,
            Fault::Overspeed => rate.abs() > thresholds.overspeed,
            Fault::OverCurrent => thresholds.is_over_current(sensed.current.0),
            Fault::ReadingsStale => sensed.is_stale,
            Fault::SupplyLow => supply < thresholds.supply_min,
            Fault::SupplyHigh => supply > thresholds.supply_max,
            // With the drive off the others cannot persist; faults of the tasks are reported again.
            _ => false,
        };
        if !persists {
            *self = Self { motion: Motion { still_at: self.motion.still_at, ..Motion::default() }, ..Self::default() };
        }
    }
}

impl Motion {
    fn update(&mut self, thresholds: &Thresholds, drive: &DriveState) {
        let resistive_drop = drive.current.wrapping_sub(thresholds.zero_current) as f32 * thresholds.duty_per_code;
        let duty = drive.duty;
        // By the measured current or, if its wire is off, by what the voltage would drive at rest.
        let is_driven = resistive_drop.abs() > thresholds.stall_duty || duty.abs() > thresholds.stall_duty;
        // Not by the edges: with one channel off the other still has them, and the count alternates by one.
        let counts = drive.counts.wrapping_sub(self.still_at).unsigned_abs();
        let is_still = counts <= STILL_COUNTS;
        if !is_still {
            self.still_at = drive.counts;
            self.pace = (self.pace >> 1).max(counts);
        }
        self.back_emf += BACK_EMF_WEIGHT * (duty - resistive_drop - self.back_emf);
        let mut threshold = thresholds.rotation_duty + RESISTANCE_TOLERANCE * resistive_drop.abs();
        // A count that stops during fast rotation has lost its encoder; one that stopped slowly, or never ran, needs more evidence.
        if self.pace <= MOVING_COUNTS {
            threshold = threshold.max(STILL_FACTOR * thresholds.rotation_duty);
        }
        let is_rotating = self.back_emf.abs() > threshold;
        self.stalled_ms = if is_driven && is_still { self.stalled_ms.saturating_add(1) } else { 0 };
        self.rotating_ms = if is_rotating && is_still { self.rotating_ms.saturating_add(1) } else { 0 };
    }
}

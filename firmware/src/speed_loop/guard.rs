//! What switches the drive off, judged in the tick.
//!
//! In each tick: current, the wish to stop. Once in a millisecond, in turn: rate, whether the motor pushes and nothing turns, whether its
//! back-EMF says that it turns and no edge comes, supply, and how long the ramp has been slipping. The first cause latches and is kept;
//! clearing takes its cause to be gone. Thresholds: [`crate::supervision::Settings`].

use crate::board::{Hardware, Sensed};
use crate::maths::{to_i32, to_u32};
use crate::status::Fault;
use crate::status::Limits;
use crate::supervision;

/// Conversions in a row above the limit that are a current: one alone is a spike of the bridge.
const OVER_CURRENT_TICKS: u32 = 3;
/// Share of the converter's range that still is a reading.
const CONVERTER_ENDS: f64 = 0.98;
/// Supply readings in a row out of its limits: a notch of a connector is shorter.
const SUPPLY_MS: u32 = 5;
/// Counts about a count that are no motion.
const STAYS_COUNTS: u32 = 2;
/// What of R·i may be wrong, as the resistance is (copper: 0.4 % for each kelvin).
const RESISTANCE_WRONG: f32 = 0.2;
/// Counts in a millisecond, and half of those in the one before, from which no motor comes to rest at once: 2.5 rad/s of the default encoder.
const PACE_COUNTS: u32 = 8;
/// What looks like back-EMF of a motor that came to rest slowly may be its brushes' or the bridge's: at least so many times the rate's is taken there, 0.35 V.
const AT_REST: f32 = 3.0;
/// Share of a new reading in the back-EMF's mean: 8 ms.
const BACK_EMF_SHARE: f32 = 0.125;

/// Thresholds in the tick's units.
#[derive(Clone, Copy, Debug)]
pub struct Thresholds {
    overspeed: f32,
    /// Codes: the lowest that is allowed, and from there the range.
    current_from: i32,
    current_range: u32,
    zero_code: i32,
    /// Compare counts that drive a current code through the winding.
    duty_per_code: f32,
    stall_duty: f32,
    stall_ms: u32,
    /// Compare counts of back-EMF at the rate that cannot be without edges.
    turning_duty: f32,
    lost_ms: u32,
    /// Codes: the lowest that is allowed, and from there the range.
    supply_from: u32,
    supply_range: u32,
    tracking_ms: u32,
}

/// What of the settings decides, all in SI units.
pub struct Given {
    pub overspeed_rad_s: f64,
    pub resistance_ohm: f64,
    pub motor_constant_N_m_A: f64,
    /// One count per tick, rad/s.
    pub rad_s_per_count_tick: f64,
}

impl Thresholds {
    /// Checked settings in the tick's units.
    pub fn new(s: &supervision::Settings, hardware: &Hardware, given: &Given) -> Self {
        let codes = |amperes: f64| amperes / hardware.current_A_per_code;
        let duty_per_volt = 1.0 / hardware.volt_per_duty();
        let supply = |share: f64| to_u32(share * hardware.supply_nominal_V / hardware.supply_V_per_code);
        let ms = |seconds: f64| to_u32(crate::maths::round(seconds * 1e3)).max(1);
        let zero = hardware.current_zero_code;
        // A current at the converter's end may be any: there it is over, too.
        let over_codes = crate::maths::lesser(codes(s.over_current_A), CONVERTER_ENDS * zero);
        Self {
            overspeed: (given.overspeed_rad_s / given.rad_s_per_count_tick) as f32,
            current_from: to_i32(zero - over_codes),
            current_range: to_u32(2.0 * over_codes),
            zero_code: to_i32(zero),
            duty_per_code: (hardware.current_A_per_code * given.resistance_ohm * duty_per_volt) as f32,
            stall_duty: (s.stall_current_A * given.resistance_ohm * duty_per_volt) as f32,
            stall_ms: ms(s.stall_s),
            turning_duty: (s.encoder_lost_rad_s * given.motor_constant_N_m_A * duty_per_volt) as f32,
            lost_ms: ms(s.encoder_lost_s),
            supply_from: supply(s.supply_low_share),
            supply_range: supply(s.supply_high_share).saturating_sub(supply(s.supply_low_share)),
            tracking_ms: ms(s.tracking_s),
        }
    }
}

/// What of the last tick the guard looks at.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// What is sensed.
    pub current: i32,
    pub supply: u32,
    /// Compare counts during the tick that has ended.
    pub duty: i16,
    /// Whether the drive is on.
    pub on: bool,
    /// Whole counts.
    pub counts: i32,
    /// What was in force within the millisecond before.
    pub limits: Limits,
}

/// Counters between ticks, and the latched fault.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guard {
    /// The first cause.
    pub fault: Fault,
    /// The tick in which it was seen, low word.
    pub at: u32,
    over: u32,
    stalled_ms: u32,
    back_emf: f32,
    /// The count about which it has stayed.
    stays_at: i32,
    /// Counts in the last millisecond in which it moved; of those before, half as many for each.
    pace: u32,
    turning_ms: u32,
    over_at: u32,
    bad_supply_ms: u32,
    slipping_ms: u32,
}

impl Guard {
    /// Latches a fault; the first stays.
    #[cold]
    #[inline(never)]
    pub fn trip(&mut self, fault: Fault, tick: u32) {
        if self.fault == Fault::None {
            self.fault = fault;
            self.at = tick;
        }
    }

    /// In each tick: current, and the wish to stop.
    #[inline]
    pub fn fast(&mut self, t: &Thresholds, sensed: &Sensed) {
        if sensed.stop || t.is_over(sensed.current.0) {
            self.out_of_bounds(t, sensed);
        }
    }

    #[cold]
    #[inline(never)]
    fn out_of_bounds(&mut self, t: &Thresholds, sensed: &Sensed) {
        // One that is latched stays, and a stop may be held for long.
        if self.fault != Fault::None {
            return;
        }
        let tick = sensed.tick as u32;
        if sensed.stop {
            self.trip(Fault::EmergencyStop, tick);
        }
        if t.is_over(sensed.current.0) {
            let in_a_row = tick.wrapping_sub(self.over_at) == 1;
            self.over = if in_a_row { self.over.wrapping_add(1) } else { 1 };
            self.over_at = tick;
            if self.over >= OVER_CURRENT_TICKS {
                self.trip(Fault::OverCurrent, tick);
            }
        }
    }

    /// Once in a millisecond: the motor pushes, and nothing turns; or it turns, and no edge comes.
    #[inline]
    pub fn turning(&mut self, t: &Thresholds, look: &Look, tick: u32) {
        if !look.on {
            *self = Self { stalled_ms: 0, turning_ms: 0, back_emf: 0.0, pace: 0, stays_at: look.counts, ..*self };
            return;
        }
        let drop = look.current.wrapping_sub(t.zero_code) as f32 * t.duty_per_code;
        let duty = f32::from(look.duty);
        // What it pushes with: what is measured, or, where the current's wire is off, what the voltage would drive at rest.
        let pushes = drop.abs() > t.stall_duty || duty.abs() > t.stall_duty;
        // Not the edges: with one channel off the other still has them, and the count goes to and fro by one.
        let counts = look.counts.wrapping_sub(self.stays_at).unsigned_abs();
        let moved = counts > STAYS_COUNTS;
        if moved {
            self.stays_at = look.counts;
            self.pace = (self.pace >> 1).max(counts);
        }
        let stays = !moved;
        self.stalled_ms = if pushes && stays { self.stalled_ms.wrapping_add(1) } else { 0 };
        self.back_emf += BACK_EMF_SHARE * (duty - drop - self.back_emf);
        let mut least_duty = t.turning_duty + RESISTANCE_WRONG * drop.abs();
        // A count that stops in its run has lost its encoder; one that crept to rest, or never ran, is at rest until more speaks against it.
        let at_rest = AT_REST * t.turning_duty;
        if self.pace <= PACE_COUNTS && least_duty < at_rest {
            least_duty = at_rest;
        }
        let turns = self.back_emf.abs() > least_duty;
        self.turning_ms = if turns && stays { self.turning_ms.wrapping_add(1) } else { 0 };
        if self.turning_ms >= t.lost_ms {
            self.trip(Fault::EncoderLost, tick);
        } else if self.stalled_ms >= t.stall_ms {
            self.trip(Fault::Stall, tick);
        }
    }

    /// Once in a millisecond: rate, supply, and how long the ramp has been slipping.
    #[inline]
    pub fn supply(&mut self, t: &Thresholds, look: &Look, rate: f32, tick: u32) {
        if rate.abs() > t.overspeed {
            self.trip(Fault::Overspeed, tick);
        }
        let bad = look.supply.wrapping_sub(t.supply_from) > t.supply_range && look.on;
        self.bad_supply_ms = if bad { self.bad_supply_ms.wrapping_add(1) } else { 0 };
        if self.bad_supply_ms >= SUPPLY_MS {
            self.trip(if look.supply < t.supply_from { Fault::SupplyLow } else { Fault::SupplyHigh }, tick);
        }
        self.slipping_ms = if look.limits.contains(Limits::SLIPPED) { self.slipping_ms.wrapping_add(1) } else { 0 };
        if self.slipping_ms >= t.tracking_ms {
            self.trip(Fault::Tracking, tick);
        }
    }

    /// Lets a latched fault go if its cause is gone.
    #[cold]
    pub fn clear(&mut self, t: &Thresholds, sensed: &Sensed, rate: f32) {
        let supply = sensed.supply.0;
        let there = match self.fault {
            Fault::EmergencyStop => sensed.stop,
            Fault::Overspeed => rate.abs() > t.overspeed,
            Fault::OverCurrent => t.is_over(sensed.current.0),
            Fault::SupplyLow => supply < t.supply_from,
            Fault::SupplyHigh => supply >= t.supply_from && supply.wrapping_sub(t.supply_from) > t.supply_range,
            // With the drive off nothing pushes, turns or slips; what the tasks see, they say anew.
            _ => false,
        };
        if !there {
            // What counts, counts anew. (A whole new guard would be a call that fills it byte by byte.)
            self.fault = Fault::None;
            self.over = 0;
            self.stalled_ms = 0;
            self.back_emf = 0.0;
            self.pace = 0;
            self.turning_ms = 0;
            self.bad_supply_ms = 0;
            self.slipping_ms = 0;
        }
    }
}

impl Thresholds {
    #[inline]
    fn is_over(&self, code: i32) -> bool {
        code.wrapping_sub(self.current_from) as u32 > self.current_range
    }
}

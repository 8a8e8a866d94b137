//! Regulator: PI on the rate, as a gain on the rate error and one on the position error, which is its integral; then current and voltage
//! limit.
//!
//! The integral cannot wind up: the ramp slips where the platform does not follow ([`super::ramp`]).
//!
//! The current is limited by the voltage over the winding's resistance: u − K ω. A compare count is a fraction of the present supply, and
//! the resistance changes with the temperature by 0.4 % per kelvin. [`CurrentLimit`] therefore scales both by the measured supply, and
//! while the limit is in force it adjusts the voltage until the measured current is the limit.

use crate::board::Sensed;
use crate::status::Limits;

/// Change of the voltage per millisecond and relative error of the current: below the limit slowly (20 ms), above it fast (3 ms), since the
/// over-current trip is 20 % above the limit.
const RISE_PER_MS: f32 = 0.05;
const FALL_PER_MS: f32 = 0.3;
/// Return to the nominal resistance per millisecond while the limit is not in force: 100 ms.
const RETURN_PER_MS: f32 = 0.01;
/// Range of resistance / nominal resistance that is followed: copper has 0.88 at −10 °C and 1.39 at 125 °C.
const RESISTANCE_RATIO: (f32, f32) = (0.7, 1.5);

/// Gains and limits in compare counts of the bridge, at nominal supply and resistance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Config {
    /// Per count per tick of rate error.
    pub rate_gain: f32,
    /// Per count of position error.
    pub position_gain: f32,
    /// Back-EMF per count per tick.
    pub back_emf: f32,
    /// Voltage of the current limit over the winding's resistance.
    pub current_limit: f32,
    /// Voltage limit.
    pub voltage_limit: f32,
    /// Code of the current sensor at zero, and the share of the limit in a code.
    pub zero_current_code: i32,
    pub share_per_current_code: f32,
    /// Share of the nominal supply in a code, and its least and greatest value: beyond it the supply is a fault.
    pub share_per_supply_code: f32,
    pub supply_share: (f32, f32),
}

/// The current limit at the present supply and resistance.
#[derive(Clone, Copy, Debug)]
pub(super) struct CurrentLimit {
    /// Measured / nominal supply.
    supply_share: f32,
    /// Resistance / nominal resistance, as the current shows it in `direction`.
    resistance_ratio: f32,
    /// Sign of the limited current. An error of the back-EMF has the opposite effect in the other direction.
    direction: f32,
    /// Back-EMF per count per tick, and voltage over the resistance at the limit, compare counts of the present supply.
    back_emf: f32,
    resistive_drop: f32,
}

impl CurrentLimit {
    /// At nominal supply and resistance.
    pub fn new(config: &Config) -> Self {
        Self { supply_share: 1.0, resistance_ratio: 1.0, direction: 0.0, back_emf: config.back_emf, resistive_drop: config.current_limit }
    }

    /// Once in a millisecond: `is_in_force`: the limit was in its first half; `moves`: an edge of the encoder came within it. Without edges
    /// the back-EMF is unknown, and a current below the limit is not evidence of a greater resistance.
    #[inline]
    pub fn update(&mut self, config: &Config, sensed: &Sensed, is_in_force: bool, moves: bool) {
        // Not `clamp`, which panics on a wrong range.
        let (least, greatest) = config.supply_share;
        self.supply_share = (sensed.supply.0 as f32 * config.share_per_supply_code).max(least).min(greatest);
        let current = sensed.current.0.wrapping_sub(config.zero_current_code) as f32 * config.share_per_current_code;
        let change = if is_in_force {
            let direction = 1.0_f32.copysign(current);
            if direction != self.direction {
                self.direction = direction;
                self.resistance_ratio = 1.0;
            }
            match 1.0 - current.abs() {
                error if error < 0.0 => FALL_PER_MS * error,
                error if moves => RISE_PER_MS * error,
                _ => 0.0,
            }
        } else {
            (1.0 - self.resistance_ratio) * RETURN_PER_MS
        };
        let (least, greatest) = RESISTANCE_RATIO;
        self.resistance_ratio = (self.resistance_ratio + change).max(least).min(greatest);
        let supply_ratio = 1.0 / self.supply_share;
        self.back_emf = config.back_emf * supply_ratio;
        self.resistive_drop = config.current_limit * supply_ratio * self.resistance_ratio;
    }

    /// The voltage of a duty at the present supply, as compare counts of the nominal supply.
    #[inline]
    pub fn nominal_duty(&self, duty: i16) -> f32 {
        f32::from(duty) * self.supply_share
    }
}

impl Config {
    /// Compare counts for a position error (counts) and a rate error (counts per tick).
    #[inline]
    pub fn regulate(&self, position_error: f32, rate_error: f32) -> f32 {
        self.position_gain * position_error + self.rate_gain * rate_error
    }

    /// `duty` within the limits of current and voltage at this rate (counts per tick). Limits in force are set in `limits`.
    #[inline]
    pub fn limit(&self, current: &CurrentLimit, duty: f32, rate: f32, limits: &mut Limits) -> f32 {
        let back_emf = current.back_emf * rate;
        let resistive_drop = duty - back_emf;
        let mut limited = duty;
        if resistive_drop.abs() > current.resistive_drop {
            limited = back_emf + current.resistive_drop.copysign(resistive_drop);
            limits.set(Limits::CURRENT, true);
        }
        if limited.abs() > self.voltage_limit {
            limited = self.voltage_limit.copysign(limited);
            limits.set(Limits::VOLTAGE, true);
        }
        limited
    }
}

//! Settings of the speed loop: gains, limits and the drive's nominal constants, checked by name.
//!
//! [`Settings`] are in SI units; [`Config`] holds the same in the tick's units (counts, ticks, compare counts), in single precision. A
//! number can be refused only where the one is made from the other.

use super::feed_forward::CompensationGains;
use super::segment::{ONE, rate_unit};
use super::units::TickUnits;
use super::{estimator, feed_forward, ramp, regulator};
use crate::board::{CONTROL_HZ, Hardware, ROW_HZ};
use crate::compensation::Compensation;
use crate::config::{ConfigError, all_within, within};
use crate::gyro_loop;
use crate::supervision::{self, DriveConstants, Thresholds};

/// Least ratio of the current at which the drive is switched off and the current limit, which is held within 1 %: the peak of a step stays
/// below.
const TRIP_RATIO: f64 = 1.2;
/// Least share of the nominal supply that the current limit follows, where the supervision allows any.
const MIN_SUPPLY_SHARE: f64 = 0.1;

/// Gains and limits. The default is the default stand's: maxon RE 25 118752, platform of 2.5·10⁻⁴ kg m².
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Terminal resistance, Ω: for the current limit and the acceleration feed-forward.
    pub resistance_ohm: f64,
    /// Torque and back-EMF constant, N m/A = V s/rad.
    pub motor_constant_N_m_A: f64,
    /// Inertia of rotor and platform, kg m².
    pub inertia_kg_m2: f64,
    /// Gain on the rate error, V s/rad.
    pub rate_gain_V_s_rad: f64,
    /// Gain on the position error (the integral of the rate error), V/rad.
    pub position_gain_V_rad: f64,
    /// Bandwidth of the rate estimate, Hz.
    pub rate_bandwidth_Hz: f64,
    /// Acceleration limit of the rate command, rad/s².
    pub acceleration_rad_s2: f64,
    /// Position error at which the ramp slips, rad.
    pub slip_rad: f64,
    /// Current limit, A. A greater one than 1/1.2 of the current at which the drive is switched off acts as that: a limit must not trip.
    pub current_limit_A: f64,
    /// Voltage limit, V.
    pub voltage_limit_V: f64,
    /// Rate at which the drive is switched off, rad/s.
    pub overspeed_rad_s: f64,
    /// Greatest rate of the approach to an angle, rad/s, if the command names none; always below the overspeed.
    pub approach_rad_s: f64,
    /// Friction and harmonics, fed forward in rate and position mode.
    pub compensation: Compensation,
    /// Thresholds of supervision.
    pub safety: supervision::Settings,
    /// The gyroscope on the drive: its gains and its correction loop.
    pub gyro: gyro_loop::Settings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            resistance_ohm: 2.32,          // maxon RE 25, 118752
            motor_constant_N_m_A: 23.4e-3, // the same sheet
            inertia_kg_m2: 2.5e-4,
            // Two poles at 80 rad/s: J s² + (K²/R + K k/R) s + K c/R = J (s + 80)². At 40 a step never stayed within 2 %
            // (docs/rate-accuracy.md).
            rate_gain_V_s_rad: 3.94,
            position_gain_V_rad: 159.0,
            rate_bandwidth_Hz: 120.0,
            acceleration_rad_s2: 60.0, // 0.64 A of the 1.3
            slip_rad: 0.1,
            current_limit_A: 1.3,  // the trip is 23 % above it
            voltage_limit_V: 11.4, // 5 % of reserve for a sagging supply
            overspeed_rad_s: 45.0, // the range is 34.9 (2000 °/s)
            approach_rad_s: 6.0,   // a turn in a second
            compensation: Compensation::default(),
            safety: supervision::Settings::default(),
            gyro: gyro_loop::Settings::default(),
        }
    }
}

/// Settings in the tick's units: rates in counts per tick, voltages in compare counts.
#[derive(Clone, Copy, Debug)]
pub struct Config {
    pub(super) estimator: estimator::Config,
    pub(super) ramp: ramp::Config,
    pub(super) approach: ApproachConfig,
    pub(super) feed_forward: feed_forward::Config,
    pub(super) regulator: regulator::Config,
    pub(super) thresholds: Thresholds,
    /// Edge timer steps in a tick.
    pub(super) period: u32,
}

/// Limits of the approach to an angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct ApproachConfig {
    /// Counts per tick in a millisecond.
    pub acceleration: f32,
    /// Counts per tick.
    pub max_rate: f32,
}

impl Config {
    /// The settings' compensation in the tick's units: to be posted after a calibration.
    pub fn compensation(&self) -> CompensationGains {
        self.feed_forward.compensation
    }

    /// Replaces the compensation.
    pub(super) fn set_compensation(&mut self, gains: CompensationGains) {
        self.feed_forward.compensation = gains;
    }

    /// Checks the settings for this hardware.
    ///
    /// # Errors
    /// The name of the first parameter that is not finite or out of its range.
    pub fn new(s: &Settings, hardware: &Hardware) -> Result<Self, ConfigError> {
        hardware.check()?;
        all_within! { of s, "";
            resistance_ohm: 1e-3, 1e4;
            motor_constant_N_m_A: 1e-6, 1e3;
            inertia_kg_m2: 0.0, 1e3;
            rate_gain_V_s_rad: 0.0, 1e4;
            position_gain_V_rad: 0.0, 1e6;
            rate_bandwidth_Hz: 1.0, 1e3;
            acceleration_rad_s2: 1e-3, 1e5;
            slip_rad: 1e-4, 6.3;
            current_limit_A: 1e-3, 1e3;
            overspeed_rad_s: 1e-3, 1e4;
            approach_rad_s: 1e-4, 1e4;
        }?;
        within("voltage_limit_V", s.voltage_limit_V, 1e-3, hardware.supply_nominal_V)?;
        s.compensation.check(s.motor_constant_N_m_A * s.current_limit_A)?;
        s.safety.check()?;
        s.gyro.check()?;

        let units = TickUnits::new(s.resistance_ohm / s.motor_constant_N_m_A, hardware);
        let TickUnits { rad_s_per_count_tick, duty_per_V, duty_per_N_m } = units;
        let tick_Hz = CONTROL_HZ as f64;
        let ms_Hz = ROW_HZ as f64;
        let rad_per_count = hardware.rad_per_count();
        let current_limit_A = libm::fmin(s.current_limit_A, s.safety.trip_A(hardware) / TRIP_RATIO);
        let back_emf = (s.motor_constant_N_m_A * rad_s_per_count_tick * duty_per_V) as f32;
        let inertia = (s.inertia_kg_m2 * rad_s_per_count_tick * tick_Hz * duty_per_N_m) as f32;
        Ok(Self {
            estimator: estimator::Config::new(s.rate_bandwidth_Hz, tick_Hz),
            ramp: ramp::Config {
                max_rate_step: ((s.acceleration_rad_s2 * rate_unit(hardware) / ms_Hz) as i64).max(1),
                max_slip: (s.slip_rad / rad_per_count * ONE) as i64,
            },
            approach: ApproachConfig {
                acceleration: (s.acceleration_rad_s2 / rad_s_per_count_tick / ms_Hz) as f32,
                max_rate: (libm::fmin(s.approach_rad_s, 0.9 * s.overspeed_rad_s) / rad_s_per_count_tick) as f32,
            },
            feed_forward: feed_forward::Config::new(back_emf, inertia, CompensationGains::new(&s.compensation, &units), hardware),
            regulator: regulator::Config {
                rate_gain: (s.rate_gain_V_s_rad * rad_s_per_count_tick * duty_per_V) as f32,
                position_gain: (s.position_gain_V_rad * rad_per_count * duty_per_V) as f32,
                back_emf,
                current_limit: (s.resistance_ohm * current_limit_A * duty_per_V) as f32,
                voltage_limit: (s.voltage_limit_V * duty_per_V) as f32,
                zero_current_code: hardware.current_zero_code as i32,
                share_per_current_code: (hardware.current_A_per_code / current_limit_A) as f32,
                share_per_supply_code: (hardware.supply_V_per_code / hardware.supply_nominal_V) as f32,
                supply_share: (s.safety.supply_low_share.max(MIN_SUPPLY_SHARE) as f32, s.safety.supply_high_share as f32),
            },
            thresholds: Thresholds::new(
                &s.safety,
                hardware,
                &DriveConstants {
                    overspeed_rad_s: s.overspeed_rad_s,
                    resistance_ohm: s.resistance_ohm,
                    motor_constant_N_m_A: s.motor_constant_N_m_A,
                    rad_s_per_count_tick,
                },
            ),
            period: libm::round(hardware.edge_timer_Hz / tick_Hz) as u32,
        })
    }
}

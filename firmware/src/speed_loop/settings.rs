//! What the speed loop is told once: gains, limits and the drive's nominal constants, checked by name.
//!
//! [`Settings`] are in a person's units; [`Config`] is the same in the tick's units (counts, ticks, compare counts), in
//! single precision. Making one from the other is the only place where a number can be refused.

use super::BEAT;
use super::feed_forward::{self, Learnt};
use super::guard::{Given, Thresholds};
use super::segment::rate_unit;
use crate::board::{CONTROL_HZ, Hardware, ROW_HZ};
use crate::compensation::Compensation;
use crate::config::{ConfigError, all_within, within};
use crate::gyro_loop;
use crate::maths::{to_i32, to_i64, to_u32};
use crate::supervision;

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
    /// Gain on the position error, which is the integral of the rate error, V/rad.
    pub position_gain_V_rad: f64,
    /// Bandwidth of the rate that is regulated, Hz.
    pub rate_bandwidth_Hz: f64,
    /// Acceleration limit of the rate command, rad/s².
    pub acceleration_rad_s2: f64,
    /// Position error at which the ramp slips, rad.
    pub slip_rad: f64,
    /// Current limit, A.
    pub current_limit_A: f64,
    /// Voltage limit, V.
    pub voltage_limit_V: f64,
    /// Rate at which the drive is switched off, rad/s.
    pub overspeed_rad_s: f64,
    /// Greatest rate on the way to an angle, rad/s, where the order names none; below the overspeed in any case.
    pub approach_rad_s: f64,
    /// What was learnt of the drive, fed forward in rate and position mode.
    pub compensation: Compensation,
    /// What else switches the drive off, and when.
    pub safety: supervision::Settings,
    /// The gyro beside the drive: its gains, its correction loop.
    pub gyro: gyro_loop::Settings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            resistance_ohm: 2.32,          // maxon RE 25, 118752
            motor_constant_N_m_A: 23.4e-3, // the same sheet
            inertia_kg_m2: 2.5e-4,
            // Two poles at 80 rad/s: J s² + (K²/R + K k/R) s + K c/R = J (s + 80)². At 40 a step never stayed within 2 % (docs/rate-accuracy.md).
            rate_gain_V_s_rad: 3.94,
            position_gain_V_rad: 159.0,
            rate_bandwidth_Hz: 120.0,
            acceleration_rad_s2: 60.0, // 0.64 A of the 1.5
            slip_rad: 0.1,
            current_limit_A: 1.5,
            voltage_limit_V: 11.4, // 5 % of reserve: the loop keeps authority when the supply sags
            overspeed_rad_s: 45.0, // the range is 34.9 (2000 °/s)
            approach_rad_s: 6.0,   // a turn in a second
            compensation: Compensation::default(),
            safety: supervision::Settings::default(),
            gyro: gyro_loop::Settings::default(),
        }
    }
}

/// The same in the tick's units: rates in counts per tick, voltages in compare counts.
#[derive(Clone, Copy, Debug)]
pub struct Config {
    /// Duty per rate of back-EMF.
    pub(crate) back_emf: f32,
    /// Duty per change of the rate command in a millisecond (counts per tick).
    pub(crate) inertia: f32,
    pub(crate) rate_gain: f32,
    /// The same for the rate command: less by what the position command is ahead of what is measured, a tick.
    pub(crate) command_gain: f32,
    /// Duty per 2⁻¹⁶ counts, and per count.
    pub(crate) fine_gain: f32,
    pub(crate) position_gain: f32,
    /// Gains of the tracking filter for position, rate, and what the rate gains.
    pub(crate) tracking: [f32; 3],
    /// 2⁻³² counts per tick in a millisecond, and the same in counts.
    pub(crate) acceleration: i64,
    pub(crate) braking: f32,
    /// Greatest rate on the way to an angle, counts per tick.
    pub(crate) approach: f32,
    /// Whole counts.
    pub(crate) slip: i32,
    /// Edge timer steps in a tick.
    pub(crate) period: u32,
    /// R·I_max as duty.
    pub(crate) current_window: f32,
    pub(crate) duty_limit: f32,
    pub(crate) thresholds: Thresholds,
    pub(crate) learnt: Learnt,
    /// One encoder count, 2⁻³² turn.
    pub(crate) angle_per_count: u32,
    /// Order and rate, counts per tick, whose product is no wave within a millisecond any more.
    pub(crate) fastest_wave: f32,
    /// Counts without an index after which it is lost.
    pub(crate) index_lost: i32,
}

impl Config {
    /// What the settings' compensation is in the tick's units: to be posted where something was learnt.
    pub fn learnt(&self) -> Learnt {
        self.learnt
    }

    /// Checks the settings for this hardware.
    ///
    /// # Errors
    /// The name of the first parameter that is not a number or makes no sense.
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
        let resistance = s.resistance_ohm;
        let constant = s.motor_constant_N_m_A;
        let inertia = s.inertia_kg_m2;
        let rate_gain = s.rate_gain_V_s_rad;
        let position_gain = s.position_gain_V_rad;
        let bandwidth = s.rate_bandwidth_Hz;
        let acceleration = s.acceleration_rad_s2;
        let slip = s.slip_rad;
        let current = s.current_limit_A;
        let volts = s.voltage_limit_V;
        let overspeed = s.overspeed_rad_s;
        let approach = crate::maths::lesser(s.approach_rad_s, 0.9 * overspeed);
        s.compensation.check(constant * current)?;
        s.safety.check()?;
        s.gyro.check()?;

        let hz = CONTROL_HZ as f64;
        let rad_s_per_count_tick = hardware.rad_per_count() * hz;
        let duty_per_volt = 1.0 / hardware.volt_per_duty();
        let step = f64::from(BEAT);
        // Triple pole at w: the rate's transfer (3 w² s + w³)/(s + w)³ is 3 dB down at 1.65 w.
        let pole = crate::maths::exp(-core::f64::consts::TAU * bandwidth / 1.65 / hz * step);
        let gap = 1.0 - pole;
        let (angle_per_count, index_lost) = feed_forward::units(hardware);
        Ok(Self {
            back_emf: (constant * rad_s_per_count_tick * duty_per_volt) as f32,
            inertia: (resistance / constant * inertia * rad_s_per_count_tick * ROW_HZ as f64 * duty_per_volt) as f32,
            rate_gain: (rate_gain * rad_s_per_count_tick * duty_per_volt) as f32,
            command_gain: ((rate_gain * rad_s_per_count_tick - position_gain * hardware.rad_per_count()) * duty_per_volt) as f32,
            fine_gain: (position_gain * hardware.rad_per_count() * duty_per_volt / 65_536.0) as f32,
            position_gain: (position_gain * hardware.rad_per_count() * duty_per_volt) as f32,
            // The gains of a step are for rates in counts per step; the rate is in counts per tick.
            tracking: [1.0 - pole * pole * pole, 1.5 * gap * gap * (1.0 + pole) / step, gap * gap * gap / step].map(|gain| gain as f32),
            acceleration: to_i64(acceleration * rate_unit(hardware) / ROW_HZ as f64).max(1),
            braking: (acceleration / rad_s_per_count_tick / ROW_HZ as f64) as f32,
            approach: (approach / rad_s_per_count_tick) as f32,
            // More than 2¹⁵ counts have no room in the tick; some are gone within a millisecond.
            slip: to_i32(slip / hardware.rad_per_count()).clamp(1, 30_000),
            period: to_u32(crate::maths::round(hardware.edge_timer_Hz / hz)),
            current_window: (resistance * current * duty_per_volt) as f32,
            duty_limit: (volts * duty_per_volt) as f32,
            thresholds: Thresholds::new(
                &s.safety,
                hardware,
                &Given { overspeed_rad_s: overspeed, resistance_ohm: resistance, motor_constant_N_m_A: constant, rad_s_per_count_tick },
            ),
            learnt: Learnt::new(&s.compensation, hardware, resistance, constant),
            angle_per_count,
            fastest_wave: feed_forward::fastest_wave(angle_per_count),
            index_lost,
        })
    }
}

//! What a stand needs of its hardware, as few verbs as can be.
//!
//! The interrupt and the tasks own different halves: [`TickIo`] belongs to the 10 kHz interrupt, [`Board`] to the
//! tasks, and neither can reach the other's. Time is the board's own [`Clock`], not a global driver.
//!
//! Glossary: a *tick* is one period of the control interrupt (100 µs), numbered from power-on; [`Ticks`] is the board
//! clock, finer (0.1 µs). A *code* is what a converter delivers, before any scale; scales are in [`Hardware`], so that
//! another stand is other data, not other code. A *stamped* reading carries the time at which it was true.

use crate::config::{ConfigError, all_within};
use core::ops::{Add, Sub};
use embedded_hal_async::spi::SpiDevice;

/// Board clock, steps per second.
pub const TICKS_PER_S: u64 = 10_000_000;
/// Rate of the control interrupt, Hz.
pub const CONTROL_HZ: u64 = 10_000;
/// Rate of the measurement loop's rows, Hz.
pub const ROW_HZ: u64 = 1_000;
/// Board clock steps in one control tick.
pub const TICKS_PER_CONTROL: u64 = 1_000;
/// Board clock steps in one row.
pub const TICKS_PER_ROW: u64 = 10_000;
/// Control ticks in one row.
pub const CONTROL_PER_ROW: u64 = 10;

/// A moment of the board clock, in 0.1 µs since power-on; lasts 58 000 years.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticks(pub u64);

impl Ticks {
    /// The moment at which control tick `n` begins.
    pub fn of_control(n: u64) -> Self {
        Self(n.saturating_mul(TICKS_PER_CONTROL))
    }

    /// Seconds since power-on.
    pub fn seconds(self) -> f64 {
        self.0 as f64 / TICKS_PER_S as f64
    }
}

impl Add<u64> for Ticks {
    type Output = Self;
    #[inline(never)] // small; the tick does not use it
    fn add(self, steps: u64) -> Self {
        Self(self.0.saturating_add(steps))
    }
}

impl Sub for Ticks {
    type Output = u64;
    /// Steps from `earlier` to `self`; 0 if `earlier` is later.
    #[inline(never)]
    fn sub(self, earlier: Self) -> u64 {
        self.0.saturating_sub(earlier.0)
    }
}

/// The encoder's counter: 16 bits, wrapping. Every edge of both channels counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EncoderCount(pub u16);

impl EncoderCount {
    /// Counts from `earlier` to `self`, right as long as less than half a wrap lies between (0.8 turns per reading).
    pub fn since(self, earlier: Self) -> i16 {
        self.0.wrapping_sub(earlier.0) as i16
    }
}

/// A wrapping counter unrolled: where the stand is since the counter's zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwrapped {
    last: Option<EncoderCount>,
    /// Counts from the counter's zero.
    pub counts: i64,
}

impl Unwrapped {
    /// Takes the next reading; the first is taken as lying within half a wrap of zero. Returns the step in counts.
    #[inline]
    pub fn take(&mut self, count: EncoderCount) -> i16 {
        let step = count.since(self.last.unwrap_or_default());
        self.last = Some(count);
        self.counts = self.counts.wrapping_add(step as i64);
        step
    }
}

/// One conversion of the motor current's ADC channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CurrentCode(pub i32);

/// The current's ADC since the last look: what DMA has summed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CurrentSum {
    /// Sum of the [`CurrentCode`]s.
    pub codes: i64,
    /// How many there were.
    pub count: u32,
}

impl CurrentSum {
    /// Their mean in amperes; `None` if there was none.
    pub fn mean_A(self, hardware: &Hardware) -> Option<f64> {
        (self.count > 0).then(|| (self.codes as f64 / self.count as f64 - hardware.current_zero_code) * hardware.current_A_per_code)
    }
}

/// One conversion of the bridge supply's ADC channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SupplyCode(pub u32);

impl SupplyCode {
    /// Volts.
    pub fn volts(self, hardware: &Hardware) -> f64 {
        self.0 as f64 * hardware.supply_V_per_code
    }
}

/// One sample of the rate sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RateCode(pub i32);

impl RateCode {
    /// Radians per second.
    pub fn rad_s(self, hardware: &Hardware) -> f64 {
        self.0 as f64 * hardware.rate_rad_s_per_code
    }
}

/// What the gyro's angle sensor and its torquer showed at one whole millisecond, as their converters have it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GyroSample {
    /// The angle sensor at that moment, code.
    pub angle: i32,
    /// The torquer's current over the millisecond before, sum of codes.
    pub torquer: i32,
    /// How many codes are in that sum.
    pub conversions: u32,
}

impl GyroSample {
    /// Volts of the angle sensor.
    pub fn angle_V(&self, hardware: &Hardware) -> f64 {
        (f64::from(self.angle) - hardware.angle_zero_code) * hardware.angle_V_per_code
    }

    /// Mean current of the torquer over the millisecond before, A; `None` where nothing was converted.
    pub fn torquer_A(&self, hardware: &Hardware) -> Option<f64> {
        let mean = || f64::from(self.torquer) / f64::from(self.conversions) - hardware.torquer_zero_code;
        (self.conversions > 0).then(|| mean() * hardware.torquer_A_per_code)
    }
}

/// One conversion of the gyro's roll sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RollCode(pub i32);

impl RollCode {
    /// Radians.
    pub fn rad(self, hardware: &Hardware) -> f64 {
        f64::from(self.0) * hardware.roll_rad_per_code
    }
}

/// What the torquer's converter is given: steps from the middle of its range, where the amplifier gives no current.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TorquerStep(pub i16);

/// The winding's temperature in steps of the converter, linearised by the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TemperatureCode(pub i32);

impl TemperatureCode {
    /// Degrees Celsius.
    pub fn celsius(self, hardware: &Hardware) -> f64 {
        self.0 as f64 * hardware.temperature_C_per_code
    }
}

/// A reading and the moment at which it was true.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamped<T> {
    /// What was read.
    pub value: T,
    /// When it was so.
    pub at: Ticks,
}

impl<T> Stamped<T> {
    /// How old the reading is at `now`, in board clock steps.
    pub fn age(&self, now: Ticks) -> u64 {
        now - self.at
    }
}

/// A moment of the edge timer: its steps ([`Hardware::edge_timer_Hz`]) since power-on. The board counts the timer's wraps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeTime(pub u64);

impl EdgeTime {
    /// The moment at which a timer of 32 bits stood at `captured`, at most one wrap before `self`.
    pub fn when(self, captured: u32) -> Self {
        Self(self.0.wrapping_sub(u64::from((self.0 as u32).wrapping_sub(captured))))
    }

    /// Seconds since `earlier`, negative if `self` is the earlier one.
    pub fn since_s(self, earlier: Self, hardware: &Hardware) -> f64 {
        self.0.wrapping_sub(earlier.0) as i64 as f64 / hardware.edge_timer_Hz
    }
}

/// An edge of the encoder or of its index, as the hardware caught it: no code was in between.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Edge {
    /// What the counter was right after it.
    pub count: EncoderCount,
    /// When it came.
    pub at: EdgeTime,
}

/// What the interrupt senses at the beginning of its tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sensed {
    /// Number of this tick since power-on; a number left out is a tick that was lost.
    pub tick: u64,
    /// The speed loop's encoder counter.
    pub encoder: EncoderCount,
    /// Steps of the edge timer ([`Hardware::edge_timer_Hz`]) from the last edge of the encoder, on either channel, to the beginning of this
    /// tick, which comes each 100 µs of that timer exactly, however late the look. It belongs to `encoder`: where an edge came between
    /// the tick's beginning and the look, the age is negative (two's complement). Saturates; where no edge was ever seen it is the greatest number.
    pub edge_age: u32,
    /// The newest conversion of the motor current.
    pub current: CurrentCode,
    /// The newest conversion of the supply.
    pub supply: SupplyCode,
    /// Somebody asks for an emergency stop now: a pin, or the serial line's guard.
    pub stop: bool,
}

/// What the interrupt asks of the bridge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Drive {
    /// Both low sides on: no voltage is asked for.
    #[default]
    Off,
    /// Compare counts of the bridge, ± [`Hardware::duty_full_scale`].
    Duty(i16),
}

impl Drive {
    /// Compare counts; 0 when off.
    #[inline]
    pub fn counts(self) -> i16 {
        match self {
            Drive::Off => 0,
            Drive::Duty(counts) => counts,
        }
    }
}

/// The half of the hardware that the 10 kHz interrupt owns.
pub trait TickIo {
    /// What is so at the beginning of this tick.
    fn sense(&mut self) -> Sensed;
    /// What the encoder's counter was when the index pulse last began, if it has begun since the last call.
    fn index(&mut self) -> Option<EncoderCount>;
    /// What the bridge shall do from the *next* tick on, for one whole tick.
    fn drive(&mut self, out: Drive);
}

/// The board's time.
#[allow(async_fn_in_trait)] // one thread, one executor: no future leaves it
pub trait Clock {
    /// Now.
    fn now(&self) -> Ticks;
    /// Returns at `t`, or at once if `t` is past.
    async fn until(&self, t: Ticks);
}

/// The half of the hardware that the tasks own. No reading waits.
pub trait Board {
    /// A handle to the board's time, cheap to copy.
    type Clock: Clock + Clone;
    /// The line to the sensor under test. Transfers go by DMA: who waits for one leaves the core to the others.
    type SensorBus: SpiDevice<u8>;
    /// The board's time.
    fn clock(&self) -> Self::Clock;
    /// The encoder by a counter of its own, not the speed loop's.
    fn encoder(&mut self) -> Stamped<EncoderCount>;
    /// The newest edge of that counter with its time, captured for the tasks alone; `None` before the first, and where nothing captures it.
    fn edge(&mut self) -> Option<Edge>;
    /// What that counter was when the index pulse last began, and when that was; if it has begun since the last call.
    fn index(&mut self) -> Option<Edge>;
    /// What the current's ADC has summed since the last call; stamped with the end of the sum.
    fn current(&mut self) -> Stamped<CurrentSum>;
    /// The rate sensor's newest sample; `None` where there is no sensor.
    fn rate(&mut self) -> Option<Stamped<RateCode>>;
    /// The newest supply reading.
    fn supply(&mut self) -> Option<Stamped<SupplyCode>>;
    /// The newest temperature reading.
    fn temperature(&mut self) -> Option<Stamped<TemperatureCode>>;
    /// What the gyro's angle sensor showed at the moment that was asked for last, see [`Board::torque`]; `None` before the first, and where
    /// the board has no gyro.
    fn gyro(&mut self) -> Option<Stamped<GyroSample>> {
        None
    }
    /// The roll γ about the rotor's axis by a sensor of its own; `None` where there is none.
    fn roll(&mut self) -> Option<Stamped<RollCode>> {
        None
    }
    /// At `at`, a whole millisecond ahead, the angle sensor is sampled, and from then on the torquer is given this current: both by the
    /// hardware that paces the control ticks, whatever the tasks do. What is late acts at once, and its sample's stamp shows it.
    fn torque(&mut self, _at: Ticks, _step: TorquerStep) {}
    /// Hands out the line to the sensor under test, once; `None` after that, and where the board has none.
    fn sensor_bus(&mut self) -> Option<Self::SensorBus>;
}

/// The scales of one stand's hardware: data, so that another stand is other numbers.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Hardware {
    /// Encoder counts in one turn, every edge counted.
    pub counts_per_turn: f64,
    /// Rate of the timer that stamps the encoder's edges, Hz.
    pub edge_timer_Hz: f64,
    /// Compare counts at which the bridge is fully on.
    pub duty_full_scale: i16,
    /// Supply for which duties are computed, V.
    pub supply_nominal_V: f64,
    /// Current per code, A.
    pub current_A_per_code: f64,
    /// Code at no current.
    pub current_zero_code: f64,
    /// Supply per code, V.
    pub supply_V_per_code: f64,
    /// Rate per code, rad/s.
    pub rate_rad_s_per_code: f64,
    /// Cutoff of the rate sensor's own low pass, Hz; 0 where it has none. For who reads the log: nothing is corrected by it.
    pub rate_cutoff_Hz: f64,
    /// Winding temperature per code, °C.
    pub temperature_C_per_code: f64,
    /// Voltage of the gyro's angle sensor per code, V.
    pub angle_V_per_code: f64,
    /// Code at no angle.
    pub angle_zero_code: f64,
    /// Roll per code of its sensor, rad.
    pub roll_rad_per_code: f64,
    /// The torquer's current, as it is measured, per code, A.
    pub torquer_A_per_code: f64,
    /// Code at no current of the torquer.
    pub torquer_zero_code: f64,
    /// The torquer's current, as it is given, per step of its converter, A.
    pub torquer_A_per_step: f64,
}

impl Default for Hardware {
    /// NUCLEO-F446RE with the default stand's sensors; the sources stand at each number.
    fn default() -> Self {
        Self {
            counts_per_turn: 20_000.0, // 5000 lines × 4 edges (US Digital E6, 5000 CPR)
            edge_timer_Hz: 90e6,       // TIM2 on APB1, twice its 45 MHz
            duty_full_scale: 4_500,    // 180 MHz / 20 kHz / 2, centre-aligned
            supply_nominal_V: 12.0,
            current_A_per_code: 3.3 / 4096.0, // 12 bits of 3.3 V at 20 mΩ × 50 V/V = 1 V/A (INA240A2, SBOS662)
            current_zero_code: 2048.0,        // its references at mid-supply
            supply_V_per_code: 3.3 / 4096.0 * 6.0, // divider 10 kΩ : 2 kΩ
            rate_rad_s_per_code: core::f64::consts::PI / 180.0 / 16.4, // Bosch BMG160, ±2000 °/s (BST-BMG160-DS000)
            rate_cutoff_Hz: 523.0,            // the same, unfiltered
            temperature_C_per_code: 0.01,     // NTC linearised by table
            angle_V_per_code: 3.3 / 4096.0,   // 12 bits of 3.3 V; the demodulator's output lies at mid-supply at no angle
            angle_zero_code: 2048.0,
            roll_rad_per_code: 5e-6, // 1 arcsecond, as an electrolytic or capacitive tilt sensor with its own converter resolves
            torquer_A_per_code: 0.2 / 4096.0, // 1 Ω × 16.5 V/V about mid-supply: ± 0.1 A
            torquer_zero_code: 2048.0,
            torquer_A_per_step: 0.2 / 4096.0, // an amplifier of ± 0.1 A over the converter's range
        }
    }
}

impl Hardware {
    /// Checks the scales.
    ///
    /// # Errors
    /// The name of the first that makes no sense.
    pub fn check(&self) -> Result<(), ConfigError> {
        all_within! { of self, "";
            counts_per_turn: 4.0, 1e6;
            edge_timer_Hz: 1e5, 1e9;
            duty_full_scale: 16.0, 32_000.0;
            supply_nominal_V: 0.1, 1e3;
            current_A_per_code: 1e-15, 1e3;
            current_zero_code: 1.0, 1e15;
            supply_V_per_code: 1e-9, 1e3;
            rate_rad_s_per_code: 1e-12, 1e3;
            rate_cutoff_Hz: 0.0, 1e6;
            temperature_C_per_code: 1e-9, 1e3;
            angle_V_per_code: 1e-15, 1e3;
            angle_zero_code: -1e9, 1e9;
            roll_rad_per_code: 1e-12, 1.0;
            torquer_A_per_code: 1e-15, 1e3;
            torquer_zero_code: -1e9, 1e9;
            torquer_A_per_step: 1e-9, 1e3;
        }
    }

    /// One encoder count, rad.
    pub fn rad_per_count(&self) -> f64 {
        core::f64::consts::TAU / self.counts_per_turn
    }

    /// One compare count at nominal supply, V.
    pub fn volt_per_duty(&self) -> f64 {
        self.supply_nominal_V / self.duty_full_scale as f64
    }
}

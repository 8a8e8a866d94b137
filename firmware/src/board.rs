//! Traits and types of the stand's hardware.
//!
//! The hardware has two owners: the 10 kHz interrupt owns [`TickIo`], the tasks own [`Board`], and neither has access to the other's
//! part. Time is a [`Clock`] of the board, not a global time driver, so that a test can run several boards.
//!
//! Glossary: a *tick* is one period of the control interrupt (100 µs), numbered from power-on; [`Ticks`] is the board
//! clock with a resolution of 0.1 µs. A *code* is the unscaled output of a converter; the scales are data in [`Hardware`], so that another
//! stand needs no other code. A *stamped* reading carries the time of its sampling.

use crate::config::{ConfigError, all_within};
use core::ops::{Add, Sub};
use embedded_hal_async::spi::{Mode, SpiDevice};

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

/// A time of the board clock, in 0.1 µs since power-on; the range is 58 000 years.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ticks(pub u64);

impl Ticks {
    /// Start time of control tick `n`.
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

/// Numbers the control ticks by a counter of the core's cycles, lost ticks included.
///
/// The counter and the timer of the ticks have one clock. A handler begins some cycles after its tick; the least delay seen so far marks
/// where ticks begin. After a stall of the core one tick is served late and the next one in time: each counts once.
#[derive(Clone, Copy, Debug, Default)]
pub struct TickCounter {
    /// Number of the present tick.
    pub tick: u64,
    /// Cycle counter at its beginning.
    begins: u32,
}

impl TickCounter {
    /// The counter at tick 0, which begins at `cycles`.
    pub fn start(cycles: u32) -> Self {
        Self { tick: 0, begins: cycles }
    }

    /// The next tick, whose handler begins at `cycles`; a tick takes `period` cycles. Correct for stalls shorter than the counter's wrap.
    #[inline]
    pub fn advance(&mut self, cycles: u32, period: u32) {
        let since = cycles.wrapping_sub(self.begins);
        let ticks = since.checked_div(period).unwrap_or(1).max(1);
        self.tick += u64::from(ticks);
        let nominal = ticks.wrapping_mul(period);
        self.begins = if since < nominal { cycles } else { self.begins.wrapping_add(nominal) };
    }
}

/// The encoder's counter: 16 bits, wrapping. Every edge of both channels counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EncoderCount(pub u16);

impl EncoderCount {
    /// Counts from `earlier` to `self`. Correct while the counter moves less than half a wrap between readings (1.6 turns at 20 000 counts
    /// per turn).
    pub fn since(self, earlier: Self) -> i16 {
        self.0.wrapping_sub(earlier.0) as i16
    }
}

/// Unwraps the encoder's counter: position relative to the counter's zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwrapped {
    last: Option<EncoderCount>,
    /// Counts from the counter's zero.
    pub counts: i64,
}

impl Unwrapped {
    /// Adds a reading and returns the step in counts. The first reading is assumed to be within half a wrap of zero.
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

/// Sum of the current conversions since the previous reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CurrentSum {
    /// Sum of the [`CurrentCode`]s.
    pub codes: i64,
    /// Number of conversions in the sum.
    pub count: u32,
}

impl CurrentSum {
    /// Mean current, A; `None` without a conversion.
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

/// Codes of the gyroscope's angle sensor and torquer current at a whole millisecond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GyroSample {
    /// Angle sensor at that time, code.
    pub angle: i32,
    /// Torquer current over the preceding millisecond, sum of codes.
    pub torquer: i32,
    /// Number of codes in that sum.
    pub conversions: u32,
}

impl GyroSample {
    /// Volts of the angle sensor.
    pub fn angle_V(&self, hardware: &Hardware) -> f64 {
        (f64::from(self.angle) - hardware.angle_zero_code) * hardware.angle_V_per_code
    }

    /// Mean torquer current over the preceding millisecond, A; `None` without a conversion.
    pub fn torquer_A(&self, hardware: &Hardware) -> Option<f64> {
        let mean = || f64::from(self.torquer) / f64::from(self.conversions) - hardware.torquer_zero_code;
        (self.conversions > 0).then(|| mean() * hardware.torquer_A_per_code)
    }
}

/// One conversion of the gyroscope's roll sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RollCode(pub i32);

impl RollCode {
    /// Radians.
    pub fn rad(self, hardware: &Hardware) -> f64 {
        f64::from(self.0) * hardware.roll_rad_per_code
    }
}

/// Output of the torquer's converter, in steps from the middle of its range; the amplifier gives no current at 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TorquerStep(pub i16);

/// Winding temperature in steps of the converter, linearised by the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TemperatureCode(pub i32);

impl TemperatureCode {
    /// Degrees Celsius.
    pub fn celsius(self, hardware: &Hardware) -> f64 {
        self.0 as f64 * hardware.temperature_C_per_code
    }
}

/// A reading with the time of its sampling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamped<T> {
    /// The reading.
    pub value: T,
    /// Time of sampling.
    pub at: Ticks,
}

impl<T> Stamped<T> {
    /// Age of the reading at `now`, in board clock steps.
    pub fn age(&self, now: Ticks) -> u64 {
        now - self.at
    }
}

/// A time of the edge timer, in its steps ([`Hardware::edge_timer_Hz`]) since power-on. The board counts the timer's wraps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeTime(pub u64);

impl EdgeTime {
    /// Time at which the 32-bit timer had the value `captured`, at most one wrap before `self`.
    pub fn when(self, captured: u32) -> Self {
        Self(self.0.wrapping_sub(u64::from((self.0 as u32).wrapping_sub(captured))))
    }

    /// Seconds since `earlier`; negative if `self` is earlier.
    pub fn since_s(self, earlier: Self, hardware: &Hardware) -> f64 {
        self.0.wrapping_sub(earlier.0) as i64 as f64 / hardware.edge_timer_Hz
    }
}

/// An edge of the encoder or of its index, captured by hardware: interrupt latency does not affect its time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Edge {
    /// Counter right after the edge.
    pub count: EncoderCount,
    /// Time of the edge.
    pub at: EdgeTime,
}

/// Readings of the interrupt at the start of its tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sensed {
    /// Number of this tick since power-on; a missing number is a lost tick.
    pub tick: u64,
    /// The speed loop's encoder counter.
    pub encoder: EncoderCount,
    /// Steps of the edge timer ([`Hardware::edge_timer_Hz`]) from the last encoder edge on either channel to the start of this tick. The
    /// start is at exact multiples of 100 µs of that timer, independent of the interrupt's latency. The age belongs to `encoder`: it is
    /// negative (two's complement) if the edge came between the start of the tick and the reading. It saturates; `u32::MAX` before the
    /// first edge.
    pub edge_age: u32,
    /// Newest conversion of the motor current.
    pub current: CurrentCode,
    /// Newest conversion of the supply.
    pub supply: SupplyCode,
    /// No conversion of current and supply has ended since the last tick: both readings are old.
    pub is_stale: bool,
    /// An emergency stop is requested, by the stop contact or by the serial line's guard.
    pub stop: bool,
    /// Lost ticks before this one were announced: the flash of the settings is being erased, which stalls the core.
    pub announced_stall: bool,
}

/// Command of the interrupt to the bridge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Drive {
    /// Both low sides conduct: the motor brakes.
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

/// Hardware that the 10 kHz interrupt owns.
pub trait TickIo {
    /// Readings at the start of this tick.
    fn sense(&mut self) -> Sensed;
    /// Encoder counter at the start of the latest index pulse; `None` if no pulse started since the last call.
    fn index(&mut self) -> Option<EncoderCount>;
    /// Sets the bridge's output for the *next* tick; the hardware applies it for exactly one tick.
    fn drive(&mut self, out: Drive);
}

/// The board's time.
#[allow(async_fn_in_trait)] // one single-threaded executor: futures need not be `Send`
pub trait Clock {
    /// Current time.
    fn now(&self) -> Ticks;
    /// Waits until `t`; returns at once if `t` is past.
    async fn until(&self, t: Ticks);
}

/// SPI bus of the sensor under test. The parts need different modes: the ISM330DHCX mode 3, the ADXL355 mode 0.
pub trait SensorSpi: SpiDevice<u8> {
    /// Sets clock polarity and phase for the following transactions.
    ///
    /// # Errors
    /// The bus does not have this mode.
    fn set_mode(&mut self, mode: Mode) -> Result<(), UnsupportedMode>;
}

/// The bus does not have this clock polarity and phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnsupportedMode;

/// Hardware that the tasks own. No reading blocks.
pub trait Board {
    /// Handle to the board's clock.
    type Clock: Clock + Clone;
    /// SPI bus of the sensor under test. Transfers use DMA, so that other tasks run meanwhile.
    type SensorBus: SensorSpi;
    /// The board's clock.
    fn clock(&self) -> Self::Clock;
    /// Encoder counter of the tasks, separate from the speed loop's counter.
    fn encoder(&mut self) -> Stamped<EncoderCount>;
    /// Newest edge of that counter with its captured time; `None` before the first edge and on a board without capture.
    fn edge(&mut self) -> Option<Edge>;
    /// That counter and the time at the start of the latest index pulse; `None` if no pulse started since the last call.
    fn index(&mut self) -> Option<Edge>;
    /// Time of the last edge on the input of the clock reference (1PPS); `None` if there was none since the last call, and on a board
    /// without that input.
    fn reference_pulse(&mut self) -> Option<EdgeTime> {
        None
    }
    /// Sum of the current conversions since the last call, stamped with the end of the sum.
    fn current(&mut self) -> Stamped<CurrentSum>;
    /// Newest sample of the rate sensor; `None` without a sensor.
    fn rate(&mut self) -> Option<Stamped<RateCode>>;
    /// Newest supply reading.
    fn supply(&mut self) -> Option<Stamped<SupplyCode>>;
    /// Newest temperature reading.
    fn temperature(&mut self) -> Option<Stamped<TemperatureCode>>;
    /// Gyroscope sample at the time of the latest [`Board::torque`]; `None` before the first sample and on a board without a gyroscope.
    fn gyro(&mut self) -> Option<Stamped<GyroSample>> {
        None
    }
    /// Roll γ about the rotor's axis; `None` without a roll sensor.
    fn roll(&mut self) -> Option<Stamped<RollCode>> {
        None
    }
    /// Samples the angle sensor at `at` and sets the torquer's output from `at` on. `at` is a whole millisecond in the future. The control
    /// tick does both, so that the delay of the tasks has no effect. A late call acts at once, and the sample's stamp shows the delay.
    fn torque(&mut self, _at: Ticks, _step: TorquerStep) {}
    /// SPI bus of the sensor under test, on the first call; `None` later and on a board without the bus.
    fn sensor_bus(&mut self) -> Option<Self::SensorBus>;
}

/// Scales of a stand's hardware.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Hardware {
    /// Encoder counts per turn; every edge of both channels counts.
    pub counts_per_turn: f64,
    /// Clock of the timer that captures the encoder's edges, Hz.
    pub edge_timer_Hz: f64,
    /// Compare counts of full duty.
    pub duty_full_scale: i16,
    /// Supply voltage assumed in computing duties, V.
    pub supply_nominal_V: f64,
    /// Current per code, A.
    pub current_A_per_code: f64,
    /// Code at zero current.
    pub current_zero_code: f64,
    /// Supply per code, V.
    pub supply_V_per_code: f64,
    /// Rate per code, rad/s.
    pub rate_rad_s_per_code: f64,
    /// Cutoff of the rate sensor's low-pass filter, Hz; 0 without a filter. Information for the log only; the firmware does not use it.
    pub rate_cutoff_Hz: f64,
    /// Winding temperature per code, °C.
    pub temperature_C_per_code: f64,
    /// Voltage of the gyroscope's angle sensor per code, V.
    pub angle_V_per_code: f64,
    /// Code at zero angle.
    pub angle_zero_code: f64,
    /// Roll angle per code, rad.
    pub roll_rad_per_code: f64,
    /// Measured torquer current per code, A.
    pub torquer_A_per_code: f64,
    /// Code at zero torquer current.
    pub torquer_zero_code: f64,
    /// Commanded torquer current per step of the converter, A.
    pub torquer_A_per_step: f64,
}

impl Default for Hardware {
    /// NUCLEO-F446RE with the default sensors; the comments give the sources.
    fn default() -> Self {
        Self {
            counts_per_turn: 20_000.0, // 5000 lines × 4 edges (US Digital E6, 5000 CPR)
            edge_timer_Hz: 90e6,       // TIM2 on APB1, twice its 45 MHz
            duty_full_scale: 4_500,    // 180 MHz / 20 kHz / 2, centre-aligned
            supply_nominal_V: 12.0,
            current_A_per_code: 3.3 / 4096.0, // 12 bits of 3.3 V at 20 mΩ × 50 V/V = 1 V/A (INA240A2, SBOS662)
            current_zero_code: 2048.0,        // REF1 and REF2 give mid-supply
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
    /// Name of the first scale outside its permitted range.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of handlers in cycles: `late` cycles after the ticks, with a stall between two of them.
    fn counted(stall_begins: u32, stall_ends: u32, late: impl Fn(u32) -> u32) -> (u64, u64) {
        const PERIOD: u32 = 18_000;
        let origin = u32::MAX - 40_000;
        let mut counter = TickCounter::start(origin.wrapping_add(late(0)));
        let mut served_until = 0;
        for tick in 1..5_000_u32 {
            let at = tick * PERIOD + late(tick);
            if at < served_until {
                continue;
            }
            // All ticks within the stall are one pending interrupt, served at its end.
            let at = if (stall_begins..stall_ends).contains(&at) { stall_ends } else { at };
            served_until = at;
            counter.advance(origin.wrapping_add(at), PERIOD);
            if at == stall_ends {
                served_until = (at / PERIOD + 1) * PERIOD;
            }
        }
        (counter.tick, 4_999)
    }

    #[test]
    fn each_tick_counts_once_after_a_stall_of_any_length() {
        for part in 0..36 {
            let (begins, ends) = (100 * 18_000 + 9_000, 2_600 * 18_000 + 500 * part);
            let (tick, expected) = counted(begins, ends, |tick| tick * 37 % 400);
            assert_eq!(tick, expected, "stall until {} of a tick", f64::from(500 * part) / 18e3);
        }
    }

    #[test]
    fn late_handlers_count_once() {
        assert_eq!(counted(0, 0, |tick| if tick.is_multiple_of(7) { 2_000 } else { 12 }), (4_999, 4_999));
        assert_eq!(counted(0, 0, |tick| if tick == 0 { 2_000 } else { 12 }), (4_999, 4_999));
    }
}

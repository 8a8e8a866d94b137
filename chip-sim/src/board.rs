//! The stand's board around the chip: pins, bridge, encoder, analog inputs, switches, sensor under test, on a plant of `hal-sim`.
//!
//! The plant is advanced where something reads it, in steps of at least 2 µs, and at each change of the bridge. Between two steps the angle
//! is interpolated linearly for the times of the encoder's edges: within 50 µs at 1000 rad/s² the error is 0.001 count.
//!
//! [`Time`] counts the periods of the crystal, whose frequency error the plant and the clock reference do not share.

use crate::peripherals::gpio::{Pin, pin};
use crate::time::{NEVER, PER_US, Time, of_seconds, seconds};
use embedded_hal::spi::Mode;
use hal_sim::board::PlantPort;
use hal_sim::peripherals::imu::Imu;
use hal_sim::peripherals::{Crystal, Encoder, Noise, ReferencePulses, SensorSetup};
use hal_sim::setup::StandSetup;
use stand_firmware::board::Hardware;

/// Emergency stop: closed to ground unless pressed.
pub const STOP_CONTACT: Pin = pin(b'C', 8);
/// Button B1, low while pressed, and the LED.
pub const BUTTON: Pin = pin(b'C', 13);
/// User LED.
pub const LED: Pin = pin(b'A', 5);
/// Inputs of the bridge (TIM1_CH1, CH2; alternate function 1).
pub const BRIDGE: [Pin; 2] = [pin(b'A', 8), pin(b'A', 9)];
/// Chip select, clock, data of the sensor under test (alternate function 5).
pub const SENSOR_SELECT: Pin = pin(b'B', 12);
/// SCK, MISO, MOSI.
pub const SENSOR_BUS: [Pin; 3] = [pin(b'B', 13), pin(b'B', 14), pin(b'B', 15)];
/// Clock reference with one pulse per second (TIM2_CH3; alternate function 1).
pub const CLOCK_REFERENCE: Pin = pin(b'B', 10);
/// Serial line: transmit, receive (alternate function 7).
pub const SERIAL: [Pin; 2] = [pin(b'A', 2), pin(b'A', 3)];

/// Smallest step of the plant for a reading.
const MIN_STEP: Time = 2 * PER_US;
/// Step of the sensor under test.
pub const SENSOR_STEP: Time = 100 * PER_US;
/// NTC thermistor at the converter (Vishay NTCLE100E3103, B25/85) with a resistor of its nominal value.
const NTC_B_K: f64 = 3977.0;
const NTC_T0_K: f64 = 298.15;
const ADC_FULL_SCALE: f64 = 4096.0;

/// Passage of the encoder since the last call of [`Board::take_passage`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Passage {
    /// Time of the last edge.
    pub edge: Option<Time>,
    /// Time of the index's last rising edge, and the disc's count there.
    pub index: Option<(Time, i64)>,
}

/// Faults of the board that tests inject.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoardFaults {
    /// Channel A and B of the encoder are disconnected.
    pub encoder_off: bool,
    /// The index is disconnected.
    pub index_off: bool,
    /// The sensor under test does not answer.
    pub sensor_silent: bool,
}

/// The board.
pub struct Board {
    plant: Box<dyn PlantPort>,
    motor_constant: f64,
    hardware: Hardware,
    encoder: Encoder,
    now: Time,
    exact: f64,
    passage: Passage,
    /// Command in V at nominal supply; `None`: both inputs of the bridge are low, the motor coasts.
    command_V: Option<f64>,
    noise: [Noise; 3],
    imu: Option<Imu>,
    sensor_at: Time,
    sensor_selected: bool,
    /// Disc count at which disconnected encoder inputs stand.
    frozen: Option<i64>,
    faults: BoardFaults,
    crystal: Crystal,
    reference: Option<ReferencePulses>,
}

impl Board {
    /// The board of a stand with this plant; `motor_constant` in N m/A gives the voltage of the coasting motor.
    pub fn new(stand: &StandSetup, plant: Box<dyn PlantPort>, motor_constant: f64, seed: u64) -> Self {
        let SensorSetup { current_noise_A, supply_noise_V, temp_noise_K, .. } = stand.sensors;
        let hardware = stand.hardware;
        let encoder = Encoder::new(&hardware);
        let exact = encoder.exact(plant.theta_rad());
        let noise = [
            Noise::new(seed, 0, current_noise_A / hardware.current_A_per_code),
            Noise::new(seed, 2, supply_noise_V),
            Noise::new(seed, 3, temp_noise_K),
        ];
        Self {
            plant,
            motor_constant,
            hardware,
            encoder,
            now: 0,
            exact,
            passage: Passage::default(),
            command_V: None,
            noise,
            imu: stand.imu.map(|setup| Imu::new(setup, seed)),
            sensor_at: SENSOR_STEP,
            sensor_selected: false,
            frozen: None,
            faults: BoardFaults::default(),
            crystal: Crystal::new(&stand.clock),
            reference: stand.clock.reference.map(|setup| ReferencePulses::new(&setup, seed)),
        }
    }

    /// The plant.
    pub fn plant(&self) -> &dyn PlantPort {
        &*self.plant
    }

    /// The plant, to disturb it.
    pub fn plant_mut(&mut self) -> &mut dyn PlantPort {
        &mut *self.plant
    }

    /// Changes the faults.
    pub fn set_faults(&mut self, faults: BoardFaults) {
        self.frozen = match (faults.encoder_off, self.frozen) {
            (true, None) => Some(self.disc()),
            (true, frozen) => frozen,
            (false, _) => None,
        };
        self.faults = faults;
    }

    /// Voltage that the bridge asks for; `None`: the motor coasts.
    pub fn command_V(&self) -> Option<f64> {
        self.command_V
    }

    /// The levels at the bridge's inputs (mean over a PWM period) from `now` on (DRV8871: both high brakes, both low coasts).
    pub fn set_bridge(&mut self, levels: [f64; 2], now: Time) {
        self.advance(now);
        let [first, second] = levels;
        self.command_V = (first > 0.0 || second > 0.0).then_some((first - second) * self.hardware.supply_nominal_V);
    }

    /// Integrates the plant to `now`.
    pub fn advance(&mut self, now: Time) {
        let step = now.saturating_sub(self.now);
        if step == 0 {
            return;
        }
        // A coasting motor has the voltage of its rotation at its terminals.
        let command_V = self.command_V.unwrap_or_else(|| self.motor_constant * self.plant.true_rate_rad_s());
        self.plant.advance(command_V, self.true_s(step));
        let after = self.encoder.exact(self.plant.theta_rad());
        self.pass(after, step);
        self.now = now;
    }

    /// Detects edges and index between the last position and `after`, `step` later.
    fn pass(&mut self, after: f64, step: Time) {
        let before = self.exact;
        self.exact = after;
        let (from, to) = (before.floor() as i64, after.floor() as i64);
        if from == to {
            return;
        }
        let at = |position: f64| {
            let part = ((position - before) / (after - before)).clamp(0.0, 1.0);
            self.now + (part * step as f64) as Time
        };
        let turn = self.hardware.counts_per_turn as i64;
        let (edge, index) = if to > from {
            let first = to - to.rem_euclid(turn);
            (to as f64, (first > from).then_some((first as f64, first)))
        } else {
            // Backwards the pulse begins where count 0 of the turn is entered from above.
            let first = to + (-to).rem_euclid(turn);
            ((to + 1) as f64, (first < from).then_some(((first + 1) as f64, first)))
        };
        if !self.faults.encoder_off {
            self.passage.edge = Some(at(edge));
        }
        if let Some((position, count)) = index.filter(|_| !self.faults.index_off) {
            self.passage.index = Some((at(position), count));
        }
    }

    /// What passed the encoder since the last call.
    pub fn take_passage(&mut self) -> Passage {
        std::mem::take(&mut self.passage)
    }

    /// Integrates the plant to `now` where the last step is older than 2 µs.
    pub fn catch_up(&mut self, now: Time) {
        if now >= self.now + MIN_STEP {
            self.advance(now);
        }
    }

    /// Count of the encoder as its counters see it.
    pub fn disc(&self) -> i64 {
        self.frozen.unwrap_or(self.exact.floor() as i64)
    }

    /// Code of a conversion of ADC channel `channel` (10 to 14: PC0 to PC4) with the torquer at `torquer_code`.
    pub fn analog_code(&mut self, channel: u32, torquer_code: Option<u16>) -> u32 {
        let code = match channel {
            10 => self.hardware.current_zero_code + self.plant.mean_current_A() / self.hardware.current_A_per_code + self.noise[0].draw(),
            11 => (self.plant.supply_V() + self.noise[1].draw()) / self.hardware.supply_V_per_code,
            12 => {
                let temp_K = self.plant.temp_C() + 273.15 + self.noise[2].draw();
                let ratio = libm::exp(NTC_B_K * (1.0 / temp_K - 1.0 / NTC_T0_K));
                ADC_FULL_SCALE * ratio / (ratio + 1.0)
            }
            // No gyroscope: its angle sensor is at its zero, the torquer's amplifier measures what it is given.
            13 => self.hardware.angle_zero_code,
            14 => torquer_code.map_or(0.0, f64::from),
            _ => 0.0,
        };
        code.round().clamp(0.0, ADC_FULL_SCALE - 1.0) as u32
    }

    /// True seconds of a time by the crystal.
    fn true_s(&self, time: Time) -> f64 {
        self.crystal.true_s(seconds(time))
    }

    /// Time of the reference's next pulse.
    pub fn next_reference_pulse(&self) -> Time {
        self.reference.as_ref().map_or(NEVER, |reference| of_seconds(self.crystal.counted_s(reference.next_s())))
    }

    /// The reference's next pulse comes.
    pub fn pass_reference_pulse(&mut self) {
        if let Some(reference) = &mut self.reference {
            reference.pass(reference.next_s());
        }
    }

    /// Next sample time of the sensor under test.
    pub fn next_sensor_step(&self) -> Time {
        if self.imu.is_some() { self.sensor_at } else { Time::MAX }
    }

    /// Advances the sensor under test by one step.
    pub fn step_sensor(&mut self) {
        let at = self.sensor_at;
        let true_s = self.true_s(at);
        self.advance(at);
        self.sensor_at = at + SENSOR_STEP;
        if let Some(imu) = &mut self.imu {
            imu.tick(true_s, self.plant.rate_rad_s(), self.plant.true_rate_rad_s(), self.plant.true_theta_rad());
        }
    }

    /// Chip select of the sensor is low from `now` on, or high.
    pub fn select_sensor(&mut self, selected: bool, now: Time) {
        let true_s = self.true_s(now);
        if let Some(imu) = self.imu.as_mut().filter(|_| selected && !self.sensor_selected) {
            imu.chip.select(true_s);
        }
        self.sensor_selected = selected;
    }

    /// Transfers a byte on the sensor's bus in SPI mode `mode`; without a selected device the line is pulled up.
    pub fn sensor_byte(&mut self, sent: u8, mode: Mode) -> u8 {
        match &mut self.imu {
            Some(imu) if self.sensor_selected && !self.faults.sensor_silent => imu.chip.byte(sent, mode),
            _ => 0xFF,
        }
    }
}

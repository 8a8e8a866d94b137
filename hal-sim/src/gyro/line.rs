//! The wiring between board and gyroscope: the converter of the torquer, two ADC channels, and the tick that serves them.

use super::GyroPort;
use crate::peripherals::Noise;
use stand_firmware::board::{GyroSample, Hardware, RollCode, Stamped, Ticks, TorquerStep};

/// Largest ADC code of the chip (12 bits, RM0390).
const MAX_CODE: f64 = 4095.0;
/// Noise of one conversion, codes rms (about one code on a quiet board; DS10693 gives a total unadjusted error of some codes).
const NOISE_CODES: f64 = 1.0;

/// A gyroscope with its wiring.
pub struct GyroLine {
    gyro: Box<dyn GyroPort>,
    hardware: Hardware,
    acting_A: f64,
    pending: Option<(Ticks, TorquerStep)>,
    charge: i32,
    conversions: u32,
    newest: Option<Stamped<GyroSample>>,
    noise: Noise,
    is_off: bool,
    most_code: f64,
    noise_codes: f64,
}

impl GyroLine {
    /// This gyroscope, with converters of these scales; `seed` of the noise.
    pub fn new(gyro: Box<dyn GyroPort>, hardware: &Hardware, seed: u64) -> Self {
        Self {
            gyro,
            hardware: *hardware,
            acting_A: 0.0,
            pending: None,
            charge: 0,
            conversions: 0,
            newest: None,
            noise: Noise::new(seed, 7, 1.0),
            is_off: false,
            most_code: MAX_CODE,
            noise_codes: NOISE_CODES,
        }
    }

    /// Converters with codes from 0 to this and this noise, codes rms.
    pub fn convert(&mut self, most_code: f64, noise_codes: f64) {
        (self.most_code, self.noise_codes) = (most_code, noise_codes);
    }

    /// Code of the roll sensor; `None` where there is none.
    pub fn roll(&self) -> Option<RollCode> {
        self.gyro.roll_rad().map(|roll_rad| RollCode((roll_rad / self.hardware.roll_rad_per_code).round() as i32))
    }

    /// The gyroscope.
    pub fn gyro(&mut self) -> &mut dyn GyroPort {
        &mut *self.gyro
    }

    /// Disconnects the wire of the angle sensor: its input is pulled up.
    pub fn disconnect(&mut self, is_off: bool) {
        self.is_off = is_off;
    }

    /// The command for a time.
    pub fn command(&mut self, at: Ticks, step: TorquerStep) {
        self.pending = Some((at, step));
    }

    /// The newest sample.
    pub fn newest(&self) -> Option<Stamped<GyroSample>> {
        self.newest
    }

    /// Advances by `dt_s`.
    pub fn advance(&mut self, platform_rad: f64, dt_s: f64) {
        self.gyro.advance(self.acting_A, platform_rad, dt_s);
    }

    /// Starts a tick at `now`: one conversion of the current, and, when due, the sample and the next command.
    pub fn tick(&mut self, now: Ticks) {
        let h = self.hardware;
        self.charge += self.code(self.gyro.torquer_A() / h.torquer_A_per_code + h.torquer_zero_code);
        self.conversions += 1;
        if let Some((_, step)) = self.pending.take_if(|(at, _)| *at <= now) {
            let volts = self.gyro.sensor_V();
            let angle = if self.is_off { self.most_code as i32 } else { self.code(volts / h.angle_V_per_code + h.angle_zero_code) };
            let value = GyroSample { angle, torquer: std::mem::take(&mut self.charge), conversions: std::mem::take(&mut self.conversions) };
            self.newest = Some(Stamped { value, at: now });
            self.acting_A = f64::from(step.0) * h.torquer_A_per_step;
        }
    }

    fn code(&mut self, exact: f64) -> i32 {
        (exact + self.noise_codes * self.noise.draw()).round().clamp(0.0, self.most_code) as i32
    }
}

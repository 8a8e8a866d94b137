//! Mounting and errors of the sensor under test, as data.

use super::adxl355::Adxl355;
use super::chip::{Chip, Part};
use super::element::{Element, GyroElement};
use super::ism330dhcx::Ism330dhcx;
use super::registers::G_M_S2;
use crate::peripherals::{Noise, SlowNoise};
use serde::{Deserialize, Serialize};
use stand_firmware::board::CONTROL_HZ;
use stand_firmware::config::{ConfigError, within};

/// Noise stream of the biases of the starts.
const TURN_ON_STREAM: u32 = 22;
/// Ambient temperature of the chip, °C: it is on the platform, far from the winding.
const AMBIENT_C: f64 = 25.0;

/// Bias instability of the gyro, rad/s: 3 °/h. DS13012 gives no value; this is a typical value of MEMS gyros with the same noise density
/// (ST ASM330LHH, data sheet: 5 mdps/√Hz, 0.21 °/√h, 3 °/h).
const GYRO_BIAS_INSTABILITY_RAD_S: f64 = 3.0 / 3600.0 / 180.0 * std::f64::consts::PI;
/// Ratio K/B, 1/√s, of a sensor whose Allan deviation rises beyond τ = 1000 s: K √(τ/3) = 0.664 B. No data sheet gives K. This τ is an
/// assumption; the published curves of such parts rise after some minutes to an hour.
const WALK_PER_INSTABILITY: f64 = 0.0364;

impl Part {
    /// White noise of the accelerometer, m/s²/√Hz, and its bias instability, m/s². The densities are those of the data sheets (DS13012,
    /// table 2: 60 µg/√Hz; ADXL355: 22.5 µg/√Hz). Neither gives a bias instability: 40 µg and 10 µg are typical of their classes.
    fn accel_noise(self) -> [f64; 2] {
        match self {
            Self::Ism330dhcx => [60e-6 * G_M_S2, 40e-6 * G_M_S2],
            Self::Adxl355 => [22.5e-6 * G_M_S2, 10e-6 * G_M_S2],
        }
    }
}

/// The sensor under test of a stand. The defaults are those of a typical part (DS13012, tables 2 and 3), with exact scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImuSetup {
    /// Type of the sensor.
    pub part: Part,
    /// Distance from the platform axis to the element of the accelerometer, m.
    pub radius_m: f64,
    /// Rotation of the sensor about the platform axis, from outward towards the motion, rad.
    pub chi_rad: f64,
    /// Tilt of the platform axis, rad; at angle 0 it tilts outward along the sensor.
    pub tilt_rad: f64,
    /// Scale of the rate reading.
    pub gyro_scale: f64,
    /// Rate reading at rest, rad/s.
    pub gyro_bias_rad_s: f64,
    /// Standard deviation of the rate reading at rest from one start of the chip (power-on or software reset) to the next, rad/s.
    pub gyro_turn_on_rad_s: f64,
    /// White noise of the gyro, one-sided density, rad/s/√Hz; √2 times the angle random walk N.
    pub gyro_noise_rad_s_rtHz: f64,
    /// Bias instability B of the gyro (flicker noise; the floor of its Allan deviation is 0.664 B), rad/s.
    pub gyro_bias_instability_rad_s: f64,
    /// Rate random walk K of the gyro, rad/s/√s.
    pub gyro_random_walk_rad_s_rts: f64,
    /// Scale of the force reading.
    pub accel_scale: f64,
    /// Force reading at zero force, along x and along y, m/s².
    pub accel_bias_m_s2: f64,
    /// White noise of the accelerometer, one-sided density, m/s²/√Hz; `None`: typical of the part, as for the two below.
    pub accel_noise_m_s2_rtHz: Option<f64>,
    /// Bias instability B of the accelerometer (flicker noise), m/s².
    pub accel_bias_instability_m_s2: Option<f64>,
    /// Random walk K of the accelerometer, m/s²/√s.
    pub accel_random_walk_m_s2_rts: Option<f64>,
    /// Relative error of the oscillator with respect to its trim value.
    pub clock_error: f64,
    /// INTERNAL_FREQ_FINE: the trim value, in steps of 0.15 %.
    pub clock_trim: i8,
    /// Temperature of the warm chip above ambient, K.
    pub self_heating_K: f64,
    /// Time constant of the warming from power-on, s; 0: warm at once.
    pub warm_up_s: f64,
    /// Component of the Earth rate along the platform axis, rad/s: 7.292115e-5 sin(latitude) on a level stand.
    pub earth_rate_rad_s: f64,
    /// Orientation of the sensor.
    #[serde(rename = "lying")]
    pub orientation: SensorOrientation,
    /// Errors of the gyroscope element.
    pub gyro: GyroElement,
}

/// Orientation of the sensor on the platform.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorOrientation {
    /// Its z along the platform's axis.
    #[default]
    Flat,
    /// On its side: its y along the platform's axis, its z inward.
    Side,
    /// On the other side: its y against the platform's axis.
    OtherSide,
}

/// Mounting of the sensor: changed by hand between two steps of a calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "as in ImuSetup")]
pub struct Mounting {
    pub radius_m: f64,
    pub chi_rad: f64,
    pub tilt_rad: f64,
    pub orientation: SensorOrientation,
}

impl Default for ImuSetup {
    fn default() -> Self {
        Self {
            part: Part::Ism330dhcx,
            radius_m: 0.05,
            chi_rad: 0.0,
            tilt_rad: 0.0,
            gyro_scale: 1.0,
            gyro_bias_rad_s: 0.0,
            gyro_turn_on_rad_s: 0.0,
            gyro_noise_rad_s_rtHz: 5e-3_f64.to_radians(), // 5 mdps/√Hz (DS13012, table 2)
            gyro_bias_instability_rad_s: GYRO_BIAS_INSTABILITY_RAD_S,
            gyro_random_walk_rad_s_rts: GYRO_BIAS_INSTABILITY_RAD_S * WALK_PER_INSTABILITY,
            accel_scale: 1.0,
            accel_bias_m_s2: 0.0,
            accel_noise_m_s2_rtHz: None,
            accel_bias_instability_m_s2: None,
            accel_random_walk_m_s2_rts: None,
            clock_error: 4e-4, // the trim is good to half a step
            clock_trim: -7,    // within the ± 2 % or so that parts come with
            self_heating_K: 1.5,
            warm_up_s: 0.0,
            earth_rate_rad_s: 0.0,
            orientation: SensorOrientation::Flat,
            gyro: GyroElement::default(),
        }
    }
}

impl ImuSetup {
    /// No noise, no bias, an exact oscillator.
    pub fn ideal() -> Self {
        Self { gyro_noise_rad_s_rtHz: 0.0, accel_noise_m_s2_rtHz: Some(0.0), clock_error: 0.0, clock_trim: 0, ..Self::default() }.white()
    }

    /// White noise, bias instability and random walk of the accelerometer, m/s²/√Hz, m/s², m/s²/√s.
    fn accel_noise(&self) -> [f64; 3] {
        let [density, instability] = self.part.accel_noise();
        let instability = self.accel_bias_instability_m_s2.unwrap_or(instability);
        let walk = self.accel_random_walk_m_s2_rts.unwrap_or(instability * WALK_PER_INSTABILITY);
        [self.accel_noise_m_s2_rtHz.unwrap_or(density), instability, walk]
    }

    /// The same sensor without flicker noise and random walk.
    pub fn white(self) -> Self {
        Self {
            gyro_bias_instability_rad_s: 0.0,
            gyro_random_walk_rad_s_rts: 0.0,
            accel_bias_instability_m_s2: Some(0.0),
            accel_random_walk_m_s2_rts: Some(0.0),
            ..self
        }
    }

    /// Checks the values of a file.
    ///
    /// # Errors
    /// The name of the first invalid parameter.
    pub fn check(&self) -> Result<(), ConfigError> {
        within("imu.radius_m", self.radius_m, 0.0, 10.0)?;
        within("imu.chi_rad", self.chi_rad, -7.0, 7.0)?;
        within("imu.tilt_rad", self.tilt_rad, -1.5, 1.5)?;
        within("imu.gyro_scale", self.gyro_scale, 0.1, 10.0)?;
        within("imu.gyro_bias_rad_s", self.gyro_bias_rad_s, -10.0, 10.0)?;
        within("imu.gyro_turn_on_rad_s", self.gyro_turn_on_rad_s, 0.0, 1.0)?;
        within("imu.gyro_noise_rad_s_rtHz", self.gyro_noise_rad_s_rtHz, 0.0, 1.0)?;
        within("imu.gyro_bias_instability_rad_s", self.gyro_bias_instability_rad_s, 0.0, 1.0)?;
        within("imu.gyro_random_walk_rad_s_rts", self.gyro_random_walk_rad_s_rts, 0.0, 1.0)?;
        within("imu.accel_scale", self.accel_scale, 0.1, 10.0)?;
        within("imu.accel_bias_m_s2", self.accel_bias_m_s2, -20.0, 20.0)?;
        let [density, instability, walk] = self.accel_noise();
        within("imu.accel_noise_m_s2_rtHz", density, 0.0, 1.0)?;
        within("imu.accel_bias_instability_m_s2", instability, 0.0, 1.0)?;
        within("imu.accel_random_walk_m_s2_rts", walk, 0.0, 1.0)?;
        within("imu.clock_error", self.clock_error, -0.05, 0.05)?;
        within("imu.self_heating_K", self.self_heating_K, -50.0, 50.0)?;
        within("imu.warm_up_s", self.warm_up_s, 0.0, 1e5)?;
        within("imu.earth_rate_rad_s", self.earth_rate_rad_s, -1e-4, 1e-4)?;
        self.gyro.check()
    }
}

/// The chip at its position.
#[derive(Clone, Debug)]
pub struct Imu {
    setup: ImuSetup,
    /// The chip behind its bus.
    pub chip: Chip,
    element: Element,
    last_rate_rad_s: f64,
    /// Bias of the present start of the chip.
    turn_on: Noise,
    start: u32,
    start_bias_rad_s: f64,
}

impl Imu {
    /// The sensor of this setup at power-on; `seed` of its noise.
    pub fn new(setup: ImuSetup, seed: u64) -> Self {
        let [density, instability, walk] = setup.accel_noise();
        let noise = |axis: usize| Noise::new(seed, 8 + axis as u32, 1.0);
        let slow = |axis: usize| {
            let [instability, walk] =
                if axis < 3 { [setup.gyro_bias_instability_rad_s, setup.gyro_random_walk_rad_s_rts] } else { [instability, walk] };
            SlowNoise::new(seed, 14 + axis as u32, instability, walk)
        };
        let chip = match setup.part {
            Part::Ism330dhcx => {
                let pace = (1.0 + 0.0015 * f64::from(setup.clock_trim)) * (1.0 + setup.clock_error);
                let densities = [setup.gyro_noise_rad_s_rtHz, density];
                let chip = Ism330dhcx::new(std::array::from_fn(noise), std::array::from_fn(slow), densities, pace, setup.clock_trim);
                Chip::Ism330dhcx(Box::new(chip))
            }
            Part::Adxl355 => {
                let of_accel = |axis: usize| axis + 3;
                let (noise, slow) = (std::array::from_fn(|axis| noise(of_accel(axis))), std::array::from_fn(|axis| slow(of_accel(axis))));
                Chip::Adxl355(Box::new(Adxl355::new(noise, slow, density, 1.0 + setup.clock_error)))
            }
        };
        let mut turn_on = Noise::new(seed, TURN_ON_STREAM, setup.gyro_turn_on_rad_s);
        let start_bias_rad_s = turn_on.draw();
        Self { setup, chip, element: Element::new(setup.gyro), last_rate_rad_s: 0.0, turn_on, start: 0, start_bias_rad_s }
    }

    /// Its mounting.
    pub fn mounting(&self) -> Mounting {
        let ImuSetup { radius_m, chi_rad, tilt_rad, orientation, .. } = self.setup;
        Mounting { radius_m, chi_rad, tilt_rad, orientation }
    }

    /// Changes the mounting.
    pub fn set_mounting(&mut self, m: Mounting) {
        let Mounting { radius_m, chi_rad, tilt_rad, orientation } = m;
        self.setup = ImuSetup { radius_m, chi_rad, tilt_rad, orientation, ..self.setup };
    }

    /// Ends a tick at `now_s`: the rate reading of the element is `reading_rad_s`, the platform has the rate `rate_rad_s` and the angle
    /// `theta_rad`.
    #[inline]
    pub fn tick(&mut self, now_s: f64, reading_rad_s: f64, rate_rad_s: f64, theta_rad: f64) {
        let acceleration = (rate_rad_s - self.last_rate_rad_s) * CONTROL_HZ as f64;
        self.last_rate_rad_s = rate_rad_s;
        if !self.chip.samples() {
            return self.chip.pass(now_s);
        }
        let s = &self.setup;
        // With a tilted axis gravity rotates through the plane of the platform.
        let (outward, along) = (-rate_rad_s * rate_rad_s * s.radius_m, acceleration * s.radius_m);
        let (sin, cos) = libm::sincos(s.chi_rad);
        let lean = G_M_S2 * libm::sin(s.tilt_rad);
        let forces = [
            outward * cos + along * sin + lean * libm::cos(theta_rad + s.chi_rad),
            along * cos - outward * sin - lean * libm::sin(theta_rad + s.chi_rad),
            G_M_S2 * libm::cos(s.tilt_rad),
        ];
        let warm = if s.warm_up_s > 0.0 { 1.0 - libm::exp(-now_s / s.warm_up_s) } else { 1.0 };
        let temp_C = AMBIENT_C + s.self_heating_K * warm;
        let turning = reading_rad_s + s.earth_rate_rad_s;
        // On its side the platform axis is the sensor's y, and the former z points inward.
        let (about, across, forces) = match s.orientation {
            SensorOrientation::Flat => (turning, 0.0, forces),
            SensorOrientation::Side => (0.0, turning, [forces[1], forces[2], -forces[0]]),
            SensorOrientation::OtherSide => (0.0, -turning, [-forces[1], -forces[2], -forces[0]]),
        };
        let rate = self.element.reading(about, across, forces[0], temp_C);
        let [x, y, z] = forces.map(|force| force * s.accel_scale);
        let start = self.chip.starts();
        if start != self.start {
            (self.start, self.start_bias_rad_s) = (start, self.turn_on.draw());
        }
        let seen =
            [0.0, 0.0, s.gyro_scale * rate + s.gyro_bias_rad_s + self.start_bias_rad_s, x + s.accel_bias_m_s2, y + s.accel_bias_m_s2, z];
        self.chip.tick(now_s, &seen, temp_C);
    }
}

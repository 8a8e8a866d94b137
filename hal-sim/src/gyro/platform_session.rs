//! A drift session on a three-axis platform without firmware: rows as a recorder writes them.
//!
//! Input: the platform with its torquers and sensors ([`PlatformSetup`]), the pulses of each cycle, the positions. Output: rows with time, mark of the cycle,
//! position, voltages of the angle sensors and currents of the torquers. All three correction loops are open from half a second before a cycle, when the zero
//! of the currents is measured, to its end. The firmware drives one axis at a time; pulses on all axes at once exist here only.

use super::{AngleSensor, Site, ThreeAxis, Torquer};
use crate::peripherals::Noise;
use serde::{Deserialize, Serialize};

/// Names of the columns of a row.
pub const PLATFORM_COLUMNS: [&str; 9] = [
    "t_s",
    "drift_mark",
    "turned_deg",
    "angle_sensor_x_V",
    "angle_sensor_y_V",
    "angle_sensor_z_V",
    "torquer_x_A",
    "torquer_y_A",
    "torquer_z_A",
];

/// Time with open loops before a cycle, s.
const LEAD_S: f64 = 0.5;
/// Steps of the plant in a row.
const STEPS: usize = 5;
/// Time for a turn to another position, which is not recorded, s.
const TURN_S: f64 = 60.0;
/// Time with closed loops after the last cycle of a position, s.
const END_S: f64 = 2.0;

/// The platform and its pulses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlatformSetup {
    /// Site and azimuth.
    pub site: Site,
    /// Own drifts about x (along the azimuth), y (up) and z, rad/s.
    pub own_rad_s: [f64; 3],
    /// The torquers; the next two fields replace their inequalities.
    pub torquer: Torquer,
    /// Relative excess of a negative current, for each axis.
    pub inequality: [f64; 3],
    /// Relative excess of the gain for negative currents, for each axis.
    pub gain_inequality: [f64; 3],
    /// The angle sensors.
    pub sensor: AngleSensor,
    /// Reading of the current sensors at zero current, A.
    pub current_zero_A: [f64; 3],
    /// Noise of the current readings, A rms.
    pub current_noise_A: f64,
    /// Gain of the correction loops, 1/s.
    pub correction_1_s: f64,
    /// Initial gimbal angles of a position, rad.
    pub start_rad: [f64; 3],
    /// Magnitude of the pulses, rad/s.
    pub rate_rad_s: f64,
    /// Duration of a pulse, s.
    pub pulse_s: f64,
    /// Time with closed loops before each cycle, s.
    pub rest_s: f64,
    /// Interval of the rows, s.
    pub row_s: f64,
}

impl Default for PlatformSetup {
    /// The platform of the published figures, with sensors of 0.1″.
    fn default() -> Self {
        let arcsec = super::ARCSEC;
        Self {
            site: Site::default(),
            own_rad_s: [1.0, -0.5, 2.0].map(|rate| rate * super::DEG_H),
            torquer: Torquer::default(),
            inequality: [1e-4, -2e-4, 3e-4],
            gain_inequality: [0.0; 3],
            // The loops keep the sensor's zero: another zero would be an error of level and azimuth.
            sensor: AngleSensor { offset_V: 0.0, noise_rad: 0.1 * arcsec, step_rad: 0.1 * arcsec, ..AngleSensor::default() },
            current_zero_A: [2e-5, -1e-5, 3e-5],
            current_noise_A: 1e-6,
            correction_1_s: 10.0,
            start_rad: [30.0 * arcsec; 3],
            rate_rad_s: 0.05_f64.to_radians(),
            pulse_s: 5.0,
            rest_s: 3.0,
            row_s: 5e-3,
        }
    }
}

impl PlatformSetup {
    /// Checks the numbers that divide or count.
    ///
    /// # Errors
    /// The name of the first invalid number.
    pub fn check(&self) -> Result<(), stand_firmware::config::ConfigError> {
        use stand_firmware::config::within;
        within("torquer.gain_rad_s_A", self.torquer.gain_rad_s_A, 1e-9, 1e3)?;
        within("sensor.gain_V_rad", self.sensor.gain_V_rad, 1e-6, 1e9)?;
        within("sensor.noise_rad", self.sensor.noise_rad, 0.0, 1.0)?;
        within("rate_rad_s", self.rate_rad_s, 1e-9, 1.0)?;
        within("row_s", self.row_s, 1e-4, 1.0)?;
        within("pulse_s", self.pulse_s, 10.0 * self.row_s, 1e3)?;
        within("rest_s", self.rest_s, self.row_s, 1e5)
    }

    /// Records cycles in positions of `turned_deg`; each cycle has the first pulses on the three axes, in units of the usual one.
    pub fn record(&self, cycles: &[[f64; 3]], turned_deg: &[f64], seed: u64) -> Vec<[f64; 9]> {
        let torquers = std::array::from_fn(|axis| Torquer {
            inequality: self.inequality[axis],
            gain_inequality: self.gain_inequality[axis],
            ..self.torquer
        });
        let mut recorder = Recorder {
            setup: self,
            platform: ThreeAxis::new([0.0; 3], [0.0; 3], [0.0; 3]),
            torquers,
            noise: Noise::new(seed, 0, 1.0),
            t_s: 0.0,
            turned_deg: 0.0,
            rows: Vec::new(),
        };
        let count = |seconds: f64| (seconds / self.row_s).round() as usize;
        let gain = self.torquer.gain_rad_s_A;
        let command_A = self.rate_rad_s / gain;
        let closed = |angles: [f64; 3]| angles.map(|angle| -self.correction_1_s * angle / gain);
        let mut number = 0.0;
        let mut before = None;
        for turned in turned_deg {
            if before.is_some_and(|before| before != *turned) {
                recorder.t_s += TURN_S;
            }
            if before != Some(*turned) {
                recorder.turned_deg = *turned;
                recorder.platform = ThreeAxis::new(self.own_rad_s, self.site.rate_rad_s(turned.to_radians()), self.start_rad);
            }
            before = Some(*turned);
            for signs in cycles {
                number += 4.0;
                recorder.rows(count(self.rest_s), number, closed);
                recorder.rows(count(LEAD_S), number, |_| [0.0; 3]);
                recorder.rows(count(self.pulse_s), number + 1.0, |_| signs.map(|sign| sign * command_A));
                recorder.rows(count(self.pulse_s), number + 2.0, |_| signs.map(|sign| -sign * command_A));
            }
            recorder.rows(count(END_S), 0.0, closed);
        }
        recorder.rows
    }
}

/// The platform in motion and its rows.
struct Recorder<'a> {
    setup: &'a PlatformSetup,
    platform: ThreeAxis,
    torquers: [Torquer; 3],
    noise: Noise,
    t_s: f64,
    turned_deg: f64,
    rows: Vec<[f64; 9]>,
}

impl Recorder<'_> {
    /// Records `count` rows: `asked` gives the current on each axis from the sensors' angles, rad.
    fn rows(&mut self, count: usize, mark: f64, asked: impl Fn([f64; 3]) -> [f64; 3]) {
        let setup = self.setup;
        for _ in 0..count {
            let angles = self.platform.gimbals_rad();
            let volts = angles.map(|angle| setup.sensor.output_V(angle, &mut self.noise));
            let given = asked(volts.map(|volts| volts / setup.sensor.gain_V_rad));
            let step_s = setup.row_s / STEPS as f64;
            let mut mean_A = [0.0; 3];
            for _ in 0..STEPS {
                let rates: [f64; 3] = std::array::from_fn(|axis| self.torquers[axis].advance(given[axis], step_s));
                mean_A.iter_mut().zip(&self.torquers).for_each(|(mean, torquer)| *mean += torquer.mean_A() / STEPS as f64);
                self.platform.advance(rates, step_s);
            }
            let [x, y, z]: [f64; 3] =
                std::array::from_fn(|axis| mean_A[axis] + setup.current_zero_A[axis] + setup.current_noise_A * self.noise.draw());
            self.rows.push([self.t_s, mark, self.turned_deg, volts[0], volts[1], volts[2], x, y, z]);
            self.t_s += setup.row_s;
        }
    }
}

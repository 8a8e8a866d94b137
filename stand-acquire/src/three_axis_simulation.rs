//! A drift session of a simulated three-axis platform, as a log: gimbals X–Z–Y with exact kinematics, a torquer and an angle sensor for
//! each axis, without the firmware, which drives one axis at a time.
//!
//! Input: the platform, the seed. Output: a log of 200 rows per second for `stand drift compute`, and the true values. The session has two
//! positions half a turn apart in the order A B B A, twice; pulses on all axes at once with both signs at two rates; 3 s with the loops
//! closed and 0.5 s with the loops open before each cycle.

use std::path::Path;

use hal_sim::gyro::{AngleSensor, DEG_H, Site, ThreeAxis, Torquer};
use hal_sim::peripherals::{Noise, SlowNoise};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use identification::log::{Column, Format, Log, LogError, Note, Notes};

/// Interval of the rows, s, and steps of the platform per row.
const ROW_S: f64 = 5e-3;
const STEPS: usize = 5;
/// Duration of a pulse, s.
const PULSE_S: f64 = 5.0;
/// Rates of the pulses, rad/s: 0.05 and 0.02 °/s.
const RATES_RAD_S: [f64; 2] = [0.05 * std::f64::consts::PI / 180.0, 0.02 * std::f64::consts::PI / 180.0];
/// Times with closed and with open loops before a cycle, and of a turn, s.
const CLOSED_S: f64 = 3.0;
const OPEN_S: f64 = 0.5;
const TURN_S: f64 = 60.0;
/// Gain of the loops, 1/s.
const LOOP_1_S: f64 = 2.0;
/// Order of the positions, in half turns; the platform stays where two successive ones are equal.
const HALF_TURNS: [f64; 8] = [0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0];
/// Noise of a current reading, A.
const CURRENT_NOISE_A: f64 = 1e-6;
/// Streams of the noise; the slow noise takes one for each axis.
const READING_STREAM: u32 = 72;
const SLOW_STREAM: u32 = 73;
/// Names of the axes in columns and files.
const AXES: [&str; 3] = ["x", "y", "z"];

/// Own drift of the platform about its axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlatformDrift {
    /// Constant part about x, y (up), z, rad/s.
    pub constant_rad_s: [f64; 3],
    /// Ramps, rad/s².
    pub ramp_rad_s2: [f64; 3],
    /// Flicker noise of each axis: bias instability B, rad/s.
    pub flicker_rad_s: f64,
    /// Random walk K of each axis, rad/s/√s.
    pub random_walk_rad_s_sqrt_s: f64,
}

impl Default for PlatformDrift {
    /// 1, −0.5 and 2 °/h, as in the published figures.
    fn default() -> Self {
        Self {
            constant_rad_s: [1.0, -0.5, 2.0].map(|rate| rate * DEG_H),
            ramp_rad_s2: [0.0; 3],
            flicker_rad_s: 0.0,
            random_walk_rad_s_sqrt_s: 0.0,
        }
    }
}

/// A three-axis platform, from a TOML file: `[site]`, `[own]`, `[sensor]`, three tables `[[torquer]]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Platform {
    /// Site and azimuth.
    pub site: Site,
    /// Own drift.
    pub own: PlatformDrift,
    /// The angle sensors, alike.
    pub sensor: AngleSensor,
    /// The torquers about x, y, z.
    pub torquer: [Torquer; 3],
}

impl Default for Platform {
    fn default() -> Self {
        Self {
            site: Site::default(),
            own: PlatformDrift::default(),
            // The loops hold the zero of the sensors: another zero would be an error of level and azimuth.
            sensor: AngleSensor { offset_V: 0.0, ..AngleSensor::default() },
            torquer: [Torquer::default(); 3],
        }
    }
}

impl Platform {
    /// Reads a platform.
    ///
    /// # Errors
    /// Not TOML, an unknown key, a number of tables other than three, or a number out of its range; with its line or name.
    pub fn read(text: &str) -> Result<Self, String> {
        let platform: Self =
            toml::from_str(text).map_err(|e| e.to_string().lines().next().unwrap_or_default().to_owned() + ": " + e.message())?;
        let within = |name: &str, value: f64, least: f64, most: f64| {
            let is_valid = (least..=most).contains(&value);
            is_valid.then_some(()).ok_or_else(|| format!("{name} {value} is out of range: {least} to {most}"))
        };
        let right_angle = std::f64::consts::FRAC_PI_2;
        within("site.latitude_rad", platform.site.latitude_rad, -right_angle, right_angle)?;
        within("site.azimuth_rad", platform.site.azimuth_rad, -1e3, 1e3)?;
        within("own.flicker_rad_s", platform.own.flicker_rad_s, 0.0, 1.0)?;
        within("own.random_walk_rad_s_sqrt_s", platform.own.random_walk_rad_s_sqrt_s, 0.0, 1.0)?;
        within("sensor.gain_V_rad", platform.sensor.gain_V_rad, 1e-6, 1e9)?;
        within("sensor.offset_V", platform.sensor.offset_V, -1e3, 1e3)?;
        within("sensor.noise_rad", platform.sensor.noise_rad, 0.0, 1.0)?;
        within("sensor.step_rad", platform.sensor.step_rad, 0.0, 1.0)?;
        within("sensor.range_V", platform.sensor.range_V, 1e-6, 1e9)?;
        for (axis, torquer) in AXES.iter().zip(&platform.torquer) {
            let name = |field: &str| format!("torquer {axis}: {field}");
            within(&name("gain_rad_s_A"), torquer.gain_rad_s_A, 1e-9, 1e3)?;
            within(&name("lag_s"), torquer.lag_s, 0.0, 10.0)?;
            within(&name("inequality"), torquer.inequality, -0.5, 0.5)?;
            within(&name("gain_inequality"), torquer.gain_inequality, -0.5, 0.5)?;
            within(&name("offset_A"), torquer.offset_A, -1e3, 1e3)?;
            within(&name("limit_A"), torquer.limit_A, 1e-9, 1e3)?;
        }
        for (k, axis) in AXES.iter().enumerate() {
            within(&format!("own.constant_rad_s about {axis}"), platform.own.constant_rad_s[k], -1.0, 1.0)?;
            within(&format!("own.ramp_rad_s2 about {axis}"), platform.own.ramp_rad_s2[k], -1.0, 1.0)?;
        }
        if platform.torquer.iter().any(|torquer| torquer.gain_rad_s_A != platform.torquer[0].gain_rad_s_A) {
            return Err("torquer: gain_rad_s_A must be the same for the three axes, because a log has one torquer_gain_rad_s_A".to_owned());
        }
        Ok(platform)
    }
}

/// The true values of a session.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct PlatformTruth {
    /// Own drift, mean over the cycles, rad/s.
    pub own_rad_s: [f64; 3],
    /// Apparent drift in the first position, rad/s.
    pub apparent_rad_s: [f64; 3],
    /// Azimuth, rad.
    pub azimuth_rad: f64,
}

/// Why there is no log.
#[derive(Debug, thiserror::Error)]
pub enum PlatformSimulationError {
    /// Simulation ended by the caller.
    #[error("interrupted")]
    Interrupted,
    /// The name of the log is invalid, or it cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
}

/// Duration of the session, s.
pub fn duration_s() -> f64 {
    let visits = HALF_TURNS.len() as f64;
    let turns = HALF_TURNS.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64;
    visits * (2 * RATES_RAD_S.len()) as f64 * (CLOSED_S + OPEN_S + 2.0 * PULSE_S) + turns * (TURN_S + OPEN_S)
}

/// The running session.
struct Session<'a> {
    setup: &'a Platform,
    platform: ThreeAxis,
    torquers: [Torquer; 3],
    slow: [SlowNoise; 3],
    noise: Noise,
    t_s: f64,
    turned_deg: f64,
    columns: Vec<Vec<f64>>,
    /// Sum of the own drift over the rows of the cycles, and their number.
    own_sum_rad_s: [f64; 3],
    cycle_rows: usize,
}

impl Session<'_> {
    fn own_rad_s(&mut self) -> [f64; 3] {
        let (own, t_s) = (&self.setup.own, self.t_s);
        std::array::from_fn(|axis| own.constant_rad_s[axis] + own.ramp_rad_s2[axis] * t_s + self.slow[axis].at(t_s))
    }

    /// Appends rows of a duration: `command_A` by the angles of the gimbals, rad.
    fn rows(&mut self, duration_s: f64, mark: f64, in_cycle: bool, command_A: impl Fn([f64; 3]) -> [f64; 3]) {
        for _ in 0..(duration_s / ROW_S).round() as usize {
            let volts = self.platform.gimbals_rad().map(|angle| self.setup.sensor.output_V(angle, &mut self.noise));
            let commands_A = command_A(volts.map(|volts| volts / self.setup.sensor.gain_V_rad));
            self.platform.own_rad_s = self.own_rad_s();
            let mut mean_A = [0.0; 3];
            for _ in 0..STEPS {
                let dt_s = ROW_S / STEPS as f64;
                let rates: [f64; 3] = std::array::from_fn(|axis| self.torquers[axis].advance(commands_A[axis], dt_s));
                mean_A.iter_mut().zip(&self.torquers).for_each(|(mean, torquer)| *mean += torquer.mean_A() / STEPS as f64);
                self.platform.advance(rates, dt_s);
            }
            if in_cycle {
                self.own_sum_rad_s.iter_mut().zip(self.platform.own_rad_s).for_each(|(sum, own)| *sum += own);
                self.cycle_rows += 1;
            }
            let read_A = mean_A.map(|mean| mean + CURRENT_NOISE_A * self.noise.draw());
            let row = [self.t_s, mark, self.turned_deg].into_iter().chain(volts).chain(read_A);
            self.columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
            self.t_s += ROW_S;
        }
    }
}

/// Simulates the session and writes its log. `goes_on` is asked with the time before each cycle, s.
///
/// # Errors
/// As [`PlatformSimulationError`]; no file remains.
pub fn write(
    setup: &Platform,
    seed: u64,
    path: &Path,
    mut goes_on: impl FnMut(f64) -> bool,
) -> Result<(Log, PlatformTruth), PlatformSimulationError> {
    // Checked first: a wrong ending must not cost the simulation.
    Format::of(path)?;
    let own = &setup.own;
    let mut session = Session {
        setup,
        platform: ThreeAxis::new(own.constant_rad_s, setup.site.rate_rad_s(0.0), [0.0; 3]),
        torquers: setup.torquer,
        slow: std::array::from_fn(|axis| SlowNoise::new(seed, SLOW_STREAM + axis as u32, own.flicker_rad_s, own.random_walk_rad_s_sqrt_s)),
        noise: Noise::new(seed, READING_STREAM, 1.0),
        t_s: 0.0,
        turned_deg: 0.0,
        columns: vec![Vec::new(); 9],
        own_sum_rad_s: [0.0; 3],
        cycle_rows: 0,
    };
    let gains = setup.torquer.map(|torquer| torquer.gain_rad_s_A);
    let correction = |angles: [f64; 3]| std::array::from_fn(|axis| -LOOP_1_S * angles[axis] / gains[axis]);
    let mut number = 0;
    for (visit, half_turns) in HALF_TURNS.into_iter().enumerate() {
        if visit > 0 && HALF_TURNS[visit - 1] != half_turns {
            // The end of a cycle is the row that follows it.
            session.rows(OPEN_S, 0.0, false, correction);
            session.t_s += TURN_S;
        }
        session.turned_deg = 180.0 * half_turns;
        session.platform.earth_rad_s = setup.site.rate_rad_s(session.turned_deg.to_radians());
        let mut rates = RATES_RAD_S;
        if visit % 2 == 1 {
            rates.reverse();
        }
        for rate_rad_s in rates {
            for sign in [1.0, -1.0] {
                if !goes_on(session.t_s) {
                    return Err(PlatformSimulationError::Interrupted);
                }
                // As the firmware: 4 n before cycle n, 4 n + 1 and 4 n + 2 in its pulses.
                number += 1;
                let mark = f64::from(4 * number);
                let pulse_A = gains.map(|gain| sign * rate_rad_s / gain);
                session.rows(CLOSED_S, mark, false, correction);
                session.rows(OPEN_S, mark, false, |_| [0.0; 3]);
                session.rows(PULSE_S, mark + 1.0, true, |_| pulse_A);
                session.rows(PULSE_S, mark + 2.0, true, |_| pulse_A.map(|current| -current));
            }
        }
    }
    session.rows(OPEN_S, 0.0, false, correction);
    let [earth_x, earth_y, earth_z] = setup.site.rate_rad_s(0.0);
    let truth = PlatformTruth {
        own_rad_s: session.own_sum_rad_s.map(|sum| sum / session.cycle_rows as f64),
        apparent_rad_s: [-earth_x, -earth_y, -earth_z],
        azimuth_rad: setup.site.azimuth_rad,
    };
    let mut names: Vec<String> = ["t_s", "drift_mark", "turned_deg"].map(str::to_owned).to_vec();
    names.extend(AXES.map(|axis| format!("angle_sensor_{axis}_V")));
    names.extend(AXES.map(|axis| format!("torquer_{axis}_A")));
    let columns = names.into_iter().zip(session.columns).map(|(name, values)| Column { name, values }).collect();
    let notes = Notes::from_iter([
        Note::Number("angle_gain_V_rad", setup.sensor.gain_V_rad),
        Note::Number("torquer_gain_rad_s_A", gains[0]),
        Note::Number("angle_limit_V", setup.sensor.range_V),
        Note::Number("pulse_s", PULSE_S),
        Note::Number("latitude_deg", setup.site.latitude_rad.to_degrees()),
    ]);
    let log = Log::new(path, columns, notes)?;
    log.write(path)?;
    Ok((log, truth))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_platform_has_three_torquers_of_one_gain() {
        assert_eq!(Platform::read("").unwrap(), Platform::default());
        let error = |text: &str| Platform::read(text).unwrap_err();
        assert!(error("[[torquer]]\nlag_s = 0.001\n").contains("line"), "{}", error("[[torquer]]\n"));
        assert!(error("[site]\nlatitude_rad = 2.0\n").contains("site.latitude_rad 2 is out of range"));
        let gains = "[[torquer]]\n[[torquer]]\n[[torquer]]\ngain_rad_s_A = 0.03\n";
        assert!(error(gains).contains("same for the three axes"), "{}", error(gains));
    }
}

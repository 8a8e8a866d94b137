//! Accuracy of the simulated stand's rate, from the plant's true angle and the crystal: data of docs/rate-accuracy.md.
//!
//! Input: a stand and a rate. Output: mean rate over whole turns, its scatter over windows of one turn, ten degrees and one degree, and the
//! settling of a rate step. Marks of the plant's true angle are timed between ticks; encoder and rate sensor are not used.

use std::cell::RefCell;
use std::f64::consts::PI;
use std::rc::Rc;

use hal_sim::board::PlantPort;
use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{SessionError, SessionRequest, calibrate, run_rows};
use stand_firmware::board::TICKS_PER_S;
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;

/// Initial angle, rad from the index: 3° before it, so that the index comes soon.
const BEGIN_RAD: f64 = -PI / 60.0;
/// Turns after the index that are discarded.
pub const TURNS_TO_SETTLE: usize = 2;
/// Turns over which the mean is taken.
pub const TURNS_OF_THE_MEAN: usize = 10;
/// Turns over which the scatter is taken.
pub const TURNS_OF_THE_SCATTER: usize = 20;
/// Settling band as a fraction of the step.
const SETTLING_BAND: f64 = 0.02;
/// Duration of a step, s.
const STEP_S: f64 = 2.0;

/// The default stand (Coulomb and viscous friction, inductance, one tick of delay) with cogging of harmonic order 7, in the middle of the
/// range of hidden cogging, and half of that at order 14.
pub fn cogging_stand() -> Stand {
    let mut stand = Stand::default();
    for (name, order, torque_N_m, phase_rad) in [("cogging", 7.0, 2e-3, 0.3), ("cogging#2", 14.0, 1e-3, 2.0)] {
        let parameters = [("cogging_N_m", torque_N_m), ("cogging_order", order), ("cogging_phase_rad", phase_rad)];
        stand.effects.insert(name.to_owned(), parameters.map(|(name, value)| (name.to_owned(), value)).into());
    }
    stand
}

/// The stand with the compensation from its own calibration of cogging and friction.
///
/// # Panics
/// The stand cannot be calibrated.
pub fn calibrated_stand(stand: &Stand, seed: u64) -> Stand {
    let plant = Plant::new(stand, BEGIN_RAD).expect("a valid stand");
    let calibrated = calibrate(stand.setup(), Box::new(plant), seed, &|_| ()).expect("a valid stand");
    let mut stand = stand.clone();
    stand.firmware.compensation = calibrated.outcome.expect("a stand that can be calibrated").compensation;
    stand
}

/// Results at one rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Commanded rate, °/s.
    pub rate_deg_s: f64,
    /// Relative error of the mean rate over ten whole turns.
    pub mean: f64,
    /// Relative scatter (1 σ) of the mean rates over whole turns from index to index.
    pub turn: f64,
    /// Relative scatter over each ten degrees.
    pub ten_degrees: f64,
    /// Relative scatter over each degree.
    pub one_degree: f64,
}

/// Settling of a step from rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Time after the step at which the rate last leaves ± 2 %, s.
    pub settled_s: f64,
    /// Relative overshoot.
    pub overshoot: f64,
}

/// Turns `stand` at `rate_deg_s` (positive) and measures.
///
/// # Errors
/// The session is refused.
///
/// # Panics
/// The platform turned less than commanded, or the stand is invalid.
pub fn accuracy(stand: &Stand, rate_deg_s: f64, seed: u64) -> Result<Accuracy, SessionError> {
    let rate_rad_s = rate_deg_s.to_radians();
    let turns = TURNS_TO_SETTLE + TURNS_OF_THE_SCATTER;
    let seconds = (turns as f64 * 360.0 + 6.0) / rate_deg_s + rate_rad_s / stand.firmware.acceleration_rad_s2 + 1.0;
    let degrees_s = Rc::new(RefCell::new(Vec::with_capacity(turns * 360 + 100)));
    let plant = Marked::new(Plant::new(stand, BEGIN_RAD).expect("a valid stand"), PI / 180.0, degrees_s.clone());
    run_rows(stand.setup(), plant, constant(rate_rad_s, seconds, seed), |_, _| ())?;
    let degrees_s = degrees_s.borrow();
    let marks = &degrees_s[TURNS_TO_SETTLE * 360..=turns * 360];
    let mean_s = (marks[TURNS_OF_THE_MEAN * 360] - marks[0]) / (TURNS_OF_THE_MEAN * 360) as f64;
    Ok(Accuracy {
        rate_deg_s,
        mean: 1.0 / (mean_s * rate_deg_s) - 1.0,
        turn: scatter(marks, 360),
        ten_degrees: scatter(marks, 10),
        one_degree: scatter(marks, 1),
    })
}

/// A step from rest to `rate_deg_s` (positive), by the plant's true rate.
///
/// # Errors
/// The session is refused.
///
/// # Panics
/// The stand is invalid.
pub fn step(stand: &Stand, rate_deg_s: f64, seed: u64) -> Result<Step, SessionError> {
    let rate_rad_s = rate_deg_s.to_radians();
    let (mut settled_s, mut overshoot) = (0.0_f64, 0.0_f64);
    let plant = Plant::new(stand, BEGIN_RAD).expect("a valid stand");
    run_rows(stand.setup(), plant, constant(rate_rad_s, STEP_S, seed), |row, truth| {
        let off = truth.omega_rad_s / rate_rad_s - 1.0;
        overshoot = overshoot.max(off);
        if off.abs() > SETTLING_BAND {
            settled_s = row.t_s;
        }
    })?;
    Ok(Step { settled_s, overshoot })
}

fn constant(rate_rad_s: f64, seconds: f64, seed: u64) -> SessionRequest {
    SessionRequest { mode: Mode::Rate, profile: ProfileConfig::new(ProfileKind::Constant, rate_rad_s, seed), seconds, seed }
}

/// Standard deviation of the mean rates over windows of `window` marks, relative to their mean.
fn scatter(marks_s: &[f64], window: usize) -> f64 {
    let ends: Vec<f64> = marks_s.iter().copied().step_by(window).collect();
    let rates: Vec<f64> = ends.windows(2).map(|ends| 1.0 / (ends[1] - ends[0])).collect();
    let mean = rates.iter().sum::<f64>() / rates.len() as f64;
    let squares: f64 = rates.iter().map(|rate| (rate / mean - 1.0).powi(2)).sum();
    (squares / (rates.len() - 1) as f64).sqrt()
}

/// A plant that times the forward crossings of marks of its true angle, from zero on.
struct Marked {
    plant: Plant,
    every_rad: f64,
    steps: u64,
    times_s: Rc<RefCell<Vec<f64>>>,
}

impl Marked {
    /// Marks every `every_rad`; their times go to `times_s`.
    fn new(plant: Plant, every_rad: f64, times_s: Rc<RefCell<Vec<f64>>>) -> Self {
        Self { plant, every_rad, steps: 0, times_s }
    }

    fn now_s(&self) -> f64 {
        self.steps as f64 / TICKS_PER_S as f64
    }
}

impl PlantPort for Marked {
    fn advance(&mut self, command_V: f64, dt_s: f64) {
        let (theta, omega) = (self.plant.true_theta_rad(), self.plant.true_rate_rad_s());
        self.plant.advance(command_V, dt_s);
        let mut times_s = self.times_s.borrow_mut();
        let (after, omega_after) = (self.plant.true_theta_rad(), self.plant.true_rate_rad_s());
        loop {
            let mark = times_s.len() as f64 * self.every_rad;
            if after < mark {
                break;
            }
            // Hermite cubic through both ends; Newton's method starts at the chord.
            let way = after - theta;
            let mut x = ((mark - theta) / way).clamp(0.0, 1.0);
            for _ in 0..3 {
                let (a, b) = (omega * dt_s - way, way - omega_after * dt_s);
                let value = theta + way * x + x * (1.0 - x) * (a * (1.0 - x) + b * x);
                let slope = way + (1.0 - 2.0 * x) * (a * (1.0 - x) + b * x) + x * (1.0 - x) * (b - a);
                x = (x + (mark - value) / slope).clamp(0.0, 1.0);
            }
            times_s.push(self.now_s() + x * dt_s);
        }
        self.steps += (dt_s * TICKS_PER_S as f64).round() as u64;
    }

    fn theta_rad(&self) -> f64 {
        self.plant.theta_rad()
    }

    fn rate_rad_s(&self) -> f64 {
        self.plant.rate_rad_s()
    }

    fn mean_current_A(&self) -> f64 {
        self.plant.mean_current_A()
    }

    fn supply_V(&self) -> f64 {
        self.plant.supply_V()
    }

    fn temp_C(&self) -> f64 {
        self.plant.temp_C()
    }

    fn true_theta_rad(&self) -> f64 {
        self.plant.true_theta_rad()
    }

    fn true_rate_rad_s(&self) -> f64 {
        self.plant.true_rate_rad_s()
    }
}

//! The running observer: updated once in a millisecond with the angle of the gyroscope, set up and read by the console at a lower priority.
//! Before an update the measurement's task awaits [`RunningObserver::released`], in case it has preempted an access of the console.
//!
//! At t_n the angle of t_n is known, and the moment that acts from t_n on was set a row before, so that the regulator's moment for x̂[n+1]
//! acts in time, at t_{n+1}. The observer knows the torquer's limit and steps. Feedback stays off until the estimates have settled and ends
//! with any fault. A start begins at the measured angle (docs/theory.md §1.5). Missed rows are predicted; after [`MAX_MISSED_ROWS`] the
//! observer restarts.

use super::parameters::{GAIN, GAMMA, MOMENT, REGULATOR, RESPONSE, SETTLE, TORQUER, VIBRATION};
use super::{Design, MAX_STATES, Motion, Observer, ObserverParameters, Regulator, Stability, Vibration, VibrationCorrection};
use crate::board::{Hardware, ROW_HZ, TICKS_PER_ROW, Ticks, TorquerStep};
use crate::config::{ConfigError, within};
use crate::gyro_loop::Settings;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::{Mutex, MutexGuard};

/// Most rows without an angle that are predicted.
pub const MAX_MISSED_ROWS: u32 = 10;
/// Why feedback is refused.
const UNSTABLE_LOOP: ConfigError =
    ConfigError::Unfit("regulator", "leaves a pole of the closed loop on or outside the unit circle: feedback would not be stable");
/// Range of the torquer's converter, ± steps.
const MAX_STEPS: f64 = 2047.0;

/// Phase of the observer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// Off.
    #[default]
    Off,
    /// Its poles are checked, a piece in each row.
    Checking,
    /// Waiting for an angle.
    Waiting,
    /// Settling: rows left.
    Settling(u32),
    /// Settled: the estimates are valid.
    Settled,
}

impl Phase {
    /// Its name in replies.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "OFF",
            Self::Checking => "CHECKING",
            Self::Waiting => "NO ANGLE",
            Self::Settling(_) => "SETTLING",
            Self::Settled => "SETTLED",
        }
    }
}

/// Estimates for one t_n.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObservedState {
    /// Azimuth, rad.
    pub alpha_rad: f32,
    /// Its rate, rad/s.
    pub alpha_rate_rad_s: f32,
    /// Rate of the tilt, rad/s.
    pub beta_rate_rad_s: f32,
    /// Disturbing moment, N m; `None` with a static observer.
    pub moment_N_m: Option<f32>,
}

/// Input of one row.
#[derive(Clone, Copy, Debug)]
pub struct ObserverInput {
    /// Time of the row.
    pub due: Ticks,
    /// Angle at that time, rad; `None` without a valid sample.
    pub angle_rad: Option<f64>,
    /// Roll at that time, rad, if there is a sensor.
    pub roll_rad: Option<f64>,
    /// Current limit of the torquer, A.
    pub limit_A: f64,
    /// A fault is latched.
    pub has_fault: bool,
}

struct RunningState {
    parameters: ObserverParameters,
    phase: Phase,
    stability: Option<Stability<MAX_STATES>>,
    /// The poles of the observer are checked.
    is_observer_checked: bool,
    /// The closed loop of plant and regulator: `None` until it is checked.
    is_loop_stable: Option<bool>,
    refused: Option<ConfigError>,
    /// Rows from the start until the estimates have settled.
    settling_rows: u32,
    gyro_settings: Settings,
    design: Option<Design<f64, MAX_STATES>>,
    observer: Observer<f64, MAX_STATES>,
    vibration: Option<Vibration>,
    innovation_rad: f64,
    feedback: bool,
    feed_forward: bool,
    /// The torquer's step since the last row.
    acting: TorquerStep,
    last: Option<Ticks>,
    missed_rows: u32,
}

type Locked<'a> = MutexGuard<'a, CriticalSectionRawMutex, RunningState>;

#[inline(never)]
fn unlock(state: Locked<'_>) {
    drop(state);
}

/// The observer with its settings.
pub struct RunningObserver {
    // Locked only within the functions of this file, which neither wait nor call each other while they hold it.
    state: Mutex<CriticalSectionRawMutex, RunningState>,
}

impl Default for RunningObserver {
    fn default() -> Self {
        Self {
            state: Mutex::new(RunningState {
                parameters: ObserverParameters::default(),
                phase: Phase::Off,
                stability: None,
                is_observer_checked: false,
                is_loop_stable: None,
                refused: None,
                settling_rows: 0,
                gyro_settings: Settings::default(),
                design: None,
                observer: Observer::at(0.0),
                vibration: None,
                innovation_rad: 0.0,
                feedback: false,
                feed_forward: false,
                acting: TorquerStep::default(),
                last: None,
                missed_rows: 0,
            }),
        }
    }
}

impl RunningObserver {
    /// Waits until no access of a lower priority is in progress: at most the time of one console command's access.
    pub async fn released(&self) {
        drop(self.state.lock().await);
    }

    fn with<T>(&self, action: impl FnOnce(&mut RunningState) -> T) -> Option<T> {
        let mut state = self.lock()?;
        let result = action(&mut state);
        unlock(state);
        Some(result)
    }

    // Not inlined, for the size of the image.
    #[inline(never)]
    fn lock(&self) -> Option<Locked<'_>> {
        self.state.try_lock().ok()
    }

    /// The parameters in force.
    pub fn parameters(&self) -> ObserverParameters {
        self.with(|state| state.parameters).unwrap_or_default()
    }

    /// Sets the parameters and switches the observer off.
    pub fn set_parameters(&self, parameters: &ObserverParameters) {
        self.with(|state| {
            state.stop();
            state.parameters = *parameters;
        });
    }

    /// Changes the parameters and switches the observer off.
    pub fn change(&self, change: impl FnOnce(&mut ObserverParameters)) {
        self.with(|state| {
            state.stop();
            change(&mut state.parameters);
        });
    }

    /// Settings of angle sensor and torquer.
    pub fn gyro_settings(&self) -> Settings {
        self.with(|state| state.gyro_settings).unwrap_or_default()
    }

    /// Other settings of angle sensor and torquer.
    pub fn set_gyro_settings(&self, settings: Settings) {
        self.with(|state| state.gyro_settings = settings);
    }

    /// Switches it on, after a check of its poles that takes 0.3 s.
    ///
    /// # Errors
    /// There are no parameters, or one is out of its range: its name.
    pub fn start(&self) -> Result<(), ConfigError> {
        self.with(RunningState::start).unwrap_or(Ok(()))
    }

    /// Switches it off, feedback included.
    pub fn stop(&self) {
        self.with(RunningState::stop);
    }

    /// Why the check of the poles failed, once.
    pub fn take_refused(&self) -> Option<ConfigError> {
        self.with(|state| state.refused.take()).flatten()
    }

    /// Feedback by the regulator, once the estimates have settled.
    ///
    /// # Errors
    /// The regulator would make the closed loop unstable.
    pub fn set_feedback(&self, on: bool) -> Result<(), ConfigError> {
        self.with(|state| {
            if on && state.is_loop_stable == Some(false) {
                return Err(UNSTABLE_LOOP);
            }
            state.feedback = on;
            Ok(())
        })
        .unwrap_or(Ok(()))
    }

    /// Ends the feedback.
    pub fn end_feedback(&self) {
        self.with(|state| state.feedback = false);
    }

    /// Feed-forward of the estimated moment.
    pub fn set_feed_forward(&self, on: bool) {
        self.with(|state| state.feed_forward = on);
    }

    /// Whether feedback is on, and whether feed-forward is.
    pub fn feedback_switches(&self) -> (bool, bool) {
        self.with(|state| (state.feedback, state.feed_forward)).unwrap_or_default()
    }

    /// Its phase.
    pub fn phase(&self) -> Phase {
        self.with(|state| state.phase).unwrap_or_default()
    }

    /// All estimates for the next row, the last innovation, rad, and the correction for vibration.
    pub fn estimates(&self) -> ([f64; MAX_STATES], f64, VibrationCorrection) {
        self.with(|state| {
            let correction = state.vibration.as_ref().map_or_else(VibrationCorrection::default, Vibration::newest);
            (*state.observer.estimate(), state.innovation_rad, correction)
        })
        .unwrap_or_default()
    }

    /// One row further: the estimates for this row, and the regulator's step from the next row on. `None` without estimates or without
    /// feedback.
    pub fn update(&self, input: &ObserverInput, hardware: &Hardware) -> (Option<ObservedState>, Option<TorquerStep>) {
        self.with(|state| state.update(input, hardware)).unwrap_or_default()
    }

    /// The torquer's actual step from the next row on.
    pub fn set_torquer(&self, step: TorquerStep) {
        self.with(|state| state.acting = step);
    }
}

impl RunningState {
    fn stop(&mut self) {
        self.phase = Phase::Off;
        self.feedback = false;
        self.stability = None;
        self.is_loop_stable = None;
    }

    fn start(&mut self) -> Result<(), ConfigError> {
        let parameters = &self.parameters;
        if parameters.states() == 0 {
            return Err(ConfigError::Unfit("observer", "has no parameters: `stand observer design --port` writes them"));
        }
        let (phi, gain) = (parameters.phi(), parameters.array(GAIN));
        within("settle_s", parameters.value(SETTLE), 0.0, 1e5)?;
        within("torquer_N_m_A", parameters.value(TORQUER), 1e-12, 1e6)?;
        Regulator::<f64, MAX_STATES>::new(&parameters.array(REGULATOR), 1.0)?;
        let design = Design::unchecked(&phi, &parameters.array(GAMMA), &gain)?;
        self.vibration = match parameters.get(VIBRATION) {
            [window_s, rate_gain_s, inertia_gain_s2] if *window_s > 0.0 => {
                let step_s = 1.0 / ROW_HZ as f64;
                let response = match parameters.get(RESPONSE) {
                    [a, b, c, d] => [*a, *b, *c, *d],
                    _ => [0.0; 4],
                };
                Some(Vibration::new(*window_s, step_s, *rate_gain_s, *inertia_gain_s2)?.with_response(response, step_s)?)
            }
            _ => None,
        };
        self.settling_rows = libm::ceil(parameters.value(SETTLE) * ROW_HZ as f64) as u32;
        self.design = Some(design);
        self.stability = Some(Stability::new(&phi, &gain));
        (self.is_observer_checked, self.is_loop_stable) = (false, None);
        self.phase = Phase::Checking;
        Ok(())
    }

    fn update(&mut self, input: &ObserverInput, hardware: &Hardware) -> (Option<ObservedState>, Option<TorquerStep>) {
        if input.has_fault {
            self.feedback = false;
        }
        let passed = self.last.replace(input.due).map_or(1, |last| (input.due - last).checked_div(TICKS_PER_ROW).unwrap_or(1));
        match self.phase {
            Phase::Off => return (None, None),
            Phase::Checking => {
                self.check();
                return (None, None);
            }
            _ => {}
        }
        let Some(design) = self.design else { return (None, None) };
        let moment_per_step = hardware.torquer_A_per_step * self.parameters.value(TORQUER);
        let acting_N_m = f64::from(self.acting.0) * moment_per_step;
        // Missed rows; the torquer kept its step.
        self.missed_rows = self.missed_rows.saturating_add(passed.saturating_sub(1) as u32);
        if self.missed_rows > MAX_MISSED_ROWS {
            self.missed_rows = 0;
            self.phase = Phase::Waiting;
        }
        if self.phase == Phase::Waiting {
            if let Some(angle_rad) = input.angle_rad {
                self.observer = Observer::at(angle_rad);
                self.phase = Phase::Settling(self.settling_rows);
                self.missed_rows = 0;
            } else {
                return (None, None);
            }
        }
        for _ in 1..passed.min(u64::from(MAX_MISSED_ROWS)) {
            self.observer.predict(&design, acting_N_m);
        }
        let observed = self.observed();
        match input.angle_rad {
            Some(angle_rad) => {
                self.missed_rows = 0;
                self.update_vibration(angle_rad, input.roll_rad);
                self.innovation_rad = self.observer.step(&design, angle_rad, acting_N_m);
                self.phase = match self.phase {
                    Phase::Settling(left) if left > 0 => Phase::Settling(left - 1),
                    _ => Phase::Settled,
                };
            }
            None => {
                self.missed_rows += 1;
                self.observer.predict(&design, acting_N_m);
            }
        }
        let has_feedback = self.feedback && self.phase == Phase::Settled;
        (Some(observed), has_feedback.then(|| self.feedback(input.limit_A, hardware, moment_per_step)))
    }

    /// A piece of the checks: first the poles of the observer, then those of plant and regulator.
    fn check(&mut self) {
        let Some(result) = self.stability.as_mut().and_then(Stability::step) else { return };
        match (result, self.is_observer_checked) {
            (Err(why), false) => {
                self.stop();
                self.refused = Some(why);
            }
            (Ok(()), false) => {
                self.is_observer_checked = true;
                let plant_states = self.parameters.states().saturating_sub(usize::from(self.parameters.value(MOMENT) != 0.0));
                let gains = self.parameters.array(REGULATOR);
                self.stability = gains
                    .iter()
                    .take(plant_states)
                    .any(|gain| *gain != 0.0)
                    .then(|| Stability::of_loop(&self.parameters.phi(), &self.parameters.array(GAMMA), &gains, plant_states));
                if self.stability.is_none() {
                    self.finish_check(true);
                }
            }
            (result, true) => self.finish_check(result.is_ok()),
        }
    }

    fn finish_check(&mut self, is_loop_stable: bool) {
        self.is_loop_stable = Some(is_loop_stable);
        self.phase = Phase::Waiting;
        if self.feedback && !is_loop_stable {
            self.feedback = false;
            self.refused = Some(UNSTABLE_LOOP);
        }
    }

    fn observed(&self) -> ObservedState {
        let [alpha, alpha_rate, _, beta_rate, ..] = *self.observer.estimate();
        let has_moment = self.parameters.value(MOMENT) != 0.0;
        let moment = self.observer.estimate().get(self.parameters.states().saturating_sub(1)).filter(|_| has_moment);
        ObservedState {
            alpha_rad: alpha as f32,
            alpha_rate_rad_s: alpha_rate as f32,
            beta_rate_rad_s: beta_rate as f32,
            moment_N_m: moment.map(|moment| *moment as f32),
        }
    }

    fn update_vibration(&mut self, alpha_rad: f64, roll_rad: Option<f64>) {
        let settled = self.phase == Phase::Settled;
        if let (Some(vibration), Some(gamma_rad), true) = (&mut self.vibration, roll_rad, settled) {
            let [_, alpha_rate_rad_s, _, beta_rate_rad_s, ..] = *self.observer.estimate();
            vibration.update(Motion { alpha_rad, alpha_rate_rad_s, beta_rate_rad_s, gamma_rad });
        }
    }

    fn feedback(&self, limit_A: f64, hardware: &Hardware, moment_per_step: f64) -> TorquerStep {
        let mut gains = self.parameters.array(REGULATOR);
        if !self.feed_forward
            && self.parameters.value(MOMENT) != 0.0
            && let Some(forward) = gains.get_mut(self.parameters.states().saturating_sub(1))
        {
            *forward = 0.0;
        }
        let max_steps = f64::min(limit_A / hardware.torquer_A_per_step, MAX_STEPS);
        let moment =
            Regulator::new(&gains, max_steps * moment_per_step).map_or(0.0, |regulator| regulator.moment(self.observer.estimate()));
        TorquerStep(libm::round(moment / moment_per_step) as i32 as i16)
    }
}

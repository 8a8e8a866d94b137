//! The observer at work: the measurement loop steps it on the gyro's angle, the console sets it up and asks.
//!
//! At t_n the angle of t_n is there, and the moment that is in force from t_n on was given a row before. So what the regulator makes of x̂[n+1] acts
//! on time, at t_{n+1}. The torquer's limit and steps are known to the observer. Feedback stays off until the estimates have settled, and ends with
//! any fault; a restart begins at the angle that is seen (theory §1.5). A row that was missed is predicted; after [`MOST_MISSED`] it begins anew.

use super::numbers::{GAIN, GAMMA, MOMENT, REGULATOR, SETTLE, TORQUER, VIBRATION};
use super::{Corrected, Design, MOST_STATES, Motion, Numbers, Observer, Regulator, Stability, Vibration};
use crate::board::{Hardware, ROW_HZ, TICKS_PER_ROW, Ticks, TorquerStep};
use crate::config::{ConfigError, within};
use crate::gyro_loop;
use core::cell::RefCell;

/// Rows without an angle that are predicted.
pub const MOST_MISSED: u32 = 10;
/// Most steps of the torquer's converter, either way.
const MOST_STEPS: f64 = 2047.0;

/// Where the observer is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// Off.
    #[default]
    Off,
    /// Its poles are looked at, a piece each row.
    Checking,
    /// It waits for an angle.
    Waiting,
    /// So many rows until it has settled.
    Settling(u32),
    /// The estimates hold.
    Settled,
}

impl Phase {
    /// In a word.
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

/// What it says of one t_n.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observed {
    /// Estimated azimuth, rad.
    pub alpha_rad: f32,
    /// Its rate, rad/s.
    pub alpha_rate_rad_s: f32,
    /// Rate of the tilt, rad/s.
    pub beta_rate_rad_s: f32,
    /// Moment from outside, N m; `None` of a static observer.
    pub moment_N_m: Option<f32>,
}

/// What a row brings.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The row's time.
    pub due: Ticks,
    /// The angle at that time, rad; `None` where it was not sampled.
    pub angle_rad: Option<f64>,
    /// The roll at that time, rad, where there is a sensor of it.
    pub roll_rad: Option<f64>,
    /// Greatest current of the torquer, A.
    pub limit_A: f64,
    /// A fault is latched.
    pub faulty: bool,
}

struct All {
    numbers: Numbers,
    phase: Phase,
    stability: Option<Stability<MOST_STATES>>,
    refused: Option<ConfigError>,
    /// Rows until it has settled, from the beginning.
    settling: u32,
    gains: gyro_loop::Settings,
    design: Option<Design<f64, MOST_STATES>>,
    observer: Observer<f64, MOST_STATES>,
    vibration: Option<Vibration>,
    corrected: Corrected,
    innovation_rad: f64,
    feedback: bool,
    feed_forward: bool,
    /// The step in force since the last row's time.
    acting: TorquerStep,
    last: Option<Ticks>,
    missed: u32,
}

/// The observer and what is said to it.
pub struct Shared {
    // Borrowed only within the functions of this file, which call nothing that borrows it.
    all: RefCell<All>,
}

impl Default for Shared {
    fn default() -> Self {
        Self {
            all: RefCell::new(All {
                numbers: Numbers::default(),
                phase: Phase::Off,
                stability: None,
                refused: None,
                settling: 0,
                gains: gyro_loop::Settings::default(),
                design: None,
                observer: Observer::at(0.0),
                vibration: None,
                corrected: Corrected::default(),
                innovation_rad: 0.0,
                feedback: false,
                feed_forward: false,
                acting: TorquerStep::default(),
                last: None,
                missed: 0,
            }),
        }
    }
}

impl Shared {
    fn with<T>(&self, does: impl FnOnce(&mut All) -> T) -> Option<T> {
        self.all.try_borrow_mut().ok().map(|mut all| does(&mut all))
    }

    /// The numbers in force.
    pub fn numbers(&self) -> Numbers {
        self.with(|all| all.numbers).unwrap_or_default()
    }

    /// Other numbers; the observer is off then.
    pub fn set(&self, numbers: &Numbers) {
        self.with(|all| {
            all.off();
            all.numbers = *numbers;
        });
    }

    /// Changes the numbers; the observer is off then.
    pub fn change(&self, change: impl FnOnce(&mut Numbers)) {
        self.with(|all| {
            all.off();
            change(&mut all.numbers);
        });
    }

    /// The angle sensor's gain and the torquer's limits.
    pub fn gains(&self) -> gyro_loop::Settings {
        self.with(|all| all.gains).unwrap_or_default()
    }

    /// Other ones.
    pub fn scale(&self, gains: gyro_loop::Settings) {
        self.with(|all| all.gains = gains);
    }

    /// Switches it on: its poles are checked first, which takes 0.3 s.
    ///
    /// # Errors
    /// There are no numbers, or one makes no sense: which, by name.
    pub fn begin(&self) -> Result<(), ConfigError> {
        self.with(All::begin).unwrap_or(Ok(()))
    }

    /// Switches it off, feedback too.
    pub fn end(&self) {
        self.with(All::off);
    }

    /// Why the check has refused it, once.
    pub fn take_refused(&self) -> Option<ConfigError> {
        self.with(|all| all.refused.take()).flatten()
    }

    /// Feedback by the regulator, as soon as it has settled.
    pub fn feed_back(&self, on: bool) {
        self.with(|all| all.feedback = on);
    }

    /// The estimated moment is fed forward.
    pub fn feed_forward(&self, on: bool) {
        self.with(|all| all.feed_forward = on);
    }

    /// Whether feedback is asked for, and feed-forward.
    pub fn feeds(&self) -> (bool, bool) {
        self.with(|all| (all.feedback, all.feed_forward)).unwrap_or_default()
    }

    /// Where it is.
    pub fn phase(&self) -> Phase {
        self.with(|all| all.phase).unwrap_or_default()
    }

    /// All estimates for the row to come, the last innovation, rad, and the vibration's means.
    pub fn estimates(&self) -> ([f64; MOST_STATES], f64, Corrected) {
        self.with(|all| (*all.observer.estimate(), all.innovation_rad, all.corrected)).unwrap_or_default()
    }

    /// A row: what was estimated for it, and what the torquer is given from the next row on; `None` for either where there is no such thing.
    #[inline(never)]
    pub fn step(&self, seen: &Seen, hardware: &Hardware) -> (Option<Observed>, Option<TorquerStep>) {
        self.with(|all| all.step(seen, hardware)).unwrap_or_default()
    }

    /// What the torquer is really given from the next row on.
    pub fn given(&self, step: TorquerStep) {
        self.with(|all| all.acting = step);
    }
}

impl All {
    fn off(&mut self) {
        self.phase = Phase::Off;
        self.feedback = false;
        self.stability = None;
    }

    fn begin(&mut self) -> Result<(), ConfigError> {
        let n = &self.numbers;
        if n.states() == 0 {
            return Err(ConfigError::Unfit("observer", "has no numbers: `stand observer design --port` writes them"));
        }
        let (phi, gain) = (n.phi(), n.array(GAIN));
        within("settle_s", n.one(SETTLE), 0.0, 1e5)?;
        within("torquer_N_m_A", n.one(TORQUER), 1e-12, 1e6)?;
        Regulator::<f64, MOST_STATES>::new(&n.array(REGULATOR), 1.0)?;
        let design = Design::unproved(&phi, &n.array(GAMMA), &gain)?;
        self.vibration = match n.of(VIBRATION) {
            [window_s, rate_gain_s, inertia_gain_s2] if *window_s > 0.0 => {
                Some(Vibration::new(*window_s, 1.0 / ROW_HZ as f64, *rate_gain_s, *inertia_gain_s2)?)
            }
            _ => None,
        };
        self.corrected = Corrected::default();
        self.settling = libm::ceil(n.one(SETTLE) * ROW_HZ as f64) as u32;
        self.design = Some(design);
        self.stability = Some(Stability::new(&phi, &gain));
        self.phase = Phase::Checking;
        Ok(())
    }

    fn step(&mut self, seen: &Seen, hardware: &Hardware) -> (Option<Observed>, Option<TorquerStep>) {
        if seen.faulty {
            self.feedback = false;
        }
        let passed = self.last.replace(seen.due).map_or(1, |last| (seen.due - last).checked_div(TICKS_PER_ROW).unwrap_or(1));
        match self.phase {
            Phase::Off => return (None, None),
            Phase::Checking => {
                match self.stability.as_mut().and_then(Stability::work) {
                    Some(Ok(())) => self.phase = Phase::Waiting,
                    Some(Err(why)) => {
                        self.off();
                        self.refused = Some(why);
                    }
                    None => {}
                }
                return (None, None);
            }
            _ => {}
        }
        let Some(design) = self.design else { return (None, None) };
        let moment_per_step = hardware.torquer_A_per_step * self.numbers.one(TORQUER);
        let acting_N_m = f64::from(self.acting.0) * moment_per_step;
        // Rows that were missed whole; what was in force stayed so.
        self.missed = self.missed.saturating_add(passed.saturating_sub(1) as u32);
        if self.missed > MOST_MISSED {
            self.missed = 0;
            self.phase = Phase::Waiting;
        }
        if self.phase == Phase::Waiting {
            if let Some(angle_rad) = seen.angle_rad {
                self.observer = Observer::at(angle_rad);
                self.phase = Phase::Settling(self.settling);
                self.missed = 0;
            } else {
                return (None, None);
            }
        }
        for _ in 1..passed.min(u64::from(MOST_MISSED)) {
            self.observer.predict(&design, acting_N_m);
        }
        let observed = self.observed();
        match seen.angle_rad {
            Some(angle_rad) => {
                self.missed = 0;
                self.vibrate(angle_rad, seen.roll_rad);
                self.innovation_rad = self.observer.step(&design, angle_rad, acting_N_m);
                self.phase = match self.phase {
                    Phase::Settling(left) if left > 0 => Phase::Settling(left - 1),
                    _ => Phase::Settled,
                };
            }
            None => {
                self.missed += 1;
                self.observer.predict(&design, acting_N_m);
            }
        }
        let feeds = self.feedback && self.phase == Phase::Settled;
        (Some(observed), feeds.then(|| self.feedback(seen.limit_A, hardware, moment_per_step)))
    }

    fn observed(&self) -> Observed {
        let [alpha, alpha_rate, _, beta_rate, ..] = *self.observer.estimate();
        let has_moment = self.numbers.one(MOMENT) != 0.0;
        let moment = self.observer.estimate().get(self.numbers.states().saturating_sub(1)).filter(|_| has_moment);
        Observed {
            alpha_rad: alpha as f32,
            alpha_rate_rad_s: alpha_rate as f32,
            beta_rate_rad_s: beta_rate as f32,
            moment_N_m: moment.map(|moment| *moment as f32),
        }
    }

    fn vibrate(&mut self, alpha_rad: f64, roll_rad: Option<f64>) {
        let settled = self.phase == Phase::Settled;
        if let (Some(vibration), Some(gamma_rad), true) = (&mut self.vibration, roll_rad, settled) {
            let [_, alpha_rate_rad_s, _, beta_rate_rad_s, ..] = *self.observer.estimate();
            self.corrected = vibration.take(Motion { alpha_rad, alpha_rate_rad_s, beta_rate_rad_s, gamma_rad });
        }
    }

    fn feedback(&self, limit_A: f64, hardware: &Hardware, moment_per_step: f64) -> TorquerStep {
        let mut gains = self.numbers.array(REGULATOR);
        if !self.feed_forward
            && self.numbers.one(MOMENT) != 0.0
            && let Some(forward) = gains.get_mut(self.numbers.states().saturating_sub(1))
        {
            *forward = 0.0;
        }
        let most = limit_A / hardware.torquer_A_per_step;
        let most = if most < MOST_STEPS { most } else { MOST_STEPS };
        let moment = Regulator::new(&gains, most * moment_per_step).map_or(0.0, |regulator| regulator.moment(self.observer.estimate()));
        TorquerStep(libm::round(moment / moment_per_step) as i32 as i16)
    }
}

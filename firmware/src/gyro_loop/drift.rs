//! Drift measurement: a session of cycles with its results. The measurement's task updates it, the console controls and reads it at a lower
//! priority. Before an update the measurement's task awaits [`DriftMeasurement::released`], in case it has preempted an access of the
//! console.

use super::{Commutator, Cycle, Drift, DriftMean, Pair, Phase, Plan, Polarity, Register, Rejection, Scales, Sums};
use crate::board::{GyroSample, Stamped, Ticks, TorquerStep};
use crate::config::ConfigError;
use crate::status::Fault;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::{Mutex, MutexGuard};

/// The commutator and the results of its cycles.
pub struct DriftMeasurement {
    // Locked only within the functions of this file, which neither wait nor call each other while they hold it.
    state: Mutex<CriticalSectionRawMutex, MeasurementState>,
    running: AtomicBool,
}

type Locked<'a> = MutexGuard<'a, CriticalSectionRawMutex, MeasurementState>;

struct MeasurementState {
    commutator: Commutator,
    /// Scales for the next session.
    scales: Scales,
    newest: Option<Cycle>,
    mean: DriftMean,
    register: Register,
    /// The zero-input cycle: its samples and sums.
    zero_input: Option<(u32, Sums)>,
}

impl MeasurementState {
    fn add(&mut self, cycle: Cycle) {
        self.newest = Some(cycle);
        if cycle.polarity == Polarity::Zero {
            if cycle.rejection == Rejection::None {
                self.zero_input = Some((cycle.samples, cycle.sums));
            }
            return;
        }
        let zero_input = self.zero_input_of(&cycle);
        self.mean.add(&cycle, cycle.rate_rad_s(self.commutator.scales(), zero_input.as_ref()));
        self.register.add(&cycle, zero_input.map_or(0, |sums| sums.acc2));
    }

    /// The zero-input sums that are subtracted from this cycle.
    fn zero_input_of(&self, cycle: &Cycle) -> Option<Sums> {
        self.zero_input.filter(|(samples, _)| *samples == cycle.samples && cycle.polarity != Polarity::Zero).map(|(_, sums)| sums)
    }
}

impl DriftMeasurement {
    /// No session; the correction loop is closed.
    pub fn new(scales: Scales) -> Self {
        let state = MeasurementState {
            commutator: Commutator::new(scales),
            scales,
            newest: None,
            mean: DriftMean::default(),
            register: Register::default(),
            zero_input: None,
        };
        Self { state: Mutex::new(state), running: AtomicBool::new(false) }
    }

    /// Waits until no access of a lower priority is in progress: at most the time of one console command's access.
    pub async fn released(&self) {
        drop(self.state.lock().await);
    }

    fn with<T>(&self, action: impl FnOnce(&mut MeasurementState) -> T) -> Option<T> {
        let mut state = self.lock()?;
        let result = action(&mut state);
        self.unlock(state);
        Some(result)
    }

    // Not inlined, for the size of the image.
    #[inline(never)]
    fn lock(&self) -> Option<Locked<'_>> {
        self.state.try_lock().ok()
    }

    #[inline(never)]
    fn unlock(&self, state: Locked<'_>) {
        self.running.store(state.commutator.phase() != Phase::Idle, Ordering::Relaxed);
        drop(state);
    }

    /// The next sample: [`Commutator::update`]. Keeps the results of a finished cycle.
    pub fn update(&self, sample: Option<Stamped<GyroSample>>, at: Ticks, fault: Fault) -> TorquerStep {
        let step = self.with(|state| {
            state.commutator.set_scales(state.scales);
            let (step, finished) = state.commutator.update(sample, at, fault);
            if let Some(cycle) = finished {
                state.add(cycle);
            }
            step
        });
        step.unwrap_or_default()
    }

    /// Starts a session. `zero_input`: one cycle without pulses, which is then subtracted from all others.
    pub fn start(&self, plan: Plan, zero_input: bool) {
        self.with(|state| {
            if !zero_input {
                state.mean = DriftMean::default();
            }
            state.commutator.start(plan, zero_input);
        });
    }

    /// Ends the session.
    pub fn abort(&self) {
        self.with(|state| state.commutator.abort());
    }

    /// Whether a session runs.
    pub fn is_running(&self) -> bool {
        self.running.load(Ordering::Relaxed)
    }

    /// Phase of the session.
    pub fn phase(&self) -> Phase {
        self.with(|state| state.commutator.phase()).unwrap_or_default()
    }

    /// Finished cycles, and the number of cycles.
    pub fn progress(&self) -> (u32, u32) {
        self.with(|state| state.commutator.progress()).unwrap_or_default()
    }

    /// Phase for a log: [`Commutator::mark`].
    pub fn mark(&self) -> u32 {
        self.with(|state| state.commutator.mark()).unwrap_or_default()
    }

    /// Checks a plan with the scales in force.
    ///
    /// # Errors
    /// As [`Plan::pulse`].
    pub fn check(&self, plan: &Plan) -> Result<(), ConfigError> {
        self.with(|state| plan.pulse(0, state.commutator.scales()).map(drop)).unwrap_or(Ok(()))
    }

    /// Other scales, from the next session on.
    pub fn set_scales(&self, scales: Scales) {
        self.with(|state| state.scales = scales);
    }

    /// The newest cycle and its drift rates by (13), without and with the correction by the current, rad/s.
    pub fn newest(&self) -> Option<(Cycle, f32, f32)> {
        self.with(|state| {
            let cycle = state.newest?;
            let (scales, zero_input) = (state.commutator.scales(), state.zero_input_of(&cycle));
            Some((cycle, cycle.raw_rad_s(scales, zero_input.as_ref()), cycle.rate_rad_s(scales, zero_input.as_ref())))
        })
        .flatten()
    }

    /// Accepted cycles, rejected cycles, and the mean drift of the session.
    pub fn drift(&self) -> (u32, u32, Option<Drift>) {
        self.with(|state| (state.mean.accepted(), state.mean.rejected, state.mean.drift())).unwrap_or_default()
    }

    /// The register over the pair of positions, and its drift rate, rad/s.
    pub fn register(&self) -> (Register, Option<f32>) {
        self.with(|state| (state.register, state.register.rate_rad_s(state.commutator.scales()))).unwrap_or_default()
    }

    /// Zeroes the register for this quantity.
    pub fn reset_register(&self, pair: Pair) {
        self.with(|state| state.register = Register::new(pair));
    }

    /// The zero-input cycle: its samples and sums.
    pub fn zero_input(&self) -> Option<(u32, Sums)> {
        self.with(|state| state.zero_input).flatten()
    }

    /// Deletes the zero-input cycle.
    pub fn clear_zero_input(&self) {
        self.with(|state| state.zero_input = None);
    }
}

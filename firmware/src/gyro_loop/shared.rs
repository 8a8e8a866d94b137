//! What the measurement loop, which steps the commutator, and the console say to each other, on one thread.

use super::{Bad, Commutator, Cycle, Drift, Pair, Phase, Plan, Polarity, Register, Scales, Sums, Tally};
use crate::board::{GyroSample, Stamped, Ticks, TorquerStep};
use crate::config::ConfigError;
use crate::status::Fault;
use core::cell::{Cell, RefCell};

/// The commutator and what came of its cycles.
pub struct Shared {
    // Borrowed only within the functions of this file, which call nothing that borrows it.
    all: RefCell<All>,
    running: Cell<bool>,
}

struct All {
    commutator: Commutator,
    /// Others, as soon as no session runs.
    scales: Scales,
    newest: Option<Cycle>,
    tally: Tally,
    register: Register,
    /// The zero-input cycle: its samples and sums.
    null: Option<(u32, Sums)>,
}

impl All {
    #[inline(never)]
    fn take(&mut self, cycle: Cycle) {
        self.newest = Some(cycle);
        if cycle.polarity == Polarity::Zero {
            if cycle.bad == Bad::No {
                self.null = Some((cycle.samples, cycle.sums));
            }
            return;
        }
        let null = self.null_of(&cycle);
        self.tally.take(&cycle, cycle.rate_rad_s(self.commutator.scales(), null.as_ref()));
        self.register.take(&cycle, null.map_or(0, |null| null.acc2));
    }

    /// What is taken off this cycle.
    fn null_of(&self, cycle: &Cycle) -> Option<Sums> {
        self.null.filter(|(of, _)| *of == cycle.samples && cycle.polarity != Polarity::Zero).map(|(_, sums)| sums)
    }
}

impl Shared {
    /// Nothing runs, the loop is closed.
    pub fn new(scales: Scales) -> Self {
        let (commutator, newest, tally, register, null) = (Commutator::new(scales), None, Tally::default(), Register::default(), None);
        Self { all: RefCell::new(All { commutator, scales, newest, tally, register, null }), running: Cell::new(false) }
    }

    fn with<T>(&self, does: impl FnOnce(&mut All) -> T) -> Option<T> {
        let done = self.all.try_borrow_mut().ok().map(|mut all| (does(&mut all), all.commutator.phase() != Phase::Idle));
        done.map(|(done, running)| (self.running.set(running), done).1)
    }

    /// One sample further: [`Commutator::step`]; what comes of a cycle is kept here.
    #[inline(never)]
    pub fn step(&self, sample: Option<Stamped<GyroSample>>, at: Ticks, fault: Fault) -> TorquerStep {
        let step = self.with(|all| {
            all.commutator.scale(all.scales);
            let (step, over) = all.commutator.step(sample, at, fault);
            if let Some(cycle) = over {
                all.take(cycle);
            }
            step
        });
        step.unwrap_or_default()
    }

    /// Begins a session; `nulls`: one cycle without pulses, to be taken off the others.
    pub fn start(&self, plan: Plan, nulls: bool) {
        self.with(|all| {
            if !nulls {
                all.tally = Tally::default();
            }
            all.commutator.start(plan, nulls);
        });
    }

    /// Ends the session.
    pub fn abort(&self) {
        self.with(|all| all.commutator.abort());
    }

    /// Whether a session runs.
    pub fn is_running(&self) -> bool {
        self.running.get()
    }

    /// Where it is.
    pub fn phase(&self) -> Phase {
        self.with(|all| all.commutator.phase()).unwrap_or_default()
    }

    /// Cycles that are over, of how many.
    pub fn progress(&self) -> (u32, u32) {
        self.with(|all| all.commutator.progress()).unwrap_or_default()
    }

    /// What a log carries of it: [`Commutator::mark`].
    pub fn mark(&self) -> u32 {
        self.with(|all| all.commutator.mark()).unwrap_or_default()
    }

    /// The session that is asked for, with the scales in force.
    ///
    /// # Errors
    /// As [`Plan::pulse`].
    pub fn check(&self, plan: &Plan) -> Result<(), ConfigError> {
        self.with(|all| plan.pulse(0, all.commutator.scales()).map(drop)).unwrap_or(Ok(()))
    }

    /// Other scales, as soon as no session runs.
    pub fn scale(&self, scales: Scales) {
        self.with(|all| all.scales = scales);
    }

    /// The newest cycle, and its drift rates: (13) as it is, and without the current's residual, rad/s.
    pub fn newest(&self) -> Option<(Cycle, f32, f32)> {
        self.with(|all| {
            let cycle = all.newest?;
            let (scales, null) = (all.commutator.scales(), all.null_of(&cycle));
            Some((cycle, cycle.raw_rad_s(scales, null.as_ref()), cycle.rate_rad_s(scales, null.as_ref())))
        })
        .flatten()
    }

    /// Good cycles, bad ones, and the mean of the session.
    pub fn drift(&self) -> (u32, u32, Option<Drift>) {
        self.with(|all| (all.tally.good(), all.tally.bad, all.tally.drift())).unwrap_or_default()
    }

    /// The register over the pair of positions, and the rate that it holds, rad/s.
    pub fn register(&self) -> (Register, Option<f32>) {
        self.with(|all| (all.register, all.register.rate_rad_s(all.commutator.scales()))).unwrap_or_default()
    }

    /// Zeroes the register, to hold this.
    pub fn hold(&self, pair: Pair) {
        self.with(|all| all.register = Register::new(pair));
    }

    /// The zero-input cycle: its samples and sums.
    pub fn null(&self) -> Option<(u32, Sums)> {
        self.with(|all| all.null).flatten()
    }

    /// Forgets it.
    pub fn forget_null(&self) {
        self.with(|all| all.null = None);
    }
}

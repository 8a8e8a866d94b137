//! What the sensor's task and everybody else say to each other, on one thread.

use super::{InForce, Motion, SelfTest, Setup, Trouble};
use crate::board::Stamped;
use core::cell::Cell;

/// What the task is at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// It looks for the chip and sets it up.
    #[default]
    Starting,
    /// There is no sensor to be had; it tries again each half second.
    Failed(Trouble),
    /// Samples come.
    Running,
    /// The chip tests itself; no samples come meanwhile.
    Testing,
}

/// How it goes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Status {
    /// What the task is at.
    pub state: State,
    /// The part's name.
    pub name: &'static str,
    /// Its set-up, as it was read back; `None` before that.
    pub in_force: Option<InForce>,
    /// Samples since power-on.
    pub samples: u32,
    /// Samples lost: overwritten in the chip, or incomplete.
    pub lost: u32,
    /// Words that were refused.
    pub refused: u32,
    /// Troubles since power-on, and the last.
    pub troubles: u32,
    /// The last of them.
    pub last_trouble: Option<Trouble>,
    /// The chip's temperature, °C.
    pub temperature_C: Option<f32>,
    /// How fast the chip's oscillator runs, as a part of what it should.
    pub relative_pace: f64,
    /// The longest that a reading of the FIFO took, s.
    pub longest_reading_s: f64,
}

/// What is shared.
#[derive(Debug, Default)]
pub struct Shared {
    newest: Cell<Option<Stamped<Motion>>>,
    status: Cell<Status>,
    test_wanted: Cell<bool>,
    tested: Cell<Option<Result<SelfTest, Trouble>>>,
    setup_wanted: Cell<Option<Setup>>,
}

impl Shared {
    /// The newest sample; `None` unless samples come.
    pub fn newest(&self) -> Option<Stamped<Motion>> {
        self.newest.get()
    }

    /// How it goes.
    pub fn status(&self) -> Status {
        self.status.get()
    }

    /// Asks for a self-test; the platform must be at rest. The answer comes in [`Shared::tested`] within a second, if the sensor runs.
    pub fn ask_self_test(&self) {
        self.tested.set(None);
        self.test_wanted.set(true);
    }

    /// What the last self-test that was asked for said; `None` while it is to come.
    pub fn tested(&self) -> Option<Result<SelfTest, Trouble>> {
        self.tested.get()
    }

    /// Asks for another set-up; [`Status::in_force`] says what was made of it.
    pub fn ask_setup(&self, setup: Setup) {
        self.setup_wanted.set(Some(setup));
    }

    pub(super) fn post(&self, newest: Option<Stamped<Motion>>) {
        self.newest.set(newest);
    }

    pub(super) fn change(&self, change: impl FnOnce(&mut Status)) {
        let mut status = self.status.get();
        change(&mut status);
        self.status.set(status);
    }

    pub(super) fn setup_or_test_wanted(&self) -> bool {
        self.test_wanted.get() || self.setup_wanted.get().is_some()
    }

    pub(super) fn take_test(&self) -> bool {
        self.test_wanted.take()
    }

    pub(super) fn answer_test(&self, outcome: Result<SelfTest, Trouble>) {
        self.tested.set(Some(outcome));
    }

    pub(super) fn take_setup(&self) -> Option<Setup> {
        self.setup_wanted.take()
    }
}

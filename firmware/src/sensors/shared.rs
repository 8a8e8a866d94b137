//! Interface between the task of the sensor under test, the measurement loop and the console, which runs at a lower priority.
//! The task alone writes sample and status.

use super::{InForce, Motion, SelfTest, SensorError, Setup};
use crate::board::Stamped;
use crate::mailbox::SharedCell;

/// State of the task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// The task detects and configures the chip.
    #[default]
    Starting,
    /// An error occurred; the task tries again every half second.
    Failed(SensorError),
    /// The task receives samples.
    Running,
    /// The self-test runs; there are no samples meanwhile.
    Testing,
}

/// Status of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status {
    /// State of the task.
    pub state: State,
    /// Name of the part.
    pub name: &'static str,
    /// Set-up read back from the chip; `None` before the first read-back.
    pub in_force: Option<InForce>,
    /// Samples since power-on.
    pub samples: u32,
    /// Samples lost: overwritten in the chip, or incomplete.
    pub lost: u32,
    /// FIFO words refused for an unknown tag or a wrong parity.
    pub refused: u32,
    /// Errors since power-on.
    pub errors: u32,
    /// The last error.
    pub last_error: Option<SensorError>,
    /// Temperature of the chip, °C.
    pub temperature_C: Option<f32>,
    /// Frequency of the chip's oscillator, relative to its nominal frequency; 1 before it was measured.
    pub relative_frequency: f64,
    /// Longest duration of a FIFO read, s.
    pub longest_read_s: f64,
}

impl Default for Status {
    fn default() -> Self {
        Self {
            state: State::default(),
            name: "",
            in_force: None,
            samples: 0,
            lost: 0,
            refused: 0,
            errors: 0,
            last_error: None,
            temperature_C: None,
            relative_frequency: 1.0,
            longest_read_s: 0.0,
        }
    }
}

/// State and requests shared by the tasks.
#[derive(Debug, Default)]
pub struct Shared {
    newest: SharedCell<Option<Stamped<Motion>>>,
    status: SharedCell<Status>,
    self_test_requested: SharedCell<bool>,
    self_test: SharedCell<Option<Result<SelfTest, SensorError>>>,
    setup_requested: SharedCell<Option<Setup>>,
}

impl Shared {
    /// The newest sample; `None` while the sensor does not run.
    pub fn newest(&self) -> Option<Stamped<Motion>> {
        self.newest.get()
    }

    /// Status of the sensor.
    pub fn status(&self) -> Status {
        self.status.get()
    }

    /// Requests a self-test; the platform must be at rest. [`Shared::self_test_result`] holds the result within a
    /// second, if the sensor runs.
    pub fn request_self_test(&self) {
        self.self_test.set(None);
        self.self_test_requested.set(true);
    }

    /// Result of the last requested self-test; `None` before it is available.
    pub fn self_test_result(&self) -> Option<Result<SelfTest, SensorError>> {
        self.self_test.get()
    }

    /// Requests a set-up; [`Status::in_force`] then holds the set-up read back.
    pub fn request_setup(&self, setup: Setup) {
        self.setup_requested.set(Some(setup));
    }

    /// Replaces the newest sample; `None` when the sensor stops.
    pub(super) fn post(&self, newest: Option<Stamped<Motion>>) {
        self.newest.set(newest);
    }

    pub(super) fn change(&self, change: impl FnOnce(&mut Status)) {
        let mut status = self.status.get();
        change(&mut status);
        self.status.set(status);
    }

    pub(super) fn has_request(&self) -> bool {
        self.self_test_requested.get() || self.setup_requested.get().is_some()
    }

    pub(super) fn take_self_test_request(&self) -> bool {
        self.self_test_requested.take()
    }

    pub(super) fn finish_self_test(&self, outcome: Result<SelfTest, SensorError>) {
        self.self_test.set(Some(outcome));
    }

    pub(super) fn take_setup_request(&self) -> Option<Setup> {
        self.setup_requested.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use critical_section as _;

    #[test]
    fn the_oscillator_has_no_error_before_it_was_measured() {
        assert_eq!(Shared::default().status().relative_frequency, 1.0);
    }

    #[test]
    fn what_a_critical_section_copies_is_at_most_a_quarter_kilobyte() {
        // 64 words: with load and store of several registers 100 to 200 cycles, below 2 us at 180 MHz.
        for bytes in [size_of::<Status>(), size_of::<Option<Stamped<Motion>>>(), size_of::<Option<Result<SelfTest, SensorError>>>()] {
            assert!(bytes <= 256, "{bytes}");
        }
    }
}

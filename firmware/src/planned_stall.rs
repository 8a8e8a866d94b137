//! Permission to stall the core: the erase of a flash sector stops all code for up to 0.5 s (RM0390 §3.4; DS10693 table 48).
//!
//! A task requests; the control interrupt grants once the bridge is off and the platform is slow, by its own output and measurement, not by the
//! command. From the grant to the end it keeps the bridge off, and lost ticks are not a fault of the clock. Without a grant the task withdraws and
//! reports the reason.

use core::sync::atomic::{AtomicU8, Ordering};

/// Rate up to which a stall is permitted, rad/s. One encoder count moves the rate estimate by 0.24 rad/s, so that a platform at rest stays
/// below; in 0.5 s at this rate the platform turns by 14°, far below the half wrap of the counter (295°).
pub const MAX_RATE_RAD_S: f64 = 0.5;
/// Ticks with the bridge off before a grant: the output of the first one acts from the second on.
const OFF_TICKS: u8 = 3;

const NONE: u8 = 0;
const REQUESTED: u8 = 1;
const GRANTED: u8 = 2;
/// The task has ended the stall; the interrupt has not seen it yet.
const ENDED: u8 = 3;

const NO_ANSWER: u8 = 0;
const DRIVEN: u8 = 1;
const TURNING: u8 = 2;

/// Why a stall is not granted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StallRefusal {
    /// The interrupt has not answered.
    NoAnswer,
    /// The bridge drives the motor.
    Driven,
    /// The platform turns.
    Turning,
}

impl StallRefusal {
    /// The cause and what to do.
    pub fn message(self) -> &'static str {
        match self {
            Self::NoAnswer => "the control interrupt does not answer",
            Self::Driven => "the drive is on: OUTPut OFF first",
            Self::Turning => "the platform turns: wait until it is at rest",
        }
    }
}

/// The exchange between the task and the interrupt.
#[derive(Debug, Default)]
pub struct PlannedStall {
    state: AtomicU8,
    /// Why the last tick did not grant.
    refusal: AtomicU8,
    /// Ticks with the bridge off since the request.
    off_ticks: AtomicU8,
}

impl PlannedStall {
    /// No stall.
    pub const fn new() -> Self {
        Self { state: AtomicU8::new(NONE), refusal: AtomicU8::new(NO_ANSWER), off_ticks: AtomicU8::new(0) }
    }

    /// Task: requests the permission.
    pub fn request(&self) {
        self.refusal.store(NO_ANSWER, Ordering::Relaxed);
        self.off_ticks.store(0, Ordering::Relaxed);
        self.state.store(REQUESTED, Ordering::Release);
    }

    /// Task: whether the core may be stalled now, or the present reason against it.
    ///
    /// # Errors
    /// Not granted, or not yet.
    pub fn answer(&self) -> Result<(), StallRefusal> {
        match (self.state.load(Ordering::Acquire), self.refusal.load(Ordering::Relaxed)) {
            (GRANTED, _) => Ok(()),
            (_, DRIVEN) => Err(StallRefusal::Driven),
            (_, TURNING) => Err(StallRefusal::Turning),
            _ => Err(StallRefusal::NoAnswer),
        }
    }

    /// Task: the stall is over, or not needed any more. To be called a tick after the stall at the earliest, so that the interrupt has counted it.
    pub fn end(&self) {
        self.state.store(ENDED, Ordering::Release);
    }

    /// Interrupt: whether [`PlannedStall::update`] must be called in this tick.
    #[inline]
    pub fn needs_update(&self) -> bool {
        self.state.load(Ordering::Acquire) != NONE
    }

    /// Interrupt: the law's output is off, and the platform is slow. Returns whether a stall is permitted, and the bridge must stay off.
    #[cold]
    #[inline(never)]
    pub fn update(&self, is_off: bool, is_slow: bool) -> bool {
        match self.state.load(Ordering::Acquire) {
            GRANTED => true,
            REQUESTED => {
                let off_ticks = if is_off { self.off_ticks.load(Ordering::Relaxed).saturating_add(1) } else { 0 };
                self.off_ticks.store(off_ticks, Ordering::Relaxed);
                let refusal = match (is_off, is_slow) {
                    (false, _) => DRIVEN,
                    (_, false) => TURNING,
                    _ => NO_ANSWER,
                };
                self.refusal.store(refusal, Ordering::Relaxed);
                let grants = is_slow && off_ticks >= OFF_TICKS;
                if grants {
                    self.state.store(GRANTED, Ordering::Release);
                }
                grants
            }
            _ => {
                self.state.store(NONE, Ordering::Relaxed);
                false
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stall_is_granted_after_three_ticks_off_and_slow() {
        let stall = PlannedStall::new();
        assert!(!stall.needs_update());
        stall.request();
        assert_eq!(stall.answer(), Err(StallRefusal::NoAnswer));
        assert!(!stall.update(true, true) && !stall.update(true, true));
        assert!(stall.update(true, true), "the third");
        assert_eq!(stall.answer(), Ok(()));
        assert!(stall.update(false, false), "until the end, whatever is commanded");
        stall.end();
        assert!(stall.needs_update() && !stall.update(true, true) && !stall.needs_update());
    }

    #[test]
    fn a_driven_or_turning_stand_gets_no_grant() {
        let stall = PlannedStall::new();
        stall.request();
        (0..100).for_each(|_| assert!(!stall.update(false, true)));
        assert_eq!(stall.answer(), Err(StallRefusal::Driven));
        (0..100).for_each(|_| assert!(!stall.update(true, false)));
        assert_eq!(stall.answer(), Err(StallRefusal::Turning));
        // Driven in between: the count of ticks starts again.
        stall.update(false, true);
        assert!(!stall.update(true, true) && !stall.update(true, true) && stall.update(true, true));
    }
}

//! Virtual time: constant while the tasks run, it advances to the next time that a task waits for.
//!
//! [`run`] polls a future until nothing wakes any more, takes the earliest deadline, advances the simulation to it
//! (plant, then the tick interrupt at its exact times, before any task of the same time) and polls again. Each stand
//! has its own [`VirtualClock`]; nothing is global, so that several run in parallel with the same results as alone.
//!
//! [`run_prioritised`] has two priorities: a poll of the lower one takes the time that was charged by [`VirtualClock::charge`], and the
//! higher one runs meanwhile. [`VirtualClock::stall`] stalls both and the interrupts. The effects of a charged poll occur at its begin. Not
//! simulated: the duration of other code.

use embassy_futures::select::Either;
use stand_firmware::board::{Clock, Ticks};
use std::cell::Cell;
use std::future::Future;
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll, Wake, Waker};

/// The time of one simulated stand.
#[derive(Debug)]
pub struct VirtualClock {
    now: Cell<Ticks>,
    /// The earliest deadline of the tasks in the last poll.
    deadline: Cell<Option<Ticks>>,
    /// Compute time of the present poll, board clock steps.
    charged: Cell<u64>,
    /// Time for which the present poll has stalled the core, board clock steps.
    stalled: Cell<u64>,
    /// Begin and end of the last stall.
    last_stall: Cell<(Ticks, Ticks)>,
}

impl Default for VirtualClock {
    fn default() -> Self {
        Self {
            now: Cell::new(Ticks(0)),
            deadline: Cell::new(None),
            charged: Cell::new(0),
            stalled: Cell::new(0),
            last_stall: Cell::new((Ticks(0), Ticks(0))),
        }
    }
}

impl VirtualClock {
    /// A clock that begins at `start`, as on a stand that has been on for that time.
    pub fn starting_at(start: Ticks) -> Self {
        Self { now: Cell::new(start), ..Self::default() }
    }

    /// Present time.
    pub fn now(&self) -> Ticks {
        self.now.get()
    }

    /// Adds compute time to the present poll of the lower priority, in board clock steps.
    pub fn charge(&self, steps: u64) {
        self.charged.set(self.charged.get().saturating_add(steps));
    }

    /// Stalls the core from the end of the present poll of the lower priority on, in board clock steps. The simulation holds tasks and
    /// interrupts of the firmware back while [`VirtualClock::is_stalled_at`] says so; a host runs on.
    pub fn stall(&self, steps: u64) {
        self.stalled.set(self.stalled.get().saturating_add(steps));
    }

    /// Whether the core is stalled at `t`: an interrupt of that time is lost.
    pub fn is_stalled_at(&self, t: Ticks) -> bool {
        let (begin, end) = self.last_stall.get();
        t >= begin && t < end
    }

    /// Begins the stall that the present poll has caused, if any; returns its end.
    fn begin_stall(&self) -> Ticks {
        let now = self.now.get();
        let end = now + self.stalled.take();
        if end > now {
            self.last_stall.set((now, end));
        }
        end
    }

    /// Requests a poll at `t` for the present task: for futures that wait for a peripheral.
    pub(crate) fn wait_until(&self, t: Ticks) {
        // Everything is polled again after each advance, so the deadlines are collected anew each time.
        let earliest = self.deadline.get().map_or(t, |other| other.min(t));
        self.deadline.set(Some(earliest));
    }
}

/// The clock as the firmware's trait.
#[derive(Clone, Copy, Debug)]
pub struct SimClock<'a>(pub &'a VirtualClock);

impl Clock for SimClock<'_> {
    fn now(&self) -> Ticks {
        self.0.now.get()
    }

    async fn until(&self, t: Ticks) {
        Until { clock: self.0, t }.await;
    }
}

struct Until<'a> {
    clock: &'a VirtualClock,
    t: Ticks,
}

impl Future for Until<'_> {
    type Output = ();
    fn poll(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<()> {
        if self.clock.now.get() >= self.t {
            return Poll::Ready(());
        }
        self.clock.wait_until(self.t);
        Poll::Pending
    }
}

struct Flag(AtomicBool);

impl Wake for Flag {
    fn wake(self: Arc<Self>) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// All tasks wait, and none of them for a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("at {0:?} every task waits for something that no other task will do")]
pub struct Stuck(pub Ticks);

/// Runs two priorities until one of them ends, as [`run`] does one. A poll of `low` lasts as long as was charged within it; until its end
/// `low` is not polled again, while time advances and `high` runs.
///
/// # Errors
/// [`Stuck`] if all tasks wait and none of them for a time.
pub fn run_prioritised<H: Future, L: Future>(
    clock: &VirtualClock,
    high: H,
    low: L,
    mut advance: impl FnMut(Ticks),
) -> Result<Either<H::Output, L::Output>, Stuck> {
    let flag = Arc::new(Flag(AtomicBool::new(false)));
    let waker = Waker::from(flag.clone());
    let mut context = Context::from_waker(&waker);
    let (mut high, mut low) = (pin!(high), pin!(low));
    let mut busy_until = Ticks(0);
    advance(clock.now.get());
    loop {
        clock.deadline.set(None);
        if let Poll::Ready(output) = high.as_mut().poll(&mut context) {
            return Ok(Either::First(output));
        }
        if busy_until <= clock.now.get() {
            clock.charged.set(0);
            if let Poll::Ready(output) = low.as_mut().poll(&mut context) {
                return Ok(Either::Second(output));
            }
            busy_until = clock.begin_stall() + clock.charged.take();
        }
        if busy_until > clock.now.get() {
            clock.wait_until(busy_until);
        }
        if flag.0.swap(false, Ordering::Relaxed) {
            continue;
        }
        let Some(next) = clock.deadline.get() else { return Err(Stuck(clock.now.get())) };
        advance(next);
        clock.now.set(next);
    }
}

/// Runs `tasks` to the end; `advance` advances the simulation to a time, including its interrupts.
///
/// # Errors
/// [`Stuck`] if all tasks wait and none of them for a time.
pub fn run<F: Future>(clock: &VirtualClock, tasks: F, mut advance: impl FnMut(Ticks)) -> Result<F::Output, Stuck> {
    let flag = Arc::new(Flag(AtomicBool::new(false)));
    let waker = Waker::from(flag.clone());
    let mut context = Context::from_waker(&waker);
    let mut tasks = pin!(tasks);
    advance(clock.now.get());
    loop {
        clock.deadline.set(None);
        if let Poll::Ready(output) = tasks.as_mut().poll(&mut context) {
            return Ok(output);
        }
        if flag.0.swap(false, Ordering::Relaxed) {
            continue;
        }
        let Some(next) = clock.deadline.get() else { return Err(Stuck(clock.now.get())) };
        advance(next);
        clock.now.set(next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    #[test]
    fn interrupts_run_before_the_tasks_of_the_same_time() {
        let clock = VirtualClock::default();
        let story = RefCell::new(Vec::new());
        let mut interrupt = 0;
        let task = |name: &'static str, every: u64| {
            let (clock, story) = (SimClock(&clock), &story);
            async move {
                for n in 1..=2 {
                    clock.until(Ticks(n * every)).await;
                    story.borrow_mut().push(format!("{name}@{}", clock.now().0));
                }
            }
        };
        let both = embassy_futures::join::join(task("a", 15), task("b", 10));
        let advance = |to: Ticks| {
            while interrupt <= to.0 {
                story.borrow_mut().push(format!("tick@{interrupt}"));
                interrupt += 10;
            }
        };
        assert!(run(&clock, both, advance).is_ok());
        let expected = ["tick@0", "tick@10", "b@10", "a@15", "tick@20", "b@20", "tick@30", "a@30"];
        assert_eq!(story.into_inner(), expected);
    }

    #[test]
    fn a_charged_poll_delays_the_lower_priority_only() {
        let clock = VirtualClock::default();
        let (high_at, low_at) = (RefCell::new(Vec::new()), RefCell::new(Vec::new()));
        let sim = SimClock(&clock);
        let high = async {
            for n in 1..=5 {
                sim.until(Ticks(n * 10)).await;
                high_at.borrow_mut().push(sim.now().0);
            }
        };
        let low = async {
            for n in 1.. {
                sim.until(Ticks(n * 10)).await;
                low_at.borrow_mut().push(sim.now().0);
                clock.charge(25);
            }
        };
        assert!(run_prioritised(&clock, high, low, |_| ()).is_ok());
        assert_eq!(high_at.into_inner(), [10, 20, 30, 40, 50]);
        // Both missed deadlines are served in one poll, which lasts for both.
        assert_eq!(low_at.into_inner(), [10, 35, 35]);
    }

    #[test]
    fn tasks_without_a_deadline_are_reported_as_stuck() {
        let clock = VirtualClock::default();
        assert_eq!(run(&clock, std::future::pending::<()>(), |_| ()), Err(Stuck(Ticks(0))));
    }
}

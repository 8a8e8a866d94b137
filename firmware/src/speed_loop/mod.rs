//! The control law: one plain function for the 10 kHz timer interrupt.
//!
//! In: the encoder's counter and the age of its last edge, current, supply and the number of the tick ([`Sensed`]), orders from the tasks
//! ([`Order`]). Out: compare counts of the bridge ([`Drive`]) and, each millisecond, a [`Report`]. Modes: off, voltage as asked, rate as an
//! integrated position ramp with a PI on top and back-EMF, inertia and what was learnt ([`crate::compensation`]) fed forward, position as
//! such a ramp to an angle. Limits (current, voltage, acceleration, slip) are statuses; what switches off latches until it is cleared (`guard.rs`).
//!
//! Timing: what tick n computes acts during [n+1, n+2). So a segment that starts at tick s is worked out at tick s−1
//! and is on the motor from exactly tick s on. The report of tick n sums what has acted up to n.
//!
//! A tick is a tenth of a millisecond, and what may take a millisecond is done in one of its ten *slots*, so that each tick stays short:
//! slot 0 reports, 1 and 2 judge what takes time to judge, 3 measures the rate by the edges, 4 takes lessons, 5 and 6 take orders, 7 leads
//! the ramp, 9 lays it out for the next millisecond; harmonics are worked out one by one between. Slots are numbered from the board's whole milliseconds, in which the log's rows begin, too.
//!
//! Promises: no panic, no wait, no double-precision call.

mod approach;
mod edges;
mod feed_forward;
mod guard;
mod interrupt;
mod ramp;
mod rate_estimate;
mod report;
mod segment;
mod settings;
#[cfg(test)]
mod tests;
mod tuning;

pub use crate::safety::Fault;
pub use feed_forward::{Compensating, LEARNT_WORDS, Learnt};
pub use interrupt::{Interrupt, LessonWriter, Lessons, OrderReader, OrderWriter, Orders, ReportReader, ReportWriter, Reports};
pub use report::{Limits, REPORT_WORDS, Report};
pub use segment::{Mode, ONE, Order, Segment, Zero, rate_unit};
pub use settings::{Config, Settings};
pub use tuning::Tuning;

use crate::board::{CONTROL_PER_ROW, Drive, EncoderCount, Sensed};
use crate::mailbox::Words;
use edges::Edges;
use feed_forward::FeedForward;
use guard::{Guard, Look};
use ramp::{Ramp, fixed_to_f32};
use rate_estimate::RateEstimate;

/// Slots in a millisecond.
const SLOTS: u32 = CONTROL_PER_ROW as u32;
/// The slot that lays out the next millisecond.
const PLAN: u32 = SLOTS - 1;

/// The law's configuration and state.
pub struct SpeedLoop {
    config: Config,
    /// Number of this tick.
    tick: u64,
    /// The tick's place in its millisecond.
    slot: u32,
    edges: Edges,
    estimate: RateEstimate,
    ramp: Ramp,
    feed_forward: FeedForward,
    guard: Guard,
    active: Active,
    /// The segment that waits for its start.
    next: Option<Segment>,
    clear: u16,
    /// What the bridge does during the tick that runs now; from the end of the interrupt on, what it does from the next tick on.
    pending: i16,
    /// Sum of all that was ever pending.
    duty_sum: i32,
    /// Limits in force within this millisecond.
    limits: Limits,
    limited_ms: [u32; Limits::COUNT],
    /// Rounding of the duty that is still owed, compare counts.
    owed: f32,
    /// What the rate at the end of this millisecond needs, compare counts.
    needed: f32,
    began: bool,
}

/// The segment under way.
#[derive(Clone, Copy, Debug, Default)]
struct Active {
    mode: Mode,
    zero: Zero,
    /// Value at the tick for which output is computed next, and what it gains in each, until nothing is left.
    value: i64,
    slope: i64,
    left: u32,
    /// Ran out without a successor.
    starved: bool,
}

impl SpeedLoop {
    /// A law at rest.
    pub fn new(config: Config) -> Self {
        Self {
            feed_forward: FeedForward::new(config.learnt),
            config,
            // No tick follows it.
            tick: u64::MAX - 1,
            slot: 0,
            edges: Edges::default(),
            estimate: RateEstimate::default(),
            ramp: Ramp::default(),
            guard: Guard::default(),
            active: Active::default(),
            next: None,
            clear: 0,
            pending: 0,
            duty_sum: 0,
            limits: Limits::default(),
            limited_ms: [0; Limits::COUNT],
            owed: 0.0,
            needed: 0.0,
            began: false,
        }
    }

    /// The index pulse has begun at this count since the last tick; to be told after [`SpeedLoop::look`].
    #[inline]
    pub fn see_index(&mut self, at: EncoderCount) {
        let now = EncoderCount(self.edges.counts as u16);
        self.feed_forward.from_index.see(self.edges.counts, now.since(at));
    }

    /// Compensates what was learnt from now on; its harmonics come in anew.
    #[inline]
    pub fn learn(&mut self, learnt: &Learnt) {
        self.learn_words(&learnt.to_words());
    }

    /// The same, by its words.
    #[inline]
    pub(crate) fn learn_words(&mut self, words: &[u32; LEARNT_WORDS]) {
        self.feed_forward.learnt.set_words(words);
        self.feed_forward.restart();
    }

    /// Other settings from the next tick on; the drive must be off.
    #[cold]
    pub fn tune(&mut self, config: Config) {
        self.config = config;
        self.learn(&config.learnt);
    }

    /// The compensation in force.
    pub fn learnt(&self) -> &Learnt {
        &self.feed_forward.learnt
    }

    /// The rate that is regulated, counts per tick.
    pub fn rate_estimate(&self) -> f32 {
        self.estimate.rate
    }

    /// The tick's place in its millisecond, 0 … 9.
    #[inline]
    pub fn slot(&self) -> u32 {
        self.slot
    }

    /// The latched fault, and the tick in which it was seen, low word.
    #[inline]
    pub fn fault(&self) -> (Fault, u32) {
        (self.guard.fault, self.guard.at)
    }

    /// What is regulated, for a record: the rate command, 2⁻¹⁶ counts per tick, or the voltage asked for, 2⁻¹⁶ compare counts.
    #[inline]
    pub fn command(&self) -> i32 {
        let value = if self.active.mode.follows() { self.ramp.rate() } else { self.active.value };
        (value >> 16) as i32
    }

    /// One tick: see the module. The interrupt does the same in parts.
    #[inline]
    pub fn tick(&mut self, sensed: &Sensed, order: Option<&Order>) -> Drive {
        self.look(sensed);
        self.in_turn(sensed);
        if let Some(order) = order {
            self.order(order, sensed);
        }
        self.decide()
    }

    /// The tick's first half: what is so.
    #[inline]
    pub fn look(&mut self, sensed: &Sensed) {
        let tick = sensed.tick as u32;
        self.slot = if self.slot >= PLAN { 0 } else { self.slot.wrapping_add(1) };
        if tick.wrapping_sub(1) != self.tick as u32 {
            self.out_of_step(sensed);
        }
        self.tick = sensed.tick;
        let moved = self.edges.take(sensed.encoder, sensed.edge_age, tick, self.config.period);
        self.estimate.update(&self.config.tracking, moved, self.edges.part);
        self.guard.fast(&self.config.thresholds, sensed);
    }

    /// The first tick, or one that follows a lost one.
    #[cold]
    #[inline(never)]
    fn out_of_step(&mut self, sensed: &Sensed) {
        // 2³² is 6 modulo 10.
        let (high, low) = ((sensed.tick >> 32) as u32, sensed.tick as u32);
        let rest = |x: u32| x.wrapping_sub(x.checked_div(SLOTS).unwrap_or(0).wrapping_mul(SLOTS));
        self.slot = rest(rest(high).wrapping_mul(6).wrapping_add(rest(low)));
        if self.began {
            let lost = (sensed.tick as u32).wrapping_sub(self.tick as u32).wrapping_sub(1);
            // What had been asked for last has acted all along.
            self.duty_sum = self.duty_sum.wrapping_add(i32::from(self.pending).wrapping_mul(lost as i32));
            self.edges.pass(self.config.period.wrapping_mul(lost));
            self.guard.trip(Fault::Clock, sensed.tick as u32);
        } else {
            self.began = true;
            self.edges.begin(sensed.encoder, (sensed.tick as u32).wrapping_sub(1).wrapping_mul(self.config.period));
        }
    }

    /// Takes an order.
    pub fn order(&mut self, order: &Order, sensed: &Sensed) {
        if order.trip != Fault::None {
            self.guard.trip(order.trip, sensed.tick as u32);
        } else if order.clear != self.clear {
            self.guard.clear(&self.config.thresholds, sensed, self.estimate.rate);
            // A cleared fault starts from rest in its mode, not from where the command has got to.
            self.active = Active::default();
        }
        self.clear = order.clear;
        self.next = Some(order.segment);
    }

    /// What is so at this tick; to be asked for between [`SpeedLoop::look`] and [`SpeedLoop::decide`]. Begins a new millisecond of limits.
    #[inline]
    pub fn report(&mut self) -> Report {
        let limits = core::mem::take(&mut self.limits);
        if limits != Limits::default() {
            for (bit, ms) in self.limited_ms.iter_mut().enumerate() {
                *ms = ms.wrapping_add(u32::from(limits.0 >> bit & 1));
            }
        }
        Report {
            tick: self.tick,
            // What is pending acts in the tick that begins now.
            duty_sum: self.duty_sum.wrapping_sub(i32::from(self.pending)),
            position_command: self.ramp.position,
            rate_command: self.ramp.rate(),
            rate: self.edges.rate(self.config.period),
            edge_age: self.edges.age,
            mode: self.active.mode,
            compensating: self.feed_forward.compensating(self.active.mode.follows()),
            fault: self.guard.fault,
            limits,
            limited_ms: self.limited_ms,
        }
    }

    /// What is done once in a millisecond, in all slots but 5, 6 and 9.
    #[inline(always)]
    pub fn in_turn(&mut self, sensed: &Sensed) {
        let tick = sensed.tick as u32;
        match self.slot {
            1 => self.guard.turning(&self.config.thresholds, &self.guarded(sensed), tick),
            2 => self.guard.supply(&self.config.thresholds, &self.guarded(sensed), self.estimate.rate, tick),
            3 => self.edges.measure(tick.wrapping_mul(self.config.period)),
            4 => self.feed_forward.from_index.check(self.edges.counts, self.config.index_lost),
            7 => self.lead(),
            _ => {}
        }
        self.waves();
    }

    /// The slot's harmonics; all that is done in turn in the slot that reports.
    #[inline]
    pub(crate) fn waves(&mut self) {
        if self.feed_forward.has_waves() {
            self.harmonics();
        }
    }

    /// The tick's second half: what to do about it.
    #[inline]
    pub fn decide(&mut self) -> Drive {
        let soon = (self.tick as u32).wrapping_add(1);
        if let Some(next) = &self.next
            && (next.start_tick as u32).wrapping_sub(soon) as i32 <= 0
        {
            self.switch_segment(soon);
        }
        let on = self.guard.fault == Fault::None;
        let duty = match self.active.mode {
            Mode::Rate | Mode::Position if on => self.follow(),
            Mode::Voltage if on => self.voltage(),
            _ => {
                self.pending = 0;
                return Drive::Off;
            }
        };
        self.pending = duty;
        self.duty_sum = self.duty_sum.wrapping_add(i32::from(duty));
        Drive::Duty(duty)
    }
}

impl SpeedLoop {
    #[inline]
    fn guarded(&self, sensed: &Sensed) -> Look {
        Look {
            current: sensed.current.0,
            supply: sensed.supply.0,
            duty: self.pending,
            on: self.active.mode != Mode::Off && self.guard.fault == Fault::None,
            counts: self.edges.counts,
            limits: self.limits,
        }
    }

    /// Works out the slot's harmonics for the end of the millisecond after this: one, and in slot 8, which has nothing else to do, two.
    #[inline(never)]
    fn harmonics(&mut self) {
        match self.slot {
            slot @ (0..=4 | 7) => self.harmonic(if slot == 7 { 5 } else { slot as usize }),
            8 => {
                self.harmonic(6);
                self.harmonic(7);
            }
            _ => {}
        }
    }

    #[inline]
    fn harmonic(&mut self, k: usize) {
        let ahead = SLOTS.wrapping_mul(2).wrapping_sub(self.slot) as i32 as f32;
        let (edges, rate) = (&self.edges, self.estimate.rate);
        self.feed_forward.add(k, edges.boundary, edges.part, rate, ahead, self.config.angle_per_count);
    }

    /// Takes the next segment over; `soon` is the tick for which output is computed.
    #[inline(never)]
    fn switch_segment(&mut self, soon: u32) {
        let Some(next) = self.next.take() else { return };
        let was = self.active.mode;
        let late = soon.wrapping_sub(next.start_tick as u32);
        self.limits.set(Limits::STARVED, late > 0 && next.mode != Mode::Off && next.mode != Mode::Position);
        let along = late.min(u32::from(next.ticks));
        let moves = next.mode != Mode::Position;
        // In time there is nothing to catch up with, and no 64-bit product.
        let ahead = if moves && along > 0 { next.slope.wrapping_mul(i64::from(along)) } else { 0 };
        self.active = Active {
            mode: next.mode,
            zero: next.zero,
            value: next.value.wrapping_add(ahead),
            slope: next.slope,
            left: u32::from(next.ticks).wrapping_sub(along),
            starved: false,
        };
        if next.mode.follows() && !was.follows() {
            let measured = (i64::from(self.edges.boundary) << 32).wrapping_add(i64::from((self.edges.part * 16_777_216.0) as i32) << 8);
            self.ramp.anchor(measured, self.estimate.rate);
            self.owed = 0.0;
            self.feed_forward.restart();
            self.needed = self.config.back_emf * self.estimate.rate + self.feed_forward.friction(self.estimate.rate);
            self.feed(self.estimate.rate, self.estimate.rate, (0.0, 0.0));
        }
    }

    /// The voltage asked for at this tick; moves on to the next.
    #[inline]
    fn voltage(&mut self) -> i16 {
        let active = &mut self.active;
        let asked = fixed_to_f32(active.value);
        if active.left > 0 {
            active.left = active.left.wrapping_sub(1);
            active.value = active.value.wrapping_add(active.slope);
        } else {
            self.limits.set(Limits::STARVED, active.starved);
            active.starved = true;
        }
        let held = self.limit(asked);
        (held + ROUND).to_bits().wrapping_sub(ROUND.to_bits()) as i16
    }

    /// The regulator on the ramp; moves the ramp to the next tick.
    #[inline]
    fn follow(&mut self) -> i16 {
        let (error, slipped) = self.ramp.error(self.edges.boundary, self.config.slip);
        if slipped {
            self.limits.set(Limits::SLIPPED, true);
        }
        self.ramp.step();
        if self.slot == PLAN {
            self.plan();
        }
        let config = &self.config;
        let asked = self.ramp.feed - config.rate_gain * self.estimate.rate
            + (config.fine_gain * error as f32 - config.position_gain * self.edges.part);
        let held = self.limit(asked) + self.owed;
        // What rounding takes now is given later: the mean duty is finer than a compare count.
        let shifted = held + ROUND;
        self.owed = held - (shifted - ROUND);
        shifted.to_bits().wrapping_sub(ROUND.to_bits()) as i16
    }

    /// Works out where the ramp is to be at the end of the millisecond after this.
    #[inline(never)]
    fn lead(&mut self) {
        if !self.active.mode.follows() {
            return;
        }
        let target = if self.active.mode == Mode::Position {
            self.approach()
        } else {
            // Where the segment will be at this millisecond's end.
            let active = &mut self.active;
            let ticks = active.left.min(SLOTS);
            self.limits.set(Limits::STARVED, ticks < SLOTS);
            active.left = active.left.wrapping_sub(ticks);
            active.value = active.value.wrapping_add(active.slope.wrapping_mul(i64::from(ticks)));
            active.value
        };
        let held_back = self.ramp.ahead(target, self.config.acceleration);
        self.limits.set(Limits::ACCELERATION, held_back && self.active.mode == Mode::Rate);
    }

    /// Lays out the millisecond that begins with the next tick.
    #[inline(never)]
    fn plan(&mut self) {
        let (from, to) = self.ramp.plan();
        let waves = self.feed_forward.turn_over();
        self.feed(from, to, waves);
    }

    /// What the millisecond from the rate `from` to `to` needs, whatever is measured in it.
    #[inline]
    fn feed(&mut self, from: f32, to: f32, (waves_from, waves_to): (f32, f32)) {
        let config = &self.config;
        let change = to - from;
        // What is fed forward acts on the mean in the middle of the next tick; the rate that is measured is this tick's.
        let needs = config.back_emf * to + self.feed_forward.friction(to);
        let pushed = config.inertia * change + 0.05 * (needs - self.needed) - 0.1 * config.rate_gain * change;
        self.ramp.feed(self.needed + config.rate_gain * from + pushed + waves_from, needs + config.rate_gain * to + pushed + waves_to);
        self.needed = needs;
    }

    /// The rate that leads to the angle.
    #[inline(never)]
    fn approach(&mut self) -> i64 {
        let (rate, position) = self.ramp.straight();
        let goal = match self.active.zero {
            Zero::PowerOn => self.active.value,
            Zero::Index if self.feed_forward.from_index.seen => {
                self.active.value.wrapping_add(i64::from(self.feed_forward.from_index.at) << 32)
            }
            Zero::Index => {
                self.limits.set(Limits::NO_INDEX, true);
                return 0;
            }
        };
        let fastest = if self.active.slope == 0 { self.config.approach } else { fixed_to_f32(self.active.slope) };
        let next = approach::next_rate(fixed_to_f32(goal.wrapping_sub(position)), fixed_to_f32(rate), fastest, self.config.braking);
        // Whole counts per tick and 2⁻²⁴ of one, in two integer halves.
        i64::from((next * 16_777_216.0) as i32) << 8
    }

    /// Current limit, then voltage limit.
    #[inline]
    fn limit(&mut self, asked: f32) -> f32 {
        let config = &self.config;
        let back_emf = config.back_emf * self.estimate.rate;
        if (asked - back_emf).abs() <= config.current_window && asked.abs() <= config.duty_limit {
            return asked;
        }
        let (low, high) = (back_emf - config.current_window, back_emf + config.current_window);
        let within_current = if asked > high {
            self.limits.set(Limits::CURRENT, true);
            high
        } else if asked < low {
            self.limits.set(Limits::CURRENT, true);
            low
        } else {
            asked
        };
        let most = config.duty_limit;
        if within_current.abs() > most {
            self.limits.set(Limits::VOLTAGE, true);
            return most.copysign(within_current);
        }
        within_current
    }
}

/// Added to a float below 2²², it leaves the nearest whole number in the low bits; what is no number leaves 0 in the lowest 16.
const ROUND: f32 = 12_582_912.0;

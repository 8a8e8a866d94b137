//! The control law, worked out at 5 kHz: one plain function for the 10 kHz timer interrupt.
//!
//! In: the encoder's counter and the age of its last edge, current, supply and the number of the tick ([`Sensed`]), orders from the tasks
//! ([`Order`]). Out: compare counts of the bridge ([`Drive`]) and, each millisecond, a [`Report`]. Modes: off, voltage as asked, rate as an
//! integrated position ramp with a PI on top and back-EMF, inertia and what was learnt ([`crate::compensation`]) fed forward, position as
//! such a ramp to an angle. Limits (current, voltage, acceleration, slip) are statuses; what switches off latches until it is cleared (`guard.rs`).
//!
//! Timing: what tick n computes acts from tick n+1 on. In each tick edges are counted, what switches off at once is judged, and a sample is
//! recorded; the law itself is worked out in every second one ([`BEAT`]), at 5 kHz, some hundred times the drive's bandwidth, and its duty
//! stands for two ticks. A segment that starts at tick s is on the motor from exactly tick s on, though s−1 be a tick between. The report
//! of tick n sums what has acted up to n.
//!
//! A tick is a tenth of a millisecond, and what may take a millisecond is done in one of its ten *slots*, so that each tick stays short. They
//! are numbered from the board's whole milliseconds, in which the log's rows begin, too. The law has the odd ones, so that it acts from whole
//! milliseconds on, and the even ones have what is long: 0 measures the rate by the edges and reports, 2 judges what takes time to judge and sees where
//! the harmonics will be, 4 and 8 work them out, 6 leads the ramp, 8 lays it out for the next millisecond. Beside the law 1 takes lessons, 1 and 3 look for
//! the rate that leads to an angle, 5 takes orders, and 8 what came late, 7 looks after the record, 9 takes the next millisecond over.
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
mod under_way;

pub use crate::status::{Fault, Limits};
pub use feed_forward::{Compensating, LEARNT_WORDS, Learnt};
pub use interrupt::{Interrupt, LessonWriter, Lessons, OrderReader, OrderWriter, Orders, ReportReader, ReportWriter, Reports};
pub use report::{REPORT_WORDS, Report};
pub use segment::{Mode, ONE, ORDER_WORDS, Order, Segment, Zero, rate_unit};
pub use settings::{Config, Settings};
pub use tuning::Tuning;

use crate::board::{CONTROL_PER_ROW, Drive, EncoderCount, Sensed};
use crate::mailbox::{Words, split_u64};
use core::sync::atomic::{AtomicU32, Ordering};
use edges::Edges;
use feed_forward::FeedForward;
use guard::{Guard, Look};
use ramp::Ramp;
use rate_estimate::RateEstimate;
use report::state_word;

/// Ticks from one decision to the next; the odd slots decide.
const BEAT: u32 = 2;
/// Decisions in a millisecond.
const BEATS: u32 = 5;
/// Slots in a millisecond.
const SLOTS: u32 = CONTROL_PER_ROW as u32;
const _: () = assert!(BEATS * BEAT == SLOTS);
/// The slot that sees where the harmonics will be.
const AIM: u32 = 2;
/// The slot that takes the next millisecond over.
const LAST: u32 = SLOTS - 1;

/// The law's configuration and state.
pub struct SpeedLoop {
    config: Config,
    /// Number of this tick.
    tick: u64,
    /// The tick's place in its millisecond.
    slot: u32,
    edges: Edges,
    /// From the last boundary to where the platform was at the last decision, counts.
    part: f32,
    estimate: RateEstimate,
    ramp: Ramp,
    feed_forward: FeedForward,
    guard: Guard,
    active: Active,
    /// The newest order, and whether its segment waits for its start.
    ordered: [u32; ORDER_WORDS],
    waits: bool,
    /// What it said of faults.
    of_faults: u32,
    /// What was decided on last, for a record.
    command: i32,
    /// What the bridge does during the tick that runs now; from the end of the interrupt on, what it does from the next tick on.
    pending: i16,
    /// Sum of all that was ever pending.
    duty_sum: i32,
    /// Limits in force within this millisecond, and those of the one before.
    limits: Limits,
    reported: Limits,
    limited_ms: [u32; Limits::COUNT],
    /// What may be asked for within this millisecond without a look at the limits, compare counts.
    free_duty: f32,
    /// Rounding of the duty that is still owed, compare counts.
    owed: f32,
    /// What the rate at the end of this millisecond needs, compare counts.
    needed: f32,
    began: bool,
    /// An angle is approached in this millisecond; how far it is, counts, and the rate that leads to it, 2⁻³² counts per tick.
    approaches: bool,
    distance: f32,
    way: i64,
}

/// The segment under way.
#[derive(Clone, Copy, Debug, Default)]
struct Active {
    mode: Mode,
    zero: Zero,
    /// Value at the tick for which output is computed next, and what it gains in a tick, until nothing is left.
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
            part: 0.0,
            estimate: RateEstimate::default(),
            ramp: Ramp::default(),
            guard: Guard::default(),
            active: Active::default(),
            ordered: [0; ORDER_WORDS],
            waits: false,
            of_faults: 0,
            command: 0,
            pending: 0,
            duty_sum: 0,
            limits: Limits::default(),
            reported: Limits::default(),
            limited_ms: [0; Limits::COUNT],
            free_duty: 0.0,
            owed: 0.0,
            needed: 0.0,
            began: false,
            approaches: false,
            distance: 0.0,
            way: 0,
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
        *self.lesson() = learnt.to_words();
        self.learn_lesson();
    }

    /// The words of the next lesson, to be filled before it acts.
    #[inline]
    pub(crate) fn lesson(&mut self) -> &mut [u32; LEARNT_WORDS] {
        self.feed_forward.lesson()
    }

    /// Compensates that lesson from now on.
    #[inline]
    pub(crate) fn learn_lesson(&mut self) {
        self.feed_forward.learn();
    }

    /// Other settings from the next tick on; the drive must be off.
    #[cold]
    pub fn tune(&mut self, config: Config) {
        self.config = config;
        self.learn(&config.learnt);
    }

    /// The compensation in force.
    pub fn learnt(&self) -> &Learnt {
        self.feed_forward.learnt()
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

    /// What is regulated, for a record, as it was decided last: the rate command, 2⁻¹⁶ counts per tick, or the voltage asked for, 2⁻¹⁶ compare counts.
    #[inline]
    pub fn command(&self) -> i32 {
        self.command
    }

    /// What the bridge does from the next tick on, compare counts; to be asked for after [`SpeedLoop::decide`].
    #[inline]
    pub fn duty(&self) -> i16 {
        self.pending
    }

    /// One tick: see the module. The interrupt does the same in parts.
    #[inline]
    pub fn tick(&mut self, sensed: &Sensed, order: Option<&Order>) -> Drive {
        self.look(sensed);
        if self.slot == 0 {
            self.measure();
        }
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
        self.slot = if self.slot >= LAST { 0 } else { self.slot.wrapping_add(1) };
        if tick.wrapping_sub(1) != self.tick as u32 {
            self.out_of_step(sensed);
        }
        self.tick = sensed.tick;
        self.edges.take(sensed.encoder, sensed.edge_age, tick, self.config.period);
        if self.decides() {
            self.part = self.edges.part();
            self.estimate.update(&self.config.tracking, self.edges.boundary, self.part);
        }
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
            self.estimate.begin(self.edges.boundary);
        }
    }

    /// Takes an order.
    pub fn order(&mut self, order: &Order, sensed: &Sensed) {
        self.ordered = order.to_words();
        self.take_order(sensed);
    }

    /// The place of an order that is to be taken with [`SpeedLoop::take_order`].
    #[inline]
    pub(crate) fn ordered(&mut self) -> &mut [u32; ORDER_WORDS] {
        &mut self.ordered
    }

    /// What is in their place is no order.
    #[inline]
    pub(crate) fn forget_order(&mut self) {
        self.waits = false;
    }

    /// Takes the order whose words are in their place.
    #[inline]
    pub(crate) fn take_order(&mut self, sensed: &Sensed) {
        let [.., of_faults] = self.ordered;
        if of_faults != self.of_faults {
            self.order_of_faults(of_faults, sensed);
        }
        self.waits = true;
    }

    /// An order that says something new of faults.
    #[cold]
    #[inline(never)]
    fn order_of_faults(&mut self, of_faults: u32, sensed: &Sensed) {
        let (trip, clear) = (segment::trip_of(of_faults), segment::clear_of(of_faults));
        if trip != Fault::None {
            self.guard.trip(trip, sensed.tick as u32);
        } else if clear != segment::clear_of(self.of_faults) {
            self.guard.clear(&self.config.thresholds, sensed, self.estimate.rate);
            // A cleared fault starts from rest in its mode, not from where the command has got to.
            self.active.mode = Mode::Off;
            self.active.value = 0;
            self.active.left = 0;
        }
        self.of_faults = of_faults;
    }

    /// What is so at this tick; to be asked for between [`SpeedLoop::look`] and [`SpeedLoop::decide`]. Begins a new millisecond of limits.
    pub fn report(&mut self) -> Report {
        let cells = [const { AtomicU32::new(0) }; REPORT_WORDS];
        self.report_to(&cells);
        Report::from_words(&cells.map(|cell| cell.into_inner()))
    }

    /// The same, word by word to where it goes.
    #[inline(always)]
    pub(crate) fn report_to(&mut self, cells: &[AtomicU32; REPORT_WORDS]) {
        let limits = core::mem::take(&mut self.limits);
        self.reported = limits;
        if limits != Limits::default() {
            let mut left = u32::from(limits.0);
            let mut count = |ms: &mut u32| {
                *ms = ms.wrapping_add(left & 1);
                left >>= 1;
            };
            // Written out: a loop takes twice as long.
            let [current, voltage, acceleration, slipped, starved, no_index] = &mut self.limited_ms;
            count(current);
            count(voltage);
            count(acceleration);
            count(slipped);
            count(starved);
            count(no_index);
        }
        let [tick_0, tick_1, duty, position_0, position_1, command_0, command_1, rate, edge_age, state, ms @ ..] = cells;
        let put = |cell: &AtomicU32, word: u32| cell.store(word, Ordering::Relaxed);
        let put_u64 = |low: &AtomicU32, high: &AtomicU32, value: u64| {
            let [low_word, high_word] = split_u64(value);
            put(low, low_word);
            put(high, high_word);
        };
        put_u64(tick_0, tick_1, self.tick);
        // What is pending acts in the tick that begins now.
        put(duty, self.duty_sum.wrapping_sub(i32::from(self.pending)) as u32);
        put_u64(position_0, position_1, self.ramp.position as u64);
        put_u64(command_0, command_1, self.ramp.rate() as u64);
        put(rate, self.edges.rate(self.config.period).to_bits());
        put(edge_age, self.edges.age);
        let mode = self.active.mode;
        put(state, state_word(mode, self.guard.fault, limits, self.feed_forward.compensating(mode.follows())));
        let ([a, b, c, d, e, f], [in_a, in_b, in_c, in_d, in_e, in_f]) = (&self.limited_ms, ms);
        put(in_a, *a);
        put(in_b, *b);
        put(in_c, *c);
        put(in_d, *d);
        put(in_e, *e);
        put(in_f, *f);
    }

    /// In slot 0, before its report: the rate by the edges.
    #[inline]
    pub fn measure(&mut self) {
        self.edges.measure((self.tick as u32).wrapping_mul(self.config.period));
    }

    /// What is done once in a millisecond, in its slot.
    #[inline(always)]
    pub fn in_turn(&mut self, sensed: &Sensed) {
        let tick = sensed.tick as u32;
        match self.slot {
            1 => {
                self.approaches = self.active.mode == Mode::Position;
                if self.approaches {
                    self.distance = self.distance();
                }
            }
            AIM => {
                let look = self.guarded(sensed);
                self.guard.turning(&self.config.thresholds, &look, tick);
                self.guard.supply(&self.config.thresholds, &look, self.estimate.rate, tick);
                self.look_for_room();
                self.aim();
            }
            3 if self.approaches => self.way = self.approach(),
            4 => self.feed_forward.add(false),
            6 => {
                self.feed_forward.from_index.check(self.edges.counts, self.config.index_lost);
                self.lead();
            }
            8 => {
                self.feed_forward.add(true);
                self.plan();
            }
            _ => {}
        }
    }

    /// The tick's second half: what to do about it.
    #[inline]
    pub fn decide(&mut self) -> Drive {
        let tick = self.tick as u32;
        let [start_tick, ..] = self.ordered;
        let (mut decides, mut begins) = (self.decides(), false);
        if self.waits && start_tick.wrapping_sub(tick) as i32 <= 1 {
            begins = self.switch_segment(tick.wrapping_add(1));
            // A voltage is on the motor from exactly its tick on.
            decides |= begins || !self.active.mode.follows();
        }
        if self.guard.fault != Fault::None || self.active.mode == Mode::Off {
            self.command = 0;
            self.pending = 0;
            return Drive::Off;
        }
        if decides {
            let (asked, owed) = match self.active.mode {
                _ if begins => (self.needed, 0.0),
                Mode::Voltage => (self.voltage(), 0.0),
                _ => (self.follow(), self.owed),
            };
            let held = self.limit(asked) + owed;
            // What rounding takes now is given later, where a rate is held: the mean duty is finer than a compare count.
            let shifted = held + ROUND;
            self.owed = held - (shifted - ROUND);
            self.pending = shifted.to_bits().wrapping_sub(ROUND.to_bits()) as i16;
        }
        self.duty_sum = self.duty_sum.wrapping_add(i32::from(self.pending));
        Drive::Duty(self.pending)
    }
}

impl SpeedLoop {
    /// Whether the law is worked out in this tick; a tick between keeps what it has decided.
    #[inline]
    fn decides(&self) -> bool {
        self.slot & (BEAT - 1) != 0
    }

    /// Ticks from this one to the next in which the law is worked out.
    #[inline]
    fn until_next(&self) -> u32 {
        if self.decides() { BEAT } else { 1 }
    }

    #[inline]
    fn guarded(&self, sensed: &Sensed) -> Look {
        Look {
            current: sensed.current.0,
            supply: sensed.supply.0,
            duty: self.pending,
            on: self.active.mode != Mode::Off && self.guard.fault == Fault::None,
            counts: self.edges.counts,
            limits: self.reported,
        }
    }

    /// Where the harmonics will be at the end of the millisecond after this.
    #[inline(always)]
    fn aim(&mut self) {
        const AHEAD: f32 = (2 * SLOTS - AIM) as f32;
        let (edges, rate, config) = (&self.edges, self.estimate.rate, &self.config);
        self.feed_forward.aim(edges.boundary, edges.part(), rate, AHEAD, config.angle_per_count, config.fastest_wave);
    }
}

/// Added to a float below 2²², it leaves the nearest whole number in the low bits; what is no number leaves 0 in the lowest 16.
const ROUND: f32 = 12_582_912.0;

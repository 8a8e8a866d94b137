//! The control law: one plain function for the 10 kHz timer interrupt.
//!
//! In: the encoder's counter and the number of the tick ([`Sensed`]), orders from the tasks ([`Order`]). Out: compare
//! counts of the bridge ([`Drive`]) and a [`Report`]. Modes: off, voltage as asked, rate as an integrated position ramp
//! with a PI on top and back-EMF, inertia and what was learnt ([`crate::compensation`]) fed forward. Limits (current, voltage, acceleration, slip) are statuses;
//! overspeed and a lost tick are faults and latch until they are cleared.
//!
//! Timing: what tick n computes acts during [n+1, n+2). So a segment that starts at tick s is worked out at tick s−1
//! and is on the motor from exactly tick s on. The report of tick n sums what has acted up to n.
//!
//! Promises: no panic, no wait, no double-precision call. Does not do yet: edge timing.

mod feed_forward;
mod ramp;
mod rate_estimate;
mod report;
mod segment;
mod settings;
#[cfg(test)]
mod tests;

pub use crate::safety::Fault;
pub use feed_forward::{Compensating, LEARNT_WORDS, Learnt};
pub use report::{Limits, Report};
pub use segment::{Mode, ONE, Order, Segment, rate_unit};
pub use settings::{Config, Settings};

use crate::board::{Drive, EncoderCount, Sensed, TickIo, Unwrapped};
use crate::mailbox::{Mailbox, Reader, Writer};
use feed_forward::FeedForward;
use ramp::Ramp;
use rate_estimate::RateEstimate;

/// The mailbox of orders, tasks to interrupt.
pub type Orders = Mailbox<Order, 8>;
/// The mailbox of reports, interrupt to tasks.
pub type Reports = Mailbox<Report, 14>;
/// The tasks' end of the orders.
pub type OrderWriter<'a> = Writer<'a, Order, 8>;
/// The tasks' end of the reports.
pub type ReportReader<'a> = Reader<'a, Report, 14>;

/// The mailbox of what was learnt, tasks to interrupt.
pub type Lessons = Mailbox<Learnt, LEARNT_WORDS>;
/// The tasks' end of the lessons.
pub type LessonWriter<'a> = Writer<'a, Learnt, LEARNT_WORDS>;

/// All that the timer interrupt owns besides its hardware.
pub struct Interrupt<'a> {
    speed_loop: SpeedLoop,
    lessons: Option<Reader<'a, Learnt, LEARNT_WORDS>>,
    orders: Reader<'a, Order, 8>,
    reports: Writer<'a, Report, 14>,
}

impl<'a> Interrupt<'a> {
    /// Joins the law with the interrupt's ends of the two mailboxes.
    pub fn new(speed_loop: SpeedLoop, orders: Reader<'a, Order, 8>, reports: Writer<'a, Report, 14>) -> Self {
        Self { speed_loop, lessons: None, orders, reports }
    }

    /// Listens for what is learnt while it runs; otherwise the settings' compensation stays.
    pub fn listening(self, lessons: Reader<'a, Learnt, LEARNT_WORDS>) -> Self {
        Self { lessons: Some(lessons), ..self }
    }

    /// The compensation in force.
    pub fn learnt(&self) -> &Learnt {
        &self.speed_loop.feed_forward.learnt
    }

    /// The interrupt: sense, decide, drive, report.
    #[inline]
    pub fn run<T: TickIo>(&mut self, io: &mut T) {
        let sensed = io.sense();
        if let Some(at) = io.index() {
            self.speed_loop.see_index(at);
        }
        if let Some(learnt) = self.lessons.as_mut().and_then(Reader::take_once) {
            self.speed_loop.learn(learnt);
        }
        let (drive, report) = self.speed_loop.tick(sensed, self.orders.take_once());
        io.drive(drive);
        self.reports.post(&report);
    }
}

/// The law's configuration and state.
pub struct SpeedLoop {
    config: Config,
    position: Unwrapped,
    estimate: RateEstimate,
    ramp: Ramp,
    feed_forward: FeedForward,
    /// An index that the next tick is to take.
    index: Option<EncoderCount>,
    active: Segment,
    next: Option<Segment>,
    clear: u16,
    fault: Fault,
    last_tick: Option<u64>,
    /// What the bridge does during the tick that runs now.
    acting: i16,
    /// What it does from the next tick on.
    pending: i16,
    duty_sum: i64,
    limited_ticks: [u32; Limits::COUNT],
    /// Rounding of the duty that is still owed, compare counts.
    owed: f32,
}

impl SpeedLoop {
    /// A law at rest.
    pub fn new(config: Config) -> Self {
        Self {
            feed_forward: FeedForward::new(config.learnt),
            index: None,
            config,
            position: Unwrapped::default(),
            estimate: RateEstimate::default(),
            ramp: Ramp::default(),
            active: Segment::default(),
            next: None,
            clear: 0,
            fault: Fault::None,
            last_tick: None,
            acting: 0,
            pending: 0,
            duty_sum: 0,
            limited_ticks: [0; Limits::COUNT],
            owed: 0.0,
        }
    }

    /// The index pulse has begun at this count, since the last tick: the tick that follows counts on from it.
    #[inline]
    pub fn see_index(&mut self, at: EncoderCount) {
        self.index = Some(at);
    }

    /// Compensates what was learnt from the next tick on; its harmonics come in anew.
    #[inline]
    pub fn learn(&mut self, learnt: Learnt) {
        self.feed_forward.learnt = learnt;
        self.feed_forward.restart();
    }

    /// The rate estimate, counts per tick.
    pub fn rate_estimate(&self) -> f32 {
        self.estimate.rate
    }

    /// One tick: see the module.
    #[inline]
    pub fn tick(&mut self, sensed: Sensed, order: Option<Order>) -> (Drive, Report) {
        let n = sensed.tick;
        let first = self.last_tick.is_none();
        self.close_intervals(n);
        let step = self.position.take(sensed.encoder);
        self.feed_forward.from_index.take(step, sensed.encoder, self.index.take(), self.config.index_lost);
        if !first {
            self.estimate.update(&self.config.tracking, f32::from(step));
        }
        if let Some(order) = order {
            self.take_order(order);
        }

        let mut limits = Limits::default();
        let soon = n.saturating_add(1);
        let was = self.active.mode;
        // What is reported belongs to now; from here on the ramp is the next tick's.
        self.switch_segment(soon, &mut limits);
        if self.active.mode == Mode::Rate && was != Mode::Rate {
            self.ramp = Ramp::anchor(self.position.counts, self.estimate.rate);
            self.owed = 0.0;
            self.feed_forward.restart();
        }
        if self.fault == Fault::None && self.estimate.rate.abs() > self.config.overspeed {
            self.fault = Fault::Overspeed;
        }
        let mut report = Report {
            tick: n,
            duty_sum: self.duty_sum,
            mode: was,
            position_command: self.ramp.position,
            rate_command: self.ramp.rate,
            compensating: self.feed_forward.compensating(was == Mode::Rate),
            ..Report::default()
        };
        let drive = if self.fault != Fault::None {
            Drive::Off
        } else {
            match self.active.mode {
                Mode::Off => Drive::Off,
                Mode::Voltage => self.voltage(soon, &mut limits),
                Mode::Rate => self.rate(soon, &mut report, &mut limits),
            }
        };
        self.pending = drive.counts();
        if limits != Limits::default() {
            for (bit, ticks) in self.limited_ticks.iter_mut().enumerate() {
                *ticks = ticks.wrapping_add(u32::from(limits.0 >> bit & 1));
            }
        }
        report.fault = self.fault;
        report.limits = limits;
        report.limited_ticks = self.limited_ticks;
        (drive, report)
    }
}

impl SpeedLoop {
    /// Adds up what has acted since the last tick; a tick that was left out is a fault.
    #[inline]
    fn close_intervals(&mut self, n: u64) {
        if let Some(last) = self.last_tick.replace(n) {
            let lost = n.saturating_sub(last).saturating_sub(1);
            self.duty_sum = self.duty_sum.wrapping_add(i64::from(self.acting));
            if lost > 0 {
                self.duty_sum = self.duty_sum.wrapping_add(i64::from(self.pending).wrapping_mul(lost as i64));
                self.fault = Fault::Clock;
            }
        }
        self.acting = self.pending;
    }

    fn take_order(&mut self, order: Order) {
        if order.trip != Fault::None {
            self.clear = order.clear;
            if self.fault == Fault::None {
                self.fault = order.trip;
            }
        } else if order.clear != self.clear {
            self.clear = order.clear;
            self.fault = Fault::None;
            // A cleared fault starts from rest in its mode, not from where the command has got to.
            self.active = Segment::default();
        }
        self.next = Some(order.segment);
    }

    /// Takes the next segment over if its time has come; `soon` is the tick for which output is computed.
    #[inline]
    fn switch_segment(&mut self, soon: u64, limits: &mut Limits) {
        if let Some(next) = self.next.take_if(|next| next.start_tick <= soon) {
            limits.set(Limits::STARVED, next.start_tick < soon);
            self.active = next;
        }
        limits.set(Limits::STARVED, self.active.mode != Mode::Off && self.active.is_over(soon));
    }

    #[inline]
    fn voltage(&mut self, soon: u64, limits: &mut Limits) -> Drive {
        let asked = fixed_to_f32(self.active.at(soon));
        Drive::Duty(round(self.limit(asked, limits)))
    }

    /// The regulator in rate mode; moves the ramp to the tick `soon`.
    #[inline]
    fn rate(&mut self, soon: u64, report: &mut Report, limits: &mut Limits) -> Drive {
        let config = &self.config;
        let (error, slipped) = self.ramp.error(self.position.counts, config.slip);
        limits.set(Limits::SLIPPED, slipped);
        report.position_command = self.ramp.position;
        let rate_now = self.ramp.rate;
        let held_back = self.ramp.advance(self.active.at(soon), config.acceleration);
        limits.set(Limits::ACCELERATION, held_back);

        let command = fixed_to_f32(self.ramp.rate);
        let acceleration = fixed_to_f32(self.ramp.rate.wrapping_sub(rate_now));
        let asked = config.back_emf * command
            + config.inertia * acceleration
            + config.rate_gain * (fixed_to_f32(rate_now) - self.estimate.rate)
            + config.position_gain * fixed_to_f32(error)
            + self.feed_forward.duty(command, self.estimate.rate, config.angle_per_count);
        let held = self.limit(asked, limits);
        // What rounding takes now is given later: the mean duty is finer than a compare count.
        let duty = round(held + self.owed);
        self.owed = held + self.owed - f32::from(duty);
        Drive::Duty(duty)
    }

    /// Current limit, then voltage limit.
    #[inline]
    fn limit(&self, asked: f32, limits: &mut Limits) -> f32 {
        let back_emf = self.config.back_emf * self.estimate.rate;
        let window = self.config.current_window;
        let within_current = asked.max(back_emf - window).min(back_emf + window);
        limits.set(Limits::CURRENT, within_current != asked);
        let duty_limit = self.config.duty_limit;
        let within_voltage = within_current.max(-duty_limit).min(duty_limit);
        limits.set(Limits::VOLTAGE, within_voltage != within_current);
        within_voltage
    }
}

/// A fixed-point number as single precision, in units; ± 32 767.
#[inline]
fn fixed_to_f32(value: i64) -> f32 {
    // Two integer halves: a 64-bit conversion is a library call on the chip.
    let whole = (value >> 32) as i32;
    let part = (value as u32 >> 8) as i32;
    whole as f32 + part as f32 * (1.0 / 16_777_216.0)
}

/// To the nearest compare count; saturates, NaN is 0.
#[inline]
fn round(duty: f32) -> i16 {
    (duty + 0.5_f32.copysign(duty)) as i16
}

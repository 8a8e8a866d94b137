//! The timer interrupt: the law between its hardware and its mailboxes.
//!
//! Once in a millisecond each: a report out (slot 0), a part of a lesson in (slot 4; the whole of it acts from slot 8 on), orders in (slots 5 and
//! 6; who orders for the next whole millisecond comes in time). An emergency stop does not wait for them: it is sensed in each tick.

use super::{LEARNT_WORDS, Learnt, Order, REPORT_WORDS, Report, SpeedLoop, Tuning};
use crate::board::{Sensed, TickIo};
use crate::capture::{Recorder, Sample};
use crate::mailbox::{Mailbox, Parts, Reader, Writer};

/// Words of a lesson that are taken in a millisecond.
const LESSON_PART: usize = 7;

/// The mailbox of orders, tasks to interrupt.
pub type Orders = Mailbox<Order, 8>;
/// The tasks' end of the orders.
pub type OrderWriter<'a> = Writer<'a, Order, 8>;
/// The interrupt's end of the orders.
pub type OrderReader<'a> = Reader<'a, Order, 8>;
/// The mailbox of reports, interrupt to tasks.
pub type Reports = Mailbox<Report, REPORT_WORDS>;
/// The tasks' end of the reports.
pub type ReportReader<'a> = Reader<'a, Report, REPORT_WORDS>;
/// The interrupt's end of the reports.
pub type ReportWriter<'a> = Writer<'a, Report, REPORT_WORDS>;
/// The mailbox of what was learnt, tasks to interrupt.
pub type Lessons = Mailbox<Learnt, LEARNT_WORDS>;
/// The tasks' end of the lessons.
pub type LessonWriter<'a> = Writer<'a, Learnt, LEARNT_WORDS>;

/// All that the timer interrupt owns besides its hardware.
pub struct Interrupt<'a> {
    speed_loop: SpeedLoop,
    lessons: Option<(Reader<'a, Learnt, LEARNT_WORDS>, Parts<LEARNT_WORDS>)>,
    /// A lesson is whole and waits for its slot.
    lesson_waits: bool,
    tuning: Option<&'a Tuning>,
    orders: OrderReader<'a>,
    reports: ReportWriter<'a>,
    recorder: Option<Recorder<'a>>,
}

impl<'a> Interrupt<'a> {
    /// Joins the law with the interrupt's ends of the two mailboxes.
    pub fn new(speed_loop: SpeedLoop, orders: OrderReader<'a>, reports: ReportWriter<'a>) -> Self {
        Self { speed_loop, lessons: None, lesson_waits: false, tuning: None, orders, reports, recorder: None }
    }

    /// Listens for what is learnt while it runs; otherwise the settings' compensation stays.
    pub fn listening(self, lessons: Reader<'a, Learnt, LEARNT_WORDS>) -> Self {
        Self { lessons: Some((lessons, Parts::default())), ..self }
    }

    /// Takes other settings while it runs, with the drive off.
    pub fn tuned_by(self, tuning: &'a Tuning) -> Self {
        Self { tuning: Some(tuning), ..self }
    }

    /// Records each tick, so that what led to a fault can be looked at.
    pub fn recording(self, recorder: Recorder<'a>) -> Self {
        Self { recorder: Some(recorder), ..self }
    }

    /// The compensation in force.
    pub fn learnt(&self) -> &Learnt {
        self.speed_loop.learnt()
    }

    /// The interrupt: sense, decide, drive, report.
    #[inline]
    pub fn run<T: TickIo>(&mut self, io: &mut T) {
        let sensed = io.sense();
        self.speed_loop.look(&sensed);
        if let Some(at) = io.index() {
            self.speed_loop.see_index(at);
        }
        let slot = self.speed_loop.slot();
        match slot {
            0 => {
                self.reports.post(&self.speed_loop.report());
                self.speed_loop.waves();
            }
            5 | 6 => self.take_order(&sensed),
            8 if self.lesson_waits => self.learn(),
            9 => {
                if let Some(config) = self.tuning.and_then(Tuning::take) {
                    self.speed_loop.tune(config);
                }
            }
            _ => {
                self.speed_loop.in_turn(&sensed);
                if slot == 4 {
                    self.rest(&sensed);
                }
            }
        }
        let drive = self.speed_loop.decide();
        io.drive(drive);
        if let Some(recorder) = &mut self.recorder {
            recorder.take(&Sample {
                count: sensed.encoder,
                duty: drive.counts(),
                current: sensed.current,
                rate: self.speed_loop.rate_estimate(),
                command: self.speed_loop.command(),
            });
        }
    }

    #[inline]
    fn take_order(&mut self, sensed: &Sensed) {
        if let Some(order) = self.orders.take_once() {
            self.speed_loop.order(&order, sensed);
        }
    }

    /// Lessons, and what the record is to do.
    #[inline]
    fn rest(&mut self, sensed: &Sensed) {
        if let Some(recorder) = &mut self.recorder {
            recorder.look(sensed.tick as u32, self.speed_loop.fault());
        }
        if let Some((lessons, parts)) = &mut self.lessons
            && lessons.take_part(parts, LESSON_PART)
        {
            self.lesson_waits = true;
        }
    }

    /// The harmonics begin anew, so none is worked out in this slot.
    #[inline(never)]
    fn learn(&mut self) {
        self.lesson_waits = false;
        if let Some((_, parts)) = &self.lessons {
            self.speed_loop.learn_words(parts.words());
        }
    }
}

//! The timer interrupt: the law between its hardware and its mailboxes.
//!
//! Once in a millisecond each: a report out (slot 0), a part of a lesson in (slot 1; the whole of it acts from slot 7 on), orders in (slots 5 and
//! 8; who orders for the next whole millisecond comes in time). An emergency stop does not wait for them: it is sensed in each tick.

use super::{LEARNT_WORDS, Learnt, ORDER_WORDS, Order, REPORT_WORDS, Report, SpeedLoop, Tuning};
use crate::board::{Sensed, TickIo};
use crate::capture::{Recorder, Sample};
use crate::mailbox::{Mailbox, Parts, Reader, Writer};

/// The mailbox of orders, tasks to interrupt.
pub type Orders = Mailbox<Order, ORDER_WORDS>;
/// The tasks' end of the orders.
pub type OrderWriter<'a> = Writer<'a, Order, ORDER_WORDS>;
/// The interrupt's end of the orders.
pub type OrderReader<'a> = Reader<'a, Order, ORDER_WORDS>;
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
    lessons: Option<(Reader<'a, Learnt, LEARNT_WORDS>, Parts)>,
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
                self.speed_loop.measure();
                self.reports.post_by(|cells| self.speed_loop.report_to(cells));
            }
            9 => self.take_tuning(),
            _ => {
                self.speed_loop.in_turn(&sensed);
                match slot {
                    1 => self.listen(),
                    5 | 8 => self.take_order(&sensed),
                    7 => {
                        self.look_at_record(&sensed);
                        self.take_lesson();
                    }
                    _ => {}
                }
            }
        }
        let drive = self.speed_loop.decide();
        io.drive(drive);
        if let Some(recorder) = &mut self.recorder {
            recorder.take(&Sample {
                count: sensed.encoder,
                duty: self.speed_loop.duty(),
                current: sensed.current,
                rate: self.speed_loop.rate_estimate(),
                command: self.speed_loop.command(),
            });
        }
    }

    #[inline]
    fn take_order(&mut self, sensed: &Sensed) {
        match self.orders.take_to(self.speed_loop.ordered()) {
            Some(true) => self.speed_loop.take_order(sensed),
            Some(false) => self.speed_loop.forget_order(),
            None => {}
        }
    }

    /// Other settings; a lesson that waits comes first.
    #[inline]
    fn take_tuning(&mut self) {
        if !self.lesson_waits
            && let Some(config) = self.tuning.and_then(Tuning::take)
        {
            self.speed_loop.tune(config);
            // The settings' compensation came into the room in which a lesson may lie in part.
            if let Some((_, parts)) = &mut self.lessons {
                *parts = Parts::default();
            }
        }
    }

    /// What the record is to do.
    #[inline]
    fn look_at_record(&mut self, sensed: &Sensed) {
        if let Some(recorder) = &mut self.recorder {
            recorder.look(sensed.tick as u32, self.speed_loop.fault());
        }
    }

    /// A lesson that is whole acts from now on.
    #[inline]
    fn take_lesson(&mut self) {
        if self.lesson_waits {
            self.lesson_waits = false;
            self.speed_loop.learn_lesson();
        }
    }

    /// Lessons; one that waits for its slot is not written over.
    #[inline]
    fn listen(&mut self) {
        if !self.lesson_waits
            && let Some((lessons, parts)) = &mut self.lessons
            && lessons.take_part(parts, self.speed_loop.lesson())
        {
            self.lesson_waits = true;
        }
    }
}

//! The control interrupt: the law between its hardware and its mailboxes.

use super::{Command, CompensationGains, Config, Report, SpeedLoop, begins_millisecond};
use crate::board::TickIo;
use crate::capture::{Recorder, Sample};
use crate::mailbox::Mailbox;
use crate::status::Fault;

/// All messages between the tasks and the interrupt.
#[derive(Default)]
pub struct Mailboxes {
    /// Commands, to the interrupt.
    pub commands: Mailbox<Command>,
    /// Other settings, to the interrupt; the drive must be off.
    pub config: Mailbox<Config>,
    /// A learnt compensation, to the interrupt, while the drive runs.
    pub compensation: Mailbox<CompensationGains>,
    /// Reports, one each millisecond, to the tasks.
    pub reports: Mailbox<Report>,
}

impl Mailboxes {
    /// Empty ones.
    pub const fn new() -> Self {
        Self { commands: Mailbox::new(), config: Mailbox::new(), compensation: Mailbox::new(), reports: Mailbox::new() }
    }
}

/// All that the timer interrupt owns besides its hardware.
pub struct Interrupt<'a> {
    speed_loop: SpeedLoop,
    mailboxes: &'a Mailboxes,
    recorder: Option<Recorder<'a>>,
}

impl<'a> Interrupt<'a> {
    /// Joins the law with its mailboxes.
    pub fn new(speed_loop: SpeedLoop, mailboxes: &'a Mailboxes) -> Self {
        Self { speed_loop, mailboxes, recorder: None }
    }

    /// Also records each tick, for a look at the ticks before a fault.
    pub fn recording(self, recorder: Recorder<'a>) -> Self {
        Self { recorder: Some(recorder), ..self }
    }

    /// The compensation in force.
    pub fn compensation(&self) -> CompensationGains {
        self.speed_loop.compensation()
    }

    /// The latched fault.
    #[inline]
    pub fn fault(&self) -> Fault {
        self.speed_loop.fault().0
    }

    /// One tick: sense, report, take messages, compute, drive, record.
    #[inline]
    pub fn run<T: TickIo>(&mut self, io: &mut T) {
        let Self { speed_loop, mailboxes, recorder } = self;
        let sensed = io.sense();
        speed_loop.sense(&sensed, io.index());
        if begins_millisecond(sensed.tick) {
            mailboxes.reports.post(speed_loop.report());
        }
        if let Some(config) = mailboxes.config.take() {
            speed_loop.set_config(config);
        }
        if let Some(gains) = mailboxes.compensation.take() {
            speed_loop.set_compensation(gains);
        }
        if let Some(command) = mailboxes.commands.take() {
            speed_loop.set_command(&command, &sensed);
        }
        io.drive(speed_loop.compute(&sensed));
        if let Some(recorder) = recorder {
            recorder.record(&Sample {
                count: sensed.encoder,
                duty: speed_loop.duty(),
                current: sensed.current,
                rate: speed_loop.rate_estimate(),
                command: speed_loop.setpoint(),
            });
            recorder.update(sensed.tick as u32, speed_loop.fault());
        }
    }
}

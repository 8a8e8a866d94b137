//! The measurement runner: measurement loop, sensor under test, and setpoints of the speed loop. It runs at a priority above the console.
//!
//! Out: rows, through a queue without locks into [`RowReceiver`], which the console's runner empties. The measurement never waits for it: a
//! row that finds the queue full is counted and lost. The queue spans [`QUEUED_ROWS`] milliseconds of a console that does not yield.

use super::setpoints;
use super::state::DriveState;
use crate::board::{Board, Clock, Hardware, Ticks};
use crate::mailbox::Mailbox;
use crate::measurement_loop::{MeasurementLoop, Pace, Row, RowSink};
use crate::sensors;
use crate::session::next_start;
use crate::speed_loop::Command;
use core::future::poll_fn;
use core::pin::{Pin, pin};
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::{Context, Poll};
use embassy_futures::join::join3;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use heapless::spsc::{Consumer, Producer, Queue};

/// Rows that wait for the console at most. Its longest poll measured takes 81 284 instructions, about 0.5 ms.
pub const QUEUED_ROWS: usize = 15;

/// Memory of the queue; one place of the ring stays free.
pub(super) type RowQueue = Queue<Row, { QUEUED_ROWS + 1 }>;

/// Signals between the ends of the queue.
#[derive(Default)]
pub(super) struct RowSignals {
    filled: Signal<CriticalSectionRawMutex, ()>,
    /// Rows lost for lack of room, wrapping.
    lost: AtomicU32,
}

/// The end of the queue in the measurement runner.
struct RowSender<'a> {
    rows: Producer<'a, Row>,
    signals: &'a RowSignals,
}

impl RowSink for RowSender<'_> {
    fn row(&mut self, row: &Row) {
        if self.rows.enqueue(*row).is_err() {
            self.signals.lost.fetch_add(1, Ordering::Relaxed);
        }
        self.signals.filled.signal(());
    }
}

/// The end of the queue in the console's runner.
pub(super) struct RowReceiver<'a> {
    rows: Consumer<'a, Row>,
    signals: &'a RowSignals,
}

impl RowReceiver<'_> {
    /// Passes all rows to `sink`, for ever.
    pub(super) async fn run(&mut self, sink: &mut impl RowSink) -> ! {
        loop {
            self.signals.filled.wait().await;
            while let Some(row) = self.rows.dequeue() {
                sink.row(&row);
            }
        }
    }
}

/// The part of the program that measures. Everything that it shares with other priorities is `Sync`.
pub struct Measurement<'a> {
    measurement: MeasurementLoop<'a>,
    sender: RowSender<'a>,
    dut: &'a sensors::Shared,
    drive: &'a DriveState,
    commands: &'a Mailbox<Command>,
}

impl<'a> Measurement<'a> {
    pub(super) fn new(
        measurement: MeasurementLoop<'a>,
        queue: &'a mut RowQueue,
        signals: &'a RowSignals,
        dut: &'a sensors::Shared,
        drive: &'a DriveState,
        commands: &'a Mailbox<Command>,
    ) -> (Self, RowReceiver<'a>) {
        let (producer, consumer) = queue.split();
        let sender = RowSender { rows: producer, signals };
        (Self { measurement, sender, dut, drive, commands }, RowReceiver { rows: consumer, signals })
    }

    /// Shortest and longest time between rows so far.
    pub fn pace(&self) -> Pace {
        self.measurement.pace()
    }

    /// Rows lost so far because the console did not take them.
    pub fn rows_lost(&self) -> u32 {
        self.sender.signals.lost.load(Ordering::Relaxed)
    }

    /// Runs for ever. Borrows itself, so that the future stays small and its owner decides where it is stored.
    pub async fn run<B: Board>(&mut self, board: &mut B) {
        let Self { measurement, sender, dut, drive, commands } = self;
        let clock = board.clock();
        let hardware: Hardware = *measurement.hardware();
        let start: Ticks = next_start(clock.now());
        let sensor_bus = board.sensor_bus();
        let sensor = pin!(async {
            if let Some(line) = sensor_bus {
                let sensor = sensors::DetectedSensor::new(line, clock.clone());
                sensors::Runner::new(sensor, clock.clone(), dut).run().await;
            }
        });
        // Without end, for practical purposes.
        let measurement = pin!(measurement.run(board, start, u64::MAX, sender));
        let setpoints = pin!(setpoints::run(drive, &hardware, &clock, commands, start));
        join3(separate(sensor), separate(measurement), separate(setpoints)).await;
    }
}

/// A future whose code stays a separate function, for a smaller stack frame of their common caller.
pub(super) fn separate<F: Future>(mut future: Pin<&mut F>) -> impl Future<Output = F::Output> {
    #[inline(never)]
    fn poll<F: Future>(future: Pin<&mut F>, context: &mut Context<'_>) -> Poll<F::Output> {
        future.poll(context)
    }
    poll_fn(move |context| poll(future.as_mut(), context))
}

//! The measurement loop is independent of the speed loop: wrong reports or inputs of the speed loop do not change the rows or the results.
#![allow(clippy::unwrap_used)]

use hal_sim::board::{Bench, PlantPort, SimBoard};
use hal_sim::clock::{self, VirtualClock};
use hal_sim::peripherals::SensorSetup;
use stand_firmware::board::{Drive, EncoderCount, Hardware, Sensed, TickIo, Ticks};
use stand_firmware::mailbox::Mailbox;
use stand_firmware::measurement_loop::{Instruments, MeasurementLoop, Row, RowSink};
use stand_firmware::speed_loop::{Config, Interrupt, Mailboxes, Mode, Report, Settings, SpeedLoop};
use std::cell::RefCell;
use std::f64::consts::TAU;

/// A platform that turns by itself: 7 rad/s with a ripple of 0.1 %, nine times a turn. The command of the bridge has no effect.
struct Turntable {
    t_s: f64,
}

const RATE: f64 = 7.0;

impl Turntable {
    fn theta(&self) -> f64 {
        RATE * self.t_s - 1.0 + 1e-3 / 9.0 * (9.0 * RATE * self.t_s).sin()
    }
}

impl PlantPort for Turntable {
    fn advance(&mut self, _: f64, dt_s: f64) {
        self.t_s += dt_s;
    }
    fn theta_rad(&self) -> f64 {
        self.theta()
    }
    fn rate_rad_s(&self) -> f64 {
        RATE * (1.0 + 1e-3 * (9.0 * RATE * self.t_s).cos())
    }
    fn mean_current_A(&self) -> f64 {
        0.25
    }
    fn supply_V(&self) -> f64 {
        12.0
    }
    fn temp_C(&self) -> f64 {
        25.0
    }
    fn true_theta_rad(&self) -> f64 {
        self.theta()
    }
}

/// Manipulation of the interrupt's hardware.
#[derive(Clone, Copy, PartialEq)]
enum Tick {
    Sound,
    /// The encoder wires of the speed loop are disconnected: counter and index stand still.
    WireOff,
    /// The counter of the speed loop runs backwards at three times the rate.
    Wrong,
}

struct Io<'a, T>(&'a mut T, Tick);

impl<T: TickIo> TickIo for Io<'_, T> {
    fn sense(&mut self) -> Sensed {
        let sensed = self.0.sense();
        match self.1 {
            Tick::Sound => sensed,
            Tick::WireOff => Sensed { encoder: EncoderCount(0), edge_age: u32::MAX, ..sensed },
            Tick::Wrong => Sensed { encoder: EncoderCount(sensed.encoder.0.wrapping_mul(65_533)), ..sensed },
        }
    }
    fn index(&mut self) -> Option<EncoderCount> {
        self.0.index().filter(|_| self.1 == Tick::Sound)
    }
    fn drive(&mut self, out: Drive) {
        self.0.drive(out);
    }
}

struct Kept<'a>(Vec<Row>, &'a Instruments);

impl RowSink for Kept<'_> {
    fn row(&mut self, row: &Row) {
        self.0.push(*row);
        self.1.add(row);
    }
}

/// Ten seconds of rows; with `reports_false` the interrupt reports false numbers.
fn rows(tick: Tick, reports_false: bool) -> (Vec<Row>, Instruments) {
    let hardware = Hardware::default();
    let clock = VirtualClock::default();
    let bench = RefCell::new(Bench::new(&hardware, &SensorSetup::default(), 1, Box::new(Turntable { t_s: 0.0 })));
    let (mailboxes, false_reports) = (Mailboxes::new(), Mailbox::new());
    let config = Config::new(&Settings::default(), &hardware).unwrap();
    let mut interrupt = Interrupt::new(SpeedLoop::new(config), &mailboxes);
    let instruments = Instruments::new(hardware);
    let mut sink = Kept(Vec::new(), &instruments);
    let mut measurement = MeasurementLoop::new(hardware, if reports_false { &false_reports } else { &mailboxes.reports });
    let mut board = SimBoard::new(&bench, &clock);
    let mut n = 0_u64;
    clock::run(&clock, measurement.run(&mut board, Ticks(20_000), 10_000, &mut sink), |to| {
        bench.borrow_mut().advance(to, |io| {
            interrupt.run(&mut Io(io, tick));
            if reports_false {
                n += 1;
                // A rate and a position that no stand has.
                false_reports.post(Report {
                    tick: n,
                    position_command: (n as i64) << 40,
                    rate_command: i64::MAX >> 8,
                    mode: Mode::Rate,
                    ..Report::default()
                });
            }
        });
    })
    .unwrap();
    let Kept(rows, _) = sink;
    (rows, instruments)
}

/// A row without the values of the speed loop: its commands, and its rate feedback.
fn measured(row: &Row) -> Row {
    let none = Row::default();
    Row {
        u_V: 0.0,
        rate_cmd_rad_s: None,
        theta_cmd_rad: None,
        loop_rate_rad_s: 0.0,
        loop_rate_age_s: 0.0,
        limits: none.limits,
        compensating: none.compensating,
        fault: none.fault,
        mode: none.mode,
        ..*row
    }
}

#[test]
fn a_speed_loop_with_false_reports_or_without_encoder_does_not_change_the_measurement() {
    let (sound, instruments) = rows(Tick::Sound, false);
    let (turn, stability) = (instruments.turn(10), instruments.stability());
    for (tick, reports_false) in [(Tick::Sound, true), (Tick::WireOff, false), (Tick::Wrong, false), (Tick::Wrong, true)] {
        let (others, instruments) = rows(tick, reports_false);
        assert_eq!(sound.len(), others.len());
        for (a, b) in sound.iter().zip(&others) {
            assert_eq!(measured(a), measured(b));
        }
        assert_eq!((turn, stability), (instruments.turn(10), instruments.stability()));
    }
    // The false reports appear in the command columns only.
    assert!(rows(Tick::Sound, true).0[5000].rate_cmd_rad_s.unwrap() > 1e3 && sound[5000].rate_cmd_rad_s.is_none());
}

#[test]
fn turns_are_timed_to_an_edge_timer_step_and_the_ripple_is_resolved_in_angle() {
    let (rows, instruments) = rows(Tick::Sound, false);
    let turn = instruments.turn(10).unwrap();
    // A ripple periodic in the turn does not change the time of a turn.
    assert!((turn.turn_s / (TAU / RATE) - 1.0).abs() < 3e-8, "{turn:?}");
    assert!(turn.turns == 10 && (turn.rate_rad_s / RATE - 1.0).abs() < 3e-9, "{turn:?}");
    assert!(turn.age_s > 0.0 && turn.age_s < TAU / RATE);
    let [one, ten, whole] = instruments.stability();
    println!(
        "1 σ of the rate: 1° {:.1} ppm, 10° {:.1} ppm, 360° {:.4} ppm",
        1e6 * one.relative().unwrap(),
        1e6 * ten.relative().unwrap(),
        1e6 * whole.relative().unwrap()
    );
    let rms = 1e-3 / 2_f64.sqrt();
    assert!((one.relative().unwrap() / rms - 1.0).abs() < 0.01 && (ten.relative().unwrap() / rms - 0.900).abs() < 0.02);
    assert!(whole.windows >= 9 && whole.relative().unwrap() < 3e-8, "{whole:?}");
    // The column is empty before the first turn; afterwards it has the last turn.
    let first = rows.iter().position(|row| row.turn.is_some()).unwrap();
    assert!((rows[first].t_s - (1.0 + TAU) / RATE).abs() < 3e-3, "{}", rows[first].t_s);
    let timing = instruments.timing();
    assert_eq!((timing.rows, timing.missed, timing.min_s, timing.max_s), (10_000, 0, 1e-3, 1e-3));
}

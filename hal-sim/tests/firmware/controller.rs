//! The whole controller behind its line, in virtual time: replies, stream, stop, bad line and power cut.
#![allow(clippy::unwrap_used)]

use hal_sim::clock::{SimClock, VirtualClock};
use hal_sim::controller::{Controller, flash};
use hal_sim::faults::{Fault, FaultKind, Faults};
use hal_sim::peripherals::SimFlash;
use hal_sim::plant::{Plant, Stand};
use stand_firmware::board::{Clock, TICKS_PER_ROW, TICKS_PER_S, Ticks};
use stand_firmware::reset_cause::ResetCause;
use stand_firmware::telemetry::frame::Piece;
use stand_firmware::telemetry::{Body, Deframer};
use std::cell::RefCell;

/// The host side of the line.
struct Host<'a, 'c> {
    controller: &'a Controller<'c>,
    clock: SimClock<'c>,
    received: RefCell<Vec<u8>>,
}

impl Host<'_, '_> {
    async fn wait_s(&self, seconds: f64) {
        self.clock.until(self.clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
        self.controller.line().receive(&mut self.received.borrow_mut());
    }

    /// Bytes received since the last call.
    fn received(&self) -> Vec<u8> {
        self.received.take()
    }

    /// Sends a line and returns the reply within `seconds`.
    async fn query_within(&self, line: &str, seconds: f64) -> String {
        self.received();
        self.controller.line().send(format!("{line}\n").as_bytes());
        self.wait_s(seconds).await;
        String::from_utf8(self.received()).unwrap().trim_end().to_owned()
    }

    async fn query(&self, line: &str) -> String {
        self.query_within(line, 0.05).await
    }
}

/// Switches a controller on and runs `script` as its host.
fn talk<T>(faults: Faults, flash: SimFlash, script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> (T, SimFlash) {
    let stand = Stand { faults, ..Stand::default() };
    let clock = VirtualClock::default();
    let controller = Controller::new(&clock, &stand.setup(), Plant::new(&stand, -1.0).unwrap(), flash, 1).unwrap();
    let host = Host { controller: &controller, clock: controller.clock(), received: RefCell::default() };
    controller.line().send(b"HOST:UNATTended 1E6\n");
    let done = controller.run(script(&host), |_| ()).unwrap();
    (done, controller.into_flash())
}

fn sound<T>(script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> T {
    talk(Faults::default(), flash(1), script).0
}

fn true_rate(host: &Host<'_, '_>) -> f64 {
    host.controller.bench().borrow().plant().true_rate_rad_s()
}

#[test]
fn it_says_who_it_is_and_holds_a_rate_that_is_physically_so() {
    sound(async |host| {
        host.wait_s(0.1).await;
        host.received();
        assert_eq!(host.query("*IDN?").await, format!("Rotary Stand,simulated,SIM-1,{}", stand_firmware::VERSION));
        assert_eq!(host.query("SOURce:RATE 5 RAD/S;:SOURce:MODE RATE;:SYSTem:ERRor?").await, "0,\"No error\"");
        host.wait_s(1.0).await;
        assert!((true_rate(host) - 5.0).abs() < 0.05, "{}", true_rate(host));
        assert_eq!(host.query("OUTPut OFF;:SYSTem:ERRor?").await, "0,\"No error\"");
        host.wait_s(1.0).await;
        assert!(true_rate(host).abs() < 1.0, "the rate decreases: {}", true_rate(host));
    });
}

#[test]
fn the_byte_0x18_stops_the_drive_in_the_interrupt_in_both_modes() {
    for streams in [false, true] {
        sound(async |host| {
            host.wait_s(0.1).await;
            host.query("SOURce:RATE 5 RAD/S;:SOURce:MODE RATE").await;
            if streams {
                host.controller.line().send(b"STReam ON\n");
            }
            host.wait_s(1.0).await;
            host.received();
            host.controller.line().send(b"\x18");
            host.wait_s(0.02).await;
            // Pending stream data is sent first.
            host.wait_s(0.1).await;
            host.received();
            let fault = host.query("FAULt?").await;
            assert!(fault.contains("emergency stop"), "streams {streams}: {fault}");
            host.wait_s(1.0).await;
            assert!(true_rate(host) < 3.0, "the drive is off: {}", true_rate(host));
        });
    }
}

#[test]
fn ten_seconds_of_rows_at_1_khz_arrive_complete_and_in_sequence() {
    sound(async |host| {
        host.wait_s(0.1).await;
        host.query("SOURce:RATE 5 RAD/S;:SOURce:MODE RATE").await;
        host.controller.line().send(b"STReam ON\n");
        host.wait_s(10.0).await;
        let mut deframer = Deframer::default();
        let (mut rows, mut last, mut next_seq) = (0, None, None);
        for byte in host.received() {
            let Some(piece) = deframer.push(byte) else { continue };
            let Piece::Frame(frame) = piece else { panic!("a damaged piece") };
            assert!(next_seq.is_none_or(|seq: u16| seq == frame.seq), "{next_seq:?} {}", frame.seq);
            next_seq = Some(frame.seq.wrapping_add(1));
            if let Body::Row(row) = frame.body {
                assert!(last.is_none_or(|last: u32| row.sequence == last + 1));
                last = Some(row.sequence);
                rows += 1;
            }
        }
        assert!((9990..=10_000).contains(&rows), "{rows}");
    });
}

#[test]
fn after_a_power_cut_the_controller_restarts_with_saved_settings() {
    let faults = Faults::of([Fault::new(FaultKind::PowerCut, 2.0, 0.5)]).unwrap();
    let (cuts, _) = talk(faults, flash(7), async |host| {
        host.wait_s(0.1).await;
        assert_eq!(host.query("SETTings:current_limit_A 1.25;:SETTings:SAVE;:SYSTem:ERRor?").await, "0,\"No error\"");
        assert_eq!(host.query("SETTings:slip_rad 0.2;:SYSTem:ERRor?").await, "0,\"No error\"");
        host.query("SOURce:RATE 5 RAD/S;:SOURce:MODE RATE").await;
        host.wait_s(1.0).await;
        assert!(true_rate(host) > 4.9);
        // The power cut, and the restart.
        host.wait_s(1.0).await;
        assert_eq!(host.query("*IDN?").await, "", "no reply without supply");
        host.wait_s(1.0).await;
        host.received();
        assert!(host.query("*IDN?").await.starts_with("Rotary Stand"));
        assert!(host.query("SETTings:current_limit_A?").await.starts_with("1.25"), "the saved value is restored");
        assert!(host.query("SETTings:slip_rad?").await.starts_with("0.1"), "the unsaved value is lost");
        assert!(host.query("FAULt?").await.starts_with("0,"), "a restart is not a fault");
        host.wait_s(2.0).await;
        assert!(true_rate(host).abs() < 1.0, "and the drive is off: {}", true_rate(host));
        host.controller.power_cuts()
    });
    assert_eq!(cuts, 1);
}

#[test]
fn on_a_bad_line_no_damaged_command_is_executed_and_no_damaged_frame_accepted() {
    let faults = [FaultKind::LineFlips, FaultKind::LineLoses, FaultKind::LineInserts]
        .map(|what| Fault::new(what, 0.3, f64::INFINITY).with_magnitude(0.003));
    let (shown, _) = talk(Faults::of(faults).unwrap(), flash(1), async |host| {
        host.wait_s(0.1).await;
        host.controller.line().send(b"STReam:CHANnels theta_rad,rate_cmd_rad_s\nSTReam ON\n");
        host.wait_s(0.3).await;
        // A checked command a hundred times: some arrive damaged; none of them may set another rate.
        for _ in 0..100 {
            host.controller.line().send(checked("SOURce:RATE 3 RAD/S;:SOURce:MODE RATE").as_bytes());
            host.wait_s(0.05).await;
        }
        let mut deframer = Deframer::default();
        let mut shown = 0;
        for byte in host.received() {
            if let Some(Piece::Frame(frame)) = deframer.push(byte)
                && let Body::Row(row) = frame.body
            {
                shown += 1;
                let command = row.value("rate_cmd_rad_s").unwrap();
                assert!(command.is_nan() || (0.0..=3.000_1).contains(&command), "{command}");
            }
        }
        assert!(deframer.damaged() > 100, "the line was bad: {}", deframer.damaged());
        shown
    });
    assert!(shown > 1000, "{shown}");
}

fn checked(command: &str) -> String {
    format!("{command}~{:08X}\n", stand_firmware::telemetry::crc32(command.as_bytes()))
}

#[test]
fn two_controllers_with_one_seed_send_equal_bytes() {
    let output = || {
        sound(async |host| {
            host.wait_s(0.1).await;
            host.controller.line().send(b"SOURce:RATE 5 RAD/S;:SOURce:MODE RATE;:STReam ON\n");
            host.wait_s(0.5).await;
            host.received()
        })
    };
    let first = output();
    assert!(first.len() > 20_000);
    assert!(first == output());
}

#[test]
fn an_unplugged_line_is_silent_and_works_again_after_reconnection() {
    let faults = Faults::of([Fault::new(FaultKind::LineOff, 0.2, 0.3)]).unwrap();
    talk(faults, flash(1), async |host| {
        host.wait_s(0.1).await;
        assert!(host.query("*IDN?").await.starts_with("Rotary"));
        host.clock.until(Ticks(3_000_000)).await;
        assert_eq!(host.query("*IDN?").await, "");
        host.clock.until(Ticks(6_000_000)).await;
        assert!(host.query("*IDN?").await.starts_with("Rotary"));
    });
}

/// Rows received in `seconds` of a stream at 5 rad/s beside a console whose polls take `poll_ms`, and rows that found the queue full.
fn stream_with_busy_console(poll_ms: u64, seconds: f64) -> (Vec<u32>, u32) {
    let stand = Stand::default();
    let clock = VirtualClock::default();
    let controller = Controller::new(&clock, &stand.setup(), Plant::new(&stand, -1.0).unwrap(), flash(1), 1).unwrap();
    let host = Host { controller: &controller, clock: controller.clock(), received: RefCell::default() };
    let script = async {
        host.wait_s(0.1).await;
        host.query("HOST:UNATTended 1E6;:SOURce:RATE 5 RAD/S;:SOURce:MODE RATE").await;
        controller.burden_console(poll_ms * TICKS_PER_ROW);
        controller.line().send(b"STReam ON\n");
        host.wait_s(seconds).await;
        let mut deframer = Deframer::default();
        let mut sequences = Vec::new();
        for byte in host.received() {
            if let Some(Piece::Frame(frame)) = deframer.push(byte)
                && let Body::Row(row) = frame.body
            {
                sequences.push(row.sequence);
            }
        }
        assert!((true_rate(&host) - 5.0).abs() < 0.1, "the setpoints continue");
        sequences
    };
    let sequences = controller.run(script, |_| ()).unwrap();
    (sequences, controller.rows_lost())
}

#[test]
fn rows_survive_a_console_that_never_yields() {
    // 3 ms is longer than the longest poll of the chip's console. On one executor, two of three rows are not measured.
    let (sequences, lost) = stream_with_busy_console(3, 5.0);
    assert!(sequences.len() > 4_950, "{}", sequences.len());
    assert!(sequences.windows(2).all(|pair| pair[1] == pair[0] + 1), "a row is missing");
    assert_eq!(lost, 0);
}

#[test]
fn rows_that_find_the_queue_full_are_counted() {
    // Polls of 40 ms exceed the queue of 15 rows. Each row is either taken by the console or counted.
    let (sequences, lost) = stream_with_busy_console(40, 4.0);
    assert!((2_000..3_000).contains(&lost), "{lost}");
    assert!(sequences.windows(2).any(|pair| pair[1] > pair[0] + 1), "the gap shows in the numbers");
}

/// Errors and fault after a command.
async fn state_of(host: &Host<'_, '_>) -> String {
    host.query("SYSTem:ERRor?;:FAULt?").await
}

const SOUND: &str = "0,\"No error\";0,none,nothing is wrong";

#[test]
fn seventeen_saves_while_off_succeed_and_the_next_while_it_turns_is_refused() {
    sound(async |host| {
        host.wait_s(0.1).await;
        let uptime_s = async || -> f64 {
            let reply = host.query("SYSTem:UPTime?").await;
            reply.trim_end_matches(" S").parse().unwrap()
        };
        for save in 1..=17 {
            let (before_s, clock_s) = (uptime_s().await, host.clock.now().seconds());
            host.query_within(&format!("SETTings:slip_rad 0.{};:SETTings:SAVE", 100 + save), 0.6).await;
            assert_eq!(state_of(host).await, SOUND, "save {save}");
            // The time of the stand goes on through the erase of save 17.
            let (after_s, passed_s) = (uptime_s().await, host.clock.now().seconds() - clock_s);
            assert!((after_s - before_s - passed_s).abs() < 0.002, "save {save}: {before_s} {after_s} {passed_s}");
        }
        host.query("SOURce:RATE 5 RAD/S;:SOURce:MODE RATE").await;
        host.wait_s(1.0).await;
        host.query_within("SETTings:SAVE", 0.6).await;
        let refusal = host.query("SYSTem:ERRor?").await;
        assert!(refusal.starts_with("-221") && refusal.contains("OUTPut OFF"), "{refusal}");
        assert!((true_rate(host) - 5.0).abs() < 0.05, "and the drive goes on");
        // Switched off, it still turns: the save waits until it stands.
        host.query_within("OUTPut OFF;:SETTings:SAVE;*OPC?", 0.1).await;
        assert!(true_rate(host).abs() > 0.5, "{}", true_rate(host));
        host.wait_s(3.0).await;
        host.received();
        assert_eq!(state_of(host).await, SOUND);
    });
}

/// A controller whose next save erases a sector.
fn full_flash() -> SimFlash {
    talk(Faults::default(), flash(1), async |host| {
        host.wait_s(0.1).await;
        for _ in 0..16 {
            host.query_within("SETTings:SAVE", 0.1).await;
        }
    })
    .1
}

#[test]
fn an_erase_loses_ticks_and_neither_commands_nor_the_time() {
    talk(Faults::default(), full_flash(), async |host| {
        host.wait_s(0.1).await;
        host.received();
        host.controller.line().send(b"SETTings:SAVE\n");
        host.wait_s(0.05).await;
        // The core is stalled: this command waits in the ring of the receiver.
        host.controller.line().send(b"*IDN?\n");
        host.wait_s(0.1).await;
        assert_eq!(host.received(), b"", "no reply during the erase");
        host.wait_s(0.3).await;
        assert!(String::from_utf8(host.received()).unwrap().starts_with("Rotary Stand"));
        assert_eq!(state_of(host).await, SOUND);
        assert!(
            host.query("MEASure:TIMing?").await.contains("0.25"),
            "the rows of the erase are missing: {}",
            host.query("MEASure:TIMing?").await
        );
        assert_eq!(host.controller.line().counts().overrun, 0);
    });
}

#[test]
fn bytes_beyond_the_ring_of_the_receiver_are_lost_in_an_erase() {
    talk(Faults::default(), full_flash(), async |host| {
        host.wait_s(0.1).await;
        host.controller.line().send(b"SETTings:SAVE\n");
        host.wait_s(0.05).await;
        host.controller.line().send(&b"*IDN?\n".repeat(300));
        host.wait_s(0.5).await;
        assert!(host.controller.line().counts().overrun > 0);
        host.received();
        assert!(host.query("*IDN?").await.starts_with("Rotary Stand"), "the line works again");
    });
}

#[test]
fn the_cause_of_a_reset_is_reported_and_the_drive_is_off_after_it() {
    sound(async |host| {
        host.wait_s(0.1).await;
        assert_eq!(host.query("SYSTem:RESet:CAUSe?").await, "power-on");
        host.query("SOURce:RATE 5 RAD/S;:SOURce:MODE RATE").await;
        host.wait_s(1.0).await;
        host.controller.reset(ResetCause::Watchdog);
        host.wait_s(0.2).await;
        host.received();
        assert_eq!(host.query("SYSTem:RESet:CAUSe?;:OUTPut?;:FAULt?").await, "watchdog;0;0,none,nothing is wrong");
        host.wait_s(2.0).await;
        assert!(true_rate(host).abs() < 1.0, "{}", true_rate(host));
    });
    // A power cut is a power-on.
    let faults = Faults::of([Fault::new(FaultKind::PowerCut, 0.5, 0.5)]).unwrap();
    talk(faults, flash(1), async |host| {
        host.wait_s(1.2).await;
        host.received();
        assert_eq!(host.query("SYSTem:RESet:CAUSe?").await, "power-on");
        assert_eq!(host.controller.power_cuts(), 1);
    });
}

/// Presses the button for `seconds`.
async fn press(host: &Host<'_, '_>, seconds: f64) {
    host.controller.press_button(true);
    host.wait_s(seconds).await;
    host.controller.press_button(false);
    host.wait_s(0.1).await;
}

#[test]
fn the_button_clears_with_one_press_and_starts_with_the_next() {
    // Ticks are lost at 1 s.
    let faults = Faults::of([Fault::new(FaultKind::LostTicks, 1.0, 0.001)]).unwrap();
    talk(faults, flash(1), async |host| {
        host.wait_s(0.1).await;
        host.query("PROFile:TYPE CONSTANT;AMPLitude 5;DURation 60").await;
        press(host, 0.2).await;
        assert_eq!(host.query("OUTPut?").await, "1", "a press starts the profile");
        host.wait_s(1.0).await;
        assert!(host.query("FAULt?").await.contains("clock"));
        press(host, 0.2).await;
        host.wait_s(0.5).await;
        assert_eq!(host.query("FAULt?;:OUTPut?").await, "0,none,nothing is wrong;0", "cleared, and not started");
        press(host, 0.2).await;
        assert_eq!(host.query("OUTPut?").await, "1");
        press(host, 0.2).await;
        assert!(host.query("FAULt?;:OUTPut?").await.contains("emergency stop"), "a press while the drive is on");
    });
}

#[test]
fn no_press_of_the_button_clears_an_emergency_stop() {
    sound(async |host| {
        host.wait_s(0.1).await;
        host.query("PROFile:TYPE CONSTANT;AMPLitude 5;DURation 60;:PROFile:STARt").await;
        host.wait_s(0.5).await;
        host.controller.line().send(b"\x18");
        host.wait_s(0.5).await;
        for seconds in [0.05, 0.2, 1.0, 3.0] {
            press(host, seconds).await;
            host.wait_s(0.5).await;
            let state = host.query("FAULt?;:OUTPut?").await;
            assert!(state.contains("emergency stop") && state.ends_with(";0"), "{seconds} s: {state}");
        }
        // The LED blinks fast: five changes in half a second.
        let mut changes = 0;
        let mut before = host.controller.is_led_on();
        for _ in 0..50 {
            host.wait_s(0.01).await;
            changes += u32::from(std::mem::replace(&mut before, host.controller.is_led_on()) != before);
        }
        assert!((4..=6).contains(&changes), "{changes}");
        // The console clears and starts on one line.
        assert_eq!(
            host.query("FAULt:CLEar;:PROFile:STARt;:SYSTem:ERRor:NEXT?").await,
            "101,\"Drive switched off; emergency stop: release the stop, then FAULt:CLEar; the button does not clear it\""
        );
        assert_eq!(host.query("SYSTem:ERRor?;:OUTPut?").await, "0,\"No error\";1");
    });
}

#[test]
fn an_emergency_stop_replaces_another_fault() {
    let faults = Faults::of([Fault::new(FaultKind::LostTicks, 1.0, 0.001)]).unwrap();
    talk(faults, flash(1), async |host| {
        host.wait_s(1.2).await;
        assert!(host.query("FAULt?").await.contains("clock"));
        host.controller.line().send(b"\x18");
        host.wait_s(0.1).await;
        press(host, 0.2).await;
        assert!(host.query("FAULt?").await.contains("emergency stop"));
        assert_eq!(host.query("FAULt:CLEar;:FAULt?").await, "0,none,nothing is wrong");
    });
}

#[test]
fn self_test_passes_on_a_sound_stand_and_names_what_is_wrong() {
    let drive_test = async |host: &Host<'_, '_>, before: &str| -> String {
        host.wait_s(0.3).await;
        host.query(before).await;
        host.query("TEST:DRIVe:STARt").await;
        assert_eq!(host.query("TEST:DRIVe?").await, "RUNNING");
        host.wait_s(3.0).await;
        host.query("TEST:DRIVe?").await
    };
    sound(async |host| {
        let result = drive_test(host, "*CLS").await;
        let ratio: f64 = result.strip_prefix("PASSED,").unwrap_or_else(|| panic!("{result}")).parse().unwrap();
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
        assert_eq!(host.query("*TST?;:OUTPut?;:SYSTem:ERRor?").await, "0;0;0,\"No error\"");
        host.wait_s(2.0).await;
        let result = drive_test(host, "SETTings:motor_constant_N_m_A 0.05").await;
        assert!(result.starts_with("FAILED,rate does not match the voltage"), "{result}");
        assert!(host.query("SYSTem:ERRor?").await.starts_with("-330,\"Self-test failed; rate does not match"));
    });
    let with = |kind| {
        let (start_s, seconds) = if kind == FaultKind::LostTicks { (1.5, 0.001) } else { (0.0, 60.0) };
        Faults::of([Fault::new(kind, start_s, seconds)]).unwrap()
    };
    for (kind, finding) in [
        (FaultKind::IndexOff, "FAILED,no index in a turn"),
        (FaultKind::CounterStuck, "FAILED,the encoder's counters of loop and measurement disagree"),
        (FaultKind::LostTicks, "FAILED,ended by a fault or a stop"),
    ] {
        talk(with(kind), flash(1), async |host| assert_eq!(drive_test(host, "*CLS").await, finding));
    }
    talk(with(FaultKind::SupplyDip), flash(1), async |host| {
        host.wait_s(0.4).await;
        assert_eq!(host.query("*TST?").await, "32");
        assert_eq!(host.query("SYSTem:ERRor?").await, "-330,\"Self-test failed; supply out of limits\"");
    });
}

/// Times at which a counter of 32 bits wraps: board clock, edge timer (90 MHz), core cycles (180 MHz), microseconds, time stamp of the
/// ISM330DHCX (25 µs), control ticks, milliseconds; and the counter of 16 bits of milliseconds.
#[test]
fn nothing_happens_when_a_counter_wraps() {
    let steps = |count: f64, rate_Hz: f64| (count / rate_Hz * TICKS_PER_S as f64) as u64 / TICKS_PER_ROW * TICKS_PER_ROW;
    const WORD: f64 = 4_294_967_296.0;
    let wraps = [
        steps(WORD, 1e7),
        steps(WORD, 90e6),
        steps(WORD, 180e6),
        steps(WORD, 1e6),
        steps(WORD, 40e3),
        steps(WORD, 1e4),
        steps(WORD, 1e3),
        steps(WORD / 2.0, 1e3),
        steps(65_536.0, 1e3),
    ];
    for wrap in wraps {
        // The wrap comes in the drive, in the count of the unattended time and in the silence of the host.
        for before_s in [2.5, 6.0] {
            let stand = Stand::default();
            let clock = VirtualClock::starting_at(Ticks(wrap - (before_s * TICKS_PER_S as f64) as u64));
            let controller = Controller::new(&clock, &stand.setup(), Plant::new(&stand, -1.0).unwrap(), flash(1), 1).unwrap();
            let host = Host { controller: &controller, clock: controller.clock(), received: RefCell::default() };
            let script = async {
                host.wait_s(0.1).await;
                host.controller
                    .line()
                    .send(b"HOST:UNATTended 3;:PROFile:TYPE SINE;AMPLitude 2;FREQuency_Hz 0.5;DURation 4;STARt;:STReam ON\n");
                host.wait_s(5.0).await;
                let name = format!("wrap at {wrap}, {before_s} s after the start");
                let mut deframer = Deframer::default();
                let mut rows = Vec::new();
                for byte in host.received() {
                    if let Some(Piece::Frame(frame)) = deframer.push(byte)
                        && let Body::Row(row) = frame.body
                    {
                        rows.push((row.sequence, row.at, row.value("omega_rad_s").unwrap_or(f64::NAN)));
                    }
                }
                assert!(rows.len() > 4_900, "{name}: {} rows", rows.len());
                for pair in rows.windows(2) {
                    assert_eq!(pair[0].0.wrapping_add(1), pair[1].0, "{name}: a row is lost");
                    assert!(pair[1].1.abs_diff(pair[0].1 + TICKS_PER_ROW) < 2, "{name}: {pair:?}");
                    assert!((pair[1].2 - pair[0].2).abs() < 0.5, "{name}: {pair:?}");
                }
                assert!(rows.iter().any(|row| row.2 > 1.8) && rows.iter().any(|row| row.2 < -1.8), "{name}");
                // Fault 0, or a host that was silent for 2 s after its 3 s.
                host.controller.line().send(b"STReam OFF\nHOST:UNATTended 0;:FAULt:CLEar;:SOURce:RATE 5;MODE RATE\n");
                host.wait_s(1.9).await;
                assert!((true_rate(&host) - 5.0).abs() < 0.1, "{name}: {} rad/s, {}", true_rate(&host), host.query("FAULt?").await);
                host.wait_s(1.0).await;
                host.received();
                assert!(host.query("FAULt?").await.contains("host silent"), "{name}");
            };
            controller.run(script, |_| ()).unwrap();
        }
    }
}

//! The whole app in virtual time over a serial line: commands typed by a user or sent by a program, and the replies.
#![allow(clippy::unwrap_used)]

use embassy_futures::join::join;
use embassy_futures::select::{Either, select};
use hal_sim::board::linear_motor::LinearMotor;
use hal_sim::board::{Bench, SimBoard};
use hal_sim::clock::{self, SimClock, VirtualClock};
use hal_sim::peripherals::SensorSetup;
use hal_sim::peripherals::flash::{SMALL_SECTOR_BYTES, SimFlash};
use hal_sim::peripherals::serial::{DamageRates, SerialLine, USUAL_BAUD};
use stand_firmware::app::{Identity, Memory, assemble};
use stand_firmware::board::{Clock, TICKS_PER_S};
use stand_firmware::console::{Guard, StopLine};
use stand_firmware::reset_cause::ResetCause;
use stand_firmware::settings::{Kept, Store};
use stand_firmware::telemetry::frame::Piece;
use stand_firmware::telemetry::{Body, Deframer, crc32};
use std::cell::RefCell;

/// A host program at the serial line.
struct Host<'h, 'c> {
    line: &'h SerialLine<'c>,
    clock: SimClock<'c>,
    bench: &'h RefCell<Bench>,
    bytes: RefCell<Vec<u8>>,
}

impl Host<'_, '_> {
    async fn wait(&self, seconds: f64) {
        self.clock.until(self.clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
        self.line.receive(&mut self.bytes.borrow_mut());
    }

    fn send(&self, text: &str) {
        self.line.send(format!("{text}\n").as_bytes());
    }

    /// The output since the last call, as text.
    fn text(&self) -> String {
        let bytes = std::mem::take(&mut *self.bytes.borrow_mut());
        let allowed = |b: &u8| matches!(b, b' '..=b'~' | b'\r' | b'\n');
        assert!(bytes.iter().all(allowed), "text mode contains only text: {:?}", String::from_utf8_lossy(&bytes));
        String::from_utf8(bytes).unwrap()
    }

    async fn query(&self, text: &str) -> String {
        self.send(text);
        self.wait(0.05).await;
        let reply = self.text();
        reply.strip_suffix("\r\n").unwrap_or_else(|| panic!("{text}: {reply:?}")).to_string()
    }

    async fn error(&self) -> String {
        self.query("SYST:ERR?").await
    }

    async fn no_error(&self) {
        assert_eq!(self.error().await, "0,\"No error\"");
    }

    fn true_rate(&self) -> f64 {
        self.bench.borrow().truth()[0].omega_rad_s
    }
}

/// Runs `host` with a stand with this flash; returns the flash.
fn with_flash<T>(flash: SimFlash, baud: u32, host: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> T {
    let defaults = Kept::default();
    let clock = VirtualClock::default();
    let bench = RefCell::new(Bench::new(&defaults.hardware, &SensorSetup::default(), 1, Box::new(LinearMotor::default())));
    let line = SerialLine::new(&clock, baud, 1);
    let stop_line = StopLine::new();
    let mut guard = Guard::new(&stop_line);
    let mut memory = Memory::new();
    let store = Store::new(flash, [0, SMALL_SECTOR_BYTES as u32], SMALL_SECTOR_BYTES as u32);
    let identity = Identity { model: "simulated", serial: "1", baud, reset_cause: ResetCause::PowerOn };
    let (mut interrupt, mut measurement, mut app) = assemble(&mut memory, store, defaults, identity, &stop_line).unwrap();
    let mut board = SimBoard::new(&bench, &clock);
    let (receive, transmit) = line.device();
    let host_end = Host { line: &line, clock: SimClock(&clock), bench: &bench, bytes: RefCell::default() };
    host_end.send("HOST:UNATTended 1E6");
    let device_clock = SimClock(&clock);
    let program = join(measurement.run(&mut board), app.run(&device_clock, receive, transmit));
    let both = select(program, host(&host_end));
    let ended = clock::run(&clock, both, |to| {
        line.deliver(to, |incoming| match incoming {
            Ok(byte) => guard.byte(byte),
            Err(_) => guard.line_break(),
        });
        let mut bench = bench.borrow_mut();
        bench.request_stop(stop_line.is_stop_requested());
        bench.advance(to, |io| interrupt.run(io));
    });
    match ended.unwrap() {
        Either::First(_) => panic!("the app ended"),
        Either::Second(result) => result,
    }
}

fn stand<T>(host: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> T {
    with_flash(SimFlash::new(&[SMALL_SECTOR_BYTES; 2], 1), USUAL_BAUD, host)
}

#[test]
fn the_app_identifies_itself_and_queues_errors() {
    stand(async |host| {
        assert_eq!(host.query("*IDN?").await, format!("Rotary Stand,simulated,1,{}", stand_firmware::VERSION));
        host.no_error().await;
        host.send("FOO:BAR 1");
        host.send("SOUR:RATE 5 V");
        host.send("SOUR:RATE 9E9");
        host.send("SOUR:RATE");
        host.send("*RST 5");
        host.wait(0.05).await;
        assert_eq!(host.text(), "", "errors of a program stay in the queue until queried");
        assert_eq!(host.query("SYST:ERR:COUN?").await, "5");
        for (code, about) in [(-113, "FOO:BAR"), (-131, "5 V"), (-222, "9E9"), (-109, "SOUR:RATE"), (-108, "5")] {
            let error = host.error().await;
            assert!(error.starts_with(&format!("{code},\"")) && error.contains(about), "{error}");
        }
        host.no_error().await;
        assert_eq!(host.query("*ESR?;*ESR?").await, "176;0", "power on, command errors, an execution error");
    });
}

#[test]
fn a_terminal_user_sees_an_error_at_once() {
    stand(async |host| {
        host.line.send(b"SOUR:RTAE 5\r");
        host.wait(0.05).await;
        let output = host.text();
        assert!(output.starts_with("ERROR -113,\"Undefined header; SOUR:RTAE") && output.matches("\r\n").count() == 1, "{output:?}");
        host.line.send(b"SOUR:RTAE 5\r\n");
        host.wait(0.05).await;
        assert_eq!(host.text(), "", "CR LF marks a program");
        assert!(host.error().await.starts_with("-113"));
    });
}

#[test]
fn help_lists_each_accepted_command() {
    stand(async |host| {
        host.send("HELP?");
        host.wait(2.0).await;
        let help = host.text();
        let block = help.strip_suffix("\r\n").unwrap();
        let length: usize = block[2..7].parse().unwrap();
        assert!(block.starts_with("#5") && block.len() == 7 + length, "{} bytes: {:.20}", block.len(), block);
        let lines: Vec<_> = block[7..].split("\r\n").collect();
        assert!(lines.len() > 120, "{}", lines.len());
        host.send("*CLS");
        for line in lines {
            let (command, description) = line.split_once("  ").unwrap_or_else(|| panic!("{line}"));
            assert!(!description.is_empty());
            let header = command.split(' ').next().unwrap();
            // Other tests cover commands that end text mode or wait.
            if ["STReam", "STOP", "HELP?", "*WAI", "*OPC?"].contains(&header) {
                continue;
            }
            // With a suitable parameter, in long and in short form.
            let parameter = match command.split_once(" <") {
                // `NEW` comes first and sets two states.
                Some((_, _)) if header == "OBServer:NEW" => " 2,OFF".to_string(),
                Some((_, _)) if ["OBServer:PHI", "OBServer:VIBRation"].contains(&header) => " 1,0,0".to_string(),
                Some((_, _)) if header == "OBServer:RESPonse" => " 1,0,0,0".to_string(),
                Some((_, kind)) if kind.contains("each state") => " 0,0".to_string(),
                Some((_, kind)) if kind.starts_with("ON") => " OFF".to_string(),
                Some((_, kind)) if kind.contains('|') => format!(" {}", kind.split('|').next().unwrap()),
                Some((_, kind)) if kind.contains(" to ") => " DEF".to_string(),
                Some((_, _)) if header.ends_with("TYPE") => " sine".to_string(),
                Some((_, _)) if header.ends_with("CHANnels") => " u_V,i_A".to_string(),
                Some((_, _)) if header.ends_with("HARMonic") => " 7,1 MN.M,0".to_string(),
                Some((_, _)) => " 1".to_string(),
                None => String::new(),
            };
            let short: String = header.chars().filter(|c| !c.is_lowercase()).collect();
            let is_name =
                header.contains(['_']) || header.starts_with("PROFile:") && header.chars().rev().nth(1).is_some_and(char::is_lowercase);
            for form in if is_name { vec![header.to_string()] } else { vec![header.to_string(), short] } {
                host.send(&format!("{form}{}{parameter}", if header.ends_with('?') && !form.ends_with('?') { "?" } else { "" }));
                host.wait(0.02).await;
                let error = host.query("*RST;:SYST:ERR?").await;
                let error = error.rsplit("\r\n").next().unwrap();
                assert!(
                    error.starts_with("0,") || error.starts_with("-230") || error.starts_with("-240") || error.starts_with("103"),
                    "{form}{parameter}: {error}"
                );
                host.send("FAULt:CLEar;*CLS");
                host.wait(0.02).await;
                host.text();
            }
        }
    });
}

#[test]
fn the_drive_spins_up_measures_and_stops() {
    stand(async |host| {
        host.send("SOURce:MODE RATE;RATE 100 DEG/S");
        host.wait(1.0).await;
        let commanded = 100_f64.to_radians();
        assert!((host.true_rate() - commanded).abs() < 0.02, "{}", host.true_rate());
        let reply = host.query("MEASure:RATE?").await;
        // One count of 20 000 in 32 ms is 0.01 rad/s.
        assert!((reply.parse::<f64>().unwrap() - commanded).abs() < 0.03, "{reply}");
        assert_eq!(host.query("SOUR:MODE?;RATE?;:OUTP?").await, "RATE;1.74532925;1");
        assert_eq!(host.query("FORM:UNIT ON;:SOUR:RATE?;:*RST;:FORM:UNIT?").await, "1.74532925 RAD/S;0");
        host.no_error().await;
        host.send("STOP");
        host.wait(3.0).await;
        assert!(host.true_rate().abs() < 0.5, "{}", host.true_rate());
        assert_eq!(host.query("OUTP?").await, "0");
    });
}

#[test]
fn a_stream_carries_rows_and_replies_without_gaps_and_0x18_ends_it() {
    stand(async |host| {
        host.send("STR:CHAN theta_rad,i_A,rate_cmd_rad_s,from_index_rad;DEC 2");
        host.send("SOUR:MODE RATE;RATE 2");
        host.wait(4.0).await;
        assert_eq!(host.text(), "");
        host.send("STReam ON");
        host.wait(0.5).await;
        host.send("*IDN?");
        host.send("FOO");
        host.wait(0.5).await;
        let bytes = std::mem::take(&mut *host.bytes.borrow_mut());
        let mut deframer = Deframer::default();
        let (mut rows, mut texts, mut beats, mut hello, mut last) = (Vec::new(), Vec::new(), 0, 0, None);
        for byte in bytes {
            let Some(Piece::Frame(frame)) = deframer.push(byte) else { continue };
            assert!(last.is_none_or(|last: u16| frame.seq == last.wrapping_add(1)), "no gap");
            last = Some(frame.seq);
            match frame.body {
                Body::Row(row) => rows.push(row),
                Body::Text(text) => texts.push(text.to_string()),
                Body::Beat(beat) => beats += u32::from(beat.lost == 0),
                Body::Hello(header) => {
                    hello += u32::from(header.decimation == 2 && header.zero_is_index && header.identity.starts_with("Rotary Stand"))
                }
            }
        }
        assert_eq!((deframer.damaged(), hello), (0, 1));
        assert!((490..=510).contains(&rows.len()) && beats >= 1, "{} rows, {beats} beats", rows.len());
        for pair in rows.windows(2) {
            assert_eq!((pair[1].sequence - pair[0].sequence, pair[1].at - pair[0].at), (2, 20_000));
        }
        let names: Vec<_> = rows[0].named().map(|(name, _)| name).collect();
        assert_eq!(names, ["i_A", "theta_rad", "rate_cmd_rad_s", "from_index_rad"]);
        let value = |name| rows[0].named().find(|(n, _)| *n == name).unwrap().1;
        let half_count_rad = std::f64::consts::PI / 20_000.0;
        assert!((value("from_index_rad") - value("theta_rad") - half_count_rad).abs() % std::f64::consts::TAU < 1e-8, "from the index");
        assert_eq!(texts.len(), 2);
        assert!(texts[0].starts_with("Rotary Stand") && texts[1].starts_with("ERROR -113"), "{texts:?}");

        host.line.send(&[0x18]);
        host.wait(0.3).await;
        host.bytes.borrow_mut().clear();
        assert_eq!(host.query("OUTP?").await, "0", "text again, and the drive is off");
        host.send("*CLS;FAUL:CLE");
        host.send("STReam ON");
        host.wait(0.1).await;
        host.line.send_break();
        host.wait(0.1).await;
        host.bytes.borrow_mut().clear();
        assert!(host.query("*IDN?").await.starts_with("Rotary"), "a break ends the stream as well");
    });
}

#[test]
fn a_stream_above_the_line_rate_is_refused_with_its_load() {
    with_flash(SimFlash::new(&[SMALL_SECTOR_BYTES; 2], 1), 115_200, async |host: &Host<'_, '_>| {
        host.send("STReam ON");
        let error = host.error().await;
        assert!(error.starts_with("102,\"") && error.contains('%') && error.contains("115200"), "{error}");
        host.send("STR:DEC 10");
        host.send("STR ON");
        host.wait(0.5).await;
        assert!(host.bytes.borrow().contains(&0), "with decimation the line rate suffices");
    });
}

#[test]
fn a_profile_runs_and_opc_waits_for_its_end() {
    stand(async |host| {
        host.send("PROF:TYPE sine;AMPL 3;FREQ 2;DUR 1.5 S;:PROF:STAR;*OPC?");
        host.wait(0.5).await;
        assert_eq!(host.text(), "", "not complete yet");
        host.wait(1.2).await;
        assert_eq!(host.text(), "1\r\n");
        assert_eq!(host.query("PROF:STAT?;FREQ?").await, "STOPPED;2");
        host.no_error().await;
    });
}

#[test]
fn settings_survive_power_off_and_are_refused_while_the_drive_is_on() {
    stand(async |host| {
        host.send("SOUR:MODE RATE");
        host.send("SETT:rate_gain_V_s_rad 1.5");
        assert!(host.error().await.starts_with("-221"));
        host.send("OUTP OFF;:SETT:RATE_GAIN_V_S_RAD 1.5;:SETT:SAVE;:SETT:RATE_GAIN_V_S_RAD 1.7");
        assert_eq!(host.query("SETT:rate_gain_V_s_rad?").await, "1.7");
        assert_eq!(host.query("SETT:LOAD;:SETT:rate_gain_V_s_rad?").await, "1.5");
        let usual = stand_firmware::speed_loop::Settings::default().rate_gain_V_s_rad;
        assert_eq!(host.query("SETT:RES;:SETT:rate_gain_V_s_rad?").await, usual.to_string());
        host.no_error().await;
    });
}

#[test]
fn a_changed_setting_acts_at_once() {
    stand(async |host| {
        host.send("SETT:acceleration_rad_s2 5 RAD/S2");
        host.send("SOUR:MODE RATE;RATE 10");
        host.wait(1.0).await;
        assert!((4.0..5.5).contains(&host.true_rate()), "{}", host.true_rate());
        host.no_error().await;
    });
}

#[test]
fn the_position_mode_holds_an_angle() {
    stand(async |host| {
        host.send("SOUR:MODE POS;POS 2 TURN");
        host.wait(3.0).await;
        let theta_rad = host.bench.borrow().truth()[0].theta_rad;
        assert!((theta_rad - 2.0 * std::f64::consts::TAU).abs() < 2e-3, "{theta_rad}");
        host.no_error().await;
    });
}

#[test]
fn the_capture_of_a_stop_is_read_out() {
    stand(async |host| {
        host.send("SOUR:MODE RATE;RATE 5");
        host.wait(1.0).await;
        assert_eq!(host.query("FAUL:CAPT?").await, "EMPTY");
        host.send("STOP");
        host.wait(0.2).await;
        let about = host.query("FAUL:CAPT?").await;
        let trigger: usize = about.split(',').nth(1).unwrap().parse().unwrap();
        assert!(about.starts_with("2048,") && about.contains("emergency stop"), "{about}");
        host.send(&format!("FAUL:CAPT:DATA? {},4", trigger - 2));
        host.wait(0.1).await;
        let text = host.text();
        let lines: Vec<_> = text.split("\r\n").filter(|line| !line.is_empty()).collect();
        assert!(lines.len() == 4 && lines[2].starts_with("0.0000,"), "{text}");
        let rate: f64 = lines[0].split(',').nth(4).unwrap().parse().unwrap();
        assert!((rate - 5.0).abs() < 0.1, "{text}");
    });
}

#[test]
fn a_calibration_reports_progress_and_can_be_aborted() {
    stand(async |host| {
        host.send("CAL:COGG:STAR");
        host.wait(5.0).await;
        let progress = host.query("CAL:COGG:PROG?").await;
        let percent: f64 = progress.parse().unwrap();
        assert!((3.0..20.0).contains(&percent), "{progress}");
        host.send("CAL:COGG:STAR");
        assert!(host.error().await.starts_with("-221"), "one at a time");
        host.send("CAL:COGG:ABOR");
        host.wait(0.1).await;
        assert!(host.query("CAL:COGG?").await.starts_with("FAILED,aborted"));
        assert!(host.error().await.starts_with("103,"));
        assert_eq!(host.query("OUTP?").await, "0");
        host.wait(3.0).await;
        host.send("CAL:COGG:STAR;*OPC?");
        host.wait(100.0).await;
        assert_eq!(host.text(), "1\r\n");
        let found = host.query("CAL:COGG?").await;
        // The linear motor has only viscous friction of 5e-6 N m s.
        let numbers = found.strip_prefix("DONE,").map(|rest| rest.split(',').filter_map(|number| number.parse::<f64>().ok()).count());
        assert_eq!(numbers, Some(2), "{found}");
        host.no_error().await;
    });
}

#[test]
fn an_armed_host_watchdog_trips_when_the_host_is_silent() {
    stand(async |host| {
        host.send("HOST:UNATTended 0;ARM 0.5 S;:SOUR:MODE RATE;RATE 2");
        for _ in 0..10 {
            host.wait(0.2).await;
            host.send("HOST:ALIVe");
        }
        assert!((host.true_rate() - 2.0).abs() < 0.1, "the drive runs on");
        host.wait(2.5).await;
        assert!(host.true_rate().abs() < 0.5, "{}", host.true_rate());
        host.text();
        assert!(host.query("FAUL?").await.contains("host silent"));
        host.send("SOUR:MODE RATE");
        assert!(host.error().await.starts_with("101,"), "the fault itself");
        assert!(host.error().await.starts_with("-221"), "no start before the fault is cleared");
        host.send("HOST:ARM 0;:FAUL:CLE");
        host.wait(0.01).await;
        host.send("SOUR:RATE 1;MODE RATE");
        host.wait(1.0).await;
        assert!((host.true_rate() - 1.0).abs() < 0.1);
    });
}

fn checked(command: &str) -> String {
    format!("{command}~{:08X}", crc32(command.as_bytes()))
}

#[test]
fn no_damaged_line_is_executed() {
    stand(async |host| {
        let rates = DamageRates { flip: 0.02, lose: 0.01, insert: 0.01 };
        let (mut obeyed, mut refused) = (0, 0);
        let mut sent = vec![0];
        for n in 0..2000_u32 {
            // After a checked line, a fragment without checksum is not accepted as a plain line.
            let milli_degrees = (n * 7919) % 90_000 + 1;
            host.line.damage(rates, DamageRates::NONE);
            host.send(&checked(&format!("SOUR:RATE {}.{:03} DEG/S", milli_degrees / 1000, milli_degrees % 1000)));
            if n == 0 {
                host.line.damage(DamageRates::NONE, DamageRates::NONE);
            }
            host.wait(0.002).await;
            host.line.damage(DamageRates::NONE, DamageRates::NONE);
            host.send("");
            host.send(&checked("*CLS"));
            sent.push(milli_degrees);
            let reply = host.query(&checked("SOUR:RATE?")).await;
            let now = (reply.split(' ').next().unwrap().parse::<f64>().unwrap().to_degrees() * 1000.0).round() as u32;
            assert!(sent.contains(&now), "line {n}: {now} was never commanded");
            *(if now == milli_degrees { &mut obeyed } else { &mut refused }) += 1;
        }
        assert!(obeyed > 200 && refused > 200, "{obeyed} whole, {refused} damaged");
        host.send("*IDN?");
        host.wait(0.05).await;
        assert_eq!(host.text(), "", "plain lines are refused after a checked line");
    });
}

#[test]
fn plain_lines_are_accepted_again_after_the_tool() {
    stand(async |host| {
        assert!(host.query(&checked("*IDN?")).await.starts_with("Rotary"));
        host.send("SOUR:RATE 1");
        host.wait(0.02).await;
        let error = host.query(&checked("SYST:ERR?")).await;
        assert!(error.starts_with("-362,"), "{error}");
        host.line.send(&[0x18]);
        host.wait(0.05).await;
        host.text();
        assert!(host.query("*IDN?").await.starts_with("Rotary"), "after Ctrl-X");
        assert!(host.query(&checked("*IDN?")).await.starts_with("Rotary"));
        host.wait(11.0).await;
        assert!(host.query("*IDN?").await.starts_with("Rotary"), "after ten seconds without the tool");
    });
}

#[test]
fn a_pending_completion_query_delays_no_stop() {
    for stop in ["OUTP OFF", "PROF:STOP", "STOP", "*RST", "SOUR:MODE OFF"] {
        for wait in ["*OPC?", "*WAI"] {
            stand(async |host| {
                host.send(&format!("PROF:TYPE CONSTANT;AMPL 3;DUR 60;STAR;{wait}"));
                host.wait(2.0).await;
                assert!((host.true_rate() - 3.0).abs() < 0.1, "{wait}: {} rad/s", host.true_rate());
                host.send("*ESE 9");
                host.send(stop);
                host.wait(0.02).await;
                assert_eq!(host.query("OUTP?").await, if wait == "*OPC?" { "1\r\n0" } else { "0" }, "{stop}");
                host.wait(3.0).await;
                assert!(host.true_rate().abs() < 0.5, "{wait}, {stop}: {} rad/s", host.true_rate());
                assert_eq!(host.query("*ESE?").await, "9", "{wait}, {stop}: lines that came meanwhile are executed in turn");
            });
        }
    }
}

#[test]
fn what_comes_while_the_console_waits_is_kept_up_to_a_limit_that_is_reported() {
    stand(async |host| {
        host.send("PROF:TYPE CONSTANT;AMPL 3;DUR 5;STAR;*OPC?");
        for k in 0..60 {
            host.send(&format!("*ESE {}", k + 1));
            host.wait(0.01).await;
        }
        host.wait(6.0).await;
        assert_eq!(host.text(), "1\r\n");
        // 9 lines of 7 bytes and 56 of 8; each is executed whole or not at all.
        assert_eq!(host.query("*ESE?").await, "60", "511 bytes");
        host.no_error().await;
        host.send("PROF:STAR;*OPC?");
        for k in 0..100 {
            host.send(&format!("*ESE {}", k + 100));
            host.wait(0.01).await;
        }
        host.wait(6.0).await;
        assert_eq!(host.text(), "1\r\n");
        // 512 bytes are 56 lines of 9 bytes.
        assert_eq!(host.query("*ESE?").await, "155");
        let error = host.error().await;
        assert!(error.starts_with("-363,"), "{error}");
        host.no_error().await;
    });
}

#[test]
fn the_index_passed_backwards_after_a_stop_is_no_fault() {
    stand(async |host| {
        for (rate, seconds) in [(20.0, 3.0), (-20.0, 2.0), (20.0, 2.0)] {
            host.send(&format!("SOUR:RATE {rate};MODE RATE"));
            host.wait(seconds).await;
            assert!((host.true_rate() - rate).abs() < 0.3, "{rate}: {} rad/s, {}", host.true_rate(), host.query("FAUL?").await);
            host.send("STOP");
            host.wait(3.0).await;
            host.send("FAUL:CLE");
            host.wait(0.1).await;
        }
    });
}

#[test]
fn lines_follow_scpi_99() {
    stand(async |host| {
        for (line, reply) in [
            ("OUTPut1?;:SOURce1:RATE1?", "0;0"),
            ("*ESE #H2C;*ESE?;*ESE #Q17;*ESE?;*ESE #b101;*ESE?", "44;15;5"),
            ("DRIF:REV 1.0;REV?;REV 0.2;REV?;REV ON;REV?", "1;0;1"),
            ("*OPT?;*PSC 1;*PSC?", "0;1"),
            ("SYST:ERR:ALL?;CODE?", "0,\"No error\";0"),
            ("PROF:AMPL? MIN;AMPL? MAX;AMPL? DEF", "-34.9065850;34.9065850;5"),
            ("STAT:OPER:PTR 1;NTR 256;ENAB 65535;PTR?;NTR?;ENAB?", "1;256;32767"),
            ("STAT:PRES;:STAT:OPER:PTR?;NTR?;ENAB?", "32767;0;0"),
        ] {
            assert_eq!(host.query(line).await, reply.replace("34.9065850", "34.906585"), "{line}");
            host.no_error().await;
        }
        for (line, code, about) in [
            ("OUTP2 ON", "-114", "OUTP2"),
            ("SOUR:RATE12?", "-114", "SOUR:RATE12"),
            ("SOUR:RATE \"5\"", "-158", "5"),
            ("OUTP 'ON'", "-158", "ON"),
            ("*PSC 0", "-222", "*PSC"),
            ("PROF:AMPL 1E9", "-222", "above the maximum of 34.9066 RAD/S"),
            ("PROF:MODE VOLT;AMPL 49", "-222", "48 V"),
            ("*ESE #HG", "-120", "#HG"),
        ] {
            host.send(line);
            let error = host.error().await;
            assert!(error.starts_with(code) && error.contains(about), "{line}: {error}");
        }
        host.send("FOO");
        host.send("SOUR:RATE 9E9");
        let all = host.query("SYST:ERR:ALL?;COUN?").await;
        assert!(all.starts_with("-113,\"Undefined") && all.contains("\",-222,\"Data out of range") && all.ends_with("\";0"), "{all}");
        host.send("FOO");
        host.send("BAR;:SOUR:RATE 9E9");
        assert_eq!(host.query("SYST:ERR:CODE:ALL?").await, "-113,-113", "a line ends at its error");
    });
}

#[test]
fn sixteen_errors_and_long_replies_are_one_line() {
    stand(async |host| {
        for n in 0..16 {
            host.send(&format!("NO:SUCH:COMMAND:AS:THIS:{n}:WITH:A:LONG:HEADER"));
        }
        host.wait(0.1).await;
        let all = host.query("SYST:ERR:ALL?").await;
        assert!(all.matches("\",-11").count() == 15 && !all.contains('\n') && all.len() > 1000, "{all}");
        let thrice = host.query("*IDN?;SETT:LIST?;*IDN?").await;
        let (identity, rest) = thrice.split_once(';').unwrap();
        assert!(rest.starts_with('#') && rest.ends_with(&format!(";{identity}")), "{thrice}");
        let digits = rest[1..2].parse::<usize>().unwrap();
        let length: usize = rest[2..2 + digits].parse().unwrap();
        assert_eq!(rest.len(), 2 + digits + length + 1 + identity.len(), "{thrice}");
    });
}

#[test]
fn every_number_has_least_greatest_and_default() {
    stand(async |host| {
        host.send("HELP?");
        host.wait(2.0).await;
        let help = host.text();
        let mut numbers = 0;
        for line in help.lines() {
            let Some((header, range)) = line.split_once("  ").unwrap().0.split_once(" <") else { continue };
            let Some((least, greatest)) = range.trim_end_matches('>').split_once(" to ") else { continue };
            let greatest = greatest.split(' ').next().unwrap();
            let replies = host.query(&format!("{header}? MIN;:{header}? MAX;:{header}? DEF")).await;
            let replies: Vec<f64> =
                replies.split(';').map(|reply| reply.parse().unwrap_or_else(|_| panic!("{header}: {replies}"))).collect();
            let close = |a: f64, b: &str| b.parse::<f64>().is_ok_and(|b| (a - b).abs() <= 1e-5 * b.abs());
            assert!(close(replies[0], least) && close(replies[1], greatest), "{line}: {replies:?}");
            assert!(replies[0] <= replies[2] && replies[2] <= replies[1], "{line}: {replies:?}");
            numbers += 1;
        }
        assert!(numbers > 80, "{numbers}");
    });
}

#[test]
fn a_stream_ends_when_its_program_is_silent() {
    stand(async |host| {
        host.send(&checked("STReam ON"));
        for _ in 0..8 {
            host.wait(1.0).await;
            host.send(&checked(""));
        }
        assert!(host.bytes.borrow().ends_with(&[0]) && !host.bytes.borrow().is_empty(), "an empty line with a check sum keeps the stream");
        host.wait(5.5).await;
        host.bytes.borrow_mut().clear();
        assert!(host.query("*IDN?").await.starts_with("Rotary"), "the next program finds text");
        // The stream of a person or of a simple script goes on.
        host.send("STReam ON");
        host.wait(8.0).await;
        host.bytes.borrow_mut().clear();
        host.wait(0.5).await;
        assert!(host.bytes.borrow().contains(&0));
    });
}

#[test]
fn signs_of_life_during_a_long_wait_take_no_room() {
    for end in ["\n", "\r\n"] {
        stand(async |host| {
            host.send(&checked("PROF:TYPE CONSTANT;AMPL 3;DUR 300;STAR;*OPC?"));
            host.wait(0.02).await;
            host.send(&checked("SOUR:RATE 2"));
            for _ in 0..550 {
                host.line.send(format!("{}{end}", checked("HOST:ALIVe")).as_bytes());
                host.wait(0.5).await;
            }
            host.line.send(format!("{}{end}", checked("SOUR:RATE?")).as_bytes());
            host.wait(30.0).await;
            assert_eq!(host.text(), "1\r\n2\r\n", "the lines that came before and after the signs are executed in their turn");
            host.send(&checked("SYST:ERR?"));
            host.wait(0.1).await;
            assert_eq!(host.text(), "0,\"No error\"\r\n");
        });
    }
}

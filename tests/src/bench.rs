//! The host at the simulated stand's serial line, in virtual time.
//!
//! Input: a stand and a script. Output: the script's result. The complete firmware runs behind the line, as on the board.

use std::cell::RefCell;

use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::faults::FaultKind;
use hal_sim::gyro::SingleAxis;
use hal_sim::peripherals::SimFlash;
use hal_sim::plant::{Plant, Stand};
use stand_firmware::board::{Clock, TICKS_PER_ROW, TICKS_PER_S};
use stand_firmware::telemetry::crc32;

/// Timeout of a reply, s.
const REPLY_TIMEOUT_S: f64 = 2.0;

/// The host's end of the line.
pub struct Host<'x, 'c> {
    controller: &'x Controller<'c>,
    received: RefCell<Vec<u8>>,
}

/// Powers a stand on and runs `script` against it. Returns the script's result and the final flash.
///
/// # Panics
/// The stand is invalid, or its firmware stops.
pub fn with_flash<T>(stand: &Stand, flash: SimFlash, script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> (T, SimFlash) {
    run_script(stand, flash, None, script)
}

fn run_script<T>(stand: &Stand, flash: SimFlash, gyro: Option<SingleAxis>, script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> (T, SimFlash) {
    let clock = VirtualClock::default();
    let plant = Plant::new(stand, -0.05).expect("a valid stand");
    let mut controller = Controller::new(&clock, &stand.setup(), plant, flash, 1).expect("a valid stand");
    if let Some(gyro) = gyro {
        controller = controller.with_gyro(Box::new(gyro.seeded(1)), 1);
    }
    let run_script = async {
        let host = Host { controller: &controller, received: RefCell::default() };
        // Scripts wait for minutes; the stand would stop a drive whose host is silent for 2 s.
        host.send(b"HOST:UNATTended 1E6\n");
        script(&host).await
    };
    let done = controller.run(run_script, |_| ()).expect("the firmware keeps running");
    (done, controller.into_flash())
}

/// As [`with_flash`], with an empty flash.
///
/// # Panics
/// As [`with_flash`].
pub fn with_stand<T>(stand: &Stand, script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> T {
    with_flash(stand, flash(1), script).0
}

/// As [`with_stand`], with this gyro connected to torquer and angle sensor.
///
/// # Panics
/// As [`with_flash`].
pub fn with_gyro<T>(stand: &Stand, gyro: SingleAxis, script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> T {
    run_script(stand, flash(1), Some(gyro), script).0
}

/// A command with its checksum.
pub fn checked(command: &str) -> String {
    format!("{command}~{:08X}\n", crc32(command.as_bytes()))
}

impl Host<'_, '_> {
    /// Waits for a duration, s.
    pub async fn wait_s(&self, seconds: f64) {
        let clock = self.controller.clock();
        clock.until(clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
    }

    /// Time of the stand, s.
    pub fn now_s(&self) -> f64 {
        self.controller.clock().now().seconds()
    }

    /// Sends bytes on the line.
    pub fn send(&self, bytes: &[u8]) {
        self.controller.line().send(bytes);
    }

    /// All unread bytes received.
    pub fn received(&self) -> Vec<u8> {
        let mut received = self.received.borrow_mut();
        self.controller.line().receive(&mut received);
        std::mem::take(&mut received)
    }

    /// The next line of text without its end; `None` on timeout.
    pub async fn line(&self, timeout_s: f64) -> Option<String> {
        let clock = self.controller.clock();
        let until = clock.now() + (timeout_s * TICKS_PER_S as f64) as u64;
        loop {
            let line = {
                let mut received = self.received.borrow_mut();
                self.controller.line().receive(&mut received);
                let end = received.iter().position(|byte| *byte == b'\n');
                end.map(|end| received.drain(..=end).collect::<Vec<u8>>())
            };
            if let Some(line) = line {
                return Some(String::from_utf8_lossy(&line).trim_end().to_owned());
            }
            if clock.now() >= until {
                return None;
            }
            clock.until(clock.now() + TICKS_PER_ROW).await;
        }
    }

    /// Sends a query and returns its one-line reply.
    ///
    /// # Panics
    /// No reply arrives.
    pub async fn query(&self, query: &str) -> String {
        self.send(format!("{query}\n").as_bytes());
        self.line(REPLY_TIMEOUT_S).await.unwrap_or_else(|| panic!("no answer to {query}"))
    }

    /// Sends a query whose reply is a number, with or without unit.
    ///
    /// # Panics
    /// The reply is not a number.
    pub async fn number(&self, query: &str) -> f64 {
        let answer = self.query(query).await;
        let word = answer.split([' ', ',']).next().unwrap_or_default();
        word.parse().unwrap_or_else(|_| panic!("{query}: {answer}"))
    }

    /// Sends a query whose reply is a definite-length block (IEEE 488.2 §8.7.9) of lines.
    ///
    /// # Panics
    /// The reply is no block, or not of the length that it states.
    pub async fn list(&self, query: &str) -> Vec<String> {
        let first = self.query(query).await;
        let digits = first.strip_prefix('#').and_then(|rest| rest.get(..1)?.parse::<usize>().ok());
        let digits = digits.unwrap_or_else(|| panic!("{query}: no block: {first}"));
        let length: usize = first[2..2 + digits].parse().unwrap_or_else(|_| panic!("{query}: {first}"));
        let mut text = first[2 + digits..].to_owned();
        while text.len() < length {
            let line = self.line(REPLY_TIMEOUT_S).await.unwrap_or_else(|| panic!("{query}: no end after {text}"));
            text += "\r\n";
            text += &line;
        }
        assert_eq!(text.len(), length, "{query}");
        text.split("\r\n").map(str::to_owned).collect()
    }

    /// Sends a command that must be accepted without error.
    ///
    /// # Panics
    /// The command is rejected.
    pub async fn command(&self, command: &str) {
        let error = self.refusal(command).await;
        assert!(error.starts_with("0,"), "{command}: {error}");
    }

    /// Sends a command and returns its error.
    pub async fn refusal(&self, command: &str) -> String {
        self.send(format!("{command}\n").as_bytes());
        self.query("SYSTem:ERRor?").await
    }

    /// Injects a fault.
    ///
    /// # Panics
    /// Too many faults are active.
    pub fn inject_fault(&self, what: FaultKind, for_s: f64, size: Option<f64>) {
        self.controller.bench().borrow_mut().active_faults().inject(what, for_s, size).expect("fewer active faults than the maximum");
    }

    /// Clears all faults of a kind.
    pub fn clear_fault(&self, what: FaultKind) {
        self.controller.bench().borrow_mut().active_faults().clear(what);
    }

    /// True rate of the platform, rad/s.
    pub fn true_rate_rad_s(&self) -> f64 {
        self.controller.bench().borrow().plant().true_rate_rad_s()
    }

    /// True angle of the platform, rad.
    pub fn true_angle_rad(&self) -> f64 {
        self.controller.bench().borrow().plant().true_theta_rad()
    }

    /// Number of power cuts.
    pub fn power_cuts(&self) -> u32 {
        self.controller.power_cuts()
    }
}

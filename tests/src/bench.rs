//! Somebody at the other end of the simulated stand's serial line, in virtual time: a person, a program, or nobody.
//!
//! In: a stand and a script. Out: what the script returns. The whole firmware runs behind the line, as on the board.

use std::cell::RefCell;

use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::faults::FaultKind;
use hal_sim::gyro::SingleAxis;
use hal_sim::peripherals::SimFlash;
use hal_sim::plant::{Plant, Stand};
use stand_firmware::board::{Clock, TICKS_PER_ROW, TICKS_PER_S};
use stand_firmware::telemetry::crc32;

/// How long an answer may take, s.
const PATIENCE_S: f64 = 2.0;

/// The one at the line.
pub struct Host<'x, 'c> {
    controller: &'x Controller<'c, Plant>,
    heard: RefCell<Vec<u8>>,
}

/// Switches a stand on, lets `script` talk to it, and gives what that returns, with the flash that is left.
///
/// # Panics
/// Where the stand cannot be, or its firmware stands still.
pub fn with_flash<T>(stand: &Stand, flash: SimFlash, script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> (T, SimFlash) {
    talk(stand, flash, None, script)
}

fn talk<T>(stand: &Stand, flash: SimFlash, gyro: Option<SingleAxis>, script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> (T, SimFlash) {
    let clock = VirtualClock::default();
    let plant = Plant::new(stand, -0.05).expect("a good stand");
    let mut controller = Controller::new(&clock, &stand.setup(), plant, flash, 1).expect("a good stand");
    if let Some(gyro) = gyro {
        controller = controller.with_gyro(Box::new(gyro.seeded(1)), 1);
    }
    let talk = async {
        let host = Host { controller: &controller, heard: RefCell::default() };
        script(&host).await
    };
    let done = controller.run(talk, |_| ()).expect("the firmware goes on");
    (done, controller.into_flash())
}

/// The same with a flash that holds nothing.
///
/// # Panics
/// As [`with_flash`].
pub fn at_the_bench<T>(stand: &Stand, script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> T {
    with_flash(stand, flash(1), script).0
}

/// The same with this gyro on the torquer's and the angle sensor's wires.
///
/// # Panics
/// As [`with_flash`].
pub fn with_gyro<T>(stand: &Stand, gyro: SingleAxis, script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> T {
    talk(stand, flash(1), Some(gyro), script).0
}

/// A command with the check that a tool puts behind it.
pub fn checked(command: &str) -> String {
    format!("{command}~{:08X}\n", crc32(command.as_bytes()))
}

impl Host<'_, '_> {
    /// Time passes.
    pub async fn wait_s(&self, seconds: f64) {
        let clock = self.controller.clock();
        clock.until(clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
    }

    /// The stand's time, s.
    pub fn now_s(&self) -> f64 {
        self.controller.clock().now().seconds()
    }

    /// Puts bytes on the line.
    pub fn send(&self, bytes: &[u8]) {
        self.controller.line().send(bytes);
    }

    /// All bytes that have come and nobody has looked at.
    pub fn heard(&self) -> Vec<u8> {
        let mut heard = self.heard.borrow_mut();
        self.controller.line().receive(&mut heard);
        std::mem::take(&mut heard)
    }

    /// The next line of text without its end; `None` if none comes in time.
    pub async fn line(&self, patience_s: f64) -> Option<String> {
        let clock = self.controller.clock();
        let until = clock.now() + (patience_s * TICKS_PER_S as f64) as u64;
        loop {
            let line = {
                let mut heard = self.heard.borrow_mut();
                self.controller.line().receive(&mut heard);
                let end = heard.iter().position(|byte| *byte == b'\n');
                end.map(|end| heard.drain(..=end).collect::<Vec<u8>>())
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

    /// A program's question and its answer, one line.
    ///
    /// # Panics
    /// Where no answer comes.
    pub async fn ask(&self, question: &str) -> String {
        self.send(format!("{question}\n").as_bytes());
        self.line(PATIENCE_S).await.unwrap_or_else(|| panic!("no answer to {question}"))
    }

    /// A question whose answer is a number, with or without a unit behind it.
    ///
    /// # Panics
    /// Where the answer is no number.
    pub async fn number(&self, question: &str) -> f64 {
        let answer = self.ask(question).await;
        let word = answer.split([' ', ',']).next().unwrap_or_default();
        word.parse().unwrap_or_else(|_| panic!("{question}: {answer}"))
    }

    /// A question whose answer is many lines with an empty one behind them.
    ///
    /// # Panics
    /// Where the answer has no end.
    pub async fn list(&self, question: &str) -> Vec<String> {
        self.send(format!("{question}\n").as_bytes());
        let mut lines = Vec::new();
        loop {
            match self.line(PATIENCE_S).await {
                Some(line) if line.is_empty() => return lines,
                Some(line) => lines.push(line),
                None => panic!("{question}: no end after {lines:?}"),
            }
        }
    }

    /// A program's command, which must be taken without an error.
    ///
    /// # Panics
    /// Where it is not.
    pub async fn tell(&self, command: &str) {
        let error = self.refusal(command).await;
        assert!(error.starts_with("0,"), "{command}: {error}");
    }

    /// A program's command, and the error that comes of it.
    pub async fn refusal(&self, command: &str) -> String {
        self.send(format!("{command}\n").as_bytes());
        self.ask("SYSTem:ERRor?").await
    }

    /// Breaks something from now on.
    ///
    /// # Panics
    /// Where too much is broken already.
    pub fn break_(&self, what: FaultKind, for_s: f64, size: Option<f64>) {
        self.controller.bench().borrow_mut().active_faults().inject(what, for_s, size).expect("room for one more");
    }

    /// Mends all of a kind.
    pub fn mend(&self, what: FaultKind) {
        self.controller.bench().borrow_mut().active_faults().clear(what);
    }

    /// The platform's own rate, rad/s.
    pub fn true_rate_rad_s(&self) -> f64 {
        use hal_sim::board::PlantPort;
        self.controller.bench().borrow().plant().true_rate_rad_s()
    }

    /// The platform's own angle, rad.
    pub fn true_angle_rad(&self) -> f64 {
        use hal_sim::board::PlantPort;
        self.controller.bench().borrow().plant().true_theta_rad()
    }

    /// How often the supply was cut.
    pub fn power_cuts(&self) -> u32 {
        self.controller.power_cuts()
    }
}

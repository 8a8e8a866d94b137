//! The emulated chip on the default stand, with a host at its serial line.
//!
//! The image is `STAND_IMAGE`, else the one that `scripts/build-firmware.sh` has built. Tests that need it are ignored without
//! `--include-ignored`.
#![allow(clippy::unwrap_used, dead_code)]

use chip_sim::board::Board;
use chip_sim::image::Image;
use chip_sim::machine::Machine;
use chip_sim::time::{PER_MS, Time, of_seconds};
use hal_sim::plant::{Plant, Stand};
use stand_firmware::telemetry::frame::Piece;
use stand_firmware::telemetry::{Body, Deframer, RowFrame};
use std::path::PathBuf;
use std::sync::OnceLock;

pub const BAUD: u64 = 921_600;
/// Longest time until a reply.
const REPLY: Time = 2_000 * PER_MS;
/// Angle of the platform from its index at power-on, rad.
const START_RAD: f64 = -0.1;

/// Path of the image.
fn image_path() -> PathBuf {
    std::env::var_os("STAND_IMAGE").map_or_else(|| built("stand"), PathBuf::from)
}

/// A program that `scripts/build-firmware.sh` has built.
pub fn built(name: &str) -> PathBuf {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or(root.join("target"), PathBuf::from);
    let folders = ["firmware/thumbv7em-none-eabihf/chip", "thumbv7em-none-eabihf/chip"];
    let mut programs = folders.iter().map(|folder| target.join(folder).join(name));
    programs.find(|path| path.exists()).unwrap_or_else(|| panic!("no program {name}: run scripts/build-firmware.sh first"))
}

/// The image under test.
pub fn image() -> &'static Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE.get_or_init(|| Image::read(&image_path()).unwrap())
}

/// A chip with its host.
pub struct Chip {
    pub machine: Machine<'static>,
    received: Vec<u8>,
}

impl Chip {
    /// Log messages since power-on, without their arguments.
    pub fn log(&mut self) -> Vec<String> {
        chip_sim::log::messages(self.machine.log(), image())
    }

    /// The chip at power-on on this stand.
    pub fn on(stand: &Stand) -> Self {
        let plant = Plant::new(stand, START_RAD).unwrap();
        let board = Board::new(&stand.setup(), Box::new(plant), stand.drive.motor_constant_N_m_A, 1);
        Self { machine: Machine::new(image(), board), received: Vec::new() }
    }

    /// The chip on the default stand, 0.3 s after power-on.
    pub fn booted() -> Self {
        Self::booted_on(&Stand::default())
    }

    /// The chip on this stand, 0.3 s after power-on.
    pub fn booted_on(stand: &Stand) -> Self {
        let mut chip = Self::on(stand);
        chip.run_ms(300);
        // The tests wait longer than the 2 s after which the stand stops a drive whose host is silent.
        chip.command("HOST:UNATTended 1E6");
        chip
    }

    /// Runs for `ms` milliseconds; everything that the chip sends is kept.
    pub fn run_ms(&mut self, ms: u64) {
        self.run_until(self.machine.now() + ms * PER_MS);
    }

    /// Runs for `seconds`.
    pub fn run_s(&mut self, seconds: f64) {
        self.run_until(self.machine.now() + of_seconds(seconds));
    }

    /// Runs until `to`.
    pub fn run_until(&mut self, to: Time) {
        if let Err(halt) = self.machine.run_until(to) {
            panic!("{halt}; log: {:#?}", self.log());
        }
        self.received.append(&mut self.machine.take_sent());
    }

    /// Sends a command line without waiting.
    pub fn say(&mut self, line: &str) {
        self.machine.send(format!("{line}\n").as_bytes(), BAUD);
    }

    /// Sends a command line, and requires that it caused no error.
    pub fn command(&mut self, line: &str) {
        self.say(line);
        let errors = self.ask("SYSTem:ERRor:COUNt?");
        if errors != "0" {
            panic!("{line}: {}", self.ask("SYSTem:ERRor:ALL?"));
        }
    }

    /// Sends a query and returns the line of its reply.
    pub fn ask(&mut self, line: &str) -> String {
        self.received.clear();
        self.say(line);
        let end = self.machine.now() + REPLY;
        while self.machine.now() < end {
            self.run_ms(1);
            if let Some(at) = self.received.iter().position(|byte| *byte == b'\n') {
                let reply = String::from_utf8_lossy(&self.received[..at]).trim_end().to_owned();
                self.received.drain(..=at);
                return reply;
            }
        }
        panic!("no reply to {line}; log: {:#?}", self.log());
    }

    /// The number at the start of a reply.
    pub fn number(&mut self, query: &str) -> f64 {
        let reply = self.ask(query);
        let number = reply.split([' ', ',', ';']).next().unwrap_or_default();
        number.parse().unwrap_or_else(|_| panic!("{query}: {reply}"))
    }

    /// Name of the latched fault.
    pub fn fault(&mut self) -> String {
        let reply = self.ask("FAULt?");
        reply.split(',').nth(1).unwrap_or_default().to_owned()
    }

    /// True rate of the platform, rad/s.
    pub fn rate_rad_s(&self) -> f64 {
        self.machine.soc.board.plant().true_rate_rad_s()
    }

    /// Bytes that the chip has sent and that no reply has taken.
    pub fn take_received(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.received)
    }
}

/// Rows and gaps in received frames.
#[derive(Default)]
pub struct Rows {
    deframer: Deframer,
    pub rows: u64,
    pub missing_rows: u64,
    pub missing_frames: u64,
    pub damaged: u64,
    last_frame: Option<u16>,
    pub last: Option<RowFrame>,
}

impl Rows {
    /// Adds received bytes; `each` sees every row.
    pub fn take(&mut self, bytes: &[u8], mut each: impl FnMut(&RowFrame)) {
        for byte in bytes {
            match self.deframer.push(*byte) {
                Some(Piece::Frame(frame)) => {
                    if let Some(last) = self.last_frame.replace(frame.seq) {
                        self.missing_frames += u64::from(frame.seq.wrapping_sub(last.wrapping_add(1)));
                    }
                    if let Body::Row(row) = frame.body {
                        if let Some(last) = &self.last {
                            self.missing_rows += u64::from(row.sequence.wrapping_sub(last.sequence.wrapping_add(1)));
                        }
                        self.rows += 1;
                        each(&row);
                        self.last = Some(row);
                    }
                }
                Some(_) => self.damaged += 1,
                None => {}
            }
        }
    }
}

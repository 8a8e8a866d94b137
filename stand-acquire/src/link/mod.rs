//! The serial line to a stand, from the host's side.
//!
//! A link that has sent a command of a program that drives gives signs of life while it waits; when it ends, by an error or a panic too, it
//! switches the drive off and says so on standard error, unless the stand runs unattended.
//!
//! In: the path of a serial port or pseudo-terminal. Out: a [`SerialLink`]: queries and commands in text, each line with a checksum, and
//! the frames of a stream. Losses are counted ([`LineLosses`]). [`SerialLink::open`] reports a port that does not exist, is in use, or has
//! no stand behind it.

mod error;
mod port;
mod receive;

pub use error::LinkError;
pub use port::{BAUD, IN_USE, Port, ports};
pub use receive::{LineLosses, OtherProtocol, Received, Receiver, StreamHeader};

use std::collections::VecDeque;
use std::path::Path;
use std::time::{Duration, Instant};

use stand_firmware::app::commands::{SIGN_OF_LIFE, is_sign_of_life, is_stop};
use stand_firmware::console::parse::{Command, Commands};
use stand_firmware::telemetry::crc32;

/// Longest wait for a reply.
pub const REPLY_TIMEOUT: Duration = Duration::from_millis(1500);
/// Time without data after which the line counts as quiet.
const QUIET_TIME: Duration = Duration::from_millis(20);
/// Interval of the signs of life; the stand waits for [`stand_firmware::supervision::HOST_TIMEOUT_S`].
const ALIVE_INTERVAL: Duration = Duration::from_millis(200);
/// Longest wait for a reply when the link ends.
const CLOSE_TIMEOUT: Duration = Duration::from_millis(300);
/// Part of a stand's reply to `*IDN?`.
const STAND_IDENTITY: &str = "rotary stand";

/// Query that ends an exchange: the oldest error, and the version of SCPI as a mark that no other reply has behind an error.
pub const END_QUERY: &str = "SYSTem:ERRor?;:SYSTem:VERSion?";
/// End of the reply to [`END_QUERY`].
const END_MARK: &str = "1999.0";
/// Error code of a line that was damaged in transmission.
const DAMAGED_LINE: &str = "-362,";
/// Attempts to send a damaged line.
pub const MAX_ATTEMPTS: u32 = 4;
/// Attempts to identify the stand.
const MAX_IDENTIFICATIONS: u32 = 6;

/// Result of one line.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reply {
    /// Lines of the reply, including empty ones.
    pub lines: Vec<String>,
    /// Errors in the stand's queue afterwards, the oldest first.
    pub errors: Vec<String>,
}

impl Reply {
    /// The line was damaged in transmission and was not executed.
    pub fn is_damaged(&self) -> bool {
        self.errors.iter().any(|error| error.starts_with(DAMAGED_LINE))
    }
}

/// The reply to a line that was sent with [`END_QUERY`] behind it, as far as it has arrived.
#[derive(Debug, Default)]
pub struct Exchange {
    /// The reply so far.
    pub reply: Reply,
}

/// What follows a received line of an exchange.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExchangeStep {
    /// More lines follow.
    NextLine,
    /// The queue of errors has another one: [`END_QUERY`] is sent again.
    AskAgain,
    /// The reply is complete.
    Complete,
}

impl Exchange {
    /// Takes the next line of text.
    pub fn take(&mut self, line: String) -> ExchangeStep {
        match line.rsplit_once(';') {
            Some((error, END_MARK)) if error.starts_with("0,") && error.ends_with('"') => return ExchangeStep::Complete,
            Some((error, END_MARK)) if error.ends_with('"') => {
                self.reply.errors.push(error.to_owned());
                return ExchangeStep::AskAgain;
            }
            // During a stream, errors are reported at once; they are in the queue too.
            _ if line.starts_with("ERROR ") => {}
            _ => self.reply.lines.push(without_block_head(&line).to_owned()),
        }
        ExchangeStep::NextLine
    }
}

/// A serial line with a stand at its other end.
#[derive(Debug)]
pub struct SerialLink {
    port: Port,
    receiver: Receiver,
    received: VecDeque<Received>,
    identity: String,
    /// This link has sent a command of a program that drives.
    has_driven: bool,
    /// Time of the last [`sign`].
    signed_at: Instant,
    /// Ends an exchange early.
    is_interrupted: fn() -> bool,
}

impl SerialLink {
    /// Opens the port and identifies the stand.
    ///
    /// # Errors
    /// The port does not exist, is in use, or has no stand behind it.
    pub fn open(path: &Path) -> Result<Self, LinkError> {
        let port = Port::open(path)?;
        let mut link = SerialLink {
            port,
            receiver: Receiver::default(),
            received: VecDeque::new(),
            identity: String::new(),
            has_driven: false,
            signed_at: Instant::now(),
            is_interrupted: || false,
        };
        link.identify()?;
        Ok(link)
    }

    /// Identifies the stand. Repeated, because the first line may be damaged or may arrive before the stand listens.
    fn identify(&mut self) -> Result<(), LinkError> {
        let mut other_device = None;
        for attempt in 0..MAX_IDENTIFICATIONS {
            // Ends an incomplete line that an earlier program left; without a valid checksum the stand does not execute it.
            self.port.write(b"~\r\n")?;
            if attempt == 0 {
                // Discards what the stand is sending.
                self.discard_until_quiet()?;
            }
            self.receiver.restart();
            self.send("*IDN?")?;
            let deadline = Instant::now() + REPLY_TIMEOUT / MAX_IDENTIFICATIONS;
            while let Some(line) = self.line(deadline)? {
                if line.to_ascii_lowercase().contains(STAND_IDENTITY) {
                    self.identity = line;
                    self.discard_replies()?;
                    self.receiver.reset_losses();
                    return Ok(());
                }
                other_device.get_or_insert(line);
            }
        }
        Err(match other_device {
            Some(line) => LinkError::NotAStand { port: self.name(), reply: line.chars().take(60).collect() },
            None if self.receiver.bytes() > 0 => LinkError::Garbled { port: self.name(), baud: BAUD },
            None => LinkError::Silent { port: self.name(), baud: BAUD },
        })
    }

    /// Discards replies to repeated queries, and errors that were in the queue before.
    fn discard_replies(&mut self) -> Result<(), LinkError> {
        let deadline = Instant::now() + REPLY_TIMEOUT;
        while Instant::now() < deadline {
            self.receiver.restart();
            self.send(END_QUERY)?;
            let attempt_deadline = Instant::now() + REPLY_TIMEOUT / MAX_IDENTIFICATIONS;
            while let Some(line) = self.line(attempt_deadline)? {
                match line.rsplit_once(';') {
                    Some((error, mark)) if mark == END_MARK && error.starts_with("0,") => return Ok(()),
                    Some((_, mark)) if mark == END_MARK => break,
                    _ => {}
                }
            }
        }
        Err(LinkError::NoReply { port: self.name(), query: "*IDN?".to_owned() })
    }

    /// Exchanges end with an error once this returns true.
    pub fn set_interrupt(&mut self, is_interrupted: fn() -> bool) {
        self.is_interrupted = is_interrupted;
    }

    /// Gives a [`sign`] if the last one is a fifth of a second old. Every wait of the link calls it.
    ///
    /// # Errors
    /// The port was disconnected.
    pub fn keep_alive(&mut self) -> Result<(), LinkError> {
        match sign(self.has_driven, self.receiver.is_streaming()) {
            Some(sign) if self.signed_at.elapsed() >= ALIVE_INTERVAL => {
                self.signed_at = Instant::now();
                self.port.write(with_checksum(sign).as_bytes())
            }
            _ => Ok(()),
        }
    }

    /// Switches the drive off if this link has driven and the stand does not run unattended; whether it was on.
    fn leave(&mut self) -> Result<bool, LinkError> {
        if !std::mem::take(&mut self.has_driven) || !self.is_left_on()? {
            return Ok(false);
        }
        self.exchange("OUTPut OFF", CLOSE_TIMEOUT)?;
        // A calibration refuses OUTPut OFF.
        if self.is_left_on()? {
            self.stop()?;
        }
        Ok(true)
    }

    /// The drive is on, and the stand does not run unattended.
    fn is_left_on(&mut self) -> Result<bool, LinkError> {
        let reply = self.exchange("OUTPut?;:HOST:UNATTended?", CLOSE_TIMEOUT)?;
        let state = reply.lines.first().and_then(|line| line.split_once(';'));
        Ok(state.is_some_and(|(output, unattended)| output == "1" && reply_number(unattended) == Some(0.0)))
    }

    /// Path of the port.
    pub fn name(&self) -> String {
        self.port.path().display().to_string()
    }

    /// The stand's reply to `*IDN?`: manufacturer, model, serial number, firmware.
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// Losses since the line was opened, or since [`SerialLink::reset`].
    pub fn losses(&self) -> LineLosses {
        self.receiver.losses()
    }

    /// Discards received data and sets the losses to zero.
    pub fn reset(&mut self) {
        self.received.clear();
        self.receiver.reset_losses();
    }

    /// Sends a line with its checksum.
    ///
    /// # Errors
    /// The port was disconnected, or the line is longer than the stand accepts.
    pub fn send(&mut self, command: &str) -> Result<(), LinkError> {
        let line = with_checksum(command);
        if line.len() > MAX_LINE {
            return Err(LinkError::TooLong { command: command.to_owned(), limit: MAX_LINE - CHECKSUM });
        }
        self.has_driven |= drives(command);
        self.port.write(line.as_bytes())
    }

    /// Sends a line and returns the reply and the errors of the stand. A line that was damaged in transmission is sent again.
    ///
    /// # Errors
    /// The port was disconnected, or no reply came within `timeout`.
    pub fn exchange(&mut self, command: &str, timeout: Duration) -> Result<Reply, LinkError> {
        for _ in 0..MAX_ATTEMPTS {
            let reply = self.exchange_once(command, timeout)?;
            if !reply.is_damaged() {
                return Ok(reply);
            }
        }
        Err(LinkError::NoReply { port: self.name(), query: command.to_owned() })
    }

    fn exchange_once(&mut self, command: &str, timeout: Duration) -> Result<Reply, LinkError> {
        // Unsolicited lines are not part of the reply.
        self.received.retain(|received| !matches!(received, Received::Line(_)));
        self.send(command)?;
        let mut exchange = Exchange::default();
        loop {
            self.send(END_QUERY)?;
            let deadline = Instant::now() + timeout;
            loop {
                let Some(line) = self.line(deadline)? else {
                    return Err(LinkError::NoReply { port: self.name(), query: command.to_owned() });
                };
                match exchange.take(line) {
                    ExchangeStep::NextLine => {}
                    ExchangeStep::AskAgain => break,
                    ExchangeStep::Complete => return Ok(exchange.reply),
                }
            }
        }
    }

    /// Sends a query; the single line of the reply.
    ///
    /// # Errors
    /// The port was disconnected, no reply came, or the stand rejected the query.
    pub fn query(&mut self, query: &str) -> Result<String, LinkError> {
        let lines = self.query_lines(query)?;
        let none = || LinkError::NoReply { port: self.name(), query: query.to_owned() };
        lines.into_iter().next().ok_or_else(none)
    }

    /// Sends a query; all lines of the reply.
    ///
    /// # Errors
    /// As [`SerialLink::query`].
    pub fn query_lines(&mut self, query: &str) -> Result<Vec<String>, LinkError> {
        let reply = self.exchange(query, REPLY_TIMEOUT)?;
        match reply.errors.into_iter().next() {
            None => Ok(reply.lines.into_iter().filter(|line| !line.is_empty()).collect()),
            Some(message) => Err(LinkError::Rejected { command: query.to_owned(), message }),
        }
    }

    /// Sends a command and checks that the stand accepted it.
    ///
    /// # Errors
    /// The port was disconnected, or the stand rejected the command.
    pub fn command(&mut self, command: &str) -> Result<(), LinkError> {
        self.query_lines(command).map(|_| ())
    }

    /// Sends the STOP byte 0x18: the stand stops its drive and returns to text mode.
    ///
    /// # Errors
    /// The port was disconnected.
    pub fn stop(&mut self) -> Result<(), LinkError> {
        self.port.write(&[0x18])
    }

    /// The next line of text before `deadline`; rows received before it are kept.
    fn line(&mut self, deadline: Instant) -> Result<Option<String>, LinkError> {
        loop {
            if let Some(at) = self.received.iter().position(|received| matches!(received, Received::Line(_)))
                && let Some(Received::Line(line)) = self.received.remove(at)
            {
                return Ok(Some(line));
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            if (self.is_interrupted)() {
                return Err(LinkError::Interrupted { port: self.name() });
            }
            self.read(left)?;
        }
    }

    /// The next received line, row or frame within `wait`.
    ///
    /// # Errors
    /// The port was disconnected.
    pub fn receive(&mut self, wait: Duration) -> Result<Option<Received>, LinkError> {
        if self.received.is_empty() {
            self.read(wait)?;
        }
        Ok(self.received.pop_front())
    }

    /// Reads once, for at most `wait` or until the next sign of life is due.
    fn read(&mut self, wait: Duration) -> Result<(), LinkError> {
        self.keep_alive()?;
        let mut buffer = [0; 4096];
        let count = self.port.read(&mut buffer, wait.min(ALIVE_INTERVAL / 4))?;
        self.receiver.take(&buffer[..count], &mut self.received).map_err(|other| other.at(self.name()))
    }

    /// Discards data until the line is quiet, or during a stream for five quiet times.
    fn discard_until_quiet(&mut self) -> Result<(), LinkError> {
        let until = Instant::now() + 5 * QUIET_TIME;
        loop {
            self.read(QUIET_TIME)?;
            if std::mem::take(&mut self.received).is_empty() || Instant::now() > until {
                return Ok(());
            }
        }
    }
}

impl Drop for SerialLink {
    fn drop(&mut self) {
        self.is_interrupted = || false;
        match self.leave() {
            Ok(true) => eprintln!("stand: the drive was on and has been switched off (HOST:UNATTended allows it to run without a program)"),
            Ok(false) => {}
            Err(error) => eprintln!("stand: the drive could not be switched off: {error}; the stand does so after 2 s of silence"),
        }
        // Lines of a terminal without check sums are accepted at once.
        let _ = self.send("HOST:RELease");
    }
}

/// What a program has to send twice a second: a sign of life if it has driven; an empty line during a stream, which would end without lines
/// that have check sums.
pub fn sign(has_driven: bool, is_streaming: bool) -> Option<&'static str> {
    if has_driven { Some(SIGN_OF_LIFE) } else { is_streaming.then_some("") }
}

/// The first line of a list without what makes it a definite-length block: `#`, the number of digits, and the length.
fn without_block_head(line: &str) -> &str {
    let after_head = || {
        let (digits, rest) = line.strip_prefix('#')?.split_at_checked(1)?;
        let (length, rest) = rest.split_at_checked(digits.parse().ok()?)?;
        length.bytes().all(|byte| byte.is_ascii_digit()).then_some(rest)
    };
    after_head().unwrap_or(line)
}

/// The number at the beginning of a word of a reply, with or without a unit. The stand writes 9.91E37 for "not a number" and 9.9E37 for
/// infinity (SCPI-99, volume 1, §7.2.1).
pub fn reply_number(word: &str) -> Option<f64> {
    let number: f64 = word.split_whitespace().next()?.parse().ok()?;
    Some(match number.abs() {
        9.91e37 => f64::NAN,
        9.9e37 => f64::INFINITY.copysign(number),
        _ => number,
    })
}

/// Commands that supervise the program at the other end of the line.
const OF_HOST: [&str; 4] = ["HOST:ALIVe", "HOST:ARM", "HOST:RELease", "HOST:UNATTended"];

/// Whether a line has a command of a program that drives.
pub fn drives(line: &str) -> bool {
    Commands::new(line.as_bytes()).any(|command| is_sign_of_life(&command) && !is_of_host(&command))
}

/// Whether a line sets nothing in motion: queries, stops, and the clearing of a fault.
pub fn is_harmless(line: &str) -> bool {
    Commands::new(line.as_bytes()).all(|command| !is_sign_of_life(&command) || is_stop(&command) || command.is("FAULt:CLEar"))
}

/// Whether a line changes how the program at the other end is supervised; also where the header continues the path, as in
/// `HOST:ARM?;ARM 3600`.
pub fn supervises(line: &str) -> bool {
    Commands::new(line.as_bytes()).any(|command| !command.is_query && is_of_host(&command))
}

fn is_of_host(command: &Command) -> bool {
    OF_HOST.iter().any(|pattern| command.is(pattern))
}

/// Maximum length of a line to the stand without its line feed, bytes.
pub const MAX_LINE: usize = 200;
/// Length of the checksum: `~` and eight hexadecimal digits.
const CHECKSUM: usize = 9;

/// A command with its CRC-32 and line feed: `*IDN?~XXXXXXXX`.
pub fn with_checksum(command: &str) -> String {
    format!("{command}~{:08X}\n", crc32(command.as_bytes()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    #[test]
    fn stops_and_queries_are_harmless_in_any_form() {
        for line in [
            "OUTP OFF",
            "output 0",
            "PROF:STOP",
            "SOUR:MODE OFF",
            "*RST",
            "DRIF:ABOR",
            "STOP",
            "FAULt:CLEar",
            "MEAS:CURR?",
            "*IDN?;OUTP OFF",
        ] {
            assert!(super::is_harmless(line), "{line}");
        }
        for line in ["OUTP ON", "SOUR:RATE 9", "OUTP OFF;OUTP ON", "PROF:STAR", "SOUR:MODE RATE"] {
            assert!(!super::is_harmless(line), "{line}");
        }
    }

    #[test]
    fn checksum_is_crc_32_of_the_command() {
        // python: zlib.crc32(b"*IDN?")
        assert_eq!(super::with_checksum("123456789"), "123456789~CBF43926\n");
    }

    #[test]
    fn only_the_head_of_a_block_is_removed() {
        for (line, text) in
            [("#212*IDN? -> who", "*IDN? -> who"), ("#212", ""), ("#2x2a", "#2x2a"), ("#9", "#9"), ("#", "#"), ("1.5", "1.5")]
        {
            assert_eq!(super::without_block_head(line), text);
        }
    }

    #[test]
    fn numbers_of_replies_have_units_or_not_and_know_not_a_number() {
        use super::reply_number;
        assert_eq!(
            ["1.5", "1.5E-3 RAD/S", "9.9E37", "-9.9E37 V", "V", ""].map(reply_number),
            [Some(1.5), Some(1.5e-3), Some(f64::INFINITY), Some(-f64::INFINITY), None, None]
        );
        assert!(reply_number("9.91E37 PPM").unwrap().is_nan());
    }
}

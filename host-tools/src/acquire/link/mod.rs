//! The serial line to a stand, from the host's side.
//!
//! In: the path of a port, a real one or a PTY. Out: a [`SerialLink`]: questions and orders in text, each line with its check (interfaces.md, "The serial
//! line"), and the frames of a stream. What was lost on the way is counted ([`LineLosses`]), never hidden. A port that is not there, is taken, or
//! has no stand behind it is told in one line when the link is opened.

mod error;
mod port;
mod receive;

pub use error::LinkError;
pub use port::{BAUD, Port, ports};
pub use receive::{LineLosses, Received, Receiver, StreamHeader};

use std::collections::VecDeque;
use std::path::Path;
use std::time::{Duration, Instant};

use stand_firmware::telemetry::crc32;

/// How long a stand may take for a reply.
pub const REPLY_TIMEOUT: Duration = Duration::from_millis(1500);
/// How long is listened for the rest of what came.
const MOMENT: Duration = Duration::from_millis(20);
/// What a stand's answer to `*IDN?` has in it.
const MODEL: &str = "rotary stand";

/// What ends what is said to a line: the oldest error, and something that nobody else asks for.
const MARK: &str = "SYSTem:ERRor?;:SYSTem:LINE:RATE?";
const MARK_ENDS: &str = " BAUD";
/// The error of a line that was damaged on the way, and how often it is said again.
const DAMAGED: &str = "-362,";
const TRIES: u32 = 4;
/// How often it is asked who is there.
const GREETINGS: u32 = 6;

/// What came of a line.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reply {
    /// The lines of the reply, empty ones too.
    pub lines: Vec<String>,
    /// The errors that were in the stand's queue afterwards, the oldest first.
    pub refused: Vec<String>,
}

/// A stand at the other end of a line.
#[derive(Debug)]
pub struct SerialLink {
    port: Port,
    receiver: Receiver,
    heard: VecDeque<Received>,
    identity: String,
}

impl SerialLink {
    /// Opens the port and makes sure that a stand answers.
    ///
    /// # Errors
    /// No such port, taken, no stand: one line for a person each.
    pub fn open(path: &Path) -> Result<Self, LinkError> {
        let port = Port::open(path)?;
        let mut link = SerialLink { port, receiver: Receiver::default(), heard: VecDeque::new(), identity: String::new() };
        link.greet()?;
        Ok(link)
    }

    /// Asks who is there, as often as the time of a reply allows: the first line may be damaged, or come before the stand listens.
    fn greet(&mut self) -> Result<(), LinkError> {
        let mut stranger = None;
        for attempt in 0..GREETINGS {
            // Whatever another program or a person has left half-said ends here, and is not done: nothing is no check.
            self.port.write(b"~\r\n")?;
            if attempt == 0 {
                // What the stand was saying is let go.
                self.quiet()?;
            }
            self.send("*IDN?")?;
            let deadline = Instant::now() + REPLY_TIMEOUT / GREETINGS;
            while let Some(line) = self.line(deadline)? {
                if line.to_ascii_lowercase().contains(MODEL) {
                    self.identity = line;
                    self.settle()?;
                    self.receiver.forget();
                    return Ok(());
                }
                stranger.get_or_insert(line);
            }
        }
        Err(match stranger {
            Some(line) => LinkError::Stranger { port: self.name(), says: line.chars().take(60).collect() },
            None if self.receiver.bytes() > 0 => LinkError::Garbled { port: self.name(), baud: BAUD },
            None => LinkError::Silent { port: self.name(), baud: BAUD },
        })
    }

    /// Hears the rest of what was asked more than once, and the errors that were in the queue before: they are nobody's answer.
    fn settle(&mut self) -> Result<(), LinkError> {
        let deadline = Instant::now() + REPLY_TIMEOUT;
        while Instant::now() < deadline {
            self.send(MARK)?;
            let patience = Instant::now() + REPLY_TIMEOUT / GREETINGS;
            while let Some(line) = self.line(patience)? {
                match line.rsplit_once(';') {
                    Some((error, mark)) if mark.ends_with(MARK_ENDS) && error.starts_with("0,") => return Ok(()),
                    Some((_, mark)) if mark.ends_with(MARK_ENDS) => break,
                    _ => {}
                }
            }
        }
        Err(LinkError::NoReply { port: self.name(), query: "*IDN?".to_owned() })
    }

    /// The port's path.
    pub fn name(&self) -> String {
        self.port.path().display().to_string()
    }

    /// The stand's answer to `*IDN?`: maker, model, serial number, firmware.
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// What was lost on the line since it was opened.
    pub fn losses(&self) -> LineLosses {
        self.receiver.losses()
    }

    /// What was heard and lost so far is nobody's: a recording begins.
    pub fn forget(&mut self) {
        self.heard.clear();
        self.receiver.forget();
    }

    /// Sends a line with its check.
    ///
    /// # Errors
    /// The line was unplugged, or is longer than the stand takes.
    pub fn send(&mut self, command: &str) -> Result<(), LinkError> {
        let line = with_checksum(command);
        if line.len() > MOST_LINE {
            return Err(LinkError::TooLong { command: command.to_owned(), most: MOST_LINE - CHECK });
        }
        self.port.write(line.as_bytes())
    }

    /// Says a line and hears what the stand has to say to it, and what of it the stand refused. A line that was damaged on the way is said again.
    ///
    /// # Errors
    /// The line was unplugged; no reply within `patience`.
    pub fn converse(&mut self, command: &str, patience: Duration) -> Result<Reply, LinkError> {
        for _ in 0..TRIES {
            let said = self.converse_once(command, patience)?;
            if !said.refused.iter().any(|says| says.starts_with(DAMAGED)) {
                return Ok(said);
            }
        }
        Err(LinkError::NoReply { port: self.name(), query: command.to_owned() })
    }

    fn converse_once(&mut self, command: &str, patience: Duration) -> Result<Reply, LinkError> {
        // Lines that nobody asked for belong to no question.
        self.heard.retain(|heard| !matches!(heard, Received::Line(_)));
        self.send(command)?;
        let mut said = Reply::default();
        loop {
            self.send(MARK)?;
            let deadline = Instant::now() + patience;
            let error = loop {
                let Some(line) = self.line(deadline)? else {
                    return Err(LinkError::NoReply { port: self.name(), query: command.to_owned() });
                };
                match line.rsplit_once(';') {
                    Some((error, mark)) if mark.ends_with(MARK_ENDS) && error.ends_with('"') => break error.to_owned(),
                    // In a stream errors are told at once; they are in the queue, too.
                    _ if line.starts_with("ERROR ") => {}
                    _ => said.lines.push(line),
                }
            };
            if error.starts_with("0,") {
                return Ok(said);
            }
            said.refused.push(error);
        }
    }

    /// Asks, and waits for the one line of the reply.
    ///
    /// # Errors
    /// The line was unplugged; no reply; the stand refuses, with its own words.
    pub fn query(&mut self, query: &str) -> Result<String, LinkError> {
        let lines = self.query_lines(query)?;
        let none = || LinkError::NoReply { port: self.name(), query: query.to_owned() };
        lines.into_iter().next().ok_or_else(none)
    }

    /// Asks for a reply of several lines.
    ///
    /// # Errors
    /// As [`SerialLink::ask`].
    pub fn query_lines(&mut self, query: &str) -> Result<Vec<String>, LinkError> {
        let said = self.converse(query, REPLY_TIMEOUT)?;
        match said.refused.into_iter().next() {
            None => Ok(said.lines.into_iter().filter(|line| !line.is_empty()).collect()),
            Some(says) => Err(LinkError::Refused { command: query.to_owned(), says }),
        }
    }

    /// Gives an order, and makes sure that it was taken.
    ///
    /// # Errors
    /// The line was unplugged; the stand refuses, with its own words.
    pub fn command(&mut self, command: &str) -> Result<(), LinkError> {
        self.query_lines(command).map(|_| ())
    }

    /// The byte 0x18: the drive is stopped and text is spoken, whatever the stand does.
    ///
    /// # Errors
    /// The line was unplugged.
    pub fn cancel(&mut self) -> Result<(), LinkError> {
        self.port.write(&[0x18])
    }

    /// The next line of text until `deadline`; rows and the like that come before it are kept.
    fn line(&mut self, deadline: Instant) -> Result<Option<String>, LinkError> {
        loop {
            if let Some(at) = self.heard.iter().position(|heard| matches!(heard, Received::Line(_)))
                && let Some(Received::Line(line)) = self.heard.remove(at)
            {
                return Ok(Some(line));
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            self.listen(left)?;
        }
    }

    /// The next thing that is heard within `wait`.
    ///
    /// # Errors
    /// The line was unplugged.
    pub fn next(&mut self, wait: Duration) -> Result<Option<Received>, LinkError> {
        if self.heard.is_empty() {
            self.listen(wait)?;
        }
        Ok(self.heard.pop_front())
    }

    /// Reads once, for at most so long.
    fn listen(&mut self, wait: Duration) -> Result<(), LinkError> {
        let mut some = [0; 4096];
        let count = self.port.read(&mut some, wait)?;
        self.receiver.take(&some[..count], &mut self.heard);
        Ok(())
    }

    /// Lets go what comes until a moment is silent, in a stream for a moment.
    fn quiet(&mut self) -> Result<(), LinkError> {
        let until = Instant::now() + 5 * MOMENT;
        loop {
            self.listen(MOMENT)?;
            if std::mem::take(&mut self.heard).is_empty() || Instant::now() > until {
                return Ok(());
            }
        }
    }
}

/// Most bytes of a line to the stand, its end not counted (interfaces.md).
const MOST_LINE: usize = 200;
/// `~` and eight digits.
const CHECK: usize = 9;

/// A command with its check and its end: `*IDN?~XXXXXXXX` and a line feed.
pub fn with_checksum(command: &str) -> String {
    format!("{command}~{:08X}\n", crc32(command.as_bytes()))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_check_is_zlibs_crc_of_the_command() {
        // python: zlib.crc32(b"*IDN?")
        assert_eq!(super::with_checksum("123456789"), "123456789~CBF43926\n");
    }
}

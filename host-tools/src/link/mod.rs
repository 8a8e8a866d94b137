//! The serial line to a stand, from the host's side.
//!
//! In: the path of a port, a real one or a PTY. Out: a [`Link`]: questions and orders in text, each line with its check (interfaces.md, "The serial
//! line"), and the frames of a stream. What was lost on the way is counted ([`Losses`]), never hidden. A port that is not there, is taken, or
//! has no stand behind it is told in one line when the link is opened.

mod error;
mod port;
mod receive;

pub use error::LinkError;
pub use port::{BAUD, Port};
pub use receive::{Greeting, Heard, Losses, Receiver};

use std::collections::VecDeque;
use std::path::Path;
use std::time::{Duration, Instant};

use stand_firmware::telemetry::crc32;

/// How long a stand may take for a reply.
pub const REPLY: Duration = Duration::from_millis(1500);
/// How long is listened for the rest of what came.
const MOMENT: Duration = Duration::from_millis(20);
/// What a stand's answer to `*IDN?` has in it.
const MODEL: &str = "rotary stand";

/// A stand at the other end of a line.
#[derive(Debug)]
pub struct Link {
    port: Port,
    receiver: Receiver,
    heard: VecDeque<Heard>,
    identity: String,
}

impl Link {
    /// Opens the port and makes sure that a stand answers.
    ///
    /// # Errors
    /// No such port, taken, no stand: one line for a person each.
    pub fn open(path: &Path) -> Result<Self, LinkError> {
        let port = Port::open(path)?;
        let mut link = Link { port, receiver: Receiver::default(), heard: VecDeque::new(), identity: String::new() };
        // Whatever another program has left half-said ends here; what the stand was saying is let go.
        link.port.write(b"\r\n")?;
        link.quiet()?;
        link.send("*IDN?")?;
        let deadline = Instant::now() + REPLY;
        let mut stranger = None;
        while let Some(line) = link.line(deadline)? {
            if line.to_ascii_lowercase().contains(MODEL) {
                link.identity = line;
                link.receiver.forget();
                return Ok(link);
            }
            stranger.get_or_insert(line);
        }
        Err(match stranger {
            Some(line) => LinkError::Stranger { port: link.name(), says: line.chars().take(60).collect() },
            None if link.receiver.bytes() > 0 => LinkError::Garbled { port: link.name(), baud: BAUD },
            None => LinkError::Silent { port: link.name(), baud: BAUD },
        })
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
    pub fn losses(&self) -> Losses {
        self.receiver.losses()
    }

    /// Sends a line with its check.
    ///
    /// # Errors
    /// The line was unplugged, or is longer than the stand takes.
    pub fn send(&mut self, command: &str) -> Result<(), LinkError> {
        let line = checked(command);
        if line.len() > MOST_LINE {
            return Err(LinkError::TooLong { command: command.to_owned(), most: MOST_LINE - CHECK });
        }
        self.port.write(line.as_bytes())
    }

    /// Asks, and waits for the one line of the reply.
    ///
    /// # Errors
    /// The line was unplugged; no reply; the stand refuses, with its own words.
    pub fn ask(&mut self, query: &str) -> Result<String, LinkError> {
        self.let_lines_go();
        self.send(query)?;
        match self.line(Instant::now() + REPLY)? {
            Some(line) => Ok(line),
            // A query that is not understood has no reply; the error says why.
            None => match self.errors()? {
                Some(says) => Err(LinkError::Refused { command: query.to_owned(), says }),
                None => Err(LinkError::NoReply { port: self.name(), query: query.to_owned() }),
            },
        }
    }

    /// Gives an order, and makes sure that it was taken.
    ///
    /// # Errors
    /// The line was unplugged; the stand refuses, with its own words.
    pub fn tell(&mut self, command: &str) -> Result<(), LinkError> {
        self.let_lines_go();
        self.send(command)?;
        match self.errors()? {
            None => Ok(()),
            Some(says) => Err(LinkError::Refused { command: command.to_owned(), says }),
        }
    }

    /// Asks for a reply of several lines: all that come until the stand has done it.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn ask_lines(&mut self, query: &str) -> Result<Vec<String>, LinkError> {
        self.let_lines_go();
        self.send(query)?;
        self.send("*OPC?")?;
        let mut lines = Vec::new();
        while let Some(line) = self.line(Instant::now() + REPLY)? {
            if line == "1" {
                return Ok(lines);
            }
            lines.push(line);
        }
        Err(LinkError::NoReply { port: self.name(), query: query.to_owned() })
    }

    /// The oldest error of the stand's queue, if there is one; the rest of the queue is emptied.
    fn errors(&mut self) -> Result<Option<String>, LinkError> {
        let mut first = None;
        loop {
            self.send("SYSTem:ERRor?")?;
            let Some(line) = self.line(Instant::now() + REPLY)? else {
                return Err(LinkError::NoReply { port: self.name(), query: "SYSTem:ERRor?".to_owned() });
            };
            if line.trim_start_matches('+').starts_with('0') {
                return Ok(first);
            }
            first.get_or_insert(line);
        }
    }

    /// The next line of text until `deadline`; rows and the like that come before it are kept.
    fn line(&mut self, deadline: Instant) -> Result<Option<String>, LinkError> {
        loop {
            if let Some(at) = self.heard.iter().position(|heard| matches!(heard, Heard::Line(_)))
                && let Some(Heard::Line(line)) = self.heard.remove(at)
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
    pub fn next(&mut self, wait: Duration) -> Result<Option<Heard>, LinkError> {
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

    /// Lines that nobody asked for belong to no question.
    fn let_lines_go(&mut self) {
        self.heard.retain(|heard| !matches!(heard, Heard::Line(_)));
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
pub fn checked(command: &str) -> String {
    format!("{command}~{:08X}\n", crc32(command.as_bytes()))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_check_is_zlibs_crc_of_the_command() {
        // python: zlib.crc32(b"*IDN?")
        assert_eq!(super::checked("123456789"), "123456789~CBF43926\n");
    }
}

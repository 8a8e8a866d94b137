//! The line of a served stand: a pseudo-terminal or a TCP port.

use std::io;
use std::time::Duration;

use super::pty::PtyError;
use super::{Pty, TcpPort};

/// The line of a served stand.
#[derive(Debug)]
pub enum ServedLine {
    /// A pseudo-terminal.
    Pty(Pty),
    /// A TCP port of the loopback interface.
    Tcp(TcpPort),
}

/// Why the line failed.
#[derive(Debug, thiserror::Error)]
pub enum ServedLineError {
    /// The pseudo-terminal.
    #[error(transparent)]
    Pty(#[from] PtyError),
    /// The TCP port.
    #[error("TCP: {0}")]
    Tcp(#[from] io::Error),
}

impl ServedLine {
    /// Name that `--port` accepts.
    pub fn name(&self) -> String {
        match self {
            ServedLine::Pty(pty) => pty.path().display().to_string(),
            ServedLine::Tcp(tcp) => format!("tcp:{}", tcp.address()),
        }
    }

    /// Bytes lost because a client did not read them in time.
    pub fn lost(&self) -> u64 {
        match self {
            ServedLine::Pty(pty) => pty.lost(),
            ServedLine::Tcp(tcp) => tcp.lost(),
        }
    }

    /// Reads the bytes of the client since the last call into `into`, and sends it the bytes of `out`.
    ///
    /// # Errors
    /// The line failed.
    pub fn exchange(&mut self, out: &mut Vec<u8>, into: &mut Vec<u8>) -> Result<(), ServedLineError> {
        match self {
            ServedLine::Pty(pty) => Ok(pty.exchange(out, into)?),
            ServedLine::Tcp(tcp) => Ok(tcp.exchange(out, into)?),
        }
    }

    /// Waits until a client has written, at most `timeout`.
    ///
    /// # Errors
    /// The line failed.
    pub fn wait(&self, timeout: Duration) -> Result<(), ServedLineError> {
        match self {
            ServedLine::Pty(pty) => Ok(pty.wait(timeout)?),
            ServedLine::Tcp(tcp) => Ok(tcp.wait(timeout)?),
        }
    }
}

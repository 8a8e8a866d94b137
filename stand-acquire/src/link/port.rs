//! A serial port in exclusive use, or a TCP connection to a stand (`tcp:PORT`, `tcp:HOST:PORT`).
//!
//! Raw bytes, eight bits, no parity, no flow control. Exclusive by an advisory lock (like pyserial's `exclusive` and picocom's) and by the
//! exclusive mode of the driver, so that no other program reads part of the replies.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serial2::{SerialPort, Settings};

use super::LinkError;

/// Baud rate of the stand; a pseudo-terminal ignores it.
pub const BAUD: u32 = 921_600;

/// Time for another program to release the port: a child process that is being started holds it until it runs.
const RELEASE_TIME: Duration = Duration::from_millis(300);

/// Line that a stand behind a TCP port sends to a second client.
pub const IN_USE: &str = "ERROR the stand is in use by another client";

/// Time in which a stand behind a TCP port refuses a second client.
const REFUSAL_TIME: Duration = Duration::from_millis(100);

/// An open port.
#[derive(Debug)]
pub struct Port {
    path: PathBuf,
    line: OpenLine,
    read_timeout: Duration,
}

#[derive(Debug)]
enum OpenLine {
    Serial(SerialPort),
    Tcp(TcpStream),
}

impl Port {
    /// Opens the port at `path` for exclusive use.
    ///
    /// # Errors
    /// The port does not exist, is not a serial port, is in use, or may not be opened.
    pub fn open(path: &Path) -> Result<Self, LinkError> {
        let begun = Instant::now();
        loop {
            match Self::open_at_once(path) {
                // A pseudo-terminal is made raw when a client has left, and then another one's settings are not applied as a whole.
                Err(LinkError::InUse { .. } | LinkError::Other { .. }) if begun.elapsed() < RELEASE_TIME => {
                    std::thread::sleep(Duration::from_millis(10))
                }
                opened => return opened,
            }
        }
    }

    fn open_at_once(path: &Path) -> Result<Self, LinkError> {
        let port = path.display().to_string();
        if let Some(address) = port.strip_prefix("tcp:") {
            return Ok(Port { path: path.to_owned(), line: OpenLine::Tcp(connect(&port, address)?), read_timeout: REFUSAL_TIME });
        }
        let settings = |mut settings: Settings| {
            settings.set_raw();
            settings.set_baud_rate(BAUD)?;
            Ok(settings)
        };
        let mut serial = match SerialPort::open(path, settings) {
            Ok(serial) => serial,
            Err(error) => return Err(open_error(path, error)),
        };
        if !lock(&serial) {
            return Err(LinkError::InUse { port });
        }
        let other = |source| LinkError::Other { port: port.clone(), source };
        serial.set_write_timeout(Duration::from_secs(2)).map_err(other)?;
        serial.discard_input_buffer().map_err(other)?;
        Ok(Port { path: path.to_owned(), line: OpenLine::Serial(serial), read_timeout: Duration::ZERO })
    }

    /// Path of the port.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the available bytes, waiting at most `wait` for the first; 0 if none came.
    ///
    /// # Errors
    /// The port was disconnected.
    pub fn read(&mut self, into: &mut [u8], wait: Duration) -> Result<usize, LinkError> {
        if self.read_timeout != wait {
            let timeout = wait.max(Duration::from_millis(1));
            let set = match &mut self.line {
                OpenLine::Serial(serial) => serial.set_read_timeout(timeout),
                OpenLine::Tcp(stream) => stream.set_read_timeout(Some(timeout)),
            };
            set.map_err(|e| self.broken(e))?;
            self.read_timeout = wait;
        }
        let read = match &mut self.line {
            OpenLine::Serial(serial) => serial.read(into),
            OpenLine::Tcp(stream) => stream.read(into),
        };
        match read {
            // The other end of a pseudo-terminal is closed, or a USB port was unplugged.
            Ok(0) => Err(LinkError::Unplugged { port: self.path.display().to_string() }),
            Ok(count) => Ok(count),
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock) => Ok(0),
            Err(e) => Err(self.broken(e)),
        }
    }

    /// Writes all bytes.
    ///
    /// # Errors
    /// The port was disconnected.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let written = match &mut self.line {
            OpenLine::Serial(serial) => serial.write_all(bytes),
            OpenLine::Tcp(stream) => stream.write_all(bytes),
        };
        written.map_err(|e| self.broken(e))
    }

    fn broken(&self, source: std::io::Error) -> LinkError {
        let port = self.path.display().to_string();
        // EIO, ENXIO, ENODEV: the device no longer exists.
        match source.raw_os_error() {
            Some(5 | 6 | 19) => LinkError::Unplugged { port },
            _ if matches!(source.kind(), ErrorKind::BrokenPipe | ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted) => {
                LinkError::Unplugged { port }
            }
            _ => LinkError::Other { port, source },
        }
    }
}

/// Connects to `[HOST:]PORT`, by default of this computer.
fn connect(port: &str, address: &str) -> Result<TcpStream, LinkError> {
    let other = |source| LinkError::Other { port: port.to_owned(), source };
    let address = if address.contains(':') { address.to_owned() } else { format!("127.0.0.1:{address}") };
    let stream = TcpStream::connect(&address).map_err(|error| match error.kind() {
        ErrorKind::ConnectionRefused => LinkError::Absent {
            port: port.to_owned(),
            available: "no stand listens there; `stand sim --serve tcp:PORT` serves one".to_owned(),
        },
        ErrorKind::InvalidInput => LinkError::NotAPort { port: port.to_owned() },
        _ => other(error),
    })?;
    stream.set_nodelay(true).map_err(other)?;
    stream.set_write_timeout(Some(Duration::from_secs(2))).map_err(other)?;
    stream.set_read_timeout(Some(REFUSAL_TIME)).map_err(other)?;
    // A stand is silent until it is asked, unless it refuses the connection.
    let mut first = [0; IN_USE.len()];
    match stream.peek(&mut first) {
        Ok(0) => Err(LinkError::InUse { port: port.to_owned() }),
        Ok(count) if IN_USE.as_bytes().starts_with(&first[..count]) => Err(LinkError::InUse { port: port.to_owned() }),
        _ => Ok(stream),
    }
}

/// Locks the port; `false` if another program has locked it.
#[cfg(unix)]
fn lock(serial: &SerialPort) -> bool {
    use rustix::fs::{FlockOperation, flock};
    if flock(serial, FlockOperation::NonBlockingLockExclusive).is_err() {
        return false;
    }
    // Keeps out programs without a lock; the driver releases it when the port is closed.
    let _ = rustix::termios::ioctl_tiocexcl(serial);
    true
}

/// Windows opens a port for one program at a time.
#[cfg(not(unix))]
fn lock(_: &SerialPort) -> bool {
    true
}

/// The error of a port that could not be opened.
fn open_error(path: &Path, error: std::io::Error) -> LinkError {
    let port = path.display().to_string();
    match (error.kind(), error.raw_os_error()) {
        (ErrorKind::NotFound, _) => LinkError::Absent { port, available: ports() },
        (ErrorKind::PermissionDenied, _) => LinkError::Denied { port },
        (ErrorKind::ResourceBusy, _) => LinkError::InUse { port },
        // ENOTTY, EINVAL, EISDIR, ENXIO: a file, folder or socket.
        (_, Some(25 | 22 | 21 | 6)) => LinkError::NotAPort { port },
        _ if path.is_file() || path.is_dir() => LinkError::NotAPort { port },
        _ => LinkError::Other { port, source: error },
    }
}

/// The available ports, for an error message.
pub fn ports() -> String {
    let mut names: Vec<String> = SerialPort::available_ports()
        .unwrap_or_default()
        .iter()
        .map(|path| path.display().to_string())
        // Onboard ports, most of which do not exist physically.
        .filter(|name| !name.starts_with("/dev/ttyS"))
        .collect();
    names.sort();
    if names.is_empty() { "no serial port is connected".to_owned() } else { format!("available: {}", names.join(", ")) }
}

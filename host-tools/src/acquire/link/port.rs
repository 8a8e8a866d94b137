//! A serial port, for this program alone.
//!
//! Raw bytes, eight bits, no parity, no flow control. RowOutcome by an advisory lock (as pyserial's `exclusive` and picocom's do) and by the
//! driver's own exclusive mode, so that neither a second `stand` nor another program reads half of what the first one waits for.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serial2::{SerialPort, Settings};

use super::LinkError;

/// The line's rate on the board, bits per second; a PTY has none.
pub const BAUD: u32 = 921_600;

/// Who has just closed a port may hold it for a moment yet: a program that was being started meanwhile has it until it runs.
const GIVING_BACK: Duration = Duration::from_millis(300);

/// An open port.
#[derive(Debug)]
pub struct Port {
    path: PathBuf,
    serial: SerialPort,
    waits: Duration,
}

impl Port {
    /// Opens the port at `path` for this program alone.
    ///
    /// # Errors
    /// There is none, it is no port, it is taken, or it may not be opened.
    pub fn open(path: &Path) -> Result<Self, LinkError> {
        let begun = Instant::now();
        loop {
            match Self::open_at_once(path) {
                Err(LinkError::RowOutcome { .. }) if begun.elapsed() < GIVING_BACK => std::thread::sleep(Duration::from_millis(10)),
                opened => return opened,
            }
        }
    }

    fn open_at_once(path: &Path) -> Result<Self, LinkError> {
        let port = path.display().to_string();
        let settings = |mut settings: Settings| {
            settings.set_raw();
            settings.set_baud_rate(BAUD)?;
            Ok(settings)
        };
        let mut serial = match SerialPort::open(path, settings) {
            Ok(serial) => serial,
            Err(error) => return Err(refused(path, error)),
        };
        if !lock(&serial) {
            return Err(LinkError::RowOutcome { port });
        }
        let other = |source| LinkError::Other { port: port.clone(), source };
        serial.set_write_timeout(Duration::from_secs(2)).map_err(other)?;
        serial.discard_input_buffer().map_err(other)?;
        Ok(Port { path: path.to_owned(), serial, waits: Duration::ZERO })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads what there is, waiting for at most `wait` for the first byte; 0 bytes if none came.
    ///
    /// # Errors
    /// The line was unplugged.
    pub fn read(&mut self, into: &mut [u8], wait: Duration) -> Result<usize, LinkError> {
        if self.waits != wait {
            self.serial.set_read_timeout(wait.max(Duration::from_millis(1))).map_err(|e| self.broken(e))?;
            self.waits = wait;
        }
        match self.serial.read(into) {
            // The other end of a PTY is closed, or a USB port was pulled.
            Ok(0) => Err(LinkError::Unplugged { port: self.path.display().to_string() }),
            Ok(count) => Ok(count),
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock) => Ok(0),
            Err(e) => Err(self.broken(e)),
        }
    }

    /// Writes all.
    ///
    /// # Errors
    /// The line was unplugged.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.serial.write_all(bytes).map_err(|e| self.broken(e))
    }

    fn broken(&self, source: std::io::Error) -> LinkError {
        let port = self.path.display().to_string();
        // EIO, ENXIO, ENODEV: the device is no longer there.
        match source.raw_os_error() {
            Some(5 | 6 | 19) => LinkError::Unplugged { port },
            _ if source.kind() == ErrorKind::BrokenPipe => LinkError::Unplugged { port },
            _ => LinkError::Other { port, source },
        }
    }
}

/// Takes the port for this program; `false` if somebody else has it.
#[cfg(unix)]
fn lock(serial: &SerialPort) -> bool {
    use rustix::fs::{FlockOperation, flock};
    if flock(serial, FlockOperation::NonBlockingLockExclusive).is_err() {
        return false;
    }
    // Keeps out those who ask for no lock; the driver gives it back as the port is closed.
    let _ = rustix::termios::ioctl_tiocexcl(serial);
    true
}

/// Windows opens a port for one program only.
#[cfg(not(unix))]
fn lock(_: &SerialPort) -> bool {
    true
}

/// Why a port could not be opened.
fn refused(path: &Path, error: std::io::Error) -> LinkError {
    let port = path.display().to_string();
    match (error.kind(), error.raw_os_error()) {
        (ErrorKind::NotFound, _) => LinkError::Absent { port, there: ports() },
        (ErrorKind::PermissionDenied, _) => LinkError::Denied { port },
        (ErrorKind::ResourceBusy, _) => LinkError::RowOutcome { port },
        // ENOTTY, EINVAL, EISDIR, ENXIO: a file, a folder, a socket.
        (_, Some(25 | 22 | 21 | 6)) => LinkError::NoPort { port },
        _ if path.is_file() || path.is_dir() => LinkError::NoPort { port },
        _ => LinkError::Other { port, source: error },
    }
}

/// The ports that there are, for a person who typed another one.
pub fn ports() -> String {
    let mut names: Vec<String> = SerialPort::available_ports()
        .unwrap_or_default()
        .iter()
        .map(|path| path.display().to_string())
        // The sixteen onboard ports that most computers only pretend to have.
        .filter(|name| !name.starts_with("/dev/ttyS"))
        .collect();
    names.sort();
    if names.is_empty() { "no serial port is plugged in".to_owned() } else { format!("there are: {}", names.join(", ")) }
}

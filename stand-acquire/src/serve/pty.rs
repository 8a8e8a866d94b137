//! A pseudo-terminal as the serial port of a stand.
//!
//! This module has the master side; clients open the path. Without a client, output of the stand is discarded, as on an unconnected line.
//! The terminal is raw from the start and is reset to raw when a client has left, so that a plain `cat` works and settings of one client do
//! not affect the next. Only [`Pty::wait`] blocks.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::OFlags;
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};

/// Buffer for a client that reads slowly, bytes; when it is full, new bytes are lost.
const MAX_BUFFERED: usize = 1 << 18;

/// A pseudo-terminal.
#[derive(Debug)]
pub struct Pty {
    master: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
    buffered: Vec<u8>,
    has_client: bool,
    lost: u64,
}

/// Why a pseudo-terminal could not be created, or failed.
#[derive(Debug, thiserror::Error)]
pub enum PtyError {
    /// The operating system failed.
    #[error("no pseudo-terminal: {0}")]
    Open(#[from] io::Error),
    /// The path exists and is not a symbolic link.
    #[error("{0}: exists and is not a symbolic link; choose another --link or remove it")]
    LinkTaken(PathBuf),
    /// The link cannot be created.
    #[error("{0}: cannot create the symbolic link: {1}")]
    Link(PathBuf, io::Error),
}

impl From<Errno> for PtyError {
    fn from(error: Errno) -> Self {
        PtyError::Open(error.into())
    }
}

impl Pty {
    /// A new pseudo-terminal; `link` is a symbolic link to it, removed with it.
    ///
    /// # Errors
    /// The operating system provides no pseudo-terminal, or the link cannot be created.
    pub fn open(link: Option<&Path>) -> Result<Self, PtyError> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        rustix::io::ioctl_fionbio(&master, true)?;
        let path = PathBuf::from(std::ffi::OsString::from_vec(ptsname(&master, Vec::new())?.into_bytes()));
        let mut pty = Self { master, path, link: None, buffered: Vec::new(), has_client: false, lost: 0 };
        pty.make_raw()?;
        if let Some(link) = link {
            pty.link(link)?;
        }
        Ok(pty)
    }

    /// Path that a client opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes lost because a client did not read them in time.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Reads the bytes of the client since the last call into `into`, and sends it the bytes of `out`.
    ///
    /// # Errors
    /// The pseudo-terminal failed.
    pub fn exchange(&mut self, out: &mut Vec<u8>, into: &mut Vec<u8>) -> Result<(), PtyError> {
        // Read first: the client may have left already.
        self.read(into)?;
        let is_open = !self.events(PollFlags::OUT, Some(Duration::ZERO))?.contains(PollFlags::HUP);
        if !is_open {
            if std::mem::replace(&mut self.has_client, false) {
                self.buffered.clear();
                self.make_raw()?;
            }
            out.clear();
            return Ok(());
        }
        self.has_client = true;
        let free = MAX_BUFFERED - self.buffered.len();
        self.lost += out.len().saturating_sub(free) as u64;
        self.buffered.extend(out.drain(..).take(free));
        self.write()
    }

    /// Waits until a client has written, at most `timeout`.
    ///
    /// # Errors
    /// The pseudo-terminal failed.
    pub fn wait(&self, timeout: Duration) -> Result<(), PtyError> {
        if !self.has_client {
            // poll() reports a terminal without a client as always ready.
            std::thread::sleep(timeout);
            return Ok(());
        }
        self.events(PollFlags::IN, Some(timeout)).map(|_| ())
    }

    fn events(&self, of: PollFlags, timeout: Option<Duration>) -> Result<PollFlags, PtyError> {
        let timeout = timeout.map(|t| Timespec { tv_sec: t.as_secs() as i64, tv_nsec: i64::from(t.subsec_nanos()) });
        let mut fds = [PollFd::new(&self.master, of)];
        match poll(&mut fds, timeout.as_ref()) {
            Ok(_) | Err(Errno::INTR) => Ok(fds[0].revents()),
            Err(error) => Err(error.into()),
        }
    }

    fn read(&self, into: &mut Vec<u8>) -> Result<(), PtyError> {
        let mut buffer = [0; 4096];
        loop {
            match rustix::io::read(&self.master, &mut buffer) {
                Ok(0) | Err(Errno::AGAIN | Errno::INTR) => return Ok(()),
                Ok(count) => into.extend_from_slice(&buffer[..count]),
                // The last client has closed the terminal.
                Err(Errno::IO) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
        }
    }

    fn write(&mut self) -> Result<(), PtyError> {
        let mut written = 0;
        while written < self.buffered.len() {
            match rustix::io::write(&self.master, &self.buffered[written..]) {
                Ok(0) | Err(Errno::AGAIN | Errno::INTR | Errno::IO) => break,
                Ok(count) => written += count,
                Err(error) => return Err(error.into()),
            }
        }
        self.buffered.drain(..written);
        Ok(())
    }

    /// Sets the terminal to raw mode and discards what the client that has left did not read. What a next client may have written already
    /// stays.
    fn make_raw(&self) -> Result<(), PtyError> {
        let client = self.client()?;
        let mut settings = tcgetattr(&client)?;
        settings.make_raw();
        tcsetattr(&client, OptionalActions::Now, &settings)?;
        tcflush(&client, QueueSelector::IFlush)?;
        Ok(())
    }

    fn client(&self) -> io::Result<File> {
        let flags = OFlags::NOCTTY | OFlags::NONBLOCK;
        OpenOptions::new().read(true).write(true).custom_flags(flags.bits() as i32).open(&self.path)
    }

    /// Creates the symbolic link; replaces an existing one.
    fn link(&mut self, link: &Path) -> Result<(), PtyError> {
        let failed = |error| PtyError::Link(link.to_owned(), error);
        match fs::symlink_metadata(link) {
            Ok(there) if there.file_type().is_symlink() => fs::remove_file(link).map_err(failed)?,
            Ok(_) => return Err(PtyError::LinkTaken(link.to_owned())),
            Err(_) => {}
        }
        std::os::unix::fs::symlink(&self.path, link).map_err(failed)?;
        self.link = Some(link.to_owned());
        Ok(())
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        // A link that points elsewhere belongs to another program.
        if let Some(link) = self.link.take().filter(|link| fs::read_link(link).is_ok_and(|to| to == self.path)) {
            let _ = fs::remove_file(link);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};

    fn client(pty: &Pty) -> File {
        let flags = OFlags::NOCTTY | OFlags::NONBLOCK;
        OpenOptions::new().read(true).write(true).custom_flags(flags.bits() as i32).open(pty.path()).unwrap()
    }

    fn said(client: &mut File) -> Vec<u8> {
        let mut all = Vec::new();
        let _ = client.read_to_end(&mut all);
        all
    }

    #[test]
    fn bytes_pass_unchanged_and_output_without_a_client_is_discarded() {
        let mut pty = Pty::open(None).unwrap();
        let every: Vec<u8> = (0..=255).collect();
        let mut heard = Vec::new();
        pty.exchange(&mut b"no client".to_vec(), &mut heard).unwrap();
        for round in 0..3 {
            let mut one = client(&pty);
            pty.exchange(&mut every.clone(), &mut heard).unwrap();
            assert_eq!(said(&mut one), every, "round {round}: raw, without earlier bytes");
            one.write_all(&every).unwrap();
            pty.exchange(&mut b"unread".to_vec(), &mut heard).unwrap();
            assert_eq!(heard, every, "no echo, no line ends changed");
            // Bytes that a client writes before it leaves are received.
            one.write_all(b"last words").unwrap();
            drop(one);
            heard.clear();
            pty.exchange(&mut b"no client".to_vec(), &mut heard).unwrap();
            assert_eq!(heard, b"last words");
            heard.clear();
        }
        assert_eq!(pty.lost(), 0);
    }

    /// The end of one client may be noticed only when the next one has written.
    #[test]
    fn first_line_of_a_quick_next_client_is_received() {
        let mut pty = Pty::open(None).unwrap();
        let mut first = client(&pty);
        pty.exchange(&mut b"unread".to_vec(), &mut Vec::new()).unwrap();
        first.write_all(b"last words").unwrap();
        let mut next = client(&pty);
        next.write_all(b", next line").unwrap();
        drop(first);
        pty.make_raw().unwrap();
        let mut heard = Vec::new();
        pty.exchange(&mut b"reply".to_vec(), &mut heard).unwrap();
        assert_eq!(heard, b"last words, next line");
        assert_eq!(said(&mut next), b"reply", "without what the first client left unread");
    }

    #[test]
    fn bytes_lost_by_a_slow_client_are_counted() {
        let mut pty = Pty::open(None).unwrap();
        let mut slow = client(&pty);
        let sent = 1_000_000;
        for k in 0..sent / 1000 {
            pty.exchange(&mut vec![(k % 251) as u8; 1000], &mut Vec::new()).unwrap();
        }
        assert!(pty.lost() > 0);
        let mut got = Vec::new();
        for _ in 0..10_000 {
            got.extend(said(&mut slow));
            pty.exchange(&mut Vec::new(), &mut Vec::new()).unwrap();
        }
        assert_eq!(got.len() as u64 + pty.lost(), sent as u64);
        // Until the buffer is full nothing is lost; later the kernel may take some bytes at any time.
        let whole = got.chunks(1000).take(MAX_BUFFERED / 1000).enumerate();
        assert!(whole.into_iter().all(|(k, chunk)| chunk.iter().all(|b| *b == (k % 251) as u8)), "the oldest bytes are kept");
        assert!(got.chunk_by(|a, b| a == b).all(|run| run.len() <= 1000), "no byte is repeated");
    }

    #[test]
    fn link_is_removed_with_the_terminal_and_files_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("stand");
        let pty = Pty::open(Some(&link)).unwrap();
        assert_eq!(fs::read_link(&link).unwrap(), pty.path());
        drop(pty);
        assert!(fs::symlink_metadata(&link).is_err());
        std::os::unix::fs::symlink("/nowhere", &link).unwrap();
        drop(Pty::open(Some(&link)).unwrap());
        fs::write(&link, "notes").unwrap();
        assert!(matches!(Pty::open(Some(&link)), Err(PtyError::LinkTaken(_))));
        assert_eq!(fs::read_to_string(&link).unwrap(), "notes");
        let nowhere = folder.path().join("no/such/folder");
        assert!(matches!(Pty::open(Some(&nowhere)), Err(PtyError::Link(..))));
    }
}

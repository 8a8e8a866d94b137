//! A pseudo-terminal as a stand's serial port.
//!
//! The master's end is here; clients open the path. While nobody has it open, what the stand says is lost, as on a line with nobody at the other
//! end, and a client that comes finds nothing old. The terminal is raw from the beginning and is made so again when a client has left, so
//! that a plain `cat` works and one client's settings are not the next one's. Nothing here waits but [`Pty::wait`].

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

/// What may wait for a client that reads slowly, bytes; then the newest are lost.
const MOST_WAITING: usize = 1 << 18;

/// The port.
#[derive(Debug)]
pub struct Pty {
    master: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
    waiting: Vec<u8>,
    has_client: bool,
    lost: u64,
}

/// Why there is no port.
#[derive(Debug, thiserror::Error)]
pub enum PtyError {
    /// The system gives none.
    #[error("no pseudo-terminal: {0}")]
    Open(#[from] io::Error),
    /// The name is taken by something that is not ours to replace.
    #[error("{0}: this is there already and is no symbolic link; give another --link or remove it")]
    LinkTaken(PathBuf),
    /// The link cannot be made.
    #[error("{0}: cannot make this link: {1}")]
    Link(PathBuf, io::Error),
}

impl From<Errno> for PtyError {
    fn from(error: Errno) -> Self {
        PtyError::Open(error.into())
    }
}

impl Pty {
    /// A new port; `link` is a second name for it, which goes away with it.
    ///
    /// # Errors
    /// The system gives no pseudo-terminal, or the link cannot be made.
    pub fn open(link: Option<&Path>) -> Result<Self, PtyError> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        rustix::io::ioctl_fionbio(&master, true)?;
        let path = PathBuf::from(std::ffi::OsString::from_vec(ptsname(&master, Vec::new())?.into_bytes()));
        let mut pty = Self { master, path, link: None, waiting: Vec::new(), has_client: false, lost: 0 };
        pty.make_raw()?;
        if let Some(link) = link {
            pty.link(link)?;
        }
        Ok(pty)
    }

    /// The path that a client opens.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of the stand that a client did not read in time; what is said to nobody does not count.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Takes what a client has written since the last call, and gives it what `out` holds.
    ///
    /// # Errors
    /// The pseudo-terminal itself is broken.
    pub fn exchange(&mut self, out: &mut Vec<u8>, into: &mut Vec<u8>) -> Result<(), PtyError> {
        // First what was written: a client may have left already.
        self.read(into)?;
        let is_open = !self.events(PollFlags::OUT, Some(Duration::ZERO))?.contains(PollFlags::HUP);
        if !is_open {
            if std::mem::replace(&mut self.has_client, false) {
                self.waiting.clear();
                self.make_raw()?;
            }
            out.clear();
            return Ok(());
        }
        self.has_client = true;
        let room = MOST_WAITING - self.waiting.len();
        self.lost += out.len().saturating_sub(room) as u64;
        self.waiting.extend(out.drain(..).take(room));
        self.write()
    }

    /// Waits until a client has written something, but not longer than `most`.
    ///
    /// # Errors
    /// The pseudo-terminal itself is broken.
    pub fn wait(&self, most: Duration) -> Result<(), PtyError> {
        if !self.has_client {
            // A line without a client is "ready" all the time.
            std::thread::sleep(most);
            return Ok(());
        }
        self.events(PollFlags::IN, Some(most)).map(|_| ())
    }

    fn events(&self, of: PollFlags, most: Option<Duration>) -> Result<PollFlags, PtyError> {
        let most = most.map(|most| Timespec { tv_sec: most.as_secs() as i64, tv_nsec: i64::from(most.subsec_nanos()) });
        let mut fds = [PollFd::new(&self.master, of)];
        match poll(&mut fds, most.as_ref()) {
            Ok(_) | Err(Errno::INTR) => Ok(fds[0].revents()),
            Err(error) => Err(error.into()),
        }
    }

    fn read(&self, into: &mut Vec<u8>) -> Result<(), PtyError> {
        let mut some = [0; 4096];
        loop {
            match rustix::io::read(&self.master, &mut some) {
                Ok(0) | Err(Errno::AGAIN | Errno::INTR) => return Ok(()),
                Ok(count) => into.extend_from_slice(&some[..count]),
                // The last client has closed it.
                Err(Errno::IO) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
        }
    }

    fn write(&mut self) -> Result<(), PtyError> {
        let mut written = 0;
        while written < self.waiting.len() {
            match rustix::io::write(&self.master, &self.waiting[written..]) {
                Ok(0) | Err(Errno::AGAIN | Errno::INTR | Errno::IO) => break,
                Ok(count) => written += count,
                Err(error) => return Err(error.into()),
            }
        }
        self.waiting.drain(..written);
        Ok(())
    }

    /// Makes the terminal raw, and lets go what nobody has read.
    fn make_raw(&self) -> Result<(), PtyError> {
        let client = self.client()?;
        let mut settings = tcgetattr(&client)?;
        settings.make_raw();
        tcsetattr(&client, OptionalActions::Now, &settings)?;
        tcflush(&client, QueueSelector::IOFlush)?;
        Ok(())
    }

    fn client(&self) -> io::Result<File> {
        let flags = OFlags::NOCTTY | OFlags::NONBLOCK;
        OpenOptions::new().read(true).write(true).custom_flags(flags.bits() as i32).open(&self.path)
    }

    /// Gives it a second name. A link that is there is an old one: what it points to is gone, or was another stand's.
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
        // Somebody else's by now, if it points elsewhere.
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
    fn bytes_go_through_as_they_are_and_what_is_said_to_nobody_is_gone() {
        let mut pty = Pty::open(None).unwrap();
        let every: Vec<u8> = (0..=255).collect();
        let mut heard = Vec::new();
        pty.exchange(&mut b"to nobody".to_vec(), &mut heard).unwrap();
        for round in 0..3 {
            let mut one = client(&pty);
            pty.exchange(&mut every.clone(), &mut heard).unwrap();
            assert_eq!(said(&mut one), every, "round {round}: raw, and nothing old");
            one.write_all(&every).unwrap();
            pty.exchange(&mut b"unread".to_vec(), &mut heard).unwrap();
            assert_eq!(heard, every, "no echo, no line ends changed");
            // What a client writes before it leaves is heard.
            one.write_all(b"last words").unwrap();
            drop(one);
            heard.clear();
            pty.exchange(&mut b"to nobody".to_vec(), &mut heard).unwrap();
            assert_eq!(heard, b"last words");
            heard.clear();
        }
        assert_eq!(pty.lost(), 0);
    }

    #[test]
    fn a_client_that_does_not_read_loses_the_newest_bytes_and_they_are_counted() {
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
        assert!(got.chunks(1000).enumerate().all(|(k, chunk)| chunk.iter().all(|b| *b == (k % 251) as u8)), "the oldest are whole");
    }

    #[test]
    fn the_second_name_goes_away_with_the_port_and_a_file_is_left_alone() {
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

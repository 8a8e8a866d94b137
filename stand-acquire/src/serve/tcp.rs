//! A TCP port of this computer as the line of a stand: raw SCPI, as instruments offer it.
//!
//! One client at a time; another gets [`IN_USE`] and is disconnected. A client that leaves is not noticed by the stand except by its
//! silence, as on a serial line. Only [`TcpPort::wait`] blocks.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::link::IN_USE;

/// Buffer for a client that reads slowly, bytes; when it is full, new bytes are lost.
const MAX_BUFFERED: usize = 1 << 18;
/// Time that a client that sends no more still gets replies.
const LINGER: Duration = Duration::from_millis(500);

/// A listening port, and its client.
#[derive(Debug)]
pub struct TcpPort {
    listener: TcpListener,
    address: SocketAddr,
    client: Option<Client>,
    lost: u64,
}

#[derive(Debug)]
struct Client {
    stream: TcpStream,
    buffered: Vec<u8>,
    /// When it stopped to send.
    ended: Option<Instant>,
}

impl TcpPort {
    /// Listens on the loopback interface; with port 0, on a free one.
    ///
    /// # Errors
    /// The port is in use, or may not be opened.
    pub fn open(port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        Ok(Self { listener, address, client: None, lost: 0 })
    }

    /// Address that a client connects to.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Bytes lost because a client did not read them in time.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Reads the bytes of the client since the last call into `into`, and sends it the bytes of `out`.
    ///
    /// # Errors
    /// The operating system takes no more clients.
    pub fn exchange(&mut self, out: &mut Vec<u8>, into: &mut Vec<u8>) -> io::Result<()> {
        if self.client.as_mut().is_some_and(|client| !client.read(into)) {
            self.client = None;
        }
        self.accept()?;
        let Some(client) = &mut self.client else {
            out.clear();
            return Ok(());
        };
        let free = MAX_BUFFERED - client.buffered.len();
        self.lost += out.len().saturating_sub(free) as u64;
        client.buffered.extend(out.drain(..).take(free));
        if !client.write() {
            self.client = None;
        }
        Ok(())
    }

    /// Waits until a client has connected or written, at most `timeout`.
    ///
    /// # Errors
    /// The operating system fails.
    pub fn wait(&self, timeout: Duration) -> io::Result<()> {
        let timeout = Timespec { tv_sec: timeout.as_secs() as i64, tv_nsec: i64::from(timeout.subsec_nanos()) };
        let mut fds = vec![PollFd::new(&self.listener, PollFlags::IN)];
        // A client that sends no more is always ready.
        fds.extend(self.client.iter().filter(|client| client.ended.is_none()).map(|client| PollFd::new(&client.stream, PollFlags::IN)));
        match poll(&mut fds, Some(&timeout)) {
            Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    fn accept(&mut self) -> io::Result<()> {
        loop {
            match self.listener.accept() {
                Ok((mut stream, _)) => {
                    if self.client.as_ref().is_some_and(|client| client.ended.is_none()) {
                        // A client that has left already does not read this.
                        let _ = stream.write_all(format!("{IN_USE}\r\n").as_bytes());
                        continue;
                    }
                    stream.set_nonblocking(true)?;
                    stream.set_nodelay(true)?;
                    self.client = Some(Client { stream, buffered: Vec::new(), ended: None });
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                // The client has left before it was accepted.
                Err(error)
                    if matches!(error.kind(), ErrorKind::ConnectionAborted | ErrorKind::ConnectionReset | ErrorKind::Interrupted) => {}
                Err(error) => return Err(error),
            }
        }
    }
}

impl Client {
    /// Reads what has arrived; `false`: the client has left.
    fn read(&mut self, into: &mut Vec<u8>) -> bool {
        if let Some(ended) = self.ended {
            return ended.elapsed() < LINGER;
        }
        let mut buffer = [0; 4096];
        loop {
            match self.stream.read(&mut buffer) {
                Ok(0) => {
                    self.ended = Some(Instant::now());
                    return true;
                }
                Ok(count) => into.extend_from_slice(&buffer[..count]),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return error.kind() == ErrorKind::WouldBlock,
            }
        }
    }

    /// Sends what it accepts; `false`: the client has left.
    fn write(&mut self) -> bool {
        while !self.buffered.is_empty() {
            match self.stream.write(&self.buffered) {
                Ok(count) => drop(self.buffered.drain(..count)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return error.kind() == ErrorKind::WouldBlock,
            }
        }
        true
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use std::net::Shutdown;

    fn connected(port: &TcpPort) -> TcpStream {
        let stream = TcpStream::connect(port.address()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        stream
    }

    /// Exchanges until the stand has received `expected`.
    fn received(port: &mut TcpPort, expected: &[u8]) {
        let mut into = Vec::new();
        let begun = Instant::now();
        while into != expected {
            assert!(begun.elapsed() < Duration::from_secs(5), "{into:?}");
            port.exchange(&mut Vec::new(), &mut into).unwrap();
        }
    }

    #[test]
    fn second_client_is_refused_with_a_line_and_the_place_becomes_free() {
        let mut port = TcpPort::open(0).unwrap();
        let mut first = connected(&port);
        first.write_all(b"*IDN?\n").unwrap();
        received(&mut port, b"*IDN?\n");
        let mut second = connected(&port);
        port.wait(Duration::from_secs(5)).unwrap();
        port.exchange(&mut b"stand\r\n".to_vec(), &mut Vec::new()).unwrap();
        let mut line = String::new();
        second.read_to_string(&mut line).unwrap();
        assert_eq!(line, format!("{IN_USE}\r\n"));
        let mut reply = [0; 7];
        first.read_exact(&mut reply).unwrap();
        assert_eq!(&reply, b"stand\r\n");
        drop(first);
        let mut third = connected(&port);
        third.write_all(b"1\n").unwrap();
        received(&mut port, b"1\n");
    }

    #[test]
    fn client_that_sends_no_more_still_gets_its_reply() {
        let mut port = TcpPort::open(0).unwrap();
        let mut client = connected(&port);
        client.write_all(b"*IDN?\n").unwrap();
        client.shutdown(Shutdown::Write).unwrap();
        received(&mut port, b"*IDN?\n");
        port.exchange(&mut b"stand\r\n".to_vec(), &mut Vec::new()).unwrap();
        std::thread::sleep(LINGER);
        port.exchange(&mut Vec::new(), &mut Vec::new()).unwrap();
        let mut reply = String::new();
        client.read_to_string(&mut reply).unwrap();
        assert_eq!(reply, "stand\r\n");
    }
}

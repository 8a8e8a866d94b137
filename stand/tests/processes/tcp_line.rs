//! A simulated stand behind a TCP port: our tools, raw sockets, PyVISA; one client at a time.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use common::served::send_lines;
use common::{command, folder, stand};
use identification::log::Log;

struct Served {
    child: Child,
    port: String,
}

impl Served {
    fn new() -> Self {
        let words = ["sim", "--serve", "tcp:0"];
        let mut child = command(std::path::Path::new("."), &words).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut port = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut port).unwrap();
        Served { child, port: port.trim().to_owned() }
    }

    fn raw(&self) -> TcpStream {
        let stream = TcpStream::connect(self.port.strip_prefix("tcp:").unwrap()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        stream
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn line(stream: &mut BufReader<TcpStream>) -> String {
    let mut line = String::new();
    stream.read_line(&mut line).unwrap();
    line.trim_end().to_owned()
}

#[test]
fn tools_and_raw_sockets_use_the_line_in_turn() {
    let served = Served::new();
    let folder = folder();
    assert!(served.port.starts_with("tcp:127.0.0.1:"), "{}", served.port);
    let number = served.port.rsplit(':').next().unwrap();
    // The port alone is of this computer.
    let version = send_lines(folder.path(), &format!("tcp:{number}"), "SYSTem:VERSion?\n").succeeded().out;
    assert_eq!(version.trim(), "1999.0");
    stand(folder.path(), &["record", "--port", &served.port, "--out", "r.csv", "--seconds", "1", "--decimation", "10"]).succeeded();
    assert_eq!(Log::read(folder.path().join("r.csv")).unwrap().len(), 100);
    let mut client = BufReader::new(served.raw());
    client.get_mut().write_all(b"*IDN?\n").unwrap();
    let identity = line(&mut client);
    assert!(identity.to_lowercase().contains("stand"), "{identity:?}");
    // A second client, raw or ours, is refused while the first one is connected.
    let mut refused = String::new();
    served.raw().read_to_string(&mut refused).unwrap();
    assert_eq!(refused, "ERROR the stand is in use by another client\r\n");
    let ran = send_lines(folder.path(), &served.port, "*IDN?\n");
    assert!(ran.status == Some(2) && ran.err.contains("another program uses this port"), "{ran:?}");
    client.get_mut().write_all(b"*OPC?\n").unwrap();
    assert_eq!(line(&mut client), "1", "the first client was not disturbed");
}

#[test]
fn drive_stops_when_its_client_is_gone() {
    let served = Served::new();
    let mut client = served.raw();
    client.write_all(b"SOURce:RATE 5;MODE RATE;:OUTPut ON;:OUTPut?\n").unwrap();
    let mut reply = [0; 1];
    client.read_exact(&mut reply).unwrap();
    assert_eq!(&reply, b"1");
    drop(client);
    std::thread::sleep(Duration::from_secs(4));
    let mut client = BufReader::new(served.raw());
    client.get_mut().write_all(b"OUTPut?;:FAULt?\n").unwrap();
    let state = line(&mut client);
    assert!(state.starts_with("0;") && state.contains("host silent"), "{state}");
}

#[test]
fn wrong_ports_are_refused_with_a_line() {
    let folder = folder();
    let refused = |words: &[&str], status, expected: &str| {
        let ran = stand(folder.path(), words);
        assert!(ran.status == Some(status) && ran.err.lines().count() == 1 && ran.err.contains(expected), "{words:?}: {ran:?}");
    };
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    refused(&["console", "--port", &format!("tcp:{free}")], 2, "no stand listens there");
    refused(&["console", "--port", "tcp:nowhere"], 2, "not a");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", taken.local_addr().unwrap().port());
    refused(&["sim", "--serve", &port], 1, &port);
    refused(&["sim", "--serve", "tcp:0", "--link", "port"], 2, "--link");
    for wrong in ["tcp:70000", "tcp:x", "usb"] {
        assert_eq!(stand(folder.path(), &["sim", "--serve", wrong]).status, Some(2), "{wrong}");
    }
}

#[test]
#[ignore = "needs PyVISA, PyMeasure and InstrumentKit; .ci/run installs them"]
fn instrument_libraries_are_clients_over_the_socket() {
    let served = Served::new();
    let (_, number) = served.port.rsplit_once(':').unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scpi_clients.py");
    let ran = Command::new("python3").args([script, number]).output().unwrap();
    let out = String::from_utf8(ran.stdout).unwrap();
    assert!(ran.status.success(), "{out} {}", String::from_utf8_lossy(&ran.stderr));
    for client in ["PyVISA 0 RAD/S", "PyMeasure Rotary Stand,", "InstrumentKit Rotary Stand,", "driver "] {
        assert!(out.contains(client), "{client}: {out}");
    }
}

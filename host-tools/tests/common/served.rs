//! A simulated stand behind a port, for as long as a test needs it.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use super::{Ran, command};

/// A simulated stand that is served for as long as this lives.
pub struct Served {
    pub child: Child,
    pub port: String,
}

impl Served {
    /// Serves one with these words of `sim` more; its second name is `port`.
    pub fn new(folder: &Path, words: &[&str]) -> Self {
        let all = [&["sim", "--serve", "pty", "--link", "port"], words].concat();
        let mut child = command(folder, &all).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut port = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut port).unwrap();
        Served { child, port: port.trim().to_owned() }
    }

    /// Sends it a signal.
    pub fn signal(&self, name: &str) {
        assert!(Command::new("kill").args(["-s", name, &self.child.id().to_string()]).status().unwrap().success());
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Says lines through a pipe.
pub fn said(folder: &Path, port: &str, lines: &str) -> Ran {
    let mut console = command(folder, &["console", "--port", port]);
    let mut child = console.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(lines.as_bytes()).unwrap();
    child.wait_with_output().unwrap().into()
}

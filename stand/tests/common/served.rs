//! A simulated stand behind a port, for the duration of a test.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use super::{RunOutput, command};

/// A simulated stand that is served until it is dropped.
pub struct Served {
    pub child: Child,
    pub port: String,
}

impl Served {
    /// Serves a stand with these further arguments of `sim`; its second name is `port`.
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

/// Sends lines through a pipe.
pub fn send_lines(folder: &Path, port: &str, lines: &str) -> RunOutput {
    let mut console = command(folder, &["console", "--port", port]);
    let mut child = console.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(lines.as_bytes()).unwrap();
    child.wait_with_output().unwrap().into()
}

//! A panel for the duration of a test, a client of its requests on raw sockets, and a page without a browser.
#![allow(dead_code, clippy::unwrap_used, reason = "each test binary uses its part")]

use std::cell::Cell;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::time::{Duration, Instant};

use serde_json::Value;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// Held by each panel; a panel whose stand turns in real time holds it alone, since other programs' work may keep its host silent for two
/// seconds.
static MACHINE: RwLock<()> = RwLock::new(());

thread_local! {
    /// This test's thread holds a share already: a second panel needs none, and would wait for ever behind a test that wants the whole.
    static HOLDS: Cell<bool> = const { Cell::new(false) };
}

/// What the first panel of a test holds of the machine.
pub enum Share {
    Part(RwLockReadGuard<'static, ()>),
    Whole(RwLockWriteGuard<'static, ()>),
}

/// The program `stand panel`, killed when it is dropped.
pub struct Panel {
    pub child: Child,
    pub port: u16,
    pub token: String,
    share: Option<Share>,
}

impl Panel {
    pub fn new(folder: &Path, words: &[&str]) -> Self {
        let first = !HOLDS.replace(true);
        Self::with(first.then(|| Share::Part(MACHINE.read().unwrap_or_else(PoisonError::into_inner))), folder, words)
    }

    /// A panel beside which no other panel of these tests runs.
    pub fn alone(folder: &Path, words: &[&str]) -> Self {
        HOLDS.set(true);
        Self::with(Some(Share::Whole(MACHINE.write().unwrap_or_else(PoisonError::into_inner))), folder, words)
    }

    fn with(share: Option<Share>, folder: &Path, words: &[&str]) -> Self {
        let mut child = super::command(folder, &[&["panel"], words].concat()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut address = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut address).unwrap();
        let (base, token) = address.trim().split_once("/#").unwrap_or_else(|| panic!("{address:?}"));
        Panel { child, port: base.rsplit_once(':').unwrap().1.parse().unwrap(), token: token.to_owned(), share }
    }

    pub fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    /// Sends bytes and returns the status of the response; 0: the connection was closed without one.
    pub fn raw(&self, bytes: &[u8]) -> u16 {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        let _ = stream.write_all(bytes);
        let mut head = [0; 12];
        if stream.read_exact(&mut head).is_err() {
            return 0;
        }
        std::str::from_utf8(&head[9..]).unwrap().parse().unwrap()
    }

    /// A request of the page: the status and the JSON of the answer.
    pub fn request(&self, method: &str, path: &str, body: &str) -> (u16, Value) {
        self.request_bytes(method, path, body.as_bytes())
    }

    /// The same with a body of bytes.
    pub fn request_bytes(&self, method: &str, path: &str, body: &[u8]) -> (u16, Value) {
        let (status, answer) = self.exchange(method, path, body);
        (status, serde_json::from_str(&answer).unwrap_or(Value::Null))
    }

    /// The answer to a request that is a text.
    pub fn text(&self, path: &str) -> String {
        let (status, answer) = self.exchange("GET", path, b"");
        assert_eq!(status, 200, "{path}: {answer}");
        answer
    }

    fn exchange(&self, method: &str, path: &str, body: &[u8]) -> (u16, String) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        let host = self.host();
        let head = format!(
            "{method} /api/{path} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nAuthorization: Bearer {}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
            self.token,
            body.len()
        );
        stream.write_all(head.as_bytes()).unwrap();
        // A body that is too large is refused before it has been sent.
        let _ = stream.write_all(body);
        let mut response = Vec::new();
        let _ = stream.read_to_end(&mut response);
        let response = String::from_utf8_lossy(&response).into_owned();
        let (head, body) = response.split_once("\r\n\r\n").unwrap_or((&response, ""));
        (head[9..12].parse().unwrap(), body.to_owned())
    }

    pub fn post(&self, path: &str, body: &Value) -> Value {
        let (status, answer) = self.request("POST", path, &body.to_string());
        assert_eq!(status, 200, "{path} {body}: {answer}");
        answer
    }

    pub fn page(&self) -> Page {
        Page::open(self)
    }
}

impl Drop for Panel {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if self.share.take().is_some() {
            HOLDS.set(false);
        }
    }
}

/// The WebSocket of a page.
pub struct Page {
    socket: WebSocket<TcpStream>,
    pub state: Value,
    /// Times of the rows, s.
    pub times: Vec<f64>,
    /// Number of columns of the last rows, without the time.
    pub columns: usize,
}

pub const BEAT: u8 = 1;
pub const TAKE: u8 = 2;
pub const LEAVE: u8 = 3;
pub const STOP: u8 = 0x18;

impl Page {
    fn open(panel: &Panel) -> Self {
        let host = panel.host();
        let mut request = format!("ws://{host}/socket").into_client_request().unwrap();
        request.headers_mut().insert("Origin", format!("http://{host}").parse().unwrap());
        let stream = TcpStream::connect(("127.0.0.1", panel.port)).unwrap();
        let (mut socket, _) = tungstenite::client(request, stream).unwrap();
        socket.get_ref().set_read_timeout(Some(Duration::from_millis(20))).unwrap();
        socket.send(Message::binary(panel.token.clone().into_bytes())).unwrap();
        let mut page = Page { socket, state: Value::Null, times: Vec::new(), columns: 0 };
        page.until(|page| page.state["client"].is_number(), false);
        page
    }

    pub fn client(&self) -> u64 {
        self.state["client"].as_u64().unwrap()
    }

    pub fn say(&mut self, word: u8) {
        self.say_bytes(&[word]);
    }

    pub fn say_bytes(&mut self, bytes: &[u8]) {
        self.socket.send(Message::binary(bytes.to_vec())).unwrap();
    }

    /// Takes the messages of at most 20 ms.
    pub fn read(&mut self) {
        let until = Instant::now() + Duration::from_millis(20);
        while Instant::now() < until {
            let Ok(message) = self.socket.read() else { return };
            let bytes = message.into_data();
            match bytes.first() {
                Some(1) => {
                    self.columns = usize::from(bytes[1]);
                    let width = (self.columns + 1) * 8;
                    self.times.extend(bytes[8..].chunks_exact(width).map(|row| f64::from_le_bytes(row[..8].try_into().unwrap())));
                }
                Some(3) => self.state = serde_json::from_slice(&bytes[1..]).unwrap(),
                _ => {}
            }
        }
    }

    /// Reads, with beats or without, until the condition holds; the time that it took.
    #[track_caller]
    pub fn until(&mut self, condition: impl Fn(&Page) -> bool, beats: bool) -> Duration {
        let begun = Instant::now();
        while !condition(self) {
            assert!(begun.elapsed() < Duration::from_secs(300), "{}", self.state);
            if beats {
                self.say(BEAT);
            }
            self.read();
        }
        begun.elapsed()
    }

    /// Waits with beats until the job that an answer has started is over; its state.
    pub fn finish(&mut self, started: &Value) -> Value {
        self.until(|page| page.state["job"]["number"] == started["job"] && page.state["job"]["is_running"] == false, true);
        self.state["job"].clone()
    }

    /// The same; the name of what the job made, which must have succeeded.
    #[track_caller]
    pub fn answer_of(&mut self, started: &Value) -> String {
        let job = self.finish(started);
        assert_eq!(job["error"], "", "{job}");
        job["answer"].as_str().unwrap().to_owned()
    }

    /// Takes the control and starts the drive at 5 rad/s.
    pub fn drive(&mut self, panel: &Panel) {
        self.say(TAKE);
        self.until(|page| page.state["driver"] == page.state["client"], true);
        for line in ["SOURce:RATE 5", "SOURce:MODE RATE", "OUTPut ON"] {
            self.say(BEAT);
            let answer = self.command(panel, line);
            assert_eq!(answer["errors"], serde_json::json!([]), "{line}");
        }
        self.until(|page| page.state["drive"]["is_on"] == true, true);
    }

    pub fn command(&self, panel: &Panel, line: &str) -> Value {
        panel.post("command", &serde_json::json!({"client": self.client(), "line": line}))
    }

    pub fn is_off_with_fault(&self) -> bool {
        self.state["drive"]["is_on"] == false && self.state["drive"]["fault"] != ""
    }
}

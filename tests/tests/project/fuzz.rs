//! Mutated inputs of every format: no panic, no answer without end.
//!
//! `STAND_FUZZ` is the number of inputs of each format (10 000 in the tests, a million in `scripts/full-benches.sh`), `STAND_FUZZ_SEED` the
//! first seed. An input is determined by its seed and the files of `corpus/`; one that fails is printed with its seed and written below
//! `target/`.
#![allow(clippy::unwrap_used)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use hal_sim::plant::Stand;
use identification::log::{Column, Log};
use identification::model::Model;
use identification::model::expression::{Expression, Variables};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stand_acquire::calibration_session::Session;
use stand_acquire::link::Receiver;
use stand_acquire::settings::file as settings_file;
use stand_firmware::telemetry::frame::MAX_FRAME;
use stand_firmware::telemetry::{Beat, Body, encode};
use stand_records::stored_record::StoredRecord;
use stand_tests::bench::with_stand;

/// Inputs of each format without `STAND_FUZZ`.
const INPUTS: u64 = 10_000;
/// Longest time for one input.
const TIMEOUT: Duration = Duration::from_secs(10);
/// Pieces that are put into inputs: limits of numbers, separators, signs of other formats.
const PIECES: [&str; 40] = [
    "0",
    "-0",
    "1e308",
    "-1e-320",
    "1e999",
    "NaN",
    "inf",
    "9223372036854775808",
    "0x1F",
    "1_000",
    ".",
    ",",
    ";",
    ":",
    "\n",
    "\r\n",
    "\t",
    "\0",
    "\"",
    "'",
    "#",
    "[",
    "]",
    "[[",
    "{",
    "}",
    "(",
    ")",
    "((((((((",
    "=",
    "?",
    "*",
    "^",
    "~",
    " ",
    "\u{feff}",
    "µ",
    "\u{2028}",
    "t_s",
    "#2",
];

/// A number from a variable of the environment.
fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name}={text}: not a number")))
}

/// The files of a format, or each line of a file as an example of its own.
fn corpus(format: &str, by_line: bool) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus").join(format);
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let texts = paths.iter().map(|path| std::fs::read(path).unwrap());
    if by_line {
        texts.flat_map(|text| text.split(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect::<Vec<_>>()).collect()
    } else {
        texts.collect()
    }
}

/// An input: one to eight changes of an example, or bytes of no format.
fn input(examples: &[Vec<u8>], seed: u64) -> Vec<u8> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut below = |n: usize| (random.next_u64() % n.max(1) as u64) as usize;
    if below(20) == 0 {
        return (0..below(300)).map(|_| below(256) as u8).collect();
    }
    let mut bytes = examples[below(examples.len())].clone();
    for _ in 0..=below(8) {
        let at = below(bytes.len() + 1);
        let end = (at + below(30)).min(bytes.len());
        match below(6) {
            0 if at < bytes.len() => bytes[at] ^= 1 << below(8),
            1 => drop(bytes.drain(at..end)),
            2 => {
                let piece = bytes[at..end].to_vec();
                let to = below(bytes.len() + 1);
                drop(bytes.splice(to..to, piece));
            }
            3 => {
                let other = &examples[below(examples.len())];
                let from = below(other.len() + 1);
                bytes.truncate(at);
                bytes.extend_from_slice(&other[from..]);
            }
            4 => bytes.truncate(at),
            _ => drop(bytes.splice(at..end, PIECES[below(PIECES.len())].bytes())),
        }
    }
    bytes
}

/// Gives `take` the inputs of a format. `share`: part of the number of inputs, for a format whose inputs are slow.
fn fuzz(format: &str, examples: &[Vec<u8>], share: f64, take: impl Fn(&[u8]) + Sync) {
    let count = (number("STAND_FUZZ", INPUTS) as f64 * share) as u64;
    let first = number("STAND_FUZZ_SEED", 1);
    let current = Mutex::new((first, Instant::now()));
    let failed = |seed: u64, what: &str| {
        let bytes = input(examples, seed);
        let path = std::env::temp_dir().join(format!("stand-fuzz-{format}-{seed}"));
        std::fs::write(&path, &bytes).unwrap();
        format!("{format}, seed {seed}: {what}; the input is in {}: {}", path.display(), String::from_utf8_lossy(&bytes))
    };
    let (done, ended) = channel();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for seed in first..first + count {
                *current.lock().unwrap() = (seed, Instant::now());
                let bytes = input(examples, seed);
                if catch_unwind(AssertUnwindSafe(|| take(&bytes))).is_err() {
                    done.send(Some(failed(seed, "panic"))).unwrap();
                    return;
                }
            }
            done.send(None).unwrap();
        });
        loop {
            match ended.recv_timeout(Duration::from_millis(200)) {
                Ok(None) => break,
                Ok(Some(message)) => panic!("{message}"),
                Err(RecvTimeoutError::Disconnected) => panic!("{format}: the thread of the inputs ended"),
                Err(RecvTimeoutError::Timeout) => {
                    let (seed, begun) = *current.lock().unwrap();
                    if begun.elapsed() > TIMEOUT {
                        // The thread cannot be stopped; the process ends.
                        eprintln!("{}", failed(seed, "no answer within 10 s"));
                        std::process::exit(101);
                    }
                }
            }
        }
    });
}

/// Reads an input from a file; an error is one line that names the file.
fn read_file(folder: &Path, name: &str, bytes: &[u8]) {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    if let Err(error) = Log::read(&path) {
        let text = error.to_string();
        assert!(text.contains(name) && !text.contains('\n'), "{text:?}");
    }
}

/// Asserts that an error is one line.
fn one_line<T>(result: Result<T, impl std::fmt::Display>) {
    if let Err(error) = result {
        let text = error.to_string();
        assert!(!text.is_empty() && !text.trim_end().contains('\n'), "{text:?}");
    }
}

#[test]
fn csv_logs() {
    let folder = tempfile::tempdir().unwrap();
    fuzz("csv", &corpus("csv", false), 1.0, |bytes| read_file(folder.path(), "a.csv", bytes));
}

#[test]
fn parquet_logs() {
    let folder = tempfile::tempdir().unwrap();
    let column = |name: &str, scale: f64| Column { name: name.to_owned(), values: (0..50).map(|k| scale * f64::from(k)).collect() };
    let log = Log::new("a", vec![column("t_s", 1e-3), column("u_V", 0.1)], vec![("stand".to_owned(), "x".to_owned())]).unwrap();
    let path = folder.path().join("valid.parquet");
    log.write(&path).unwrap();
    fuzz("parquet", &[std::fs::read(path).unwrap()], 1.0, |bytes| read_file(folder.path(), "a.parquet", bytes));
}

#[test]
fn models_stands_sessions_and_settings() {
    fuzz("toml", &corpus("toml", false), 1.0, |bytes| {
        let text = String::from_utf8_lossy(bytes);
        one_line(Model::parse(&text, "m.toml"));
        let _ = Stand::parse(&text);
        let _ = Session::parse(&text);
        let _ = settings_file::parse(&text);
    });
}

#[test]
fn records() {
    fuzz("json", &corpus("json", false), 1.0, |bytes| {
        if let Ok(value) = serde_json::from_slice::<serde_json::Value>(bytes) {
            let _ = StoredRecord::from_json(&value);
        }
    });
}

#[test]
fn expressions() {
    let names = ["a", "m", "w0"].map(str::to_owned);
    fuzz("expression", &corpus("expression", true), 1.0, |bytes| {
        let text = String::from_utf8_lossy(bytes);
        let parsed = Expression::parse(&text, &names);
        if let Ok(expression) = &parsed {
            let variables = Variables { t: 1.0, theta: 2.0, omega: -3.0, i: 0.1, u: 5.0, temp_C: 25.0 };
            let _: f64 = expression.eval(&variables, &[1.0, 0.5, 2.0]);
            assert_eq!(Expression::parse(&expression.to_string(), &names).as_ref().ok(), Some(expression), "printed and parsed again");
        }
        one_line(parsed);
    });
}

#[test]
fn frames() {
    let frame = |body: &Body<'_>, seq| encode(body, seq, &mut [0; MAX_FRAME]).unwrap().to_vec();
    let stream =
        [frame(&Body::Text("1"), 1), frame(&Body::Beat(Beat::default()), 2), frame(&Body::Text("0,\"No error\""), 3), b"text\r\n".to_vec()];
    let examples = [stream.concat(), stream[0].clone(), stream[1].clone()];
    fuzz("frames", &examples, 1.0, |bytes| {
        let mut received = std::collections::VecDeque::new();
        let _ = Receiver::default().take(bytes, &mut received); // another version is no crash
        assert!(received.len() <= bytes.len());
    });
}

#[test]
fn lines_of_the_console() {
    let examples = corpus("scpi", true);
    let lines = Mutex::new(Vec::new());
    // The lines of a batch go to one stand, which must still answer at its end; a failure names the last seed of its 500.
    fuzz("scpi", &examples, 1.0, |bytes| {
        let mut batch = lines.lock().unwrap();
        batch.push(bytes.to_vec());
        if batch.len() < 500 {
            return;
        }
        let batch = std::mem::take(&mut *batch);
        with_stand(&Stand::default(), async |host| {
            for line in &batch {
                host.send(line);
                host.send(b"\n");
                host.wait_s(2e-3).await;
                drop(host.received());
            }
            // A stop character ends what a line has begun.
            host.send(b"\x18\n");
            host.wait_s(0.5).await;
            host.send(b"STReam OFF\n");
            host.wait_s(1.0).await;
            drop(host.received());
            assert!(host.query("*IDN?").await.contains("tand"));
        });
    });
}

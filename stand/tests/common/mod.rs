//! The command `stand`: arguments in, streams and exit status out.
#![allow(dead_code, clippy::unwrap_used, reason = "each test binary uses its part")]

pub mod calibration;
pub mod gyro_noise;
pub mod panel;
pub mod served;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// Result of a run.
#[derive(Debug)]
pub struct RunOutput {
    pub status: Option<i32>,
    pub out: String,
    pub err: String,
}

impl RunOutput {
    /// Asserts success and an empty standard error.
    #[track_caller]
    pub fn succeeded(self) -> Self {
        assert_eq!((self.status, self.err.as_str()), (Some(0), ""), "{self:?}");
        self
    }

    /// Asserts exit status 2 and one line on standard error, which calls the log implausible.
    #[track_caller]
    pub fn refused_the_log(self) -> Self {
        let says = self.err.contains("the log is not a plausible record of a drive");
        assert!(self.status == Some(2) && self.err.lines().count() == 1 && says, "{self:?}");
        self
    }

    /// Standard output, which must be JSON only.
    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("{e}: {}", self.out))
    }
}

impl From<Output> for RunOutput {
    fn from(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        RunOutput { status: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
    }
}

/// Runs a command that writes `page.html` and its plots, which are files in both formats; its standard output. On a computer without a font
/// the plots are missing, and the command says so.
#[track_caller]
pub fn with_plots(folder: &Path, words: &[&str]) -> String {
    let ran = stand(folder, &[words, &["--html", "page.html", "--plots", "new/plots"]].concat());
    if ran.status == Some(1) && ran.err.contains("needs a font") {
        return ran.out;
    }
    let ran = ran.succeeded();
    let page = std::fs::read_to_string(folder.join("page.html")).unwrap();
    let files = |ending: &str| {
        let names = std::fs::read_dir(folder.join("new/plots")).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name.ends_with(ending)).count()
    };
    let drawings = page.matches("<svg").count();
    assert!(files(".svg") >= drawings && files(".svg") == files(".png"), "{words:?}: {drawings} drawings, {} files", files(".svg"));
    ran.out
}

/// The command with these arguments, in a folder.
pub fn command(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stand"));
    command.args(words).current_dir(folder).stdin(Stdio::null());
    command
}

/// Runs it.
pub fn stand(folder: &Path, words: &[&str]) -> RunOutput {
    command(folder, words).output().unwrap().into()
}

/// The model of the default stand by its data sheet.
pub const MODEL: &str = "[drive]\ninput = \"u_V\"\neffects = [\"viscous\", \"coulomb\", \"inductance\"]\n\n[parameters]\n\
    inertia_kg_m2 = 2.2e-4\nmotor_constant_N_m_A = 0.0234\nresistance_ohm = 2.32\nviscous_N_m_s = 1e-5\ncoulomb_N_m = 8.6e-4\n\
    inductance_H = 2.38e-4\n";

/// A folder with a short log in both formats, with equal numbers, and a model.
pub fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    stand(path, &["sim", "--out", "log.csv", "--seconds", "3"]).succeeded();
    identification::log::Log::read(path.join("log.csv")).unwrap().write(path.join("log.parquet")).unwrap();
    std::fs::write(path.join("model.toml"), MODEL).unwrap();
    folder
}

/// Every file below a folder with its bytes.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.insert(format!("{}/", path.display()), Vec::new());
            found.extend(files(&path));
        } else {
            found.insert(path.display().to_string(), std::fs::read(&path).unwrap());
        }
    }
    found
}

/// Copies what a folder contains into another, which exists.
pub fn copy_folder(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            std::fs::create_dir(&target).unwrap();
            copy_folder(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), &target).unwrap();
        }
    }
}

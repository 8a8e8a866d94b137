//! docs/session.md shows what the command prints: its commands are run one after the other in an empty folder.
//!
//! With `STAND_DOCS=write` the test writes the page instead of comparing it.
#![cfg(unix)]

use std::path::Path;
use std::process::Command;

use tempfile::tempdir;

/// Stands for lines that the page leaves out.
const LEFT_OUT: &str = "…";
/// What differs from run to run, up to the end of its line.
const COMPUTING_TIME: &str = "computed in ";

/// The output of a command line in `folder`, without trailing blanks.
fn output(folder: &Path, line: &str) -> String {
    let stand = Path::new(env!("CARGO_BIN_EXE_stand"));
    let path = format!("{}:{}", stand.parent().unwrap().display(), std::env::var("PATH").unwrap());
    let ran = Command::new("sh").args(["-c", line]).current_dir(folder).env("PATH", path).output().unwrap();
    assert!(ran.status.success(), "{line}: {}", String::from_utf8_lossy(&ran.stderr));
    String::from_utf8(ran.stdout).unwrap().trim_end().to_owned()
}

/// A block of the page with the commands run again. Of an output that the page shortens, the lines after the mark are kept.
fn typed_again(folder: &Path, block: &str) -> String {
    let mut text = String::new();
    for part in block.split("$ ").skip(1) {
        let (line, shown) = part.split_once('\n').unwrap_or((part, ""));
        let mut now = output(folder, line);
        if let Some(kept) = shown.strip_prefix(LEFT_OUT) {
            let lines = kept.trim().lines().count();
            let all: Vec<&str> = now.lines().collect();
            now = format!("{LEFT_OUT}\n{}", all[all.len() - lines..].join("\n"));
        }
        text += &format!("$ {line}\n");
        text += &if now.is_empty() { String::new() } else { format!("{now}\n") };
    }
    text
}

/// Without the times that the computer needs.
fn comparable(text: &str) -> String {
    text.lines().map(|line| line.split(COMPUTING_TIME).next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

#[test]
fn page_of_a_session_is_what_the_command_prints() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/session.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let folder = tempdir().unwrap();
    let parts: Vec<String> = page
        .split("```")
        .map(|part| match part.strip_prefix('\n').filter(|block| block.starts_with("$ ")) {
            Some(block) => format!("\n{}", typed_again(folder.path(), block)),
            None => part.to_owned(),
        })
        .collect();
    let now = parts.join("```");
    if std::env::var("STAND_DOCS").is_ok_and(|v| v == "write") {
        std::fs::write(&path, now).unwrap();
    } else if let Some((k, (now, page))) = comparable(&now).lines().zip(comparable(&page).lines()).enumerate().find(|(_, (a, b))| a != b) {
        panic!("docs/session.md differs in line {}: “{page}” is “{now}” now; STAND_DOCS=write writes the page", k + 1);
    } else {
        assert_eq!(now.lines().count(), page.lines().count());
    }
}

//! Generated parts of docs/ agree with the program: the console transcripts of docs/the-stand-controller.md and the page docs/effects.md.
//!
//! With `STAND_DOCS=write` the tests write the pages instead of comparing them.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::Stand;
use stand_firmware::status::Fault;
use stand_tests::bench::with_stand;

/// Idle time that ends a reply, s.
const QUIET_S: f64 = 0.05;
/// Longest wait for the reply to a command with `*OPC?`, s.
const MAX_WAIT_S: f64 = 20.0;

/// Version and commit in the transcripts.
const DOCUMENTED_VERSION: &str = "0.1.0+1234abc";

/// Path and text of the page on disk.
fn page() -> (std::path::PathBuf, String) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/the-stand-controller.md");
    let text = std::fs::read_to_string(&path).unwrap();
    (path, text)
}

/// Types the commands of one block on a stand after power-on; returns the block with the replies.
fn typed(block: &[&str]) -> Vec<String> {
    with_stand(&Stand::default(), async |host| {
        host.wait_s(0.1).await;
        let mut page = Vec::new();
        for line in block {
            if let Some(command) = line.strip_prefix("> ") {
                page.push((*line).to_owned());
                host.send(format!("{command}\n").as_bytes());
                let waits = command.contains("*OPC?");
                let mut timeout_s = if waits { MAX_WAIT_S } else { QUIET_S };
                while let Some(answer) = host.line(timeout_s).await {
                    timeout_s = QUIET_S;
                    // A list ends with an empty line.
                    if answer.is_empty() {
                        break;
                    }
                    // The page has an example of a commit.
                    page.push(answer.replace(stand_firmware::VERSION, DOCUMENTED_VERSION));
                }
            } else if let Some(time) = line.strip_prefix('(').and_then(|time| time.strip_suffix(')')) {
                page.push((*line).to_owned());
                let (number, unit) = time.split_once(' ').unwrap();
                let number: f64 = number.parse().unwrap();
                host.wait_s(if unit == "ms" { 1e-3 * number } else { number }).await;
            }
        }
        page
    })
}

fn faults() -> Vec<String> {
    let mut table = vec!["| | fault | what to do |".to_owned(), "|---:|---|---|".to_owned()];
    table.extend(Fault::ALL.iter().map(|fault| format!("| {} | {} | {} |", fault.code(), fault.name(), fault.advice())));
    table
}

#[test]
fn controller_page_equals_the_stands_replies() {
    let (path, text) = page();
    let mut generated = Vec::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if line == "```console" {
            generated.push(line.to_owned());
            let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
            generated.extend(typed(&block));
            generated.push("```".to_owned());
        } else if line == "FAULTS" || line.starts_with("| | fault |") {
            while lines.next_if(|line| line.starts_with('|')).is_some() {}
            generated.extend(faults());
        } else {
            generated.push(line.to_owned());
        }
    }
    let generated = generated.join("\n") + "\n";
    if std::env::var("STAND_DOCS").is_ok_and(|word| word == "write") {
        std::fs::write(path, generated).unwrap();
        return;
    }
    for (n, (documented, generated)) in text.lines().zip(generated.lines()).enumerate() {
        assert_eq!(documented, generated, "line {}: write the page anew with STAND_DOCS=write", n + 1);
    }
    assert_eq!(text.len(), generated.len(), "write the page anew with STAND_DOCS=write");
}

#[test]
fn effects_page_equals_the_catalogue() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/effects.md");
    let expected = stand_report::effects::catalogue_markdown();
    if std::env::var("STAND_DOCS").is_ok_and(|word| word == "write") {
        std::fs::write(path, expected).unwrap();
        return;
    }
    assert_eq!(std::fs::read_to_string(path).unwrap(), expected, "write the page with STAND_DOCS=write");
}

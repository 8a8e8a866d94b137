//! `stand console`: a line to the stand for a person, or for a script through a pipe.
//!
//! On a terminal: editing, history, completion from the stand's own `HELP?`. Through a pipe: each line is said in turn, replies go to standard output,
//! refusals to standard error; whatever was refused, the rest is said too, and the exit status tells.

use std::io::{BufRead, IsTerminal};
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use rustyline::completion::Completer;
use rustyline::error::ReadlineError;
use rustyline::history::FileHistory;
use rustyline::{Context, Editor, Helper, Highlighter, Hinter, Validator};

use super::error::CliError;
use super::output::print;
use super::record::missing_port;
use crate::acquire::link::{REPLY_TIMEOUT, Received, SerialLink};

/// What waits for the end of something may take an hour.
const END: Duration = Duration::from_secs(3600);

/// Talk to a stand.
#[derive(Debug, Args)]
pub(super) struct Console {
    /// The serial port of the stand
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
}

impl Console {
    pub(super) fn run(self) -> Result<(), CliError> {
        let port = self.port.ok_or_else(missing_port)?;
        let mut link = SerialLink::open(&port)?;
        if std::io::stdin().is_terminal() { typed(&mut link) } else { piped(&mut link) }
    }
}

/// Says one line; what was refused.
fn say(link: &mut SerialLink, line: &str) -> Result<Vec<String>, CliError> {
    let waits = ["*opc?", "*wai"].iter().any(|word| line.to_ascii_lowercase().contains(word));
    let said = link.converse(line, if waits { END } else { REPLY_TIMEOUT })?;
    let mut text = String::new();
    for line in said.lines.iter().filter(|line| !line.is_empty()) {
        text += line;
        text.push('\n');
    }
    print(&text)?;
    Ok(said.refused)
}

fn piped(link: &mut SerialLink) -> Result<(), CliError> {
    let mut refused = 0;
    for (n, line) in std::io::stdin().lock().lines().enumerate() {
        let line = line.map_err(|e| CliError::Input(format!("standard input, line {}: {e}", n + 1)))?;
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        for says in say(link, line)? {
            eprintln!("stand: line {}: `{line}`: {says}", n + 1);
            refused += 1;
        }
    }
    match refused {
        0 => Ok(()),
        1 => Err(CliError::Input("the stand refused one command".to_owned())),
        many => Err(CliError::Input(format!("the stand refused {many} commands"))),
    }
}

fn typed(link: &mut SerialLink) -> Result<(), CliError> {
    let headers = headers(&link.query_lines("HELP?")?);
    let broken = |e: ReadlineError| CliError::Other(format!("the terminal: {e}"));
    let config = rustyline::Config::builder().completion_type(rustyline::CompletionType::List).auto_add_history(true).build();
    let mut editor = Editor::<Headers, FileHistory>::with_config(config).map_err(broken)?;
    editor.set_helper(Some(Headers(headers)));
    let history = history();
    if let Some(history) = &history {
        // There is none the first time.
        let _ = editor.load_history(history);
    }
    println!("{}: {}", link.name(), link.identity());
    println!("HELP? lists what it understands, Tab completes, Ctrl-C stops the drive, Ctrl-D leaves.");
    let done = loop {
        match editor.readline("> ") {
            Ok(line) if line.trim().is_empty() => unasked(link)?,
            Ok(line) => {
                for says in say(link, line.trim())? {
                    println!("refused: {says}");
                }
            }
            Err(ReadlineError::Interrupted) => {
                link.cancel()?;
                println!("stopped (0x18); FAULt:CLEar lets the drive be switched on again");
            }
            Err(ReadlineError::Eof) => break Ok(()),
            Err(other) => break Err(broken(other)),
        }
    };
    if let Some(history) = &history {
        // A history that cannot be kept is no reason to fail.
        let _ = editor.save_history(history);
    }
    done
}

/// What the stand has said since the last line: a fault, the rows of a stream.
fn unasked(link: &mut SerialLink) -> Result<(), CliError> {
    let mut rows = 0;
    while let Some(heard) = link.next(Duration::from_millis(20))? {
        match heard {
            Received::Line(line) if !line.is_empty() => println!("{line}"),
            Received::Row(row) => {
                rows += 1;
                if rows == 1 {
                    println!("{}", row.named().map(|(name, value)| format!("{name} {value:.6}")).collect::<Vec<_>>().join(", "));
                }
                if rows > 1000 {
                    break;
                }
            }
            _ => {}
        }
    }
    if rows > 1 {
        println!("… and {} rows more", rows - 1);
    }
    Ok(())
}

/// Where the lines of former days are, as other programs keep theirs.
fn history() -> Option<PathBuf> {
    let home = std::env::var_os("HOME").map(PathBuf::from);
    let state = std::env::var_os("XDG_STATE_HOME").map(PathBuf::from).or(home.map(|home| home.join(".local/state")))?;
    let folder = state.join("stand");
    std::fs::create_dir_all(&folder).ok()?;
    Some(folder.join("history"))
}

/// What can be typed: the first word of each line of `HELP?`.
fn headers(help: &[String]) -> Vec<String> {
    let mut headers: Vec<String> = help.iter().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect();
    headers.sort();
    headers.dedup();
    headers
}

/// Completes headers, in their long form, whatever the case.
#[derive(Helper, Highlighter, Hinter, Validator)]
struct Headers(Vec<String>);

impl Completer for Headers {
    type Candidate = String;

    fn complete(&self, line: &str, at: usize, _: &Context<'_>) -> rustyline::Result<(usize, Vec<String>)> {
        let before = &line[..at];
        let begin = before.rfind([';', ' ']).map_or(0, |at| at + 1);
        Ok((begin, candidates(&self.0, &before[begin..])))
    }
}

/// The headers that begin with what is typed, in any case; those of a deeper level only where nothing else is left.
fn candidates(headers: &[String], typed: &str) -> Vec<String> {
    let typed = typed.trim_start_matches(':').to_ascii_lowercase();
    headers.iter().filter(|header| header.to_ascii_lowercase().starts_with(&typed)).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_come_from_the_help_and_complete_in_any_case() {
        let help = ["*IDN? -> maker  who it is", "SOURce:RATE <RAD/S>  rate", "SOURce:RATE? -> RAD/S  rate", "STOP  stop"];
        let headers = headers(&help.map(str::to_owned));
        assert_eq!(headers, ["*IDN?", "SOURce:RATE", "SOURce:RATE?", "STOP"]);
        assert_eq!(candidates(&headers, "sour"), ["SOURce:RATE", "SOURce:RATE?"]);
        assert_eq!(candidates(&headers, "*"), ["*IDN?"]);
        assert!(candidates(&headers, "x").is_empty());
    }
}

//! `stand console`: commands to a stand, typed on a terminal or piped from a script.
//!
//! On a terminal: line editing, history, completion from the stand's `HELP?`. From a pipe: each line is sent in turn; replies go to
//! standard output, rejected commands to standard error. All lines are sent; the exit status is 2 if the stand rejected any.

use std::io::{BufRead, IsTerminal};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use clap::Args;
use rustyline::completion::Completer;
use rustyline::error::ReadlineError;
use rustyline::history::FileHistory;
use rustyline::{Context, Editor, Helper, Highlighter, Hinter, Validator};
use schemars::JsonSchema;
use serde::Serialize;

use super::error::CliError;
use super::output::{JsonOutput, print};
use super::signals::Interrupts;
use super::stand_file::required_port;
use stand_acquire::link::{REPLY_TIMEOUT, Received, Reply, SerialLink};
use stand_report::json::value;

/// Time that a command which waits for completion may take.
const COMPLETION_TIMEOUT: Duration = Duration::from_secs(3600);

/// Open a command console to a stand over its serial port.
#[derive(Debug, Args)]
pub(super) struct Console {
    /// Serial port of the stand
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOutput,
}

/// A line of a script, its reply, and the errors of the stand.
#[derive(Serialize, JsonSchema)]
pub(super) struct Exchange {
    line: String,
    replies: Vec<String>,
    errors: Vec<String>,
}

impl Console {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        let port = required_port(self.port)?;
        if self.json.json.is_some() && std::io::stdin().is_terminal() {
            return Err(CliError::Input("--json: the commands must come from a pipe or a file".to_owned()));
        }
        let mut link = SerialLink::open(&port)?;
        if std::io::stdin().is_terminal() {
            interactive(&mut link)
        } else {
            Interrupts::install()?;
            link.set_interrupt(Interrupts::any_so_far);
            from_pipe(&mut link, &self.json)
        }
    }
}

/// Sends one line; the reply without empty lines.
fn send_line(link: &mut SerialLink, line: &str) -> Result<Reply, CliError> {
    let waits = ["*opc?", "*wai"].iter().any(|word| line.to_ascii_lowercase().contains(word));
    let mut reply = link.exchange(line, if waits { COMPLETION_TIMEOUT } else { REPLY_TIMEOUT })?;
    reply.lines.retain(|line| !line.is_empty());
    Ok(reply)
}

/// Lines of a reply, each with its end.
fn text(lines: &[String]) -> String {
    lines.iter().flat_map(|line| [line, "\n"]).collect()
}

/// The next of the `lines`; `None` at their end.
fn next<T>(link: &mut SerialLink, lines: &Receiver<T>) -> Result<Option<T>, CliError> {
    loop {
        match lines.recv_timeout(Duration::from_millis(50)) {
            Ok(line) => return Ok(Some(line)),
            Err(RecvTimeoutError::Disconnected) => return Ok(None),
            Err(RecvTimeoutError::Timeout) if Interrupts::any_so_far() => {
                return Err(CliError::Other("interrupted by a signal".to_owned()));
            }
            Err(RecvTimeoutError::Timeout) => link.keep_alive()?,
        }
    }
}

fn from_pipe(link: &mut SerialLink, json: &JsonOutput) -> Result<(), CliError> {
    let mut rejected = 0;
    let mut exchanges = Vec::new();
    // A thread of its own reads, so that the link gives signs of life and a signal ends the command while a script pauses.
    let (sender, lines) = channel();
    std::thread::spawn(move || std::io::stdin().lock().lines().try_for_each(|line| sender.send(line)));
    for n in 0.. {
        let Some(line) = next(link, &lines)? else { break };
        let line = line.map_err(|e| CliError::Input(format!("standard input, line {}: {e}", n + 1)))?;
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        let reply = send_line(link, line)?;
        json.text(&text(&reply.lines))?;
        for error in &reply.errors {
            eprintln!("stand: line {}: `{line}`: {error}", n + 1);
            rejected += 1;
        }
        if json.json.is_some() {
            exchanges.push(Exchange { line: line.to_owned(), replies: reply.lines, errors: reply.errors });
        }
    }
    json.json(|| value(&exchanges))?;
    match rejected {
        0 => Ok(()),
        1 => Err(CliError::Input("the stand rejected one command; see standard error".to_owned())),
        many => Err(CliError::Input(format!("the stand rejected {many} commands; see standard error"))),
    }
}

fn interactive(link: &mut SerialLink) -> Result<(), CliError> {
    let headers = headers(&link.query_lines("HELP?")?);
    // People want units; the end of the link switches them off again.
    link.command("FORMat:UNITs ON")?;
    let broken = |e: ReadlineError| CliError::Other(format!("cannot read from the terminal: {e}"));
    let config = rustyline::Config::builder().completion_type(rustyline::CompletionType::List).auto_add_history(true).build();
    let mut editor = Editor::<Headers, FileHistory>::with_config(config).map_err(broken)?;
    editor.set_helper(Some(Headers(headers)));
    let history = history();
    if let Some(history) = &history {
        // The file does not exist at the first start.
        let _ = editor.load_history(history);
    }
    println!("{}: {}", link.name(), link.identity());
    println!("HELP? lists the commands, Tab completes, Ctrl-C stops the drive, Ctrl-D quits and switches the drive off.");
    // The terminal has a thread of its own, so that the link gives signs of life while somebody types or reads.
    let (ask, asked) = channel();
    let (answer, answers) = channel();
    let terminal = std::thread::spawn(move || {
        while asked.recv().is_ok() {
            if answer.send(editor.readline("> ")).is_err() {
                break;
            }
        }
        if let Some(history) = &history {
            // Failure to save the history is not an error of the command.
            let _ = editor.save_history(history);
        }
    });
    let done = loop {
        if ask.send(()).is_err() {
            break Ok(());
        }
        let line = next(link, &answers)?.unwrap_or(Err(ReadlineError::Eof));
        match line {
            Ok(line) if line.trim().is_empty() => print_unsolicited(link)?,
            Ok(line) => {
                let reply = send_line(link, line.trim())?;
                print(&text(&reply.lines))?;
                for error in reply.errors {
                    println!("rejected: {error}");
                }
            }
            Err(ReadlineError::Interrupted) => {
                link.stop()?;
                println!("Drive stopped (0x18). FAULt:CLEar enables it again.");
            }
            Err(ReadlineError::Eof) => break Ok(()),
            Err(other) => break Err(broken(other)),
        }
    };
    drop(ask);
    // A panic there has been reported; nothing is left to do.
    let _ = terminal.join();
    done
}

/// Prints what the stand has sent unsolicited since the last line: faults, rows of a stream.
fn print_unsolicited(link: &mut SerialLink) -> Result<(), CliError> {
    let mut rows = 0;
    while let Some(heard) = link.receive(Duration::from_millis(20))? {
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
        println!("… and {} more rows", rows - 1);
    }
    Ok(())
}

/// File of the command history, by the XDG convention.
fn history() -> Option<PathBuf> {
    let home = std::env::var_os("HOME").map(PathBuf::from);
    let state = std::env::var_os("XDG_STATE_HOME").map(PathBuf::from).or(home.map(|home| home.join(".local/state")))?;
    let folder = state.join("stand");
    std::fs::create_dir_all(&folder).ok()?;
    Some(folder.join("history"))
}

/// Command headers: the first word of each line of `HELP?`.
fn headers(help: &[String]) -> Vec<String> {
    let mut headers: Vec<String> = help.iter().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect();
    headers.sort();
    headers.dedup();
    headers
}

/// Completes command headers in their long form, in any case.
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

/// Headers that begin with `typed`, in any case.
fn candidates(headers: &[String], typed: &str) -> Vec<String> {
    let typed = typed.trim_start_matches(':').to_ascii_lowercase();
    headers.iter().filter(|header| header.to_ascii_lowercase().starts_with(&typed)).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_of_the_help_complete_in_any_case() {
        let help = ["*IDN? -> maker  who it is", "SOURce:RATE <RAD/S>  rate", "SOURce:RATE? -> RAD/S  rate", "STOP  stop"];
        let headers = headers(&help.map(str::to_owned));
        assert_eq!(headers, ["*IDN?", "SOURce:RATE", "SOURce:RATE?", "STOP"]);
        assert_eq!(candidates(&headers, "sour"), ["SOURce:RATE", "SOURce:RATE?"]);
        assert_eq!(candidates(&headers, "*"), ["*IDN?"]);
        assert!(candidates(&headers, "x").is_empty());
    }
}

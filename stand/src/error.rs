//! Errors of the command line: one line of text each, and the exit status.

use std::path::Path;
use std::process::ExitCode;

use stand_acquire::connection::ConnectionError;

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub(super) enum CliError {
    /// The arguments or the input are wrong: exit status 2.
    #[error("{0}")]
    Input(String),
    /// Standard output was closed by its reader: exit status 0.
    #[error("standard output was closed")]
    ClosedPipe,
    /// Any other failure: exit status 1.
    #[error("{0}")]
    Other(String),
}

/// Conversions of library errors that are errors of the input.
macro_rules! input_errors {
    ($($error:ty),* $(,)?) => {$(
        impl From<$error> for CliError {
            fn from(error: $error) -> Self {
                CliError::Input(error.to_string())
            }
        }
    )*};
}
input_errors!(
    identification::identify::fit::prepare::PrepareError,
    identification::identify::fit::FitError,
    stand_analysis::observer::ObserverError,
    hal_sim::plant::StandError,
);

impl From<identification::log::LogError> for CliError {
    fn from(error: identification::log::LogError) -> Self {
        match &*error.kind {
            identification::log::LogErrorKind::Write(cause) => CliError::file(&error.path, "write", cause),
            kind if kind.may_be_of_another_program() => {
                CliError::Input(format!("{error}; stand log inspect {} shows how a file of another program is read", error.path.display()))
            }
            _ => CliError::Input(error.to_string()),
        }
    }
}

impl From<identification::model::ModelError> for CliError {
    fn from(error: identification::model::ModelError) -> Self {
        match &*error.kind {
            identification::model::ModelErrorKind::Write(cause) => CliError::file(Path::new(&error.file), "write", cause),
            _ => CliError::Input(error.to_string()),
        }
    }
}

impl From<stand_acquire::link::LinkError> for CliError {
    fn from(error: stand_acquire::link::LinkError) -> Self {
        if error.is_input_error() { CliError::Input(error.to_string()) } else { CliError::Other(error.to_string()) }
    }
}

impl From<ConnectionError> for CliError {
    fn from(error: ConnectionError) -> Self {
        match error {
            ConnectionError::Link(error) => error.into(),
            rejected @ ConnectionError::Rejected { .. } => CliError::Input(rejected.to_string()),
            other => CliError::Other(other.to_string()),
        }
    }
}

impl From<hal_sim::session::SessionError> for CliError {
    fn from(error: hal_sim::session::SessionError) -> Self {
        match error {
            hal_sim::session::SessionError::Config(error) => CliError::Input(error.to_string()),
            other => CliError::Other(other.to_string()),
        }
    }
}

impl CliError {
    /// An error of the file at `path` while `action` was tried: a wrong name is an input error, a full disk is not.
    pub(super) fn file(path: &Path, action: &str, error: &std::io::Error) -> Self {
        use std::io::ErrorKind;
        let line = format!("{}: cannot {action}: {error}", path.display());
        match error.kind() {
            ErrorKind::NotFound | ErrorKind::IsADirectory | ErrorKind::NotADirectory => CliError::Input(line),
            ErrorKind::PermissionDenied if action == "read" => CliError::Input(line),
            ErrorKind::BrokenPipe => CliError::ClosedPipe,
            _ => CliError::Other(line),
        }
    }

    /// An input error in the file at `path`.
    pub(super) fn in_file(path: &Path, message: impl std::fmt::Display) -> Self {
        CliError::Input(format!("{}: {message}", path.display()))
    }
}

/// Prints the error on standard error; the exit status.
pub(super) fn exit_code(result: Result<(), CliError>) -> ExitCode {
    match result {
        Ok(()) | Err(CliError::ClosedPipe) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("stand: {error}");
            ExitCode::from(if matches!(error, CliError::Input(_)) { 2 } else { 1 })
        }
    }
}

/// The message of the argument parser in one line, without its usage paragraph.
pub(super) fn one_line(message: &str) -> String {
    let paragraphs = message.strip_prefix("error: ").unwrap_or(message).split("\n\n").filter(|p| !p.trim_start().starts_with("Usage:"));
    let lines = paragraphs.flat_map(str::lines).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("For more information"));
    format!("{} (--help lists commands and options)", lines.collect::<Vec<_>>().join(" "))
}

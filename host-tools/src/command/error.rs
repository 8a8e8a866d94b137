//! What can go wrong, in one line each, and the exit status that follows.

use std::path::Path;
use std::process::ExitCode;

use crate::acquire::connection::ConnectionError;

/// Why a command did not do its job.
#[derive(Debug, thiserror::Error)]
pub(super) enum CliError {
    /// The words or the input are wrong: status 2.
    #[error("{0}")]
    Input(String),
    /// Standard output was closed: nobody reads on, which is no error.
    #[error("standard output was closed")]
    ClosedPipe,
    /// Anything else: status 1.
    #[error("{0}")]
    Other(String),
}

/// An error of the input, whatever its type.
macro_rules! of_the_input {
    ($($error:ty),* $(,)?) => {$(
        impl From<$error> for CliError {
            fn from(error: $error) -> Self {
                CliError::Input(error.to_string())
            }
        }
    )*};
}
of_the_input!(
    crate::log::LogError,
    crate::model::ModelError,
    crate::identify::fit::prepare::PrepareError,
    crate::identify::fit::FitError,
    crate::observer::ObserverError,
    hal_sim::plant::StandError,
);

impl From<crate::acquire::link::LinkError> for CliError {
    fn from(error: crate::acquire::link::LinkError) -> Self {
        if error.is_of_the_input() { CliError::Input(error.to_string()) } else { CliError::Other(error.to_string()) }
    }
}

impl From<ConnectionError> for CliError {
    fn from(error: ConnectionError) -> Self {
        match error {
            ConnectionError::Link(error) => error.into(),
            refused @ ConnectionError::Refused { .. } => CliError::Input(refused.to_string()),
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
    /// A file that could not be read or written: a wrong name is the input's fault, a full disk is not.
    pub(super) fn file(path: &Path, doing: &str, error: &std::io::Error) -> Self {
        use std::io::ErrorKind;
        let line = format!("{}: cannot {doing}: {error}", path.display());
        match error.kind() {
            ErrorKind::NotFound | ErrorKind::PermissionDenied | ErrorKind::IsADirectory | ErrorKind::NotADirectory => CliError::Input(line),
            ErrorKind::BrokenPipe => CliError::ClosedPipe,
            _ => CliError::Other(line),
        }
    }
}

/// Says what went wrong on standard error, and the status.
pub(super) fn exit_code(done: Result<(), CliError>) -> ExitCode {
    match done {
        Ok(()) | Err(CliError::ClosedPipe) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("stand: {error}");
            ExitCode::from(if matches!(error, CliError::Input(_)) { 2 } else { 1 })
        }
    }
}

/// What the reader of the command line has to say, without its usage, in one line like every other error.
pub(super) fn in_one_line(says: &str) -> String {
    let paragraphs = says.strip_prefix("error: ").unwrap_or(says).split("\n\n").filter(|p| !p.trim_start().starts_with("Usage:"));
    let lines = paragraphs.flat_map(str::lines).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("For more information"));
    format!("{} (--help says what there is)", lines.collect::<Vec<_>>().join(" "))
}

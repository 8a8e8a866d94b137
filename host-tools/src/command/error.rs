//! What can go wrong, in one line each, and the exit status that follows.

use std::path::Path;
use std::process::ExitCode;

use crate::acquire::stand::SessionError;

/// Why a command did not do its job.
#[derive(Debug, thiserror::Error)]
pub(super) enum Trouble {
    /// The words or the input are wrong: status 2.
    #[error("{0}")]
    Input(String),
    /// Standard output was closed: nobody reads on, which is no trouble.
    #[error("standard output was closed")]
    ClosedPipe,
    /// Anything else: status 1.
    #[error("{0}")]
    Other(String),
}

/// An error of the input, whatever its type.
macro_rules! of_the_input {
    ($($error:ty),* $(,)?) => {$(
        impl From<$error> for Trouble {
            fn from(error: $error) -> Self {
                Trouble::Input(error.to_string())
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

impl From<crate::acquire::link::LinkError> for Trouble {
    fn from(error: crate::acquire::link::LinkError) -> Self {
        if error.is_of_the_input() { Trouble::Input(error.to_string()) } else { Trouble::Other(error.to_string()) }
    }
}

impl From<SessionError> for Trouble {
    fn from(error: SessionError) -> Self {
        match error {
            SessionError::Link(error) => error.into(),
            refused @ SessionError::Refused { .. } => Trouble::Input(refused.to_string()),
            other => Trouble::Other(other.to_string()),
        }
    }
}

impl From<hal_sim::session::SessionError> for Trouble {
    fn from(error: hal_sim::session::SessionError) -> Self {
        match error {
            hal_sim::session::SessionError::Config(error) => Trouble::Input(error.to_string()),
            other => Trouble::Other(other.to_string()),
        }
    }
}

impl Trouble {
    /// A file that could not be read or written: a wrong name is the input's fault, a full disk is not.
    pub(super) fn file(path: &Path, doing: &str, error: &std::io::Error) -> Self {
        use std::io::ErrorKind;
        let line = format!("{}: cannot {doing}: {error}", path.display());
        match error.kind() {
            ErrorKind::NotFound | ErrorKind::PermissionDenied | ErrorKind::IsADirectory | ErrorKind::NotADirectory => Trouble::Input(line),
            ErrorKind::BrokenPipe => Trouble::ClosedPipe,
            _ => Trouble::Other(line),
        }
    }
}

/// Says what went wrong on standard error, and the status.
pub(super) fn exit_code(done: Result<(), Trouble>) -> ExitCode {
    match done {
        Ok(()) | Err(Trouble::ClosedPipe) => ExitCode::SUCCESS,
        Err(trouble) => {
            eprintln!("stand: {trouble}");
            ExitCode::from(if matches!(trouble, Trouble::Input(_)) { 2 } else { 1 })
        }
    }
}

/// What the reader of the command line has to say, without its usage, in one line like every other error.
pub(super) fn in_one_line(says: &str) -> String {
    let paragraphs = says.strip_prefix("error: ").unwrap_or(says).split("\n\n").filter(|p| !p.trim_start().starts_with("Usage:"));
    let lines = paragraphs.flat_map(str::lines).map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("For more information"));
    format!("{} (--help says what there is)", lines.collect::<Vec<_>>().join(" "))
}

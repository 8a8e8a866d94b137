//! `stand panel`: the virtual instrument, a page in the browser of this computer.

use std::path::{Path, PathBuf};

use clap::Args;

use super::error::CliError;
use super::output::print;
use super::signals::Interrupts;
use stand_panel::PanelError;

/// Seed of the simulated stand's noise.
#[cfg(unix)]
const SEED: u64 = 1;

/// Show a stand on a page of this computer, drive it, record, compare and explain.
#[derive(Debug, Args)]
pub(super) struct Panel {
    /// Serial port of the stand; without it, a simulated stand
    #[arg(long, value_name = "P", conflicts_with_all = ["stand", "hidden"])]
    port: Option<PathBuf>,
    /// Description of the simulated stand, .toml
    #[arg(long, value_name = "FILE")]
    stand: Option<PathBuf>,
    /// Effect that the simulated stand has and its model lacks: a name, or a seed that draws one
    #[arg(long, value_name = "SEED|EFFECT", allow_negative_numbers = true)]
    hidden: Option<String>,
    /// Folder of the session: logs, models, answers, commands.txt
    #[arg(long, value_name = "FOLDER", default_value = "panel")]
    folder: PathBuf,
    /// Port of the page on 127.0.0.1; 0: a free one
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    listen: u16,
}

impl From<PanelError> for CliError {
    fn from(error: PanelError) -> Self {
        match error {
            PanelError::Link(error) => error.into(),
            PanelError::Listen { .. } | PanelError::Session(_) => CliError::Input(error.to_string()),
            PanelError::Serve(_) => CliError::Other(error.to_string()),
        }
    }
}

impl Panel {
    pub(super) fn run(self) -> Result<(), CliError> {
        let interrupts = Interrupts::install()?;
        let serve = |port: &Path| {
            // The address has the token, so it is the only line of standard output.
            let ready = |address: &str| drop(print(&format!("{address}\n")));
            Ok(stand_panel::serve(port, &self.folder, self.listen, ready, || interrupts.any())?)
        };
        match &self.port {
            Some(port) => serve(port),
            None => self.with_simulated_stand(serve),
        }
    }

    /// Runs `serve` with the port of a simulated stand.
    #[cfg(unix)]
    fn with_simulated_stand(&self, serve: impl Fn(&Path) -> Result<(), CliError>) -> Result<(), CliError> {
        use super::stand_file::{hide_effect, read_stand};
        use stand_acquire::serve::SimulatedStand;

        let mut stand = read_stand(self.stand.as_deref())?;
        hide_effect(self.hidden.as_deref(), &mut stand)?;
        let simulated = SimulatedStand::start(stand, SEED).map_err(|error| CliError::Other(error.to_string()))?;
        serve(simulated.port())
    }

    /// The simulated stand needs a pseudo-terminal.
    #[cfg(not(unix))]
    fn with_simulated_stand(&self, _: impl Fn(&Path) -> Result<(), CliError>) -> Result<(), CliError> {
        super::stand_file::required_port(None).map(drop)
    }
}

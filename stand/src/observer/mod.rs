//! `stand observer design|simulate|bode`: state observers of a gyrotheodolite.

mod bode;
mod design;
mod options;
mod simulate;
mod track;

use clap::Subcommand;

use super::error::CliError;

#[derive(Debug, Subcommand)]
pub(super) enum ObserverCommand {
    /// Gains of an observer, continuous and discrete, with warnings; with --port also written into a stand
    Design(design::DesignObserver),
    /// Simulate a static and an astatic observer side by side: errors, settling, estimated moment, closed loop
    Simulate(simulate::Simulate),
    /// Run an observer over a recorded log: states and learnt moment, beside the truth where the log has it
    Track(track::Track),
    /// Frequency responses of the element and the observers, and the distortion of the estimated rate
    Bode(bode::ShowBode),
}

impl ObserverCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            Self::Design(design) => design.run(),
            Self::Simulate(simulate) => simulate.run(),
            Self::Track(track) => track.run(),
            Self::Bode(bode) => bode.run(),
        }
    }
}

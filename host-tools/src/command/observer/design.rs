//! `stand observer design`.

use clap::Args;

use super::write::Target;
use super::{ElementWords, Placing};
use crate::command::error::CliError;
use crate::command::output::ReportOutput;
use crate::report::observer::{design_html, design_json, design_text};

/// Step of the stand's rows, s.
pub(super) const ROW_S: f64 = 1e-3;

/// Gains of an observer.
#[derive(Debug, Args)]
pub(in crate::command) struct DesignObserver {
    #[command(flatten)]
    element: ElementWords,
    #[command(flatten)]
    placing: Placing,
    /// Step of the exact discrete form, s
    #[arg(long, value_name = "S", default_value_t = ROW_S, allow_negative_numbers = true)]
    step: f64,
    #[command(flatten)]
    target: Target,
    #[command(flatten)]
    output: ReportOutput,
}

impl DesignObserver {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let design = self.placing.request(self.element.plant()?, None, Some(self.step))?.design()?;
        let written = self.target.port.as_deref().map(|port| self.target.write(&design, port)).transpose()?;
        self.output.text(&(design_text(&design) + &written.unwrap_or_default()))?;
        self.output.json(|| design_json(&design))?;
        self.output.html(|| design_html(&design))
    }
}

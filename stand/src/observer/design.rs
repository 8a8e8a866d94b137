//! `stand observer design`.

use std::path::PathBuf;

use clap::Args;

use super::options::{DesignOptions, ElementOptions};
use crate::error::CliError;
use crate::output::ReportOutput;
use stand_acquire::link::SerialLink;
use stand_analysis::observer::serial_stand::{ROW_INTERVAL_S, TransferError, TransferRequest, check, write_design};
use stand_report::observer::{design_html, design_json, design_text, transfer_text};

/// Gains of an observer.
#[derive(Debug, Args)]
pub(crate) struct DesignObserver {
    #[command(flatten)]
    element: ElementOptions,
    #[command(flatten)]
    design: DesignOptions,
    /// Step of the exact discrete form, s
    #[arg(long, value_name = "S", default_value_t = ROW_INTERVAL_S, allow_negative_numbers = true)]
    step: f64,
    /// Write the observer into the stand at this serial port and switch it on
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    /// With --port: save the observer in the stand's flash
    #[arg(long, requires = "port")]
    save: bool,
    /// With --port: moment of the gyroscope's torquer per current, N m/A
    #[arg(long, requires = "port", value_name = "N_M_A", default_value_t = 0.05, allow_negative_numbers = true)]
    torquer: f64,
    /// With --port: gains of the regulator for the first states, N m; an estimated moment is fed forward in full
    #[arg(long, requires = "port", value_name = "R1,R2,…", value_delimiter = ',', allow_negative_numbers = true)]
    regulator: Vec<f64>,
    #[command(flatten)]
    output: ReportOutput,
}

impl From<TransferError> for CliError {
    fn from(error: TransferError) -> Self {
        match error {
            TransferError::Link(error) => error.into(),
            other => CliError::of_parameters(&other),
        }
    }
}

impl DesignObserver {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let design = self.design.request(self.element.plant()?, None, Some(self.step))?.design()?;
        let mut text = design_text(&design);
        if let Some(port) = &self.port {
            let request = TransferRequest { torquer_N_m_A: self.torquer, regulator: &self.regulator, save: self.save };
            check(&design, &request)?;
            let mut link = SerialLink::open(port)?;
            let phase = write_design(&mut link, &design, &request)?;
            text += &transfer_text(&link.name(), &phase, self.save);
        }
        self.output.text(&text)?;
        self.output.json(|| design_json(&design))?;
        self.output.html(|| design_html(&design))
    }
}

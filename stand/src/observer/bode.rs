//! `stand observer bode`.

use clap::Args;

use super::options::{ElementOptions, ObserverKind, check_vibration};
use crate::error::CliError;
use crate::output::ReportOutput;
use stand_analysis::observer::{Bode, DEFAULT_INTEGRAL_ROW};
use stand_report::observer::{bode_html, bode_json, bode_text};

/// Frequency responses of the element and the observers.
#[derive(Debug, Args)]
pub(crate) struct ShowBode {
    #[command(flatten)]
    element: ElementOptions,
    /// All poles at −W, 1/s, for several observers, e.g. 10,100,1000; default 0.1, 1 and 10 times the default of `observer design`
    #[arg(long, visible_alias = "w0", value_name = "W,…", value_delimiter = ',', allow_negative_numbers = true)]
    omega: Vec<f64>,
    /// Kind of the observer
    #[arg(long, value_enum, default_value = "static")]
    kind: ObserverKind,
    /// Row that the integral channel feeds, counted from 1
    #[arg(long, value_name = "ROW", default_value_t = DEFAULT_INTEGRAL_ROW)]
    row: usize,
    /// Frequency of a vibration, Hz, at which the distortion is reported
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    vibration_hz: Option<f64>,
    #[command(flatten)]
    output: ReportOutput,
}

impl ShowBode {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let vibration_Hz = check_vibration(self.vibration_hz)?;
        let plant = self.element.plant()?;
        let omegas = if self.omega.is_empty() { Bode::default_omegas_1_s(&plant) } else { self.omega.clone() };
        let bodes = Bode::of(&plant, self.kind.with(self.row, None), &omegas)?;
        self.output.text(&bode_text(&plant, &bodes, vibration_Hz))?;
        self.output.json(|| bode_json(&plant, &bodes, vibration_Hz))?;
        self.output.html(|| bode_html(&plant, &bodes, vibration_Hz))
    }
}

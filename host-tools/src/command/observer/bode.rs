//! `stand observer bode`.

use clap::Args;

use super::{ElementWords, KindWord, usual_omega};
use crate::command::error::CliError;
use crate::command::output::ReportOutput;
use crate::observer::{Bode, Kind};
use crate::report::observer::{bode_html, bode_json, bode_text};

/// Object and observers over frequency.
#[derive(Debug, Args)]
pub(in crate::command) struct ShowBode {
    #[command(flatten)]
    element: ElementWords,
    /// All poles at −W, 1/s, several: 10,100,1000; usually a tenth, once and ten times what suits
    #[arg(long, visible_alias = "w0", value_name = "W,…", value_delimiter = ',', allow_negative_numbers = true)]
    omega: Vec<f64>,
    /// Which observer
    #[arg(long, value_enum, default_value = "static")]
    kind: KindWord,
    /// Row that the integral channel feeds, from 1
    #[arg(long, value_name = "ROW", default_value_t = 2)]
    row: usize,
    /// A frequency of vibration, Hz, at which the distortion is told
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    vibration_hz: Option<f64>,
    #[command(flatten)]
    output: ReportOutput,
}

impl ShowBode {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        if self.vibration_hz.is_some_and(|f| !(f.is_finite() && f > 0.0)) {
            return Err(CliError::Input("--vibration-hz must be above 0".to_owned()));
        }
        let plant = self.element.plant()?;
        let usual = usual_omega(&plant);
        let omegas = if self.omega.is_empty() { vec![0.1 * usual, usual, 10.0 * usual] } else { self.omega.clone() };
        let kind = match self.kind {
            KindWord::Static => Kind::Static,
            KindWord::Integral => Kind::Integral { row: self.row, gain: None },
            KindWord::Augmented => Kind::Augmented,
        };
        let bodes = Bode::of(&plant, kind, &omegas)?;
        self.output.text(&bode_text(&plant, &bodes, self.vibration_hz))?;
        self.output.json(|| bode_json(&plant, &bodes, self.vibration_hz))?;
        self.output.html(|| bode_html(&plant, &bodes, self.vibration_hz))
    }
}

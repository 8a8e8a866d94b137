//! `stand allan LOG --column C`: the noise of a sensor at rest.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::error::CliError;
use super::output::{ReportOutput, spinner};
use crate::allan::{AllanError, Request, Take, Taus};
use crate::report::allan as page;

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Averages {
    /// 1, 2, 4, 8 … rows
    Octave,
    /// 1, 2, 5, 10, 20 … rows
    Decade,
    /// Eight to an octave
    Fine,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum As {
    /// The quantity whose noise is looked for, a rate or any other
    Value,
    /// Its integral, as an angle is of the rate
    Integral,
}

/// Read up to τ = T/10: σ²(τ) = 3Q²/τ² + N²/τ + (0.664 B)² + K²τ/3 + R²τ²/2.
#[derive(Debug, Args)]
pub(super) struct Allan {
    /// The log of a sensor at rest, .csv or .parquet
    log: PathBuf,
    /// The column, of any name; its end tells the unit
    #[arg(long, value_name = "COLUMN")]
    column: String,
    /// Rows from this time on, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Rows up to this time, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    to: Option<f64>,
    /// Averaging times that are shown
    #[arg(long, value_enum, default_value_t = Averages::Octave)]
    taus: Averages,
    /// What the column is; usually by its unit: an angle is an integral, all else a value
    #[arg(long = "as", value_enum)]
    take: Option<As>,
    #[command(flatten)]
    output: ReportOutput,
}

impl From<AllanError> for CliError {
    fn from(error: AllanError) -> Self {
        CliError::Input(error.to_string())
    }
}

impl Allan {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        let request = Request {
            log: self.log,
            column: self.column,
            from_s: self.from,
            to_s: self.to,
            taus: match self.taus {
                Averages::Octave => Taus::Octave,
                Averages::Decade => Taus::Decade,
                Averages::Fine => Taus::Fine,
            },
            take: self.take.map(|take| match take {
                As::Value => Take::Value,
                As::Integral => Take::Integral,
            }),
        };
        let bar = spinner("reading");
        let answer = request.answer();
        bar.finish_and_clear();
        let answer = answer?;
        self.output.text(&page::text(&answer))?;
        self.output.html(|| page::html(&answer))?;
        self.output.json(|| answer.json())
    }
}

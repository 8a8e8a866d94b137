//! `stand allan LOG --column C`: the noise of a sensor at rest.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::error::CliError;
use super::import::ImportOptions;
use super::output::{ReportOutput, UnitOptions, spinner};
use stand_analysis::allan::{Interpretation, Request, Taus};
use stand_report::allan as report;

/// Values of `--taus`.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum TausOption {
    /// 1, 2, 4, 8 … rows
    Octave,
    /// 1, 2, 5, 10, 20 … rows
    Decade,
    /// Eight averaging times per octave
    Fine,
}

/// Values of `--as`.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum InterpretationOption {
    /// The quantity itself: a rate or any other
    Value,
    /// The integral of the quantity, as an angle is of the rate
    Integral,
}

/// Noise coefficients by the Allan deviation, for τ up to T/10 (T: duration of the log): σ²(τ) = 3Q²/τ² + N²/τ + (0.664 B)² + K²τ/3 +
/// R²τ²/2.
#[derive(Debug, Args)]
pub(super) struct Allan {
    /// The log of a sensor at rest, .csv or .parquet
    log: PathBuf,
    /// Name of the column; its suffix gives the unit
    #[arg(long, value_name = "COLUMN")]
    column: String,
    /// Start of the analysed range, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<f64>,
    /// End of the analysed range, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    to: Option<f64>,
    /// Averaging times of the result
    #[arg(long, value_enum, default_value_t = TausOption::Octave)]
    taus: TausOption,
    /// Interpretation of the column; by default an angle is an integral, everything else a value
    #[arg(long = "as", value_enum)]
    interpretation: Option<InterpretationOption>,
    #[command(flatten)]
    import: ImportOptions,
    #[command(flatten)]
    units: UnitOptions,
    #[command(flatten)]
    output: ReportOutput,
}

impl Allan {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.import.apply([self.log.as_path()])?;
        let request = Request {
            log: self.log,
            column: self.column,
            from_s: self.from,
            to_s: self.to,
            taus: match self.taus {
                TausOption::Octave => Taus::Octave,
                TausOption::Decade => Taus::Decade,
                TausOption::Fine => Taus::Fine,
            },
            interpretation: self.interpretation.map(|given| match given {
                InterpretationOption::Value => Interpretation::Value,
                InterpretationOption::Integral => Interpretation::Integral,
            }),
        };
        let bar = spinner("reading");
        let answer = request.answer();
        bar.finish_and_clear();
        let answer = answer?;
        let display = report::Display::new(&answer, self.units.units.unwrap_or_default());
        self.output.text(&report::text(&answer, &display))?;
        self.output.html(|| report::html(&answer, &display))?;
        self.output.json(|| report::json(&answer, &display))
    }
}

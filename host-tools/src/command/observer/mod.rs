//! `stand observer design|simulate|bode`: state observers of a gyrotheodolite.

mod bode;
mod design;
mod simulate;
mod write;

use clap::{Args, Subcommand, ValueEnum};

use super::error::CliError;
use crate::observer::{Kind, ObserverError, Plant, Poles, Request};

#[derive(Debug, Subcommand)]
pub(super) enum ObserverCommand {
    /// Gains of an observer: continuous, exact discrete, with what to beware of; written into a stand
    Design(design::DesignObserver),
    /// A static observer beside an astatic one: errors, settling, the moment, the closed loop
    Simulate(simulate::Simulate),
    /// Object and observers over frequency: where the estimated rate is distorted
    Bode(bode::ShowBode),
}

impl ObserverCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        match self {
            Self::Design(design) => design.run(),
            Self::Simulate(simulate) => simulate.run(),
            Self::Bode(bode) => bode.run(),
        }
    }
}

/// Which element, as every one of these commands takes it.
#[derive(Debug, Clone, Args)]
#[command(group = clap::ArgGroup::new("element").required(true).args(["element_name", "preset"]))]
struct ElementWords {
    /// A preset (astatic-identifier, astatic-identifier-recovered, rate-observer), or a .toml with [six_state] or [four_state]
    #[arg(value_name = "MODEL")]
    element_name: Option<String>,
    /// The preset, by an option
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
}

impl ElementWords {
    fn plant(&self) -> Result<Plant, CliError> {
        let name = self.element_name.as_ref().or(self.preset.as_ref()).map_or("", String::as_str);
        Ok(Plant::named(name)?)
    }
}

/// The kinds by their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum KindWord {
    /// Without an integral channel
    Static,
    /// Static gains and an integral channel
    Integral,
    /// The disturbance is one state more
    Augmented,
}

/// Poles and kind.
#[derive(Debug, Clone, Args)]
struct Placing {
    /// All poles at −W, 1/s; usually 50 for six states and 100 for four
    #[arg(long, visible_alias = "w0", value_name = "W", conflicts_with = "poles", allow_negative_numbers = true)]
    omega: Option<f64>,
    /// The poles one by one, 1/s: -50,-40+30i,…
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    poles: Option<String>,
    /// Which observer; usually integral for six states and static for four
    #[arg(long, value_enum)]
    kind: Option<KindWord>,
    /// Row that the integral channel feeds, from 1
    #[arg(long, value_name = "ROW")]
    row: Option<usize>,
    /// Its gain; usually that of the row, without sign
    #[arg(long, value_name = "KAPPA", allow_negative_numbers = true)]
    integral_gain: Option<f64>,
    /// Highest frequency of vibration, Hz
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    vibration_hz: Option<f64>,
}

impl Placing {
    /// What is asked for, `kind` where none is named.
    fn request(&self, plant: Plant, kind: Option<KindWord>, step_s: Option<f64>) -> Result<Request, ObserverError> {
        let six = plant.states().len() == 6;
        let poles = match (&self.poles, self.omega) {
            (Some(list), _) => Poles::parse(list)?,
            (None, omega) => Poles::Binomial(omega.unwrap_or(usual_omega(&plant))),
        };
        let usual = if six { KindWord::Integral } else { KindWord::Static };
        let kind = match self.kind.or(kind).unwrap_or(usual) {
            KindWord::Integral => Kind::Integral { row: self.row.unwrap_or(2), gain: self.integral_gain },
            other if self.row.is_some() || self.integral_gain.is_some() => {
                let name = if other == KindWord::Static { "static" } else { "augmented" };
                return Err(ObserverError::Option(format!("--row and --integral-gain apply to --kind integral, not to {name}")));
            }
            KindWord::Static => Kind::Static,
            KindWord::Augmented => Kind::Augmented,
        };
        let vibration_Hz = self.vibration_hz;
        if vibration_Hz.is_some_and(|f| !(f.is_finite() && f > 0.0)) {
            return Err(ObserverError::Option("--vibration-hz must be above 0".to_owned()));
        }
        Ok(Request { plant, poles, kind, step_s, vibration_Hz })
    }
}

/// Poles that suit: the paper's of the identifier, above three times the nutation of set B.
fn usual_omega(plant: &Plant) -> f64 {
    if plant.states().len() == 6 { 50.0 } else { 100.0 }
}

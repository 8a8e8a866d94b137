//! Options shared by the observer commands: element, kind, poles.

use clap::{Args, ValueEnum};

use crate::error::CliError;
use stand_analysis::observer::{DEFAULT_INTEGRAL_ROW, Kind, Plant, Poles, Request};

/// The element.
#[derive(Debug, Clone, Args)]
#[command(group = clap::ArgGroup::new("element").required(true).args(["element_name", "preset"]))]
pub(super) struct ElementOptions {
    /// The element: a preset (astatic-identifier, astatic-identifier-recovered, rate-observer) or a .toml file with [six_state] or
    /// [four_state]
    #[arg(value_name = "MODEL")]
    element_name: Option<String>,
    /// The preset, given by an option
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
}

impl ElementOptions {
    /// The element's model.
    pub(super) fn plant(&self) -> Result<Plant, CliError> {
        let name = self.element_name.as_ref().or(self.preset.as_ref()).map_or("", String::as_str);
        Ok(Plant::named(name)?)
    }
}

/// Kind of the observer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ObserverKind {
    /// Static gains
    Static,
    /// Static gains and an integral channel
    Integral,
    /// The disturbance is an additional state
    Augmented,
}

impl ObserverKind {
    /// The kind with the options of the integral channel.
    pub(super) fn with(self, row: usize, gain: Option<f64>) -> Kind {
        match self {
            ObserverKind::Static => Kind::Static,
            ObserverKind::Integral => Kind::Integral { row, gain },
            ObserverKind::Augmented => Kind::Augmented,
        }
    }
}

/// Poles and kind of the observer.
#[derive(Debug, Clone, Args)]
pub(super) struct DesignOptions {
    /// All poles at −W, 1/s; default 50 for six states and 100 for four
    #[arg(long, visible_alias = "w0", value_name = "W", conflicts_with = "poles", allow_negative_numbers = true)]
    pub(super) omega: Option<f64>,
    /// List of poles, 1/s, e.g. -50,-40+30i,…
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    pub(super) poles: Option<String>,
    /// Kind of the observer; default integral for six states and static for four
    #[arg(long, value_enum)]
    pub(super) kind: Option<ObserverKind>,
    /// Row that the integral channel feeds, counted from 1; default 2
    #[arg(long, value_name = "ROW")]
    pub(super) row: Option<usize>,
    /// Gain of the integral channel; default the absolute gain of its row
    #[arg(long, value_name = "KAPPA", allow_negative_numbers = true)]
    pub(super) integral_gain: Option<f64>,
    /// Highest frequency of the vibration, Hz
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    pub(super) vibration_hz: Option<f64>,
}

impl DesignOptions {
    /// The design request; `kind` is the kind where the option is missing.
    pub(super) fn request(&self, plant: Plant, kind: Option<ObserverKind>, step_s: Option<f64>) -> Result<Request, CliError> {
        let poles = self.poles.as_deref().map(Poles::parse).transpose()?;
        let poles = poles.unwrap_or_else(|| Poles::Binomial(self.omega.unwrap_or(plant.default_omega_1_s())));
        let kind = self.kind.or(kind).map_or(Kind::usual(&plant), |kind| kind.with(DEFAULT_INTEGRAL_ROW, None));
        let kind = kind
            .with_integral(self.row, self.integral_gain)
            .ok_or_else(|| CliError::Input(format!("--row and --integral-gain apply to --kind integral, not to {}", kind.name())))?;
        let vibration_Hz = check_vibration(self.vibration_hz)?;
        Ok(Request { plant, poles, kind, step_s, vibration_Hz })
    }
}

/// The frequency of the option `--vibration-hz`.
pub(super) fn check_vibration(vibration_Hz: Option<f64>) -> Result<Option<f64>, CliError> {
    if vibration_Hz.is_some_and(|f| !(f.is_finite() && f > 0.0)) {
        return Err(CliError::Input("--vibration-hz must be above 0".to_owned()));
    }
    Ok(vibration_Hz)
}

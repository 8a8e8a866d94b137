//! The result of an explanation, as data; `report` words it.

pub mod coverage;
pub mod experiment;
pub mod reasons;

use drive_model::{Card, Coordinate};

use crate::identify::explain::criteria::Criteria;
use crate::identify::fit::{FitResult, MAX_CHI2_PER_N_OF_NOISE};
use crate::identify::residual::Misfit;
use crate::log::Log;
use crate::model::{Channel, Model, SummingPoint};
use crate::recording::{Preparation, PreparedLog};
use crate::statistics::bins::Bin;
use coverage::Coverage;
use experiment::NextExperiment;
use reasons::{NotVisible, Refusal, Remark};

/// The verdict on a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// No effect is missing that the logs could show.
    Adequate,
    /// Effects of the catalogue were missing.
    EffectFound,
    /// Effects of the catalogue were missing and explain most of the error; something else is left.
    PartlyExplained,
    /// The model fails, and no effect of the catalogue explains it.
    UnknownStructure,
    /// The limit of effort or time ended the search.
    NotFinished,
}

impl Verdict {
    /// All of them.
    pub const ALL: [Verdict; 5] =
        [Verdict::Adequate, Verdict::EffectFound, Verdict::PartlyExplained, Verdict::UnknownStructure, Verdict::NotFinished];

    /// Name in the JSON answer.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Adequate => "adequate",
            Verdict::EffectFound => "effect-found",
            Verdict::PartlyExplained => "partly-explained",
            Verdict::UnknownStructure => "unknown-structure",
            Verdict::NotFinished => "not-finished",
        }
    }
}

/// Error of one channel, in the channel's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelError {
    /// The channel.
    pub channel: Channel,
    /// Root mean square of the residual over the fitted rows.
    pub rms: f64,
    /// Root mean square over the held-out rows; `None` where there are none.
    pub heldout_rms: Option<f64>,
    /// Standard deviation of the channel's noise.
    pub noise: f64,
}

impl ChannelError {
    /// rms over noise: 1 where only noise is left.
    pub fn ratio(&self) -> f64 {
        self.rms / self.noise
    }

    /// χ²/n on the held-out rows; on the fitted rows where there are none.
    pub fn heldout_chi2_per_n(&self) -> f64 {
        (self.heldout_rms.unwrap_or(self.rms) / self.noise).powi(2)
    }
}

/// An estimated parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Name in the model file, e.g. `cogging_N_m#2`.
    pub name: String,
    /// Its unit; empty for a parameter that the user defined.
    pub unit: &'static str,
    /// Value.
    pub value: f64,
    /// Standard error; 0 where the parameter was scanned or fixed.
    pub sigma: f64,
}

/// One stage of the search: the model with what was added so far, fitted.
#[derive(Debug, Clone)]
pub struct Stage {
    /// Names of the model's effects, user-defined ones included.
    pub effects: Vec<String>,
    /// The effect that was added last; `None` for the given model.
    pub added: Option<String>,
    /// Error of each channel, relative to the noise that the last stage found.
    pub outputs: Vec<ChannelError>,
    /// All free parameters.
    pub parameters: Vec<Estimate>,
    /// Of a standard error, the larger part is by the voltage within the rows ([`crate::identify::fit::FitResult::rests_on_course`]).
    pub rests_on_course: bool,
}

impl Stage {
    /// No channel has more than noise left. Otherwise the standard errors are those of noise of the size that is left, and what the model
    /// lacks may have shifted the parameters by more.
    pub fn leaves_noise_only(&self) -> bool {
        self.outputs.iter().all(|o| o.ratio().powi(2) <= MAX_CHI2_PER_N_OF_NOISE)
    }

    /// As [`crate::identify::fit::FitResult::sigma_is_lower_bound`].
    pub fn sigma_is_lower_bound(&self) -> bool {
        !self.leaves_noise_only() || self.rests_on_course
    }
}

/// An effect that the given model lacks, with the evidence for it.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Name in the model if it were added, e.g. `cogging`, `cogging#2`.
    pub effect: String,
    /// Its own parameters; where it was only screened, after one step of the linear model.
    pub parameters: Vec<Estimate>,
    /// The model with it was fitted; otherwise it was only screened.
    pub refitted: bool,
    /// Error of each channel with it; empty where it was only screened.
    pub outputs: Vec<ChannelError>,
    /// BIC on whitened residuals with it minus that without it; `None` where it was only screened.
    pub delta_bic: Option<f64>,
    /// Familywise probability of such a gain by chance. Where the effect was only screened it is too small on correlated residuals.
    pub p_value: f64,
    /// Its decimal logarithm.
    pub log10_p: f64,
    /// Effects that these logs cannot distinguish from it.
    pub ambiguous_with: Vec<String>,
    /// Why it was refused; `None` where it was not.
    pub refused: Option<Refusal>,
    /// Why the logs cannot show it; `None` where it was tried.
    pub not_visible: Option<NotVisible>,
}

impl Candidate {
    /// An effect that was only screened: its card, values after one step of the linear model, and the logarithm of the probability by
    /// chance.
    pub fn screened(effect: String, card: &Card, values: &[f64], ln_p: f64, refused: Option<Refusal>) -> Self {
        let parameters = card.parameters.iter().zip(values);
        Candidate {
            effect,
            parameters: parameters.map(|(p, v)| Estimate { name: p.name.to_owned(), unit: p.unit, value: *v, sigma: 0.0 }).collect(),
            refitted: false,
            outputs: Vec::new(),
            delta_bic: None,
            p_value: ln_p.exp(),
            log10_p: ln_p / std::f64::consts::LN_10,
            ambiguous_with: Vec::new(),
            refused,
            not_visible: None,
        }
    }

    /// An effect that the logs cannot show.
    pub fn invisible(effect: String, reason: NotVisible) -> Self {
        Candidate {
            effect,
            parameters: Vec::new(),
            refitted: false,
            outputs: Vec::new(),
            delta_bic: None,
            p_value: 1.0,
            log10_p: 0.0,
            ambiguous_with: Vec::new(),
            refused: None,
            not_visible: Some(reason),
        }
    }

    /// The gain is not significant over the whole catalogue.
    pub fn may_be_chance(&self, criteria: &Criteria) -> bool {
        self.log10_p > criteria.evidence.max_familywise_p.log10()
    }
}

/// What is left by a model, as a function of a coordinate.
#[derive(Debug, Clone)]
pub struct Shape {
    /// What it is added to: a torque, the Coulomb level or the voltage.
    pub acts_on: SummingPoint,
    /// Its coordinate.
    pub coordinate: Coordinate,
    /// Its form.
    pub form: ShapeForm,
    /// The function itself, in the unit of `acts_on`.
    pub bins: Vec<Bin>,
    /// An `[effect.NAME]` table for the model file, fitted to the logs.
    pub expression: Option<String>,
    /// BIC of the model with that expression minus that without it.
    pub delta_bic: f64,
}

/// Form of a [`Shape`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShapeForm {
    /// Piecewise linear over the coordinate; largest deviation from its median, in the unit of `acts_on`.
    PiecewiseLinear {
        /// Largest deviation from the median.
        largest: f64,
    },
    /// A sine in time. The bins cover one period.
    Oscillation {
        /// Frequency, Hz.
        frequency_Hz: f64,
        /// Amplitude: N m, or a fraction of the commanded voltage.
        amplitude: f64,
    },
}

/// The whole result.
pub struct Explanation {
    /// The verdict.
    pub verdict: Verdict,
    /// The given model, fitted.
    pub given: FitResult,
    /// Names of the added effects, in order.
    pub missing: Vec<String>,
    /// The given model first, then one stage per added effect.
    pub stages: Vec<Stage>,
    /// All candidates of the first adding step, the best first.
    pub candidates: Vec<Candidate>,
    /// Misfits of the given model, largest share first.
    pub misfits: Vec<Misfit>,
    /// Misfits of the final model, where it is not adequate; empty otherwise.
    pub remaining: Vec<Misfit>,
    /// What is left at the end and no effect explains; empty where it is noise.
    pub unexplained: Vec<Shape>,
    /// What is open, and the state to continue from, where the search is not finished.
    pub unfinished: Option<Unfinished>,
    /// What to measure next; `None` where nothing is open.
    pub next: Option<NextExperiment>,
    /// The model with the added effects, fitted: what `--apply` writes.
    pub model: Model,
    /// The fit of that model.
    pub explained: FitResult,
    /// Paths of the logs as given.
    pub logs: Vec<String>,
    /// All logs as one, each at least a segment of its own. `given` and `explained` are fits to it.
    pub log: Log,
    /// The preparation of that log, see [`Explanation::data`].
    pub preparation: Preparation,
    /// The range of operation that it covers.
    pub coverage: Coverage,
    /// Where nothing is missing: the smallest effects that the logs would have shown with 95 % probability.
    pub detection_limits: Vec<DetectionLimit>,
    /// Remarks on the preparation and the search.
    pub remarks: Vec<Remark>,
    /// The criteria in force.
    pub criteria: Criteria,
    /// Simulated rows × lanes (the value and its derivatives) over the rows of the logs. The same on every machine.
    pub effort_passes: f64,
    /// Duration of the computation, s.
    pub seconds: f64,
}

impl Explanation {
    /// The log as it was fitted.
    pub fn data(&self) -> PreparedLog<'_> {
        self.preparation.with_columns(&self.log)
    }
}

/// The smallest amplitude of an effect that the logs would have shown.
#[derive(Debug, Clone, Copy)]
pub struct DetectionLimit {
    /// The effect.
    pub card: &'static Card,
    /// Position of the amplitude among its parameters.
    pub parameter: usize,
    /// The amplitude, in the unit of the parameter.
    pub size: f64,
    /// Where the limit is highest among the values that were tried of another parameter: its position among the parameters, and the value.
    pub at: Option<(usize, f64)>,
}

/// What a search has not settled.
#[derive(Debug, Clone)]
pub struct Unfinished {
    /// The part that the budget ended.
    pub open: OpenPart,
    /// What the next run continues from, as the text of a file ([`crate::identify::explain::SearchState`]).
    pub state: String,
}

/// A part of the method that was not completed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OpenPart {
    /// Whether a further effect is missing.
    AddingStep {
        /// Its number: 1 for the first effect.
        number: usize,
    },
    /// Whether the log was recorded by another convention.
    Conventions,
    /// What is left, and whether a structure that no effect has describes it better.
    Remainder,
}

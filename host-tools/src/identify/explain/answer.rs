//! What an explanation says, apart from how it is told.

use drive_model::Coordinate;

use super::fitted::FAMILYWISE;
use crate::identify::fit::FitResult;
use crate::identify::residual::Misfit;
use crate::log::Log;
use crate::model::{Channel, Model};
use crate::statistics::bins::Bin;

/// The answer in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing is missing that this log could show.
    Adequate,
    /// Effects of the catalogue were missing.
    EffectFound,
    /// Something is there that no known effect explains.
    UnknownStructure,
}

impl Verdict {
    /// Name in the answers.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Adequate => "adequate",
            Verdict::EffectFound => "effect-found",
            Verdict::UnknownStructure => "unknown-structure",
        }
    }
}

/// One channel at one stage of the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// The channel.
    pub channel: Channel,
    /// Root mean square of the residual over the fitted rows.
    pub rms: f64,
    /// The same over rows that the fit never saw; `None` where nothing was held out.
    pub heldout_rms: Option<f64>,
    /// The channel's noise.
    pub noise: f64,
}

impl Shown {
    /// rms over noise: 1 where the model lacks nothing.
    pub fn ratio(&self) -> f64 {
        self.rms / self.noise
    }
}

/// A parameter of an answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Name in the model file, e.g. `cogging_N_m#2`.
    pub name: String,
    /// Its unit; empty for a parameter of the user's own.
    pub unit: &'static str,
    /// Value.
    pub value: f64,
    /// Standard error; 0 where it was scanned (an order) or fixed.
    pub sigma: f64,
}

/// One stage of the path: the model with what was added so far, fitted.
#[derive(Debug, Clone)]
pub struct Stage {
    /// Effects of the model, those of the user's own too.
    pub effects: Vec<String>,
    /// What was added last; `None` for the model as it was given.
    pub added: Option<String>,
    /// Its channels.
    pub outputs: Vec<Shown>,
    /// All free parameters, fitted.
    pub parameters: Vec<Estimate>,
}

/// One candidate of the first adding step, with the evidence for it; or why there is none.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Name in the model if it were added, e.g. `cogging`, `cogging#2`.
    pub effect: String,
    /// Its own parameters, fitted (or by the score test's one step, if `refitted` is false).
    pub parameters: Vec<Estimate>,
    /// The model with it was fitted in full; else only screened.
    pub refitted: bool,
    /// Channels of the model with it; empty where it was only screened.
    pub outputs: Vec<Shown>,
    /// BIC on whitened residuals with it, minus that without: negative is better with it. `None` where it was only screened.
    pub delta_bic: Option<f64>,
    /// Probability of as much by chance, over the whole catalogue (familywise); where it was only screened, too small on residuals that remember.
    pub p_value: f64,
    /// Its decimal logarithm.
    pub log10_p: f64,
    /// Other effects that this log cannot tell from it.
    pub ambiguous_with: Vec<String>,
    /// Why it cannot be the explanation, or cannot be seen in this log, as a sentence; `None` where nothing speaks against it but the figures.
    pub refused: Option<String>,
}

impl Candidate {
    /// Over the whole catalogue, chance alone would do as much too often.
    pub fn may_be_chance(&self) -> bool {
        self.log10_p > FAMILYWISE.log10()
    }
}

/// What is left, drawn over a coordinate, with an expression for it.
#[derive(Debug, Clone)]
pub struct Shape {
    /// What it is: `torque_N_m`, `voltage_V`, or the channel that shows it.
    pub acts_on: &'static str,
    /// Over which coordinate.
    pub coordinate: Coordinate,
    /// Label of the coordinate's axis with its unit.
    pub along: &'static str,
    /// The shape itself, in the unit of `acts_on`.
    pub bins: Vec<Bin>,
    /// An `[effect.NAME]` table that can be pasted into the model file, fitted to the log.
    pub expression: Option<String>,
    /// BIC of the model with that expression, minus that without.
    pub delta_bic: f64,
    /// A sentence for the person.
    pub says: String,
}

/// What to measure next.
#[derive(Debug, Clone, PartialEq)]
pub struct NextExperiment {
    /// Why, and what it will show.
    pub says: String,
    /// The command that does it.
    pub command: String,
}

/// The whole answer.
pub struct Explanation {
    /// In one word.
    pub verdict: Verdict,
    /// The model as it was given, fitted: what fails where.
    pub given: FitResult,
    /// Names of what was added, in order.
    pub missing: Vec<String>,
    /// The path: the given model first, then one stage per added effect.
    pub stages: Vec<Stage>,
    /// All candidates of the first adding step, the best first.
    pub candidates: Vec<Candidate>,
    /// Where the given model fails, most telling first.
    pub failures: Vec<Misfit>,
    /// What is left at the end and no effect explains; empty where it is noise.
    pub unexplained: Vec<Shape>,
    /// What to measure next; `None` where nothing is open.
    pub next: Option<NextExperiment>,
    /// The model with what was missing, fitted: what `--apply` writes.
    pub model: Model,
    /// That model held against the log (for the plots).
    pub explained: FitResult,
    /// Their paths, as they were given.
    pub logs: Vec<String>,
    /// All logs as one, a segment each at least; what `given` and `explained` were held against.
    pub log: Log,
    /// What a person should know of how it was done.
    pub remarks: Vec<String>,
    /// How long it took, s.
    pub seconds: f64,
}

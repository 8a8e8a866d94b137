//! The next experiment that an answer recommends, as data.

use drive_model::StandRun;

/// An experiment to do next.
#[derive(Debug, Clone, PartialEq)]
pub struct NextExperiment {
    /// Its purpose.
    pub purpose: Purpose,
    /// The session.
    pub run: StandRun,
    /// What each run of the stand is expected to bring, the best first; empty where no two effects are to be distinguished, or the drive
    /// cannot be simulated.
    pub expected: Vec<Separation>,
}

/// How well a run would separate candidates that the present logs do not distinguish.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Separation {
    /// The run.
    pub run: StandRun,
    /// Expected increase of ΔBIC between the added effect and its nearest rival.
    pub expected_delta_bic: f64,
}

/// What to change where the log is already the run that separates two effects best.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Repeated {
    /// The stand, as described; the run is the same.
    ChangeOfStand(&'static str),
    /// The run.
    OtherRun,
}

/// Purpose of an experiment. Effects are identifiers of cards where not stated otherwise.
#[derive(Debug, Clone, PartialEq)]
pub enum Purpose {
    /// Distinguish two effects.
    Distinguish {
        /// Name of the effect in the model.
        effect: String,
        /// Name of its rival in the model.
        rival: String,
        /// How they differ; `None`: the experiments of both cards are proposed.
        difference: Option<&'static str>,
        /// The log is such a run already, and does not separate the two.
        repeated: Option<Repeated>,
    },
    /// Rotate in both directions.
    BothDirections,
    /// Determine an effect better.
    Determine {
        /// The effect.
        effect: &'static str,
    },
    /// Determine which part of the remainder is reproducible.
    Repeat,
    /// Rotate slowly through whole turns.
    SlowTurns,
}

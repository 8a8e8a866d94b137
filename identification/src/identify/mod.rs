//! Identification: fit a model to a log, test where its residual has structure, find the missing effect.

pub mod constants;
pub mod defects;
pub mod equation_error;
pub mod evaluation;
pub mod explain;
pub mod explain_logs;
pub mod fit;
pub mod predict;
pub mod recording_conventions;
pub mod repetition;
pub mod residual;
pub mod sensitivities;
pub mod series;

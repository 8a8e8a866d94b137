//! Identification: fit a model to a log, test where its residual has structure, find the missing effect.

pub mod explain;
pub mod fit;
pub mod residual;

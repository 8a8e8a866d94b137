//! Candidates between which the logs do not decide.

use super::candidate::FittedCandidate;

/// Candidates that the logs cannot distinguish.
pub struct Doubt {
    /// The one that was added.
    pub chosen: FittedCandidate,
    /// The others.
    pub rivals: Vec<FittedCandidate>,
}

//! Words for notes on the preparation of a log and for remarks on an evaluation.

use crate::identify::evaluation::EvaluationRemark;
use crate::identify::fit::prepare::PreparationNote;
use crate::log::plausible::ShiftedConstant;

/// A preparation note as a sentence.
pub fn note(note: &PreparationNote) -> String {
    match note {
        PreparationNote::NotVisibleAtTerminals { effect } => {
            format!("u_V was measured at the motor terminals, behind the bridge: {effect} is not visible in this log.")
        }
    }
}

/// A question about a constant that a fit shifts by a decade or more, as sentences.
pub fn constant(shifted: &ShiftedConstant) -> String {
    format!(
        "By a fit {}. A physical constant is known better than to a factor of ten: check the units of the log's columns and the start value.",
        super::defects::shifted_constant(shifted)
    )
}

/// A remark on an evaluation as a sentence.
pub fn remark(remark: &EvaluationRemark) -> String {
    match remark {
        EvaluationRemark::Preparation(n) => note(n),
        EvaluationRemark::AssumedRateSource { from_encoder } => {
            let source = if *from_encoder { "derived from the encoder" } else { "from a separate sensor" };
            format!("The log does not state the source of omega_rad_s. The fit is better for a rate {source}, which is assumed.")
        }
        EvaluationRemark::ShiftedConstant(shifted) => constant(shifted),
    }
}

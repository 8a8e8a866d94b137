//! A calibration of a unit turned by hand, as text and JSON.

use super::{basis, coverage_text, footnote, meaning_with_standard, with_expanded_u};
use crate::calibrate::Quantity;
use crate::calibrate::stored_record::quantities_json;
use serde_json::Value;

/// One line for each quantity.
pub fn by_hand_text(quantities: &[Quantity]) -> String {
    let width = quantities.iter().map(|q| q.name.len()).max().unwrap_or(0);
    let line = |q: &Quantity| format!("  {:<width$}  {}  ({})\n", q.name, with_expanded_u(q), coverage_text(q));
    quantities.iter().map(line).collect::<String>() + &footnote() + "\n"
}

/// The quantities with their budgets.
pub fn by_hand_json(quantities: &[Quantity]) -> Value {
    quantities_json(&quantities.iter().map(|q| q.map_texts(basis, meaning_with_standard)).collect::<Vec<_>>())
}

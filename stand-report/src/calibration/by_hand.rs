//! A calibration of a unit turned by hand, as text and JSON.

use super::{basis, coverage_text, footnote, meaning_with_standard, with_expanded_u};
use serde_json::Value;
use stand_analysis::calibrate::Quantity;
use stand_records::stored_record::quantities_json;

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

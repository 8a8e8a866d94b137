//! Many logs: the row of one log in the table, and the evaluation of a fleet as text, JSON and HTML.
//!
//! In: an explanation or why there is none; a [`FleetEvaluation`](stand_analysis::fleet::evaluation::FleetEvaluation). Out: a
//! [`Row`](stand_analysis::fleet::Row), text.

mod html;
mod json;
mod row;
mod text;
mod words;

pub use html::html;
pub(crate) use json::schemas;
pub use json::{json, run_json};
pub use row::{RowRequest, row};
pub use text::{run_text, text};

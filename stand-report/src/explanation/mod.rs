//! An explanation, which names the effects that a model lacks, as text, HTML and JSON.
//!
//! In: an [`Explanation`](identification::identify::explain::Explanation). Out: text; nothing is printed or written here.

pub mod coverage;
mod evidence;
mod folder;
mod html;
mod json;
mod names;
mod plots;
pub mod sentences;
mod text;
pub mod words;

pub use evidence::{Outcome, STRENGTHS};
pub use folder::{folder_json, folder_text, folder_verdict};
pub use html::explain_html;
pub(crate) use json::schemas;
pub use json::{explain_bad_log_json, explain_json};
pub use text::explain_text;

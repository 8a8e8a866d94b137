//! An explanation (which effect the model lacks) as text, HTML and JSON.

pub mod coverage;
mod evidence;
mod folder;
mod html;
mod json;
mod plots;
pub mod sentences;
mod text;
pub mod words;

pub use folder::{folder_json, folder_text, folder_verdict};
pub use html::explain_html;
pub use json::{explain_bad_log_json, explain_json};
pub use text::explain_text;

//! Results of the drift measurement: text for a terminal, HTML pages, JSON.

mod display;
mod html;
mod json;
mod text;
mod words;

pub use html::{advice_html, html, platform_html};
pub(crate) use json::schemas;
pub use json::{advice_json, json, platform_json};
pub use text::{advice_text, platform_text, text};
pub use words::{NoteKind, SetupPartKind, error_text};

use words::{defect, source, warning};

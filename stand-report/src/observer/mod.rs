//! Observers as text, JSON and HTML.

mod html;
mod json;
mod text;
pub(crate) mod track;
mod words;

pub use html::{bode_html, design_html, simulate_html, vibration_html};
pub(crate) use json::schemas;
pub use json::{bode_json, design_json, simulate_json, vibration_json};
pub use text::{bode_text, design_text, simulate_text, transfer_text, vibration_text};
pub use track::{track_json, track_text};
pub use words::warning;

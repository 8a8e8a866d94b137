//! Allan analysis as text, JSON and HTML.

mod curve;
mod html;
mod json;
mod text;
mod words;

pub use html::html;
pub use json::json;
pub use text::text;

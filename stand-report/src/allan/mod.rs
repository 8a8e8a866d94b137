//! Allan analysis as text, JSON and HTML.

mod curve;
mod display;
mod html;
mod json;
mod text;
mod words;

pub use display::Display;
pub use html::html;
pub(crate) use json::schemas;
pub use json::{ReasonKind, json};
pub use text::text;
pub use words::NoteKind;

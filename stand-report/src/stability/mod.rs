//! Rate stability as text, JSON and HTML.

mod html;
mod json;
mod text;
mod words;

pub use html::html;
pub use json::json;
pub(crate) use json::schemas;
pub use text::text;

//! The frame of every HTML file: one file, style inside, nothing fetched, well-formed as XML too.

/// A page under way.
pub struct Page {
    text: String,
}

const STYLE: &str = include_str!("html.css");

impl Page {
    /// A page with its heading.
    pub fn new(title: &str) -> Self {
        let title = escaped(title);
        Page {
            text: format!(
                "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n"
            ),
        }
    }

    /// Adds markup, which must be well-formed.
    pub fn push(&mut self, markup: &str) {
        self.text.push_str(markup);
        self.text.push('\n');
    }

    /// A paragraph of plain text.
    pub fn paragraph(&mut self, class: &str, text: &str) {
        self.push(&format!("<p class=\"{class}\">{}</p>", escaped(text)));
    }

    /// A drawing with its caption; `caption` is markup.
    pub fn figure(&mut self, svg: &str, caption: &str) {
        self.push(&format!("<figure>\n{svg}<figcaption>{caption}</figcaption>\n</figure>"));
    }

    /// The file.
    pub fn finish(mut self) -> String {
        self.text.push_str("</main>\n</body>\n</html>\n");
        self.text
    }
}

pub use super::html::escaped;

/// Plain text as markup, with what stands between backticks as code.
pub fn with_code(text: &str) -> String {
    let mut markup = String::new();
    for (k, part) in escaped(text).split('`').enumerate() {
        if k % 2 == 1 { markup.push_str(&format!("<code>{part}</code>")) } else { markup.push_str(part) }
    }
    markup
}

/// A swatch of a class's colour before its word, for captions.
pub fn swatch(class: &str, word: &str) -> String {
    format!("<span class=\"swatch {class}\"></span>{}", escaped(word))
}

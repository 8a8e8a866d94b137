//! Escaping of text for HTML and SVG.

/// Text as markup. Characters that XML cannot contain become a blank.
pub fn escaped(text: &str) -> String {
    let mut markup = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => markup.push_str("&amp;"),
            '<' => markup.push_str("&lt;"),
            '>' => markup.push_str("&gt;"),
            '"' => markup.push_str("&quot;"),
            '\t' | '\n' => markup.push(c),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => markup.push(' '),
            c => markup.push(c),
        }
    }
    markup
}

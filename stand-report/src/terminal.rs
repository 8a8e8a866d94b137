//! Plain text for a terminal: line width, emphasis, sparklines.

/// Style of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Style {
    /// Escape sequences for colour and weight.
    pub colour: bool,
    /// Columns of the terminal.
    pub width: usize,
}

impl Default for Style {
    fn default() -> Self {
        Style { colour: false, width: 80 }
    }
}

impl Style {
    /// Bold: titles and results.
    pub fn strong(self, text: &str) -> String {
        self.paint("1", text)
    }

    /// Faint: details.
    pub fn faint(self, text: &str) -> String {
        self.paint("2", text)
    }

    /// In the colour of a warning.
    pub fn warn(self, text: &str) -> String {
        self.paint("33", text)
    }

    /// In the colour of a good result.
    pub fn good(self, text: &str) -> String {
        self.paint("32", text)
    }

    fn paint(self, code: &str, text: &str) -> String {
        if self.colour { format!("\u{1b}[{code}m{text}\u{1b}[0m") } else { text.to_owned() }
    }

    /// Breaks `text` at words into lines, the first after `first`, the others after `rest`.
    pub fn wrapped(self, first: &str, rest: &str, text: &str) -> String {
        let mut lines = vec![first.to_owned()];
        let mut has_word = false;
        for word in text.split_whitespace() {
            let line = lines.last().map_or(0, |l| l.chars().count());
            if has_word && line + 1 + word.chars().count() > self.width {
                lines.push(format!("{rest}{word}"));
            } else if let Some(line) = lines.last_mut() {
                if has_word {
                    line.push(' ');
                }
                line.push_str(word);
            }
            has_word = true;
        }
        lines.join("\n") + "\n"
    }
}

/// A sparkline: blocks of eight heights for values from 0 to `most`; a space for a missing value.
pub fn sparkline(values: &[Option<f64>], most: f64) -> String {
    const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let block = |v: f64| {
        // A share that is no number (infinite residuals) is drawn as nothing.
        let height = if most > 0.0 { (v / most * 8.0).ceil() as usize } else { 1 };
        BLOCKS.get(height.clamp(1, 8) - 1).copied().unwrap_or('█')
    };
    values.iter().map(|v| v.map_or(' ', block)).collect()
}

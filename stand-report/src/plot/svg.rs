//! The SVG elements that plots are made of.
//!
//! No plotting crate is used: `plotters` gives each shape a fixed colour, while these shapes have a class, so that one style sheet serves
//! light and dark screens and paper. A trace of 3000 points is one path, in tenths of a pixel.

use std::fmt::Write as _;

use crate::escape::escaped;

/// A finished drawing.
#[derive(Debug, Clone)]
pub struct Drawing(String);

impl Drawing {
    /// The SVG element as text.
    pub fn svg(&self) -> &str {
        &self.0
    }
}

/// A drawing under construction.
pub struct Svg {
    text: String,
}

/// Alignment of a text at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The text begins there.
    Start,
    /// The text is centred there.
    Middle,
    /// The text ends there.
    End,
}

impl Svg {
    /// An empty drawing of `width` by `height` px; `description` is its alternative text.
    pub fn new(width: f64, height: f64, description: &str) -> Self {
        let description = escaped(description);
        Svg {
            text: format!("<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{description}\"><title>{description}</title>\n"),
        }
    }

    /// A filled rectangle.
    pub fn rect(&mut self, x: f64, y: f64, width: f64, height: f64, class: &str) {
        let _ = writeln!(self.text, "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" class=\"{class}\"/>");
    }

    /// A straight line.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), class: &str) {
        let _ = writeln!(
            self.text,
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" class=\"{class}\"/>",
            from.0, from.1, to.0, to.1
        );
    }

    /// A line with gaps, as one path.
    pub fn path<'a>(&mut self, pieces: impl Iterator<Item = &'a [(f64, f64)]>, class: &str) {
        let mut d = String::new();
        for piece in pieces {
            for (k, (x, y)) in piece.iter().enumerate() {
                let _ = write!(d, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
            }
            if piece.len() == 1 {
                d.push_str("h0.1");
            }
        }
        if !d.is_empty() {
            let _ = writeln!(self.text, "<path d=\"{d}\" class=\"{class}\"/>");
        }
    }

    /// A filled circle.
    pub fn dot(&mut self, at: (f64, f64), radius: f64, class: &str) {
        let _ = writeln!(self.text, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" class=\"{class}\"/>", at.0, at.1);
    }

    /// A line of text.
    pub fn text(&mut self, at: (f64, f64), anchor: Anchor, class: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let text = escaped(text);
        let _ = writeln!(self.text, "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" class=\"{class}\">{text}</text>", at.0, at.1);
    }

    /// The finished drawing.
    pub fn finish(mut self) -> Drawing {
        self.text.push_str("</svg>\n");
        Drawing(self.text)
    }
}

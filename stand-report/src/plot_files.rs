//! The plots of an HTML report as files of their own, SVG and PNG, for a paper or a slide: light colours, the caption with its legend
//! below.

use std::fmt::Write as _;

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg;
use roxmltree::Node;

use super::escape::escaped;
use super::html::STYLE;

/// Height of a line of the caption, and of its text, px.
const LINE_PX: f64 = 16.0;
const TEXT_PX: f64 = 11.5;
/// Mean width of a character of that text, px.
const CHARACTER_PX: f64 = 6.7;
/// Width of a sample of a colour with the space behind it, px.
const SWATCH_PX: f64 = 24.0;
/// Margin on both sides of the caption, px.
const MARGIN_PX: f64 = 8.0;
/// Fonts for the numbers of the axes, the first that exists.
const SANS_SERIF: [&str; 6] = ["DejaVu Sans", "Noto Sans", "Liberation Sans", "Arial", "Helvetica", "Segoe UI"];
/// Pixels of the PNG for each unit of the drawing.
const PNG_SCALE: f32 = 2.0;

/// A plot as a file.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotFile {
    /// Name without ending: its number on the page, and its title.
    pub name: String,
    /// The file.
    pub svg: String,
    /// Width and height, px.
    size: (f64, f64),
}

/// Why a plot cannot be a PNG.
#[derive(Debug, thiserror::Error)]
pub enum PngError {
    /// Without a font the axes have no numbers.
    #[error("PNG needs a font, and this computer has none (on Debian: apt install fonts-dejavu-core)")]
    NoFont,
    /// The plot cannot be drawn.
    #[error("{0}")]
    Drawing(String),
}

/// The plots of a page that [`super::html::Page`] has made, in its order.
pub fn plots_of(page: &str) -> Vec<PlotFile> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let Ok(document) = roxmltree::Document::parse_with_options(page, options) else { return Vec::new() };
    let style = style();
    let figures = document.descendants().filter(|node| node.has_tag_name("figure"));
    figures.enumerate().filter_map(|(k, figure)| plot(page, figure, k + 1, &style)).collect()
}

fn plot(page: &str, figure: Node<'_, '_>, number: usize, style: &str) -> Option<PlotFile> {
    let svg = figure.children().find(|node| node.has_tag_name("svg"))?;
    let numbers: Vec<f64> = svg.attribute("viewBox")?.split(' ').filter_map(|number| number.parse().ok()).collect();
    let [_, _, width, height] = numbers[..] else { return None };
    let title = svg.children().find(|node| node.has_tag_name("title")).and_then(|node| node.text()).unwrap_or("plot");
    let drawing = page[svg.range()].split_once('>')?.1.strip_suffix("</svg>")?;
    let caption = figure.children().find(|node| node.has_tag_name("figcaption"));
    let (caption, lines) = caption.map_or_else(|| (String::new(), 0), |node| caption_svg(node, width, height));
    let height = height + LINE_PX * lines as f64;
    let mut text =
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" ");
    text += "font-family=\"'DejaVu Sans', 'Segoe UI', Arial, sans-serif\">\n";
    let _ = write!(
        text,
        "<style>\n{style}</style>\n<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n{drawing}{caption}</svg>\n"
    );
    Some(PlotFile { name: format!("{number:02}-{}", file_name(title)), svg: text, size: (width, height) })
}

/// The caption below a drawing of this height, and the number of its lines. Lines are broken by the mean width of a character.
fn caption_svg(caption: Node<'_, '_>, width: f64, height: f64) -> (String, usize) {
    let baseline = |lines: usize| height + LINE_PX * lines as f64 - 4.0;
    let (mut x, mut lines) = (MARGIN_PX, 1_usize);
    // Samples of colours as (class, x, line), and texts as (text, x, line).
    let (mut swatches, mut texts) = (Vec::new(), Vec::<(String, f64, usize)>::new());
    let mut continues = false;
    for node in caption.descendants() {
        if let Some(class) = node.attribute("class").and_then(|class| class.strip_prefix("swatch ")) {
            if x + SWATCH_PX > width - MARGIN_PX {
                (x, lines) = (MARGIN_PX, lines + 1);
            }
            swatches.push((class, x, lines));
            x += SWATCH_PX;
            continues = false;
        }
        for word in node.text().filter(|_| node.is_text()).unwrap_or_default().split_whitespace() {
            let word_px = CHARACTER_PX * (word.chars().count() + 1) as f64;
            if x > MARGIN_PX && x + word_px > width - MARGIN_PX {
                (x, lines, continues) = (MARGIN_PX, lines + 1, false);
            }
            match texts.last_mut().filter(|_| continues) {
                Some((text, ..)) => *text += &format!(" {word}"),
                None => texts.push((word.to_owned(), x, lines)),
            }
            x += word_px;
            continues = true;
        }
    }
    let mut svg = String::new();
    for (class, x, line) in swatches {
        let (y, class) = (baseline(line) - 6.0, escaped(class));
        let _ = writeln!(svg, "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"18\" height=\"4\" class=\"swatch-{class}\"/>");
    }
    for (text, x, line) in texts {
        let (y, text) = (baseline(line), escaped(&text));
        let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" style=\"font-size:{TEXT_PX}px\">{text}</text>");
    }
    (svg, lines)
}

/// Letters and digits of a title, the rest as single dashes.
fn file_name(title: &str) -> String {
    let mut name = String::new();
    for character in title.chars() {
        match character {
            _ if name.len() >= 60 => break,
            c if c.is_ascii_alphanumeric() => name.push(c.to_ascii_lowercase()),
            'ω' => name.push_str("rate"),
            'θ' => name.push_str("angle"),
            _ if !name.is_empty() && !name.ends_with('-') => name.push('-'),
            _ => {}
        }
    }
    name.trim_end_matches('-').to_owned()
}

/// The rules of the pages' style sheet that concern drawings, with the colours of light pages in place of its variables.
fn style() -> String {
    let colours: Vec<(&str, &str)> = STYLE
        .split_once('}')
        .map_or("", |(first, _)| first)
        .split(';')
        .filter_map(|entry| entry.trim().trim_start_matches(":root {").trim().strip_prefix("--")?.split_once(':'))
        .collect();
    let mut rules = String::new();
    for line in STYLE.lines().map(str::trim) {
        if line.starts_with("svg ") && !line.starts_with("svg {") {
            rules += line;
            rules.push('\n');
        }
        // Samples of colours are boxes on a page and rectangles here.
        for rule in line.split_inclusive('}').map(str::trim).filter_map(|rule| rule.strip_prefix(".swatch.")) {
            rules +=
                &format!(".swatch-{rule}\n").replace("background:", "fill:").replace("height: .9em;", "").replace("height: .45em;", "");
        }
    }
    colours.iter().fold(rules, |rules, (name, colour)| rules.replace(&format!("var(--{name})"), colour.trim()))
}

/// Draws plots as PNG files; the fonts of the computer are read once.
pub struct PngWriter(usvg::Options<'static>);

impl PngWriter {
    /// Reads the fonts.
    ///
    /// # Errors
    /// There is none.
    pub fn new() -> Result<Self, PngError> {
        let mut options = usvg::Options::default();
        options.fontdb_mut().load_system_fonts();
        // The generic family is one that exists.
        let families = options.fontdb.faces().flat_map(|face| face.families.iter().map(|(name, _)| name.clone())).collect::<Vec<_>>();
        let known = SANS_SERIF.into_iter().find(|known| families.iter().any(|family| family == known)).map(str::to_owned);
        let family = known.or_else(|| families.into_iter().next()).ok_or(PngError::NoFont)?;
        options.fontdb_mut().set_sans_serif_family(family);
        Ok(Self(options))
    }

    /// The plot as a PNG file.
    ///
    /// # Errors
    /// The drawing is too large for the memory.
    pub fn png(&self, plot: &PlotFile) -> Result<Vec<u8>, PngError> {
        let failed = |error: &dyn std::fmt::Display| PngError::Drawing(format!("{}: {error}", plot.name));
        let tree = usvg::Tree::from_str(&plot.svg, &self.0).map_err(|error| failed(&error))?;
        let pixels = |length: f64| (length as f32 * PNG_SCALE).ceil() as u32;
        let mut pixmap = Pixmap::new(pixels(plot.size.0), pixels(plot.size.1)).ok_or_else(|| failed(&"the plot is too large"))?;
        resvg::render(&tree, Transform::from_scale(PNG_SCALE, PNG_SCALE), &mut pixmap.as_mut());
        pixmap.encode_png().map_err(|error| failed(&error))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::html::{Markup, Page};
    use crate::plot::svg::Svg;

    fn page() -> String {
        let mut svg = Svg::new(400.0, 100.0, "rate ω, rad/s over time <s>");
        svg.rect(10.0, 10.0, 50.0, 20.0, "band");
        svg.path([&[(0.0, 0.0), (400.0, 100.0)][..]].into_iter(), "measured");
        let mut page = Page::new("title");
        let caption = Markup::swatch("measured", "measured & ").then(Markup::swatch("held", "held out of the fit ".repeat(8).as_str()));
        page.section("part", |page| page.figure(&svg.finish(), caption));
        page.finish()
    }

    #[test]
    fn plot_stands_alone_with_its_caption_in_light_colours() {
        let plots = plots_of(&page());
        let [plot] = &plots[..] else { panic!("{plots:?}") };
        assert_eq!(plot.name, "01-rate-rate-rad-s-over-time-s");
        let document = roxmltree::Document::parse(&plot.svg).unwrap();
        assert!(!plot.svg.contains("var(") && plot.svg.contains("svg path.measured { stroke: #9aa4af;"), "{}", plot.svg);
        assert!(plot.svg.contains(".swatch-held { fill: #7a5cc7; opacity: .25;"), "{}", plot.svg);
        let lines: std::collections::BTreeSet<_> =
            document.descendants().filter(|n| n.has_tag_name("text")).map(|n| n.attribute("y").unwrap().to_owned()).collect();
        assert!(lines.len() >= 3 && plot.size.1 == 100.0 + LINE_PX * lines.len() as f64, "{lines:?} {:?}", plot.size);
    }

    #[test]
    #[ignore = "needs fonts; .ci/run installs them"]
    fn png_has_fonts_and_shows_the_drawing() {
        let plots = plots_of(&page());
        let png = PngWriter::new().unwrap().png(&plots[0]).unwrap();
        let pixmap = Pixmap::decode_png(&png).unwrap();
        assert_eq!((pixmap.width(), pixmap.height()), (800, (plots[0].size.1 * 2.0) as u32));
        let colour = |x: u32, y: u32| pixmap.pixel(x, y).map(|p| (p.red(), p.green(), p.blue())).unwrap();
        assert_eq!(colour(790, 10), (255, 255, 255));
        assert!(colour(400, 100) != (255, 255, 255) && colour(60, 40) != (255, 255, 255));
        // Dark pixels of the caption's letters.
        let below = (0..800).flat_map(|x| (200..pixmap.height()).map(move |y| (x, y)));
        assert!(below.filter(|(x, y)| colour(*x, *y).0 < 90).count() > 300);
    }
}

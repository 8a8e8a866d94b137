//! A typed builder of HTML pages: text is escaped where it enters, elements close themselves.
//!
//! In: text, [`Markup`], [`Table`]s and [`Drawing`]s. Out: one self-contained file with its style sheet inside, also well-formed XML.
//!
//! ```
//! use stand_report::html::{Cell, Class, Page, Table};
//! let mut page = Page::new("Comparison of run.csv with model drive.toml");
//! page.paragraph(Class::Lead, "The rate residual is 3 × the noise.");
//! page.section("Parameters", |page| {
//!     let mut table = Table::new(["parameter", "value ± 1σ"]);
//!     table.row([Cell::code("inertia_kg_m2"), Cell::number("(2.50 ± 0.01) × 10⁻⁴")]);
//!     page.table(table);
//! });
//! assert!(page.finish().ends_with("</html>\n"));
//! ```

use super::escape::escaped;
use super::plot::svg::Drawing;

/// Style sheet of all pages.
pub(super) const STYLE: &str = include_str!("html.css");
/// Zooms the plots.
const ZOOM: &str = include_str!("zoom.js");
/// Number of sections from which a page has a list of contents.
const MIN_LISTED_SECTIONS: usize = 4;

/// Look of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// The summary at the top of a page: larger.
    Lead,
    /// Secondary text: grey.
    Faint,
    /// A warning, or a value out of its limits.
    Warning,
    /// A value within its limits.
    Good,
    /// A remark in a table: grey.
    Mark,
    /// A formula.
    Equation,
    /// Small monospaced text.
    Notes,
    /// A warning that is printed at the top of every page.
    EveryPage,
}

impl Class {
    fn name(self) -> &'static str {
        match self {
            Class::Lead => "lead",
            Class::Faint => "faint",
            Class::Warning => "warn",
            Class::Good => "good",
            Class::Mark => "mark",
            Class::Equation => "equation",
            Class::Notes => "notes",
            Class::EveryPage => "warn every-page",
        }
    }
}

/// Well-formed HTML within a paragraph or a cell. Conversion from text escapes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Markup(String);

impl From<&str> for Markup {
    fn from(text: &str) -> Self {
        Markup(escaped(text))
    }
}

impl From<&String> for Markup {
    fn from(text: &String) -> Self {
        Markup(escaped(text))
    }
}

impl From<String> for Markup {
    fn from(text: String) -> Self {
        Markup(escaped(&text))
    }
}

impl Markup {
    /// Text in a fixed-width font.
    pub fn code(text: &str) -> Markup {
        Markup(format!("<code>{}</code>", escaped(text)))
    }

    /// Text; parts between backticks are set in a fixed-width font.
    pub fn with_code(text: &str) -> Markup {
        let parts = text.split('`').enumerate();
        parts.fold(Markup::default(), |all, (k, part)| all.then(if k % 2 == 1 { Markup::code(part) } else { part.into() }))
    }

    /// Text of a certain look.
    pub fn span(class: Class, content: impl Into<Markup>) -> Markup {
        Markup(format!("<span class=\"{}\">{}</span>", class.name(), content.into().0))
    }

    /// A label in a caption, after a sample of the colour that the style sheet gives to the plots' class `class`.
    pub fn swatch(class: &'static str, label: &str) -> Markup {
        Markup(format!("<span class=\"swatch {class}\"></span>{}", escaped(label)))
    }

    /// `self` followed by `more`.
    pub fn then(mut self, more: impl Into<Markup>) -> Markup {
        self.0.push_str(&more.into().0);
        self
    }

    /// `self` followed by `more` on a new line.
    pub fn then_line(mut self, more: impl Into<Markup>) -> Markup {
        self.0.push_str("<br/>");
        self.then(more)
    }

    /// All `parts` with `separator` between them.
    pub fn joined(parts: impl IntoIterator<Item = Markup>, separator: &str) -> Markup {
        let mut all = Markup::default();
        for (k, part) in parts.into_iter().enumerate() {
            all = if k == 0 { part } else { all.then(separator).then(part) };
        }
        all
    }
}

/// One cell of a table.
#[derive(Debug, Clone)]
pub struct Cell {
    content: Markup,
    class: Option<&'static str>,
}

impl Cell {
    /// Text.
    pub fn text(content: impl Into<Markup>) -> Cell {
        Cell { content: content.into(), class: None }
    }

    /// A number, or a short text that is not broken into lines.
    pub fn number(content: impl Into<Markup>) -> Cell {
        Cell { content: content.into(), class: Some("number") }
    }

    /// A name in a fixed-width font.
    pub fn code(text: &str) -> Cell {
        Cell::number(Markup::code(text))
    }

    /// The cell with another look.
    pub fn class(self, class: Class) -> Cell {
        Cell { class: Some(class.name()), ..self }
    }
}

/// A table with a head.
#[derive(Debug, Clone)]
pub struct Table {
    text: String,
}

impl Table {
    /// An empty table with the given column heads; no head where there are none.
    pub fn new<H: Into<Markup>>(heads: impl IntoIterator<Item = H>) -> Table {
        let heads: String = heads.into_iter().map(|head| format!("<th>{}</th>", head.into().0)).collect();
        let head = if heads.is_empty() { String::new() } else { format!("<thead><tr>{heads}</tr></thead>") };
        Table { text: format!("<div class=\"scroll\"><table>{head}<tbody>\n") }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.add_row("", cells);
    }

    /// Adds a row of a certain look.
    pub fn row_of(&mut self, class: Class, cells: impl IntoIterator<Item = Cell>) {
        self.add_row(&format!(" class=\"{}\"", class.name()), cells);
    }

    fn add_row(&mut self, attribute: &str, cells: impl IntoIterator<Item = Cell>) {
        self.text.push_str(&format!("<tr{attribute}>"));
        for cell in cells {
            let class = cell.class.map_or(String::new(), |class| format!(" class=\"{class}\""));
            self.text.push_str(&format!("<td{class}>{}</td>", cell.content.0));
        }
        self.text.push_str("</tr>\n");
    }
}

/// A page under construction.
pub struct Page {
    text: String,
    /// Headings of the sections.
    headings: Vec<Markup>,
    /// Position in the text at which the first section begins.
    first_section: usize,
}

impl Page {
    /// A page with its title as the main heading.
    pub fn new(title: &str) -> Page {
        let title = escaped(title);
        Page {
            headings: Vec::new(),
            first_section: 0,
            text: format!(
                "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n"
            ),
        }
    }

    fn push(&mut self, markup: &str) {
        self.text.push_str(markup);
        self.text.push('\n');
    }

    /// A section with a heading; `content` fills it.
    pub fn section(&mut self, heading: impl Into<Markup>, content: impl FnOnce(&mut Page)) {
        let heading = heading.into();
        if self.headings.is_empty() {
            self.first_section = self.text.len();
        }
        self.headings.push(heading.clone());
        self.push(&format!("<section id=\"section-{}\"><h2>{}</h2>", self.headings.len(), heading.0));
        content(self);
        self.push("</section>");
    }

    /// Figures side by side, where the page is wide enough; `content` adds them.
    pub fn side_by_side(&mut self, content: impl FnOnce(&mut Page)) {
        self.push("<div class=\"pair\">");
        content(self);
        self.push("</div>");
    }

    /// A heading within a section.
    pub fn heading(&mut self, heading: impl Into<Markup>) {
        self.push(&format!("<h3>{}</h3>", heading.into().0));
    }

    /// A paragraph.
    pub fn text(&mut self, content: impl Into<Markup>) {
        self.push(&format!("<p>{}</p>", content.into().0));
    }

    /// A paragraph of a certain look.
    pub fn paragraph(&mut self, class: Class, content: impl Into<Markup>) {
        self.push(&format!("<p class=\"{}\">{}</p>", class.name(), content.into().0));
    }

    /// A bulleted list; nothing where there are no items.
    pub fn list<I: Into<Markup>>(&mut self, items: impl IntoIterator<Item = I>) {
        let items: String = items.into_iter().map(|item| format!("<li>{}</li>", item.into().0)).collect();
        if !items.is_empty() {
            self.push(&format!("<ul>{items}</ul>"));
        }
    }

    /// Terms with their explanations.
    pub fn definitions<T: Into<Markup>, D: Into<Markup>>(&mut self, entries: impl IntoIterator<Item = (T, D)>) {
        let entries = entries.into_iter().map(|(term, text)| format!("<dt>{}</dt><dd>{}</dd>\n", term.into().0, text.into().0));
        let entries: String = entries.collect();
        self.push(&format!("<dl>{entries}</dl>"));
    }

    /// A paragraph that opens on a click on `summary`.
    pub fn details(&mut self, summary: &str, class: Class, content: impl Into<Markup>) {
        let (summary, content) = (escaped(summary), content.into().0);
        self.push(&format!("<details><summary class=\"faint\">{summary}</summary><p class=\"{}\">{content}</p></details>", class.name()));
    }

    /// Text with its own line breaks, in a fixed-width font.
    pub fn preformatted(&mut self, text: &str) {
        self.push(&format!("<pre class=\"notes\">{}</pre>", escaped(text)));
    }

    /// Lines to be copied: a command, or part of a model file.
    pub fn command(&mut self, text: &str) {
        self.push(&format!("<pre class=\"command\">{}</pre>", escaped(text)));
    }

    /// A drawing with its caption; an empty caption is left out.
    pub fn figure(&mut self, drawing: &Drawing, caption: impl Into<Markup>) {
        let caption = caption.into();
        let caption = if caption == Markup::default() { String::new() } else { format!("<figcaption>{}</figcaption>", caption.0) };
        self.push(&format!("<figure>\n{}{caption}\n</figure>", drawing.svg()));
    }

    /// A table.
    pub fn table(&mut self, table: Table) {
        self.push(&table.text);
        self.push("</tbody></table></div>");
    }

    /// The file.
    pub fn finish(mut self) -> String {
        if self.headings.len() >= MIN_LISTED_SECTIONS {
            let item = |(k, heading): (usize, &Markup)| format!("<li><a href=\"#section-{}\">{}</a></li>", k + 1, heading.0);
            let items: String = self.headings.iter().enumerate().map(item).collect();
            self.text.insert_str(self.first_section, &format!("<nav aria-label=\"Contents\"><ul>{items}</ul></nav>\n"));
        }
        if self.text.contains("<svg") {
            self.paragraph(
                Class::Faint,
                "Plots: click one, then zoom with the wheel or + and −, move by dragging or with the arrow keys; a double click shows the whole.",
            );
            self.push(&format!("<script>\n{ZOOM}</script>"));
        }
        self.text.push_str("</main>\n</body>\n</html>\n");
        self.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_page_has_a_list_of_its_sections() {
        let page = |count: usize| {
            let mut page = Page::new("title");
            page.paragraph(Class::Lead, "summary");
            (0..count).for_each(|k| page.section(format!("part {k}"), |page| page.text("text")));
            page.finish()
        };
        assert!(!page(3).contains("<nav"));
        let long = page(4);
        let contents = long.find("<li><a href=\"#section-4\">part 3</a></li>").unwrap();
        assert!(long.find("summary").unwrap() < contents && contents < long.find("<section id=\"section-1\">").unwrap());
    }

    #[test]
    fn text_is_escaped_wherever_it_enters() {
        let nasty = "<b> & \"x\"\u{1}";
        let mut page = Page::new(nasty);
        page.paragraph(Class::Lead, nasty);
        page.section(nasty, |page| {
            page.heading(nasty);
            page.list([nasty]);
            page.definitions([(nasty, nasty)]);
            page.details(nasty, Class::Notes, nasty);
            page.preformatted(nasty);
            page.command(nasty);
            page.text(Markup::with_code("a `b<` c").then(Markup::swatch("measured", nasty)).then_line(Markup::span(Class::Good, nasty)));
            let mut table = Table::new([nasty]);
            table.row([Cell::text(nasty)]);
            table.row_of(Class::Faint, [Cell::code(nasty).class(Class::Warning)]);
            page.table(table);
        });
        let page = page.finish();
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        let document = roxmltree::Document::parse_with_options(&page, options).unwrap();
        assert!(!document.descendants().any(|n| n.has_tag_name("b")));
        assert!(page.contains("a <code>b&lt;</code> c"));
    }
}

//! Allan analysis as an HTML page with its curve.

use super::Display;
use super::curve::curve;
use super::words::{CONDITIONS, density, facts, name, note, standard, title, value};
use crate::html::{Cell, Class, Markup, Page, Table};
use crate::uncertainty::FOOTNOTE;
use crate::{grouped, significant};
use stand_analysis::allan::MAX_RELATIVE_TAU;
use stand_analysis::allan::answer::{Answer, WHITE};
use stand_analysis::allan::units::PROCESSES;

/// Terms of the page.
const GLOSSARY: [(&str, &str); 8] = [
    (
        "Allan deviation",
        "rms difference of adjacent averages over τ, divided by √2: the expected change from one average over τ to the next.",
    ),
    (
        "overlapping",
        "uses all pairs of adjacent averages, starting at every row. Its expectation equals that of the plain deviation, its uncertainty is smaller.",
    ),
    (
        "N",
        "white noise of the rate: after one hour the integrated angle has a standard deviation of N. Data sheets give N or the one-sided density √2 N.",
    ),
    ("B", "flicker noise: the floor that averaging does not reduce. The floor is 0.664 B, with 0.664 = √(2 ln 2/π)."),
    ("K", "random walk of the rate: after one hour the rate has changed by K (standard deviation)."),
    ("R", "constant drift of the rate, often caused by temperature."),
    ("Q", "quantisation or white noise of the angle that the rate is derived from."),
    ("T/10", "averages longer than a tenth of the record are not used: fewer than ten of them are independent."),
];

/// The page.
pub fn html(answer: &Answer, display: &Display) -> String {
    let mut page = Page::new(&format!("Allan deviation of {}, {}", answer.column, answer.log));
    page.paragraph(Class::Lead, title(answer).as_str());
    for found in &answer.notes {
        page.paragraph(Class::Warning, note(found, display).as_str());
    }
    let caption = [
        ("modelled", "overlapping Allan deviation"),
        ("band", "95 % confidence interval"),
        ("residual", "all processes together"),
        ("process", "each process"),
        ("held", "beyond T/10"),
    ];
    page.figure(&curve(answer, display), Markup::joined(caption.map(|(class, label)| Markup::swatch(class, label)), ", "));
    page.section("Coefficients", |page| {
        let mut table = Table::new(["process", "symbol", "value ± U", "slope of σ(τ)", "standard"]);
        for (p, process) in PROCESSES.iter().enumerate() {
            let mut shown = Markup::from(value(answer, display, p).as_str());
            if let (WHITE, Some(density)) = (p, density(answer, display)) {
                shown = shown.then_line(density.as_str());
            }
            let cells = [
                Cell::text(name(answer, process)),
                Cell::text(process.letter),
                Cell::text(shown),
                Cell::text(process.slope),
                Cell::text(standard(p)),
            ];
            match answer.coefficients[p].estimate {
                Some(_) => table.row(cells),
                None => table.row_of(Class::Faint, cells),
            }
        }
        page.table(table);
        page.text(FOOTNOTE);
        page.text(CONDITIONS);
        for line in facts(answer, display) {
            page.text(line.as_str());
        }
    });
    let (scale, unit) = (display.deviation().factor, &display.deviation().unit);
    page.section("Curve", |page| {
        let overlapping = format!("overlapping, {unit}");
        let plain = format!("plain, {unit}");
        let mut table = Table::new(["τ, s", &overlapping, "68 %", "95 %", &plain, "terms", "degrees of freedom", "strongest"]);
        for p in &answer.points {
            let number = |x: f64| significant(x * scale, 4);
            let interval = |range: [f64; 2]| format!("{} … {}", number(range[0]), number(range[1]));
            let numbers = [
                significant(p.tau_s, 4),
                number(p.oadev),
                interval(p.within_68),
                interval(p.within_95),
                number(p.adev),
                grouped(p.terms),
                significant(p.degrees, 3),
            ];
            let cells = numbers.iter().map(|n| Cell::number(n.as_str())).chain([Cell::text(PROCESSES[p.strongest].letter)]);
            if p.tau_s > MAX_RELATIVE_TAU * answer.duration_s() { table.row_of(Class::Faint, cells) } else { table.row(cells) }
        }
        page.table(table);
    });
    page.section("Terms", |page| page.definitions(GLOSSARY));
    page.finish()
}

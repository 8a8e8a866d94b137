//! Where a model fails, in words and as JSON; comparison and explanation share it.

use serde::Serialize;

use super::html::{Cell, Class, Page, Table};
use super::numbers;
use crate::identify::residual::Misfit;

/// Smallest p-value that JSON gives as a number; smaller ones are 0, and `log10_p` has the magnitude.
const MIN_P: f64 = 1e-300;

/// A p-value for JSON.
pub fn p_value(p: f64) -> f64 {
    if p < MIN_P { 0.0 } else { p }
}

/// A failure as one sentence.
pub fn sentence(failure: &Misfit) -> &str {
    &failure.says
}

/// The failures as a list of sentences.
pub fn lines(failures: &[Misfit]) -> Vec<String> {
    failures.iter().map(|f| sentence(f).to_owned()).collect()
}

/// The failures as a section with a table; nothing where there are none.
pub fn section(failures: &[Misfit], page: &mut Page) {
    if failures.is_empty() {
        return;
    }
    page.section("Where the model fails", |page| {
        page.paragraph(
            Class::Faint,
            "Sorted by share of the residual variance, largest first; each share is what the coordinate explains beyond those above it. Listed if p < 0.001 over all channels and coordinates.",
        );
        let mut table = Table::new(["channel", "coordinate", "share of the residual", "harmonic order", "p", ""]);
        for f in failures {
            table.row([
                Cell::text(f.output.column()),
                Cell::text(f.coordinate.name()),
                Cell::number(format!("{} %", numbers::significant(100.0 * f.share, 2))),
                Cell::number(f.order.map_or(String::new(), |n| n.to_string())),
                Cell::number(numbers::p_value(f.log10_p)),
                Cell::text(sentence(f)),
            ]);
        }
        page.table(table);
    });
}

/// A failure in a JSON answer.
#[derive(Serialize)]
pub struct MisfitJson<'a> {
    output: &'static str,
    coordinate: &'static str,
    share: f64,
    order: Option<u32>,
    p_value: f64,
    log10_p: f64,
    says: &'a str,
}

impl<'a> From<&'a Misfit> for MisfitJson<'a> {
    fn from(f: &'a Misfit) -> Self {
        MisfitJson {
            output: f.output.column(),
            coordinate: f.coordinate.name(),
            share: f.share,
            order: f.order,
            p_value: p_value(f.p_value),
            log10_p: f.log10_p,
            says: sentence(f),
        }
    }
}

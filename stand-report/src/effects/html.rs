//! The catalogue as HTML pages.

use drive_model::Card;

use super::plots::plots;
use super::{DOMAINS, description, of_domain, range, simulated_pair, unit};
use crate::digits;
use crate::html::{Cell, Class, Markup, Page, Table};

/// The catalogue by domain.
pub fn list_html() -> String {
    let mut page = Page::new("The physical effects");
    let usage = "Effects that a model of the stand may contain or lack. `stand effects ID --html FILE` plots one; `stand model add MODEL ID` adds it to a model.";
    page.text(Markup::with_code(usage));
    for domain in DOMAINS {
        page.section(domain.title(), |page| {
            let mut table = Table::new(["effect", "", "coordinate"]);
            for card in of_domain(domain) {
                let text = Markup::from(card.description.summary).then_line(Markup::span(Class::Equation, card.equation));
                table.row([Cell::code(card.id), Cell::text(text), Cell::text(card.coordinate.name()).class(Class::Mark)]);
            }
            page.table(table);
        });
    }
    page.finish()
}

/// The page of one effect, with its simulated picture.
pub fn effect_html(card: &'static Card) -> String {
    let mut page = Page::new(card.title);
    page.paragraph(Class::Faint, Markup::code(card.id).then(" · ").then(card.domain.title()));
    page.paragraph(Class::Equation, card.equation);
    page.paragraph(Class::Lead, card.description.summary);
    match simulated_pair(card) {
        Ok(pair) => {
            for (drawing, caption) in plots(card, &pair) {
                page.figure(&drawing, caption);
            }
        }
        Err(error) => page.paragraph(Class::Warning, format!("The effect cannot be simulated: {error}")),
    }
    page.section("Description", |page| page.definitions(description(card)));
    page.section("Parameters", |page| {
        let mut table = Table::new(["name", "meaning", "unit", "physical range", "start value of a fit"]);
        for p in card.parameters {
            table.row([
                Cell::code(p.name),
                Cell::text(p.description),
                Cell::text(unit(p.unit)),
                Cell::number(range(p.range)),
                Cell::number(digits(p.start)),
            ]);
        }
        page.table(table);
    });
    page.text(Markup::with_code(&format!("`stand model add MODEL {}` adds it to a model.", card.id)));
    page.finish()
}

//! A certificate as one HTML page for print, with the fields of ISO/IEC 17025:2017, clause 7.8.

use super::names::name;
use super::{SIMULATED, STATEMENT, conformity, limits, rule};
use crate::calibration::{definition, value_text};
use crate::html::{Cell, Class, Page, Table};
use crate::significant;
use identification::statistics::uncertainty::COVERAGE_PROBABILITY;
use stand_records::certificate::{Certificate, Conformity, Organisation};
use stand_records::stored_record::StoredRecord;

fn organisation(o: &Organisation) -> String {
    let city = format!("{} {}", o.post_code, o.city);
    let parts = [o.name.as_str(), o.street.as_str(), city.trim(), o.country.as_str(), o.email.as_str()];
    parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
}

fn results(record: &StoredRecord) -> Table {
    let mut table = Table::new(["quantity", "value", "U", "k", "unit", "conditions and definition"]);
    for q in &record.quantities {
        table.row([
            Cell::text(name(&q.name, &q.unit)),
            Cell::number(value_text(q)),
            Cell::number(significant(q.expanded_u(), 2)),
            Cell::number(significant(q.coverage_factor(COVERAGE_PROBABILITY), 3)),
            Cell::text(if q.unit == "1" { "" } else { &q.unit }),
            Cell::text(definition(q)),
        ]);
    }
    table
}

/// The page.
pub fn html(certificate: &Certificate) -> String {
    let (d, record) = (&certificate.details, &certificate.record);
    let mut page = Page::new(&format!("{} {}", d.title, d.number));
    page.paragraph(
        Class::Lead,
        format!("{}, {} {}, serial number {}", d.item.description, d.item.manufacturer, certificate.model(), certificate.serial()),
    );
    if record.header.simulated {
        page.paragraph(Class::EveryPage, SIMULATED);
    }
    page.paragraph(Class::Warning, STATEMENT);
    page.section("Certificate", |page| {
        let mut table = Table::new(Vec::<String>::new());
        let mut row = |name: &str, text: String| {
            if !text.is_empty() {
                table.row([Cell::text(name), Cell::text(text)]);
            }
        };
        row("number", d.number.clone());
        row("date of issue", d.issued.to_string());
        row("laboratory", organisation(&d.laboratory));
        row("customer", organisation(&d.customer));
        row(
            "item",
            format!("{}, {} {}, serial number {}", d.item.description, d.item.manufacturer, certificate.model(), certificate.serial()),
        );
        row("condition of the item", d.item.condition.clone());
        row("received", d.received.map_or(String::new(), |date| date.to_string()));
        row("calibrated", format!("{} to {}", record.header.began, certificate.ended));
        row("place", d.place.clone());
        row("method", d.method.clone());
        row("traceability", d.traceability.clone());
        row("clock reference", record.header.crystal.as_ref().map_or(String::new(), |crystal| crystal.reference.clone()));
        row("adjustment", if d.adjustment.what.is_empty() { "none: as found is as left".into() } else { d.adjustment.what.clone() });
        page.table(table);
    });
    page.section("Ambient conditions", |page| {
        let mut table = Table::new(["condition", "lowest", "greatest", "unit"]);
        for a in &d.ambient {
            table.row([
                Cell::text(&a.name),
                Cell::number(significant(a.lowest, 5)),
                Cell::number(significant(a.greatest, 5)),
                Cell::text(&a.unit),
            ]);
        }
        page.table(table);
    });
    page.section("Equipment", |page| {
        let mut table = Table::new(["equipment", "serial number", "certificate", "valid until"]);
        table.row([Cell::text("rotary test stand"), Cell::text(&record.header.stand), Cell::text(""), Cell::text("")]);
        for e in &d.equipment {
            table.row([Cell::text(&e.name), Cell::text(&e.serial), Cell::text(&e.certificate), Cell::text(e.valid_until.to_string())]);
        }
        page.table(table);
    });
    page.section(if certificate.as_found.is_some() { "Results as left" } else { "Results" }, |page| {
        page.text(format!(
            "U is the expanded uncertainty: the standard uncertainty multiplied by the coverage factor k, for a coverage probability of {} % \
             (JCGM 100:2008, JCGM 101:2008).",
            COVERAGE_PROBABILITY * 100.0
        ));
        page.table(results(record));
    });
    if let Some(as_found) = &certificate.as_found {
        page.section("Results as found", |page| page.table(results(as_found)));
    }
    if let Some(decision) = &d.decision {
        page.section("Statement of conformity", |page| {
            page.text(format!("Decision rule: {}.", rule(decision.rule)));
            let mut table = Table::new(["quantity", "limits", "value", "U", "decision"]);
            for (limit, q, decided) in certificate.decisions() {
                let class = match decided {
                    Conformity::Pass => Class::Good,
                    Conformity::Fail | Conformity::Undecided => Class::Warning,
                };
                table.row([
                    Cell::text(name(&q.name, &q.unit)),
                    Cell::number(limits(limit)),
                    Cell::number(value_text(q)),
                    Cell::number(significant(q.expanded_u(), 2)),
                    Cell::text(conformity(decided)).class(class),
                ]);
            }
            page.table(table);
        });
    }
    if !d.remarks.is_empty() || !record.header.remarks.is_empty() {
        page.section("Remarks", |page| page.list(d.remarks.iter().chain(&record.header.remarks).cloned()));
    }
    page.section("Authorised by", |page| {
        page.text(format!("{}, {}", d.signatory.name, d.signatory.function));
        page.text(format!("Date of issue {}. Certificate {}, end.", d.issued, d.number));
    });
    page.finish()
}

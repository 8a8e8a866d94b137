//! A certificate as a Digital Calibration Certificate of PTB, schema 3.3.0, with units and uncertainties of the D-SI 2.2.
//!
//! Input: a certificate. Output: XML. Scalar results have `si:expandedMU`; the frequency response and the characteristic are lists with
//! `si:expandedMUXMLList`. The schema itself is not part of this project; `stand/tests/command/certificate.rs` checks the structure, and
//! the Schematron rules where Python's package `dcclib` is installed.

use super::d_si::d_si;
use super::names::name;
use super::{SIMULATED, STATEMENT, conformity, limits, rule};
use crate::escape::escaped;
use identification::statistics::uncertainty::{COVERAGE_PROBABILITY, Quantity};
use stand_records::certificate::{Certificate, Organisation};
use stand_records::stored_record::{StoredQuantity, StoredRecord};

/// Version of the DCC schema.
const SCHEMA: &str = "3.3.0";
/// Points of the characteristic on each side of rest.
const CHARACTERISTIC_POINTS: i32 = 10;

/// An XML text that grows by elements.
struct Xml(String);

impl Xml {
    fn element(&mut self, name: &str, text: &str) {
        self.0 += &format!("<{name}>{}</{name}>\n", escaped(text));
    }

    fn within(&mut self, name: &str, content: impl FnOnce(&mut Self)) {
        self.within_of(name, "", content);
    }

    fn within_of(&mut self, name: &str, attributes: &str, content: impl FnOnce(&mut Self)) {
        self.0 += &format!("<{name}{attributes}>\n");
        content(self);
        self.0 += &format!("</{name}>\n");
    }

    /// A text in the language of the certificate.
    fn text(&mut self, name: &str, text: &str) {
        self.within(name, |xml| xml.0 += &format!("<dcc:content lang=\"en\">{}</dcc:content>\n", escaped(text)));
    }

    fn organisation(&mut self, name: &str, o: &Organisation) {
        self.within(name, |xml| {
            xml.text("dcc:name", &o.name);
            if !o.email.is_empty() {
                xml.element("dcc:eMail", &o.email);
            }
            xml.within("dcc:location", |xml| {
                xml.element("dcc:city", &o.city);
                xml.element("dcc:countryCode", &o.country);
                for (name, text) in [("dcc:postCode", &o.post_code), ("dcc:street", &o.street)] {
                    if !text.is_empty() {
                        xml.element(name, text);
                    }
                }
            });
        });
    }

    /// `issuer`: `manufacturer`, `calibrationLaboratory`, `customer`, `owner` or `other`, the words of the schema.
    fn identification(&mut self, issuer: &str, value: &str, name: &str) {
        self.within("dcc:identification", |xml| {
            xml.element("dcc:issuer", issuer);
            xml.element("dcc:value", value);
            xml.text("dcc:name", name);
        });
    }
}

/// A number in XML: the shortest text that reads back exactly.
fn number(x: f64) -> String {
    if x.is_finite() { format!("{x:?}") } else { String::new() }
}

fn list(values: impl Iterator<Item = f64>) -> String {
    values.map(number).collect::<Vec<_>>().join(" ")
}

/// The date of a time stamp.
fn date(stamp: &str) -> &str {
    stamp.get(..10).unwrap_or(stamp)
}

fn expanded(xml: &mut Xml, U: f64, k: f64) {
    xml.within("si:measurementUncertaintyUnivariate", |xml| {
        xml.within("si:expandedMU", |xml| {
            xml.element("si:valueExpandedMU", &number(U));
            xml.element("si:coverageFactor", &number(k));
            xml.element("si:coverageProbability", &number(COVERAGE_PROBABILITY));
        });
    });
}

fn quantity(xml: &mut Xml, q: &StoredQuantity) {
    let Some((unit, factor)) = d_si(&q.unit) else { return };
    let attributes = format!(" refType=\"stand_{}\"", escaped(&q.name));
    xml.within("dcc:result", |xml| {
        xml.text("dcc:name", &name(&q.name, &q.unit));
        if let Some(meaning) = q.meaning.as_deref().filter(|m| !m.is_empty()) {
            xml.text("dcc:description", meaning);
        }
        xml.within("dcc:data", |xml| {
            xml.within_of("dcc:quantity", &attributes, |xml| {
                xml.within("si:real", |xml| {
                    xml.element("si:value", &number(q.value * factor));
                    xml.element("si:unit", &unit);
                    if q.expanded_u().is_finite() {
                        expanded(xml, q.expanded_u() * factor, q.coverage_factor(COVERAGE_PROBABILITY));
                    }
                });
                if let Some(t) = q.conditions.temperature {
                    temperature(xml, t.at_C, t.low_C, t.high_C);
                }
            });
        });
    });
}

/// Temperature of the item as an influence condition of one quantity.
fn temperature(xml: &mut Xml, at_C: f64, low_C: f64, high_C: f64) {
    xml.within("dcc:influenceConditions", |xml| {
        condition(xml, "temperature of the item", &format!("{low_C:.2} °C to {high_C:.2} °C"), at_C, r"\degreecelsius");
    });
}

fn condition(xml: &mut Xml, name: &str, description: &str, value: f64, unit: &str) {
    xml.within("dcc:influenceCondition", |xml| {
        xml.text("dcc:name", name);
        xml.text("dcc:description", description);
        xml.within("dcc:data", |xml| {
            xml.within("dcc:quantity", |xml| {
                xml.text("dcc:name", name);
                xml.within("si:real", |xml| {
                    xml.element("si:value", &number(value));
                    xml.element("si:unit", unit);
                });
            });
        });
    });
}

/// One column of a list: name, unit, values, and their expanded uncertainties with coverage factors.
struct Column {
    name: &'static str,
    unit: &'static str,
    values: Vec<f64>,
    uncertainty: Option<(Vec<f64>, Vec<f64>)>,
}

fn table(xml: &mut Xml, name: &str, columns: &[Column]) {
    if columns.first().is_none_or(|c| c.values.is_empty()) {
        return;
    }
    xml.within("dcc:result", |xml| {
        xml.text("dcc:name", name);
        xml.within("dcc:data", |xml| {
            xml.within("dcc:list", |xml| {
                for c in columns {
                    let Some((unit, factor)) = d_si(c.unit) else { continue };
                    xml.within("dcc:quantity", |xml| {
                        xml.text("dcc:name", c.name);
                        xml.within("si:realListXMLList", |xml| {
                            xml.element("si:valueXMLList", &list(c.values.iter().map(|v| v * factor)));
                            xml.element("si:unitXMLList", &unit);
                            if let Some((U, k)) = &c.uncertainty {
                                xml.within("si:measurementUncertaintyUnivariateXMLList", |xml| {
                                    xml.within("si:expandedMUXMLList", |xml| {
                                        xml.element("si:valueExpandedMUXMLList", &list(U.iter().map(|v| v * factor)));
                                        xml.element("si:coverageFactorXMLList", &list(k.iter().copied()));
                                        xml.element("si:coverageProbabilityXMLList", &number(COVERAGE_PROBABILITY));
                                    });
                                });
                            }
                        });
                    });
                }
            });
        });
    });
}

fn lists(xml: &mut Xml, record: &StoredRecord) {
    if let Some(function) = &record.header.response_function {
        let rates: Vec<f64> = (-CHARACTERISTIC_POINTS..=CHARACTERISTIC_POINTS)
            .map(|k| f64::from(k) / f64::from(CHARACTERISTIC_POINTS) * function.full_scale)
            .collect();
        let outputs: Vec<_> = rates.iter().filter_map(|rate| function.output_at(*rate).ok()).collect();
        let k = |q: &Quantity<String, String>| q.coverage_factor(COVERAGE_PROBABILITY);
        let uncertainty = (outputs.iter().map(Quantity::expanded_u).collect(), outputs.iter().map(k).collect());
        table(
            xml,
            "characteristic",
            &[
                Column { name: "rate", unit: "rad/s", values: rates, uncertainty: None },
                Column { name: "output", unit: "rad/s", values: outputs.iter().map(|q| q.value).collect(), uncertainty: Some(uncertainty) },
            ],
        );
    }
    let response = &record.header.frequency_response;
    let of = |f: fn(&stand_analysis::calibrate::FrequencyPoint) -> f64| response.iter().map(f).collect::<Vec<f64>>();
    let k = vec![identification::statistics::uncertainty::coverage_factor(f64::INFINITY, COVERAGE_PROBABILITY); response.len()];
    table(
        xml,
        "frequency response",
        &[
            Column { name: "frequency", unit: "Hz", values: of(|p| p.frequency_Hz), uncertainty: None },
            Column { name: "gain", unit: "1", values: of(|p| p.gain), uncertainty: Some((of(|p| p.gain_U), k.clone())) },
            Column { name: "phase", unit: "°", values: of(|p| p.phase_deg), uncertainty: Some((of(|p| p.phase_U_deg), k)) },
        ],
    );
}

fn administrative_data(xml: &mut Xml, certificate: &Certificate) {
    let (d, header) = (&certificate.details, &certificate.record.header);
    xml.within("dcc:administrativeData", |xml| {
        xml.within("dcc:dccSoftware", |xml| software(xml, &header.tools));
        xml.within("dcc:coreData", |xml| {
            xml.element("dcc:countryCodeISO3166_1", &d.laboratory.country);
            xml.element("dcc:usedLangCodeISO639_1", "en");
            xml.element("dcc:mandatoryLangCodeISO639_1", "en");
            xml.element("dcc:uniqueIdentifier", &d.number);
            if let Some(received) = d.received {
                xml.element("dcc:receiptDate", &received.to_string());
            }
            xml.element("dcc:beginPerformanceDate", date(&header.began));
            xml.element("dcc:endPerformanceDate", date(&certificate.ended));
            xml.element("dcc:performanceLocation", "laboratory");
            xml.element("dcc:issueDate", &d.issued.to_string());
        });
        xml.within("dcc:items", |xml| {
            xml.within("dcc:item", |xml| {
                xml.text("dcc:name", &d.item.description);
                xml.within("dcc:manufacturer", |xml| xml.text("dcc:name", &d.item.manufacturer));
                if !certificate.model().is_empty() {
                    xml.element("dcc:model", certificate.model());
                }
                xml.within("dcc:identifications", |xml| xml.identification("manufacturer", certificate.serial(), "serial number"));
            });
        });
        xml.within("dcc:calibrationLaboratory", |xml| xml.organisation("dcc:contact", &d.laboratory));
        xml.within("dcc:respPersons", |xml| {
            xml.within("dcc:respPerson", |xml| {
                xml.within("dcc:person", |xml| xml.text("dcc:name", &d.signatory.name));
                xml.element("dcc:role", &d.signatory.function);
                xml.element("dcc:mainSigner", "true");
            });
        });
        xml.organisation("dcc:customer", &d.customer);
        xml.within("dcc:statements", |xml| statements(xml, certificate));
    });
}

fn statements(xml: &mut Xml, certificate: &Certificate) {
    let d = &certificate.details;
    let mut statement = |name: &str, text: &str| {
        xml.within("dcc:statement", |xml| {
            xml.text("dcc:name", name);
            xml.text("dcc:description", text);
        });
    };
    if certificate.record.header.simulated {
        statement("simulated stand", SIMULATED);
    }
    statement("not accredited", STATEMENT);
    statement("traceability", &d.traceability);
    if let Some(crystal) = &certificate.record.header.crystal {
        statement("clock reference", &crystal.reference);
    }
    statement("place", &d.place);
    let adjustment = if d.adjustment.what.is_empty() { "none: as found is as left" } else { &d.adjustment.what };
    statement("adjustment", adjustment);
    if let Some(decision) = &d.decision {
        statement("decision rule", rule(decision.rule));
        for (limit, q, decided) in certificate.decisions() {
            statement("conformity", &format!("{}: limits {} {}: {}", name(&q.name, &q.unit), limits(limit), q.unit, conformity(decided)));
        }
    }
}

/// The rules of the DCC want a letter before the version.
fn software(xml: &mut Xml, version: &str) {
    xml.within("dcc:software", |xml| {
        xml.text("dcc:name", "Rotary Stand, stand calibrate");
        xml.element("dcc:release", &format!("v{version}"));
    });
}

fn measurement_result(xml: &mut Xml, certificate: &Certificate, record: &StoredRecord, name: &str) {
    let d = &certificate.details;
    xml.within("dcc:measurementResult", |xml| {
        xml.text("dcc:name", name);
        xml.within("dcc:usedMethods", |xml| {
            xml.within("dcc:usedMethod", |xml| {
                xml.text("dcc:name", "rotary stand");
                xml.text("dcc:description", &d.method);
            });
            xml.within("dcc:usedMethod", |xml| {
                xml.text("dcc:name", "measurement uncertainty");
                xml.text("dcc:description", "Expanded uncertainties by JCGM 100:2008 and JCGM 101:2008.");
                xml.element("dcc:norm", "JCGM 100:2008");
            });
        });
        xml.within("dcc:usedSoftware", |xml| software(xml, &record.header.tools));
        xml.within("dcc:measuringEquipments", |xml| {
            for e in &d.equipment {
                xml.within("dcc:measuringEquipment", |xml| {
                    xml.text("dcc:name", &e.name);
                    xml.within("dcc:identifications", |xml| {
                        xml.identification("calibrationLaboratory", &e.serial, "serial number");
                        xml.identification("calibrationLaboratory", &e.certificate, &format!("certificate, valid until {}", e.valid_until));
                    });
                });
            }
        });
        xml.within("dcc:influenceConditions", |xml| {
            for a in &d.ambient {
                if let Some((unit, factor)) = d_si(&a.unit) {
                    let range = format!("{} {unit} to {} {unit}", a.lowest, a.greatest, unit = a.unit);
                    condition(xml, &a.name, &range, 0.5 * (a.lowest + a.greatest) * factor, &unit);
                }
            }
        });
        xml.within("dcc:results", |xml| {
            record.quantities.iter().for_each(|q| quantity(xml, q));
            lists(xml, record);
        });
    });
}

/// The XML file.
pub fn dcc(certificate: &Certificate) -> String {
    let mut xml = Xml("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".into());
    let attributes = format!(
        " schemaVersion=\"{SCHEMA}\" xmlns:dcc=\"https://ptb.de/dcc\" xmlns:si=\"https://ptb.de/si\" \
         xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:schemaLocation=\"https://ptb.de/dcc https://ptb.de/dcc/v{SCHEMA}/dcc.xsd\""
    );
    xml.within_of("dcc:digitalCalibrationCertificate", &attributes, |xml| {
        administrative_data(xml, certificate);
        xml.within("dcc:measurementResults", |xml| {
            if let Some(as_found) = &certificate.as_found {
                measurement_result(xml, certificate, as_found, "results as found");
                measurement_result(xml, certificate, &certificate.record, "results as left");
            } else {
                measurement_result(xml, certificate, &certificate.record, "results");
            }
        });
    });
    xml.0
}

//! The details of a certificate that no log contains (ISO/IEC 17025:2017, clauses 7.8.2 and 7.8.4), and the conformity of results with
//! limits.
//!
//! Input: a TOML file and a verified record. Output: [`Certificate`]: all fields checked, results with their decisions. Limits: a
//! certificate made here is never called accredited; the laboratory is responsible for what the fields state.

use super::archive::{LogState, Verification};
use super::stored_record::{StoredQuantity, StoredRecord};
use serde::Deserialize;
use toml::value::Datetime;

/// Details from the user's file; each field names its clause.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CertificateDetails {
    /// Unique number of the certificate (7.8.2.1 d).
    pub number: String,
    /// Date of issue, YYYY-MM-DD (7.8.2.1 j).
    pub issued: Datetime,
    /// Title (7.8.2.1 a).
    #[serde(default = "default_title")]
    pub title: String,
    /// The laboratory (7.8.2.1 b).
    pub laboratory: Organisation,
    /// The customer (7.8.2.1 e).
    pub customer: Organisation,
    /// The calibrated item (7.8.2.1 g).
    pub item: Item,
    /// Place of the calibration (7.8.2.1 c).
    pub place: String,
    /// Date of receipt, where it matters (7.8.2.1 h).
    #[serde(default)]
    pub received: Option<Datetime>,
    /// Ambient conditions that influence the results (7.8.4.1 b).
    pub ambient: Vec<AmbientCondition>,
    /// Equipment with its own certificates (7.8.4.1 c).
    pub equipment: Vec<Equipment>,
    /// How the results are traceable (7.8.4.1 c).
    pub traceability: String,
    /// The method (7.8.2.1 f).
    #[serde(default = "default_method")]
    pub method: String,
    /// State of the item: results before and after an adjustment (7.8.4.1 d).
    #[serde(default)]
    pub adjustment: Adjustment,
    /// Decision rule with limits (7.8.6).
    #[serde(default)]
    pub decision: Option<Decision>,
    /// Who authorises the certificate (7.8.2.1 o).
    pub signatory: Signatory,
    /// Further remarks.
    #[serde(default)]
    pub remarks: Vec<String>,
}

fn default_title() -> String {
    "Calibration certificate".into()
}

fn default_method() -> String {
    "Comparison with the rate of a rotary test stand: encoder angle over the time of its clock; analysis of `stand calibrate`.".into()
}

/// A laboratory or a customer.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Organisation {
    /// Name.
    pub name: String,
    /// Street and number.
    #[serde(default)]
    pub street: String,
    /// Postal code.
    #[serde(default)]
    pub post_code: String,
    /// City.
    pub city: String,
    /// Country, ISO 3166-1, two letters.
    pub country: String,
    /// Electronic mail.
    #[serde(default)]
    pub email: String,
}

/// The calibrated item.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// What it is.
    pub description: String,
    /// Manufacturer.
    pub manufacturer: String,
    /// Condition on receipt.
    #[serde(default)]
    pub condition: String,
    /// Type; that of the record by default.
    #[serde(default)]
    pub model: String,
    /// Serial number; that of the record by default.
    #[serde(default)]
    pub serial: String,
}

/// An ambient condition.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AmbientCondition {
    /// Name: `temperature`.
    pub name: String,
    /// Lowest value.
    pub lowest: f64,
    /// Greatest value.
    pub greatest: f64,
    /// Unit: `°C`, `%`, `Pa`.
    pub unit: String,
}

/// Equipment with its own certificate.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Equipment {
    /// What it is.
    pub name: String,
    /// Serial number.
    pub serial: String,
    /// Number of its certificate.
    pub certificate: String,
    /// Date until which that certificate is valid.
    pub valid_until: Datetime,
}

/// State of the item during the calibration.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Adjustment {
    /// What was adjusted or repaired; empty for nothing.
    pub what: String,
    /// Record of the results before it: as found.
    pub as_found: Option<std::path::PathBuf>,
}

/// How a statement of conformity accounts for the uncertainty (ILAC-G8:09/2019).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DecisionRule {
    /// Pass within the limits, whatever the uncertainty (ILAC-G8, 4.2.1).
    SimpleAcceptance,
    /// Pass within the limits reduced by U, fail beyond the limits enlarged by U, else undecided (ILAC-G8, 4.2.3).
    GuardBand,
}

/// Decision rule and limits.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Decision {
    /// The rule.
    pub rule: DecisionRule,
    /// Limits of quantities.
    pub limits: Vec<Limit>,
}

/// Limits of a quantity, in its unit.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    /// Name of the quantity.
    pub quantity: String,
    /// Lowest permitted value.
    #[serde(default)]
    pub lowest: Option<f64>,
    /// Greatest permitted value.
    #[serde(default)]
    pub greatest: Option<f64>,
}

/// Who authorises the certificate.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Signatory {
    /// Name.
    pub name: String,
    /// Function.
    pub function: String,
}

/// A statement of conformity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conformity {
    /// Within the limits by the rule.
    Pass,
    /// Outside the limits by the rule.
    Fail,
    /// The uncertainty does not permit a decision.
    Undecided,
}

impl Limit {
    /// Decision on a quantity.
    pub fn decide(&self, rule: DecisionRule, q: &StoredQuantity) -> Conformity {
        let (low, high) = (self.lowest.unwrap_or(f64::NEG_INFINITY), self.greatest.unwrap_or(f64::INFINITY));
        let U = match rule {
            DecisionRule::SimpleAcceptance => 0.0,
            DecisionRule::GuardBand => q.expanded_u(),
        };
        if q.value >= low + U && q.value <= high - U {
            Conformity::Pass
        } else if q.value < low - U || q.value > high + U {
            Conformity::Fail
        } else {
            Conformity::Undecided
        }
    }
}

/// A certificate: the details with the record.
#[derive(Debug, Clone)]
pub struct Certificate {
    /// The details.
    pub details: CertificateDetails,
    /// The results.
    pub record: StoredRecord,
    /// Results before the adjustment.
    pub as_found: Option<StoredRecord>,
    /// Date on which the session ended.
    pub ended: String,
}

/// Why no certificate is issued.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CertificateError {
    /// The file of the details.
    #[error("{0}")]
    Details(String),
    /// A field is empty or invalid.
    #[error("{field}: {message}")]
    Field {
        /// The field.
        field: String,
        /// What is wrong.
        message: String,
    },
    /// The session is not complete.
    #[error("the session is not complete: {done} of {all} steps; a certificate needs all of them; resume it")]
    Incomplete {
        /// Recorded steps.
        done: usize,
        /// Steps of the session.
        all: usize,
    },
    /// The record does not follow from its raw logs.
    #[error("the record does not follow from its raw logs: {0}; `stand records show` has the details")]
    NotVerified(String),
}

fn field(name: &str, message: impl Into<String>) -> CertificateError {
    CertificateError::Field { field: name.to_owned(), message: message.into() }
}

impl CertificateDetails {
    /// Parses the details and checks each field.
    ///
    /// # Errors
    /// The first field that is missing, empty or invalid.
    pub fn parse(text: &str) -> Result<Self, CertificateError> {
        let details: Self = toml::from_str(text).map_err(|e| CertificateError::Details(e.to_string().trim_end().to_owned()))?;
        let required = [
            ("number", &details.number),
            ("title", &details.title),
            ("laboratory.name", &details.laboratory.name),
            ("laboratory.city", &details.laboratory.city),
            ("customer.name", &details.customer.name),
            ("customer.city", &details.customer.city),
            ("item.description", &details.item.description),
            ("item.manufacturer", &details.item.manufacturer),
            ("place", &details.place),
            ("traceability", &details.traceability),
            ("method", &details.method),
            ("signatory.name", &details.signatory.name),
            ("signatory.function", &details.signatory.function),
        ];
        if let Some((name, _)) = required.iter().find(|(_, text)| text.trim().is_empty()) {
            return Err(field(name, "must not be empty"));
        }
        for (name, country) in [("laboratory.country", &details.laboratory.country), ("customer.country", &details.customer.country)] {
            if country.len() != 2 || !country.chars().all(|c| c.is_ascii_uppercase()) {
                return Err(field(name, format!("`{country}` is not a country code of ISO 3166-1 with two capital letters, such as DE")));
            }
        }
        let dates = [("issued", Some(details.issued)), ("received", details.received)];
        if let Some((name, date)) = dates.iter().find(|(_, date)| date.is_some_and(|d| d.date.is_none() || d.time.is_some())) {
            return Err(field(name, format!("{} is not a date, YYYY-MM-DD", date.map_or(String::new(), |d| d.to_string()))));
        }
        if details.ambient.is_empty() {
            return Err(field(
                "ambient",
                "the certificate needs the ambient conditions that influence the results, at least the temperature",
            ));
        }
        for condition in &details.ambient {
            if !(condition.lowest.is_finite() && condition.greatest.is_finite() && condition.lowest <= condition.greatest) {
                return Err(field(&format!("ambient `{}`", condition.name), "lowest must not exceed greatest"));
            }
        }
        if details.equipment.is_empty() {
            return Err(field(
                "equipment",
                "the certificate needs the equipment with its own certificates: encoder and clock of the stand",
            ));
        }
        Ok(details)
    }
}

impl Certificate {
    /// Combines details and a record that was verified against its raw logs.
    ///
    /// # Errors
    /// The record is incomplete or does not follow from its logs; a limit names a quantity that the record does not have.
    pub fn new(
        details: CertificateDetails,
        record: StoredRecord,
        verification: &Verification,
        as_found: Option<StoredRecord>,
    ) -> Result<Self, CertificateError> {
        let header = &record.header;
        let (done, all) = (header.steps.len(), header.session.steps.len());
        if done != all {
            return Err(CertificateError::Incomplete { done, all });
        }
        if let Some((log, _)) = verification.logs.iter().find(|(_, state)| *state != LogState::AsRecorded) {
            return Err(CertificateError::NotVerified(format!("{log} is missing or has changed")));
        }
        if !verification.is_same() {
            return Err(CertificateError::NotVerified("computed again, the results differ".into()));
        }
        for limit in details.decision.iter().flat_map(|d| &d.limits) {
            if record.get(&limit.quantity).is_none() {
                return Err(field("decision.limits", format!("the record has no quantity {}", limit.quantity)));
            }
            if limit.lowest.is_none() && limit.greatest.is_none() {
                return Err(field("decision.limits", format!("{}: lowest or greatest is missing", limit.quantity)));
            }
        }
        let ended = header.steps.last().map_or_else(|| header.began.clone(), |step| step.began.clone());
        check_dates(&details, &header.began, &ended)?;
        let certificate = Self { details, record, as_found, ended };
        if certificate.serial().trim().is_empty() {
            return Err(field(
                "item.serial",
                "the record has no serial number, and the item must be identified unambiguously: give one here",
            ));
        }
        Ok(certificate)
    }

    /// Serial number of the item.
    pub fn serial(&self) -> &str {
        if self.details.item.serial.is_empty() { &self.record.header.serial } else { &self.details.item.serial }
    }

    /// Type of the item.
    pub fn model(&self) -> &str {
        if self.details.item.model.is_empty() { &self.record.header.sensor } else { &self.details.item.model }
    }

    /// The limits with their decisions.
    pub fn decisions(&self) -> Vec<(&Limit, &StoredQuantity, Conformity)> {
        let Some(decision) = &self.details.decision else { return Vec::new() };
        let all = decision.limits.iter().filter_map(|limit| Some((limit, self.record.get(&limit.quantity)?)));
        all.map(|(limit, q)| (limit, q, limit.decide(decision.rule, q))).collect()
    }
}

/// Received, calibrated from `began` to `ended`, issued; equipment that was valid during the calibration.
fn check_dates(details: &CertificateDetails, began: &str, ended: &str) -> Result<(), CertificateError> {
    let day = |stamp: &str| stamp.get(..10).and_then(|day| day.parse::<Datetime>().ok()?.date);
    let (Some(began), Some(ended)) = (day(began), day(ended)) else { return Ok(()) };
    if let Some(received) = details.received.filter(|received| received.date > Some(began)) {
        return Err(field("received", format!("{received} is after the begin of the calibration, {began}")));
    }
    if details.issued.date < Some(ended) {
        return Err(field("issued", format!("{} is before the end of the calibration, {ended}", details.issued)));
    }
    if let Some(expired) = details.equipment.iter().find(|e| e.valid_until.date < Some(ended)) {
        let message = format!(
            "its certificate {} is valid until {}, before the end of the calibration, {ended}",
            expired.certificate, expired.valid_until
        );
        return Err(field(&format!("equipment `{}`", expired.name), message));
    }
    Ok(())
}

const EXAMPLE: &str = include_str!("certificate.toml");

/// An example of the file with the details, with a comment for each field: received and issued on this day, YYYY-MM-DD, equipment valid until
/// the end of the next year.
pub fn example(today: &str) -> String {
    let next_year = today.get(..4).and_then(|year| year.parse::<u32>().ok()).map_or(2100, |year| year + 1);
    EXAMPLE.replace("RECEIVED", today).replace("ISSUED", today).replace("VALID_UNTIL", &format!("{next_year}-12-31"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::statistics::uncertainty::Contribution;

    #[test]
    fn example_is_valid_and_missing_fields_are_named() {
        let example = example("2026-11-24");
        assert_eq!(CertificateDetails::parse(&example).unwrap().laboratory.country, "DE");
        let without = |line: &str| {
            let text: String = example.lines().filter(|l| !l.starts_with(line)).map(|l| format!("{l}\n")).collect();
            CertificateDetails::parse(&text).unwrap_err().to_string()
        };
        for name in ["number", "issued", "place", "traceability"] {
            assert!(without(name).contains(name), "{}", without(name));
        }
        let with = |from: &str, to: &str| CertificateDetails::parse(&example.replace(from, to)).unwrap_err().to_string();
        assert!(with("country = \"DE\"", "country = \"Germany\"").contains("laboratory.country: `Germany`"));
        assert!(with("name = \"Example laboratory\"", "name = \" \"").contains("laboratory.name: must not be empty"));
    }

    #[test]
    fn dates_are_in_the_order_of_receipt_calibration_and_issue() {
        let check = |began: &str, ended: &str, from: &str, to: &str| {
            let details = CertificateDetails::parse(&example("2026-11-24").replace(from, to)).unwrap();
            check_dates(&details, began, ended).map_err(|error| error.to_string())
        };
        let (began, ended) = ("2026-11-24T08:00:00+00:00", "2026-11-24T09:00:00+00:00");
        assert_eq!(check(began, ended, "", ""), Ok(()));
        let refused = |from: &str, to: &str| check(began, ended, from, to).unwrap_err();
        assert!(refused("received = 2026-11-24", "received = 2026-11-25").contains("received: 2026-11-25 is after the begin"));
        assert!(refused("issued = 2026-11-24", "issued = 2026-11-23").contains("issued: 2026-11-23 is before the end"));
        assert!(refused("valid_until = 2027-12-31", "valid_until = 2026-11-23").contains("encoder of the stand`: its certificate A-1234"));
        // Equipment may expire between calibration and issue.
        let later = check("2026-11-20T08:00:00Z", "2026-11-20T09:00:00Z", "received = 2026-11-24", "received = 2026-11-19");
        assert_eq!(later, Ok(()));
    }

    #[test]
    fn guard_band_decides_with_the_expanded_uncertainty() {
        let q = |value: f64| {
            StoredQuantity::new("scale", "1", value, vec![Contribution::type_b("clock", 0.01 / 1.959_964, "1", 1.0, String::new())])
        };
        let limit = Limit { quantity: "scale".into(), lowest: Some(0.9), greatest: Some(1.1) };
        let decide = |rule, value| limit.decide(rule, &q(value));
        assert_eq!(decide(DecisionRule::GuardBand, 1.085), Conformity::Pass);
        assert_eq!(decide(DecisionRule::GuardBand, 1.095), Conformity::Undecided);
        assert_eq!(decide(DecisionRule::GuardBand, 1.115), Conformity::Fail);
        assert_eq!(decide(DecisionRule::SimpleAcceptance, 1.095), Conformity::Pass);
        assert_eq!(decide(DecisionRule::SimpleAcceptance, 0.899), Conformity::Fail);
    }
}

//! The file `record.json`: a calibration with all texts, so that it can be read without the program that made it.
//!
//! Each quantity is an entry by its name; the entry `record` holds the session as it was run, the raw logs with their SHA-256, the
//! operator's actions, interruptions, absent quantities, remarks and curves.

use identification::statistics::uncertainty::{
    COVERAGE_PROBABILITY, Conditions, Contribution, CovarianceMatrix, Distribution, Evaluation, Quantity,
};
use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;
use stand_acquire::calibration_session::Session;
use stand_acquire::calibration_session::journal::StepRecord;
use stand_analysis::calibrate::DutKind;
use stand_analysis::calibrate::FrequencyPoint;
use stand_analysis::calibrate::response_function::StoredFunction;

/// The file's name in a session's folder.
pub const RECORD_FILE: &str = "record.json";

/// A quantity with its texts.
pub type StoredQuantity = Quantity<String, String>;

/// The content of a record file.
#[derive(Debug, Clone)]
pub struct StoredRecord {
    /// The quantities.
    pub quantities: Vec<StoredQuantity>,
    /// The rest.
    pub header: RecordHeader,
}

/// What a record contains beside the quantities.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct RecordHeader {
    /// What was calibrated.
    #[serde(rename = "what")]
    pub dut_kind: DutKind,
    /// Type of the device under test.
    #[serde(default)]
    pub sensor: String,
    /// Its serial number.
    #[serde(default)]
    pub serial: String,
    /// Who ran the session.
    #[serde(default)]
    pub operator: String,
    /// When the session began.
    pub began: String,
    /// When the results were computed.
    #[serde(default)]
    pub computed: String,
    /// Answer of the stand to `*IDN?`.
    pub stand: String,
    /// The stand was simulated; `false` in records of versions before this field.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub simulated: bool,
    /// Version of these tools.
    pub tools: String,
    /// All steps of the session are done.
    #[serde(default, rename = "whole")]
    pub is_complete: bool,
    /// What the uncertainties mean.
    #[serde(default)]
    pub statement: String,
    /// The session.
    pub session: Session,
    /// The recorded steps.
    pub steps: Vec<StepRecord>,
    /// Interruptions of the session.
    pub interruptions: Vec<String>,
    /// Quantities that were not found.
    #[serde(default)]
    pub absent: Vec<StoredAbsence>,
    /// Remarks on the whole.
    #[serde(default, rename = "says")]
    pub remarks: Vec<String>,
    /// Curves.
    #[serde(default)]
    pub curves: Vec<StoredCurve>,
    /// Covariances of the quantities.
    #[serde(default)]
    pub covariance: CovarianceMatrix,
    /// Output of the device as a function of its input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub response_function: Option<StoredFunction>,
    /// Gain and phase by frequency.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frequency_response: Vec<FrequencyPoint>,
    /// The crystal by the clock reference, where one was used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crystal: Option<StoredCrystal>,
}

/// The crystal of the stand, compared with a clock reference.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct StoredCrystal {
    /// Name of the reference.
    pub reference: String,
    /// Relative frequency error of the crystal, ppm; positive: fast.
    pub error_ppm: f64,
    /// Its expanded uncertainty, ppm.
    #[serde(rename = "U_ppm")]
    pub expanded_u_ppm: f64,
    /// Time with pulses of the reference, s.
    pub seconds: f64,
}

/// A quantity that was not found.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct StoredAbsence {
    /// Name of the quantity.
    pub name: String,
    /// Reason, as text.
    #[serde(rename = "why")]
    pub reason: String,
}

/// A curve with its texts.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct StoredCurve {
    /// Title.
    pub title: String,
    /// Label of the horizontal axis.
    pub x: String,
    /// Label of the vertical axis.
    pub y: String,
    /// Measured points.
    pub points: Vec<[Option<f64>; 2]>,
    /// Other series of measured points.
    #[serde(rename = "beside")]
    pub other_series: Vec<StoredSeries>,
    /// The line by the result.
    pub line: Vec<[Option<f64>; 2]>,
}

/// A named series of points.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct StoredSeries {
    /// Name.
    pub name: String,
    /// Points.
    pub points: Vec<[Option<f64>; 2]>,
}

/// A line of a budget in the file.
#[derive(Serialize, Deserialize, JsonSchema)]
struct ContributionEntry {
    #[serde(rename = "of")]
    source: String,
    #[serde(rename = "type")]
    evaluation: Evaluation,
    #[serde(deserialize_with = "null_as_nan")]
    u: f64,
    unit: String,
    #[serde(deserialize_with = "null_as_nan")]
    sensitivity: f64,
    distribution: Distribution,
    #[serde(deserialize_with = "null_as_infinity")]
    dof: f64,
    #[serde(deserialize_with = "null_as_nan")]
    contribution: f64,
    #[serde(default, rename = "says")]
    basis: String,
}

/// A quantity in the file. u, ν, k and U follow from the budget and are not read.
#[derive(Serialize, Deserialize, JsonSchema)]
struct QuantityEntry {
    #[serde(deserialize_with = "null_as_nan")]
    value: f64,
    #[serde(skip_deserializing)]
    sigma: f64,
    unit: String,
    #[serde(skip_deserializing)]
    dof: f64,
    #[serde(skip_deserializing)]
    k: f64,
    #[serde(skip_deserializing, rename = "U")]
    expanded_u: f64,
    #[serde(skip_deserializing)]
    coverage: f64,
    budget: Vec<ContributionEntry>,
    #[serde(default, rename = "says")]
    meaning: String,
    #[serde(default, skip_serializing_if = "is_unconditional")]
    conditions: Conditions,
}

fn is_unconditional(conditions: &Conditions) -> bool {
    *conditions == Conditions::default()
}

/// JSON has no NaN and no infinity: the writer puts `null`.
fn null_as_nan<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Option::<f64>::deserialize(from).map(|number| number.unwrap_or(f64::NAN))
}

fn null_as_infinity<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Option::<f64>::deserialize(from).map(|number| number.unwrap_or(f64::INFINITY))
}

impl From<&StoredQuantity> for QuantityEntry {
    fn from(q: &StoredQuantity) -> Self {
        let entry = |c: &Contribution<String>| ContributionEntry {
            source: c.source.clone(),
            evaluation: c.evaluation,
            u: c.u,
            unit: if c.unit.is_empty() { q.unit.clone() } else { c.unit.clone() },
            sensitivity: c.sensitivity,
            distribution: c.distribution,
            dof: c.dof,
            contribution: c.contribution(),
            basis: c.basis.clone(),
        };
        Self {
            value: q.value,
            sigma: q.combined_u(),
            unit: q.unit.clone(),
            dof: q.effective_dof(),
            k: q.coverage_factor(COVERAGE_PROBABILITY),
            expanded_u: q.expanded_u(),
            coverage: COVERAGE_PROBABILITY,
            budget: q.contributions.iter().map(entry).collect(),
            meaning: q.meaning.clone().unwrap_or_default(),
            conditions: q.conditions,
        }
    }
}

impl QuantityEntry {
    fn into_quantity(self, name: &str) -> StoredQuantity {
        let contribution = |c: ContributionEntry| Contribution {
            source: c.source,
            evaluation: c.evaluation,
            u: c.u,
            unit: c.unit,
            sensitivity: c.sensitivity,
            dof: c.dof,
            distribution: c.distribution,
            loadings: None,
            basis: c.basis,
        };
        Quantity {
            name: name.to_owned(),
            unit: self.unit,
            value: self.value,
            contributions: self.budget.into_iter().map(contribution).collect(),
            meaning: (!self.meaning.is_empty()).then_some(self.meaning),
            conditions: self.conditions,
        }
    }
}

impl Serialize for StoredRecord {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut map = to.serialize_map(Some(self.quantities.len() + 1))?;
        for q in &self.quantities {
            map.serialize_entry(&q.name, &QuantityEntry::from(q))?;
        }
        map.serialize_entry("record", &self.header)?;
        map.end()
    }
}

impl JsonSchema for StoredRecord {
    fn schema_name() -> Cow<'static, str> {
        "StoredRecord".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "object",
            "description": "The header as `record`, and each quantity by its name.",
            "properties": { "record": generator.subschema_for::<RecordHeader>() },
            "required": ["record"],
            "additionalProperties": generator.subschema_for::<QuantityEntry>(),
        })
    }
}

/// Quantities with their budgets, each by its name.
pub fn quantities_json(quantities: &[StoredQuantity]) -> Value {
    let entry = |q: &StoredQuantity| (q.name.clone(), serde_json::to_value(QuantityEntry::from(q)).unwrap_or(Value::Null));
    Value::Object(quantities.iter().map(entry).collect())
}

impl StoredRecord {
    /// Reads the content of a record file.
    ///
    /// # Errors
    /// What is missing or wrong, with the entry's name.
    pub fn from_json(all: &Value) -> Result<Self, String> {
        let header = all.get("record").ok_or("it has no entry `record`")?;
        let header = RecordHeader::deserialize(header).map_err(|e| format!("record: {e}"))?;
        let entries = all.as_object().into_iter().flatten().filter(|(name, _)| *name != "record");
        let quantity = |(name, entry): (&String, &Value)| {
            QuantityEntry::deserialize(entry).map(|entry| entry.into_quantity(name)).map_err(|e| format!("{name}: {e}"))
        };
        Ok(Self { quantities: entries.map(quantity).collect::<Result<_, _>>()?, header })
    }

    /// A quantity by its name.
    pub fn get(&self, name: &str) -> Option<&StoredQuantity> {
        self.quantities.iter().find(|q| q.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantity_survives_the_file() {
        let infinite = Contribution::type_b("tilt", 2.0, "rad", -0.5, "level".to_owned());
        let finite = Contribution::type_a("noise", f64::NAN, 3.0, String::new());
        for contributions in [vec![infinite.clone()], vec![infinite, finite]] {
            let quantity = StoredQuantity::new("x", "m", 1.5, contributions);
            let written = serde_json::to_value(QuantityEntry::from(&quantity)).unwrap();
            let read = QuantityEntry::deserialize(&written).unwrap().into_quantity("x");
            assert_eq!(serde_json::to_value(QuantityEntry::from(&read)).unwrap(), written);
        }
    }

    #[test]
    fn infinite_degrees_of_freedom_are_null() {
        let quantity = StoredQuantity::new("x", "m", 1.5, vec![Contribution::type_b("tilt", 2.0, "rad", 1.0, String::new())]);
        assert_eq!(serde_json::to_value(QuantityEntry::from(&quantity)).unwrap()["dof"], Value::Null);
    }
}

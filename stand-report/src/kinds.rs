//! The kinds of the answers, with their numbers, by family.
//!
//! Where an answer has a sentence, the kind with the numbers of this sentence stands beside it (`{"kind": "torque-step", "t_s": 3.2}`). A
//! client that makes sentences of its own, in another language, needs one for each kind. The kinds are read from the JSON schemas of the
//! types.

use std::collections::{BTreeMap, BTreeSet};

use drive_model::Coordinate;
use identification::identify::explain::Verdict;
use schemars::{JsonSchema, schema_for};
use serde_json::Value;
use stand_acquire::calibration_session::{Action, Orientation};
use stand_analysis::calibrate::note::{AbsenceReason, Remark};

use crate::explanation::sentences::{NotVisibleKind, PurposeKind, RefusalKind, ShapeKind};
use crate::explanation::{Outcome, STRENGTHS};
use crate::{allan, compensation::LeftOutKind, drift, misfits::FormKind};

/// Names of kinds, in words separated by `_`, with the names of their fields.
pub type Kinds = BTreeMap<String, BTreeSet<String>>;

/// The kinds of a type that is tagged by `kind`, or of plain names.
pub fn of<T: JsonSchema>() -> Kinds {
    let schema = Value::from(schema_for!(T));
    let mut kinds = Kinds::new();
    collect(&schema, &schema, &mut kinds);
    kinds
}

/// Adds the kinds of a schema; references are looked up in `root`.
fn collect(schema: &Value, root: &Value, kinds: &mut Kinds) {
    if let Some(reference) = schema["$ref"].as_str() {
        collect(root.pointer(reference.trim_start_matches('#')).unwrap_or(&Value::Null), root, kinds);
    }
    for parts in ["oneOf", "anyOf"] {
        schema[parts].as_array().into_iter().flatten().for_each(|part| collect(part, root, kinds));
    }
    if let (Some(fields), Some(kind)) = (schema["properties"].as_object(), schema["properties"]["kind"]["const"].as_str()) {
        kinds.insert(key(kind), fields.keys().filter(|field| *field != "kind").cloned().collect());
    }
    let names = schema["enum"].as_array().into_iter().flatten().chain(std::iter::once(&schema["const"]));
    kinds.extend(names.filter_map(Value::as_str).map(|name| (key(name), BTreeSet::new())));
}

fn key(name: &str) -> String {
    name.replace([' ', '-'], "_")
}

/// Plain names as kinds without fields.
fn named<'n>(names: impl IntoIterator<Item = &'n str>) -> Kinds {
    names.into_iter().map(|name| (key(name), BTreeSet::new())).collect()
}

/// The families with their kinds. A family may come in several parts.
pub fn families() -> Vec<(&'static str, Kinds)> {
    let coordinates = || named(Coordinate::ALL.map(Coordinate::name));
    vec![
        ("form", of::<FormKind>()),
        ("refusal", of::<RefusalKind>()),
        ("hidden", of::<NotVisibleKind>()),
        ("shape", of::<ShapeKind>()),
        ("purpose", of::<PurposeKind>()),
        ("allan", of::<allan::ReasonKind>()),
        ("allan_note", of::<allan::NoteKind>()),
        ("drift", of::<drift::NoteKind>()),
        ("drift_parts", of::<drift::SetupPartKind>()),
        ("left_out", of::<LeftOutKind>()),
        ("absent", of::<AbsenceReason>()),
        ("calibration", of::<Remark>()),
        ("ask", of::<Action>()),
        ("ask_orientation", of::<Orientation>()),
        ("fate", named(Outcome::ALL.map(Outcome::name))),
        ("strength", named(STRENGTHS)),
        ("verdict", named(Verdict::ALL.map(Verdict::name))),
        ("coordinate", coordinates()),
        ("with", coordinates()),
    ]
}

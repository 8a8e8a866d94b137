//! Settings of a stand that were exported or imported, as text and JSON.

use crate::json::schema_of;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::json::{Entries, value};
use stand_acquire::settings::{Difference, Imported, StandSettings};

/// The identity without the manufacturer.
fn stand(identity: &str) -> &str {
    identity.split_once(',').map_or(identity, |(_, rest)| rest)
}

/// Settings of the stand `identity` that were written into `path`.
pub fn exported(path: &str, identity: &str, settings: &StandSettings) -> String {
    let observer = match settings.observer.states() {
        0 => "no observer".to_owned(),
        states => format!("an observer of {states} states"),
    };
    let (numbers, harmonics) = (settings.settings.len(), settings.harmonics.len());
    format!("{path}: {numbers} settings of {}, {harmonics} harmonics of the compensation, {observer}\n", stand(identity))
}

/// What an import from the stand `source` changes in the stand `identity`.
pub fn differences(source: &str, identity: &str, differences: &[Difference]) -> String {
    let mut text = String::new();
    if !source.is_empty() {
        text += &format!("settings of  {source}\n");
    }
    text += &format!("stand        {}\n", stand(identity));
    text += &match differences.len() {
        0 => "nothing differs\n".to_owned(),
        1 => "1 difference:\n".to_owned(),
        count => format!("{count} differences:\n"),
    };
    differences.iter().for_each(|difference| text += &format!("  {difference}\n"));
    text
}

/// The end of an import.
pub fn imported(result: &Imported) -> String {
    let mut text = String::from("saved in the stand's flash and read back\n");
    if result.differences.iter().any(is_scale) {
        text += "scales changed: switch the stand off and on, they act from the next power-on on\n";
    }
    text
}

#[derive(Serialize, JsonSchema)]
struct ExportedJson<'a> {
    stand: &'a str,
    settings: Entries<SettingJson<'a>>,
    harmonics: Vec<HarmonicJson>,
    observer_states: usize,
}

#[derive(Serialize, JsonSchema)]
struct SettingJson<'a> {
    value: f64,
    unit: &'a str,
    /// It acts from the next power-on on.
    is_scale: bool,
}

#[derive(Serialize, JsonSchema)]
#[allow(non_snake_case, reason = "names with units")]
struct HarmonicJson {
    order: u16,
    torque_N_m: f64,
    phase_rad: f64,
}

/// Exported settings as JSON.
pub fn exported_json(identity: &str, settings: &StandSettings) -> Value {
    value(&ExportedJson {
        stand: stand(identity),
        settings: Entries(
            settings
                .settings
                .iter()
                .map(|s| (s.name.clone(), SettingJson { value: s.value, unit: &s.unit, is_scale: s.is_scale() }))
                .collect(),
        ),
        harmonics: settings
            .harmonics
            .iter()
            .map(|h| HarmonicJson { order: h.order, torque_N_m: h.torque_N_m, phase_rad: h.phase_rad })
            .collect(),
        observer_states: settings.observer.states(),
    })
}

#[derive(Serialize, JsonSchema)]
struct ImportedJson<'a> {
    stand: &'a str,
    source: &'a str,
    differences: Vec<String>,
    /// Scales act from the next power-on on.
    needs_power_cycle: bool,
}

/// The result of an import as JSON.
pub fn imported_json(source: &str, identity: &str, result: &Imported) -> Value {
    value(&ImportedJson {
        stand: stand(identity),
        source,
        differences: result.differences.iter().map(ToString::to_string).collect(),
        needs_power_cycle: result.differences.iter().any(is_scale),
    })
}

fn is_scale(difference: &Difference) -> bool {
    matches!(difference, Difference::Setting { after, .. } if after.is_scale())
}

/// Schemas of the answers.
pub(crate) fn schemas() -> Vec<(&'static str, Value)> {
    vec![("settings export", schema_of::<ExportedJson<'_>>()), ("settings import", schema_of::<ImportedJson<'_>>())]
}

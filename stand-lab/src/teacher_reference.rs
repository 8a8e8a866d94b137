//! The teacher's reference of a work on a real stand: the values X with their expanded uncertainties U_X, or what the logs of a hunt hide.
//!
//! Input: a TOML file, or the record of a calibration (`record.json` of `stand calibrate`) of the device. It is not part of the work
//! folder, which has its code only ([`super::real_stand`]).

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Deserialize;

use super::LabError;
use super::answers::{NONE, UNKNOWN, class_of};
use super::course::{HuntTask, Lab, Task};
use super::journal::sha256_of;
use super::measurement::Hidden;
use super::stand_recording::check_possible;
use stand_records::stored_record::StoredRecord;

/// A reference value.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceValue {
    /// X.
    pub value: f64,
    /// Its expanded uncertainty U_X, coverage probability 95 %.
    #[serde(rename = "U")]
    pub expanded_u: f64,
    /// Unit, that of the work.
    pub unit: String,
}

/// What a log of a hunt hides.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct HiddenEntry {
    present: Vec<String>,
    description: String,
}

/// The file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    source: String,
    #[serde(default)]
    known: BTreeMap<String, f64>,
    #[serde(default)]
    quantities: BTreeMap<String, ReferenceValue>,
    #[serde(default)]
    hunt: BTreeMap<String, HiddenEntry>,
}

/// A reference that suits its work.
#[derive(Debug, Clone, PartialEq)]
pub struct TeacherReference {
    /// Where it is from.
    pub source: String,
    /// Values of the stand that replace those of the instructions; [`Lab::on_real_stand`] checks them.
    pub known: BTreeMap<String, f64>,
    /// The values of the work, by name; empty for a hunt.
    pub quantities: BTreeMap<String, ReferenceValue>,
    /// What the logs of a hunt hide, in their order; empty for other works.
    pub hidden: Vec<Hidden>,
    /// SHA-256 of the file.
    pub sha256: String,
}

impl TeacherReference {
    /// Reads the reference of a work.
    ///
    /// # Errors
    /// A work that a real stand cannot have; the file cannot be read; a value is missing or has another unit; an uncertainty is not
    /// positive; a hunt that the rules exclude.
    pub fn read(path: &Path, lab: &Lab) -> Result<Self, LabError> {
        check_possible(lab)?;
        let text = std::fs::read_to_string(path).map_err(|source| LabError::file(path, "read", source))?;
        TeacherReference::parse(&text, lab).map_err(|message| LabError::invalid(path, message))
    }

    fn parse(text: &str, lab: &Lab) -> Result<Self, String> {
        let file = if text.trim_start().starts_with('{') { of_record(text, lab)? } else { of_table(text)? };
        if file.source.trim().is_empty() || file.source.chars().any(char::is_control) {
            return Err("source: one line that says where the values are from".to_owned());
        }
        if let Some((name, value)) = file.known.iter().find(|(_, value)| !value.is_finite()) {
            return Err(format!("known.{name}: {value} is not a number"));
        }
        if let Some(name) = file.quantities.keys().find(|name| !lab.quantities().iter().any(|asked| asked.name == **name)) {
            return Err(format!("quantities.{name}: the work `{}` has no such quantity", lab.id));
        }
        for asked in lab.quantities() {
            let Some(given) = file.quantities.get(&asked.name) else {
                return Err(format!("quantities.{} is missing", asked.name));
            };
            if given.unit != asked.unit {
                return Err(format!("quantities.{}: unit `{}`, the work has `{}`", asked.name, given.unit, asked.unit));
            }
            // An X without uncertainty is a simulated one.
            if !(given.value.is_finite() && given.expanded_u.is_finite() && given.expanded_u > 0.0) {
                return Err(format!("quantities.{}: value and U must be numbers, U above 0", asked.name));
            }
        }
        let hidden = match lab.hunt() {
            Some(task) => hidden(&file.hunt, task)?,
            None if file.hunt.is_empty() => Vec::new(),
            None => return Err(format!("hunt: the work `{}` is no hunt", lab.id)),
        };
        Ok(TeacherReference {
            source: file.source,
            known: file.known,
            quantities: file.quantities,
            hidden,
            sha256: sha256_of(text.as_bytes()),
        })
    }

    /// The classes that are present in a log of a hunt and already part of `model_effects`: they are not hidden.
    pub fn class_in_model<'a>(&'a self, model_effects: &[&str]) -> Option<&'a str> {
        let classes: BTreeSet<&str> = model_effects.iter().filter_map(|effect| class_of(effect)).collect();
        self.hidden.iter().flat_map(|log| &log.present).map(String::as_str).find(|class| classes.contains(class))
    }
}

fn of_table(text: &str) -> Result<File, String> {
    toml::from_str(text).map_err(|e| e.to_string().trim_end().to_owned())
}

/// The values of the work in the record of a calibration.
fn of_record(text: &str, lab: &Lab) -> Result<File, String> {
    let json = serde_json::from_str(text).map_err(|e| format!("no record of a calibration: {e}"))?;
    let record = StoredRecord::from_json(&json)?;
    let header = &record.header;
    match &lab.task {
        Task::Session(task) if task.device == header.dut_kind => {}
        _ => return Err(format!("a calibration of `{}` is no reference of the work `{}`", header.dut_kind.name(), lab.id)),
    }
    let value = |name: &str| {
        let found = record.get(name)?;
        let unit = if found.unit.is_empty() { "1".to_owned() } else { found.unit.clone() };
        Some((name.to_owned(), ReferenceValue { value: found.value, expanded_u: found.expanded_u(), unit }))
    };
    let device = [header.sensor.as_str(), header.serial.as_str()].join(" ");
    Ok(File {
        source: format!("calibration `{}` of {} on {}, {}", header.dut_kind.name(), device.trim(), header.stand, header.began),
        known: BTreeMap::new(),
        quantities: lab.quantities().iter().filter_map(|asked| value(&asked.name)).collect(),
        hunt: BTreeMap::new(),
    })
}

/// What the logs hide, by the rules of the simulated hunt.
fn hidden(given: &BTreeMap<String, HiddenEntry>, task: &HuntTask) -> Result<Vec<Hidden>, String> {
    if let Some(log) = given.keys().find(|log| !task.logs.contains(log)) {
        return Err(format!("hunt.{log}: the hunt has the logs {}", task.logs.join(", ")));
    }
    let mut all = Vec::new();
    for log in &task.logs {
        let entry = given.get(log).ok_or_else(|| format!("hunt.{log} is missing"))?;
        let mut present = BTreeSet::new();
        for name in &entry.present {
            let class = if [NONE, UNKNOWN].contains(&name.as_str()) { Some(name.as_str()) } else { class_of(name) };
            present.insert(
                class
                    .ok_or_else(|| {
                        format!("hunt.{log}: `{name}` is no effect of the catalogue (`stand effects`), no `{NONE}` and no `{UNKNOWN}`")
                    })?
                    .to_owned(),
            );
        }
        if present.is_empty() || present.contains(NONE) && present.len() > 1 {
            return Err(format!("hunt.{log}: present must have `{NONE}` alone, or what is hidden"));
        }
        all.push(Hidden { log: log.clone(), present, description: entry.description.clone() });
    }
    let count = |class: &String| all.iter().filter(|log| log.present.contains(class)).count();
    if let Some(class) = all.iter().flat_map(|log| &log.present).find(|class| count(class) > task.max_same) {
        let most = task.max_same;
        return Err(format!("hunt: `{class}` is present in more than {most} logs, so that one answer for all logs could meet the limit"));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motor() -> Lab {
        Lab::find("motor").expect("a work")
    }

    fn table(lab: &Lab, u: &str) -> String {
        let quantities = lab.quantities().iter().map(|q| format!("[quantities.{}]\nvalue = 1\nU = {u}\nunit = \"{}\"\n", q.name, q.unit));
        format!("source = \"certificate 7\"\n{}", quantities.collect::<String>())
    }

    #[test]
    fn every_quantity_needs_a_value_with_a_positive_uncertainty_in_the_unit_of_the_work() {
        let lab = motor();
        let given = table(&lab, "0.1");
        assert_eq!(TeacherReference::parse(&given, &lab).expect("a reference").quantities.len(), 4);
        for wrong in [
            table(&lab, "0"),
            given.replace("\"H\"", "\"mH\""),
            given.replace("inductance_H", "inductance"),
            given.replace("certificate 7", ""),
            "source = \"x\"".to_owned(),
        ] {
            assert!(TeacherReference::parse(&wrong, &lab).is_err(), "{wrong}");
        }
        let is_changed = |text: &str| {
            TeacherReference::parse(text, &lab).expect("a reference").sha256
                != TeacherReference::parse(&given, &lab).expect("a reference").sha256
        };
        assert!(is_changed(&given.replace("0.1", "0.2")));
    }

    #[test]
    fn hunt_names_classes_and_no_class_in_more_than_two_logs() {
        let lab = Lab::find("hunt").expect("the hunt");
        let table = |present: [&str; 4]| {
            let logs = ["A", "B", "C", "D"].iter().zip(present);
            let entries: String =
                logs.map(|(log, present)| format!("[hunt.{log}]\npresent = [{present}]\ndescription = \"d\"\n")).collect();
            TeacherReference::parse(&format!("source = \"the teacher\"\n{entries}"), &lab)
        };
        let read = table(["\"none\"", "\"load\"", "\"brush-drop\"", "\"load\", \"cogging\""]).expect("a reference");
        assert_eq!(read.hidden.len(), 4);
        // `load` is of the family `offset`.
        assert_eq!(read.class_in_model(&["viscous", "load"]), Some("offset"));
        assert_eq!(read.class_in_model(&["viscous"]), None);
        assert!(table(["\"none\"", "\"load\"", "\"load\"", "\"load\""]).expect_err("three logs").contains("more than 2"));
        assert!(table(["\"none\", \"load\"", "\"load\"", "\"none\"", "\"cogging\""]).is_err());
        assert!(table(["\"nothing\"", "\"load\"", "\"none\"", "\"cogging\""]).is_err());
        assert!(table(["", "\"load\"", "\"none\"", "\"cogging\""]).is_err());
    }
}

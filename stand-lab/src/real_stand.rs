//! What a work folder states of a real stand, sealed with the teacher's key.
//!
//! A measurement on a real stand cannot be repeated bit for bit. In place of a replay the file `work.toml` has the hashes of the logs, a
//! code by which the teacher's reference is recognised, and the seal: the authentication code of this description under the teacher's key.
//! Whoever lacks the key can neither replace a log nor change the description, even with a journal written anew. The reference itself is
//! not in the folder.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::seal::{Attempt, Key};

/// Purposes of the authentication codes.
const SEAL: &str = "real stand";
const REFERENCE: &str = "reference";

/// The reply of a stand to `*IDN?` (IEEE 488.2, §10.14).
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StandIdentity {
    /// Manufacturer.
    pub manufacturer: String,
    /// Model.
    pub model: String,
    /// Serial number.
    pub serial: String,
    /// Firmware.
    pub firmware: String,
}

impl StandIdentity {
    /// Of the reply to `*IDN?`; fields that are missing are empty.
    pub fn of(reply: &str) -> Self {
        let mut fields = reply.splitn(4, ',').map(|field| field.trim().to_owned());
        let mut next = || fields.next().unwrap_or_default();
        StandIdentity { manufacturer: next(), model: next(), serial: next(), firmware: next() }
    }
}

impl std::fmt::Display for StandIdentity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {} {} ({})", self.manufacturer, self.model, self.serial, self.firmware)
    }
}

/// The real stand of a work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RealStand {
    /// Where the reference values are from, in the teacher's words; no values.
    pub reference_source: String,
    /// Authentication code of the reference: the same file gives the same code.
    pub reference_code: String,
    /// Authentication code of this description without the code itself.
    pub seal: String,
    /// Model of the drive with nothing hidden, for a hunt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// The stand.
    pub identity: StandIdentity,
    /// Values that replace those of the instructions.
    pub known: BTreeMap<String, f64>,
    /// SHA-256 of the logs by their paths in the work folder.
    pub logs: BTreeMap<String, String>,
}

impl RealStand {
    /// Fixes the reference with this hash, and seals the description.
    pub fn sealed(mut self, key: &Key, attempt: &Attempt, reference_sha256: &str) -> Self {
        self.reference_code = key.code(attempt, REFERENCE, reference_sha256);
        self.seal = key.code(attempt, SEAL, &self.content());
        self
    }

    /// The description is as it was sealed with this key for this attempt.
    pub fn is_sealed_by(&self, key: &Key, attempt: &Attempt) -> bool {
        self.seal == key.code(attempt, SEAL, &self.content())
    }

    /// The reference with this hash is that which was fixed at the start.
    pub fn has_reference(&self, key: &Key, attempt: &Attempt, reference_sha256: &str) -> bool {
        self.reference_code == key.code(attempt, REFERENCE, reference_sha256)
    }

    /// What is sealed: the description as JSON without the seal. The order of its fields is that of the structure; numbers have their
    /// shortest form.
    fn content(&self) -> String {
        let unsealed = RealStand { seal: String::new(), ..self.clone() };
        serde_json::to_string(&unsealed).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stand() -> RealStand {
        RealStand {
            reference_source: "certificate 7".to_owned(),
            reference_code: String::new(),
            seal: String::new(),
            model: None,
            identity: StandIdentity::of("Rotary Stand, F446, 12, 1.0 (abc, d)"),
            known: BTreeMap::from([("current_percent".to_owned(), 0.1)]),
            logs: BTreeMap::from([("logs/a.parquet".to_owned(), "00".to_owned())]),
        }
    }

    #[test]
    fn identity_has_the_four_fields_of_the_reply() {
        let identity = stand().identity;
        assert_eq!((identity.serial.as_str(), identity.firmware.as_str()), ("12", "1.0 (abc, d)"));
    }

    #[test]
    fn seal_finds_every_change_and_survives_the_file() {
        let (key, attempt) = (Key::practice(), Attempt { lab: "motor".to_owned(), student: "anna".to_owned(), number: 1 });
        let sealed = stand().sealed(&key, &attempt, "ff");
        let read: RealStand = toml::from_str(&toml::to_string(&sealed).expect("a table")).expect("a description");
        assert!(read.is_sealed_by(&key, &attempt) && read.has_reference(&key, &attempt, "ff"));
        assert!(!read.has_reference(&key, &attempt, "fe"));
        assert!(!read.is_sealed_by(&key, &Attempt { number: 2, ..attempt.clone() }));
        let changes: [fn(&mut RealStand); 4] = [
            |s| s.reference_source.push('x'),
            |s| s.identity.serial.push('x'),
            |s| s.known = BTreeMap::from([("current_percent".to_owned(), 0.2)]),
            |s| s.logs = BTreeMap::from([("logs/a.parquet".to_owned(), "01".to_owned())]),
        ];
        for change in changes {
            let mut changed = read.clone();
            change(&mut changed);
            assert!(!changed.is_sealed_by(&key, &attempt), "{changed:?}");
        }
    }
}

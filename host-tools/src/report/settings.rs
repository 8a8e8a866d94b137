//! Settings of a stand that were exported or imported, as text.

use crate::acquire::settings::{Difference, Imported, StandSettings};

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
    let is_scale = |difference: &&Difference| matches!(difference, Difference::Setting { after, .. } if after.is_scale());
    if result.differences.iter().any(|difference| is_scale(&difference)) {
        text += "scales changed: switch the stand off and on, they act from the next power-on on\n";
    }
    text
}

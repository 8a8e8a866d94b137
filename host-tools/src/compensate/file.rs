//! A compensation in a stand's file: the rest of the file stays as the person wrote it.

use stand_firmware::compensation::Compensation;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

/// A stand's file that says nothing: all of it is the default stand's.
pub const NEW: &str = "# What this file does not say is the default stand's.\n";

/// Why the compensation cannot be written.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FileError {
    /// The text is not TOML.
    #[error("{0}")]
    Toml(String),
    /// A key is there, but no table.
    #[error("{0} must be a table")]
    NoTable(&'static str),
}

/// The text with `[firmware.compensation]` as given, whatever it held before.
///
/// # Errors
/// The text is not TOML, or `firmware` is no table in it.
pub fn with_compensation(text: &str, compensation: &Compensation) -> Result<String, FileError> {
    let mut document: DocumentMut =
        text.parse().map_err(|e: toml_edit::TomlError| FileError::Toml(e.to_string().trim().replace('\n', " ")))?;
    let root = document.as_table_mut();
    if !root.contains_key("firmware") {
        let mut firmware = Table::new();
        // Only its own table is to be seen.
        firmware.set_implicit(true);
        root.insert("firmware", Item::Table(firmware));
    }
    let Some(firmware) = root.get_mut("firmware") else { return Err(FileError::NoTable("firmware")) };
    if let Some(inline) = firmware.as_inline_table() {
        *firmware = Item::Table(inline.clone().into_table());
    }
    let firmware = firmware.as_table_like_mut().ok_or(FileError::NoTable("firmware"))?;
    firmware.insert("compensation", Item::Table(table(compensation)));
    Ok(document.to_string())
}

fn table(compensation: &Compensation) -> Table {
    let mut table = Table::new();
    for (key, number) in [
        ("coulomb_N_m", compensation.coulomb_N_m),
        ("coulomb_fade_rad_s", compensation.coulomb_fade_rad_s),
        ("viscous_N_m_s", compensation.viscous_N_m_s),
        ("winding_lag_s", compensation.winding_lag_s),
    ] {
        put(&mut table, key, number);
    }
    let mut list = ArrayOfTables::new();
    for harmonic in compensation.harmonics.as_slice() {
        let mut entry = Table::new();
        entry.insert("order", value(i64::from(harmonic.order)));
        put(&mut entry, "torque_N_m", harmonic.torque_N_m);
        put(&mut entry, "phase_rad", harmonic.phase_rad);
        list.push(entry);
    }
    if !list.is_empty() {
        table.insert("harmonics", Item::ArrayOfTables(list));
    }
    table
}

/// A number with the digits that matter: a compensation is known to a thousandth at best.
fn put(table: &mut Table, key: &str, number: f64) {
    let short: f64 = format!("{number:.5e}").parse().unwrap_or(number);
    let text = zmij::Buffer::new().format(short).to_owned();
    table.insert(key, text.parse::<toml_edit::Value>().map_or_else(|_| value(short), Item::Value));
}

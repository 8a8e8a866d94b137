//! Writes a compensation into a stand file and keeps the rest of the file unchanged.

use stand_firmware::compensation::Compensation;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, TomlError, value};

/// A new stand file: all values are those of the default stand.
pub const NEW: &str = "# Values that are not given are those of the default stand.\n";

/// Why the compensation cannot be written.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FileError {
    /// The text is not TOML.
    #[error("{}", .0.to_string().trim().replace('\n', " "))]
    Toml(#[from] TomlError),
    /// The key exists and is not a table.
    #[error("{0} must be a table")]
    NoTable(&'static str),
}

/// The text with the table `[firmware.compensation]` replaced.
///
/// # Errors
/// The text is not TOML, or its `firmware` is not a table.
pub fn with_compensation(text: &str, compensation: &Compensation) -> Result<String, FileError> {
    let mut document: DocumentMut = text.parse()?;
    let root = document.as_table_mut();
    if !root.contains_key("firmware") {
        let mut firmware = Table::new();
        // The parent table needs no header of its own.
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

/// Inserts a number with six significant digits: a compensation is accurate to one part in a thousand at best.
fn put(table: &mut Table, key: &str, number: f64) {
    let short: f64 = format!("{number:.5e}").parse().unwrap_or(number);
    let text = zmij::Buffer::new().format(short).to_owned();
    table.insert(key, text.parse::<toml_edit::Value>().map_or_else(|_| value(short), Item::Value));
}

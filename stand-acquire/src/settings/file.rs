//! The file of a stand's settings: TOML with units, the identity of the stand, and a format version.
//!
//! Out: [`text`] of settings; in: the [`Content`] of a file, with each value checked against its range. A key that the file lacks is left
//! unchanged by an import.

use std::fmt::Write;

use stand_firmware::compensation::{Harmonic, MAX_HARMONIC_ORDER, MAX_HARMONICS};
use stand_firmware::gyro_loop::observer::parameters::{
    Field as Numbers, GAIN, GAMMA, MOMENT, REGULATOR, RESPONSE, SETTLE, STATES, TORQUER, VIBRATION, phi,
};
use stand_firmware::gyro_loop::observer::{MAX_STATES, ObserverParameters};
use stand_firmware::settings::{FIELDS, Field, Kept};
use toml::{Table, Value};

use super::{COULOMB, Content, StandSettings};
use identification::words::nearest;

/// Version of the format.
pub const FORMAT: i64 = 1;
/// Range of an observer's number, as the console accepts it.
const ANY: (f64, f64) = (-1e18, 1e18);

/// Why a file of settings is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
pub enum FileError {
    #[error("line {line}: {message}")]
    Toml { line: usize, message: String },
    #[error("this is not a file of settings: `format = {FORMAT}` is missing")]
    NoFormat,
    #[error("format = {0}: this program reads format {FORMAT}")]
    Format(Value),
    #[error("{key}: there is no such key{}", suggestion(.nearest))]
    UnknownKey { key: String, nearest: Option<String> },
    #[error("{key} = {value}: expected {expected}")]
    Value { key: String, value: String, expected: String },
    #[error("{key} is missing")]
    Missing { key: String },
}

fn suggestion(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or(String::new(), |name| format!("; did you mean `{name}`?"))
}

/// The text of a file with these settings; `identity` is the stand's reply to `*IDN?`, `date` the time of the export.
pub fn text(settings: &StandSettings, identity: &str, date: &str) -> String {
    let fields: Vec<&str> = identity.split(',').collect();
    let field = |n: usize| Value::from(fields.get(n).copied().unwrap_or_default());
    let mut text = String::from("# Settings of a rotary stand; `stand settings import` writes them into a stand.\n");
    text += "# A unit is at the end of each name and, in the console's spelling, behind each value.\n";
    text += "# A key that is deleted here keeps the value of the stand.\n";
    // Writing into a string cannot fail.
    let _ = writeln!(text, "format = {FORMAT}\n\n[stand]\nmodel = {}\nserial = {}\nfirmware = {}", field(1), field(2), field(3));
    let _ = writeln!(text, "exported = {}", Value::from(date));
    for (title, is_scale) in [("[settings]", false), ("[scales] # of the hardware; they act from the next power-on on", true)] {
        let _ = writeln!(text, "\n{title}");
        for setting in settings.settings.iter().filter(|setting| setting.is_scale() == is_scale) {
            let _ = write!(text, "{} = {:?}", setting.name, setting.value);
            text += &if setting.unit.is_empty() { "\n".to_owned() } else { format!(" # {}\n", setting.unit) };
        }
    }
    text += "\n[compensation]\n# Torque of the disturbance: torque_N_m · sin(order · angle from the index + phase_rad).\nharmonics = [\n";
    for h in &settings.harmonics {
        let _ = writeln!(text, "    {{ order = {}, torque_N_m = {:?}, phase_rad = {:?} }},", h.order, h.torque_N_m, h.phase_rad);
    }
    text += "]\n\n[observer]\n";
    let observer = &settings.observer;
    let states = observer.states();
    let _ = writeln!(text, "states = {states}{}", if states == 0 { " # none" } else { "" });
    if states == 0 {
        return text;
    }
    let list = |field: Numbers| {
        let count = if field.count == MAX_STATES { states } else { field.count };
        format!("[{}]", observer.get(field)[..count].iter().map(|number| format!("{number:?}")).collect::<Vec<_>>().join(", "))
    };
    let _ = writeln!(text, "moment = {} # the last state is a disturbing moment, N m", observer.value(MOMENT) != 0.0);
    text += "phi = [\n";
    (0..states).for_each(|row| text += &format!("    {},\n", list(phi(row))));
    let _ = writeln!(text, "]\ngamma = {} # per N m\ngain = {} # per rad", list(GAMMA), list(GAIN));
    let _ = writeln!(text, "regulator = {} # N m", list(REGULATOR));
    let _ = writeln!(text, "torquer_N_m_A = {:?}\nsettle_s = {:?}", observer.value(TORQUER), observer.value(SETTLE));
    let _ = writeln!(text, "vibration = {} # seconds of whole periods; H/k, s; (Jx-Jz)/k, s2", list(VIBRATION));
    let _ = writeln!(text, "response = {} # of the observer at the vibration frequency; zeros: not known", list(RESPONSE));
    text
}

/// Reads the text of a file and checks each value.
///
/// # Errors
/// The first error, with its key and value.
pub fn parse(text: &str) -> Result<Content, FileError> {
    let file: Table = toml::from_str(text).map_err(|e| {
        let line = e.span().map_or(1, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        FileError::Toml { line, message: e.message().replace('\n', " ") }
    })?;
    match file.get("format") {
        None => return Err(FileError::NoFormat),
        Some(Value::Integer(FORMAT)) => {}
        Some(other) => return Err(FileError::Format(other.clone())),
    }
    known(&file, "", &["format", "stand", "settings", "scales", "compensation", "observer"])?;
    let mut content = Content::default();
    if let Some(stand) = table(&file, "stand")? {
        let word = |key: &str| stand.get(key).and_then(Value::as_str).unwrap_or("?").to_owned();
        content.source = ["model", "serial", "firmware"].map(word).join(",");
    }
    for (group, is_scale) in [("settings", false), ("scales", true)] {
        for (name, value) in table(&file, group)?.into_iter().flatten() {
            content.settings.push((name.clone(), setting(group, is_scale, name, value)?));
        }
    }
    if let Some(compensation) = table(&file, "compensation")? {
        known(compensation, "compensation.", &["harmonics"])?;
        content.harmonics = compensation.get("harmonics").map(harmonics).transpose()?;
    }
    content.observer = table(&file, "observer")?.map(observer).transpose()?;
    Ok(content)
}

fn table<'f>(file: &'f Table, key: &str) -> Result<Option<&'f Table>, FileError> {
    let Some(value) = file.get(key) else { return Ok(None) };
    value.as_table().map(Some).ok_or_else(|| wrong(key, value, "a table"))
}

/// Checks that all keys of a table are known.
fn known(table: &Table, path: &str, keys: &[&str]) -> Result<(), FileError> {
    match table.keys().find(|key| !keys.contains(&key.as_str())) {
        None => Ok(()),
        Some(key) => Err(FileError::UnknownKey { key: format!("{path}{key}"), nearest: nearest(key, keys.iter().copied()) }),
    }
}

fn wrong(key: &str, value: &Value, expected: impl Into<String>) -> FileError {
    FileError::Value { key: key.to_owned(), value: value.to_string(), expected: expected.into() }
}

/// A finite number in a range.
fn number(key: &str, value: &Value, (least, greatest): (f64, f64)) -> Result<f64, FileError> {
    let found = match value {
        Value::Float(number) => *number,
        Value::Integer(number) => *number as f64,
        _ => return Err(wrong(key, value, "a number")),
    };
    if found >= least && found <= greatest { Ok(found) } else { Err(wrong(key, value, format!("a number from {least:?} to {greatest:?}"))) }
}

fn setting(group: &str, is_scale: bool, name: &str, value: &Value) -> Result<f64, FileError> {
    let key = format!("{group}.{name}");
    let Some(field) = Field::named(name.as_bytes()).filter(|field| field.is_scale == is_scale && field.name == name) else {
        let names = FIELDS.iter().filter(|field| field.is_scale == is_scale).map(|field| field.name);
        return Err(FileError::UnknownKey { key, nearest: nearest(name, names) });
    };
    // The listed range of this one is that of the default drive; the whole is checked against the drive in force.
    let greatest = if name == COULOMB { 1e3 } else { field.greatest };
    let found = number(&key, value, (field.least, greatest))?;
    let mut kept = Kept::default();
    (field.write)(&mut kept, found);
    if (field.read)(&kept) == found { Ok(found) } else { Err(wrong(&key, value, "a whole number")) }
}

fn harmonics(value: &Value) -> Result<Vec<Harmonic>, FileError> {
    let key = "compensation.harmonics";
    let list = value.as_array().ok_or_else(|| wrong(key, value, "a list of harmonics"))?;
    if list.len() > MAX_HARMONICS {
        return Err(FileError::Value {
            key: key.to_owned(),
            value: format!("{} harmonics", list.len()),
            expected: format!("at most {MAX_HARMONICS}"),
        });
    }
    let mut all: Vec<Harmonic> = Vec::new();
    for (n, value) in list.iter().enumerate() {
        let path = format!("{key}[{n}]");
        let entry = value.as_table().ok_or_else(|| wrong(&path, value, "{ order, torque_N_m, phase_rad }"))?;
        known(entry, &format!("{path}."), &["order", "torque_N_m", "phase_rad"])?;
        let of = |name: &str, range| {
            let key = format!("{path}.{name}");
            let value = entry.get(name).ok_or_else(|| FileError::Missing { key: key.clone() })?;
            number(&key, value, range)
        };
        let order = of("order", (1.0, f64::from(MAX_HARMONIC_ORDER)))?;
        if order.fract() != 0.0 || all.iter().any(|h| f64::from(h.order) == order) {
            return Err(wrong(&format!("{path}.order"), &entry["order"], "a whole number that no other harmonic has"));
        }
        let torque_N_m = of("torque_N_m", (0.0, 1e3))?;
        if torque_N_m == 0.0 {
            return Err(wrong(&format!("{path}.torque_N_m"), &entry["torque_N_m"], "more than 0; delete the harmonic"));
        }
        all.push(Harmonic { order: order as u16, torque_N_m, phase_rad: of("phase_rad", (-1e3, 1e3))? });
    }
    Ok(all)
}

fn observer(table: &Table) -> Result<ObserverParameters, FileError> {
    let keys = ["states", "moment", "phi", "gamma", "gain", "regulator", "torquer_N_m_A", "settle_s", "vibration", "response"];
    known(table, "observer.", &keys)?;
    let get = |name: &str| {
        let key = format!("observer.{name}");
        table.get(name).map(|value| (key.clone(), value)).ok_or(FileError::Missing { key })
    };
    let mut observer = ObserverParameters::default();
    let (key, value) = get("states")?;
    let states = match value.as_integer() {
        Some(0) => return Ok(observer),
        Some(states) if (2..=MAX_STATES as i64).contains(&states) => states as usize,
        _ => return Err(wrong(&key, value, format!("0 or a whole number from 2 to {MAX_STATES}"))),
    };
    observer.get_mut(STATES).fill(states as f64);
    let (key, value) = get("moment")?;
    let has_moment = value.as_bool().ok_or_else(|| wrong(&key, value, "true or false"))?;
    observer.get_mut(MOMENT).fill(f64::from(u8::from(has_moment)));
    let mut fill = |key: &str, value: &Value, field: Numbers, count: usize| {
        let list = value.as_array().filter(|list| list.len() == count);
        let list = list.ok_or_else(|| wrong(key, value, format!("a list of {count} numbers")))?;
        for (n, (to, value)) in observer.get_mut(field).iter_mut().zip(list).enumerate() {
            *to = number(&format!("{key}[{n}]"), value, ANY)?;
        }
        Ok(())
    };
    let (key, value) = get("phi")?;
    let rows = value.as_array().filter(|rows| rows.len() == states);
    for (n, row) in rows.ok_or_else(|| wrong(&key, value, format!("a list of {states} rows")))?.iter().enumerate() {
        fill(&format!("{key}[{n}]"), row, phi(n), states)?;
    }
    for (name, field, count) in
        [("gamma", GAMMA, states), ("gain", GAIN, states), ("regulator", REGULATOR, states), ("vibration", VIBRATION, 3)]
    {
        let (key, value) = get(name)?;
        fill(&key, value, field, count)?;
    }
    // Files of earlier versions do not have it.
    if let Ok((key, value)) = get("response") {
        fill(&key, value, RESPONSE, RESPONSE.count)?;
    }
    // 0: not set, as after `OBServer:NEW`; otherwise the console's range.
    let (key, value) = get("torquer_N_m_A")?;
    let torquer = number(&key, value, (0.0, 1e6))?;
    if torquer != 0.0 && torquer < 1e-12 {
        return Err(wrong(&key, value, "0 or a number from 1e-12 to 1e6"));
    }
    observer.get_mut(TORQUER).fill(torquer);
    let (key, value) = get("settle_s")?;
    observer.get_mut(SETTLE).fill(number(&key, value, (0.0, 1e5))?);
    Ok(observer)
}

//! `*LRN?` (IEEE 488.2 §10.17): all that `SETTings:SAVE` keeps, as the commands that restore it, one per line.
//!
//! Sent back in this order with the drive off, the commands give the same settings from any others: the defaults come first, and from them
//! each number in the order of the list is valid where the whole is. Numbers have 17 digits: nine would move the poles of an observer with
//! seven equal ones by (1e-9)^(1/7), 5 %.

use super::{Action, Entry, List, entry};
use crate::app::state::State;
use crate::gyro_loop::observer::MAX_STATES;
use crate::gyro_loop::observer::parameters::{
    Field, GAIN, GAMMA, MOMENT, ObserverParameters, REGULATOR, RESPONSE, SETTLE, TORQUER, VIBRATION, phi,
};
use crate::settings::FIELDS;
use crate::text::Significant;
use core::fmt::{self, Write};

/// Digits of a number.
const DIGITS: u32 = 17;
/// Commands that come before the numbers.
const FIRST: [&str; 2] = ["SETTings:RESet", "COMPensation:CLEar"];

pub(super) const ENTRIES: &[Entry] =
    &[entry("*LRN", Action::ListQuery(List::Learn), "commands that restore settings, compensation and observer")];

/// A command of the list; `false` after the last.
pub(super) fn line(state: &State<'_>, line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    if let Some(command) = FIRST.get(line) {
        out.write_str(command)?;
        return Ok(true);
    }
    let kept = state.settings.kept.get();
    let line = line.saturating_sub(FIRST.len());
    if let Some(field) = FIELDS.get(line) {
        match field.name {
            // The range of the setting is that of the default drive; this command has the range of the drive in force.
            "coulomb_N_m" => out.write_str("COMPensation:COULomb")?,
            name => write!(out, "SETTings:{name}")?,
        }
        write!(out, " {}", Significant((field.read)(&kept), DIGITS))?;
        let unit = field.quantity().unit;
        if !unit.is_empty() {
            write!(out, " {unit}")?;
        }
        return Ok(true);
    }
    let line = line.saturating_sub(FIELDS.len());
    let harmonics = kept.settings.compensation.harmonics;
    if let Some(harmonic) = harmonics.as_slice().get(line) {
        let (torque, phase) = (Significant(harmonic.torque_N_m, DIGITS), Significant(harmonic.phase_rad, DIGITS));
        write!(out, "COMPensation:HARMonic {},{torque} N.M,{phase} RAD", harmonic.order)?;
        return Ok(true);
    }
    observer_line(&state.gyro.observer.parameters(), line.saturating_sub(harmonics.as_slice().len()), out)
}

/// A command of the observer.
fn observer_line(numbers: &ObserverParameters, line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    let states = numbers.states();
    let Some(line) = line.checked_sub(1) else {
        match states {
            0 => out.write_str("OBServer:CLEar")?,
            _ => write!(out, "OBServer:NEW {states},{}", if numbers.value(MOMENT) == 0.0 { "OFF" } else { "ON" })?,
        }
        return Ok(true);
    };
    if line < states {
        write!(out, "OBServer:PHI {},", line.saturating_add(1))?;
        write_numbers(numbers, phi(line), states, out)?;
        return Ok(true);
    }
    const REST: [(&str, Field, &str); 7] = [
        ("GAMMa", GAMMA, ""),
        ("GAIN", GAIN, ""),
        ("REGulator", REGULATOR, ""),
        ("TORQuer", TORQUER, " N.M/A"),
        ("SETTle", SETTLE, " S"),
        ("VIBRation", VIBRATION, ""),
        ("RESPonse", RESPONSE, ""),
    ];
    // `OBServer:NEW` sets the torquer's constant to 0, which its command does not accept: it is sent only once it was set.
    let is_sent = |place: Field| states > 0 && (place != TORQUER || numbers.value(TORQUER) != 0.0);
    let Some((name, place, unit)) = REST.iter().filter(|(_, place, _)| is_sent(*place)).nth(line.saturating_sub(states)) else {
        return Ok(false);
    };
    write!(out, "OBServer:{name} ")?;
    write_numbers(numbers, *place, states, out)?;
    out.write_str(unit)?;
    Ok(true)
}

/// The numbers of a field with commas between them; one for each state where the field has one for each.
fn write_numbers(numbers: &ObserverParameters, place: Field, states: usize, out: &mut dyn Write) -> fmt::Result {
    let count = if place.count == MAX_STATES { states } else { place.count };
    for (n, number) in numbers.get(place).iter().take(count).enumerate() {
        write!(out, "{}{}", if n == 0 { "" } else { "," }, Significant(*number, DIGITS))?;
    }
    Ok(())
}

//! All settings of a stand, read from and written to a stand behind a serial port or a file ([`file`]).
//!
//! In: the commands with which the stand replies to `*LRN?`. Out: [`StandSettings`]; [`import`] writes them into a stand with its drive
//! off, saves them in its flash, and reads them back. The stand's list determines which settings exist, so that a setting of a newer
//! firmware is carried too.

pub mod file;

use stand_firmware::compensation::{Harmonic, Harmonics};
use stand_firmware::config::ConfigError;
use stand_firmware::gyro_loop::observer::parameters::{GAIN, GAMMA, MOMENT, REGULATOR, RESPONSE, SETTLE, STATES, TORQUER, VIBRATION, phi};
use stand_firmware::gyro_loop::observer::{MAX_STATES, ObserverParameters};
use stand_firmware::settings::{Field, Kept};

use super::link::{LinkError, SerialLink};

/// Greatest relative difference of a number that was sent to a stand and read back: 17 digits, and the few roundings of both conversions.
pub const READ_BACK_TOLERANCE: f64 = 1e-14;
/// Bits of `STATus:OPERation:CONDition?`: calibrating, driving, profile.
const DRIVE_BITS: u32 = 1 | 256 | 512;
/// The setting with a command of its own, whose range is that of the drive in force.
pub(crate) const COULOMB: &str = "coulomb_N_m";
/// Fields of an observer beside Φ.
const OBSERVER_FIELDS: [stand_firmware::gyro_loop::observer::parameters::Field; 9] =
    [STATES, MOMENT, GAMMA, GAIN, REGULATOR, TORQUER, SETTLE, VIBRATION, RESPONSE];

/// A setting of a stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Name, with its unit at the end.
    pub name: String,
    /// Value in that unit.
    pub value: f64,
    /// Unit in the console's spelling; empty for a plain number.
    pub unit: String,
}

impl Setting {
    /// It is a scale of the hardware, which acts from the next power-on on.
    pub fn is_scale(&self) -> bool {
        Field::named(self.name.as_bytes()).is_some_and(|field| field.is_scale)
    }
}

/// All that a stand keeps in its flash.
#[derive(Debug, Clone, PartialEq)]
pub struct StandSettings {
    /// Settings and scales, in the stand's order.
    pub settings: Vec<Setting>,
    /// Harmonics of the compensation.
    pub harmonics: Vec<Harmonic>,
    /// Parameters of the observer; no states: there is none.
    pub observer: ObserverParameters,
}

/// Settings that a file states; what it lacks is left unchanged.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Content {
    /// Identity of the stand that the file was exported from, as `*IDN?` replies it without the manufacturer.
    pub source: String,
    /// Settings and scales: name and value.
    pub settings: Vec<(String, f64)>,
    /// All harmonics of the compensation.
    pub harmonics: Option<Vec<Harmonic>>,
    /// The observer; no states: none.
    pub observer: Option<ObserverParameters>,
}

/// Why settings were not read or written.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The serial line fails, or the stand rejects a query.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// A line of `*LRN?` is not one of the known commands.
    #[error("`*LRN?` returned `{line}`, which this program does not know; use the program of the stand's firmware version")]
    Reply {
        /// The line.
        line: String,
    },
    /// The drive is on.
    #[error("{port}: {activity}; nothing was written: OUTPut OFF first, or wait for its end")]
    Busy {
        /// The port.
        port: String,
        /// The activity of the stand.
        activity: &'static str,
    },
    /// The stand has no setting of this name.
    #[error("{name}: the stand has no such setting; its firmware is another version than the file's")]
    Unknown {
        /// The setting.
        name: String,
    },
    /// The settings as a whole are invalid.
    #[error("{error}; nothing was written")]
    Invalid {
        /// The parameter and its limit.
        error: ConfigError,
    },
    /// The stand rejected a command; its settings from before are in force again.
    #[error("{error}; the previous settings were restored")]
    Restored {
        /// The stand's error.
        error: LinkError,
    },
    /// A setting that was read back differs from the one that was sent.
    #[error("{port}: {difference} after it was sent; check the serial line and import again")]
    ReadBack {
        /// The port.
        port: String,
        /// The difference, with the sent value first.
        difference: String,
    },
}

/// A difference between two sets of settings.
#[derive(Debug, Clone, PartialEq)]
pub enum Difference {
    /// A setting.
    Setting {
        /// Value before.
        before: f64,
        /// The setting after.
        after: Setting,
    },
    /// A harmonic; `None`: there is none of this order.
    Harmonic {
        /// Periods per turn.
        order: u16,
        /// Before.
        before: Option<Harmonic>,
        /// After.
        after: Option<Harmonic>,
    },
    /// The observer.
    Observer {
        /// Names of the fields that differ.
        fields: Vec<String>,
        /// Number of states before; 0: no observer.
        states_before: usize,
        /// Number of states after.
        states_after: usize,
    },
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Difference::Setting { before, after } => {
                write!(f, "{}: {before:?} → {:?}", after.name, after.value)?;
                if after.unit.is_empty() { Ok(()) } else { write!(f, " {}", after.unit) }
            }
            Difference::Harmonic { order, before, after } => {
                let text = |harmonic: &Option<Harmonic>| {
                    harmonic.map_or("none".to_owned(), |h| format!("{:?} N.M, {:?} RAD", h.torque_N_m, h.phase_rad))
                };
                write!(f, "harmonic of order {order}: {} → {}", text(before), text(after))
            }
            Difference::Observer { fields, states_before, states_after } => {
                let text = |states: &usize| if *states == 0 { "none".to_owned() } else { format!("{states} states") };
                write!(f, "observer: {} → {}", text(states_before), text(states_after))?;
                if *states_before > 0 && *states_after > 0 { write!(f, " ({})", fields.join(", ")) } else { Ok(()) }
            }
        }
    }
}

/// Result of an import.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// What differed before.
    pub differences: Vec<Difference>,
}

/// Reads all settings of a stand.
///
/// # Errors
/// The line fails, or the reply is not understood.
pub fn read(link: &mut SerialLink) -> Result<StandSettings, SettingsError> {
    of_reply(link.query_lines("*LRN?")?)
}

/// The settings that the reply to `*LRN?` states.
///
/// # Errors
/// A line is not understood.
pub fn of_reply(lines: Vec<String>) -> Result<StandSettings, SettingsError> {
    let mut found = StandSettings { settings: Vec::new(), harmonics: Vec::new(), observer: ObserverParameters::default() };
    for line in lines {
        found.take(&line).ok_or(SettingsError::Reply { line })?;
    }
    Ok(found)
}

/// Writes settings into a stand, saves them in its flash, and reads them back. `content` is what a file states; other settings keep the
/// stand's values. `show` receives the differences before anything is written.
///
/// # Errors
/// As [`SettingsError`]. The drive must be off. If the stand rejects a command its previous settings are restored.
pub fn import(link: &mut SerialLink, content: &Content, show: impl FnOnce(&[Difference])) -> Result<Imported, SettingsError> {
    let before = read(link)?;
    let after = before.with(content)?;
    after.check()?;
    require_at_rest(link)?;
    let differences = before.differences(&after);
    show(&differences);
    if !differences.is_empty()
        && let Err(error) = send(link, &after)
    {
        if !matches!(error, LinkError::Rejected { .. }) {
            return Err(error.into());
        }
        send(link, &before)?;
        return Err(SettingsError::Restored { error });
    }
    link.command("SETTings:SAVE")?;
    let read_back = read(link)?;
    if let Some(difference) = after.differences(&read_back).first() {
        return Err(SettingsError::ReadBack { port: link.name(), difference: difference.to_string() });
    }
    Ok(Imported { differences })
}

fn send(link: &mut SerialLink, settings: &StandSettings) -> Result<(), LinkError> {
    settings.commands().iter().try_for_each(|command| link.command(command))
}

/// Refuses a stand with its drive on or a measurement running.
fn require_at_rest(link: &mut SerialLink) -> Result<(), SettingsError> {
    let busy = |link: &SerialLink, activity| Err(SettingsError::Busy { port: link.name(), activity });
    let condition = link.query("STATus:OPERation:CONDition?")?;
    // A reply that is not a number is no permission.
    if condition.parse::<f64>().map_or(true, |bits| bits as u32 & DRIVE_BITS != 0) {
        return busy(link, "the drive is on");
    }
    if !link.query("DRIFt:STATe?")?.starts_with("IDLE") {
        return busy(link, "a drift measurement runs");
    }
    Ok(())
}

fn is_equal(a: f64, b: f64) -> bool {
    a == b || (a - b).abs() <= READ_BACK_TOLERANCE * a.abs().max(b.abs())
}

fn are_equal(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| is_equal(*a, *b))
}

/// The number at the beginning of a parameter, without its unit.
fn number(text: &str) -> Option<f64> {
    text.split_whitespace().next()?.parse().ok()
}

impl StandSettings {
    /// Takes a line of `*LRN?`; `None` if it is not known.
    fn take(&mut self, line: &str) -> Option<()> {
        let (header, rest) = line.split_once(' ').unwrap_or((line, ""));
        let (group, name) = header.split_once(':')?;
        match (group, name) {
            ("SETTings", "RESet") | ("COMPensation" | "OBServer", "CLEar") => {}
            ("SETTings", _) | ("COMPensation", "COULomb") => {
                let name = if name == "COULomb" { COULOMB } else { name };
                let (value, unit) = rest.split_once(' ').unwrap_or((rest, ""));
                self.settings.push(Setting { name: name.to_owned(), value: value.parse().ok()?, unit: unit.to_owned() });
            }
            ("COMPensation", "HARMonic") => {
                let [order, torque, phase] = rest.split(',').collect::<Vec<_>>().try_into().ok()?;
                let harmonic = Harmonic { order: order.parse().ok()?, torque_N_m: number(torque)?, phase_rad: number(phase)? };
                self.harmonics.push(harmonic);
            }
            ("OBServer", "NEW") => {
                let (states, has_moment) = rest.split_once(',')?;
                self.observer.get_mut(STATES).fill(number(states)?);
                self.observer.get_mut(MOMENT).fill(f64::from(u8::from(has_moment == "ON")));
            }
            ("OBServer", name) => {
                let mut numbers = rest.split(',').map(number).collect::<Option<Vec<_>>>()?;
                let field = match name {
                    "PHI" => {
                        let row = numbers.remove(0) as usize;
                        phi((1..=MAX_STATES).contains(&row).then(|| row - 1)?)
                    }
                    "GAMMa" => GAMMA,
                    "GAIN" => GAIN,
                    "REGulator" => REGULATOR,
                    "TORQuer" => TORQUER,
                    "SETTle" => SETTLE,
                    "VIBRation" => VIBRATION,
                    "RESPonse" => RESPONSE,
                    _ => return None,
                };
                self.observer.get_mut(field).get_mut(..numbers.len())?.copy_from_slice(&numbers);
            }
            _ => return None,
        }
        Some(())
    }

    /// The commands that give a stand these settings, from any others. Numbers are in the shortest form that reads back exactly.
    fn commands(&self) -> Vec<String> {
        let list = |numbers: &[f64]| numbers.iter().map(|number| format!("{number:e}")).collect::<Vec<_>>().join(",");
        let mut commands = vec!["SETTings:RESet".to_owned(), "COMPensation:CLEar".to_owned()];
        for Setting { name, value, unit } in &self.settings {
            let header = if name == COULOMB { "COMPensation:COULomb".to_owned() } else { format!("SETTings:{name}") };
            commands.push(format!("{header} {value:e} {unit}").trim_end().to_owned());
        }
        let harmonics = self.harmonics.iter();
        commands.extend(harmonics.map(|h| format!("COMPensation:HARMonic {},{:e} N.M,{:e} RAD", h.order, h.torque_N_m, h.phase_rad)));
        let observer = &self.observer;
        let states = observer.states();
        if states == 0 {
            commands.push("OBServer:CLEar".to_owned());
            return commands;
        }
        commands.push(format!("OBServer:NEW {states},{}", if observer.value(MOMENT) == 0.0 { "OFF" } else { "ON" }));
        commands.extend((0..states).map(|row| format!("OBServer:PHI {},{}", row + 1, list(&observer.get(phi(row))[..states]))));
        for (name, field) in [("GAMMa", GAMMA), ("GAIN", GAIN), ("REGulator", REGULATOR)] {
            commands.push(format!("OBServer:{name} {}", list(&observer.get(field)[..states])));
        }
        // 0 is the value after `OBServer:NEW`; the command does not accept it.
        if observer.value(TORQUER) != 0.0 {
            commands.push(format!("OBServer:TORQuer {:e} N.M/A", observer.value(TORQUER)));
        }
        commands.push(format!("OBServer:SETTle {:e} S", observer.value(SETTLE)));
        commands.push(format!("OBServer:VIBRation {}", list(observer.get(VIBRATION))));
        commands.push(format!("OBServer:RESPonse {}", list(observer.get(RESPONSE))));
        commands
    }

    /// These settings with those of a file in their place.
    fn with(&self, content: &Content) -> Result<Self, SettingsError> {
        let mut after = self.clone();
        for (name, value) in &content.settings {
            let setting = after.settings.iter_mut().find(|setting| setting.name == *name);
            setting.ok_or_else(|| SettingsError::Unknown { name: name.clone() })?.value = *value;
        }
        if let Some(harmonics) = &content.harmonics {
            after.harmonics.clone_from(harmonics);
        }
        if let Some(observer) = content.observer {
            after.observer = observer;
        }
        Ok(after)
    }

    /// The settings as the firmware keeps them, without the observer. A setting that this program does not know is left out.
    pub fn kept(&self) -> Kept {
        let mut kept = Kept::default();
        for setting in &self.settings {
            if let Some(field) = Field::named(setting.name.as_bytes()) {
                (field.write)(&mut kept, setting.value);
            }
        }
        kept.settings.compensation.harmonics = Harmonics::of(self.harmonics.iter().copied()).unwrap_or_default();
        kept
    }

    /// The firmware's own check of the whole, before anything is sent.
    fn check(&self) -> Result<(), SettingsError> {
        self.kept().config().map(drop).map_err(|error| SettingsError::Invalid { error })
    }

    /// What differs in `after`.
    pub fn differences(&self, after: &Self) -> Vec<Difference> {
        let mut differences = Vec::new();
        for setting in &after.settings {
            let before = self.settings.iter().find(|s| s.name == setting.name).map_or(f64::NAN, |s| s.value);
            if !is_equal(before, setting.value) {
                differences.push(Difference::Setting { before, after: setting.clone() });
            }
        }
        let of = |harmonics: &[Harmonic], order| harmonics.iter().find(|h| h.order == order).copied();
        let mut orders: Vec<u16> = self.harmonics.iter().chain(&after.harmonics).map(|h| h.order).collect();
        orders.sort_unstable();
        orders.dedup();
        for order in orders {
            let (before, after) = (of(&self.harmonics, order), of(&after.harmonics, order));
            let numbers = |h: Harmonic| [h.torque_N_m, h.phase_rad];
            let same = before.zip(after).is_some_and(|(before, after)| are_equal(&numbers(before), &numbers(after)));
            if !same {
                differences.push(Difference::Harmonic { order, before, after });
            }
        }
        let (states_before, states_after) = (self.observer.states(), after.observer.states());
        let rows = (0..MAX_STATES).map(phi).filter(|row| !are_equal(self.observer.get(*row), after.observer.get(*row)));
        let rest = OBSERVER_FIELDS.into_iter().filter(|field| !are_equal(self.observer.get(*field), after.observer.get(*field)));
        let mut fields: Vec<String> = rows.chain(rest).map(|field| field.name.to_owned()).collect();
        fields.dedup();
        if !fields.is_empty() {
            differences.push(Difference::Observer { fields, states_before, states_after });
        }
        differences
    }
}

#[cfg(test)]
mod tests;

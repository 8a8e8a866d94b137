//! What the columns of another program's table probably are, by their names and stated units; [`super::questions`] compares them with the
//! values.
//!
//! Nothing is used without consent: the user accepts a [`Belief`] or states something else.

use super::names::{self, own_name, targets};
use super::programs::Program;
use super::table::{Table, TableColumn};
use super::units::{Quantity, Unit, UnitMark, split_name};
use crate::log::{axis, known, plausible};
use crate::statistics::Extremes;

/// Why a column is believed to be something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evidence {
    /// The user or an import file states it.
    Stated,
    /// Its name is that of a column of the project.
    OwnName,
    /// Name and unit say it.
    NameAndUnit,
    /// The name says the quantity; no unit is stated, that of the project is assumed.
    NameOnly,
    /// The name says the quantity; the values suggest the unit.
    NameAndValues,
    /// The name says the quantity; the unit makes the rate the derivative of the angle.
    RateAgainstAngle,
    /// The user states what it is; the file states a unit of something else.
    OtherUnit,
    /// A setpoint, believed to be in the unit of the reading.
    LikeTheReading,
    /// A voltage that is constant: the supply.
    ConstantVoltage,
    /// The unit says the quantity, and no other column has it.
    UnitOnly,
    /// The header is that of this program.
    Program(&'static str),
    /// The only column that increases evenly: a time.
    IncreasesEvenly,
    /// Nothing is known: it can be used in expressions.
    Unknown,
}

/// What a column is believed to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Belief {
    /// Name in the file.
    pub source: String,
    /// Name of the column of the project, or of the user's own; `None`: not used.
    pub target: Option<String>,
    /// Unit of the numbers in the file; `None` for a column of the user's own.
    pub unit: Option<Unit>,
    /// Why.
    pub evidence: Evidence,
    /// The unit is not certain: these fit the values too.
    pub alternatives: Vec<String>,
    /// Other columns whose names say the same.
    pub rivals: Vec<String>,
    /// The name says that it is a quantity of the motor.
    pub(super) of_motor: bool,
    /// It is a voltage that was asked for: the motor's, if no other column is.
    pub(super) is_voltage_setpoint: bool,
    /// It is the duty of a bridge: the motor's voltage, as a part of the supply, if no other column is.
    pub(super) is_duty: bool,
    /// Words of the name without its unit: `timestamp` says more clearly what it is than `timestamp_sample`.
    pub(super) words: usize,
}

impl Belief {
    /// A column of which nothing is known.
    pub(super) fn unknown(name: &str) -> Belief {
        Belief {
            source: name.to_owned(),
            target: None,
            unit: None,
            evidence: Evidence::Unknown,
            alternatives: Vec::new(),
            rivals: Vec::new(),
            of_motor: false,
            is_voltage_setpoint: false,
            is_duty: false,
            words: 0,
        }
    }

    /// Nothing more is believed.
    fn forget(&mut self) {
        (self.target, self.unit, self.evidence) = (None, None, Evidence::Unknown);
    }

    /// No unit is stated.
    pub(super) fn lacks_unit(&self) -> bool {
        matches!(
            self.evidence,
            Evidence::NameOnly
                | Evidence::NameAndValues
                | Evidence::RateAgainstAngle
                | Evidence::LikeTheReading
                | Evidence::IncreasesEvenly
        )
    }
}

/// Spread of a voltage, part of its mean, below which it is constant.
const MAX_SUPPLY_SPREAD: f64 = 0.05;
/// Relative spread of the steps of a column that increases evenly.
const MAX_STEP_SPREAD: f64 = 0.5;

/// Beliefs about all columns of a table, in their order.
pub fn beliefs(table: &Table) -> Vec<Belief> {
    let mut list = Program::of(table).map_or_else(|| by_names_and_values(table), |program| by_program(table, program));
    let mut taken: Vec<String> = list.iter().filter_map(|b| b.target.clone()).collect();
    for (belief, column) in list.iter_mut().zip(&table.columns) {
        if belief.evidence == Evidence::Unknown && belief.target.is_none() && !column.is_text() && is_usable(column) {
            let base = own_name(&column.name, column.position);
            let mut name = base.clone();
            let mut copy = 2;
            while taken.contains(&name) || known(&name).is_some() {
                name = format!("{base}_{copy}");
                copy += 1;
            }
            taken.push(name.clone());
            belief.target = Some(name);
        }
    }
    list
}

/// What the program states that has written the table; its other columns are not used.
fn by_program(table: &Table, program: &Program) -> Vec<Belief> {
    let belief = |column: &TableColumn| {
        let unknown = Belief::unknown(&column.name);
        let Some((target, unit)) = program.meaning(&column.name) else { return unknown };
        let evidence = if unit.is_some() { Evidence::Program(program.name) } else { Evidence::NameOnly };
        Belief { target: Some(target.to_owned()), unit: unit.and_then(Unit::parse), evidence, ..unknown }
    };
    table.columns.iter().map(belief).collect()
}

fn by_names_and_values(table: &Table) -> Vec<Belief> {
    let of = |column: &TableColumn| match column.is_text() || !is_usable(column) {
        true => Belief::unknown(&column.name),
        false => by_name(&column.name, &column.unit, column.is_date),
    };
    let mut list: Vec<Belief> = table.columns.iter().map(of).collect();
    constant_motion(table, &mut list);
    constant_voltage(table, &mut list);
    time(table, &mut list);
    by_unit(&mut list);
    voltage_setpoint(&mut list);
    duty(&mut list);
    without_repetition(&mut list);
    list
}

/// The column has numbers, with text in few cells at most.
fn is_usable(column: &TableColumn) -> bool {
    column.text.is_none() || column.is_mostly_numbers()
}

/// The quantity of a column of the project, from its unit.
pub fn quantity_of(target: &str) -> Option<Quantity> {
    Unit::parse(known(target)?.unit).map(|u| u.quantity)
}

fn by_name(name: &str, unit_row: &str, is_date: bool) -> Belief {
    let (base, of_name) = split_name(name);
    let (found, named) = targets(&base);
    let belief = |target: Option<&str>, unit, evidence| Belief {
        target: target.map(str::to_owned),
        unit,
        evidence,
        of_motor: named.of_motor,
        words: names::words(&base).len(),
        ..Belief::unknown(name)
    };
    if is_date {
        return belief(Some("t_s"), Some(Unit::si(Quantity::Time)), Evidence::NameAndUnit);
    }
    if known(name).is_some() {
        return belief(Some(name), quantity_of(name).map(Unit::si), Evidence::OwnName);
    }
    if let Some(rotary) = axis::of_linear_column(name) {
        let unit = quantity_of(rotary).map(Unit::of_linear_axis);
        return belief(Some(rotary), unit, Evidence::OwnName);
    }
    let fits = |target: &str, unit: &Unit| quantity_of(target) == Some(unit.quantity);
    let row = Unit::parse(unit_row).map(|u| (u, UnitMark::Marked));
    let unit = row.or(of_name).filter(|(unit, mark)| {
        // A last letter is a unit only if the rest names its quantity: `phase_a`, `Channel A`.
        *mark == UnitMark::Marked || unit.text.chars().count() > 1 || found.iter().any(|target| fits(target, unit))
    });
    // The whole name where its last word is no unit: `temperature a`.
    let (found, named) = if unit.is_none() { targets(name) } else { (found, named) };
    let unit = unit.map(|(unit, _)| unit);
    let target = found.iter().copied().find(|target| unit.as_ref().is_none_or(|u| fits(target, u)));
    match (target, unit) {
        (Some("omega_rad_s"), unit) if named.setpoint => setpoint(belief(Some("rate_cmd_rad_s"), None, Evidence::NameAndUnit), unit),
        (Some("theta_rad"), unit) if named.setpoint => setpoint(belief(Some("theta_cmd_rad"), None, Evidence::NameAndUnit), unit),
        (Some("u_V"), unit) if named.setpoint => {
            Belief { is_voltage_setpoint: true, ..setpoint(belief(None, None, Evidence::NameAndUnit), unit) }
        }
        (Some(_), _) if named.setpoint => belief(None, None, Evidence::Unknown),
        (Some(target), Some(unit)) => belief(Some(target), Some(unit), Evidence::NameAndUnit),
        (Some(target), None) => belief(Some(target), quantity_of(target).map(Unit::si), Evidence::NameOnly),
        (None, Some(unit)) if !named.setpoint && names::words(&base).len() <= 3 => belief(None, Some(unit), Evidence::UnitOnly),
        (None, None) if named.is_duty => Belief { is_duty: true, ..belief(None, None, Evidence::Unknown) },
        (None, _) => belief(None, None, Evidence::Unknown),
    }
}

fn setpoint(belief: Belief, unit: Option<Unit>) -> Belief {
    let quantity = belief.target.as_deref().and_then(quantity_of).unwrap_or(Quantity::Voltage);
    let evidence = if unit.is_some() { Evidence::NameAndUnit } else { Evidence::LikeTheReading };
    Belief { unit: unit.or_else(|| Some(Unit::si(quantity))), evidence, ..belief }
}

/// A voltage that was asked for is the motor's, if no other column is.
fn voltage_setpoint(list: &mut [Belief]) {
    let has_voltage = list.iter().any(|b| b.target.as_deref() == Some("u_V"));
    for belief in list.iter_mut().filter(|b| b.is_voltage_setpoint) {
        if has_voltage {
            belief.forget();
        } else {
            belief.target = Some("u_V".to_owned());
            if belief.evidence == Evidence::LikeTheReading {
                belief.evidence = Evidence::NameOnly;
            }
        }
    }
}

/// The duty of a bridge is the motor's voltage, in a unit that is a part of the supply, if no other column is.
fn duty(list: &mut [Belief]) {
    if list.iter().any(|b| b.target.as_deref() == Some("u_V")) {
        return;
    }
    for belief in list.iter_mut().filter(|b| b.is_duty) {
        belief.target = Some("u_V".to_owned());
        belief.evidence = Evidence::NameOnly;
    }
}

/// A column that never changes is neither a time nor a motion, whatever its name says: nothing is connected to it.
fn constant_motion(table: &Table, list: &mut [Belief]) {
    let is_motion = |b: &Belief| matches!(b.target.as_deref(), Some("t_s" | "omega_rad_s" | "theta_rad"));
    for (belief, column) in list.iter_mut().zip(&table.columns).filter(|(b, _)| is_motion(b) && b.evidence != Evidence::OwnName) {
        let (low, high) = column.values.iter().copied().filter(|v| v.is_finite()).min_max();
        if low == high && column.values.len() > 1 {
            belief.forget();
        }
    }
}

/// A constant positive voltage is the supply, unless the motion is one response to it: a step from rest.
fn constant_voltage(table: &Table, list: &mut [Belief]) {
    let voltages = list.iter().filter(|b| b.target.as_deref() == Some("u_V")).count();
    let is_rate = |(belief, _): &(&Belief, &TableColumn)| belief.target.as_deref() == Some("omega_rad_s");
    let rate = list.iter().zip(&table.columns).find(is_rate);
    if voltages == 1 && rate.is_some_and(|(_, column)| plausible::is_one_response(&column.values, true)) {
        return;
    }
    for (belief, column) in list.iter_mut().zip(&table.columns).filter(|(b, _)| b.target.as_deref() == Some("u_V")) {
        let (low, high) = column.values.iter().copied().filter(|v| v.is_finite()).min_max();
        if low > 0.0 && high - low < MAX_SUPPLY_SPREAD * low && belief.evidence != Evidence::OwnName {
            belief.target = Some("supply_V".to_owned());
            belief.evidence = Evidence::ConstantVoltage;
        }
    }
}

/// Finds the time column: the first, or else the only one, that increases evenly.
fn time(table: &Table, list: &mut [Belief]) {
    let may_be = |k: &usize| {
        let (t, belief) = (&table.columns[*k].values, &list[*k]);
        let increases = t.len() > 2 && t.iter().all(|v| v.is_finite()) && t.windows(2).all(|w| w[1] > w[0]);
        matches!(belief.evidence, Evidence::Unknown | Evidence::UnitOnly)
            && increases
            && steps_are_even(t)
            && belief.unit.as_ref().is_none_or(|u| u.quantity == Quantity::Time)
    };
    if list.iter().any(|b| b.target.as_deref() == Some("t_s")) {
        return;
    }
    let found: Vec<usize> = (0..list.len()).filter(may_be).collect();
    let Some(&k) = found.first().filter(|k| **k == 0 || found.len() == 1) else { return };
    let unit = list[k].unit.clone();
    let evidence = if unit.is_some() { Evidence::UnitOnly } else { Evidence::IncreasesEvenly };
    list[k] = Belief { target: Some("t_s".to_owned()), unit, evidence, ..list[k].clone() };
}

fn steps_are_even(values: &[f64]) -> bool {
    let steps: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
    let Some(median) = crate::statistics::robust::median(steps.iter().copied()) else { return false };
    let even = steps.iter().filter(|s| (*s - median).abs() <= MAX_STEP_SPREAD * median).count();
    even as f64 > 0.9 * steps.len() as f64
}

/// A column whose name says nothing is what its unit says, if no other column is that. Metres beside a rotation are a place or a length,
/// not the motion of a linear axis.
fn by_unit(list: &mut [Belief]) {
    let is_rotation = |b: &Belief| {
        matches!(b.target.as_deref(), Some("omega_rad_s" | "theta_rad" | "gyro_rad_s")) && b.unit.as_ref().is_some_and(|u| !u.linear)
    };
    let is_rotary = list.iter().any(is_rotation);
    for k in 0..list.len() {
        let Some(unit) = list[k].unit.clone().filter(|_| list[k].evidence == Evidence::UnitOnly && list[k].target.is_none()) else {
            continue;
        };
        let target = match unit.quantity {
            Quantity::Time => "t_s",
            Quantity::Angle => "theta_rad",
            Quantity::Rate => "omega_rad_s",
            Quantity::Voltage => "u_V",
            Quantity::Current => "i_A",
            Quantity::Torque => "torque_N_m",
            Quantity::Temperature => "temp_C",
            Quantity::Acceleration => "accel_x_m_s2",
        };
        let is_other = |(other, b): (usize, &Belief)| other != k && b.unit.as_ref().is_some_and(|u| u.quantity == unit.quantity);
        if list.iter().enumerate().any(is_other) || (unit.linear && is_rotary) {
            list[k].evidence = Evidence::Unknown;
        } else {
            list[k].target = Some(target.to_owned());
        }
    }
}

/// How strong the evidence is; 0 is the strongest.
pub(super) fn rank(belief: &Belief) -> (u8, bool, usize) {
    let by_evidence = match belief.evidence {
        Evidence::Stated | Evidence::OtherUnit => 0,
        Evidence::OwnName => 1,
        Evidence::NameAndUnit | Evidence::Program(_) => 2,
        Evidence::NameAndValues | Evidence::RateAgainstAngle | Evidence::LikeTheReading | Evidence::NameOnly => 3,
        Evidence::UnitOnly => 4,
        Evidence::ConstantVoltage => 5,
        Evidence::IncreasesEvenly => 6,
        Evidence::Unknown => 7,
    };
    (by_evidence, !belief.of_motor, belief.words)
}

/// Each column of the project once: the first with the best evidence.
fn without_repetition(list: &mut [Belief]) {
    for k in 0..list.len() {
        let Some(target) = list[k].target.clone() else { continue };
        let best = (0..list.len()).filter(|&o| list[o].target.as_ref() == Some(&target)).min_by_key(|&o| (rank(&list[o]), o));
        if let Some(best) = best.filter(|best| *best != k) {
            if rank(&list[best]) == rank(&list[k]) {
                let rival = list[k].source.clone();
                list[best].rivals.push(rival);
            }
            if list[k].lacks_unit() {
                list[k].unit = None;
            }
            list[k].target = None;
            list[k].evidence = Evidence::Unknown;
        }
    }
}

//! Programs whose logs state what each column is by their header alone, with the units of their documentation.

use super::guess::{Belief, Evidence};
use super::table::Table;
use super::units::Unit;

/// A program that writes logs.
struct Program {
    /// Name for messages.
    name: &'static str,
    /// Columns by which its header is recognised: all of them.
    header: &'static [&'static str],
    /// Column of the file, column of the project, unit. No unit: the user is asked.
    columns: &'static [(&'static str, &'static str, Option<&'static str>)],
}

/// VESC Tool 6, Data Analysis, Log Analysis: the file that its real-time log writes. The rate is electrical.
const PROGRAMS: [Program; 1] = [Program {
    name: "VESC Tool",
    header: &["ms_today", "input_voltage", "current_motor", "erpm", "duty_cycle"],
    columns: &[
        ("ms_today", "t_s", Some("ms")),
        ("input_voltage", "supply_V", Some("V")),
        ("q_axis_voltage", "u_V", Some("V")),
        ("current_motor", "i_A", Some("A")),
        ("erpm", "omega_rad_s", None),
        ("temp_motor", "temp_C", Some("°C")),
    ],
}];

/// What the columns are, in their order, where the header is that of a known program; its other columns are not used.
pub(super) fn beliefs(table: &Table) -> Option<Vec<Belief>> {
    let has = |name: &&str| table.columns.iter().any(|c| c.name == **name);
    let program = PROGRAMS.iter().find(|program| program.header.iter().all(|name| has(&name)))?;
    let belief = |name: &str| {
        let mut belief = Belief::unknown(name);
        if let Some((_, target, unit)) = program.columns.iter().find(|(column, ..)| *column == name) {
            belief.target = Some((*target).to_owned());
            belief.unit = unit.and_then(Unit::parse);
            belief.evidence = if unit.is_some() { Evidence::Program(program.name) } else { Evidence::NameOnly };
        }
        belief
    };
    Some(table.columns.iter().map(|column| belief(&column.name)).collect())
}

//! Programs whose logs state what each column is by their header alone, with the units of their documentation.

use super::table::Table;

/// A program that writes logs.
pub(super) struct Program {
    /// Name for messages.
    pub name: &'static str,
    /// Columns by which its header is recognised: all of them.
    header: &'static [&'static str],
    /// Column of the file, column of the project, unit. No unit: the user is asked.
    columns: &'static [(&'static str, &'static str, Option<&'static str>)],
}

/// The real-time log of VESC Tool, by its header. The rate is electrical.
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

impl Program {
    /// The program whose header a table has.
    pub fn of(table: &Table) -> Option<&'static Program> {
        let has = |name: &str| table.columns.iter().any(|c| c.name == name);
        PROGRAMS.iter().find(|program| program.header.iter().all(|name| has(name)))
    }

    /// Column of the project and unit of a column of the file; `None` for one that is not used.
    pub fn meaning(&self, column: &str) -> Option<(&'static str, Option<&'static str>)> {
        self.columns.iter().find(|(name, ..)| *name == column).map(|(_, target, unit)| (*target, *unit))
    }
}

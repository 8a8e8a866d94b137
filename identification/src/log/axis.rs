//! The axis of a drive: rotary, or linear.
//!
//! Inside the program every axis is a rotary one: 1 m is 1 rad, 1 N is 1 N m, 1 kg is 1 kg m², and the equations are the same. What a user
//! of a linear axis reads and writes, columns, parameters and units, is translated here, at the readers and at the reports.

/// Rotary or linear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Axis {
    /// Angle, rate, torque.
    #[default]
    Rotary,
    /// Position, velocity, force.
    Linear,
}

/// Columns of a rotary and of a linear axis.
const COLUMNS: [(&str, &str); 5] = [
    ("theta_rad", "x_m"),
    ("omega_rad_s", "v_m_s"),
    ("torque_N_m", "force_N"),
    ("theta_cmd_rad", "x_cmd_m"),
    ("rate_cmd_rad_s", "v_cmd_m_s"),
];

/// Units of a rotary and of a linear axis, as reports write them.
const UNITS: [(&str, &str); 13] = [
    ("rad", "m"),
    ("rad/s", "m/s"),
    ("rad/s²", "m/s²"),
    ("rad/(s K)", "m/(s K)"),
    ("N m", "N"),
    ("N m s", "N s/m"),
    ("N m s²", "N s²/m²"),
    ("N m/rad", "N/m"),
    ("N m s/rad", "N s/m"),
    ("N m/A", "N/A"),
    ("kg m²", "kg"),
    ("1/turn", "1/(2π m)"),
    ("N m/s", "N/s"),
];

/// Quantities of a rotary and of a linear axis, in words.
const QUANTITIES: [(&str, &str); 7] = [
    ("rate", "velocity"),
    ("angle increment over 20 ms", "displacement over 20 ms"),
    ("torque", "force"),
    ("angle within the turn", "position within 2π m"),
    ("angle within the turn from the index", "position within 2π m from the index"),
    ("total moment of inertia J", "total moving mass m"),
    ("motor constant K, of torque and back-EMF", "force constant K, of force and back-EMF"),
];

/// Ends of parameter names of a rotary and of a linear axis, the longest first.
const NAME_ENDS: [(&str, &str); 9] = [
    ("_N_m_s_rad", "_N_s_m"),
    ("_N_m_s2", "_N_s2_m2"),
    ("_N_m_rad", "_N_m"),
    ("_N_m_s", "_N_s_m"),
    ("_N_m_A", "_N_A"),
    ("_kg_m2", "_kg"),
    ("_N_m", "_N"),
    ("_rad_s", "_m_s"),
    ("_rad", "_m"),
];
/// Words in parameter names of a rotary and of a linear axis.
const NAME_WORDS: [(&str, &str); 4] =
    [("motor_constant", "force_constant"), ("inertia", "mass"), ("rate", "velocity"), ("torque", "force")];
/// Parameters whose names do not follow the rules: their units are inverse rates.
const NAMES: [(&str, &str); 2] = [("rate_scale_2_s", "velocity_scale_2_s_m"), ("rate_scale_3_s2", "velocity_scale_3_s2_m2")];

impl Axis {
    /// The axis of this name: `rotary` or `linear`.
    pub fn named(name: &str) -> Option<Axis> {
        [Axis::Rotary, Axis::Linear].into_iter().find(|a| a.name().eq_ignore_ascii_case(name.trim()))
    }

    /// Its name in notes and model files.
    pub fn name(self) -> &'static str {
        match self {
            Axis::Rotary => "rotary",
            Axis::Linear => "linear",
        }
    }

    fn translated(self, table: &[(&'static str, &'static str)], text: &'static str) -> &'static str {
        match self {
            Axis::Rotary => text,
            Axis::Linear => table.iter().find(|(rotary, _)| *rotary == text).map_or(text, |(_, linear)| linear),
        }
    }

    /// Name of a column on this axis.
    pub fn column(self, column: &'static str) -> &'static str {
        self.translated(&COLUMNS, column)
    }

    /// Name of a column in a file of this axis.
    pub fn file_column(self, column: &str) -> &str {
        match self {
            Axis::Rotary => column,
            Axis::Linear => COLUMNS.iter().find(|(rotary, _)| *rotary == column).map_or(column, |(_, linear)| linear),
        }
    }

    /// Key of a note in a file of this axis.
    pub fn file_note(self, key: &str) -> &str {
        match self {
            Axis::Rotary => key,
            Axis::Linear => {
                QUANTIZATION_NOTES.iter().find(|(_, rotary)| *rotary == key).map_or(self.file_column(key), |(linear, _)| linear)
            }
        }
    }

    /// A unit on this axis.
    pub fn unit(self, unit: &'static str) -> &'static str {
        self.translated(&UNITS, unit)
    }

    /// A quantity or description on this axis.
    pub fn quantity(self, quantity: &'static str) -> &'static str {
        self.translated(&QUANTITIES, quantity)
    }

    /// Name of a parameter on this axis; `name` is that of a rotary one, with the number of its instance. Phases stay in rad.
    pub fn parameter(self, name: &str) -> String {
        if self == Axis::Rotary {
            return name.to_owned();
        }
        let (stem, instance) = name.split_once('#').map_or((name, None), |(stem, n)| (stem, Some(n)));
        let renamed = match NAMES.iter().find(|(rotary, _)| *rotary == stem) {
            Some((_, linear)) => (*linear).to_owned(),
            None if stem.ends_with("_phase_rad") => stem.to_owned(),
            None => {
                let end = NAME_ENDS.iter().find(|(rotary, _)| stem.ends_with(rotary));
                let (begin, end) = end.map_or((stem, ""), |(rotary, linear)| (&stem[..stem.len() - rotary.len()], *linear));
                let mut begin = begin.to_owned();
                for (rotary, linear) in NAME_WORDS {
                    let words: Vec<String> = match begin.contains(rotary) {
                        true if rotary.contains('_') => vec![begin.replace(rotary, linear)],
                        _ => begin.split('_').map(|w| if w == rotary { linear.to_owned() } else { w.to_owned() }).collect(),
                    };
                    begin = words.join("_");
                }
                begin + end
            }
        };
        instance.map_or(renamed.clone(), |n| format!("{renamed}#{n}"))
    }
}

/// The column of the project that a name of a linear axis means; `None` if it is no such name.
pub fn of_linear_column(name: &str) -> Option<&'static str> {
    COLUMNS.iter().find(|(_, linear)| *linear == name).map(|(rotary, _)| *rotary)
}

/// Keys of notes about the least significant bit of a column: linear, rotary.
const QUANTIZATION_NOTES: [(&str, &str); 6] = [
    ("x_lsb", "theta_lsb"),
    ("x_lsb_m", "theta_lsb_rad"),
    ("v_lsb", "omega_lsb"),
    ("v_lsb_m_s", "omega_lsb_rad_s"),
    ("force_lsb", "torque_lsb"),
    ("force_lsb_N", "torque_lsb_N_m"),
];

/// Key of a note about a column of a linear axis, as of the rotary one: `v_m_s`, `x_lsb_m`; `None` for other keys.
pub fn rotary_note(key: &str) -> Option<String> {
    let of_column = of_linear_column(key);
    of_column.or_else(|| QUANTIZATION_NOTES.iter().find(|(linear, _)| *linear == key).map(|(_, rotary)| *rotary)).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_have_the_names_of_a_linear_axis() {
        for (rotary, linear) in [
            ("inertia_kg_m2", "mass_kg"),
            ("motor_constant_N_m_A", "force_constant_N_A"),
            ("resistance_ohm", "resistance_ohm"),
            ("viscous_N_m_s", "viscous_N_s_m"),
            ("coulomb_N_m", "coulomb_N"),
            ("cable_N_m_rad", "cable_N_m"),
            ("drag_N_m_s2", "drag_N_s2_m2"),
            ("stribeck_rate_rad_s", "stribeck_velocity_m_s"),
            ("motor_inertia_share", "motor_mass_share"),
            ("cogging_phase_rad", "cogging_phase_rad"),
            ("cogging_N_m#2", "cogging_N#2"),
            ("rate_scale_2_s", "velocity_scale_2_s_m"),
            ("seal-drag.a", "seal-drag.a"),
        ] {
            assert_eq!(Axis::Linear.parameter(rotary), linear);
            assert_eq!(Axis::Rotary.parameter(rotary), rotary);
        }
    }

    #[test]
    fn names_of_the_catalogue_stay_different() {
        let names: Vec<&str> = drive_model::cards().iter().flat_map(|c| c.parameters.iter().map(|p| p.name)).collect();
        for (k, a) in names.iter().enumerate() {
            for b in names[..k].iter().filter(|b| *b != a) {
                assert_ne!(Axis::Linear.parameter(a), Axis::Linear.parameter(b), "{a} and {b}");
            }
        }
        for card in drive_model::cards() {
            for p in card.parameters.iter().filter(|p| p.unit.contains("rad") || p.unit.contains("N m") || p.unit.contains("kg")) {
                let is_phase = p.name.ends_with("_phase_rad");
                assert!(is_phase || Axis::Linear.unit(p.unit) != p.unit, "{}: {} has no unit on a linear axis", p.name, p.unit);
            }
        }
    }
}

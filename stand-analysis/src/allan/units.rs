//! Unit of a column from its name, and names and units of the coefficients.

use identification::log::known;

/// Suffixes of column names with their unit and its size in rad or rad/s.
const SUFFIXES: [(&str, &str, f64); 13] = [
    ("_rad_s", "rad/s", 1.0),
    ("_deg_s", "°/s", std::f64::consts::PI / 180.0),
    ("_deg_h", "°/h", std::f64::consts::PI / 180.0 / 3600.0),
    ("_rad", "rad", 1.0),
    ("_deg", "°", std::f64::consts::PI / 180.0),
    ("_m_s2", "m/s²", 0.0),
    ("_m_s", "m/s", 0.0),
    ("_N_m", "N m", 0.0),
    ("_V", "V", 0.0),
    ("_A", "A", 0.0),
    ("_K", "K", 0.0),
    ("_C", "°C", 0.0),
    ("_s", "s", 0.0),
];

/// Physical quantity of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ColumnKind {
    /// An angular rate, or an angle.
    Rate {
        /// Size of its unit in rad/s or rad.
        rad: f64,
    },
    /// An acceleration in m/s², or a velocity in m/s.
    Acceleration,
    /// Anything else.
    Other,
}

/// The unit of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// Symbol; empty if the name has no known suffix.
    pub name: String,
    /// Physical quantity.
    pub kind: ColumnKind,
}

impl Unit {
    /// From the name of the column.
    pub fn of(column: &str) -> Self {
        let end = SUFFIXES.iter().find(|(end, _, _)| column.ends_with(end));
        let name = known(column).map(|c| c.unit).or(end.map(|e| e.1)).unwrap_or("");
        let kind = match end {
            Some((_, _, rad)) if *rad > 0.0 => ColumnKind::Rate { rad: *rad },
            Some((_, "m/s²" | "m/s", _)) => ColumnKind::Acceleration,
            _ => ColumnKind::Other,
        };
        Self { name: name.to_owned(), kind }
    }

    /// Whether the column is an angle, i.e. the integral of a rate.
    pub fn is_angle(&self) -> bool {
        matches!(self.name.as_str(), "rad" | "°")
    }

    /// Size in rad/s or rad; `None` if the column is neither rate nor angle.
    pub fn rad(&self) -> Option<f64> {
        match self.kind {
            ColumnKind::Rate { rad } => Some(rad),
            _ => None,
        }
    }

    /// Unit of the time derivative.
    pub fn per_second(self) -> Self {
        let name = match self.name.as_str() {
            "" => "1/s".to_owned(),
            name if name.contains(['/', ' ']) => format!("({name})/s"),
            name => format!("{name}/s"),
        };
        Self { name, ..self }
    }

    /// The unit multiplied by `by`.
    pub fn times(&self, by: &str) -> String {
        match (self.name.as_str(), by) {
            ("", by) => by.to_owned(),
            (name, "") => name.to_owned(),
            (name, by) if by.starts_with('/') && name.contains('/') => format!("({name}){by}"),
            (name, by) if by.starts_with('/') => format!("{name}{by}"),
            (name, by) => format!("{name} {by}"),
        }
    }
}

/// Names and units of one coefficient, in the order of the processes of [`super::noise`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Process {
    /// Letter of IEEE Std 952.
    pub letter: &'static str,
    /// Key among the coefficients in the column's unit.
    pub key: &'static str,
    /// Key in degrees and hours.
    pub deg_key: &'static str,
    /// Name for a rate.
    pub name: &'static str,
    /// Name for other quantities.
    pub plain_name: &'static str,
    /// Unit relative to the column's unit.
    pub unit: &'static str,
    /// Unit in degrees and hours.
    pub deg_unit: &'static str,
    /// Conversion to this unit: 1 rad/s with the seconds of [`Process::unit`] is 180/π times this value.
    pub hours: f64,
    /// Exponent of τ in the deviation.
    pub slope: &'static str,
}

/// The five processes, by increasing exponent.
pub const PROCESSES: [Process; 5] = [
    Process {
        letter: "Q",
        key: "quantisation",
        deg_key: "quantisation_deg",
        name: "quantisation",
        plain_name: "quantisation",
        unit: "s",
        deg_unit: "°",
        hours: 1.0,
        slope: "−1",
    },
    Process {
        letter: "N",
        key: "white_noise",
        deg_key: "angle_random_walk_deg_sqrt_h",
        name: "angle random walk",
        plain_name: "white noise",
        unit: "√s",
        deg_unit: "°/√h",
        hours: 60.0,
        slope: "−½",
    },
    Process {
        letter: "B",
        key: "bias_instability",
        deg_key: "bias_instability_deg_h",
        name: "bias instability",
        plain_name: "bias instability",
        unit: "",
        deg_unit: "°/h",
        hours: 3600.0,
        slope: "0",
    },
    Process {
        letter: "K",
        key: "random_walk",
        deg_key: "rate_random_walk_deg_h_sqrt_h",
        name: "rate random walk",
        plain_name: "random walk",
        unit: "/√s",
        deg_unit: "°/h/√h",
        hours: 216_000.0,
        slope: "+½",
    },
    Process {
        letter: "R",
        key: "ramp",
        deg_key: "rate_ramp_deg_h_h",
        name: "rate ramp",
        plain_name: "ramp",
        unit: "/s",
        deg_unit: "°/h/h",
        hours: 12_960_000.0,
        slope: "+1",
    },
];

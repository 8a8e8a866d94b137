//! What a column's name says of its unit, and what the coefficients are called in it.

use crate::log::known;

/// Ends of names, the unit that they stand for, and rad or rad/s in it.
const ENDS: [(&str, &str, f64); 13] = [
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

/// A unit of a column.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// As it is written; empty where the name tells none.
    pub name: String,
    /// rad/s (or rad) of one of it; `None`: it is neither rate nor angle.
    pub rad: Option<f64>,
}

impl Unit {
    /// By the column's name.
    pub fn of(column: &str) -> Self {
        let end = ENDS.iter().find(|(end, _, _)| column.ends_with(end));
        let name = known(column).map(|c| c.unit).or(end.map(|e| e.1)).unwrap_or("");
        Self { name: name.to_owned(), rad: end.map(|e| e.2).filter(|rad| *rad > 0.0) }
    }

    /// The column is an angle: the integral of the rate whose noise is looked for.
    pub fn is_angle(&self) -> bool {
        matches!(self.name.as_str(), "rad" | "°")
    }

    /// Unit of its change in time.
    pub fn per_second(self) -> Self {
        let name = match self.name.as_str() {
            "" => "1/s".to_owned(),
            name if name.contains(['/', ' ']) => format!("({name})/s"),
            name => format!("{name}/s"),
        };
        Self { name, ..self }
    }

    /// The unit with `by` behind it.
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

/// What one coefficient is called, in the order of [`super::noise`]'s processes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Process {
    /// Letter of IEEE Std 952.
    pub letter: &'static str,
    /// Key among the coefficients in the column's unit.
    pub key: &'static str,
    /// Key of the same in degrees and hours.
    pub deg_key: &'static str,
    /// What it is called of a rate.
    pub name: &'static str,
    /// What it is called of anything else.
    pub plain_name: &'static str,
    /// What comes behind the column's unit.
    pub unit: &'static str,
    /// Its unit in degrees and hours.
    pub deg_unit: &'static str,
    /// That unit's size: 1 rad/s, with the seconds of [`Process::unit`], in it is 180/π times this.
    pub hours: f64,
    /// Power of τ of its part of the deviation.
    pub slope: &'static str,
}

/// The five, by falling slope.
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

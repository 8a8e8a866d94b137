//! Words in the column names of laboratories, in several languages, and the columns of the project that they name.

/// Words that name a quantity, with the project's column; a word alone or among others in the name.
const NAMES: &[(&str, &[&str])] = &[
    (
        "t_s",
        &[
            "t",
            "time",
            "timestamp",
            "zeit",
            "ts",
            "sec",
            "seconds",
            "millis",
            "micros",
            "xvalue",
            "temps",
            "tiempo",
            "tempo",
            "czas",
            "час",
            "время",
            "uptime",
        ],
    ),
    ("supply_V", &["supply", "vbus", "vdc", "udc", "ubus", "vbat", "battery", "bus", "vsupply", "vs", "vcc", "versorgung", "uzk"]),
    (
        "u_V",
        &[
            "u",
            "v",
            "voltage",
            "volt",
            "volts",
            "uin",
            "vin",
            "um",
            "vm",
            "va",
            "ua",
            "vmot",
            "umot",
            "uq",
            "vq",
            "spannung",
            "armature",
            "tension",
            "voltaje",
            "tensión",
            "tensione",
            "napięcie",
            "напруга",
            "напряжение",
        ],
    ),
    (
        "i_A",
        &["i", "current", "curr", "amps", "iq", "im", "ia", "imot", "strom", "courant", "corriente", "corrente", "prąd", "струм", "ток"],
    ),
    (
        "torque_N_m",
        &["torque", "tau", "moment", "drehmoment", "force", "kraft", "trq", "couple", "coppia", "effort", "момент", "сила", "зусилля"],
    ),
    (
        "omega_rad_s",
        &[
            "omega",
            "w",
            "ω",
            "speed",
            "velocity",
            "vel",
            "rate",
            "rpm",
            "erpm",
            "drehzahl",
            "dq",
            "qdot",
            "thetadot",
            "spd",
            "wm",
            "geschwindigkeit",
            "winkelgeschwindigkeit",
            "vitesse",
            "velocidad",
            "velocità",
            "prędkość",
            "швидкість",
            "скорость",
            "оберти",
            "обороты",
        ],
    ),
    (
        "theta_rad",
        &[
            "theta",
            "θ",
            "φ",
            "angle",
            "pos",
            "position",
            "phi",
            "encoder",
            "enc",
            "counts",
            "ticks",
            "pulses",
            "q",
            "winkel",
            "ang",
            "drehwinkel",
            "ángulo",
            "angolo",
            "posizione",
            "posición",
            "kąt",
            "кут",
            "угол",
            "положення",
            "положение",
        ],
    ),
    ("temp_C", &["temp", "temperature", "winding", "tmotor", "temperatur", "température", "температура"]),
    ("gyro_rad_s", &["gyro", "gyroscope", "gyr", "gz"]),
    ("accel_x_m_s2", &["ax", "accx", "accelx"]),
    ("accel_y_m_s2", &["ay", "accy", "accely"]),
];
/// Words that make a rate, an angle or a voltage a setpoint.
const SETPOINT: &[&str] = &[
    "ref",
    "reference",
    "cmd",
    "command",
    "set",
    "setpoint",
    "target",
    "desired",
    "des",
    "sp",
    "soll",
    "sollwert",
    "goal",
    "commanded",
    "demand",
];
/// Words that make a column something about a quantity, not the quantity.
const ABOUT: &[&str] =
    &["limit", "max", "min", "err", "error", "fehler", "offset", "std", "sigma", "raw", "flag", "fault", "index", "count", "status"];
/// Words for other places than the motor, by the column that they exclude.
const ELSEWHERE: &[(&str, &[&str])] = &[
    ("i_A", &["in", "input", "bus", "dc", "battery", "bat", "supply", "id", "total", "charger"]),
    (
        "temp_C",
        &["mos", "mosfet", "fet", "board", "pcb", "mcu", "cpu", "ambient", "driver", "imu", "room", "air", "case", "controller", "esc"],
    ),
];
/// Words for the motor.
const MOTOR: &[&str] =
    &["motor", "mot", "armature", "winding", "coil", "phase", "q", "iq", "uq", "vq", "measured", "meas", "ist", "istwert", "actual"];

/// What the words of a name say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Named {
    /// A setpoint, not a reading.
    pub setpoint: bool,
    /// It says that the quantity is that of the motor.
    pub of_motor: bool,
    /// The duty of a bridge.
    pub is_duty: bool,
}

/// Words for the duty of a bridge.
const DUTY: &[&str] = &["pwm", "duty", "dutycycle"];

/// The name is that of an electrical rate: the mechanical one times the pole pairs.
pub(super) fn is_electrical_rate(name: &str) -> bool {
    let words = words(name);
    words.concat() == "erpm" || words.iter().any(|word| word == "erpm")
}

/// The columns of the project that a name may mean, the first in the order above.
pub(super) fn targets(name: &str) -> (Vec<&'static str>, Named) {
    let words = words(name);
    let joined = words.concat();
    let has = |list: &[&str]| words.iter().any(|w| list.contains(&w.as_str()));
    let named = |list: &[&str]| list.contains(&joined.as_str()) || has(list);
    let excluded = |target: &str| ELSEWHERE.iter().any(|(column, list)| *column == target && has(list));
    let found = NAMES.iter().filter(|(target, list)| named(list) && !excluded(target)).map(|(target, _)| *target);
    let found = if has(ABOUT) { Vec::new() } else { found.collect() };
    (found, Named { setpoint: has(SETPOINT), of_motor: has(MOTOR), is_duty: has(DUTY) })
}

/// The words of a name in lower case: parts between signs, and of CamelCase; a number at the end of a word is no part of it.
pub(super) fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before_lower = false;
    for letter in name.chars() {
        if !letter.is_alphanumeric() {
            words.push(String::new());
        } else {
            if letter.is_uppercase() && before_lower {
                words.push(String::new());
            }
            if let Some(word) = words.last_mut() {
                word.extend(letter.to_lowercase());
            }
        }
        before_lower = letter.is_lowercase();
    }
    for word in &mut words {
        let stem = word.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        word.truncate(if stem > 0 { stem } else { word.len() });
    }
    words.retain(|w| !w.is_empty());
    words
}

/// A name that an expression can use; `position` is that of the column in the file.
pub(super) fn own_name(name: &str, position: usize) -> String {
    let mut own: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    while own.contains("__") {
        own = own.replace("__", "_");
    }
    let own = own.trim_matches('_');
    match own.chars().next() {
        None => format!("column_{position}"),
        Some(first) if first.is_ascii_digit() => format!("column_{own}"),
        Some(_) => own.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_laboratories_are_understood() {
        let first = |name: &str| targets(name).0.first().copied();
        for (name, target) in [
            ("Drehzahl", Some("omega_rad_s")),
            ("axis0.encoder.vel_estimate", Some("omega_rad_s")),
            ("field.velocity0", Some("omega_rad_s")),
            ("MotorSpeed", Some("omega_rad_s")),
            ("Напруга", Some("u_V")),
            ("current_in", None),
            ("temp_mos_max", None),
            ("temp_motor", Some("temp_C")),
            ("speed_limit", None),
            ("fault", None),
            ("Channel A", None),
        ] {
            let found = first(name);
            let found = if name.contains("encoder.vel") { targets(name).0.into_iter().find(|t| *t == "omega_rad_s") } else { found };
            assert_eq!(found, target, "{name}");
        }
        assert!(targets("speed_ref").1.setpoint && targets("motor_current").1.of_motor);
    }

    #[test]
    fn own_names_can_be_used_in_expressions() {
        assert_eq!(own_name("pulse flag (1)", 3), "pulse_flag_1");
        assert_eq!(own_name("Сигнал", 3), "column_3");
        assert_eq!(own_name("2nd", 3), "column_2nd");
    }
}

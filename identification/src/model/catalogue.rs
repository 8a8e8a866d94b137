//! Names of the model file: base parameters, effects with instance numbers; a blank file.

use drive_model::{Card, Parameter, ParameterKind, Structure, card, cards, law};

use super::Input;
use super::error::ModelErrorKind;
use crate::log::Axis;

const fn base(name: &'static str, unit: &'static str, description: &'static str, start: f64) -> Parameter {
    Parameter {
        name,
        unit,
        description,
        range: (0.0, f64::INFINITY),
        start,
        kind: ParameterKind::Positive,
        simulated_range: (start, start),
    }
}

/// Base parameters: rigid rotor J ω' = K i, quasi-static armature i = (u − K ω)/R, and the regulator of a position servo.
static BASE: [Parameter; 6] = [
    base("inertia_kg_m2", "kg m²", "total moment of inertia J", 2.5e-4),
    base("motor_constant_N_m_A", "N m/A", "motor constant K, of torque and back-EMF", 0.05),
    base("resistance_ohm", "Ω", "winding resistance R", 5.0),
    base("servo_gain_V_rad", "V/rad", "gain kp of the servo's regulator, u = kp (setpoint − angle) − kd rate", 10.0),
    Parameter { kind: ParameterKind::NonNegative, ..base("servo_damping_V_s_rad", "V s/rad", "its damping kd by the rate", 0.0) },
    base("servo_limit_V", "V", "its greatest voltage", 12.0),
];

/// A base parameter: a parameter of every drive, whatever its effects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BaseParameter {
    /// Total moment of inertia J.
    Inertia,
    /// Motor constant K.
    MotorConstant,
    /// Winding resistance R.
    Resistance,
    /// Gain of the regulator of a position servo.
    ServoGain,
    /// Its damping by the rate.
    ServoDamping,
    /// Its greatest voltage.
    ServoLimit,
}

impl BaseParameter {
    /// All base parameters, in the order of the model file.
    pub const ALL: [BaseParameter; 6] = [
        BaseParameter::Inertia,
        BaseParameter::MotorConstant,
        BaseParameter::Resistance,
        BaseParameter::ServoGain,
        BaseParameter::ServoDamping,
        BaseParameter::ServoLimit,
    ];

    /// A parameter of the regulator of a position servo.
    pub fn is_of_servo(self) -> bool {
        matches!(self, BaseParameter::ServoGain | BaseParameter::ServoDamping | BaseParameter::ServoLimit)
    }

    /// Its entry in the catalogue.
    pub fn info(self) -> &'static Parameter {
        &BASE[self as usize]
    }

    /// Name in the model file.
    pub fn name(self) -> &'static str {
        self.info().name
    }
}

/// Base parameters that a model with this input needs.
pub(super) fn needed(input: Input) -> &'static [BaseParameter] {
    use BaseParameter::{Inertia, MotorConstant, Resistance};
    match input {
        Input::Setpoint => &BaseParameter::ALL,
        Input::Voltage => &[Inertia, MotorConstant, Resistance],
        Input::Current => &[Inertia, MotorConstant],
        Input::Torque => &[Inertia],
        // Which ones are needed depends on the outputs.
        Input::Motion => &[],
    }
}

/// Name of an instance: `cogging`, `cogging#2`.
pub(super) fn with_instance(name: &str, instance: u32) -> String {
    if instance == 1 { name.to_owned() } else { format!("{name}#{instance}") }
}

/// Name and number of an instance; `None` if the suffix is not a number from 2 on.
pub(super) fn split_instance(name: &str) -> Option<(&str, u32)> {
    match name.split_once('#') {
        None => Some((name, 1)),
        Some((stem, suffix)) => {
            let instance: u32 = suffix.parse().ok()?;
            (instance >= 2 && instance.to_string() == suffix).then_some((stem, instance))
        }
    }
}

/// Card and instance of a name in the file; `None` if it is not an effect of the catalogue.
pub(super) fn effect(name: &str) -> Option<Result<(&'static Card, u32), ModelErrorKind>> {
    let stem = name.split('#').next().unwrap_or(name);
    let card = card(stem)?;
    Some(match split_instance(name) {
        None => Err(ModelErrorKind::Mark(name.to_owned(), stem.to_owned())),
        Some((_, instance)) if instance > 1 && is_structural(card) => Err(ModelErrorKind::NoRepeat(card.id)),
        Some((_, instance)) => Ok((card, instance)),
    })
}

/// The effect is an arm of the rig, of which there is one.
pub(super) fn is_structural(card: &Card) -> bool {
    let Some(law) = law::<f64>(card.id) else { return false };
    let mut structure = Structure::default();
    law.configure(&card.parameters.iter().map(|p| p.start).collect::<Vec<_>>(), &mut structure);
    structure.shaft.is_some()
        || structure.inductance_H.is_some()
        || structure.bristle_N_m_rad.is_some()
        || structure.thermal.is_some()
        || structure.lag_s.is_some()
        || structure.skew_s.is_some()
}

/// Effects that have a parameter of that name (without suffix).
pub(super) fn owners(parameter: &str) -> Vec<&'static str> {
    cards().iter().filter(|c| c.parameters.iter().any(|p| p.name == parameter)).map(|c| c.id).collect()
}

/// All parameter names of the catalogue.
pub(super) fn parameter_names() -> impl Iterator<Item = &'static str> {
    BASE.iter().map(|p| p.name).chain(cards().iter().flat_map(|c| c.parameters.iter().map(|p| p.name)))
}

/// Name inside the program, that of a rotary drive, of a parameter in a file of this axis. A name that the catalogue lacks stays as it is.
///
/// # Errors
/// The name is one of the other axis; the error is the name on this one.
pub(super) fn rotary_name(axis: Axis, name: &str) -> Result<String, String> {
    if axis == Axis::Rotary {
        return Ok(name.to_owned());
    }
    let (stem, instance) = name.split_once('#').map_or((name, String::new()), |(stem, n)| (stem, format!("#{n}")));
    match parameter_names().find(|rotary| axis.parameter(rotary) == stem) {
        Some(rotary) => Ok(format!("{rotary}{instance}")),
        None if parameter_names().any(|rotary| rotary == stem) => Err(axis.parameter(name)),
        None => Ok(name.to_owned()),
    }
}

/// Name inside the program of a parameter in a file of either axis.
pub(super) fn any_rotary_name(name: &str) -> String {
    let linear = parameter_names().find(|rotary| Axis::Linear.parameter(rotary) == name);
    if parameter_names().any(|rotary| rotary == name) { name.to_owned() } else { linear.unwrap_or(name).to_owned() }
}

/// A number for a file: the fewest digits that read back exactly, with an exponent for very small and large values.
pub(super) fn number(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) { format!("{value:e}") } else { format!("{value:?}") }
}

/// The text of a model without effects.
pub(super) fn blank(input: Input, axis: Axis) -> String {
    let column = |name| axis.column(name);
    let axis_line = if axis == Axis::Linear { "axis = \"linear\"\n" } else { "" };
    let mut text = format!(
        "[drive]\n{axis_line}input = \"{}\" # u_V, i_A, {}, {} (prescribed motion), or {} (position servo)\n# outputs = [\"{}\"] # default: all columns that the log has\neffects = []\n\n[parameters] # start values of a fit; {{ value = …, fixed = true }} fixes a parameter\n",
        column(input.column()),
        column("torque_N_m"),
        column("theta_rad"),
        column("theta_cmd_rad"),
        column("omega_rad_s"),
    );
    for base in BaseParameter::ALL {
        let is_needed = needed(input).contains(&base)
            || (input == Input::Motion && matches!(base, BaseParameter::Inertia | BaseParameter::MotorConstant));
        if is_needed {
            let parameter = base.info();
            let start = match (axis, base) {
                (Axis::Linear, BaseParameter::Inertia) => 1.0,
                (Axis::Linear, BaseParameter::MotorConstant) => 10.0,
                _ => parameter.start,
            };
            let (name, description, unit) =
                (axis.parameter(parameter.name), axis.quantity(parameter.description), axis.unit(parameter.unit));
            // Without a current, the gain of a servo and these two are one factor.
            let fixed = input == Input::Setpoint && matches!(base, BaseParameter::MotorConstant | BaseParameter::Resistance);
            let value = if fixed { format!("{{ value = {}, fixed = true }}", number(start)) } else { number(start) };
            text.push_str(&format!("{name} = {value} # {description}, {unit}\n"));
        }
    }
    text
}

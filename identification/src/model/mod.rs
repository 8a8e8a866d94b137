//! The model file: the user's model of the drive.
//!
//! In: TOML. Out: a checked [`Model`]: input, outputs, effects of the catalogue, user effects, and one ordered list of [`ModelParameter`]s
//! (base parameters, then those of each effect in the order of its card, then those of the user effects), each in the unit of its name. All
//! names exist, and each parameter belongs to an effect and lies in its physical range. A parameter that the file omits has the start value
//! of the catalogue, stated by [`Model::remarks`]. Edits keep comments and order of the file.
//!
//! * A repeatable effect may have several instances: `cogging`, `cogging#2`. The parameters of the second instance have the same suffix,
//!   `"cogging_N_m#2" = 1e-3`, or are listed without it in a table `[effect."cogging#2"]`.
//! * Parameters of a user effect have names of the form `seal-drag.a` outside the file.

mod catalogue;
mod drive;
mod edit;
mod effects;
mod error;
pub mod expression;
mod read;
mod user_effects;

use std::path::Path;

use drive_model::{Card, Parameter, ParameterKind};
use toml_edit::DocumentMut;

use crate::files;
use crate::log::Axis;

pub use catalogue::BaseParameter;
pub use error::{ModelError, ModelErrorKind};
pub use user_effects::{SummingPoint, UserEffect};

/// Input of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// `u_V`
    Voltage,
    /// `i_A`
    Current,
    /// `torque_N_m`
    Torque,
    /// `theta_rad`: prescribed motion; the outputs are the current, torque and voltage that it needs, or the reading of a rate sensor.
    Motion,
    /// `theta_cmd_rad`: setpoint of a position servo, whose regulator is a part of the model.
    Setpoint,
}

impl Input {
    /// All inputs, in the order of the messages.
    pub const ALL: [Input; 5] = [Input::Voltage, Input::Current, Input::Torque, Input::Motion, Input::Setpoint];

    /// Column of the log.
    pub fn column(self) -> &'static str {
        match self {
            Input::Voltage => "u_V",
            Input::Current => "i_A",
            Input::Torque => "torque_N_m",
            Input::Motion => "theta_rad",
            Input::Setpoint => "theta_cmd_rad",
        }
    }

    /// A voltage drives the winding: it is measured, or the regulator of a servo gives it.
    pub fn is_voltage(self) -> bool {
        matches!(self, Input::Voltage | Input::Setpoint)
    }

    /// Outputs that can be compared for this input, in the order of the reports.
    pub fn outputs(self) -> &'static [Channel] {
        match self {
            Input::Voltage | Input::Setpoint => &[Channel::Rate, Channel::Current, Channel::Angle],
            Input::Current | Input::Torque => &[Channel::Rate, Channel::Angle],
            Input::Motion => &[Channel::Current, Channel::Torque, Channel::Voltage, Channel::Rate, Channel::Angle],
        }
    }
}

/// An output of the model, compared with a column of the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// `omega_rad_s`
    Rate,
    /// `theta_rad`
    Angle,
    /// `i_A`
    Current,
    /// `u_V`
    Voltage,
    /// `torque_N_m`
    Torque,
}

impl Channel {
    /// Column of the log.
    pub fn column(self) -> &'static str {
        match self {
            Channel::Rate => "omega_rad_s",
            Channel::Angle => "theta_rad",
            Channel::Current => "i_A",
            Channel::Voltage => "u_V",
            Channel::Torque => "torque_N_m",
        }
    }

    /// Column of the log that is compared with this output of a model. Where the angle is the input, the compared angle is that of a sensor
    /// under test.
    pub fn compared_column(self, input: Input) -> &'static str {
        match (self, input) {
            (Channel::Angle, Input::Motion) => "theta_sensor_rad",
            _ => self.column(),
        }
    }
}

/// One parameter.
#[derive(Debug, Clone)]
pub struct ModelParameter {
    /// Name: `inertia_kg_m2`, `cogging_N_m#2`, `seal-drag.a`.
    pub name: String,
    /// Value, or start of a fit, in the unit of the name.
    pub value: f64,
    /// A fit does not change the value.
    pub fixed: bool,
    /// The file omits the parameter; the value is the start value of the catalogue.
    pub filled_in: bool,
    /// Its entry in the catalogue; `None` for a parameter of a user effect.
    pub info: Option<&'static Parameter>,
}

impl ModelParameter {
    /// Transformation of the parameter in a fit.
    pub fn kind(&self) -> ParameterKind {
        self.info.map_or(ParameterKind::Signed, |i| i.kind)
    }

    /// Physical range.
    pub fn range(&self) -> (f64, f64) {
        self.info.map_or((f64::NEG_INFINITY, f64::INFINITY), |i| i.range)
    }
}

/// One effect of the catalogue in a model.
#[derive(Debug, Clone)]
pub struct ModelEffect {
    /// Its card.
    pub card: &'static Card,
    /// Number of the instance: 1, or the number after `#`.
    pub instance: u32,
    /// Indices into [`Model::parameters`], in the order of the card.
    pub parameters: Vec<usize>,
}

impl ModelEffect {
    /// Name in the file: `cogging`, `cogging#2`.
    pub fn name(&self) -> String {
        catalogue::with_instance(self.card.id, self.instance)
    }
}

/// A checked model.
#[derive(Debug, Clone)]
pub struct Model {
    name: String,
    axis: Axis,
    input: Input,
    outputs: Option<Vec<Channel>>,
    rate_column: Option<String>,
    columns: Vec<String>,
    effects: Vec<ModelEffect>,
    own: Vec<UserEffect>,
    parameters: Vec<ModelParameter>,
    remarks: Vec<String>,
    document: DocumentMut,
}

impl Model {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// One line with file, position and key.
    pub fn read(path: impl AsRef<Path>) -> Result<Model, ModelError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| ModelError::file(&name, ModelErrorKind::Read(e)))?;
        Model::parse(&text, &name)
    }

    /// Reads the text of a model file; `name` is its name in messages.
    ///
    /// # Errors
    /// As [`Model::read`].
    pub fn parse(text: &str, name: &str) -> Result<Model, ModelError> {
        read::parse(text, name)
    }

    /// A model of the default stand without effects, with comments.
    ///
    /// # Errors
    /// As [`Model::parse`].
    pub fn new(input: Input, name: &str) -> Result<Model, ModelError> {
        Model::new_on(Axis::Rotary, input, name)
    }

    /// The same with the given axis; the input is named as on a rotary one.
    ///
    /// # Errors
    /// As [`Model::parse`].
    pub fn new_on(axis: Axis, input: Input, name: &str) -> Result<Model, ModelError> {
        Model::parse(&catalogue::blank(input, axis), name)
    }

    /// The axis of the drive. Names in this program are those of a rotary one; the file and the reports have those of the axis.
    pub fn axis(&self) -> Axis {
        self.axis
    }

    /// The text of the file, with its comments and order.
    pub fn to_toml(&self) -> String {
        self.document.to_string()
    }

    /// Writes the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), ModelError> {
        let path = path.as_ref();
        files::replace_text(path, &self.to_toml()).map_err(|e| ModelError::file(&path.display().to_string(), ModelErrorKind::Write(e)))
    }

    /// Name of the file in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Input of the model.
    pub fn input(&self) -> Input {
        self.input
    }

    /// Outputs; `None`: all that the log contains and the input allows.
    pub fn outputs(&self) -> Option<&[Channel]> {
        self.outputs.as_deref()
    }

    /// Column of the log that is compared as the rate, instead of `omega_rad_s`: that of another sensor.
    pub fn rate_column(&self) -> Option<&str> {
        self.rate_column.as_deref()
    }

    /// Columns of the log that expressions use, in the order of the file.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Effects of the catalogue, in the order of the file.
    pub fn effects(&self) -> &[ModelEffect] {
        &self.effects
    }

    /// User effects, in the order of the file.
    pub fn user_effects(&self) -> &[UserEffect] {
        &self.own
    }

    /// Names of all effects: those of the catalogue, then user effects.
    pub fn effect_names(&self) -> Vec<String> {
        self.effects.iter().map(ModelEffect::name).chain(self.own.iter().map(|o| o.name.clone())).collect()
    }

    /// The effects without their values, sorted: the harmonic order or number of periods tells effects of one kind apart.
    pub fn structure(&self) -> Vec<String> {
        let one = |e: &ModelEffect| {
            let order = e.card.harmonic_order_index().or(e.card.periodicity_index()).and_then(|k| e.parameters.get(k));
            order.map_or_else(|| e.card.id.to_owned(), |&k| format!("{} {:.2}", e.card.id, self.parameters[k].value))
        };
        let mut all: Vec<String> = self.effects.iter().map(one).chain(self.own.iter().map(|o| o.name.clone())).collect();
        all.sort();
        all
    }

    /// All parameters: base, then those of each effect, then those of the user effects.
    pub fn parameters(&self) -> &[ModelParameter] {
        &self.parameters
    }

    /// The parameter of that name.
    pub fn parameter(&self, name: &str) -> Option<&ModelParameter> {
        self.parameters.iter().find(|p| p.name == name)
    }

    /// The value of that name.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.parameter(name).map(|p| p.value)
    }

    /// Index of that name in [`Model::parameters`].
    pub fn index(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.name == name)
    }

    /// The value of a base parameter; `None` if the model does not have it.
    pub fn base(&self, parameter: BaseParameter) -> Option<f64> {
        self.value(parameter.name())
    }

    /// Index of a base parameter in [`Model::parameters`].
    pub fn base_index(&self, parameter: BaseParameter) -> Option<usize> {
        self.index(parameter.name())
    }

    /// Remarks for the user, one line each: start values, effects without influence.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }
}

#[cfg(test)]
mod tests;

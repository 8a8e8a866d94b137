//! The model file: what the user believes about the drive (interfaces.md, "Models").
//!
//! In: TOML. Out: a [`Model`], typed and checked: input, outputs, effects of the catalogue and of the user's own, and one ordered list
//! of [`ModelParameter`]s (base, then each effect's in its card's order, then the own ones), each in the unit of its name. A checked
//! model names only what exists, each parameter belongs to an effect and lies in its physical range; what the file leaves out begins
//! at the catalogue's start value, and [`Model::remarks`] says so. Edits keep the person's comments and order.
//!
//! * an effect may repeat: `cogging`, `cogging#2`; the second's parameters bear the same mark, `"cogging_N_m#2" = 1e-3`, or stand
//!   without it in a table `[effect."cogging#2"]`. Effects that change the structure of the drive do not repeat;
//! * parameters of an effect of the user's own are called `seal-drag.a` outside the file.

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

pub use catalogue::BASE;
pub use error::{ModelError, ModelErrorKind};
pub use user_effects::{SummingPoint, UserEffect};

/// What drives the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// `u_V`
    Voltage,
    /// `i_A`
    Current,
    /// `torque_N_m`
    Torque,
    /// `theta_rad`: prescribed motion; compared is what it needs.
    Motion,
}

impl Input {
    /// All, as the file may name them.
    pub const ALL: [Input; 4] = [Input::Voltage, Input::Current, Input::Torque, Input::Motion];

    /// The column of the log.
    pub fn column(self) -> &'static str {
        match self {
            Input::Voltage => "u_V",
            Input::Current => "i_A",
            Input::Torque => "torque_N_m",
            Input::Motion => "theta_rad",
        }
    }

    /// What can be compared under this input, in the order in which it is said.
    pub fn outputs(self) -> &'static [Channel] {
        match self {
            Input::Voltage => &[Channel::Rate, Channel::Current, Channel::Angle],
            Input::Current | Input::Torque => &[Channel::Rate, Channel::Angle],
            Input::Motion => &[Channel::Current, Channel::Torque, Channel::Voltage],
        }
    }
}

/// What is compared.
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
    /// The column of the log.
    pub fn column(self) -> &'static str {
        match self {
            Channel::Rate => "omega_rad_s",
            Channel::Angle => "theta_rad",
            Channel::Current => "i_A",
            Channel::Voltage => "u_V",
            Channel::Torque => "torque_N_m",
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
    /// Not to be fitted.
    pub fixed: bool,
    /// The file does not give it; the value is the catalogue's start.
    pub filled_in: bool,
    /// What the catalogue says of it; `None` for a parameter of the user's own.
    pub info: Option<&'static Parameter>,
}

impl ModelParameter {
    /// How a fit moves it.
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
    /// What the catalogue says of it.
    pub card: &'static Card,
    /// 1, or the number after `#`.
    pub instance: u32,
    /// Indices into [`Model::parameters`], in the card's order.
    pub parameters: Vec<usize>,
}

impl ModelEffect {
    /// Name in the file: `cogging`, `cogging#2`.
    pub fn name(&self) -> String {
        catalogue::with_instance(self.card.id, self.instance)
    }
}

/// A model, checked.
#[derive(Debug, Clone)]
pub struct Model {
    name: String,
    input: Input,
    outputs: Option<Vec<Channel>>,
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
    /// One line with file, place and key.
    pub fn read(path: impl AsRef<Path>) -> Result<Model, ModelError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| ModelError::file(&name, ModelErrorKind::Read(e)))?;
        Model::parse(&text, &name)
    }

    /// Reads the text of a model file; `name` is what it is called in messages.
    ///
    /// # Errors
    /// As [`Model::read`].
    pub fn parse(text: &str, name: &str) -> Result<Model, ModelError> {
        read::parse(text, name)
    }

    /// A model of the default stand without effects, as a commented file.
    pub fn new(input: Input, name: &str) -> Result<Model, ModelError> {
        Model::parse(&catalogue::blank(input), name)
    }

    /// The file's text, comments and order kept.
    pub fn to_toml(&self) -> String {
        self.document.to_string()
    }

    /// Writes the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), ModelError> {
        let path = path.as_ref();
        std::fs::write(path, self.to_toml()).map_err(|e| ModelError::file(&path.display().to_string(), ModelErrorKind::Write(e)))
    }

    /// What the file is called in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What drives the model.
    pub fn input(&self) -> Input {
        self.input
    }

    /// What is compared; `None`: all that the log has and the input allows.
    pub fn outputs(&self) -> Option<&[Channel]> {
        self.outputs.as_deref()
    }

    /// Effects of the catalogue, in the file's order.
    pub fn effects(&self) -> &[ModelEffect] {
        &self.effects
    }

    /// Effects of the user's own, in the file's order.
    pub fn user_effects(&self) -> &[UserEffect] {
        &self.own
    }

    /// Names of all effects: the catalogue's, then the own.
    pub fn effect_names(&self) -> Vec<String> {
        self.effects.iter().map(ModelEffect::name).chain(self.own.iter().map(|o| o.name.clone())).collect()
    }

    /// All parameters: base, then each effect's, then the own ones.
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

    /// Where in [`Model::parameters`] that name is.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.name == name)
    }

    /// What the person should hear: values that were filled in, effects that do nothing; a line each.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }
}

#[cfg(test)]
mod tests;

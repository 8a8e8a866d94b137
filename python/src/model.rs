//! Models: effects, parameters, expressions.

use std::path::PathBuf;

use identification::log::Axis;
use identification::model::{self, Input, ModelError, SummingPoint};
use identification::words::nearest;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stand_report as report;

use crate::error::model_error;

/// A model of a drive. An analysis takes a copy.
#[pyclass(module = "rotary_stand._native")]
pub struct Model {
    model: model::Model,
}

impl From<model::Model> for Model {
    fn from(model: model::Model) -> Self {
        Model { model }
    }
}

impl Model {
    /// A copy of the library's model.
    pub fn copy(&self) -> model::Model {
        self.model.clone()
    }

    fn edit(&mut self, edit: impl FnOnce(&mut model::Model) -> Result<(), ModelError>) -> PyResult<()> {
        edit(&mut self.model).map_err(|error| model_error(&error))
    }
}

/// A word that must be one of `known`.
///
/// # Errors
/// `ValueError`, with the nearest of `known`.
pub fn chosen<T>(what: &str, word: &str, known: &[&'static str], choice: Option<T>) -> PyResult<T> {
    choice.ok_or_else(|| {
        let hint = nearest(word, known.iter().copied()).map_or(String::new(), |near| format!("; did you mean {near:?}?"));
        PyValueError::new_err(format!("{what} {word:?}: must be one of {}{hint}", known.join(", ")))
    })
}

#[pymethods]
impl Model {
    /// Reads a model file.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Model> {
        model::Model::read(path).map(Model::from).map_err(|error| model_error(&error))
    }

    /// Reads the text of a model file; `name` is its name in messages.
    #[staticmethod]
    fn parse(text: &str, name: &str) -> PyResult<Model> {
        model::Model::parse(text, name).map(Model::from).map_err(|error| model_error(&error))
    }

    /// A model without effects, with the start values of the default stand.
    #[staticmethod]
    fn new(input: &str, axis: &str, name: &str) -> PyResult<Model> {
        let axis = chosen("axis", axis, &["rotary", "linear"], Axis::named(axis))?;
        let known = Input::ALL.map(|input| axis.column(input.column()));
        let input = chosen("input", input, &known, Input::ALL.into_iter().find(|i| axis.column(i.column()) == input))?;
        model::Model::new_on(axis, input, name).map(Model::from).map_err(|error| model_error(&error))
    }

    /// The same model as another object.
    fn clone(&self) -> Model {
        self.copy().into()
    }

    /// Adds an effect of the catalogue, or a further instance of one that the model has.
    fn add(&mut self, effect: &str) -> PyResult<()> {
        self.edit(|model| {
            let is_further = model.effect_names().iter().any(|name| name == effect) && !effect.contains('#');
            let name = if is_further { model.next_name(effect) } else { effect.to_owned() };
            model.add(&name)
        })
    }

    /// Adds an effect of the user's own, an expression.
    fn add_expression(&mut self, name: &str, adds_to: &str, expression: &str, parameters: Vec<(String, f64)>) -> PyResult<()> {
        let axis = self.model.axis();
        let known = SummingPoint::ALL.map(|point| point.key_on(axis));
        let point = SummingPoint::ALL.into_iter().find(|point| point.key_on(axis) == adds_to);
        let point = chosen("adds_to", adds_to, &known, point)?;
        let parameters: Vec<(&str, f64)> = parameters.iter().map(|(name, start)| (name.as_str(), *start)).collect();
        self.edit(|model| model.add_user_effect(name, point, expression, &parameters))
    }

    /// Removes an effect with its parameters.
    fn remove(&mut self, effect: &str) -> PyResult<()> {
        self.edit(|model| model.remove(effect))
    }

    /// Sets the value of a parameter.
    fn set(&mut self, parameter: &str, value: f64) -> PyResult<()> {
        self.edit(|model| model.set(parameter, value))
    }

    /// Fixes a parameter at its value, or frees it.
    fn fix(&mut self, parameter: &str, fixed: bool) -> PyResult<()> {
        self.edit(|model| model.fix(parameter, fixed))
    }

    /// The text of the model file.
    fn to_toml(&self) -> String {
        self.model.to_toml()
    }

    /// Writes the model file.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        self.model.write(path).map_err(|error| model_error(&error))
    }

    /// The model as `stand model show --json` gives it.
    #[getter]
    fn json(&self) -> String {
        report::model::json(&self.model).to_string()
    }

    /// The model as `stand model show` prints it.
    #[getter]
    fn text(&self) -> String {
        report::model::text(&self.model)
    }

    /// Columns of a log that expressions use, and the column of another rate sensor.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.model.columns().iter().map(String::as_str).chain(self.model.rate_column()).map(str::to_owned).collect()
    }
}

//! An answer in the forms of the command line: JSON, text, HTML.

use pyo3::prelude::*;
use serde_json::Value;
use stand_report::Style;

use crate::log::Log;
use crate::model::Model;

/// Text without colour, in lines of this many columns.
pub const STYLE: Style = Style { colour: false, width: 80 };

/// The answer of an analysis: JSON as of `--json`, text as on the terminal, the page of `--html` (empty: the analysis has none).
#[pyclass(frozen, module = "rotary_stand._native")]
pub struct Answer {
    #[pyo3(get)]
    json: String,
    #[pyo3(get)]
    text: String,
    #[pyo3(get)]
    html: String,
    series: Option<identification::log::Log>,
    model: Option<identification::model::Model>,
    /// State of a search that was not finished, to go on from; None for any other answer.
    #[pyo3(get)]
    state: Option<String>,
}

impl Answer {
    /// An answer without series and model.
    pub fn new(json: &Value, text: String, html: String) -> Self {
        Answer { json: json.to_string(), text, html, series: None, model: None, state: None }
    }

    /// The same with the measured and modelled series.
    pub fn with_series(self, series: identification::log::Log) -> Self {
        Answer { series: Some(series), ..self }
    }

    /// The same with a model that the analysis made.
    pub fn with_model(self, model: identification::model::Model) -> Self {
        Answer { model: Some(model), ..self }
    }

    /// The same with the state of a search that was not finished.
    pub fn with_state(self, state: Option<String>) -> Self {
        Answer { state, ..self }
    }
}

#[pymethods]
impl Answer {
    /// Measured and modelled series; None for an analysis without them.
    #[getter]
    fn series(&self) -> Option<Log> {
        self.series.clone().map(Log::from)
    }

    /// The model that the analysis made; None for an analysis without one.
    #[getter]
    fn model(&self) -> Option<Model> {
        self.model.clone().map(Model::from)
    }
}

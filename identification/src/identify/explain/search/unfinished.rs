//! A search that its budget has ended: what is open, and the state from which another run continues.
//!
//! The state holds what was decided, as model files with their fitted values. Another run fits these again, screens the given model again
//! for the answer, and goes on where the budget ended. The budget of that run counts from zero.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::identify::explain::fitted::trial::Trial;
use crate::log::Log;
use crate::model::{Model, ModelError};
use crate::recording::Convention;

/// Version of the form of [`SearchState`].
const VERSION: u32 = 1;

/// What a search has settled.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SearchState {
    version: u32,
    /// Blocks of rows are held out.
    pub(crate) hold_out: bool,
    /// Nothing more was to be added by these conventions.
    pub(crate) is_complete: bool,
    /// Times that an added effect led to a better fit without it.
    pub(crate) restarts: usize,
    /// Conventions of recording that were assumed.
    pub(crate) conventions: Vec<Convention>,
    /// SHA-256 of the columns of the logs, hexadecimal.
    logs_sha256: String,
    /// The given model, as it was read.
    model: String,
    /// One stage for each added effect.
    #[serde(default)]
    pub(crate) stages: Vec<StageState>,
}

/// What a search has settled, beside its logs and its model.
pub(crate) struct Settled {
    /// Blocks of rows are held out.
    pub hold_out: bool,
    /// Nothing more was to be added by these conventions.
    pub is_complete: bool,
    /// Times that an added effect led to a better fit without it.
    pub restarts: usize,
    /// Conventions of recording that were assumed.
    pub conventions: Vec<Convention>,
    /// One stage for each added effect.
    pub stages: Vec<StageState>,
}

/// A model with an added effect.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct StageState {
    /// Name of the effect that was added.
    pub effect: String,
    /// Whether its rate channel is derived from the encoder.
    pub rate_from_encoder: bool,
    /// The model file with the fitted values.
    pub model_file: String,
    /// Effects that may take its place later.
    #[serde(default)]
    pub rivals: Vec<Trial>,
}

/// Why a state cannot be continued from.
#[derive(Debug, thiserror::Error)]
pub enum StateError {
    /// It is not the text of a state.
    #[error("this is no state of a search: {0}")]
    NoState(String),
    /// Another version of the program has written it.
    #[error("the state has version {0}; this program continues from version {VERSION}: explain the log again from the beginning")]
    Version(u32),
    /// It is the state of another model.
    #[error("the state is that of another model: continue with the model that was given then, or explain the log again from the beginning")]
    OtherModel,
    /// It is the state of other logs.
    #[error("the state is that of other logs: continue with the logs that were given then, or explain these from the beginning")]
    OtherLogs,
    /// A model in it cannot be read.
    #[error("a model in the state cannot be read: {0}")]
    Model(#[from] ModelError),
}

impl SearchState {
    /// The state of a search from the `given` model on these logs.
    pub(crate) fn new(given: &Model, log: &Log, settled: Settled) -> SearchState {
        let Settled { hold_out, is_complete, restarts, conventions, stages } = settled;
        let (logs_sha256, model) = (hash_of(log), given.to_toml());
        SearchState { version: VERSION, hold_out, is_complete, restarts, conventions, logs_sha256, model, stages }
    }

    /// The state in a text of [`SearchState::to_toml`].
    ///
    /// # Errors
    /// The text is no state, or that of another version.
    pub fn parse(text: &str) -> Result<SearchState, StateError> {
        let state: SearchState = toml::from_str(text).map_err(|error| StateError::NoState(error.message().to_owned()))?;
        if state.version == VERSION { Ok(state) } else { Err(StateError::Version(state.version)) }
    }

    /// The state as the text of a file.
    pub fn to_toml(&self) -> String {
        // Numbers, texts and lists have a form in TOML.
        toml::to_string(self).unwrap_or_default()
    }

    pub(crate) fn check(&self, log: &Log, given: &Model) -> Result<(), StateError> {
        self.stages.iter().try_for_each(|stage| stage.model().map(drop))?;
        if self.model != given.to_toml() {
            return Err(StateError::OtherModel);
        }
        if self.logs_sha256 == hash_of(log) { Ok(()) } else { Err(StateError::OtherLogs) }
    }
}

fn hash_of(log: &Log) -> String {
    let mut hash = Sha256::new();
    for column in log.columns() {
        hash.update(column.name.as_bytes());
        column.values.iter().for_each(|value| hash.update(value.to_le_bytes()));
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

impl StageState {
    pub fn model(&self) -> Result<Model, ModelError> {
        Model::parse(&self.model_file, "a stage of the search")
    }
}

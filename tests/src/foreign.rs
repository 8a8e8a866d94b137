//! External records of another simulator with their true answers (folder `cases` of `STAND_DATA`).

use identification::recording;
use std::fs;
use std::path::{Path, PathBuf};

use identification::identify::fit::{self, FitError, FitResult};
use identification::log::Log;
use identification::model::Model;
use serde_json::Value;

/// The folder of the external records, from the environment variable `STAND_DATA`.
///
/// # Panics
/// `STAND_DATA` is not set or names no folder.
pub fn stand_data() -> PathBuf {
    let folder = std::env::var_os("STAND_DATA").map(PathBuf::from);
    let folder = folder.expect("the environment variable STAND_DATA names the folder of the external records");
    assert!(folder.is_dir(), "STAND_DATA: {} is not a folder", folder.display());
    folder
}

/// One case.
pub struct Case {
    /// Name of its folder.
    pub name: String,
    /// Log.
    pub log: Log,
    /// The user's model.
    pub user_model_table: toml::Table,
    /// The hidden effect, `none`, or `outside-…`.
    pub hidden: String,
    /// True effects, hidden one last; `None` where the hidden one is not in the catalogue.
    pub effects: Option<Vec<String>>,
    /// True parameters.
    pub truth: Vec<(String, f64)>,
    /// The rate is derived from the encoder (stated in the collection's README only).
    pub rate_from_encoder: bool,
}

/// All cases, sorted by name.
///
/// # Panics
/// A case is incomplete.
pub fn cases(data: &Path) -> Vec<Case> {
    let mut folders: Vec<PathBuf> =
        fs::read_dir(data.join("cases")).expect("the cases").map(|e| e.expect("an entry").path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    folders.iter().map(|folder| case(folder)).collect()
}

/// The case in a folder.
///
/// # Panics
/// It is incomplete.
pub fn case(folder: &Path) -> Case {
    let text = |name: &str| fs::read_to_string(folder.join(name)).expect("a file of the case");
    let answer: Value = serde_json::from_str(&text("truth.json")).expect("the answer");
    let hidden = answer["hidden"].as_str().expect("the hidden effect").to_owned();
    let mut effects: Vec<String> = serde_json::from_value(answer["known"].clone()).expect("the known effects");
    let inside = !hidden.starts_with("outside");
    if inside && hidden != "none" {
        effects.push(hidden.clone());
    }
    let truth =
        answer["parameters"].as_object().expect("parameters").iter().map(|(k, v)| (k.clone(), v.as_f64().expect("a number"))).collect();
    Case {
        name: folder.file_name().expect("a name").to_string_lossy().into_owned(),
        rate_from_encoder: hidden == "encoder-eccentricity",
        hidden,
        log: Log::read(folder.join("log.parquet")).expect("the log"),
        user_model_table: toml::from_str(&text("model.toml")).expect("the model"),
        effects: inside.then_some(effects),
        truth,
    }
}

impl Case {
    /// The true value of a parameter.
    pub fn true_value(&self, name: &str) -> Option<f64> {
        self.truth.iter().find(|(n, _)| n == name).map(|(_, v)| *v)
    }

    /// The user's model.
    ///
    /// # Panics
    /// The case's model is invalid.
    pub fn user_model(&self) -> Model {
        Model::parse(&self.user_model_table.to_string(), &self.name).expect("a model of the case")
    }

    /// The model with true effects and parameters; `None` where an effect is not in the catalogue.
    pub fn true_model(&self) -> Option<Model> {
        let parameters: Vec<(String, f64)> = self.truth.clone();
        Some(self.model(self.effects.as_ref()?, &parameters))
    }

    /// The model with the true effects at the start of a fit: the user's values, and the catalogue's start for the hidden effect. Harmonic
    /// orders are true, because no fit changes them.
    pub fn start_model(&self) -> Option<Model> {
        let user_model_table = self.user_model_table["parameters"].as_table().expect("parameters");
        let mut parameters: Vec<(String, f64)> =
            user_model_table.iter().map(|(k, v)| (k.clone(), v.as_float().expect("a number"))).collect();
        for (name, value) in &self.truth {
            if name.ends_with("_order") {
                parameters.push((name.clone(), *value));
            }
        }
        Some(self.model(self.effects.as_ref()?, &parameters))
    }

    fn model(&self, effects: &[String], parameters: &[(String, f64)]) -> Model {
        let mut text =
            format!("[drive]\ninput = \"u_V\"\noutputs = [\"omega_rad_s\", \"i_A\", \"theta_rad\"]\neffects = {effects:?}\n[parameters]\n");
        for (name, value) in parameters {
            // A true coefficient of zero is fixed at zero.
            let zero = *value == 0.0 || (self.true_value(name) == Some(0.0));
            text += &if zero { format!("{name} = {{ value = 0.0, fixed = true }}\n") } else { format!("{name} = {value:e}\n") };
        }
        if effects.iter().any(|e| e == "asymmetric-friction") {
            text += "asymmetry_N_m_s = { value = 0.0, fixed = true }\n";
        }
        Model::parse(&text, &self.name).expect("a model of the case")
    }

    /// Compares `model` with the log, or fits it.
    ///
    /// # Errors
    /// The model cannot be simulated.
    ///
    /// # Panics
    /// The log lacks a column.
    pub fn fit_or_compare(&self, model: &Model, fitted: bool) -> Result<FitResult, FitError> {
        let (mut record, _) = recording::prepare(&self.log, model, fitted).expect("the log has the columns");
        record.rate_from_encoder = self.rate_from_encoder;
        let (system, parameters) = fit::build::system(model, record.temp_C.is_some());
        if fitted { fit::fit(&system, &parameters, &record) } else { fit::compare(&system, &parameters, &record) }
    }

    /// Fitted minus true value of every fitted parameter, in standard errors.
    pub fn deviations(&self, held: &FitResult) -> Vec<(String, f64)> {
        held.parameters
            .list
            .iter()
            .zip(&held.sigmas)
            .filter(|(p, sigma)| !p.fixed && **sigma > 0.0)
            .filter_map(|(p, sigma)| {
                let mut off = p.value - self.true_value(&p.name)?;
                if p.name.ends_with("_phase_rad") {
                    off -= std::f64::consts::TAU * (off / std::f64::consts::TAU).round();
                }
                Some((p.name.clone(), off / sigma))
            })
            .collect()
    }
}

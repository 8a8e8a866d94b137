//! Logs of another simulator, each with a hidden effect or none, with its answer (folder `cases` of `STAND_DATA`).

use std::fs;
use std::path::{Path, PathBuf};

use host_tools::identify::fit::{self, FitError, FitResult};
use host_tools::log::Log;
use host_tools::model::Model;
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
    /// The log.
    pub log: Log,
    /// What the user believes.
    pub believed: toml::Table,
    /// What is hidden: an effect, `none`, or `outside-…`.
    pub hidden: String,
    /// Effects that are there, the hidden one last; `None` where the hidden one is no effect of the catalogue.
    pub effects: Option<Vec<String>>,
    /// True parameters.
    pub truth: Vec<(String, f64)>,
    /// The rate was seen by the encoder (the log does not say so, the collection's README does).
    pub rate_from_encoder: bool,
}

/// All cases, in order.
///
/// # Panics
/// Where a case is not whole.
pub fn cases(data: &Path) -> Vec<Case> {
    let mut folders: Vec<PathBuf> =
        fs::read_dir(data.join("cases")).expect("the cases").map(|e| e.expect("an entry").path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    folders.iter().map(|folder| case(folder)).collect()
}

fn case(folder: &Path) -> Case {
    let text = |name: &str| fs::read_to_string(folder.join(name)).expect("a file of the case");
    let answer: Value = serde_json::from_str(&text("truth.json")).expect("the answer");
    let hidden = answer["hidden"].as_str().expect("what is hidden").to_owned();
    let mut effects: Vec<String> = serde_json::from_value(answer["known"].clone()).expect("what is known");
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
        believed: toml::from_str(&text("model.toml")).expect("the model"),
        effects: inside.then_some(effects),
        truth,
    }
}

impl Case {
    /// The true value of a parameter.
    pub fn true_value(&self, name: &str) -> Option<f64> {
        self.truth.iter().find(|(n, _)| n == name).map(|(_, v)| *v)
    }

    /// What the user believes.
    ///
    /// # Panics
    /// Where the case's model is none.
    pub fn user_model(&self) -> Model {
        Model::parse(&self.believed.to_string(), &self.name).expect("a model of the case")
    }

    /// The model with the true effects and parameters; `None` where no effect of the catalogue is true.
    pub fn true_model(&self) -> Option<Model> {
        let parameters: Vec<(String, f64)> = self.truth.clone();
        Some(self.model(self.effects.as_ref()?, &parameters))
    }

    /// The model with the true effects at the given start: what the user believes, and the catalogue's start for the hidden effect (its
    /// order, which no fit moves, is the true one).
    pub fn start_model(&self) -> Option<Model> {
        let believed = self.believed["parameters"].as_table().expect("parameters");
        let mut parameters: Vec<(String, f64)> = believed.iter().map(|(k, v)| (k.clone(), v.as_float().expect("a number"))).collect();
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
            // A coefficient that is truly zero is not part of the question.
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
    /// Where it cannot be simulated.
    ///
    /// # Panics
    /// Where the log lacks a column.
    pub fn hold(&self, model: &Model, fitted: bool) -> Result<FitResult, FitError> {
        let (mut record, _) = fit::prepare::prepare(&self.log, model, fitted).expect("the log has the columns");
        record.rate_from_encoder = self.rate_from_encoder;
        let (system, parameters) = fit::build::system(model, record.temp_C.is_some());
        if fitted { fit::fit(&system, &parameters, &record) } else { fit::compare(&system, &parameters, &record) }
    }

    /// Fitted minus true, in standard errors, of every parameter that was fitted.
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

//! The works of the course: their definitions and texts, embedded from `labs/`.
//!
//! A folder `labs/NN-name` has `lab.toml` (device, measurement, quantities, questions: [`Lab`]), `en.md` and `uk.md` (aim, theory, steps),
//! and, where the work records a session, `session.toml`. A work is in [`works`] only if it can be started and graded.

use std::borrow::Cow;
use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::LabError;
use stand_acquire::calibration_session::{DutKind, PreparedSession, SessionChanges};

/// Language of the texts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, serde::Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Language {
    /// English
    #[default]
    En,
    /// Ukrainian
    Uk,
}

/// A text in both languages.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Text {
    en: String,
    uk: String,
}

impl Text {
    /// The text in a language.
    pub fn in_language(&self, language: Language) -> &str {
        match language {
            Language::En => &self.en,
            Language::Uk => &self.uk,
        }
    }
}

/// When a question is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum When {
    /// Before the measurement.
    Before,
    /// After it.
    After,
}

/// A question, answered in words; the teacher judges it.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Question {
    /// Key in the table of answers.
    pub id: String,
    /// When it is answered.
    pub when: When,
    /// The question.
    pub text: Text,
}

/// A quantity to be measured.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QuantitySpec {
    /// Name of the quantity of `stand calibrate`, whose result is the reference procedure.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// What it is.
    pub text: Text,
}

/// Logs of a session with a drawn device; its quantities have true values.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionTask {
    /// Device under test.
    pub device: DutKind,
    /// The quantities.
    pub quantities: Vec<QuantitySpec>,
}

/// Log of a drift session with a drawn gyroscope.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriftTask {
    /// Latitude of the site, degrees, north positive.
    pub latitude_deg: f64,
    /// The quantities.
    pub quantities: Vec<QuantitySpec>,
}

/// Logs at constant rates with a drawn friction.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionTask {
    /// Motor constant by its certificate, N m/A.
    pub motor_constant_N_m_A: f64,
    /// Its half-width, %.
    pub motor_constant_percent: f64,
    /// Half-width of the current reading, %.
    pub current_percent: f64,
    /// The runs: slow, fast.
    pub runs: [StaircaseRun; 2],
    /// The quantities.
    pub quantities: Vec<QuantitySpec>,
}

/// A staircase of rates, both ways and with both signs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StaircaseRun {
    /// Greatest rate, rad/s.
    pub amplitude_rad_s: f64,
    /// Levels of one sign.
    pub levels: u32,
    /// Duration of a level, s.
    pub dwell_s: f64,
    /// Duration of the log, s.
    pub seconds: f64,
}

/// Logs at constant voltages of a drive with drawn disturbances of once per turn.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OncePerTurnTask {
    /// Moment of inertia by its certificate, kg m².
    pub inertia_kg_m2: f64,
    /// Its half-width, %.
    pub inertia_percent: f64,
    /// Voltages, V, slowest first; each is applied with both signs.
    pub voltages_V: [f64; 3],
    /// Duration of a log, s.
    pub seconds: f64,
    /// Time at its beginning that is left out, s.
    pub settle_s: f64,
    /// The quantities.
    pub quantities: Vec<QuantitySpec>,
}

/// Log of a sensitive element under a drawn constant moment.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObserversTask {
    /// Name of the element's preset.
    pub element: String,
    /// Duration of the log, s.
    pub seconds: f64,
    /// All poles of an observer are at minus this, 1/s: the astatic one for the moment, the slow and the fast static one.
    pub poles_1_s: [f64; 3],
    /// Half-width of the gain of the angle sensor, %.
    pub angle_gain_percent: f64,
    /// The quantities.
    pub quantities: Vec<QuantitySpec>,
}

/// Logs of drives with hidden effects.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HuntTask {
    /// Names of the logs.
    pub logs: Vec<String>,
    /// Greatest number of logs in which one class is present, `none` and `unknown` included.
    pub max_same: usize,
    /// Duration of a log, s.
    pub seconds: f64,
    /// Amplitude of the voltage steps, V.
    pub amplitude_V: f64,
    /// Shares of logs with no effect, one, two, and a disturbance outside the catalogue. They sum to 1.
    pub shares: Shares,
    /// The effects that may be hidden.
    pub effects: Vec<String>,
    /// The mean Brier score over the logs must be below this.
    pub max_brier_score: f64,
}

/// Shares of the kinds of logs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shares {
    /// Nothing is hidden.
    pub none: f64,
    /// One effect of the catalogue.
    pub one: f64,
    /// Two effects of the catalogue.
    pub two: f64,
    /// A disturbance that the catalogue lacks.
    pub unknown: f64,
}

/// What is measured in a work.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Task {
    /// Quantities of a device.
    Session(SessionTask),
    /// Friction of a drive.
    Friction(FrictionTask),
    /// Torque and encoder error of once per turn.
    OncePerTurn(OncePerTurnTask),
    /// Drift of a gyroscope.
    Drift(DriftTask),
    /// Observers of a sensitive element.
    Observers(ObserversTask),
    /// Hidden effects.
    Hunt(HuntTask),
}

/// The machine-readable definition of a work.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Definition {
    title: Text,
    task: Task,
    questions: Vec<Question>,
}

/// A work of the course.
#[derive(Debug, Clone, PartialEq)]
pub struct Lab {
    /// Identifier.
    pub id: &'static str,
    /// Number in the course.
    pub number: u32,
    /// Title.
    pub title: Text,
    /// What is measured.
    pub task: Task,
    /// The questions.
    pub questions: Vec<Question>,
    files: Files,
    /// Session or model: that of the course, or that of a real stand.
    data: Cow<'static, str>,
}

/// The embedded files of a work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Files {
    id: &'static str,
    number: u32,
    definition: &'static str,
    en: &'static str,
    uk: &'static str,
    /// Session or model, by the kind of the task; empty where it has neither.
    data: &'static str,
}

macro_rules! files {
    ($id:literal, $number:literal, $folder:literal, $data:expr) => {
        Files {
            id: $id,
            number: $number,
            definition: include_str!(concat!("../../labs/", $folder, "/lab.toml")),
            en: include_str!(concat!("../../labs/", $folder, "/en.md")),
            uk: include_str!(concat!("../../labs/", $folder, "/uk.md")),
            data: $data,
        }
    };
}

/// The works that can be started and graded.
const FILES: [Files; 8] = [
    files!("motor", 1, "01-motor", include_str!("../../labs/01-motor/session.toml")),
    files!("friction", 2, "02-friction", ""),
    files!("once-per-turn", 3, "03-once-per-turn", ""),
    files!("gyro", 4, "04-gyro", include_str!("../../labs/04-gyro/session.toml")),
    files!("accelerometer", 5, "05-accelerometer", include_str!("../../labs/05-accelerometer/session.toml")),
    files!("drift", 6, "06-drift", ""),
    files!("observers", 7, "07-observers", ""),
    files!("hunt", 8, "08-hunt", include_str!("../../labs/08-hunt/model.toml")),
];

impl Lab {
    fn of(files: Files) -> Result<Self, LabError> {
        let wrong = |message: String| LabError::Definition { lab: files.id.to_owned(), message };
        let Definition { title, task, questions } = toml::from_str(files.definition).map_err(|e| wrong(e.to_string()))?;
        Ok(Lab { id: files.id, number: files.number, title, task, questions, files, data: Cow::Borrowed(files.data) })
    }

    /// The work on a real stand: `known` replaces what the texts state of the simulated stand, and a hunt has the model of the real drive.
    ///
    /// # Errors
    /// A value that the work does not have; values that only the real stand has are missing; an invalid model.
    pub fn on_real_stand(mut self, known: &BTreeMap<String, f64>, model: Option<&str>) -> Result<Self, LabError> {
        if let Some(name) = known.keys().find(|name| !self.known_names().contains(&name.as_str())) {
            let names = self.known_names().join(", ");
            return Err(LabError::Argument(format!(
                "known.{name}: the work `{}` has {}",
                self.id,
                if names.is_empty() { "no such values".to_owned() } else { format!("only {names}") }
            )));
        }
        if let Some(name) = self.required_names().iter().find(|name| !known.contains_key(**name)) {
            return Err(LabError::Argument(format!(
                "known.{name} is missing: the value in the text of the work `{}` is that of the simulated stand",
                self.id
            )));
        }
        if model.is_some() != self.hunt().is_some() {
            return Err(LabError::Argument(match model {
                Some(_) => format!("the work `{}` has no model", self.id),
                None => "a hunt on a real stand needs the model of the stand with nothing hidden (--model)".to_owned(),
            }));
        }
        let value = |name: &str| known.get(name).copied().unwrap_or(f64::NAN);
        match &mut self.task {
            Task::Session(_) => {
                let wrong = |e: toml_edit::TomlError| LabError::Definition { lab: self.id.to_owned(), message: e.to_string() };
                let mut document: toml_edit::DocumentMut = self.data.parse().map_err(wrong)?;
                for (name, value) in known {
                    document["known"][name] = toml_edit::value(*value);
                }
                self.data = Cow::Owned(document.to_string());
            }
            Task::Friction(task) => {
                task.motor_constant_N_m_A = value("motor_constant_N_m_A");
                task.motor_constant_percent = value("motor_constant_percent");
                task.current_percent = value("current_percent");
            }
            Task::OncePerTurn(task) => {
                task.inertia_kg_m2 = value("inertia_kg_m2");
                task.inertia_percent = value("inertia_percent");
            }
            Task::Drift(task) => task.latitude_deg = value("latitude_deg"),
            Task::Observers(_) => {}
            Task::Hunt(_) => {
                let model = model.unwrap_or_default();
                identification::model::Model::parse(model, "model.toml").map_err(|e| LabError::Argument(e.to_string()))?;
                self.data = Cow::Owned(model.to_owned());
            }
        }
        Ok(self)
    }

    /// Values of a real stand that the text of a work states and a log does not show.
    fn known_names(&self) -> &'static [&'static str] {
        match &self.task {
            // The table `[known]` of a session.
            Task::Session(task) => match task.device {
                DutKind::Drive => &["crystal_ppm", "current_percent", "supply_percent"],
                DutKind::Gyro => &["crystal_ppm", "misalignment_deg", "level_deg", "g_sensitivity_deg_s_g"],
                DutKind::Accel => &["crystal_ppm", "radius_error_m", "level_deg", "gravity_m_s2"],
            },
            _ => self.required_names(),
        }
    }

    /// Those of [`Lab::known_names`] that must be given, because the value in the text is that of the simulated stand.
    fn required_names(&self) -> &'static [&'static str] {
        match &self.task {
            Task::Friction(_) => &["motor_constant_N_m_A", "motor_constant_percent", "current_percent"],
            Task::OncePerTurn(_) => &["inertia_kg_m2", "inertia_percent"],
            Task::Drift(_) => &["latitude_deg"],
            Task::Session(_) | Task::Observers(_) | Task::Hunt(_) => &[],
        }
    }

    /// The work with this identifier or number.
    ///
    /// # Errors
    /// There is none.
    pub fn find(name: &str) -> Result<Self, LabError> {
        let found = FILES.iter().find(|f| f.id == name || f.number.to_string() == name);
        found.map_or_else(|| Err(LabError::unknown(name, FILES.iter().map(|f| f.id))), |files| Lab::of(*files))
    }

    /// Aim, theory and steps.
    pub fn instructions(&self, language: Language) -> &'static str {
        match language {
            Language::En => self.files.en,
            Language::Uk => self.files.uk,
        }
    }

    /// What is different on a real stand, for the instructions: a template with `{stand}`, `{source}` and, for values, `{known}`.
    pub fn real_stand_text(&self, language: Language) -> &'static str {
        match (language, self.hunt()) {
            (Language::En, None) => include_str!("../../labs/real-stand/en.md"),
            (Language::Uk, None) => include_str!("../../labs/real-stand/uk.md"),
            (Language::En, Some(_)) => include_str!("../../labs/real-stand/hunt-en.md"),
            (Language::Uk, Some(_)) => include_str!("../../labs/real-stand/hunt-uk.md"),
        }
    }

    /// The session of a [`Task::Session`].
    ///
    /// # Errors
    /// The session is invalid.
    pub fn session(&self, device: DutKind) -> Result<PreparedSession, LabError> {
        Ok(PreparedSession::new(Some(&self.data), device, SessionChanges::default())?)
    }

    /// The effects of the model of a [`Task::Hunt`]; empty for other works.
    pub fn effects_in_model(&self) -> Vec<&'static str> {
        // A test excludes an invalid model.
        let model = self.hunt().and_then(|_| identification::model::Model::parse(self.model(), "model.toml").ok());
        model.map_or_else(Vec::new, |model| model.effects().iter().map(|effect| effect.card.id).collect())
    }

    /// The model file of a [`Task::Hunt`].
    pub fn model(&self) -> &str {
        &self.data
    }

    /// The quantities to be measured; none in a hunt.
    pub fn quantities(&self) -> &[QuantitySpec] {
        match &self.task {
            Task::Session(SessionTask { quantities, .. })
            | Task::Friction(FrictionTask { quantities, .. })
            | Task::OncePerTurn(OncePerTurnTask { quantities, .. })
            | Task::Drift(DriftTask { quantities, .. })
            | Task::Observers(ObserversTask { quantities, .. }) => quantities,
            Task::Hunt(_) => &[],
        }
    }

    /// The hunt; `None` for a work with quantities.
    pub fn hunt(&self) -> Option<&HuntTask> {
        if let Task::Hunt(task) = &self.task { Some(task) } else { None }
    }

    /// The questions of a time.
    pub fn questions(&self, when: When) -> impl Iterator<Item = &Question> {
        self.questions.iter().filter(move |question| question.when == when)
    }
}

/// All works, by number.
///
/// # Errors
/// A definition is wrong.
pub fn works() -> Result<Vec<Lab>, LabError> {
    FILES.iter().map(|files| Lab::of(*files)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_definition_is_valid() {
        for lab in works().expect("valid definitions") {
            match &lab.task {
                Task::Session(task) => drop(lab.session(task.device).expect("a valid session")),
                Task::Friction(task) => assert!(task.runs[0].amplitude_rad_s < task.runs[1].amplitude_rad_s),
                Task::OncePerTurn(task) => assert!(task.voltages_V.is_sorted() && task.settle_s < task.seconds),
                Task::Observers(task) => drop(stand_analysis::observer::Plant::named(&task.element).expect("a preset")),
                Task::Drift(task) => assert!((30.0..60.0).contains(&task.latitude_deg)),
                Task::Hunt(task) => {
                    identification::model::Model::parse(lab.model(), "model.toml").expect("a valid model");
                    assert!(task.effects.iter().all(|id| drive_model::card(id).is_some()), "{:?}", task.effects);
                    let s = task.shares;
                    assert!((s.none + s.one + s.two + s.unknown - 1.0).abs() < 1e-12);
                    // The best constant answer states each class with its share f of the logs and has the mean Σ f (1 − f).
                    let share = task.max_same as f64 / task.logs.len() as f64;
                    assert!(share <= 0.5 && task.max_brier_score <= 0.5);
                }
            }
            assert!(lab.questions(When::Before).count() > 0 && lab.questions(When::After).count() > 0);
            assert_eq!(Lab::find(&lab.number.to_string()).expect("found").id, lab.id);
        }
        assert!(Lab::find("moter").expect_err("no such work").to_string().contains("did you mean `motor`"));
    }

    /// Both languages have the same sections and the same commands.
    #[test]
    fn translations_have_the_same_sections_and_commands() {
        let count = |text: &str, begin: &str| text.lines().filter(|line| line.starts_with(begin)).count();
        let commands = |text: &str| text.lines().filter(|line| line.starts_with("stand ")).map(str::to_owned).collect::<Vec<_>>();
        for lab in works().expect("valid definitions") {
            let [en, uk] = [Language::En, Language::Uk].map(|language| lab.instructions(language));
            assert_eq!(count(en, "#"), count(uk, "#"), "{}", lab.id);
            assert_eq!(commands(en), commands(uk), "{}", lab.id);
            assert!(!commands(en).is_empty());
        }
    }

    /// The instructions of the hunt list each family of several effects in one row with all its members.
    #[test]
    fn instructions_of_the_hunt_list_the_families_of_the_cards() {
        let lab = Lab::find("hunt").expect("the hunt");
        for language in [Language::En, Language::Uk] {
            for card in drive_model::cards().iter().filter(|card| !card.family.is_empty()) {
                let members: Vec<&str> = drive_model::cards().iter().filter(|c| c.family == card.family).map(|c| c.id).collect();
                let begin = format!("| `{}` |", card.family);
                let row = lab.instructions(language).lines().find(|line| line.starts_with(&begin)).unwrap_or_default();
                let is_listed = members.iter().all(|id| row.contains(&format!("`{id}`")));
                assert!(members.len() == 1 || is_listed, "{language:?} {}: {members:?}", card.family);
            }
        }
    }
}

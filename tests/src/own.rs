//! Simulated sessions of the project's firmware, as logs.

use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{self, SessionRequest};
use identification::identify::fit::{self, FitError, FitResult};
use identification::log::{Column, Log};
use identification::model::Model;
use identification::recording;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

/// The default stand's true parameters: the base, viscous, coulomb, inductance.
pub const TRUTH: [(&str, f64); 6] = [
    ("inertia_kg_m2", 2.5e-4),
    ("motor_constant_N_m_A", 2.34e-2),
    ("resistance_ohm", 2.32),
    ("viscous_N_m_s", 2e-5),
    ("coulomb_N_m", 9e-4),
    ("inductance_H", 2.38e-4),
];

/// A session on `stand` as a log.
///
/// # Panics
/// The stand or the request is invalid.
pub fn log(stand: &Stand, mode: Mode, profile: ProfileKind, seconds: f64, seed: u64) -> Log {
    let request = SessionRequest::new(mode, profile, seconds, seed);
    let plant = Plant::new(stand, 0.0).expect("a valid stand");
    let record = session::run(stand.setup(), plant, request).expect("a valid request");
    let columns = record.columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    Log::new("session.parquet", columns, record.notes).expect("a valid log")
}

/// The default stand's model with every parameter multiplied by its factor.
///
/// # Panics
/// Never: the model is valid.
pub fn model(factors: &[f64; 6]) -> Model {
    let mut text = "[drive]\ninput = \"u_V\"\neffects = [\"viscous\", \"coulomb\", \"inductance\"]\n[parameters]\n".to_owned();
    for ((name, value), factor) in TRUTH.iter().zip(factors) {
        text += &format!("{name} = {:e}\n", value * factor);
    }
    Model::parse(&text, "default stand").expect("a valid model")
}

/// Compares `model` with the log, or fits it.
///
/// # Errors
/// The model cannot be simulated.
///
/// # Panics
/// The log lacks a column.
pub fn fit_or_compare(log: &Log, model: &Model, fitted: bool) -> Result<FitResult, FitError> {
    let (record, _) = recording::prepare(log, model, fitted).expect("the log has the columns");
    let (system, parameters) = fit::build::system(model, record.temp_C.is_some());
    if fitted { fit::fit(&system, &parameters, &record) } else { fit::compare(&system, &parameters, &record) }
}

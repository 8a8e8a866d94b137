//! A rotor with viscous friction under steps of a known torque, for tests.

use super::FittedModel;
use crate::identify::explain::context::Context;
use crate::identify::explain::criteria::Criteria;
use crate::log::{Column, Log};
use crate::model::Model;
use crate::recording::prepare;

/// The rotor, with starts that are 10 % off.
const MODEL: &str =
    "[drive]\ninput = \"torque_N_m\"\neffects = [\"viscous\"]\n[parameters]\ninertia_kg_m2 = 1.1e-4\nviscous_N_m_s = 0.9e-4\n";

/// Fits the rotor to its rates in rows of 10 ms: a hidden torque, N m, and the error of the sensor, rad/s, by row.
pub fn with_fit<T>(rows: impl Iterator<Item = (f64, f64)>, test: impl FnOnce(FittedModel<'_>) -> T) -> T {
    let (inertia, viscous, dt_s) = (1e-4, 1e-4, 0.01);
    let mut omega = 0.0;
    let mut columns = [const { Vec::new() }; 3];
    for (k, (hidden, error)) in rows.enumerate() {
        let known = if (k / 70 + k / 110) % 2 == 0 { 2e-3 } else { -1e-3 };
        for (column, value) in columns.iter_mut().zip([k as f64 * dt_s, known, omega + error]) {
            column.push(value);
        }
        let end = (known + hidden) / viscous;
        omega = end + (omega - end) * f64::exp(-viscous / inertia * dt_s);
    }
    let columns = ["t_s", "torque_N_m", "omega_rad_s"].into_iter().zip(columns);
    let columns = columns.map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    let log = Log::new("rotor.csv", columns, Vec::new()).expect("a log");
    let (criteria, rows) = (Criteria::default(), 0..log.len());
    let context = Context { log: &log, log_rows: std::slice::from_ref(&rows), criteria: &criteria };
    let model = Model::parse(MODEL, "rotor.toml").expect("a model");
    let (data, _) = prepare::prepare(&log, &model, true).expect("a log of this model");
    test(FittedModel::fit(context, &model, data, None).expect("a fit").0)
}

//! The library finds an effect that a model lacks: simulate, fit, explain, add the effect, fit again.
//!
//! `cargo run -p stand-tests --example missing-effect`. Out: the residual over the noise of both fits, and the effect.

use std::error::Error;
use std::io::{Write, stdout};
use std::path::Path;

use hal_sim::plant::Stand;
use hal_sim::session::SessionRequest;
use identification::deadline::Deadline;
use identification::identify::evaluation::{Evaluation, ParameterTreatment, evaluate};
use identification::identify::explain::explain;
use identification::log::Log;
use identification::model::Model;
use stand_acquire::hidden::hide;
use stand_acquire::simulation::simulate;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

/// The drive by its data sheets; the stand also has cogging.
const MODEL: &str = r#"
[drive]
input = "u_V"
effects = ["viscous", "coulomb", "inductance"]

[parameters]
inertia_kg_m2 = 2.2e-4
motor_constant_N_m_A = 0.0234
resistance_ohm = 2.32
viscous_N_m_s = 1e-5
coulomb_N_m = 8.6e-4
inductance_H = 2.38e-4
"#;

#[allow(dead_code, reason = "not used where a test includes this file as a module")]
fn main() -> Result<(), Box<dyn Error>> {
    session(&mut stdout())
}

/// Writes the lines of the example.
pub fn session(out: &mut impl Write) -> Result<(), Box<dyn Error>> {
    // A log of your own: `let log = Log::read("run.csv")?;`
    let mut stand = Stand::default();
    hide("cogging", &mut stand)?;
    let log = simulate(&stand, SessionRequest::new(Mode::Rate, ProfileKind::MultiStep, 30.0, 1), Path::new("run.parquet"))?;
    let mut model = Model::parse(MODEL, "drive.toml")?;

    writeln!(out, "without the effect: {:.1} × noise", fit(&log, &mut model)?)?;

    let explanation = explain(vec![log.clone()], &model, &|_| {})?;
    writeln!(out, "missing: {}", explanation.missing.join(", "))?;

    // The search also gives start values: an effect with a harmonic order needs them. Others are added by `model.add(effect)` as well.
    let mut model = explanation.model;
    writeln!(out, "with the effect: {:.2} × noise", fit(&log, &mut model)?)?;
    let value = |name| model.value(name).ok_or(name);
    let torque_mN_m = 1e3 * value("cogging_N_m")?;
    Ok(writeln!(out, "cogging: {torque_mN_m:.3} mN m, {:.0} periods per turn", value("cogging_order")?)?)
}

/// Fits the parameters of the model; the residual over the noise in the worst channel, 1 where only noise is left.
fn fit(log: &Log, model: &mut Model) -> Result<f64, Box<dyn Error>> {
    let Evaluation::Evaluated(evaluated) = evaluate(log, model, ParameterTreatment::Fitted, Deadline::NEVER)? else {
        return Err("not a plausible record of a drive".into());
    };
    let fitted = &evaluated.result;
    model.set_all(fitted.parameters.list.iter().map(|parameter| (parameter.name.as_str(), parameter.value)))?;
    Ok(fitted.worst_chi2_per_n().sqrt())
}

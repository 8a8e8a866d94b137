//! `stand` without a command: a demonstration of the main workflow.
//!
//! The simulated stand, with a hidden effect, runs a session. The nominal model is compared with the log, then fitted; `explain` identifies
//! the missing effect. Log, models and HTML pages are written to the folder `out`.

use std::path::Path;

use hal_sim::plant::Stand;
use hal_sim::session::SessionRequest;
use stand_firmware::speed_loop::Mode;

use super::compare::evaluate_and_report;
use super::error::CliError;
use super::output::{JsonOutput, ReportOutput, SeriesOutput, print, spinner, style, write};
use super::profile::ProfileOptions;
use super::stand_file::hide_effect;
use identification::deadline::Deadline;
use identification::identify::evaluation::ParameterTreatment;
use identification::identify::explain;
use identification::model::Model;
use stand_acquire::simulation::simulate;
use stand_report::demonstration as text;
use stand_report::explanation::sentences::progress;

/// Folder of the files.
const FOLDER: &str = "out";
/// Effect that the nominal model lacks.
const HIDDEN_EFFECT: &str = "cogging";
/// Duration of the session, s.
const SECONDS: f64 = 30.0;
/// Seed of the session.
const SEED: u64 = 1;

/// The default stand by its data sheets, with the effects of every drive.
const NOMINAL_MODEL: &str = r#"# The default stand by its data sheets; `stand fit` starts here.
[drive]
input = "u_V"
effects = ["viscous", "coulomb", "inductance"]

[parameters]
inertia_kg_m2 = 2.2e-4          # platform and rotor, from their drawings
motor_constant_N_m_A = 0.0234   # maxon RE 25, 118752
resistance_ohm = 2.32           # data sheet
viscous_N_m_s = 1e-5            # estimate
coulomb_N_m = 8.6e-4            # no-load current 36.9 mA × 23.4 mN m/A
inductance_H = 2.38e-4          # data sheet
"#;

pub(super) fn run() -> Result<(), CliError> {
    let folder = Path::new(FOLDER);
    std::fs::create_dir_all(folder).map_err(|e| CliError::file(folder, "create the folder", &e))?;
    let file = |name: &str| folder.join(name);
    let (log_path, model_path) = (file("session.parquet"), file("nominal.toml"));

    print("1  Simulation: the firmware runs a 30 s multi-step profile. The simulated stand has an effect that the model lacks.\n")?;
    let mut stand = Stand::default();
    let hidden = hide_effect(Some(HIDDEN_EFFECT), &mut stand)?;
    let profile = ProfileOptions::default_of("multi-step").config(Mode::Rate, SEED)?;
    let simulating = spinner("simulating");
    let log = simulate(&stand, SessionRequest { mode: Mode::Rate, profile, seconds: SECONDS, seed: SEED }, &log_path);
    simulating.finish_and_clear();
    let log = log?;
    log.write(&log_path)?;
    print(&format!("   {}: {} rows\n\n", log_path.display(), log.len()))?;

    print("2  Comparison with the nominal model (data-sheet values):\n\n")?;
    write(&model_path, NOMINAL_MODEL)?;
    let model = Model::read(&model_path)?;
    let page = |name: &str| ReportOutput { json: JsonOutput::default(), html: Some(file(name)), plots: None };
    let nominal =
        evaluate_and_report(&log, &model, ParameterTreatment::Kept, Deadline::NEVER, (&page("nominal.html"), &SeriesOutput::default()))?;

    print("\n3  Fit of the parameters of the nominal model:\n\n")?;
    let result =
        evaluate_and_report(&log, &model, ParameterTreatment::Fitted, Deadline::NEVER, (&page("fitted.html"), &SeriesOutput::default()))?;
    let mut fitted = model.clone();
    fitted.set_all(result.parameters.list.iter().map(|p| (p.name.as_str(), p.value)))?;
    fitted.write(file("fitted.toml"))?;

    print("\n4  The fitted model still fails. Search for the missing effect in the catalogue:\n\n")?;
    let explaining = spinner("explaining");
    let explanation = explain::explain(vec![log], &model, &|stage| explaining.set_message(progress(stage)));
    explaining.finish_and_clear();
    let explanation = explanation.map_err(|e| CliError::Input(e.to_string()))?;
    print(&stand_report::explain_text(&explanation, style()))?;
    page("explained.html").html(|| stand_report::explain_html(&explanation))?;
    explanation.model.write(file("explained.toml"))?;

    print(&format!("\n5  Residual (rms) of the three models, and the noise:\n\n{}", text::residual_table(&nominal, &explanation)))?;
    write(&file("stand.toml"), &text::stand_file(&stand))?;
    let hidden = hidden.map_or("none".to_owned(), |h| h.to_string());
    let pages = ["nominal.html", "fitted.html", "explained.html"].map(|name| file(name).display().to_string()).join(", ");
    print(&format!(
        "\n6  Hidden effect of the simulated stand: {hidden}\n   HTML pages: {pages}\n   Model with the missing effect: {model_out}\n   Run the search again:\n     stand explain {log} --model {nominal}\n   Compensate cogging and friction in the firmware:\n     stand compensate --model {model_out} --log {log} --stand {stand}\n",
        model_out = file("explained.toml").display(),
        log = log_path.display(),
        nominal = model_path.display(),
        stand = file("stand.toml").display(),
    ))
}

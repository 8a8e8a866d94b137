//! `stand` with nothing after it: the main job from nothing.
//!
//! The simulated stand runs a session with the firmware; the nominal model, by the data sheet, is held against the log, then fitted; what it
//! lacks is found, added, and the error falls. Three pages and three models stay for a look and for walking on.

use std::path::Path;

use hal_sim::plant::Stand;

use super::error::CliError;
use super::explain::explained_log;
use super::hold::{Manner, hold};
use super::output::{JsonOutput, ReportOutput, is_terminal, print, write};
use super::profile::ProfileWords;
use super::sim::{Drive, Request, session};
use crate::acquire::hidden::HiddenEffect;
use crate::identify::explain::Explanation;
use crate::identify::fit::FitResult;
use crate::model::Model;
use crate::report::{self, Style, explanation::words as explain_words};

/// Where the story leaves its files.
const FOLDER: &str = "out";
/// What is hidden in the stand.
const HIDDEN: &str = "cogging";

/// The model that a user of the default stand begins with: the data sheet's numbers, and what every drive has.
const NOMINAL: &str = r#"# The default stand by its data sheets; `stand fit` starts here.
[drive]
input = "u_V"
effects = ["viscous", "coulomb", "inductance"]

[parameters]
inertia_kg_m2 = 2.2e-4          # platform and rotor, by their drawings
motor_constant_N_m_A = 0.0234   # maxon RE 25, 118752
resistance_ohm = 2.32           # the same
viscous_N_m_s = 1e-5            # a guess
coulomb_N_m = 8.6e-4            # no-load current 36.9 mA × 23.4 mN m/A
inductance_H = 2.38e-4          # the same
"#;

pub(super) fn run() -> Result<(), CliError> {
    let folder = Path::new(FOLDER);
    std::fs::create_dir_all(folder).map_err(|e| CliError::file(folder, "make the folder", &e))?;
    let place = |name: &str| folder.join(name);
    let (log_path, model_path) = (place("session.parquet"), place("nominal.toml"));
    print("1  The firmware runs 30 s of steps on the simulated stand, in which an effect is hidden that its model lacks.\n")?;
    let session = session(&Request {
        out: &log_path,
        profile: &ProfileWords::usual("multi-step"),
        seconds: 30.0,
        mode: Drive::Rate,
        hidden: Some(HIDDEN),
        stand: Stand::default(),
        seed: 1,
    })?;
    session.log.write(&log_path)?;
    print(&format!("   {}: {} rows\n\n", log_path.display(), session.log.len()))?;

    print("2  The nominal model, by the data sheets, beside the measurement:\n\n")?;
    write(&model_path, NOMINAL)?;
    let model = Model::read(&model_path)?;
    let page = |name: &str| ReportOutput { json: JsonOutput::default(), html: Some(place(name)) };
    let nominal = hold(&session.log, &model, Manner::Compared, &page("nominal.html"))?;

    print("\n3  The same model with its parameters fitted:\n\n")?;
    if let Some(held) = hold(&session.log, &model, Manner::Fitted, &page("fitted.html"))? {
        let mut fitted = model.clone();
        fitted.set_all(held.parameters.list.iter().map(|p| (p.name.as_str(), p.value)))?;
        fitted.write(place("fitted.toml"))?;
    }

    print("\n4  No parameters make up for what is missing. So every effect of the catalogue is tried:\n\n")?;
    let explanation = explained_log(session.log, &model)?;
    print(&report::explain_text(&explanation, Style { colour: is_terminal(), width: 80 }))?;
    page("explained.html").html(|| report::explain_html(&explanation))?;
    explanation.model.write(place("explained.toml"))?;

    print(&format!("\n5  The error of the three models (rms), and the noise:\n\n{}", table(nominal.as_ref(), &explanation)))?;
    write(&place("stand.toml"), &stand_file(session.hidden.as_ref()))?;
    let hidden = session.hidden.map_or("nothing".to_owned(), |h| h.to_string());
    let pages = ["nominal.html", "fitted.html", "explained.html"].map(|name| place(name).display().to_string()).join(", ");
    print(&format!(
        "\n6  What was hidden: {hidden}.\n   Pages, for a browser: {pages}\n   (`xdg-open {0}`, `open {0}` on a Mac, or a double click). The model with what was missing: {1}\n   Walk on by hand:  stand explain {2} --model {3}\n   What was learnt makes the stand itself turn more evenly:\n     stand compensate --model {1} --log {2} --stand {4}\n",
        place("explained.html").display(),
        place("explained.toml").display(),
        log_path.display(),
        model_path.display(),
        place("stand.toml").display(),
    ))
}

/// The stand of the story, with what was hidden in it, as `--stand` reads it.
fn stand_file(hidden: Option<&HiddenEffect>) -> String {
    let mut effects = Stand::default().effects;
    effects.extend(hidden.map(|h| (h.effect.to_owned(), h.parameters.clone())));
    let mut text = String::from("# The default stand, with what the story hid in it.\n");
    for (name, parameters) in &effects {
        text.push_str(&format!("\n[effects.{name}]\n"));
        for (parameter, value) in parameters {
            text.push_str(&format!("{parameter} = {value:?}\n"));
        }
    }
    text
}

/// One line per channel: the error at each stage, and the noise.
fn table(nominal: Option<&FitResult>, e: &Explanation) -> String {
    let number = |x: f64| report::significant(x, 3);
    let mut columns = vec!["".to_owned()];
    columns.extend(nominal.map(|_| "data sheet".to_owned()));
    columns.extend(e.stages.iter().map(|s| if s.added.is_none() { "fitted".to_owned() } else { explain_words::stage(s) }));
    columns.push("noise".to_owned());
    let mut rows = vec![columns];
    for (k, first) in e.stages.first().map_or(&[][..], |s| &s.outputs).iter().enumerate() {
        let mut row = vec![format!("{}, {}", first.channel.column(), report::unit(first.channel))];
        row.extend(nominal.and_then(|held| held.channels.iter().find(|c| c.channel == first.channel)).map(|c| number(c.rms)));
        row.extend(e.stages.iter().filter_map(|s| s.outputs.get(k)).map(|o| number(o.rms)));
        row.extend(e.stages.last().and_then(|s| s.outputs.get(k)).map(|o| number(o.noise)));
        rows.push(row);
    }
    let width = |k: usize| rows.iter().filter_map(|r| r.get(k)).map(|c| c.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for row in &rows {
        let cells: Vec<String> = row.iter().enumerate().map(|(k, cell)| format!("{cell:<width$}", width = width(k))).collect();
        text.push_str(&format!("   {}\n", cells.join("   ").trim_end()));
    }
    text
}

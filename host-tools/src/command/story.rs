//! `stand` with nothing after it: the main job from nothing.
//!
//! The simulated stand runs a session with the firmware; the nominal model, by the data sheet, is held against the log, then fitted, and
//! both are shown: what the data sheet says, what the log says, and what neither explains.

use std::path::Path;

use hal_sim::plant::Stand;

use super::error::Trouble;
use super::hold::{Manner, hold};
use super::output::{Answer, Output, print, write};
use super::sim::{Drive, Request, session};
use crate::model::Model;

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

pub(super) fn run() -> Result<(), Trouble> {
    let folder = Path::new(FOLDER);
    std::fs::create_dir_all(folder).map_err(|e| Trouble::file(folder, "make the folder", &e))?;
    let (log_path, model_path, fitted_path) = (folder.join("session.parquet"), folder.join("nominal.toml"), folder.join("fitted.toml"));
    print("1  The firmware runs 30 s of steps on the simulated stand, in which an effect is hidden that its model lacks.\n")?;
    let session = session(&Request {
        out: &log_path,
        profile: "multi-step",
        seconds: 30.0,
        mode: Drive::Rate,
        amplitude: None,
        hidden: Some(HIDDEN),
        stand: Stand::default(),
        seed: 1,
    })?;
    session.log.write(&log_path)?;
    print(&format!("   {}: {} rows\n\n", log_path.display(), session.log.len()))?;

    print("2  The nominal model, by the data sheets, beside the measurement:\n\n")?;
    write(&model_path, NOMINAL)?;
    let model = Model::read(&model_path)?;
    let page = |name: &str| Output { answer: Answer::default(), html: Some(folder.join(name)) };
    hold(&session.log, &model, Manner::Compared, &page("nominal.html"))?;

    print("\n3  The same model with its parameters fitted:\n\n")?;
    let held = hold(&session.log, &model, Manner::Fitted, &page("fitted.html"))?;
    if let Some(held) = held {
        let mut fitted = model.clone();
        fitted.set_all(held.parameters.list.iter().map(|p| (p.name.as_str(), p.value)))?;
        fitted.write(&fitted_path)?;
    }
    let mut end = String::from("\n4  What was hidden: ");
    end += &session.hidden.map_or("nothing".to_owned(), |h| h.to_string());
    end += &format!(
        ".\n   Walk on by hand:  stand model add {} EFFECT  and  stand fit {} --model {}\n   Pages: {}, {}\n",
        fitted_path.display(),
        log_path.display(),
        fitted_path.display(),
        folder.join("nominal.html").display(),
        folder.join("fitted.html").display()
    );
    print(&end)
}

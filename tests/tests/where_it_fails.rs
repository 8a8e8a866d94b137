//! Where a model fails: the coordinate that is true comes first, and a true model fails nowhere.

use hal_sim::plant::Stand;
use host_tools::identify::residual::Signature;
use rayon::prelude::*;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;
use stand_tests::foreign::{cases, stand_data};
use stand_tests::own;

#[path = "common/fails.rs"]
mod fails;

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn the_coordinate_that_a_case_states_is_named_first() {
    let data = stand_data();
    let wrong: Vec<String> = cases(&data)
        .par_iter()
        .filter_map(|case| {
            let stated = fails::stated(&data, case)?;
            let list = fails::fitted(&case.log, &fails::believed(case), false);
            let found = list.first().map_or("nothing", |f| f.coordinate.name());
            (found != stated).then(|| format!("{}: stated {stated}, found {found}", case.name))
        })
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn the_true_model_of_a_case_without_hidden_effect_fails_nowhere() {
    let data = stand_data();
    let cases = cases(&data);
    let nulls: Vec<_> = cases.iter().filter(|c| c.name.ends_with("-none")).collect();
    assert!(nulls.len() >= 8);
    for case in nulls {
        let list = fails::fitted(&case.log, &fails::believed(case), false);
        assert!(list.is_empty(), "{}: {list:#?}", case.name);
    }
}

/// Twelve logs at one in a thousand: an alarm by chance in one run of eighty.
#[test]
fn a_session_with_nothing_hidden_fails_nowhere_with_the_voltage_given_or_the_rate_controlled() {
    let profiles = [ProfileKind::MultiStep, ProfileKind::Multisine, ProfileKind::Prbs];
    (0..12usize).into_par_iter().for_each(|k| {
        let mode = if k % 2 == 0 { Mode::Voltage } else { Mode::Rate };
        let log = own::log(&Stand::default(), mode, profiles[k % 3], 20.0, 40 + k as u64);
        let list = fails::fitted(&log, &own::model(&[1.2, 0.9, 1.1, 0.8, 1.2, 1.1]), false);
        assert!(list.is_empty(), "{mode:?} {:?} {k}: {list:#?}", profiles[k % 3]);
    });
}

/// One seed: of six such logs five pass, and of six with the voltage given only two, where slow drift after moments of sticking hides
/// the order (docs/figures.md, "Where it fails"). This holds what is reached, not what is wanted.
#[test]
fn cogging_under_the_speed_loop_is_a_torque_at_its_order() {
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
        // The seventh order has the larger torque and half the frequency, so at least three quarters of what cogging leaves.
        assert!(first.explained_fraction > 0.5, "{}", first.explained_fraction);
    }
}

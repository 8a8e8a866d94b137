//! What is learnt goes back: with the learnt compensation the simulated stand turns evenly, in its true rate.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::Stand;
use host_tools::compensate::ripple;
use stand_firmware::compensation::{Compensation, Harmonic, Harmonics};

const RATES_DEG_S: [f64; 3] = [10.0, 100.0, 720.0];

fn cogging(harmonics: &[(u16, f64, f64)]) -> (Stand, Compensation) {
    let mut stand = Stand::default();
    for (k, (order, torque_N_m, phase_rad)) in harmonics.iter().enumerate() {
        let name = if k == 0 { "cogging".to_owned() } else { format!("cogging#{}", k + 1) };
        let parameters = [("cogging_N_m", *torque_N_m), ("cogging_order", f64::from(*order)), ("cogging_phase_rad", *phase_rad)];
        stand.effects.insert(name, parameters.map(|(name, value)| (name.to_owned(), value)).into());
    }
    let list =
        harmonics.iter().map(|(order, torque_N_m, phase_rad)| Harmonic { order: *order, torque_N_m: *torque_N_m, phase_rad: *phase_rad });
    (stand, Compensation { harmonics: Harmonics::of(list).unwrap(), coulomb_N_m: 9e-4, viscous_N_m_s: 2e-5, ..Compensation::default() })
}

#[test]
fn orders_that_are_known_exactly_fall_at_least_8_times_at_every_rate() {
    for (seed, phases) in [(1, [0.3, 2.0]), (2, [4.0, 5.5])] {
        let (stand, compensation) = cogging(&[(7, 2e-3, phases[0]), (14, 1e-3, phases[1])]);
        for rate in RATES_DEG_S {
            let before = ripple(&stand, &Compensation::default(), rate.to_radians(), &[7, 14], seed).unwrap();
            let after = ripple(&stand, &compensation, rate.to_radians(), &[7, 14], seed).unwrap();
            println!("{rate} deg/s {before:?}\n   {after:?}");
            assert!(after.compensated);
        }
    }
}

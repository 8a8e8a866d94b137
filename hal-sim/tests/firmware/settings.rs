//! Every setting has an effect: each parameter of stand, sensors, loop and profile changes a record.
#![allow(clippy::unwrap_used)]

use hal_sim::board::linear_motor::LinearMotor;
use hal_sim::session::{Record, SessionRequest, StandSetup, run};
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

type Change = fn(&mut StandSetup, &mut SessionRequest);

fn record(change: Change, mode: Mode, kind: ProfileKind) -> Record {
    let mut motor = LinearMotor::default();
    motor.coulomb_N_m = 0.9e-3;
    let mut stand = StandSetup::default();
    let mut request = SessionRequest::new(mode, kind, 2.0, 1);
    // Short dwells and rates near the limits, so that each setting acts within two seconds.
    request.profile.dwell_s = 0.3;
    request.profile.amplitude = if mode == Mode::Rate { 36.0 } else { 4.0 };
    request.profile.sweep_s = 1.5;
    stand.settings.overspeed_rad_s = 200.0;
    stand.settings.acceleration_rad_s2 = 200.0;
    request.profile.acceleration = 200.0;
    request.profile.jerk = 4000.0;
    change(&mut stand, &mut request);
    run(stand, motor, request).unwrap()
}

#[test]
fn every_setting_of_stand_and_loop_changes_the_record() {
    let changes: [(&str, Mode, Change); 25] = [
        ("counts_per_turn", Mode::Rate, |s, _| s.hardware.counts_per_turn = 4000.0),
        ("duty_full_scale", Mode::Rate, |s, _| s.hardware.duty_full_scale = 1000),
        ("supply_nominal_V", Mode::Rate, |s, _| s.hardware.supply_nominal_V = 24.0),
        ("current_A_per_code", Mode::Rate, |s, _| s.hardware.current_A_per_code *= 2.0),
        ("current_zero_code", Mode::Rate, |s, _| s.hardware.current_zero_code = 100.0),
        ("supply_V_per_code", Mode::Rate, |s, _| s.hardware.supply_V_per_code *= 2.0),
        ("rate_rad_s_per_code", Mode::Rate, |s, _| s.hardware.rate_rad_s_per_code *= 2.0),
        ("temperature_C_per_code", Mode::Rate, |s, _| s.hardware.temperature_C_per_code = 1.0),
        ("current_noise_A", Mode::Rate, |s, _| s.sensors.current_noise_A = 0.0),
        ("current_per_tick", Mode::Rate, |s, _| s.sensors.current_per_tick = 4),
        ("rate_cutoff_Hz", Mode::Rate, |s, _| s.sensors.rate_cutoff_Hz = f64::INFINITY),
        ("rate_noise_rad_s", Mode::Rate, |s, _| s.sensors.rate_noise_rad_s = 0.0),
        ("rate_full_scale_rad_s", Mode::Rate, |s, _| s.sensors.rate_full_scale_rad_s = 5.0),
        ("supply_noise_V", Mode::Rate, |s, _| s.sensors.supply_noise_V = 0.1),
        ("temp_noise_K", Mode::Rate, |s, _| s.sensors.temp_noise_K = 1.0),
        ("resistance_ohm", Mode::Rate, |s, _| s.settings.resistance_ohm = 3.0),
        ("motor_constant_N_m_A", Mode::Rate, |s, _| s.settings.motor_constant_N_m_A = 0.03),
        ("inertia_kg_m2", Mode::Rate, |s, _| s.settings.inertia_kg_m2 = 1e-4),
        ("rate_gain_V_s_rad", Mode::Rate, |s, _| s.settings.rate_gain_V_s_rad = 1.0),
        ("position_gain_V_rad", Mode::Rate, |s, _| s.settings.position_gain_V_rad = 20.0),
        ("rate_bandwidth_Hz", Mode::Rate, |s, _| s.settings.rate_bandwidth_Hz = 30.0),
        ("acceleration_rad_s2", Mode::Rate, |s, _| s.settings.acceleration_rad_s2 = 50.0),
        ("slip_rad", Mode::Rate, |s, _| s.settings.slip_rad = 0.01),
        ("current_limit_A", Mode::Voltage, |s, _| s.settings.current_limit_A = 0.5),
        ("voltage_limit_V", Mode::Voltage, |s, _| s.settings.voltage_limit_V = 1.0),
    ];
    for (name, mode, change) in changes {
        let kind = ProfileKind::MultiStep;
        assert_ne!(record(|_, _| (), mode, kind).columns, record(change, mode, kind).columns, "{name}");
    }
    let slow = record(|s, _| s.settings.overspeed_rad_s = 10.0, Mode::Voltage, ProfileKind::MultiStep);
    assert!(slow.note("fault").is_some(), "overspeed_rad_s");
}

#[test]
fn every_parameter_of_the_profiles_changes_the_record() {
    let changes: [(&str, ProfileKind, Change); 18] = [
        ("amplitude", ProfileKind::Constant, |_, r| r.profile.amplitude = 2.0),
        ("offset", ProfileKind::Constant, |_, r| r.profile.offset = -2.0),
        ("seconds", ProfileKind::Constant, |_, r| r.seconds = 1.0),
        ("seed", ProfileKind::Constant, |_, r| r.seed = 2),
        ("profile seed", ProfileKind::MultiStep, |_, r| r.profile.seed = 2),
        ("profile seed", ProfileKind::Prbs, |_, r| r.profile.seed = 2),
        ("dwell_s", ProfileKind::MultiStep, |_, r| r.profile.dwell_s = 0.5),
        ("dwell_s", ProfileKind::Staircase, |_, r| r.profile.dwell_s = 0.5),
        ("levels", ProfileKind::Staircase, |_, r| r.profile.levels = 3),
        ("bit_s", ProfileKind::Prbs, |_, r| r.profile.bit_s = 0.05),
        ("from_Hz", ProfileKind::Multisine, |_, r| r.profile.from_Hz = 0.1),
        ("sweep_s", ProfileKind::Chirp, |_, r| r.profile.sweep_s = 1.0),
        ("sweep_s", ProfileKind::ChirpLinear, |_, r| r.profile.sweep_s = 1.0),
        ("frequency_Hz", ProfileKind::Sine, |_, r| r.profile.frequency_Hz = 1.0),
        ("acceleration", ProfileKind::Trapezoid, |_, r| r.profile.acceleration = 100.0),
        ("jerk", ProfileKind::Alternating, |_, r| r.profile.jerk = 2000.0),
        ("cycles", ProfileKind::Alternating, |_, r| r.profile.cycles = 1),
        ("dwell_s", ProfileKind::Abba, |_, r| r.profile.dwell_s = 0.2),
    ];
    for mode in [Mode::Voltage, Mode::Rate] {
        for (name, kind, change) in changes {
            assert_ne!(record(|_, _| (), mode, kind).columns, record(change, mode, kind).columns, "{name} {kind}");
        }
        for kind in [ProfileKind::Multisine, ProfileKind::Chirp] {
            let changed = record(|_, r| r.profile.to_Hz = 5.0, mode, kind);
            assert_ne!(record(|_, _| (), mode, kind).columns, changed.columns, "to_Hz {kind}");
        }
    }
    let turns = |change: Change| record(change, Mode::Rate, ProfileKind::Turns).columns;
    assert_ne!(turns(|_, r| r.profile.turns = 3), turns(|_, r| r.profile.turns = 4), "turns");
}

#[test]
fn each_profile_runs_in_both_modes_and_is_distinct() {
    for mode in [Mode::Voltage, Mode::Rate] {
        let kinds: Vec<ProfileKind> = ProfileKind::ALL.into_iter().filter(|kind| mode == Mode::Rate || !kind.is_a_rate()).collect();
        let records: Vec<_> = kinds.iter().map(|kind| record(|_, _| (), mode, *kind).columns).collect();
        for (n, one) in records.iter().enumerate() {
            assert!(records[..n].iter().all(|other| other != one), "{}", kinds[n]);
        }
    }
}

#[test]
fn a_stand_file_is_read_and_an_unknown_key_is_refused() {
    let stand: StandSetup =
        toml::from_str("[hardware]\ncounts_per_turn = 4096.0\n[sensors]\nrate_noise_rad_s = 0.001\n[settings]\nslip_rad = 0.2\n").unwrap();
    assert_eq!((stand.hardware.counts_per_turn, stand.sensors.rate_noise_rad_s, stand.settings.slip_rad), (4096.0, 0.001, 0.2));
    assert_eq!(stand.hardware.supply_nominal_V, StandSetup::default().hardware.supply_nominal_V, "the rest stays");
    let again: StandSetup = toml::from_str(&toml::to_string(&stand).unwrap()).unwrap();
    assert_eq!(again, stand);
    let ideal = StandSetup::ideal();
    assert_eq!(toml::from_str::<StandSetup>(&toml::to_string(&ideal).unwrap()).unwrap(), ideal);
    let error = toml::from_str::<StandSetup>("[sensors]\nrate_nose_rad_s = 1.0\n").unwrap_err().to_string();
    assert!(error.contains("rate_nose_rad_s"), "{error}");
}

#[test]
fn an_invalid_stand_is_refused_with_the_parameter_name() {
    type Spoil = fn(&mut StandSetup);
    let changes: [(&str, Spoil); 8] = [
        ("current_noise_A", |s| s.sensors.current_noise_A = -1.0),
        ("current_per_tick", |s| s.sensors.current_per_tick = 0),
        ("rate_cutoff_Hz", |s| s.sensors.rate_cutoff_Hz = f64::NAN),
        ("rate_full_scale_rad_s", |s| s.sensors.rate_full_scale_rad_s = 0.0),
        ("current_A_per_code", |s| s.hardware.current_A_per_code = 0.0),
        ("current_zero_code", |s| s.hardware.current_zero_code = f64::NAN),
        ("rate_rad_s_per_code", |s| s.hardware.rate_rad_s_per_code = -1.0),
        ("counts_per_turn", |s| s.hardware.counts_per_turn = 0.0),
    ];
    for (name, change) in changes {
        let mut stand = StandSetup::default();
        change(&mut stand);
        let request = SessionRequest::new(Mode::Rate, ProfileKind::Constant, 0.1, 1);
        let error = run(stand, LinearMotor::default(), request).err().map(|e| e.to_string());
        assert!(error.as_ref().is_some_and(|e| e.contains(name)), "{name}: {error:?}");
    }
}

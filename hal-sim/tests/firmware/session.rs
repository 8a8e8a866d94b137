//! Sessions on the simulated board with a plant that is solved exactly: conventions, regulation, repeatability.
#![allow(clippy::unwrap_used)]

use hal_sim::board::linear_motor::LinearMotor;
use hal_sim::session::{Record, SessionRequest, StandSetup, run};
use stand_firmware::board::{Hardware, TICKS_PER_ROW};
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::{Fault, Limits, Mode};

fn col<'a>(record: &'a Record, name: &str) -> &'a [f64] {
    record.column(name).unwrap_or_else(|| panic!("no column {name}"))
}

/// The linear motor with the Coulomb friction of the default stand.
fn with_friction() -> LinearMotor {
    let mut motor = LinearMotor::default();
    motor.coulomb_N_m = 0.9e-3;
    motor
}

fn constant(mode: Mode, value: f64, seconds: f64) -> SessionRequest {
    let profile = ProfileConfig::new(ProfileKind::Constant, value, 1);
    SessionRequest { mode, profile, seconds, seed: 1 }
}

#[test]
fn voltage_current_angle_and_rate_of_a_row_are_synchronous_to_the_tick() {
    for kind in [ProfileKind::MultiStep, ProfileKind::Multisine, ProfileKind::Prbs] {
        let motor = LinearMotor::default();
        let record = run(StandSetup::ideal(), motor.clone(), SessionRequest::new(Mode::Voltage, kind, 5.0, 3)).unwrap();
        assert_eq!(record.rows(), 5000);
        assert!(record.limits.iter().all(|l| *l == Limits::default()), "unlimited, or the voltage is not constant");
        let (t, u, i) = (col(&record, "t_s"), col(&record, "u_V"), col(&record, "i_A"));
        let (theta, omega) = (&record.true_theta_rad, &record.true_omega_rad_s);
        let h = 1e-3;
        for k in 0..record.rows() - 1 {
            assert!((t[k] - k as f64 * h).abs() < 1e-12);
            let (end, tau) = motor.steady(u[k]);
            let omega_next = end + (omega[k] - end) * (-h / tau).exp();
            assert!((omega[k + 1] - omega_next).abs() < 1e-9, "{kind} row {k}: {} {omega_next}", omega[k + 1]);
            let step = end * h - (omega[k] - end) * tau * (-h / tau).exp_m1();
            assert!((theta[k + 1] - theta[k] - step).abs() < 1e-9);
            let mean_A = (u[k] - motor.motor_constant_N_m_A * step / h) / motor.resistance_ohm;
            // The converter's step is 4e-9 A, ten of them make a row.
            assert!((i[k] - mean_A).abs() < 3e-9, "{kind} row {k}: {} {mean_A}", i[k]);
            // The sensor's step is 5e-8 rad/s.
            assert!((col(&record, "omega_rad_s")[k] - omega[k]).abs() < 3e-8);
            let below = theta[k] - col(&record, "theta_rad")[k];
            assert!((-1e-9..Hardware::default().rad_per_count() + 1e-9).contains(&below));
        }
        assert!(u.iter().any(|u| *u > 0.1) && u.iter().any(|u| *u < -0.1), "{kind} goes both ways");
    }
}

#[test]
fn a_step_of_100_deg_s_settles_in_0_3_s_with_less_than_5_percent_overshoot() {
    let step = 100_f64.to_radians();
    for sign in [1.0, -1.0] {
        let record = run(StandSetup::default(), with_friction(), constant(Mode::Rate, sign * step, 1.5)).unwrap();
        let rate: Vec<f64> = record.true_omega_rad_s.iter().map(|w| w * sign / step).collect();
        let greatest = rate.iter().copied().fold(0.0, f64::max);
        assert!(greatest < 1.05, "overshoot {greatest}");
        let settled = rate[300..].iter().all(|w| (w - 1.0).abs() < 0.02);
        assert!(settled, "{:?}", rate[300..].iter().map(|w| (w - 1.0).abs()).fold(0.0, f64::max));
        // Three checks: command, sensor reading, true rate.
        let seen = col(&record, "omega_rad_s");
        let mean = seen[500..].iter().sum::<f64>() / (seen.len() - 500) as f64;
        assert!((mean / (sign * step) - 1.0).abs() < 1e-3, "{mean}");
        assert!((col(&record, "rate_cmd_rad_s")[1000] - sign * step).abs() < 1e-9);
    }
}

#[test]
fn the_mean_rate_over_whole_turns_is_as_good_as_the_crystal() {
    let rate = 7.0;
    let record = run(StandSetup::default(), with_friction(), constant(Mode::Rate, rate, 11.0)).unwrap();
    // Ten turns, from one second on, when the ramp is long over.
    let rows = (10.0 * std::f64::consts::TAU / rate * 1e3).round() as usize;
    let theta = &record.true_theta_rad;
    let mean = (theta[1000 + rows] - theta[1000]) / (rows as f64 * 1e-3);
    // Angle noise at both ends is below a count in 20 000 · 10.
    assert!((mean / rate - 1.0).abs() < 1.0 / 200_000.0, "{mean}");
    let command = col(&record, "theta_cmd_rad");
    let commanded = (command[1000 + rows] - command[1000]) / (rows as f64 * 1e-3);
    assert!((commanded / rate - 1.0).abs() < 1e-9, "{commanded}");
}

#[test]
fn a_hundred_parallel_stands_equal_single_runs() {
    let request = |seed: u64| {
        let mode = if seed.is_multiple_of(2) { Mode::Rate } else { Mode::Voltage };
        let kinds = [ProfileKind::MultiStep, ProfileKind::Multisine, ProfileKind::Prbs, ProfileKind::Chirp, ProfileKind::SCurve];
        SessionRequest::new(mode, kinds[seed as usize % kinds.len()], 0.5, seed)
    };
    let alone: Vec<Record> = (0..100).map(|seed| run(StandSetup::default(), with_friction(), request(seed)).unwrap()).collect();
    let together: Vec<Record> = std::thread::scope(|scope| {
        let stands: Vec<_> =
            (0..100).map(|seed| scope.spawn(move || run(StandSetup::default(), with_friction(), request(seed)).unwrap())).collect();
        stands.into_iter().map(|stand| stand.join().unwrap()).collect()
    });
    assert_eq!(alone, together);
    assert_ne!(alone[0].columns, alone[10].columns, "another seed is another record");
}

#[test]
fn overspeed_ends_the_rows_with_a_note() {
    let record = run(StandSetup::default(), LinearMotor::default(), constant(Mode::Voltage, 4.0, 3.0)).unwrap();
    assert_eq!(record.fault, Fault::Overspeed);
    assert!(record.note("fault").unwrap().starts_with("overspeed at "));
    let last = *record.true_omega_rad_s.last().unwrap();
    assert!((44.0..46.5).contains(&last), "{last}");
    assert!(record.rows() < 1000);
}

#[test]
fn the_current_limit_holds_and_is_a_status() {
    let record = run(StandSetup::default(), LinearMotor::default(), constant(Mode::Voltage, 4.5, 0.2)).unwrap();
    assert!(record.limits[10].contains(Limits::CURRENT));
    assert_eq!(record.fault, Fault::None);
    let i = col(&record, "i_A");
    // 12 mA rms of noise in each of 20 conversions: 3 mA; the estimate's lag at 140 rad/s² adds a few.
    assert!(i[5..150].iter().all(|i| (i - 1.3).abs() < 0.03), "{:?}", &i[5..20]);
    assert!(record.note("limited_current").is_some());
}

#[test]
fn rows_are_evenly_spaced_and_complete() {
    let record = run(StandSetup::default(), with_friction(), constant(Mode::Rate, 3.0, 0.5)).unwrap();
    assert_eq!((record.pace.min, record.pace.max), (TICKS_PER_ROW, TICKS_PER_ROW));
    for name in ["t_s", "u_V", "supply_V", "i_A", "theta_rad", "omega_rad_s", "rate_cmd_rad_s", "theta_cmd_rad", "temp_C"] {
        assert_eq!(col(&record, name).len(), 500, "{name}");
        assert!(col(&record, name).iter().all(|v| v.is_finite()));
    }
    assert!((col(&record, "supply_V")[3] - 12.0).abs() < 0.03 && (col(&record, "temp_C")[3] - 25.0).abs() < 0.3);
}

#[test]
fn sensor_noise_matches_the_data_sheets() {
    let record = run(StandSetup::default(), LinearMotor::default(), constant(Mode::Voltage, 0.0, 20.0)).unwrap();
    let sigma = |name: &str| {
        let x = col(&record, name);
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
    };
    // 20 conversions of 12 mA, and the converter's step of 0.8 mA; 0.40 °/s and the step of 0.061 °/s.
    assert!((sigma("i_A") / (12e-3 / 20_f64.sqrt()) - 1.0).abs() < 0.03, "{}", sigma("i_A"));
    let rate = 0.014 * (std::f64::consts::FRAC_PI_2 * 523.0).sqrt();
    assert!((sigma("omega_rad_s").to_degrees() / rate - 1.0).abs() < 0.03, "{}", sigma("omega_rad_s"));
}

#[test]
fn an_invalid_request_is_refused_with_the_parameter_name() {
    let error = run(StandSetup::default(), LinearMotor::default(), constant(Mode::Rate, f64::NAN, 1.0)).unwrap_err();
    assert!(error.to_string().contains("amplitude"), "{error}");
    let error = run(StandSetup::default(), LinearMotor::default(), constant(Mode::Rate, 1.0, -1.0)).unwrap_err();
    assert!(error.to_string().contains("seconds"), "{error}");
}

#[test]
fn the_rate_command_is_the_profile_where_no_limit_is_in_force() {
    let mut request = SessionRequest::new(Mode::Rate, ProfileKind::Multisine, 4.0, 1);
    request.profile.amplitude = 1.0;
    let record = run(StandSetup::default(), LinearMotor::default(), request).unwrap();
    let mut profile = stand_firmware::profile::Profile::new(&request.profile).unwrap();
    let commands = col(&record, "rate_cmd_rad_s");
    let values: Vec<f64> = commands.iter().map(|_| profile.next_value()).collect();
    // The start from rest is a step; 1 rad/s at 60 rad/s² are 17 ms, and then 32 ms of smoothing.
    for (k, command) in commands.iter().enumerate().skip(50) {
        assert!(!record.limits[k].contains(Limits::ACCELERATION), "row {k}");
        // The mean over 32 milliseconds.
        let smoothed = (0..32).map(|back| values[k - back]).sum::<f64>() / 32.0;
        assert!((command - smoothed).abs() < 1e-8, "row {k}: {command} {smoothed}");
    }
}

#[test]
fn mean_voltage_and_mean_current_match_in_the_closed_loop_and_at_the_limits_too() {
    // R i + K ω = u holds at every instant, so it holds for the means of a row, however u moves within it.
    let step = |mode, amplitude| {
        let mut request = SessionRequest::new(mode, ProfileKind::MultiStep, 6.0, 5);
        request.profile.amplitude = amplitude;
        request
    };
    for (request, current_limit_A, limit) in
        [(step(Mode::Rate, 30.0), 1.3, Limits::ACCELERATION), (step(Mode::Voltage, 0.7), 0.2, Limits::CURRENT)]
    {
        let mut stand = StandSetup::ideal();
        stand.settings.current_limit_A = current_limit_A;
        let motor = LinearMotor::default();
        let record = run(stand, motor.clone(), request).unwrap();
        let (u, i, theta) = (col(&record, "u_V"), col(&record, "i_A"), &record.true_theta_rad);
        for k in 0..record.rows() - 1 {
            let rate = (theta[k + 1] - theta[k]) / 1e-3;
            let expected = (u[k] - motor.motor_constant_N_m_A * rate) / motor.resistance_ohm;
            assert!((i[k] - expected).abs() < 3e-9, "row {k}: {} {expected}", i[k]);
        }
        assert!(record.limits.iter().any(|l| l.contains(limit)), "{limit:?}");
    }
}

#[test]
fn the_default_stand_settles_a_step_and_holds_the_rate_of_the_crystal() {
    use hal_sim::plant::{Plant, Stand};
    let stand = Stand::default();
    let run_at = |rate, seconds| run(stand.setup(), Plant::new(&stand, 0.0).unwrap(), constant(Mode::Rate, rate, seconds)).unwrap();
    let step = 100_f64.to_radians();
    let record = run_at(step, 1.5);
    let greatest = record.true_omega_rad_s.iter().copied().fold(0.0, f64::max);
    assert!(greatest < 1.05 * step, "overshoot {}", greatest / step);
    let worst = record.true_omega_rad_s[300..].iter().map(|w| (w / step - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst < 0.02, "{worst}");
    let rate = -7.0_f64;
    let record = run_at(rate, 11.0);
    let rows = (10.0 * std::f64::consts::TAU / rate.abs() * 1e3).round() as usize;
    let theta = &record.true_theta_rad;
    let mean = (theta[1000 + rows] - theta[1000]) / (rows as f64 * 1e-3);
    assert!((mean / rate - 1.0).abs() < 1.0 / 200_000.0, "{mean}");
}

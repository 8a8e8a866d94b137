//! The learned compensation makes the simulated stand's true rate uniform.
//!
//! Only the plant's true rate is evaluated, not encoder, rate sensor or firmware values.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{self, Record, SessionRequest, calibrate};
use identification::log::Log;
use identification::model::Model;
use rayon::prelude::*;
use stand_analysis::compensate::{LearnError, NotCompensated, file, learn, ripple};
use stand_firmware::calibration::CalibrationError;
use stand_firmware::compensation::{Compensation, Harmonic, Harmonics};
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::{Compensating, Config, Fault, Mode, Settings};
use stand_tests::own::{fit_or_compare, log};

const RATES_DEG_S: [f64; 3] = [10.0, 100.0, 720.0];
/// Least reduction factor of a compensated harmonic's amplitude.
const MIN_REDUCTION: f64 = 8.0;
/// Harmonic orders, amplitudes and phases of three stands; a stand's number is its noise seed.
const STANDS: [[Harmonic; 2]; 3] = [
    [Harmonic { order: 7, torque_N_m: 2e-3, phase_rad: 0.3 }, Harmonic { order: 14, torque_N_m: 1e-3, phase_rad: 2.0 }],
    [Harmonic { order: 7, torque_N_m: 1e-3, phase_rad: 4.0 }, Harmonic { order: 14, torque_N_m: 1.5e-3, phase_rad: 5.5 }],
    [Harmonic { order: 7, torque_N_m: 3e-3, phase_rad: 5.9 }, Harmonic { order: 14, torque_N_m: 1e-3, phase_rad: 0.1 }],
];

/// The default stand with these hidden torques.
fn stand(harmonics: &[Harmonic]) -> Stand {
    let mut stand = Stand::default();
    for (k, harmonic) in harmonics.iter().enumerate() {
        let name = if k == 0 { "cogging".to_owned() } else { format!("cogging#{}", k + 1) };
        let parameters =
            [("cogging_N_m", harmonic.torque_N_m), ("cogging_order", f64::from(harmonic.order)), ("cogging_phase_rad", harmonic.phase_rad)];
        stand.effects.insert(name, parameters.map(|(name, value)| (name.to_owned(), value)).into());
    }
    stand
}

fn compensation_for(harmonics: &[Harmonic]) -> Compensation {
    let harmonics = Harmonics::of(harmonics.iter().copied()).unwrap();
    Compensation { coulomb_N_m: 9e-4, viscous_N_m_s: 2e-5, harmonics, ..Compensation::default() }
}

/// Asserts the reduction for all rates and orders, and prints a line for each rate.
#[track_caller]
fn assert_orders_fall(stand: &Stand, compensation: &Compensation, seed: u64, from: &str) {
    RATES_DEG_S.par_iter().for_each(|rate| {
        let at = |compensation| ripple(stand, compensation, rate.to_radians(), seed).unwrap();
        let (before, after) = (at(&Compensation::default()), at(compensation));
        assert!(after.compensated && !before.compensated);
        for order in [7, 14] {
            let [was, is] = [&before, &after].map(|ripple| ripple.spectrum.amplitude(order));
            println!("{from}, stand {seed}, {rate} °/s, order {order}: {was:.2e} to {is:.2e} rad/s, {:.0} times", was / is);
            assert!(was / is >= MIN_REDUCTION, "{from}, stand {seed}, {rate} °/s, order {order}: {was:e} to {is:e}");
        }
        let (was, is) = (before.one_degree, after.one_degree);
        println!("{from}, stand {seed}, {rate} °/s, over 1°: {:.3} % to {:.4} %", 100.0 * was, 100.0 * is);
        assert!(is < was, "{from}, {rate} °/s: over one degree {was} to {is}");
    });
}

#[test]
fn known_orders_fall_8_times_from_10_to_720_deg_s() {
    for (harmonics, seed) in STANDS.iter().zip(1..) {
        assert_orders_fall(&stand(harmonics), &compensation_for(harmonics), seed, "known");
    }
}

/// The start is off by more than a third; the fit must find amplitudes and phases.
fn fitted(stand: &Stand, seed: u64) -> (Log, Model) {
    let log = log(stand, Mode::Rate, ProfileKind::MultiStep, 30.0, seed);
    let text = "[drive]\ninput = \"u_V\"\neffects = [\"viscous\", \"coulomb\", \"inductance\", \"cogging\", \"cogging#2\"]\n\
        [parameters]\ninertia_kg_m2 = 3.5e-4\nmotor_constant_N_m_A = 0.03\nresistance_ohm = 2.0\nviscous_N_m_s = 4e-5\ncoulomb_N_m = 5e-4\n\
        cogging_N_m = 5e-4\ncogging_order = 7\n\"cogging_N_m#2\" = 5e-4\n\"cogging_order#2\" = 14\n";
    let mut model = Model::parse(text, "two-orders.toml").unwrap();
    let held = fit_or_compare(&log, &model, true).unwrap();
    model.set_all(held.parameters.list.iter().map(|p| (p.name.as_str(), p.value))).unwrap();
    (log, model)
}

#[test]
fn orders_of_a_fitted_model_fall_8_times() {
    for (harmonics, seed) in STANDS.iter().zip(1..) {
        let stand = stand(harmonics);
        let (log, model) = fitted(&stand, seed);
        let learned = learn(&model, Some(&log), &stand.firmware).unwrap();
        assert_eq!(learned.not_compensated, []);
        assert_orders_fall(&stand, &learned.compensation, seed, "fitted");
    }
}

#[test]
fn model_constants_other_than_the_firmwares_give_equal_volts() {
    let stand = stand(&STANDS[0]);
    let (log, model) = fitted(&stand, 1);
    let nominal = learn(&model, Some(&log), &stand.firmware).unwrap().compensation;
    let off = Settings { resistance_ohm: 3.0, motor_constant_N_m_A: 0.02, ..stand.firmware };
    let other = learn(&model, Some(&log), &off).unwrap().compensation;
    for (a, b) in nominal.harmonics.as_slice().iter().zip(other.harmonics.as_slice()) {
        let volts = |h: &Harmonic, s: &Settings| h.torque_N_m * s.resistance_ohm / s.motor_constant_N_m_A;
        assert!((volts(a, &stand.firmware) / volts(b, &off) - 1.0).abs() < 1e-12 && a.torque_N_m != b.torque_N_m);
    }
}

#[test]
fn calibration_without_a_model_finds_orders_that_fall_8_times() {
    for (harmonics, seed) in STANDS.iter().zip(1..) {
        let stand = stand(harmonics);
        // From an angle where the index may pass late.
        let plant = Plant::new(&stand, 2.0 * seed as f64).unwrap();
        let calibrated = calibrate(stand.setup(), Box::new(plant), seed, &|_| ()).unwrap();
        let found = calibrated.outcome.unwrap();
        println!("threshold {:.2e} N m; {:?}", found.threshold_N_m, found.compensation);
        let mut orders: Vec<u16> = found.compensation.harmonics.as_slice().iter().map(|h| h.order).collect();
        orders.sort_unstable();
        assert_eq!(orders, [7, 14], "exactly these orders");
        // The current's noise is negligible over 40 000 rows; the remainder is the change of kinetic energy over a leg.
        assert!((found.compensation.coulomb_N_m / 9e-4 - 1.0).abs() < 0.05);
        assert!((found.compensation.viscous_N_m_s / 2e-5 - 1.0).abs() < 0.25);
        assert_orders_fall(&stand, &found.compensation, seed, "measured");
        let now = Settings { compensation: found.compensation, ..stand.firmware };
        assert_eq!(calibrated.in_force, Config::new(&now, &stand.hardware).unwrap().compensation(), "the compensation is in force");
    }
}

#[test]
fn calibration_without_cogging_finds_no_order() {
    for seed in 1..=5 {
        let stand = Stand::default();
        let calibrated = calibrate(stand.setup(), Box::new(Plant::new(&stand, 1.0).unwrap()), seed, &|_| ()).unwrap();
        let found = calibrated.outcome.unwrap();
        assert!(found.compensation.harmonics.is_empty(), "{:?}", found.harmonics);
        assert!(found.threshold_N_m < 3e-5, "the detection threshold is a thirtieth of the usual cogging: {}", found.threshold_N_m);
    }
}

#[test]
fn aborted_calibration_keeps_the_compensation_and_progress_only_rises() {
    let mut stand = stand(&STANDS[0]);
    stand.firmware.compensation = Compensation { coulomb_N_m: 3e-4, ..compensation_for(&STANDS[1]) };
    let old = Config::new(&stand.firmware, &stand.hardware).unwrap().compensation();
    for percent in [0.1, 30.0, 99.0] {
        let seen = std::cell::Cell::new(0.0_f32);
        let calibrated = calibrate(stand.setup(), Box::new(Plant::new(&stand, 1.0).unwrap()), 1, &|watch| {
            assert!(watch.percent() >= seen.get() && watch.percent() <= 100.0);
            seen.set(watch.percent());
            if watch.percent() >= percent {
                watch.abort();
            }
        })
        .unwrap();
        assert_eq!(calibrated.outcome, Err(CalibrationError::Aborted));
        assert_eq!(calibrated.in_force, old, "aborted at {percent} %");
        assert!(seen.get() >= percent && seen.get() < percent + 1.0, "it ends at the abort: {}", seen.get());
    }
}

#[test]
fn calibration_is_refused_without_index_or_steady_rate() {
    // The drive cannot overcome this friction: the platform slips and no index comes.
    let mut blocked = Stand::default();
    blocked.effects.insert("coulomb".to_owned(), [("coulomb_N_m".to_owned(), 0.1)].into());
    let refused = calibrate(blocked.setup(), Box::new(Plant::new(&blocked, 1.0).unwrap()), 1, &|_| ()).unwrap();
    assert_eq!(refused.outcome, Err(CalibrationError::Fault(Fault::Stall)), "the drive pushes without an edge");
    assert_eq!(refused.in_force, Config::new(&blocked.firmware, &blocked.hardware).unwrap().compensation());
    // The current limit is below the demand of friction while turning: cogging stops the platform.
    let mut weak = stand(&STANDS[2]);
    weak.firmware.current_limit_A = 0.1;
    let refused = calibrate(weak.setup(), Box::new(Plant::new(&weak, 1.0).unwrap()), 1, &|_| ()).unwrap();
    assert!(
        matches!(
            refused.outcome,
            Err(CalibrationError::RateNotHeld(_) | CalibrationError::NoIndex | CalibrationError::Fault(Fault::Tracking))
        ),
        "{:?}",
        refused.outcome
    );
}

fn constant(stand: &Stand, rate_rad_s: f64, begin_rad: f64, seconds: f64) -> Record {
    let profile = ProfileConfig::new(ProfileKind::Constant, rate_rad_s, 1);
    session::run(stand.setup(), Plant::new(stand, begin_rad).unwrap(), SessionRequest { mode: Mode::Rate, profile, seconds, seed: 1 })
        .unwrap()
}

#[test]
fn orders_wait_for_the_index_and_the_log_notes_it() {
    let mut stand = stand(&STANDS[0]);
    stand.firmware.compensation = compensation_for(&STANDS[0]);
    // Half a turn before the index, at 2 rad/s: the index comes after 1.6 s.
    let record = constant(&stand, 2.0, -std::f64::consts::PI, 3.0);
    let first = record.compensating.iter().position(|c| c.contains(Compensating::HARMONICS)).unwrap();
    let crossed = record.true_theta_rad.iter().position(|theta| *theta >= 0.0).unwrap();
    // A row describes its own t_k; the tick of the index is within the previous row.
    assert!((first as i64 - crossed as i64).abs() <= 1, "{first} {crossed}");
    assert!(record.compensating[200..crossed].iter().all(|c| c.contains(Compensating::WAITS_FOR_INDEX)));
    assert_eq!(record.note("compensation"), Some(format!("friction, orders 7 14 (from {} s)", first as f64 / 1e3).as_str()));
    let short = constant(&stand, 2.0, -std::f64::consts::PI, 1.0);
    assert_eq!(short.note("compensation"), Some("friction, orders 7 14 (not at work, the index was not seen)"));
    assert_eq!(constant(&Stand::default(), 2.0, 0.0, 0.5).note("compensation"), None);
}

#[test]
fn friction_compensation_reduces_the_error_of_a_reversal() {
    let worst = |rubs: bool, compensation: Compensation| {
        let mut stand = Stand::default();
        if !rubs {
            stand.effects.retain(|name, _| name == "inductance");
        }
        stand.firmware.compensation = compensation;
        let mut request = SessionRequest::new(Mode::Rate, ProfileKind::Staircase, 14.0, 1);
        request.profile = ProfileConfig { dwell_s: 0.7, levels: 2, ..ProfileConfig::new(ProfileKind::Staircase, 2.0, 1) };
        let record = session::run(stand.setup(), Plant::new(&stand, 0.0).unwrap(), request).unwrap();
        let (cmd, rows) = (record.column("theta_cmd_rad").unwrap(), &record.true_theta_rad);
        cmd.iter().zip(rows).skip(100).fold(0.0_f64, |worst, (cmd, is)| worst.max((cmd - is).abs()))
    };
    let (without, with) = (worst(true, Compensation::default()), worst(true, compensation_for(&[])));
    let frictionless = worst(false, Compensation::default());
    println!("largest error of the angle over reversals: {without:.2e} rad; compensated {with:.2e}; without friction {frictionless:.2e}");
    // A stand without friction has this remainder too: the lag of the rate estimate at the ends of the ramp.
    assert!(with < 0.5 * without && with < 1.2 * frictionless, "{without} {with} {frictionless}");
}

#[test]
fn every_compensation_setting_moves_something() {
    type Change = fn(&mut Compensation);
    let changes: [(&str, Change); 7] = [
        ("coulomb_N_m", |c| c.coulomb_N_m = 0.0),
        ("coulomb_fade_rad_s", |c| c.coulomb_fade_rad_s = 1.0),
        ("viscous_N_m_s", |c| c.viscous_N_m_s = 0.0),
        ("winding_lag_s", |c| c.winding_lag_s = 5e-3),
        ("order", |c| c.harmonics = Harmonics::of([Harmonic { order: 8, ..STANDS[0][0] }]).unwrap()),
        ("torque_N_m", |c| c.harmonics = Harmonics::of([Harmonic { torque_N_m: 1e-3, ..STANDS[0][0] }]).unwrap()),
        ("phase_rad", |c| c.harmonics = Harmonics::of([Harmonic { phase_rad: 1.0, ..STANDS[0][0] }]).unwrap()),
    ];
    let columns = |change: Change| {
        let mut stand = Stand::default();
        stand.firmware.compensation = compensation_for(&STANDS[0][..1]);
        change(&mut stand.firmware.compensation);
        session::run(stand.setup(), Plant::new(&stand, -0.5).unwrap(), SessionRequest::new(Mode::Rate, ProfileKind::MultiStep, 4.0, 1))
            .unwrap()
            .columns
    };
    let usual = columns(|_| ());
    for (name, change) in changes {
        assert_ne!(usual, columns(change), "{name}");
    }
}

#[test]
fn model_without_a_known_index_zero_is_refused_with_advice() {
    let stand = stand(&STANDS[0]);
    let model = |effects: &str| {
        let base = "inertia_kg_m2 = 2.5e-4\nmotor_constant_N_m_A = 0.0234\nresistance_ohm = 2.32\n";
        Model::parse(&format!("[drive]\ninput = \"u_V\"\neffects = [{effects}]\n[parameters]\n{base}"), "m.toml").unwrap()
    };
    let [friction, bare, more] = ["\"coulomb\"", "\"inductance\"", "\"coulomb\", \"torque-ripple\""].map(model);
    let model = model("\"coulomb\", \"cogging\"");
    let unknown = learn(&model, None, &stand.firmware).unwrap_err();
    assert!(matches!(unknown, LearnError::ZeroUnknown { .. }) && unknown.to_string().contains("give the log of the fit"), "{unknown}");
    let good = log(&stand, Mode::Rate, ProfileKind::MultiStep, 1.0, 1);
    assert!(learn(&model, Some(&good), &stand.firmware).is_ok());
    let log_with_zero = |zero: Option<&str>| {
        let notes = zero.map(|zero| ("theta_zero".to_owned(), zero.to_owned()));
        Log::new("elsewhere.csv", good.columns().to_vec(), notes.into_iter().collect::<Vec<_>>()).unwrap()
    };
    for zero in [None, Some("arbitrary")] {
        let elsewhere = learn(&model, Some(&log_with_zero(zero)), &stand.firmware).unwrap_err();
        assert!(
            matches!(elsewhere, LearnError::ZeroElsewhere { .. }) && elsewhere.to_string().contains("theta_zero: index"),
            "{elsewhere}"
        );
    }
    assert!(learn(&friction, None, &stand.firmware).is_ok(), "friction has no phase");
    assert!(matches!(learn(&bare, None, &stand.firmware), Err(LearnError::Nothing { .. })));
    assert_eq!(learn(&more, None, &stand.firmware).unwrap().not_compensated, [NotCompensated::Effect("torque-ripple".to_owned())]);
}

#[test]
fn stand_file_keeps_user_text_and_returns_the_compensation_unchanged() {
    let compensation = compensation_for(&STANDS[0]);
    for text in [
        file::NEW,
        "# mine\nname = \"stand 12\" # by the window\n[firmware]\nslip_rad = 0.2\n[drive]\ninertia_kg_m2 = 4e-4\n",
        "firmware = { slip_rad = 0.2 }\n",
        "[firmware.compensation]\ncoulomb_N_m = 1e-3\n[[firmware.compensation.harmonics]]\norder = 3\ntorque_N_m = 1e-4\nphase_rad = 0\n",
    ] {
        let written = file::with_compensation(text, &compensation).unwrap();
        assert_eq!(Stand::parse(&written).unwrap().firmware.compensation, compensation_in_five_digits(&compensation), "{written}");
        assert!(text.lines().filter(|l| l.contains('#') || l.contains("inertia")).all(|line| written.contains(line)), "{written}");
        assert_eq!(written.contains("slip_rad = 0.2"), text.contains("slip_rad"), "{written}");
        assert_eq!(file::with_compensation(&written, &compensation).unwrap(), written, "writing twice changes nothing");
    }
    let wrong = Stand::parse("[firmware.compensation]\ncoulomb_Nm = 1.0\n").unwrap_err().to_string();
    assert!(wrong.contains("coulomb_Nm"), "{wrong}");
    assert!(file::with_compensation("firmware = 3\n", &compensation).is_err());
}

/// The compensation rounded to the file's digits.
fn compensation_in_five_digits(exact: &Compensation) -> Compensation {
    let short = |x: f64| format!("{x:.5e}").parse::<f64>().unwrap();
    let harmonics = exact.harmonics.as_slice().iter().map(|h| Harmonic {
        order: h.order,
        torque_N_m: short(h.torque_N_m),
        phase_rad: short(h.phase_rad),
    });
    Compensation { winding_lag_s: short(exact.winding_lag_s), harmonics: Harmonics::of(harmonics).unwrap(), ..*exact }
}

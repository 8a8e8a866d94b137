use std::path::PathBuf;

use super::*;
use crate::log::Column;
use crate::statistics::Extremes;

/// A drive with friction, noise, quantised angle: 20 s at 1 kHz, steps of the voltage.
fn drive() -> Log {
    const DT: f64 = 1e-3;
    let (inertia, constant, resistance, viscous, coulomb) = (2.5e-4, 0.05, 5.0, 6e-5, 1e-3);
    let mut seed = 12345u64;
    let mut noise = move || {
        // Sum of four uniform numbers: approximately normal.
        let mut sum = 0.0;
        for _ in 0..4 {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            sum += (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        }
        sum * 3f64.sqrt()
    };
    let levels = [0.0, 6.0, -3.0, 8.0, 2.0, -7.0, 4.0, 0.0, -5.0, 3.0];
    let (mut theta, mut omega) = (0.0, 0.0);
    let mut rows: [Vec<f64>; 5] = Default::default();
    for k in 0..20_000 {
        let u = levels[k / 700 % levels.len()];
        let mut current = 0.0;
        let (before, turned) = (omega, theta);
        for _ in 0..10 {
            let h = DT / 10.0;
            let i = (u - constant * omega) / resistance;
            current += i / 10.0;
            let free: f64 = omega + h * (constant * i - viscous * omega) / inertia;
            let next = free.signum() * (free.abs() - h * coulomb / inertia).max(0.0);
            theta += 0.5 * h * (omega + next);
            omega = next;
        }
        let lsb = std::f64::consts::TAU / 20_000.0;
        let values = [k as f64 * DT, u, current + 0.004 * noise(), (turned / lsb).round() * lsb, before + 0.02 * noise()];
        rows.iter_mut().zip(values).for_each(|(row, value)| row.push(value));
    }
    let [t_s, u, i, theta, omega] = rows;
    made([("t_s", t_s), ("u_V", u), ("i_A", i), ("theta_rad", theta), ("omega_rad_s", omega)].map(|(n, v)| (n.to_owned(), v)))
}

fn made(columns: impl IntoIterator<Item = (String, Vec<f64>)>) -> Log {
    Log::new("made", columns.into_iter().map(|(name, values)| Column { name, values }).collect(), Vec::new()).unwrap()
}

/// The log with columns changed: `None` leaves a column out.
fn with(log: &Log, change: impl Fn(&str, f64, usize) -> Option<f64>) -> Log {
    made(log.columns().iter().filter_map(|c| {
        let values: Option<Vec<f64>> = c.values.iter().enumerate().map(|(k, v)| change(&c.name, *v, k)).collect();
        Some((c.name.clone(), values?))
    }))
}

fn scaled(log: &Log, column: &str, factor: f64) -> Log {
    with(log, |name, v, _| Some(if name == column { factor * v } else { v }))
}

fn swapped(log: &Log, a: &str, b: &str) -> Log {
    made(log.columns().iter().map(|c| {
        let name = if c.name == a {
            b
        } else if c.name == b {
            a
        } else {
            &c.name
        };
        (name.to_owned(), c.values.clone())
    }))
}

fn without(log: &Log, columns: &[&str]) -> Log {
    with(log, |name, v, _| (!columns.contains(&name)).then_some(v))
}

/// Exactly one defect is found, with this code and of this form.
#[track_caller]
fn finds(log: &Log, input: &str, code: DefectCode, form: impl Fn(&Defect) -> bool) {
    let defects = check(log, input);
    assert!(defects.len() == 1 && defects[0].code() == code && form(&defects[0]), "{code:?}: {defects:?}");
}

/// A reversal of the motion relative to this column.
fn reversed(column: &'static str) -> impl Fn(&Defect) -> bool {
    move |d| *d == Defect::ReversedAcceleration { column }
}

#[track_caller]
fn sound(log: &Log, input: &str) {
    let defects = check(log, input);
    assert!(defects.is_empty(), "{defects:?}");
}

/// Applies every corruption to a log with voltage, current, angle and rate.
fn each_corruption_is_found(log: &Log) {
    use std::f64::consts::PI;
    let degrees = 180.0 / PI;
    let scale = |d: &Defect| matches!(d, Defect::RateScale { unit: None, .. });
    let unit = |wanted: UnitError| move |d: &Defect| matches!(d, Defect::RateScale { unit: Some(u), .. } if *u == wanted);
    finds(&scaled(log, "omega_rad_s", -1.0), "u_V", DefectCode::WrongSign, scale);
    finds(&scaled(log, "theta_rad", -1.0), "u_V", DefectCode::WrongSign, scale);
    for (factor, error) in [
        (degrees, UnitError::RateInDegrees),
        (30.0 / PI, UnitError::RateInRpm),
        (0.5 / PI, UnitError::RateInRevolutions),
        (1e3, UnitError::Milliseconds),
        (PI / 30.0, UnitError::RateDividedByRpm),
    ] {
        finds(&scaled(log, "omega_rad_s", factor), "u_V", DefectCode::WrongUnit, unit(error));
        let negative = |d: &Defect| matches!(d, Defect::RateScale { ratio, .. } if *ratio < 0.0);
        finds(&scaled(log, "omega_rad_s", -factor), "u_V", DefectCode::WrongUnit, negative);
    }
    finds(&scaled(log, "theta_rad", degrees), "u_V", DefectCode::WrongUnit, unit(UnitError::AngleInDegrees));
    finds(&scaled(log, "theta_rad", 0.5 / PI), "u_V", DefectCode::WrongUnit, unit(UnitError::AngleInRevolutions));
    finds(&scaled(log, "t_s", 1e3), "u_V", DefectCode::WrongUnit, unit(UnitError::Milliseconds));
    finds(&scaled(log, "omega_rad_s", 1.3), "u_V", DefectCode::RateDisagrees, scale);
    finds(&swapped(log, "theta_rad", "omega_rad_s"), "u_V", DefectCode::Swapped, |d| *d == Defect::ExchangedAngleAndRate);
    finds(&swapped(log, "u_V", "i_A"), "u_V", DefectCode::Swapped, |d| *d == Defect::ExchangedVoltageAndCurrent);
    let backwards = with(log, |name, v, _| Some(if name == "theta_rad" || name == "omega_rad_s" { -v } else { v }));
    let negative = DefectCode::NegativeMotorConstant;
    finds(&backwards, "u_V", negative, |d| *d == Defect::ReversedDrive);
    finds(&without(&backwards, &["i_A"]), "u_V", negative, reversed("u_V"));
    finds(&without(&backwards, &["u_V"]), "i_A", negative, reversed("i_A"));
    finds(&without(&backwards, &["i_A", "theta_rad"]), "u_V", negative, reversed("u_V"));
    finds(&scaled(log, "i_A", -1.0), "u_V", DefectCode::WrongSign, |d| *d == Defect::ReversedCurrent);
    finds(&scaled(log, "u_V", -1.0), "u_V", DefectCode::WrongSign, |d| *d == Defect::ReversedVoltage);
    let constant = with(log, |name, v, _| Some(if name == "u_V" { 6.0 } else { v }));
    finds(&constant, "u_V", DefectCode::ConstantInput, |d| matches!(d, Defect::ConstantInput { input: "u_V", value: 6.0, .. }));
    let no_current = with(log, |name, v, _| Some(if name == "i_A" { 0.0 } else { v }));
    finds(&no_current, "u_V", DefectCode::ConstantChannel, |d| d.columns() == ["i_A"]);
    let truncated = with(log, |name, v, _| Some(if name == "omega_rad_s" { v.trunc() } else { v }));
    finds(&truncated, "u_V", DefectCode::WholeNumbers, |d| d.columns() == ["omega_rad_s"]);
    let whole_current = with(log, |name, v, k| Some(if name == "i_A" { if k / 100 % 2 == 0 { 4.0 } else { -4.0 } } else { v }));
    let is_refused = |input| check(&whole_current, input).iter().any(|d| d.code() == DefectCode::WholeNumbers);
    assert!(is_refused("u_V") && !is_refused("i_A"), "measured, and commanded");
    finds(&without(log, &["u_V"]), "u_V", DefectCode::MissingInput, |d| *d == Defect::MissingInput { input: "u_V".to_owned() });
    let other =
        |name: &str, v: f64, k: usize| Some(if name == "omega_rad_s" { log.column("omega_rad_s").unwrap()[log.len() - 1 - k] } else { v });
    // The code is open: the reversed rate of a symmetric profile looks like another error.
    let defects = check(&with(log, other), "u_V");
    assert!(defects.len() == 1, "{defects:?}");
}

#[test]
fn sound_log_has_no_defect_with_any_choice_of_columns() {
    let log = drive();
    sound(&log, "u_V");
    sound(&log, "i_A");
    sound(&log, "theta_rad");
    for left_out in [&["i_A"][..], &["theta_rad"], &["omega_rad_s"], &["i_A", "theta_rad"], &["i_A", "omega_rad_s"]] {
        sound(&without(&log, left_out), "u_V");
    }
    sound(&without(&log, &["theta_rad", "omega_rad_s"]), "u_V");
}

#[test]
fn every_corruption_of_a_sound_log_is_found() {
    each_corruption_is_found(&drive());
}

#[test]
fn physical_rate_errors_are_not_defects() {
    let log = drive();
    let theta = log.column("theta_rad").unwrap().to_vec();
    let omega = log.column("omega_rad_s").unwrap().to_vec();
    sound(&with(&log, |n, v, k| Some(if n == "omega_rad_s" { omega[k.saturating_sub(15)] } else { v })), "u_V");
    sound(&with(&log, |n, v, _| Some(if n == "omega_rad_s" { v + 2.0 } else { v })), "u_V");
    sound(&with(&log, |n, v, _| Some(if n == "omega_rad_s" { 0.97 * v } else { v })), "u_V");
    let largest_rate = omega.iter().copied().max_abs();
    sound(&with(&log, |n, v, _| Some(if n == "omega_rad_s" { v * (1.0 - 0.04 * v.abs() / largest_rate) } else { v })), "u_V");
    sound(&with(&log, |n, v, k| Some(if n == "theta_rad" { v + 0.02 * theta[k].sin() } else { v })), "u_V");
    let mean_before = |k: usize| omega[k.saturating_sub(20)..=k].iter().sum::<f64>() / (k - k.saturating_sub(20) + 1) as f64;
    sound(&with(&log, |n, v, k| Some(if n == "omega_rad_s" { mean_before(k) } else { v })), "u_V");
    // An encoder with 100 counts per revolution.
    let coarse = std::f64::consts::TAU / 100.0;
    sound(&with(&log, |n, v, _| Some(if n == "theta_rad" { (v / coarse).round() * coarse } else { v })), "u_V");
}

#[test]
fn exchanged_gyro_column_is_found() {
    let log = drive();
    let omega = log.column("omega_rad_s").unwrap().to_vec();
    let columns = log.columns().iter().cloned().map(|c| (c.name, c.values));
    let both = made(columns.chain([("gyro_rad_s".to_owned(), omega.iter().map(|w| 1.4 * w + 0.5).collect())]));
    sound(&both, "u_V");
    finds(&swapped(&both, "gyro_rad_s", "omega_rad_s"), "u_V", DefectCode::Swapped, |d| matches!(d, Defect::ExchangedRates { .. }));
}

#[test]
fn standing_drive_is_reported() {
    let log = drive();
    let mut seed = 1u64;
    let noise: Vec<f64> = (0..log.len())
        .map(|_| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            0.02 * ((seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
        })
        .collect();
    let stands = with(&log, |n, v, k| {
        Some(match n {
            "theta_rad" => 1.25,
            "omega_rad_s" => noise[k],
            "i_A" => v.abs().sqrt(),
            _ => v,
        })
    });
    finds(&stands, "u_V", DefectCode::NoMotion, |_| true);
    finds(&without(&stands, &["theta_rad"]), "u_V", DefectCode::NoMotion, |_| true);
    finds(&without(&stands, &["omega_rad_s"]), "u_V", DefectCode::NoMotion, |_| true);
}

#[test]
fn short_logs_and_gaps_give_no_false_defect() {
    let log = drive();
    for rows in [1, 2, 3, 10, 100, 1000] {
        let short = made(log.columns().iter().map(|c| (c.name.clone(), c.values[..rows].to_vec())));
        let defects = check(&short, "u_V");
        assert!(
            defects.iter().all(|d| matches!(d.code(), DefectCode::ConstantInput | DefectCode::NoMotion | DefectCode::ConstantChannel)),
            "{rows}: {defects:?}"
        );
    }
    sound(&with(&log, |n, v, k| Some(if n == "t_s" { v + (k / 3000) as f64 * 5.0 } else { v })), "u_V");
}

/// The folder of the external records, from the environment variable `STAND_DATA`.
fn stand_data() -> PathBuf {
    std::env::var_os("STAND_DATA").expect("the environment variable STAND_DATA names the folder of the external records").into()
}

fn cases(folder: &std::path::Path) -> Vec<PathBuf> {
    let mut cases: Vec<_> =
        std::fs::read_dir(folder.join("cases")).unwrap().map(|e| e.unwrap().path().join("log.parquet")).filter(|p| p.is_file()).collect();
    cases.sort();
    cases
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn real_logs_have_no_defect() {
    let folder = stand_data();
    for (name, input) in [
        ("emps_train.csv", "torque_N_m"),
        ("emps_pulses.csv", "torque_N_m"),
        ("dcmotor_un_prbs.csv", "u_V"),
        ("odrive_slow_run.csv", "theta_rad"),
        ("odrive_slow_run.csv", "i_A"),
    ] {
        let defects = check(&Log::read(folder.join(name)).unwrap(), input);
        assert!(defects.is_empty(), "{name}: {defects:?}");
    }
    for path in cases(&folder) {
        let defects = check(&Log::read(&path).unwrap(), "u_V");
        assert!(defects.is_empty(), "{path:?}: {defects:?}");
    }
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn corruptions_of_real_logs_are_found() {
    let folder = stand_data();
    let read = |name: &str| Log::read(folder.join(name)).unwrap();
    for name in ["emps_train.csv", "emps_pulses.csv"] {
        finds(&scaled(&read(name), "theta_rad", -1.0), "torque_N_m", DefectCode::NegativeMotorConstant, reversed("torque_N_m"));
    }
    finds(&scaled(&read("dcmotor_un_prbs.csv"), "omega_rad_s", -1.0), "u_V", DefectCode::NegativeMotorConstant, reversed("u_V"));
    for path in cases(&folder) {
        each_corruption_is_found(&Log::read(&path).unwrap());
    }
}

/// The drive stands until a fault ends the log. The notes are those of the simulated and of the real stand.
#[test]
fn defects_of_a_log_without_motion_name_its_fault() {
    let sound = drive();
    let still: Vec<Column> = sound
        .columns()
        .iter()
        .map(|c| Column { name: c.name.clone(), values: c.values[..600].iter().map(|v| if c.name == "t_s" { *v } else { 0.0 }).collect() })
        .collect();
    for (note, name) in [
        ("encoder lost at 0.6 s; the rows end there", "encoder lost at 0.6 s"),
        ("5,encoder lost,check the encoder's plug, then clear the fault at 0.6 s; the rows end there", "encoder lost at 0.6 s"),
        ("power-cut at 0.5990 s; the rows end there", "power-cut at 0.5990 s"),
    ] {
        let log = Log::new("made", still.clone(), vec![("fault".to_owned(), note.to_owned())]).unwrap();
        let found = check(&log, "u_V");
        let codes: Vec<DefectCode> = found.iter().map(Defect::code).collect();
        assert_eq!(codes, [DefectCode::NoMotion, DefectCode::ConstantInput, DefectCode::ConstantChannel], "{found:?}");
        assert!(found.iter().all(|d| fault_of(d) == Some(name)), "{name}: {found:?}");
    }
    let log = Log::new("made", still, Vec::new()).unwrap();
    assert!(check(&log, "u_V").iter().all(|d| fault_of(d).is_none()));
}

fn fault_of(defect: &Defect) -> Option<&str> {
    match defect {
        Defect::NoMotion { fault, .. } | Defect::ConstantInput { fault, .. } | Defect::ConstantChannel { fault, .. } => fault.as_deref(),
        _ => None,
    }
}

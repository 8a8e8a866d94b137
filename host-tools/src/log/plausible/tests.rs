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
        // Sum of four uniform numbers: near enough to normal.
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

#[track_caller]
fn finds(log: &Log, input: &str, code: Code, word: &str) {
    let findings = check(log, input);
    assert!(findings.len() == 1 && findings[0].code == code && findings[0].says.contains(word), "{code:?} “{word}”: {findings:?}");
}

#[track_caller]
fn sound(log: &Log, input: &str) {
    let findings = check(log, input);
    assert!(findings.is_empty(), "{findings:?}");
}

/// All that can be broken in a log with voltage, current, angle and rate.
fn each_corruption_is_found(log: &Log) {
    use std::f64::consts::PI;
    let degrees = 180.0 / PI;
    finds(&scaled(log, "omega_rad_s", -1.0), "u_V", Code::WrongSign, "wrong sign");
    finds(&scaled(log, "theta_rad", -1.0), "u_V", Code::WrongSign, "wrong sign");
    for (factor, word) in
        [(degrees, "degrees per second"), (30.0 / PI, "rpm"), (0.5 / PI, "turns per second"), (1e3, "mrad/s"), (PI / 30.0, "9.55")]
    {
        finds(&scaled(log, "omega_rad_s", factor), "u_V", Code::WrongUnit, word);
        finds(&scaled(log, "omega_rad_s", -factor), "u_V", Code::WrongUnit, "with the wrong sign");
    }
    finds(&scaled(log, "theta_rad", degrees), "u_V", Code::WrongUnit, "theta_rad in degrees");
    finds(&scaled(log, "theta_rad", 0.5 / PI), "u_V", Code::WrongUnit, "theta_rad in turns");
    finds(&scaled(log, "t_s", 1e3), "u_V", Code::WrongUnit, "milliseconds");
    finds(&scaled(log, "omega_rad_s", 1.3), "u_V", Code::RateDisagrees, "should be 1 ± 0.05");
    finds(&swapped(log, "theta_rad", "omega_rad_s"), "u_V", Code::Swapped, "theta_rad and omega_rad_s");
    finds(&swapped(log, "u_V", "i_A"), "u_V", Code::Swapped, "u_V and i_A");
    let backwards = |name: &str, v: f64, _: usize| Some(if name == "theta_rad" || name == "omega_rad_s" { -v } else { v });
    finds(&with(log, backwards), "u_V", Code::NegativeMotorConstant, "backwards");
    finds(&without(&with(log, backwards), &["i_A"]), "u_V", Code::NegativeMotorConstant, "voltage");
    finds(&without(&with(log, backwards), &["u_V"]), "i_A", Code::NegativeMotorConstant, "current");
    finds(&without(&with(log, backwards), &["i_A", "theta_rad"]), "u_V", Code::NegativeMotorConstant, "voltage");
    finds(&scaled(log, "i_A", -1.0), "u_V", Code::WrongSign, "current has the wrong sign");
    finds(&scaled(log, "u_V", -1.0), "u_V", Code::WrongSign, "voltage has the wrong sign");
    finds(&with(log, |name, v, _| Some(if name == "u_V" { 6.0 } else { v })), "u_V", Code::ConstantInput, "u_V is 6 in all rows");
    finds(&with(log, |name, v, _| Some(if name == "i_A" { 0.0 } else { v })), "u_V", Code::ConstantChannel, "i_A never changes");
    finds(&with(log, |name, v, _| Some(if name == "omega_rad_s" { v.trunc() } else { v })), "u_V", Code::WholeNumbers, "decimal comma");
    finds(&without(log, &["u_V"]), "u_V", Code::MissingInput, "u_V is no column");
    let other =
        |name: &str, v: f64, k: usize| Some(if name == "omega_rad_s" { log.column("omega_rad_s").unwrap()[log.len() - 1 - k] } else { v });
    // (Where a profile is its own mirror image the reversed rate may look like another error.)
    let findings = check(&with(log, other), "u_V");
    assert!(findings.len() == 1, "{findings:?}");
}

#[test]
fn a_sound_log_has_no_finding_with_any_choice_of_columns() {
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
fn a_rate_that_is_physics_is_no_finding() {
    let log = drive();
    let theta = log.column("theta_rad").unwrap().to_vec();
    let omega = log.column("omega_rad_s").unwrap().to_vec();
    sound(&with(&log, |n, v, k| Some(if n == "omega_rad_s" { omega[k.saturating_sub(15)] } else { v })), "u_V");
    sound(&with(&log, |n, v, _| Some(if n == "omega_rad_s" { v + 2.0 } else { v })), "u_V");
    sound(&with(&log, |n, v, _| Some(if n == "omega_rad_s" { 0.97 * v } else { v })), "u_V");
    let fast = omega.iter().copied().max_abs();
    sound(&with(&log, |n, v, _| Some(if n == "omega_rad_s" { v * (1.0 - 0.04 * v.abs() / fast) } else { v })), "u_V");
    sound(&with(&log, |n, v, k| Some(if n == "theta_rad" { v + 0.02 * theta[k].sin() } else { v })), "u_V");
    let mean_before = |k: usize| omega[k.saturating_sub(20)..=k].iter().sum::<f64>() / (k - k.saturating_sub(20) + 1) as f64;
    sound(&with(&log, |n, v, k| Some(if n == "omega_rad_s" { mean_before(k) } else { v })), "u_V");
    // Quiet in the middle, and an encoder of 100 counts.
    let coarse = std::f64::consts::TAU / 100.0;
    sound(&with(&log, |n, v, _| Some(if n == "theta_rad" { (v / coarse).round() * coarse } else { v })), "u_V");
}

#[test]
fn an_exchanged_gyro_is_named() {
    let log = drive();
    let omega = log.column("omega_rad_s").unwrap().to_vec();
    let columns = log.columns().iter().cloned().map(|c| (c.name, c.values));
    let both = made(columns.chain([("gyro_rad_s".to_owned(), omega.iter().map(|w| 1.4 * w + 0.5).collect())]));
    sound(&both, "u_V");
    finds(&swapped(&both, "gyro_rad_s", "omega_rad_s"), "u_V", Code::Swapped, "rate columns exchanged");
}

#[test]
fn a_drive_that_stands_is_said_to_stand() {
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
    finds(&stands, "u_V", Code::NoMotion, "nothing moves");
    finds(&without(&stands, &["theta_rad"]), "u_V", Code::NoMotion, "nothing moves");
    finds(&without(&stands, &["omega_rad_s"]), "u_V", Code::NoMotion, "nothing moves");
}

#[test]
fn short_logs_and_logs_with_gaps_do_not_mislead() {
    let log = drive();
    for rows in [1, 2, 3, 10, 100, 1000] {
        let short = made(log.columns().iter().map(|c| (c.name.clone(), c.values[..rows].to_vec())));
        let findings = check(&short, "u_V");
        assert!(
            findings.iter().all(|f| matches!(f.code, Code::ConstantInput | Code::NoMotion | Code::ConstantChannel)),
            "{rows}: {findings:?}"
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
fn real_records_have_no_finding() {
    let folder = stand_data();
    for (name, input) in [
        ("emps_train.csv", "torque_N_m"),
        ("emps_pulses.csv", "torque_N_m"),
        ("dcmotor_un_prbs.csv", "u_V"),
        ("odrive_slow_run.csv", "theta_rad"),
        ("odrive_slow_run.csv", "i_A"),
    ] {
        let findings = check(&Log::read(folder.join(name)).unwrap(), input);
        assert!(findings.is_empty(), "{name}: {findings:?}");
    }
    for path in cases(&folder) {
        let findings = check(&Log::read(&path).unwrap(), "u_V");
        assert!(findings.is_empty(), "{path:?}: {findings:?}");
    }
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn corrupted_real_records_are_found() {
    let folder = stand_data();
    let read = |name: &str| Log::read(folder.join(name)).unwrap();
    for name in ["emps_train.csv", "emps_pulses.csv"] {
        finds(&scaled(&read(name), "theta_rad", -1.0), "torque_N_m", Code::NegativeMotorConstant, "torque");
    }
    finds(&scaled(&read("dcmotor_un_prbs.csv"), "omega_rad_s", -1.0), "u_V", Code::NegativeMotorConstant, "voltage");
    for path in cases(&folder) {
        each_corruption_is_found(&Log::read(&path).unwrap());
    }
}

/// The drive stood until a fault ended the log: each sentence names it, as the simulated stand and as a stand at a line put it.
#[test]
fn a_log_that_a_fault_ended_before_anything_moved_names_the_fault() {
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
        let codes: Vec<Code> = found.iter().map(|f| f.code).collect();
        assert_eq!(codes, [Code::NoMotion, Code::ConstantInput, Code::ConstantChannel], "{found:?}");
        assert!(found.iter().all(|f| f.says.contains(name) && !f.says.contains("connected")), "{name}: {found:?}");
    }
    let log = Log::new("made", still, Vec::new()).unwrap();
    assert!(check(&log, "u_V").iter().all(|f| !f.says.contains("fault")));
}

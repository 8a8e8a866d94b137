//! Files as benches have them: what their columns are is known, asked, or left alone, and what nobody uses costs nothing.

use std::path::{Path, PathBuf};

use identification::log::import::{self, ImportMapping, Inspection, Question, Statements};
use identification::log::{Log, LogWarning, WordForm};
use tempfile::TempDir;

/// A file in a folder of its own.
fn file(name: &str, text: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("a file");
    (folder, path)
}

fn table(head: &str, rows: usize, row: impl Fn(f64) -> String) -> String {
    (0..rows).fold(format!("{head}\n"), |text, k| text + &row(k as f64) + "\n")
}

fn inspected(path: &Path, units: &[(&str, &str)]) -> Inspection {
    let units = units.iter().map(|(column, unit)| ((*column).to_owned(), (*unit).to_owned())).collect();
    import::inspect(path, &Statements { units, ..Statements::default() }).expect("a table")
}

/// What a column of the file is taken as.
fn is(inspection: &Inspection, source: &str) -> Option<String> {
    inspection.mapping.columns.get(source).map(|c| c.is.clone())
}

fn accepted(path: &Path, units: &[(&str, &str)]) -> Log {
    inspected(path, units).accept().expect("a mapping");
    Log::read(path).expect("a log")
}

#[test]
fn constant_voltage_is_the_motors_where_the_motion_answers_it() {
    let voltage_of = |rate: fn(f64) -> f64| {
        let (_folder, path) =
            file("run.csv", &table("time (s),voltage (V),speed (rad/s)", 500, |k| format!("{},6,{}", k * 2e-3, rate(k * 2e-3))));
        is(&inspected(&path, &[]), "voltage (V)")
    };
    assert_eq!(voltage_of(|t| 113.0 * (1.0 - (-5.0 * t).exp()) + 0.01 * (777.0 * t).sin()).as_deref(), Some("u_V"));
    assert_eq!(voltage_of(|t| 113.0 * (20.0 * t).sin()).as_deref(), Some("supply_V"));
}

#[test]
fn columns_that_never_change_and_lengths_are_no_motion() {
    let text = table("time (s),voltage (V),speed (rad/s),encoder position (deg),cable length (mm)", 400, |k| {
        let t = k * 2e-3;
        format!("{t},{},{},0,{}", (9.0 * t).sin(), 30.0 * (9.0 * t - 0.5).sin(), 150.0 + 0.1 * (k / 50.0).floor())
    });
    let (_folder, path) = file("drive.csv", &text);
    let inspection = inspected(&path, &[]);
    assert_eq!(is(&inspection, "speed (rad/s)").as_deref(), Some("omega_rad_s"));
    for column in ["encoder position (deg)", "cable length (mm)"] {
        assert!(!matches!(is(&inspection, column).as_deref(), Some("theta_rad" | "t_s")), "{column}: {:?}", is(&inspection, column));
    }
    // Without another motion, metres are the position of a linear axis.
    let linear =
        table("time (s),force (N),place (m)", 400, |k| format!("{},{},{}", k * 2e-3, (k * 0.05).sin(), 1.0 + 0.2 * (k * 0.02).sin()));
    let (_folder, path) = file("slide.csv", &linear);
    assert_eq!(is(&inspected(&path, &[]), "place (m)").as_deref(), Some("theta_rad"));
}

#[test]
fn time_is_found_in_any_column() {
    let (_folder, path) = file("save.txt", &table("", 400, |k| format!("{} {} {}", (k * 0.1).sin(), 0.001 * k, 3.0 * (k * 0.1).cos())));
    assert_eq!(is(&inspected(&path, &[]), "column_2").as_deref(), Some("t_s"));
}

#[test]
fn duty_and_counts_of_a_microcontroller_are_asked_with_an_example() {
    let text = table("millis,pwm,counts", 800, |k| {
        format!("{},{},{}", 4000.0 + 5.0 * k, (190.0 * (k * 0.02).sin()).round(), (-4e4 * (k * 0.01).cos()).round())
    });
    let (_folder, path) = file("arduino.csv", &text);
    let inspection = inspected(&path, &[]);
    assert_eq!(["millis", "pwm", "counts"].map(|c| is(&inspection, c)), ["t_s", "u_V", "theta_rad"].map(|c| Some(c.to_owned())));
    assert!(inspection.questions.iter().any(|q| matches!(q, Question::Duty { full: 255, .. })), "{:?}", inspection.questions);
    assert!(inspection.questions.iter().any(|q| matches!(q, Question::Counts { .. })), "{:?}", inspection.questions);
    let log = accepted(&path, &[("pwm", "12/255 V"), ("counts", "counts:1440")]);
    assert!((log.column("u_V").unwrap()[78] - 12.0 / 255.0 * (190.0 * 1.56f64.sin()).round()).abs() < 1e-9);
}

/// The columns of VESC Tool's log as far as they matter here, and two that look like others.
#[test]
fn log_of_vesc_tool_is_known_by_its_header() {
    let head = "ms_today;input_voltage;temp_motor;current_motor;current_in;erpm;duty_cycle;encoder_position;q_axis_voltage;battery_level;gnss_posTime;gnss_gVel";
    let text = table(head, 400, |k| {
        let w = (k * 0.03).sin();
        format!(
            "{};{};40;{};{};{};{};0;{};0.9;{};0",
            43_200_000.0 + 20.0 * k,
            37.0 + w,
            74.0 * w,
            50.0 * w,
            (9000.0 * w).round(),
            0.6 * w,
            20.0 * w,
            43_200_000.0 + 1000.0 * k
        )
    });
    let (_folder, path) = file("vesc.csv", &text);
    let inspection = inspected(&path, &[]);
    let wanted =
        [("ms_today", "t_s"), ("input_voltage", "supply_V"), ("current_motor", "i_A"), ("erpm", "omega_rad_s"), ("q_axis_voltage", "u_V")];
    for (source, target) in wanted {
        assert_eq!(is(&inspection, source).as_deref(), Some(target));
    }
    assert!(matches!(&inspection.questions[..], [Question::PolePairs { column }] if column == "erpm"), "{:?}", inspection.questions);
    let log = accepted(&path, &[("erpm", "erpm:7")]);
    let of_row_50 = (9000.0 * 1.5f64.sin()).round() / 7.0 * std::f64::consts::TAU / 60.0;
    assert!((log.column("omega_rad_s").unwrap()[50] - of_row_50).abs() < 1e-9);
}

#[test]
fn unused_columns_cost_no_row_and_a_slow_temperature_is_interpolated() {
    let text = table("time (s),voltage (V),speed (rad/s),winding temp (degC),thrust (gf)", 500, |k| {
        let temperature = if k % 50.0 == 0.0 { format!("{}", 20.0 + 0.01 * k) } else { String::new() };
        let thrust = if k % 3.0 == 0.0 { "7" } else { "" };
        format!("{},{},{},{temperature},{thrust}", k * 2e-3, (k * 0.05).sin(), 20.0 * (k * 0.05 - 0.4).sin())
    });
    let (_folder, path) = file("bench.csv", &text);
    let log = accepted(&path, &[]);
    assert_eq!(log.len(), 500);
    let temperature = log.column("temp_C").unwrap();
    assert!((temperature[25] - 20.25).abs() < 1e-9 && (temperature[499] - 24.5).abs() < 1e-9, "{} {}", temperature[25], temperature[499]);
    assert!(
        log.warnings().contains(&LogWarning::SlowColumn { column: "temp_C".to_owned(), readings: 10, rows: 500 }),
        "{:?}",
        log.warnings()
    );
}

#[test]
fn words_without_their_sign_get_it_back() {
    let speed = |k: f64| (400.0 * (k * 0.02).sin()).round();
    let text = table("time (s),voltage (V),speed", 1000, |k| {
        format!("{},{},{}", k * 1e-2, 6.0 * (k * 0.02 + 0.2).sin(), speed(k).rem_euclid(65_536.0))
    });
    let (_folder, path) = file("words.csv", &text);
    let log = accepted(&path, &[("speed", "counts/s:360")]);
    let negative = (0..1000).filter(|k| speed(f64::from(*k)) < 0.0).count();
    let said = LogWarning::SignedWords { column: "speed".to_owned(), bits: 16, form: WordForm::TwosComplement, rows: negative };
    assert!(log.warnings().contains(&said), "{:?}", log.warnings());
    assert!((log.column("omega_rad_s").unwrap()[200] - speed(200.0) * std::f64::consts::TAU / 360.0).abs() < 1e-9);
}

#[test]
fn a_missing_reading_is_a_gap_in_one_column_as_in_two() {
    let reading = |k: f64| if (100.0..120.0).contains(&k) { "NaN".to_owned() } else { format!("{}", 0.01 * (k * 1.7).sin()) };
    let times = |name: &str, text: &str| {
        let (_folder, path) = file(name, text);
        let statements = Statements { sample_rate_Hz: Some(100.0), ..Statements::default() };
        import::inspect(&path, &statements).expect("a table").accept().expect("a mapping");
        Log::read(&path).expect("a log").t_s().to_vec()
    };
    let one = times("one.csv", &table("gyro_x (rad/s)", 400, reading));
    let two = times("two.csv", &table("gyro_x (rad/s),temp (degC)", 400, |k| format!("{},25", reading(k))));
    assert_eq!(one, two);
    assert!(one.windows(2).any(|w| w[1] - w[0] > 0.2));
}

#[test]
fn text_is_read_whatever_its_ending_and_an_import_file_that_was_copied_is_used() {
    let text = table("", 300, |k| format!("{} {} {}", 2e-3 * k, (k * 0.05).sin(), 30.0 * (k * 0.05 - 0.4).sin()));
    let (folder, path) = file("a.mat", &text);
    let statements = |columns: &[(&str, &str)]| Statements {
        columns: columns.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect(),
        ..Statements::default()
    };
    let stated = statements(&[("column_2", "u_V"), ("column_3", "omega_rad_s")]);
    let import_file = import::inspect(&path, &stated).expect("a table").accept().expect("a mapping");
    let other = folder.path().join("b.mat");
    std::fs::write(&other, &text).unwrap();
    // Without an import file the message names it, and does not say that text cannot be a log.
    let refused = Log::read(&other).unwrap_err().to_string();
    assert!(refused.contains("b.import.toml") && !refused.contains("must end in"), "{refused}");
    std::fs::copy(import_file, folder.path().join("b.import.toml")).unwrap();
    assert!(ImportMapping::beside(&other).unwrap().is_some());
    assert_eq!(Log::read(&other).unwrap().columns(), Log::read(&path).unwrap().columns());
}

#[test]
fn tables_beyond_the_limits_are_refused_before_they_are_read() {
    let wide = ["0"; 20_000].join(",");
    let (_folder, path) =
        file("wide.csv", &format!("{}\n{wide}\n{wide}\n", (0..20_000).map(|k| format!("c{k}")).collect::<Vec<_>>().join(",")));
    let refused = import::inspect(&path, &Statements::default()).unwrap_err().to_string();
    assert!(refused.contains("columns") && refused.contains("10000"), "{refused}");
    let refused = Log::read(&path).unwrap_err().to_string();
    assert!(refused.contains("10000"), "{refused}");
}

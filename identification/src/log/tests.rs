use std::path::PathBuf;

use proptest::prelude::*;

use super::*;

fn file(name: &str, text: impl AsRef<[u8]>) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

fn csv(text: impl AsRef<[u8]>) -> Result<Log, String> {
    let (_folder, path) = file("log.csv", text);
    Log::read(&path).map_err(|e| {
        let message = e.to_string();
        assert!(message.contains("log.csv: ") && !message.contains('\n'), "{message}");
        message.rsplit_once("log.csv: ").unwrap().1.to_owned()
    })
}

fn error(text: impl AsRef<[u8]>) -> String {
    csv(text).unwrap_err()
}

/// The folder of the external records, from the environment variable `STAND_DATA`.
fn stand_data() -> PathBuf {
    std::env::var_os("STAND_DATA").expect("the environment variable STAND_DATA names the folder of the external records").into()
}

fn sample() -> Log {
    let columns = [("t_s", vec![0.0, 0.001, 0.002]), ("u_V", vec![1.0, -0.0, 1e-300]), ("omega_rad_s", vec![0.1, 1.0 / 3.0, 6.02e23])];
    let columns = columns.map(|(name, values)| Column { name: name.to_owned(), values }).to_vec();
    let notes =
        vec![("stand".to_owned(), "no. 3: blue".to_owned()), ("omega_rad_s".to_owned(), "encoder, mean over 4 ms before t".to_owned())];
    Log::new("sample", columns, notes).unwrap()
}

fn same(a: &Log, b: &Log) {
    assert_eq!(a.notes(), b.notes());
    assert_eq!(a.columns().len(), b.columns().len());
    for (a, b) in a.columns().iter().zip(b.columns()) {
        assert_eq!(a.name, b.name);
        let bits = |c: &Column| c.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(a), bits(b), "{}", a.name);
    }
}

#[test]
fn notes_between_rows_and_unknown_columns_are_read() {
    let log =
        csv("# stand: 3\r\n#plain words\r\nt_s,u_V,pulse_flag\r\n0,1.5,yes\r\n# event: a bump: hard\r\n0.1,\"2\", no\r\n\r\n").unwrap();
    assert_eq!(log.column("u_V"), Some(&[1.5, 2.0][..]));
    assert_eq!(log.ignored(), ["pulse_flag"]);
    assert_eq!(log.note("event"), Some("a bump: hard"));
    assert_eq!(log.note("comment"), Some("plain words"));
    assert_eq!((log.len(), log.median_dt_s(), log.duration_s()), (2, 0.1, 0.2));
    assert!(log.warnings().is_empty(), "{:?}", log.warnings());
}

#[test]
fn caller_can_select_additional_columns() {
    let (_folder, path) = file("a.csv", "t_s,strange\n0,1\n1,2\n");
    let log = Log::read_also(&path, &["strange"]).unwrap();
    assert_eq!(log.column("strange"), Some(&[1.0, 2.0][..]));
    assert!(log.ignored().is_empty());
}

#[test]
fn byte_order_mark_is_skipped() {
    assert_eq!(csv("\u{feff}t_s,i_A\n0,1\n").unwrap().column("t_s"), Some(&[0.0][..]));
}

#[test]
fn error_is_one_line_with_row_and_column() {
    for (text, message) in [
        ("", "the file is empty"),
        ("# stand: 3\n", "notes but no header"),
        ("t_s,u_V\n", "header but no rows"),
        ("0.0,1.0\n0.1,1.0\n", "line 1: the header is missing"),
        ("u_V,i_A\n0,1\n", "there is no column t_s (time of each row in seconds); the file has u_V, i_A"),
        ("t_s,u_V,u_V\n0,1,1\n", "line 1, column u_V: this name is used twice"),
        ("t_s,x,x\n0,1,1\n", "line 1, column x: this name is used twice"),
        ("t_s,,u_V\n0,1,1\n", "column 2 of the header has no name"),
        ("# a: b\nt_s,u_V\n0,1\n0.1,abc\n0.2,1\n", "row 2 (line 4), column u_V: “abc” is not a number"),
        ("t_s,u_V\n0,1.5 V\n1,1\n", "units belong in the column name"),
        ("t_s,u_V\n0,\n1,1\n", "row 1 (line 2), column u_V: the cell is empty"),
        ("t_s,u_V\n0,1\n0.1,NaN\n", "row 2 (line 3), column u_V: NaN is not a measured value"),
        ("t_s,u_V\n0,1\n0.1,-inf\n", "row 2 (line 3), column u_V: -inf is not a measured value"),
        ("t_s,u_V\n0,1\n0.2,1\n0.1,1\n", "row 3 (line 4), column t_s: time steps back from 0.2 s to 0.1 s"),
        ("t_s,u_V\n0,1\n0.2,1\n0.2,1\n", "row 3 (line 4), column t_s: time 0.2 s repeats"),
        ("t_s,u_V,i_A\n0,1,2\n0.1,1\n", "row 2 (line 3): the last row is cut short (2 of 3 cells)"),
        ("t_s,u_V,i_A\n0,1,2\n0.1,1,-", "row 2 (line 3): the last row is cut short"),
        ("t_s,u_V,i_A\n0,1,2\n0.1,1\n0.2,1,2\n", "row 2 (line 3): 2 cells where the header names 3 columns"),
        ("t_s,u_V\n0,0,1,5\n0,1,1,6\n", "row 1 (line 2): 4 cells where the header names 2 columns; decimal commas?"),
        ("t_s;u_V\n0,0;1,5\n", "separated by semicolons"),
        ("t_s\tu_V\n0.0\t1.5\n", "separated by tabs"),
        ("t_s,u_V\n0,1;5\n1,2\n", "a decimal comma?"),
    ] {
        let error = error(text);
        assert!(error.contains(message), "{text:?} → {error}");
    }
    assert!(error(b"\xff\xfet\0_\0").contains("UTF-16"));
    assert!(error(b"PAR1xxxxxxxxxxxPAR1").contains(".parquet"));
    assert!(error(b"t_s,\xffu\n0,1\n").contains("UTF-8"));
}

#[test]
fn last_row_without_line_break_causes_a_warning() {
    let log = csv("t_s,u_V\n0,1\n1,2").unwrap();
    assert_eq!(log.len(), 2);
    assert_eq!(log.warnings(), [LogWarning::UnterminatedRow { line: 3 }]);
}

#[test]
fn ending_selects_the_format() {
    let message = Log::read("somewhere/log.txt").unwrap_err().to_string();
    assert_eq!(message, "somewhere/log.txt: the name of a log must end in .csv or .parquet; the ending selects the format");
    assert!(Log::read("nowhere/log.csv").unwrap_err().to_string().contains("cannot be read"));
    let (_folder, path) = file("a.parquet", "t_s,u_V\n0,1\n1,2\n");
    assert!(Log::read(&path).unwrap_err().to_string().contains("not a Parquet file; the name of a CSV"));
    let (_folder, path) = file("a.parquet", "");
    assert!(Log::read(&path).unwrap_err().to_string().contains("empty"));
}

#[test]
fn both_formats_round_trip_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let log = sample();
    for name in ["log.csv", "log.PARQUET"] {
        let path = folder.path().join(name);
        log.write(&path).unwrap();
        same(&log, &Log::read(&path).unwrap());
    }
    assert!(log.write(folder.path().join("log.xlsx")).is_err());
}

#[test]
fn truncated_parquet_file_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.parquet");
    sample().write(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
    assert!(Log::read(&path).unwrap_err().to_string().contains("its end is cut off"));
}

#[test]
fn columns_of_a_program_are_checked() {
    let column = |name: &str, values: &[f64]| Column { name: name.to_owned(), values: values.to_vec() };
    let message = |columns: Vec<Column>| Log::new("made", columns, Vec::new()).unwrap_err().to_string();
    assert_eq!(
        message(vec![column("t_s", &[0.0, 0.0])]),
        "made: row 2, column t_s: time 0 s repeats; the time must increase from row to row"
    );
    assert!(message(vec![column("t_s", &[0.0]), column("i_A", &[f64::NAN])]).contains("row 1, column i_A: NaN"));
    assert!(message(vec![column("t_s", &[0.0]), column("i_A", &[])]).contains("0 numbers"));
    assert!(message(vec![column("t_s", &[0.0]), column("t_s", &[0.0])]).contains("twice"));
}

#[test]
fn step_above_one_and_a_half_intervals_is_a_gap() {
    let t_s = vec![0.0, 1.0, 2.0, 3.4, 4.4, 6.0, 7.0];
    let log = Log::new("", vec![Column { name: "t_s".to_owned(), values: t_s }], Vec::new()).unwrap();
    assert_eq!(log.segments(), vec![0..5, 5..7]);
    assert!((log.median_dt_s() - 1.0).abs() < 1e-12);
}

fn noted(notes: &[(&str, &str)]) -> Log {
    let mut log = sample();
    log.notes = notes.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>().into();
    log.warnings = log.notes.not_understood();
    log
}

#[test]
fn another_column_takes_the_place_of_the_rate_with_its_notes() {
    let columns = [("t_s", vec![0.0, 1.0]), ("omega_rad_s", vec![1.0, 1.0]), ("gyro_rad_s", vec![2.0, 2.0])];
    let columns = columns.map(|(name, values)| Column { name: name.to_owned(), values }).to_vec();
    let notes = [("omega_rad_s", "encoder"), ("gyro_rad_s", "X1, gyro, filter 50 Hz")].map(|(k, v)| (k.to_owned(), v.to_owned()));
    let log = Log::new("a.csv", columns, notes.to_vec()).unwrap();
    let other = log.clone().with_rate("gyro_rad_s").unwrap();
    assert_eq!(other.column("omega_rad_s"), Some(&[2.0, 2.0][..]));
    assert_eq!(other.provenance("omega_rad_s").filter_hz, Some(50.0));
    let missing = log.with_rate("imu").unwrap_err().to_string();
    assert!(missing.contains("imu") && missing.contains("gyro_rad_s"), "{missing}");
}

#[test]
fn bridge_that_coasts_is_a_clause_of_the_voltages_note() {
    assert!(noted(&[("u_V", "coasting, at t")]).notes().bridge_coasts());
    let before = noted(&[("u_V", "held, over the row before t")]);
    assert!(before.warnings.is_empty() && before.notes().is_of_row_before("u_V") && before.notes().voltage_is_held());
    assert!(before.notes().states_timing("u_V") && !noted(&[("u_V", "held")]).notes().states_timing("u_V"));
    assert!(noted(&[("torque_N_m", "mean over the row before t")]).notes().is_of_row_before("torque_N_m"));
    assert!(!noted(&[("u_V", "mean over the row")]).notes().is_of_row_before("u_V"));
    assert!(noted(&[("u_V", "asked, held")]).notes().voltage_is_held() && !noted(&[("u_V", "asked")]).notes().voltage_is_held());
    assert!(!noted(&[("u_V", "asked")]).notes().bridge_coasts());
}

#[test]
fn notes_state_the_provenance_of_a_column() {
    let made = |column: &str, note: &str| {
        let log = noted(&[(column, note)]);
        assert!(log.warnings().is_empty(), "{note}: {:?}", log.warnings());
        log.provenance(column)
    };
    let plain = Provenance {
        instant: true,
        mean_before_s: None,
        sample_interval_s: None,
        filter_hz: None,
        source: RateSource::Unknown,
        magnitude: false,
        absolute: false,
    };
    let by = |source| Provenance { source, ..plain };
    let rate = |note: &str| made("omega_rad_s", note);
    let mean = |s| Provenance { instant: false, mean_before_s: Some(s), ..by(RateSource::Encoder) };
    assert_eq!(rate("encoder, mean over 4 ms before t"), mean(4.0 * 1e-3));
    assert_eq!(rate("mean over 4ms before t, encoder"), mean(4.0 * 1e-3));
    assert_eq!(rate("encoder; mean over 0.02 s"), mean(0.02));
    assert_eq!(rate("gyro, magnitude"), Provenance { magnitude: true, ..by(RateSource::RateSensor) });
    assert_eq!(made("theta_rad", "compared absolutely"), Provenance { absolute: true, ..plain });
    assert_eq!(rate("gyro, filter 100 Hz"), Provenance { filter_hz: Some(100.0), ..by(RateSource::RateSensor) });
    assert_eq!(rate("gyro, low-pass 0.1 kHz"), Provenance { filter_hz: Some(100.0), ..by(RateSource::RateSensor) });
    let sampled = Provenance { mean_before_s: Some(1e-3), sample_interval_s: Some(1e-3), ..by(RateSource::RateSensor) };
    assert_eq!(rate("gyro, newest sample of 1 kHz before t"), sampled);
    assert_eq!(rate("at t"), plain);
    assert_eq!(made("i_A", "mean over [t_k, t_k+1)"), Provenance { instant: false, ..plain });
    assert_eq!(made("i_A", "at t"), plain);
    assert_eq!(sample().provenance("i_A"), Provenance { instant: false, ..plain });
    assert_eq!(noted(&[("encoder", "0.1286 deg per count, rate by counts per 20 ms")]).provenance("omega_rad_s"), mean(0.02));
    assert_eq!(noted(&[("u_V", "terminal")]).voltage(), VoltageSource::Terminals);
    assert_eq!(noted(&[("u_V", "asked")]).voltage(), VoltageSource::Command);
    assert_eq!(noted(&[]).voltage(), VoltageSource::Command);
    assert!(noted(&[("theta_zero", "index")]).theta_zero_is_index());
}

#[test]
fn notes_that_are_written_are_read() {
    let fault = FaultNote { message: "3,overspeed,reduce the setpoint".to_owned(), at_s: "0.5".to_owned() };
    let written = [
        Note::Voltage(VoltageSource::Terminals),
        Note::Rate(RateSource::RateSensor, Some(100.0)),
        Note::MeanCurrent,
        Note::Encoder(8192.0),
        Note::QuantizationStep("omega", "rad_s", 1e-3),
        Note::ThetaZeroIsIndex,
        Note::SupplyNominal(24.0),
        Note::Limited("current", 12),
        Note::Fault(fault.clone()),
    ];
    let notes: Notes = written.into_iter().collect();
    assert_eq!(notes.not_understood(), Vec::new());
    assert_eq!(notes.voltage(), VoltageSource::Terminals);
    let rate = notes.provenance("omega_rad_s");
    assert_eq!((rate.source, rate.filter_hz), (RateSource::RateSensor, Some(100.0)));
    assert!(!notes.provenance("i_A").instant && notes.theta_zero_is_index());
    assert_eq!(notes.quantization_step("theta_rad"), Some(std::f64::consts::TAU / 8192.0));
    assert_eq!((notes.quantization_step("omega_rad_s"), notes.number("supply_nominal_V")), (Some(1e-3), Some(24.0)));
    assert_eq!(notes.limits().collect::<Vec<_>>(), [("current", "12 rows")]);
    assert_eq!((notes.fault(), fault.name()), (Some(fault.clone()), "overspeed"));
}

#[test]
fn note_that_is_not_understood_causes_a_warning() {
    for (key, value) in [
        ("omega_rad_s", "encoder, smoothed by hand"),
        ("omega_rad_s", "mean over a while"),
        ("omega_rad_s", "second-order filter 100 Hz"),
        ("omega_rad_s", "mean over 4 ms around t"),
        ("omega_rad_s", "filter 0 Hz"),
        ("omega", "something"),
        ("u_V", "from the moon"),
        ("theta_lsb_rad", "small"),
        ("i_A_lsb", "3 apples"),
        ("encoder", "a good one"),
        ("theta_zero", "noon"),
    ] {
        let warnings = noted(&[(key, value)]).warnings().to_vec();
        let names_the_note = |w: &LogWarning| matches!(w, LogWarning::NoteNotUnderstood { key: named, .. } if named == key);
        assert!(warnings.len() == 1 && names_the_note(&warnings[0]), "{key}: {value} → {warnings:?}");
    }
    assert!(noted(&[("stand", "anything"), ("seed", "7"), ("theta_zero", "arbitrary")]).warnings().is_empty());
    let for_a_person =
        [("turn_s", "index to index, captured at 90 MHz, 0 before the first whole turn"), ("gyro_rad_s", "ISM330DHCX, its own low-pass")];
    assert!(noted(&for_a_person).warnings().is_empty());
}

#[test]
fn quantization_step_is_read_from_notes() {
    let log = |notes: &[(&str, &str)]| {
        let mut log = noted(notes);
        log.columns.push(Column { name: "theta_rad".to_owned(), values: vec![0.0, 1.0, 2.0] });
        log
    };
    let close = |lsb: Option<f64>, expected: f64| assert!((lsb.unwrap() / expected - 1.0).abs() < 1e-12, "{lsb:?} {expected}");
    for key in ["theta_lsb_rad", "theta_rad_lsb", "theta_lsb", "lsb_theta_rad", "lsb_theta"] {
        close(log(&[(key, "3.1e-4")]).quantization_step("theta_rad"), 3.1e-4);
    }
    close(log(&[("theta_lsb_deg", "0.1")]).quantization_step("theta_rad"), 0.1_f64.to_radians());
    close(log(&[("encoder", "8192 counts per turn")]).quantization_step("theta_rad"), std::f64::consts::TAU / 8192.0);
    let counted = log(&[("encoder", "0.1286 deg per count, rate by counts per 20 ms")]);
    close(counted.quantization_step("theta_rad"), 0.1286_f64.to_radians());
    close(counted.quantization_step("omega_rad_s"), 6.43_f64.to_radians());
    assert_eq!(log(&[]).quantization_step("theta_rad"), None);
}

#[test]
fn quantization_step_is_found_in_quantized_values_only() {
    let noise = |k: usize| ((k as f64 * 12.9898).sin() * 43758.5453).fract();
    let turning: Vec<f64> = (0..20_000).map(|k| 0.02 * k as f64 + (k as f64 * 0.003).sin()).collect();
    let lsb = 3.14159e-4;
    let on_grid = |v: &[f64], lsb: f64| v.iter().map(|x| (x / lsb).round() * lsb).collect::<Vec<_>>();
    let near = |found: Option<f64>, lsb: f64| assert!((found.unwrap() / lsb - 1.0).abs() < 1e-4, "{found:?} {lsb}");
    near(quantization::step(&on_grid(&turning, lsb)), lsb);
    let current: Vec<f64> = (0..20_000).map(|k| 0.3 * (k as f64 * 0.01).sin() + 0.004 * noise(k)).collect();
    near(quantization::step(&on_grid(&current, 8e-4)), 8e-4);
    // As text with six digits, and in single precision.
    let rounded: Vec<f64> = on_grid(&current, 8.123e-4).iter().map(|x| (x * 1e6).round() / 1e6).collect();
    near(quantization::step(&rounded), 8.123e-4);
    let single: Vec<f64> = on_grid(&current, 8.123e-4).iter().map(|&x| f64::from(x as f32)).collect();
    near(quantization::step(&single), 8.123e-4);
    assert_eq!(quantization::step(&turning), None);
    assert_eq!(quantization::step(&current), None);
    let single: Vec<f64> = current.iter().map(|&x| f64::from(x as f32)).collect();
    assert_eq!(quantization::step(&single), None);
    let steps: Vec<f64> = (0..1000).map(|k| [0.0, 6.0, -6.0][k / 100 % 3]).collect();
    assert_eq!(quantization::step(&steps), None);
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn logs_of_other_stands_are_read() {
    let folder = stand_data();
    let read = |name: &str| Log::read(folder.join(name)).unwrap();
    let emps = read("emps_pulses.csv");
    assert_eq!(emps.ignored(), ["pulse_flag"]);
    assert_eq!(emps.segments().len(), 1);
    assert!(read("emps_train.csv").ignored().is_empty());
    let motor = read("dcmotor_un_prbs.csv");
    let quantum = motor.quantization_step("omega_rad_s").unwrap();
    assert!((quantum / 6.43_f64.to_radians() - 1.0).abs() < 1e-3, "{quantum}");
    assert!((quantization::step(motor.column("omega_rad_s").unwrap()).unwrap() / quantum - 1.0).abs() < 1e-3);
    let odrive = read("odrive_slow_run.csv");
    assert!((odrive.median_dt_s() - 0.0026).abs() < 5e-4);
    for log in [&emps, &motor, &odrive] {
        assert!(log.warnings().is_empty(), "{:?}", log.warnings());
    }
    let message = Log::read(folder.join("odrive_cogging_map.csv")).unwrap_err().to_string();
    assert!(message.contains("there is no column t_s"), "{message}");
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn logs_of_another_simulator_have_their_quantization_step() {
    let folder = stand_data();
    let mut cases = 0;
    for case in std::fs::read_dir(folder.join("cases")).unwrap().map(|e| e.unwrap().path()).filter(|p| p.is_dir()) {
        let log = Log::read(case.join("log.parquet")).unwrap();
        assert!(log.len() >= 30_000 && log.warnings().is_empty(), "{case:?} {:?}", log.warnings());
        assert_eq!(log.voltage(), VoltageSource::Terminals);
        assert_eq!(log.note("pandas"), None);
        let lsb = log.quantization_step("theta_rad").unwrap();
        assert!((lsb / 0.0003141592653589793 - 1.0).abs() < 1e-6, "{case:?} {lsb}");
        assert_eq!(log.quantization_step("omega_rad_s"), None, "{case:?}");
        cases += 1;
    }
    assert_eq!(cases, 31);
}

#[test]
#[ignore = "needs python3 with pandas and pyarrow"]
fn files_are_compatible_with_pandas_and_pyarrow() {
    let python = |code: &str, args: &[&std::path::Path]| std::process::Command::new("python3").arg("-c").arg(code).args(args).output();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.parquet");
    let log = sample();
    log.write(&path).unwrap();
    let code = "import sys, pandas as pd, pyarrow.parquet as pq\n\
        f = pd.read_parquet(sys.argv[1]); t = pq.read_table(sys.argv[1])\n\
        assert list(f.columns) == ['t_s', 'u_V', 'omega_rad_s'] and t.num_rows == 3\n\
        assert t.schema.metadata[b'stand'] == 'no. 3: blue'.encode()\n\
        for codec in ['snappy', 'gzip', 'lz4', 'zstd', 'none']:\n\
        \x20   f.to_parquet(f'{sys.argv[2]}/{codec}.parquet', compression=None if codec == 'none' else codec)\n\
        f.astype({'u_V': 'float32'}).assign(i_A=pd.array([1, None, 3], dtype='Int32')).to_parquet(f'{sys.argv[2]}/null.parquet')\n\
        f.assign(i_A=['a', 'b', 'c']).to_parquet(f'{sys.argv[2]}/text.parquet')\n\
        f.assign(t_s=pd.to_datetime(f.t_s, unit='s')).to_parquet(f'{sys.argv[2]}/date.parquet')\n\
        f.assign(i_A=[1, 2, 3], label=['a', 'b', 'c']).to_parquet(f'{sys.argv[2]}/whole.parquet')\n";
    let output = python(code, &[&path, folder.path()]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for codec in ["snappy", "gzip", "lz4", "zstd", "none"] {
        let back = Log::read(folder.path().join(format!("{codec}.parquet"))).unwrap();
        assert!(back.notes().is_empty());
        assert_eq!(back.columns(), log.columns());
    }
    let message = |name: &str| Log::read(folder.path().join(name)).unwrap_err().to_string();
    assert!(
        message("null.parquet").ends_with("null.parquet: row 2, column i_A: the value is missing (null)"),
        "{}",
        message("null.parquet")
    );
    assert!(message("text.parquet").ends_with("column i_A: the column contains text or bytes, not numbers"), "{}", message("text.parquet"));
    assert!(message("date.parquet").contains("column t_s: the column contains dates"), "{}", message("date.parquet"));
    let whole = Log::read(folder.path().join("whole.parquet")).unwrap();
    assert_eq!((whole.column("i_A"), whole.ignored()), (Some(&[1.0, 2.0, 3.0][..]), &["label".to_owned()][..]));
}

proptest! {
    #[test]
    fn readers_do_not_panic_on_any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..300), cut in 0usize..2000, flip in any::<u8>()) {
        let (_a, path) = file("a.csv", &bytes);
        let _ = Log::read(&path);
        let (_b, path) = file("a.parquet", &bytes);
        let _ = Log::read(&path);
        // A valid Parquet file with one byte changed.
        sample().write(&path).unwrap();
        let mut real = std::fs::read(&path).unwrap();
        let at = cut % real.len();
        real[at] ^= flip;
        std::fs::write(&path, real).unwrap();
        let _ = Log::read(&path);
    }

    #[test]
    fn csv_reader_does_not_panic_on_any_text(text in "(# ?[a-z_]{0,9}:? ?[ -~]{0,20}\n)?(t_s,[a-zA-Z_,;]{0,12})?\n?([-0-9.,;eENna#\"\r\n]{0,80})") {
        if let Err(message) = csv(text.replacen("t_s,", "t_s,u_V,i_A\n", 1)) {
            prop_assert!(!message.is_empty());
        }
        let _ = csv(text);
    }

    #[test]
    fn all_finite_numbers_round_trip(values in proptest::collection::vec(proptest::num::f64::NORMAL | proptest::num::f64::SUBNORMAL | proptest::num::f64::ZERO, 1..40), key in "[a-z]{1,8}", note in "[!-~]([ -~]{0,20}[!-~])?") {
        let t_s = Column { name: "t_s".to_owned(), values: (0..values.len()).map(|k| k as f64 * 1e-3).collect() };
        let log = Log::new("any", vec![t_s, Column { name: "i_A".to_owned(), values }], vec![(key, note)]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.csv", "a.parquet"] {
            let path = folder.path().join(name);
            log.write(&path).unwrap();
            same(&log, &Log::read(&path).unwrap());
        }
    }
}

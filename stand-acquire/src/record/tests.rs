//! Tests of the recorder.

use super::*;
use identification::log::Log;
use stand_firmware::board::{TICKS_PER_ROW, TICKS_PER_S, Ticks};
use stand_firmware::measurement_loop::Row;
use stand_firmware::telemetry::Channels;

fn row(k: u32, has_command: bool) -> RowFrame {
    let row = Row {
        sequence: k,
        at: Ticks(5 * TICKS_PER_S + u64::from(k) * TICKS_PER_ROW),
        t_s: 5.0 + f64::from(k) * 1e-3,
        u_V: 0.25,
        i_A: Some(0.5),
        theta_rad: f64::from(k) * 0.01,
        rate_cmd_rad_s: has_command.then_some(10.0),
        ..Row::default()
    };
    let channels = ["u_V", "i_A", "theta_rad", "omega_rad_s", "rate_cmd_rad_s", "limits", "fault"];
    RowFrame::new(&row, channels.iter().fold(Channels::default(), |all, name| all.and(Channels::named(name).unwrap())))
}

#[test]
fn log_starts_when_every_column_has_a_value() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let out = std::fs::File::create(&path).unwrap();
    let first = row(0, false);
    let mut recorder = Recorder::new(out, first.channels, Notes::from_iter([Note::Profile("sine".to_owned())]));
    // The rate sensor has no values; the setpoint starts at row 40.
    let taken: Vec<RowOutcome> = (0..200).map(|k| recorder.take(&row(k, k >= 40 && k != 150)).unwrap()).collect();
    assert_eq!(taken.iter().filter(|t| **t == RowOutcome::NotYet).count(), 99, "rows before the column without values is left out");
    assert_eq!(recorder.absent(), ["omega_rad_s"]);
    assert_eq!(taken[150], RowOutcome::LeftOut);
    recorder.finish(&Notes::from_iter([Note::LostRows(0)])).unwrap();
    let log = Log::read(&path).unwrap();
    let names: Vec<&str> = log.columns().iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["t_s", "u_V", "i_A", "theta_rad", "rate_cmd_rad_s"]);
    assert_eq!(log.len(), 100);
    assert_eq!(log.t_s()[0], 0.0);
    assert!((log.t_s()[99] - 0.1).abs() < 1e-12, "{}", log.t_s()[99]);
    assert!((log.column("theta_rad").unwrap()[0] - 0.99).abs() < 1e-9);
    assert_eq!(log.segments().len(), 2, "the row left out is a gap");
    assert_eq!((log.note("profile"), log.note("lost_rows")), (Some("sine"), Some("0")));
}

#[test]
fn log_ends_before_the_row_of_a_fault() {
    let mut recorder = Recorder::new(Vec::new(), row(0, true).channels, Notes::default());
    let mut faulty = row(7, true);
    let bit = stand_firmware::telemetry::CHANNELS.iter().position(|c| c.name == "fault").unwrap();
    faulty.values[bit] = 3.0;
    assert_eq!(recorder.take(&faulty).unwrap(), RowOutcome::Fault(3));
    assert_eq!(recorder.rows(), 0);
    recorder.finish(&Notes::default()).unwrap();
}

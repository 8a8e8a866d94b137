//! Each fault acts where it should and nowhere else: on the bench alone, and in the record of a session.
#![allow(clippy::unwrap_used)]

use hal_sim::board::Bench;
use hal_sim::faults::{Fault, FaultKind, Faults};
use hal_sim::plant::{Plant, Stand, StandError};
use hal_sim::session::{self, Record, SessionRequest};
use stand_firmware::board::{Drive, EncoderCount, Hardware, Sensed, TickIo, Ticks};
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

/// Inputs of the interrupt during 0.3 s at about 10 rad/s with a fault from 0.1 to 0.2 s, and the index captures.
fn sensed(what: FaultKind) -> (Vec<Sensed>, Vec<EncoderCount>) {
    let stand = Stand::default();
    let mut plant = Plant::new(&stand, -0.5).unwrap();
    plant.spin(10.0);
    let faults = Faults::of([Fault::new(what, 0.1, 0.1)]).unwrap();
    let mut bench = Bench::new(&stand.hardware, &stand.sensors, 1, Box::new(plant)).with_faults(faults);
    let (mut all, mut captures) = (Vec::new(), Vec::new());
    // 0.24 V for 10 rad/s, and 0.09 V for 0.9 mN m of Coulomb friction.
    let duty = (0.35 / stand.hardware.volt_per_duty()) as i16;
    for n in 0..3000 {
        bench.advance(Ticks::of_control(n), |io| {
            all.push(io.sense());
            captures.extend(io.index());
            io.drive(Drive::Duty(duty));
        });
    }
    (all, captures)
}

/// Counts between two ticks.
fn passed(sensed: &[Sensed], from: usize, to: usize) -> i64 {
    sensed[from..=to].windows(2).map(|pair| i64::from(pair[1].encoder.since(pair[0].encoder))).sum()
}

#[test]
fn a_disconnected_encoder_wire_loses_the_counts() {
    for what in [FaultKind::EncoderAOff, FaultKind::EncoderBOff, FaultKind::CounterStuck] {
        let (all, _) = sensed(what);
        assert!(passed(&all, 0, 999) > 2500, "before: 10 rad/s are 3183 counts in 0.1 s");
        let during = passed(&all, 1001, 1999);
        assert!(during.abs() <= 2, "{what:?}: {during}");
        assert!(passed(&all, 2001, 2999) > 2500, "{what:?}: counts again");
    }
    let (stuck, _) = sensed(FaultKind::CounterStuck);
    assert!(passed(&stuck, 1999, 2000) > 2000, "a stuck counter shows all counts afterwards");
}

#[test]
fn without_its_wire_the_index_is_not_captured_and_the_current_reads_zero_codes() {
    let (_, captures) = sensed(FaultKind::LostTicks);
    assert_eq!(captures, [EncoderCount(1592)], "the platform starts half a radian before the index, with the counter at 0");
    let mut off = Faults::default();
    off.push(Fault::new(FaultKind::IndexOff, 0.0, 1.0)).unwrap();
    off.push(Fault::new(FaultKind::CurrentSensorOff, 0.0, 1.0)).unwrap();
    let stand = Stand::default();
    let mut plant = Plant::new(&stand, -0.5).unwrap();
    plant.spin(10.0);
    let mut bench = Bench::new(&stand.hardware, &stand.sensors, 1, Box::new(plant)).with_faults(off);
    let mut ticks = 0;
    bench.advance(Ticks::of_control(2000), |io| {
        assert_eq!(io.index(), None);
        let sensed = io.sense();
        assert!(sensed.tick == 0 || sensed.current.0 == 0);
        ticks += 1;
    });
    assert_eq!(ticks, 2001);
}

#[test]
fn lost_ticks_and_a_power_cut_skip_interrupts() {
    for what in [FaultKind::LostTicks, FaultKind::PowerCut] {
        let (all, _) = sensed(what);
        assert_eq!(all.len(), 2000, "{what:?}");
        let gap = all.windows(2).find(|pair| pair[1].tick != pair[0].tick + 1).map(|pair| (pair[0].tick, pair[1].tick));
        assert_eq!(gap, Some((999, 2000)));
    }
}

#[test]
fn supply_dip_and_noise_burst_act_in_their_interval() {
    let volts = |s: &Sensed| s.supply.volts(&Hardware::default());
    let (all, _) = sensed(FaultKind::SupplyDip);
    assert!((volts(&all[990]) - 12.0).abs() < 0.05);
    assert!((volts(&all[1500]) - 6.0).abs() < 0.05);
    assert!((volts(&all[2990]) - 12.0).abs() < 0.05);
    let (all, _) = sensed(FaultKind::NoiseBurst);
    let scatter = |range: std::ops::Range<usize>| {
        let codes: Vec<f64> = all[range].iter().map(|s| f64::from(s.current.0)).collect();
        let mean = codes.iter().sum::<f64>() / codes.len() as f64;
        (codes.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / codes.len() as f64).sqrt()
    };
    let ratio = scatter(1010..2000) / scatter(500..1000);
    // Thirty times the usual noise; before the burst the current settles.
    assert!((15.0..40.0).contains(&ratio), "{ratio}");
}

/// Two seconds at a constant rate with one fault from 1 s on.
fn record(fault: Option<Fault>) -> Record {
    let stand = Stand { faults: Faults::of(fault).unwrap(), ..Stand::default() };
    let request = SessionRequest::new(Mode::Rate, ProfileKind::Constant, 2.0, 1);
    session::run(stand.setup(), Plant::new(&stand, 0.0).unwrap(), request).unwrap()
}

#[test]
fn each_board_fault_changes_a_record_from_its_start_on() {
    let sound = record(None);
    // Those of the gyro: gyro_drift.rs; of the clock reference: clock_reference.rs.
    let is_elsewhere = |what: &FaultKind| what.affects_serial_line() || what.affects_gyroscope() || what.affects_clock_reference();
    let of_the_board = |what: &FaultKind| !is_elsewhere(what) && *what != FaultKind::IndexOff;
    for what in FaultKind::ALL.into_iter().filter(of_the_board) {
        let broken = record(Some(Fault::new(what, 1.0, f64::INFINITY)));
        let rows = broken.rows();
        assert!(rows < sound.rows() || broken.columns != sound.columns, "{what:?} changes nothing");
        assert!(rows >= 996, "{what:?}: rows before the fault are present, {rows}");
        for ((name, with), (_, without)) in broken.columns.iter().zip(&sound.columns) {
            // The session's row 0 is 1 ms after power-on.
            assert_eq!(with[..996], without[..996], "{what:?}: {name} before the fault");
        }
    }
}

#[test]
fn a_power_cut_ends_the_rows_with_a_note() {
    let cut = record(Some(Fault::new(FaultKind::PowerCut, 1.0, 1.0)));
    assert_eq!(cut.rows(), 999, "row k ends k + 2 ms after power-on");
    assert_eq!(cut.note("fault"), Some("power-cut at 0.9990 s; the rows end there"));
}

#[test]
fn a_stand_file_lists_faults_and_an_invalid_one_is_refused_with_its_index() {
    let stand = Stand::parse("[[faults]]\nwhat = \"winding-hot\"\nfrom_s = 1\n").unwrap();
    assert_eq!(stand.faults.iter().next().map(Fault::magnitude), Some(160.0));
    let refused = |text: &str| match Stand::parse(text) {
        Err(error @ (StandError::Toml(_) | StandError::Fault(_))) => error.to_string(),
        other => panic!("{other:?}"),
    };
    assert!(refused("[[faults]]\nwhat = \"wire\"\n").starts_with("line 2: unknown variant `wire`"));
    assert!(refused("[[faults]]\nwhat = \"index-off\"\nfrom = 1\n").contains("unknown field `from`"));
    assert!(refused("[[faults]]\nwhat = \"index-off\"\nfor_s = -1\n").starts_with("faults[0].for_s = -1"));
}

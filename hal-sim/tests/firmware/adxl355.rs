//! The ADXL355 as sensor under test: recognised by the firmware, at register level in the simulator, through the same rows as the
//! ISM330DHCX.
#![allow(clippy::unwrap_used)]

use crate::common::sensor_bench;
use embedded_hal_async::spi::{MODE_0, MODE_3, Operation, SpiDevice};
use hal_sim::board::{Bench, SimBoard};
use hal_sim::clock::{self, SimClock, VirtualClock};
use hal_sim::peripherals::SensorSetup;
use hal_sim::peripherals::imu::{Fault, ImuSetup, Part};
use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{self, Record, SessionRequest};
use sensor_bench::{STILL, Turning, run};
use stand_firmware::board::{Board, Clock, Hardware, SensorSpi, TICKS_PER_S, TickIo, Ticks};
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::sensors::{Adxl355, DetectedSensor, Sample, Sensor, SensorError, Setup, State};
use stand_firmware::speed_loop::Mode;
use std::cell::RefCell;

const G_M_S2: f64 = 9.806_65;

fn adxl355() -> ImuSetup {
    ImuSetup { part: Part::Adxl355, ..ImuSetup::default() }
}

/// Runs `story` with the bus of a stand that carries this sensor.
fn on_the_bus<F: Future<Output = ()>>(setup: ImuSetup, story: impl FnOnce(hal_sim::board::SensorBus<'static>, SimClock<'static>) -> F) {
    // The bus borrows bench and clock: they live until the end of the test program.
    let clock: &'static VirtualClock = Box::leak(Box::default());
    let bench = Bench::new(&Hardware::default(), &SensorSetup::default(), 1, Box::new(STILL)).with_imu(setup, 1);
    let bench: &'static RefCell<_> = Box::leak(Box::new(RefCell::new(bench)));
    let line = SimBoard::new(bench, clock).sensor_bus().unwrap();
    clock::run(clock, story(line, SimClock(clock)), |to| bench.borrow_mut().advance(to, |io| _ = io.sense())).unwrap();
}

#[test]
fn the_part_is_recognised_and_its_samples_are_late_by_the_group_delay() {
    let setup = ImuSetup { clock_error: 4e-3, accel_noise_m_s2_rtHz: Some(0.0), ..adxl355() }.white();
    let mut seen = Vec::new();
    let status = run(Turning { t_s: 0.0, from_rad_s: 0.0, acceleration_rad_s2: 5.0 }, setup, 5.0, |ms, shared, _| {
        seen.extend(shared.newest().map(|newest| (newest, newest.age(Ticks(ms * 10_000)))));
    });
    assert_eq!((status.name, status.state, status.lost, status.refused, status.errors), ("ADXL355", State::Running, 0, 0, 0));
    let in_force = status.in_force.unwrap();
    assert_eq!((in_force.setup.data_rate_Hz, in_force.accel_cutoff_Hz), (2000.0, 500.0));
    assert!(in_force.setup.rate_range_rad_s.is_nan() && in_force.rate_cutoff_Hz.is_nan(), "no gyro");
    assert!((f64::from(status.samples) / (5.0 * 2000.0 * 1.004) - 1.0).abs() < 5e-3, "{}", status.samples);
    assert!((status.relative_frequency - 1.004).abs() < 5e-5, "{}", status.relative_frequency);
    // The data sheet: 2.00 intervals at 2000 Hz. The observation of a sample errs by a poll of the bus, some 20 µs.
    let delay_s = 2.00 / 2000.0 / 1.004;
    assert!(seen.len() > 4000);
    for (newest, age) in &seen[300..] {
        assert!((500..30_000).contains(age), "{age}");
        let rate = 5.0 * (newest.at.seconds() - delay_s);
        let (outward, along) = (-rate * rate * 0.05, 5.0 * 0.05);
        let slope = 2.0 * 5.0 * rate * 0.05;
        assert_eq!(newest.value.rate_rad_s, None);
        assert!((f64::from(newest.value.outward_m_s2) - outward).abs() < 2e-4 + slope * 60e-6, "{newest:?} {outward}");
        assert!((f64::from(newest.value.along_m_s2) - along).abs() < 2e-4, "{newest:?}");
    }
}

fn record(stand: &str, profile: ProfileKind, rate_rad_s: f64) -> Record {
    let stand = Stand::parse(stand).unwrap();
    let mode = if rate_rad_s == 0.0 { Mode::Voltage } else { Mode::Rate };
    let request = SessionRequest { mode, profile: ProfileConfig::new(profile, rate_rad_s, 1), seconds: 4.0, seed: 1 };
    session::run(stand.setup(), Plant::new(&stand, 0.0).unwrap(), request).unwrap()
}

/// Mean of the last two seconds.
fn mean(values: &[f64]) -> f64 {
    values[2000..].iter().sum::<f64>() / 2000.0
}

/// Three standard uncertainties of a mean over 2 s: 22.5 µg/√Hz over 2 √2 s, 0.664 × 10 µg and a quarter of a code.
const UNCERTAINTY_M_S2: f64 = 3.0 * (22.5e-6 / 2.0 + 6.64e-6 + 2e-6) * G_M_S2;

#[test]
fn a_tilted_stand_at_rest_records_the_component_of_gravity() {
    let record = record("[imu]\npart = \"adxl355\"\ntilt_rad = 0.1\nchi_rad = 0.5\n", ProfileKind::Constant, 0.0);
    assert!(record.column("gyro_rad_s").is_none() && record.note("gyro_rad_s").is_none(), "the part has no gyro");
    assert!(
        record.note("accel_x_m_s2").unwrap().starts_with("ADXL355, accelerometer, filter 500 Hz, ±4 g"),
        "{:?}",
        record.note("accel_x_m_s2")
    );
    let lean = G_M_S2 * 0.1_f64.sin();
    for (name, expected) in [("accel_x_m_s2", lean * 0.5_f64.cos()), ("accel_y_m_s2", -lean * 0.5_f64.sin())] {
        let found = mean(record.column(name).unwrap());
        assert!((found - expected).abs() < UNCERTAINTY_M_S2, "{name}: {found} {expected} ± {UNCERTAINTY_M_S2}");
    }
}

#[test]
fn a_turning_stand_records_the_centripetal_acceleration() {
    let record = record("[imu]\npart = \"adxl355\"\nradius_m = 0.04\n", ProfileKind::Constant, 10.0);
    let squares: Vec<f64> = record.true_omega_rad_s.iter().map(|rate| rate * rate).collect();
    let (found, expected) = (mean(record.column("accel_x_m_s2").unwrap()), -0.04 * mean(&squares));
    assert!((found - expected).abs() < UNCERTAINTY_M_S2, "{found} {expected} ± {UNCERTAINTY_M_S2}");
}

#[test]
fn noise_has_the_density_of_the_data_sheet() {
    let record = record("[imu]\npart = \"adxl355\"\n", ProfileKind::Constant, 0.0);
    let values = &record.column("accel_y_m_s2").unwrap()[1000..];
    // Neighbouring rows are independent samples of 2000 Hz: differences do not contain the slow noise.
    let variance = values.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / (2 * (values.len() - 1)) as f64;
    let expected = 22.5e-6 * G_M_S2 * 1000_f64.sqrt();
    assert!((variance.sqrt() / expected - 1.0).abs() < 0.05, "{} {expected}", variance.sqrt());
}

#[test]
fn the_self_test_and_the_temperature_are_those_of_the_data_sheet() {
    let mut answers = Vec::new();
    let status = run(STILL, adxl355(), 3.0, |ms, shared, _| {
        if ms == 100 {
            shared.request_self_test();
        }
        answers.extend(shared.self_test_result().filter(|_| answers.is_empty()));
    });
    let test = answers.first().unwrap().unwrap();
    let expected = [0.3, 0.3, 1.5].map(|g| g * G_M_S2);
    assert!(test.passed && test.accel_m_s2.iter().zip(expected).all(|(a, b)| (f64::from(*a) - b).abs() < 0.02), "{test:?}");
    assert_eq!((status.state, status.errors), (State::Running, 0));
    assert!((status.temperature_C.unwrap() - 26.5).abs() < 0.06, "{status:?}");
}

#[test]
fn a_failing_part_is_reported_and_recognised_again() {
    let (mut errors, mut states) = (Vec::new(), Vec::new());
    let status = run(STILL, adxl355(), 4.0, |ms, shared, bench| {
        let fault = match ms {
            500..1500 => Fault::Silent(0xFF),
            2500..2700 => Fault::Stuck,
            _ => Fault::None,
        };
        bench.imu().unwrap().chip.set_fault(fault);
        states.push(shared.status().state);
        errors.extend(shared.status().last_error);
        errors.dedup();
    });
    assert!(matches!(errors[0], SensorError::InvalidData(_) | SensorError::Silent), "{errors:?}");
    assert!(
        errors.contains(&SensorError::Absent { who_am_i: 0xFF, expected: 0x6B }) && errors.contains(&SensorError::Silent),
        "{errors:?}"
    );
    assert!(matches!(states[1400], State::Failed(_)) && states[2400] == State::Running);
    assert_eq!((status.state, status.name), (State::Running, "ADXL355"));
}

#[test]
fn another_part_is_refused() {
    let mut errors = Vec::new();
    let status = run(STILL, adxl355(), 3.0, |_, shared, bench| {
        bench.imu().unwrap().chip.set_fault(Fault::Named(0x12));
        errors.extend(shared.status().last_error);
        errors.dedup();
    });
    // The running driver checks the identity each second; then neither part is found.
    assert_eq!(errors[0], SensorError::WrongChip { who_am_i: 0x12, expected: 0xAD });
    let State::Failed(error) = status.state else { panic!("{status:?}") };
    assert!(matches!(error, SensorError::WrongChip { expected: 0x6B, .. }) && error.to_string().contains("another part"), "{error}");
}

#[test]
fn an_answer_in_the_wrong_spi_mode_is_not_recognised() {
    on_the_bus(adxl355(), |mut line, _| async move {
        for (mode, recognised) in [(MODE_0, true), (MODE_3, false)] {
            line.set_mode(mode).unwrap();
            let mut name = [0];
            line.transaction(&mut [Operation::Write(&[0x01]), Operation::Read(&mut name)]).await.unwrap();
            assert_eq!(name == [0xAD], recognised, "{mode:?}: {name:?}");
        }
    });
}

#[test]
fn the_probe_for_the_other_part_changes_nothing() {
    on_the_bus(ImuSetup::default(), |line, clock| async move {
        let mut sensor = DetectedSensor::new(line, clock);
        assert!(sensor.detect().await.is_ok());
        assert_eq!(sensor.name(), "ISM330DHCX");
    });
    on_the_bus(ImuSetup::default(), |mut line, _| async move {
        // The bytes of `Adxl355::identify`: a read of DEVID_AD, which the ISM330DHCX takes as a write of 0 to register 0x01.
        let before = registers(&mut line).await;
        line.set_mode(MODE_0).unwrap();
        line.transaction(&mut [Operation::TransferInPlace(&mut [0x01, 0x00])]).await.unwrap();
        assert_eq!(registers(&mut line).await, before);
    });
}

/// Registers 0x01 to 0x1E of an ISM330DHCX.
async fn registers(line: &mut hal_sim::board::SensorBus<'static>) -> [u8; 30] {
    let mut read = [0; 30];
    line.set_mode(MODE_3).unwrap();
    line.transaction(&mut [Operation::Write(&[0x81]), Operation::Read(&mut read)]).await.unwrap();
    read
}

#[test]
fn a_fifo_overrun_reports_the_lost_samples_and_keeps_the_count() {
    on_the_bus(adxl355(), |line, clock| async move {
        let later = clock;
        let mut chip = Adxl355::new(line, clock);
        chip.identify().await.unwrap();
        chip.configure(&Setup::default()).await.unwrap();
        let first = chip.stamp().await.unwrap();
        later.until(Ticks(first.at.0 + TICKS_PER_S)).await;
        let mut samples = [Sample::default(); 100];
        let drained = chip.drain(&mut samples).await.unwrap();
        // 96 entries are 32 samples, and some come while the FIFO is read.
        assert!((32..36).contains(&drained.samples) && drained.refused == 0, "{drained:?}");
        assert!((1960..1980).contains(&drained.lost), "{drained:?}");
        // One second later the number is higher by 2000 and the error of the oscillator, 4e-4.
        let newest = samples[drained.samples - 1].stamp.wrapping_sub(first.value);
        assert!((1998..2004).contains(&newest), "{newest}");
        let steps = samples[..drained.samples].windows(2).all(|w| w[1].stamp == w[0].stamp + 1);
        assert!(steps);
        let ready = chip.ready().await.unwrap();
        assert!(!ready.rate);
    });
}

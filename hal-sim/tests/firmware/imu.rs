//! The sensor under test: the firmware's driver and task on the registers of the chip, and their errors when the chip fails.
#![allow(clippy::unwrap_used)]

use crate::common::sensor_bench;
use embassy_futures::select::select;
use hal_sim::board::{Bench, SimBoard};
use hal_sim::clock::{self, SimClock, VirtualClock};
use hal_sim::peripherals::SensorSetup;
use hal_sim::peripherals::imu::{Fault, ImuSetup};
use sensor_bench::{STILL, Turning, run};
use stand_firmware::board::{Board, Clock, Hardware, Stamped, TICKS_PER_S, TickIo, Ticks};
use stand_firmware::sensors::{
    Drained, InForce, Ism330dhcx, Motion, Ready, Runner, Sample, SelfTest, Sensor, SensorError, Setup, Shared, State,
};
use std::cell::RefCell;

#[test]
fn samples_have_rate_and_forces_of_their_sampling_time_on_the_board_clock() {
    let setup = ImuSetup { chi_rad: 2_f64.to_radians(), clock_error: 4e-4, clock_trim: -7, ..ImuSetup::ideal() };
    let mut seen = Vec::new();
    let status = run(Turning { t_s: 0.0, from_rad_s: 0.0, acceleration_rad_s2: 5.0 }, setup, 5.0, |ms, shared, _| {
        if let Some(newest) = shared.newest() {
            seen.push((newest, newest.age(Ticks(ms * 10_000))));
        }
    });
    assert_eq!((status.state, status.lost, status.refused, status.errors), (State::Running, 0, 0, 0));
    assert_eq!(status.name, "ISM330DHCX");
    assert_eq!(status.in_force.unwrap().setup.data_rate_Hz, 1667.0);
    // 6667 / 4 Hz by an oscillator that is 1.05 % slow and 0.04 % fast, for five seconds.
    let pace = (1.0 - 7.0 * 0.0015) * (1.0 + 4e-4);
    assert!((f64::from(status.samples) / (5.0 * 6667.0 / 4.0 * pace) - 1.0).abs() < 3e-3, "{}", status.samples);
    assert!((status.relative_frequency - (1.0 + 4e-4)).abs() < 3e-5, "{}", status.relative_frequency);
    let rate_delay_s = 1.0 / (std::f64::consts::TAU * 304.2);
    let force_delay_s = 1.0 / (std::f64::consts::TAU * 166.7);
    // During the first 0.25 s, before the clock rate of the chip is known, the error is 0.04 % of the time.
    for (newest, age) in &seen[300..] {
        // The reading starts 0.2 ms before the millisecond and takes about 60 µs; a sample each 0.6 ms.
        assert!((1_000..8_500).contains(age), "{age}");
        let t = newest.at.seconds();
        let Motion { rate_rad_s, outward_m_s2, along_m_s2 } = newest.value;
        let rate_rad_s = rate_rad_s.unwrap();
        // The time stamp has steps of 25 µs, its conversion to the board clock adds another; the code is 1.2 mrad/s.
        assert!((f64::from(rate_rad_s) - 5.0 * (t - rate_delay_s)).abs() < 1.2e-3 + 5.0 * 80e-6, "{t}: {rate_rad_s}");
        let (rate, chi) = (5.0 * (t - force_delay_s), 2_f64.to_radians());
        let (x, y) = (-rate * rate * 0.05, 5.0 * 0.05);
        let near = |seen: f32, expected: f64| (f64::from(seen) - expected).abs() < 1.2e-3 + 10.0 * rate * 0.05 * 1e-4;
        assert!(near(outward_m_s2, x * chi.cos() + y * chi.sin()), "{t}: {outward_m_s2} {x}");
        assert!(near(along_m_s2, y * chi.cos() - x * chi.sin()), "{t}: {along_m_s2} {y}");
    }
    println!("longest reading of the FIFO {:.1} µs", status.longest_read_s * 1e6);
    // Two bytes of state, and at most twelve words at 0.8 µs a byte: a tenth of a row, and the others run meanwhile.
    assert!(status.longest_read_s < 200e-6, "{}", status.longest_read_s);
}

#[test]
fn the_accelerometer_matches_the_example_of_the_theory() {
    // docs/theory.md §4: r = 0.05 m, χ = 2°, ω = 10, ω' = 5: −4.988229261 and 0.424345190 m/s². The filter settles within 0.1 s.
    let setup = ImuSetup { chi_rad: 2_f64.to_radians(), ..ImuSetup::ideal() };
    let delay_s = 1.0 / (std::f64::consts::TAU * 166.7);
    let mut at_ten = None;
    run(Turning { t_s: 0.0, from_rad_s: 9.0, acceleration_rad_s2: 5.0 }, setup, 0.4, |_, shared, _| {
        if let Some(newest) = shared.newest().filter(|n| 9.0 + 5.0 * (n.at.seconds() - delay_s) < 10.0) {
            at_ten = Some(newest.value);
        }
    });
    let motion = at_ten.unwrap();
    assert!((f64::from(motion.outward_m_s2) + 4.988).abs() < 8e-3 && (f64::from(motion.along_m_s2) - 0.4243).abs() < 2e-3, "{motion:?}");
}

#[test]
fn noise_matches_the_data_sheet_and_a_temperature_is_reported() {
    let mut rates = Vec::new();
    let status =
        run(STILL, ImuSetup::default(), 4.0, |_, shared, _| rates.extend(shared.newest().and_then(|n| n.value.rate_rad_s).map(f64::from)));
    let mean = rates.iter().sum::<f64>() / rates.len() as f64;
    let sigma = (rates.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / rates.len() as f64).sqrt();
    // 5 mdps/√Hz through 304 Hz of first order, and a code of 70 mdps.
    let expected = (0.005_f64 * (std::f64::consts::FRAC_PI_2 * 304.2).sqrt()).hypot(0.07 / 12_f64.sqrt());
    assert!((sigma.to_degrees() / expected - 1.0).abs() < 0.06, "{} {expected}", sigma.to_degrees());
    assert!((status.temperature_C.unwrap() - 26.5).abs() < 0.01, "{status:?}");
}

#[test]
fn the_self_test_response_matches_the_data_sheet_and_sampling_resumes() {
    let mut answers = Vec::new();
    let status = run(STILL, ImuSetup::default(), 3.0, |ms, shared, _| {
        if ms == 100 {
            shared.request_self_test();
        }
        answers.extend(shared.self_test_result().filter(|_| answers.is_empty()));
    });
    let test = answers.first().unwrap().unwrap();
    assert!(test.passed, "{test:?}");
    assert!(
        test.rate_rad_s.iter().all(|r| (r.to_degrees() - 400.0).abs() < 1.0) && test.accel_m_s2.iter().all(|a| (a - 3.92).abs() < 0.05)
    );
    assert_eq!((status.state, status.errors), (State::Running, 0));
}

#[test]
fn a_changed_setup_is_read_back_with_sufficient_range() {
    let mut asked = false;
    let wanted = Setup { data_rate_Hz: 500.0, rate_range_rad_s: 300_f32.to_radians(), accel_range_m_s2: 60.0 };
    let status = run(Turning { t_s: 0.0, from_rad_s: 8.0, acceleration_rad_s2: 0.0 }, ImuSetup::ideal(), 1.0, |ms, shared, _| {
        if ms == 100 {
            shared.request_setup(wanted);
            asked = true;
        }
        if ms > 200 {
            assert!((shared.newest().unwrap().value.rate_rad_s.unwrap() - 8.0).abs() < 4e-4, "the code is finer now");
        }
    });
    let setup = status.in_force.unwrap().setup;
    assert!(asked && setup.data_rate_Hz == 833.0 && (setup.rate_range_rad_s.to_degrees() - 500.0).abs() < 1e-3, "{setup:?}");
    assert!((setup.accel_range_m_s2 / 9.80665 - 8.0).abs() < 1e-3);
}

#[test]
fn an_absent_wrong_stuck_or_disturbed_chip_is_reported_and_recovers() {
    type Fails = fn(SensorError) -> bool;
    let faults: [(Fault, Fails, &str); 6] = [
        (Fault::Silent(0x00), |t| matches!(t, SensorError::Absent { who_am_i: 0, .. } | SensorError::Silent), "no sensor, or no power"),
        (
            Fault::Silent(0xFF),
            |t| matches!(t, SensorError::Absent { who_am_i: 0xFF, .. } | SensorError::InvalidData(_)),
            "no sensor, or no power",
        ),
        (Fault::Named(0x6C), |t| matches!(t, SensorError::WrongChip { who_am_i: 0x6C, expected: 0x6B }), "0x6c instead of 0x6b"),
        (Fault::Stuck, |t| matches!(t, SensorError::Silent), "gives no samples"),
        (Fault::FlippedBits(2), |_| true, ""),
        (Fault::FlippedBits(20), |_| true, ""),
    ];
    for (fault, fails, message) in faults {
        // From the start, and in the middle.
        for from in [0, 700] {
            let mut errors = Vec::new();
            let status = run(STILL, ImuSetup::default(), 4.0, |ms, shared, bench| {
                let chip = &mut bench.imu().unwrap().chip;
                chip.set_fault(if (from..2500).contains(&ms) { fault } else { Fault::None });
                if let State::Failed(trouble) = shared.status().state
                    && ms < 2500
                {
                    assert!(shared.newest().is_none(), "no old sample without a fresh one");
                    errors.push(trouble);
                }
            });
            assert!(!errors.is_empty() && errors.iter().all(|t| fails(*t)), "{fault:?} from {from}: {errors:?}");
            assert!(errors.last().unwrap().to_string().contains(message), "{fault:?}: {}", errors.last().unwrap());
            assert_eq!(status.state, State::Running, "{fault:?} from {from}: recovered");
        }
    }
}

#[test]
fn an_occasional_flipped_bit_is_refused_and_sampling_continues() {
    let status = run(STILL, ImuSetup::default(), 3.0, |_, _, bench| bench.imu().unwrap().chip.set_fault(Fault::FlippedBits(20_000)));
    // 21 bytes a moment of which three are tags: most flips hit data, which nothing protects.
    assert!(status.refused > 0 && status.samples > 1500, "{status:?}");
}

#[test]
fn a_fifo_overrun_reports_the_lost_samples() {
    use embedded_hal_async::spi::{Operation, SpiDevice};
    let clock = VirtualClock::default();
    let bench = RefCell::new(Bench::new(&Hardware::default(), &SensorSetup::default(), 1, Box::new(STILL)).with_imu(ImuSetup::ideal(), 1));
    let mut board = SimBoard::new(&bench, &clock);
    let mut line = board.sensor_bus().unwrap();
    let story = async {
        let mut name = [0];
        line.transaction(&mut [Operation::Write(&[0x8F]), Operation::Read(&mut name)]).await.unwrap();
        assert_eq!(name, [0x6B]);
        let mut chip = Ism330dhcx::new(line, SimClock(&clock));
        chip.configure(&Setup::default()).await.unwrap();
        SimClock(&clock).until(Ticks(TICKS_PER_S)).await;
        let mut samples = [Sample::default(); 300];
        let drained = chip.drain(&mut samples).await.unwrap();
        // 512 words, three to a moment, and some that come while it is read; the oldest moment lost some of its words.
        assert!((170..180).contains(&drained.samples) && drained.lost >= 1 && drained.refused == 0, "{drained:?}");
        let steps: Vec<u32> = samples[..170].windows(2).map(|w| w[1].stamp - w[0].stamp).collect();
        assert!(steps.iter().all(|s| (23..=25).contains(s)), "a sample each 600 µs is 24 steps: {steps:?}");
        let ready = chip.ready().await.unwrap();
        assert!(ready.rate && ready.accel && ready.temperature);
    };
    clock::run(&clock, story, |to| bench.borrow_mut().advance(to, |io| _ = io.sense())).unwrap();
}

/// Another sensor behind the trait: it delivers the true motion.
struct TrueMotion<'a> {
    bench: &'a RefCell<Bench>,
    last: u32,
}

impl TrueMotion<'_> {
    /// A sample; time in steps of 1 µs, from the angle at a constant rate.
    fn sample(&self) -> Sample {
        let bench = self.bench.borrow();
        let plant = bench.plant();
        let rate = plant.true_rate_rad_s();
        Sample {
            stamp: (plant.true_theta_rad() / rate * 1e6).round() as u32,
            rate_rad_s: Some([0.0, 0.0, rate as f32]),
            accel_m_s2: [(-rate * rate * 0.05) as f32, 0.0, 9.8],
        }
    }
}

impl Sensor for TrueMotion<'_> {
    fn name(&self) -> &'static str {
        "true-motion"
    }

    async fn identify(&mut self) -> Result<(), SensorError> {
        Ok(())
    }
    async fn configure(&mut self, wanted: &Setup) -> Result<InForce, SensorError> {
        Ok(InForce { setup: *wanted, rate_cutoff_Hz: 1e4, accel_cutoff_Hz: 1e4, stamp_s: 1e-6 })
    }
    async fn ready(&mut self) -> Result<Ready, SensorError> {
        Ok(Ready { rate: true, accel: true, temperature: true })
    }
    async fn drain(&mut self, samples: &mut [Sample]) -> Result<Drained, SensorError> {
        let sample = self.sample();
        let fresh = usize::from(std::mem::replace(&mut self.last, sample.stamp) != sample.stamp);
        samples[0] = sample;
        Ok(Drained { samples: fresh, ..Drained::default() })
    }
    async fn stamp(&mut self) -> Result<Stamped<u32>, SensorError> {
        let value = self.sample().stamp;
        Ok(Stamped { value, at: Ticks(u64::from(value) * TICKS_PER_S / 1_000_000) })
    }
    async fn temperature_C(&mut self) -> Result<f32, SensorError> {
        Ok(25.0)
    }
    async fn self_test(&mut self) -> Result<SelfTest, SensorError> {
        Ok(SelfTest { passed: true, ..SelfTest::default() })
    }
}

#[test]
fn a_second_sensor_implements_the_trait() {
    let clock = VirtualClock::default();
    let plant = Turning { t_s: 0.0, from_rad_s: 3.0, acceleration_rad_s2: 0.0 };
    let bench = RefCell::new(Bench::new(&Hardware::default(), &SensorSetup::default(), 1, Box::new(plant)));
    let shared = Shared::default();
    let mut runner = Runner::new(TrueMotion { bench: &bench, last: 0 }, SimClock(&clock), &shared);
    let until = SimClock(&clock);
    let watch = until.until(Ticks(TICKS_PER_S));
    clock::run(&clock, select(watch, runner.run()), |to| bench.borrow_mut().advance(to, |io| _ = io.sense())).unwrap();
    let (status, newest) = (shared.status(), shared.newest().unwrap());
    assert_eq!((status.name, status.state, status.errors), ("true-motion", State::Running, 0));
    assert!((newest.value.rate_rad_s.unwrap() - 3.0).abs() < 1e-6 && (newest.value.outward_m_s2 + 0.45).abs() < 1e-6);
    assert!(newest.age(Ticks(TICKS_PER_S)) < 3_000, "{newest:?}");
}

#[test]
fn a_stand_file_with_a_sensor_adds_its_columns_and_notes() {
    use hal_sim::plant::{Plant, Stand};
    use hal_sim::session::{self, SessionRequest};
    use stand_firmware::profile::{ProfileConfig, ProfileKind};
    use stand_firmware::speed_loop::Mode;
    let profile = ProfileConfig::new(ProfileKind::Constant, 10.0, 1);
    let request = SessionRequest { mode: Mode::Rate, profile, seconds: 3.0, seed: 1 };
    let record = |stand: &Stand| session::run(stand.setup(), Plant::new(stand, 0.0).unwrap(), request).unwrap();
    let with = Stand::parse("[imu]\nradius_m = 0.04\ngyro_scale = 1.01\n").unwrap();
    let (with, without) = (record(&with), record(&Stand::default()));
    for name in ["gyro_rad_s", "accel_x_m_s2", "accel_y_m_s2"] {
        assert!(with.column(name).is_some() && without.column(name).is_none(), "{name}");
        assert!(with.note(name).unwrap().starts_with("ISM330DHCX, "), "{:?}", with.note(name));
    }
    let mean = |name: &str| with.column(name).unwrap()[2000..].iter().sum::<f64>() / 1000.0;
    assert!((mean("gyro_rad_s") / 10.1 - 1.0).abs() < 1e-3, "{}", mean("gyro_rad_s"));
    assert!((mean("accel_x_m_s2") / -4.0 - 1.0).abs() < 5e-3, "{}", mean("accel_x_m_s2"));
    for record in [&with, &without] {
        let turns = record.column("turn_s").unwrap();
        assert!(turns[0] == 0.0 && (turns[2999] - std::f64::consts::TAU / 10.0).abs() < 1e-4, "{}", turns[2999]);
        assert!(record.note("turn_s").unwrap().contains("90 MHz"));
    }
    let wrong = Stand::parse("[imu]\nradius_m = -1.0\n").unwrap();
    let error = session::run(wrong.setup(), Plant::new(&wrong, 0.0).unwrap(), request).unwrap_err().to_string();
    assert!(error.contains("imu.radius_m"), "{error}");
}

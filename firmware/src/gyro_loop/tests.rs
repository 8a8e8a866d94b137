//! Test vectors of docs/theory.md §3.2 for the integrator, and the commutator on an ideal gyroscope.

use super::*;
use crate::board::{GyroSample, Hardware, Stamped, TICKS_PER_ROW, Ticks, TorquerStep};
use crate::status::Fault;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

const DEG_H: f64 = core::f64::consts::PI / 180.0 / 3600.0;
const ARCSEC: f64 = DEG_H;
const T_S: f64 = 5.0;
const W: f64 = 0.1 * core::f64::consts::PI / 180.0;
const OMEGA: f64 = 3.0 * DEG_H;
/// K_k = 50 V/rad, U0 = 0.02 V.
const START: f64 = 0.02 / 50.0;
/// Codes fine enough to make rounding negligible.
const FINE: f64 = 1e-11;

fn scales(rad_per_code: f64) -> Scales {
    let hardware = Hardware { angle_V_per_code: rad_per_code * 50.0, ..Hardware::default() };
    let settings = Settings { angle_gain_V_rad: 50.0, ..Settings::default() };
    Scales::new(&settings, &hardware)
}

/// A cycle with `samples` in each pulse.
fn cycle(samples: u32, mut code: impl FnMut(u32) -> i32) -> Cycle {
    let mut integrator = Integrator::new(samples);
    (0..=2 * samples).for_each(|n| integrator.add(&GyroSample { angle: code(n), torquer: 0, conversions: 1 }));
    Cycle { samples, sums: integrator.sums().unwrap(), ..Cycle::default() }
}

/// (13) from the exact sum; checks the firmware's conversion in single precision, too.
fn exact_rad_s(cycle: &Cycle, rad_per_code: f64) -> f64 {
    let n = f64::from(cycle.samples);
    let exact = -(cycle.sums.acc2 as f64) * rad_per_code * 1e3 / (2.0 * n * n);
    let own = f64::from(cycle.raw_rad_s(&scales(rad_per_code), None));
    assert!((own - exact).abs() <= 4e-7 * exact.abs(), "{own} {exact}");
    exact
}

/// Drift rate of a cycle of 2 T whose angle is a function of time, °/h, at any sampling rate.
fn drift_deg_h(samples: u32, lsb_rad: f64, mut theta_rad: impl FnMut(f64) -> f64) -> f64 {
    let dt_s = T_S / f64::from(samples);
    let cycle = cycle(samples, |n| (theta_rad(f64::from(n) * dt_s) / lsb_rad).round() as i32);
    exact_rad_s(&cycle, lsb_rad) * 1e-3 / dt_s / DEG_H
}

/// Reference angle of a rectangular pair of pulses.
fn tent(t_s: f64) -> f64 {
    W * if t_s < T_S { t_s.max(0.0) } else { 2.0 * T_S - t_s }
}

#[test]
fn test_vector_of_counts_is_integrated_exactly() {
    let counts = [7, 107, 208, 310, 411, 312, 214, 115, 16];
    let cycle = cycle(4, |n| counts[n as usize]);
    assert_eq!(cycle.sums.acc2, -41);
    assert_eq!((cycle.sums.min, cycle.sums.max), (7, 411));
    assert_eq!(cycle.sums.sum2, 7 + 2 * (107 + 208 + 310 + 411 + 312 + 214 + 115) + 16);
    // 0.128125 °/h at 1 s per sample; the rows are a thousand times faster.
    let rate = exact_rad_s(&cycle, 0.1 * ARCSEC) / DEG_H;
    assert!((rate - 128.125).abs() < 1e-9, "{rate}");
}

#[test]
fn symmetric_pulses_and_a_reversed_sawtooth_cancel() {
    let ramp = |t: f64| W * t * t / (2.0 * T_S);
    let triangle = |t: f64| if t < T_S / 2.0 { W * t * t / T_S } else { W * (T_S / 2.0 - (T_S - t) * (T_S - t) / T_S) };
    let pair = |first: &dyn Fn(f64) -> f64, reversed: bool, t: f64| match (t <= T_S, reversed) {
        (true, _) => first(t),
        (_, false) => first(T_S) - first(t - T_S),
        // ∫ w(T − s) ds = θ(T) − θ(T − s).
        (_, true) => first(2.0 * T_S - t),
    };
    // 50 000 samples: the trapezoid's own error on the sawtooth is 2e-8 °/h.
    let of = |first: &dyn Fn(f64) -> f64, reversed| drift_deg_h(50_000, FINE, |t| START + pair(first, reversed, t) + OMEGA * t);
    assert!((of(&|t| W * t, false) - 3.0).abs() < 1e-6);
    assert!((of(&triangle, false) - 3.0).abs() < 1e-6);
    assert!((of(&ramp, false) - 63.0).abs() < 1e-6);
    assert!((of(&ramp, true) - 3.0).abs() < 1e-6);
}

#[test]
fn pulse_errors_match_the_formulas() {
    let rate = |theta: &dyn Fn(f64) -> f64| drift_deg_h(5_000, FINE, |t| START + theta(t) + OMEGA * t);
    // Second amplitude 1e-4 greater: −ε w/2.
    let unequal = |t: f64| tent(t) - if t > T_S { 1e-4 * W * (t - T_S) } else { 0.0 };
    assert!((rate(&unequal) - 3.0 + 0.018).abs() < 1e-6);
    // A reference that lags by 1 ms: 2 w lag/T, and the other way with the other polarity; their mean is right.
    let late = |t: f64| tent(t - 1e-3);
    let (plus, minus) = (rate(&late), rate(&|t| -late(t)));
    // The test vector has −0.143978 for the second, with a lag that is linear between samples: the difference is w lag²/T².
    assert!((plus - 3.0 - 0.143978).abs() < 1e-6 && (minus - 3.0 + 0.143978).abs() < 3e-5, "{plus} {minus}");
    assert!(((plus + minus) / 2.0 - 3.0).abs() < 2e-5);
    assert!((rate(&tent) - 3.0).abs() < 1e-6);
}

#[test]
fn current_corrects_lag_and_inequality_of_the_pulses() {
    // 3 ms late and 0.1 % unequal, the current in millionths of w.
    let (n, unit) = (5_000_u32, W / 1e6);
    let at = |k: i64| match k - 3 {
        ..0 => 0.0,
        0..5_000 => 1.0,
        _ => -1.001,
    };
    let mut integrator = Integrator::new(n);
    let mut theta = START;
    for k in 0..=2 * i64::from(n) {
        let current = if k > 0 { at(k - 1) } else { 0.0 };
        theta += (W * current + OMEGA) * if k > 0 { 1e-3 } else { 0.0 };
        let torquer = (current * 1e6).round() as i32;
        integrator.add(&GyroSample { angle: (theta / FINE).round() as i32, torquer, conversions: 1 });
    }
    let cycle = Cycle { samples: n, sums: integrator.sums().unwrap(), rest_current: (0, 1), ..Cycle::default() };
    let corrected = |error: f64| {
        let mut scales = scales(FINE);
        scales.rad_s_per_code = (unit * error) as f32;
        let raw = exact_rad_s(&cycle, FINE);
        (raw / DEG_H, (raw - f64::from(cycle.residual_rad_s(&scales, None))) / DEG_H)
    };
    let (raw, right) = corrected(1.0);
    assert!((raw - 3.252_021_5).abs() < 1e-6, "{raw}");
    assert!((right - 3.0).abs() < 1e-6, "{right}");
    assert!((corrected(1.01).1 - 2.997_479_8).abs() < 1e-6, "{}", corrected(1.01).1);
}

#[test]
fn sums_without_commutation_measure_the_reference() {
    let sum = |sign: f64| {
        cycle(5_000, |n| ((START + sign * tent(f64::from(n) * 1e-3) + OMEGA * f64::from(n) * 1e-3) / FINE).round() as i32).sums.sum2
    };
    // K_m i/H = (S₊ − S₋)/(2 T²), S = sum2/2.
    let w = (sum(1.0) - sum(-1.0)) as f64 / 2.0 * FINE * 1e-3 / (2.0 * T_S * T_S);
    assert!((w.to_degrees() - 0.1).abs() < 1e-9, "{}", w.to_degrees());
}

/// A normal deviate as the sum of twelve uniform ones.
fn normal(random: &mut Xoshiro256PlusPlus) -> f64 {
    (0..12).map(|_| uniform(random)).sum::<f64>() - 6.0
}

fn uniform(random: &mut Xoshiro256PlusPlus) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

#[test]
fn white_noise_of_5_arcsec_gives_0_02_deg_h_and_less_by_least_squares() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let draws = 800;
    let (mut trapezoid, mut slope) = (0.0, 0.0);
    for _ in 0..draws {
        let cycle = cycle(5_000, |_| (5.0 * ARCSEC * normal(&mut random) / FINE).round() as i32);
        trapezoid += exact_rad_s(&cycle, FINE).powi(2);
        // Σ (n − N)² = N (N + 1) (2 N + 1) / 3.
        slope += (cycle.sums.moment as f64 * 3.0 / (5_000.0 * 5_001.0 * 10_001.0) * FINE * 1e3).powi(2);
    }
    let std = |squares: f64| (squares / f64::from(draws)).sqrt() / DEG_H;
    // 800 draws know a standard deviation to 2.5 %; four of these.
    assert!((std(trapezoid) / 0.020 - 1.0).abs() < 0.1, "{}", std(trapezoid));
    assert!((std(slope) / 0.017_321 - 1.0).abs() < 0.1, "{}", std(slope));
}

#[test]
fn pulses_dither_a_coarse_quantiser() {
    // LSB, rms error with pulses and without, °/h (docs/theory.md §3.2); other random numbers: 15 %.
    for (lsb, with, without) in [(1.0, 0.000_199, 0.0228), (10.0, 0.001_24, 0.594), (60.0, 0.0108, 1.926)] {
        let rms = |pulses: f64| {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
            let squares: f64 = (0..400)
                .map(|_| {
                    let omega = 2.0 * uniform(&mut random) - 1.0;
                    let start = uniform(&mut random) * lsb * ARCSEC;
                    let found = drift_deg_h(5_000, lsb * ARCSEC, |t| start + pulses * tent(t) + omega * DEG_H * t);
                    (found - omega).powi(2)
                })
                .sum();
            (squares / 400.0).sqrt()
        };
        let (found, alone) = (rms(1.0), rms(0.0));
        assert!((found / with - 1.0).abs() < 0.15, "{lsb}: {found}");
        assert!((alone / without - 1.0).abs() < 0.15, "{lsb}: {alone}");
    }
}

#[test]
fn steps_of_a_cycle_sum_to_zero_for_every_shape() {
    for shape in Shape::ALL {
        for (reversed, samples, amplitude) in [(false, 1, 7), (false, 7, 873), (true, 5_000, -873), (false, 4_999, 1), (true, 3, i16::MAX)]
        {
            let pulse = Pulse { shape, reversed, amplitude, samples };
            let steps: Vec<i64> = (0..2 * samples).map(|n| i64::from(pulse.step(n))).collect();
            assert_eq!(steps.iter().sum::<i64>(), 0, "{shape:?} {samples}");
            assert!(steps.iter().all(|step| step.abs() <= i64::from(amplitude).abs()));
            assert_eq!((pulse.step(2 * samples), pulse.step(u32::MAX)), (0, 0));
            // ∫ (T − 2t) w dt of both pulses must vanish for (13).
            let n = i64::from(samples);
            let weighted: i64 = steps.iter().zip(0..).map(|(step, k)| step * (2 * k.min(2 * n - 1 - k) + 1)).sum();
            assert!(weighted == 0 || (shape == Shape::Sawtooth && !reversed), "{shape:?} {samples}: {weighted}");
        }
    }
}

#[test]
fn duration_is_a_multiple_of_the_period() {
    let samples = |duration_s, period_s| Plan { duration_s, period_s, ..Plan::default() }.samples();
    assert_eq!((samples(5.0, 0.0), samples(5.0, 0.02), samples(5.005, 0.02)), (5_000, 5_000, 5_000));
    // Of 60 Hz mains, of a vibration of 0.7 s.
    assert_eq!((samples(5.0, 1.0 / 60.0), samples(5.0, 0.7), samples(0.1, 0.7)), (5_000, 4_900, 700));
    let scales = scales(ARCSEC);
    let wrong = |plan: Plan| plan.pulse(0, &scales).unwrap_err().parameter();
    assert_eq!(wrong(Plan { duration_s: 0.0, period_s: 0.0, ..Plan::default() }), "duration of a pulse");
    assert_eq!(wrong(Plan { duration_s: 0.0, ..Plan::default() }), "duration of a pulse", "the period does not replace a duration");
    assert_eq!(wrong(Plan { duration_s: f64::NAN, ..Plan::default() }), "duration of a pulse");
    assert_eq!(wrong(Plan { duration_s: 61.0, ..Plan::default() }), "duration of a pulse");
    assert_eq!(wrong(Plan { rate_rad_s: 0.0, ..Plan::default() }), "rate of a pulse");
    assert_eq!(wrong(Plan { rate_rad_s: 1.0, ..Plan::default() }), "rate of a pulse");
}

/// An ideal gyroscope θ′ = w + ω with converters; the torquer's amplifier and its measurement have offsets.
struct Gyro {
    theta_rad: f64,
    omega_rad_s: f64,
    acting: TorquerStep,
    pending: TorquerStep,
    at: Ticks,
    /// Output of the amplifier for a step, in steps.
    gain: fn(i16) -> f64,
    rad_per_code: f64,
}

impl Gyro {
    fn new(omega_rad_s: f64) -> Self {
        let (acting, pending) = Default::default();
        Self { theta_rad: 1e-3, omega_rad_s, acting, pending, at: Ticks(0), gain: f64::from, rad_per_code: ARCSEC }
    }

    /// The sample of the next millisecond.
    fn next(&mut self, scales: &Scales) -> Stamped<GyroSample> {
        let steps = (self.gain)(self.acting.0);
        self.theta_rad += (steps * f64::from(scales.rad_s_per_step) + self.omega_rad_s) * 1e-3;
        self.acting = self.pending;
        self.at = self.at + TICKS_PER_ROW;
        let angle = (self.theta_rad / self.rad_per_code).round() as i32 + 2048;
        // 16 conversions, a sixteenth of a code fine, 3 codes off.
        let torquer = ((steps + 2048.0 + 3.0) * 16.0).round() as i32;
        Stamped { value: GyroSample { angle, torquer, conversions: 16 }, at: self.at }
    }
}

/// Runs for `rows` milliseconds; returns the finished cycles.
fn run(drift: &DriftMeasurement, gyro: &mut Gyro, rows: u32, fault: Fault) -> Vec<Cycle> {
    let scales = *SCALES;
    let mut cycles = Vec::new();
    for _ in 0..rows {
        let before = drift.newest().map_or(0, |(cycle, ..)| cycle.number);
        let sample = gyro.next(&scales);
        gyro.pending = drift.update(Some(sample), sample.at, fault);
        if let Some((cycle, ..)) = drift.newest().filter(|(cycle, ..)| cycle.number != before) {
            cycles.push(cycle);
        }
    }
    cycles
}

fn plan() -> Plan {
    Plan { duration_s: 0.5, period_s: 0.0, rest_s: 0.2, cycles: 4, rate_rad_s: 1e-3, ..Plan::default() }
}

static SCALES: std::sync::LazyLock<Scales> =
    std::sync::LazyLock::new(|| Scales::new(&Settings::default(), &Hardware { angle_V_per_code: 150.0 * ARCSEC, ..Hardware::default() }));

fn measurement() -> DriftMeasurement {
    DriftMeasurement::new(*SCALES)
}

#[test]
fn a_session_opens_the_loop_for_each_cycle_and_closes_it() {
    let drift = measurement();
    let mut gyro = Gyro::new(50.0 * DEG_H);
    run(&drift, &mut gyro, 3_000, Fault::None);
    assert!(gyro.theta_rad.abs() < 1.5 * ARCSEC * 50.0, "loop closed: {}", gyro.theta_rad / ARCSEC);
    drift.start(plan(), false);
    let cycles = run(&drift, &mut gyro, 6_900, Fault::None);
    assert_eq!(cycles.iter().map(|cycle| (cycle.number, cycle.rejection)).collect::<Vec<_>>(), [1, 2, 3, 4].map(|n| (n, Rejection::None)));
    let polarities: Vec<i16> = cycles.iter().map(|cycle| cycle.polarity.sign()).collect();
    assert_eq!(polarities, [1, -1, 1, -1]);
    // The angle goes out by w T and back.
    for cycle in &cycles {
        let span = cycle.sums.max - cycle.sums.min;
        assert!((f64::from(span) * ARCSEC - 0.5e-3).abs() < 30.0 * ARCSEC, "{span}");
    }
    assert!(!drift.is_running() && drift.phase().is_closed());
    let (accepted, rejected, mean) = drift.drift();
    let mean = mean.unwrap();
    assert_eq!((accepted, rejected), (4, 0));
    // A quantiser of 1″ over 0.5 s: some 0.01 °/h each.
    assert!((f64::from(mean.rate_rad_s) / DEG_H - 50.0).abs() < 0.05, "{}", f64::from(mean.rate_rad_s) / DEG_H);
    assert!(f64::from(mean.sigma_rad_s.unwrap()) < 0.05 * DEG_H);
}

#[test]
fn an_asymmetric_amplifier_is_corrected_by_its_current() {
    let drift = measurement();
    let mut gyro = Gyro { gain: |step| f64::from(step) * if step < 0 { 1.02 } else { 1.0 }, ..Gyro::new(5.0 * DEG_H) };
    drift.start(plan(), false);
    let cycles = run(&drift, &mut gyro, 7_000, Fault::None);
    assert_eq!(cycles.len(), 4);
    let (raw, corrected) = drift.newest().map(|(_, raw, corrected)| (f64::from(raw), f64::from(corrected))).unwrap();
    // ε w/2 of 206 °/h.
    assert!((raw / DEG_H - 5.0).abs() > 1.9, "{}", raw / DEG_H);
    // The current's sixteenth of a code is 0.06 °/h.
    assert!((corrected / DEG_H - 5.0).abs() < 0.05, "{}", corrected / DEG_H);
}

#[test]
fn every_error_closes_the_loop_and_rejects_the_cycle() {
    type Spoil = fn(&mut Gyro, &DriftMeasurement);
    let cases: [(Rejection, Fault, Spoil); 5] = [
        (Rejection::Saturated, Fault::None, |gyro, _| gyro.theta_rad = 2.0),
        (Rejection::Limited, Fault::None, |gyro, _| gyro.gain = |_| 300.0),
        (Rejection::Fault(Fault::EmergencyStop), Fault::EmergencyStop, |_, _| ()),
        (Rejection::Aborted, Fault::None, |_, drift| drift.abort()),
        (Rejection::SampleLost, Fault::None, |gyro, _| gyro.at = gyro.at + 1),
    ];
    for (rejection, fault, spoil) in cases {
        let drift = measurement();
        let mut gyro = Gyro::new(0.0);
        drift.start(plan(), false);
        run(&drift, &mut gyro, 1_000, Fault::None);
        assert_eq!(drift.phase(), Phase::Pulses);
        spoil(&mut gyro, &drift);
        if rejection == Rejection::SampleLost {
            drift.update(None::<Stamped<GyroSample>>.or(Some(Stamped { at: Ticks(1), ..gyro.next(&SCALES) })), gyro.at, fault);
        } else {
            run(&drift, &mut gyro, 1, fault);
        }
        assert!(drift.phase().is_closed(), "{rejection:?}");
        assert_eq!(drift.newest().map(|(cycle, ..)| cycle.rejection), Some(rejection));
        assert_eq!(drift.drift(), (0, 1, None), "{rejection:?}");
        assert_eq!(drift.is_running(), !rejection.ends_session(), "{rejection:?}");
        // The loop is closed: it corrects the angle.
        let step = run_step(&drift, &mut gyro, fault);
        assert_eq!(step, SCALES.correction((gyro.theta_rad / ARCSEC).round() as i32 + 2048), "{rejection:?}");
    }
}

fn run_step(drift: &DriftMeasurement, gyro: &mut Gyro, fault: Fault) -> TorquerStep {
    let sample = gyro.next(&SCALES);
    gyro.pending = drift.update(Some(sample), sample.at, fault);
    gyro.pending
}

#[test]
fn a_board_without_angle_sensor_rejects_and_a_zero_input_cycle_is_subtracted() {
    let drift = measurement();
    drift.start(plan(), false);
    drift.update(None, Ticks(TICKS_PER_ROW), Fault::None);
    assert_eq!(drift.newest().map(|(cycle, ..)| cycle.rejection), Some(Rejection::Silent));
    assert!(!drift.is_running());

    // A converter that drifts by 20 codes per second, and a gyroscope at rest.
    let drift = measurement();
    let drifting = |drift: &DriftMeasurement, omega: f64, rows: u32| {
        let mut gyro = Gyro::new(omega);
        gyro.theta_rad = 0.0;
        run(drift, &mut gyro, rows, Fault::None);
    };
    drift.start(plan(), true);
    drifting(&drift, 20.0 * DEG_H, 2_000);
    let (samples, sums) = drift.zero_input().unwrap();
    assert_eq!((samples, sums.acc2 != 0, drift.is_running()), (500, true, false));
    drift.start(Plan { sequence: Sequence::PlusMinus, cycles: 1, ..plan() }, false);
    drifting(&drift, 23.0 * DEG_H, 2_000);
    let (cycle, raw) = drift.newest().map(|(cycle, raw, _)| (cycle, f64::from(raw))).unwrap();
    assert_eq!(cycle.rejection, Rejection::None);
    assert!((raw / DEG_H - 3.0).abs() < 0.2, "{}", raw / DEG_H);
    drift.clear_zero_input();
    assert!((f64::from(drift.newest().unwrap().1) / DEG_H - 23.0).abs() < 0.2);
}

#[test]
fn register_over_two_positions_gives_own_or_apparent_drift() {
    // docs/theory.md §3.2, single axis: ω_d = 1.5, ω_a = −0.8933067 °/h.
    let (own, apparent) = (1.5, -0.893_306_7);
    for (pair, expected) in [(Pair::Own, own), (Pair::Apparent, apparent)] {
        let mut register = Register::new(pair);
        let mut add = |position: u8, rejection: Rejection, omega: f64| {
            let found = cycle(5_000, |n| ((START + tent(f64::from(n) * 1e-3) + omega * DEG_H * f64::from(n) * 1e-3) / FINE).round() as i32);
            register.add(&Cycle { position, rejection, polarity: Polarity::PlusMinus, ..found }, 0);
            register
        };
        add(1, Rejection::None, own + apparent);
        assert_eq!(add(1, Rejection::Saturated, 1e3).rate_rad_s(&scales(FINE)), None, "one position is not enough");
        let both = add(2, Rejection::None, own - apparent);
        assert_eq!(both.cycles, [1, 1]);
        let rate = f64::from(both.rate_rad_s(&scales(FINE)).unwrap()) / DEG_H;
        assert!((rate - expected).abs() < 1e-6, "{rate}");
        assert!((-(both.acc2 as f64) * FINE * 1e-3 / (4.0 * T_S * T_S) / DEG_H - expected).abs() < 1e-6);
    }
}

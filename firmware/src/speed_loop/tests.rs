//! The law tick by tick against prescribed motion; closed loops are tried in hal-sim, on plants.

use super::ramp::SMOOTHED;
use super::segment::ONE;
use super::*;
use crate::board::{CONTROL_HZ, EncoderCount, Hardware, Sensed};
use crate::mailbox::Words;

const HW: fn() -> Hardware = Hardware::default;

/// A speed loop and an encoder that shows what the test says.
struct Stand {
    law: SpeedLoop,
    n: u64,
    theta_rad: f64,
}

impl Stand {
    fn new() -> Self {
        Self::with(&Settings::default())
    }

    fn with(settings: &Settings) -> Self {
        Self { law: SpeedLoop::new(Config::new(settings, &HW()).unwrap()), n: 0, theta_rad: 0.0 }
    }

    fn tick(&mut self, order: Option<Segment>) -> (Drive, Report) {
        self.order(order.map(|segment| Order { segment, ..Order::default() }))
    }

    fn order(&mut self, order: Option<Order>) -> (Drive, Report) {
        let counts = (self.theta_rad / HW().rad_per_count()).floor() as i64;
        let sensed = Sensed { tick: self.n, encoder: EncoderCount(counts as u16), ..Sensed::default() };
        self.n += 1;
        self.law.tick(sensed, order)
    }

    /// `ticks` at a constant rate; the last answer.
    fn turn(&mut self, rate_rad_s: f64, ticks: u64) -> (Drive, Report) {
        let mut last = None;
        for _ in 0..ticks {
            self.theta_rad += rate_rad_s / CONTROL_HZ as f64;
            last = Some(self.tick(None));
        }
        last.unwrap()
    }

    fn rate_rad_s(&self) -> f64 {
        f64::from(self.law.rate_estimate()) * HW().rad_per_count() * CONTROL_HZ as f64
    }
}

fn hold_rate(start: u64, rate_rad_s: f64) -> Segment {
    Segment::rate(&HW(), start, u16::MAX, rate_rad_s, rate_rad_s)
}

#[test]
fn a_segment_acts_on_the_motor_from_exactly_its_start_tick_on() {
    let mut stand = Stand::new();
    let segment = Segment::voltage(&HW(), 10, 10, 1.0);
    let mut drives = Vec::new();
    let mut reports = Vec::new();
    for n in 0..20 {
        let (drive, report) = stand.tick((n == 2).then_some(segment));
        drives.push(drive.counts());
        reports.push(report);
    }
    // What is driven at tick n acts in [n+1, n+2).
    assert!(drives[..9].iter().all(|d| *d == 0) && drives[9..].iter().all(|d| *d == 375), "{drives:?}");
    for (n, report) in reports.iter().enumerate() {
        let acted = n.saturating_sub(10) as i64;
        assert_eq!((report.tick, report.duty_sum), (n as u64, acted * 375));
        assert_eq!(report.mode == Mode::Voltage, n >= 10);
        assert_eq!(report.limits, Limits::default());
    }
}

#[test]
fn one_segment_hands_over_to_the_next_without_a_tick_between() {
    let mut stand = Stand::new();
    stand.tick(Some(Segment::voltage(&HW(), 2, 10, 1.0)));
    let drives: Vec<i16> = (1..20).map(|n| stand.tick((n == 4).then_some(Segment::voltage(&HW(), 12, 10, -1.0))).0.counts()).collect();
    assert!(drives[..10].iter().all(|d| *d == 375) && drives[10..].iter().all(|d| *d == -375), "{drives:?}");
}

#[test]
fn the_mean_rate_is_as_good_as_the_crystal() {
    for rate in [1e-3, 0.123_456_789, 1.0, 34.9] {
        let mut stand = Stand::new();
        let mut end = stand.tick(Some(hold_rate(1, rate))).1;
        let mut start = end;
        // The ramp is followed exactly, so that it does not slip; after a second it has its rate.
        for n in 0..110_000 {
            stand.theta_rad = end.position_command as f64 / ONE * HW().rad_per_count();
            end = stand.tick(None).1;
            start = if n < 10_000 { end } else { start };
        }
        let asked = (end.position_command - start.position_command) as f64 / ONE * HW().rad_per_count();
        let seconds = (end.tick - start.tick) as f64 / CONTROL_HZ as f64;
        // Half a unit of the fixed point.
        assert!((asked / seconds - rate).abs() < 4e-10, "{rate}: {}", asked / seconds - rate);
    }
}

#[test]
fn a_straight_segment_is_followed_straight_and_its_position_is_the_integral() {
    let mut stand = Stand::new();
    let unit = rate_unit(&HW());
    // 2 to 4 rad/s in 80 ms: 25 rad/s², below the limit of 60.
    stand.tick(Some(hold_rate(1, 2.0)));
    let before = stand.turn(2.0, 2_000).1;
    assert!((before.rate_command as f64 / unit - 2.0).abs() < 1e-9);
    stand.tick(Some(Segment::rate(&HW(), 2_100, 800, 2.0, 4.0)));
    let mut reports: Vec<Report> = (0..1_200).map(|_| stand.turn(2.0, 1).1).collect();
    // Once the whole average lies on the slope it is straight, later by the mean age of what is averaged.
    reports.retain(|r| (2_400..=2_900).contains(&r.tick));
    let late = (SMOOTHED as f64 - 1.0) / 2.0;
    let mut way = 0.0;
    for (k, r) in reports.iter().enumerate() {
        let expected = 2.0 + 0.0025 * (r.tick as f64 - 2_100.0 - late);
        // The slope is rounded to 2⁻³² counts per tick²: 1.5e-7 of it, so 3e-7 rad/s after 2 rad/s.
        assert!((r.rate_command as f64 / unit - expected).abs() < 4e-7, "{}", r.tick);
        way += if k == 0 || k == 500 { 0.5 } else { 1.0 } * expected / 1e4;
    }
    let went = (reports[500].position_command - reports[0].position_command) as f64 / ONE * HW().rad_per_count();
    assert!((way - went).abs() < 2e-8, "{way} {went}");
}

#[test]
fn the_acceleration_of_the_command_never_jumps() {
    let mut stand = Stand::new();
    stand.tick(Some(hold_rate(1, 10.0)));
    let unit = rate_unit(&HW());
    let (mut rate, mut acceleration) = (0.0, 0.0);
    for _ in 0..3_000 {
        let r = stand.turn(0.0, 1).1.rate_command as f64 / unit;
        let a = (r - rate) * 1e4;
        // The limit of 60 rad/s² is reached in no less than the average's length.
        assert!((a - acceleration).abs() < 60.0 / SMOOTHED as f64 + 1e-4, "{a} after {acceleration}");
        (rate, acceleration) = (r, a);
    }
}

#[test]
fn the_rate_command_keeps_the_acceleration_limit_and_says_so() {
    let mut stand = Stand::new();
    stand.tick(Some(hold_rate(1, 10.0)));
    let unit = rate_unit(&HW());
    let mut last = 0.0;
    let mut limited = 0;
    for _ in 0..3_000 {
        let r = stand.turn(0.0, 1).1;
        let rate = r.rate_command as f64 / unit;
        assert!(rate - last < 60.0 / 1e4 + 1e-9);
        limited += u32::from(r.limits.contains(Limits::ACCELERATION));
        last = rate;
    }
    assert!((last - 10.0).abs() < 1e-9);
    // 10 rad/s at 60 rad/s² are 1667 ticks.
    assert!((1_660..1_670).contains(&limited), "{limited}");
}

#[test]
fn a_blocked_platform_lets_the_ramp_slip_and_does_not_wind_up() {
    let mut stand = Stand::new();
    stand.tick(Some(hold_rate(1, 5.0)));
    let (drive, report) = stand.turn(0.0, 30_000);
    assert!(report.limits.contains(Limits::SLIPPED) && report.limits.contains(Limits::CURRENT));
    // R·I_max = 2.32 Ω · 1.5 A is 1305 of 4500 counts of 12 V.
    assert!((1_304..=1_306).contains(&drive.counts()), "{drive:?}");
    let ahead = report.position_command as f64 / ONE * HW().rad_per_count();
    assert!((0.099..0.102).contains(&ahead), "{ahead}");
    // Asked for the other way, it pushes the other way after 2 · 0.1 rad, not after 3 s.
    let back = stand.n;
    stand.tick(Some(hold_rate(back, -5.0)));
    let (drive, _) = stand.turn(0.0, 2_500);
    assert!(drive.counts() < -1_000, "{drive:?}");
}

#[test]
fn overspeed_switches_off_stays_off_and_is_cleared_by_an_order() {
    let mut stand = Stand::new();
    let order = |clear, at| Some(Order { segment: Segment::voltage(&HW(), at, u16::MAX, 1.0), clear, trip: Fault::None });
    stand.order(order(0, 1));
    // Not from standstill at once: the estimate of third order overshoots a step by an eighth.
    assert_eq!((0..=44).map(|rate| stand.turn(f64::from(rate), 200).1.fault).last(), Some(Fault::None));
    let (drive, report) = stand.turn(46.5, 1_000);
    assert_eq!((drive, report.fault), (Drive::Off, Fault::Overspeed));
    let (drive, report) = stand.turn(0.0, 5_000);
    assert_eq!((drive, report.fault), (Drive::Off, Fault::Overspeed), "latched");
    stand.order(order(0, stand.n));
    assert_eq!(stand.turn(0.0, 2).0, Drive::Off, "a new segment alone does not clear it");
    stand.order(order(1, stand.n));
    let (drive, report) = stand.turn(0.0, 2);
    assert_eq!((drive.counts(), report.fault), (375, Fault::None));
}

#[test]
fn a_lost_tick_is_a_fault_and_its_duty_is_not_lost() {
    let mut stand = Stand::new();
    stand.tick(Some(Segment::voltage(&HW(), 1, u16::MAX, 1.0)));
    stand.turn(0.0, 10);
    let before = stand.tick(None).1;
    stand.n += 3;
    let after = stand.tick(None).1;
    assert_eq!(after.fault, Fault::Clock);
    assert_eq!(after.duty_sum - before.duty_sum, 375 * (after.tick - before.tick) as i64);
}

#[test]
fn current_limit_and_voltage_limit_hold_apart_from_each_other() {
    let settings = Settings { current_limit_A: 1.0, voltage_limit_V: 6.0, ..Settings::default() };
    let mut stand = Stand::with(&settings);
    stand.tick(Some(Segment::voltage(&HW(), 1, u16::MAX, 10.0)));
    let (drive, report) = stand.turn(0.0, 2);
    assert_eq!((drive.counts(), report.limits), (870, Limits::CURRENT), "2.32 V");
    let settings = Settings { current_limit_A: 5.0, ..settings };
    let mut stand = Stand::with(&settings);
    stand.tick(Some(Segment::voltage(&HW(), 1, u16::MAX, 10.0)));
    let (drive, report) = stand.turn(0.0, 2);
    assert_eq!((drive.counts(), report.limits), (2_250, Limits::VOLTAGE), "6 V");
}

#[test]
fn a_late_segment_and_a_segment_without_successor_say_starved_and_hold() {
    let mut stand = Stand::new();
    stand.turn(0.0, 10);
    let late = stand.tick(Some(Segment::rate(&HW(), 5, 100, 1.0, 1.2))).1;
    assert!(late.limits.contains(Limits::STARVED));
    assert!(!stand.turn(0.0, 50).1.limits.contains(Limits::STARVED));
    let held = stand.turn(0.0, 800).1;
    assert!(held.limits.contains(Limits::STARVED));
    assert!((held.rate_command as f64 / rate_unit(&HW()) - 1.2).abs() < 1e-7, "the slope is over");
    assert!(held.limits_since(&late).contains(Limits::STARVED), "seen by counting, too");
}

#[test]
fn the_rate_estimate_has_no_lag_at_constant_acceleration_and_is_smooth() {
    let mut stand = Stand::new();
    let mut rate = 0.0;
    let mut worst = 0.0_f64;
    for n in 0..20_000 {
        let next = rate + 15.0 / 1e4;
        stand.theta_rad += 0.5 * (rate + next) / 1e4;
        rate = next;
        stand.tick(None);
        if n > 3_000 {
            worst = worst.max((stand.rate_rad_s() - rate).abs());
        }
    }
    // One count, 0.31 mrad, times the filter's pole, 228 1/s, is 0.072 rad/s; it stays below.
    assert!(worst < 0.07, "{worst}");
    let mut slow = Stand::new();
    slow.turn(1.0, 5_000);
    let last = (0..1_000).fold(0.0_f64, |worst, _| {
        slow.turn(1.0, 1);
        worst.max((slow.rate_rad_s() - 1.0).abs())
    });
    assert!(last < 0.07, "an edge each third tick: {last}");
}

#[test]
fn every_bad_setting_is_refused_by_its_name() {
    type Set = fn(&mut Settings) -> &mut f64;
    let all: [(&str, Set); 11] = [
        ("resistance_ohm", |s| &mut s.resistance_ohm),
        ("motor_constant_N_m_A", |s| &mut s.motor_constant_N_m_A),
        ("inertia_kg_m2", |s| &mut s.inertia_kg_m2),
        ("rate_gain_V_s_rad", |s| &mut s.rate_gain_V_s_rad),
        ("position_gain_V_rad", |s| &mut s.position_gain_V_rad),
        ("rate_bandwidth_Hz", |s| &mut s.rate_bandwidth_Hz),
        ("acceleration_rad_s2", |s| &mut s.acceleration_rad_s2),
        ("slip_rad", |s| &mut s.slip_rad),
        ("current_limit_A", |s| &mut s.current_limit_A),
        ("voltage_limit_V", |s| &mut s.voltage_limit_V),
        ("overspeed_rad_s", |s| &mut s.overspeed_rad_s),
    ];
    for (name, field) in all {
        for bad in [f64::NAN, f64::INFINITY, -1.0] {
            let mut settings = Settings::default();
            *field(&mut settings) = bad;
            let error = Config::new(&settings, &HW()).unwrap_err();
            assert_eq!(error.parameter(), name);
            assert!(error.to_string().contains(name));
        }
    }
}

#[test]
fn orders_and_reports_pass_the_mailbox_unchanged() {
    let segment = Segment { start_tick: u64::MAX - 3, ticks: 65_535, mode: Mode::Rate, value: i64::MIN + 7, slope: -123_456_789_012 };
    let order = Order { segment, clear: 65_535, trip: Fault::IndexLost };
    assert_eq!(Order::from_words(&order.to_words()), order);
    let report = Report {
        tick: u64::MAX - 1,
        duty_sum: -1,
        position_command: i64::MIN,
        rate_command: i64::MAX,
        mode: Mode::Voltage,
        fault: Fault::Overspeed,
        limits: Limits(31),
        compensating: Compensating(15),
        limited_ticks: [1, 2, 3, 4, u32::MAX],
    };
    assert_eq!(Report::from_words(&report.to_words()), report);
}

#[test]
fn fixed_point_becomes_single_precision_without_a_64_bit_conversion() {
    for value in [0.0, 0.5, -0.5, 11.103_5, -11.103_5, 4500.0, -4500.25, 1e-6] {
        let converted = f64::from(fixed_to_f32((value * ONE) as i64));
        assert!((converted - value).abs() <= 1.2e-7 * value.abs().max(0.5), "{value} {converted}");
    }
}

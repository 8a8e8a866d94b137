//! The law tick by tick against prescribed motion; closed loops are tried in hal-sim, on plants.

use super::ramp::AVERAGED_MS;
use super::segment::ONE;
use super::*;
use crate::board::{CONTROL_HZ, CurrentCode, EncoderCount, Hardware, Sensed, SupplyCode, TickIo};
use crate::compensation::{Compensation, Harmonic, Harmonics};
use crate::supervision;
use critical_section as _;

const HW: fn() -> Hardware = Hardware::default;

/// A speed loop and an encoder that shows what the test says.
struct Stand {
    law: SpeedLoop,
    n: u64,
    theta_rad: f64,
    before_rad: f64,
    sensed: Sensed,
}

impl Stand {
    fn new() -> Self {
        Self::with(&Settings::default())
    }

    fn with(settings: &Settings) -> Self {
        let quiet = Sensed { edge_age: i32::MAX as u32, current: CurrentCode(2048), supply: SupplyCode(2482), ..Sensed::default() };
        Self { law: SpeedLoop::new(Config::new(settings, &HW()).unwrap()), n: 0, theta_rad: 0.0, before_rad: 0.0, sensed: quiet }
    }

    fn tick(&mut self, segment: Option<Segment>) -> (Drive, Report) {
        self.command(segment.map(|segment| Command { segment, ..Command::default() }))
    }

    /// One tick, to which the platform has come straight from where it was.
    fn command(&mut self, command: Option<Command>) -> (Drive, Report) {
        let counts = |theta_rad: f64| theta_rad / HW().rad_per_count();
        let (before, now) = (counts(self.before_rad), counts(self.theta_rad));
        let boundary = if now > before { now.floor() } else { now.floor() + 1.0 };
        self.sensed.edge_age = if before.floor() == now.floor() {
            self.sensed.edge_age.saturating_add(9_000)
        } else {
            ((now - boundary) / (now - before) * 9_000.0) as u32
        };
        // R i = u − K ω, by the mean of the tick that has ended.
        let rate_rad_s = (self.theta_rad - self.before_rad) * CONTROL_HZ as f64;
        let amperes = (f64::from(self.law.duty()) * HW().volt_per_duty() - 0.0234 * rate_rad_s) / 2.32;
        self.sensed.current = CurrentCode((2048.0 + amperes / HW().current_A_per_code).clamp(0.0, 4095.0) as i32);
        self.before_rad = self.theta_rad;
        self.sensed.tick = self.n;
        self.sensed.encoder = EncoderCount(now.floor() as i64 as u16);
        self.n += 1;
        self.law.sense(&self.sensed, None);
        let report = self.law.report();
        if let Some(command) = command {
            self.law.set_command(&command, &self.sensed);
        }
        (self.law.compute(&self.sensed), report)
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
        let acted = n.saturating_sub(10) as i32;
        assert_eq!((report.tick, report.duty_sum), (n as u64, acted * 375));
        assert_eq!(report.mode == Mode::Voltage, n >= 10);
        assert_eq!(report.limits, Limits::default());
    }
}

#[test]
fn slope_of_the_duty_is_the_first_moment_of_what_acted() {
    let mut stand = Stand::new();
    // Steps at ticks 14 and 17, within the ten ticks from 10 on; then off, with the last duty still acting in tick 20.
    let segments =
        [(0, Segment::voltage(&HW(), 2, 12, 1.0)), (5, Segment::voltage(&HW(), 14, 3, -2.0)), (15, Segment::voltage(&HW(), 17, 4, 0.5))];
    let (mut acted, mut reports) = (vec![0], Vec::new());
    for n in 0..40 {
        let (drive, report) = stand.tick(segments.iter().find(|(at, _)| *at == n).map(|(_, segment)| *segment));
        acted.push(i32::from(drive.counts()));
        reports.push(report);
    }
    let mut largest = 0.0_f64;
    for (a, b) in [(0, 10), (9, 19), (10, 20), (13, 23), (12, 15), (20, 30), (7, 8)] {
        let n = (b - a) as f64;
        let middle = |k: usize| (2.0 * k as f64 + 1.0) / n - 1.0;
        let moment: f64 = acted[a..b].iter().enumerate().map(|(k, duty)| f64::from(*duty) * middle(k)).sum::<f64>() / n;
        let slope = reports[b].duty_slope_since(&reports[a]);
        assert!((slope - 3.0 * moment).abs() < 1e-9, "{a} to {b}: {slope} {}", 3.0 * moment);
        largest = largest.max(slope.abs());
    }
    assert!(largest > 300.0, "the duties were not constant: {largest}");
}

#[test]
fn one_segment_hands_over_to_the_next_without_a_tick_between() {
    let mut stand = Stand::new();
    stand.tick(Some(Segment::voltage(&HW(), 2, 10, 1.0)));
    let drives: Vec<i16> = (1..20).map(|n| stand.tick((n == 4).then_some(Segment::voltage(&HW(), 12, 10, -1.0))).0.counts()).collect();
    assert!(drives[..10].iter().all(|d| *d == 375) && drives[10..].iter().all(|d| *d == -375), "{drives:?}");
}

#[test]
fn a_segment_that_starts_between_two_decisions_acts_from_exactly_its_tick_on_too() {
    for start in 10..20 {
        let mut stand = Stand::new();
        stand.tick(Some(Segment::voltage(&HW(), start, 7, 1.0)));
        let other = Segment::voltage(&HW(), start + 7, 10, -1.0);
        let drives: Vec<i16> = (1..30).map(|n| stand.tick((n == start).then_some(other)).0.counts()).collect();
        for (n, drive) in (1..).zip(&drives) {
            let expected = if n + 1 < start { 0 } else { 375 * if n + 1 < start + 7 { 1 } else { -1 } };
            assert_eq!(*drive, expected, "{start}: {n}");
        }
        // A ramp begins at the tick and where the stand is.
        let mut stand = Stand::new();
        stand.turn(3.0, 2_000);
        stand.theta_rad += 3.0 / CONTROL_HZ as f64;
        stand.tick(Some(hold_rate(2_000 + start, 3.0)));
        for n in 2_001..2_000 + start + 50 {
            let (drive, report) = stand.turn(3.0, 1);
            assert_eq!(drive.counts() != 0, n + 1 >= 2_000 + start, "{start}: {n}");
            if n > 2_000 + start && n % 10 == 0 {
                let off = report.position_command as f64 / ONE - stand.theta_rad / HW().rad_per_count();
                assert!(off.abs() < 0.1, "{start}: {n} {off}");
            }
        }
    }
}

#[test]
fn an_emergency_stop_switches_off_in_the_tick_that_sees_it() {
    for at in 20..30 {
        let mut stand = Stand::new();
        stand.tick(Some(Segment::voltage(&HW(), 1, u16::MAX, 1.0)));
        assert_eq!(stand.turn(0.0, at - 1).0.counts(), 375);
        stand.sensed.stop = true;
        assert_eq!((stand.tick(None).0, stand.law.fault()), (Drive::Off, (Fault::EmergencyStop, at as u32)));
    }
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
    reports.retain(|r| (2_440..=2_900).contains(&r.tick));
    let late = (AVERAGED_MS as f64 - 1.0) / 2.0 * 10.0;
    let mut way = 0.0;
    for (k, r) in reports.iter().enumerate() {
        let expected = 2.0 + 0.0025 * (r.tick as f64 - 2_100.0 - late);
        // The slope is rounded to 2⁻³² counts per tick²: 1.5e-7 of it, so 3e-7 rad/s after 2 rad/s.
        assert!((r.rate_command as f64 / unit - expected).abs() < 4e-7, "{}", r.tick);
        way += if k == 0 || k == 460 { 0.5 } else { 1.0 } * expected / 1e4;
    }
    let went = (reports[460].position_command - reports[0].position_command) as f64 / ONE * HW().rad_per_count();
    assert!((way - went).abs() < 2e-8, "{way} {went}");
}

#[test]
fn the_acceleration_of_the_command_never_jumps() {
    let mut stand = Stand::new();
    stand.tick(Some(hold_rate(1, 10.0)));
    let unit = rate_unit(&HW());
    let (mut rate, mut acceleration) = (0.0, 0.0);
    stand.turn(0.0, 1);
    for _ in 0..3_000 {
        let r = stand.turn(0.0, 1).1.rate_command as f64 / unit;
        let a = (r - rate) * 1e4;
        // The limit of 60 rad/s² is reached in no less than the average's length, in steps of a millisecond.
        assert!((a - acceleration).abs() < 60.0 / AVERAGED_MS as f64 + 1e-4, "{a} after {acceleration}");
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
    stand.turn(0.0, 1);
    for _ in 0..3_000 {
        let r = stand.turn(0.0, 1).1;
        let rate = r.rate_command as f64 / unit;
        // A tenth of a millisecond's change, and at its end the rounding: ten units.
        assert!(rate - last < 60.0 / 1e4 + 1e-8, "{}", rate - last);
        limited += u32::from(r.limits.contains(Limits::ACCELERATION));
        last = rate;
    }
    assert!((last - 10.0).abs() < 1e-9);
    // 10 rad/s at 60 rad/s² are 166.7 ms, and it is said once in each.
    assert!((166..=168).contains(&limited), "{limited}");
}

#[test]
fn a_blocked_platform_lets_the_ramp_slip_and_does_not_wind_up() {
    let patient = supervision::Settings { stall_s: 60.0, tracking_s: 60.0, ..supervision::Settings::default() };
    let mut stand = Stand::with(&Settings { safety: patient, ..Settings::default() });
    stand.tick(Some(hold_rate(1, 5.0)));
    let (drive, report) = stand.turn(0.0, 30_000);
    assert!(report.limits.contains(Limits::SLIPPED) && report.limits.contains(Limits::CURRENT));
    // R·I_max = 2.32 Ω · 1.3 A is 1131 of 4500 counts of 12 V.
    assert!((1_130..=1_132).contains(&drive.counts()), "{drive:?}");
    let ahead = report.position_command as f64 / ONE * HW().rad_per_count();
    assert!((0.099..0.102).contains(&ahead), "{ahead}");
    // Asked for the other way, it pushes the other way after 2 · 0.1 rad, not after 3 s.
    let back = stand.n;
    stand.tick(Some(hold_rate(back, -5.0)));
    let (drive, _) = stand.turn(0.0, 2_500);
    assert!(drive.counts() < -900, "{drive:?}");
}

#[test]
fn overspeed_switches_off_stays_off_and_is_cleared_by_an_order() {
    let mut stand = Stand::new();
    let command = |clear, at| Some(Command { segment: Segment::voltage(&HW(), at, u16::MAX, 1.0), clear, trip: Fault::None });
    stand.command(command(0, 1));
    // Not from standstill at once: the estimate of third order overshoots a step by an eighth.
    assert_eq!((0..=44).map(|rate| stand.turn(f64::from(rate), 200).1.fault).last(), Some(Fault::None));
    let (drive, report) = stand.turn(46.5, 1_000);
    assert_eq!((drive, report.fault), (Drive::Off, Fault::Overspeed));
    let (drive, report) = stand.turn(0.0, 5_000);
    assert_eq!((drive, report.fault), (Drive::Off, Fault::Overspeed), "latched");
    stand.command(command(0, stand.n));
    assert_eq!(stand.turn(0.0, 2).0, Drive::Off, "a new segment alone does not clear it");
    stand.command(command(1, stand.n));
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
    assert_eq!(after.duty_since(&before), 375 * (after.tick - before.tick) as i32);
    assert_eq!(after.duty_slope_since(&before), 0.0, "the duty was constant");
}

#[test]
fn current_limit_and_voltage_limit_hold_apart_from_each_other() {
    let settings = Settings { current_limit_A: 1.0, voltage_limit_V: 6.0, ..Settings::default() };
    let mut stand = Stand::with(&settings);
    stand.tick(Some(Segment::voltage(&HW(), 1, u16::MAX, 10.0)));
    let (drive, report) = stand.turn(0.0, 2);
    assert_eq!((drive.counts(), report.limits), (870, Limits::CURRENT), "2.32 V");
    let settings = Settings { current_limit_A: 1.3, resistance_ohm: 9.0, ..settings };
    let mut stand = Stand::with(&settings);
    stand.tick(Some(Segment::voltage(&HW(), 1, u16::MAX, 10.0)));
    let (drive, report) = stand.turn(0.0, 2);
    assert_eq!((drive.counts(), report.limits), (2_250, Limits::VOLTAGE), "6 V");
}

#[test]
fn a_late_segment_and_a_segment_without_successor_say_starved_and_hold() {
    let mut stand = Stand::new();
    stand.turn(0.0, 10);
    stand.tick(Some(Segment::rate(&HW(), 5, 100, 1.0, 1.2)));
    let late = stand.tick(None).1;
    assert!(late.limits.contains(Limits::STARVED));
    assert!(!stand.turn(0.0, 50).1.limits.contains(Limits::STARVED));
    let held: Vec<Report> = (0..900).map(|_| stand.turn(0.0, 1).1).collect();
    assert_eq!(held[800..].iter().filter(|r| r.limits.contains(Limits::STARVED)).count(), 10, "once in a millisecond");
    let last = held.last().unwrap();
    assert!((last.rate_command as f64 / rate_unit(&HW()) - 1.2).abs() < 1e-7, "the slope is over");
    assert!(last.limits_since(&late).contains(Limits::STARVED), "seen by counting, too");
}

#[test]
fn the_regulated_rate_has_no_lag_at_constant_acceleration_and_is_smooth() {
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
    // Counts without edge times would make 0.07 rad/s of it.
    assert!(worst < 2e-3, "{worst}");
    for rate in [0.02, 1.0, -1.0, 10.0] {
        let mut slow = Stand::new();
        slow.turn(rate, 8_000);
        let last = (0..1_000).fold(0.0_f64, |worst, _| {
            slow.turn(rate, 1);
            worst.max((slow.rate_rad_s() - rate).abs())
        });
        assert!(last < 1e-3, "{rate}: {last}");
    }
}

#[test]
fn every_bad_setting_is_refused_by_its_name() {
    type Set = fn(&mut Settings) -> &mut f64;
    let all: [(&str, Set); 23] = [
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
        ("approach_rad_s", |s| &mut s.approach_rad_s),
        ("safety.over_current_A", |s| &mut s.safety.over_current_A),
        ("safety.stall_current_A", |s| &mut s.safety.stall_current_A),
        ("safety.stall_s", |s| &mut s.safety.stall_s),
        ("safety.encoder_lost_rad_s", |s| &mut s.safety.encoder_lost_rad_s),
        ("safety.encoder_lost_s", |s| &mut s.safety.encoder_lost_s),
        ("safety.supply_low_share", |s| &mut s.safety.supply_low_share),
        ("safety.supply_high_share", |s| &mut s.safety.supply_high_share),
        ("safety.tracking_s", |s| &mut s.safety.tracking_s),
        ("safety.temperature_C", |s| &mut s.safety.temperature_C),
        ("safety.sensor_silent_s", |s| &mut s.safety.sensor_silent_s),
        ("safety.index_off_counts", |s| &mut s.safety.index_off_counts),
    ];
    for (name, field) in all {
        for bad in [f64::NAN, f64::INFINITY, -100.0] {
            let mut settings = Settings::default();
            *field(&mut settings) = bad;
            let error = Config::new(&settings, &HW()).unwrap_err();
            assert_eq!(error.parameter(), name);
            assert!(error.to_string().contains(name));
        }
    }
}

/// Hardware on which nothing happens but time.
#[derive(Default)]
struct Still(u64);

impl TickIo for Still {
    fn sense(&mut self) -> Sensed {
        self.0 += 1;
        Sensed { tick: self.0, edge_age: i32::MAX as u32, current: CurrentCode(2048), supply: SupplyCode(2482), ..Sensed::default() }
    }
    fn index(&mut self) -> Option<EncoderCount> {
        None
    }
    fn drive(&mut self, _: Drive) {}
}

#[test]
fn compensation_and_settings_act_whole_and_in_sequence() {
    let config = |torque_N_m: f64| {
        let harmonics = [7, 14, 21].map(|order| Harmonic { order, torque_N_m, phase_rad: 0.3 });
        let compensation =
            Compensation { coulomb_N_m: torque_N_m, harmonics: Harmonics::of(harmonics).unwrap(), ..Compensation::default() };
        Config::new(&Settings { compensation, ..Settings::default() }, &HW()).unwrap()
    };
    let mailboxes = Mailboxes::new();
    let mut interrupt = Interrupt::new(SpeedLoop::new(config(1e-3)), &mailboxes);
    let mut io = Still::default();
    interrupt.run(&mut io);
    assert_eq!(interrupt.compensation(), config(1e-3).compensation());
    mailboxes.compensation.post(config(2e-3).compensation());
    interrupt.run(&mut io);
    assert_eq!(interrupt.compensation(), config(2e-3).compensation());
    mailboxes.config.post(config(3e-3));
    interrupt.run(&mut io);
    assert_eq!(interrupt.compensation(), config(3e-3).compensation());
}

#[test]
fn the_interrupt_reports_each_millisecond_and_commands_act_in_their_tick() {
    let mailboxes = Mailboxes::new();
    let mut interrupt = Interrupt::new(SpeedLoop::new(Config::new(&Settings::default(), &HW()).unwrap()), &mailboxes);
    let mut io = Still::default();
    for n in 1..=100 {
        if n % 10 == 5 {
            mailboxes.commands.post(Command { segment: Segment::voltage(&HW(), n + 5, 10, 0.1 * n as f64), ..Command::default() });
        }
        interrupt.run(&mut io);
        if let Some(report) = mailboxes.reports.take() {
            assert_eq!((n % 10, report.tick), (0, n));
            assert_eq!(report.mode == Mode::Voltage, n >= 10, "{n}");
        }
    }
}

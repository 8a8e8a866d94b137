//! Drift of a simulated gyro, measured by the firmware's app over the console: results, and faults during a cycle.
#![allow(clippy::unwrap_used)]

use crate::common::host;
use hal_sim::board::linear_motor::LinearMotor;
use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::faults::FaultKind;
use hal_sim::gyro::{AngleSensor, DEG_H, GyroPort, OneAxis, Orientation, SingleAxis, Site, ThreeAxis, Torquer};
use hal_sim::session::StandSetup;
use host::Host;
use std::f64::consts::PI;

impl Host<'_, '_> {
    async fn until_idle(&self) {
        while !self.query("DRIF:STAT?").await.starts_with("IDLE,CLOSED") {
            self.wait_s(0.2).await;
        }
    }

    async fn until_pulses(&self) {
        while !self.query("DRIF:STAT?").await.starts_with("PULSES,OPEN") {
            self.wait_s(0.02).await;
        }
    }

    /// The number in a field of a reply, without its unit.
    async fn number(&self, query: &str, field: usize) -> f64 {
        let reply = self.query(query).await;
        let text = reply.split(',').nth(field).unwrap_or_else(|| panic!("{query}: {reply}"));
        text.split(' ').next().unwrap().parse().unwrap_or_else(|_| panic!("{query}: {reply}"))
    }

    async fn verdict(&self) -> String {
        self.query("DRIF:CYCL?").await.split(',').nth(12).unwrap_or_default().to_owned()
    }

    fn inject(&self, what: FaultKind, size: Option<f64>) {
        self.controller.bench().borrow_mut().active_faults().inject(what, f64::INFINITY, size).unwrap();
    }

    fn set_orientation(&self, orientation: Orientation) {
        self.controller.bench().borrow_mut().gyro().unwrap().gyro().set_orientation(orientation);
    }
}

fn talk<T>(gyro: Box<dyn GyroPort>, script: impl AsyncFnOnce(&Host<'_, '_>) -> T) -> T {
    let clock = VirtualClock::default();
    let controller = Controller::new(&clock, &StandSetup::default(), LinearMotor::default(), flash(1), 1).unwrap().with_gyro(gyro, 1);
    let host = Host { controller: &controller };
    controller.line().send(b"HOST:UNATTended 1E6\n");
    controller.run(script(&host), |_| ()).unwrap()
}

fn usual() -> Box<SingleAxis> {
    Box::new(SingleAxis::default().seeded(1))
}

/// Pulses of a second: 25 times the scatter of those of 5 s.
const SHORT: &str = "DRIF:DUR 1 S;REST 1.5 S;RATE 0.1 DEG/S;COUN 4";

#[test]
fn a_session_in_two_positions_separates_own_and_apparent_drift() {
    let gyro = usual();
    let (own, apparent) = (gyro.own_rad_s() / DEG_H, gyro.apparent_rad_s(0.0) / DEG_H);
    assert!((own - 1.5).abs() < 1e-9 && (apparent + 0.893_306_7).abs() < 1e-6);
    talk(gyro, async |host| {
        host.wait_s(1.0).await;
        host.command("DRIF:COUN 4;REST 3 S").await;
        let mut rates = Vec::new();
        for (register, expected) in [("OWN", own), ("APP", apparent)] {
            host.command(&format!("DRIF:PAIR {register}")).await;
            for (position, turned_rad) in [(1, 0.0), (2, PI)] {
                host.set_orientation(Orientation { turned_rad, ..Orientation::default() });
                host.command(&format!("DRIF:POS {position};STAR")).await;
                host.until_idle().await;
                assert_eq!((host.number("DRIF?", 0).await, host.number("DRIF?", 1).await), (4.0, 0.0));
                rates.push(host.number("DRIF?", 2).await / DEG_H);
                assert!(host.number("DRIF?", 3).await / DEG_H < 0.02, "the scatter of four cycles");
            }
            // The register holds the raw sums: 1e-4 of inequality is a true torque of −ε w/2 = −0.009 °/h in both positions, own drift to
            // it.
            let held = host.number("DRIF:PAIR?", 4).await / DEG_H;
            assert!((held - expected).abs() < 0.03, "{register}: {held}");
            assert_eq!(host.query("DRIF:PAIR?").await.split(',').nth(2), Some("4"));
        }
        // Noise of 0.5″ and of a code, a quantiser of 1.1″: some 0.004 °/h for each cycle of 5 s.
        assert!(((rates[0] + rates[1]) / 2.0 - own).abs() < 0.015, "{rates:?}");
        assert!(((rates[0] - rates[1]) / 2.0 - apparent).abs() < 0.015, "{rates:?}");
    });
}

#[test]
fn a_fault_in_a_cycle_closes_the_loop_and_excludes_the_cycle_from_the_mean() {
    type Spoil = fn(&Host<'_, '_>);
    let cases: [(&str, bool, Spoil); 5] = [
        ("angle sensor saturated", false, |host| host.inject(FaultKind::AngleSensorOff, None)),
        ("current limited", false, |host| host.inject(FaultKind::TorquerLimit, Some(0.01))),
        ("emergency stop", true, |host| host.controller.line().send(&[0x18])),
        ("host silent", true, |host| host.inject(FaultKind::LineOff, None)),
        ("aborted", true, |host| host.controller.line().send(b"DRIF:ABOR\n")),
    ];
    for (reason, ends, spoil) in cases {
        talk(usual(), async |host| {
            host.wait_s(0.1).await;
            host.command(SHORT).await;
            host.command("HOST:UNATTended 0;ARM 0.5 S;:DRIF:STAR").await;
            for _ in 0..50 {
                host.wait_s(0.1).await;
                host.command("HOST:ALIVe").await;
                if host.query("DRIF:STAT?").await.starts_with("PULSES") {
                    break;
                }
            }
            let pulses = host.query("DRIF:STAT?").await;
            assert!(pulses.starts_with("PULSES,OPEN,0,4"), "{reason}: {pulses}");
            spoil(host);
            // The host is armed for half a second.
            host.wait_s(if reason == "host silent" { 0.6 } else { 0.02 }).await;
            host.controller.bench().borrow_mut().active_faults().clear(FaultKind::LineOff);
            if reason == "host silent" {
                host.wait_s(0.1).await;
            }
            let state = host.query("DRIF:STAT?").await;
            assert!(state.contains(",CLOSED,1,4"), "{reason}: {state}");
            assert_eq!(state.starts_with("IDLE"), ends, "{reason}: {state}");
            assert_eq!(host.verdict().await, reason);
            assert!(host.query("DRIF?").await.starts_with("0,1,9.91E37"), "{reason}");
            // The closed loop returns the angle of the pulse to zero.
            host.controller.bench().borrow_mut().active_faults().clear(FaultKind::AngleSensorOff);
            host.controller.bench().borrow_mut().active_faults().clear(FaultKind::TorquerLimit);
            host.query("DRIF:ABOR").await;
            host.wait_s(3.0).await;
            let volts = host.controller.bench().borrow_mut().gyro().unwrap().gyro().sensor_V();
            assert!(volts.abs() < 0.005, "{reason}: {volts} V");
        });
    }
}

#[test]
fn a_session_continues_after_a_bad_cycle_and_averages_the_good_cycles() {
    talk(usual(), async |host| {
        host.wait_s(1.0).await;
        host.command(SHORT).await;
        host.command("DRIF:STAR").await;
        host.until_pulses().await;
        host.inject(FaultKind::TorquerLimit, Some(0.01));
        host.wait_s(0.5).await;
        host.controller.bench().borrow_mut().active_faults().clear(FaultKind::TorquerLimit);
        host.until_idle().await;
        let reply = host.query("DRIF?").await;
        assert!(reply.starts_with("3,1,"), "{reply}");
        let total = 1.5 - 0.893_306_7;
        let found = host.number("DRIF?", 2).await / DEG_H;
        assert!((found - total).abs() < 0.3, "{found}");
    });
}

#[test]
fn invalid_parameters_are_refused_in_one_line() {
    talk(usual(), async |host| {
        host.wait_s(0.1).await;
        for (command, reply) in [
            ("DRIF:DUR 0 S;STAR", "104,\"Setting refused; duration of a pulse must be 1 ms to 60 s\""),
            ("DRIF:DUR 5 S;RATE 0;STAR", "104,\"Setting refused; rate of a pulse is less than a step of the torquer, or above its limit\""),
            ("DRIF:RATE 1 DEG/S;STAR", "104,\"Setting refused; rate of a pulse is less than a step of the torquer, or above its limit\""),
        ] {
            assert_eq!(host.query(&format!("{command};:SYST:ERR?")).await, "");
            assert_eq!(host.query("SYST:ERR?").await, reply);
        }
        host.command("DRIF:RATE 0.05 DEG/S;STAR").await;
        assert_eq!(host.query("DRIF:STAR;:SYST:ERR?").await, "");
        assert!(host.query("SYST:ERR?").await.contains("a drift measurement runs"));
        assert_eq!(host.query("SETT:correction_1_s 1").await, "");
        assert!(host.query("SYST:ERR?").await.contains("DRIFt:ABORt first"));
    });
}

#[test]
fn a_stand_without_a_gyro_reports_no_angle_sensor() {
    let clock = VirtualClock::default();
    let controller = Controller::new(&clock, &StandSetup::default(), LinearMotor::default(), flash(1), 1).unwrap();
    let host = Host { controller: &controller };
    let script = async {
        host.wait_s(0.1).await;
        host.command("DRIF:STAR").await;
        assert_eq!(host.verdict().await, "no angle sensor");
        assert!(host.query("DRIF:STAT?").await.starts_with("IDLE"));
    };
    controller.run(script, |_| ()).unwrap();
}

#[test]
fn a_vibration_with_the_set_period_cancels() {
    // 0.7 s and 20″: an oscillation of unfavourable phase causes some °/h with pulses of 1 s.
    let off = |period: &'static str| {
        let mut gyro = SingleAxis::default();
        gyro.torquer = Torquer::ideal();
        gyro.vibration.amplitude_rad = 20.0 * DEG_H;
        gyro.vibration.frequency_Hz = 1.0 / 0.7;
        let total = gyro.own_rad_s() + gyro.apparent_rad_s(0.0);
        talk(Box::new(gyro.seeded(1)), async |host| {
            host.wait_s(0.1).await;
            host.command(SHORT).await;
            host.command(&format!("DRIF:PER {period} S;STAR")).await;
            host.until_idle().await;
            let sigma = host.number("DRIF?", 3).await;
            ((host.number("DRIF?", 2).await - total).abs() / DEG_H, sigma / DEG_H)
        })
    };
    let (with, without) = (off("0.7"), off("0"));
    assert!(with.0 < 0.3 && with.1 < 0.3, "{with:?}");
    assert!(without.1 > 3.0 * with.1, "{without:?} {with:?}");
}

#[test]
fn one_axis_of_a_gimballed_platform_is_measured_correctly() {
    let site = Site::default();
    let platform = ThreeAxis::new([1.0, -0.5, 2.0].map(|rate| rate * DEG_H), site.rate_rad_s(0.0), [0.0; 3]);
    let mut gyro = OneAxis::new(platform, 0, 1);
    gyro.sensor = AngleSensor::default();
    let expected = 1.0 - site.rate_rad_s(0.0)[0] / DEG_H;
    talk(Box::new(gyro), async |host| {
        host.wait_s(1.0).await;
        host.command("DRIF:COUN 2;REST 3 S;STAR").await;
        host.until_idle().await;
        let found = host.number("DRIF?", 2).await / DEG_H;
        // The coupling of the gimbals contributes 0.002 °/h, the noise of two cycles 0.005 °/h.
        assert!((found - expected).abs() < 0.02, "{found} {expected}");
    });
}

#[test]
fn a_drift_measurement_does_not_affect_the_drive() {
    let turned = |measures: bool| {
        talk(usual(), async |host| {
            host.wait_s(0.1).await;
            host.command(SHORT).await;
            host.command("SOUR:MODE RATE;RATE 1 RAD/S;:OUTP ON").await;
            // The same number of bytes at the same times.
            host.command(if measures { "DRIF:STAR" } else { "DRIF:ABOR" }).await;
            let mut trace = Vec::new();
            for _ in 0..300 {
                host.wait_s(0.01).await;
                let bench = host.controller.bench().borrow();
                trace.push((bench.plant().true_theta_rad(), bench.plant().true_rate_rad_s(), bench.plant().mean_current_A()));
            }
            let phase = host.query("DRIF:STAT?").await;
            (trace, phase)
        })
    };
    let (with, without) = (turned(true), turned(false));
    assert!(with.1.starts_with("PULSES,OPEN") && without.1.starts_with("IDLE,CLOSED"), "{} {}", with.1, without.1);
    assert!(with.0 == without.0, "equal bit for bit");
    assert!((with.0[299].1 - 1.0).abs() < 0.05, "the drive turns");
}

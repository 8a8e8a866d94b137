//! Measurement effects: channel readings of the rig and of the plant's sensor elements.
//!
//! Lag and delay are filters of the finished series in the fitted model; here only the plant's are tested.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{BOTH, Bench, Drive, Kind, Setup, close, close_rel};
use std::f64::consts::TAU;

const FLYWHEEL: Drive = Drive { inertia: 1e9, motor_constant: 0.02, resistance: 2.0 };

/// A flywheel at this rate, seen with one effect after a second.
fn turning(kind: Kind, id: &str, parameters: &[f64], omega: f64) -> Bench {
    let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[(id, parameters)])).spin(omega);
    bench.hold(0.0, 1.0);
    bench
}

#[test]
fn an_eccentric_encoder_changes_the_angle_and_not_a_separate_rate_sensor() {
    let (e, phase) = (0.004, 0.9);
    for kind in BOTH {
        for n in [1.0, 2.0] {
            for omega in [7.0, -13.0] {
                let bench = turning(kind, "encoder-eccentricity", &[e, n, phase], omega);
                let seen = bench.seen(false);
                close(seen.theta, bench.theta() + e * (n * bench.theta() + phase).sin(), 1e-12, &format!("{kind:?} angle"));
                assert_eq!(seen.omega, bench.omega(), "{kind:?} rate");
            }
        }
    }
    // The rate from that encoder is the derivative of its reading.
    let bench = turning(Kind::Rig, "encoder-eccentricity", &[e, 2.0, phase], 7.0);
    let exact = 7.0 * (1.0 + e * 2.0 * (2.0 * bench.theta() + phase).cos());
    close_rel(bench.seen(true).omega, exact, 1e-9, "derivative");
}

#[test]
fn the_eccentricity_error_depends_on_the_true_angle() {
    // The reading instead of the true angle would leave n e²/2 at twice the harmonic order: 3e-4 rad.
    let (e, n, phase) = (0.012, 4.0, 0.9);
    for omega in [7.0, -13.0, 3.1] {
        let bench = turning(Kind::Rig, "encoder-eccentricity", &[e, n, phase], omega);
        let shown = bench.seen(false).theta;
        let error = bench.seen_at(shown).theta - bench.theta();
        close(error, shown - bench.theta(), e * (n * e).powi(3), "angle");
    }
}

#[test]
fn scale_bias_and_nonlinearity_of_the_rate_follow_their_equations() {
    for kind in BOTH {
        for omega in [11.0, -11.0] {
            let seen = |id: &str, p: &[f64]| turning(kind, id, p, omega).seen(false);
            // The back-EMF brakes the flywheel by 2e-13/s.
            close(seen("rate-scale", &[0.03]).omega, 1.03 * omega, 1e-9, "scale");
            close(seen("rate-bias", &[-0.2]).omega, omega - 0.2, 1e-9, "bias");
            let curved = omega * (1.0 + 1e-3 * 11.0 + 5e-5 * 121.0);
            close(seen("rate-scale-nonlinearity", &[1e-3, 5e-5]).omega, curved, 1e-9, "curvature");
            assert!((seen("rate-scale", &[0.03]).theta - omega).abs() < 1e-9, "the angle is untouched");
        }
    }
}

#[test]
fn the_bias_depends_on_the_temperature() {
    for kind in BOTH {
        for temp_C in [25.0, 45.0, 0.0] {
            let setup = Setup::by_voltage(FLYWHEEL, &[("rate-bias-temperature", &[0.02])]).warm(temp_C);
            let mut bench = Bench::new(kind, &setup);
            bench.hold(0.0, 0.1);
            close(bench.seen(false).omega, 0.02 * (temp_C - 25.0), 1e-9, &format!("{kind:?} {temp_C}"));
        }
    }
}

#[test]
fn a_g_sensitive_sensor_shows_gravity_once_per_turn_without_torque() {
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[("rate-g-sensitivity", &[0.05, 0.4])])).spin(TAU);
        for _ in 0..100 {
            bench.hold(0.0, 0.01);
            close(bench.seen(false).omega - bench.omega(), 0.05 * (bench.theta() + 0.4).sin(), 1e-12, "by the angle");
        }
        close(bench.omega(), TAU, 1e-9, "the rate itself is even");
    }
}

#[test]
fn offset_and_scale_of_the_current_sensor_change_the_reading_and_not_the_current() {
    for kind in BOTH {
        for (id, p, exact) in [("current-offset", 0.03, 1.53), ("current-scale", -0.04, 1.5 * 0.96)] {
            let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[(id, &[p])]));
            bench.hold(3.0, 1e-3);
            close(bench.seen(false).current, exact, 1e-12, &format!("{kind:?} {id}"));
            close_rel(bench.omega(), 0.02 * 1.5 * 1e-3 / 1e9, 1e-12, "the true current turns the rotor");
        }
    }
}

/// The plant under a constant torque from rest: a ramp of the rate.
fn ramp(id: &str, p: f64) -> Bench {
    Bench::new(Kind::Plant, &Setup::by_torque(1e-4, &[(id, &[p])]))
}

#[test]
fn a_lagging_sensor_follows_a_ramp_delayed_by_its_time_constant() {
    // Also far below the tick, where the lag is a delay.
    for tau in [6e-3, 1e-3, 2e-4, 5e-5, 1e-6] {
        let mut bench = ramp("sensor-lag", tau);
        for n in 1..=1000 {
            bench.hold(1e-3, 1e-4);
            let t = f64::from(n) * 1e-4;
            let exact = 10.0 * (t - tau * (1.0 - (-t / tau).exp()));
            // Between ticks the sensor element assumes a ramp.
            close(bench.seen(false).omega, exact, 1e-9, &format!("lag {tau} at {t}"));
        }
    }
}

#[test]
fn a_lagging_sensor_responds_to_a_step_by_its_exponential() {
    // A hundred thousand rad/s² for one tick, then nothing: a step of 10 rad/s in 1e-4 s.
    let tau = 6e-3;
    let mut bench = ramp("sensor-lag", tau);
    bench.hold(10.0, 1e-4);
    for n in 1..=300 {
        bench.hold(0.0, 1e-4);
        let t = f64::from(n) * 1e-4;
        let exact = 10.0 - 10.0 * tau / 1e-4 * ((-t / tau).exp() - (-(t + 1e-4) / tau).exp());
        close(bench.seen(false).omega, exact, 1e-9, &format!("at {t}"));
    }
}

#[test]
fn a_delayed_sensor_shows_the_earlier_rate() {
    for skew in [5e-5, 1.5e-4, 7.3e-3] {
        let mut bench = ramp("time-skew", skew);
        for n in 1..=500 {
            bench.hold(1e-3, 1e-4);
            let t = f64::from(n) * 1e-4;
            close(bench.seen(false).omega, 10.0 * (t - skew).max(0.0), 1e-10, &format!("skew {skew} at {t}"));
        }
    }
}

#[test]
fn a_delayed_sensor_starts_with_the_initial_rate() {
    let mut bench = Bench::new(Kind::Plant, &Setup::by_torque(1e-4, &[("time-skew", &[5e-3])])).spin(10.0);
    for _ in 0..100 {
        assert_eq!(bench.seen(false).omega, 10.0);
        bench.hold(0.0, 1e-4);
    }
}

#[test]
fn lost_counts_shift_the_angle_from_their_time_on_and_move_nothing() {
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_voltage(FLYWHEEL, &[("lost-counts", &[-0.012, 0.5003])])).spin(9.0);
        bench.hold(0.0, 0.5);
        close(bench.seen(false).theta, bench.theta(), 1e-15, &format!("{kind:?} before"));
        bench.hold(0.0, 0.001);
        close(bench.seen(false).theta, bench.theta() - 0.012, 1e-15, &format!("{kind:?} after"));
        assert_eq!(bench.seen(false).omega, bench.omega(), "{kind:?}: a separate rate sensor");
    }
    let rig = turning(Kind::Rig, "lost-counts", &[-0.012, 0.5003], 9.0);
    assert_eq!(rig.seen(true).jumped, -0.012, "the sum of the jumps is reported to the filter of a derived rate");
}

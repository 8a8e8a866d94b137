//! Torque effects: each against a closed form, in the rig and in the plant.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{BOTH, Bench, Draw, Kind, ROW_S, Setup, THEORY, close, close_rel};
use std::f64::consts::{PI, TAU};

/// The rig's midpoint rule is off by (rate · h)³/6 in each step; the plant's fourth order by far less.
fn by_kind(kind: Kind, rig: f64, plant: f64) -> f64 {
    if kind == Kind::Rig { rig } else { plant }
}

const B: f64 = 2e-6;
const MC: f64 = 1e-3;

#[test]
fn the_steady_rates_match_theory_section_4() {
    for kind in BOTH {
        for (volt, steady) in [(1.0, 43.7469105), (3.0, 142.6099852), (6.0, 290.9045971)] {
            let setup = Setup::by_voltage(THEORY, &[("viscous", &[B]), ("coulomb", &[MC]), ("inductance", &[0.5e-3])]);
            let mut bench = Bench::new(kind, &setup).spin(steady * 0.99);
            bench.hold(volt, 12.0);
            // 21 time constants: e^-21 of a hundredth. docs/theory.md gives nine to ten digits.
            close_rel(bench.omega(), steady, 1e-8, &format!("{kind:?} at {volt} V"));
        }
    }
}

#[test]
fn a_coast_down_follows_the_closed_form_to_its_stop_time() {
    let stop_s = (1e-4 / B) * (1.0 + B * 100.0 / MC).ln();
    close(stop_s, 9.1160778, 5e-8, "theory's digits");
    for kind in BOTH {
        let setup = Setup::by_torque(1e-4, &[("viscous", &[B]), ("coulomb", &[MC])]);
        let mut bench = Bench::new(kind, &setup).spin(100.0);
        bench.hold(0.0, 2.0);
        close(bench.omega(), 76.4736635, 1e-7, &format!("{kind:?}, digits of the theory"));
        bench.hold(0.0, 7.116);
        // The last piece ends a microsecond before or after the stop.
        let last_s = stop_s - bench.t_s;
        for (beyond_s, moves) in [(-1e-6, true), (1e-6, false)] {
            let mut again = Bench::new(kind, &setup).spin(bench.omega());
            again.hold(0.0, last_s + beyond_s);
            assert_eq!(again.omega() != 0.0, moves, "{kind:?} {beyond_s:e} s from the stop: {}", again.omega());
        }
    }
}

#[test]
fn a_voltage_step_has_both_poles_of_theory_section_4() {
    let (j, k, r, l) = (1e-4, 0.02, 2.3, 0.5e-3);
    // Roots of J L s² + (J R + b L) s + K² + R b.
    let (a2, a1, a0): (f64, f64, f64) = (j * l, j * r + B * l, k * k + r * B);
    let root = (a1 * a1 - 4.0 * a2 * a0).sqrt();
    let (fast, slow) = ((-a1 - root) / (2.0 * a2), 2.0 * a0 / (-a1 - root));
    close(fast, -4598.2602, 5e-5, "theory's fast pole");
    close(slow, -1.75979602, 5e-9, "theory's slow pole");
    let steady = 3.0 * k / a0;
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_voltage(THEORY, &[("viscous", &[B]), ("inductance", &[l])]));
        for n in 1..=1000 {
            bench.hold(3.0, ROW_S);
            let t = f64::from(n) * ROW_S;
            let exact = steady * (1.0 - (fast * (slow * t).exp() - slow * (fast * t).exp()) / (fast - slow));
            // Rig: within a step the rate is taken as constant, so that a current that lags by L/R sees it half a step old: at most
            // α K² h L/R² of torque against K² α/R, 1e-4 of the rate after the first rows. Plant: two steps per L/R, (0.5)⁵/120 a step.
            close(bench.omega(), exact, by_kind(kind, 4e-5, 2e-6) * steady, &format!("{kind:?} at {t}"));
        }
    }
}

#[test]
fn viscous_friction_lets_the_rate_fall_exponentially() {
    for kind in BOTH {
        let (j, b) = (1e-4, 5e-4);
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("viscous", &[b])])).spin(30.0);
        bench.hold(0.0, 0.7);
        let left = (-b / j * 0.7_f64).exp();
        // Midpoint: (b h/J)²/6 per unit of b t/J = 3.5: 1.5e-5.
        close_rel(bench.omega(), 30.0 * left, by_kind(kind, 1.5e-5, 1e-11), "rate");
        close_rel(bench.theta(), 30.0 * j / b * (1.0 - left), by_kind(kind, 1.5e-5, 1e-11), "angle");
    }
}

#[test]
fn coulomb_friction_holds_exactly_up_to_its_torque() {
    for kind in BOTH {
        let c = 1.0 / 1024.0; // exact in binary, so that "equal" is equal
        for sign in [1.0, -1.0] {
            let setup = Setup::by_torque(1e-4, &[("coulomb", &[c])]);
            let mut bench = Bench::new(kind, &setup);
            bench.hold(sign * c, 1.0);
            assert_eq!((bench.omega(), bench.theta()), (0.0, 0.0), "{kind:?} at the level");
            let mut bench = Bench::new(kind, &setup);
            bench.hold(sign * c * (1.0 + 1e-9), 1.0);
            // (τ − c)/J t: the net torque is 1e-9 of the Coulomb torque, with a rounding error of 1e-16/1e-9.
            close_rel(bench.omega(), sign * c * 1e-9 / 1e-4, 1e-6, &format!("{kind:?} just above"));
        }
    }
}

#[test]
fn coulomb_friction_opposes_both_directions() {
    for kind in BOTH {
        for sign in [1.0, -1.0] {
            let mut bench = Bench::new(kind, &Setup::by_torque(1e-4, &[("coulomb", &[1e-3])])).spin(sign * 10.0);
            bench.hold(0.0, 0.5);
            close(bench.omega(), sign * 5.0, 1e-11, "a straight line");
            // Against a torque of 3 c it stops after 10 J/(4 c) = 0.125 s + … and goes the other way with 2 c/J.
            let mut bench = Bench::new(kind, &Setup::by_torque(1e-4, &[("coulomb", &[1e-3])])).spin(sign * 10.003);
            bench.hold(-sign * 3e-3, 0.5);
            let stop_s = 10.003 / 40.0;
            close(bench.omega(), -sign * 20.0 * (0.5 - stop_s), 1e-9, &format!("{kind:?} reversal within a row"));
        }
    }
}

/// Steady rate under a torque, after 60 time constants.
fn steady(kind: Kind, effects: &[(&str, &[f64])], torque: f64, near: f64) -> f64 {
    let mut bench = Bench::new(kind, &Setup::by_torque(1e-5, effects)).spin(near);
    bench.hold(torque, 3.0);
    bench.omega()
}

#[test]
fn asymmetric_friction_and_load_follow_their_torque_balances() {
    let (b, c, d, e, t) = (2e-4, 1e-3, 3e-4, 4e-5, 5e-3);
    for kind in BOTH {
        let list: &[(&str, &[f64])] = &[("viscous", &[b]), ("coulomb", &[c]), ("asymmetric-friction", &[d, e])];
        // e^-48 after 3 s with (b − e)/J = 16/s.
        close_rel(steady(kind, list, t, 1.0), (t - c - d) / (b + e), 1e-12, "forward");
        close_rel(steady(kind, list, -t, -1.0), -(t - c + d) / (b - e), 1e-12, "backward");
        let list: &[(&str, &[f64])] = &[("viscous", &[b]), ("coulomb", &[c]), ("load", &[d])];
        close_rel(steady(kind, list, t, 1.0), (t + d - c) / b, 1e-12, "with the load");
        close_rel(steady(kind, list, -t, -1.0), -(t - d - c) / b, 1e-12, "against the load");
    }
}

#[test]
fn a_load_shifts_the_stick_band() {
    for kind in BOTH {
        let list: &[(&str, &[f64])] = &[("coulomb", &[1e-3]), ("load", &[4e-4])];
        for (torque, moves) in [(5.9e-4, false), (6.1e-4, true), (-1.39e-3, false), (-1.41e-3, true)] {
            let mut bench = Bench::new(kind, &Setup::by_torque(1e-4, list));
            bench.hold(torque, 0.1);
            assert_eq!(bench.omega() != 0.0, moves, "{kind:?} {torque}");
        }
    }
}

#[test]
fn stribeck_friction_breaks_away_at_the_sum_of_both_torques_and_falls_with_the_rate() {
    let (c, s, v) = (1.0 / 1024.0, 1.0 / 512.0, 2.0);
    for kind in BOTH {
        let setup = Setup::by_torque(1e-4, &[("coulomb", &[c]), ("stribeck", &[s, v])]);
        let mut bench = Bench::new(kind, &setup);
        bench.hold(c + s, 1.0);
        assert_eq!(bench.omega(), 0.0, "{kind:?} at c + s");
        let mut bench = Bench::new(kind, &setup);
        bench.hold((c + s) * (1.0 + 1e-6), 0.1);
        assert!(bench.omega() > 0.0, "{kind:?} just above");
        // b above the steepest fall 0.86 s/v, so that every rate is a stable one.
        let b = 2.0 * s / v;
        for rate in [0.1, 1.0, 2.0, 5.0, 20.0] {
            let dry = c + s * (-(rate / v) * (rate / v)).exp();
            let list: &[(&str, &[f64])] = &[("viscous", &[b]), ("coulomb", &[c]), ("stribeck", &[s, v])];
            close_rel(steady(kind, list, b * rate + dry, rate * 1.1), rate, 1e-10, &format!("{kind:?} Coulomb torque at {rate}"));
        }
    }
}

#[test]
fn a_bristle_is_a_spring_for_small_motions() {
    let (j, c, sigma) = (1e-4, 1e-3, 0.1);
    let w = f64::sqrt(sigma / j);
    for kind in BOTH {
        // A ten-thousandth of the breakaway angle c/σ: Dahl's loss turns the phase by about as much.
        let amplitude = 1e-4 * c / sigma;
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("coulomb", &[c]), ("presliding", &[sigma])])).spin(amplitude * w);
        for n in 1..=600 {
            bench.hold(0.0, ROW_S);
            let t = f64::from(n) * ROW_S;
            // 3 periods. Midpoint: phase runs by (w h)²/6 · w t = 3e-3 at w h = 0.032; Dahl: a few 1e-4.
            close(bench.omega(), amplitude * w * (w * t).cos(), by_kind(kind, 5e-3, 1e-3) * amplitude * w, &format!("{kind:?} {t}"));
        }
    }
}

#[test]
fn a_bristle_dissipates_the_work_of_the_dahl_curve() {
    let (j, c, sigma) = (1e-4, 1e-3, 0.1);
    let z = c / sigma;
    let list: &[(&str, &[f64])] = &[("coulomb", &[c]), ("presliding", &[sigma])];
    for kind in BOTH {
        // From a fresh bristle: ½ J (ω0² − ω²) = c (x − z (1 − e^(−x/z))).
        let mut bench = Bench::new(kind, &Setup::by_torque(j, list)).spin(2.0);
        for _ in 0..100 {
            bench.hold(0.0, ROW_S);
            let x = bench.theta();
            let work = c * (x - z * (1.0 - (-x / z).exp()));
            // Energies of 2e-4 J; the rig's bristle is exact at a rate that is held over half a step.
            close(0.5 * j * (4.0 - bench.omega().powi(2)), work, by_kind(kind, 2e-8, 1e-11), &format!("{kind:?} loading"));
        }
        // Until it slides at c, then back by a torque: the bristle relaxes from +z to −z along 2 e^(−x/z) − 1.
        let mut turned = 0.0;
        let torque = -3.0 * c;
        let mut last = bench.omega();
        for _ in 0..100_000 {
            bench.hold(torque, 1e-5);
            if bench.omega() <= 0.0 {
                // The time of reversal, on the straight line between both steps.
                turned = bench.theta() + 0.5 * bench.omega() * 1e-5 * bench.omega() / (last - bench.omega());
                break;
            }
            last = bench.omega();
        }
        assert!(bench.omega() <= 0.0);
        for _ in 0..50 {
            bench.hold(torque, ROW_S);
            let x = turned - bench.theta();
            // −σz dx with z from the deflection at the turn, which is c/σ to e^−10 (x ≥ 10 z before it).
            let work = -torque * x - c * x + 2.0 * c * z * (1.0 - (-x / z).exp());
            close_rel(0.5 * j * bench.omega().powi(2), work, by_kind(kind, 2e-2, 1e-3), &format!("{kind:?} after the reversal at x = {x}"));
        }
    }
}

#[test]
fn a_sliding_bristle_transmits_the_coulomb_torque() {
    for kind in BOTH {
        let list: &[(&str, &[f64])] = &[("viscous", &[2e-4]), ("coulomb", &[1e-3]), ("presliding", &[0.5])];
        close_rel(steady(kind, list, 3e-3, 5.0), 10.0, 1e-9, &format!("{kind:?}"));
    }
}

#[test]
fn quadratic_drag_has_its_terminal_rate_and_hyperbolic_decay() {
    let (j, q) = (1e-4, 3e-6);
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("quadratic-drag", &[q])])).spin(-40.0);
        bench.hold(0.0, 2.0);
        // Midpoint: (q ω h/J)² = 1.4e-6 per unit of q ω t/J = 2.4.
        close_rel(bench.omega(), -40.0 / (1.0 + q * 40.0 * 2.0 / j), by_kind(kind, 1e-6, 1e-11), "hyperbola");
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("quadratic-drag", &[q])])).spin(35.0);
        bench.hold(q * 900.0, 16.0);
        // 2 q ω t/J = 28.8.
        close_rel(bench.omega(), 30.0, 1e-11, "terminal rate");
    }
}

#[test]
fn viscosity_falls_with_temperature_by_its_exponent() {
    let (j, b, kappa) = (1e-4, 5e-4, 0.02);
    for kind in BOTH {
        for temp_C in [25.0, 60.0, 5.0] {
            let setup = Setup::by_torque(j, &[("viscous", &[b]), ("viscous-temperature", &[kappa])]).warm(temp_C);
            let mut bench = Bench::new(kind, &setup).spin(30.0);
            bench.hold(0.0, 0.5);
            let rate = b / j * (-kappa * (temp_C - 25.0)).exp();
            close_rel(bench.omega(), 30.0 * (-rate * 0.5).exp(), by_kind(kind, 5e-5, 1e-9), &format!("{kind:?} {temp_C}"));
        }
    }
}

/// Cosine and sine amplitudes of the rate at harmonic order n over whole turns: rate ≈ mean + p cos nθ + q sin nθ.
fn rate_harmonic(bench: &mut Bench, input: f64, n: f64, turns: f64) -> (f64, f64) {
    let (mut p, mut q, mut turned) = (0.0, 0.0, 0.0);
    let begin = bench.theta();
    let mean = bench.omega();
    let (mut last, mut at) = (bench.omega() - mean, begin);
    while turned < turns * TAU {
        bench.hold(input, ROW_S);
        // Trapezoid over the angle; the last piece ends with the turn.
        let (now, theta) = (bench.omega() - mean, bench.theta());
        let full = theta - at;
        let part = (begin + turns * TAU - at).min(full);
        let (middle, value) = (at + 0.5 * part, 0.5 * (last + now));
        p += value * (n * middle).cos() * part;
        q += value * (n * middle).sin() * part;
        turned += part;
        if part < full {
            break;
        }
        (last, at) = (now, theta);
    }
    (p / (turns * PI), q / (turns * PI))
}

#[test]
fn cogging_modulates_the_rate_at_its_harmonic_order() {
    let (j, a, n, phase) = (2.5e-4, 2e-4, 7.0, 0.8);
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("cogging", &[a, n, phase])])).spin(20.0);
        let (p, q) = rate_harmonic(&mut bench, 0.0, n, 3.0);
        // J ω ω_θ = a sin(nθ + φ): −a/(J n ω) cos(nθ + φ) = −A cos φ cos nθ + A sin φ sin nθ.
        // The next harmonic of the ripple, A²/4ω, is at 2n. 0.14 rad per row: 0.14²/12 by the trapezoid, 0.14²/24 by the rig.
        let size = a / (j * n * 20.0);
        close(p, -size * phase.cos(), 5e-3 * size, &format!("{kind:?} cosine"));
        close(q, size * phase.sin(), 5e-3 * size, &format!("{kind:?} sine"));
        // Zero at the neighbouring harmonic orders.
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("cogging", &[a, n, phase])])).spin(20.0);
        let (p, q) = rate_harmonic(&mut bench, 0.0, n + 1.0, 3.0);
        assert!(p.hypot(q) < 5e-3 * size, "{kind:?} {p} {q}");
        // Energy, at any size of the ripple: ½ J (ω² − ω0²) = a/n (cos φ − cos(nθ + φ)).
        let (a, n) = (3e-3, 9.0);
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("cogging", &[a, n, phase])])).spin(3.0);
        for _ in 0..1000 {
            bench.hold(0.0, ROW_S);
            let gained = a / n * (phase.cos() - (n * bench.theta() + phase).cos());
            // 6e-4 J to and fro. Midpoint at w h = √(a n/J) h ≈ 0.01: (w h)² of it.
            close(0.5 * j * (bench.omega().powi(2) - 9.0), gained, by_kind(kind, 1e-7, 1e-12), &format!("{kind:?} energy"));
        }
    }
}

#[test]
fn cogging_and_unbalance_come_to_rest_at_the_stable_zero_of_the_torque() {
    let rest = |kind, list: &[(&str, &[f64])], from: f64| {
        let mut bench = Bench::new(kind, &Setup::by_torque(1e-4, list).at(from));
        // 4/s and 3/s: e^-48, e^-36.
        bench.hold(0.0, 12.0);
        bench.theta()
    };
    for kind in BOTH {
        for from in [-2.0, 0.1, 1.0, 2.5] {
            // Damping near critical: 2 √(a n J) = 8e-4.
            let at = rest(kind, &[("viscous", &[8e-4]), ("cogging", &[4e-4, 4.0, 1.1])], from);
            let argument = (4.0 * at + 1.1).rem_euclid(TAU);
            close(argument, PI, 1e-9, &format!("{kind:?} detent"));
            let at = rest(kind, &[("viscous", &[6e-4]), ("unbalance", &[1e-3, 0.7])], from);
            close((at + 0.7).rem_euclid(TAU), PI, 1e-6, &format!("{kind:?} heavy side down"));
        }
    }
}

/// The rate of an undamped oscillator about `rest`, let go at `rest + amplitude`, over three periods.
fn swings(kind: Kind, list: &[(&str, &[f64])], rest: f64, w: f64, amplitude: f64) {
    let mut bench = Bench::new(kind, &Setup::by_torque(1e-4, list).at(rest + amplitude));
    let rows = (3.0 * TAU / w / ROW_S) as usize;
    for n in 1..=rows {
        bench.hold(0.0, ROW_S);
        let phase = w * n as f64 * ROW_S;
        // Midpoint: (w h)²/6 of phase in each of w t = 19 rad; amplitude²/16 of an anharmonic one.
        let off = by_kind(kind, (w * ROW_S).powi(2) * 4.0, 1e-8) + amplitude * amplitude * 2.0;
        close(bench.theta() - rest, amplitude * phase.cos(), off * amplitude, &format!("{kind:?} angle"));
        close(bench.omega(), -amplitude * w * phase.sin(), off * amplitude * w, &format!("{kind:?} rate"));
    }
}

#[test]
fn an_unbalance_oscillates_as_a_pendulum() {
    for kind in BOTH {
        let (a, phase) = (2e-3, 0.6);
        swings(kind, &[("unbalance", &[a, phase])], PI - phase, (a / 1e-4_f64).sqrt(), 1e-3);
    }
}

#[test]
fn a_cable_spring_oscillates_about_its_rest_angle() {
    for kind in BOTH {
        let (k, rest) = (3e-3, -2.0);
        // Linear: any amplitude is suitable.
        swings(kind, &[("cable-spring", &[k, rest])], rest, (k / 1e-4_f64).sqrt(), 1e-3);
    }
}

#[test]
fn torque_ripple_modulates_torque_and_back_emf_alike() {
    let (k, r, a, n, phase) = (0.02, 2.0, 0.08, 5.0, 0.4);
    let drive = common::Drive { inertia: 1e9, motor_constant: k, resistance: r };
    for kind in BOTH {
        // A flywheel that nothing slows: i = −K(θ) ω/R, its mean over a row in closed form.
        let omega = 10.0;
        let mut bench = Bench::new(kind, &Setup::by_voltage(drive, &[("torque-ripple", &[a, n, phase])])).spin(omega);
        for m in 0..700 {
            let from = n * omega * f64::from(m) * ROW_S + phase;
            let to = from + n * omega * ROW_S;
            let mean = bench.hold(0.0, ROW_S);
            let exact = -k * omega / r * (1.0 + a * (from.cos() - to.cos()) / (to - from));
            // The rig uses the middle as mean: (n ω h)²/24 = 1e-4 of the ripple.
            close(mean, exact, by_kind(kind, 1.2e-4, 1e-9) * k * omega / r * a, &format!("{kind:?} row {m}"));
        }
        // Standing still at some angle: the torque is K(θ) u/R.
        for theta in [0.0, 0.3, 1.7, 4.0] {
            let mut bench = Bench::new(kind, &Setup::by_voltage(drive, &[("torque-ripple", &[a, n, phase])]).at(theta));
            bench.hold(2.0, ROW_S);
            let torque = k * (1.0 + a * (n * theta + phase).sin()) * 2.0 / r;
            close_rel(bench.omega(), torque * ROW_S / 1e9, 1e-9, &format!("{kind:?} at {theta}"));
        }
    }
}

#[test]
fn a_load_step_starts_at_its_time_within_a_row() {
    for kind in BOTH {
        for from_s in [0.01, 0.01234, 0.0123456] {
            let mut bench = Bench::new(kind, &Setup::by_torque(1e-4, &[("load-step", &[5e-4, from_s])]));
            bench.hold(0.0, 0.05);
            // The rig shares the row exactly; the plant finds when the rotor is no longer held, to a nanosecond.
            close(bench.omega(), 5.0 * (0.05 - from_s), by_kind(kind, 1e-13, 5e-9), &format!("{kind:?} {from_s} from rest"));
            let mut bench = Bench::new(kind, &Setup::by_torque(1e-4, &[("load-step", &[5e-4, from_s])])).spin(1.0);
            bench.hold(0.0, 0.05);
            // While the rotor turns, the stages of the plant resolve the jump at their own times only: half a tick at most, 5 rad/s² × 5e-5
            // s.
            close(bench.omega(), 1.0 + 5.0 * (0.05 - from_s), by_kind(kind, 1e-13, 2.5e-4), &format!("{kind:?} {from_s} turning"));
        }
    }
}

/// Complex division, for transfer functions.
fn ratio(n: (f64, f64), d: (f64, f64)) -> (f64, f64) {
    let s = d.0 * d.0 + d.1 * d.1;
    ((n.0 * d.0 + n.1 * d.1) / s, (n.1 * d.0 - n.0 * d.1) / s)
}

#[test]
fn a_shaft_follows_the_two_mass_transfer_function() {
    let (j, k, c, share): (f64, f64, f64, f64) = (2.5e-4, 0.6, 1e-3, 0.3);
    let (motor, platform) = (j * share, j * (1.0 - share));
    let resonance = (k * (1.0 / motor + 1.0 / platform)).sqrt();
    let antiresonance = (k / platform).sqrt();
    for kind in BOTH {
        for w in [0.5 * antiresonance, antiresonance, resonance, 1.5 * resonance] {
            let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("compliance", &[k, c, share])]));
            // c/2 (1/motor + 1/platform) = 9.5/s: e^-19 of the transient is left after 2 s. Then four periods are correlated.
            let dt: f64 = TAU / w / (TAU / w / 1e-4).round();
            let rows = (TAU / w / dt).round() as usize;
            let (mut a, mut b, mut mean) = (0.0, 0.0, 0.0);
            let settle = (2.0 / dt / rows as f64).ceil() as usize * rows;
            for n in 0..settle + 4 * rows {
                let t = n as f64 * dt;
                // The mean of sin over the row, so that a held value stands for it.
                bench.hold((w * (t + 0.5 * dt)).sin() * (0.5 * w * dt).sin() / (0.5 * w * dt) * 1e-3, dt);
                if n >= settle {
                    let phase = w * (t + dt);
                    mean += bench.omega() / (4 * rows) as f64;
                    a += bench.omega() * phase.sin() * 2.0 / (4 * rows) as f64;
                    b += bench.omega() * phase.cos() * 2.0 / (4 * rows) as f64;
                }
            }
            // (k + s c)/(s (Jm Jp s² + J (k + s c))) at s = iw.
            let inner = (-motor * platform * w * w + j * k, j * c * w);
            let g = ratio((k, c * w), (-w * inner.1, w * inner.0));
            let size = g.0.hypot(g.1) * 1e-3;
            // Rig: 14 to 40 steps per rad: implicit midpoint shifts w by (w h)²/12 = 5e-5, at the resonance (Q = 18) 4e-3 of the size.
            let off = by_kind(kind, 6e-3, 1e-3) * size;
            close(a, g.0 * 1e-3, off, &format!("{kind:?} w {w} in phase"));
            close(b, g.1 * 1e-3, off, &format!("{kind:?} w {w} across"));
            // The torque began with a sine: its momentum 1e-3/(J w) stays as a mean.
            close(mean, 1e-3 / (j * w), 2e-3 * size + 1e-6 / (j * w), &format!("{kind:?} w {w} mean"));
        }
    }
}

#[test]
fn at_the_antiresonance_the_motor_of_the_rig_stands_still() {
    let (j, k, share): (f64, f64, f64) = (2.5e-4, 0.6, 0.3);
    let platform = j * (1.0 - share);
    let w = (k / platform).sqrt();
    let mut bench = Bench::new(Kind::Rig, &Setup::by_torque(j, &[("compliance", &[k, 0.0, share])]));
    // The steady oscillation under τ sin wt: the shaft carries all of τ.
    let size = 1e-3 / (platform * w);
    bench.state_mut().omega = -size;
    let dt = 1e-4;
    for n in 0..5000 {
        bench.hold(1e-3 * (w * (f64::from(n) + 0.5) * dt).sin(), dt);
        assert!(bench.state().motor_omega.abs() < 5e-3 * size, "row {n}: {}", bench.state().motor_omega / size);
    }
}

#[test]
fn an_undamped_shaft_conserves_energy_and_momentum() {
    let (j, k, share): (f64, f64, f64) = (2.5e-4, 0.6, 0.3);
    let w = (k / (j * share * (1.0 - share))).sqrt();
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_torque(j, &[("compliance", &[k, 0.0, share])]));
        // A short torque pulse on the motor: the platform then turns at P/J (1 − cos wt), as the blow is short (w h = 0.011).
        let h = 1e-4;
        bench.hold(0.1, h);
        let rate = 0.1 * h / j;
        for n in 1..=2000 {
            bench.hold(0.0, h);
            let t = (f64::from(n) + 0.5) * h;
            let exact = rate * (1.0 - (w * t).cos());
            // 21 rad: the rig's implicit midpoint turns (w h)²/12 = 1e-5 of it; the blow's width 2e-5.
            close(bench.omega(), exact, 1e-3 * rate, &format!("{kind:?} at {t}"));
        }
        if kind == Kind::Rig {
            let s = bench.state();
            let momentum = j * (share * s.motor_omega + (1.0 - share) * s.omega);
            close_rel(momentum, 0.1 * h, 1e-12, "momentum");
            let energy = 0.5 * j * (share * s.motor_omega.powi(2) + (1.0 - share) * s.omega.powi(2)) + 0.5 * k * s.twist.powi(2);
            close_rel(energy, (0.1 * h).powi(2) / (2.0 * j * share), 1e-4, "energy of the blow on the motor");
        } else {
            // w h/12 of the blow's energy by its width.
            close_rel(bench.plant().mechanical_energy_J(), (0.1 * h).powi(2) / (2.0 * j * share), 1e-4, "energy");
        }
    }
}

#[test]
fn the_platform_rests_until_the_motor_closes_the_play() {
    let (j, share, gap, torque) = (2.5e-4, 0.3, 0.04, 5e-3);
    let setup = Setup::by_torque(j, &[("backlash", &[gap, 6.0, 0.02, share])]);
    // From the middle of the play: ½ τ/Jm t² = gap/2.
    let contact_s = (gap * j * share / torque).sqrt();
    for kind in BOTH {
        let mut bench = Bench::new(kind, &setup);
        // The rig's steps within a row are 70 µs.
        bench.hold(torque, contact_s - 1e-4);
        assert_eq!(bench.omega(), 0.0, "{kind:?} before");
        bench.hold(torque, 2e-4);
        assert!(bench.omega() > 0.0, "{kind:?} after");
        // Momentum: the impulse of the torque is in both masses.
        bench.hold(torque, 1.0);
        let impulse = torque * (contact_s + 1e-4 + 1.0);
        // Pressed together by then: c/2J_r rings down at 190/s.
        close_rel(bench.omega(), impulse / j, 1e-6, &format!("{kind:?} together"));
        // And back across the whole play, coasting meanwhile at a constant rate.
        let before = bench.omega();
        bench.hold(-torque, 0.5 * (2.0 * gap * j * share / torque).sqrt());
        // The remaining error is the release of the shaft's twist in contact, τ Jp/(J k) = 0.6 mrad: a few per cent of the play.
        let coasting = bench.omega();
        bench.hold(-torque, 0.2 * (2.0 * gap * j * share / torque).sqrt());
        close(bench.omega(), coasting, 1e-12, &format!("{kind:?} coasts ({before})"));
    }
}

#[test]
fn a_stuck_motor_stays_at_rest_within_the_play() {
    // Below the Coulomb torque neither motor nor twist moves.
    let list: &[(&str, &[f64])] = &[("coulomb", &[1e-3]), ("backlash", &[0.04, 6.0, 0.02, 0.3])];
    let mut bench = Bench::new(Kind::Rig, &Setup::by_torque(2.5e-4, list));
    bench.hold(9e-4, 5.0);
    assert_eq!((bench.state().twist, bench.omega()), (0.0, 0.0));
}

#[test]
fn a_platform_oscillates_on_the_shaft_of_a_stuck_motor() {
    // Motor stuck, platform swinging against it: √(k/Jp), and its mean twist is zero.
    let (j, k, share): (f64, f64, f64) = (2.5e-4, 0.6, 0.3);
    let list: &[(&str, &[f64])] = &[("coulomb", &[1.0]), ("compliance", &[k, 0.0, share])];
    let w = (k / (j * (1.0 - share))).sqrt();
    for kind in BOTH {
        let mut bench = Bench::new(kind, &Setup::by_torque(j, list)).spin(1.0);
        // The motor is stopped within 75 µs; a torque below its level does nothing.
        let mut greatest = 0.0_f64;
        for n in 1..=3000 {
            bench.hold(0.5, 1e-4);
            let t = f64::from(n) * 1e-4;
            greatest = greatest.max((bench.omega() - (w * t).cos()).abs());
        }
        // 17 rad at (w h)²/12 = 3e-6; the angle of the motor to its stop, Jm ω/c = 75 µs or 150 µs with the torque, is w · 75 µs of phase.
        assert!(greatest < 8e-3, "{kind:?} {greatest}");
    }
}

#[test]
fn two_coggings_add() {
    let mut draw = Draw(4);
    for kind in BOTH {
        let (a, b) = (draw.log(1e-4, 1e-3), draw.log(1e-4, 1e-3));
        let list: &[(&str, &[f64])] = &[("cogging", &[a, 5.0, 0.3]), ("cogging#2", &[b, 14.0, 2.0])];
        let mut bench = Bench::new(kind, &Setup::by_torque(2.5e-4, list)).spin(8.0);
        bench.hold(0.0, 0.4);
        let th = bench.theta();
        let gained = a / 5.0 * (0.3_f64.cos() - (5.0 * th + 0.3).cos()) + b / 14.0 * (2.0_f64.cos() - (14.0 * th + 2.0).cos());
        close(0.5 * 2.5e-4 * (bench.omega().powi(2) - 64.0), gained, by_kind(kind, 1e-6, 1e-11), &format!("{kind:?}"));
    }
}

//! Properties of the rig's step over random parameters: finite, second order, exact where documented, symmetric in direction.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{Bench, Draw, Drive, Kind, ROW_S, Setup, close, rig, span};
use drive_model::{Parameter, ParameterKind as Moves};
use drive_rig::{DriveState, Input, slide};

/// Within the range, a hundredth to a hundred times the start value (or the hidden one, where the start is zero).
fn drawn(draw: &mut Draw, p: &Parameter) -> f64 {
    // A friction e|ω| that drives in one direction is a source: the true motion diverges for a large one.
    let usual = [p.start, p.simulated_range.1].into_iter().map(f64::abs).find(|v| *v > 0.0).unwrap_or(1e-6);
    let value = match p.kind {
        Moves::Phase => draw.even(0.0, std::f64::consts::TAU),
        Moves::HarmonicOrder => draw.even(p.range.0, p.range.1).round(),
        Moves::Fraction => draw.even(p.range.0, p.range.1),
        Moves::EventTime => draw.even(0.0, 1.0),
        Moves::Signed => draw.signed_log(0.01 * usual, 100.0 * usual),
        Moves::NonNegative | Moves::Positive | Moves::Periodicity => draw.log(0.01 * usual, 100.0 * usual),
    };
    value.clamp(p.range.0, p.range.1)
}

#[test]
fn the_step_is_finite_for_any_parameters() {
    let mut draw = Draw(21);
    for card in drive_model::cards() {
        for _ in 0..12 {
            let parameters: Vec<f64> = card.parameters.iter().map(|p| drawn(&mut draw, p)).collect();
            let drive = Drive { inertia: draw.log(2e-5, 3e-3), motor_constant: draw.log(3e-3, 0.2), resistance: draw.log(0.3, 20.0) };
            for input in [Input::Voltage, Input::Current, Input::Torque] {
                let mut list = vec![("viscous".to_owned(), vec![draw.log(1e-7, 1e-3)]), ("coulomb".to_owned(), vec![draw.log(1e-6, 1e-2)])];
                list.retain(|e| e.0 != card.id);
                list.push((card.id.to_owned(), parameters.clone()));
                let rig = rig(drive, input, &list);
                let mut state = DriveState::turning(draw.signed_log(0.1, 50.0), draw.even(-3.0, 3.0));
                for n in 0..300 {
                    let row_s = if n % 3 == 0 { 1e-2 } else { ROW_S };
                    let size = match input {
                        Input::Voltage => 6.0,
                        Input::Current => 2.0,
                        Input::Torque => 0.02,
                        Input::Setpoint => 3.0,
                    };
                    let mean = rig.advance(&mut state, &span(f64::from(n) * 4e-3, row_s, draw.even(-size, size), None));
                    let s = [state.omega, state.theta, state.current, state.motor_omega, state.twist, state.bristle, state.heat_K, mean];
                    assert!(s.iter().all(|x| x.is_finite()), "{} {parameters:?} {input:?} {drive:?} row {n}: {s:?}", card.id);
                }
            }
        }
    }
}

#[test]
fn halving_the_row_quarters_the_error() {
    let drive = Drive { inertia: 2.5e-4, motor_constant: 0.0234, resistance: 2.32 };
    let lists: [&[(&str, &[f64])]; 6] = [
        &[("viscous", &[2e-3])],
        &[("viscous", &[2e-5]), ("coulomb", &[1e-3]), ("quadratic-drag", &[5e-6])],
        &[("cogging", &[5e-3, 9.0, 0.3])],
        &[("unbalance", &[5e-3, 0.3]), ("cable-spring", &[1e-3, 0.0])],
        &[("torque-ripple", &[0.1, 7.0, 0.3]), ("viscous", &[2e-5])],
        &[("coulomb", &[1e-3]), ("stribeck", &[4e-3, 8.0])],
    ];
    for list in lists {
        let end = |row_s: f64| {
            let mut bench = Bench::new(Kind::Rig, &Setup::by_voltage(drive, list)).spin(12.0);
            bench.tick_s = row_s;
            bench.hold(0.6, 0.256);
            bench.omega()
        };
        let exact = (4.0 * end(1.0 / 64_000.0) - end(1.0 / 32_000.0)) / 3.0;
        let (whole, half) = ((end(1e-3) - exact).abs(), (end(5e-4) - exact).abs());
        // 4, apart from the next order in h.
        assert!((3.2..5.0).contains(&(whole / half)), "{list:?}: {whole:e} {half:e}");
    }
}

/// The motion computed event by event, each phase by its parabola.
fn event_by_event(omega: f64, torque: f64, dry: f64, inertia: f64, h: f64) -> (f64, f64) {
    let (mut t, mut w, mut angle) = (0.0, omega, 0.0);
    for _ in 0..3 {
        let left = h - t;
        if left <= 0.0 {
            break;
        }
        let net = match (w > 0.0, w < 0.0) {
            (true, _) => torque - dry,
            (_, true) => torque + dry,
            _ if torque > dry => torque - dry,
            _ if torque < -dry => torque + dry,
            _ => break,
        };
        let a = net / inertia;
        let to_rest = if w != 0.0 && w * a < 0.0 { -w / a } else { f64::INFINITY };
        let part = left.min(to_rest);
        angle += w * part + 0.5 * a * part * part;
        w = if to_rest < left { 0.0 } else { w + a * part };
        t += part;
    }
    (w, angle)
}

#[test]
fn a_slide_equals_the_event_by_event_motion() {
    let mut draw = Draw(22);
    let mut rests = 0;
    for _ in 0..200_000 {
        let (j, h, dry) = (draw.log(1e-5, 1e-2), draw.log(1e-5, 1e-2), draw.log(1e-5, 1e-1));
        let torque = draw.signed_log(0.01 * dry, 100.0 * dry);
        // Rates comparable to the change in one step, and rest.
        let omega = if draw.even(0.0, 1.0) < 0.1 { 0.0 } else { draw.signed_log(0.01, 100.0) * dry * h / j };
        let (w, angle) = slide(omega, torque, dry, j, h);
        let (exact, turned) = event_by_event(omega, torque, dry, j, h);
        let scale = omega.abs() + (torque.abs() + dry) * h / j;
        close(w, exact, 1e-13 * scale, "rate");
        close(angle, turned, 1e-13 * scale * h, "angle");
        assert_eq!(w == 0.0, exact == 0.0, "equal at rest: {omega} {torque} {dry} {j} {h}");
        rests += usize::from(w == 0.0);
    }
    assert!((20_000..180_000).contains(&rests), "both cases occur: {rests}");
}

#[test]
fn a_slide_is_the_limit_of_moreau_steps() {
    let mut draw = Draw(23);
    for _ in 0..200 {
        let (j, h, dry) = (1e-4, 1e-3, 1e-3);
        let torque = draw.signed_log(1e-4, 1e-2);
        let omega = draw.signed_log(1e-4, 0.1);
        let (w, angle) = slide(omega, torque, dry, j, h);
        let (n, mut moreau, mut turned) = (10_000, omega, 0.0);
        let step = h / f64::from(n);
        for _ in 0..n {
            let free = moreau + step * torque / j;
            let next = free.signum() * (free.abs() - step * dry / j).max(0.0);
            turned += 0.5 * (moreau + next) * step;
            moreau = next;
        }
        // Moreau's own error at the one step that passes zero: 2 h/n dry/J.
        let off = 2.0 * step * dry / j;
        close(w, moreau, off * 1.001 + 1e-12, "rate");
        close(angle, turned, off * h * 1.001 + 1e-15, "angle");
    }
}

#[test]
fn a_shaft_is_accurate_to_a_twentieth_of_the_noise_and_play_to_a_hundredth() {
    let drive = Drive { inertia: 2.5e-4, motor_constant: 0.0234, resistance: 2.32 };
    let rub = [("coulomb".to_owned(), vec![9e-4]), ("viscous".to_owned(), vec![2e-5]), ("inductance".to_owned(), vec![2.38e-4])];
    for (id, parameters) in [
        ("compliance", vec![8.0, 1e-3, 0.3]),
        ("compliance", vec![0.6, 4e-4, 0.3]),
        ("backlash", vec![0.02, 8.0, 0.012, 0.3]),
        ("backlash", vec![0.032, 5.0, 0.004, 0.3]),
    ] {
        let list = [&[(id.to_owned(), parameters.clone())], &rub[..]].concat();
        let rig = rig(drive, Input::Voltage, &list);
        // Levels that make the shaft ring and hit both flanks; each thousandth in so many parts.
        let run = |parts: u32| -> Vec<f64> {
            let mut state = DriveState::turning(0.0, 0.0);
            let row = |n: u32| {
                let volt = if (n / 90).is_multiple_of(2) { 0.6 } else { -0.4 };
                for part in 0..parts {
                    let t_s = (f64::from(n) + f64::from(part) / f64::from(parts)) * ROW_S;
                    rig.advance(&mut state, &span(t_s, ROW_S / f64::from(parts), volt, None));
                }
                state.omega
            };
            (0..2_000).map(row).collect()
        };
        let (rows, exact) = (run(1), run(50));
        let square: f64 = rows.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum();
        let off = (square / rows.len() as f64).sqrt();
        println!("{id} {parameters:?}: {off:.1e} rad/s");
        // The default sensor's noise is 7e-3 rad/s.
        let most = if id == "backlash" { 7e-5 } else { 3.5e-4 };
        assert!(off < most, "{id} {parameters:?}: {off:e} rad/s");
    }
}

#[test]
fn mirrored_inputs_mirror_the_motion_exactly() {
    let drive = Drive { inertia: 2.5e-4, motor_constant: 0.0234, resistance: 2.32 };
    let odd = [
        "viscous",
        "coulomb",
        "stribeck",
        "presliding",
        "quadratic-drag",
        "viscous-temperature",
        "compliance",
        "backlash",
        "inductance",
        "brush-drop",
        "dead-time",
        "resistance-temperature",
        "supply-droop",
        "magnetic-saturation",
    ];
    for id in odd {
        let mut list = vec![("coulomb".to_owned(), vec![9e-4]), ("viscous".to_owned(), vec![2e-5]), ("inductance".to_owned(), vec![5e-4])];
        list.retain(|e| e.0 != id);
        list.push((id.to_owned(), drive_model::card(id).unwrap().parameters.iter().map(|p| p.start).collect()));
        for kind in common::BOTH {
            let setup = Setup { effects: list.clone(), ..Setup::by_voltage(drive, &[]) };
            let mut draw = Draw(24);
            let (mut there, mut back) = (Bench::new(kind, &setup), Bench::new(kind, &setup));
            let mut turned = 0;
            for n in 0..300 {
                // Levels of 20 ms through zero; at small levels the rotor sticks.
                let volt = draw.signed_log(0.02, 2.0);
                let (a, b) = (there.hold(volt, 0.02), back.hold(-volt, 0.02));
                assert_eq!((there.omega(), there.theta(), a), (-back.omega(), -back.theta(), -b), "{kind:?} {id} level {n}");
                turned += usize::from(there.omega() != 0.0);
            }
            assert!(turned > 100, "{id}");
        }
    }
}

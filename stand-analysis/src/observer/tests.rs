//! All vectors of theory §1.2 to §1.6 and §2.1, §2.2.

use super::bode::object_response;
use super::exact::{Matrix, rounded};
use super::*;
use nalgebra::Complex;

fn request(preset: &str, omega: f64, kind: Kind) -> Request {
    Request { plant: Plant::named(preset).unwrap(), poles: Poles::Binomial(omega), kind, step_s: None, vibration_Hz: None }
}

fn design(preset: &str, omega: f64, kind: Kind) -> Design {
    request(preset, omega, kind).design().unwrap()
}

#[track_caller]
fn near(found: &[f64], expected: &[f64], relative: f64) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= relative * b.abs(), "{found:?} is not {expected:?}");
    }
}

const PRINTED: [f64; 6] = [300.0, -298290.0, 432.64, 93324.0, -23.17, -7980.8];
const SET_T: [f64; 6] = [300.0, -272250.941, 410.290185, 90425.2308, -25.8517491, -9177.60808];
const SET_R: [f64; 6] = [300.0, -298287.758, 432.650632, 93324.4594, -23.1729100, -7980.81126];

/// §1.2 and §1.3; the recovered parameters give the printed gains to 1.3e-4.
#[test]
fn the_printed_gains_come_of_the_recovered_parameters() {
    near(&design("astatic-identifier", 50.0, Kind::Static).gains, &SET_T, 1e-8);
    let recovered = design("astatic-identifier-recovered", 50.0, Kind::Static).gains;
    near(&recovered, &SET_R, 1e-8);
    near(&recovered, &PRINTED, 1.3e-4);
}

/// §1.2, closed form; the design by Ackermann shares nothing with it.
#[test]
fn ackermann_agrees_with_the_closed_form() {
    for omega in [5.0, 50.0, 500.0] {
        let Element::Six(p) = Plant::named("astatic-identifier").unwrap().element else { panic!("six states") };
        let (a, b) = (p.azimuth_stiffness_N_m_rad() / p.inertia_z_kg_m2, p.rotor_N_m_s / p.inertia_z_kg_m2);
        let (c, d) = (p.rotor_N_m_s / p.inertia_x_kg_m2, p.mass_kg * p.gravity_m_s2 * p.arm_m / p.inertia_x_kg_m2);
        let (e, f, l) = (p.suspension_N_per_m * p.arm_m / p.inertia_x_kg_m2, p.suspension_N_per_m / p.mass_kg, p.arm_m);
        let (s, w) = (d + f + l * e, omega);
        let k1 = 6.0 * w;
        let k2 = 15.0 * w * w - (a + s + b * c);
        let k3 = (w.powi(6) / (d * f) - a - k2) / b;
        let k4 = (k1 * (s + b * c) - 20.0 * w.powi(3)) / b;
        let k5 = (a * s + d * f + b * c * f + k2 * s + k3 * b * d - 15.0 * w.powi(4)) / (b * e);
        let k6 = (k1 * (d * f + b * c * f) - b * (f + l * e) * k4 - 6.0 * w.powi(5)) / (b * e);
        // The closed form itself is in double precision: its differences lose a few digits.
        near(&design("astatic-identifier", omega, Kind::Static).gains, &[k1, k2, k3, k4, k5, k6], 1e-8);
    }
}

/// §1.2: check the polynomial, not the eigenvalues.
#[test]
fn the_characteristic_polynomial_is_the_binomial() {
    for kind in [Kind::Static, Kind::Augmented] {
        let (f, _) = design("astatic-identifier-recovered", 50.0, kind).observer();
        let n = f.len();
        let polynomial: Vec<f64> = Matrix::of(&f).characteristic().0.iter().map(rounded).collect();
        let mut binomial = vec![1.0];
        for _ in 0..n {
            let shifted: Vec<f64> = binomial.iter().map(|c| 50.0 * c).collect();
            binomial.push(0.0);
            shifted.iter().zip(&mut binomial[1..]).for_each(|(s, c)| *c += s);
        }
        // Gains rounded to doubles move the last coefficients by their cancellation.
        near(&polynomial, &binomial, 1e-7);
    }
}

/// §1.4.
#[test]
fn a_static_observer_keeps_the_offset() {
    let fixed = design("astatic-identifier-recovered", 50.0, Kind::Static);
    let rest = fixed.simulate(Disturbance { angle_rad: 0.0, moment: Moment::constant(1e-5) }, 0.01, 1e-3).steady;
    near(&rest, &[1.67473404e-7, 5.02420211e-5, 2.95227008e-6, 7.24574739e-5, 1.43301053e-7, -3.88084611e-6], 1e-7);
}

/// §1.5: the candidates of the integral channel, and which are stable.
#[test]
fn the_integral_channel_has_its_range() {
    for (row, gain, pole) in [
        (2, 298287.758, -3.62436),
        (2, 93324.4594, -0.64652),
        (3, 432.650632, -4.77398),
        (3, 300.0, -3.14515),
        (2, 3.03e5, -4.180),
        (3, 346.0, -5.289),
    ] {
        let found = design("astatic-identifier-recovered", 50.0, Kind::Integral { row, gain: Some(gain) }).poles[0].re;
        assert!((found - pole).abs() < 2e-2 * pole.abs(), "row {row}, {gain}: {found}");
    }
    let a2 = design("astatic-identifier-recovered", 50.0, Kind::Integral { row: 2, gain: None });
    let channel = a2.integral.unwrap();
    near(&[channel.gain, channel.moment_per_integral], &[298287.758, 3.8e-4 * 298287.758], 1e-8);
    // Theory's is the last stable point of a grid of 0.23 %.
    near(&[channel.stable_below.unwrap()], &[8.375e6], 2.4e-3);
    assert!((a2.poles[0].re + 3.62436).abs() < 1e-4, "{:?}", a2.poles);
    let a3 = design("astatic-identifier-recovered", 50.0, Kind::Integral { row: 3, gain: None });
    let channel = a3.integral.unwrap();
    near(&[channel.gain, channel.moment_per_integral], &[432.650632, 0.4 * 432.650632], 1e-8);
    near(&[channel.stable_below.unwrap()], &[4227.0], 2.4e-3);
    assert!((a3.poles[0] - Complex::new(-4.77398, 3.1252)).norm() < 1e-3 || (a3.poles[0] - Complex::new(-4.77398, -3.1252)).norm() < 1e-3);

    let refused = |kind| request("astatic-identifier-recovered", 50.0, kind).design().map(drop);
    let literal = refused(Kind::Integral { row: 2, gain: Some(-298287.758) });
    assert!(matches!(literal, Err(ObserverError::Unstable { pole, .. }) if (pole - 1.63341).abs() < 1e-4), "{literal:?}");
    for row in [1, 4, 5, 6] {
        assert_eq!(refused(Kind::Integral { row, gain: None }), Err(ObserverError::Row(row, "2, 3".to_owned())));
    }
}

/// §1.5, P7.
#[test]
fn the_augmented_observer_has_the_gains_of_theory() {
    let p7 = design("astatic-identifier-recovered", 50.0, Kind::Augmented);
    near(&p7.gains, &[350.0, -283287.758, 1314.06524, 114956.991, 19.6103172, -9139.45676], 1e-8);
    let channel = p7.integral.unwrap();
    near(&[channel.gain, channel.moment_per_integral], &[7856707.07, 2985.54869], 1e-8);
}

/// §1.5, the table of error vectors; 1e-6 of what is given, 1e-5 where the errors of six equal poles cross zero.
#[test]
fn errors_go_as_theory_says() {
    let both = Disturbance { angle_rad: 1e-2, moment: Moment::constant(1e-5) };
    let run = |kind| design("astatic-identifier-recovered", 50.0, kind).simulate(both, 4.0, 5e-3);
    let (fixed, a2) = (run(Kind::Static), run(Kind::Integral { row: 2, gain: None }));
    let (a3, p7) = (run(Kind::Integral { row: 3, gain: None }), run(Kind::Augmented));
    #[rustfmt::skip]
    let table = [
        (0.1, &fixed, 1.86411679e-2, 6.28965735, 2.12078372e-7, 5.97820928e-5, 0.0),
        (0.5, &fixed, -6.62973905e-7, -1.66998647e-4, 1.67461152e-7, 5.02388226e-5, 0.0),
        (1.0, &fixed, 1.67473403e-7, 5.02420209e-5, 1.67473404e-7, 5.02420211e-5, 0.0),
        (0.1, &a2, 1.58968302e-2, 5.24179270, 1.60011559e-7, 4.32836263e-5, 1.82631729e-6),
        (0.5, &a2, 2.08020894e-6, 3.47505193e-3, 1.02986928e-7, 3.07369947e-5, 5.28764730e-6),
        (1.0, &a2, 4.86830013e-5, 1.45117410e-2, 3.10496803e-8, 9.22351752e-6, 8.89102170e-6),
        (3.0, &a2, 8.13198894e-8, 2.41070665e-5, 3.36975843e-11, 9.98859504e-9, 9.99893666e-6),
        (0.5, &a3, 5.19059454e-5, 1.64282315e-2, 7.83590320e-8, 2.32810824e-5, 7.21120757e-6),
        (1.0, &a3, 4.88237612e-5, 1.44024973e-2, 4.48394465e-9, 1.30137387e-6, 1.00052986e-5),
        (0.1, &p7, 2.39780627e-2, 7.89072579, 3.44843519e-8, 6.50388686e-6, 1.06043119e-5),
        (0.5, &p7, 2.12980437e-6, 6.70834835e-4, 3.38024022e-11, 1.06178423e-8, 9.99725005e-6),
    ];
    for (t_s, of, e1, e2, m1, m2, moment) in table {
        let (left, (right, estimated)) = (of.both.at(t_s).0, of.moment_only.at(t_s));
        near(&[left[0], left[1], right[0], right[1]], &[e1, e2, m1, m2], 1e-5);
        near(&[estimated], &[moment], 1e-6);
    }
    let (end, (moment_end, estimated)) = (p7.both.at(1.0).0, p7.moment_only.at(1.0));
    assert!(end[0].abs() < 1e-14 && end[1].abs() < 1e-11 && moment_end[0].abs() < 1e-18, "{end:?} {moment_end:?}");
    near(&[estimated], &[1e-5], 1e-8);
    // Row 3 leaves β′ its offset M/H.
    near(&[a3.steady[3]], &[2.5e-5], 1e-8);
    assert!(a2.steady.iter().chain(&p7.steady).all(|e| e.abs() < 1e-20) && a3.steady[0].abs() < 1e-20);

    // Settling to 1 %, on theory's grid of 5 ms; peaks.
    let settled = |of: &Simulated| [of.settled_s.unwrap(), of.rate_settled_s.unwrap()];
    for (of, expected) in [(&fixed, [0.370, 0.300]), (&a2, [0.480, 0.330]), (&a3, [0.830, 0.260]), (&p7, [0.380, 0.300])] {
        near(&settled(of), &expected, 1e-9);
    }
    near(&fixed.largest, &[0.066195, 20.855], 1e-4);
    near(&p7.largest, &[0.052775, 19.290], 1e-4);
}

/// §1.5, noise: the observer costs it, astatism does not.
#[test]
fn astatism_costs_no_noise() {
    for (kind, peak) in [(Kind::Static, 5801.9), (Kind::Integral { row: 2, gain: None }, 5536.6), (Kind::Augmented, 5608.4)] {
        let (found, at) = Bode::new(&design("astatic-identifier-recovered", 50.0, kind), 50.0).noise;
        near(&[found], &[peak], 1e-4);
        assert!((70.0..90.0).contains(&at), "{at}");
    }
}

/// §1.5, the closed loop.
#[test]
fn the_astatic_observer_brings_the_closed_loop_to_zero() {
    let regulated = Regulator { angle_N_m_rad: 1e-2, rate_N_m_s_rad: 6.5e-2 };
    let start = Start { angle_rad: 0.0, moment: Moment::constant(1e-5), closed_from_s: 0.0 };
    let run = |kind| {
        let closed = design("astatic-identifier-recovered", 50.0, kind).regulate(regulated, start, 60.0, 1e-2).unwrap();
        (closed.angle_rad, closed.steady_rad.unwrap())
    };
    let (angles, rest) = run(Kind::Static);
    near(&[rest], &[1.31768166e-3], 1e-8);
    // The slow pair at 0.15 1/s: e⁻⁹ is left after a minute.
    near(&[*angles.last().unwrap()], &[rest], 1e-3);
    let (angles, rest) = run(Kind::Augmented);
    assert!(rest.abs() < 1e-15 && angles.last().unwrap().abs() < 1e-7, "{rest:e} {:e}", angles.last().unwrap());
}

/// A harmonic moment against the response of the error system, e = (jω E − A + K C)⁻¹ G M: amplitude of the static observer's angle error.
#[test]
fn a_harmonic_moment_gives_the_error_of_the_frequency_response() {
    let fixed = design("astatic-identifier-recovered", 50.0, Kind::Static);
    let harmonic = moment::Harmonic { amplitude_N_m: 1e-5, frequency_Hz: 3.0 };
    let moment = Moment { harmonic: Some(harmonic), ..Moment::default() };
    let run = fixed.simulate(Disturbance { angle_rad: 0.0, moment }, 6.0, 1e-3);
    let (f, _) = fixed.observer();
    let s = Complex::new(0.0, std::f64::consts::TAU * 3.0);
    let matrix = nalgebra::DMatrix::from_fn(6, 6, |i, j| (if i == j { s } else { Complex::new(0.0, 0.0) }) - f[i][j]);
    let input = nalgebra::DVector::from_fn(6, |i, _| Complex::new(1e-5 * fixed.request.plant.b()[i], 0.0));
    let error = matrix.lu().solve(&input).unwrap();
    near(&run.rms_second_half, &[error[0].norm() / 2_f64.sqrt(), error[1].norm() / 2_f64.sqrt()], 1e-3);
    assert!(run.steady.iter().all(|e| e.abs() < 1e-20), "no constant part");
}

/// §1.6.
#[test]
fn the_discrete_gains_are_those_of_theory() {
    let discrete = |kind| {
        let of = Request { step_s: Some(1e-3), ..request("astatic-identifier-recovered", 50.0, kind) };
        of.design().unwrap().discrete.unwrap()
    };
    let fixed = discrete(Kind::Static);
    near(&fixed.gains, &[-0.0338818049, -303.127521, 0.420194316, -12.941131, -0.0237577351, 0.965541775], 1e-8);
    near(&fixed.phi[1], &[-0.000171010263, 0.83753667, 0.307601403, -0.994877742, -5.19257732, -0.0017504676], 1e-8);
    near(&fixed.gamma, &[0.00127955562, 2.48745359, 0.000136919014, 0.406158104, -1.15011012e-5, -0.0341168024], 1e-8);
    let p7 = discrete(Kind::Augmented);
    near(&p7.gains, &[0.0148887706, -297.332429, 1.19190752, 7.47223465, 0.012647949, -0.18345819, 2.57944344], 1e-8);
    assert!(!fixed.has_disturbance && p7.has_disturbance);
    // The PI forms: the six static poles, and a channel that the firmware's law accepts and that finds the moment.
    for row in [2, 3] {
        let pi = discrete(Kind::Integral { row, gain: None });
        near(&pi.gains[..6], &fixed.gains, 1e-12);
        let law = pi.law::<7>().unwrap();
        let mut observer = stand_firmware::gyro_loop::observer::Observer::at(0.0);
        let mut plant = [0.0; 6];
        for _ in 0..6000 {
            observer.step(&law, plant[0], 0.0);
            plant = std::array::from_fn(|i| (0..6).map(|j| fixed.phi[i][j] * plant[j]).sum::<f64>() + fixed.gamma[i] * 1e-5);
        }
        // A tail of 0.28 or 0.21 s: e⁻²¹ is left.
        near(&[observer.estimate()[6]], &[1e-5], 1e-6);
    }
}

/// §2.1 and §2.2.
#[test]
fn the_rate_observer_has_the_gains_and_polynomials_of_theory() {
    let plant = Plant::named("rate-observer").unwrap();
    let bodes = Bode::of(&plant, Kind::Static, &[10.0, 100.0, 1000.0]).unwrap();
    #[rustfmt::skip]
    let gains = [
        [39.65, -463.894844, 13.03995, 752.498002],
        [399.65, 58810.1052, 38821.3999, -71548.12],
        [3999.65, 5997550.11, 399880025.0, -79910008.3],
    ];
    #[rustfmt::skip]
    let numerators = [
        [-463.894844, -37648.1878, 9405.12817, -4.64626803],
        [58810.1052, 3580345.57, 99994005.1, -46.8318038],
        [5997550.11, 3.99580028e9, 9.9999994e11, -468.687161],
    ];
    for (k, bode) in bodes.iter().enumerate() {
        near(&bode.gains, &gains[k], 1e-8);
        // Printed to nine digits; those of the last are differences of gains that are rounded.
        near(&bode.numerator, &numerators[k], 1e-6);
    }
    let ratios = [
        [(-0.54093333, -3.77634779), (-1.39486531, 9.41203533), (0.31950653, -0.07327268), (0.00187236, -0.00015182)],
        [(0.99978439, -0.00418596), (0.98648281, -0.03469055), (1.18416218, -0.03183892), (-0.17090806, -0.13473559)],
        [(0.99999993, -0.00000419), (0.99999866, -0.00003797), (1.00005710, 0.00028286), (1.31700010, -0.05119997)],
    ];
    for (bode, expected) in bodes.iter().zip(ratios) {
        for (rad_s, (re, im)) in [1.0, 10.0, 50.0, 500.0].into_iter().zip(expected) {
            assert!((bode.ratio(rad_s) - Complex::new(re, im)).norm() < 1e-6, "{rad_s}: {}", bode.ratio(rad_s));
        }
    }
    let (_, numerator, denominator) = object_response(&plant);
    for (rad_s, expected) in [(1.0, 2.383217), (10.0, 2.631528), (50.0, 1.724037), (500.0, 0.01004218)] {
        let s = Complex::new(0.0, rad_s);
        near(&[(bode::evaluate(&numerator, s) / bode::evaluate(&denominator, s)).norm()], &[expected], 1e-6);
    }
}

/// §2.2, the limit of a slow nutation: (6x² + 4x + 1)/(x + 1)⁴, at half the poles +2.4075 dB and −2.2240°.
#[test]
fn half_way_to_the_poles_a_slow_element_is_shown_2_4_dB_too_great() {
    let mut element = hal_sim::element::FourState::SET_B;
    (element.rotor_N_m_s, element.pendulum_N_m) = (1e-6, 1e-3);
    (element.link_damping_N_m_s, element.beta_damping_N_m_s) = (0.0, 0.0);
    let plant = Plant::new("slow", Element::Four(element)).unwrap();
    let ratio = Bode::of(&plant, Kind::Static, &[1000.0]).unwrap()[0].ratio(500.0);
    assert!((20.0 * ratio.norm().log10() - 2.4075).abs() < 1e-4 && (ratio.arg().to_degrees() + 2.2240).abs() < 1e-4, "{ratio}");
}

/// §2.2, the table of limits; printed to three digits, on a grid of theory's own.
#[test]
fn distortion_begins_where_theory_says() {
    #[rustfmt::skip]
    let table = [
        (8e-3, 2e-2, 31.62, [0.0245, 45.0, 342.8]),
        (5e-2, 5e-2, 8.00, [0.261, 35.0, 341.9]),
        (1e-2, 1e-2, 40.00, [0.0180, 51.6, 343.5]),
        (1e-3, 2e-2, 89.44, [0.01, 2.73, 349.7]),
        (4e-4, 1.13e-2, 188.1, [0.01, 0.624, 377.5]),
        (4e-4, 1.3e-3, 554.7, [0.01, 0.0725, 74.1]),
    ];
    for (inertia_y, inertia_z, nutation, limits) in table {
        let element =
            hal_sim::element::FourState { inertia_y_kg_m2: inertia_y, inertia_z_kg_m2: inertia_z, ..hal_sim::element::FourState::SET_B };
        near(&[element.nutation_rad_s()], &[nutation], 1e-3);
        let plant = Plant::new("table", Element::Four(element)).unwrap();
        for (bode, expected) in Bode::of(&plant, Kind::Static, &[10.0, 100.0, 1000.0]).unwrap().iter().zip(limits) {
            near(&[bode.limit.rad_s.unwrap()], &[expected], 5e-3);
            assert_eq!(bode.limit.at_lowest_frequency, expected == 0.01);
        }
    }
}

/// §2.1: 200 random elements, closed form against Ackermann (theory: 2.2e-14 with gains to 1e-6 of the greatest).
#[test]
fn the_four_gains_are_the_closed_form_for_any_element() {
    let mut seed = 1_u64;
    let mut draw = |low: f64, high: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    for _ in 0..200 {
        let element = hal_sim::element::FourState {
            rotor_N_m_s: draw(0.05, 2.0),
            inertia_x_kg_m2: 1.0,
            inertia_y_kg_m2: 10f64.powf(draw(-4.0, -1.0)),
            inertia_z_kg_m2: 10f64.powf(draw(-4.0, -1.0)),
            pendulum_N_m: draw(0.1, 5.0),
            link_damping_N_m_s: draw(0.0, 1e-2),
            alpha_damping_N_m_s: draw(0.0, 1e-2),
            beta_damping_N_m_s: draw(0.0, 1e-2),
            gamma_damping_N_m_s: 0.0,
            link_rad_s: draw(0.0, 1e-2),
            latitude_deg: draw(-80.0, 80.0),
        };
        let w = 10f64.powf(draw(1.0, 3.0));
        let r = (element.link_damping_N_m_s + element.alpha_damping_N_m_s) / element.inertia_y_kg_m2;
        let (q, a) = (element.beta_damping_N_m_s / element.inertia_z_kg_m2, element.azimuth_stiffness_N_m_rad() / element.inertia_y_kg_m2);
        let (b, c) = (element.rotor_N_m_s / element.inertia_y_kg_m2, element.rotor_N_m_s / element.inertia_z_kg_m2);
        let d = element.pendulum_N_m / element.inertia_z_kg_m2;
        let k1 = 4.0 * w - r - q;
        let k2 = 6.0 * w * w - (r * q + d + a + b * c) - k1 * (r + q);
        let k3 = (w.powi(4) / d - a - k1 * r - k2) / b;
        let k4 = (r * d + a * q + k1 * (r * q + b * c + d) + k2 * q - 4.0 * w.powi(3)) / b;
        let plant = Plant::new("drawn", Element::Four(element)).unwrap();
        let request = Request { plant, poles: Poles::Binomial(w), kind: Kind::Static, step_s: None, vibration_Hz: None };
        // A random element may have a condition beyond what doubles call observable; theory drew the same.
        let found = request.design().unwrap().gains;
        let greatest = k1.abs().max(k2.abs()).max(k3.abs()).max(k4.abs());
        for (gain, closed) in found.iter().zip([k1, k2, k3, k4]) {
            assert!((gain - closed).abs() <= 1e-9 * closed.abs().max(1e-6 * greatest), "{element:?} {w}: {found:?} {closed}");
        }
    }
}

#[test]
fn an_element_that_the_angle_does_not_show_is_refused() {
    let element = hal_sim::element::FourState { rotor_N_m_s: 1e-9, link_damping_N_m_s: 1e6, ..hal_sim::element::FourState::SET_B };
    let plant = Plant::new("no rotor", Element::Four(element)).unwrap();
    let request = Request { plant, poles: Poles::Binomial(10.0), kind: Kind::Static, step_s: None, vibration_Hz: None };
    assert!(matches!(request.design(), Err(ObserverError::Singular { .. })));
}

#[test]
fn warnings_follow_the_theory() {
    let found = |request: Request| request.design().unwrap().warnings();
    let gives = |request: Request, expected: fn(&Warning) -> bool| found(request).iter().any(expected);
    let four = |omega, vibration_Hz| Request { vibration_Hz, ..request("rate-observer", omega, Kind::Static) };
    assert!(gives(four(60.0, None), |w| matches!(w, Warning::PolesBelowNutation { .. })));
    assert!(gives(four(120.0, Some(10.0)), |w| matches!(w, Warning::PolesBelowVibration { .. })));
    assert_eq!(found(four(1000.0, Some(10.0))), []);
    let six = |kind, step_s| Request { step_s, ..request("astatic-identifier-recovered", 50.0, kind) };
    assert!(gives(six(Kind::Integral { row: 2, gain: None }, None), |w| matches!(w, Warning::SlowIntegralPole { .. })));
    assert!(gives(six(Kind::Augmented, Some(1e-3)), |w| matches!(w, Warning::SinglePrecision { .. })));
    assert!(gives(six(Kind::Static, Some(0.01)), |w| matches!(w, Warning::ModeAboveNyquist { .. })));
    assert!(gives(six(Kind::Static, Some(0.02)), |w| matches!(w, Warning::FewSamplesPerPole { .. })));
}

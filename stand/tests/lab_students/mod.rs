//! Scripted honest students of the works with quantities. They follow the steps of the instructions with arithmetic of their own, apart
//! from the reference procedures.

pub mod drive;
mod regression;
pub mod sensors;

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

use identification::log::Log;
use nalgebra::{Complex, DMatrix, DVector};
use stand_analysis::observer::{Kind, Plant, Poles, Request};

/// Value and expanded uncertainty by the name of the quantity.
pub type Values = BTreeMap<String, (f64, f64)>;

/// Coverage factor of a student who combines several contributions.
const COVERAGE: f64 = 2.0;

/// Work 3: rate by a fit of the time over the angle, components of its square over the square of the rate, the encoder's error removed from
/// the angle in turn.
pub fn once_per_turn(logs: &Path) -> Values {
    const SETTLED_S: f64 = 12.0;
    const COUNT_DEG: f64 = 360.0 / 20_000.0;
    const INERTIA: (f64, f64) = (2.5e-4, 0.01);
    let files = ["01-slow-forward", "02-slow-backward", "03-medium-forward", "04-medium-backward", "05-fast-forward", "06-fast-backward"];
    let read = |name: &str| {
        let log = Log::read(logs.join(format!("{name}.parquet"))).unwrap();
        let rows = log.t_s().iter().copied().zip(log.column("theta_rad").unwrap().iter().copied());
        rows.filter(|(t_s, _)| *t_s >= SETTLED_S).collect::<Vec<(f64, f64)>>()
    };
    let runs = files.map(|name| Turning::of(&read(name)));
    // a e^{jφ} of torque over inertia, and of both errors.
    let mut errors = [Complex::new(0.0, 0.0); 2];
    let (mut torque, mut sigmas) = (errors[0], [0.0; 3]);
    for _ in 0..8 {
        // Unknown: −T₁, E₁, T₂, E₂ with two parts each, β.
        let mut rows = DMatrix::zeros(4 * runs.len(), 9);
        let mut values = DVector::zeros(4 * runs.len());
        for (k, run) in runs.iter().map(|run| run.squared(errors)).enumerate() {
            for n in [1, 2] {
                let (order, y) = (n as f64, run.squared[n] / run.squared[0].re);
                let damping = run.rate[n] * Complex::new(0.0, 2.0 / order) / run.squared[0].re;
                let first = 4 * k + 2 * (n - 1);
                for (row, value, by_damping) in [(first, y.re, damping.re), (first + 1, y.im, damping.im)] {
                    let column = 4 * (n - 1) + row - first;
                    rows[(row, column)] = -1.0 / run.squared[0].re;
                    rows[(row, column + 2)] = order;
                    rows[(row, 8)] = by_damping;
                    values[row] = value;
                }
            }
        }
        let scale: Vec<f64> = (0..9).map(|column| rows.column(column).norm()).collect();
        (0..9).for_each(|column| rows.column_mut(column).unscale_mut(scale[column]));
        let inverse = (rows.transpose() * &rows).try_inverse().unwrap();
        let found = &inverse * (rows.transpose() * &values);
        let scatter = ((&values - &rows * &found).norm_squared() / (values.len() - 9) as f64).sqrt();
        let component = |column: usize| Complex::new(found[column] / scale[column], found[column + 1] / scale[column + 1]);
        torque = component(0);
        errors = [errors[0] + component(2), errors[1] + component(6)];
        sigmas = [0, 2, 6].map(|column| scatter * inverse[(column, column)].sqrt() / scale[column]);
    }
    let degrees = |z: Complex<f64>| z.arg().rem_euclid(TAU).to_degrees();
    let mut values = Vec::new();
    let names = [["torque_N_m", "torque_phase_deg"], ["error_1_rad", "error_1_phase_deg"], ["error_2_rad", "error_2_phase_deg"]];
    for (k, (component, [size, phase])) in [torque * INERTIA.0, errors[0], errors[1]].into_iter().zip(names).enumerate() {
        let (unit, inertia, counts) = [(INERTIA.0, INERTIA.1, 1.0), (1.0, 0.0, 1.0), (1.0, 0.0, 2.0)][k];
        let sigma = unit * sigmas[k];
        values.push((size, component.norm(), sigma.hypot(component.norm() * inertia / 3_f64.sqrt())));
        values.push((phase, degrees(component), (sigma / component.norm()).to_degrees().hypot(counts * COUNT_DEG / 3_f64.sqrt())));
    }
    values.into_iter().map(|(name, value, u)| (name.to_owned(), (value, COVERAGE * u))).collect()
}

/// Components of ω and ω² over the true angle, orders 0 to 2.
struct Squared {
    rate: [Complex<f64>; 3],
    squared: [Complex<f64>; 3],
}

/// Fit of the time over the encoder's angle in a log: 1/ω = slowness + Σ n (b_n cos nθ − a_n sin nθ).
struct Turning {
    slowness: f64,
    harmonics: Vec<[f64; 2]>,
}

impl Turning {
    /// A square and harmonics up to order 4, over whole turns, by the normal equations.
    fn of(run: &[(f64, f64)]) -> Self {
        let from = run[0].1;
        let turns = ((run[run.len() - 1].1 - from) / TAU).trunc();
        let used: Vec<&(f64, f64)> = run.iter().take_while(|(_, theta)| (theta - from).abs() < turns.abs() * TAU).collect();
        let half = 0.5 * turns * TAU;
        let row = |theta: f64| {
            let x = (theta - from) / half - 1.0;
            let harmonics = (1..=4).flat_map(|n| [(f64::from(n) * theta).cos(), (f64::from(n) * theta).sin()]);
            [1.0, x, x * x].into_iter().chain(harmonics).collect::<Vec<f64>>()
        };
        let rows: Vec<f64> = used.iter().flat_map(|(_, theta)| row(*theta)).collect();
        let rows = DMatrix::from_row_slice(used.len(), 11, &rows);
        let times = DVector::from_iterator(used.len(), used.iter().map(|(t_s, _)| *t_s));
        let fit = (rows.transpose() * &rows).cholesky().unwrap().solve(&(rows.transpose() * times));
        Turning { slowness: fit[1] / half, harmonics: (0..4).map(|k| [fit[3 + 2 * k], fit[4 + 2 * k]]).collect() }
    }

    /// ω² over the true angle, for an encoder with the errors a e^{jφ}.
    fn squared(&self, errors: [Complex<f64>; 2]) -> Squared {
        const POINTS: usize = 256;
        let zero = [Complex::new(0.0, 0.0); 3];
        let mut found = Squared { rate: zero, squared: zero };
        for k in 0..POINTS {
            let theta = TAU * k as f64 / POINTS as f64;
            let (mut shown, mut per_angle) = (theta, 1.0);
            for (n, error) in (1..).map(f64::from).zip(errors) {
                let turned = error * Complex::from_polar(1.0, n * theta);
                // Both angles are zero at the index.
                shown += turned.im - error.im;
                per_angle += n * turned.re;
            }
            let slowness = (1..).map(f64::from).zip(&self.harmonics).map(|(n, [a, b])| n * (b * (n * shown).cos() - a * (n * shown).sin()));
            let rate = 1.0 / ((self.slowness + slowness.sum::<f64>()) * per_angle);
            for n in 0..3 {
                let share = Complex::from_polar(1.0 / POINTS as f64, -(n as f64) * theta);
                found.rate[n] += share * rate;
                found.squared[n] += share * rate * rate;
            }
        }
        found
    }
}

/// Work 7: the moment by a fit of the free motion to the whole log, without an observer; the errors of static observers by their
/// equilibrium.
pub fn observers(logs: &Path) -> Values {
    const GAIN: f64 = 0.01;
    const STEP_S: f64 = 1e-3;
    let log = Log::read_also(logs.join("element.parquet"), &["angle_sensor_V"]).unwrap();
    let gain_V_rad = log.notes().number("angle_gain_V_rad").unwrap();
    let angle: Vec<f64> =
        log.columns().iter().find(|c| c.name == "angle_sensor_V").unwrap().values.iter().map(|v| v / gain_V_rad).collect();
    let plant = Plant::named("astatic-identifier-recovered").unwrap();
    let (a, b) = (plant.a(), plant.b());
    let n = a.len();
    // The moment as an additional state that does not change.
    let all = DMatrix::from_fn(n + 1, n + 1, |i, j| if i == n { 0.0 } else { STEP_S * if j == n { b[i] } else { a[i][j] } });
    let step = all.exp();
    let mut response = DMatrix::from_fn(1, n + 1, |_, j| if j == 0 { 1.0 } else { 0.0 });
    let mut rows = DMatrix::zeros(angle.len(), n + 1);
    for k in 0..angle.len() {
        rows.set_row(k, &response.row(0));
        response = &response * &step;
    }
    let scale: Vec<f64> = (0..=n).map(|j| rows.column(j).norm()).collect();
    (0..=n).for_each(|j| rows.column_mut(j).unscale_mut(scale[j]));
    let measured = DVector::from_column_slice(&angle);
    let normal = (rows.transpose() * &rows).try_inverse().unwrap();
    let found = &normal * (rows.transpose() * &measured);
    let residual_sd = ((&measured - &rows * &found).norm_squared() / (angle.len() - n - 1) as f64).sqrt();
    let moment = found[n] / scale[n];
    let scatter = residual_sd * normal[(n, n)].sqrt() / found[n].abs();
    let relative_u = scatter.hypot(GAIN / 3_f64.sqrt());

    let mut values = vec![("moment_N_m", moment)];
    for (omega, names) in [
        (10.0, [Some("static_angle_error_slow_rad"), Some("static_rate_error_slow_rad_s")]),
        (20.0, [None, Some("static_rate_error_fast_rad_s")]),
    ] {
        let request =
            Request { plant: plant.clone(), poles: Poles::Binomial(omega), kind: Kind::Static, step_s: Some(STEP_S), vibration_Hz: None };
        let gains = request.design().unwrap().discrete.unwrap().gains;
        let error = DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) - step[(i, j)] + if j == 0 { gains[i] } else { 0.0 });
        let equilibrium = error.lu().solve(&step.view((0, n), (n, 1)).into_owned()).unwrap();
        for (state, name) in names.into_iter().enumerate() {
            values.extend(name.map(|name| (name, -equilibrium[state] * moment)));
        }
    }
    values.into_iter().map(|(name, value)| (name.to_owned(), (value, COVERAGE * relative_u * value.abs()))).collect()
}

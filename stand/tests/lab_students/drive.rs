//! Students of the works on motor and friction.

use std::path::Path;

use identification::log::Log;

use super::Values;
use super::regression::{Fit, expanded, mean, sigma_of_mean};

/// Columns of a log.
struct Rows {
    t_s: Vec<f64>,
    theta: Vec<f64>,
    current: Vec<f64>,
    log: Log,
}

impl Rows {
    fn read(path: &Path) -> Self {
        let log = Log::read(path).unwrap();
        let column = |name: &str| log.column(name).unwrap().to_vec();
        Rows { t_s: log.t_s().to_vec(), theta: column("theta_rad"), current: column("i_A"), log }
    }

    fn voltage(&self) -> &[f64] {
        self.log.column("u_V").unwrap()
    }

    /// Mean rate between two rows.
    fn rate(&self, from: usize, to: usize) -> f64 {
        (self.theta[to] - self.theta[from]) / (self.t_s[to] - self.t_s[from])
    }

    /// Row at a time.
    fn at(&self, t_s: f64) -> usize {
        self.t_s.partition_point(|t| *t < t_s).min(self.t_s.len() - 1)
    }
}

/// Half-widths of voltage and current reading, relative.
const VOLTAGE: f64 = 0.005;
const CURRENT: f64 = 0.01;

/// Work 1, steps 3 to 6: R by the hold, K by a line through the levels, J by the coast-down, L by the missing charge.
pub fn motor(logs: &Path) -> Values {
    let hold = Rows::read(&logs.join("01-hold.parquet"));
    let from = hold.at(1.0);
    let (u, i) = (mean(&hold.voltage()[from..]), mean(&hold.current[from..]));
    let resistance = u / i;
    let resistance_u = sigma_of_mean(&hold.current[from..]) / i.abs();

    let rates = Rows::read(&logs.join("02-rates.parquet"));
    let (mut emf, mut torque) = ((Vec::new(), Vec::new()), Vec::new());
    let levels = (rates.t_s[rates.t_s.len() - 1] / 2.0).floor() as usize;
    for level in 0..levels {
        let (from, to) = (rates.at(2.0 * level as f64 + 0.5), rates.at(2.0 * level as f64 + 2.0) - 1);
        let (u, i, rate) = (mean(&rates.voltage()[from..to]), mean(&rates.current[from..to]), rates.rate(from, to));
        emf.0.push(vec![rate, 1.0]);
        emf.1.push(u - resistance * i);
        if rate.abs() > 0.1 {
            torque.push((rate, i));
        }
    }
    let fit = Fit::of(&emf.0, &emf.1);
    let constant = fit.found[0];
    let constant_u = fit.sigma(0) / constant;
    let rows: Vec<Vec<f64>> = torque.iter().map(|(rate, _)| vec![*rate, rate.signum()]).collect();
    let friction = Fit::of(&rows, &torque.iter().map(|(_, i)| constant * i).collect::<Vec<_>>());

    // dω/dt = −p ω − q, integrated; the rate is that of the encoder over 20 ms.
    let coast = Rows::read(&logs.join("04-coast.parquet"));
    let off = coast.voltage().iter().rposition(|u| u.abs() > 0.05).unwrap() + 1;
    let (mut rows, mut values) = (Vec::new(), Vec::new());
    for k in (off + 60..coast.t_s.len() - 10).step_by(20) {
        let rate = coast.rate(k - 10, k + 10);
        if rate.abs() < 0.5 {
            break;
        }
        rows.push(vec![coast.theta[k] - coast.theta[off], coast.t_s[k] - coast.t_s[off], 1.0]);
        values.push(rate);
    }
    let fit = Fit::of(&rows, &values);
    let inertia = (friction.found[0] + constant * constant / resistance) / -fit.found[0];
    let inertia_u = (fit.sigma(0) / fit.found[0]).hypot(2.0 * constant_u).hypot(resistance_u);

    // The missing charge of the first row after each step over the step of the current.
    let steps = Rows::read(&logs.join("03-steps.parquet"));
    let line = |from: usize, to: usize, at: f64| {
        let rows: Vec<Vec<f64>> = (from..to).map(|k| vec![1.0, k as f64 - at]).collect();
        Fit::of(&rows, &steps.current[from..to]).found[0]
    };
    let (mut rows, mut charges) = (Vec::new(), Vec::new());
    let voltage = steps.voltage();
    for k in 21..steps.t_s.len() - 21 {
        if (voltage[k] - voltage[k - 1]).abs() > 0.1 {
            // The step is at the beginning of row k, half a row before its middle.
            let after = line(k + 1, k + 21, k as f64);
            let change = line(k + 1, k + 21, k as f64 - 0.5) - line(k - 20, k, k as f64 - 0.5);
            rows.push(vec![change]);
            charges.push((after - steps.current[k]) * 1e-3);
        }
    }
    let fit = Fit::of(&rows, &charges);
    let inductance = fit.found[0] * resistance;
    let inductance_u = (fit.sigma(0) / fit.found[0]).hypot(resistance_u);

    let both = [CURRENT, VOLTAGE];
    [
        ("resistance_ohm", resistance, expanded(&both, resistance_u)),
        ("motor_constant_N_m_A", constant, expanded(&[VOLTAGE], constant_u)),
        ("inertia_kg_m2", inertia, expanded(&both, inertia_u)),
        ("inductance_H", inductance, expanded(&both, inductance_u)),
    ]
    .map(|(name, value, relative)| (name.to_owned(), (value, relative * value.abs())))
    .into()
}

/// Work 2: means of the plateaus, a scan of the Stribeck rate with the other three parameters by least squares, covariance by differences.
pub fn friction(logs: &Path) -> Values {
    const MOTOR_CONSTANT: (f64, f64) = (0.0234, 0.005);
    let mut points = Vec::new();
    for name in ["01-slow.parquet", "02-fast.parquet"] {
        let rows = Rows::read(&logs.join(name));
        let setpoint = rows.log.column("rate_cmd_rad_s").unwrap();
        let mut from = 0;
        for k in 1..=setpoint.len() {
            if k < setpoint.len() && (setpoint[k] - setpoint[from]).abs() < 1e-6 {
                continue;
            }
            let begin = from + 500;
            if k > begin + 500 && setpoint[from].abs() > 0.1 {
                points.push((rows.rate(begin, k - 1), MOTOR_CONSTANT.0 * mean(&rows.current[begin..k])));
            }
            from = k;
        }
    }
    let torques: Vec<f64> = points.iter().map(|(_, torque)| *torque).collect();
    let at = |v: f64| {
        let bump = |rate: f64| (-(rate / v).powi(2)).exp();
        let rows: Vec<Vec<f64>> = points.iter().map(|(rate, _)| vec![rate.signum(), *rate, rate.signum() * bump(*rate)]).collect();
        let fit = Fit::of(&rows, &torques);
        let left: f64 =
            rows.iter().zip(&torques).map(|(row, y)| (y - row.iter().zip(&fit.found).map(|(a, b)| a * b).sum::<f64>()).powi(2)).sum();
        (left, fit.found)
    };
    let (mut v, mut width) = (2.5, 2.3);
    for _ in 0..12 {
        let grid = (-20..=20).map(|k| v + width * f64::from(k) / 20.0).filter(|v| *v > 0.05);
        v = grid.min_by(|a, b| at(*a).0.total_cmp(&at(*b).0)).unwrap();
        width /= 5.0;
    }
    let found = at(v).1;
    // Columns: the three linear ones, and the difference quotient by v.
    let torque = |rate: f64, v: f64| rate.signum() * found[2] * (-(rate / v).powi(2)).exp();
    let step = 1e-4 * v;
    let rows: Vec<Vec<f64>> = points
        .iter()
        .map(|(rate, _)| {
            let by_v = (torque(*rate, v + step) - torque(*rate, v - step)) / (2.0 * step);
            vec![rate.signum(), *rate, rate.signum() * (-(rate / v).powi(2)).exp(), by_v]
        })
        .collect();
    let left: Vec<f64> = points.iter().map(|(rate, y)| y - found[0] * rate.signum() - found[1] * rate - torque(*rate, v)).collect();
    let fit = Fit::of(&rows, &left);
    let value = |name: &str, value: f64, k: usize, a: &[f64]| (name.to_owned(), (value, value * expanded(a, fit.sigma(k) / value)));
    let common = [CURRENT, MOTOR_CONSTANT.1];
    [
        value("coulomb_N_m", found[0], 0, &common),
        value("viscous_N_m_s", found[1], 1, &common),
        value("stribeck_N_m", found[2], 2, &common),
        value("stribeck_rate_rad_s", v, 3, &[]),
    ]
    .into()
}

//! A three-axis calibration without a rate table: an inertial unit laid on each of its sides and turned by whole turns about each axis
//! (Ferraris, Grimaldi and Parvis, Sensors and Materials 7, 1995).
//!
//! Input: logs with `gyro_x_rad_s` … `accel_z_m_s2` (any subset) and a CSV table with the columns `file`, `from`, `to` (s), `turn_x_deg`,
//! `turn_y_deg`, `turn_z_deg` (angle turned about an axis of the unit between two rests, with its sign; 0 or empty for none) and `up` (the
//! axis that points upwards in a step at rest: `+x` … `-z`, or the direction in the axes of the unit, `0.5:0.866:0`, for a dividing head).
//! Output: per axis the bias, the scale, the cross-axis terms, and for an accelerometer the coefficients of the second and, with inclined
//! positions, of the third order.
//!
//! Gyro: ∫ωᵢ dt = Σⱼ Mᵢⱼ Δθⱼ + bᵢ T. Accelerometer: fᵢ = bᵢ + Σⱼ Aᵢⱼ gⱼ + K₂ fᵢ² + K₃ fᵢ³ where there are enough positions; at rest the
//! specific force is g upwards (IEEE Std 1293: K₀ is the bias, K₁ the scale, K₂ and K₃ the coefficients of the second and third order). The
//! uncertainties of the angle turned and of the level are those of the user's hand.

use super::plausibility::objection;
use super::positions_fit::{self, PositionErrors};
use super::{Basis, Contribution, Meaning, Quantity};
use identification::log::{Log, LogError};
use identification::statistics::least_squares;
use std::path::{Path, PathBuf};

/// Names of the axes.
const AXES: [&str; 3] = ["x", "y", "z"];
/// Columns of the gyro and of the accelerometer.
pub const COLUMNS: [&str; 6] = ["gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s", "accel_x_m_s2", "accel_y_m_s2", "accel_z_m_s2"];

/// Component of the upward direction along an axis from which a position counts as upright, and below which as across.
const MIN_COMPONENT: f64 = 0.7;
/// Components that differ by less are one.
const DISTINCT_COMPONENTS: f64 = 0.05;

/// Parts of a step at rest whose scatter gives the noise of its mean.
const PARTS: usize = 8;

/// What the user knows beside the table.
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HandAssumptions {
    /// Half-width of an angle turned, degrees.
    pub turn_error_deg: f64,
    /// Half-width of the direction of an axis at rest, degrees.
    pub level_deg: f64,
    /// Local gravity, m/s²; the scales of the accelerometer refer to it.
    pub gravity_m_s2: f64,
    /// Half-width of that gravity, m/s².
    pub gravity_error_m_s2: f64,
    /// Clock of the logger, ppm.
    pub clock_ppm: f64,
}

impl Default for HandAssumptions {
    fn default() -> Self {
        Self { turn_error_deg: 1.0, level_deg: 0.5, gravity_m_s2: 9.806_65, gravity_error_m_s2: 0.0, clock_ppm: 100.0 }
    }
}

/// Why there is no calibration.
#[derive(Debug, thiserror::Error)]
pub enum ByHandError {
    /// The table.
    #[error("{path}: row {row}: {message}")]
    Row {
        /// The table.
        path: PathBuf,
        /// Number of the row, from 1 for the header.
        row: usize,
        /// What is wrong.
        message: String,
    },
    /// The table cannot be read, or lacks a column.
    #[error("{path}: {message}")]
    Table {
        /// The table.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// A log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A scale that no sensor has.
    #[error("{path}: {quantity}: {message}")]
    Implausible {
        /// The table.
        path: PathBuf,
        /// The scale.
        quantity: String,
        /// Why not.
        message: String,
    },
    /// The steps determine nothing.
    #[error("the steps determine no axis: six positions (`up`) with an accelerometer, or turns about each axis with a gyro, are needed")]
    Nothing,
}

/// One step of the table with the sums of its log.
struct Step {
    turned_rad: [f64; 3],
    /// Direction of the upward axis; `None` in a turn.
    up: Option<[f64; 3]>,
    duration_s: f64,
    /// Integral of each gyro column, and mean of each accelerometer column; NaN without the column.
    values: [f64; 6],
    /// Standard deviation of each mean, from those of up to [`PARTS`] parts of the step; 0 for the integrals.
    noise: [f64; 6],
    /// Its degrees of freedom.
    noise_dof: usize,
}

fn direction(text: &str) -> Option<[f64; 3]> {
    if text.contains(':') {
        let numbers: Vec<f64> = text.split(':').map(|number| number.trim().parse::<f64>()).collect::<Result<_, _>>().ok()?;
        let up: [f64; 3] = numbers.try_into().ok()?;
        let length = up.iter().map(|part| part * part).sum::<f64>().sqrt();
        return (length.is_finite() && length > 0.0).then(|| up.map(|part| part / length));
    }
    let (sign, axis) = match text.split_at_checked(1)? {
        ("+", axis) => (1.0, axis),
        ("-" | "−", axis) => (-1.0, axis),
        _ => (1.0, text),
    };
    let at = AXES.iter().position(|name| *name == axis)?;
    let mut up = [0.0; 3];
    up[at] = sign;
    Some(up)
}

fn read(table: &Path, logs: &Path) -> Result<Vec<Step>, ByHandError> {
    let table_error = |message: String| ByHandError::Table { path: table.to_owned(), message };
    let text = std::fs::read_to_string(table).map_err(|e| table_error(format!("cannot be read: {e}")))?;
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let names: Vec<&str> = lines.next().map_or(Vec::new(), |(_, header)| header.split(',').map(str::trim).collect());
    let place = |column: &str| names.iter().position(|name| *name == column);
    let required = |column: &str| place(column).ok_or_else(|| table_error(format!("the column {column} is missing")));
    let (file, from, to) = (required("file")?, required("from")?, required("to")?);
    let turns = AXES.map(|axis| place(&format!("turn_{axis}_deg")));
    let up = place("up");
    let mut known: Vec<(String, Log)> = Vec::new();
    let mut steps = Vec::new();
    for (line, text) in lines {
        let cells: Vec<&str> = text.split(',').map(str::trim).collect();
        let cell = |at: usize| cells.get(at).copied().unwrap_or("");
        let error = |message: String| ByHandError::Row { path: table.to_owned(), row: line + 1, message };
        let number = |at: usize| cell(at).parse::<f64>().map_err(|_| error(format!("{}: `{}` is not a number", names[at], cell(at))));
        let optional = |at: Option<usize>| at.filter(|at| !cell(*at).is_empty()).map_or(Ok(0.0), number);
        let (from_s, to_s) = (number(from)?, number(to)?);
        let name = cell(file);
        if !known.iter().any(|(known, _)| known == name) {
            known.push((name.to_owned(), Log::read_also(logs.join(name), &COLUMNS)?));
        }
        let Some((_, log)) = known.iter().find(|(known, _)| known == name) else { continue };
        let t_s = log.t_s();
        let rows: Vec<usize> = (0..t_s.len()).filter(|k| t_s[*k] >= from_s && t_s[*k] <= to_s).collect();
        if rows.len() < 2 {
            return Err(error(format!("{name} has fewer than two rows from {from_s} to {to_s} s")));
        }
        let direction =
            match up.map(cell).filter(|text| !text.is_empty()) {
                Some(text) => Some(direction(text).ok_or_else(|| {
                    error(format!("up: `{text}` is none of +x, -x, +y, -y, +z, -z, and no direction such as 0.5:0.866:0"))
                })?),
                None => None,
            };
        let mut turned_rad = [0.0; 3];
        for (turned, at) in turned_rad.iter_mut().zip(turns) {
            *turned = optional(at)?.to_radians();
        }
        let integral = |column: &[f64]| rows.windows(2).map(|w| 0.5 * (column[w[0]] + column[w[1]]) * (t_s[w[1]] - t_s[w[0]])).sum::<f64>();
        let duration_s = t_s[rows[rows.len() - 1]] - t_s[rows[0]];
        let of = |k: usize| {
            log.column(COLUMNS[k]).map_or(f64::NAN, |column| if k < 3 { integral(column) } else { integral(column) / duration_s })
        };
        let noise = |k: usize| log.column(COLUMNS[k]).filter(|_| k >= 3).map_or(0.0, |column| noise_of_mean(column, &rows));
        steps.push(Step {
            turned_rad,
            up: direction,
            duration_s,
            values: std::array::from_fn(of),
            noise: std::array::from_fn(noise),
            noise_dof: rows.len().min(PARTS) - 1,
        });
    }
    Ok(steps)
}

/// Standard deviation of the mean of these rows, from the scatter of its parts: noise that is not white within a part is contained.
fn noise_of_mean(column: &[f64], rows: &[usize]) -> f64 {
    let parts = rows.len().min(PARTS);
    let length = rows.len() / parts;
    let means: Vec<f64> =
        rows.chunks_exact(length).take(parts).map(|part| part.iter().map(|k| column[*k]).sum::<f64>() / length as f64).collect();
    let mean = means.iter().sum::<f64>() / parts as f64;
    (means.iter().map(|part| (part - mean).powi(2)).sum::<f64>() / (parts * (parts - 1)) as f64).sqrt()
}

/// Calibrates the axes of an inertial unit.
///
/// # Errors
/// The table or a log cannot be read; the steps determine no axis.
pub fn calibrate(table: &Path, logs: &Path, known: &HandAssumptions) -> Result<Vec<Quantity>, ByHandError> {
    let steps = read(table, logs)?;
    let mut quantities = Vec::new();
    for axis in 0..3 {
        gyro_axis(&steps, axis, known, &mut quantities);
    }
    for axis in 0..3 {
        accelerometer_axis(&steps, axis, known, &mut quantities);
    }
    for scale in quantities.iter().filter(|q| q.meaning == Some(Meaning::HandScale)) {
        if let Some(message) = objection(scale.value) {
            return Err(ByHandError::Implausible { path: table.to_owned(), quantity: scale.name.clone(), message });
        }
    }
    if quantities.is_empty() { Err(ByHandError::Nothing) } else { Ok(quantities) }
}

fn gyro_axis(steps: &[Step], axis: usize, known: &HandAssumptions, quantities: &mut Vec<Quantity>) {
    let used: Vec<&Step> = steps.iter().filter(|s| s.values[axis].is_finite()).collect();
    let turned: Vec<usize> = (0..3).filter(|k| used.iter().any(|s| s.turned_rad[*k] != 0.0)).collect();
    if !turned.contains(&axis) {
        return;
    }
    let rows: Vec<Vec<f64>> = used.iter().map(|s| turned.iter().map(|k| s.turned_rad[*k]).chain([s.duration_s]).collect()).collect();
    let integrals: Vec<f64> = used.iter().map(|s| s.values[axis]).collect();
    let Some(fit) = least_squares(&rows, &integrals) else { return };
    let noise =
        |k: usize| Contribution::type_a("noise and repeatability", fit.sigma(k), fit.dof, Basis::WholeTurnRuns { count: used.len() });
    let count = used.iter().filter(|s| s.turned_rad[axis] != 0.0).count() as f64;
    let largest = used.iter().map(|s| s.turned_rad[axis].abs()).fold(0.0, f64::max);
    for (k, other) in turned.iter().enumerate() {
        let value = fit.coefficients[k];
        let name = AXES[axis];
        if *other == axis {
            let half_width = known.turn_error_deg.to_radians() / largest / count.sqrt();
            let turn = Contribution::rectangular(
                "angle turned",
                half_width,
                "1",
                value,
                Basis::TurnHalfWidth { half_width_deg: known.turn_error_deg },
            );
            let clock =
                Contribution::rectangular("clock", known.clock_ppm * 1e-6, "1", value, Basis::Crystal { half_width_ppm: known.clock_ppm });
            quantities
                .push(Quantity::new(&format!("gyro_{name}_scale"), "1", value, vec![noise(k), turn, clock]).meaning(Meaning::HandScale));
        } else {
            let level = axis_direction(known);
            let name = format!("gyro_{name}_by_{}", AXES[*other]);
            quantities.push(Quantity::new(&name, "1", value, vec![noise(k), level]).meaning(Meaning::HandCrossAxis));
        }
    }
    let bias = fit.coefficients[turned.len()];
    let name = format!("gyro_{}_bias_rad_s", AXES[axis]);
    quantities.push(Quantity::new(&name, "rad/s", bias, vec![noise(turned.len()), earth()]).meaning(Meaning::BiasWithEarthRate));
}

/// Direction of the axis of a turn or of gravity in the frame of the unit.
fn axis_direction(known: &HandAssumptions) -> Contribution {
    Contribution::rectangular(
        "direction of the axis",
        known.level_deg.to_radians(),
        "rad",
        1.0,
        Basis::TiltHalfWidth { half_width_deg: known.level_deg },
    )
}

/// The Earth's rotation along the axis, which a unit turned by hand does not separate.
fn earth() -> Contribution {
    Contribution::rectangular("Earth rate", stand_acquire::calibration_session::EARTH_RAD_S, "rad/s", 1.0, Basis::LatitudeUnknown)
}

fn accelerometer_axis(steps: &[Step], axis: usize, known: &HandAssumptions, quantities: &mut Vec<Quantity>) {
    let used: Vec<(&Step, [f64; 3])> = steps.iter().filter(|s| s.values[3 + axis].is_finite()).filter_map(|s| Some((s, s.up?))).collect();
    let has = |sign: f64| used.iter().any(|(_, up)| sign * up[axis] > MIN_COMPONENT);
    if !(has(1.0) && has(-1.0)) {
        return;
    }
    let others: Vec<usize> = (0..3).filter(|k| *k != axis && used.iter().any(|(_, up)| up[*k] != 0.0)).collect();
    let g = known.gravity_m_s2;
    let mut components: Vec<f64> = used.iter().map(|(_, up)| up[axis]).collect();
    components.sort_by(f64::total_cmp);
    components.dedup_by(|a, b| (*a - *b).abs() < DISTINCT_COMPONENTS);
    let has_square = components.iter().any(|component| component.abs() < MIN_COMPONENT);
    // A cubic needs four components of gravity.
    let has_cube = has_square && components.len() >= 4;
    let row = |up: &[f64; 3]| {
        let mut row = vec![1.0, g * up[axis]];
        row.extend(others.iter().map(|k| g * up[*k]));
        let force = g * up[axis];
        row.extend([(has_square, force.powi(2)), (has_cube, force.powi(3))].into_iter().filter(|(has, _)| *has).map(|(_, power)| power));
        row
    };
    let means: Vec<f64> = used.iter().map(|(s, _)| s.values[3 + axis]).collect();
    let rows: Vec<Vec<f64>> = used.iter().map(|(_, up)| row(up)).collect();
    let level_rad = known.level_deg.to_radians();
    // The noise is that of one sensor: pooled over the positions.
    let noise = (used.iter().map(|(s, _)| s.noise[3 + axis].powi(2)).sum::<f64>() / used.len() as f64).sqrt();
    // The error of an angle acts in the first order where the axis is not upright; each position has its own.
    let tilt = |up: &[f64; 3]| g * level_rad / 3.0_f64.sqrt() * (1.0 - up[axis].powi(2)).max(0.0).sqrt();
    let errors: Vec<PositionErrors> = used.iter().map(|(_, up)| PositionErrors { noise, tilt: tilt(up) }).collect();
    let noise_dof = used.iter().map(|(s, _)| s.noise_dof).sum::<usize>() as f64;
    // More positions than coefficients are needed; without them the highest powers are left out.
    let linear = 2 + others.len();
    let fitted = (linear..=rows[0].len()).rev().find_map(|columns| {
        let rows: Vec<Vec<f64>> = rows.iter().map(|row| row[..columns].to_vec()).collect();
        positions_fit::fit(&rows, &means, &errors, noise_dof).filter(|_| rows.len() > columns || columns == linear)
    });
    let Some(fit) = fitted else { return };
    let name = AXES[axis];
    let errors_of = |k: usize| {
        let basis = Basis::TiltHalfWidth { half_width_deg: known.level_deg };
        let noise = Contribution::type_a("noise and repeatability", fit.noise[k], fit.dof, Basis::Positions { count: used.len() });
        // The sensitivity that gives this standard uncertainty.
        let sensitivity = if level_rad > 0.0 { fit.tilt[k] * 3.0_f64.sqrt() / level_rad } else { 0.0 };
        vec![noise, Contribution::rectangular("angles of the positions", level_rad, "rad", sensitivity, basis)]
    };
    // cos of a tilt uniform within ± level: a one-sided error, in the budget of the scale with its greatest value, in that of the bias, where
    // two positions share it, with half of it.
    let cosine = |unit: &str, sensitivity: f64| {
        let basis = Basis::TiltHalfWidth { half_width_deg: known.level_deg };
        Contribution::rectangular("level", 0.5 * level_rad * level_rad, unit, sensitivity, basis)
    };
    let mut of_bias = errors_of(0);
    of_bias.push(cosine("1", 0.5 * g * fit.coefficients[1]));
    let bias = Quantity::new(&format!("accel_{name}_bias_m_s2"), "m/s²", fit.coefficients[0], of_bias);
    quantities.push(bias.meaning(Meaning::TumbleK0));
    let mut of_scale = errors_of(1);
    of_scale.push(cosine("1", fit.coefficients[1]));
    if known.gravity_error_m_s2 > 0.0 {
        let basis = Basis::GravityHalfWidth { half_width_m_s2: known.gravity_error_m_s2 };
        of_scale.push(Contribution::rectangular("gravity", known.gravity_error_m_s2, "m/s²", fit.coefficients[1] / g, basis));
    }
    let scale = Quantity::new(&format!("accel_{name}_scale"), "1", fit.coefficients[1], of_scale);
    quantities.push(scale.meaning(Meaning::TumbleK1));
    for (k, other) in others.iter().enumerate() {
        let mut contributions = errors_of(2 + k);
        contributions.push(axis_direction(known));
        let q = Quantity::new(&format!("accel_{name}_by_{}", AXES[*other]), "1", fit.coefficients[2 + k], contributions);
        quantities.push(q.meaning(Meaning::HandCrossAxis));
    }
    let powers = [("k2_s2_m", "s²/m", Meaning::TumbleK2), ("k3_s4_m2", "s⁴/m²", Meaning::TumbleK3)];
    for (k, (power, unit, meaning)) in (linear..fit.coefficients.len()).zip(powers) {
        let q = Quantity::new(&format!("accel_{name}_{power}"), unit, fit.coefficients[k], errors_of(k));
        quantities.push(q.meaning(meaning));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::peripherals::Noise;

    /// A tumble in steps of 30° about z on a dividing head, whose angles are off within the stated half-width: bias, scale, K₂ and K₃ of x
    /// are covered. Six upright positions give no K₃.
    #[test]
    fn a_tumble_on_a_dividing_head_gives_the_third_order() {
        let truth = [("accel_x_bias_m_s2", 0.02), ("accel_x_scale", 1.003), ("accel_x_k2_s2_m", 3e-5), ("accel_x_k3_s4_m2", -4e-6)];
        let known = HandAssumptions { level_deg: 0.002, ..HandAssumptions::default() };
        let mut covered = 0;
        for seed in 0..30 {
            let folder = tempfile::tempdir().unwrap();
            let (mut head, mut noise) = (Noise::new(seed, 1, 1.0), Noise::new(seed, 2, 1e-4));
            let mut csv = "t_s,accel_x_m_s2\n".to_owned();
            let mut table = "file,from,to,up\n".to_owned();
            for k in 0..24 {
                let angle_rad = f64::from(k % 12) * 30_f64.to_radians();
                let force = 9.806_65 * (angle_rad + head.uniform(known.level_deg.to_radians())).cos();
                let output = truth[0].1 + truth[1].1 * force + truth[2].1 * force.powi(2) + truth[3].1 * force.powi(3) + noise.draw();
                for row in 0..3 {
                    csv += &format!("{},{output:.9}\n", f64::from(10 * k + row) * 0.1);
                }
                table += &format!("log.csv,{},{},{:.9}:{:.9}:0\n", f64::from(k), f64::from(k) + 0.2, angle_rad.cos(), angle_rad.sin());
            }
            std::fs::write(folder.path().join("log.csv"), csv).unwrap();
            let path = folder.path().join("table.csv");
            std::fs::write(&path, table).unwrap();
            let found = calibrate(&path, folder.path(), &known).unwrap();
            for (name, truth) in truth {
                let quantity = found.iter().find(|quantity| quantity.name == name).unwrap_or_else(|| panic!("{name}"));
                covered += u32::from(quantity.covers(truth));
                assert!(name != "accel_x_k3_s4_m2" || quantity.expanded_u() < 1.5e-6, "{quantity:?}");
            }
        }
        // 95 % of 120 less three standard errors.
        assert!(covered >= 107, "{covered}");
        assert!(direction("0:0:0").is_none() && direction("1:2").is_none() && direction("3:0:4") == Some([0.6, 0.0, 0.8]));
    }

    /// Six positions twice and two turns of ± 360° about each axis, with known errors and small noise.
    #[test]
    fn axes_of_a_unit_turned_by_hand_are_recovered() {
        let folder = tempfile::tempdir().unwrap();
        let gyro = [[1.02, 0.004, -0.003], [0.002, 0.97, 0.006], [-0.005, 0.001, 1.01]];
        let gyro_bias = [0.01, -0.02, 0.005];
        let accel = [[1.01, 0.003, -0.002], [0.001, 0.99, 0.004], [-0.004, 0.002, 1.005]];
        let accel_bias = [0.1, -0.2, 0.05];
        let mut csv = format!("t_s,{}\n", COLUMNS.join(","));
        let mut table = "file,from,to,turn_x_deg,turn_y_deg,turn_z_deg,up\n".to_owned();
        let mut t = 0.0;
        let mut seed = 0.0_f64;
        let mut noise = |size: f64| {
            seed += 1.0;
            size * 12_f64.sqrt() * ((seed * 0.618_034).fract() - 0.5)
        };
        let mut add = |rate: [f64; 3], up: [f64; 3], row: String, csv: &mut String, table: &mut String| {
            let from = t;
            for _ in 0..=400 {
                let omega = |i: usize| gyro_bias[i] + (0..3).map(|j| gyro[i][j] * rate[j]).sum::<f64>();
                let force = |i: usize| accel_bias[i] + (0..3).map(|j| accel[i][j] * 9.806_65 * up[j]).sum::<f64>();
                *csv += &format!("{t:.3}");
                (0..3).for_each(|i| *csv += &format!(",{:.9}", omega(i) + noise(1e-3)));
                (0..3).for_each(|i| *csv += &format!(",{:.9}", force(i) + noise(1e-2)));
                *csv += "\n";
                t += 0.01;
            }
            *table += &format!("log.csv,{:.3},{:.3},{row}\n", from, t - 0.01);
        };
        for round in 0..2 {
            for (name, up) in [
                ("+x", [1., 0., 0.]),
                ("-x", [-1., 0., 0.]),
                ("+y", [0., 1., 0.]),
                ("-y", [0., -1., 0.]),
                ("+z", [0., 0., 1.]),
                ("-z", [0., 0., -1.]),
            ] {
                add([0.0; 3], up, format!(",,,{name}"), &mut csv, &mut table);
            }
            for axis in 0..3 {
                let sign = if round == 0 { 1.0 } else { -1.0 };
                let mut rate = [0.0; 3];
                rate[axis] = sign * std::f64::consts::TAU / 4.0;
                let mut cells = ["", "", ""].map(str::to_owned);
                cells[axis] = format!("{}", sign * 360.0);
                add(rate, [0.0, 0.0, 1.0], format!("{},", cells.join(",")), &mut csv, &mut table);
            }
        }
        std::fs::write(folder.path().join("log.csv"), csv).unwrap();
        let path = folder.path().join("table.csv");
        std::fs::write(&path, table).unwrap();
        let found = calibrate(&path, folder.path(), &HandAssumptions::default()).unwrap();
        let check = |name: &str, truth: f64| {
            let q = found.iter().find(|q| q.name == name).unwrap_or_else(|| panic!("{name}"));
            assert!(q.covers(truth) && q.expanded_u() < 0.05, "{name} = {} ± {}, truth {truth}", q.value, q.expanded_u());
        };
        for (i, a) in AXES.iter().enumerate() {
            check(&format!("gyro_{a}_bias_rad_s"), gyro_bias[i]);
            check(&format!("accel_{a}_scale"), accel[i][i]);
            check(&format!("gyro_{a}_scale"), gyro[i][i]);
            for (j, b) in AXES.iter().enumerate().filter(|(j, _)| *j != i) {
                check(&format!("gyro_{a}_by_{b}"), gyro[i][j]);
                check(&format!("accel_{a}_by_{b}"), accel[i][j]);
            }
        }
        // In upright positions a tilt acts in the second order: 0.5° half-width is 4e-5 of the scale.
        for axis in AXES {
            let scale = found.iter().find(|q| q.name == format!("accel_{axis}_scale")).unwrap();
            assert!(scale.expanded_u() < 3e-4, "{scale:?}");
        }
        let bias = found.iter().find(|q| q.name == "accel_x_bias_m_s2").unwrap();
        assert!(bias.covers(0.1), "{} ± {}", bias.value, bias.expanded_u());
        let wrong = std::fs::read_to_string(&path).unwrap().replace("+y", "north");
        std::fs::write(&path, wrong).unwrap();
        let error = calibrate(&path, folder.path(), &HandAssumptions::default()).unwrap_err().to_string();
        assert!(error.contains("row 4") && error.contains("`north`"), "{error}");
    }
}

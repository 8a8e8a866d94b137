//! Noise of the simulated sensor under test: from the stand file through registers, driver and rows to the coefficients of the Allan
//! deviation.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{self, SessionRequest};
use stand_analysis::allan::deviation::Series;
use stand_analysis::allan::noise::{self, Found};
use stand_analysis::allan::{FLOOR, MAX_RELATIVE_TAU};
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;
use std::f64::consts::FRAC_PI_2;

const ROW_S: f64 = 1e-3;
/// Cutoff of the gyro's low-pass at 1667 Hz (DS13012, table 60).
const CUTOFF_HZ: f64 = 304.2;

/// The column `gyro_rad_s` of a stand at rest whose sensor under test has this noise.
fn at_rest(noise: &str, seconds: f64, seed: u64) -> Vec<f64> {
    let stand = Stand::parse(&format!("[imu]\n{noise}\n")).unwrap();
    let profile = ProfileConfig::new(ProfileKind::Constant, 0.0, 1);
    let request = SessionRequest { mode: Mode::Voltage, profile, seconds, seed };
    let record = session::run(stand.setup(), Plant::new(&stand, 0.0).unwrap(), request).unwrap();
    // The first rows come before the first sample.
    record.column("gyro_rad_s").unwrap()[200..].to_vec()
}

/// Averaging factors, one per octave, and the Allan deviations.
fn curve(rates: &[f64]) -> Vec<(usize, f64)> {
    let longest = (rates.len() as f64 * MAX_RELATIVE_TAU) as usize;
    let factors: Vec<usize> = (0..).map(|k| 1 << k).take_while(|m| *m <= longest).collect();
    let rows = 0..rates.len();
    let found = Series::of_rates(rates.to_vec(), &[rows]).overlapping(&factors);
    found.iter().map(|v| (v.factor, v.variance.sqrt())).collect()
}

fn fitted(rates: Vec<f64>) -> Found {
    let rows = rates.len();
    let factors: Vec<usize> = (0..).map(|k| 1 << k).take_while(|m| *m <= rows / 10).collect();
    let segment = 0..rows;
    noise::fit(&Series::of_rates(rates, &[segment]).overlapping(&factors), &[(rows + 1, 1)]).unwrap()
}

/// Asserts σ(τ) = `expected` between two averaging times, within three standard errors: an overlapping deviation over T has about
/// T/τ degrees of freedom, its relative standard error is 1/√(2 T/τ).
#[track_caller]
fn follows(rates: &[f64], from_s: f64, to_s: f64, expected: impl Fn(f64) -> f64) {
    let duration_s = rates.len() as f64 * ROW_S;
    let mut compared = 0;
    for (factor, deviation) in curve(rates) {
        let tau_s = factor as f64 * ROW_S;
        if (from_s..=to_s).contains(&tau_s) {
            let error = 3.0 * (tau_s / (2.0 * duration_s)).sqrt() + 0.02;
            assert!((deviation / expected(tau_s) - 1.0).abs() < error, "{tau_s} s: {deviation} {} ± {error}", expected(tau_s));
            compared += 1;
        }
    }
    assert!(compared >= 4, "{compared}");
}

/// Standard deviation of the angle after 1 s, from samples of independent noise.
fn angle_random_walk(density_rad_s_rtHz: f64) -> f64 {
    density_rad_s_rtHz * (FRAC_PI_2 * CUTOFF_HZ * ROW_S).sqrt()
}

const NO_SLOW_NOISE: &str = "gyro_bias_instability_rad_s = 0.0\ngyro_random_walk_rad_s_rts = 0.0";

#[test]
fn without_flicker_and_random_walk_white_noise_alone_remains() {
    let density = 1e-3;
    let rates = at_rest(&format!("gyro_noise_rad_s_rtHz = {density}\n{NO_SLOW_NOISE}"), 60.0, 1);
    follows(&rates, 0.004, 6.0, |tau_s| angle_random_walk(density) / tau_s.sqrt());
    let found = fitted(rates);
    assert!(found.intervals[2].is_none() && found.intervals[3].is_none(), "{found:?}");
}

#[test]
fn the_floor_of_the_flicker_noise_is_0_664_times_the_bias_instability() {
    let noise = "gyro_noise_rad_s_rtHz = 0.0\ngyro_bias_instability_rad_s = 0.1\ngyro_random_walk_rad_s_rts = 0.0";
    follows(&at_rest(noise, 120.0, 2), 0.2, 12.0, |_| FLOOR * 0.1);
}

#[test]
fn the_random_walk_rises_with_the_root_of_the_averaging_time() {
    let noise = "gyro_noise_rad_s_rtHz = 0.0\ngyro_bias_instability_rad_s = 0.0\ngyro_random_walk_rad_s_rts = 0.1";
    follows(&at_rest(noise, 120.0, 3), 0.2, 12.0, |tau_s| 0.1 * (tau_s / 3.0).sqrt());
}

#[test]
fn the_estimator_recovers_all_three_coefficients_from_one_record() {
    // White noise equals the floor at 1 s, the random walk at 20 s: all within the range of the flicker noise, which begins at 0.2 s.
    let (density, instability, walk) = (1.45e-3, 1.5e-3, 3.9e-4);
    let noise =
        format!("gyro_noise_rad_s_rtHz = {density}\ngyro_bias_instability_rad_s = {instability}\ngyro_random_walk_rad_s_rts = {walk}");
    // In 1200 s a ramp explains the longest averages nearly as well as the random walk, in 2400 s not.
    let found = fitted(at_rest(&noise, 2400.0, 4));
    let wanted = [(1, angle_random_walk(density)), (2, instability), (3, walk)];
    let rows = [1.0, ROW_S.sqrt(), 1.0, 1.0 / ROW_S.sqrt()];
    for (process, wanted) in wanted {
        let value = found.squares[process].sqrt() * rows[process];
        let [low, high] = found.intervals[process].unwrap().within_95.map(|square| square.sqrt() * rows[process]);
        println!("process {process}: {value:.4e}, 95 % between {low:.4e} and {high:.4e}, true {wanted:.4e}");
        // The simulated flicker noise is within 2 % of its nominal floor.
        assert!(0.98 * low <= wanted && wanted <= 1.02 * high, "{process}: {low} to {high}, not {wanted}");
        assert!(high < 2.5 * low, "{process}: {low} to {high} is too uncertain for a test");
    }
}

//! Noise coefficients and confidence intervals for known noise.
#![allow(clippy::unwrap_used)]

use crate::common::gyro_noise;
use gyro_noise::{DEG_H, Gyro};
use nalgebra::DMatrix;
use stand_analysis::allan::confidence::{Covariance, Squares, chi_squared_share, interval};
use stand_analysis::allan::deviation::Series;
use stand_analysis::allan::noise::{self, Found};

#[track_caller]
fn close(found: f64, wanted: f64, relative: f64, what: &str) {
    assert!((found / wanted - 1.0).abs() <= relative, "{what}: {found}, not {wanted}");
}

fn whole(rates: Vec<f64>) -> Series {
    let rows = 0..rates.len();
    Series::of_rates(rates, &[rows])
}

#[test]
fn degrees_of_freedom_match_greenhall_and_riley() {
    // For white rates, m = 1 is exact: z is white minus its predecessor, M²/(M + (M − 1)/2).
    let terms = 1023.0;
    let exact = Covariance::new(1, 1, &[(1025, 1)]).degrees_of_freedom(&[0.0, 1.0, 0.0, 0.0, 0.0]);
    close(exact, terms * terms / (terms + (terms - 1.0) / 2.0), 1e-9, "white, m 1");
    // Greenhall and Riley's formulas (allantools' edf_greenhall, d = 2, overlapping, unmodified) for 1025 angles and α = 0, −1, −2. They
    // average each angle over a row, which matters for few rows, and truncate their sums, which is accurate to a few per cent.
    let table: [(usize, [f64; 3]); 2] = [(32, [44.442, 35.719, 28.156]), (128, [9.83, 7.609, 5.903])];
    for (m, wanted) in table {
        let covariance = Covariance::new(m, m, &[(1025, 1)]);
        for (p, wanted) in wanted.into_iter().enumerate() {
            let mut squares = [0.0; 5];
            squares[p + 1] = 1.0;
            close(covariance.degrees_of_freedom(&squares), wanted, 0.03, &format!("m {m}, process {p}"));
        }
    }
    // 95 % of χ² with 10 degrees is between 3.247 and 20.483 (any table).
    assert!((10.0 * chi_squared_share(0.025, 10.0) - 3.247).abs() < 5e-4 && (10.0 * chi_squared_share(0.975, 10.0) - 20.483).abs() < 5e-4);
    // No discontinuity where the formula changes at many degrees of freedom.
    for p in [0.025, 0.16, 0.84, 0.975] {
        close(chi_squared_share(p, 400.001), chi_squared_share(p, 400.0), 2e-5, "many");
    }
    let [low, high] = interval(1.0, 10.0, 0.95);
    close(low, (10.0_f64 / 20.483).sqrt(), 1e-4, "low");
    close(high, (10.0_f64 / 3.247).sqrt(), 1e-4, "high");
}

/// Correlations of the variances at all octaves up to a tenth of 52 200 rows.
fn correlations(squares: &Squares) -> DMatrix<f64> {
    let covariance = DMatrix::from_fn(13, 13, |i, j| Covariance::new(1 << i, 1 << j, &[(52_201, 1)]).of(squares));
    DMatrix::from_fn(13, 13, |i, j| covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt())
}

/// The covariance matrix of estimates is positive definite, whatever the noise: a likelihood by another one has maxima where it is
/// singular.
#[test]
fn variances_at_all_octaves_have_a_positive_definite_covariance() {
    for squares in [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0, 0.0],
        [0.0, 1.0, 0.0, 4e-4, 0.0],
        [0.0, 1.0, 1e-2, 1e-5, 1e-9],
        [1.0, 1.0, 0.0, 1e-3, 0.0],
    ] {
        let smallest = correlations(&squares).symmetric_eigenvalues().min();
        assert!(smallest > 5e-3, "{squares:?}: smallest eigenvalue {smallest}");
    }
    // By sums over all lags with 64 lags per averaging time, independent of this code.
    let walk = correlations(&[0.0, 0.0, 0.0, 1.0, 0.0]);
    close(walk[(0, 6)], 0.17003, 0.01, "random walk, factors 1 and 64");
    close(walk[(0, 1)], 0.87200, 0.01, "random walk, factors 1 and 2");
}

/// Fit of all octaves up to a tenth of the record.
fn fitted(rates: Vec<f64>) -> Found {
    let rows = rates.len();
    let factors: Vec<usize> = (0..).map(|k| 1 << k).take_while(|m| *m <= rows / 10).collect();
    noise::fit(&whole(rates).overlapping(&factors), &[(rows + 1, 1)]).unwrap()
}

#[test]
fn intervals_have_their_stated_coverage() {
    let (series, rows) = (1000, 4000);
    let (mut of_n, mut of_points, mut strangers) = (0, [0; 3], 0);
    let factors = [4, 32, 256];
    for seed in 0..series {
        let rates = Gyro { white: 1.0, ..Gyro::default() }.rates(rows, 1.0, 100 + seed);
        for (k, found) in whole(rates.clone()).overlapping(&factors).iter().enumerate() {
            let degrees = Covariance::new(found.factor, found.factor, &[(rows + 1, 1)]).degrees_of_freedom(&[0.0, 1.0, 0.0, 0.0, 0.0]);
            let [low, high] = interval(found.variance.sqrt(), degrees, 0.95);
            let truth = 1.0 / (found.factor as f64).sqrt();
            of_points[k] += usize::from(low <= truth && truth <= high);
        }
        let found = fitted(rates);
        let [low, high] = found.intervals[1].unwrap().within_95;
        of_n += usize::from(low <= 1.0 && 1.0 <= high);
        strangers += found.intervals.iter().flatten().count() - 1;
    }
    println!("95 % intervals: N {of_n}, points {of_points:?}; strangers {strangers}; of {series}");
    // 93 to 97 %: three standard errors of a thousand.
    let promised = 930..=970;
    // The upper end of N is the larger one of the fits with and without quantisation noise: up to 98.5 %.
    assert!((930..=985).contains(&of_n), "{of_n}");
    assert!(of_points.iter().all(|n| promised.contains(n)), "{of_points:?}");
    assert!(strangers <= 30, "processes that are not there: {strangers}");
}

#[test]
fn known_noise_is_estimated_within_its_uncertainty() {
    // A good MEMS gyro: 0.3 °/√h, 4 °/h, 60 °/h/√h, an hour and a half at 50 Hz.
    let interval_s = 0.02_f64;
    let truth = Gyro { white: 0.3 / 60.0 * DEG_H * 3600.0, flicker: 4.0 * DEG_H, walk: DEG_H, ..Gyro::default() };
    let wanted = [0.0, truth.white / interval_s.sqrt(), truth.flicker, truth.walk * interval_s.sqrt(), 0.0];
    let (mut shown, mut covered, count) = ([0; 5], [0; 5], 24);
    for seed in 0..count {
        let found = fitted(truth.rates(1 << 18, interval_s, seed));
        for p in 1..4 {
            let square = wanted[p] * wanted[p];
            let inside = match found.intervals[p] {
                Some(intervals) => {
                    shown[p] += 1;
                    intervals.within_95[0] <= square && square <= intervals.within_95[1]
                }
                None => square <= found.below[p],
            };
            covered[p] += i32::from(inside);
        }
    }
    println!("N, B, K shown {:?}, covered {:?} of {count}", &shown[1..4], &covered[1..4]);
    assert_eq!(shown[1], count as i32);
    assert!(shown[2] * 2 > count as i32 && shown[3] * 2 > count as i32, "{shown:?}");
    // 95 % of 24: 20 or fewer have a probability of 0.6 %.
    assert!(covered[1..4].iter().all(|n| *n > 20), "{covered:?}");
}

#[test]
fn quantisation_and_ramp_are_estimated() {
    let truth = Gyro { quantisation: 1e-5, white: 1e-5, ramp: 2e-8, ..Gyro::default() };
    let found = fitted(truth.rates(1 << 17, 0.1, 4));
    let seconds = [0.1, 0.1_f64.sqrt(), 1.0, 1.0 / 0.1_f64.sqrt(), 10.0];
    for (p, wanted) in [(0, truth.quantisation), (1, truth.white), (4, truth.ramp)] {
        let [low, high] = found.intervals[p].unwrap().within_95.map(|square| square.sqrt() * seconds[p]);
        assert!(low <= wanted && wanted <= high && high < 1.5 * low, "{p}: {low} to {high}, not {wanted}");
    }
}

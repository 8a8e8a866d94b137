//! Online estimate of the drive's constants: `MEASure:DRIVe?`.
//!
//! In: the weighted sums of [`Window`]s. Out: R, K, J, b and c (Coulomb) of u = R i + K ω and J ω' = K i − b ω − c sign ω (docs/theory.md
//! §4), each with its standard error. Two regressions have the *current* as the dependent variable, because its noise is by far the largest
//! and a noisy regressor would bias its coefficient; angle and commanded voltage are almost exact:
//!
//! ```text
//! ∫φi = (1/R) ∫φu − (K/R) ∫φω − τ ∫φi' + o ∫φ     ∫φi = (J/K) ∫φω' + (b/K) ∫φω ± (c/K) ∫φ + o ∫φ
//! ```
//!
//! with o the offset of the current sensor and τ = L/R the time constant of the winding, without which K would be 0.1 % low. Both errors
//! are the same noise; their covariance is taken into account. Windows in which the platform stood or reversed are left out: there the
//! friction is not c. All windows since the last restart count ([`LeastSquares`]).

use super::least_squares::{LeastSquares, Regressor};
use super::matrix::Matrix;
use super::windows::Window;

/// Elements of z: the dependent variable first.
const CURRENT: usize = 0;
const VOLTAGE: usize = 1;
const RATE: usize = 2;
const ACCELERATION: usize = 3;
const FRICTION: usize = 4;
const OFFSET: usize = 5;
const SLOPE: usize = 6;
/// Number of elements; the sensor's regression has the same number, so that both share one instance of the code.
pub(super) const ELEMENTS: usize = 7;
/// Lags of the residuals' autocovariance: one second.
const LAGS: usize = 10;
/// Fewest windows for an estimate.
const MIN_WINDOWS: u32 = 20;
/// Offset of the current's sensor, 1 σ: INA240A2 (SBOS662) 25 µV over 20 mΩ is 1.3 mA, its mid-supply reference to 0.1 % 3 mA.
const OFFSET_A: f64 = 4e-3;

/// Prior of the winding's time constant, 1 σ, s: it is not observable at constant current.
const TIME_CONSTANT_S: f64 = 5e-3;

/// A value with its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error, 1 σ.
    pub sigma: f64,
}

impl Estimate {
    /// Whether the rows determine the value: at least five times its standard error.
    pub fn is_significant(&self) -> bool {
        libm::fabs(self.value) > 5.0 * self.sigma
    }
}

/// Estimates of the drive's constants.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriveReading {
    /// Resistance, Ω; not significant without changes of voltage or rate.
    pub resistance_ohm: Estimate,
    /// Motor constant, N m/A and V s/rad.
    pub motor_constant_N_m_A: Estimate,
    /// Inertia; not significant at a constant rate.
    pub inertia_kg_m2: Estimate,
    /// Viscous friction.
    pub viscous_N_m_s: Estimate,
    /// Coulomb friction; with rotation in one direction only its error contains the current's offset.
    pub coulomb_N_m: Estimate,
    /// Number of windows used.
    pub windows: u32,
}

/// Estimator of the drive's constants.
#[derive(Clone, Copy, Debug, Default)]
pub struct DriveEstimator {
    sums: LeastSquares<ELEMENTS, LAGS>,
}

impl DriveEstimator {
    /// Adds a window.
    pub fn add(&mut self, window: &Window) {
        let current = window.ampere_s.zip(window.slope_A);
        let z = current.zip(window.direction).map(|((ampere_s, slope_A), direction)| {
            let friction = f64::from(direction) * window.weight_s;
            [ampere_s, window.volt_s, window.angle_rad, window.rate_rad_s, friction, window.weight_s, slope_A]
        });
        self.sums.add(z);
    }

    /// Forgets all windows.
    pub fn restart(&mut self) {
        *self = Self::default();
    }

    /// The estimates so far; `None` with too few windows.
    pub fn reading(&self) -> Option<DriveReading> {
        let sums = &self.sums;
        if sums.count() < MIN_WINDOWS {
            return None;
        }
        let offset = Regressor { prior_sigma: OFFSET_A, ..Regressor::plus(OFFSET) };
        let winding = Regressor { prior_sigma: TIME_CONSTANT_S, ..Regressor::minus(SLOPE) };
        let electrical = sums.solve([Regressor::plus(VOLTAGE), Regressor::minus(RATE), winding, offset])?;
        let mechanical = sums.solve([Regressor::plus(ACCELERATION), Regressor::plus(RATE), Regressor::plus(FRICTION), offset])?;
        let [g, h, ..] = electrical.coefficients;
        let [p, q, r, _] = mechanical.coefficients;
        if g <= 0.0 {
            return None;
        }
        let covariances = Covariances {
            electrical: sums.covariance(&electrical, &electrical, true),
            mechanical: sums.covariance(&mechanical, &mechanical, true),
            cross: sums.covariance(&electrical, &mechanical, false),
        };
        let (resistance, constant) = (1.0 / g, h / g);
        // Derivatives of K = h/g; the others are K times p, q, r.
        let by_constant = [-h / (g * g), 1.0 / g, 0.0, 0.0];
        let times = |value: f64, place: usize| {
            let electrical = by_constant.map(|d| d * value);
            let mechanical = core::array::from_fn(|k| if k == place { constant } else { 0.0 });
            Estimate { value: constant * value, sigma: covariances.sigma(electrical, mechanical) }
        };
        Some(DriveReading {
            resistance_ohm: Estimate { value: resistance, sigma: covariances.sigma([-1.0 / (g * g), 0.0, 0.0, 0.0], [0.0; 4]) },
            motor_constant_N_m_A: Estimate { value: constant, sigma: covariances.sigma(by_constant, [0.0; 4]) },
            inertia_kg_m2: times(p, 0),
            viscous_N_m_s: times(q, 1),
            coulomb_N_m: times(r, 2),
            windows: sums.count(),
        })
    }
}

const _: () = assert!(CURRENT == 0, "the dependent variable is the first element");

/// Covariances of both regressions.
struct Covariances {
    electrical: Matrix<4, 4>,
    mechanical: Matrix<4, 4>,
    cross: Matrix<4, 4>,
}

impl Covariances {
    /// Standard error of a quantity with these derivatives by the coefficients.
    fn sigma(&self, electrical: [f64; 4], mechanical: [f64; 4]) -> f64 {
        let variance = self.electrical.form(&electrical, &electrical)
            + 2.0 * self.cross.form(&electrical, &mechanical)
            + self.mechanical.form(&mechanical, &mechanical);
        libm::sqrt(f64::max(variance, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Windows of a drive with a noisy current, with rotation in both directions or in one.
    fn run(both_ways: bool, seed: u64) -> DriveReading {
        let (resistance, constant, inertia, viscous, coulomb) = (2.3, 0.0234, 2.5e-4, 2e-5, 9e-4);
        let mut state = seed;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 12_f64.sqrt()
        };
        let mut drive = DriveEstimator::default();
        for _ in 0..600 {
            let way = if both_ways && noise() < 0.0 { -1.0 } else { 1.0 };
            let (rate, acceleration) = (way * (8.0 + 3.0 * noise()), 10.0 * noise());
            let current = (inertia * acceleration + viscous * rate + coulomb * way) / constant;
            let volts = resistance * current + constant * rate;
            drive.add(&Window {
                weight_s: 1.0,
                volt_s: volts,
                ampere_s: Some(current + 2e-3 * noise()),
                slope_A: Some(0.01 * noise()),
                angle_rad: rate,
                rate_rad_s: acceleration,
                slope_rad_s2: 0.0,
                sensor_rad: None,
                direction: Some(way as i8),
            });
        }
        let reading = drive.reading().unwrap();
        for (estimate, truth) in [
            (reading.resistance_ohm, resistance),
            (reading.motor_constant_N_m_A, constant),
            (reading.inertia_kg_m2, inertia),
            (reading.viscous_N_m_s, viscous),
            (reading.coulomb_N_m, coulomb),
        ] {
            assert!((estimate.value - truth).abs() < 4.0 * estimate.sigma && estimate.sigma < 0.5 * truth, "{truth}: {estimate:?}");
        }
        reading
    }

    #[test]
    fn constants_are_within_their_errors_and_one_direction_leaves_friction_uncertain() {
        for seed in 1..=20 {
            let (both, one) = (run(true, seed), run(false, seed));
            assert!(both.coulomb_N_m.sigma < 2e-5, "{both:?}");
            // 4 mA of offset are 94 µN m.
            assert!((8e-5..1.2e-4).contains(&one.coulomb_N_m.sigma), "{one:?}");
        }
    }

    #[test]
    fn a_drive_at_rest_has_no_estimate() {
        let mut drive = DriveEstimator::default();
        for _ in 0..100 {
            drive.add(&Window { ampere_s: Some(0.1), slope_A: Some(0.0), ..Window::default() });
        }
        assert_eq!(drive.reading(), None);
    }
}

//! Error of an observer in single precision, by running the firmware's law in both precisions.

use stand_firmware::gyro_loop::observer::{Design as Law, Observer, Real};

use super::Discrete;

/// Errors of single precision against double precision in steady state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Single {
    /// Error of the estimated α′ against double precision, rad/s.
    pub rate_rad_s: f64,
    /// Relative error of the estimated moment; 0 for a static observer.
    pub moment: f64,
}

/// Moment, N m, and initial angle, rad, of the test vector in docs/theory.md §1.6.
const MOMENT_N_M: f64 = 1e-5;
const ANGLE_RAD: f64 = 1e-3;
const STEPS: usize = 2000;

/// Errors in single precision; `None` if the firmware rejects the design.
pub(super) fn single(discrete: &Discrete) -> Option<Single> {
    match discrete.gains.len() {
        4 => of::<4>(discrete),
        5 => of::<5>(discrete),
        6 => of::<6>(discrete),
        7 => of::<7>(discrete),
        _ => None,
    }
}

fn of<const N: usize>(discrete: &Discrete) -> Option<Single> {
    let one = run::<f32, N>(discrete)?;
    let other = run::<f64, N>(discrete)?;
    let moment = if discrete.has_disturbance { (one[N - 1] - other[N - 1]).abs() / MOMENT_N_M } else { 0.0 };
    Some(Single { rate_rad_s: (one[1] - other[1]).abs(), moment })
}

fn run<T: Real, const N: usize>(discrete: &Discrete) -> Option<[f64; N]> {
    let (phi, gamma, gains) = discrete.numbers::<N>();
    let law = Law::<T, N>::new(&phi, &gamma, &gains).ok()?;
    // The plant is the observer's model. A disturbance enters like the control moment, by Γ.
    let states = N - usize::from(discrete.has_disturbance);
    let mut plant = vec![0.0; states];
    plant[0] = ANGLE_RAD;
    let mut observer = Observer::at(T::from_f64(ANGLE_RAD));
    for _ in 0..STEPS {
        observer.step(&law, T::from_f64(plant[0]), T::ZERO);
        plant = (0..states).map(|i| (0..states).map(|j| phi[i][j] * plant[j]).sum::<f64>() + gamma[i] * MOMENT_N_M).collect();
    }
    Some(observer.estimate().map(Real::to_f64))
}

//! Checks the discrete observer on the target's instruction set (vectors of docs/theory.md §1.6) and counts the instructions of a step.
//!
//! Runs under QEMU with `-icount shift=10`. A deviation from a vector panics and QEMU exits with a failure.
//! Output: one line per observer, `name|states|instructions per step`.
#![no_std]
#![no_main]

#[path = "../meter.rs"]
mod meter;
#[allow(clippy::excessive_precision)]
#[path = "../../../firmware/src/gyro_loop/observer/vectors.rs"]
mod vectors;

use core::hint::black_box;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use meter::Meter;
use panic_semihosting as _;
use stand_firmware::gyro_loop::observer::{Design, Observer, Real};
use vectors::{GAIN_5, GAIN_6, GAIN_7, GAMMA_5, GAMMA_6, GAMMA_7, PHI_5, PHI_6, PHI_7};

/// Step; α − α̂ and α′ − α̂′ of the static and of the astatic observer; estimated moment of the astatic one; relative tolerance.
type Vector = (u32, [f64; 2], [f64; 2], f64, f64);
const VECTORS: [Vector; 3] = [
    (300, [-8.481336e-5, -7.962803e-3], [6.491505e-5, 9.828458e-3], -7.919037e-3, 1e-5),
    (500, [9.700624e-8, 1.476126e-5], [2.425026e-7, 3.204966e-5], -7.695208e-6, 1e-3),
    (2000, [1.890740e-7, 2.246645e-5], [0.0, 0.0], 1e-5, 1e-5),
];
const MOMENT_N_M: f64 = 1e-5;

#[entry]
fn main() -> ! {
    let Some(core) = cortex_m::Peripherals::take() else { panic!("the core's peripherals were taken before") };
    let meter = Meter::calibrate(core.SYST);
    check_vectors();
    hprintln!("# the vectors of docs/theory.md §1.6 are reproduced on this instruction set");
    count::<f64, 7>(&meter, "six states, astatic, double", &PHI_7, &GAMMA_7, &GAIN_7);
    count::<f64, 5>(&meter, "four states, astatic, double", &PHI_5, &GAMMA_5, &GAIN_5);
    count::<f32, 7>(&meter, "six states, astatic, single", &PHI_7, &GAMMA_7, &GAIN_7);
    count::<f32, 5>(&meter, "four states, astatic, single", &PHI_5, &GAMMA_5, &GAIN_5);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::nop();
    }
}

fn design<T: Real, const N: usize>(phi: &[[f64; N]; N], gamma: &[f64; N], gain: &[f64; N]) -> Design<T, N> {
    match Design::new(phi, gamma, gain) {
        Ok(design) => design,
        Err(error) => panic!("{}", error.parameter()),
    }
}

fn check_vectors() {
    let fixed = design::<f64, 6>(&PHI_6, &GAMMA_6, &GAIN_6);
    let astatic = design::<f64, 7>(&PHI_7, &GAMMA_7, &GAIN_7);
    let mut plant = [1e-3, 0.0, 0.0, 0.0, 0.0, 0.0];
    let (mut static_observer, mut astatic_observer) = (Observer::at(0.0), Observer::at(0.0));
    for step in 1..=2000 {
        static_observer.step(&fixed, plant[0], 0.0);
        astatic_observer.step(&astatic, plant[0], 0.0);
        let before = plant;
        for (next, (row, gamma)) in plant.iter_mut().zip(PHI_6.iter().zip(&GAMMA_6)) {
            *next = row.iter().zip(&before).map(|(phi, x)| phi * x).sum::<f64>() + gamma * MOMENT_N_M;
        }
        for (at, expected_static, expected_astatic, moment, tolerance) in VECTORS.iter().filter(|vector| vector.0 == step) {
            for k in 0..2 {
                assert_near(*at, plant[k] - static_observer.estimate()[k], expected_static[k], *tolerance);
                assert_near(*at, plant[k] - astatic_observer.estimate()[k], expected_astatic[k], *tolerance);
            }
            assert_near(*at, astatic_observer.estimate()[6], *moment, *tolerance);
        }
    }
}

/// An expected zero is compared with the rounding error of milliradian angles, 300 times larger in a rate.
fn assert_near(step: u32, value: f64, expected: f64, relative: f64) {
    let off = value - expected;
    let most = relative * expected.abs() + if expected == 0.0 { 3e-13 } else { 0.0 };
    assert!(off.abs() <= most, "step {step}: {value:e} is not {expected:e}");
}

/// Instructions of a step in mid-run, where no value is zero or a power of two.
fn count<T: Real, const N: usize>(meter: &Meter, name: &str, phi: &[[f64; N]; N], gamma: &[f64; N], gain: &[f64; N]) {
    let design = design::<T, N>(phi, gamma, gain);
    let mut observer = Observer::at(T::from_f64(1e-3));
    let mut greatest = 0;
    for step in 0..200_u32 {
        let (angle, moment) = (T::from_f64(1.1e-3 + 1.3e-6 * f64::from(step)), T::from_f64(3.3e-6));
        let instructions = meter.count(|| {
            black_box(black_box(&mut observer).step(black_box(&design), black_box(angle), black_box(moment)));
        });
        greatest = greatest.max(instructions);
    }
    hprintln!("{}|{}|{}", name, N, greatest);
}

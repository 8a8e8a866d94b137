//! Evaluation of a calibration: from the sums to a compensation.
//!
//! At harmonic order n, with s = j n ω, the torque balance of the rotor is u = (R/K)(J s² Δ − T) + K s Δ, where Δ is the deviation of the
//! angle. The voltage for an exactly constant rate is therefore u − (K s + R J/K s²) Δ, and the disturbance T is −K/R times that. The mean
//! of both directions depends on the angle alone: it is the harmonic. Half their difference is noise (and angle-dependent friction); its
//! median over all orders gives the standard error of the mean. A harmonic is accepted if noise reaches its amplitude in one of a thousand
//! calibrations, and if it exceeds one compare count of the bridge.

use super::CalibrationError;
use super::map::{BINS, Bin, Map};
use super::trajectory::Trajectory;
use crate::board::Hardware;
use crate::compensation::{Compensation, Harmonic, Harmonics, MAX_HARMONICS};
use crate::speed_loop::{Limits, Settings};
use core::f64::consts::{FRAC_PI_2, LN_2, TAU};

/// Number of harmonic orders that are evaluated; a bin is too wide for higher ones.
const EVALUATED_ORDERS: usize = BINS >> 2;
/// Probability that noise alone exceeds the threshold at any order.
const FALSE_ALARM_PROBABILITY: f64 = 1e-3;

/// Result of a calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationResult {
    /// The compensation; fade and winding lag are taken from the settings.
    pub compensation: Compensation,
    /// The accepted harmonics, strongest first, with their standard error.
    pub harmonics: [Option<MeasuredHarmonic>; MAX_HARMONICS],
    /// Amplitude that a harmonic must exceed to be accepted, N m.
    pub threshold_N_m: f64,
}

/// A harmonic with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredHarmonic {
    /// The harmonic.
    pub harmonic: Harmonic,
    /// Standard error of its amplitude, N m.
    pub sigma_N_m: f64,
}

/// A complex amplitude. Single precision, as the bins; 256 successive rotations lose 2·10⁻⁵.
#[derive(Clone, Copy, Default)]
struct Phasor {
    re: f32,
    im: f32,
}

impl Phasor {
    /// exp(j angle).
    fn unit(angle_rad: f32) -> Self {
        let (sine, cosine) = libm::sincos(f64::from(angle_rad));
        Self { re: cosine as f32, im: sine as f32 }
    }

    #[inline(never)]
    fn times(self, re: f32, im: f32) -> Self {
        Self { re: self.re * re - self.im * im, im: self.re * im + self.im * re }
    }

    fn plus(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }

    fn magnitude(self) -> f64 {
        libm::sqrt(f64::from(self.re * self.re + self.im * self.im))
    }
}

/// Evaluates the sums, with a yield after each harmonic order.
///
/// # Errors
/// A bin is empty (the platform did not turn fully), no current was measured, or the compensation is out of range.
pub(super) async fn evaluate(
    map: &Map,
    trajectory: &Trajectory,
    settings: &Settings,
    hardware: &Hardware,
) -> Result<CalibrationResult, CalibrationError> {
    if [map.forward(), map.backward()].into_iter().flatten().any(|bin| bin.count == 0) {
        return Err(CalibrationError::RateNotHeld(Limits::default()));
    }
    let (slow, fast) = trajectory.rates_rad_s();
    let mut half_differences = [0.0_f32; EVALUATED_ORDERS];
    let mut strongest: [Option<(Harmonic, f64)>; MAX_HARMONICS] = [None; MAX_HARMONICS];
    for (order, half) in (1..).zip(half_differences.iter_mut()) {
        let forward = disturbance(map.forward(), order, slow, settings);
        let backward = disturbance(map.backward(), order, -slow, settings);
        let mean = forward.plus(backward).times(0.5, 0.0);
        let half_difference = forward.plus(backward.times(-1.0, 0.0)).magnitude() * 0.5;
        *half = half_difference as f32;
        // a sin(nθ + φ) is the real part of −j a exp(jφ) exp(jnθ).
        let phase_rad = libm::atan2(f64::from(mean.im), f64::from(mean.re)) + FRAC_PI_2;
        let harmonic =
            Harmonic { order, torque_N_m: mean.magnitude(), phase_rad: if phase_rad < 0.0 { phase_rad + TAU } else { phase_rad } };
        insert(&mut strongest, harmonic, half_difference);
        // One order takes 3 ms on the chip: rows and replies run in between.
        embassy_futures::yield_now().await;
    }
    // The magnitude of two normal components of equal σ has the median σ √(2 ln 2).
    let sigma_N_m = f64::from(median(&half_differences)) / libm::sqrt(2.0 * LN_2);
    // Quantisation of encoder and bridge reaches one compare count, and is not noise.
    let one_count_N_m = hardware.volt_per_duty() * settings.motor_constant_N_m_A / settings.resistance_ohm;
    let threshold_N_m = f64::max(one_count_N_m, sigma_N_m * libm::sqrt(2.0 * libm::log(EVALUATED_ORDERS as f64 / FALSE_ALARM_PROBABILITY)));
    let mut harmonics = [None; MAX_HARMONICS];
    let mut accepted = Harmonics::default();
    // A harmonic that differs between the directions does not depend on the angle alone.
    let significant = strongest.iter().flatten().filter(|(h, half)| h.torque_N_m > threshold_N_m && h.torque_N_m > 2.0 * half);
    for (place, (harmonic, _)) in harmonics.iter_mut().zip(significant) {
        *place = Some(MeasuredHarmonic { harmonic: *harmonic, sigma_N_m });
        accepted.push(*harmonic);
    }
    let constant = settings.motor_constant_N_m_A;
    let (slow_A, fast_A) = map.friction_currents_A().ok_or(CalibrationError::NoCurrent)?;
    let (at_slow, at_fast) = (slow_A * constant, fast_A * constant);
    let viscous_N_m_s = f64::max((at_fast - at_slow) / (fast - slow), 0.0);
    let coulomb_N_m = f64::max(at_slow - viscous_N_m_s * slow, 0.0);
    let compensation = Compensation { coulomb_N_m, viscous_N_m_s, harmonics: accepted, ..settings.compensation };
    compensation.check(constant * settings.current_limit_A).map_err(CalibrationError::Settings)?;
    Ok(CalibrationResult { compensation, harmonics, threshold_N_m })
}

/// Disturbing torque of one harmonic order in one direction, N m; `rate_rad_s` is signed.
#[inline(never)]
fn disturbance(turn: &[Bin; BINS], order: u16, rate_rad_s: f64, settings: &Settings) -> Phasor {
    let n = f32::from(order);
    let bin_rad = TAU as f32 / BINS as f32;
    // A bin's mean is the value in its middle times sinc of half its width.
    let half_width = 0.5 * n * bin_rad;
    let mut rotation = Phasor::unit(-half_width);
    let scale = -2.0 / BINS as f32 * half_width / rotation.im;
    let step = Phasor::unit(-n * bin_rad);
    let (mut voltage, mut deviation) = (Phasor::default(), Phasor::default());
    for bin in turn {
        let weight = 1.0 / bin.count.max(1) as f32;
        voltage = voltage.plus(rotation.times(bin.voltage_V * weight, 0.0));
        deviation = deviation.plus(rotation.times(bin.deviation_rad * weight, 0.0));
        rotation = rotation.times(step.re, step.im);
    }
    let (constant, resistance) = (settings.motor_constant_N_m_A as f32, settings.resistance_ohm as f32);
    let frequency = n * rate_rad_s as f32;
    // −(K s + R J/K s²) with s = j n ω.
    let inertial = resistance * settings.inertia_kg_m2 as f32 / constant * frequency * frequency;
    let holding_voltage = voltage.plus(deviation.times(inertial, -constant * frequency)).times(scale, 0.0);
    holding_voltage.times(-constant / resistance, 0.0)
}

/// Inserts a harmonic into the list of the strongest, together with half the difference of the two directions.
fn insert(strongest: &mut [Option<(Harmonic, f64)>; MAX_HARMONICS], harmonic: Harmonic, half: f64) {
    let mut carried = Some((harmonic, half));
    for place in strongest {
        let torque_N_m = |entry: &Option<(Harmonic, f64)>| entry.map(|(harmonic, _)| harmonic.torque_N_m);
        // `None` is weaker than any harmonic.
        if torque_N_m(place) < torque_N_m(&carried) {
            core::mem::swap(place, &mut carried);
        }
    }
}

/// The median, by counting: a sort would take 8 KiB of flash.
fn median(values: &[f32; EVALUATED_ORDERS]) -> f32 {
    let below = |value: f32| values.iter().filter(|other| **other < value).count();
    values.iter().copied().filter(|value| below(*value) <= EVALUATED_ORDERS >> 1).fold(0.0, f32::max)
}

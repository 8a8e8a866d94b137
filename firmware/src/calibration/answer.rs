//! From the sums to a compensation.
//!
//! At order n, with s = j n ω, the torque balance of the rotor is u = (R/K)(J s² Δ − T) + K s Δ, where Δ is the deviation of the angle. So
//! the voltage that would hold the rate exactly is u − (K s + R J/K s²) Δ, and the disturbance T = −K/R times that. What is the same in
//! both directions belongs to the angle and is the harmonic; half their difference is noise (and friction that changes with the angle),
//! and its median over all orders says how much of the mean is noise. An order is taken if noise would reach it once in a thousand
//! calibrations, and if it is more than one compare count of the bridge.

use super::Refused;
use super::course::Course;
use super::map::{BINS, Bin, Map};
use crate::board::Hardware;
use crate::compensation::{Compensation, Harmonic, Harmonics, MOST_HARMONICS};
use crate::speed_loop::{Limits, Settings};
use core::f64::consts::{FRAC_PI_2, LN_2, TAU};

/// Orders that are looked at; above, a bin is too wide.
const ORDERS: usize = BINS >> 2;
/// Chance that an order of pure noise is taken, over all orders.
const CHANCE: f64 = 1e-3;

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The compensation to be used; its fade and winding lag are the settings'.
    pub compensation: Compensation,
    /// The orders, the strongest first, with their uncertainty.
    pub harmonics: [Option<FoundHarmonic>; MOST_HARMONICS],
    /// Amplitude that an order must exceed to be taken, N m.
    pub threshold_N_m: f64,
}

/// An order and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundHarmonic {
    /// The harmonic.
    pub harmonic: Harmonic,
    /// Standard error of its amplitude, N m.
    pub sigma_N_m: f64,
}

/// A complex amplitude, in single precision: a bin holds no more, and 256 of them turned one after the other lose 2·10⁻⁵.
#[derive(Clone, Copy, Default)]
struct Phasor {
    re: f32,
    im: f32,
}

impl Phasor {
    /// Of the length 1.
    fn at(angle_rad: f32) -> Self {
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

    fn size(self) -> f64 {
        libm::sqrt(f64::from(self.re * self.re + self.im * self.im))
    }
}

/// Works the answer out.
///
/// # Errors
/// Where a bin stayed empty (the platform did not turn round) or no current was measured.
pub(super) async fn answer(map: &Map, course: &Course, settings: &Settings, hardware: &Hardware) -> Result<Found, Refused> {
    if [false, true].iter().any(|backwards| map.turn(*backwards).iter().any(|bin| bin.count == 0)) {
        return Err(Refused::NotHeld(Limits::default()));
    }
    let (slow, fast) = course.rates_rad_s();
    let mut halves = [0.0_f32; ORDERS];
    let mut best: [Option<(Harmonic, f64)>; MOST_HARMONICS] = [None; MOST_HARMONICS];
    for (order, half) in (1..).zip(halves.iter_mut()) {
        let [forwards, backwards] = [(false, slow), (true, -slow)].map(|(back, rate)| disturbance(map.turn(back), order, rate, settings));
        let mean = forwards.plus(backwards).times(0.5, 0.0);
        let apart = forwards.plus(backwards.times(-1.0, 0.0)).size() * 0.5;
        *half = apart as f32;
        // a sin(nθ + φ) is the real part of −j a exp(jφ) exp(jnθ).
        let phase_rad = libm::atan2(f64::from(mean.im), f64::from(mean.re)) + FRAC_PI_2;
        let harmonic = Harmonic { order, torque_N_m: mean.size(), phase_rad: if phase_rad < 0.0 { phase_rad + TAU } else { phase_rad } };
        insert(&mut best, harmonic, apart);
        // An order is 3 ms of the chip's time: rows and replies come between.
        embassy_futures::yield_now().await;
    }
    // The size of two equal normal components has the median σ √(2 ln 2).
    let sigma_N_m = f64::from(median(&halves)) / libm::sqrt(2.0 * LN_2);
    // Below one compare count of the bridge, what the encoder's and the bridge's own steps make of a turn is as large, and no noise.
    let one_count_N_m = hardware.volt_per_duty() * settings.motor_constant_N_m_A / settings.resistance_ohm;
    let threshold_N_m = f64::max(one_count_N_m, sigma_N_m * libm::sqrt(2.0 * libm::log(ORDERS as f64 / CHANCE)));
    let mut harmonics = [None; MOST_HARMONICS];
    let mut taken = Harmonics::default();
    // An order of which the two directions say different things does not belong to the angle alone.
    let sure = best.iter().flatten().filter(|(h, half)| h.torque_N_m > threshold_N_m && h.torque_N_m > 2.0 * half);
    for (place, (harmonic, _)) in harmonics.iter_mut().zip(sure) {
        *place = Some(FoundHarmonic { harmonic: *harmonic, sigma_N_m });
        taken.push(*harmonic);
    }
    let constant = settings.motor_constant_N_m_A;
    let torque = |slow| map.friction_A(slow).map(|current_A| current_A * constant).ok_or(Refused::NoCurrent);
    let (at_slow, at_fast) = (torque(true)?, torque(false)?);
    let viscous_N_m_s = f64::max((at_fast - at_slow) / (fast - slow), 0.0);
    let coulomb_N_m = f64::max(at_slow - viscous_N_m_s * slow, 0.0);
    let compensation = Compensation { coulomb_N_m, viscous_N_m_s, harmonics: taken, ..settings.compensation };
    compensation.check(constant * settings.current_limit_A).map_err(Refused::Settings)?;
    Ok(Found { compensation, harmonics, threshold_N_m })
}

/// Disturbing torque of one order in one direction, N m; the rate has its sign.
#[inline(never)]
fn disturbance(turn: &[Bin; BINS], order: u16, rate_rad_s: f64, settings: &Settings) -> Phasor {
    let n = f32::from(order);
    let bin_rad = TAU as f32 / BINS as f32;
    // A bin's mean is the value in its middle, weaker by the sine of half its width over that half.
    let half_width = 0.5 * n * bin_rad;
    let mut turned = Phasor::at(-half_width);
    let scale = -2.0 / BINS as f32 * half_width / turned.im;
    let step = Phasor::at(-n * bin_rad);
    let (mut voltage, mut deviation) = (Phasor::default(), Phasor::default());
    for bin in turn {
        let part = 1.0 / bin.count.max(1) as f32;
        voltage = voltage.plus(turned.times(bin.voltage_V * part, 0.0));
        deviation = deviation.plus(turned.times(bin.deviation_rad * part, 0.0));
        turned = turned.times(step.re, step.im);
    }
    let (constant, resistance) = (settings.motor_constant_N_m_A as f32, settings.resistance_ohm as f32);
    let frequency = n * rate_rad_s as f32;
    // −(K s + R J/K s²) with s = j n ω.
    let inertial = resistance * settings.inertia_kg_m2 as f32 / constant * frequency * frequency;
    let held = voltage.plus(deviation.times(inertial, -constant * frequency)).times(scale, 0.0);
    held.times(-constant / resistance, 0.0)
}

/// Puts a harmonic into its place among the strongest, with half the difference of the two directions.
fn insert(best: &mut [Option<(Harmonic, f64)>; MOST_HARMONICS], harmonic: Harmonic, half: f64) {
    let mut carried = Some((harmonic, half));
    for place in best {
        let weaker = |held: &Option<(Harmonic, f64)>, new: &Option<(Harmonic, f64)>| match (held, new) {
            (Some((held, _)), Some((new, _))) => held.torque_N_m < new.torque_N_m,
            (None, _) => true,
            (_, None) => false,
        };
        if weaker(place, &carried) {
            core::mem::swap(place, &mut carried);
        }
    }
}

/// The value that half of the others are below. By counting: a sort is 8 KiB of flash, and this is asked once.
fn median(values: &[f32; ORDERS]) -> f32 {
    let below = |value: f32| values.iter().filter(|other| **other < value).count();
    values.iter().copied().filter(|value| below(*value) <= ORDERS >> 1).fold(0.0, f32::max)
}

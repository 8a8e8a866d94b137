//! Responses along a chirp: the lock-in of a signal over the platform's rate while the frequency grows exponentially.
//!
//! Input: a log with the notes of its chirp, the encoder angle, rad, and the samples of a signal with their age, s. Output: the signal over
//! the rate at the middle of each piece of the chirp. Frequency and amplitude change during a piece: both signals are fitted by the sweep
//! itself with an amplitude that is linear in time.

use super::lock_in::{Response, mean_rate};
use identification::log::Log;
use identification::statistics::least_squares;
use nalgebra::{Complex, DMatrix};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Pieces of a chirp.
const PIECES: usize = 24;
/// Fewest rows of a piece.
const MIN_PIECE_ROWS: usize = 200;
/// Fewest and most blocks of a piece.
const MIN_BLOCKS: usize = 4;
const MAX_BLOCKS: f64 = 24.0;
/// Fewest blocks for a response that is quadratic in the logarithm of the frequency.
const MIN_QUADRATIC_BLOCKS: usize = 6;

/// Responses along a chirp, cut into pieces of little frequency change. `age`: time from a sample of `output` to its row, s.
pub(super) fn along_chirp(log: &Log, theta: &[f64], output: &[f64], age: Option<&[f64]>) -> Vec<Response> {
    let note = |key: &str| log.notes().number(key);
    let (Some(from_Hz), Some(to_Hz), Some(sweep_s)) = (note("profile_from_Hz"), note("profile_to_Hz"), note("profile_sweep_s")) else {
        return Vec::new();
    };
    let t_s = log.t_s();
    let sweep = Sweep { begin_s: t_s[0], from_Hz, rate_1_s: (to_Hz / from_Hz).ln() / sweep_s };
    let mut found = Vec::new();
    for piece in 0..PIECES {
        let at = |k: usize| t_s[0] + sweep_s * k as f64 / PIECES as f64;
        let rows = t_s.partition_point(|t| *t < at(piece))..t_s.partition_point(|t| *t < at(piece + 1));
        if rows.len() < MIN_PIECE_ROWS {
            continue;
        }
        let [t_s, theta, output] = [t_s, theta, output].map(|column| &column[rows.clone()]);
        found.extend(piece_response(t_s, theta, output, age.map(|a| &a[rows.clone()]), &sweep));
    }
    found
}

/// A sine whose frequency grows exponentially.
struct Sweep {
    begin_s: f64,
    from_Hz: f64,
    /// Relative growth of the frequency, 1/s.
    rate_1_s: f64,
}

impl Sweep {
    fn frequency_Hz(&self, t_s: f64) -> f64 {
        self.from_Hz * (self.rate_1_s * (t_s - self.begin_s)).exp()
    }

    /// Phase from one time to another, rad.
    fn phase_rad(&self, from_s: f64, to_s: f64) -> f64 {
        TAU * (self.frequency_Hz(to_s) - self.frequency_Hz(from_s)) / self.rate_1_s
    }

    /// Phasor of the part of a signal that follows the sweep, at the middle of a block, and the derivative of the phasor there, 1/s:
    /// Hann-weighted fit of the sweep with an amplitude that is linear in time, beside a cubic. A window alone would leave the slow motion
    /// and the image at twice the frequency, which a block of few periods does not separate.
    fn phasor(&self, t_s: &[f64], y: &[f64], [middle_s, half_s]: [f64; 2]) -> Option<[Complex<f64>; 2]> {
        let each = t_s.iter().zip(y).map(|(t, y)| {
            let x = (t - middle_s) / half_s;
            let weight = (FRAC_PI_2 * x.clamp(-1.0, 1.0)).cos();
            let (sin, cos) = self.phase_rad(middle_s, *t).sin_cos();
            ([cos, sin, x * cos, x * sin, 1.0, x, x * x, x * x * x].map(|column| weight * column).to_vec(), weight * y)
        });
        let (rows, values): (Vec<Vec<f64>>, Vec<f64>) = each.unzip();
        let fit = least_squares(&rows, &values)?;
        // a cos φ + b sin φ = Re (a − jb) e^(jφ).
        let [a, b, a_slope, b_slope, ..] = fit.coefficients[..] else { return None };
        Some([Complex::new(a, -b), Complex::new(a_slope, -b_slope) / half_s])
    }
}

/// Response of one piece: phasors of rate and output at the middle of each block, and a regression of the output over the rate whose
/// coefficient is a polynomial in the logarithm of the frequency; the response is its value at the middle of the piece.
fn piece_response(t_s: &[f64], theta: &[f64], output: &[f64], age: Option<&[f64]>, sweep: &Sweep) -> Option<Response> {
    let (first, last) = (*t_s.first()?, *t_s.last()?);
    let middle_Hz = sweep.frequency_Hz(0.5 * (first + last));
    // Blocks of two periods or more; each gives one pair of phasors.
    let blocks = ((last - first) * middle_Hz / 2.0).floor().min(MAX_BLOCKS) as usize;
    if blocks < MIN_BLOCKS {
        return None;
    }
    let length = t_s.len() / blocks;
    let taken: Vec<f64> = t_s.iter().enumerate().map(|(k, t)| t - age.map_or(0.0, |a| a[k])).collect();
    // Of each block: logarithm of its relative frequency, phasor of the rate, phasor of the output.
    let block = |b: usize| {
        let rows = b * length..(b + 1) * length;
        let (begin, end) = (t_s[rows.start], t_s[rows.end - 1]);
        let [middle_s, half_s] = [0.5 * (begin + end), 0.5 * (end - begin)];
        let f_Hz = sweep.frequency_Hz(middle_s);
        let [angle, growth] = sweep.phasor(&t_s[rows.clone()], &theta[rows.clone()], [middle_s, half_s])?;
        let [output, _] = sweep.phasor(&taken[rows.clone()], &output[rows], [middle_s, half_s])?;
        Some(((f_Hz / middle_Hz).ln(), Complex::new(0.0, TAU * f_Hz) * angle + growth, output))
    };
    let each = (0..blocks).map(block).collect::<Option<Vec<(f64, Complex<f64>, Complex<f64>)>>>()?;
    let terms = if blocks >= MIN_QUADRATIC_BLOCKS { 3 } else { 2 };
    let sum = |power: usize| each.iter().map(|(x, rate, _)| x.powi(power as i32) * rate.norm_sqr()).sum::<f64>();
    let inverse = DMatrix::from_fn(terms, terms, |i, j| sum(i + j)).try_inverse()?;
    let cross = |power: usize| each.iter().map(|(x, rate, output)| output * rate.conj() * x.powi(power as i32)).sum::<Complex<f64>>();
    let coefficient = |i: usize| (0..terms).map(|j| cross(j) * inverse[(i, j)]).sum::<Complex<f64>>();
    let coefficients: Vec<Complex<f64>> = (0..terms).map(coefficient).collect();
    let response = |x: f64| coefficients.iter().rev().fold(Complex::default(), |sum: Complex<f64>, c| sum * x + c);
    let residual: f64 = each.iter().map(|(x, rate, output)| (output - response(*x) * rate).norm_sqr()).sum();
    let all: f64 = each.iter().map(|(_, _, output)| output.norm_sqr()).sum();
    let variance = residual / (2.0 * (blocks - terms) as f64);
    // The amplitude of the rate changes along the sweep as e^(σt): that is the response at s = σ + jω, to first order H(jω) + σ dH/ds =
    // H(jω) − j σ H′(ω).
    let mean = each.iter().map(|(x, ..)| x).sum::<f64>() / blocks as f64;
    let spread = each.iter().map(|(x, ..)| (x - mean).powi(2)).sum::<f64>();
    let growth_1_s = sweep.rate_1_s * each.iter().map(|(x, rate, _)| (x - mean) * rate.norm().ln()).sum::<f64>() / spread;
    let h = coefficients[0] + Complex::new(0.0, growth_1_s / (TAU * middle_Hz)) * coefficients[1];
    Some(Response {
        frequency_Hz: middle_Hz,
        re: h.re,
        im: h.im,
        sigma: (variance * inverse[(0, 0)]).sqrt(),
        timing_s: 0.0,
        coherence: 1.0 - residual / all,
        rate_rad_s: (sum(0) / blocks as f64).sqrt(),
        mean_rad_s: mean_rate(t_s, theta),
    })
}

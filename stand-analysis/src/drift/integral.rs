//! Integrals of one cycle: formulas (11) to (13) of docs/theory.md §3, the reference channel, the slope, and the residual of the current.
//!
//! Input: 2 N + 1 angles and the 2 N mean currents between them. The sums have trapezoidal weights, as in the firmware.

use identification::statistics::Extremes;

/// Integrals over a cycle of two pulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integral {
    /// Duration T of a pulse, s.
    pub pulse_s: f64,
    /// ∫₁ θ dt − ∫₂ θ dt: τ U_int/K_k of (11), rad s.
    pub switched_rad_s: f64,
    /// ∫₁ θ dt + ∫₂ θ dt: S, without switching, rad s.
    pub sum_rad_s: f64,
    /// Least-squares slope of the angle, rad/s.
    pub slope_rad_s: f64,
    /// Range of the angle, rad.
    pub span_rad: f64,
}

impl Integral {
    /// Integrals of the equidistant angles of one cycle; `None` for an even number or fewer than three.
    pub fn of(angles_rad: &[f64], pulse_s: f64) -> Option<Self> {
        let n = angles_rad.len().checked_sub(1)? / 2;
        if n == 0 || angles_rad.len() != 2 * n + 1 {
            return None;
        }
        let dt_s = pulse_s / n as f64;
        let ends = [angles_rad[0], angles_rad[2 * n]];
        let first: f64 = ends[0] / 2.0 + angles_rad[1..n].iter().sum::<f64>();
        let second: f64 = angles_rad[n + 1..2 * n].iter().sum::<f64>() + ends[1] / 2.0;
        let moment: f64 = angles_rad.iter().enumerate().map(|(k, angle)| (k as f64 - n as f64) * angle).sum();
        let count = n as f64;
        let (smallest, greatest) = angles_rad.iter().copied().min_max();
        Some(Self {
            pulse_s,
            switched_rad_s: dt_s * (first - second),
            sum_rad_s: dt_s * (first + angles_rad[n] + second),
            // Σ (k − N)² = N (N + 1)(2 N + 1)/3.
            slope_rad_s: moment * 3.0 / (count * (count + 1.0) * (2.0 * count + 1.0)) / dt_s,
            span_rad: greatest - smallest,
        })
    }

    /// Formula (13): drift rate for pulses that are symmetric about their middle, or whose second pulse is reversed in time, rad/s.
    pub fn drift_rad_s(&self) -> f64 {
        -self.switched_rad_s / (self.pulse_s * self.pulse_s)
    }

    /// Formula (12): drift rate for any pulse, rad/s; `reference_rad` = 2 Φ − θ_e T = ∫ (T − 2t) w dt over the first pulse, rad s.
    pub fn drift_with_reference_rad_s(&self, reference_rad: f64) -> f64 {
        -(self.switched_rad_s - reference_rad) / (self.pulse_s * self.pulse_s)
    }
}

/// Inequality of the pulses, rad/s: ∫ W w du over a cycle with the measured rate w in each interval, W = u/T² in the first and (2T − u)/T²
/// in the second pulse.
pub fn residual_rad_s(rates_rad_s: &[f64]) -> f64 {
    let n = rates_rad_s.len() / 2;
    let weighted: f64 = rates_rad_s.iter().enumerate().map(|(k, rate)| (2 * k.min(2 * n - 1 - k) + 1) as f64 * rate).sum();
    weighted / (2.0 * (n * n) as f64)
}

/// Rate K_m i/H of the torquer by the sums S of both polarities, (S₊ − S₋)/(2 T²), rad/s.
pub fn reference_rad_s(plus: &Integral, minus: &Integral) -> f64 {
    (plus.sum_rad_s - minus.sum_rad_s) / (2.0 * plus.pulse_s * plus.pulse_s)
}

/// Magnitude of the pulses by the 2 N + 1 angles of a cycle, rad/s: that of the rectangular pulses whose triangular angle fits best.
/// Independent of drift and initial angle.
pub fn amplitude_rad_s(angles_rad: &[f64], pulse_s: f64) -> f64 {
    let n = angles_rad.len() / 2;
    let middle = n as f64 * n as f64 / (2 * n + 1) as f64;
    let triangle = |k: usize| k.min(2 * n - k) as f64 - middle;
    let (product, square) =
        angles_rad.iter().enumerate().fold((0.0, 0.0), |(p, s), (k, angle)| (p + triangle(k) * angle, s + triangle(k).powi(2)));
    if square > 0.0 { (product / square).abs() * n as f64 / pulse_s } else { 0.0 }
}

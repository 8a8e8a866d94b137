//! Noise of known coefficients, evenly spaced: white, flicker, random walk, ramp, steps of the angle.
#![allow(dead_code, reason = "each test binary uses its part")]

use hal_sim::peripherals::Noise;
use identification::statistics::fourier::Transforms;

/// One degree an hour, rad/s.
pub const DEG_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// Coefficients in rad and s.
#[derive(Debug, Clone, Copy, Default)]
pub struct Gyro {
    pub quantisation: f64,
    pub white: f64,
    pub flicker: f64,
    pub walk: f64,
    pub ramp: f64,
}

impl Gyro {
    /// `rows` rates at this interval.
    pub fn rates(&self, rows: usize, interval_s: f64, seed: u64) -> Vec<f64> {
        let (mut white, mut walk) =
            (Noise::new(seed, 0, self.white / interval_s.sqrt()), Noise::new(seed, 1, self.walk * interval_s.sqrt()));
        let mut angle = Noise::new(seed, 2, self.quantisation / interval_s);
        let flicker = flicker(rows, self.flicker, seed);
        let (mut walked, mut before) = (0.0, angle.draw());
        (0..rows)
            .map(|k| {
                walked += walk.draw();
                let now = angle.draw();
                let stepped = now - std::mem::replace(&mut before, now);
                white.draw() + flicker.get(k).unwrap_or(&0.0) + walked + stepped + self.ramp * k as f64 * interval_s
            })
            .collect()
    }
}

/// Flicker of this B: white noise through 1/√(1 − z⁻¹) (Kasdin 1995), whose one-sided density is B²/(π f), from its middle on.
fn flicker(rows: usize, b: f64, seed: u64) -> Vec<f64> {
    if b == 0.0 {
        return Vec::new();
    }
    let length = (4 * rows).next_power_of_two();
    let transforms = Transforms::of_length(length);
    let spectrum = |mut values: Vec<f64>| transforms.forward(&mut values);
    let mut driven = Noise::new(seed, 3, b);
    // The second half is zero, against circular wrap-around.
    let white = spectrum((0..length).map(|k| if k < length / 2 { driven.draw() } else { 0.0 }).collect());
    let mut weight = 1.0;
    let response = spectrum(
        (0..length)
            .map(|k| {
                if k > 0 {
                    weight *= (k as f64 - 0.5) / k as f64;
                }
                if k < length / 2 { weight } else { 0.0 }
            })
            .collect(),
    );
    let mut product: Vec<_> = white.iter().zip(&response).map(|(a, b)| a * b).collect();
    product[0].im = 0.0;
    product[length / 2].im = 0.0;
    let values = transforms.inverse(&mut product);
    values[length / 4..length / 4 + rows].iter().map(|v| v / length as f64).collect()
}

//! A sum of sines of equal amplitude at logarithmically spaced frequencies, scaled to the amplitude.
//!
//! Frequencies are multiples of the lowest, so the sum is periodic and a spectrum over whole periods has no leakage. Phases after
//! Schroeder (1970): the group delays of the lines are spread evenly over the period. For unevenly spaced multiples m this is
//! φ_{n+1} = φ_n − 2π (m_{n+1} − m_n)(n+1)/N, with a crest factor of 3.25 (4.37 with −π n²/N, which is for evenly spaced lines).

use super::{ProfileConfig, sine};
use crate::config::{ConfigError, within};

const LINES: usize = 20;

#[derive(Clone, Copy, Debug, Default)]
struct SpectralLine {
    /// In units of 2⁻⁶⁴ turn, so that the phase stays exact for hours.
    phase: u64,
    step: u64,
}

#[derive(Clone, Debug)]
pub(super) struct Multisine {
    lines: [SpectralLine; LINES],
    scale: f64,
}

impl Multisine {
    pub(super) fn new(amplitude: f64, c: &ProfileConfig) -> Result<Self, ConfigError> {
        // Limits the period, which is computed once to find the peak.
        let lowest = within("from_Hz", c.from_Hz, 0.01, 250.0)?;
        let highest = c.to_Hz;
        let last = (LINES - 1) as f64;
        let mut lines = [SpectralLine::default(); LINES];
        let mut multiple = 0.0;
        let mut turns = 0.0;
        for (n, line) in lines.iter_mut().enumerate() {
            let n = n as f64;
            let below = multiple;
            let wanted = libm::round(libm::pow(highest / lowest, n / last));
            // Lines that would coincide take the next free multiple.
            multiple = if wanted > multiple { wanted } else { multiple + 1.0 };
            turns += (multiple - below) * n / LINES as f64;
            line.phase = ((1.0 - (turns - libm::trunc(turns))) * 18_446_744_073_709_551_616.0) as u64;
            line.step = (multiple * lowest * 1e-3 * 18_446_744_073_709_551_616.0) as u64;
        }
        let mut sines = Self { lines, scale: 1.0 };
        let period_ms = (1e3 / lowest) as u32;
        let peak = (0..period_ms).map(|_| sines.next_value().abs()).fold(0.0, f64::max);
        Ok(Self { lines, scale: amplitude / f64::max(peak, 1.0) })
    }

    pub(super) fn next_value(&mut self) -> f64 {
        let mut sum = 0.0;
        for line in &mut self.lines {
            sum += sine((line.phase >> 32) as u32);
            line.phase = line.phase.wrapping_add(line.step);
        }
        sum * self.scale
    }
}

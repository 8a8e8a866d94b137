//! Means over cycles, and the inequality of positive and negative pulses by two amplitudes: it is proportional to the amplitude, the drift is not.
//!
//! A torquer that is stronger in one direction adds −ε w/2 to formula (13), equally for + − and − + (docs/theory.md §3.2). The measured current
//! corrects an unequal current, but not an unequal torquer gain. For cycles of amplitude w the rate is Ω + e w: least squares with one e per sequence (a
//! lag adds to it, with opposite signs) and one Ω per position, so that the azimuth is not affected.

use super::cycle::{Cycle, is_same_position};
use super::error::DriftError;
use super::estimate::Estimate;
use crate::statistics::Extremes;

/// Smallest ratio of two amplitudes that determines the inequality.
pub const MIN_AMPLITUDE_RATIO: f64 = 1.2;

/// Checks that amplitudes of pulses determine the inequality; any unit.
///
/// # Errors
/// The first amplitude that differs too little from an earlier one.
pub fn check_amplitudes(amplitudes: &[f64]) -> Result<(), DriftError> {
    let is_similar = |a: f64, b: f64| a.max(b) < MIN_AMPLITUDE_RATIO * a.min(b);
    for (k, rate) in amplitudes.iter().enumerate() {
        if amplitudes[..k].iter().any(|earlier| is_similar(*rate, *earlier)) {
            return Err(DriftError::SimilarAmplitudes { rate: *rate, min_ratio: MIN_AMPLITUDE_RATIO });
        }
    }
    Ok(())
}

/// Inequality of positive and negative pulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulseInequality {
    /// e of the sequences + − and − +: rate over amplitude; 0 without cycles of the sequence.
    slopes: [f64; 2],
    /// Relative excess of a negative pulse, −2 e.
    pub excess: Estimate,
    /// Scatter of one cycle about the lines, rad/s.
    scatter_rad_s: Option<f64>,
    /// Standard uncertainty by e, equal in all positions, rad/s: it acts on the own drift and not on the apparent drift.
    pub common_rad_s: Option<f64>,
}

/// The cycles of one sequence in one position.
struct Group<'a> {
    sequence: usize,
    cycles: Vec<&'a Cycle>,
}

fn groups<'a>(cycles: &[&'a Cycle]) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'a>> = Vec::new();
    for cycle in cycles {
        let sequence = cycle.sequence();
        match groups.iter_mut().find(|group| group.sequence == sequence && is_same_position(&group.cycles[0].position, &cycle.position)) {
            Some(group) => group.cycles.push(cycle),
            None => groups.push(Group { sequence, cycles: vec![cycle] }),
        }
    }
    groups
}

fn average(cycles: &[&Cycle], of: impl Fn(&Cycle) -> f64) -> f64 {
    cycles.iter().map(|cycle| of(cycle)).sum::<f64>() / cycles.len() as f64
}

impl PulseInequality {
    /// From the valid cycles of one axis; `None` where a sequence has only one amplitude.
    pub fn from_cycles(cycles: &[&Cycle], rate: &dyn Fn(&Cycle) -> f64) -> Option<Self> {
        let groups = groups(cycles);
        let mut slopes = [0.0; 2];
        let (mut variance, mut sequences) = (0.0, 0.0);
        let weight = |cycle: &Cycle, group: &Group<'_>| cycle.amplitude_rad_s - average(&group.cycles, |c| c.amplitude_rad_s);
        for sequence in [0, 1] {
            let of_sequence = || groups.iter().filter(|group| group.sequence == sequence);
            if of_sequence().next().is_none() {
                continue;
            }
            let pairs = || of_sequence().flat_map(|group| group.cycles.iter().map(move |cycle| (weight(cycle, group), *cycle)));
            let (smallest, greatest) = pairs().map(|(_, c)| c.amplitude_rad_s).min_max();
            let spread: f64 = pairs().map(|(w, _)| w * w).sum();
            // One amplitude per position: inequality and apparent drift are not separable.
            if greatest < MIN_AMPLITUDE_RATIO * smallest || spread < (0.1 * (greatest - smallest)).powi(2) {
                return None;
            }
            slopes[sequence] = pairs().map(|(w, cycle)| w * rate(cycle)).sum::<f64>() / spread;
            variance += 1.0 / spread;
            sequences += 1.0;
        }
        if sequences == 0.0 {
            return None;
        }
        let remaining = |cycle: &Cycle| rate(cycle) - slopes[cycle.sequence()] * cycle.amplitude_rad_s;
        let squares: f64 = groups
            .iter()
            .flat_map(|group| group.cycles.iter().map(|cycle| (remaining(cycle) - average(&group.cycles, remaining)).powi(2)))
            .sum();
        let free = cycles.len() as f64 - groups.len() as f64 - sequences;
        let scatter_rad_s = (free > 0.0).then(|| (squares / free).sqrt());
        let sigma = scatter_rad_s.map(|scatter| scatter * variance.sqrt() / sequences);
        Some(Self {
            slopes,
            excess: Estimate { value: -2.0 * slopes.iter().sum::<f64>() / sequences, sigma: sigma.map(|sigma| 2.0 * sigma) },
            scatter_rad_s,
            common_rad_s: sigma.map(|sigma| sigma * average(cycles, |c| c.amplitude_rad_s)),
        })
    }

    /// Contribution of the inequality to the rate of a cycle, rad/s.
    fn contribution_rad_s(&self, cycle: &Cycle) -> f64 {
        self.slopes[cycle.sequence()] * cycle.amplitude_rad_s
    }
}

/// Mean rate over the cycles of one position and axis with its standard uncertainty, rad/s: the mean of the means of both sequences.
pub fn mean(cycles: &[&Cycle], rate: &dyn Fn(&Cycle) -> f64, inequality: Option<&PulseInequality>) -> (f64, Option<f64>) {
    let groups = groups(cycles);
    let corrected = |cycle: &Cycle| rate(cycle) - inequality.map_or(0.0, |inequality| inequality.contribution_rad_s(cycle));
    let sequences = groups.len() as f64;
    let share: f64 = groups.iter().map(|group| 1.0 / group.cycles.len() as f64).sum::<f64>() / (sequences * sequences);
    let scatter = match inequality {
        Some(inequality) => inequality.scatter_rad_s,
        None => {
            let squares =
                |group: &Group<'_>| group.cycles.iter().map(|c| (corrected(c) - average(&group.cycles, corrected)).powi(2)).sum::<f64>();
            let free = cycles.len() - groups.len();
            (free > 0).then(|| (groups.iter().map(squares).sum::<f64>() / free as f64).sqrt())
        }
    };
    let value = groups.iter().map(|group| average(&group.cycles, corrected)).sum::<f64>() / sequences;
    (value, scatter.map(|scatter| scatter * share.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drift::integral::Integral;
    use hal_sim::gyro::Orientation;

    fn cycle(turned_deg: f64, sign: i8, amplitude_rad_s: f64, rate_rad_s: f64) -> Cycle {
        let integral = Integral { pulse_s: 1.0, switched_rad_s: -rate_rad_s, sum_rad_s: 0.0, slope_rad_s: 0.0, span_rad: 0.0 };
        let position = Orientation { turned_rad: f64::to_radians(turned_deg), ..Orientation::default() };
        Cycle { number: 1, position, axis: 0, sign, start_s: 0.0, integral, amplitude_rad_s, residual_rad_s: None, defect: None }
    }

    /// Ω + e w with an odd lag and one Ω per position; a missing sequence in one position changes nothing.
    #[test]
    fn extrapolation_to_amplitude_zero_gives_the_drift() {
        let mut all = Vec::new();
        for (turned_deg, omega) in [(0.0, 3.0), (180.0, 5.0)] {
            for sign in [1_i8, -1] {
                for amplitude in [1.0, 1.0, 2.5] {
                    all.push(cycle(turned_deg, sign, amplitude, omega - (0.05 - 0.01 * f64::from(sign)) * amplitude));
                }
            }
        }
        // The − + cycle of the large amplitude in the second position is missing.
        all.pop();
        let cycles: Vec<&Cycle> = all.iter().collect();
        let rate = |cycle: &Cycle| cycle.integral.drift_rad_s();
        let found = PulseInequality::from_cycles(&cycles, &rate).unwrap();
        assert!((found.excess.value - 0.1).abs() < 1e-12 && found.excess.sigma.unwrap() < 1e-12, "{found:?}");
        for (turned_rad, omega) in [(0.0, 3.0), (std::f64::consts::PI, 5.0)] {
            let in_position: Vec<&Cycle> = cycles.iter().copied().filter(|c| (c.position.turned_rad - turned_rad).abs() < 0.1).collect();
            let ((plain, _), (corrected, _)) = (mean(&in_position, &rate, None), mean(&in_position, &rate, Some(&found)));
            assert!((corrected - omega).abs() < 1e-12 && (plain - omega).abs() > 0.05, "{plain} {corrected}");
        }
    }

    #[test]
    fn no_inequality_from_one_amplitude_per_position() {
        let rate = |cycle: &Cycle| cycle.integral.drift_rad_s();
        for amplitudes in [[1.0, 1.0, 1.0, 1.1], [1.0, 1.0, 2.0, 2.0]] {
            let all: Vec<Cycle> =
                amplitudes.iter().zip([0.0, 0.0, 180.0, 180.0]).map(|(w, turned_deg)| cycle(turned_deg, 1, *w, 1.0)).collect();
            assert_eq!(PulseInequality::from_cycles(&all.iter().collect::<Vec<_>>(), &rate), None);
        }
    }
}

//! Means over cycles, and what pulses of two amplitudes tell: how much of the rate is the torquer's inequality, which grows with the amplitude, and how
//! much is the drift, which does not.
//!
//! A torquer that turns faster one way leaves −ε w/2 in (13), the same for + − and − + (theory.md §3.2). The current takes it off where it is the current
//! that is unequal; where the torquer's own gain is, no current shows it. In cycles of amplitudes w the rate is Ω + e w: least squares with one e for
//! each sequence (a lag is in it, too, with a sign for each), one Ω for each place, so that the azimuth loses nothing by it.

use super::answer::{CycleLine, same};
use super::places::Value;

/// Amplitudes that differ by less than this factor tell nothing.
pub const LEAST_RATIO: f64 = 1.2;

/// What pulses of two amplitudes tell of a torquer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unequal {
    /// e of the sequences + − and − +: rate over amplitude; 0 where there is no such cycle.
    slopes: [f64; 2],
    /// By what share a negative pulse is greater, −2 e.
    pub inequality: Value,
    /// Scatter of one cycle about the lines, rad/s.
    scatter_rad_s: Option<f64>,
    /// Standard error that e leaves in every place alike, rad/s: the own drift has it, the apparent one has not.
    pub common_rad_s: Option<f64>,
}

/// The cycles of one sequence in one place.
struct Group<'a> {
    sequence: usize,
    cycles: Vec<&'a CycleLine>,
}

fn groups<'a>(cycles: &[&'a CycleLine]) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'a>> = Vec::new();
    for cycle in cycles {
        let sequence = usize::from(cycle.sign < 0);
        match groups.iter_mut().find(|group| group.sequence == sequence && same(&group.cycles[0].place, &cycle.place)) {
            Some(group) => group.cycles.push(cycle),
            None => groups.push(Group { sequence, cycles: vec![cycle] }),
        }
    }
    groups
}

fn average(cycles: &[&CycleLine], of: impl Fn(&CycleLine) -> f64) -> f64 {
    cycles.iter().map(|cycle| of(cycle)).sum::<f64>() / cycles.len() as f64
}

impl Unequal {
    /// Of the good cycles of one axis; `None` where a sequence has one amplitude only.
    pub fn of(cycles: &[&CycleLine], rate: &dyn Fn(&CycleLine) -> f64) -> Option<Self> {
        let groups = groups(cycles);
        let mut slopes = [0.0; 2];
        let (mut variance, mut kinds) = (0.0, 0.0);
        let weight = |cycle: &CycleLine, group: &Group<'_>| cycle.amplitude_rad_s - average(&group.cycles, |c| c.amplitude_rad_s);
        for sequence in [0, 1] {
            let ours = || groups.iter().filter(|group| group.sequence == sequence);
            if ours().next().is_none() {
                continue;
            }
            let pairs = || ours().flat_map(|group| group.cycles.iter().map(move |cycle| (weight(cycle, group), *cycle)));
            let (least, most) =
                pairs().fold((f64::INFINITY, 0.0_f64), |(l, m), (_, c)| (l.min(c.amplitude_rad_s), m.max(c.amplitude_rad_s)));
            let spread: f64 = pairs().map(|(w, _)| w * w).sum();
            // Each amplitude in a place of its own: nothing tells the torquer from the Earth.
            if most < LEAST_RATIO * least || spread < (0.1 * (most - least)).powi(2) {
                return None;
            }
            slopes[sequence] = pairs().map(|(w, cycle)| w * rate(cycle)).sum::<f64>() / spread;
            variance += 1.0 / spread;
            kinds += 1.0;
        }
        if kinds == 0.0 {
            return None;
        }
        let left = |cycle: &CycleLine| rate(cycle) - slopes[usize::from(cycle.sign < 0)] * cycle.amplitude_rad_s;
        let squares: f64 =
            groups.iter().flat_map(|group| group.cycles.iter().map(|cycle| (left(cycle) - average(&group.cycles, left)).powi(2))).sum();
        let free = cycles.len() as f64 - groups.len() as f64 - kinds;
        let scatter_rad_s = (free > 0.0).then(|| (squares / free).sqrt());
        let sigma = scatter_rad_s.map(|scatter| scatter * variance.sqrt() / kinds);
        Some(Self {
            slopes,
            inequality: Value { value: -2.0 * slopes.iter().sum::<f64>() / kinds, sigma: sigma.map(|sigma| 2.0 * sigma) },
            scatter_rad_s,
            common_rad_s: sigma.map(|sigma| sigma * average(cycles, |c| c.amplitude_rad_s)),
        })
    }

    /// What the inequality makes of a cycle, rad/s.
    fn leaves_rad_s(&self, cycle: &CycleLine) -> f64 {
        self.slopes[usize::from(cycle.sign < 0)] * cycle.amplitude_rad_s
    }
}

/// A mean over the cycles of one place and axis with its standard error: the mean of the sequences' means.
pub fn mean(cycles: &[&CycleLine], rate: &dyn Fn(&CycleLine) -> f64, unequal: Option<&Unequal>) -> (f64, Option<f64>) {
    let groups = groups(cycles);
    let straight = |cycle: &CycleLine| rate(cycle) - unequal.map_or(0.0, |unequal| unequal.leaves_rad_s(cycle));
    let kinds = groups.len() as f64;
    let share: f64 = groups.iter().map(|group| 1.0 / group.cycles.len() as f64).sum::<f64>() / (kinds * kinds);
    let scatter = match unequal {
        Some(unequal) => unequal.scatter_rad_s,
        None => {
            let off =
                |group: &Group<'_>| group.cycles.iter().map(|c| (straight(c) - average(&group.cycles, straight)).powi(2)).sum::<f64>();
            let free = cycles.len() - groups.len();
            (free > 0).then(|| (groups.iter().map(off).sum::<f64>() / free as f64).sqrt())
        }
    };
    let value = groups.iter().map(|group| average(&group.cycles, straight)).sum::<f64>() / kinds;
    (value, scatter.map(|scatter| scatter * share.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drift::integral::Integral;
    use hal_sim::gyro::Place;

    fn cycle(turned_deg: f64, sign: i8, amplitude_rad_s: f64, rate_rad_s: f64) -> CycleLine {
        let integral = Integral { pulse_s: 1.0, switched_rad_s: -rate_rad_s, sum_rad_s: 0.0, slope_rad_s: 0.0, span_rad: 0.0 };
        let place = Place { turned_rad: f64::to_radians(turned_deg), ..Place::default() };
        CycleLine { number: 1, place, axis: 0, sign, start_s: 0.0, integral, amplitude_rad_s, residual_rad_s: None, bad: None }
    }

    /// Ω + e w with a lag that is odd: each place its Ω, a sequence that is lost in one place moves nothing.
    #[test]
    fn lines_over_the_amplitude_meet_at_the_drift_whatever_is_lost() {
        let mut all = Vec::new();
        for (turned_deg, omega) in [(0.0, 3.0), (180.0, 5.0)] {
            for sign in [1_i8, -1] {
                for amplitude in [1.0, 1.0, 2.5] {
                    all.push(cycle(turned_deg, sign, amplitude, omega - (0.05 - 0.01 * f64::from(sign)) * amplitude));
                }
            }
        }
        // The − + cycles of the great amplitude in the second place.
        all.pop();
        let cycles: Vec<&CycleLine> = all.iter().collect();
        let rate = |cycle: &CycleLine| cycle.integral.drift_rad_s();
        let found = Unequal::of(&cycles, &rate).unwrap();
        assert!((found.inequality.value - 0.1).abs() < 1e-12 && found.inequality.sigma.unwrap() < 1e-12, "{found:?}");
        for (turned_rad, omega) in [(0.0, 3.0), (std::f64::consts::PI, 5.0)] {
            let place: Vec<&CycleLine> = cycles.iter().copied().filter(|c| (c.place.turned_rad - turned_rad).abs() < 0.1).collect();
            let ((plain, _), (corrected, _)) = (mean(&place, &rate, None), mean(&place, &rate, Some(&found)));
            assert!((corrected - omega).abs() < 1e-12 && (plain - omega).abs() > 0.05, "{plain} {corrected}");
        }
    }

    #[test]
    fn one_amplitude_or_one_for_each_place_tells_nothing() {
        let rate = |cycle: &CycleLine| cycle.integral.drift_rad_s();
        for amplitudes in [[1.0, 1.0, 1.0, 1.1], [1.0, 1.0, 2.0, 2.0]] {
            let all: Vec<CycleLine> = amplitudes.iter().zip([0.0, 0.0, 180.0, 180.0]).map(|(w, place)| cycle(place, 1, *w, 1.0)).collect();
            assert_eq!(Unequal::of(&all.iter().collect::<Vec<_>>(), &rate), None);
        }
    }
}

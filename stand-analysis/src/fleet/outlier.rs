//! Stands whose parameters are outliers of the fleet.
//!
//! The means x of the stands scatter by their uncertainty u and by the variation between stands. Location m is the median, scale s the
//! scaled median absolute deviation 1.4826 · median |x − m| (ISO 13528:2022, annex C); the variation between stands is τ² = max(0, s² −
//! median u²). A stand is compared by z = (x − m)/√(u² + τ² + π s²/(2 n)), the last term the variance of the median, with Student's t of
//! 0.37 (n − 1) degrees of freedom, since the median absolute deviation has 37 % of the efficiency of the standard deviation. By Holm's
//! procedure over all stands and parameters.

use std::collections::BTreeMap;

use super::change::Observation;
use super::significance::{FAMILYWISE_P, holm};
use identification::statistics::distributions::student_tail;
use identification::statistics::robust::median;

/// Fewest stands among which an outlier is sought.
pub const MIN_STANDS: usize = 8;
/// Standard deviation over the median absolute deviation, normal distribution.
const SIGMA_PER_MAD: f64 = 1.4826;
/// Efficiency of the median absolute deviation, normal distribution.
const MAD_EFFICIENCY: f64 = 0.37;

/// A parameter over the stands.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterSpread {
    /// The parameter.
    pub parameter: String,
    /// Its unit.
    pub unit: String,
    /// Median of the stands.
    pub median: f64,
    /// Robust standard deviation of the stands' means.
    pub scale: f64,
    /// The stands by name.
    pub stands: Vec<StandValue>,
}

/// A stand among the others.
#[derive(Debug, Clone, PartialEq)]
pub struct StandValue {
    /// The stand.
    pub stand: String,
    /// Mean of its logs.
    pub mean: Observation,
    /// Distance from the median in units of its standard uncertainty.
    pub z: f64,
    /// p-value adjusted by Holm's procedure; `None`: not tested, too few stands.
    pub adjusted_p: Option<f64>,
}

impl StandValue {
    /// The stand is an outlier.
    pub fn is_significant(&self) -> bool {
        self.adjusted_p.is_some_and(|p| p <= FAMILYWISE_P)
    }
}

/// Compares the stands by each parameter and unit.
pub fn spreads(means: &BTreeMap<(String, String), BTreeMap<String, Observation>>) -> Vec<ParameterSpread> {
    let mut all: Vec<ParameterSpread> =
        means.iter().filter(|(_, stands)| stands.len() > 1).map(|(name, stands)| spread(name, stands)).collect();
    let mut p = Vec::new();
    for spread in all.iter().filter(|spread| spread.stands.len() >= MIN_STANDS) {
        let dof = MAD_EFFICIENCY * (spread.stands.len() - 1) as f64;
        p.extend(spread.stands.iter().map(|stand| 2.0 * student_tail(stand.z.abs(), dof)));
    }
    let mut adjusted = holm(&p).into_iter();
    for spread in all.iter_mut().filter(|spread| spread.stands.len() >= MIN_STANDS) {
        spread.stands.iter_mut().for_each(|stand| stand.adjusted_p = adjusted.next());
    }
    all
}

fn spread((parameter, unit): &(String, String), stands: &BTreeMap<String, Observation>) -> ParameterSpread {
    let middle = centre(stands.values().map(|mean| mean.value));
    let scale = SIGMA_PER_MAD * centre(stands.values().map(|mean| (mean.value - middle).abs()));
    let between2 = (scale * scale - centre(stands.values().map(|mean| mean.u * mean.u))).max(0.0);
    let of_median2 = std::f64::consts::FRAC_PI_2 * scale * scale / stands.len() as f64;
    let value = |(stand, mean): (&String, &Observation)| StandValue {
        stand: stand.clone(),
        mean: *mean,
        z: (mean.value - middle) / (mean.u * mean.u + between2 + of_median2).sqrt(),
        adjusted_p: None,
    };
    ParameterSpread { parameter: parameter.clone(), unit: unit.clone(), median: middle, scale, stands: stands.iter().map(value).collect() }
}

/// The median; of an even number of values the mean of the two in the middle.
fn centre(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let (upper, lower) = (median(values.clone()), median(values.map(|value| -value)));
    0.5 * (upper.unwrap_or(f64::NAN) - lower.unwrap_or(f64::NAN))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    fn drawn(seed: u64, stands: usize, outlier: f64) -> Vec<ParameterSpread> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut normal = || (0..12).map(|_| random.next_u64() as f64 / u64::MAX as f64).sum::<f64>() - 6.0;
        let mut parameter = |name: &str, outlier: f64| {
            let value = |k: usize, z: f64| Observation { value: 10.0 + z + if k == 3 { outlier } else { 0.0 }, u: 0.3 };
            let stands = (0..stands).map(|k| (format!("stand {k}"), value(k, normal()))).collect();
            ((name.to_owned(), String::new()), stands)
        };
        spreads(&BTreeMap::from([parameter("a", outlier), parameter("b", 0.0)]))
    }

    #[test]
    fn false_alarms_keep_the_familywise_limit() {
        for stands in [8, 20, 60] {
            let draws = 400;
            let is_alarm = |seed: u64| drawn(seed, stands, 0.0).iter().flat_map(|s| &s.stands).any(StandValue::is_significant);
            let alarms = (0..draws).filter(|seed| is_alarm(*seed)).count();
            // 0.05 · 400 = 20, standard deviation 4.4.
            assert!(alarms <= 33, "{stands} stands: {alarms} of {draws}");
        }
    }

    #[test]
    fn far_stand_is_found_and_few_stands_are_not_tested() {
        let found: Vec<String> =
            drawn(5, 30, 9.0).iter().flat_map(|s| &s.stands).filter(|s| s.is_significant()).map(|s| s.stand.clone()).collect();
        assert_eq!(found, ["stand 3"]);
        assert!(drawn(5, 7, 1e6).iter().flat_map(|s| &s.stands).all(|s| s.adjusted_p.is_none()));
    }

    #[test]
    fn median_of_an_even_number_is_in_the_middle() {
        assert_eq!((centre([4.0, 1.0, 3.0, 2.0].into_iter()), centre([3.0, 1.0, 2.0].into_iter())), (2.5, 2.0));
    }
}

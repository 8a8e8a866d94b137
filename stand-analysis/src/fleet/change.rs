//! Which stands have changed since a date: their parameters, their effects, their verdicts.
//!
//! **Parameters.** The logs of one stand and one period differ by more than their standard uncertainties u: friction and resistance follow
//! temperature and load. That *variation between logs* τ is estimated for each parameter from all groups of logs of one stand in one period
//! together, by the equation of Mandel and Paule (Analytical Chemistry 42 (1970) 1194): Σ (x − x̄)²/(u² + τ²) = ν over all groups, x̄ the
//! weighted mean of the group, ν = Σ (n − 1). A difference of two weighted means over its combined standard uncertainty is compared with
//! Student's t of ν degrees of freedom. Without repetitions nothing is known of τ, and nothing is tested.
//!
//! **Effects and verdicts.** Fisher's exact test, one-sided: is the effect in more of the logs since the date than before?
//!
//! Both by Holm's procedure over all stands and parameters, or effects.

use std::collections::{BTreeMap, BTreeSet};

use super::significance::{FAMILYWISE_P, holm, hypergeometric_tail};
use identification::statistics::distributions::student_tail;

/// Fewest degrees of freedom of the variation between logs from which differences are tested.
pub const MIN_DOF: usize = 3;

/// A parameter of a stand in one log.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Observation {
    /// Value.
    pub value: f64,
    /// Its standard uncertainty.
    pub u: f64,
}

/// The variation of a parameter between logs of one stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variation {
    /// Standard deviation τ beyond the standard uncertainties.
    pub tau: f64,
    /// Degrees of freedom ν.
    pub dof: usize,
}

/// Solves the equation of Mandel and Paule for groups with one τ.
pub fn variation<'a>(groups: impl Iterator<Item = &'a [Observation]> + Clone) -> Variation {
    let dof: usize = groups.clone().map(|group| group.len().saturating_sub(1)).sum();
    let excess = |tau2: f64| {
        let of = |group: &[Observation]| {
            let mean = mean(group, tau2).value;
            group.iter().map(|o| (o.value - mean).powi(2) / (o.u * o.u + tau2)).sum::<f64>()
        };
        groups.clone().map(of).sum::<f64>() - dof as f64
    };
    if dof == 0 || excess(0.0) <= 0.0 {
        return Variation { tau: 0.0, dof };
    }
    let spread = groups.clone().flatten().map(|o| o.value.abs().max(o.u)).fold(f64::MIN_POSITIVE, f64::max);
    let (mut low, mut high) = (0.0, 4.0 * spread * spread);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Variation { tau: (0.5 * (low + high)).sqrt(), dof }
}

/// The weighted mean of a group with its standard uncertainty, variation between logs included.
pub fn mean(group: &[Observation], tau2: f64) -> Observation {
    let weight = |o: &Observation| 1.0 / (o.u * o.u + tau2);
    let sum: f64 = group.iter().map(weight).sum();
    Observation { value: group.iter().map(|o| weight(o) * o.value).sum::<f64>() / sum, u: sum.sqrt().recip() }
}

/// The logs of a stand before the date and since.
#[derive(Debug, Clone, Default)]
pub struct Periods<T> {
    /// Before.
    pub before: Vec<T>,
    /// Since.
    pub since: Vec<T>,
}

/// The difference of a parameter of a stand.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterChange {
    /// The stand.
    pub stand: String,
    /// The parameter.
    pub parameter: String,
    /// Its unit.
    pub unit: String,
    /// Mean before the date.
    pub before: Observation,
    /// Mean since.
    pub since: Observation,
    /// Numbers of logs before and since.
    pub logs: (usize, usize),
    /// p-value adjusted by Holm's procedure; `None`: not tested, too few repetitions.
    pub adjusted_p: Option<f64>,
}

impl ParameterChange {
    /// Since minus before.
    pub fn difference(&self) -> f64 {
        self.since.value - self.before.value
    }

    /// Combined standard uncertainty of the difference.
    pub fn u(&self) -> f64 {
        self.before.u.hypot(self.since.u)
    }

    /// The difference in units of its combined standard uncertainty.
    pub fn z(&self) -> f64 {
        self.difference() / self.u()
    }

    /// The parameter has changed.
    pub fn is_significant(&self) -> bool {
        self.adjusted_p.is_some_and(|p| p <= FAMILYWISE_P)
    }
}

/// Parameters of stands: by parameter and unit, by stand.
pub type ByParameter = BTreeMap<(String, String), BTreeMap<String, Periods<Observation>>>;

/// The changes of all parameters, the most significant first, and the variation of each parameter between logs.
pub fn parameter_changes(observations: &ByParameter) -> (Vec<ParameterChange>, BTreeMap<String, Variation>) {
    let (mut changes, mut dofs, mut variations) = (Vec::new(), Vec::new(), BTreeMap::new());
    for ((parameter, unit), stands) in observations {
        let groups =
            stands.values().flat_map(|periods| [periods.before.as_slice(), periods.since.as_slice()]).filter(|group| !group.is_empty());
        let found = variation(groups);
        variations.insert(parameter.clone(), found);
        for (stand, periods) in stands.iter().filter(|(_, periods)| !periods.before.is_empty() && !periods.since.is_empty()) {
            let tau2 = found.tau * found.tau;
            changes.push(ParameterChange {
                stand: stand.clone(),
                parameter: parameter.clone(),
                unit: unit.clone(),
                before: mean(&periods.before, tau2),
                since: mean(&periods.since, tau2),
                logs: (periods.before.len(), periods.since.len()),
                adjusted_p: None,
            });
            dofs.push(found.dof);
        }
    }
    let tested: Vec<usize> = (0..changes.len()).filter(|k| dofs[*k] >= MIN_DOF).collect();
    let p: Vec<f64> = tested.iter().map(|k| 2.0 * student_tail(changes[*k].z().abs(), dofs[*k] as f64)).collect();
    for (k, adjusted) in tested.into_iter().zip(holm(&p)) {
        changes[k].adjusted_p = Some(adjusted);
    }
    changes.sort_by(|a, b| {
        let p = |change: &ParameterChange| change.adjusted_p.unwrap_or(2.0);
        p(a).total_cmp(&p(b)).then(b.z().abs().total_cmp(&a.z().abs()))
    });
    (changes, variations)
}

/// An effect or a verdict of a stand that is more frequent since the date.
#[derive(Debug, Clone, PartialEq)]
pub struct FindingChange {
    /// The stand.
    pub stand: String,
    /// Name of the effect, or verdict.
    pub finding: String,
    /// Logs with it, and all logs, before the date.
    pub before: (usize, usize),
    /// Logs with it, and all logs, since.
    pub since: (usize, usize),
    /// p-value adjusted by Holm's procedure.
    pub adjusted_p: f64,
}

impl FindingChange {
    /// More than chance.
    pub fn is_significant(&self) -> bool {
        self.adjusted_p <= FAMILYWISE_P
    }
}

/// The findings that are more frequent since the date, the most significant first. In: by stand, the findings of each log.
pub fn finding_changes(stands: &BTreeMap<String, Periods<BTreeSet<String>>>) -> Vec<FindingChange> {
    let (mut changes, mut p) = (Vec::new(), Vec::new());
    for (stand, periods) in stands.iter().filter(|(_, periods)| !periods.before.is_empty() && !periods.since.is_empty()) {
        let all: BTreeSet<&String> = periods.before.iter().chain(&periods.since).flatten().collect();
        for finding in all {
            let count = |logs: &[BTreeSet<String>]| (logs.iter().filter(|log| log.contains(finding)).count(), logs.len());
            let (before, since) = (count(&periods.before), count(&periods.since));
            p.push(hypergeometric_tail(since.0, since.1, before.0 + since.0, before.1 + since.1));
            changes.push(FindingChange { stand: stand.clone(), finding: finding.clone(), before, since, adjusted_p: 1.0 });
        }
    }
    for (change, adjusted) in changes.iter_mut().zip(holm(&p)) {
        change.adjusted_p = adjusted;
    }
    changes.retain(|change| change.since.0 * change.before.1 > change.before.0 * change.since.1);
    changes.sort_by(|a, b| a.adjusted_p.total_cmp(&b.adjusted_p));
    changes
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    /// Normal deviate of standard deviation 1 (sum of twelve uniform ones).
    fn normal(random: &mut impl Rng) -> f64 {
        (0..12).map(|_| random.next_u64() as f64 / u64::MAX as f64).sum::<f64>() - 6.0
    }

    /// `stands` stands with `logs` logs in each period; τ = 3, u = 1; stand 0 changes by `change`.
    fn drawn(seed: u64, stands: usize, logs: usize, change: f64) -> ByParameter {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut by_stand = BTreeMap::new();
        for k in 0..stands {
            let own = 100.0 + 20.0 * normal(&mut random);
            let mut group = |offset: f64| -> Vec<Observation> {
                (0..logs).map(|_| Observation { value: own + offset + 3.0 * normal(&mut random) + normal(&mut random), u: 1.0 }).collect()
            };
            let periods = Periods { before: group(0.0), since: group(if k == 0 { change } else { 0.0 }) };
            by_stand.insert(format!("stand {k}"), periods);
        }
        BTreeMap::from([(("load_N_m".to_owned(), "N m".to_owned()), by_stand)])
    }

    #[test]
    fn variation_between_logs_is_found() {
        let (_, variations) = parameter_changes(&drawn(1, 40, 6, 0.0));
        let found = variations["load_N_m"];
        // 400 degrees of freedom: standard deviation of τ about 5 %.
        assert!((found.tau - 3.0).abs() < 0.45 && found.dof == 400, "{found:?}");
        let exact = [Observation { value: 1.0, u: 1.0 }, Observation { value: 1.5, u: 1.0 }];
        assert_eq!(variation([exact.as_slice()].into_iter()).tau, 0.0, "less than the standard uncertainties");
    }

    #[test]
    fn false_alarms_keep_the_familywise_limit() {
        let draws: u32 = 400;
        let alarms = (0..u64::from(draws)).filter(|seed| parameter_changes(&drawn(*seed, 10, 3, 0.0)).0[0].is_significant()).count();
        // 0.05 · 400 = 20, standard deviation 4.4.
        assert!(alarms <= 33, "{alarms} of {draws}");
    }

    #[test]
    fn change_of_ten_times_the_variation_is_found() {
        let (changes, _) = parameter_changes(&drawn(3, 10, 3, 30.0));
        let significant: Vec<&str> = changes.iter().filter(|c| c.is_significant()).map(|c| c.stand.as_str()).collect();
        assert_eq!(significant, ["stand 0"]);
        assert!((changes[0].difference() - 30.0).abs() < 4.0 * changes[0].u(), "{:?}", changes[0]);
    }

    #[test]
    fn without_repetitions_nothing_is_tested() {
        let (changes, variations) = parameter_changes(&drawn(3, 10, 1, 1e3));
        assert!(changes.iter().all(|change| change.adjusted_p.is_none()) && variations["load_N_m"].dof == 0);
        assert_eq!(changes[0].stand, "stand 0", "the largest difference first");
    }

    #[test]
    fn new_effect_needs_enough_logs() {
        let logs = |with: usize, without: usize| -> Vec<BTreeSet<String>> {
            let one = |has: bool| if has { BTreeSet::from(["cogging".to_owned()]) } else { BTreeSet::new() };
            (0..with + without).map(|k| one(k < with)).collect()
        };
        let of = |n: usize| finding_changes(&BTreeMap::from([("A".to_owned(), Periods { before: logs(0, n), since: logs(n, 0) })]));
        assert!(of(6)[0].is_significant(), "1 of 924");
        assert!(!of(2)[0].is_significant(), "1 of 6");
        assert!(finding_changes(&BTreeMap::from([("A".to_owned(), Periods { before: logs(3, 0), since: logs(0, 3) })])).is_empty());
    }
}

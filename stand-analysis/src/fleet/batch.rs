//! Effects that are common to a batch of stands: Fisher's exact test, one-sided, of the batch against all other stands, by Holm's procedure
//! over all batches and effects.
//!
//! The unit is the stand, since the logs of one stand are not independent: a stand has an effect if at least half of its logs do.

use std::collections::{BTreeMap, BTreeSet};

use super::significance::{FAMILYWISE_P, holm, hypergeometric_tail};

/// An effect in a batch.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchEffect {
    /// The batch.
    pub batch: String,
    /// The effect.
    pub effect: String,
    /// Stands of the batch with the effect, and all of its stands.
    pub inside: (usize, usize),
    /// The same of all other stands.
    pub outside: (usize, usize),
    /// p-value adjusted by Holm's procedure.
    pub adjusted_p: f64,
}

impl BatchEffect {
    /// The effect is more frequent in the batch than chance makes it.
    pub fn is_significant(&self) -> bool {
        self.adjusted_p <= FAMILYWISE_P
    }
}

/// A stand: its batch, and the effects that it has.
#[derive(Debug, Clone, Default)]
pub struct StandEffects {
    /// The batch; `None`: not known, the stand counts as one of another batch.
    pub batch: Option<String>,
    /// The effects.
    pub effects: BTreeSet<String>,
}

/// All effects of all batches, the most significant first; empty for a single batch.
pub fn batch_effects(stands: &BTreeMap<String, StandEffects>) -> Vec<BatchEffect> {
    let batches: BTreeSet<&String> = stands.values().filter_map(|stand| stand.batch.as_ref()).collect();
    let effects: BTreeSet<&String> = stands.values().flat_map(|stand| &stand.effects).collect();
    let (mut found, mut p) = (Vec::new(), Vec::new());
    for batch in batches {
        let (inside, outside): (Vec<_>, Vec<_>) = stands.values().partition(|stand| stand.batch.as_ref() == Some(batch));
        if outside.is_empty() {
            continue;
        }
        for effect in &effects {
            let count = |stands: &[&StandEffects]| (stands.iter().filter(|stand| stand.effects.contains(*effect)).count(), stands.len());
            let (inside, outside) = (count(&inside), count(&outside));
            if inside.0 > 0 {
                p.push(hypergeometric_tail(inside.0, inside.1, inside.0 + outside.0, inside.1 + outside.1));
                found.push(BatchEffect { batch: batch.clone(), effect: (*effect).clone(), inside, outside, adjusted_p: 1.0 });
            }
        }
    }
    for (entry, adjusted) in found.iter_mut().zip(holm(&p)) {
        entry.adjusted_p = adjusted;
    }
    found.sort_by(|a, b| a.adjusted_p.total_cmp(&b.adjusted_p));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fleet(counts: &[(&str, usize, usize)]) -> BTreeMap<String, StandEffects> {
        let mut stands = BTreeMap::new();
        for (batch, with, all) in counts {
            for k in 0..*all {
                let effects = if k < *with { BTreeSet::from(["cogging".to_owned()]) } else { BTreeSet::new() };
                stands.insert(format!("{batch} {k}"), StandEffects { batch: Some((*batch).to_owned()), effects });
            }
        }
        stands
    }

    #[test]
    fn effect_of_one_batch_is_found_and_one_of_all_is_not() {
        let found = batch_effects(&fleet(&[("7", 5, 6), ("8", 1, 10)]));
        assert!(found[0].batch == "7" && found[0].is_significant() && !found[1].is_significant(), "{found:?}");
        assert!(batch_effects(&fleet(&[("7", 6, 6), ("8", 10, 10)])).iter().all(|entry| !entry.is_significant()));
        assert!(batch_effects(&fleet(&[("7", 6, 6)])).is_empty());
    }
}

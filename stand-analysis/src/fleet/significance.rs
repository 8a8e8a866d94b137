//! Tests of many hypotheses, and of counts.

/// Probability that at least one of all tests of a kind is significant by chance.
pub const FAMILYWISE_P: f64 = 0.05;

/// Adjusted p-values of Holm's step-down procedure (S. Holm, Scand. J. Stat. 6 (1979) 65): a test is significant if its adjusted p is at
/// most the familywise probability. No independence of the tests is assumed.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let (mut adjusted, mut largest) = (vec![1.0; p.len()], 0.0_f64);
    for (rank, index) in order.into_iter().enumerate() {
        largest = largest.max(((p.len() - rank) as f64 * p[index]).min(1.0));
        adjusted[index] = largest;
    }
    adjusted
}

/// P(K ≥ k): k of `drawn` units have a property that `having` of all `total` units have (hypergeometric distribution; Fisher's exact test,
/// one-sided).
pub fn hypergeometric_tail(k: usize, drawn: usize, having: usize, total: usize) -> f64 {
    let least = (drawn + having).saturating_sub(total);
    let most = drawn.min(having);
    let all = ln_choose(total, drawn);
    let probability = |j: usize| (ln_choose(having, j) + ln_choose(total - having, drawn - j) - all).exp();
    (k.max(least)..=most).map(probability).sum::<f64>().min(1.0)
}

fn ln_choose(n: usize, k: usize) -> f64 {
    let k = k.min(n - k.min(n));
    (0..k).map(|j| (((n - j) as f64) / ((j + 1) as f64)).ln()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Holm's own rule on four p-values: 0.005 · 4, 0.01 · 3, 0.03 · 2, then not below its predecessor.
    #[test]
    fn adjusted_values_follow_the_steps() {
        let adjusted = holm(&[0.04, 0.005, 0.03, 0.01]);
        for (found, expected) in adjusted.iter().zip([0.06, 0.02, 0.06, 0.03]) {
            assert!((found - expected).abs() < 1e-12, "{adjusted:?}");
        }
        assert!(holm(&[]).is_empty());
    }

    /// Fisher's tea: all four cups right of eight, 1 of 70; three or more, 17 of 70.
    #[test]
    fn tea_is_tasted_exactly() {
        assert!((hypergeometric_tail(4, 4, 4, 8) - 1.0 / 70.0).abs() < 1e-12);
        assert!((hypergeometric_tail(3, 4, 4, 8) - 17.0 / 70.0).abs() < 1e-12);
        assert!((hypergeometric_tail(0, 4, 4, 8) - 1.0).abs() < 1e-12);
        assert!((hypergeometric_tail(3, 5, 6, 7) - 1.0).abs() < 1e-12, "four of five have it at least");
    }
}

//! A rate or current that is recorded without its sign.

use super::Defect;
use crate::log::Log;
use crate::statistics::Extremes;

/// Fraction of the largest input above which a row drives clearly one way.
const STRONG_INPUT: f64 = 0.2;
/// Fraction of the largest value below which a value is near zero, and above which it is not.
const NEAR_ZERO: f64 = 0.1;
/// Stretches of one direction of the input that must be there.
const MIN_STRETCHES: usize = 4;
/// Fraction of the stretches in which the value must fall to zero and rise again.
const MIN_FRACTION: f64 = 0.75;

/// A column that is never negative, although it falls to zero and rises again after the reversals of the input. A rotor that only coasts on
/// without reversing does not rise under a voltage against its motion.
pub fn check(log: &Log, input: &str) -> Option<Defect> {
    let driven = log.column(input)?;
    let unsigned = |column: &&'static str| {
        *column != input && log.column(column).is_some_and(|values| !log.provenance(column).magnitude && is_unsigned(values, driven))
    };
    ["omega_rad_s", "i_A"].into_iter().find(unsigned).map(|column| Defect::Unsigned { column })
}

fn is_unsigned(values: &[f64], input: &[f64]) -> bool {
    let (low, largest) = values.iter().copied().min_max();
    let strong = STRONG_INPUT * input.iter().copied().max_abs();
    if largest <= 0.0 || low < -1e-3 * largest || strong <= 0.0 {
        return false;
    }
    // Per stretch: lowest value, and the highest after it.
    let mut stretches: Vec<(f64, f64)> = Vec::new();
    let mut sign = 0.0;
    for (value, u) in values.iter().zip(input).filter(|(_, u)| u.abs() >= strong) {
        if u.signum() != sign {
            sign = u.signum();
            stretches.push((*value, *value));
        }
        if let Some((lowest, after)) = stretches.last_mut() {
            if *value < *lowest {
                (*lowest, *after) = (*value, *value);
            }
            *after = after.max(*value);
        }
    }
    let turns_back = |(lowest, after): &&(f64, f64)| *lowest < NEAR_ZERO * largest && *after > 2.0 * NEAR_ZERO * largest;
    let back = stretches.iter().skip(1).filter(turns_back).count();
    stretches.len() > MIN_STRETCHES && back as f64 >= MIN_FRACTION * (stretches.len() - 1) as f64
}

#[cfg(test)]
mod tests {
    use super::is_unsigned;

    /// A rate of a first-order drive with a time constant in rows, and its square-wave voltage.
    fn rate(time_constant: f64, offset: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut w, mut rates, mut volts) = (0.0, Vec::new(), Vec::new());
        for k in 0..4000 {
            let u = if (k / 250) % 2 == 0 { 1.0 } else { -1.0 };
            w += (u + offset - w) / time_constant;
            rates.push(w);
            volts.push(u);
        }
        (rates, volts)
    }

    #[test]
    fn magnitude_of_a_reversing_rate_is_noticed() {
        let (rates, volts) = rate(50.0, 0.0);
        assert!(!is_unsigned(&rates, &volts));
        assert!(is_unsigned(&rates.iter().map(|w| w.abs()).collect::<Vec<_>>(), &volts));
    }

    #[test]
    fn rate_that_stays_positive_is_no_magnitude() {
        // A heavy rotor with a mean voltage: it slows down under the negative voltage and does not reverse.
        let (rates, volts) = rate(2000.0, 1.5);
        assert!(!is_unsigned(&rates, &volts));
        let (rates, volts) = rate(50.0, 1.02);
        assert!(!is_unsigned(&rates, &volts));
    }
}

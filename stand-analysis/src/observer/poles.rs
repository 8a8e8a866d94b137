//! Poles of an observer as requested, and roots of a polynomial.

use nalgebra::Complex;

use super::ObserverError;
use super::exact::{Exact, exact};
use identification::statistics::Extremes;

/// Poles, 1/s.
#[derive(Debug, Clone, PartialEq)]
pub enum Poles {
    /// All poles at −ω₀, 1/s.
    Binomial(f64),
    /// Listed; complex poles in conjugate pairs.
    Given(Vec<Complex<f64>>),
}

impl Poles {
    /// Parses a list such as `-50,-40+30i,-40-30i`; one pole of a conjugate pair is sufficient.
    ///
    /// # Errors
    /// An entry that is no complex number or has no negative real part.
    pub fn parse(text: &str) -> Result<Self, ObserverError> {
        let mut poles: Vec<Complex<f64>> = Vec::new();
        let mut other_of_pair = None;
        for word in text.split(',').map(str::trim) {
            let fail = |why| ObserverError::Pole(word.to_owned(), why);
            let pole = complex(word).ok_or(fail("is not a number such as -50 or -40+30i"))?;
            if !(pole.re.is_finite() && pole.im.is_finite()) || pole.re >= 0.0 {
                return Err(fail("must have a negative real part; otherwise the observer is unstable"));
            }
            if other_of_pair.take() == Some(pole) {
                continue;
            }
            poles.push(pole);
            if pole.im != 0.0 {
                poles.push(pole.conj());
                other_of_pair = Some(pole.conj());
            }
        }
        Ok(Self::Given(poles))
    }

    /// Exactly `count` poles.
    ///
    /// # Errors
    /// The number of listed poles differs; ω₀ is not positive.
    pub fn list(&self, count: usize, what: &'static str) -> Result<Vec<Complex<f64>>, ObserverError> {
        match self {
            Self::Binomial(omega) if !(omega.is_finite() && *omega > 0.0) => Err(ObserverError::Omega(*omega)),
            Self::Binomial(omega) => Ok(vec![Complex::new(-omega, 0.0); count]),
            Self::Given(poles) if poles.len() != count => Err(ObserverError::Count { got: poles.len(), wanted: count, what }),
            Self::Given(poles) => Ok(poles.clone()),
        }
    }
}

fn complex(word: &str) -> Option<Complex<f64>> {
    if let Ok(real) = word.parse() {
        return Some(Complex::new(real, 0.0));
    }
    let body = word.strip_suffix(['i', 'j'])?;
    // The sign between real and imaginary part: not the leading one, and not that of an exponent.
    let split = body.char_indices().rev().find(|(k, c)| *k > 0 && matches!(c, '+' | '-') && !body[..*k].ends_with(['e', 'E']))?.0;
    let imaginary = match &body[split..] {
        "+" => 1.0,
        "-" => -1.0,
        number => number.parse().ok()?,
    };
    Some(Complex::new(body[..split].parse().ok()?, imaginary))
}

/// The monic polynomial with these roots, highest power first; complex roots as adjacent conjugate pairs.
pub(super) fn polynomial(roots: &[(Exact, Exact)]) -> Vec<Exact> {
    let mut product = vec![exact(1.0)];
    let mut k = 0;
    while k < roots.len() {
        let (re, im) = &roots[k];
        let factor = if *im == exact(0.0) {
            vec![exact(1.0), -re.clone()]
        } else {
            k += 1;
            vec![exact(1.0), -(re + re), re * re + im * im]
        };
        product = multiplied(&product, &factor);
        k += 1;
    }
    product
}

/// Product of two polynomials.
pub(super) fn multiplied(one: &[Exact], other: &[Exact]) -> Vec<Exact> {
    let mut product = vec![exact(0.0); one.len() + other.len() - 1];
    for (i, a) in one.iter().enumerate() {
        for (j, b) in other.iter().enumerate() {
            product[i + j] = &product[i + j] + a * b;
        }
    }
    product
}

/// All roots of a polynomial (coefficients with the highest power first) by Aberth's method. Multiple roots are as accurate as double
/// precision allows.
pub fn roots(polynomial: &[f64]) -> Vec<Complex<f64>> {
    let n = polynomial.len().saturating_sub(1);
    let monic: Vec<f64> = polynomial.iter().map(|c| c / polynomial[0]).collect();
    let value = |z: Complex<f64>| monic.iter().fold((Complex::new(0.0, 0.0), Complex::new(0.0, 0.0)), |(p, d), c| (p * z + c, d * z + p));
    // Start values on a circle of the roots' size, rotated so that no two are conjugate.
    let size = (1..=n).map(|k| monic[k].abs().powf(1.0 / k as f64)).max_or_zero().max(1e-300);
    let mut found: Vec<Complex<f64>> =
        (0..n).map(|k| Complex::from_polar(size, std::f64::consts::TAU * (k as f64 + 0.25) / n as f64 + 0.3)).collect();
    for _ in 0..500 {
        let mut greatest = 0.0_f64;
        for k in 0..n {
            let z = found[k];
            let (p, d) = value(z);
            let newton = if d.norm() == 0.0 { Complex::new(0.0, 0.0) } else { p / d };
            let others: Complex<f64> = (0..n).filter(|j| *j != k && found[*j] != z).map(|j| (z - found[j]).inv()).sum();
            let step = newton / (Complex::new(1.0, 0.0) - newton * others);
            if step.re.is_finite() && step.im.is_finite() {
                found[k] -= step;
                greatest = greatest.max(step.norm() / z.norm().max(1e-300));
            }
        }
        if greatest < 1e-15 {
            break;
        }
    }
    found.sort_by(|a, b| b.re.total_cmp(&a.re).then(a.im.abs().total_cmp(&b.im.abs())));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_poles_are_parsed() {
        let given = |text| match Poles::parse(text) {
            Ok(Poles::Given(poles)) => poles.iter().map(|z| (z.re, z.im)).collect(),
            _ => Vec::new(),
        };
        assert_eq!(given("-50, -60"), [(-50.0, 0.0), (-60.0, 0.0)]);
        assert_eq!(given("-4e1+3e1i"), [(-40.0, 30.0), (-40.0, -30.0)]);
        assert_eq!(given("-40+30j,-40-30j,-1"), [(-40.0, 30.0), (-40.0, -30.0), (-1.0, 0.0)]);
        assert_eq!(given("-40+i"), [(-40.0, 1.0), (-40.0, -1.0)]);
        for bad in ["", "5", "0", "-5+", "x", "-inf", "-1,nan"] {
            assert!(Poles::parse(bad).is_err(), "{bad}");
        }
        assert!(Poles::Binomial(0.0).list(6, "observer").is_err() && Poles::Binomial(f64::NAN).list(6, "observer").is_err());
    }

    #[test]
    fn real_and_complex_roots_are_found() {
        // (p + 1)(p + 2)(p² + 2 p + 10)
        let found = roots(&[1.0, 5.0, 18.0, 34.0, 20.0]);
        let expected = [(-1.0, 0.0), (-1.0, 3.0), (-1.0, -3.0), (-2.0, 0.0)];
        for (re, im) in expected {
            assert!(found.iter().any(|z| (z - Complex::new(re, im)).norm() < 1e-12), "{found:?}");
        }
    }
}

//! Where the poles of an observer shall lie, and where those of a polynomial do.

use nalgebra::Complex;

use super::ObserverError;
use super::exact::{Exact, exact};
use crate::statistics::Extremes;

/// Poles, 1/s.
#[derive(Debug, Clone, PartialEq)]
pub enum Poles {
    /// All at −ω₀.
    Binomial(f64),
    /// One by one; complex ones in pairs.
    Given(Vec<Complex<f64>>),
}

impl Poles {
    /// Poles as a person writes them: `-50,-40+30i,-40-30i`; one of a pair is enough.
    ///
    /// # Errors
    /// A word that is no pole, or one that does not lie to the left.
    pub fn parse(text: &str) -> Result<Self, ObserverError> {
        let mut poles: Vec<Complex<f64>> = Vec::new();
        let mut other_of_pair = None;
        for word in text.split(',').map(str::trim) {
            let fail = |why| ObserverError::Pole(word.to_owned(), why);
            let pole = complex(word).ok_or(fail("is no number like -50 or -40+30i"))?;
            if !(pole.re.is_finite() && pole.im.is_finite()) || pole.re >= 0.0 {
                return Err(fail("must have a negative real part, or the observer is not stable"));
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

    /// So many poles.
    ///
    /// # Errors
    /// There are not as many; ω₀ is not above 0.
    pub fn list(&self, count: usize, what: &'static str) -> Result<Vec<Complex<f64>>, ObserverError> {
        match self {
            Self::Binomial(omega) if !(omega.is_finite() && *omega > 0.0) => {
                Err(ObserverError::Words(format!("omega = {omega}: the poles lie at −omega, which must be above 0 rad/s")))
            }
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
    // The sign between the parts: not the first, and not an exponent's.
    let split = body.char_indices().rev().find(|(k, c)| *k > 0 && matches!(c, '+' | '-') && !body[..*k].ends_with(['e', 'E']))?.0;
    let imaginary = match &body[split..] {
        "+" => 1.0,
        "-" => -1.0,
        number => number.parse().ok()?,
    };
    Some(Complex::new(body[..split].parse().ok()?, imaginary))
}

/// The polynomial with these roots, highest power first; complex ones come in pairs, one after the other.
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

/// A product of polynomials.
pub(super) fn multiplied(one: &[Exact], other: &[Exact]) -> Vec<Exact> {
    let mut product = vec![exact(0.0); one.len() + other.len() - 1];
    for (i, a) in one.iter().enumerate() {
        for (j, b) in other.iter().enumerate() {
            product[i + j] = &product[i + j] + a * b;
        }
    }
    product
}

/// All roots of a polynomial, highest power first, by Aberth's method; roots that lie together come out as near as double precision can tell.
pub fn roots(polynomial: &[f64]) -> Vec<Complex<f64>> {
    let n = polynomial.len().saturating_sub(1);
    let monic: Vec<f64> = polynomial.iter().map(|c| c / polynomial[0]).collect();
    let value = |z: Complex<f64>| monic.iter().fold((Complex::new(0.0, 0.0), Complex::new(0.0, 0.0)), |(p, d), c| (p * z + c, d * z + p));
    // On a circle of the roots' size, turned so that no two are conjugate.
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
    fn poles_read_as_a_person_writes_them() {
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
    fn roots_are_found_real_and_complex() {
        // (p + 1)(p + 2)(p² + 2 p + 10)
        let found = roots(&[1.0, 5.0, 18.0, 34.0, 20.0]);
        let expected = [(-1.0, 0.0), (-1.0, 3.0), (-1.0, -3.0), (-2.0, 0.0)];
        for (re, im) in expected {
            assert!(found.iter().any(|z| (z - Complex::new(re, im)).norm() < 1e-12), "{found:?}");
        }
    }
}

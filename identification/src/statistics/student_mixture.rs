//! Weighted mixture of Student distributions with common degrees of freedom: the distribution of an estimate whose noise model is known up
//! to one parameter, averaged over that parameter.
//!
//! Input: weight, location and scale of each component. Output: mean and half-widths of symmetric intervals, and the equivalent u and ν.

use super::distributions::{student_quantile, student_tail};
use super::uncertainty::{COVERAGE_PROBABILITY, Uncertainty, coverage_factor};

/// Probability of ± 1 standard deviation of a normal distribution.
const ONE_SIGMA: f64 = 0.682_689_492_137_085_9;
/// Steps of each bisection: the half-width is accurate to 1e-12 of its bracket.
const BISECTIONS: usize = 60;
/// Degrees of freedom from which the distribution counts as normal.
const MANY_DOF: f64 = 1e4;

/// One component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component {
    /// Weight; the weights of a mixture need not add up to 1.
    pub weight: f64,
    /// Location.
    pub location: f64,
    /// Scale; 0 for a known value.
    pub scale: f64,
}

/// A mixture of Student distributions.
#[derive(Debug, Clone, PartialEq)]
pub struct StudentMixture {
    components: Vec<Component>,
    dof: f64,
}

impl StudentMixture {
    /// A mixture with `dof` degrees of freedom; `None` without a component of positive weight.
    pub fn new(components: Vec<Component>, dof: f64) -> Option<Self> {
        let total: f64 = components.iter().map(|c| c.weight).sum();
        let components = components.into_iter().map(|c| Component { weight: c.weight / total, ..c }).collect();
        (total.is_finite() && total > 0.0 && dof > 0.0).then_some(Self { components, dof })
    }

    /// Weighted mean of the locations.
    pub fn mean(&self) -> f64 {
        self.components.iter().map(|c| c.weight * c.location).sum()
    }

    /// Half-width of the interval about the mean that has this probability.
    pub fn half_width(&self, probability: f64) -> f64 {
        let mean = self.mean();
        let inside = |half: f64| -> f64 {
            let one = |c: &Component| {
                if c.scale > 0.0 {
                    let at = |x: f64| student_tail((c.location - x) / c.scale, self.dof);
                    at(mean + half) - at(mean - half)
                } else {
                    f64::from((c.location - mean).abs() <= half)
                }
            };
            self.components.iter().map(|c| c.weight * one(c)).sum()
        };
        let reach = |c: &Component| (c.location - mean).abs() + c.scale * student_quantile(0.5 + 0.5 * probability, self.dof);
        // No component reaches farther than this with the probability wanted.
        let (mut low, mut high) = (0.0, self.components.iter().map(reach).fold(0.0, f64::max));
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if inside(middle) < probability { low = middle } else { high = middle }
        }
        high
    }

    /// The uncertainty whose intervals of 68 % and 95 % are those of the mixture: ν by their ratio, and U = k u is the half-width for
    /// [`COVERAGE_PROBABILITY`].
    pub fn uncertainty(&self) -> Uncertainty {
        let (one, wide) = (self.half_width(ONE_SIGMA), self.half_width(COVERAGE_PROBABILITY));
        let dof = equivalent_dof(wide / one);
        Uncertainty::student(wide / coverage_factor(dof, COVERAGE_PROBABILITY), dof)
    }
}

/// Degrees of freedom for which Student's distribution has this ratio of the 95 % to the 68 % half-width; at least 1, infinite for a ratio
/// of the normal distribution.
fn equivalent_dof(ratio: f64) -> f64 {
    let of = |dof: f64| student_quantile(0.5 + 0.5 * COVERAGE_PROBABILITY, dof) / student_quantile(0.5 + 0.5 * ONE_SIGMA, dof);
    if ratio.is_nan() || ratio <= of(MANY_DOF) {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (0.0_f64, MANY_DOF.ln());
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if of(middle.exp()) > ratio { low = middle } else { high = middle }
    }
    // The coverage factor takes whole degrees of freedom: rounding errors must not lose one.
    let dof = (0.5 * (low + high)).exp();
    if (dof - dof.round()).abs() < 1e-6 * dof { dof.round() } else { dof }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn component(weight: f64, location: f64, scale: f64) -> Component {
        Component { weight, location, scale }
    }

    /// Table of Student's t: t(0.975; 4) = 2.776445.
    #[test]
    fn one_component_is_student() {
        let found = StudentMixture::new(vec![component(3.0, 5.0, 0.5)], 4.0).unwrap();
        assert!((found.mean() - 5.0).abs() < 1e-12 && (found.half_width(0.95) - 0.5 * 2.776_445).abs() < 1e-6);
        let Uncertainty { u, dof, k } = found.uncertainty();
        assert!((u - 0.5).abs() < 1e-6 && (dof - 4.0).abs() < 1e-3 && (k - 2.776_445).abs() < 1e-5, "{u} {dof} {k}");
    }

    /// Two normal components of equal weight, scales 1 and 3: P(|x| < h) = (erf(h/√2) + erf(h/3√2))/2 = 0.95 at h = 4.93.
    #[test]
    fn a_mixture_has_wider_tails_than_a_normal_distribution_of_its_width() {
        let found = StudentMixture::new(vec![component(1.0, 0.0, 1.0), component(1.0, 0.0, 3.0)], f64::INFINITY.min(1e6)).unwrap();
        let half = found.half_width(0.95);
        assert!((half - 4.934_6).abs() < 2e-3, "{half}");
        let uncertainty = found.uncertainty();
        assert!(uncertainty.dof < 10.0 && (uncertainty.expanded() - half).abs() < 1e-9, "{uncertainty:?}");
    }

    #[test]
    fn different_locations_widen_the_interval() {
        let found = StudentMixture::new(vec![component(1.0, -1.0, 0.0), component(1.0, 1.0, 0.0)], 5.0).unwrap();
        assert!((found.half_width(0.95) - 1.0).abs() < 1e-9 && found.mean().abs() < 1e-12);
        assert!(StudentMixture::new(Vec::new(), 5.0).is_none() && StudentMixture::new(vec![component(1.0, 0.0, 1.0)], 0.0).is_none());
    }
}

//! Distribution of a sum of rectangular contributions and one scaled Student contribution (JCGM 101, 6.4.9.2: the distribution of a type A
//! mean).
//!
//! JCGM 101 propagates distributions by Monte Carlo. A sum of independent terms needs a convolution only: the density of the rectangles on
//! a grid, with the distribution function of Student's t.

use crate::statistics::distributions::{normal_tail, student_tail};

/// Grid points on one side of zero. The relative error of the half-width is below 1e-3.
const HALF_POINTS: usize = 200;
/// Steps of the bisection: 2⁻³⁰ of the interval that it begins with.
const BISECTIONS: usize = 30;
/// Degrees of freedom from which Student's t is replaced by the normal distribution.
const NORMAL_DOF: f64 = 1e4;

/// Half-width of the symmetric interval that contains the sum with this probability; 0 without rectangles, whose interval is Student's. `half_widths` are those of the rectangles; the Student
/// contribution is `scale` times t with `dof` degrees of freedom. All in one unit.
pub(super) fn half_width(half_widths: &[f64], scale: f64, dof: f64, probability: f64) -> f64 {
    let reach: f64 = half_widths.iter().sum();
    if !(reach > 0.0 && reach.is_finite()) {
        return 0.0;
    }
    let step = reach / HALF_POINTS as f64;
    let probabilities = rectangles(half_widths, step);
    // A narrower contribution is widened: a third of a grid step changes the half-width by less than its error.
    let scale = scale.max(0.3 * step);
    let tail = |x: f64| if dof < NORMAL_DOF { student_tail(x, dof.floor().max(1.0)) } else { normal_tail(x) };
    // P(|sum| > h) by the symmetry of both densities.
    let outside = |h: f64| probabilities.iter().map(|(x, weight)| weight * (tail((h - x) / scale) + tail((h + x) / scale))).sum::<f64>();
    let (mut low, mut high) = (0.0, reach + scale);
    while outside(high) > 1.0 - probability {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if outside(middle) > 1.0 - probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Grid points and probabilities of the sum of the rectangles.
fn rectangles(half_widths: &[f64], step: f64) -> Vec<(f64, f64)> {
    let points = 2 * HALF_POINTS + 1;
    let mut density = vec![0.0; points];
    density[HALF_POINTS] = 1.0;
    for half in half_widths {
        density = running_sum(&density, half / step);
    }
    let total: f64 = density.iter().sum();
    density.into_iter().enumerate().map(|(k, p)| ((k as f64 - HALF_POINTS as f64) * step, p / total)).collect()
}

/// Running sum over ± `half` grid steps; `half` need not be whole.
fn running_sum(density: &[f64], half: f64) -> Vec<f64> {
    let mut below = vec![0.0];
    below.extend(density.iter().scan(0.0, |sum, value| {
        *sum += value;
        Some(*sum)
    }));
    // Integral up to a position between two points.
    let integral = |position: f64| {
        let position = (position + 0.5).clamp(0.0, density.len() as f64);
        let whole = (position as usize).min(density.len() - 1);
        below[whole] + (position - whole as f64) * density[whole]
    };
    // A rectangle narrower than the grid leaves the density as it is.
    let half = half.max(0.5);
    (0..density.len()).map(|k| integral(k as f64 + half) - integral(k as f64 - half)).collect()
}

//! Distribution of a sum of rectangular contributions and one normal contribution, computed on a grid.
//!
//! JCGM 101 propagates distributions by Monte Carlo; a sum of independent terms needs a convolution only.

/// Grid points on one side of zero.
const HALF_POINTS: usize = 2000;
/// Standard deviations to which the normal contribution is followed.
const NORMAL_REACH: f64 = 6.0;

/// Half-width of the symmetric interval that contains the sum with this probability. `half_widths` are those of the rectangles, `sigma` is the
/// standard deviation of the normal contribution, all in one unit.
pub(super) fn half_width(half_widths: &[f64], sigma: f64, probability: f64) -> f64 {
    let reach = half_widths.iter().sum::<f64>() + NORMAL_REACH * sigma;
    if !(reach > 0.0 && reach.is_finite()) {
        return 0.0;
    }
    let step = reach / HALF_POINTS as f64;
    let x = |k: usize| (k as f64 - HALF_POINTS as f64) * step;
    // A normal contribution narrower than the grid is a spike.
    let width = sigma.max(0.5 * step);
    let mut density: Vec<f64> = (0..=2 * HALF_POINTS).map(|k| (-0.5 * (x(k) / width).powi(2)).exp()).collect();
    for half in half_widths {
        density = running_mean(&density, half / step);
    }
    let total: f64 = density.iter().sum();
    // From the middle outwards; linear interpolation within the last step.
    let mut enclosed = density[HALF_POINTS] / total;
    for k in 1..=HALF_POINTS {
        let more = (density[HALF_POINTS + k] + density[HALF_POINTS - k]) / total;
        if enclosed + more >= probability {
            return (k as f64 - 0.5 + (probability - enclosed) / more) * step;
        }
        enclosed += more;
    }
    reach
}

/// Running mean over ± `half` grid steps; `half` need not be whole. The result is not normalised.
fn running_mean(density: &[f64], half: f64) -> Vec<f64> {
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
    (0..density.len()).map(|k| integral(k as f64 + half) - integral(k as f64 - half)).collect()
}

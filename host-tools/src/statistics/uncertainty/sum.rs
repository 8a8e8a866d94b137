//! The distribution of a sum of rectangles and one normal part, on a grid (JCGM 101 propagates distributions by drawing; a sum needs no draws).

/// Points of the grid on one side of zero.
const HALF: usize = 2000;
/// The normal part is followed to so many of its standard deviations.
const FAR: f64 = 6.0;

/// Half of the symmetric interval that holds the sum with this probability: rectangles of these half-widths, and a normal part.
pub(super) fn half_width(rectangles: &[f64], normal: f64, probability: f64) -> f64 {
    let reach = rectangles.iter().sum::<f64>() + FAR * normal;
    if !(reach > 0.0 && reach.is_finite()) {
        return 0.0;
    }
    let step = reach / HALF as f64;
    let x = |k: usize| (k as f64 - HALF as f64) * step;
    // A normal part that is narrower than the grid is a spike.
    let width = normal.max(0.5 * step);
    let mut density: Vec<f64> = (0..=2 * HALF).map(|k| (-0.5 * (x(k) / width).powi(2)).exp()).collect();
    for half in rectangles {
        density = boxed(&density, half / step);
    }
    let total: f64 = density.iter().sum();
    // From the middle outwards; within the last step by proportion.
    let mut held = density[HALF] / total;
    for k in 1..=HALF {
        let more = (density[HALF + k] + density[HALF - k]) / total;
        if held + more >= probability {
            return (k as f64 - 0.5 + (probability - held) / more) * step;
        }
        held += more;
    }
    reach
}

/// The running mean over ± `half` steps, which need not be whole.
fn boxed(density: &[f64], half: f64) -> Vec<f64> {
    let mut below = vec![0.0];
    below.extend(density.iter().scan(0.0, |sum, value| {
        *sum += value;
        Some(*sum)
    }));
    // The integral up to a place between two points.
    let up_to = |place: f64| {
        let place = (place + 0.5).clamp(0.0, density.len() as f64);
        let whole = (place as usize).min(density.len() - 1);
        below[whole] + (place - whole as f64) * density[whole]
    };
    (0..density.len()).map(|k| up_to(k as f64 + half) - up_to(k as f64 - half)).collect()
}

//! The way to an angle: as fast as rate and acceleration limits allow, and no further.
//!
//! In: how far it is and the rate at the end of the millisecond before. Out: the rate at the end of the next. In steps of a millisecond,
//! with rates that go straight between, the greatest rate v₁ from which the rest of the way still suffices solves
//! (v₀ + v₁)/2 + v₁²/2a = d; the last two steps land, beyond the goal by less than 0.6 ms of the acceleration's last millisecond (0.02 counts). The ramp smooths it into an S: an average ends where the averaged ends.

/// The rate at the end of the next millisecond.
///
/// `distance`: counts; `rate`, `fastest`: counts per tick; `acceleration`: counts per tick in a millisecond.
#[inline]
pub fn next_rate(distance: f32, rate: f32, fastest: f32, acceleration: f32) -> f32 {
    // As seen in the direction of the goal; in steps of a millisecond.
    let ahead = distance.abs() * 0.1;
    let now = if distance < 0.0 { -rate } else { rate };
    let room = 2.0 * ahead - now;
    let braking = if room > 2.0 * acceleration {
        square_root(acceleration * (0.25 * acceleration + room)) - 0.5 * acceleration
    } else {
        // Half of it now and half of it in the next step, which ends at rest.
        0.5 * room
    };
    let next = if braking > fastest { fastest } else { braking };
    if distance < 0.0 { -next } else { next }
}

/// Three steps of Newton's from a guess by the exponent: 10⁻⁷. The core has an instruction for it, but the stable library no name.
#[inline]
fn square_root(x: f32) -> f32 {
    let mut root = f32::from_bits((x.to_bits() >> 1).wrapping_add(0x1fbd_1df5));
    for _ in 0..3 {
        root = 0.5 * (root + x / root);
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_ends_at_its_end_at_rest_within_the_limits() {
        let (fastest, acceleration) = (2.0_f32, 0.02_f32);
        for distance in [0.01_f32, 0.3, 1.0, 7.77, 100.0, 5_000.0, 123_456.0, -0.3, -4_321.0] {
            for start in [0.0, 1.3, -1.3] {
                let (mut left, mut rate, mut steps) = (f64::from(distance), start, 0);
                while steps < 20_000 && (left.abs() > 1e-3 || rate != 0.0) {
                    let wanted = next_rate(left as f32, rate, fastest, acceleration);
                    let next = wanted.max(rate - acceleration).min(rate + acceleration);
                    left -= 5.0 * f64::from(rate + next);
                    assert!(next.abs() <= fastest + 1e-6);
                    if start == 0.0 {
                        // A millisecond of the last braking, at most.
                        let over = -left * f64::from(distance.signum());
                        assert!(over < 7.0 * f64::from(acceleration), "{distance}: {over}");
                    }
                    rate = if next.abs() < 1e-7 { 0.0 } else { next };
                    steps += 1;
                }
                assert!(left.abs() <= 1e-2 && steps < 20_000, "{distance} from {start}: {left} at {rate}");
                // No slower than a twentieth above the quickest way there is.
                if start == 0.0 && distance > 1.0 {
                    let d = f64::from(distance) / 10.0;
                    let (v, a) = (f64::from(fastest), f64::from(acceleration));
                    let quickest = if d < v * v / a { 2.0 * (d / a).sqrt() } else { d / v + v / a };
                    assert!(f64::from(steps) < 1.05 * quickest + 4.0, "{distance}: {steps} {quickest}");
                }
            }
        }
    }
}

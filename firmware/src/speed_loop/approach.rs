//! Approach to an angle: as fast as the limits of rate and acceleration allow, without overshoot.
//!
//! In: the distance to the angle and the rate at the end of the last millisecond. Out: the rate at the end of the next one. The rate is
//! linear within a millisecond, so the greatest rate v₁ from which the rest of the distance d suffices for braking solves
//! (v₀ + v₁)/2 + v₁²/2a = d. The last two steps end at rest, beyond the angle by less than 0.6 ms of the acceleration's last millisecond
//! (0.02 counts). The ramp smooths the rate into an S-curve; an average ends where its input ends.

use crate::board::CONTROL_PER_ROW;

/// The rate at the end of the next millisecond, counts per tick.
///
/// `distance`: counts; `rate`, `max_rate`: counts per tick; `acceleration`: counts per tick in a millisecond.
pub(super) fn next_rate(distance: f32, rate: f32, max_rate: f32, acceleration: f32) -> f32 {
    // In the direction of the angle, and in steps of a millisecond.
    let ahead = distance.abs() / CONTROL_PER_ROW as f32;
    let now = if distance < 0.0 { -rate } else { rate };
    let margin = 2.0 * ahead - now;
    let braking = if margin > 2.0 * acceleration {
        libm::sqrtf(acceleration * (0.25 * acceleration + margin)) - 0.5 * acceleration
    } else {
        // Half of it now and half of it in the next step, which ends at rest.
        0.5 * margin
    };
    let next = if braking > max_rate { max_rate } else { braking };
    if distance < 0.0 { -next } else { next }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_approach_ends_at_rest_at_its_angle_within_the_limits() {
        let (max_rate, acceleration) = (2.0_f32, 0.02_f32);
        for distance in [0.01_f32, 0.3, 1.0, 7.77, 100.0, 5_000.0, 123_456.0, -0.3, -4_321.0] {
            for start in [0.0, 1.3, -1.3] {
                let (mut left, mut rate, mut steps) = (f64::from(distance), start, 0);
                while steps < 20_000 && (left.abs() > 1e-3 || rate != 0.0) {
                    let wanted = next_rate(left as f32, rate, max_rate, acceleration);
                    let next = wanted.max(rate - acceleration).min(rate + acceleration);
                    left -= 5.0 * f64::from(rate + next);
                    assert!(next.abs() <= max_rate + 1e-6);
                    if start == 0.0 {
                        // At most a millisecond of the last braking.
                        let over = -left * f64::from(distance.signum());
                        assert!(over < 7.0 * f64::from(acceleration), "{distance}: {over}");
                    }
                    rate = if next.abs() < 1e-7 { 0.0 } else { next };
                    steps += 1;
                }
                assert!(left.abs() <= 1e-2 && steps < 20_000, "{distance} from {start}: {left} at {rate}");
                // At most 5 % slower than the fastest approach.
                if start == 0.0 && distance > 1.0 {
                    let d = f64::from(distance) / 10.0;
                    let (v, a) = (f64::from(max_rate), f64::from(acceleration));
                    let quickest = if d < v * v / a { 2.0 * (d / a).sqrt() } else { d / v + v / a };
                    assert!(f64::from(steps) < 1.05 * quickest + 4.0, "{distance}: {steps} {quickest}");
                }
            }
        }
    }
}

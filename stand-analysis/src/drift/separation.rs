//! Own and apparent drift from two positions 180° apart (docs/theory.md §3): one axis by formulas (15) and (16), three axes with the
//! correction for the rotation of the platform during a cycle.

use hal_sim::gyro::attitude::{Vector, cross, each};

/// Formulas (15) and (16): own and apparent drift by the rates in both positions, rad/s.
pub fn single(first_rad_s: f64, turned_rad_s: f64) -> (f64, f64) {
    ((first_rad_s + turned_rad_s) / 2.0, (first_rad_s - turned_rad_s) / 2.0)
}

/// Azimuth of a single axis by its apparent drift, ω_a = −ω_h cos A, 0 to π; `None` for a drift greater than ω_h.
pub fn azimuth_rad(apparent_rad_s: f64, horizontal_rad_s: f64) -> Option<f64> {
    let cos = -apparent_rad_s / horizontal_rad_s;
    (cos.abs() <= 1.0).then(|| cos.acos())
}

/// Own drift and azimuth of a three-axis platform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlatformDrift {
    /// ω_d about the platform axes x (along the azimuth), y (up), z, rad/s.
    pub own_rad_s: Vector,
    /// A, rad, −π to π.
    pub azimuth_rad: f64,
}

/// Own drift and azimuth by the uncorrected rates of three axes in both positions: (15) and (16) for each axis. The turn separates nothing
/// about the vertical, where ω_v follows from the latitude.
pub fn three_uncorrected(rates_rad_s: &[Vector; 2], vertical_rad_s: f64) -> PlatformDrift {
    from_rates(rates_rad_s, vertical_rad_s)
}

/// Own drift and azimuth with the rates referred to the beginning of the cycles: by their middle the platform has turned by T ω (gimbal
/// sequence X–Z–Y, docs/theory.md §3.3).
pub fn three(rates_rad_s: &[Vector; 2], vertical_rad_s: f64, pulse_s: f64) -> PlatformDrift {
    // From gimbal angles to rates about the platform axes.
    let body = rates_rad_s.map(|[x, y, z]| [x - pulse_s * z * y, y - pulse_s * x * z, z + pulse_s * x * y]);
    let mut found = from_rates(rates_rad_s, vertical_rad_s);
    for _ in 0..4 {
        let at_rest: [Vector; 2] =
            std::array::from_fn(|k| each(body[k], cross(rates_rad_s[k], found.own_rad_s), |body, turned| body - pulse_s * turned));
        found = from_rates(&at_rest, vertical_rad_s);
    }
    found
}

fn from_rates([first, turned]: &[Vector; 2], vertical_rad_s: f64) -> PlatformDrift {
    let mut own_rad_s = each(*first, *turned, |a, b| (a + b) / 2.0);
    own_rad_s[1] += vertical_rad_s;
    PlatformDrift { own_rad_s, azimuth_rad: (first[2] - turned[2]).atan2(turned[0] - first[0]) }
}

//! Own and apparent drift from two positions 180° apart: one axis by (15) and (16), three axes with what the platform's own rotation does meanwhile.

use super::DriftError;
use hal_sim::gyro::attitude::{Vector, cross, each};
use hal_sim::gyro::earth::EARTH_RAD_S;

/// A pole is nearer than this: the azimuth's error there is the gyro's drift times 200.
const POLE_DEG: f64 = 89.7;

/// The horizontal and vertical parts of the Earth's rate at a latitude, rad/s.
///
/// # Errors
/// A latitude that is none, or a pole.
pub fn earth_rad_s(latitude_deg: f64) -> Result<(f64, f64), DriftError> {
    super::error::within("--latitude", latitude_deg, -90.0, 90.0)?;
    if latitude_deg.abs() > POLE_DEG {
        return Err(DriftError::Pole(latitude_deg));
    }
    let (sin, cos) = latitude_deg.to_radians().sin_cos();
    Ok((EARTH_RAD_S * cos, EARTH_RAD_S * sin))
}

/// Formulas (15) and (16): own and apparent drift from the rates in both positions, rad/s.
pub fn single(first_rad_s: f64, turned_rad_s: f64) -> (f64, f64) {
    ((first_rad_s + turned_rad_s) / 2.0, (first_rad_s - turned_rad_s) / 2.0)
}

/// The azimuth of a single axis by its apparent drift, ω_a = −ω_h cos A, 0 to π; `None` where the drift is greater than ω_h.
pub fn azimuth_rad(apparent_rad_s: f64, horizontal_rad_s: f64) -> Option<f64> {
    let cos = -apparent_rad_s / horizontal_rad_s;
    (cos.abs() <= 1.0).then(|| cos.acos())
}

/// What three axes tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Platform {
    /// ω_d about the platform's axes x (along the azimuth), y (up), z, rad/s.
    pub own_rad_s: Vector,
    /// A, rad, −π to π.
    pub azimuth_rad: f64,
}

/// Own drift and azimuth from the rates of three axes in both positions, as they are: (15) and (16) for each axis; about the vertical the turn
/// separates nothing, and the latitude supplies ω_v.
pub fn three_uncorrected(rates_rad_s: &[Vector; 2], vertical_rad_s: f64) -> Platform {
    of_rates(rates_rad_s, vertical_rad_s)
}

/// The same, with the rates brought to the beginning of the cycles: by their middle the platform has turned by T ω (gimbal order X–Z–Y, theory.md §3.3).
pub fn three(rates_rad_s: &[Vector; 2], vertical_rad_s: f64, pulse_s: f64) -> Platform {
    // From angles of the gimbals to rates about the platform's axes.
    let body = rates_rad_s.map(|[x, y, z]| [x - pulse_s * z * y, y - pulse_s * x * z, z + pulse_s * x * y]);
    let mut found = of_rates(rates_rad_s, vertical_rad_s);
    for _ in 0..4 {
        let at_rest: [Vector; 2] =
            std::array::from_fn(|k| each(body[k], cross(rates_rad_s[k], found.own_rad_s), |body, turned| body - pulse_s * turned));
        found = of_rates(&at_rest, vertical_rad_s);
    }
    found
}

fn of_rates([first, turned]: &[Vector; 2], vertical_rad_s: f64) -> Platform {
    let mut own_rad_s = each(*first, *turned, |a, b| (a + b) / 2.0);
    own_rad_s[1] += vertical_rad_s;
    Platform { own_rad_s, azimuth_rad: (first[2] - turned[2]).atan2(turned[0] - first[0]) }
}

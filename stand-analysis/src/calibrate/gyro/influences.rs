//! Influences of type B that several quantities of a gyro share: misalignment, g-sensitivity, thermometer, beside the clock of the stand.
//! One definition each, so that the covariance of two quantities follows from their names.

pub(super) use crate::calibrate::crystal::clock;
use crate::calibrate::{Assumptions, Basis, Contribution};

/// Standard gravity, m/s².
pub(super) const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// Factor by which a measured scale is corrected for the mean of the cosine of the angle between both axes: the angle is uniform within ±
/// m, so the mean of its cosine is 1 − m²/6 (GUM F.2.4.4).
pub(super) fn misalignment_factor(assumed: &Assumptions) -> f64 {
    1.0 + assumed.misalignment_deg.to_radians().powi(2) / 6.0
}

/// Cosine of the misalignment; its standard deviation is m²/2 √(4/45). `sensitivity`: change of the result per change of the cosine.
pub(super) fn misalignment(assumed: &Assumptions, sensitivity: f64) -> Contribution {
    let half_width_deg = assumed.misalignment_deg;
    let u = 0.5 * half_width_deg.to_radians().powi(2) * (4.0_f64 / 45.0).sqrt();
    Contribution::type_b("misalignment", u, "1", sensitivity, Basis::Misalignment { half_width_deg })
}

/// Output per acceleration across the axis, rad/s/g. `sensitivity`: change of the result per rad/s/g.
pub(super) fn g_sensitivity(assumed: &Assumptions, sensitivity: f64) -> Contribution {
    let half_width_deg_s_g = assumed.g_sensitivity_deg_s_g;
    Contribution::rectangular(
        "g-sensitivity",
        half_width_deg_s_g.to_radians(),
        "rad/s/g",
        sensitivity,
        Basis::GSensitivityHalfWidth { half_width_deg_s_g },
    )
}

/// Thermometer of the device under test at the temperature of the value.
pub(super) fn thermometer(assumed: &Assumptions, sensitivity: f64) -> Contribution {
    let half_width_K = assumed.temperature_K;
    Contribution::rectangular("thermometer", half_width_K, "K", sensitivity, Basis::ThermometerReading { half_width_K })
}

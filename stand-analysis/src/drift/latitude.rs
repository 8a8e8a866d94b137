//! The Earth's rotation at a latitude, and whether a measured horizontal rate agrees with it.

use super::error::{DriftError, within};
use hal_sim::gyro::earth::EARTH_RAD_S;
use identification::statistics::uncertainty::{Estimate, coverage_factor};

/// Latitude from which a site counts as a pole: the error of the azimuth is 200 times that of the equator.
const MAX_LATITUDE_DEG: f64 = 89.7;
/// Coverage probability of the interval outside of which a latitude is refused: one correct latitude in a thousand is.
const AGREEMENT_PROBABILITY: f64 = 0.999;

/// Components of the Earth rate at a latitude, rad/s, with their standard uncertainties by that of the latitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EarthRate {
    /// Latitude, degrees.
    pub latitude_deg: f64,
    /// Horizontal component.
    pub horizontal_rad_s: f64,
    /// Vertical component.
    pub vertical_rad_s: f64,
    /// Uncertainty of the horizontal component.
    pub u_horizontal_rad_s: f64,
    /// Uncertainty of the vertical component.
    pub u_vertical_rad_s: f64,
}

impl EarthRate {
    /// At a latitude in degrees, north positive, with its standard uncertainty in rad.
    ///
    /// # Errors
    /// A latitude out of range.
    pub fn at(latitude_deg: f64, latitude_error_rad: f64) -> Result<Self, DriftError> {
        within("latitude_deg", latitude_deg, -90.0, 90.0)?;
        let (sin, cos) = latitude_deg.to_radians().sin_cos();
        Ok(Self {
            latitude_deg,
            horizontal_rad_s: EARTH_RAD_S * cos,
            vertical_rad_s: EARTH_RAD_S * sin,
            u_horizontal_rad_s: EARTH_RAD_S * sin.abs() * latitude_error_rad,
            u_vertical_rad_s: EARTH_RAD_S * cos * latitude_error_rad,
        })
    }

    /// A pole, where the azimuth is undefined.
    pub fn is_pole(&self) -> bool {
        self.latitude_deg.abs() > MAX_LATITUDE_DEG
    }

    /// Compares the measured horizontal component, whose uncertainty includes all contributions except the latitude.
    ///
    /// # Errors
    /// It disagrees with the latitude beyond the uncertainties of both.
    pub fn agrees_with(&self, measured: Estimate) -> Result<(), DriftError> {
        self.compare(measured, |deviation| deviation.abs())
    }

    /// Compares a component that is at most the horizontal one.
    ///
    /// # Errors
    /// It exceeds the horizontal component beyond the uncertainties of both.
    pub fn is_at_least(&self, component: Estimate) -> Result<(), DriftError> {
        self.compare(component.scaled(if component.value < 0.0 { -1.0 } else { 1.0 }), |deviation| deviation)
    }

    fn compare(&self, measured: Estimate, excess: impl Fn(f64) -> f64) -> Result<(), DriftError> {
        let Some(uncertainty) = measured.uncertainty else { return Ok(()) };
        let both = uncertainty.with_known(self.u_horizontal_rad_s);
        let limit = coverage_factor(both.dof, AGREEMENT_PROBABILITY) * both.u;
        if excess(measured.value - self.horizontal_rad_s) > limit {
            return Err(DriftError::LatitudeDisagrees {
                latitude_deg: self.latitude_deg,
                expected_deg_h: self.horizontal_rad_s / super::DEG_H,
                measured_deg_h: measured.value / super::DEG_H,
                expanded_deg_h: uncertainty.expanded() / super::DEG_H,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::DEG_H;
    use super::*;
    use identification::statistics::uncertainty::Uncertainty;

    fn measured(deg_h: f64, u_deg_h: f64) -> Estimate {
        Estimate { value: deg_h * DEG_H, uncertainty: Some(Uncertainty::student(u_deg_h * DEG_H, 10.0)) }
    }

    #[test]
    fn a_wrong_latitude_is_found_and_its_uncertainty_counts() {
        // 70°: 5.144 °/h; 68°: 5.634 °/h.
        let found = measured(5.146, 0.002);
        assert!(EarthRate::at(70.0, 0.0).unwrap().agrees_with(found).is_ok());
        assert!(EarthRate::at(68.0, 0.0).unwrap().agrees_with(found).is_err());
        assert!(EarthRate::at(68.0, 2_f64.to_radians()).unwrap().agrees_with(found).is_ok());
        assert!(EarthRate::at(70.0, 0.0).unwrap().agrees_with(Estimate { value: 1.0, uncertainty: None }).is_ok());
        assert!(EarthRate::at(91.0, 0.0).is_err() && EarthRate::at(-90.0, 0.0).unwrap().is_pole());
    }

    #[test]
    fn a_component_may_be_smaller_but_not_greater() {
        let earth = EarthRate::at(70.0, 0.0).unwrap();
        assert!(earth.is_at_least(measured(-0.9, 0.002)).is_ok() && earth.is_at_least(measured(-5.146, 0.002)).is_ok());
        assert!(earth.is_at_least(measured(-5.3, 0.002)).is_err() && earth.is_at_least(measured(5.3, 0.002)).is_err());
    }
}

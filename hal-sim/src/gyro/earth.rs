//! The Earth rate at a site.

/// Rate of the Earth's rotation, rad/s.
pub const EARTH_RAD_S: f64 = 7.292_115_9e-5;

/// Site and azimuth of the stand.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Site {
    /// Latitude, north positive, rad.
    pub latitude_rad: f64,
    /// Azimuth of the base's x axis from north, rad, clockwise seen from above.
    pub azimuth_rad: f64,
}

impl Default for Site {
    /// The site of the published figures: 70° north, azimuth 80°.
    fn default() -> Self {
        Self { latitude_rad: 70_f64.to_radians(), azimuth_rad: 80_f64.to_radians() }
    }
}

impl Site {
    /// ω_h: towards north, rad/s.
    pub fn horizontal_rad_s(&self) -> f64 {
        EARTH_RAD_S * libm::cos(self.latitude_rad)
    }

    /// ω_v: upwards, rad/s.
    pub fn vertical_rad_s(&self) -> f64 {
        EARTH_RAD_S * libm::sin(self.latitude_rad)
    }

    /// The Earth's rate in axes turned by `turned_rad` from the base's: x at the azimuth, y up, z to its right, rad/s.
    pub fn rate_rad_s(&self, turned_rad: f64) -> [f64; 3] {
        let (sin, cos) = libm::sincos(self.azimuth_rad + turned_rad);
        [self.horizontal_rad_s() * cos, self.vertical_rad_s(), -self.horizontal_rad_s() * sin]
    }
}

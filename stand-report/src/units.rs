//! Display units of measured quantities, chosen by the user (`--units deg/h,mg,ppm`).
//!
//! Input: a [`Dimension`] and the [`Units`] of the user, completed by the defaults of the report. Output: factor from the SI unit and
//! symbol. Results are computed and stored in SI units; only texts, pages and the list `quantities` of a JSON answer use these units.
//!
//! A unit of rate also fixes the units of all quantities derived from a rate: with `deg/h` an angle random walk is in °/√h and a rate ramp
//! in °/h/h. `deg/sqrt(h)` and `(deg/s)/sqrt(Hz)` choose the unit of random walk or density alone.

use std::f64::consts::PI;
use std::str::FromStr;

/// Standard gravity, m/s² (CGPM 1901).
pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;
const DEG: f64 = PI / 180.0;
const HOUR_S: f64 = 3600.0;

/// Dimension of a quantity, with the SI unit in which the analyses compute it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// Angular rate, rad/s.
    Rate,
    /// Angle random walk, rad/√s.
    AngleRandomWalk,
    /// Density of a rate, (rad/s)/√Hz.
    RateDensity,
    /// Rate random walk, rad/s/√s.
    RateRandomWalk,
    /// Rate ramp, rad/s².
    RateRamp,
    /// Angle of a gyro's quantisation, rad.
    Angle,
    /// Rate per acceleration, rad/s per g.
    RatePerG,
    /// Acceleration, m/s².
    Acceleration,
    /// Velocity random walk, m/s/√s.
    VelocityRandomWalk,
    /// Density of an acceleration, (m/s²)/√Hz.
    AccelerationDensity,
    /// Acceleration random walk, m/s²/√s.
    AccelerationRandomWalk,
    /// Acceleration ramp, m/s³.
    AccelerationRamp,
    /// Velocity of an accelerometer's quantisation, m/s.
    Velocity,
    /// Ratio, 1.
    Ratio,
    /// Part of the full scale, 1.
    OfFullScale,
}

/// Unit of an angular rate, and of the quantities derived from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RateUnit {
    /// rad/s.
    RadS,
    /// °/s.
    DegS,
    /// °/h.
    DegH,
}

/// Unit of an acceleration, and of the quantities derived from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AccelerationUnit {
    /// m/s².
    MetreS2,
    /// g.
    G,
    /// mg.
    MilliG,
    /// µg.
    MicroG,
}

/// Unit of a ratio.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RatioUnit {
    /// 1.
    One,
    /// Percent.
    Percent,
    /// Parts per million.
    Ppm,
}

/// Chosen units; `None` where the default of the report holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Units {
    /// Of rates.
    pub rate: Option<RateUnit>,
    /// Of an angle random walk; otherwise that of rates.
    pub random_walk: Option<RateUnit>,
    /// Of the density of a rate; otherwise that of rates.
    pub density: Option<RateUnit>,
    /// Of accelerations.
    pub acceleration: Option<AccelerationUnit>,
    /// Of the density of an acceleration; otherwise that of accelerations.
    pub acceleration_density: Option<AccelerationUnit>,
    /// Of ratios.
    pub ratio: Option<RatioUnit>,
}

/// Factor from the SI unit, and symbol.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// Displayed number per SI number.
    pub factor: f64,
    /// Symbol; empty for the plain ratio.
    pub unit: String,
}

/// The accepted words of `--units`, for messages and help.
pub const WORDS: &str = "rad/s, deg/s, deg/h, rad/sqrt(s), deg/sqrt(s), deg/sqrt(h), (rad/s)/sqrt(Hz), (deg/s)/sqrt(Hz), (deg/h)/sqrt(Hz), m/s2, g, mg, ug, \
                         (m/s2)/sqrt(Hz), mg/sqrt(Hz), ug/sqrt(Hz), 1, %, ppm";

/// Why a list of units is not accepted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UnitsError {
    /// A word is no unit.
    #[error("`{0}` is not a unit that can be chosen; there are {WORDS}")]
    Unknown(String),
    /// Two words for one dimension.
    #[error("`{0}`: a unit of this dimension was given before")]
    Twice(String),
}

impl FromStr for Units {
    type Err = UnitsError;

    fn from_str(text: &str) -> Result<Self, UnitsError> {
        let mut units = Self::default();
        for word in text.split(',').map(str::trim) {
            units.add(word)?;
        }
        Ok(units)
    }
}

/// Sets a unit that must not have been set before.
fn set<T>(place: &mut Option<T>, unit: T, word: &str) -> Result<(), UnitsError> {
    match place.replace(unit) {
        Some(_) => Err(UnitsError::Twice(word.to_owned())),
        None => Ok(()),
    }
}

impl Units {
    fn add(&mut self, word: &str) -> Result<(), UnitsError> {
        let plain: String = word.replace('°', "deg").replace('µ', "u").replace("√", "sqrt").replace('²', "2").to_ascii_lowercase();
        let plain: String = plain.chars().filter(|c| !matches!(c, '(' | ')' | ' ')).collect();
        match plain.as_str() {
            "rad/s" => set(&mut self.rate, RateUnit::RadS, word),
            "deg/s" => set(&mut self.rate, RateUnit::DegS, word),
            "deg/h" => set(&mut self.rate, RateUnit::DegH, word),
            "rad/sqrts" => set(&mut self.random_walk, RateUnit::RadS, word),
            "deg/sqrts" => set(&mut self.random_walk, RateUnit::DegS, word),
            "deg/sqrth" => set(&mut self.random_walk, RateUnit::DegH, word),
            "rad/s/sqrthz" => set(&mut self.density, RateUnit::RadS, word),
            "deg/s/sqrthz" => set(&mut self.density, RateUnit::DegS, word),
            "deg/h/sqrthz" => set(&mut self.density, RateUnit::DegH, word),
            "m/s2" => set(&mut self.acceleration, AccelerationUnit::MetreS2, word),
            "g" => set(&mut self.acceleration, AccelerationUnit::G, word),
            "mg" => set(&mut self.acceleration, AccelerationUnit::MilliG, word),
            "ug" => set(&mut self.acceleration, AccelerationUnit::MicroG, word),
            "m/s2/sqrthz" => set(&mut self.acceleration_density, AccelerationUnit::MetreS2, word),
            "mg/sqrthz" => set(&mut self.acceleration_density, AccelerationUnit::MilliG, word),
            "ug/sqrthz" => set(&mut self.acceleration_density, AccelerationUnit::MicroG, word),
            "1" => set(&mut self.ratio, RatioUnit::One, word),
            "%" | "percent" => set(&mut self.ratio, RatioUnit::Percent, word),
            "ppm" => set(&mut self.ratio, RatioUnit::Ppm, word),
            _ => Err(UnitsError::Unknown(word.to_owned())),
        }
    }

    /// These units, completed by those of `defaults`.
    pub fn or(self, defaults: Self) -> Self {
        // A chosen unit of rate also replaces the default units of what is derived from it.
        let (random_walk, density) = match self.rate {
            Some(_) => (self.random_walk, self.density),
            None => (self.random_walk.or(defaults.random_walk), self.density.or(defaults.density)),
        };
        let acceleration_density = match self.acceleration {
            Some(_) => self.acceleration_density,
            None => self.acceleration_density.or(defaults.acceleration_density),
        };
        Self {
            rate: self.rate.or(defaults.rate),
            random_walk,
            density,
            acceleration: self.acceleration.or(defaults.acceleration),
            acceleration_density,
            ratio: self.ratio.or(defaults.ratio),
        }
    }

    /// Factor and symbol for a dimension; the SI unit where nothing was chosen.
    pub fn scale(&self, dimension: Dimension) -> Scale {
        let rate = self.rate.unwrap_or(RateUnit::RadS);
        let acceleration = self.acceleration.unwrap_or(AccelerationUnit::MetreS2);
        let ratio = self.ratio.unwrap_or(RatioUnit::One);
        let (factor, unit) = match dimension {
            Dimension::Rate => (rate.factor(), rate.symbol().to_owned()),
            Dimension::AngleRandomWalk => self.random_walk.unwrap_or(rate).random_walk(),
            Dimension::RateDensity => {
                let unit = self.density.unwrap_or(rate);
                (unit.factor(), format!("({})/√Hz", unit.symbol()))
            }
            Dimension::RateRandomWalk => (rate.factor() * rate.time_s().sqrt(), format!("{}/√{}", rate.symbol(), rate.time())),
            Dimension::RateRamp => (rate.factor() * rate.time_s(), format!("{}/{}", rate.symbol(), rate.time())),
            Dimension::Angle => (rate.factor() / rate.time_s(), rate.angle().to_owned()),
            Dimension::RatePerG => (rate.factor(), format!("{}/g", rate.symbol())),
            Dimension::Acceleration => (acceleration.factor(), acceleration.symbol().to_owned()),
            Dimension::VelocityRandomWalk => match acceleration {
                AccelerationUnit::MetreS2 => (1.0, "m/s/√s".to_owned()),
                other => (other.factor(), format!("{}/√Hz", other.symbol())),
            },
            Dimension::AccelerationDensity => {
                let unit = self.acceleration_density.unwrap_or(acceleration);
                let symbol = unit.symbol();
                (unit.factor(), if symbol.contains('/') { format!("({symbol})/√Hz") } else { format!("{symbol}/√Hz") })
            }
            Dimension::AccelerationRandomWalk => (acceleration.factor(), format!("{}/√s", acceleration.symbol())),
            Dimension::AccelerationRamp => (acceleration.factor(), format!("{}/s", acceleration.symbol())),
            Dimension::Velocity => match acceleration {
                AccelerationUnit::MetreS2 => (1.0, "m/s".to_owned()),
                other => (other.factor(), format!("{} s", other.symbol())),
            },
            Dimension::Ratio => (ratio.factor(), ratio.symbol().to_owned()),
            Dimension::OfFullScale => (ratio.factor(), format!("{} of full scale", ratio.symbol()).trim_start().to_owned()),
        };
        Scale { factor, unit }
    }
}

impl RateUnit {
    /// Number in this unit per rad/s.
    fn factor(self) -> f64 {
        match self {
            Self::RadS => 1.0,
            Self::DegS => 1.0 / DEG,
            Self::DegH => HOUR_S / DEG,
        }
    }

    fn symbol(self) -> &'static str {
        match self {
            Self::RadS => "rad/s",
            Self::DegS => "°/s",
            Self::DegH => "°/h",
        }
    }

    fn angle(self) -> &'static str {
        match self {
            Self::RadS => "rad",
            Self::DegS | Self::DegH => "°",
        }
    }

    fn time(self) -> &'static str {
        match self {
            Self::RadS | Self::DegS => "s",
            Self::DegH => "h",
        }
    }

    fn time_s(self) -> f64 {
        match self {
            Self::RadS | Self::DegS => 1.0,
            Self::DegH => HOUR_S,
        }
    }

    /// Factor and symbol of an angle random walk.
    fn random_walk(self) -> (f64, String) {
        (self.factor() / self.time_s().sqrt(), format!("{}/√{}", self.angle(), self.time()))
    }
}

impl AccelerationUnit {
    /// Number in this unit per m/s².
    fn factor(self) -> f64 {
        match self {
            Self::MetreS2 => 1.0,
            Self::G => 1.0 / STANDARD_GRAVITY_M_S2,
            Self::MilliG => 1e3 / STANDARD_GRAVITY_M_S2,
            Self::MicroG => 1e6 / STANDARD_GRAVITY_M_S2,
        }
    }

    fn symbol(self) -> &'static str {
        match self {
            Self::MetreS2 => "m/s²",
            Self::G => "g",
            Self::MilliG => "mg",
            Self::MicroG => "µg",
        }
    }
}

impl RatioUnit {
    fn factor(self) -> f64 {
        match self {
            Self::One => 1.0,
            Self::Percent => 1e2,
            Self::Ppm => 1e6,
        }
    }

    fn symbol(self) -> &'static str {
        match self {
            Self::One => "",
            Self::Percent => "%",
            Self::Ppm => "ppm",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(words: &str, dimension: Dimension) -> (f64, String) {
        let Scale { factor, unit } = words.parse::<Units>().unwrap().scale(dimension);
        (factor, unit)
    }

    #[track_caller]
    fn near(words: &str, dimension: Dimension, factor: f64, unit: &str) {
        let (found, symbol) = scale(words, dimension);
        assert!((found / factor - 1.0).abs() < 1e-12 && symbol == unit, "{words}: {found} {symbol}");
    }

    /// 1 rad/s = 57.2958 °/s = 206 264.8 °/h; 1 °/√h = 1/60 °/√s.
    #[test]
    fn a_unit_of_rate_fixes_the_derived_units() {
        let deg = 180.0 / PI;
        near("deg/h", Dimension::Rate, deg * 3600.0, "°/h");
        near("deg/h", Dimension::AngleRandomWalk, deg * 60.0, "°/√h");
        near("deg/h", Dimension::RateRandomWalk, deg * 216_000.0, "°/h/√h");
        near("deg/h", Dimension::RateRamp, deg * 12_960_000.0, "°/h/h");
        near("deg/h", Dimension::Angle, deg, "°");
        near("deg/s", Dimension::AngleRandomWalk, deg, "°/√s");
        near("°/s", Dimension::RateDensity, deg, "(°/s)/√Hz");
        near("deg/s, deg/sqrt(h)", Dimension::AngleRandomWalk, deg * 60.0, "°/√h");
        near("deg/s,(deg/h)/sqrt(Hz)", Dimension::RateDensity, deg * 3600.0, "(°/h)/√Hz");
        near("mg", Dimension::Rate, 1.0, "rad/s");
    }

    #[test]
    fn accelerations_and_ratios_have_their_units() {
        near("mg", Dimension::Acceleration, 1e3 / 9.806_65, "mg");
        near("mg,µg/√Hz", Dimension::AccelerationDensity, 1e6 / 9.806_65, "µg/√Hz");
        near("ug", Dimension::AccelerationRandomWalk, 1e6 / 9.806_65, "µg/√s");
        near("m/s2", Dimension::AccelerationDensity, 1.0, "(m/s²)/√Hz");
        near("ppm", Dimension::OfFullScale, 1e6, "ppm of full scale");
        near("%", Dimension::Ratio, 1e2, "%");
    }

    #[test]
    fn wrong_lists_name_the_word() {
        assert_eq!("deg/min".parse::<Units>(), Err(UnitsError::Unknown("deg/min".to_owned())));
        assert_eq!("deg/h,deg/s".parse::<Units>(), Err(UnitsError::Twice("deg/s".to_owned())));
        assert!("".parse::<Units>().is_err());
    }

    #[test]
    fn defaults_complete_a_choice() {
        let defaults: Units = "deg/h,(deg/s)/sqrt(Hz),mg".parse().unwrap();
        let chosen = "rad/s".parse::<Units>().unwrap().or(defaults);
        assert_eq!(chosen.scale(Dimension::RateDensity).unit, "(rad/s)/√Hz");
        assert_eq!(chosen.scale(Dimension::Acceleration).unit, "mg");
        assert_eq!(Units::default().or(defaults).scale(Dimension::RateDensity).unit, "(°/s)/√Hz");
    }
}

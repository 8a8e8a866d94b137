//! Errors of the sensor under test, drawn and recorded by the simulated stand, and what `explain` says of them.

use std::fmt;

use hal_sim::peripherals::imu::{GyroElement, ImuSetup};
use hal_sim::plant::Stand;
use identification::identify::explain::explain;
use identification::log::Log;
use identification::model::Model;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

use crate::own;

/// An error of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// None.
    None,
    /// Scale, 0.3 to 3 % off.
    Scale,
    /// Bias, 3 to 30 mrad/s.
    Bias,
    /// A cubic term.
    Nonlinearity,
    /// A quadratic term, which the catalogue lacks: its nonlinearity is odd.
    Quadratic,
    /// The element's natural frequency, 10 to 40 Hz, or a delay of 3 to 20 ms.
    Lag,
    /// Response to gravity on a tilted stand, in turn along the sensor's axes.
    GSensitivity,
    /// Mounted askew by 5 to 20 degrees: the cosine of the angle.
    Mounting,
}

/// All errors, in the sequence of the logs.
pub const KINDS: [Kind; 8] =
    [Kind::None, Kind::Scale, Kind::Bias, Kind::Nonlinearity, Kind::Lag, Kind::GSensitivity, Kind::Mounting, Kind::Quadratic];
/// Profiles of the logs, in turn.
const PROFILES: [ProfileKind; 3] = [ProfileKind::MultiStep, ProfileKind::Multisine, ProfileKind::Staircase];
/// Duration, s.
const DURATION_S: f64 = 30.0;

/// The user knows that the sensor's sample is a little older than its note says: it waits in the FIFO.
const KNOWN_LAG: &str = "\"sensor-lag\"";

impl Kind {
    /// Name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Kind::None => "none",
            Kind::Scale => "scale",
            Kind::Bias => "bias",
            Kind::Nonlinearity => "cubic nonlinearity",
            Kind::Quadratic => "quadratic nonlinearity (outside the catalogue)",
            Kind::Lag => "lag or delay",
            Kind::GSensitivity => "g-sensitivity, stand tilted",
            Kind::Mounting => "mounted askew",
        }
    }

    /// Effects of the catalogue that describe it.
    fn effects(self) -> &'static [&'static str] {
        match self {
            Kind::None | Kind::Quadratic => &[],
            Kind::Scale | Kind::Mounting => &["rate-scale"],
            Kind::Bias => &["rate-bias"],
            Kind::Nonlinearity => &["rate-scale-nonlinearity"],
            Kind::Lag => &["sensor-lag", "time-skew"],
            Kind::GSensitivity => &["rate-g-sensitivity"],
        }
    }

    /// The sensor with this error, drawn.
    fn sensor(self, draw: &mut Draw) -> ImuSetup {
        let perfect = ImuSetup { earth_rate_rad_s: 0.0, ..ImuSetup::default() };
        let element = GyroElement::default();
        match self {
            Kind::None => perfect,
            Kind::Scale => ImuSetup { gyro_scale: 1.0 + draw.sign() * draw.between(3e-3, 3e-2), ..perfect },
            Kind::Bias => ImuSetup { gyro_bias_rad_s: draw.sign() * draw.between(3e-3, 3e-2), ..perfect },
            Kind::Nonlinearity => {
                let gyro = GyroElement { cubic_s2: draw.sign() * draw.between(1e-5, 1e-4), ..element };
                ImuSetup { gyro, ..perfect }
            }
            Kind::Quadratic => ImuSetup { gyro: GyroElement { quadratic_s: draw.sign() * draw.between(3e-4, 2e-3), ..element }, ..perfect },
            Kind::Lag if draw.sign() > 0.0 => ImuSetup { gyro: GyroElement { natural_Hz: draw.between(10.0, 40.0), ..element }, ..perfect },
            Kind::Lag => ImuSetup { gyro: GyroElement { delay_s: draw.between(3e-3, 2e-2), ..element }, ..perfect },
            Kind::GSensitivity => {
                let gyro = GyroElement { g_sensitivity_s_m: draw.sign() * draw.between(1e-3, 1e-2), ..element };
                ImuSetup { gyro, tilt_rad: draw.between(0.1, 0.5), radius_m: 0.0, ..perfect }
            }
            Kind::Mounting => ImuSetup { gyro_scale: draw.between(5.0, 20.0).to_radians().cos(), ..perfect },
        }
    }
}

/// Random numbers of a log.
struct Draw(Xoshiro256PlusPlus);

impl Draw {
    fn even(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }
    fn sign(&mut self) -> f64 {
        if self.even() < 0.5 { -1.0 } else { 1.0 }
    }
    /// Even in the logarithm.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.even())
    }
}

/// What was said about one log.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The log's seed.
    pub seed: u64,
    /// The error.
    pub kind: Kind,
    /// The verdict.
    pub verdict: &'static str,
    /// The added effects.
    pub added: Vec<String>,
    /// Residual over the noise, as given and at the end.
    pub ratios: (f64, f64),
}

impl Answer {
    /// The first name is of the hidden error.
    pub fn is_named(&self) -> bool {
        self.added.first().is_some_and(|first| self.kind.effects().contains(&first.as_str()))
    }
}

impl fmt::Display for Answer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Answer { seed, kind, verdict, added, ratios } = self;
        write!(f, "{seed} {}: {verdict} {added:?}, {:.2} to {:.2} × the noise", kind.name(), ratios.0, ratios.1)
    }
}

/// The error, the log and the model of this seed.
///
/// # Panics
/// Never: the stand and the model are valid.
pub fn case(seed: u64) -> (Kind, Log, String) {
    let kind = KINDS[seed as usize % KINDS.len()];
    let mut draw = Draw(Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x7365_6e73));
    let stand = Stand { imu: Some(kind.sensor(&mut draw)), ..Stand::default() };
    let log = own::log(&stand, Mode::Rate, PROFILES[seed as usize / KINDS.len() % PROFILES.len()], DURATION_S, seed);
    let known = if kind == Kind::Lag { "" } else { KNOWN_LAG };
    let model = format!("[drive]\ninput = \"theta_rad\"\noutputs = [\"omega_rad_s\"]\nrate_column = \"gyro_rad_s\"\neffects = [{known}]\n");
    (kind, log, model)
}

/// Records the log of this seed and explains it.
///
/// # Panics
/// The log cannot be explained.
pub fn answer(seed: u64) -> Answer {
    let (kind, log, model) = case(seed);
    let model = Model::parse(&model, "the sensor").expect("a model");
    let log = log.with_rate("gyro_rad_s").expect("the sensor's rate");
    let e = explain(vec![log], &model, &|_| ()).unwrap_or_else(|e| panic!("{e}"));
    let ratio = |fit: &identification::identify::fit::FitResult| fit.channels.iter().map(|c| c.rms / c.noise).fold(0.0, f64::max);
    Answer { seed, kind, verdict: e.verdict.name(), added: e.missing.clone(), ratios: (ratio(&e.given), ratio(&e.explained)) }
}

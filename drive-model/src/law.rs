//! What an effect does, generic over the scalar.

use num_dual::DualNum;

/// Reference temperature of all temperature laws, °C (effects.md).
pub const T0_C: f64 = 25.0;

/// A number of the rig: `f64`, or a dual number over it.
pub trait Scalar: DualNum<Primitive = f64> + Copy + Send + Sync {}
impl<T: DualNum<Primitive = f64> + Copy + Send + Sync> Scalar for T {}

/// The physics of one effect. `p` are its parameters in the card's order.
///
/// All three do nothing unless said otherwise; an effect overrides what it is about.
pub trait Law<S: Scalar>: Send + Sync {
    /// Adds to torque, voltage, dry level or one of the factors, at the state `x`.
    fn act(&self, _p: &[S], _x: &Point<S>, _a: &mut Acts<S>) {}
    /// Changes what a channel shows, with no torque behind it.
    fn see(&self, _p: &[S], _x: &Point<S>, _y: &mut Reading<S>) {}
    /// `act` does nothing: the law is of structure or measurement alone, and need not be asked at every step.
    fn is_silent(&self) -> bool {
        false
    }
    /// Changes the structure of the rig (shaft, winding, bristle, filters); called once for a set of parameters.
    fn arm(&self, _p: &[S], _arms: &mut Arms<S>) {}
}

/// The state at which an effect is evaluated; it stands for the interval [from, to).
#[derive(Debug, Clone, Copy)]
pub struct Point<S> {
    /// Begin of the interval, s.
    pub from_s: f64,
    /// End of the interval, s.
    pub to_s: f64,
    /// Platform angle, rad: the measured one where there is one.
    pub theta: S,
    /// The angle is the measured one, with what the encoder's own error does to it.
    pub theta_measured: bool,
    /// Rate, rad/s (of the motor where the shaft is an arm of the rig).
    pub omega: S,
    /// Motor current, A.
    pub current: S,
    /// Voltage asked for, V.
    pub voltage: S,
    /// Winding temperature, °C.
    pub temp_C: S,
    /// Supply voltage over its nominal value; 1 where it is not measured.
    pub supply_ratio: f64,
    /// The rate channel is made from the encoder.
    pub rate_from_encoder: bool,
}

/// What the effects do to the drive, summed over all of them.
#[derive(Debug, Clone, Copy)]
pub struct Acts<S> {
    /// Torque on the rotor, N m.
    pub torque: S,
    /// Dry level, N m: holds at rest, opposes while sliding.
    pub dry: S,
    /// Viscous coefficient, N m s.
    pub viscous: S,
    /// Factor on the viscous coefficient.
    pub viscous_factor: S,
    /// Voltage added to the one asked for, V.
    pub voltage: S,
    /// Voltage lost against the current, below which none flows, V.
    pub drop_V: S,
    /// Resistance in series with the winding, Ω.
    pub series_ohm: S,
    /// Factor on the winding resistance.
    pub resistance_factor: S,
    /// Factor on the motor constant, in torque and back-EMF.
    pub motor_factor: S,
}

impl<S: Scalar> Acts<S> {
    /// Nothing acts.
    #[inline]
    pub fn none() -> Self {
        let (zero, one) = (S::zero(), S::one());
        Acts {
            torque: zero,
            dry: zero,
            viscous: zero,
            viscous_factor: one,
            voltage: zero,
            drop_V: zero,
            series_ohm: zero,
            resistance_factor: one,
            motor_factor: one,
        }
    }
}

/// What the channels show.
#[derive(Debug, Clone, Copy)]
pub struct Reading<S> {
    /// Rate, rad/s.
    pub omega: S,
    /// Angle, rad.
    pub theta: S,
    /// Current, A.
    pub current: S,
}

/// What changes the structure of the rig. `None`: not there.
#[derive(Debug, Clone, Copy)]
pub struct Arms<S> {
    /// Winding inductance, H.
    pub inductance_H: Option<S>,
    /// Shaft between motor and platform.
    pub shaft: Option<Shaft<S>>,
    /// Stiffness of the bristle that takes the place of the dry level, N m/rad.
    pub bristle_N_m_rad: Option<S>,
    /// Heat of the winding, where its temperature is not measured.
    pub thermal: Option<Thermal<S>>,
    /// First-order lag of the rate channel, s.
    pub lag_s: Option<S>,
    /// Delay of one channel, s.
    pub skew_s: Option<S>,
    /// Some law depends on the current, so that the current must be found before the laws are evaluated.
    pub by_current: bool,
}

impl<S> Default for Arms<S> {
    fn default() -> Self {
        Arms { inductance_H: None, shaft: None, bristle_N_m_rad: None, thermal: None, lag_s: None, skew_s: None, by_current: false }
    }
}

impl<S> Arms<S> {
    /// A rotor and a winding, and no law that asks for the current.
    #[inline]
    pub fn is_plain(&self) -> bool {
        self.shaft.is_none() && self.bristle_N_m_rad.is_none() && self.thermal.is_none() && !self.by_current
    }
}

/// A shaft between motor and platform.
#[derive(Debug, Clone, Copy)]
pub struct Shaft<S> {
    /// Stiffness, N m/rad.
    pub stiffness: S,
    /// Damping, N m s/rad.
    pub damping: S,
    /// Share of the inertia on the motor's side.
    pub share: S,
    /// Whole play, rad.
    pub gap: S,
}

/// The winding as one heat capacity.
#[derive(Debug, Clone, Copy)]
pub struct Thermal<S> {
    /// Heat capacity, J/K.
    pub J_K: S,
    /// Thermal resistance to the surroundings at [`T0_C`], K/W.
    pub K_W: S,
}

//! The law of an effect, generic over the scalar.

use crate::scalar::{Dual, Scalar};

/// Columns of the log that the expressions of a model may use at most.
pub const MAX_COLUMNS: usize = 4;

/// Reference temperature of all temperature laws, °C.
pub const T0_C: f64 = 25.0;

/// The physics of one effect. `p` are its parameters in the order of its card.
///
/// Each method does nothing by default; a law implements those that its effect needs.
pub trait Law<S: Scalar>: Send + Sync {
    /// Adds to torque, voltage, Coulomb torque or one of the factors, at the point `x`.
    fn contribute(&self, _p: &[S], _x: &Point<S>, _out: &mut Contributions<S>) {}
    /// Changes the reading of a channel; no torque causes it.
    fn measure(&self, _p: &[S], _x: &Point<S>, _y: &mut Reading<S>) {}
    /// [`Law::contribute`] does nothing, so that a step need not call it: the law is of structure or measurement alone.
    fn has_no_contribution(&self) -> bool {
        false
    }
    /// Changes the structure of the drive (shaft, winding, bristle, filters); called once for a set of parameters.
    fn configure(&self, _p: &[S], _structure: &mut Structure<S>) {}
}

/// Where an effect is evaluated; the values stand for the time interval [from, to).
#[derive(Debug, Clone, Copy)]
pub struct Point<S> {
    /// Start of the interval, s.
    pub from_s: f64,
    /// End of the interval, s.
    pub to_s: f64,
    /// Time of the first row of the log, s. Laws of the time count from it.
    pub start_s: f64,
    /// Platform angle, rad: the measured angle where there is one.
    pub theta: S,
    /// The angle is the measured one, including the encoder's error.
    pub theta_measured: bool,
    /// Rate, rad/s; of the motor where there is a shaft.
    pub omega: S,
    /// Motor current, A.
    pub current: S,
    /// Commanded voltage, V.
    pub voltage: S,
    /// Winding temperature, °C.
    pub temp_C: S,
    /// Supply voltage over its nominal value; 1 where it is not measured.
    pub supply_ratio: f64,
    /// The rate channel is derived from the encoder.
    pub rate_from_encoder: bool,
    /// The measured angle is the input of the model, a reference with which the rate of another sensor is compared; `omega` is then its
    /// slope.
    pub reference_angle: bool,
    /// Columns of the log that expressions of the user use, in their units; 0 where there are none.
    pub columns: [f64; MAX_COLUMNS],
}

/// Contributions of the effects to the drive, summed over all of them.
#[derive(Debug, Clone, Copy)]
pub struct Contributions<S> {
    /// Torque on the rotor, N m.
    pub torque: S,
    /// Coulomb torque, N m: holds at rest, opposes the motion while sliding.
    pub coulomb_torque: S,
    /// Factor on the Coulomb torque.
    pub coulomb_factor: S,
    /// Additional Coulomb torque per torque of the motor.
    pub coulomb_per_torque: S,
    /// Viscous coefficient, N m s.
    pub viscous: S,
    /// Factor on the viscous coefficient.
    pub viscous_factor: S,
    /// Voltage added to the commanded voltage, V.
    pub voltage: S,
    /// Voltage drop against the current, below which no current flows, V.
    pub drop_V: S,
    /// Resistance in series with the winding, Ω.
    pub series_ohm: S,
    /// Factor on the winding resistance.
    pub resistance_factor: S,
    /// Factor on the motor constant, in torque and back-EMF.
    pub motor_factor: S,
    /// Part of the inertia that varies with the angle, over the mean inertia; only if [`Structure::varying_inertia`].
    pub inertia_variation: S,
    /// Its derivative by the angle, 1/rad.
    pub inertia_slope: S,
}

impl<S: Scalar> Contributions<S> {
    /// No contribution: sums 0, factors 1.
    #[inline]
    pub fn none() -> Self {
        let (zero, one) = (S::zero(), S::one());
        Contributions {
            torque: zero,
            coulomb_torque: zero,
            coulomb_factor: one,
            coulomb_per_torque: zero,
            viscous: zero,
            viscous_factor: one,
            voltage: zero,
            drop_V: zero,
            series_ohm: zero,
            resistance_factor: one,
            motor_factor: one,
            inertia_variation: zero,
            inertia_slope: zero,
        }
    }

    /// Coulomb torque while the motor delivers `motor_torque` (N m).
    #[inline]
    pub fn coulomb_torque_under(&self, motor_torque: S) -> S {
        self.coulomb_torque * self.coulomb_factor + self.coulomb_per_torque * motor_torque.abs()
    }
}

/// Readings of the channels.
#[derive(Debug, Clone, Copy)]
pub struct Reading<S> {
    /// Rate, rad/s.
    pub omega: S,
    /// Angle, rad.
    pub theta: S,
    /// Current, A.
    pub current: S,
    /// Sum of the jumps of the angle so far, rad. `theta` contains it; a rate derived from the encoder shows its differences.
    pub jumped: S,
}

impl<S: Scalar> Reading<S> {
    /// The readings of perfect sensors.
    #[inline]
    pub fn of(omega: S, theta: S, current: S) -> Self {
        Reading { omega, theta, current, jumped: S::zero() }
    }
}

/// Structure of the drive beyond a rigid rotor with a resistive winding. `None`: absent.
#[derive(Debug, Clone, Copy)]
pub struct Structure<S> {
    /// Winding inductance, H.
    pub inductance_H: Option<S>,
    /// Shaft between motor and platform.
    pub shaft: Option<Shaft<S>>,
    /// Stiffness of the bristle that replaces the Coulomb torque, N m/rad.
    pub bristle_N_m_rad: Option<S>,
    /// Thermal model of the winding, where its temperature is not measured.
    pub thermal: Option<Thermal<S>>,
    /// First-order lag of the rate channel, s.
    pub lag_s: Option<S>,
    /// Delay of one channel, s.
    pub skew_s: Option<S>,
    /// Some law depends on the current, which must then be computed before the laws are evaluated.
    pub needs_current: bool,
    /// Some law varies the inertia with the angle.
    pub varying_inertia: bool,
    /// Some law lets the angle reading jump.
    pub angle_jumps: bool,
}

impl<S> Default for Structure<S> {
    fn default() -> Self {
        Structure {
            inductance_H: None,
            shaft: None,
            bristle_N_m_rad: None,
            thermal: None,
            lag_s: None,
            skew_s: None,
            needs_current: false,
            varying_inertia: false,
            angle_jumps: false,
        }
    }
}

impl<S> Structure<S> {
    /// A rigid rotor of constant inertia and a winding, and no law that depends on the current.
    #[inline]
    pub fn is_plain(&self) -> bool {
        self.shaft.is_none() && self.bristle_N_m_rad.is_none() && self.thermal.is_none() && !self.needs_current && !self.varying_inertia
    }
}

/// A shaft between motor and platform.
#[derive(Debug, Clone, Copy)]
pub struct Shaft<S> {
    /// Stiffness, N m/rad.
    pub stiffness: S,
    /// Damping, N m s/rad.
    pub damping: S,
    /// Fraction of the inertia on the motor side.
    pub motor_inertia_fraction: S,
    /// Total play, rad.
    pub gap: S,
}

/// Thermal model of the winding: one heat capacity.
#[derive(Debug, Clone, Copy)]
pub struct Thermal<S> {
    /// Heat capacity, J/K.
    pub J_K: S,
    /// Thermal resistance to the surroundings at [`T0_C`], K/W.
    pub K_W: S,
}

macro_rules! scalars {
    ($($make:ident $scalar:ty, $description:literal;)*) => {
        /// A law in every scalar with which a model is computed.
        pub trait LawSource: std::fmt::Debug + Send + Sync {$(
            #[doc = $description]
            fn $make(&self) -> Box<dyn Law<$scalar>>;
        )*}

        impl<T: Clone + std::fmt::Debug + 'static $(+ Law<$scalar>)*> LawSource for T {$(
            fn $make(&self) -> Box<dyn Law<$scalar>> {
                Box::new(self.clone())
            }
        )*}

        impl LawSource for &'static dyn LawSource {$(
            fn $make(&self) -> Box<dyn Law<$scalar>> {
                (**self).$make()
            }
        )*}

        /// A scalar in which every [`LawSource`] has its law.
        pub trait LawScalar: Scalar {
            /// The law of `source` in this scalar.
            fn law(source: &dyn LawSource) -> Box<dyn Law<Self>>;
        }

        $(impl LawScalar for $scalar {
            fn law(source: &dyn LawSource) -> Box<dyn Law<Self>> {
                source.$make()
            }
        })*
    };
}

scalars! {
    plain f64, "The law without derivatives.";
    dual8 Dual<8>, "The law with 8 derivatives.";
    dual12 Dual<12>, "The law with 12 derivatives.";
    dual16 Dual<16>, "The law with 16 derivatives.";
    dual32 Dual<32>, "The law with 32 derivatives.";
}

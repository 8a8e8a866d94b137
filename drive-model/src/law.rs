//! The law of an effect, generic over the scalar.

use std::ops::{AddAssign, MulAssign, SubAssign};

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

/// A sum of contributions. Where no law adds to it, it costs no operation: most models have few of the sums and factors.
#[derive(Debug, Clone, Copy)]
pub struct Sum<S>(Option<S>);

impl<S: Scalar> Sum<S> {
    /// The sum of nothing.
    pub const NONE: Self = Sum(None);

    /// The sum; 0 where nothing was added.
    #[inline]
    pub fn value(self) -> S {
        self.0.unwrap_or_else(S::zero)
    }

    /// The sum, where something was added.
    #[inline]
    pub fn get(self) -> Option<S> {
        self.0
    }

    /// `start` plus the sum.
    #[inline]
    pub fn added_to(self, start: S) -> S {
        match self.0 {
            Some(sum) => start + sum,
            None => start,
        }
    }
}

impl<S: Scalar> AddAssign<S> for Sum<S> {
    #[inline]
    fn add_assign(&mut self, term: S) {
        self.0 = Some(match self.0 {
            Some(sum) => sum + term,
            None => term,
        });
    }
}

impl<S: Scalar> SubAssign<S> for Sum<S> {
    #[inline]
    fn sub_assign(&mut self, term: S) {
        *self += -term;
    }
}

/// A product of factors. Where no law has one, it costs no operation.
#[derive(Debug, Clone, Copy)]
pub struct Factor<S>(Option<S>);

impl<S: Scalar> Factor<S> {
    /// The product of nothing.
    pub const NONE: Self = Factor(None);

    /// `value` times the product.
    #[inline]
    pub fn times(self, value: S) -> S {
        match self.0 {
            Some(factor) => value * factor,
            None => value,
        }
    }
}

impl<S: Scalar> MulAssign<S> for Factor<S> {
    #[inline]
    fn mul_assign(&mut self, factor: S) {
        self.0 = Some(match self.0 {
            Some(product) => product * factor,
            None => factor,
        });
    }
}

/// Contributions of the effects to the drive, over all of them.
#[derive(Debug, Clone, Copy)]
pub struct Contributions<S> {
    /// Torque on the rotor, N m.
    pub torque: Sum<S>,
    /// Coulomb torque, N m: holds at rest, opposes the motion while sliding.
    pub coulomb_torque: Sum<S>,
    /// Factor on the Coulomb torque.
    pub coulomb_factor: Factor<S>,
    /// Additional Coulomb torque per torque of the motor.
    pub coulomb_per_torque: Sum<S>,
    /// Viscous coefficient, N m s.
    pub viscous: Sum<S>,
    /// Factor on the viscous coefficient.
    pub viscous_factor: Factor<S>,
    /// Voltage added to the commanded voltage, V.
    pub voltage: Sum<S>,
    /// Voltage drop against the current, below which no current flows, V.
    pub drop_V: Sum<S>,
    /// Resistance in series with the winding, Ω.
    pub series_ohm: Sum<S>,
    /// Factor on the winding resistance.
    pub resistance_factor: Factor<S>,
    /// Factor on the motor constant, in torque and back-EMF.
    pub motor_factor: Factor<S>,
    /// Part of the inertia that varies with the angle, over the mean inertia; only if [`Structure::varying_inertia`].
    pub inertia_variation: Sum<S>,
    /// Its derivative by the angle, 1/rad.
    pub inertia_slope: Sum<S>,
}

impl<S: Scalar> Contributions<S> {
    /// No contribution.
    #[inline]
    pub fn none() -> Self {
        Contributions {
            torque: Sum::NONE,
            coulomb_torque: Sum::NONE,
            coulomb_factor: Factor::NONE,
            coulomb_per_torque: Sum::NONE,
            viscous: Sum::NONE,
            viscous_factor: Factor::NONE,
            voltage: Sum::NONE,
            drop_V: Sum::NONE,
            series_ohm: Sum::NONE,
            resistance_factor: Factor::NONE,
            motor_factor: Factor::NONE,
            inertia_variation: Sum::NONE,
            inertia_slope: Sum::NONE,
        }
    }

    /// Coulomb torque while the motor delivers `motor_torque` (N m).
    #[inline]
    pub fn coulomb_torque_under(&self, motor_torque: S) -> S {
        let level = self.coulomb_factor.times(self.coulomb_torque.value());
        match self.coulomb_per_torque.get() {
            Some(share) => level + share * motor_torque.abs(),
            None => level,
        }
    }

    /// Viscous coefficient with its factor, N m s, where there is one.
    #[inline]
    pub fn viscous_N_m_s(&self) -> Option<S> {
        self.viscous.get().map(|viscous| self.viscous_factor.times(viscous))
    }

    /// Resistance of the circuit with a winding of `resistance`, Ω.
    #[inline]
    pub fn resistance_of(&self, resistance: S) -> S {
        self.series_ohm.added_to(self.resistance_factor.times(resistance))
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

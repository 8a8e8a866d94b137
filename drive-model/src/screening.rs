//! How the analysis tests whether a log contains an effect: conditions, and starting values of the test.

/// A condition on log and model without which an effect is not observable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Requirement {
    /// `u_V` is the commanded voltage, not measured at the motor terminals.
    CommandedVoltage,
    /// The voltage is the model's input, or is compared.
    Voltage,
    /// The model has a motor constant: its input is voltage or current.
    MotorConstant,
    /// The angle of the platform is measured or is the model's input.
    Angle,
    /// The angle is compared.
    ComparedAngle,
    /// The angle is compared, or a rate is compared with it as a known motion.
    AngleReading,
    /// The rate is compared.
    ComparedRate,
    /// The rate is compared, or an angle sensor with a known motion.
    RateOrSensorAngle,
    /// The current is compared and is not the model's input.
    ComparedCurrent,
    /// The winding temperature is measured.
    MeasuredTemperature,
    /// The winding temperature changes by half a kelvin or more, where it is measured.
    TemperatureChange,
    /// The angle covers a number of turns.
    Turns {
        /// The number.
        min: f64,
        /// The effect that is indistinguishable over fewer turns, if there is one.
        rival: Option<&'static str>,
    },
    /// The current is not compared while the motion is prescribed: an effect of the current would explain the current by itself.
    SimulatedCurrent,
    /// The model simulates the motion: its input is not the angle.
    SimulatedMotion,
    /// The model has no other effect with a shaft between motor and platform.
    NoOtherShaft,
}

/// An elastic element between two parts of the drive. Its resonance must be slow enough for the rows of the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Elastic {
    /// A shaft between motor and platform; its stiffness, damping and inertia fraction are the effect's last three parameters.
    Shaft,
    /// A bristle in the friction contact; its stiffness is the effect's first parameter.
    Bristle,
}

/// What varies with the angle in a scan over harmonic orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HarmonicSource {
    /// A torque that does not depend on the current.
    Torque,
    /// The motor constant.
    MotorConstant,
    /// The reading of the encoder.
    Encoder,
    /// The inertia.
    Inertia,
}

/// What a period that need not be a whole part of a turn is a period of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PeriodOf {
    /// The angle: the number of periods per turn is fitted.
    Angle,
    /// The time since the first row: the frequency is fitted.
    Time,
}

/// How the absence of an effect is tested, with the values at which the test starts.
///
/// The variants up to [`Screening::HeatCapacities`] start where the effect is absent: one simulation gives the sensitivities of many
/// effects. For the others zero is singular: each start needs a simulation of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Screening {
    /// All coefficients at zero; if there are several, also each one alone. Other parameters at their start values.
    AtZero,
    /// The first coefficient at zero; the others stay at zero.
    FirstAtZero,
    /// Amplitude at zero, at each harmonic order that a scan of the log proposes. Parameters: amplitude, harmonic order, phase.
    Harmonics(HarmonicSource),
    /// A periodic torque: amplitude at zero, at each number of periods that a scan of the log proposes. Parameters: amplitude, number of
    /// periods, phase.
    Periodicities(PeriodOf),
    /// All coefficients at zero, also each one alone; the last parameter, a time constant, at these fractions of the log's length.
    LogFractions(&'static [f64]),
    /// The first parameter at zero, the second (a time) at each jump that the residual of the angle shows best, at most this number.
    AngleJumps(usize),
    /// First coefficient at zero; the second parameter at these fractions of the largest rate in the log.
    RateFractions(&'static [f64]),
    /// First coefficient at zero; the second parameter at this number of times, evenly spaced over the log.
    EventTimes(usize),
    /// First coefficient at zero. Where the winding temperature is not measured, the second parameter (heat capacity) at these multiples of
    /// its start value.
    HeatCapacities(&'static [f64]),
    /// An inductance whose time constant L/R is this number of rows.
    WindingTimeConstants(&'static [f64]),
    /// A current of this multiple of the largest current in the log, within limits.
    CurrentMultiple {
        /// The multiple.
        multiple: f64,
        /// Lower and upper limit, A.
        limits_A: (f64, f64),
    },
    /// A stiffness at which the Coulomb torque bends the bristle by these angles, rad.
    BristleDeflections(&'static [f64]),
    /// A shaft at these resonance frequencies.
    ShaftResonances {
        /// Resonance frequencies, Hz.
        resonances_Hz: &'static [f64],
        /// Damping ratio.
        damping_ratio: f64,
    },
    /// These gaps, with a shaft of one resonance frequency in contact.
    Gaps {
        /// Total plays, rad.
        gaps_rad: &'static [f64],
        /// Resonance frequency in contact, Hz.
        resonance_Hz: f64,
        /// Damping ratio in contact.
        damping_ratio: f64,
    },
}

//! Explanations of the numbers of a calibration, as data: how a contribution was evaluated ([`Basis`]), what a quantity means
//! ([`Meaning`]), why a quantity is absent ([`AbsenceReason`]), remarks on the whole ([`Remark`]). `report` words them.

use super::response::Structure;
use schemars::JsonSchema;
use serde::Serialize;

/// How the standard uncertainty of a contribution was evaluated.
#[derive(Debug, Clone, PartialEq)]
pub enum Basis {
    /// Half-width of the crystal's frequency error, ppm.
    Crystal {
        /// ppm.
        half_width_ppm: f64,
    },
    /// The crystal, compared with a clock reference.
    MeasuredCrystal {
        /// Time with pulses of the reference, s.
        seconds: f64,
        /// Half-width of the reference, ppm.
        reference_ppm: f64,
    },
    /// Half-width, m, of a radius.
    RadiusHalfWidth {
        /// m.
        half_width_m: f64,
    },
    /// The radius is an assumption of the session.
    AssumedRadius {
        /// Assumed value, m.
        radius_m: f64,
        /// m.
        half_width_m: f64,
    },
    /// The scale is assumed to be 1.
    AssumedScale {
        /// %.
        half_width_percent: f64,
    },
    /// The scale found by two radii.
    ScaleByTwoRadii,
    /// Half-width of a reading, % of the reading.
    ReadingHalfWidth {
        /// %.
        half_width_percent: f64,
    },
    /// Half-width of a temperature over the range used, K.
    ThermometerHalfWidth {
        /// K.
        half_width_K: f64,
    },
    /// Half-width of the local gravity.
    GravityHalfWidth {
        /// m/s².
        half_width_m_s2: f64,
    },
    /// Half-width of the stand's tilt, degrees.
    TiltHalfWidth {
        /// °.
        half_width_deg: f64,
    },
    /// Half-width of the level, through which the Earth's rotation along the axis is uncertain, degrees.
    LevelForEarthRate {
        /// °.
        half_width_deg: f64,
    },
    /// The latitude is not known, and with it the component of the Earth's rotation.
    LatitudeUnknown,
    /// Cosine of the angle between the axes of the device under test and the platform; its mean is corrected.
    Misalignment {
        /// °.
        half_width_deg: f64,
    },
    /// Half-width of the output per acceleration across the axis, °/s/g.
    GSensitivityHalfWidth {
        /// °/s/g.
        half_width_deg_s_g: f64,
    },
    /// Half-width of the thermometer at the temperature of the value, K.
    ThermometerReading {
        /// K.
        half_width_K: f64,
    },
    /// Half-width of an angle turned by hand, degrees.
    TurnHalfWidth {
        /// °.
        half_width_deg: f64,
    },
    /// Scatter of positions at rest.
    Positions {
        /// Number.
        count: usize,
    },
    /// Steps of the time stamp of the device under test.
    TimeStampStep,
    /// Error of the encoder within a turn, in plateaus of less than one turn.
    EncoderWithinTurn {
        /// Amplitude of all harmonic orders together, rad.
        amplitude_rad: f64,
    },
    /// Quantisation of the encoder at both ends of a plateau.
    EncoderQuantisation,
    /// Scatter of means over windows of this length.
    WindowScatter {
        /// s.
        window_s: f64,
    },
    /// Smallest Allan deviation.
    AllanFloor {
        /// Its averaging time, s.
        averaging_s: f64,
    },
    /// Scatter of one window.
    OneWindow,
    /// Standard uncertainty of a standard deviation, by the upper end of its χ² interval.
    OfStandardDeviation,
    /// Two standard deviations of a plateau.
    TwoStandardDeviations,
    /// Scatter of plateaus about the fitted curve.
    PlateausAboutCurve {
        /// Number.
        count: usize,
    },
    /// Scatter of plateaus about two straight lines.
    PlateausAboutTwoLines {
        /// Number.
        count: usize,
    },
    /// Scatter about two straight lines that meet at rest.
    LinesMeetingAtRest,
    /// Scatter of plateaus.
    Plateaus {
        /// Number.
        count: usize,
    },
    /// Drift seen within plateaus; their sequence does not separate drift and rate.
    DriftWithinPlateaus,
    /// Scatter of runs of whole turns.
    WholeTurnRuns {
        /// Number.
        count: usize,
    },
    /// Half the difference of both senses of rotation, by which the lag of the device is bounded.
    LagBySenses,
    /// Scatter from turn to turn.
    Turns {
        /// Number.
        count: usize,
    },
    /// Scatter of parts of turns.
    TurnParts {
        /// Number.
        count: usize,
    },
    /// Scatter of the complex responses about the fitted transfer function.
    Responses {
        /// Number of frequencies.
        count: usize,
        /// Scatter over what the uncertainties of the responses predict.
        ratio: f64,
    },
    /// Uncertainty of the coefficient of Ω² at one radius.
    QuadraticCoefficient,
    /// Scatter about the slope of output over rate.
    SlopeOverRate,
    /// Scatter of block means over a temperature range.
    MeansOverTemperature {
        /// Number.
        count: usize,
        /// K.
        range_K: f64,
    },
    /// Scatter about the integrated equation of motion.
    IntegratedLaw,
    /// Scatter of rates about the integrated equation of motion, autocorrelation considered.
    RatesAboutIntegratedLaw {
        /// Number.
        count: usize,
    },
    /// Output-error fit over all rows, autocorrelation considered.
    OutputError,
    /// J/K of an output-error fit.
    OutputErrorRatio,
    /// Covariance of the fitted parameters.
    CorrelatedParameters,
    /// A parameter of the fitted model.
    ModelFit,
    /// A parameter of the fitted model that acts through the ripple of the rate.
    ModelFitOnRipple,
}

/// Definition of a quantity, where its name is not sufficient.
#[derive(Debug, Clone, PartialEq)]
pub enum Meaning {
    /// Slope of the least-squares line over ± full scale.
    LineSlope,
    /// Output at rest, without the Earth's rotation along the axis.
    BiasWithoutEarthRate,
    /// Output at rest, with the Earth's rotation along the axis.
    BiasWithEarthRate,
    /// Greatest departure from the least-squares line.
    Nonlinearity,
    /// Coefficient of Ω² over the scale; contains g-sensitivity.
    Quadratic,
    /// Approached from below minus from above.
    Hysteresis,
    /// Slope at positive minus slope at negative rates.
    Asymmetry,
    /// Standard deviation of a repeated plateau.
    Repeatability,
    /// Slope of the integral over whole turns.
    WholeTurnScale {
        /// Greatest rate of the runs, rad/s.
        greatest_rad_s: f64,
    },
    /// Coefficient of one harmonic order of the encoder's error.
    EncoderHarmonic {
        /// Periods per turn.
        harmonic_order: usize,
    },
    /// Coefficient of order 1 by forces that grow with Ω².
    EncoderEccentricityByForce,
    /// Mean output at the beginning minus at the end of a log at rest.
    WarmUpChange {
        /// Duration of each mean, s.
        part_s: f64,
        /// Duration of the log, s.
        rest_s: f64,
        /// Time from power-on to the beginning of the log, s, where it is known.
        since_power_on_s: Option<f64>,
    },
    /// Time until the output at rest stays within a band about its final level.
    WarmUpTime {
        /// Half-width of the band, rad/s.
        band_rad_s: f64,
        /// Time constant of the warm-up, s.
        time_constant_s: f64,
        /// The time counts from power-on; otherwise from the beginning of the log.
        from_power_on: bool,
    },
    /// Standard deviation of the output at rest over re-initialisations of the device.
    TurnOnRepeatability {
        /// Number of starts.
        starts: usize,
    },
    /// Smallest Allan deviation at rest.
    InRunStability {
        /// Averaging time at which it is smallest, s.
        averaging_s: f64,
        /// Duration of the log, s.
        rest_s: f64,
    },
    /// Rates within ± this value are shown as rest.
    RateDeadBand,
    /// Smallest rate that one plateau distinguishes from rest.
    Threshold,
    /// −3 dB frequency.
    Bandwidth {
        /// Structure of the fitted transfer function.
        structure: Structure,
        /// Highest frequency that was run, Hz, where the bandwidth lies beyond.
        extrapolated_beyond_Hz: Option<f64>,
    },
    /// Transport delay, apart from the lag.
    Delay {
        /// Cutoff of the known low-pass, Hz.
        known_filter_Hz: Option<f64>,
    },
    /// Damping ratio of the pair of poles.
    Damping {
        /// Cutoff of the known low-pass, Hz.
        known_filter_Hz: Option<f64>,
    },
    /// Slope towards frequency zero by the sines.
    DynamicScale {
        /// Mean rate, rad/s.
        mean_rad_s: f64,
        /// Rate amplitude, rad/s.
        amplitude_rad_s: f64,
    },
    /// Temperature coefficient of the bias at rest.
    BiasTemperature,
    /// Relative temperature coefficient of the scale.
    ScaleTemperature,
    /// Amplitude over a turn on a tilted stand, per g across the axis.
    GSensitivityByTilt,
    /// By the centripetal acceleration at two radii.
    GSensitivityByRadius,
    /// Coefficient of Ω² extrapolated to radius zero.
    QuadraticAtAxis,
    /// Half the difference of both sides.
    CrossAxis,
    /// Half the sum of both sides.
    MountingError,
    /// Scale by the difference of two radii.
    ScaleByTwoRadii,
    /// Radius of the accelerometer's element at the first mounting.
    ElementRadius,
    /// Scale with the given radius.
    ScaleAtGivenRadius,
    /// Radius for a scale of 1.
    RadiusAtUnitScale,
    /// Scale of one axis of a unit turned by hand.
    HandScale,
    /// Output of one axis by the input of another, of a unit turned by hand.
    HandCrossAxis,
    /// K₀ of an accelerometer, by positions at rest.
    TumbleK0,
    /// K₁ of an accelerometer, by positions at rest.
    TumbleK1,
    /// K₂ of an accelerometer, by positions at rest.
    TumbleK2,
    /// Output per cube of the specific force.
    TumbleK3,
    /// Angle from outward to the sensor's x axis.
    MountingAngle,
    /// Bias with the gravity of a tilted stand removed by the angle.
    AccelerometerBias,
    /// Rate below which the accelerometer shows no rate.
    BlindRate {
        /// Length of a window, s.
        window_s: f64,
    },
    /// Deviation of the weighted combination of all rate readings from the encoder.
    CombinedRate,
    /// Parameter of the model by output error.
    OutputError,
    /// J R/(K² + R b).
    MechanicalTimeConstant,
    /// L/R.
    ElectricalTimeConstant,
    /// Inertia by a known added inertia.
    InertiaByAddedInertia,
    /// Coulomb friction over motor constant.
    NoLoadCurrent,
    /// Viscous friction over motor constant.
    CurrentPerRate,
    /// Part of the current that is equal in both directions.
    CurrentAsymmetry,
    /// Approached from slower minus from faster.
    CurrentHysteresis,
    /// Voltage at which the rate–voltage lines reach rest.
    VoltageDeadBand,
    /// Slope of the settled rate–voltage curve.
    RatePerVoltage,
    /// Viscous friction and braking over inertia.
    CoastDecay,
    /// Coulomb friction over inertia.
    CoastDeceleration,
    /// Inertia by the braking current of the shorted motor.
    InertiaByCoasting,
    /// −3 dB frequency from voltage to rate.
    DriveBandwidth,
    /// Torque of one harmonic order of the angle.
    HarmonicTorque {
        /// Periods per turn.
        harmonic_order: usize,
        /// Phase, rad.
        phase_rad: f64,
    },
}

/// Why a quantity was not found, and what a session needs to contain for it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum AbsenceReason {
    /// Three rates or more.
    NeedsThreeRates,
    /// Two plateaus of each sign.
    NeedsPlateausOfBothSigns,
    /// Plateaus approached from both sides.
    NeedsBothApproaches,
    /// Repeated plateaus.
    NeedsRepeatedPlateaus,
    /// Three complete runs of whole turns, of both signs.
    NeedsWholeTurns {
        /// Runs with lost rows.
        incomplete: usize,
    },
    /// Turns of both senses at different rates, with the index of the encoder.
    NeedsBothSensesAtRates,
    /// A log at rest.
    NeedsRest,
    /// `warm_up_band_rad_s` in the session.
    NeedsWarmUpBand,
    /// The output at rest is within the band from the beginning of the log.
    WithinBandFromTheBeginning {
        /// Half-width of the band, rad/s.
        band_rad_s: f64,
        /// Beginning of the log after power-on, s; 0 if it is not known.
        since_power_on_s: f64,
    },
    /// The warm-up is no exponential.
    NotExponential {
        /// Standard deviation of the residuals over parts of the log relative to white noise.
        ratio: f64,
    },
    /// Steps at rest after a start of the device.
    NeedsRestarts {
        /// Fewest.
        minimum: usize,
    },
    /// A staircase of small rates.
    NeedsSmallRates,
    /// Two small rates of each sign beyond the dead band.
    NeedsRatesBeyondDeadBand,
    /// Sines of three frequencies, or a chirp.
    NeedsSinesOrChirp,
    /// Nothing but the known low-pass of the chip is visible.
    OnlyKnownFilter {
        /// Highest frequency that was run, Hz.
        highest_Hz: f64,
        /// Cutoff of the low-pass, Hz.
        filter_Hz: f64,
    },
    /// The gain does not fall by 3 dB.
    #[serde(rename = "no-fall-by-3-db")]
    NoFallBy3dB {
        /// Highest frequency that was run, Hz.
        highest_Hz: f64,
    },
    /// A log at rest while the device under test warms.
    NeedsWarmingAtRest,
    /// Plateaus of both signs while the device under test warms.
    NeedsWarmingPlateaus,
    /// Whole turns on a tilted stand.
    NeedsTilt,
    /// The same staircase at a second radius.
    NeedsSecondRadius,
    /// Staircases with the device under test on both sides.
    NeedsBothSides,
    /// A step whose drive ends before the record.
    NeedsCoasting,
    /// The platform did not come to rest in the record.
    NotAtRestInRecord,
    /// A staircase in rate mode.
    NeedsRateStaircase,
    /// A staircase in voltage mode.
    NeedsVoltageStaircase,
    /// The plateaus do not separate Coulomb and viscous friction.
    FrictionNotSeparable,
    /// The platform hardly moved.
    HardlyMoved,
    /// A step in voltage mode with multi-step, prbs or multisine.
    NeedsExcitation,
    /// The fit of the model failed.
    FitFailed {
        /// The error of the fit.
        message: String,
    },
    /// The record does not determine the parameter.
    NotDetermined,
    /// The same step with a known added inertia.
    NeedsAddedInertia,
    /// The added inertia has no effect.
    AddedInertiaInvisible,
    /// A slow constant rate and the motor constant.
    NeedsSlowTurns,
    /// The slow turns lack angle or current.
    NeedsAngleAndCurrent,
    /// Fewer than three whole turns.
    TooFewTurns {
        /// Whole turns in the log.
        turns: usize,
    },
    /// No harmonic order exceeds the detection limit.
    NoHarmonic {
        /// Highest harmonic order searched.
        highest_order: usize,
        /// Detection limit, N m.
        limit_N_m: f64,
    },
    /// A chirp in voltage mode.
    NeedsVoltageChirp,
    /// The log has no rows.
    NoRows,
    /// The platform did not turn.
    DidNotTurn,
    /// The platform reversed or stopped.
    Reversed,
    /// The chirp is too short.
    ChirpTooShort,
    /// Voltage and angle do not separate the parameters.
    SweepNotSeparable,
    /// The gain does not fall.
    NoCorner,
}

/// A remark on the whole calibration.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Remark {
    /// The sequence of plateaus does not separate drift and scale.
    DriftNotSeparable,
    /// Runs of whole turns with lost rows were left out.
    IncompleteTurns {
        /// Runs left out.
        left_out: usize,
        /// Runs recorded.
        total: usize,
    },
    /// A step whose output is clipped was left out.
    Clipped {
        /// The step.
        step: String,
        /// Limit of the output, rad/s.
        limit_rad_s: f64,
        /// Rows at the limit.
        rows: usize,
    },
    /// A step whose rates exceed the full scale of the static characteristic was left out of the dynamic results.
    BeyondFullScale {
        /// The step.
        step: String,
        /// Greatest rate, rad/s.
        greatest_rad_s: f64,
        /// Full scale, rad/s.
        full_scale_rad_s: f64,
    },
    /// The frequency of the crystal was measured, and the logs were corrected.
    CrystalMeasured {
        /// Name of the clock reference.
        reference: String,
        /// Relative frequency error of the crystal, ppm.
        error_ppm: f64,
        /// Its expanded uncertainty, ppm.
        U_ppm: f64,
        /// Time with pulses, s.
        seconds: f64,
    },
    /// No pulse of the clock reference of the session came; it was not used.
    ReferenceWithoutPulses {
        /// Its name.
        reference: String,
    },
    /// The pulses of the clock reference cover too little of the recorded time; it was not used.
    ReferenceTooShort {
        /// Its name.
        reference: String,
        /// Time with pulses, s.
        seconds: f64,
        /// Recorded time, s.
        recorded_s: f64,
    },
    /// An accelerometer at a radius shows the square of the rate.
    SquareOfRate,
    /// Cogging of these harmonic orders is part of the fitted model.
    CoggingInModel {
        /// Periods per turn.
        harmonic_orders: Vec<usize>,
    },
    /// The fitted model leaves more than noise.
    Misfit {
        /// The step.
        step: String,
        /// Effects of the model.
        effects: Vec<&'static str>,
        /// Residual rms over noise.
        ratio: f64,
    },
    /// Commands that show what the model lacks.
    NextCommands {
        /// The log with the strongest excitation.
        log: String,
    },
    /// The index was not seen: the phases have an arbitrary zero.
    NoIndex,
}

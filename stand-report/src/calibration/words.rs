//! Words for the typed notes of a calibration.

use crate::{plain, significant, with_sigma};
use stand_analysis::calibrate::response::Structure;
use stand_analysis::calibrate::{AbsenceReason, Basis, CurveKind, Meaning, Remark, SeriesKind};

/// How a contribution was evaluated.
pub fn basis(basis: &Basis) -> String {
    match basis {
        Basis::Crystal { half_width_ppm } => format!("crystal, ± {half_width_ppm} ppm"),
        Basis::MeasuredCrystal { seconds, reference_ppm } => {
            format!("crystal, compared with the clock reference over {seconds:.0} s; reference ± {reference_ppm} ppm")
        }
        Basis::RadiusHalfWidth { half_width_m } => format!("half-width {half_width_m} m"),
        Basis::AssumedRadius { radius_m, half_width_m } => format!("assumed radius {radius_m} m, half-width {half_width_m} m"),
        Basis::AssumedScale { half_width_percent } => format!("assumed scale 1, half-width {half_width_percent} %"),
        Basis::ScaleByTwoRadii => "scale by two radii".into(),
        Basis::ReadingHalfWidth { half_width_percent } => format!("half-width {half_width_percent} % of the reading"),
        Basis::ThermometerHalfWidth { half_width_K } => format!("half-width {half_width_K} K over the range"),
        Basis::GravityHalfWidth { half_width_m_s2 } => format!("half-width {half_width_m_s2} m/s²"),
        Basis::TiltHalfWidth { half_width_deg } => format!("half-width {half_width_deg}°"),
        Basis::LevelForEarthRate { half_width_deg } => format!("level, half-width {half_width_deg}°: Earth rate along the axis"),
        Basis::LatitudeUnknown => "latitude not given".into(),
        Basis::Misalignment { half_width_deg } => {
            format!("cosine of up to {half_width_deg}° between sensitive axis and platform axis; its mean is corrected")
        }
        Basis::GSensitivityHalfWidth { half_width_deg_s_g } => {
            format!("output per acceleration across the axis, ± {half_width_deg_s_g} °/s/g")
        }
        Basis::ThermometerReading { half_width_K } => format!("half-width {half_width_K} K at the temperature of the value"),
        Basis::TurnHalfWidth { half_width_deg } => format!("half-width {half_width_deg}° of an angle turned by hand"),
        Basis::Positions { count } => format!("scatter of {count} positions"),
        Basis::TimeStampStep => "time stamps of the device in steps of 25 µs, from which the stand computes the age of a sample".into(),
        Basis::EncoderWithinTurn { amplitude_rad } => format!(
            "amplitude of up to {} µrad within a turn by the runs of both senses; plateaus of less than one turn",
            significant(1e6 * amplitude_rad, 2)
        ),
        Basis::LagBySenses => "lag of the device, by the difference of both senses of rotation".into(),
        Basis::EncoderQuantisation => "one count at each end of a plateau".into(),
        Basis::WindowScatter { window_s } => format!("scatter of windows of {} ms", window_s * 1e3),
        Basis::AllanFloor { averaging_s } => {
            format!("√2 times the smallest Allan deviation about the fit, at an averaging time of {} s", plain(*averaging_s, 2))
        }
        Basis::OneWindow => "scatter of one window".into(),
        Basis::OfStandardDeviation => "upper 97.5 % limit of a standard deviation (χ² distribution)".into(),
        Basis::TwoStandardDeviations => "two standard deviations of a plateau".into(),
        Basis::PlateausAboutCurve { count } => format!("scatter of {count} plateaus about the curve"),
        Basis::PlateausAboutTwoLines { count } => format!("scatter of {count} plateaus about two straight lines"),
        Basis::LinesMeetingAtRest => "scatter about two straight lines that meet at rest".into(),
        Basis::Plateaus { count } => format!("scatter of {count} plateaus"),
        Basis::DriftWithinPlateaus => "drift within the plateaus; the sequence of plateaus does not separate drift and rate".into(),
        Basis::WholeTurnRuns { count } => format!("scatter of {count} runs"),
        Basis::Turns { count } => format!("scatter of {count} turns"),
        Basis::TurnParts { count } => format!("scatter of {count} parts of turns"),
        Basis::Responses { count, ratio } => {
            format!("{count} frequencies; their scatter is {ratio:.2} × what their uncertainties predict")
        }
        Basis::QuadraticCoefficient => "coefficient of Ω² at this radius".into(),
        Basis::SlopeOverRate => "slope of the output over the rate".into(),
        Basis::MeansOverTemperature { count, range_K } => format!("{count} means over {range_K:.1} K"),
        Basis::IntegratedLaw => "scatter about the integrated equation of motion".into(),
        Basis::RatesAboutIntegratedLaw { count } => {
            format!("scatter of {count} rates about the integrated equation of motion, autocorrelation considered")
        }
        Basis::OutputError => "output error over all rows, autocorrelation considered".into(),
        Basis::OutputErrorRatio => "J/K by output error".into(),
        Basis::CorrelatedParameters => "uncertainties of the fitted parameters with their correlation".into(),
        Basis::ModelFit => "parameter of the fitted model".into(),
        Basis::ModelFitOnRipple => "parameter of the fitted model, acting through the ripple of the rate".into(),
    }
}

fn structure(structure: Structure) -> &'static str {
    match structure {
        Structure::DelayOnly => "delay only",
        Structure::FirstOrder => "first order with delay",
        Structure::SecondOrder => "second order with delay",
        Structure::ThirdOrder => "third order with delay",
    }
}

fn known_filter(cutoff_Hz: Option<f64>) -> String {
    cutoff_Hz.map_or(String::new(), |f| format!("; without the low-pass of the chip at {f:.0} Hz, which is taken as known"))
}

/// Meaning of a quantity.
pub fn meaning(meaning: &Meaning) -> String {
    match meaning {
        Meaning::LineSlope => "slope of the least-squares line over ± full scale".into(),
        Meaning::BiasWithoutEarthRate => "without the Earth rate along the axis".into(),
        Meaning::BiasWithEarthRate => "includes the Earth rate along the axis; known.latitude_deg removes it".into(),
        Meaning::Nonlinearity => {
            "greatest departure of the curve from its least-squares line, at one end of ± full scale; always positive, also for noise alone; at the axis: \
             the bound for g-sensitivity is in the budget"
                .into()
        }
        Meaning::Quadratic => {
            "includes g-sensitivity, because the centripetal acceleration is proportional to Ω²; a second radius separates both".into()
        }
        Meaning::Hysteresis => "approached from below minus from above".into(),
        Meaning::Asymmetry => {
            "slope at positive minus slope at negative rates, of two lines that meet at rest; at the axis: the bound for g-sensitivity is in the budget".into()
        }
        Meaning::Repeatability => "standard deviation of a repeated plateau".into(),
        Meaning::WholeTurnScale { greatest_rad_s } => format!(
            "by the integral over whole turns, independent of the plateaus: the mean scale over runs from rest to ± {} rad/s",
            plain(*greatest_rad_s, 3)
        ),
        Meaning::EncoderHarmonic { harmonic_order } => format!(
            "error of the stand's encoder (reading minus angle), harmonic order {harmonic_order}, angle from its zero; by closed turns of both senses"
        ),
        Meaning::EncoderEccentricityByForce => {
            "error of the stand's encoder (reading minus angle), harmonic order 1, angle from its zero; by forces that grow with the square of the rate and change within a turn, both senses"
                .into()
        }
        Meaning::WarmUpChange { part_s, rest_s, since_power_on_s } => format!(
            "mean of the first {} s minus mean of the last {} s of {rest_s:.0} s at rest{}",
            plain(*part_s, 3),
            plain(*part_s, 3),
            since_power_on_s.map_or(String::new(), |from| format!(", which begin {} s after power-on", plain(from, 3)))
        ),
        Meaning::WarmUpTime { band_rad_s, time_constant_s, from_power_on } => format!(
            "time from {} until the output at rest stays within ± {} rad/s about its final level; exponential, time constant {} s",
            if *from_power_on { "power-on" } else { "the beginning of the log" },
            significant(*band_rad_s, 2),
            plain(*time_constant_s, 3)
        ),
        Meaning::TurnOnRepeatability { starts } => {
            format!("standard deviation of the mean output at rest over {starts} re-initialisations (software reset and set-up; the supply stays on)")
        }
        Meaning::InRunStability { averaging_s, rest_s } => format!(
            "smallest Allan deviation of {rest_s:.0} s at rest, at an averaging time of {} s; an upper bound of the bias instability",
            plain(*averaging_s, 2)
        ),
        Meaning::RateDeadBand => "half-width: rates within ± this value give no output".into(),
        Meaning::Threshold => "smallest rate that one plateau distinguishes from rest".into(),
        Meaning::Bandwidth { structure: found, extrapolated_beyond_Hz } => {
            let extrapolated = extrapolated_beyond_Hz
                .map_or(String::new(), |f| format!("; extrapolated beyond {f:.0} Hz, the highest measured frequency"));
            format!("−3 dB frequency; {}{extrapolated}", structure(*found))
        }
        Meaning::Delay { known_filter_Hz } => {
            format!(
                "transport delay beside the lag; the age of the sample is subtracted where the log has it{}",
                known_filter(*known_filter_Hz)
            )
        }
        Meaning::Damping { known_filter_Hz } => format!("damping ratio of the pair of poles{}", known_filter(*known_filter_Hz)),
        Meaning::DynamicScale { mean_rad_s, amplitude_rad_s } => format!(
            "slope extrapolated to frequency zero for a sine of {} rad/s about {} rad/s; the slope of a nonlinear device depends on both",
            plain(*amplitude_rad_s, 3),
            plain(*mean_rad_s, 3)
        ),
        Meaning::BiasTemperature => "at rest while the device under test warms".into(),
        Meaning::ScaleTemperature => "relative change of the scale".into(),
        Meaning::GSensitivityByTilt => "amplitude over a turn on the tilted stand, per g across the axis".into(),
        Meaning::GSensitivityByRadius => "by the centripetal acceleration at two radii".into(),
        Meaning::QuadraticAtAxis => "coefficient of Ω² extrapolated to radius zero: without g-sensitivity".into(),
        Meaning::CrossAxis => "of the rate about the y axis of the device: half the difference of both sides".into(),
        Meaning::MountingError => "angle of the sensitive axis to the platform's plane: half the sum of both sides".into(),
        Meaning::ScaleByTwoRadii => "by the difference of two radii, independent of bias and absolute radius".into(),
        Meaning::ElementRadius => "radius of the sensing element at the first mounting".into(),
        Meaning::ScaleAtGivenRadius => "for the given radius; a second radius separates scale and radius".into(),
        Meaning::RadiusAtUnitScale => "for a scale of 1; a second radius separates scale and radius".into(),
        Meaning::HandScale => "by the integral over turns about this axis".into(),
        Meaning::HandCrossAxis => "output of this axis by the input of the other, per unit: scale times misalignment, rad".into(),
        Meaning::TumbleK0 => "output without specific force: K₀ K₁ of the model equation".into(),
        Meaning::TumbleK1 => "output per specific force".into(),
        Meaning::TumbleK2 => "output per square of the specific force".into(),
        Meaning::TumbleK3 => "output per cube of the specific force".into(),
        Meaning::MountingAngle => "from outward to the sensor's x axis, positive towards the motion".into(),
        Meaning::AccelerometerBias => "without the gravity of a tilted stand, which is periodic in the angle".into(),
        Meaning::BlindRate { window_s } => {
            format!("rate at which the error of a window of {} ms equals the rate; the sign of the rate is never visible", window_s * 1e3)
        }
        Meaning::CombinedRate => {
            "rms deviation from the encoder of the weighted mean of all other rate readings, over the plateaus of one run".into()
        }
        Meaning::OutputError => "by output error, as `stand fit`".into(),
        Meaning::MechanicalTimeConstant => "J R/(K² + R b)".into(),
        Meaning::ElectricalTimeConstant => "L/R".into(),
        Meaning::InertiaByAddedInertia => {
            "by the added inertia, which is taken as known; independent of the scales of voltage and current".into()
        }
        Meaning::NoLoadCurrent => "Coulomb friction over motor constant: the rate–torque curve towards rest".into(),
        Meaning::CurrentPerRate => "viscous friction over motor constant: slope of the rate–torque curve".into(),
        Meaning::CurrentAsymmetry => "equal in both directions: asymmetric friction, a load, or the offset of the current sensor".into(),
        Meaning::CurrentHysteresis => "approached from slower minus from faster: warming, or friction with memory".into(),
        Meaning::VoltageDeadBand => {
            "half-width: where the rate–voltage lines reach rest; resistance times no-load current, brushes and bridge".into()
        }
        Meaning::RatePerVoltage => "slope of the settled rate–voltage curve".into(),
        Meaning::CoastDecay => "viscous friction, and braking where the bridge shorts the motor, over inertia".into(),
        Meaning::CoastDeceleration => "Coulomb friction over inertia".into(),
        Meaning::InertiaByCoasting => "braking current of the shorted motor times motor constant, over the decay".into(),
        Meaning::DriveBandwidth => "−3 dB frequency from voltage to rate without reversal, first order: (K²/R + b)/(2π J)".into(),
        Meaning::HarmonicTorque { harmonic_order, phase_rad } => format!(
            "torque with {harmonic_order} periods per turn, phase {phase_rad:.3} rad; `stand explain` distinguishes cogging from torque ripple"
        ),
    }
}

/// Why a quantity was not found.
pub fn absence(reason: &AbsenceReason) -> String {
    match reason {
        AbsenceReason::NeedsThreeRates => "needs three rates or more".into(),
        AbsenceReason::NeedsPlateausOfBothSigns => "needs two plateaus of each sign".into(),
        AbsenceReason::NeedsBothApproaches => "needs plateaus approached from both sides (profile staircase)".into(),
        AbsenceReason::NeedsRepeatedPlateaus => "needs repeated plateaus: a longer staircase, or ABBA".into(),
        AbsenceReason::NeedsWholeTurns { incomplete } => {
            let lost = if *incomplete > 0 { format!("; {incomplete} had lost rows") } else { String::new() };
            format!("needs three complete runs of whole turns or more, of both signs (profile turns){lost}")
        }
        AbsenceReason::NeedsBothSensesAtRates => {
            "needs turns of both signs at different rates (profile staircase), with the index of the encoder".into()
        }
        AbsenceReason::NeedsWarmUpBand => {
            "needs warm_up_band_rad_s in the session: the band about the final output that ends the warm-up".into()
        }
        AbsenceReason::WithinBandFromTheBeginning { band_rad_s, since_power_on_s } => format!(
            "the output at rest is within ± {} rad/s from the beginning of the log, {} s after power-on",
            significant(*band_rad_s, 2),
            plain(*since_power_on_s, 3)
        ),
        AbsenceReason::NotExponential { ratio } => {
            format!("the warm-up is not exponential: the residuals over parts of the log are {ratio:.1} times those of white noise")
        }
        AbsenceReason::NeedsRestarts { minimum } => format!("needs {minimum} steps at rest with restart_sensor = true"),
        AbsenceReason::NeedsRest => "needs a log at rest of 7 s or more".into(),
        AbsenceReason::NeedsSmallRates => {
            "needs a staircase of small rates (below 5 % of the greatest) at which the platform turns evenly, with eight plateaus or more"
                .into()
        }
        AbsenceReason::NeedsRatesBeyondDeadBand => "needs small rates beyond the dead band, two or more of each sign".into(),
        AbsenceReason::NeedsSinesOrChirp => "needs sines of three frequencies or more, or a chirp (mode voltage)".into(),
        AbsenceReason::OnlyKnownFilter { highest_Hz, filter_Hz } => {
            format!("up to {highest_Hz:.0} Hz only the low-pass of the chip at {filter_Hz:.0} Hz is visible, which is taken as known")
        }
        AbsenceReason::NoFallBy3dB { highest_Hz } => {
            format!("the gain does not fall by 3 dB near {highest_Hz:.0} Hz, the highest measured frequency")
        }
        AbsenceReason::NeedsWarmingAtRest => {
            "needs a log at rest with the column sensor_C in which the device under test warms by 1 K or more".into()
        }
        AbsenceReason::NeedsWarmingPlateaus => {
            "needs plateaus of both signs with the column sensor_C while the device under test warms by 1 K or more".into()
        }
        AbsenceReason::NeedsTilt => "needs whole turns on a tilted stand (a step with tilt_deg)".into(),
        AbsenceReason::NeedsSecondRadius => "needs the same staircase at a second radius (a step with radius_m)".into(),
        AbsenceReason::NeedsBothSides => "needs a staircase with the device on each of its sides (steps with lying)".into(),
        AbsenceReason::NeedsCoasting => "needs a step whose drive ends before the record (drive_s)".into(),
        AbsenceReason::NotAtRestInRecord => "the platform did not come to rest in the record: drive it faster, or record longer".into(),
        AbsenceReason::NeedsRateStaircase => "needs a staircase in rate mode".into(),
        AbsenceReason::NeedsVoltageStaircase => "needs a staircase in voltage mode".into(),
        AbsenceReason::FrictionNotSeparable => "the plateaus of the staircase do not separate Coulomb and viscous friction".into(),
        AbsenceReason::HardlyMoved => "the platform hardly moved in the voltage staircase: increase its amplitude".into(),
        AbsenceReason::NeedsExcitation => "needs a step in voltage mode with the profile multi-step, prbs or multisine".into(),
        AbsenceReason::FitFailed { message } => message.clone(),
        AbsenceReason::NotDetermined => "not determined by this record".into(),
        AbsenceReason::NeedsAddedInertia => "needs the same step again with a known inertia on the platform (added_inertia_kg_m2)".into(),
        AbsenceReason::AddedInertiaInvisible => "the added inertia has no effect: is it on the platform?".into(),
        AbsenceReason::NeedsSlowTurns => "needs a slow constant rate over several turns, and the motor constant of the model".into(),
        AbsenceReason::NeedsAngleAndCurrent => "the log of the slow turns has no angle or no current".into(),
        AbsenceReason::TooFewTurns { turns } => format!("{turns} whole turns are too few: three or more are needed"),
        AbsenceReason::NoHarmonic { highest_order, limit_N_m } => {
            format!("no harmonic order up to {highest_order} exceeds the detection limit of {} N m", significant(*limit_N_m, 2))
        }
        AbsenceReason::NeedsVoltageChirp => "needs a chirp in voltage mode".into(),
        AbsenceReason::NoRows => "the log has no rows".into(),
        AbsenceReason::DidNotTurn => "the platform did not turn".into(),
        AbsenceReason::Reversed => {
            "the platform reversed or stopped, so Coulomb friction was not constant: make the offset larger than the amplitude".into()
        }
        AbsenceReason::ChirpTooShort => "the chirp is too short: make it longer".into(),
        AbsenceReason::SweepNotSeparable => "voltage and angle do not separate the parameters".into(),
        AbsenceReason::NoCorner => "the gain does not fall: begin the chirp at a lower frequency".into(),
    }
}

/// A remark on the whole calibration.
pub(super) fn remark(remark: &Remark) -> String {
    match remark {
        Remark::DriftNotSeparable => "The sequence of plateaus does not separate drift and scale; ABBA or a staircase does.".into(),
        Remark::IncompleteTurns { left_out, total } => {
            format!("{left_out} of {total} runs of whole turns have lost rows and are left out.")
        }
        Remark::Clipped { step, limit_rad_s, rows } => format!(
            "Step `{step}` is left out: the output of the device stays at its limit of {} rad/s in {rows} rows while the rate goes on.",
            plain(*limit_rad_s, 4)
        ),
        Remark::BeyondFullScale { step, greatest_rad_s, full_scale_rad_s } => format!(
            "Step `{step}` is left out of the dynamic results: its rates reach {} rad/s, beyond the full scale of {} rad/s of the static characteristic.",
            plain(*greatest_rad_s, 3),
            plain(*full_scale_rad_s, 3)
        ),
        Remark::CrystalMeasured { reference, error_ppm, U_ppm, seconds } => format!(
            "By the clock reference `{reference}` the crystal of the stand is off by {} ppm (U) over {seconds:.0} s; times and rates are corrected for it.",
            with_sigma(*error_ppm, *U_ppm)
        ),
        Remark::ReferenceWithoutPulses { reference } => format!(
            "The clock reference `{reference}` was not used, the bound of the crystal is in the budgets: the logs have no reading of it, or no pulse came; the input is PB10, docs/hardware.md."
        ),
        Remark::ReferenceTooShort { reference, seconds, recorded_s } => format!(
            "The clock reference `{reference}` was not used, the bound of the crystal is in the budgets: its pulses cover {seconds:.0} s of {recorded_s:.0} s; half of it and 10 s are needed."
        ),
        Remark::SquareOfRate => {
            "An accelerometer at a radius measures the square of the rate: no sign, and no sensitivity near rest.".into()
        }
        Remark::CoggingInModel { harmonic_orders } => {
            let orders: Vec<String> = harmonic_orders.iter().map(ToString::to_string).collect();
            format!("The fitted model contains cogging of harmonic order {}.", orders.join(", "))
        }
        Remark::Misfit { step, effects, ratio } => format!(
            "Step `{step}`: the residual of the model with {} is {} × the noise, so the model is incomplete and its parameters may be biased; \
             `stand explain` finds what is missing.",
            effects.join(", "),
            significant(*ratio, 3)
        ),
        Remark::NextCommands { log } => {
            format!("Next: `stand compare {log} --model M` and `stand explain {log} --model M` show what this model lacks.")
        }
        Remark::NoIndex => "The index was not seen: the phases of the harmonics have an arbitrary zero.".into(),
    }
}

/// Texts and style of a curve.
pub(super) struct CurveStyle {
    /// Title.
    pub title: &'static str,
    /// Label of the horizontal axis.
    pub x: &'static str,
    /// Label of the vertical axis.
    pub y: &'static str,
    /// Name of the main series.
    pub points: &'static str,
    /// Name of the line.
    pub line: &'static str,
    /// The horizontal axis is logarithmic.
    pub is_log: bool,
    /// The points are bars from zero.
    pub has_bars: bool,
}

/// Style of a linear plot of measured points.
const LINEAR: CurveStyle =
    CurveStyle { title: "", x: "", y: "", points: "measured", line: "by the result", is_log: false, has_bars: false };

const FREQUENCY: CurveStyle = CurveStyle { x: "frequency, Hz", is_log: true, ..LINEAR };

/// Texts and style of a curve.
pub(super) fn curve_style(kind: CurveKind) -> CurveStyle {
    match kind {
        CurveKind::LineDeparture => CurveStyle {
            title: "Static characteristic: departure from the straight line",
            x: "rate by the encoder, rad/s",
            y: "departure, % of full scale",
            ..LINEAR
        },
        CurveKind::SmallRates => {
            CurveStyle { title: "Small rates", x: "rate by the encoder, rad/s", y: "output minus output at rest, rad/s", ..LINEAR }
        }
        CurveKind::Gain => CurveStyle { title: "Gain against the encoder", y: "output over rate", ..FREQUENCY },
        CurveKind::Phase => CurveStyle { title: "Phase against the encoder", y: "phase, °", ..FREQUENCY },
        CurveKind::Coherence => {
            CurveStyle { title: "Coherence", y: "fraction of the power that correlates with the platform", ..FREQUENCY }
        }
        CurveKind::RateReadings => CurveStyle {
            title: "Deviation of all rate readings from the encoder",
            x: "rate by the encoder, rad/s",
            y: "reading minus encoder, rad/s",
            points: "weighted mean",
            ..LINEAR
        },
        CurveKind::RateTorque => CurveStyle {
            title: "Rate–torque: current at constant rate",
            x: "rate, rad/s",
            y: "current, A",
            points: "approached from a slower rate",
            ..LINEAR
        },
        CurveKind::RateVoltage => {
            CurveStyle { title: "Rate–voltage", x: "voltage, V", y: "rate, rad/s", points: "approached from below", ..LINEAR }
        }
        CurveKind::TorqueSpectrum => CurveStyle {
            title: "Torque by harmonic order",
            x: "harmonic order, per turn",
            y: "amplitude, N m",
            line: "detection limit",
            has_bars: true,
            ..LINEAR
        },
        CurveKind::DriveGain => CurveStyle { title: "Frequency response, voltage to rate: gain", y: "gain, dB re 1 rad/s/V", ..FREQUENCY },
        CurveKind::DrivePhase => CurveStyle { title: "Frequency response, voltage to rate: phase", y: "phase, °", ..FREQUENCY },
    }
}

/// Name of a series of points.
pub(super) fn series(kind: SeriesKind) -> &'static str {
    match kind {
        SeriesKind::FromFasterRate => "approached from a faster rate",
        SeriesKind::FromAbove => "approached from above",
        SeriesKind::RateGyro => "rate gyro",
        SeriesKind::Accelerometer => "accelerometer (sign by the encoder)",
        SeriesKind::BackEmf => "back-EMF",
    }
}

/// Degrees of freedom; ∞ where their number does not matter.
pub(super) fn degrees_of_freedom(dof: f64) -> String {
    if dof < MANY_DOF { format!("{:.0}", dof.floor()) } else { "∞".into() }
}

/// Degrees of freedom from which Student's distribution is shown as the normal one.
pub(super) const MANY_DOF: f64 = 1e4;

/// Coverage factor with the digits that matter.
pub(super) fn coverage_factor(k: f64) -> String {
    plain(k, 3)
}

//! `stand observer simulate`.

use std::path::PathBuf;

use clap::Args;

use super::options::{DesignOptions, ElementOptions, ObserverKind};
use crate::error::CliError;
use crate::output::{Overwrite, ReportOutput};
use stand_analysis::observer::moment::{Harmonic, Moment, Random};
use stand_analysis::observer::recorded::{RecordError, simulate_log};
use stand_analysis::observer::side_by_side::{ClosedLoop, simulate};
use stand_analysis::observer::{Disturbance, Regulator, SideBySide};
use stand_report::observer::{simulate_html, simulate_json, simulate_text};

/// Simulate a static and an astatic observer side by side.
#[derive(Debug, Args)]
pub(crate) struct Simulate {
    #[command(flatten)]
    element: ElementOptions,
    #[command(flatten)]
    design: DesignOptions,
    /// Initial error of the estimated angle, rad
    #[arg(long, value_name = "RAD", default_value_t = 1e-2, allow_negative_numbers = true)]
    angle: f64,
    /// Constant moment from t = 0, N m
    #[arg(long, value_name = "N_M", default_value_t = 1e-5, allow_negative_numbers = true)]
    moment: f64,
    /// Harmonic moment in addition: amplitude, N m, and frequency, Hz
    #[arg(long, value_name = "N_M,HZ", value_delimiter = ',', allow_negative_numbers = true)]
    moment_harmonic: Vec<f64>,
    /// Random moment in addition: standard deviation, N m, and correlation time, s
    #[arg(long, value_name = "N_M,S", value_delimiter = ',', allow_negative_numbers = true)]
    moment_random: Vec<f64>,
    /// Seed of the random moment and of the noise of --out
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Duration of the simulation, s
    #[arg(long, value_name = "S", default_value_t = 3.0, allow_negative_numbers = true)]
    seconds: f64,
    /// Step of the output, s
    #[arg(long, value_name = "S", default_value_t = 1e-3, allow_negative_numbers = true)]
    step: f64,
    /// Regulator gain of the angle, N m/rad
    #[arg(long, value_name = "R1", default_value_t = 1e-2, allow_negative_numbers = true)]
    regulator_angle: f64,
    /// Regulator gain of the rate, N m s/rad
    #[arg(long, value_name = "R2", default_value_t = 6.5e-2, allow_negative_numbers = true)]
    regulator_rate: f64,
    /// Duration of the closed-loop simulation, s
    #[arg(long, value_name = "S", default_value_t = 40.0, allow_negative_numbers = true)]
    loop_seconds: f64,
    /// Write a log of the element under this angle and moment, for `stand observer track`: the angle sensor, the true states and the true
    /// moment
    #[arg(long, value_name = "LOG")]
    out: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    output: ReportOutput,
}

impl From<RecordError> for CliError {
    fn from(error: RecordError) -> Self {
        match error {
            RecordError::OutOfRange { .. } => CliError::Input(format!("--out: {error}")),
            RecordError::Log(error) => error.into(),
        }
    }
}

impl Simulate {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.check_values()?;
        if let Some(out) = &self.out {
            self.overwrite.check(out)?;
        }
        let plant = self.element.plant()?;
        let static_options = DesignOptions { kind: None, row: None, integral_gain: None, ..self.design.clone() };
        let fixed = static_options.request(plant.clone(), Some(ObserverKind::Static), None)?.design()?;
        if self.design.kind == Some(ObserverKind::Static) {
            return Err(CliError::Input(
                "--kind static: the second observer must be astatic; give --kind integral or augmented".to_owned(),
            ));
        }
        let astatic = self.design.request(plant, Some(ObserverKind::Integral), None)?.design()?;
        let disturbed = Disturbance { angle_rad: self.angle, moment: self.disturbing_moment()? };
        let regulator = Regulator { angle_N_m_rad: self.regulator_angle, rate_N_m_s_rad: self.regulator_rate };
        let closed_loop = ClosedLoop { regulator, seconds: self.loop_seconds };
        let run = |design| simulate(design, disturbed, self.seconds, self.step, closed_loop);
        let (first, second) = (run(&fixed)?, run(&astatic)?);
        if let Some(out) = &self.out {
            simulate_log(&fixed.request.plant, disturbed, self.seconds, self.step, self.seed, out)?;
        }
        let beside = SideBySide { designs: [&fixed, &astatic], runs: [&first, &second], disturbed };
        self.output.text(&simulate_text(&beside))?;
        self.output.json(|| simulate_json(&beside))?;
        self.output.html(|| simulate_html(&beside))
    }

    fn disturbing_moment(&self) -> Result<Moment, CliError> {
        let positive = |name: &str, value: f64| {
            let is_valid = value.is_finite() && value > 0.0;
            is_valid.then_some(value).ok_or_else(|| CliError::Input(format!("{name} {value}: must be above 0")))
        };
        let two = |name: &str, numbers: &[f64]| match numbers {
            [] => Ok(None),
            [first, second] => Ok(Some((positive(name, *first)?, positive(name, *second)?))),
            _ => Err(CliError::Input(format!("{name}: give two numbers, separated by a comma"))),
        };
        let harmonic = two("--moment-harmonic", &self.moment_harmonic)?;
        let random = two("--moment-random", &self.moment_random)?;
        if let Some((_, frequency_Hz)) = harmonic
            && frequency_Hz * self.step > 0.1
        {
            return Err(CliError::Input(format!(
                "--moment-harmonic: {frequency_Hz} Hz needs a --step below {} s, ten steps of a period",
                0.1 / frequency_Hz
            )));
        }
        Ok(Moment {
            constant_N_m: self.moment,
            harmonic: harmonic.map(|(amplitude_N_m, frequency_Hz)| Harmonic { amplitude_N_m, frequency_Hz }),
            random: random.map(|(sigma_N_m, correlation_s)| Random { sigma_N_m, correlation_s, seed: self.seed }),
        })
    }

    fn check_values(&self) -> Result<(), CliError> {
        let numbers = [
            ("--angle", self.angle),
            ("--moment", self.moment),
            ("--regulator-angle", self.regulator_angle),
            ("--regulator-rate", self.regulator_rate),
        ];
        for (name, value) in numbers {
            if !value.is_finite() {
                return Err(CliError::Input(format!("{name} {value} is not a finite number")));
            }
        }
        let times = [("--seconds", self.seconds, 1e-3), ("--step", self.step, 1e-6), ("--loop-seconds", self.loop_seconds, 1.0)];
        for (name, value, least) in times {
            if !(value >= least && value <= 1e5) {
                return Err(CliError::Input(format!("{name} {value} s is out of range: {least} to 100000 s")));
            }
        }
        if self.seconds / self.step > 1e6 {
            return Err(CliError::Input(format!("{} s with a step of {} s give more than a million rows", self.seconds, self.step)));
        }
        Ok(())
    }
}

//! `stand observer simulate`.

use clap::Args;

use super::{ElementWords, KindWord, Placing};
use crate::command::error::CliError;
use crate::command::output::ReportOutput;
use crate::observer::{Disturbance, ObserverError, Regulator, SideBySide, Start};
use crate::report::observer::{simulate_html, simulate_json, simulate_text};

/// Steps of the closed loop's picture.
const LOOP_STEPS: f64 = 4000.0;

/// A static observer beside an astatic one.
#[derive(Debug, Args)]
pub(in crate::command) struct Simulate {
    #[command(flatten)]
    element: ElementWords,
    #[command(flatten)]
    placing: Placing,
    /// Error of the estimated angle at first, rad
    #[arg(long, value_name = "RAD", default_value_t = 1e-2, allow_negative_numbers = true)]
    angle: f64,
    /// Constant moment from t = 0 on, N m
    #[arg(long, value_name = "N_M", default_value_t = 1e-5, allow_negative_numbers = true)]
    moment: f64,
    /// How long, s
    #[arg(long, value_name = "S", default_value_t = 3.0, allow_negative_numbers = true)]
    seconds: f64,
    /// Between rows, s
    #[arg(long, value_name = "S", default_value_t = 1e-3, allow_negative_numbers = true)]
    step: f64,
    /// Gain of the regulator from the angle, N m/rad
    #[arg(long, value_name = "R1", default_value_t = 1e-2, allow_negative_numbers = true)]
    regulator_angle: f64,
    /// Gain of the regulator from the rate, N m s/rad
    #[arg(long, value_name = "R2", default_value_t = 6.5e-2, allow_negative_numbers = true)]
    regulator_rate: f64,
    /// How long the closed loop is followed, s
    #[arg(long, value_name = "S", default_value_t = 40.0, allow_negative_numbers = true)]
    loop_seconds: f64,
    #[command(flatten)]
    output: ReportOutput,
}

impl Simulate {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        self.sensible()?;
        let plant = self.element.plant()?;
        let still = Placing { kind: None, row: None, integral_gain: None, ..self.placing.clone() };
        let fixed = still.request(plant.clone(), Some(KindWord::Static), None)?.design()?;
        if self.placing.kind == Some(KindWord::Static) {
            return Err(CliError::Input(
                "simulate puts the static observer beside an astatic one: --kind integral or augmented".to_owned(),
            ));
        }
        let astatic = self.placing.request(plant, Some(KindWord::Integral), None)?.design()?;
        let disturbed = Disturbance { angle_rad: self.angle, moment_N_m: self.moment };
        let regulated = Regulator { angle_N_m_rad: self.regulator_angle, rate_N_m_s_rad: self.regulator_rate };
        let runs = [&fixed, &astatic].map(|design| {
            let mut run = design.simulate(disturbed, self.seconds, self.step);
            // The observer begins at the angle it sees; the loop is closed once it has settled.
            let closed_from_s = run.settled_s.unwrap_or(0.5).max(0.5);
            let start = Start { angle_rad: 0.0, moment_N_m: self.moment, closed_from_s };
            let (t_s, angles, rest) = design.regulate(regulated, start, self.loop_seconds, self.loop_seconds / LOOP_STEPS);
            run.closed = Some((t_s, angles));
            run.closed_loop_steady_rad = Some(rest);
            run
        });
        let beside = SideBySide { designs: [&fixed, &astatic], runs: [&runs[0], &runs[1]], disturbed };
        self.output.text(&simulate_text(&beside))?;
        self.output.json(|| simulate_json(&beside))?;
        self.output.html(|| simulate_html(&beside))
    }

    fn sensible(&self) -> Result<(), ObserverError> {
        let numbers = [
            ("--angle", self.angle),
            ("--moment", self.moment),
            ("--regulator-angle", self.regulator_angle),
            ("--regulator-rate", self.regulator_rate),
        ];
        for (name, value) in numbers {
            if !value.is_finite() {
                return Err(ObserverError::Option(format!("{name} {value} is not a finite number")));
            }
        }
        let times = [("--seconds", self.seconds, 1e-3), ("--step", self.step, 1e-6), ("--loop-seconds", self.loop_seconds, 1.0)];
        for (name, value, least) in times {
            if !(value >= least && value <= 1e5) {
                return Err(ObserverError::Option(format!("{name} {value} s is out of range: {least} to 100000 s")));
            }
        }
        if self.seconds / self.step > 1e6 {
            return Err(ObserverError::Option(format!("{} s with a step of {} s give more than a million rows", self.seconds, self.step)));
        }
        Ok(())
    }
}

//! `stand observer design --port`: the numbers go into a stand, by console commands that it checks.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use stand_firmware::gyro_loop::observer::MAX_STATES;

use crate::acquire::link::SerialLink;
use crate::command::error::CliError;
use crate::observer::{Design, Disturbance};

/// How long the stand may take to look at the poles.
const CHECK: Duration = Duration::from_secs(3);

/// Where a design is written, and what the stand makes of its estimates.
#[derive(Debug, Args)]
pub(super) struct Target {
    /// The serial port of a stand, into which it is written and where it is switched on
    #[arg(long, value_name = "P")]
    pub(super) port: Option<PathBuf>,
    /// With --port: it is kept in the stand's flash, too
    #[arg(long, requires = "port")]
    save: bool,
    /// With --port: moment of the gyro's torquer per current, N m/A
    #[arg(long, requires = "port", value_name = "N_M_A", default_value_t = 0.05, allow_negative_numbers = true)]
    torquer: f64,
    /// With --port: gains of the regulator, one for each state from the first, N m; an estimated moment is fed forward whole
    #[arg(long, requires = "port", value_name = "R1,R2,…", value_delimiter = ',', allow_negative_numbers = true)]
    regulator: Vec<f64>,
}

impl Target {
    /// Writes it; says what the stand says of it then.
    pub(super) fn write(&self, design: &Design, port: &Path) -> Result<String, CliError> {
        let input = |says: String| Err(CliError::Input(says));
        let Some(discrete) = &design.discrete else { return input("there is no discrete form to write".to_owned()) };
        // The stand's rows are a millisecond apart, and so are its observer's steps.
        if (discrete.step_s - super::design::ROW_S).abs() > 1e-12 {
            return input(format!(
                "--port: the stand's rows come each {} s; a design for {} s does not fit",
                super::design::ROW_S,
                discrete.step_s
            ));
        }
        let states = discrete.gains.len();
        let of_plant = design.gains.len();
        if self.regulator.len() > of_plant {
            return input(format!("--regulator: {} gains for {of_plant} states", self.regulator.len()));
        }
        if states > MAX_STATES || !(self.torquer.is_finite() && self.torquer > 0.0) {
            return input(format!("--torquer {}: must be above 0 N m/A", self.torquer));
        }
        let mut regulator = self.regulator.clone();
        regulator.resize(states, 0.0);
        if discrete.has_disturbance {
            regulator[of_plant] = 1.0;
        }
        let list = |numbers: &[f64]| numbers.iter().map(|number| format!("{number:e}")).collect::<Vec<_>>().join(",");
        // Until an error of the start is down to a hundredth, and half a second at least.
        let run = design.simulate(Disturbance { angle_rad: 1e-3, moment_N_m: 0.0 }, 5.0, 5e-3);
        let settle_s = run.settled_s.unwrap_or(5.0).max(0.5);
        let mut orders = vec![format!("OBServer:NEW {states},{}", if discrete.has_disturbance { "ON" } else { "OFF" })];
        orders.extend(discrete.phi.iter().enumerate().map(|(row, numbers)| format!("OBServer:PHI {},{}", row + 1, list(numbers))));
        orders.push(format!("OBServer:GAMMa {}", list(&discrete.gamma)));
        orders.push(format!("OBServer:GAIN {}", list(&discrete.gains)));
        orders.push(format!("OBServer:REGulator {}", list(&regulator)));
        orders.push(format!("OBServer:TORQuer {:e}", self.torquer));
        orders.push(format!("OBServer:SETTle {settle_s:e}"));
        orders.push("OBServer:STATe ON".to_owned());
        let mut link = SerialLink::open(port)?;
        orders.iter().try_for_each(|order| link.command(order))?;
        let until = Instant::now() + CHECK;
        let phase = loop {
            let phase = link.query("OBServer:PHASe?")?;
            if phase != "CHECKING" || Instant::now() > until {
                break phase;
            }
            std::thread::sleep(Duration::from_millis(50));
        };
        if phase == "OFF" {
            return input(format!("{}: the stand refuses the gains at its step; it is off: SYSTem:ERRor? says why", link.name()));
        }
        if self.save {
            link.command("SETTings:SAVE")?;
        }
        let kept = if self.save { " and saved" } else { "; SETTings:SAVE keeps it" };
        Ok(format!("\n{}: the observer is on ({phase}){kept}\n", link.name()))
    }
}

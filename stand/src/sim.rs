//! `stand sim`: the firmware on the simulated stand, or the flashed image on the emulated chip, as a log in virtual time or as a serial
//! port in real time.

use std::path::{Path, PathBuf};

use chip_sim::board::Board;
use chip_sim::machine::Machine;
use clap::Args;
use embassy_futures::block_on;
use hal_sim::element::BaseVibration;
use hal_sim::plant::{self, Stand};
use hal_sim::session::SessionRequest;
use stand_firmware::telemetry::Channels;

use super::error::CliError;
use super::output::{JsonOutput, Overwrite, progress_bar};
use super::profile::{self, ProfileOptions};
use super::record::{ProgressMonitor, check_recorded_seconds};
use super::signals::Interrupts;
use super::sim_serve::{ServeOptions, ServedInterface, read_image, serve};
use super::stand_file::{DriveMode, hide_effect, read_stand};
use identification::log::{Note, Notes};
use stand_acquire::connection::{SimulatedConnection, StandConnection};
use stand_acquire::hidden::HiddenEffect;
use stand_acquire::profile_recording::{ProfileRecordingRequest, early_end, record_profile};
use stand_acquire::recording::RecordingEnd;
use stand_acquire::simulation::{LogSummary, SimulationError, simulate_to_file};
use stand_acquire::three_axis_simulation::{self, Platform, PlatformSimulationError};
use stand_acquire::vibration_simulation::{VibrationSimulation, VibrationSimulationError};
use stand_analysis::observer::vibration::predicted_rad;
use stand_analysis::observer::{Element, Plant};
use stand_report::simulation as report;

/// Simulate the stand with its firmware and write a log, or serve it as a serial port.
#[derive(Debug, Args)]
#[command(after_help = profile::list(), group = clap::ArgGroup::new("what").required(true).args(["out", "serve"]))]
pub(super) struct Sim {
    /// Log to write, .csv or .parquet
    #[arg(long, value_name = "LOG")]
    out: Option<PathBuf>,
    /// Serve the stand in real time instead, and print its port: `pty`, a serial port for any program, or `tcp:PORT`, raw SCPI on this
    /// computer (0: a free port)
    #[arg(long, value_name = "pty|tcp:PORT", conflicts_with_all = ["profile", "mode", "amplitude", "json"])]
    serve: Option<ServedInterface>,
    /// Emulate the chip, which executes the flashed image, and record from its serial line; ELF file, default: the one that
    /// scripts/build-firmware.sh has built
    #[arg(long, value_name = "ELF", conflicts_with = "gyro", num_args = 0..=1)]
    chip: Option<Option<PathBuf>>,
    /// Symbolic link to the served port
    #[arg(long, value_name = "PATH", requires = "serve", conflicts_with = "out")]
    link: Option<PathBuf>,
    /// File with the flash contents of the served stand; read at the start, written at the end
    #[arg(long, value_name = "FILE", requires = "serve", conflicts_with = "out")]
    flash: Option<PathBuf>,
    /// Connect a simulated gyroscope to the torquer and angle sensor of the served stand; parameters from a TOML file, default 1.5 °/h
    /// drift at 70° north. With --vibration: the sensitive element, a preset or a .toml file with [four_state], default rate-observer. With
    /// --axes 3: the platform, a .toml file with [site], [own], [sensor] and three [[torquer]]
    #[arg(long, value_name = "FILE", num_args = 0..=1)]
    gyro: Option<Option<PathBuf>>,
    /// Write a log of the gyroscope's sensitive element on a vibrating base instead: amplitude in g, frequency, direction from the rotor's
    /// axis, and phase of the part across it
    #[arg(long, value_name = "G,HZ[,DEG[,DEG]]", requires_all = ["gyro", "out"], conflicts_with_all = ["serve", "profile", "mode", "amplitude", "hidden", "stand"])]
    vibration: Option<BaseVibrationOption>,
    /// Write the log of a drift session of a three-axis platform instead, for `stand drift compute`: two positions in the order A B B A,
    /// twice, pulses on all axes at once. The only number is 3
    #[arg(long, value_name = "3", value_parser = clap::value_parser!(u8).range(3..=3), requires_all = ["gyro", "out"], conflicts_with_all = ["serve", "profile", "mode", "amplitude", "hidden", "stand", "seconds", "vibration"])]
    axes: Option<u8>,
    #[command(flatten)]
    profile: ProfileOptions,
    /// Multiple of real time at which the served stand runs, 0.1 to 5: timeouts and the rate of the line scale with it
    #[arg(long, value_name = "FACTOR", requires = "serve", conflicts_with = "out", default_value_t = 1.0, hide_default_value = true)]
    speed: f64,
    /// Duration of the log, s [default: 30]; of a served stand: time until it ends [default: until Ctrl-C]
    #[arg(long, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Control of the drive: the profile is a rate setpoint or a voltage
    #[arg(long, value_enum, default_value_t = DriveMode::Rate)]
    mode: DriveMode,
    /// Add an effect to the stand that its model lacks: an effect of the catalogue, or a seed that draws one
    #[arg(long, value_name = "SEED|EFFECT", allow_negative_numbers = true)]
    hidden: Option<String>,
    /// Print the hidden effect and its parameters
    #[arg(long)]
    reveal: bool,
    /// Description of the simulated stand, TOML; without it the default stand
    #[arg(long, value_name = "FILE")]
    stand: Option<PathBuf>,
    /// Seed of the profile and of the sensor noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    json: JsonOutput,
}

/// Sensitive element without a file.
const DEFAULT_ELEMENT: &str = "rate-observer";
/// Ranges of the option `--vibration`: amplitude, g, and frequency, Hz, ten rows of a period at most.
const VIBRATION_G: (f64, f64) = (1e-9, 0.1);
const VIBRATION_HZ: (f64, f64) = (0.01, 100.0);
/// Direction of the vibration without a third number, degrees.
const VIBRATION_DIRECTION_DEG: f64 = 45.0;

/// Vibration of the base, from the command line.
#[derive(Debug, Clone, Copy, PartialEq)]
struct BaseVibrationOption(BaseVibration);

impl std::str::FromStr for BaseVibrationOption {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |field: &str| field.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
        let numbers = numbers
            .filter(|numbers| (2..=4).contains(&numbers.len()))
            .ok_or("must be two to four numbers, for example 1e-3,2 or 1e-3,2,45,0")?;
        let within = |name: &str, value: f64, (least, most): (f64, f64)| {
            let is_valid = (least..=most).contains(&value);
            is_valid.then_some(value).ok_or_else(|| format!("{name} {value} is out of range: {least} to {most}"))
        };
        let angle = |k: usize, default: f64| numbers.get(k).copied().unwrap_or(default).to_radians();
        Ok(Self(BaseVibration {
            overload_g: within("amplitude in g", numbers[0], VIBRATION_G)?,
            rate_rad_s: std::f64::consts::TAU * within("frequency in Hz", numbers[1], VIBRATION_HZ)?,
            direction_rad: angle(2, VIBRATION_DIRECTION_DEG),
            phase_rad: angle(3, 0.0),
        }))
    }
}

impl From<VibrationSimulationError> for CliError {
    fn from(error: VibrationSimulationError) -> Self {
        match error {
            VibrationSimulationError::OutOfRange { .. } => CliError::Input(format!("--vibration: {error}")),
            VibrationSimulationError::Interrupted => CliError::Other(error.to_string()),
            VibrationSimulationError::Log(error) => error.into(),
        }
    }
}

impl From<PlatformSimulationError> for CliError {
    fn from(error: PlatformSimulationError) -> Self {
        match error {
            PlatformSimulationError::Interrupted => CliError::Other(error.to_string()),
            PlatformSimulationError::Log(error) => error.into(),
        }
    }
}

/// Default duration of a log, s.
const DEFAULT_SECONDS: f64 = 30.0;
/// Time from the emulated chip's power-on to the first command, s.
const CHIP_START_S: f64 = 0.3;

impl From<SimulationError> for CliError {
    fn from(error: SimulationError) -> Self {
        match error {
            SimulationError::Session(error) => error.into(),
            SimulationError::Stand(error) => error.into(),
            SimulationError::Log(error) => error.into(),
        }
    }
}

impl Sim {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        if let (Some(out), Some(vibration)) = (&self.out, self.vibration) {
            return self.simulate_vibration(out, vibration);
        }
        if let (Some(out), Some(_)) = (&self.out, self.axes) {
            return self.simulate_platform(out);
        }
        if self.gyro.is_some() && self.serve.is_none() {
            let words =
                "--gyro: give --serve, or --vibration for a log on a vibrating base, or --axes 3 for a log of a three-axis platform";
            return Err(CliError::Input(words.to_owned()));
        }
        let Some(out) = &self.out else {
            return serve(ServeOptions {
                interface: self.serve.unwrap_or(ServedInterface::Pty),
                chip: self.chip.as_ref().map(|file| file.as_deref()),
                link: self.link.as_deref(),
                flash: self.flash.as_deref(),
                gyroscope: self.gyro.as_ref().map(|file| file.as_deref()),
                speed: self.speed,
                seconds: self.seconds,
                hidden: self.hidden.as_deref(),
                reveal: self.reveal,
                stand: self.stand.as_deref(),
                seed: self.seed,
            });
        };
        self.overwrite.check(out)?;
        let mut stand = read_stand(self.stand.as_deref())?;
        // Refuses an unknown ending of the file name before the simulation runs.
        identification::log::Format::of(out)?;
        let hidden = hide_effect(self.hidden.as_deref(), &mut stand)?;
        let mode = self.mode.firmware_mode();
        let profile = self.profile.config(mode, self.seed)?;
        let seconds = self.seconds.unwrap_or(DEFAULT_SECONDS);
        if let Some(image) = &self.chip {
            return self.record_chip(
                image.as_deref(),
                &stand,
                hidden.as_ref(),
                &ProfileRecordingRequest {
                    mode,
                    profile,
                    seconds,
                    decimation: 1,
                    // As in the log of the simulated stand, which begins at the index.
                    find_index: true,
                    additional_channels: Channels::default(),
                    notes: Notes::from_iter([Note::Stand(stand.name.clone()), Note::SupplyNominal(stand.drive.supply_V)]),
                    path: out,
                },
            );
        }
        let request = SessionRequest { mode, profile, seconds, seed: self.seed };
        let interrupts = Interrupts::install()?;
        let bar = progress_bar((seconds * 1e3) as u64, "simulating {wide_bar} {percent} %, {eta} left");
        let log = simulate_to_file(&stand, request, out, |t_s| {
            bar.set_position((t_s * 1e3) as u64);
            !interrupts.any()
        });
        bar.finish_and_clear();
        let log = log?;
        self.json.text(&report::text(&log, hidden.as_ref(), self.reveal))?;
        self.json.json(|| report::json(&log, hidden.as_ref(), self.reveal))?;
        match log.notes.text("ended") {
            Some(ended) => Err(CliError::Other(format!("ended {ended}; the rows until then are in {}", out.display()))),
            None => Ok(()),
        }
    }

    /// Writes a log of a sensitive element on a vibrating base.
    fn simulate_vibration(&self, out: &Path, option: BaseVibrationOption) -> Result<(), CliError> {
        self.overwrite.check(out)?;
        let seconds = self.seconds.unwrap_or(DEFAULT_SECONDS);
        check_recorded_seconds(seconds)?;
        let name = match &self.gyro {
            Some(Some(file)) => file.to_str().ok_or_else(|| CliError::Input(format!("--gyro: {} is not UTF-8", file.display())))?,
            _ => DEFAULT_ELEMENT,
        };
        let Element::Four(element) = Plant::named(name)?.element else {
            return Err(CliError::Input(format!("--gyro {name}: a log under vibration needs an element with four states ([four_state])")));
        };
        let BaseVibrationOption(vibration) = option;
        let part_rad = predicted_rad(&element, &vibration);
        let simulation = VibrationSimulation { element, vibration, start_rad: part_rad, seconds, seed: self.seed };
        let interrupts = Interrupts::install()?;
        let bar = progress_bar((seconds * 1e3) as u64, "simulating {wide_bar} {percent} %, {eta} left");
        let log = simulation.write(out, |t_s| {
            bar.set_position((t_s * 1e3) as u64);
            !interrupts.any()
        });
        bar.finish_and_clear();
        let log = LogSummary::from(&log?);
        self.json.text(&format!("{}{}", report::text(&log, None, false), report::vibration_text(part_rad)))?;
        self.json.json(|| report::json(&log, None, false))
    }

    /// Writes the log of a drift session of a three-axis platform.
    fn simulate_platform(&self, out: &Path) -> Result<(), CliError> {
        self.overwrite.check(out)?;
        let platform = match &self.gyro {
            Some(Some(file)) => {
                let text = std::fs::read_to_string(file).map_err(|e| CliError::file(file, "read", &e))?;
                Platform::read(&text).map_err(|e| CliError::in_file(file, e))?
            }
            _ => Platform::default(),
        };
        let interrupts = Interrupts::install()?;
        let bar = progress_bar((three_axis_simulation::duration_s() * 1e3) as u64, "simulating {wide_bar} {percent} %, {eta} left");
        let written = three_axis_simulation::write(&platform, self.seed, out, |t_s| {
            bar.set_position((t_s * 1e3) as u64);
            !interrupts.any()
        });
        bar.finish_and_clear();
        let (log, truth) = written?;
        let log = LogSummary::from(&log);
        self.json.text(&format!("{}{}", report::text(&log, None, false), report::platform_text(&truth)))?;
        self.json.json(|| report::platform_json(&log, &truth))
    }

    /// Records a profile on the emulated chip, in virtual time.
    fn record_chip(
        &self,
        image: Option<&Path>,
        stand: &Stand,
        hidden: Option<&HiddenEffect>,
        request: &ProfileRecordingRequest<'_>,
    ) -> Result<(), CliError> {
        check_recorded_seconds(request.seconds)?;
        let image = read_image(image)?;
        let plant = plant::Plant::new(stand, 0.0)?;
        let board = Board::new(&stand.setup(), Box::new(plant), stand.drive.motor_constant_N_m_A, self.seed);
        let mut machine = Machine::new(&image, board);
        let mut monitor = ProgressMonitor::new(request.seconds)?;
        let recording = block_on(async {
            let mut chip = SimulatedConnection::new(&mut machine);
            chip.wait_s(CHIP_START_S).await?;
            record_profile(&mut chip, request, &mut monitor).await
        });
        monitor.finish();
        let recording = recording.inspect_err(|_| machine.log().iter().for_each(|line| eprintln!("chip: {line}")))?;
        let log = LogSummary::from(&recording.log);
        self.json.text(&report::text(&log, hidden, self.reveal))?;
        self.json.json(|| report::json(&log, hidden, self.reveal))?;
        match early_end(&recording.end) {
            Some(reason) if !matches!(recording.end, RecordingEnd::Fault(_) | RecordingEnd::Interrupted) => Err(CliError::Other(reason)),
            _ => Ok(()),
        }
    }
}

//! `stand drift run`: a drift measurement on the simulated stand or at a serial port.

use std::io::{BufRead, IsTerminal};
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use embassy_futures::block_on;
use hal_sim::gyro::Orientation;
use indicatif::ProgressBar;

use super::drift_output::{Uncertainties, write_report};
use super::error::CliError;
use super::output::{Overwrite, ReportOutput, UnitOptions, spinner};
use super::stand_file::read_gyroscope;
use identification::log::Format;
use stand_acquire::drift_session::{
    CyclePlan, DriftSessionError, DriftSessionProgress, DriftSessionRequest, VisitOrder, measure, simulate,
};
use stand_acquire::link::SerialLink;
use stand_analysis::drift::Measurement;
use stand_analysis::drift::error::within;
use stand_analysis::drift::inequality::check_amplitudes;
use stand_analysis::drift::latitude::EarthRate;

/// Shape of the pulses.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum PulseShape {
    /// Constant rate
    Rectangular,
    /// Rate rises and falls linearly
    Triangular,
    /// Rate rises linearly
    Sawtooth,
}

/// Signs of the two pulses of a cycle.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum SignSequence {
    /// + − in each cycle
    PlusMinus,
    /// − + in each cycle
    MinusPlus,
    /// + − and − + alternately
    Both,
}

/// Order of the visits to the positions.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum OrderOption {
    /// All positions, then all in reverse (A B B A): a linear trend of the drift cancels
    Abba,
    /// All positions in their order
    Once,
}

/// What turns the gyroscope between positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TurnBy {
    /// The operator turns the gyroscope and confirms each position
    Hand,
    /// The stand's drive turns the platform that carries the gyroscope
    Drive,
}

/// Measure the drift: pulse cycles in two or more positions.
#[derive(Debug, Args)]
pub(super) struct Run {
    /// Serial port of the stand; without it the simulated stand, in virtual time
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    /// Cycles in each position at each rate; they are divided between the visits to it, with at least one in each
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    cycles: u32,
    /// Duration of one pulse, s; a cycle has two pulses
    #[arg(long, value_name = "S", default_value_t = 5.0, allow_negative_numbers = true)]
    pulse: f64,
    /// Period of the vibration or of the mains, of which the pulse is a multiple, s; 0: none
    #[arg(long, value_name = "S", default_value_t = 0.02, allow_negative_numbers = true)]
    period: f64,
    /// Largest rates of a pulse, °/s; two rates, each with all cycles, separate an asymmetry of the torquer from the drift
    #[arg(long, value_name = "DEG_S", default_value = "0.05,0.02", value_delimiter = ',', allow_negative_numbers = true)]
    rate: Vec<f64>,
    /// Time with closed correction loop before each cycle, s
    #[arg(long, value_name = "S", default_value_t = 4.0, allow_negative_numbers = true)]
    rest: f64,
    /// Signs of the pulses
    #[arg(long, value_enum, default_value_t = SignSequence::Both)]
    sequence: SignSequence,
    /// Shape of the pulses
    #[arg(long, value_enum, default_value_t = PulseShape::Rectangular)]
    shape: PulseShape,
    /// The second pulse is reversed in time
    #[arg(long)]
    reversed: bool,
    /// Positions in their order: degrees turned, optionally :raised and :rolled, e.g. 0,180,0:0:90
    #[arg(long, value_name = "LIST", default_value = "0,180", allow_hyphen_values = true)]
    positions: String,
    /// Order of the visits to the positions
    #[arg(long, value_enum, default_value_t = OrderOption::Abba)]
    order: OrderOption,
    /// Number of times that the order is run. From two on the offsets of the visits (turn, level) are measured and are in the uncertainty
    /// [default: 2 for abba, 1 for once]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=20))]
    rounds: Option<u32>,
    /// What turns the gyroscope between positions
    #[arg(long, value_enum, default_value_t = TurnBy::Hand)]
    turn: TurnBy,
    /// Latitude for the azimuth, degrees, north positive; default: the site of the simulated gyroscope
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    latitude: Option<f64>,
    /// The simulated gyroscope, TOML (site, own, torquer, sensor, vibration); default 1.5 °/h drift at 70° north
    #[arg(long, value_name = "FILE")]
    gyro: Option<PathBuf>,
    /// Seed of the simulated noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Write the rows to this log, .csv or .parquet
    #[arg(long, value_name = "LOG")]
    out: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    uncertainties: Uncertainties,
    #[command(flatten)]
    units: UnitOptions,
    #[command(flatten)]
    output: ReportOutput,
}

impl From<DriftSessionError> for CliError {
    fn from(error: DriftSessionError) -> Self {
        match error {
            DriftSessionError::Connection(error) => error.into(),
            DriftSessionError::Fault(_) | DriftSessionError::NotTurned(_) => CliError::Input(error.to_string()),
            other => CliError::Other(other.to_string()),
        }
    }
}

impl Run {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        if let Some(path) = &self.out {
            self.overwrite.check(path)?;
            Format::of(path)?;
        }
        let request = self.request()?;
        let uncertainties = self.uncertainties.setup().checked()?;
        if let Some(latitude) = self.latitude {
            EarthRate::at(latitude, 0.0)?;
        }
        let spinner = spinner("");
        let show = |progress: DriftSessionProgress| show(&spinner, progress);
        let (recording, name, latitude_deg) = match &self.port {
            Some(port) => {
                let mut link = SerialLink::open(port)?;
                let turn = async |place: &Orientation, _: &mut SerialLink| spinner.suspend(|| confirm_turn(place));
                (block_on(measure(&mut link, &request, turn, show)), link.name(), self.latitude)
            }
            None => {
                let gyroscope = read_gyroscope(self.gyro.as_deref())?;
                let latitude_deg = self.latitude.unwrap_or(gyroscope.site.latitude_rad.to_degrees());
                (simulate(gyroscope, self.seed, &request, show), "simulated".to_owned(), Some(latitude_deg))
            }
        };
        spinner.finish_and_clear();
        let recording = recording?;
        if let Some(path) = &self.out {
            recording.log(path, &request.plan, latitude_deg)?.write(path)?;
        }
        let measurement = Measurement::of_recording(name, &recording, latitude_deg, uncertainties)?;
        write_report(&self.output, self.units, &measurement.evaluate()?)
    }

    /// The checked request.
    fn request(&self) -> Result<DriftSessionRequest, CliError> {
        let positions = self.positions.split(',').map(position).collect::<Result<_, _>>()?;
        within("--pulse", self.pulse, 1e-3, 60.0)?;
        within("--period", self.period, 0.0, 60.0)?;
        within("--rest", self.rest, 1e-3, 1e5)?;
        for rate in &self.rate {
            within("--rate", *rate, 1e-6, 100.0)?;
        }
        check_amplitudes(&self.rate)?;
        let plan = CyclePlan {
            shape: match self.shape {
                PulseShape::Rectangular => "RECTangular",
                PulseShape::Triangular => "TRIangular",
                PulseShape::Sawtooth => "SAWTooth",
            },
            reversed: self.reversed,
            sequence: match self.sequence {
                SignSequence::PlusMinus => "PLUSminus",
                SignSequence::MinusPlus => "MINusplus",
                SignSequence::Both => "BOTH",
            },
            pulse_s: self.pulse,
            period_s: self.period,
            rest_s: self.rest,
            cycles: self.cycles,
        };
        Ok(DriftSessionRequest {
            plan,
            rates_rad_s: self.rate.iter().map(|rate| rate.to_radians()).collect(),
            positions,
            order: match self.order {
                OrderOption::Abba => VisitOrder::Abba,
                OrderOption::Once => VisitOrder::Once,
            },
            rounds: self.rounds.unwrap_or(match self.order {
                OrderOption::Abba => 2,
                OrderOption::Once => 1,
            }),
            turn_by_drive: self.turn == TurnBy::Drive,
            keep_rows: self.out.is_some(),
        })
    }
}

/// A position of the option `--positions`: degrees turned, optionally raised and rolled, separated by colons.
fn position(text: &str) -> Result<Orientation, CliError> {
    let invalid =
        || CliError::Input(format!("--positions: `{text}` is not a position; write degrees turned[:raised[:rolled]], e.g. 180 or 0:0:90"));
    let mut numbers = [0.0; 3];
    let parts: Vec<&str> = text.split(':').collect();
    if parts.len() > 3 {
        return Err(invalid());
    }
    for (number, part) in numbers.iter_mut().zip(&parts) {
        *number = part.trim().parse().ok().filter(|n: &f64| n.is_finite()).ok_or_else(invalid)?;
    }
    let [turned_rad, raised_rad, rolled_rad] = numbers.map(f64::to_radians);
    Ok(Orientation { turned_rad, raised_rad, rolled_rad })
}

/// Shows the progress; a signal ends the program.
fn show(spinner: &ProgressBar, progress: DriftSessionProgress) -> bool {
    let DriftSessionProgress { visit, visits, position, state } = progress;
    spinner.set_message(format!("visit {visit} of {visits}, position {position} {state}"));
    true
}

/// Prints the instruction to turn the gyroscope and waits for the Enter key.
pub(super) fn confirm_turn(place: &Orientation) -> Result<(), DriftSessionError> {
    let [turned, raised, rolled] =
        [place.turned_rad, place.raised_rad, place.rolled_rad].map(|rad| stand_report::plain(rad.to_degrees(), 6));
    eprintln!("Turn the gyroscope to {turned}° (raised {raised}°, rolled {rolled}°), level it, then press Enter.");
    let mut line = String::new();
    let stdin = std::io::stdin();
    let count =
        stdin.lock().read_line(&mut line).map_err(|e| DriftSessionError::NotTurned(format!("cannot read from standard input: {e}")))?;
    if count == 0 {
        let ended = if stdin.is_terminal() { "" } else { ": standard input has ended" };
        return Err(DriftSessionError::NotTurned(format!("the position {turned}° was not confirmed{ended}")));
    }
    Ok(())
}

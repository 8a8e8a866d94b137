//! `stand drift run`: the firmware runs the cycles, position after position, on the simulated stand or over a port.

use std::cell::RefCell;
use std::io::{BufRead, IsTerminal};
use std::path::Path;

use embassy_futures::block_on;
use hal_sim::board::linear_motor::LinearMotor;
use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::gyro::Place;
use hal_sim::session::StandSetup;

use super::super::error::CliError;
use super::super::output::{check_writable, spinner};
use super::super::stand_file::read_gyroscope;
use super::{ARCMIN, Run, Turn, write_report};
use crate::acquire::connection::{SimulatedConnection, StandConnection};
use crate::acquire::link::SerialLink;
use crate::drift::error::within;
use crate::drift::inequality::MIN_AMPLITUDE_RATIO;
use crate::drift::session::{self, CyclePlan, GyroscopeScales};
use crate::drift::{Cycle, DEG_H, Measurement, separation};
use crate::log::{Column, Format, Log, Note, Notes};
use stand_firmware::telemetry::RowFrame;

/// Positions by `0,180,0:0:90`: turn, optionally elevation and roll, in degrees.
fn positions(list: &str) -> Result<Vec<Place>, CliError> {
    let one = |text: &str| {
        let wrong = || {
            CliError::Input(format!("--positions: `{text}` is not a position: turn in degrees, optionally elevation and roll after colons"))
        };
        let mut numbers = [0.0; 3];
        let parts: Vec<&str> = text.split(':').collect();
        if parts.len() > 3 {
            return Err(wrong());
        }
        for (number, part) in numbers.iter_mut().zip(&parts) {
            *number = part.trim().parse().ok().filter(|n: &f64| n.is_finite()).ok_or_else(wrong)?;
        }
        let [turned_rad, raised_rad, rolled_rad] = numbers.map(f64::to_radians);
        Ok(Place { turned_rad, raised_rad, rolled_rad })
    };
    list.split(',').map(one).collect()
}

/// Data of all positions.
#[derive(Default)]
struct Session {
    cycles: Vec<Cycle>,
    /// `t_s` and the channels of the session, row by row.
    rows: Vec<[f64; 4]>,
    /// First row of each position.
    row_positions: Vec<(usize, Place)>,
}

impl Run {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        if let Some(path) = &self.out {
            check_writable(path)?;
            Format::of(path)?;
        }
        let positions = positions(&self.positions)?;
        within("--pulse", self.pulse, 1e-3, 60.0)?;
        within("--period", self.period, 0.0, 60.0)?;
        within("--rest", self.rest, 1e-3, 1e5)?;
        self.check_rates()?;
        if let Some(latitude) = self.latitude {
            separation::earth_rad_s(latitude)?;
        }
        let (session, scales, name, latitude_deg) = match &self.port {
            Some(port) => {
                let mut link = SerialLink::open(port)?;
                let name = link.name();
                let (session, scales) = block_on(self.session(&mut link, &positions, async |position, _| turn_by_hand(position)))?;
                (session, scales, name, self.latitude)
            }
            None => self.simulated(&positions)?,
        };
        if let Some(path) = &self.out {
            self.log(path, &session, &scales, latitude_deg)?.write(path)?;
        }
        let measurement = Measurement {
            name,
            cycles: session.cycles,
            has_three_axes: false,
            latitude_deg,
            turn_error_rad: within("--turn-error", self.errors.turn_error * ARCMIN, 0.0, 1.0)?,
            level_error_rad: within("--level-error", self.errors.level_error * DEG_H, 0.0, 1.0)?,
            gain_error: within("--gain-error", self.errors.gain_error / 100.0, 0.0, 1.0)?,
            warnings: Vec::new(),
        };
        write_report(&self.output, &measurement.evaluate()?)
    }

    /// Checks the amplitudes: within their range, and different.
    fn check_rates(&self) -> Result<(), CliError> {
        for (k, rate) in self.rate.iter().enumerate() {
            within("--rate", *rate, 1e-6, 100.0)?;
            if self.rate[..k].iter().any(|other| rate.max(*other) < MIN_AMPLITUDE_RATIO * rate.min(*other)) {
                let percent = 100.0 * (MIN_AMPLITUDE_RATIO - 1.0);
                return Err(CliError::Input(format!(
                    "--rate {rate}: amplitudes must differ by at least {percent:.0} % to determine the inequality of the torquer"
                )));
            }
        }
        Ok(())
    }

    fn plan(&self) -> CyclePlan {
        let shape = ["RECTangular", "TRIangular", "SAWTooth"][self.shape as usize];
        let sequence = ["PLUSminus", "MINusplus", "BOTH"][self.sequence as usize];
        CyclePlan {
            shape,
            reversed: self.reversed,
            sequence,
            pulse_s: self.pulse,
            period_s: self.period,
            rest_s: self.rest,
            cycles: self.cycles,
        }
    }

    /// Measures in all positions on one stand; `turn` turns the gyroscope.
    async fn session<S: StandConnection>(
        &self,
        stand: &mut S,
        positions: &[Place],
        turn: impl AsyncFn(&Place, &mut S) -> Result<(), CliError>,
    ) -> Result<(Session, GyroscopeScales), CliError> {
        let fault = stand.query("FAULt?").await?;
        if !fault.starts_with("0,") {
            return Err(CliError::Input(format!("a fault has switched the drive off: {fault}; send FAULt:CLEar in `stand console` first")));
        }
        stand.command("STReam OFF").await?;
        let scales = session::scales(stand).await?;
        session::set_up(stand, &self.plan()).await?;
        if self.out.is_some() {
            stand.command(&format!("STReam:CHANnels {}", session::CHANNELS.join(","))).await?;
            stand.command("STReam:DECimation 1").await?;
            stand.command("STReam ON").await?;
        }
        let mut all = Session::default();
        let (mut origin_rad, mut sent_rate) = (None, None);
        for (k, position) in positions.iter().enumerate() {
            if k > 0 && self.turn == Turn::Drive {
                drive_to(stand, position.turned_rad - positions[0].turned_rad, &mut origin_rad).await?;
            } else if k > 0 || position != &Place::default() {
                turn(position, stand).await?;
            }
            let bar = spinner(&format!("position {} of {}", k + 1, positions.len()));
            // The firmware numbers positions from 1.
            let number = k as u32 + 1;
            all.row_positions.push((all.rows.len(), *position));
            // The sequence of the amplitudes alternates, so that a linear drift does not act on the inequality.
            let mut rates = self.rate.clone();
            if k % 2 == 1 {
                rates.reverse();
            }
            for rate in rates {
                if sent_rate != Some(rate) {
                    session::set_rate(stand, rate.to_radians()).await?;
                    sent_rate = Some(rate);
                }
                let on_state = |state: &str| bar.set_message(format!("position {number}: {state}"));
                let data = session::measure(stand, &scales, number, *position, rate.to_radians(), on_state).await?;
                all.cycles.extend(data.cycles);
                all.rows.extend(data.rows.iter().map(channels));
            }
            bar.finish_and_clear();
        }
        if self.turn == Turn::Drive {
            stand.command("OUTPut OFF").await?;
        }
        if self.out.is_some() {
            stand.command("STReam OFF").await?;
        }
        Ok((all, scales))
    }

    fn simulated(&self, positions: &[Place]) -> Result<(Session, GyroscopeScales, String, Option<f64>), CliError> {
        let gyro = read_gyroscope(self.gyro.as_deref())?;
        let latitude_deg = self.latitude.unwrap_or(gyro.site.latitude_rad.to_degrees());
        separation::earth_rad_s(latitude_deg)?;
        let other = |e: hal_sim::controller::ControllerError| CliError::Other(e.to_string());
        let clock = VirtualClock::default();
        let controller = Controller::new(&clock, &StandSetup::default(), LinearMotor::default(), flash(self.seed), self.seed)
            .map_err(other)?
            .with_gyro(Box::new(gyro.seeded(self.seed)), self.seed);
        let done = RefCell::new(None);
        let host = async {
            let mut stand = SimulatedConnection::new(&controller);
            // The first rows arrive after 2 ms.
            let began = stand.wait_s(0.1).await;
            let turn = async |position: &Place, _: &mut SimulatedConnection<'_, '_, LinearMotor>| {
                if let Some(line) = controller.bench().borrow_mut().gyro() {
                    line.gyro().put(*position);
                }
                Ok(())
            };
            let all = match began {
                Ok(_) => self.session(&mut stand, positions, turn).await,
                Err(error) => Err(error.into()),
            };
            done.replace(Some(all));
        };
        controller.run(host, |_| ()).map_err(other)?;
        let (session, scales) = done.into_inner().ok_or_else(|| CliError::Other("the simulated stand did not end".to_owned()))??;
        Ok((session, scales, "simulated".to_owned(), Some(latitude_deg)))
    }

    /// The rows as a log, with the notes that `stand drift compute` needs.
    fn log(&self, path: &Path, session: &Session, scales: &GyroscopeScales, latitude_deg: Option<f64>) -> Result<Log, CliError> {
        let mut columns: Vec<Column> = ["t_s", "angle_sensor_V", "torquer_A", "drift_mark", "turned_deg", "raised_deg", "rolled_deg"]
            .iter()
            .map(|name| Column { name: (*name).to_owned(), values: Vec::with_capacity(session.rows.len()) })
            .collect();
        let first_s = session.rows.first().map_or(0.0, |row| row[0]);
        let mut position = Place::default();
        for (k, row) in session.rows.iter().enumerate() {
            if let Some((_, next)) = session.row_positions.iter().rev().find(|(from, _)| *from <= k) {
                position = *next;
            }
            // Rows without a sample are left out.
            if row.iter().any(|value| !value.is_finite()) {
                continue;
            }
            let at = [row[0] - first_s, row[1], row[2], row[3]];
            let angles = [position.turned_rad, position.raised_rad, position.rolled_rad].map(f64::to_degrees);
            columns.iter_mut().zip(at.into_iter().chain(angles)).for_each(|(column, value)| column.values.push(value));
        }
        let pulse_s = session.cycles.first().map_or(self.pulse, |cycle| cycle.integral.pulse_s);
        let mut notes = Notes::from_iter([
            Note::Number("angle_gain_V_rad", scales.angle_gain_V_rad),
            Note::Number("torquer_gain_rad_s_A", scales.torquer_gain_rad_s_A),
            Note::Number("angle_limit_V", scales.angle_limit_V),
            Note::Number("pulse_s", pulse_s),
            Note::Text("sequence", format!("{:?}", self.sequence).to_lowercase()),
            Note::Text("shape", format!("{:?}", self.shape).to_lowercase()),
        ]);
        notes.extend(latitude_deg.map(|latitude_deg| Note::Number("latitude_deg", latitude_deg)));
        Ok(Log::new(path, columns, notes)?)
    }
}

/// `t_s` of a row and the channels of the session.
fn channels(row: &RowFrame) -> [f64; 4] {
    let [angle, torquer, mark] = session::CHANNELS.map(|name| row.value(name).unwrap_or(f64::NAN));
    [row.at as f64 * 1e-7, angle, torquer, mark]
}

/// Turns the platform by the drive, relative to its first angle. The encoder counts counter-clockwise, azimuths clockwise.
async fn drive_to<S: StandConnection>(stand: &mut S, turned_rad: f64, origin_rad: &mut Option<f64>) -> Result<(), CliError> {
    let angle = async |stand: &mut S| -> Result<f64, CliError> {
        let reply = stand.query("MEASure:ANGLe?").await?;
        let word = reply.split(' ').next().unwrap_or_default();
        word.parse().map_err(|_| CliError::Other(format!("MEASure:ANGLe? is not a number: `{reply}`")))
    };
    let origin = match *origin_rad {
        Some(origin) => origin,
        None => *origin_rad.insert(angle(stand).await?),
    };
    let goal = origin - turned_rad;
    for command in ["SOURce:MODE POSition".to_owned(), format!("SOURce:POSition {goal:e} RAD"), "OUTPut ON".to_owned()] {
        stand.command(&command).await?;
    }
    let mut error_rad = f64::INFINITY;
    for _ in 0..150 {
        stand.wait_s(0.2).await?;
        error_rad = angle(stand).await? - goal;
        if error_rad.abs() < 5e-4 {
            // Settling.
            stand.wait_s(2.0).await?;
            return Ok(());
        }
    }
    Err(CliError::Other(format!("the platform remains {} rad from its setpoint", crate::report::significant(error_rad, 2))))
}

/// Asks the operator to turn the gyroscope.
fn turn_by_hand(position: &Place) -> Result<(), CliError> {
    let [turned, raised, rolled] =
        [position.turned_rad, position.raised_rad, position.rolled_rad].map(|rad| crate::report::plain(rad.to_degrees(), 6));
    eprintln!("Turn the gyroscope to {turned}° (elevation {raised}°, roll {rolled}°), level it, and press Enter.");
    let mut line = String::new();
    let stdin = std::io::stdin();
    let count = stdin.lock().read_line(&mut line).map_err(|e| CliError::Other(format!("standard input: {e}")))?;
    if count == 0 {
        let who = if stdin.is_terminal() { "" } else { " (standard input has ended)" };
        return Err(CliError::Input(format!("no turn: the position {turned}° was not confirmed{who}")));
    }
    Ok(())
}

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
use super::{ARCMIN, Run, Turn, tell};
use crate::acquire::connection::{SimulatedConnection, StandConnection};
use crate::acquire::link::SerialLink;
use crate::drift::amplitudes::LEAST_RATIO;
use crate::drift::answer::{CycleLine, Measured};
use crate::drift::error::within;
use crate::drift::session::{self, Plan, Scales};
use crate::drift::{DEG_H, separate};
use crate::log::{Column, Format, Log, Note, Notes};
use stand_firmware::telemetry::RowFrame;

/// `0,180,0:0:90`: turned, and raised and rolled.
fn places(list: &str) -> Result<Vec<Place>, CliError> {
    let one = |text: &str| {
        let wrong =
            || CliError::Input(format!("--positions: `{text}` is no position: degrees turned, and behind colons raised and rolled"));
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

/// What was measured in all positions.
#[derive(Default)]
struct Session {
    cycles: Vec<CycleLine>,
    /// `t_s`, the channels of the session, and the place of each row.
    rows: Vec<[f64; 4]>,
    row_places: Vec<(usize, Place)>,
}

impl Run {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.output.check()?;
        if let Some(path) = &self.out {
            check_writable(path)?;
            Format::of(path)?;
        }
        let places = places(&self.positions)?;
        within("--pulse", self.pulse, 1e-3, 60.0)?;
        within("--period", self.period, 0.0, 60.0)?;
        within("--rest", self.rest, 1e-3, 1e5)?;
        self.rates()?;
        if let Some(latitude) = self.latitude {
            separate::earth_rad_s(latitude)?;
        }
        let (session, scales, name, latitude_deg) = match &self.port {
            Some(port) => {
                let mut link = SerialLink::open(port)?;
                let name = link.name();
                let (session, scales) = block_on(self.session(&mut link, &places, async |place, _| by_hand(place)))?;
                (session, scales, name, self.latitude)
            }
            None => self.simulated(&places)?,
        };
        if let Some(path) = &self.out {
            self.log(path, &session, &scales, latitude_deg)?.write(path)?;
        }
        let measured = Measured {
            name,
            cycles: session.cycles,
            has_three_axes: false,
            latitude_deg,
            turn_error_rad: within("--turn-error", self.errors.turn_error * ARCMIN, 0.0, 1.0)?,
            level_error_rad: within("--level-error", self.errors.level_error * DEG_H, 0.0, 1.0)?,
            gain_error: within("--gain-error", self.errors.gain_error / 100.0, 0.0, 1.0)?,
            warnings: Vec::new(),
        };
        tell(&self.output, &measured.answer()?)
    }

    /// The amplitudes make sense, and differ where there are several.
    fn rates(&self) -> Result<(), CliError> {
        for (k, rate) in self.rate.iter().enumerate() {
            within("--rate", *rate, 1e-6, 100.0)?;
            if self.rate[..k].iter().any(|other| rate.max(*other) < LEAST_RATIO * rate.min(*other)) {
                let most = 100.0 * (LEAST_RATIO - 1.0);
                return Err(CliError::Input(format!(
                    "--rate {rate}: amplitudes differ by {most:.0} % at least, or tell nothing of the torquer"
                )));
            }
        }
        Ok(())
    }

    fn plan(&self) -> Plan {
        let shape = ["RECTangular", "TRIangular", "SAWTooth"][self.shape as usize];
        let sequence = ["PLUSminus", "MINusplus", "BOTH"][self.sequence as usize];
        Plan {
            shape,
            reversed: self.reversed,
            sequence,
            pulse_s: self.pulse,
            period_s: self.period,
            rest_s: self.rest,
            cycles: self.cycles,
        }
    }

    /// All positions on one stand; `turn` puts the gyro where it is not yet.
    async fn session<S: StandConnection>(
        &self,
        stand: &mut S,
        places: &[Place],
        turn: impl AsyncFn(&Place, &mut S) -> Result<(), CliError>,
    ) -> Result<(Session, Scales), CliError> {
        let fault = stand.query("FAULt?").await?;
        if !fault.starts_with("0,") {
            return Err(CliError::Input(format!("the drive is off by a fault: {fault}; FAULt:CLEar in `stand console` first")));
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
        let (mut origin_rad, mut given) = (None, None);
        for (k, place) in places.iter().enumerate() {
            if k > 0 && self.turn == Turn::Drive {
                drive_to(stand, place.turned_rad - places[0].turned_rad, &mut origin_rad).await?;
            } else if k > 0 || place != &Place::default() {
                turn(place, stand).await?;
            }
            let bar = spinner(&format!("position {} of {}", k + 1, places.len()));
            // The firmware's pair is of positions 1 and 2.
            let number = k as u32 + 1;
            all.row_places.push((all.rows.len(), *place));
            // To and fro, so that what changes steadily is not taken for the amplitude's.
            let mut rates = self.rate.clone();
            if k % 2 == 1 {
                rates.reverse();
            }
            for rate in rates {
                if given != Some(rate) {
                    session::set_rate(stand, rate.to_radians()).await?;
                    given = Some(rate);
                }
                let told = |state: &str| bar.set_message(format!("position {number}: {state}"));
                let position = session::measure(stand, &scales, number, *place, rate.to_radians(), told).await?;
                all.cycles.extend(position.cycles);
                all.rows.extend(position.rows.iter().map(channels));
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

    fn simulated(&self, places: &[Place]) -> Result<(Session, Scales, String, Option<f64>), CliError> {
        let gyro = read_gyroscope(self.gyro.as_deref())?;
        let latitude_deg = self.latitude.unwrap_or(gyro.site.latitude_rad.to_degrees());
        separate::earth_rad_s(latitude_deg)?;
        let other = |e: hal_sim::controller::ControllerError| CliError::Other(e.to_string());
        let clock = VirtualClock::default();
        let controller = Controller::new(&clock, &StandSetup::default(), LinearMotor::default(), flash(self.seed), self.seed)
            .map_err(other)?
            .with_gyro(Box::new(gyro.seeded(self.seed)), self.seed);
        let done = RefCell::new(None);
        let host = async {
            let mut stand = SimulatedConnection::new(&controller);
            // Rows come from 2 ms on.
            let began = stand.wait_s(0.1).await;
            let turn = async |place: &Place, _: &mut SimulatedConnection<'_, '_, LinearMotor>| {
                if let Some(line) = controller.bench().borrow_mut().gyro() {
                    line.gyro().put(*place);
                }
                Ok(())
            };
            let all = match began {
                Ok(_) => self.session(&mut stand, places, turn).await,
                Err(error) => Err(error.into()),
            };
            done.replace(Some(all));
        };
        controller.run(host, |_| ()).map_err(other)?;
        let (session, scales) = done.into_inner().ok_or_else(|| CliError::Other("the simulated stand did not end".to_owned()))??;
        Ok((session, scales, "simulated".to_owned(), Some(latitude_deg)))
    }

    /// The rows with what a later `drift compute` must know.
    fn log(&self, path: &Path, session: &Session, scales: &Scales, latitude_deg: Option<f64>) -> Result<Log, CliError> {
        let mut columns: Vec<Column> = ["t_s", "angle_sensor_V", "torquer_A", "drift_mark", "turned_deg", "raised_deg", "rolled_deg"]
            .iter()
            .map(|name| Column { name: (*name).to_owned(), values: Vec::with_capacity(session.rows.len()) })
            .collect();
        let first_s = session.rows.first().map_or(0.0, |row| row[0]);
        let mut place = Place::default();
        for (k, row) in session.rows.iter().enumerate() {
            if let Some((_, next)) = session.row_places.iter().rev().find(|(from, _)| *from <= k) {
                place = *next;
            }
            // A row without a sample is none.
            if row.iter().any(|value| !value.is_finite()) {
                continue;
            }
            let at = [row[0] - first_s, row[1], row[2], row[3]];
            let angles = [place.turned_rad, place.raised_rad, place.rolled_rad].map(f64::to_degrees);
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

/// The stand's drive turns the platform, by an angle from where it stood first; the encoder counts to the left, azimuths go to the right.
async fn drive_to<S: StandConnection>(stand: &mut S, turned_rad: f64, origin_rad: &mut Option<f64>) -> Result<(), CliError> {
    let angle = async |stand: &mut S| -> Result<f64, CliError> {
        let says = stand.query("MEASure:ANGLe?").await?;
        let word = says.split(' ').next().unwrap_or_default();
        word.parse().map_err(|_| CliError::Other(format!("MEASure:ANGLe? is no number: `{says}`")))
    };
    let origin = match *origin_rad {
        Some(origin) => origin,
        None => *origin_rad.insert(angle(stand).await?),
    };
    let goal = origin - turned_rad;
    for order in ["SOURce:MODE POSition".to_owned(), format!("SOURce:POSition {goal:e} RAD"), "OUTPut ON".to_owned()] {
        stand.command(&order).await?;
    }
    let mut off = f64::INFINITY;
    for _ in 0..150 {
        stand.wait_s(0.2).await?;
        off = angle(stand).await? - goal;
        if off.abs() < 5e-4 {
            // Until it is still.
            stand.wait_s(2.0).await?;
            return Ok(());
        }
    }
    Err(CliError::Other(format!("the platform stands {} rad from where it should be turned to", crate::report::significant(off, 2))))
}

/// A person turns it and says so.
fn by_hand(place: &Place) -> Result<(), CliError> {
    let [turned, raised, rolled] =
        [place.turned_rad, place.raised_rad, place.rolled_rad].map(|rad| crate::report::plain(rad.to_degrees(), 6));
    eprintln!("Turn the gyro to {turned}° (raised {raised}°, rolled {rolled}°), level it, and press Enter when it stands.");
    let mut line = String::new();
    let stdin = std::io::stdin();
    let count = stdin.lock().read_line(&mut line).map_err(|e| CliError::Other(format!("standard input: {e}")))?;
    if count == 0 {
        let who = if stdin.is_terminal() { "" } else { " (standard input has ended)" };
        return Err(CliError::Input(format!("no turn: nobody said that the gyro stands at {turned}°{who}")));
    }
    Ok(())
}

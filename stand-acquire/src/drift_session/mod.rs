//! Drift session: the firmware runs pulse cycles in one position of the gyroscope after another, on a stand or a simulated one.
//!
//! Input: a connection, the plan of the cycles, the positions. Output: the cycles of all positions as the firmware reports them, and the
//! rows of the stream for a log. The drift is computed from them in `stand-analysis`, a higher layer.

mod cycles;

use std::cell::RefCell;
use std::path::Path;

use hal_sim::board::linear_motor::LinearMotor;
use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, ControllerError, flash};
use hal_sim::gyro::{Orientation, SingleAxis};
use hal_sim::session::StandSetup;

use crate::connection::{ConnectionError, SimulatedConnection, StandConnection};
use crate::preparation::{latched_fault, query_number};
use identification::log::{Column, Log, LogError, Note, Notes};

pub use cycles::{CyclePlan, CycleTrace, GyroscopeScales, ReportedCycle};

/// Time after power-on until the simulated stand sends rows, s.
const SIMULATED_START_S: f64 = 0.1;
/// Position error at which the drive has reached its setpoint, rad.
const POSITION_TOLERANCE_RAD: f64 = 5e-4;
/// The firmware's name of the sequence with both signs.
const BOTH: &str = "BOTH";
/// Interval between measurements of the angle while the drive turns the platform, s, and the largest number of them.
const POSITION_INTERVAL_S: f64 = 0.2;
const MAX_POSITION_STEPS: usize = 150;
/// Time for the platform to settle in a new position, s.
const SETTLING_S: f64 = 2.0;

/// What is to be measured.
#[derive(Debug, Clone)]
pub struct DriftSessionRequest {
    /// The cycles in each position.
    pub plan: CyclePlan,
    /// Largest rates of the pulses, rad/s; each runs all cycles.
    pub rates_rad_s: Vec<f64>,
    /// Positions of the gyroscope, each once.
    pub positions: Vec<Orientation>,
    /// Order of the visits to the positions.
    pub order: VisitOrder,
    /// Number of times that the order is run. The scatter between visits of one position is measured with two or more visits to each.
    pub rounds: u32,
    /// The stand's drive turns the platform between positions; otherwise the operator does.
    pub turn_by_drive: bool,
    /// The rows of the stream are kept for a log.
    pub keep_rows: bool,
}

/// Order of the visits to the positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VisitOrder {
    /// All positions, then all in reverse: a linear trend of the drift cancels.
    Abba,
    /// All positions.
    Once,
}

impl DriftSessionRequest {
    fn has_both_signs(&self) -> bool {
        self.plan.sequence == BOTH
    }

    /// Signs of the pulses in a visit, by its number from 0. Visits of one cycle alternate the sign: in the order A B B A with the number
    /// of the visit, since positions are visited once with an even and once with an odd number; otherwise with the round.
    fn sequence(&self, visit: usize, cycles: u32) -> &'static str {
        let alternation = match self.order {
            VisitOrder::Abba => visit,
            VisitOrder::Once => visit / self.positions.len().max(1),
        };
        match (self.has_both_signs() && cycles == 1 && self.visits_per_position() > 1, alternation % 2) {
            (false, _) => self.plan.sequence,
            (true, 0) => "PLUSminus",
            (true, _) => "MINusplus",
        }
    }

    /// A visit runs the rates in reverse: every second one, so that a linear trend does not look like an effect of the rate.
    fn is_reversed(&self, visit: usize) -> bool {
        let round = match self.order {
            VisitOrder::Abba => 0,
            VisitOrder::Once => visit / self.positions.len().max(1),
        };
        (visit + round) % 2 == 1
    }

    fn visits_per_position(&self) -> u32 {
        let in_a_round = if self.order == VisitOrder::Abba { 2 } else { 1 };
        in_a_round * self.rounds.max(1)
    }

    /// The visits: number of the position, from 0, and cycles at each rate. The cycles of a position are divided between its visits, at
    /// least one in each, and in pairs of both signs where they suffice. The gyroscope is not turned between two successive visits to one
    /// position.
    pub fn visits(&self) -> Vec<(usize, u32)> {
        let (count, visits) = (self.positions.len(), self.visits_per_position());
        let unit = if self.has_both_signs() && self.plan.cycles >= 2 * visits { 2 } else { 1 };
        let units = self.plan.cycles / unit;
        // What does not fill a unit is for the last visit.
        let rest = |visit: u32| if visit + 1 == visits { self.plan.cycles % unit } else { 0 };
        let cycles = |visit: u32| (unit * (units / visits + u32::from(visit < units % visits)) + rest(visit)).max(1);
        let there_and_back = |visit: u32| self.order == VisitOrder::Abba && visit % 2 == 1;
        let round = |visit: u32| -> Vec<(usize, u32)> {
            let positions = 0..count;
            let in_order: Vec<usize> = if there_and_back(visit) { positions.rev().collect() } else { positions.collect() };
            in_order.into_iter().map(|position| (position, cycles(visit))).collect()
        };
        (0..visits).flat_map(round).collect()
    }
}

/// Result of a drift session.
#[derive(Debug, Clone)]
pub struct DriftRecording {
    /// Cycles of all positions.
    pub cycles: Vec<ReportedCycle>,
    /// Scale factors from the stand's settings.
    pub scales: GyroscopeScales,
    /// Time, then [`cycles::CHANNELS`], of each row.
    rows: Vec<[f64; 4]>,
    /// Index of the first row of each position.
    row_positions: Vec<(usize, Orientation)>,
}

/// Progress of a drift session.
#[derive(Debug, Clone, Copy)]
pub struct DriftSessionProgress<'a> {
    /// Number of the visit, from 1.
    pub visit: usize,
    /// Number of visits.
    pub visits: usize,
    /// Number of the position, from 1.
    pub position: usize,
    /// State of the firmware's drift sequence; empty at the start of a position.
    pub state: &'a str,
}

/// Why a drift session failed.
#[derive(Debug, thiserror::Error)]
pub enum DriftSessionError {
    /// The connection fails, or the stand rejects a command.
    #[error(transparent)]
    Connection(#[from] ConnectionError),
    /// The drive is off because of a fault.
    #[error("the drive is off because of a fault: {0}; send FAULt:CLEar with `stand console` first")]
    Fault(String),
    /// The drive did not turn the platform to the position.
    #[error("the platform is {error_rad:.2e} rad from its position setpoint after 30 s; check that it turns freely")]
    NotReached {
        /// Position error, rad.
        error_rad: f64,
    },
    /// Interrupted by the user.
    #[error("interrupted by the user")]
    Interrupted,
    /// The operator did not confirm a position.
    #[error("{0}")]
    NotTurned(String),
    /// The simulated stand does not run.
    #[error(transparent)]
    Controller(#[from] ControllerError),
    /// The simulated stand ended before the measurement.
    #[error("the simulated stand ended before the measurement was complete")]
    Incomplete,
}

/// Measures in all positions of one stand. `turn` brings the gyroscope into a position; `progress` receives the state and returns false to
/// interrupt the session.
///
/// # Errors
/// As [`DriftSessionError`].
pub async fn measure<S: StandConnection>(
    stand: &mut S,
    request: &DriftSessionRequest,
    turn: impl AsyncFn(&Orientation, &mut S) -> Result<(), DriftSessionError>,
    progress: impl Fn(DriftSessionProgress) -> bool,
) -> Result<DriftRecording, DriftSessionError> {
    if let Some(fault) = latched_fault(stand).await? {
        return Err(DriftSessionError::Fault(fault));
    }
    stand.command("STReam OFF").await?;
    let scales = cycles::scales(stand).await?;
    cycles::set_up(stand, &request.plan).await?;
    // Also without a log, so that a session does not depend on whether its rows are kept.
    let channels = format!("STReam:CHANnels {}", cycles::CHANNELS.join(","));
    for command in [channels.as_str(), "STReam:DECimation 1", "STReam ON"] {
        stand.command(command).await?;
    }
    let mut all = DriftRecording { cycles: Vec::new(), scales, rows: Vec::new(), row_positions: Vec::new() };
    let (mut origin_rad, mut set, mut end_s) = (None, None, 0.0);
    let first = request.positions.first().copied().unwrap_or_default();
    let visits = request.visits();
    let mut present = None;
    for (k, (position, cycles)) in visits.iter().enumerate() {
        let place = &request.positions[*position];
        if present != Some(*position) {
            if k > 0 && request.turn_by_drive {
                drive_to(stand, place.turned_rad - first.turned_rad, &mut origin_rad).await?;
            } else if k > 0 || place != &Orientation::default() {
                turn(place, stand).await?;
            }
            present = Some(*position);
        }
        let report = |state: &str| progress(DriftSessionProgress { visit: k + 1, visits: visits.len(), position: position + 1, state });
        if !report("") {
            return interrupt(stand, request.turn_by_drive).await;
        }
        all.row_positions.push((all.rows.len(), *place));
        let mut rates = request.rates_rad_s.clone();
        if request.is_reversed(k) {
            rates.reverse();
        }
        for rate_rad_s in rates {
            let wanted = (rate_rad_s, *cycles, request.sequence(k, *cycles));
            if set != Some(wanted) {
                cycles::set_rate(stand, wanted).await?;
                set = Some(wanted);
            }
            let data = match cycles::measure(stand, *position as u32 + 1, *place, rate_rad_s, end_s, report).await {
                Ok(Some(data)) => data,
                Ok(None) | Err(ConnectionError::Interrupted) => return interrupt(stand, request.turn_by_drive).await,
                Err(error) => return Err(error.into()),
            };
            end_s = data.end_s;
            all.cycles.extend(data.cycles);
            if request.keep_rows {
                all.rows.extend(&data.rows);
            }
        }
    }
    if request.turn_by_drive {
        stand.command("OUTPut OFF").await?;
    }
    stand.command("STReam OFF").await?;
    Ok(all)
}

/// Ends the session before its time.
async fn interrupt<T>(stand: &mut impl StandConnection, turn_by_drive: bool) -> Result<T, DriftSessionError> {
    stand.command("DRIFt:ABORt").await?;
    if turn_by_drive {
        stand.command("OUTPut OFF").await?;
    }
    stand.command("STReam OFF").await?;
    Err(DriftSessionError::Interrupted)
}

/// Measures on the simulated stand with this gyroscope, in virtual time; `seed` is the seed of the noise.
///
/// # Errors
/// As [`DriftSessionError`].
pub fn simulate(
    gyroscope: SingleAxis,
    seed: u64,
    request: &DriftSessionRequest,
    progress: impl Fn(DriftSessionProgress) -> bool,
) -> Result<DriftRecording, DriftSessionError> {
    let clock = VirtualClock::default();
    let controller = Controller::new(&clock, &StandSetup::default(), LinearMotor::default(), flash(seed), seed)?
        .with_gyro(Box::new(gyroscope.seeded(seed)), seed);
    let result = RefCell::new(None);
    let host = async {
        let mut stand = SimulatedConnection::new(&controller);
        let started = stand.wait_s(SIMULATED_START_S).await;
        let turn = async |place: &Orientation, _: &mut SimulatedConnection<&Controller<'_>>| {
            if let Some(line) = controller.bench().borrow_mut().gyro() {
                line.gyro().set_orientation(*place);
            }
            Ok(())
        };
        let measured = match started {
            Ok(_) => measure(&mut stand, request, turn, progress).await,
            Err(error) => Err(error.into()),
        };
        result.replace(Some(measured));
    };
    controller.run(host, |_| ())?;
    result.into_inner().unwrap_or(Err(DriftSessionError::Incomplete))
}

impl DriftRecording {
    /// The rows as a log, with the notes that a later computation needs. `path` becomes the name of the log; no file is written.
    ///
    /// # Errors
    /// No row was kept.
    pub fn log(&self, path: &Path, plan: &CyclePlan, latitude_deg: Option<f64>) -> Result<Log, LogError> {
        let mut columns: Vec<Column> = ["t_s", "angle_sensor_V", "torquer_A", "drift_mark", "turned_deg", "raised_deg", "rolled_deg"]
            .iter()
            .map(|name| Column { name: (*name).to_owned(), values: Vec::with_capacity(self.rows.len()) })
            .collect();
        let first_s = self.rows.first().map_or(0.0, |row| row[0]);
        let mut place = Orientation::default();
        for (k, row) in self.rows.iter().enumerate() {
            if let Some((_, next)) = self.row_positions.iter().rev().find(|(from, _)| *from <= k) {
                place = *next;
            }
            // A row without a sample of the sensor is left out.
            if row.iter().any(|value| !value.is_finite()) {
                continue;
            }
            let values = [row[0] - first_s, row[1], row[2], row[3]];
            let angles = [place.turned_rad, place.raised_rad, place.rolled_rad].map(f64::to_degrees);
            columns.iter_mut().zip(values.into_iter().chain(angles)).for_each(|(column, value)| column.values.push(value));
        }
        let pulse_s = self.cycles.first().map_or(plan.pulse_s, ReportedCycle::pulse_s);
        let mut notes = Notes::from_iter([
            Note::Number("angle_gain_V_rad", self.scales.angle_gain_V_rad),
            Note::Number("torquer_gain_rad_s_A", self.scales.torquer_gain_rad_s_A),
            Note::Number("angle_limit_V", self.scales.angle_limit_V),
            Note::Number("pulse_s", pulse_s),
            Note::Text("sequence", plan.sequence.to_lowercase()),
            Note::Text("shape", plan.shape.to_lowercase()),
        ]);
        notes.extend(latitude_deg.map(|latitude_deg| Note::Number("latitude_deg", latitude_deg)));
        Log::new(path, columns, notes)
    }
}

/// Turns the platform with the stand's drive to `turned_rad` from its first position. The encoder counts counter-clockwise, azimuths
/// clockwise.
async fn drive_to<S: StandConnection>(stand: &mut S, turned_rad: f64, origin_rad: &mut Option<f64>) -> Result<(), DriftSessionError> {
    let origin = match *origin_rad {
        Some(origin) => origin,
        None => *origin_rad.insert(query_number(stand, "MEASure:ANGLe?").await?),
    };
    let setpoint_rad = origin - turned_rad;
    for command in ["SOURce:MODE POSition".to_owned(), format!("SOURce:POSition {setpoint_rad:e} RAD"), "OUTPut ON".to_owned()] {
        stand.command(&command).await?;
    }
    let mut error_rad = f64::INFINITY;
    for _ in 0..MAX_POSITION_STEPS {
        stand.wait_s(POSITION_INTERVAL_S).await?;
        error_rad = query_number(stand, "MEASure:ANGLe?").await? - setpoint_rad;
        if error_rad.abs() < POSITION_TOLERANCE_RAD {
            stand.wait_s(SETTLING_S).await?;
            return Ok(());
        }
    }
    Err(DriftSessionError::NotReached { error_rad })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(cycles: u32, positions: usize) -> DriftSessionRequest {
        DriftSessionRequest {
            plan: CyclePlan { shape: "RECTangular", reversed: false, sequence: BOTH, pulse_s: 5.0, period_s: 0.02, rest_s: 4.0, cycles },
            rates_rad_s: vec![1e-3],
            positions: vec![Orientation::default(); positions],
            order: VisitOrder::Abba,
            rounds: 1,
            turn_by_drive: false,
            keep_rows: false,
        }
    }

    /// Counts the first signs of each position as the firmware runs them.
    fn signs(request: &DriftSessionRequest) -> Vec<[u32; 2]> {
        let mut counts = vec![[0; 2]; request.positions.len()];
        for (k, (position, cycles)) in request.visits().into_iter().enumerate() {
            match request.sequence(k, cycles) {
                "PLUSminus" => counts[position][0] += cycles,
                "MINusplus" => counts[position][1] += cycles,
                _ => {
                    counts[position][0] += cycles.div_ceil(2);
                    counts[position][1] += cycles / 2;
                }
            }
        }
        counts
    }

    #[test]
    fn every_position_has_both_signs_equally_often() {
        for positions in [2, 3, 4] {
            for cycles in [2, 4, 6, 8, 10] {
                let counts = signs(&request(cycles, positions));
                assert!(counts.iter().all(|[plus, minus]| plus == minus && plus + minus == cycles), "{positions} {cycles}: {counts:?}");
            }
        }
        // One cycle becomes two, one of each sign.
        assert_eq!(signs(&request(1, 2)), [[1, 1], [1, 1]]);
        for positions in [2, 3, 4] {
            for (order, rounds) in [(VisitOrder::Abba, 2), (VisitOrder::Abba, 3), (VisitOrder::Once, 2)] {
                for cycles in [6, 8, 10, 12, 14] {
                    let request = DriftSessionRequest { order, rounds, ..request(cycles, positions) };
                    let counts = signs(&request);
                    assert!(counts.iter().all(|[plus, minus]| plus == minus && plus + minus == cycles), "{positions} {cycles}: {counts:?}");
                }
            }
        }
    }

    #[test]
    fn rounds_visit_each_position_again() {
        let twice = DriftSessionRequest { rounds: 2, ..request(10, 2) };
        assert_eq!(twice.visits(), [(0, 4), (1, 4), (1, 2), (0, 2), (0, 2), (1, 2), (1, 2), (0, 2)]);
        let once = DriftSessionRequest { order: VisitOrder::Once, rounds: 2, ..request(4, 2) };
        assert_eq!(once.visits(), [(0, 2), (1, 2), (0, 2), (1, 2)]);
    }
}

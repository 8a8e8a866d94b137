//! A session on the simulated stand in virtual time; a simulated operator mounts the device under test.

use super::drawn_dut::{drawn_drive, drawn_sensor};
use super::error::RunError;
use super::run::{Operator, Progress, run_session};
use super::{DutKind, Instruction, Mounting, Orientation, PreparedSession, Session};
use crate::connection::{SimulatedConnection, StandConnection};
use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::peripherals::imu as chip;
use hal_sim::plant::{Plant, Stand as Described};
use identification::deadline::Deadline;
use std::cell::RefCell;
use std::path::Path;

/// Full scale of a random sensor where the session has none, rad/s.
const DEFAULT_FULL_SCALE_RAD_S: f64 = 10.0;

/// The simulated stand for a session: `stand`, or the default stand, or for a drive a random one by `seed`. A stand without a sensor gets a
/// random one where the session needs a sensor.
pub fn stand_with_dut(stand: Option<Described>, seed: u64, session: &Session) -> Described {
    let assumed = &session.assumptions;
    if session.dut_kind == DutKind::Drive {
        return stand.unwrap_or_else(|| drawn_drive(seed, assumed).0);
    }
    let mut stand = stand.unwrap_or_default();
    if stand.imu.is_none() {
        stand.imu = Some(drawn_sensor(seed, assumed, session.full_scale_rad_s.unwrap_or(DEFAULT_FULL_SCALE_RAD_S)).0);
    }
    stand
}

/// Runs a session on a simulated stand; `seed` determines all noise. It ends early when `on_progress` returns false, or by the `deadline`.
///
/// # Errors
/// As [`run_session`], which refuses to go on with another seed, since that is another serial number; an invalid stand.
pub fn simulate(
    stand: &Described,
    seed: u64,
    prepared: &PreparedSession,
    folder: &Path,
    deadline: Deadline,
    on_progress: impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    let prepared = &PreparedSession { simulated_seed: Some(seed), ..prepared.clone() };
    // The seed also determines the angle at power-on, spread by the golden ratio.
    let plant = Plant::new(stand, (seed as f64 * 0.618_033_988_749_895).fract() * std::f64::consts::TAU)
        .map_err(|e| RunError::Simulated(e.to_string()))?;
    let clock = VirtualClock::default();
    let controller = Controller::new(&clock, &stand.setup(), plant, flash(seed), seed).map_err(|e| RunError::Simulated(e.to_string()))?;
    let done = RefCell::new(None);
    let host = async {
        let mut line = SimulatedConnection::new(&controller).until(deadline);
        // The device under test needs time after power-on.
        let ended = match line.wait_s(0.3).await {
            Ok(_) => {
                let mut operator = SimulatedOperator::new(&controller, &prepared.session);
                // A resumed session finds the device as the last step left it.
                if let Some(last) = prepared.begun.as_ref().and_then(|journal| journal.steps.last()) {
                    operator.perform(&Instruction::default(), &last.mounting, last.added_inertia_kg_m2.unwrap_or(0.0));
                }
                run_session(&mut line, prepared, folder, &mut operator, on_progress).await
            }
            Err(error) => Err(error.into()),
        };
        done.replace(Some(ended));
    };
    controller.run(host, |_| ()).map_err(|e| RunError::Simulated(e.to_string()))?;
    done.into_inner().unwrap_or_else(|| Err(RunError::Simulated("the simulated stand did not end".into())))
}

/// Mounts the device under test on the simulated stand; the radius keeps its deviation from the assumed one.
pub struct SimulatedOperator<'h, 'c> {
    controller: &'h Controller<'c>,
    radius_error_m: f64,
}

impl<'h, 'c> SimulatedOperator<'h, 'c> {
    /// The operator of a session; the radius of the present mounting is that of its first one, with an error.
    pub fn new(controller: &'h Controller<'c>, session: &Session) -> Self {
        let assumed_m = session.mountings().first().map_or(0.0, |m| m.radius_m);
        let radius_error_m = controller.bench().borrow_mut().imu().map_or(0.0, |imu| imu.mounting().radius_m - assumed_m);
        Self { controller, radius_error_m }
    }
}

impl Operator for SimulatedOperator<'_, '_> {
    fn perform(&mut self, _: &Instruction, m: &Mounting, added_kg_m2: f64) -> Option<String> {
        let orientation = match m.orientation {
            Orientation::Flat => chip::SensorOrientation::Flat,
            Orientation::Side => chip::SensorOrientation::Side,
            Orientation::OtherSide => chip::SensorOrientation::OtherSide,
        };
        let mut bench = self.controller.bench().borrow_mut();
        bench.plant_mut().set_load_inertia(added_kg_m2);
        if let Some(imu) = bench.imu() {
            let chi_rad = imu.mounting().chi_rad;
            imu.set_mounting(chip::Mounting {
                radius_m: m.radius_m + self.radius_error_m,
                chi_rad,
                tilt_rad: m.tilt_deg.to_radians(),
                orientation,
            });
        }
        Some("done by the simulated operator".to_owned())
    }
}

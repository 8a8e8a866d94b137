//! The same session on the simulated stand, in virtual time; who mounts the part there is no person.

use super::Session;
use super::journal::Journal;
use super::run::{Person, Progress, RunError, whole};
use crate::acquire::connection::{SimulatedConnection, StandConnection};
use crate::calibrate::{Lying, Mounted};
use hal_sim::board::PlantPort;
use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::peripherals::imu as chip;
use hal_sim::plant::{Plant, Stand as Described};
use std::cell::RefCell;
use std::path::Path;

/// Runs a session on this stand; all noise is of `seed`.
///
/// # Errors
/// As [`whole`]; a stand that cannot be.
pub fn simulate(
    stand: &Described,
    seed: u64,
    session: &Session,
    text: &str,
    begun: Option<Journal>,
    folder: &Path,
    goes: impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    // Where the disc stands at power-on is of the seed too: the golden ratio spreads it.
    let plant = Plant::new(stand, (seed as f64 * 0.618_033_988_749_895).fract() * std::f64::consts::TAU)
        .map_err(|e| RunError::Simulated(e.to_string()))?;
    let clock = VirtualClock::default();
    let controller = Controller::new(&clock, &stand.setup(), plant, flash(seed), seed).map_err(|e| RunError::Simulated(e.to_string()))?;
    let done = RefCell::new(None);
    let host = async {
        let mut line = SimulatedConnection::new(&controller);
        // The sensor under test wants a moment after power-on.
        let ended = match line.wait_s(0.3).await {
            Ok(_) => {
                let mut robot = Robot::new(&controller, session);
                // A session that goes on finds the part as it was left.
                if let Some(last) = begun.as_ref().and_then(|journal| journal.steps.last()) {
                    robot.does("", &last.mounted, last.added_inertia_kg_m2.unwrap_or(0.0));
                }
                whole(&mut line, session, text, begun, folder, &mut robot, goes).await
            }
            Err(error) => Err(error.into()),
        };
        done.replace(Some(ended));
    };
    controller.run(host, |_| ()).map_err(|e| RunError::Simulated(e.to_string()))?;
    done.into_inner().unwrap_or_else(|| Err(RunError::Simulated("the simulated stand did not end".into())))
}

/// The simulated stand does it by itself; the part stays off by what it is off from where it is believed to be.
struct Robot<'h, 'c, P> {
    controller: &'h Controller<'c, P>,
    off_m: f64,
}

impl<'h, 'c, P: PlantPort> Robot<'h, 'c, P> {
    fn new(controller: &'h Controller<'c, P>, session: &Session) -> Self {
        let believed_m = session.mounted().first().map_or(0.0, |m| m.radius_m);
        let off_m = controller.bench().borrow_mut().imu().map_or(0.0, |imu| imu.mounted().radius_m - believed_m);
        Self { controller, off_m }
    }
}

impl<P: PlantPort> Person for Robot<'_, '_, P> {
    fn does(&mut self, _: &str, m: &Mounted, added_kg_m2: f64) -> Option<String> {
        let lying = match m.lying {
            Lying::Flat => chip::Lying::Flat,
            Lying::Side => chip::Lying::Side,
            Lying::OtherSide => chip::Lying::OtherSide,
        };
        let mut bench = self.controller.bench().borrow_mut();
        bench.plant_mut().carry(added_kg_m2);
        if let Some(imu) = bench.imu() {
            let chi_rad = imu.mounted().chi_rad;
            imu.mount(chip::Mounted { radius_m: m.radius_m + self.off_m, chi_rad, tilt_rad: m.tilt_deg.to_radians(), lying });
        }
        Some("done by the simulated stand".to_owned())
    }
}

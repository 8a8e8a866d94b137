//! Self-test. Without motion: zero of the current sensor, supply, sensor under test; at power-on and by `*TST?`. With motion, when asked
//! (`TEST:DRIVe:STARt`): [`super::drive_test`].

use super::drive_test::{IN_MOTION, Names, TEST_ROWS, TEST_V};
use super::state::{Activity, Run, State};
use crate::console::errors::{Code, ErrorEntry};
use crate::measurement_loop::Row;
use crate::profile::{Profile, ProfileConfig, ProfileKind};
use crate::sensors;
use crate::speed_loop::Mode;

/// Greatest current without voltage, A: ten times the noise of the sensor.
const MAX_ZERO_A: f64 = 0.1;

/// Names of the findings without motion, from bit 4 of `*TST?` on.
const AT_REST: [&str; 3] = ["current sensor's zero", "supply out of limits", "sensor under test has failed"];
/// Findings without motion, as bits 0 to 2; the first two only while the drive is off.
pub fn at_rest(state: &State<'_>) -> u8 {
    let row = state.measured.row.get();
    let (settings, hardware) = (state.settings.kept.get().settings.safety, state.hardware);
    let is_off = row.mode == Mode::Off && row.loop_rate_rad_s.abs() < 0.1;
    let zero = row.i_A.is_some_and(|current_A| current_A.abs() > MAX_ZERO_A);
    let supply = row.supply_V.is_some_and(|volts| {
        volts < settings.supply_low_share * hardware.supply_nominal_V || volts > settings.supply_high_share * hardware.supply_nominal_V
    });
    let status = state.dut.shared.status();
    let sensor = status.samples > 0 && matches!(status.state, sensors::State::Failed(_));
    u8::from(is_off && zero) | u8::from(is_off && supply) << 1 | u8::from(sensor) << 2
}

/// Reports the findings at power-on.
pub fn report_at_rest(state: &State<'_>) {
    let found = at_rest(state);
    if found != 0 {
        state.report(ErrorEntry::with(Code::SELF_TEST, Names(found, &AT_REST)));
    }
}

/// Starts the test with motion.
///
/// # Errors
/// A fault is latched, or the drive is on.
pub fn start(state: &State<'_>) -> Result<(), ErrorEntry> {
    state.require_no_fault()?;
    state.require_at_rest()?;
    let profile = Profile::for_mode(&ProfileConfig::new(ProfileKind::Constant, TEST_V, 1), Mode::Voltage)
        .map_err(|error| ErrorEntry::with(Code::SETTING, error))?;
    state.drive_test.begin();
    state.drive.activity.set(Activity::Profile);
    state.drive.start(Run { profile, mode: Mode::Voltage, rows_left: TEST_ROWS, activity: Activity::Profile });
    Ok(())
}

/// The next row, for the test with motion.
pub fn row(state: &State<'_>, row: &Row) {
    let found = state.drive_test.row(row, state.is_busy(), &state.hardware, &state.settings.kept.get().settings);
    if let Some(found @ 1..) = found {
        state.report(ErrorEntry::with(Code::SELF_TEST, Names(found, &IN_MOTION)));
    }
}

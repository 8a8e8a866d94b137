//! Supervision in a task, once per row: temperature, silent sensors, silent host, index against count.
//!
//! In: the supervised quantities of each row, and signs of life of the host. Out: the present fault, for as long as its cause persists; it
//! goes to the interrupt as the `trip` of a command and is latched there.

use super::Settings;
use crate::board::{Hardware, ROW_HZ};
use crate::status::Fault;

/// Turns by the count within which the next index must come.
const MAX_TURNS_WITHOUT_INDEX: f64 = 1.25;

/// Longest silence of the host while the drive is on, unless `HOST:ARM` names another or `HOST:UNATTended` allows it, s: a vanished program
/// leaves nothing turning.
pub const HOST_TIMEOUT_S: f64 = 2.0;

/// Time for which a new set-up or a self-test of the sensor under test may interrupt its samples, s.
const BUSY_S: f64 = 2.0;

/// A supervised sensor: whether it has delivered anything, and rows since then.
#[derive(Clone, Copy, Debug, Default)]
struct Sensor {
    detected: bool,
    silent_rows: u32,
}

impl Sensor {
    /// Rows for which a detected sensor has delivered nothing without being `busy`; 0 for a sensor that was never detected.
    fn silent_rows(&mut self, delivers: bool, busy: bool) -> u32 {
        self.detected |= delivers;
        self.silent_rows = if delivers || busy || !self.detected { 0 } else { self.silent_rows.saturating_add(1) };
        self.silent_rows
    }
}

/// Supervised quantities of a row.
#[derive(Clone, Copy, Debug, Default)]
pub struct RowState {
    /// Time since the start of the session, s.
    pub t_s: f64,
    /// Angle, rad.
    pub theta_rad: f64,
    /// Angle from the last index, rad; `None` before the first.
    pub from_index_rad: Option<f64>,
    /// An index pulse has started since the row before.
    pub has_passed_index: bool,
    /// The drive is on.
    pub is_driven: bool,
    /// Temperature of the winding, °C; `None` without a sensor.
    pub temp_C: Option<f64>,
    /// The stand's rate sensor has delivered.
    pub has_rate: bool,
    /// The sensor under test has delivered.
    pub has_dut: bool,
}

/// State between rows.
#[derive(Clone, Copy, Debug)]
pub struct RowSupervisor {
    settings: Settings,
    rad_per_count: f64,
    rate_sensor: Sensor,
    dut: Sensor,
    /// Rows for which the sensor under test may be silent because of a new set-up or a self-test.
    busy_rows: u32,
    /// Rows without a sign of the host after which it is lost, also while the drive is off; `None`: [`HOST_TIMEOUT_S`], while it is on.
    host_timeout_rows: Option<u32>,
    host_silent_rows: u32,
    /// Time (s) and angle at the index (rad) of the last row with an index.
    index: Option<(f64, f64)>,
    /// A fault was cleared, and no index has come since.
    index_search: bool,
    /// Angle from the last index at which the search for the next one began, rad.
    search_from_rad: f64,
}

impl RowSupervisor {
    /// A supervisor with these thresholds.
    pub fn new(settings: &Settings, hardware: &Hardware) -> Self {
        Self {
            settings: *settings,
            rad_per_count: hardware.rad_per_count(),
            rate_sensor: Sensor::default(),
            dut: Sensor::default(),
            busy_rows: 0,
            host_timeout_rows: None,
            host_silent_rows: 0,
            index: None,
            index_search: false,
            search_from_rad: 0.0,
        }
    }

    /// A fault has been cleared at this row: the search for a missing index begins at the present angle, so that the stand can turn to it.
    pub fn restart_index_search(&mut self, row: &RowState) {
        self.index_search = true;
        self.search_from_rad = row.from_index_rad.unwrap_or(0.0);
    }

    /// Other thresholds.
    pub fn set_settings(&mut self, settings: &Settings) {
        self.settings = *settings;
    }

    /// Supervises the host with this timeout, also while the drive is off; `None`: with [`HOST_TIMEOUT_S`], while it is on.
    pub fn set_host_timeout(&mut self, seconds: Option<f64>) {
        self.host_timeout_rows = seconds.map(rows);
        self.host_silent_rows = 0;
    }

    /// The sensor under test takes a new set-up or tests itself.
    pub fn set_dut_busy(&mut self) {
        self.busy_rows = rows(BUSY_S);
    }

    /// A sign of life of the host, or it need not give one.
    pub fn host_heard(&mut self) {
        self.host_silent_rows = 0;
    }

    /// The next row: the present fault; the first one of temperature, sensor, host and index.
    pub fn update(&mut self, row: &RowState) -> Fault {
        let hot = row.temp_C.is_some_and(|celsius| celsius > self.settings.temperature_C);
        let silent = self.sensor_is_silent(row);
        let is_supervised = row.is_driven || self.host_timeout_rows.is_some();
        self.host_silent_rows = if is_supervised { self.host_silent_rows.saturating_add(1) } else { 0 };
        let host_lost = self.host_silent_rows > self.host_timeout_rows.unwrap_or(const { (HOST_TIMEOUT_S * ROW_HZ as f64) as u32 });
        let index_lost = self.is_index_lost(row);
        match (hot, silent, host_lost, index_lost) {
            (true, ..) => Fault::Temperature,
            (_, true, ..) => Fault::SensorSilent,
            (_, _, true, _) => Fault::HostSilent,
            (_, _, _, true) => Fault::IndexLost,
            _ => Fault::None,
        }
    }

    /// A detected sensor delivers nothing.
    fn sensor_is_silent(&mut self, row: &RowState) -> bool {
        let busy = self.busy_rows > 0;
        self.busy_rows = self.busy_rows.saturating_sub(1);
        let silent = self.rate_sensor.silent_rows(row.has_rate, false).max(self.dut.silent_rows(row.has_dut, busy));
        silent > rows(self.settings.sensor_silent_s)
    }

    /// The index does not fit the count, or has not come for more than a turn.
    fn is_index_lost(&mut self, row: &RowState) -> bool {
        let Some(from_rad) = row.from_index_rad else {
            self.index = None;
            return false;
        };
        let at_rad = row.theta_rad - from_rad;
        let before = self.index.replace((row.t_s, at_rad));
        let moved = match before {
            // A new session has another zero of the angle.
            Some((t_s, before_rad)) if row.t_s > t_s => (at_rad - before_rad) / core::f64::consts::TAU,
            _ => 0.0,
        };
        let counts_per_turn = core::f64::consts::TAU / self.rad_per_count;
        let mut error_counts = (moved - libm::round(moved)).abs() * counts_per_turn;
        // The index has come, or moved in a row that was lost; less than half a count is rounding.
        if row.has_passed_index || moved.abs() * counts_per_turn > 0.5 {
            self.search_from_rad = 0.0;
            // After a cleared fault counts may be missing: the first index is the new zero.
            if core::mem::take(&mut self.index_search) {
                error_counts = 0.0;
            }
        }
        error_counts > self.settings.index_off_counts
            || (from_rad - self.search_from_rad).abs() > MAX_TURNS_WITHOUT_INDEX * core::f64::consts::TAU
    }
}

/// Rows in `seconds`, rounded up; 0 for a time that is not positive.
fn rows(seconds: f64) -> u32 {
    libm::ceil(seconds * ROW_HZ as f64) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn supervisor() -> RowSupervisor {
        RowSupervisor::new(&Settings::default(), &Hardware::default())
    }

    /// A row of a stand at 10 rad/s, with its index at each whole turn.
    fn row(k: u32) -> RowState {
        let theta_rad = 0.01 * f64::from(k);
        let from = theta_rad % core::f64::consts::TAU;
        RowState {
            t_s: f64::from(k) * 1e-3,
            theta_rad,
            from_index_rad: Some(from),
            has_rate: true,
            temp_C: Some(40.0),
            ..RowState::default()
        }
    }

    #[test]
    fn a_rotating_stand_has_no_fault() {
        let mut supervisor = supervisor();
        assert!((0..20_000).all(|k| supervisor.update(&row(k)) == Fault::None));
    }

    #[test]
    fn temperature_is_a_fault_while_it_is_too_high() {
        let mut supervisor = supervisor();
        assert_eq!(supervisor.update(&RowState { temp_C: Some(100.1), ..row(0) }), Fault::Temperature);
        assert_eq!(supervisor.update(&RowState { temp_C: Some(99.9), ..row(1) }), Fault::None);
    }

    #[test]
    fn a_detected_sensor_must_deliver_and_a_missing_one_need_not() {
        let mute = |k| RowState { has_rate: false, ..row(k) };
        let mut never = supervisor();
        assert!((0..1_000).all(|k| never.update(&mute(k)) == Fault::None));
        let mut supervisor = supervisor();
        supervisor.update(&row(0));
        assert!((1..=100).all(|k| supervisor.update(&mute(k)) == Fault::None));
        assert_eq!(supervisor.update(&mute(101)), Fault::SensorSilent);
        assert_eq!(supervisor.update(&row(102)), Fault::None, "it is back");
    }

    #[test]
    fn the_dut_may_pause_for_a_self_test() {
        let gives = |k| RowState { has_dut: true, ..row(k) };
        let (mut supervisor, mut none) = (supervisor(), supervisor());
        supervisor.update(&gives(0));
        assert!((1..=100).all(|k| supervisor.update(&row(k)) == Fault::None));
        assert_eq!(supervisor.update(&row(101)), Fault::SensorSilent);
        assert_eq!(supervisor.update(&gives(102)), Fault::None);
        supervisor.set_dut_busy();
        assert!((103..2103).all(|k| supervisor.update(&row(k)) == Fault::None), "a self-test");
        assert!((2103..2203).all(|k| supervisor.update(&row(k)) == Fault::None), "and the usual time after it");
        assert_eq!(supervisor.update(&row(2203)), Fault::SensorSilent, "but no sample came");
        none.set_dut_busy();
        assert!((0..5_000).all(|k| none.update(&row(k)) == Fault::None), "a stand without one");
    }

    #[test]
    fn the_host_is_supervised_while_the_drive_is_on_and_on_request() {
        let driven = |k| RowState { is_driven: true, ..row(k) };
        let mut supervisor = supervisor();
        assert!((0..10_000).all(|k| supervisor.update(&row(k)) == Fault::None));
        assert!((10_000..12_000).all(|k| supervisor.update(&driven(k)) == Fault::None));
        assert_eq!(supervisor.update(&driven(12_000)), Fault::HostSilent);
        supervisor.host_heard();
        supervisor.set_host_timeout(Some(0.5));
        assert!((12_001..12_501).all(|k| supervisor.update(&row(k)) == Fault::None));
        assert_eq!(supervisor.update(&row(12_501)), Fault::HostSilent);
        supervisor.host_heard();
        assert_eq!(supervisor.update(&row(12_502)), Fault::None);
        supervisor.set_host_timeout(None);
        assert!((12_503..20_000).all(|k| supervisor.update(&row(k)) == Fault::None));
    }

    #[test]
    fn the_index_passed_backwards_after_a_cleared_fault_is_seen() {
        let mut supervisor = supervisor();
        let at = |k: u32, from_rad: f64, passed: bool| RowState {
            theta_rad: 30.0 + from_rad,
            from_index_rad: Some(from_rad),
            has_passed_index: passed,
            ..row(k)
        };
        assert_eq!(supervisor.update(&at(0, 5.0, false)), Fault::None);
        supervisor.restart_index_search(&at(0, 5.0, false));
        // Back to the same index, and on to the one before it.
        for k in 0..1_100 {
            let from_rad = 5.0 - 0.01 * f64::from(k);
            assert_eq!(supervisor.update(&at(k + 1, from_rad, k == 500)), Fault::None, "{from_rad} rad");
        }
    }

    #[test]
    fn an_index_that_moves_or_is_missing_is_a_fault() {
        let mut supervisor = supervisor();
        (0..100).for_each(|k| assert_eq!(supervisor.update(&row(k)), Fault::None));
        let counts = Hardware::default().rad_per_count();
        let moved = |by: f64| RowState { from_index_rad: row(100).from_index_rad.map(|from| from + by * counts), ..row(100) };
        assert_eq!(
            {
                let mut copy = supervisor;
                copy.update(&moved(7.0))
            },
            Fault::None,
            "eight counts are allowed"
        );
        assert_eq!(supervisor.update(&moved(9.0)), Fault::IndexLost);
        let mut lost = self::supervisor();
        let without = |k: u32| RowState { from_index_rad: Some(0.01 * f64::from(k)), ..row(k) };
        let first = (0..2_000).find(|k| lost.update(&without(*k)) != Fault::None);
        assert_eq!(first, Some(786), "a turn and a quarter are 7.85 rad");
        // Cleared, it may turn as far again.
        lost.restart_index_search(&without(786));
        assert!((786..1_571).all(|k| lost.update(&without(k)) == Fault::None));
        assert!((1_571..1_573).any(|k| lost.update(&without(k)) == Fault::IndexLost));
        // Another session: only the angle's zero changes.
        let mut again = self::supervisor();
        again.update(&row(500));
        assert_eq!(again.update(&RowState { theta_rad: 77.0, t_s: 0.0, ..row(501) }), Fault::None);
    }
}

//! What is slow enough for a task: temperature, a silent sensor, a silent host, an index that does not fit the count.
//!
//! In: each [`Row`], and what is heard of the host. Out: the cause that is there now, for as long as it is there; it goes to the interrupt
//! as the `trip` of an order, which latches it. The watch itself keeps no fault: what clears is the interrupt's.

use super::Settings;
use crate::board::{Hardware, ROW_HZ};
use crate::measurement_loop::Row;
use crate::status::Fault;

/// Turns from the index, by the count, within which the next must have come.
const INDEX_WITHIN_TURNS: f64 = 1.25;

/// How long a new set-up or a self-test may keep the sensor under test from giving samples, s.
const BUSY_S: f64 = 2.0;

/// Whether a sensor was ever there, and for how many rows it has said nothing.
#[derive(Clone, Copy, Debug, Default)]
struct Sensor {
    seen: bool,
    silent_rows: u32,
}

impl Sensor {
    /// For how many rows one that was there has given nothing and was not `busy`. One that was never there is none.
    fn silent_rows(&mut self, gives: bool, busy: bool) -> u32 {
        self.seen |= gives;
        self.silent_rows = if gives || busy || !self.seen { 0 } else { self.silent_rows.saturating_add(1) };
        self.silent_rows
    }
}

/// The watch between rows.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    settings: Settings,
    rad_per_count: f64,
    /// The stand's own rate sensor, and the sensor under test.
    sensors: [Sensor; 2],
    /// Rows for which the sensor under test may be silent because it was told to do something else.
    busy_rows: u32,
    /// Rows after which a host that is not heard is gone; 0: it is not watched.
    host_rows: u32,
    unheard_rows: u32,
    /// Time, and angle at the index, of the last row that knew it, rad.
    index: Option<(f64, f64)>,
    /// A fault was cleared, and no index has come since.
    awaits_anew: bool,
    /// Angle from the index, as last seen, at which the next began to be awaited, rad.
    from_rad: f64,
}

impl Watch {
    /// A watch with these thresholds; the host is not watched until it asks for it.
    pub fn new(settings: &Settings, hardware: &Hardware) -> Self {
        Self {
            settings: *settings,
            rad_per_count: hardware.rad_per_count(),
            sensors: [Sensor::default(); 2],
            busy_rows: 0,
            host_rows: 0,
            unheard_rows: 0,
            index: None,
            awaits_anew: false,
            from_rad: 0.0,
        }
    }

    /// A fault is cleared, `row` being the newest: an index that did not come is awaited from where the stand is now, else the way to it
    /// would stay barred.
    pub fn cleared(&mut self, row: &Row) {
        self.awaits_anew = true;
        self.from_rad = row.from_index_rad.unwrap_or(0.0);
    }

    /// Other thresholds from now on.
    pub fn set(&mut self, settings: &Settings) {
        self.settings = *settings;
    }

    /// The host wants to be watched: silent for longer than `seconds` it is gone. 0 or less: no longer.
    pub fn arm_host(&mut self, seconds: f64) {
        self.host_rows = rows(seconds);
        self.unheard_rows = 0;
    }

    /// The sensor under test was told to take a new set-up, or to test itself.
    pub fn sensor_is_busy(&mut self) {
        self.busy_rows = rows(BUSY_S);
    }

    /// Something was heard of the host.
    pub fn heard(&mut self) {
        self.unheard_rows = 0;
    }

    /// One row further: what is wrong now. Where several are, the first of temperature, sensor, host, index.
    pub fn take(&mut self, row: &Row) -> Fault {
        let hot = row.temp_C.is_some_and(|celsius| celsius > self.settings.temperature_C);
        let silent = self.sensor_is_silent(row);
        self.unheard_rows = self.unheard_rows.saturating_add(1);
        let unheard = self.host_rows > 0 && self.unheard_rows > self.host_rows;
        let off = self.index_is_off(row);
        match (hot, silent, unheard, off) {
            (true, ..) => Fault::Temperature,
            (_, true, ..) => Fault::SensorSilent,
            (_, _, true, _) => Fault::HostSilent,
            (_, _, _, true) => Fault::IndexLost,
            _ => Fault::None,
        }
    }

    /// A sensor that was there gives nothing.
    fn sensor_is_silent(&mut self, row: &Row) -> bool {
        let [own, tested] = &mut self.sensors;
        let busy = self.busy_rows > 0;
        self.busy_rows = self.busy_rows.saturating_sub(1);
        let silent = own.silent_rows(row.omega_rad_s.is_some(), false).max(tested.silent_rows(row.gyro_rad_s.is_some(), busy));
        silent > rows(self.settings.sensor_silent_s)
    }

    /// The index has moved against the count, or has not come for more than a turn.
    fn index_is_off(&mut self, row: &Row) -> bool {
        let Some(from_rad) = row.from_index_rad else {
            self.index = None;
            return false;
        };
        let at_rad = row.theta_rad - from_rad;
        let before = self.index.replace((row.t_s, at_rad));
        let moved = match before {
            // A new session counts its angles from elsewhere.
            Some((t_s, before_rad)) if row.t_s > t_s => (at_rad - before_rad) / core::f64::consts::TAU,
            _ => 0.0,
        };
        let counts_per_turn = core::f64::consts::TAU / self.rad_per_count;
        let mut off_counts = (moved - libm::round(moved)).abs() * counts_per_turn;
        // A new index; less than half a count is rounding.
        if moved.abs() * counts_per_turn > 0.5 {
            self.from_rad = 0.0;
            // After a cleared fault counts may be missing: the first index is the new zero, wherever it comes.
            if core::mem::take(&mut self.awaits_anew) {
                off_counts = 0.0;
            }
        }
        off_counts > self.settings.index_off_counts || (from_rad - self.from_rad).abs() > INDEX_WITHIN_TURNS * core::f64::consts::TAU
    }
}

/// Rows in so many seconds, at least one where there is any time; a time that is none is none.
fn rows(seconds: f64) -> u32 {
    libm::ceil(seconds * ROW_HZ as f64) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn watch() -> Watch {
        Watch::new(&Settings::default(), &Hardware::default())
    }

    /// A row of a stand that turns at 10 rad/s, its index seen at each whole turn.
    fn row(k: u32) -> Row {
        let theta_rad = 0.01 * f64::from(k);
        let from = theta_rad % core::f64::consts::TAU;
        Row {
            t_s: f64::from(k) * 1e-3,
            theta_rad,
            from_index_rad: Some(from),
            omega_rad_s: Some(10.0),
            temp_C: Some(40.0),
            ..Row::default()
        }
    }

    #[test]
    fn nothing_is_wrong_with_a_stand_that_turns() {
        let mut watch = watch();
        assert!((0..20_000).all(|k| watch.take(&row(k)) == Fault::None));
    }

    #[test]
    fn heat_is_a_cause_for_as_long_as_it_is_there() {
        let mut watch = watch();
        assert_eq!(watch.take(&Row { temp_C: Some(100.1), ..row(0) }), Fault::Temperature);
        assert_eq!(watch.take(&Row { temp_C: Some(99.9), ..row(1) }), Fault::None);
    }

    #[test]
    fn a_sensor_that_was_there_and_is_silent_for_a_tenth_of_a_second_is_a_cause_and_one_that_never_was_is_none() {
        let mute = |k| Row { omega_rad_s: None, ..row(k) };
        let mut never = watch();
        assert!((0..1_000).all(|k| never.take(&mute(k)) == Fault::None));
        let mut watch = watch();
        watch.take(&row(0));
        assert!((1..=100).all(|k| watch.take(&mute(k)) == Fault::None));
        assert_eq!(watch.take(&mute(101)), Fault::SensorSilent);
        assert_eq!(watch.take(&row(102)), Fault::None, "it is back");
    }

    #[test]
    fn the_sensor_under_test_is_watched_too_and_may_pause_for_what_it_was_told_to_do() {
        let gives = |k| Row { gyro_rad_s: Some(0.0), ..row(k) };
        let (mut watch, mut none) = (watch(), watch());
        watch.take(&gives(0));
        assert!((1..=100).all(|k| watch.take(&row(k)) == Fault::None));
        assert_eq!(watch.take(&row(101)), Fault::SensorSilent);
        assert_eq!(watch.take(&gives(102)), Fault::None);
        watch.sensor_is_busy();
        assert!((103..2103).all(|k| watch.take(&row(k)) == Fault::None), "a self-test");
        assert!((2103..2203).all(|k| watch.take(&row(k)) == Fault::None), "and as long as ever");
        assert_eq!(watch.take(&row(2203)), Fault::SensorSilent, "but it came to nothing");
        none.sensor_is_busy();
        assert!((0..5_000).all(|k| none.take(&row(k)) == Fault::None), "a stand without one was asked in vain");
    }

    #[test]
    fn a_host_is_watched_where_it_asked_for_it() {
        let mut watch = watch();
        assert!((0..10_000).all(|k| watch.take(&row(k)) == Fault::None));
        watch.arm_host(0.5);
        assert!((10_000..10_500).all(|k| watch.take(&row(k)) == Fault::None));
        assert_eq!(watch.take(&row(10_500)), Fault::HostSilent);
        watch.heard();
        assert_eq!(watch.take(&row(10_501)), Fault::None);
        watch.arm_host(0.0);
        assert!((10_502..20_000).all(|k| watch.take(&row(k)) == Fault::None));
    }

    #[test]
    fn an_index_that_moves_or_does_not_come_is_a_cause() {
        let mut watch = watch();
        (0..100).for_each(|k| assert_eq!(watch.take(&row(k)), Fault::None));
        let counts = Hardware::default().rad_per_count();
        let moved = |by: f64| Row { from_index_rad: row(100).from_index_rad.map(|from| from + by * counts), ..row(100) };
        assert_eq!(
            {
                let mut copy = watch;
                copy.take(&moved(7.0))
            },
            Fault::None,
            "eight counts are allowed"
        );
        assert_eq!(watch.take(&moved(9.0)), Fault::IndexLost);
        let mut lost = self::watch();
        let without = |k: u32| Row { from_index_rad: Some(0.01 * f64::from(k)), ..row(k) };
        let first = (0..2_000).find(|k| lost.take(&without(*k)) != Fault::None);
        assert_eq!(first, Some(786), "a turn and a quarter are 7.85 rad");
        // Cleared, it may turn as far again to look for it.
        lost.cleared(&without(786));
        assert!((786..1_571).all(|k| lost.take(&without(k)) == Fault::None));
        assert!((1_571..1_573).any(|k| lost.take(&without(k)) == Fault::IndexLost));
        // Another session: the angle's zero jumps, and nothing else.
        let mut again = self::watch();
        again.take(&row(500));
        assert_eq!(again.take(&Row { theta_rad: 77.0, t_s: 0.0, ..row(501) }), Fault::None);
    }
}

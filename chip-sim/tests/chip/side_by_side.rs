//! One session on both simulators: the firmware's library on `hal-sim`, and the flashed image on the emulated chip.
//!
//! The two differ in the time at which a command takes effect (one row), in the time between a tick and its reading of the encoder
//! (microseconds on the chip, zero in `hal-sim`), and in the instants at which the current is sampled. Without sensor noise and on the same
//! plant, rows that are aligned at the start of the voltage agree within these. `--nocapture` prints the table of docs/emulated-chip.md.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{BAUD, Chip, Rows};
use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::peripherals::SensorSetup;
use hal_sim::plant::{Plant, Stand};
use stand_firmware::board::{Clock, TICKS_PER_ROW, TICKS_PER_S};
use stand_firmware::telemetry::RowFrame;

/// Angle of the platform from its index at power-on, rad, as in `common`.
const START_RAD: f64 = -0.1;
/// Time before the first line, and after each line, s.
const BOOT_S: f64 = 0.3;
const STEP_S: f64 = 2.0;
/// Rows compared after the start.
const COMPARED: usize = 5_000;

/// The session: one line after the other. A line each two seconds is not enough for a stand that expects a sign of life each two seconds.
/// The lines that set a voltage have one length, so that each takes as long on the wire.
const SESSION: [&str; 4] = [
    "HOST:UNATTended 1E6;:STReam:CHANnels u_V,i_A,theta_rad,supply_V;:STReam ON",
    "SOURce:VOLTage +1;MODE VOLT",
    "SOURce:VOLTage +2;MODE VOLT",
    "SOURce:VOLTage -1;MODE VOLT",
];

fn stand() -> Stand {
    Stand { sensors: SensorSetup::ideal(), ..Stand::default() }
}

fn on_hal_sim() -> Vec<RowFrame> {
    let stand = stand();
    let clock = VirtualClock::default();
    let controller = Controller::new(&clock, &stand.setup(), Plant::new(&stand, START_RAD).unwrap(), flash(1), 1).unwrap();
    let host = async {
        let (line, clock) = (controller.line(), controller.clock());
        let wait = async |seconds: f64| clock.until(clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
        wait(BOOT_S).await;
        let mut received = Rows::default();
        let (mut rows, mut bytes) = (Vec::new(), Vec::new());
        for command in SESSION {
            line.send(format!("{command}\n").as_bytes());
            for _ in 0..(STEP_S / 0.01) as usize {
                wait(0.01).await;
                bytes.clear();
                line.receive(&mut bytes);
                received.take(&bytes, |row| rows.push(*row));
            }
        }
        rows
    };
    controller.run(host, |_| ()).unwrap()
}

fn on_chip_sim() -> Vec<RowFrame> {
    let mut chip = Chip::on(&stand());
    chip.run_s(BOOT_S);
    let mut received = Rows::default();
    let mut rows = Vec::new();
    for command in SESSION {
        chip.machine.send(format!("{command}\n").as_bytes(), BAUD);
        for _ in 0..(STEP_S / 0.01) as usize {
            chip.run_s(0.01);
            received.take(&chip.take_received(), |row| rows.push(*row));
        }
    }
    rows
}

/// The rows from the first one with a voltage on.
fn from_start(rows: &[RowFrame]) -> &[RowFrame] {
    let start = rows.iter().position(|row| value(row, "u_V") > 0.5).expect("a row with voltage");
    &rows[start..start + COMPARED]
}

fn value(row: &RowFrame, name: &str) -> f64 {
    row.value(name).unwrap_or(f64::NAN)
}

/// Greatest and rms difference.
fn statistics(differences: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = differences.clone().count() as f64;
    let most = differences.clone().fold(0.0, |most: f64, d| most.max(d.abs()));
    (most, (differences.map(|d| d * d).sum::<f64>() / count).sqrt())
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn rows_of_one_session_agree() {
    let (hal, chip) = (on_hal_sim(), on_chip_sim());
    let (hal, chip) = (from_start(&hal), from_start(&chip));
    let hardware = stand().hardware;
    let channel = |name: &'static str| hal.iter().zip(chip).map(move |(a, b)| value(b, name) - value(a, name));
    // Time of the readings since the millisecond in which the voltage began; the chip reads the encoder some microseconds after the tick.
    let since = |rows: &[RowFrame], k: usize| (rows[k].at - rows[0].at / TICKS_PER_ROW * TICKS_PER_ROW) as f64 / TICKS_PER_S as f64;
    let angle = (1..COMPARED - 1).map(|k| {
        let rate_rad_s = (value(&hal[k + 1], "theta_rad") - value(&hal[k - 1], "theta_rad")) / 2e-3;
        let late_s = since(chip, k) - since(hal, k);
        value(&chip[k], "theta_rad") - value(&hal[k], "theta_rad") - rate_rad_s * late_s
    });
    let time = (0..COMPARED).map(|k| since(chip, k) - since(hal, k));
    println!("| quantity | greatest difference of {COMPARED} rows | rms |\n|---|---|---|");
    let row = |name: &str, unit: f64, (most, rms): (f64, f64)| println!("| {name} | {:.2} | {:.2} |", most / unit, rms / unit);
    let (voltage, current, supply) = (statistics(channel("u_V")), statistics(channel("i_A")), statistics(channel("supply_V")));
    let (angle, time) = (statistics(angle), statistics(time));
    row("commanded voltage, V", 1.0, voltage);
    row("supply, codes", hardware.supply_V_per_code, supply);
    row("angle at equal times, counts", hardware.rad_per_count(), angle);
    row("current, codes", hardware.current_A_per_code, current);
    row("time of the readings, µs", 1e-6, time);
    assert_eq!(voltage.0, 0.0, "the same library computes the voltage");
    assert_eq!(supply.0, 0.0);
    // Each of the two readings is rounded to a count.
    assert!(angle.0 <= 1.5 * hardware.rad_per_count(), "{angle:?}");
    // A row's mean of twenty samples differs where the voltage steps; elsewhere by the rounding of the codes.
    assert!(current.1 <= hardware.current_A_per_code, "{current:?}");
    // The measurement begins when the tick's handler, up to 14 µs long, and the serial guard have ended.
    assert!(time.0 <= 50e-6, "{time:?}");
}

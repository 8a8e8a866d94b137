//! `MEASure`: the newest row, and what the rows say of turns, rate, drive and sensor; with units.

use super::{Act, Done, Entry, entry, with_unit};
use crate::app::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::text::Writer;
use crate::measurement_loop::Estimate;
use crate::words::{Words, words};

/// Turns over which `MEASure:TURN?` gives the mean.
const TURNS: u32 = 10;

pub(super) const ENTRIES: &[Entry] = &[
    entry!(
        "MEASure:RATE",
        Act::Ask("RAD/S", |state| there(state.rate_rad_s.get(), words!("no rows yet"))),
        "by the encoder's edges, mean over 32 ms",
    ),
    entry!("MEASure:ANGLe", Act::Ask("RAD", |state| Ok(state.row.get().theta_rad)), "by the encoder, unwrapped"),
    entry!(
        "MEASure:INDex",
        Act::Ask("RAD", |state| there(state.row.get().from_index_rad, words!("the index was not seen yet: turn the platform first"))),
        "angle from the index",
    ),
    entry!(
        "MEASure:CURRent",
        Act::Ask("A", |state| there(state.row.get().i_A, words!("no conversion of the current"))),
        "of the motor, mean over 1 ms",
    ),
    entry!("MEASure:SUPPly", Act::Ask("V", |state| there(state.row.get().supply_V, words!("no reading of the supply"))), "of the bridge"),
    entry!("MEASure:VOLTage", Act::Ask("V", |state| Ok(state.row.get().u_V)), "that was asked for, mean over 1 ms"),
    entry!(
        "MEASure:TEMPerature",
        Act::Ask("CEL", |state| there(state.row.get().temp_C, words!("no reading of the temperature"))),
        "of the winding"
    ),
    entry!(
        "MEASure:GYRO",
        Act::Ask("RAD/S", |state| {
            let row = state.row.get();
            there(row.gyro_rad_s.or(row.omega_rad_s), words!("no rate sensor gives a sample: IMU? says why"))
        }),
        "the sensor under test",
    ),
    entry!(
        "MEASure:TURN",
        Act::Say(words!("last turn S, mean rate RAD/S, over turns, age S"), turn),
        "whole turns by the index and the crystal"
    ),
    entry!(
        "MEASure:STABility",
        Act::Say(words!("for 1, 10, 360 DEG: mean RAD/S, 1 sigma PPM, windows"), stability),
        "how steadily it turns"
    ),
    entry!("MEASure:STABility:RESet", Act::Do(|state| (state.instruments.restart_stability(), Ok(())).1), "begin anew"),
    entry!(
        "MEASure:DRIVe",
        Act::Say(words!("R OHM, K N.M/A, J KG.M2, b N.M.S, c N.M, each +- 1 sigma; windows"), drive),
        "the drive, from its own rows",
    ),
    entry!("MEASure:DRIVe:RESet", Act::Do(|state| (state.instruments.restart_drive(), Ok(())).1), "begin anew"),
    entry!(
        "MEASure:SENSor",
        Act::Say(words!("scale, bias RAD/S, delay S, each +- 1 sigma; windows"), sensor),
        "the rate sensor against the encoder",
    ),
    entry!("MEASure:SENSor:RESet", Act::Do(|state| (state.instruments.restart_sensor(), Ok(())).1), "begin anew"),
    entry!("MEASure:TIMing", Act::Say(words!("rows, missed, least, mean, greatest, 1 sigma S"), timing), "how evenly the rows come"),
    entry!("MEASure:TIMing:RESet", Act::Do(|state| (state.instruments.restart_timing(), Ok(())).1), "begin anew"),
];

/// A reading, or why there is none.
fn there<T>(value: Option<T>, why: Words) -> Result<T, ErrorEntry> {
    value.ok_or_else(|| ErrorEntry::saying(Code::DATA_STALE, why))
}

/// A number with its unit, and a comma before the next.
fn next(out: &mut Writer<'_>, value: f64, unit: &str) {
    if out.length() > 0 {
        out.byte(b',');
    }
    with_unit(out, value, unit);
}

fn estimate(out: &mut Writer<'_>, estimate: &Estimate, unit: &str) {
    if out.length() > 0 {
        out.byte(b',');
    }
    if estimate.sigma.is_finite() && estimate.value.is_finite() {
        out.number(estimate.value, 6).text(" +- ").number(estimate.sigma, 2);
        out.text(if unit.is_empty() { "" } else { " " }).text(unit);
    } else {
        out.text("NAN");
    }
}

fn turn(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let turn = there(state.instruments.turn(TURNS), words!("no whole turn yet"))?;
    next(out, turn.turn_s, "S");
    next(out, turn.rate_rad_s, "RAD/S");
    next(out, f64::from(turn.turns), "");
    next(out, turn.age_s, "S");
    Ok(())
}

fn stability(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    for window in state.instruments.stability() {
        next(out, window.rate_rad_s, "RAD/S");
        next(out, window.relative().map_or(f64::NAN, |relative| relative * 1e6), "PPM");
        next(out, f64::from(window.windows), "");
    }
    Ok(())
}

fn drive(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let drive = there(state.instruments.drive(), words!("not enough motion yet: run a profile both ways"))?;
    estimate(out, &drive.resistance_ohm, "OHM");
    estimate(out, &drive.motor_constant_N_m_A, "N.M/A");
    estimate(out, &drive.inertia_kg_m2, "KG.M2");
    estimate(out, &drive.viscous_N_m_s, "N.M.S");
    estimate(out, &drive.coulomb_N_m, "N.M");
    next(out, f64::from(drive.windows), "");
    Ok(())
}

fn sensor(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let sensor = there(state.instruments.sensor(), words!("not enough motion with a rate sensor yet: IMU? says why"))?;
    estimate(out, &sensor.scale, "");
    estimate(out, &sensor.bias_rad_s, "RAD/S");
    estimate(out, &sensor.delay_s, "S");
    next(out, f64::from(sensor.windows), "");
    Ok(())
}

fn timing(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let timing = state.instruments.timing();
    next(out, f64::from(timing.rows), "");
    next(out, f64::from(timing.missed), "");
    next(out, timing.least_s, "S");
    next(out, timing.mean_s, "S");
    next(out, timing.greatest_s, "S");
    next(out, timing.sigma_s.unwrap_or(f64::NAN), "S");
    Ok(())
}

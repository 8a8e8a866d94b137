//! `MEASure`: the newest row, and the estimates of turns, rate stability, drive, sensor and timing, with units.

use super::{Action, Done, Entry, entry};
use crate::app::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::measurement_loop::Estimate;
use crate::text::{Significant, WithUnit};
use core::fmt::Write;

/// Turns in the mean of `MEASure:TURN?`.
const TURNS: u32 = 10;

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "MEASure:RATE",
        Action::NumberQuery("RAD/S", |state| available(state.measured.rate_rad_s.get(), "no row was measured yet")),
        "rate from the encoder's edges, mean over 32 ms",
    ),
    entry("MEASure:ANGLe", Action::NumberQuery("RAD", |state| Ok(state.measured.row.get().theta_rad)), "angle of the encoder, unwrapped"),
    entry(
        "MEASure:INDex",
        Action::NumberQuery("RAD", |state| {
            available(state.measured.row.get().from_index_rad, "the index was not seen since power-on: turn the platform first")
        }),
        "angle from the index",
    ),
    entry(
        "MEASure:CURRent",
        Action::NumberQuery("A", |state| available(state.measured.row.get().i_A, "the current was not converted")),
        "motor current, mean over 1 ms",
    ),
    entry(
        "MEASure:SUPPly",
        Action::NumberQuery("V", |state| available(state.measured.row.get().supply_V, "the supply was not converted")),
        "supply voltage of the bridge",
    ),
    entry("MEASure:VOLTage", Action::NumberQuery("V", |state| Ok(state.measured.row.get().u_V)), "commanded voltage, mean over 1 ms"),
    entry(
        "MEASure:TEMPerature",
        Action::NumberQuery("CEL", |state| available(state.measured.row.get().temp_C, "the temperature was not converted")),
        "temperature of the winding",
    ),
    entry(
        "MEASure:GYRO",
        Action::NumberQuery("RAD/S", |state| {
            let row = state.measured.row.get();
            available(row.gyro_rad_s.or(row.omega_rad_s), "no rate sensor gives samples: IMU? gives the reason")
        }),
        "rate of the sensor under test, else of the stand's rate sensor",
    ),
    entry(
        "MEASure:TURN",
        Action::TextQuery("last turn S,mean rate RAD/S,turns in the mean,age S", turn),
        "whole turns by index and crystal",
    ),
    entry(
        "MEASure:STABility",
        Action::TextQuery("for 1, 10, 360 DEG: mean RAD/S,standard deviation PPM,windows", stability),
        "stability of the rate",
    ),
    entry("MEASure:STABility:RESet", Action::Event(|state| (state.measured.instruments.restart_stability(), Ok(())).1), "restart"),
    entry(
        "MEASure:DRIVe",
        Action::TextQuery("R OHM,K N.M/A,J KG.M2,b N.M.S,c N.M, each +- standard uncertainty; windows", drive),
        "parameters of the drive, estimated from its rows",
    ),
    entry("MEASure:DRIVe:RESet", Action::Event(|state| (state.measured.instruments.restart_drive(), Ok(())).1), "restart"),
    entry(
        "MEASure:SENSor",
        Action::TextQuery("scale,bias RAD/S,delay S, each +- standard uncertainty; windows", sensor),
        "the rate sensor compared with the encoder",
    ),
    entry("MEASure:SENSor:RESet", Action::Event(|state| (state.measured.instruments.restart_sensor(), Ok(())).1), "restart"),
    entry(
        "MEASure:TIMing",
        Action::TextQuery("rows,missed,least S,mean S,greatest S,standard deviation S", timing),
        "intervals between the rows",
    ),
    entry("MEASure:TIMing:RESet", Action::Event(|state| (state.measured.instruments.restart_timing(), Ok(())).1), "restart"),
];

/// The value, or an error with the reason why there is none.
fn available<T>(value: Option<T>, reason: &str) -> Result<T, ErrorEntry> {
    value.ok_or_else(|| ErrorEntry::with(Code::DATA_STALE, reason))
}

/// Writes an estimate as `value +- uncertainty unit,`.
fn write_estimate(out: &mut dyn Write, estimate: &Estimate, unit: &str) -> Done {
    if estimate.sigma.is_finite() && estimate.value.is_finite() {
        let separator = if unit.is_empty() { "" } else { " " };
        write!(out, "{} +- {}{separator}{unit},", Significant(estimate.value, 6), Significant(estimate.sigma, 2))?;
    } else {
        out.write_str("NAN,")?;
    }
    Ok(())
}

fn turn(state: &State<'_>, out: &mut dyn Write) -> Done {
    let turn = available(state.measured.instruments.turn(TURNS), "no whole turn was measured yet")?;
    let (turn_s, rate, age) = (WithUnit(turn.turn_s, "S"), WithUnit(turn.rate_rad_s, "RAD/S"), WithUnit(turn.age_s, "S"));
    Ok(write!(out, "{turn_s},{rate},{},{age}", turn.turns)?)
}

fn stability(state: &State<'_>, out: &mut dyn Write) -> Done {
    let mut separator = "";
    for window in state.measured.instruments.stability() {
        let deviation = WithUnit(window.relative().map_or(f64::NAN, |relative| relative * 1e6), "PPM");
        write!(out, "{separator}{},{deviation},{}", WithUnit(window.rate_rad_s, "RAD/S"), window.windows)?;
        separator = ",";
    }
    Ok(())
}

fn drive(state: &State<'_>, out: &mut dyn Write) -> Done {
    let drive = available(state.measured.instruments.drive(), "too little motion yet: run a profile in both directions")?;
    write_estimate(out, &drive.resistance_ohm, "OHM")?;
    write_estimate(out, &drive.motor_constant_N_m_A, "N.M/A")?;
    write_estimate(out, &drive.inertia_kg_m2, "KG.M2")?;
    write_estimate(out, &drive.viscous_N_m_s, "N.M.S")?;
    write_estimate(out, &drive.coulomb_N_m, "N.M")?;
    Ok(write!(out, "{}", drive.windows)?)
}

fn sensor(state: &State<'_>, out: &mut dyn Write) -> Done {
    let sensor = available(state.measured.instruments.sensor(), "too little motion with a rate sensor yet: IMU? shows its status")?;
    write_estimate(out, &sensor.scale, "")?;
    write_estimate(out, &sensor.bias_rad_s, "RAD/S")?;
    write_estimate(out, &sensor.delay_s, "S")?;
    Ok(write!(out, "{}", sensor.windows)?)
}

fn timing(state: &State<'_>, out: &mut dyn Write) -> Done {
    let timing = state.measured.instruments.timing();
    write!(out, "{},{}", timing.rows, timing.missed)?;
    for seconds in [timing.min_s, timing.mean_s, timing.max_s, timing.sigma_s.unwrap_or(f64::NAN)] {
        write!(out, ",{}", WithUnit(seconds, "S"))?;
    }
    Ok(())
}

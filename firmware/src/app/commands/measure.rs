//! `MEASure`: the newest row, and the estimates of turns, rate stability, drive, sensor, timing and clock. `FORMat:UNITs`: the form of all
//! numbers in replies.

use super::{Action, Done, Entry, entry};
use crate::app::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::measurement_loop::Estimate;
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
        Action::TextQuery("R OHM,K N.M/A,J KG.M2,b N.M.S,c N.M, each followed by its standard uncertainty; windows", drive),
        "parameters of the drive, estimated from its rows",
    ),
    entry("MEASure:DRIVe:RESet", Action::Event(|state| (state.measured.instruments.restart_drive(), Ok(())).1), "restart"),
    entry(
        "MEASure:SENSor",
        Action::TextQuery("scale,bias RAD/S,delay S, each followed by its standard uncertainty; windows", sensor),
        "the rate sensor compared with the encoder",
    ),
    entry("MEASure:SENSor:RESet", Action::Event(|state| (state.measured.instruments.restart_sensor(), Ok(())).1), "restart"),
    entry(
        "MEASure:TIMing",
        Action::TextQuery("rows,missed,least S,mean S,greatest S,standard deviation S", timing),
        "intervals between the rows",
    ),
    entry(
        "MEASure:CLOCk",
        Action::TextQuery("pulses,rejected edges,seconds S,timer steps in them,their standard deviation HZ", clock),
        "the crystal compared with a reference of one pulse per second",
    ),
    entry("MEASure:CLOCk:RESet", Action::Event(|state| (state.measured.instruments.restart_clock(), Ok(())).1), "restart"),
    entry(
        "FORMat:UNITs",
        Action::Switch { read: |state| state.out.has_units.get(), write: |state, on| (state.out.has_units.set(on), Ok(())).1 },
        "units behind the numbers of replies, for people; OFF after power-on, *RST and HOST:RELease",
    ),
    entry("MEASure:TIMing:RESet", Action::Event(|state| (state.measured.instruments.restart_timing(), Ok(())).1), "restart"),
];

/// The value, or an error with the reason why there is none.
fn available<T>(value: Option<T>, reason: &str) -> Result<T, ErrorEntry> {
    value.ok_or_else(|| ErrorEntry::with(Code::DATA_STALE, reason))
}

/// Writes an estimate and its uncertainty, each with a comma behind it.
fn write_estimate(state: &State<'_>, out: &mut dyn Write, estimate: &Estimate, unit: &'static str) -> Done {
    Ok(write!(out, "{},{},", state.with_unit(estimate.value, unit), state.with_unit(estimate.sigma, unit))?)
}

fn turn(state: &State<'_>, out: &mut dyn Write) -> Done {
    let turn = available(state.measured.instruments.turn(TURNS), "no whole turn was measured yet")?;
    let (turn_s, rate, age) =
        (state.with_unit(turn.turn_s, "S"), state.with_unit(turn.rate_rad_s, "RAD/S"), state.with_unit(turn.age_s, "S"));
    Ok(write!(out, "{turn_s},{rate},{},{age}", turn.turns)?)
}

fn stability(state: &State<'_>, out: &mut dyn Write) -> Done {
    let mut separator = "";
    for window in state.measured.instruments.stability() {
        let deviation = state.with_unit(window.relative().map_or(f64::NAN, |relative| relative * 1e6), "PPM");
        write!(out, "{separator}{},{deviation},{}", state.with_unit(window.rate_rad_s, "RAD/S"), window.windows)?;
        separator = ",";
    }
    Ok(())
}

fn drive(state: &State<'_>, out: &mut dyn Write) -> Done {
    let drive = available(state.measured.instruments.drive(), "too little motion yet: run a profile in both directions")?;
    write_estimate(state, out, &drive.resistance_ohm, "OHM")?;
    write_estimate(state, out, &drive.motor_constant_N_m_A, "N.M/A")?;
    write_estimate(state, out, &drive.inertia_kg_m2, "KG.M2")?;
    write_estimate(state, out, &drive.viscous_N_m_s, "N.M.S")?;
    write_estimate(state, out, &drive.coulomb_N_m, "N.M")?;
    Ok(write!(out, "{}", drive.windows)?)
}

fn sensor(state: &State<'_>, out: &mut dyn Write) -> Done {
    let sensor = available(state.measured.instruments.sensor(), "too little motion with a rate sensor yet: IMU? shows its status")?;
    write_estimate(state, out, &sensor.scale, "")?;
    write_estimate(state, out, &sensor.bias_rad_s, "RAD/S")?;
    write_estimate(state, out, &sensor.delay_s, "S")?;
    Ok(write!(out, "{}", sensor.windows)?)
}

fn timing(state: &State<'_>, out: &mut dyn Write) -> Done {
    let timing = state.measured.instruments.timing();
    write!(out, "{},{}", timing.rows, timing.missed)?;
    for seconds in [timing.min_s, timing.mean_s, timing.max_s, timing.sigma_s.unwrap_or(f64::NAN)] {
        write!(out, ",{}", state.with_unit(seconds, "S"))?;
    }
    Ok(())
}

fn clock(state: &State<'_>, out: &mut dyn Write) -> Done {
    let clock = state.measured.instruments.clock();
    let seconds = state.with_unit(f64::from(clock.seconds), "S");
    let deviation = state.with_unit(clock.deviation_Hz.unwrap_or(f64::NAN), "HZ");
    Ok(write!(out, "{},{},{seconds},{},{deviation}", clock.pulses, clock.rejected, clock.steps)?)
}

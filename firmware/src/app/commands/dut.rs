//! `IMU`: the sensor under test: its status, set-up and self-test.

use super::{Action, Done, Entry, entry};
use crate::app::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use crate::sensors::{self, Setup};
use core::fmt::Write;

const RAD_PER_DEG: f64 = core::f64::consts::PI / 180.0;

pub(super) const ENTRIES: &[Entry] = &[
    entry("IMU", Action::TextQuery("part,state,samples,lost samples,refused words", status), "status, or the reason why it does not run"),
    entry(
        "IMU:TEMPerature",
        Action::NumberQuery("CEL", |state| {
            let temperature_C = state.dut.shared.status().temperature_C;
            temperature_C.map(f64::from).ok_or_else(|| ErrorEntry::with(Code::HARDWARE, "no temperature was read yet: see IMU?"))
        }),
        "temperature of the chip",
    ),
    entry(
        "IMU:DATarate",
        Action::Number {
            range: const { &Range::new(Quantity::FREQUENCY, 1.0, 10_000.0, 1667.0) },
            read: |state| f64::from(present_setup(state).data_rate_Hz),
            write: |state, data_rate_Hz| request(state, Setup { data_rate_Hz: data_rate_Hz as f32, ..requested_setup(state) }),
        },
        "samples per second; the chip uses its next higher rate",
    ),
    entry(
        "IMU:RANGe:RATE",
        Action::Number {
            range: const { &Range::new(Quantity::RATE, RAD_PER_DEG, 4000.0 * RAD_PER_DEG, 2000.0 * RAD_PER_DEG) },
            read: |state| f64::from(present_setup(state).rate_range_rad_s),
            write: |state, range| request(state, Setup { rate_range_rad_s: range as f32, ..requested_setup(state) }),
        },
        "range of the rate; the chip uses its next greater range",
    ),
    entry(
        "IMU:RANGe:ACCeleration",
        Action::Number {
            range: const { &Range::new(Quantity::only("M/S2"), 1.0, 160.0, 4.0 * 9.80665) },
            read: |state| f64::from(present_setup(state).accel_range_m_s2),
            write: |state, range| request(state, Setup { accel_range_m_s2: range as f32, ..requested_setup(state) }),
        },
        "range of the acceleration; the chip uses its next greater range",
    ),
    entry("IMU:FILTer", Action::TextQuery("rate HZ,acceleration HZ", filter), "cutoff frequencies of the chip's low-pass filters"),
    entry(
        "IMU:TEST:STARt",
        Action::Event(start_test),
        "self-test of the chip, at rest with the drive off; IMU:TEST? has the result within a second",
    ),
    entry(
        "IMU:TEST",
        Action::TextQuery("PASSED, FAILED or NONE; changes on x, y, z in RAD/S and M/S2", test_result),
        "result of the self-test",
    ),
    entry(
        "IMU:CLOCk",
        Action::NumberQuery("PPM", |state| Ok((state.dut.shared.status().relative_frequency - 1.0) * 1e6)),
        "frequency error of the chip's oscillator against the crystal",
    ),
];

fn not_running() -> ErrorEntry {
    ErrorEntry::with(Code::HARDWARE, "the sensor under test does not run: IMU? gives the reason")
}

/// The set-up in force, or the requested one where the sensor does not run.
fn present_setup(state: &State<'_>) -> Setup {
    let in_force = state.dut.shared.status().in_force.map(|in_force| in_force.setup);
    in_force.or(state.dut.requested_setup.get()).unwrap_or_default()
}

/// The set-up that was requested last: several commands of one line make one set-up.
fn requested_setup(state: &State<'_>) -> Setup {
    let setup = state.dut.requested_setup.get().unwrap_or(present_setup(state));
    // The range of the rate of a part without a gyro is NaN, which is no request.
    let rate_range_rad_s = if setup.rate_range_rad_s.is_nan() { Setup::default().rate_range_rad_s } else { setup.rate_range_rad_s };
    Setup { rate_range_rad_s, ..setup }
}

fn request(state: &State<'_>, setup: Setup) -> Done {
    state.dut.requested_setup.set(Some(setup));
    state.dut.shared.request_setup(setup);
    state.supervision.dut_busy.set(true);
    Ok(())
}

fn status(state: &State<'_>, out: &mut dyn Write) -> Done {
    let status = state.dut.shared.status();
    write!(out, "{},", if status.name.is_empty() { "none" } else { status.name })?;
    match status.state {
        sensors::State::Starting => out.write_str("STARTING")?,
        sensors::State::Running => out.write_str("RUNNING")?,
        sensors::State::Testing => out.write_str("TESTING")?,
        sensors::State::Failed(error) => write!(out, "FAILED {error}")?,
    }
    Ok(write!(out, ",{},{},{}", status.samples, status.lost, status.refused)?)
}

fn filter(state: &State<'_>, out: &mut dyn Write) -> Done {
    let in_force = state.dut.shared.status().in_force.ok_or_else(not_running)?;
    let (rate_Hz, accel_Hz) = (f64::from(in_force.rate_cutoff_Hz), f64::from(in_force.accel_cutoff_Hz));
    Ok(write!(out, "{},{}", state.with_unit(rate_Hz, "HZ"), state.with_unit(accel_Hz, "HZ"))?)
}

fn start_test(state: &State<'_>) -> Done {
    state.require_at_rest()?;
    if state.dut.shared.status().state != sensors::State::Running {
        return Err(not_running());
    }
    state.dut.shared.request_self_test();
    state.supervision.dut_busy.set(true);
    Ok(())
}

fn test_result(state: &State<'_>, out: &mut dyn Write) -> Done {
    match state.dut.shared.self_test_result() {
        None => out.write_str("NONE")?,
        Some(Err(error)) => write!(out, "FAILED,{error}")?,
        Some(Ok(test)) => {
            out.write_str(if test.passed { "PASSED" } else { "FAILED" })?;
            for (values, unit) in [(test.rate_rad_s, "RAD/S"), (test.accel_m_s2, "M/S2")] {
                for value in values {
                    write!(out, ",{}", state.with_unit(f64::from(value), unit))?;
                }
            }
        }
    }
    Ok(())
}

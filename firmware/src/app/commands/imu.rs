//! `IMU`: the sensor under test: whether it runs and why not, its set-up, its self-test.

use super::{Act, Done, Entry, entry, with_unit};
use crate::app::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use crate::console::text::Writer;
use crate::imu::{self, InForce, Setup, Trouble};
use crate::words::{Words, words};

const RAD_PER_DEG: f64 = core::f64::consts::PI / 180.0;

pub(super) const ENTRIES: &[Entry] = &[
    entry!("IMU", Act::Say(words!("part, state, samples, lost, refused words"), status), "whether it runs, or why not"),
    entry!(
        "IMU:TEMPerature",
        Act::Ask("CEL", |state| there(state.imu.status().temperature_C.map(f64::from), words!("no sample yet: IMU? says why"))),
        "of the chip",
    ),
    entry!(
        "IMU:DATarate",
        Act::Number {
            range: const { &Range::new(Quantity::FREQUENCY, 1.0, 10_000.0, 1667.0) },
            read: |state| f64::from(in_force(state).data_rate_Hz),
            write: |state, data_rate_Hz| ask(state, Setup { data_rate_Hz: data_rate_Hz as f32, ..setup(state) }),
        },
        "samples per second; the chip takes its next that holds it",
    ),
    entry!(
        "IMU:RANGe:RATE",
        Act::Number {
            range: const { &Range::new(Quantity::RATE, RAD_PER_DEG, 4000.0 * RAD_PER_DEG, 2000.0 * RAD_PER_DEG) },
            read: |state| f64::from(in_force(state).rate_range_rad_s),
            write: |state, range| ask(state, Setup { rate_range_rad_s: range as f32, ..setup(state) }),
        },
        "largest rate; the chip takes its next that holds it",
    ),
    entry!(
        "IMU:RANGe:ACCeleration",
        Act::Number {
            range: const { &Range::new(Quantity::only("M/S2"), 1.0, 160.0, 4.0 * 9.80665) },
            read: |state| f64::from(in_force(state).accel_range_m_s2),
            write: |state, range| ask(state, Setup { accel_range_m_s2: range as f32, ..setup(state) }),
        },
        "largest acceleration; the chip takes its next that holds it",
    ),
    entry!("IMU:FILTer", Act::Say(words!("gyro HZ, accelerometer HZ"), filter), "cutoffs of the chip's low-passes"),
    entry!("IMU:TEST:STARt", Act::Do(test), "self-test of the chip, at rest, drive off; IMU:TEST? within a second"),
    entry!("IMU:TEST", Act::Say(words!("PASSED, FAILED or NONE; x, y, z RAD/S and M/S2"), tested), "what the self-test moved"),
    entry!(
        "IMU:CLOCk",
        Act::Ask("PPM", |state| Ok((state.imu.status().relative_pace - 1.0) * 1e6)),
        "how fast the chip's oscillator runs against the crystal",
    ),
];

fn there<T>(value: Option<T>, why: Words) -> Result<T, ErrorEntry> {
    value.ok_or_else(|| ErrorEntry::saying(Code::HARDWARE, why))
}

/// What is in force, or will be asked for where the sensor does not run.
fn in_force(state: &State<'_>) -> Setup {
    state.imu.status().in_force.map(|in_force| in_force.setup).or(state.imu_setup.get()).unwrap_or_default()
}

/// What was asked for last: several parameters of one line make one set-up.
fn setup(state: &State<'_>) -> Setup {
    state.imu_setup.get().unwrap_or(in_force(state))
}

/// Asks for a set-up.
fn ask(state: &State<'_>, setup: Setup) -> Done {
    state.imu_setup.set(Some(setup));
    state.imu.ask_setup(setup);
    Ok(())
}

fn status(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let status = state.imu.status();
    out.text(if status.name.is_empty() { "none" } else { status.name }).byte(b',');
    match status.state {
        imu::State::Starting => drop(out.text("STARTING")),
        imu::State::Running => drop(out.text("RUNNING")),
        imu::State::Testing => drop(out.text("TESTING")),
        imu::State::Failed(trouble) => say(trouble, out.text("FAILED ")),
    }
    for number in [status.samples, status.lost, status.refused] {
        out.byte(b',').whole(u64::from(number), 1);
    }
    Ok(())
}

fn filter(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let InForce { rate_cutoff_Hz, accel_cutoff_Hz, .. } =
        there(state.imu.status().in_force, words!("the sensor does not run: IMU? says why"))?;
    with_unit(out, f64::from(rate_cutoff_Hz), "HZ,");
    with_unit(out, f64::from(accel_cutoff_Hz), "HZ");
    Ok(())
}

fn test(state: &State<'_>) -> Done {
    super::at_rest(state)?;
    if state.imu.status().state != imu::State::Running {
        return Err(ErrorEntry::saying(Code::HARDWARE, words!("the sensor does not run: IMU? says why")));
    }
    state.imu.ask_self_test();
    Ok(())
}

fn tested(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    match state.imu.tested() {
        None => drop(out.text("NONE")),
        Some(Err(trouble)) => say(trouble, out.text("FAILED,")),
        Some(Ok(test)) => {
            out.text(if test.passed { "PASSED" } else { "FAILED" });
            for (values, unit) in [(test.rate_rad_s, "RAD/S"), (test.accel_m_s2, "M/S2")] {
                for value in values {
                    out.byte(b',').number(f64::from(value), 4).byte(b' ').text(unit);
                }
            }
        }
    }
    Ok(())
}

/// What is the matter, with what to do.
fn say(trouble: Trouble, out: &mut Writer<'_>) {
    match trouble {
        Trouble::Bus => drop(out.words(words!("the SPI transfer failed on the processor's side"))),
        Trouble::Absent { who_am_i, expected } => {
            out.words(words!("no sensor or no power: WHO_AM_I "))
                .whole(u64::from(who_am_i), 1)
                .text(" instead of ")
                .whole(u64::from(expected), 1);
            out.words(words!("; check supply and CS, SCK, SDO"));
        }
        Trouble::WrongChip { who_am_i, expected } => {
            out.words(words!("another part or a bad wire: WHO_AM_I "))
                .whole(u64::from(who_am_i), 1)
                .text(" instead of ")
                .whole(u64::from(expected), 1);
        }
        Trouble::NotConfigured { register, wrote, read } => {
            out.text("register ").whole(u64::from(register), 1).text(" reads ").whole(u64::from(read), 1).text(" after ");
            out.whole(u64::from(wrote), 1).words(words!(" was written; check SDI and the supply"));
        }
        Trouble::Rubbish(what) => drop(out.text(what).words(words!("; check the wires' length and ground"))),
        Trouble::Silent => drop(out.words(words!("it answers, but no sample comes"))),
    }
}

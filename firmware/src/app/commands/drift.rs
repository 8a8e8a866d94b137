//! `DRIFt`: drift of the gyroscope by pulses of alternating sign: session, cycles, pair of positions, zero-input cycle.

use super::{Action, Done, Entry, entry};
use crate::app::state::State;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::quantity::Quantity;
use crate::gyro_loop::{MAX_PULSE_SAMPLES, Pair, Phase, Plan, Sequence, Shape};
use crate::text::WithUnit;
use core::fmt::Write;

const SEQUENCES: [Sequence; 3] = [Sequence::PlusMinus, Sequence::MinusPlus, Sequence::Both];
const PAIRS: [&str; 3] = ["OFF", "OWN", "APParent"];
/// The default session.
const DEFAULT: Plan = Plan::DEFAULT;
const MAX_S: f64 = MAX_PULSE_SAMPLES as f64 / 1e3;

/// A number of the plan.
macro_rules! number {
    ($header:literal, $field:ident, $quantity:expr, $least:expr, $most:expr, $default:expr, $help:literal) => {
        entry(
            $header,
            Action::Number {
                range: const { &Range::new($quantity, $least, $most, $default) },
                read: |state| state.gyro.session.$field.get(),
                write: |state, value| (state.gyro.session.$field.set(value), Ok(())).1,
            },
            $help,
        )
    };
}

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "DRIFt:SHAPe",
        Action::Choice {
            words: &["RECTangular", "TRIangular", "SAWTooth"],
            read: |state| state.gyro.session.shape.get() as usize,
            write: |state, index| (state.gyro.session.shape.set(Shape::ALL.get(index).copied().unwrap_or_default()), Ok(())).1,
        },
        "shape of a reference pulse",
    ),
    entry(
        "DRIFt:REVersed",
        Action::Switch {
            read: |state| state.gyro.session.reversed.get(),
            write: |state, on| (state.gyro.session.reversed.set(on), Ok(())).1,
        },
        "reverse the second pulse in time: a sawtooth cancels",
    ),
    entry(
        "DRIFt:SEQuence",
        Action::Choice {
            words: &["PLUSminus", "MINusplus", "BOTH"],
            read: |state| state.gyro.session.sequence.get() as usize,
            write: |state, index| (state.gyro.session.sequence.set(SEQUENCES.get(index).copied().unwrap_or_default()), Ok(())).1,
        },
        "signs of the two pulses; BOTH alternates",
    ),
    number!("DRIFt:RATE", rate_rad_s, Quantity::RATE, 0.0, 10.0, DEFAULT.rate_rad_s, "peak rate of a pulse"),
    number!(
        "DRIFt:DURation",
        duration_s,
        Quantity::TIME,
        0.0,
        MAX_S,
        DEFAULT.duration_s,
        "duration of one pulse; rounded to a multiple of the period"
    ),
    number!("DRIFt:PERiod", period_s, Quantity::TIME, 0.0, MAX_S, DEFAULT.period_s, "period of vibration or mains; 0: none"),
    number!("DRIFt:REST", rest_s, Quantity::TIME, 1e-3, 1e5, DEFAULT.rest_s, "time with the correction loop closed, before each cycle"),
    number!("DRIFt:COUNt", cycles, Quantity::PLAIN, 1.0, 1e6, DEFAULT.cycles as f64, "number of cycles in a session"),
    number!(
        "DRIFt:POSition",
        position,
        Quantity::PLAIN,
        1.0,
        99.0,
        1.0,
        "position of the gyroscope: 1, 2 turned by 180 DEG, or another number"
    ),
    entry("DRIFt:STARt", Action::Event(|state| start(state, false)), "start a session; *OPC? waits for its end"),
    entry("DRIFt:ABORt", Action::Event(|state| (state.gyro.drift.abort(), Ok(())).1), "end the session; the correction loop closes"),
    entry(
        "DRIFt:STATe",
        Action::TextQuery("IDLE, REST, LEAD or PULSES,CLOSED or OPEN,finished cycles,all cycles", phase),
        "phase of the session",
    ),
    entry(
        "DRIFt:CYCLe",
        Action::TextQuery(
            "number,position,sign,N,ACC2,SUM2,CURRENT,MOMENT,least,greatest,rate by (13) RAD/S,corrected rate RAD/S,good or the reason",
            cycle,
        ),
        "the newest cycle, with exact sums",
    ),
    entry(
        "DRIFt",
        Action::TextQuery("good cycles,bad cycles,mean RAD/S,its standard uncertainty RAD/S", mean),
        "drift rate of the session: own and apparent",
    ),
    entry(
        "DRIFt:PAIR",
        Action::CommandAndQuery("<OFF|OWN|APParent>", hold, register),
        "clear the register over positions 1 and 2; query: pair,sum,cycles,cycles,RAD/S",
    ),
    entry(
        "DRIFt:NULL:STARt",
        Action::Event(|state| start(state, true)),
        "run a cycle without pulses at zero input; its sums are subtracted from all others",
    ),
    entry("DRIFt:NULL:CLEar", Action::Event(|state| (state.gyro.drift.clear_zero_input(), Ok(())).1), "delete the zero-input cycle"),
    entry("DRIFt:NULL", Action::TextQuery("N,ACC2,CURRENT or NONE", null), "the zero-input cycle"),
];

fn start(state: &State<'_>, is_zero_input: bool) -> Done {
    state.require_no_fault()?;
    state.require_no_drift_session()?;
    let plan = state.gyro.session.plan();
    state.gyro.drift.check(&plan).map_err(|error| ErrorEntry::with(Code::SETTING, error))?;
    if !is_zero_input && state.gyro.drift.zero_input().is_some_and(|(samples, _)| samples != plan.samples()) {
        let detail = "the zero-input cycle has another duration: DRIFt:NULL:CLEar or DRIFt:NULL:STARt first";
        return Err(ErrorEntry::with(Code::SETTINGS_CONFLICT, detail));
    }
    state.gyro.drift.start(plan, is_zero_input);
    Ok(())
}

fn phase(state: &State<'_>, out: &mut dyn Write) -> Done {
    let phase = state.gyro.drift.phase();
    let name = match phase {
        Phase::Idle => "IDLE",
        Phase::Rest(_) => "REST",
        Phase::Lead(_) => "LEAD",
        Phase::Pulses => "PULSES",
    };
    let correction_loop = if phase.is_closed() { "CLOSED" } else { "OPEN" };
    let (finished, cycles) = state.gyro.drift.progress();
    Ok(write!(out, "{name},{correction_loop},{finished},{cycles}")?)
}

fn cycle(state: &State<'_>, out: &mut dyn Write) -> Done {
    let Some((cycle, raw_rad_s, rate_rad_s)) = state.gyro.drift.newest() else {
        return Ok(out.write_str("NONE")?);
    };
    let sums = &cycle.sums;
    write!(out, "{},{},{},{}", cycle.number, cycle.position, cycle.polarity.sign(), cycle.samples)?;
    write!(out, ",{},{},{},{},{},{}", sums.acc2, sums.sum2, sums.current, sums.moment, sums.min, sums.max)?;
    let (raw, corrected) = (state.with_unit(f64::from(raw_rad_s), "RAD/S"), state.with_unit(f64::from(rate_rad_s), "RAD/S"));
    Ok(write!(out, ",{raw},{corrected},{}", cycle.rejection.name())?)
}

/// A rate; not a number where there is none.
fn rate(state: &State<'_>, rate_rad_s: Option<f32>) -> WithUnit<'static> {
    state.with_unit(rate_rad_s.map_or(f64::NAN, f64::from), "RAD/S")
}

fn mean(state: &State<'_>, out: &mut dyn Write) -> Done {
    let (good, bad, drift) = state.gyro.drift.drift();
    let sigma = drift.and_then(|drift| drift.sigma_rad_s);
    Ok(write!(out, "{good},{bad},{},{}", rate(state, drift.map(|drift| drift.rate_rad_s)), rate(state, sigma))?)
}

fn hold(state: &State<'_>, parameters: &mut Parameters<'_>) -> Done {
    let index = parameters.choice(&PAIRS)?;
    state.gyro.drift.reset_register([Pair::Off, Pair::Own, Pair::Apparent].get(index).copied().unwrap_or_default());
    Ok(())
}

fn register(state: &State<'_>, out: &mut dyn Write) -> Done {
    let (register, rate_rad_s) = state.gyro.drift.register();
    write!(out, "{},{}", PAIRS.get(register.pair as usize).copied().unwrap_or_default(), register.acc2)?;
    for cycles in register.cycles {
        write!(out, ",{cycles}")?;
    }
    Ok(write!(out, ",{}", rate(state, rate_rad_s))?)
}

fn null(state: &State<'_>, out: &mut dyn Write) -> Done {
    match state.gyro.drift.zero_input() {
        None => out.write_str("NONE")?,
        Some((samples, sums)) => write!(out, "{samples},{},{}", sums.acc2, sums.current)?,
    }
    Ok(())
}

//! `DRIFt`: the gyro's drift by pulses of alternating sign: the session, its cycles, the pair of positions, the zero-input cycle.

use super::{Act, Done, Entry, entry, refused, with_unit};
use crate::app::state::{State, no_fault};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::quantity::Quantity;
use crate::console::text::Writer;
use crate::gyro_loop::{MOST_ROWS, Pair, Phase, Plan, Sequence, Shape};
use crate::words::words;

const SEQUENCES: [Sequence; 3] = [Sequence::PlusMinus, Sequence::MinusPlus, Sequence::Both];
const PAIRS: [&str; 3] = ["OFF", "OWN", "APParent"];
/// What a session is without being told.
const USUAL: Plan = Plan::USUAL;
const LONGEST_S: f64 = MOST_ROWS as f64 / 1e3;

/// A number of the plan.
macro_rules! number {
    ($header:literal, $field:ident, $quantity:expr, $least:expr, $most:expr, $usual:expr, $says:literal) => {
        entry!(
            $header,
            Act::Number {
                range: const { &Range::new($quantity, $least, $most, $usual) },
                read: |state| state.drift.$field.get(),
                write: |state, value| (state.drift.$field.set(value), Ok(())).1,
            },
            $says,
        )
    };
}

pub(super) const ENTRIES: &[Entry] = &[
    entry!(
        "DRIFt:SHAPe",
        Act::Words {
            words: &["RECTangular", "TRIangular", "SAWTooth"],
            read: |state| state.drift.shape.get() as usize,
            write: |state, chosen| (state.drift.shape.set(Shape::ALL.get(chosen).copied().unwrap_or_default()), Ok(())).1,
        },
        "what a reference pulse looks like",
    ),
    entry!(
        "DRIFt:REVersed",
        Act::Switch { read: |state| state.drift.reversed.get(), write: |state, on| (state.drift.reversed.set(on), Ok(())).1 },
        "the second pulse runs backwards: a sawtooth cancels",
    ),
    entry!(
        "DRIFt:SEQuence",
        Act::Words {
            words: &["PLUSminus", "MINusplus", "BOTH"],
            read: |state| state.drift.sequence.get() as usize,
            write: |state, chosen| (state.drift.sequence.set(SEQUENCES.get(chosen).copied().unwrap_or_default()), Ok(())).1,
        },
        "signs of the two pulses; BOTH by turns",
    ),
    number!("DRIFt:RATE", rate_rad_s, Quantity::RATE, 0.0, 10.0, USUAL.rate_rad_s, "greatest rate of a pulse"),
    number!(
        "DRIFt:DURation",
        duration_s,
        Quantity::TIME,
        0.0,
        LONGEST_S,
        USUAL.duration_s,
        "of one pulse; taken to a multiple of the period"
    ),
    number!("DRIFt:PERiod", period_s, Quantity::TIME, 0.0, LONGEST_S, USUAL.period_s, "of vibration or mains; 0: none"),
    number!("DRIFt:REST", rest_s, Quantity::TIME, 1e-3, 1e5, USUAL.rest_s, "with the correction loop closed, before each cycle"),
    number!("DRIFt:COUNt", cycles, Quantity::PLAIN, 1.0, 1e6, USUAL.cycles as f64, "cycles of a session"),
    number!("DRIFt:POSition", position, Quantity::PLAIN, 1.0, 99.0, 1.0, "the gyro's position: 1, and 2 turned by 180 DEG; others as told"),
    entry!("DRIFt:STARt", Act::Do(|state| start(state, false)), "measure; *OPC? waits for the end"),
    entry!("DRIFt:ABORt", Act::Do(|state| (state.pulse.abort(), Ok(())).1), "end it; the correction loop closes"),
    entry!("DRIFt:STATe", Act::Say(words!("IDLE, REST, LEAD or PULSES; loop; cycles over, of"), phase), "where it is"),
    entry!(
        "DRIFt:CYCLe",
        Act::Say(words!("number,position,sign,N,ACC2,SUM2,CURRENT,MOMENT,least,greatest,(13),corrected RAD/S,good or why not"), cycle),
        "the newest cycle; exact sums",
    ),
    entry!("DRIFt", Act::Say(words!("good,bad,mean,its sigma RAD/S"), mean), "drift rate of the session: own + apparent"),
    entry!(
        "DRIFt:PAIR",
        Act::TakeAndSay(words!("<OFF|OWN|APParent>"), hold, register),
        "zero the register over positions 1 and 2; asked: what,sum,cycles,RAD/S",
    ),
    entry!("DRIFt:NULL:STARt", Act::Do(|state| start(state, true)), "a cycle without pulses, input at zero; taken off all others"),
    entry!("DRIFt:NULL:CLEar", Act::Do(|state| (state.pulse.forget_null(), Ok(())).1), "forget it"),
    entry!("DRIFt:NULL", Act::Say(words!("N,ACC2,CURRENT or NONE"), null), "the zero-input cycle"),
];

fn start(state: &State<'_>, nulls: bool) -> Done {
    no_fault(state)?;
    if state.pulse.is_running() {
        return Err(ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("the drift is measured: DRIFt:ABORt first")));
    }
    let plan = state.drift.plan();
    state.pulse.check(&plan).map_err(|wrong| refused(&wrong))?;
    if !nulls && state.pulse.null().is_some_and(|(samples, _)| samples != plan.samples()) {
        return Err(ErrorEntry::saying(Code::SETTINGS_CONFLICT, words!("the zero-input cycle has another duration: DRIFt:NULL:CLEar")));
    }
    state.pulse.start(plan, nulls);
    Ok(())
}

fn phase(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let phase = state.pulse.phase();
    let name = match phase {
        Phase::Idle => "IDLE",
        Phase::Rest(_) => "REST",
        Phase::Lead(_) => "LEAD",
        Phase::Pulses => "PULSES",
    };
    let (done, cycles) = state.pulse.progress();
    out.text(name).text(if phase.is_closed() { ",CLOSED," } else { ",OPEN," });
    out.whole(u64::from(done), 1).byte(b',').whole(u64::from(cycles), 1);
    Ok(())
}

fn cycle(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let Some((cycle, raw_rad_s, rate_rad_s)) = state.pulse.newest() else {
        out.text("NONE");
        return Ok(());
    };
    let sums = &cycle.sums;
    out.whole(u64::from(cycle.number), 1);
    let signed = [
        i64::from(cycle.position),
        i64::from(cycle.polarity.sign()),
        i64::from(cycle.samples),
        sums.acc2,
        sums.sum2,
        sums.current,
        sums.moment,
        i64::from(sums.least),
        i64::from(sums.greatest),
    ];
    for number in signed {
        out.byte(b',').signed(number);
    }
    for rate in [raw_rad_s, rate_rad_s] {
        with_unit(out.byte(b','), f64::from(rate), "RAD/S");
    }
    out.byte(b',').text(cycle.bad.name());
    Ok(())
}

fn mean(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let (good, bad, drift) = state.pulse.drift();
    out.whole(u64::from(good), 1).byte(b',').whole(u64::from(bad), 1);
    let sigma = drift.and_then(|drift| drift.sigma_rad_s);
    for rate in [drift.map(|drift| drift.rate_rad_s), sigma] {
        with_unit(out.byte(b','), rate.map_or(f64::NAN, f64::from), "RAD/S");
    }
    Ok(())
}

fn hold(state: &State<'_>, parameters: &mut Parameters<'_>) -> Done {
    let chosen = parameters.choice(&PAIRS).map_err(|wrong| super::among(wrong, &PAIRS))?;
    state.pulse.hold([Pair::Off, Pair::Own, Pair::Apparent].get(chosen).copied().unwrap_or_default());
    Ok(())
}

fn register(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    let (register, rate_rad_s) = state.pulse.register();
    out.text(PAIRS.get(register.pair as usize).copied().unwrap_or_default()).byte(b',').signed(register.acc2);
    for cycles in register.cycles {
        out.byte(b',').whole(u64::from(cycles), 1);
    }
    with_unit(out.byte(b','), rate_rad_s.map_or(f64::NAN, f64::from), "RAD/S");
    Ok(())
}

fn null(state: &State<'_>, out: &mut Writer<'_>) -> Done {
    match state.pulse.null() {
        None => drop(out.text("NONE")),
        Some((samples, sums)) => {
            out.whole(u64::from(samples), 1).byte(b',').signed(sums.acc2).byte(b',').signed(sums.current);
        }
    }
    Ok(())
}

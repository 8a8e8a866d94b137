//! `FAULt`: why the drive was switched off, and the way back.

use super::List;
use super::{Act, Entry, entry};
use crate::app::state::State;
use crate::board::CONTROL_HZ;
use crate::capture::SAMPLES;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::quantity::Quantity;
use crate::console::text::Writer;
use crate::speed_loop::Limits;
use crate::words::words;

pub(super) const ENTRIES: &[Entry] = &[
    entry!(
        "FAULt",
        Act::Say(words!("number,name,advice"), |state, out| {
            let fault = state.row.get().fault;
            out.whole(u64::from(fault.code()), 1).byte(b',').text(fault.name()).byte(b',').words(fault.advice());
            Ok(())
        }),
        "the latched fault; 0,none",
    ),
    entry!("FAULt:CLEar", Act::Do(|state| (clear(state), Ok(())).1), "clear it, where its cause is gone; the drive stays off"),
    entry!(
        "FAULt:CAPTure",
        Act::Say(words!("EMPTY, or samples, the trigger's, fault, tick"), |state, out| {
            match state.capture.record() {
                None => drop(out.text("EMPTY")),
                Some(record) => {
                    out.whole(record.len() as u64, 1).byte(b',').whole(record.trigger() as u64, 1).byte(b',');
                    out.text(record.fault().name()).byte(b',').whole(u64::from(record.trigger_tick()), 1);
                }
            }
            Ok(())
        }),
        "the record at 10 kHz around a fault",
    ),
    entry!(
        "FAULt:CAPTure:DATA",
        Act::AskList(words!("{<first>{,<count>}}"), captured),
        "its samples: S from the trigger, counts, V, A, RAD/S, command",
    ),
    entry!("FAULt:CAPTure:TRIGger", Act::Do(|state| (state.capture.trigger(), Ok(())).1), "record what is around this moment"),
    entry!(
        "FAULt:CAPTure:ARM",
        Act::Take(words!("<samples before the trigger>"), |state, parameters| {
            let range = const { &Range::new(Quantity::PLAIN, 0.0, (SAMPLES - 2) as f64, crate::app::CAPTURE_BEFORE as f64) };
            let before = parameters.number(range)?;
            state.capture.arm(crate::maths::to_u32(crate::maths::round(before)) as usize);
            Ok(())
        }),
        "record anew; what was recorded is gone",
    ),
    entry!(
        "FAULt:LIMits",
        Act::Say(words!("names"), |state, out| {
            let limits = state.row.get().limits;
            let mut any = false;
            for (bit, name) in Limits::NAMES.iter().enumerate() {
                if limits.contains(Limits(1 << bit)) {
                    out.text(if any { "," } else { "" }).text(name);
                    any = true;
                }
            }
            out.text(if any { "" } else { "none" });
            Ok(())
        }),
        "why the output is less than asked, now",
    ),
];

fn clear(state: &State<'_>) {
    state.all_off();
    state.stop_line.clear_stop();
    // A cause that is still there is said anew with the next row.
    state.trip.set(crate::status::Fault::None);
    state.clear.set(state.clear.get().wrapping_add(1));
}

/// Which samples are asked for: all, or so many from one on.
fn captured(state: &State<'_>, parameters: &mut Parameters<'_>) -> Result<List, ErrorEntry> {
    let record =
        state.capture.record().ok_or_else(|| ErrorEntry::saying(Code::DATA_STALE, words!("nothing is recorded: FAULt:CAPTure:TRIGger")))?;
    let most = const { &Range::new(Quantity::PLAIN, 0.0, SAMPLES as f64, 0.0) };
    let mut next = |otherwise: usize| {
        let mut copy = *parameters;
        if copy.next_text().is_none() {
            Ok(otherwise)
        } else {
            parameters.number(most).map(|number| crate::maths::to_u32(crate::maths::round(number)) as usize)
        }
    };
    let first = next(0)?;
    let count = next(record.len())?;
    state.capture_lines.set((first, first.saturating_add(count).min(record.len())));
    Ok(List::Capture)
}

/// A sample.
pub(super) fn capture_line(state: &State<'_>, line: usize, out: &mut Writer<'_>) -> Option<()> {
    let (first, end) = state.capture_lines.get();
    let k = first.checked_add(line).filter(|k| *k < end)?;
    let record = state.capture.record()?;
    let sample = record.sample(k)?;
    let hardware = &state.hardware;
    let rad_s = hardware.rad_per_count() * CONTROL_HZ as f64;
    let from_trigger = k as f64 - record.trigger() as f64;
    out.fixed(from_trigger / CONTROL_HZ as f64, 4).byte(b',').whole(u64::from(sample.count.0), 1).byte(b',');
    out.fixed(f64::from(sample.duty) * hardware.volt_per_duty(), 4).byte(b',');
    out.fixed((f64::from(sample.current.0) - hardware.current_zero_code) * hardware.current_A_per_code, 4).byte(b',');
    out.number(f64::from(sample.rate) * rad_s, 6).byte(b',').number(f64::from(sample.command) * rad_s, 6);
    Some(())
}

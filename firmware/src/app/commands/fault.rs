//! `FAULt`: the cause of a fault, its clearing, and the recording around it.

use super::{Action, Done, Entry, Job, List, entry};
use crate::app::state::State;
use crate::board::CONTROL_HZ;
use crate::capture::SAMPLES;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::quantity::Quantity;
use crate::speed_loop::Limits;
use crate::status::Fault;
use crate::text::{Fixed, Significant, write_list};
use core::fmt::{self, Write};

pub(super) const ENTRIES: &[Entry] = &[
    entry("FAULt", Action::TextQuery("number,name,advice", fault), "the latched fault; 0,none"),
    entry("FAULt:CLEar", Action::Job(Job::ClearFault), "clear the fault if its cause is gone; the drive stays off"),
    entry(
        "FAULt:CAPTure",
        Action::TextQuery("EMPTY, or samples,index of the trigger,fault,tick", capture),
        "the recording at 10 kHz around a fault",
    ),
    entry(
        "FAULt:CAPTure:DATA",
        Action::PartialListQuery("{<first>{,<count>}}", select_samples),
        "its samples: S from the trigger, counts, V, A, RAD/S, command RAD/S",
    ),
    entry("FAULt:CAPTure:TRIGger", Action::Event(|state| (state.capture.memory.trigger(), Ok(())).1), "trigger the recording now"),
    entry(
        "FAULt:CAPTure:ARM",
        Action::Command("<samples before the trigger>", |state, parameters| {
            let range = const { &Range::new(Quantity::PLAIN, 0.0, (SAMPLES - 2) as f64, crate::app::CAPTURE_BEFORE as f64) };
            let before = parameters.number(range)?;
            state.capture.memory.arm(libm::round(before) as u32 as usize);
            Ok(())
        }),
        "start a new recording; deletes the last",
    ),
    entry("FAULt:LIMits", Action::TextQuery("names", limits), "the limits that act on the output now"),
];

fn fault(state: &State<'_>, out: &mut dyn Write) -> Done {
    let fault = state.measured.row.get().fault;
    Ok(write!(out, "{},{},{}", fault.code(), fault.name(), fault.advice())?)
}

/// Requests the clearing of the latched fault.
pub(in crate::app) fn clear(state: &State<'_>) {
    state.all_off();
    state.stop_line.clear_stop();
    // A cause that is still present is detected again with the next row.
    state.drive.trip.set(Fault::None);
    state.drive.fault_clears.set(state.drive.fault_clears.get().wrapping_add(1));
}

fn capture(state: &State<'_>, out: &mut dyn Write) -> Done {
    match state.capture.memory.record() {
        None => out.write_str("EMPTY")?,
        Some(record) => write!(out, "{},{},{},{}", record.len(), record.trigger(), record.fault().name(), record.trigger_tick())?,
    }
    Ok(())
}

fn limits(state: &State<'_>, out: &mut dyn Write) -> Done {
    let limits = state.measured.row.get().limits;
    let names = Limits::NAMES.iter().enumerate().filter(|(bit, _)| limits.contains(Limits(1 << bit)));
    Ok(write_list(out, names.map(|(_, name)| *name))?)
}

/// Selects the samples to list: all, or some from the first parameter on.
fn select_samples(state: &State<'_>, parameters: &mut Parameters<'_>) -> Result<List, ErrorEntry> {
    let record = state.capture.memory.record();
    let record = record.ok_or_else(|| ErrorEntry::with(Code::DATA_STALE, "there is no recording: FAULt:CAPTure:TRIGger makes one"))?;
    let range = const { &Range::new(Quantity::PLAIN, 0.0, SAMPLES as f64, 0.0) };
    let mut next = |default: usize| {
        let mut copy = *parameters;
        if copy.next_text().is_none() { Ok(default) } else { parameters.number(range).map(|number| libm::round(number) as u32 as usize) }
    };
    let first = next(0)?;
    let count = next(record.len())?;
    state.capture.selection.set((first, first.saturating_add(count).min(record.len())));
    Ok(List::Capture)
}

/// A sample of the recording.
pub(super) fn capture_line(state: &State<'_>, line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    let (first, end) = state.capture.selection.get();
    let index = first.saturating_add(line);
    let Some(record) = state.capture.memory.record().filter(|_| index < end) else { return Ok(false) };
    let Some(sample) = record.sample(index) else { return Ok(false) };
    let hardware = &state.hardware;
    let rad_s_per_unit = hardware.rad_per_count() * CONTROL_HZ as f64;
    let from_trigger_s = (index as f64 - record.trigger() as f64) / CONTROL_HZ as f64;
    let voltage_V = f64::from(sample.duty) * hardware.volt_per_duty();
    let current_A = (f64::from(sample.current.0) - hardware.current_zero_code) * hardware.current_A_per_code;
    let rate_rad_s = f64::from(sample.rate) * rad_s_per_unit;
    let command_rad_s = f64::from(sample.command) * rad_s_per_unit;
    write!(out, "{},{},{},", Fixed(from_trigger_s, 4), sample.count.0, Fixed(voltage_V, 4))?;
    write!(out, "{},{},{}", Fixed(current_A, 4), Significant(rate_rad_s, 6), Significant(command_rad_s, 6))?;
    Ok(true)
}

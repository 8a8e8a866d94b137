//! The common commands of IEEE 488.2, and STOP.

use super::{Action, Entry, Job, entry};
use crate::app::self_test::at_rest;
use crate::app::state::{State, Stream};
use crate::board::Ticks;
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use crate::console::status::OPERATION_COMPLETE;
use crate::status::Fault;
use crate::telemetry::Channels;
use core::fmt::{self, Write};

const BYTE: &Range = &Range::new(Quantity::PLAIN, 0.0, 255.0, 0.0);
/// Longest interval between rows that passes the self-test: one control tick late, s.
const MAX_ROW_INTERVAL_S: f64 = 1.1e-3;

pub(super) const ENTRIES: &[Entry] = &[
    entry("*IDN", Action::TextQuery("maker,model,serial number,firmware", |state, out| Ok(write_identity(state, out)?)), "identification"),
    entry(
        "*RST",
        Action::Event(|state| (reset(state), Ok(())).1),
        "drive off, text mode, default stream, no units in replies; settings are kept",
    ),
    entry("*CLS", Action::Event(|state| (state.status.clear(), Ok(())).1), "clear errors and events"),
    entry(
        "*ESR",
        Action::NumberQuery("", |state| Ok(f64::from(state.status.registers.take_event()))),
        "read and clear the standard events",
    ),
    entry(
        "*ESE",
        Action::Number {
            range: BYTE,
            read: |state| f64::from(state.status.registers.event_enable()),
            write: |state, bits| (state.status.registers.set_event_enable(bits as u8), Ok(())).1,
        },
        "standard events that set bit 5 of the status byte",
    ),
    entry(
        "*STB",
        Action::NumberQuery("", |state| Ok(f64::from(state.status.registers.byte(state.status.error_count() > 0)))),
        "status byte",
    ),
    entry(
        "*SRE",
        Action::Number {
            range: BYTE,
            read: |state| f64::from(state.status.registers.request_enable()),
            write: |state, bits| (state.status.registers.set_request_enable(bits as u8), Ok(())).1,
        },
        "bits of the status byte that set its bit 6",
    ),
    entry(
        "*OPC",
        Action::Event(|state| {
            if state.is_busy() {
                state.status.completion_pending.set(true);
            } else {
                state.status.registers.set_event(OPERATION_COMPLETE);
            }
            Ok(())
        }),
        "set the event 'operation complete' at the end of the activity",
    ),
    entry("*OPT", Action::TextQuery("0: no options", |_, out| Ok(out.write_char('0')?)), "installed options"),
    entry(
        "*PSC",
        Action::Number { range: const { &Range::new(Quantity::PLAIN, 1.0, 1.0, 1.0) }, read: |_| 1.0, write: |_, _| Ok(()) },
        "power-on clears the enable registers; cannot be switched off",
    ),
    entry("*OPC", Action::JobQuery(Job::WaitAndReply), "reply 1 at the end of the activity"),
    entry("*WAI", Action::Job(Job::Wait), "wait for the end of the activity"),
    entry(
        "*TST",
        Action::NumberQuery("", |state| Ok(self_test(state))),
        "self-test: 0, or sum of 1 settings, 2 no rows, 4 late rows, 8 fault, 16 zero of the current, 32 supply, 64 sensor",
    ),
    entry("STOP", Action::Event(|state| (stop(state), Ok(())).1), "emergency stop, as the byte 0x18; FAULt:CLEar ends it"),
];

/// The reply to `*IDN?`.
pub(super) fn write_identity(state: &State<'_>, out: &mut dyn Write) -> fmt::Result {
    write!(out, "Rotary Stand,{},{},{}", state.identity.model, state.identity.serial, crate::VERSION)
}

fn reset(state: &State<'_>) {
    state.all_off();
    state.supervision.host_timeout_s.set(None);
    state.supervision.unattended_until.set(Ticks(0));
    state.supervision.settings_changed.set(true);
    state.stream.selection.set(Stream { channels: Channels::DEFAULT, decimation: 1 });
    state.out.has_units.set(false);
    state.set_text_mode();
}

fn stop(state: &State<'_>) {
    state.stop_line.request_stop();
    state.all_off();
}

fn self_test(state: &State<'_>) -> f64 {
    let settings = u8::from(state.settings.kept.get().config().is_err());
    let no_rows = u8::from(state.measured.rate_rad_s.get().is_none()) << 1;
    let late_rows = u8::from(state.measured.instruments.timing().max_s > MAX_ROW_INTERVAL_S) << 2;
    let fault = u8::from(state.measured.row.get().fault != Fault::None) << 3;
    f64::from(settings | no_rows | late_rows | fault | at_rest(state) << 4)
}

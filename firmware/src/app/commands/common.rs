//! What IEEE 488.2 asks of every instrument.

use super::{Act, Entry, Job, entry};
use crate::app::state::{State, Stream};
use crate::console::parse::Range;
use crate::console::quantity::Quantity;
use crate::console::status::OPERATION_COMPLETE;
use crate::status::Fault;
use crate::telemetry::Channels;
use crate::words::words;

const BYTE: &Range = &Range::new(Quantity::PLAIN, 0.0, 255.0, 0.0);

pub(super) const ENTRIES: &[Entry] = &[
    entry!(
        "*IDN",
        Act::Say(words!("maker,model,serial number,firmware"), |state, out| {
            identity(state, out);
            Ok(())
        }),
        "who it is",
    ),
    entry!("*RST", Act::Do(|state| (reset(state), Ok(())).1), "drive off, text mode, nothing asked for; settings stay"),
    entry!("*CLS", Act::Do(|state| (state.clear_status(), Ok(())).1), "forget errors and events"),
    entry!("*ESR", Act::Ask("", |state| Ok(f64::from(state.status.take_event()))), "standard events, taken"),
    entry!(
        "*ESE",
        Act::Number {
            range: BYTE,
            read: |state| f64::from(state.status.event_enable()),
            write: |state, bits| (state.status.set_event_enable(bits as u8), Ok(())).1,
        },
        "standard events that the status byte shows",
    ),
    entry!("*STB", Act::Ask("", |state| Ok(f64::from(state.status.byte(state.error_count() > 0)))), "status byte"),
    entry!(
        "*SRE",
        Act::Number {
            range: BYTE,
            read: |state| f64::from(state.status.request_enable()),
            write: |state, bits| (state.status.set_request_enable(bits as u8), Ok(())).1,
        },
        "bits of the status byte that its bit 6 shows",
    ),
    entry!(
        "*OPC",
        Act::Do(|state| {
            if state.is_busy() {
                state.completes.set(true);
            } else {
                state.status.happened(OPERATION_COMPLETE);
            }
            Ok(())
        }),
        "set the event 'operation complete' when nothing runs any more",
    ),
    entry!("*OPC", Act::AskJob(Job::WaitAndSay), "1 when nothing runs any more"),
    entry!("*WAI", Act::Job(Job::Wait), "wait until nothing runs any more"),
    entry!("*TST", Act::Ask("", |state| Ok(self_test(state))), "self-test: 0, or 1 settings + 2 no rows + 4 late rows + 8 a fault"),
    entry!("STOP", Act::Do(|state| (stop(state), Ok(())).1), "emergency stop, as the byte 0x18; FAULt:CLEar ends it"),
];

pub(crate) fn identity(state: &State<'_>, out: &mut crate::console::text::Writer<'_>) {
    out.text("Rotary Stand,").text(state.identity.model).byte(b',').text(state.identity.serial).byte(b',').text(crate::VERSION);
}

fn reset(state: &State<'_>) {
    state.all_off();
    state.host_silence_s.set(None);
    state.stream.set(Stream { channels: Channels::USUAL, decimation: 1 });
    state.to_text();
}

fn stop(state: &State<'_>) {
    state.stop_line.ask_stop();
    state.all_off();
}

fn self_test(state: &State<'_>) -> f64 {
    let settings = u8::from(state.kept.get().config().is_err());
    let no_rows = u8::from(state.rate_rad_s.get().is_none()) << 1;
    // Late by more than a control tick.
    let late = u8::from(state.instruments.timing().greatest_s > 1.1e-3) << 2;
    let fault = u8::from(state.row.get().fault != Fault::None) << 3;
    f64::from(settings | no_rows | late | fault)
}

//! A calibration record as text for the terminal.

use super::{coverage_text, footnote, remarks, temperature, with_expanded_u};
use stand_records::stored_record::{RecordHeader, StoredRecord};

/// Title of a record: kind, type and serial number of the device under test.
pub(super) fn heading(header: &RecordHeader) -> String {
    let device: Vec<&str> = [header.sensor.as_str(), header.serial.as_str()].into_iter().filter(|part| !part.is_empty()).collect();
    format!("calibration {} {}", header.dut_kind.name(), device.join(" ")).trim_end().to_owned()
}

/// Values with expanded uncertainties, absent quantities and remarks.
pub fn text(record: &StoredRecord) -> String {
    let header = &record.header;
    let (done, all) = (header.steps.len(), header.session.steps.len());
    // Logs of another program have no session; the time is that of the evaluation.
    let mut out = if all == 0 {
        format!("{}: logs of another program ({done}), evaluated {}\n", heading(header), header.began)
    } else {
        format!("{}: {done} of {all} steps, begun {}\n", heading(header), header.began)
    };
    let width = record.quantities.iter().map(|q| q.name.len()).max().unwrap_or(0);
    for q in &record.quantities {
        out += &format!("  {:<width$}  {}  ({})", q.name, with_expanded_u(q), coverage_text(q));
        let at = temperature(q);
        if !at.is_empty() {
            out += &format!(" {at}");
        }
        out += "\n";
    }
    for absent in &header.absent {
        out += &format!("  {:<width$}  not found: {}\n", absent.name, absent.reason);
    }
    for line in remarks(header) {
        out += &format!("{line}\n");
    }
    out + &format!("{}\n", footnote())
}

//! Messages that the image has logged through defmt, by level and format string, without their arguments. `defmt-print` shows them in full;
//! its library would turn on a feature of serde_json that changes how the whole workspace reads numbers.

use crate::image::Image;
use std::collections::BTreeMap;

/// What defmt keeps of a message in the name of a symbol, whose address is the number of the message.
#[derive(serde::Deserialize)]
struct Message {
    tag: String,
    data: String,
}

/// The complete messages in a log of defmt's encoding (rzCOBS frames that end with a zero byte), in order: `INFO start after {}`. Frames
/// that are damaged are named as such.
pub fn messages(log: &[u8], image: &Image) -> Vec<String> {
    let texts: BTreeMap<u32, String> = image
        .symbols()
        .filter_map(|(name, number)| {
            let message: Message = serde_json::from_str(name).ok()?;
            let level = message.tag.strip_prefix("defmt_")?.to_uppercase();
            Some((number, format!("{level} {}", message.data)))
        })
        .collect();
    let text = |frame: &[u8]| {
        let bytes = rzcobs::decode(frame).ok()?;
        let number = u16::from_le_bytes(*bytes.first_chunk()?);
        texts.get(&u32::from(number)).cloned()
    };
    let complete = log.split_inclusive(|byte| *byte == 0).filter_map(|frame| frame.strip_suffix(&[0])).filter(|frame| !frame.is_empty());
    complete.map(|frame| text(frame).unwrap_or_else(|| format!("a damaged message of {} bytes", frame.len()))).collect()
}

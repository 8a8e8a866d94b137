//! Contents of frames.

use super::channel::{CHANNELS, Channel, Channels};
use crate::measurement_loop::Row;
use serde::Deserialize;

/// Version of the protocol of the serial line, the first byte of every [`Hello`]; it is apart from the version of the workspace. A receiver
/// of another version refuses the stream.
///
/// It is raised when a program of the version before would take a line or a frame for something else: another layout, type or CRC of a
/// frame, another number or coding of a channel in the table, another form of the check sum of a line or of the end of a reply. A new
/// command, setting, fault or channel behind the last one does not raise it.
pub const PROTOCOL: u8 = 1;

/// Start of a stream: the data that a receiver needs to make a log.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Hello<'a> {
    /// [`PROTOCOL`].
    pub protocol: u8,
    /// The reply to `*IDN?`: maker, model, serial number, firmware.
    pub identity: &'a str,
    /// Encoder counts per turn.
    pub counts_per_turn: f64,
    /// Measured rows per second.
    pub row_Hz: u16,
    /// Measured rows per transmitted row.
    pub decimation: u16,
    /// The channels of each row, by their bits.
    pub channels: u32,
    /// The angles are measured from the index.
    pub zero_is_index: bool,
}

/// Heartbeat, once per second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub struct Beat {
    /// Board clock, 0.1 µs since power-on.
    pub at: u64,
    /// Frames lost for lack of room since the stream began.
    pub lost: u32,
    /// Number of the latched fault, 0 for none.
    pub fault: u8,
}

/// A row of selected channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowFrame {
    /// Number of the row in the measurement loop.
    pub sequence: u32,
    /// t_k, 0.1 µs since power-on.
    pub at: u64,
    /// The selected channels.
    pub channels: Channels,
    /// Values by the index of the channel; NaN where it is not selected or has no value.
    pub values: [f64; CHANNELS.len()],
}

impl RowFrame {
    /// The selected channels of a row.
    pub fn new(row: &Row, channels: Channels) -> Self {
        let mut values = [f64::NAN; CHANNELS.len()];
        for (index, channel) in channels.indexed() {
            if let Some(value) = values.get_mut(index) {
                *value = (channel.read)(row).unwrap_or(f64::NAN);
            }
        }
        Self { sequence: row.sequence, at: row.at.0, channels, values }
    }

    /// The selected channels with their values.
    pub fn iter(&self) -> impl Iterator<Item = (&'static Channel, f64)> {
        let value = |index| self.values.get(index).copied().unwrap_or(f64::NAN);
        self.channels.indexed().map(move |(index, channel)| (channel, value(index)))
    }

    /// The value of a selected channel, NaN where the row has none; `None` if the channel is not selected.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.named().find(|(channel, _)| *channel == name).map(|(_, value)| value)
    }

    /// Names and values of the selected channels.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.iter().map(|(channel, value)| (channel.name, value))
    }
}

/// Content of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body<'a> {
    /// A stream begins, or its channels have changed.
    Hello(Hello<'a>),
    /// A row.
    Row(RowFrame),
    /// A line of text: a reply, or an error.
    Text(&'a str),
    /// Heartbeat.
    Beat(Beat),
}

//! A log as the fit sees it: the input, the channels that are compared, what the rig is told besides.
//!
//! Columns are borrowed: an hour's log is held once.

use std::ops::Range;
use std::sync::Arc;

use drive_rig::RowInput;

use crate::model::{Channel, Input};

/// Length over which the angle is compared by its increments, s (interfaces.md).
pub const ANGLE_INCREMENT_S: f64 = 0.020;
/// FitResult-out blocks: length, s, and which of four.
const HELD_OUT_BLOCK_S: f64 = 2.0;
const HELD_OUT_EVERY: i64 = 4;
const HELD_OUT_WHICH: i64 = 1;

/// One compared channel.
#[derive(Debug, Clone)]
pub struct ComparedChannel<'a> {
    /// What it shows.
    pub channel: Channel,
    /// The measured column.
    pub measured: &'a [f64],
    /// It is a mean over this long before t, s (a note of the log).
    pub mean_before_s: Option<f64>,
    /// It passed a first-order filter of this cutoff, Hz (a note of the log).
    pub filter_hz: Option<f64>,
    /// It was taken at the instant t, where the convention is the mean over the row (a note; currents only).
    pub instant: bool,
    /// Its least significant bit, where it is quantised.
    pub quantum: Option<f64>,
}

/// A log as the fit sees it. All columns have the same length.
#[derive(Debug, Clone)]
pub struct PreparedLog<'a> {
    /// Time of each row, s.
    pub t_s: &'a [f64],
    /// The input column (the angle, where the motion is prescribed).
    pub input: &'a [f64],
    /// How the input moves the model.
    pub driven: Input,
    /// Measured angle, where there is one.
    pub theta: Option<&'a [f64]>,
    /// Least significant bit of the measured angle; 0 where it is continuous.
    pub theta_quantum: f64,
    /// Measured current, where there is one (only the prescribed motion asks for it).
    pub current: Option<&'a [f64]>,
    /// Winding temperature, smoothed, where it is measured.
    pub temp_C: Option<Arc<[f64]>>,
    /// Supply over nominal, where it is measured.
    pub supply_ratio: Option<Arc<[f64]>>,
    /// The rate channel is made from the encoder.
    pub rate_from_encoder: bool,
    /// Rows without a gap between them.
    pub segments: Vec<Range<usize>>,
    /// What is compared.
    pub channels: Vec<ComparedChannel<'a>>,
    /// Median interval, s.
    pub dt_s: f64,
    /// Blocks are held out of the fit.
    pub hold_out: bool,
}

impl PreparedLog<'_> {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// True where there is no row.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// The row is in a held-out block: 2 s, every fourth, beginning after the first.
    #[inline]
    pub fn held_out(&self, row: usize) -> bool {
        self.hold_out && ((self.t_s[row] - self.t_s[0]) / HELD_OUT_BLOCK_S).floor() as i64 % HELD_OUT_EVERY == HELD_OUT_WHICH
    }

    /// The row as the rig takes it; the last of a segment is as long as the median.
    #[inline]
    pub fn span(&self, row: usize, segment_end: usize) -> RowInput {
        let next = row + 1;
        let inside = next < segment_end;
        // A count stands for the angles from its edge to the next: on the mean half a count further.
        let half = 0.5 * self.theta_quantum;
        RowInput {
            t_s: self.t_s[row],
            dt_s: if inside { self.t_s[next] - self.t_s[row] } else { self.dt_s },
            input: self.input[row],
            theta: self.theta.map(|theta| (theta[row] + half, if inside { theta[next] + half } else { theta[row] + half })),
            temp_C: self.temp_C.as_ref().map(|t| t[row]),
            supply_ratio: self.supply_ratio.as_ref().map_or(1.0, |s| s[row]),
            rate_from_encoder: self.rate_from_encoder,
        }
    }

    /// Rows over which the angle is compared.
    pub fn angle_lag(&self) -> usize {
        ((ANGLE_INCREMENT_S / self.dt_s).round() as usize).max(1)
    }

    /// What is compared of a channel at a row: the value, or the increment of an angle; `None` where a row has no partner.
    #[inline]
    pub fn target(&self, channel: usize, row: usize, segment_begin: usize) -> Option<f64> {
        let c = &self.channels[channel];
        match c.channel {
            Channel::Angle => {
                let lag = self.angle_lag();
                (row >= segment_begin + lag).then(|| c.measured[row] - c.measured[row - lag])
            }
            _ => Some(c.measured[row]),
        }
    }
}

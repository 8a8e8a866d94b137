//! Angle and current along the log, as the trials use them.

use crate::model::{Channel, Input};
use crate::recording::PreparedLog;
use crate::statistics::Extremes;

/// The angle along the log, rad, where it is measured or prescribed.
pub fn angle<'d>(data: &'d PreparedLog) -> Option<&'d [f64]> {
    data.theta.or((data.driven == Input::Motion).then_some(&data.input))
}

/// Turns between the smallest and the largest angle.
pub fn turns(data: &PreparedLog) -> f64 {
    let Some(theta) = angle(data) else { return 0.0 };
    let (low, high) = theta.iter().copied().min_max();
    (high - low) / std::f64::consts::TAU
}

/// The measured current along the log, A: compared, or beside a prescribed motion.
pub fn measured_current<'d>(data: &'d PreparedLog) -> Option<&'d [f64]> {
    data.channels.iter().find(|c| c.channel == Channel::Current).map(|c| c.measured).or(data.current)
}

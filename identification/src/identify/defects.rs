//! Defects of a log as a record of the drive or sensor that a model describes.

use crate::log::Log;
use crate::log::plausible::{self, Defect};
use crate::model::{Input, Model};

/// What makes `log` implausible for `model`; nothing where it is plausible. The scale of a rate sensor that is compared with a known motion
/// is what the comparison is about; a scale that is that of another unit remains a defect, and so does a reversed sign.
pub fn defects(log: &Log, model: &Model) -> Vec<Defect> {
    let mut defects = plausible::check(log, model.input().column());
    if model.input() == Input::Motion {
        defects.retain(|d| !matches!(d, Defect::RateScale { ratio, unit: None } if *ratio > 0.0));
    }
    defects
}

//! Input and result of the evaluation: cycles with their conditions, own drift, apparent drift, azimuth.

use super::cycle::{Cycle, is_same_position};
use super::error::{DriftError, within};
use super::estimate::Estimate;
use super::inequality::PulseInequality;
use super::positions::PositionFit;
use crate::acquire::drift_session::DriftRecording;
use crate::log::LogWarning;
use hal_sim::gyro::Orientation;
use std::f64::consts::TAU;

/// A remark on the input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DriftWarning {
    /// K_m/H is not known, so the current corrects nothing.
    NoTorquerGain,
    /// A warning of the log reader.
    Log(LogWarning),
}

/// Standard uncertainties of the setup, from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SetupUncertainties {
    /// Of the turn between positions, rad.
    pub turn_error_rad: f64,
    /// Of the level, rad.
    pub level_error_rad: f64,
    /// Of the angle sensor's gain K_k, relative.
    pub gain_error: f64,
}

impl SetupUncertainties {
    /// Checks the values.
    ///
    /// # Errors
    /// A value out of its range.
    pub fn checked(self) -> Result<Self, DriftError> {
        within("--turn-error", self.turn_error_rad, 0.0, 1.0)?;
        within("--level-error", self.level_error_rad, 0.0, 1.0)?;
        within("--gain-error", self.gain_error, 0.0, 1.0)?;
        Ok(self)
    }
}

/// Cycles and the conditions under which they were measured.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// Name: the log, the port.
    pub name: String,
    /// The cycles.
    pub cycles: Vec<Cycle>,
    /// Three axes; otherwise one.
    pub has_three_axes: bool,
    /// Latitude, degrees.
    pub latitude_deg: Option<f64>,
    /// Standard uncertainties of the setup.
    pub uncertainties: SetupUncertainties,
    /// Remarks on the input.
    pub warnings: Vec<DriftWarning>,
}

impl Measurement {
    /// The measurement of a drift session; `name` is that of the stand.
    ///
    /// # Errors
    /// An uncertainty out of its range.
    pub fn of_recording(
        name: String,
        recording: &DriftRecording,
        latitude_deg: Option<f64>,
        uncertainties: SetupUncertainties,
    ) -> Result<Self, DriftError> {
        Ok(Self {
            name,
            cycles: recording.cycles.iter().map(|cycle| Cycle::of_report(cycle, &recording.scales)).collect(),
            has_three_axes: false,
            latitude_deg,
            uncertainties: uncertainties.checked()?,
            warnings: Vec::new(),
        })
    }

    /// The cycles without a defect.
    pub fn valid_cycles(&self) -> Vec<&Cycle> {
        self.cycles.iter().filter(|cycle| cycle.defect.is_none()).collect()
    }

    /// The positions of the valid cycles, in their order.
    pub fn positions(&self) -> Vec<Orientation> {
        let mut positions: Vec<Orientation> = Vec::new();
        for cycle in self.valid_cycles() {
            if !positions.iter().any(|position| is_same_position(position, &cycle.position)) {
                positions.push(cycle.position);
            }
        }
        positions
    }
}

/// Own drift, apparent drift and azimuth.
#[derive(Debug, Clone, PartialEq)]
pub struct SeparatedDrift {
    /// Own drift ω_d, rad/s: one entry, or x, y, z.
    pub own_rad_s: Vec<Estimate>,
    /// Apparent drift ω_a in the first position, rad/s: one entry, or x, y, z.
    pub apparent_rad_s: Vec<Estimate>,
    /// Azimuth A, rad, where it is determined.
    pub azimuth_rad: Option<Estimate>,
    /// Fit over the positions of a single-axis gyroscope.
    pub position_fit: Option<PositionFit>,
    /// Inequality of the pulses for each axis; empty for pulses of one amplitude.
    pub inequality: Vec<PulseInequality>,
}

impl SeparatedDrift {
    /// The second azimuth with the same apparent drift, rad: two positions half a turn apart determine only the cosine.
    pub fn second_azimuth_rad(&self) -> Option<f64> {
        let is_cosine_only = self.position_fit.as_ref().is_some_and(|fit| fit.sine.is_none());
        self.azimuth_rad.filter(|_| is_cosine_only).map(|azimuth| TAU - azimuth.value)
    }
}

//! Online correction of the mean azimuth for vibration (docs/theory.md §2.3).
//!
//! The moment balance about the body's vertical axis, averaged over whole periods, leaves ⟨α⟩ = \[H⟨α′ sin γ⟩ − (Jx−Jz)⟨β′ γ′⟩\]/k_α of an
//! azimuth that vibration alone has moved. The rates α′ and β′ are estimates, γ is measured. A period is seldom a whole number of steps;
//! the step in which it ends is divided between both periods.
//!
//! The observer distorts the rates at the vibration frequency by its known responses R(jω) (docs/theory.md §2.2). With 1/R the rates are
//! corrected: Re(1/R) x̂ + Im(1/R)/ω x̂′, with the derivative by the difference of two steps.

use crate::config::{ConfigError, within};

/// Motion at one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Measured azimuth α, rad.
    pub alpha_rad: f64,
    /// Estimate of α′, rad/s.
    pub alpha_rate_rad_s: f64,
    /// Estimate of β′, rad/s.
    pub beta_rate_rad_s: f64,
    /// Measured roll γ, rad.
    pub gamma_rad: f64,
}

/// Means over the last whole periods.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VibrationCorrection {
    /// Mean azimuth, rad.
    pub alpha_rad: f64,
    /// Part of it that vibration causes, rad.
    pub vibration_rad: f64,
    /// Number of means since the start.
    pub means: u32,
}

/// State of the correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vibration {
    /// H/k_α, s, times the inverse response of α̂′: real part, and imaginary part over the angular frequency in steps.
    rate_gains_s: [f64; 2],
    /// (Jx − Jz)/k_α over the step, s, times the inverse response of β̂′, likewise.
    tilt_gains_s: [f64; 2],
    /// Steps in a mean, not an integer.
    steps: f64,
    left: f64,
    sums: [f64; 2],
    before: Option<Motion>,
    newest: VibrationCorrection,
}

impl Vibration {
    /// Means over `window_s`, whole periods, of steps of `step_s`; `rate_gain_s` is H/k_α and `inertia_gain_s2` (Jx−Jz)/k_α.
    ///
    /// # Errors
    /// The name of a parameter that is not finite or out of its range; the window must be at least two steps.
    pub fn new(window_s: f64, step_s: f64, rate_gain_s: f64, inertia_gain_s2: f64) -> Result<Self, ConfigError> {
        within("vibration step_s", step_s, 1e-9, 1e3)?;
        within("vibration window_s", window_s, 2.0 * step_s, 1e6)?;
        within("vibration rate_gain_s", rate_gain_s, -1e12, 1e12)?;
        within("vibration inertia_gain_s2", inertia_gain_s2, -1e12, 1e12)?;
        let steps = window_s / step_s;
        Ok(Self {
            rate_gains_s: [rate_gain_s, 0.0],
            tilt_gains_s: [inertia_gain_s2 / step_s, 0.0],
            steps,
            left: steps,
            sums: [0.0; 2],
            before: None,
            newest: VibrationCorrection::default(),
        })
    }

    /// With the inverse responses of the observer at the vibration frequency: of α̂′ the real part and the imaginary part over the angular
    /// frequency, s, and likewise of β̂′; `step_s` as above. All 0: not known.
    ///
    /// # Errors
    /// A number is not finite or out of its range.
    pub fn with_response(mut self, response: [f64; 4], step_s: f64) -> Result<Self, ConfigError> {
        for number in response {
            within("vibration response", number, -1e6, 1e6)?;
        }
        if response != [0.0; 4] {
            let ([rate_gain_s, _], [tilt_gain_s, _]) = (self.rate_gains_s, self.tilt_gains_s);
            let [rate, rate_s, tilt, tilt_s] = response;
            self.rate_gains_s = [rate_gain_s * rate, rate_gain_s * rate_s / step_s];
            self.tilt_gains_s = [tilt_gain_s * tilt, tilt_gain_s * tilt_s / step_s];
        }
        Ok(self)
    }

    /// Means over the last whole periods; zero before the first.
    pub fn newest(&self) -> VibrationCorrection {
        self.newest
    }

    /// The next step. Between two steps, values and products are the mean of both ends: the relative error is (2πf·step)²/12.
    pub fn update(&mut self, motion: Motion) -> VibrationCorrection {
        let Some(before) = self.before.replace(motion) else { return self.newest };
        let turned_rad = motion.gamma_rad - before.gamma_rad;
        let ([rate, rate_change], [tilt, tilt_change]) = (self.rate_gains_s, self.tilt_gains_s);
        let (sin_before, sin_now) = (libm::sin(before.gamma_rad), libm::sin(motion.gamma_rad));
        let product = before.alpha_rate_rad_s * sin_before + motion.alpha_rate_rad_s * sin_now;
        let change = (motion.alpha_rate_rad_s - before.alpha_rate_rad_s) * (sin_before + sin_now);
        let tilt_rad = 0.5 * tilt * (before.beta_rate_rad_s + motion.beta_rate_rad_s)
            + tilt_change * (motion.beta_rate_rad_s - before.beta_rate_rad_s);
        let vibration_rad = 0.5 * (rate * product + rate_change * change) - tilt_rad * turned_rad;
        let values = [0.5 * (before.alpha_rad + motion.alpha_rad), vibration_rad];
        let part = if self.left < 1.0 { self.left } else { 1.0 };
        for (sum, value) in self.sums.iter_mut().zip(values) {
            *sum += part * value;
        }
        self.left -= 1.0;
        if self.left <= 0.0 {
            let [alpha_rad, vibration_rad] = self.sums.map(|sum| sum / self.steps);
            self.newest = VibrationCorrection { alpha_rad, vibration_rad, means: self.newest.means.saturating_add(1) };
            // The rest of this step belongs to the next window.
            self.sums = values.map(|value| (1.0 - part) * value);
            self.left += self.steps;
        }
        self.newest
    }
}

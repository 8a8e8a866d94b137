//! The torquer with its amplifier: the commanded current becomes a precession rate, with a lag and an inequality of the two signs.

/// Parameters and state.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Torquer {
    /// K_m/H, rad/s/A.
    pub gain_rad_s_A: f64,
    /// Time constant of the amplifier, s.
    pub lag_s: f64,
    /// Relative excess of a negative current over its command.
    pub inequality: f64,
    /// Relative excess of the gain K_m/H for negative currents; the current does not show it.
    pub gain_inequality: f64,
    /// Current of the amplifier at zero input, A.
    pub offset_A: f64,
    /// Largest current, A.
    pub limit_A: f64,
    #[serde(skip)]
    now_A: f64,
    #[serde(skip)]
    mean_A: f64,
    #[serde(skip)]
    limited_A: Option<f64>,
}

impl Default for Torquer {
    fn default() -> Self {
        Self {
            gain_rad_s_A: 0.02,
            lag_s: 1e-3,
            inequality: 1e-4,
            gain_inequality: 0.0,
            offset_A: 0.0,
            limit_A: 0.1,
            now_A: 0.0,
            mean_A: 0.0,
            limited_A: None,
        }
    }
}

impl Torquer {
    /// No lag, no inequality.
    pub fn ideal() -> Self {
        Self { lag_s: 0.0, inequality: 0.0, ..Self::default() }
    }

    /// Advances by `dt_s` with this commanded current; returns the mean rate, rad/s.
    pub fn advance(&mut self, command_A: f64, dt_s: f64) -> f64 {
        let limit_A = self.limited_A.unwrap_or(self.limit_A);
        let unequal = if command_A < 0.0 { command_A * (1.0 + self.inequality) } else { command_A };
        let end_A = (unequal + self.offset_A).clamp(-limit_A, limit_A);
        let off_A = self.now_A - end_A;
        // First order, exactly over the step.
        let (left, mean) = if self.lag_s > 0.0 {
            let x = dt_s / self.lag_s;
            (libm::exp(-x), -libm::expm1(-x) / x)
        } else {
            (0.0, 0.0)
        };
        self.now_A = end_A + off_A * left;
        self.mean_A = end_A + off_A * mean;
        let gain_rad_s_A = if self.mean_A < 0.0 { self.gain_rad_s_A * (1.0 + self.gain_inequality) } else { self.gain_rad_s_A };
        self.mean_A * gain_rad_s_A
    }

    /// Mean current of the last step, A.
    pub fn mean_A(&self) -> f64 {
        self.mean_A
    }

    /// Limits the current, A; `None`: its own limit.
    pub fn limit(&mut self, limit_A: Option<f64>) {
        self.limited_A = limit_A;
    }
}

//! The torquer with its amplifier: the current that it is given becomes a rate of precession, a little later and a little unequal.

/// Constants and state.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Torquer {
    /// K_m/H, rad/s/A.
    pub gain_rad_s_A: f64,
    /// The amplifier's time constant, s.
    pub lag_s: f64,
    /// By what share a negative current is greater than asked.
    pub inequality: f64,
    /// By what share a negative current turns the gyro faster than a positive one: K_m/H itself is unequal, and no current shows it.
    pub gain_inequality: f64,
    /// The amplifier's current at no input, A.
    pub offset_A: f64,
    /// Its greatest, A.
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

    /// Time passes with this current asked for; the mean rate meanwhile, rad/s.
    pub fn advance(&mut self, given_A: f64, dt_s: f64) -> f64 {
        let limit_A = self.limited_A.unwrap_or(self.limit_A);
        let unequal = if given_A < 0.0 { given_A * (1.0 + self.inequality) } else { given_A };
        let end_A = (unequal + self.offset_A).clamp(-limit_A, limit_A);
        let off_A = self.now_A - end_A;
        // First order, exactly over the step.
        let (left, mean) = if self.lag_s > 0.0 {
            let x = dt_s / self.lag_s;
            ((-x).exp(), -(-x).exp_m1() / x)
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

    /// No more than this from now on, A; `None`: its own limit.
    pub fn limit(&mut self, limit_A: Option<f64>) {
        self.limited_A = limit_A;
    }
}

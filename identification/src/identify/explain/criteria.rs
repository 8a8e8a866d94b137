//! The thresholds of an explanation: every number on which a decision or the extent of a search depends.
//!
//! [`Criteria::default`] gives the values that the figures in `docs/figures.md` were made with. Thresholds in χ²/n are mean squares of
//! a residual over the variance of its channel's noise: 1 where only noise is left. Thresholds in ΔBIC are differences of the Bayesian
//! information criterion on whitened residuals. Where no reference is given, the value was chosen on simulated logs with known effects.

use crate::statistics::Extremes;

/// All thresholds, by stage.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Criteria {
    /// Several logs as one.
    pub joining: JoiningCriteria,
    /// What a log covers.
    pub coverage: CoverageCriteria,
    /// Classes of the misfit that a model leaves.
    pub noise: NoiseCriteria,
    /// Whitening of residuals.
    pub whitening: WhiteningCriteria,
    /// Significance, physical ranges, held-out rows.
    pub evidence: EvidenceCriteria,
    /// Values from which effects are tried, as far as their cards do not state them.
    pub trials: TrialCriteria,
    /// Search for harmonic orders and frequencies.
    pub harmonics: HarmonicCriteria,
    /// Screening of all effects and the choice of those that are refitted.
    pub screening: ScreeningCriteria,
    /// How far a refit is followed.
    pub descent: DescentCriteria,
    /// When the search ends, and what is eliminated.
    pub search: SearchCriteria,
    /// The verdict.
    pub verdict: VerdictCriteria,
    /// Structures that no effect of the catalogue has.
    pub unknown: UnknownCriteria,
    /// Whether a residual above the white noise is coloured noise.
    pub adequacy: AdequacyCriteria,
    /// The smallest effects that the logs would have shown.
    pub detection: DetectionCriteria,
}

/// Several logs as one.
#[derive(Debug, Clone, PartialEq)]
pub struct JoiningCriteria {
    /// Time inserted between two logs, sampling intervals; default 1000. Far above any gap within a log.
    pub gap_intervals: f64,
    /// Largest ratio of two logs' sampling intervals; default 1.2. One discretisation serves all rows.
    pub max_interval_ratio: f64,
}

impl Default for JoiningCriteria {
    fn default() -> Self {
        JoiningCriteria { gap_intervals: 1000.0, max_interval_ratio: 1.2 }
    }
}

/// What a log covers.
#[derive(Debug, Clone, PartialEq)]
pub struct CoverageCriteria {
    /// Length over which a rate is computed from the angle, s; default 0.02, as the fit compares angles.
    pub angle_interval_s: f64,
    /// Fraction of the largest rate above which the stand turns at all; default 0.01.
    pub min_turning_fraction: f64,
    /// Fraction of the largest rate below which a rate is slow; default 0.1.
    pub max_slow_fraction: f64,
    /// Fraction of the largest rate that the other direction must reach; default 0.05.
    pub min_reverse_fraction: f64,
    /// Fraction of slow rows below which a ripple over the angle is not visible; default 0.05.
    pub min_slow_rows_fraction: f64,
    /// Number of turns below which a ripple over the angle is not visible; default 2.
    pub min_turns: f64,
    /// Warming of the winding below which effects of its temperature are not visible, K; default 3 (1.2 % of a copper resistance).
    pub min_warming_K: f64,
}

impl Default for CoverageCriteria {
    fn default() -> Self {
        CoverageCriteria {
            angle_interval_s: 0.02,
            min_turning_fraction: 0.01,
            max_slow_fraction: 0.1,
            min_reverse_fraction: 0.05,
            min_slow_rows_fraction: 0.05,
            min_turns: 2.0,
            min_warming_K: 3.0,
        }
    }
}

/// Upper limits of the classes of [`MisfitClass`], χ²/n of the worst channel.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseCriteria {
    /// Only noise is left; default 1.03, rms 1.5 % above the noise. The noise itself is estimated to about 1 %.
    pub noise: f64,
    /// No difference is visible to a person; default 1.08, rms 4 % above the noise.
    pub invisible: f64,
    /// May be the noise itself; default 1.15. The noise of a shaft encoder at an even rate is known to some percent only.
    pub noise_uncertainty: f64,
    /// Small effects still matter; default 2.
    pub small: f64,
    /// Whitened residuals still describe the noise more than the error; default 4.
    pub moderate: f64,
    /// The fitted parameters can still be trusted; default 25, rms 5 × the noise.
    pub large: f64,
}

impl Default for NoiseCriteria {
    fn default() -> Self {
        NoiseCriteria { noise: 1.03, invisible: 1.08, noise_uncertainty: 1.15, small: 2.0, moderate: 4.0, large: 25.0 }
    }
}

/// How much a model leaves, by the χ²/n of its worst channel. Every decision on "only noise is left" compares with one of these classes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum MisfitClass {
    /// Only noise is left.
    Noise,
    /// More than noise, and not visible to a person.
    Invisible,
    /// As much as the noise is uncertain.
    NoiseUncertainty,
    /// Small effects still matter.
    Small,
    /// Most of the residual is not noise.
    Moderate,
    /// The residual is several times the noise.
    Large,
    /// The residual is so large that the fitted parameters may be far off.
    Dominant,
}

impl NoiseCriteria {
    /// Class of a χ²/n: the one definition of "only noise is left".
    pub fn misfit(&self, chi2_per_n: f64) -> MisfitClass {
        let classes = [
            (self.noise, MisfitClass::Noise),
            (self.invisible, MisfitClass::Invisible),
            (self.noise_uncertainty, MisfitClass::NoiseUncertainty),
            (self.small, MisfitClass::Small),
            (self.moderate, MisfitClass::Moderate),
            (self.large, MisfitClass::Large),
        ];
        classes.into_iter().find(|(limit, _)| chi2_per_n <= *limit).map_or(MisfitClass::Dominant, |(_, class)| class)
    }
}

/// Whitening of residuals by an autoregression.
#[derive(Debug, Clone, PartialEq)]
pub struct WhiteningCriteria {
    /// Largest order of the autoregression; default 20.
    pub max_order: usize,
    /// Rows that each coefficient needs; default 50.
    pub rows_per_coefficient: usize,
    /// Smallest ratio of two sums of squares; default 1e-12. A perfect model keeps a finite likelihood.
    pub min_square_ratio: f64,
}

impl Default for WhiteningCriteria {
    fn default() -> Self {
        WhiteningCriteria { max_order: 20, rows_per_coefficient: 50, min_square_ratio: 1e-12 }
    }
}

/// Significance, physical ranges, held-out rows. A *gain* is 2 ln of the likelihood ratio on whitened residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct EvidenceCriteria {
    /// Probability of adding an effect to a complete model, per adding step over the whole catalogue; default 0.002.
    pub max_familywise_p: f64,
    /// ΔBIC by which an effect must improve the model, and by which two effects are distinguishable; default 6 ("strong": Kass, Raftery,
    /// J. Am. Stat. Assoc. 90 (1995) 773).
    pub min_bic_difference: f64,
    /// Fall of the gain on held-out rows, or on another log, that refuses an effect; default 6.
    pub max_heldout_loss: f64,
    /// Gain below which held-out rows must confirm an effect; default 200.
    pub confirmed_below_gain: f64,
    /// Fraction of the gain that the held-out rows must then show; default 0.1. They are a third as many as the fitted rows.
    pub min_confirmed_fraction: f64,
    /// Gain from which on an effect is added although what is left is noise, or invisible; default 100. Below, it may be an error of the
    /// integration, or of the input within a row.
    pub min_gain_at_noise: f64,
    /// Part of a count of the encoder below which a jump of the angle is its rounding, above all that of a rotor at rest; default 0.75. A
    /// counter loses whole counts.
    pub min_lost_counts: f64,
    /// Relative change of χ²/n on held-out rows that is insignificant while much is unexplained; default 0.04.
    pub max_insignificant_change: f64,
    /// Standard errors by which a parameter may lie outside its physical range; default 3.
    pub range_tolerance_sigmas: f64,
    /// Excess χ²/n below which two models are not compared; default 0.1.
    pub min_compared_excess: f64,
    /// Ratio of the excess χ²/n on held-out rows below which one model leaves far less than another; default 0.5.
    pub far_less_ratio: f64,
}

impl Default for EvidenceCriteria {
    fn default() -> Self {
        EvidenceCriteria {
            max_familywise_p: 0.002,
            min_bic_difference: 6.0,
            max_heldout_loss: 6.0,
            confirmed_below_gain: 200.0,
            min_confirmed_fraction: 0.1,
            min_gain_at_noise: 100.0,
            min_lost_counts: 0.75,
            max_insignificant_change: 0.04,
            range_tolerance_sigmas: 3.0,
            min_compared_excess: 0.1,
            far_less_ratio: 0.5,
        }
    }
}

impl EvidenceCriteria {
    /// A gain of this familywise probability and ΔBIC is significant and improves the model.
    pub fn is_significant(&self, ln_p: f64, delta_bic: f64) -> bool {
        ln_p < self.max_familywise_p.ln() && delta_bic < -self.min_bic_difference
    }

    /// A model leaves far less to explain than another, by the χ²/n of their channels, in the worst channel.
    pub fn leaves_far_less(&self, one: &[f64], other: &[f64]) -> bool {
        let excess = |of: &[f64]| (worst(of.iter().copied()) - 1.0).max(self.min_compared_excess);
        excess(one) < self.far_less_ratio * excess(other)
    }
}

/// The largest of the channels' χ²/n.
pub fn worst(chi2_per_n: impl Iterator<Item = f64>) -> f64 {
    chi2_per_n.max_or_zero()
}

/// Values from which effects are tried, as far as their cards do not state them.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialCriteria {
    /// Amplitude of an absent periodic effect, in its unit; default 1e-12. Its phase still has a derivative there.
    pub absent_amplitude: f64,
    /// Longest sampling interval from which an inductance is derived, s; default 2 ms.
    pub max_winding_interval_s: f64,
    /// Largest product of a tried resonance and the sampling interval; default 0.2.
    pub max_resonance_per_row: f64,
    /// Slowest resonance of a fitted shaft, Hz; default 1.
    pub min_shaft_resonance_Hz: f64,
    /// Fastest resonance of a fitted shaft, periods per row; default 0.08. A faster one is a rigid shaft at many times the cost.
    pub max_shaft_resonance_per_row: f64,
    /// Fastest resonance of the rotor on a fitted bristle, periods per row; default 0.2. A stiffer bristle is Coulomb friction.
    pub max_bristle_resonance_per_row: f64,
    /// Periods that the log must cover of a periodic effect; default 1.5.
    pub min_periods: f64,
    /// Span of the winding temperature below which its effects are not visible, K; default 0.5.
    pub min_temperature_span_K: f64,
    /// Smallest rate that counts as the largest rate of a log, rad/s; default 1e-3.
    pub min_largest_rate_rad_s: f64,
}

impl Default for TrialCriteria {
    fn default() -> Self {
        TrialCriteria {
            absent_amplitude: 1e-12,
            max_winding_interval_s: 2e-3,
            max_resonance_per_row: 0.2,
            min_shaft_resonance_Hz: 1.0,
            max_shaft_resonance_per_row: 0.08,
            max_bristle_resonance_per_row: 0.2,
            min_periods: 1.5,
            min_temperature_span_K: 0.5,
            min_largest_rate_rad_s: 1e-3,
        }
    }
}

/// Search for harmonic orders over the angle, and for frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct HarmonicCriteria {
    /// Highest order of a torque, periods per turn; default 400, the limit of the cards.
    pub max_order: usize,
    /// Highest order of the encoder's error, periods per turn; default 8.
    pub max_encoder_order: usize,
    /// Orders of a torque that are screened exactly; default 5.
    pub torque_orders: usize,
    /// Orders of a torque that are screened besides, by the torque computed from the rows; default 1.
    pub local_orders: usize,
    /// Orders of the motor constant that are screened exactly; default 4.
    pub motor_constant_orders: usize,
    /// Orders of the encoder that are screened exactly; default 2.
    pub encoder_orders: usize,
    /// Highest order of the inertia, periods per turn; default 20, the limit of the card.
    pub max_inertia_order: usize,
    /// Orders of the inertia that are screened exactly; default 2.
    pub inertia_orders: usize,
    /// Numbers of periods per turn, not whole, that are screened exactly; default 2. As many frequencies.
    pub periods: usize,
    /// Fewest periods in the log of a period that need not be a whole part of a turn; default 2. Less is a drift.
    pub min_periods_in_log: f64,
    /// Phase of the highest order that one row covers at the largest rate, rad; default 4π, a period per row at half of that rate.
    pub max_phase_per_row_rad: f64,
    /// Most multiples of half a period of the log that are searched as frequencies; default 3000.
    pub max_half_periods: usize,
    /// Highest frequency, Hz; default 50.
    pub max_frequency_Hz: f64,
    /// Highest frequency, periods per row; default 0.2.
    pub max_frequency_per_row: f64,
    /// Lowest frequency, half periods of the log; default 4. Less than two periods are a drift.
    pub min_half_periods: u32,
    /// Rows before and after over which the torque of a row is computed; default 10.
    pub local_torque_rows: usize,
    /// Rows to which friction is fitted there; default 5000.
    pub local_friction_rows: usize,
    /// Angle passed within those rows above which a row has less weight, 1/rad; default 3.
    pub local_blur_per_rad: f64,
}

impl Default for HarmonicCriteria {
    fn default() -> Self {
        HarmonicCriteria {
            max_order: 400,
            max_encoder_order: 8,
            torque_orders: 5,
            local_orders: 1,
            motor_constant_orders: 4,
            encoder_orders: 2,
            max_inertia_order: 20,
            inertia_orders: 2,
            periods: 2,
            min_periods_in_log: 2.0,
            max_phase_per_row_rad: 2.0 * std::f64::consts::TAU,
            max_half_periods: 3000,
            max_frequency_Hz: 50.0,
            max_frequency_per_row: 0.2,
            min_half_periods: 4,
            local_torque_rows: 10,
            local_friction_rows: 5000,
            local_blur_per_rad: 3.0,
        }
    }
}

/// Screening of all effects, and the choice of those that are refitted.
#[derive(Debug, Clone, PartialEq)]
pub struct ScreeningCriteria {
    /// Fraction of an effect's sensitivity that the model's own parameters cannot imitate, below which it is not identifiable; default
    /// 1e-6.
    pub min_identifiable_fraction: f64,
    /// Fraction of an excerpt's χ² that one step with an expensive effect may leave; default 0.9.
    pub max_expensive_remainder: f64,
    /// Effects that are refitted at most; default 8.
    pub max_refitted: usize,
    /// Candidates that are refitted whatever their score relative to the best; default 4.
    pub min_refitted: usize,
    /// Fraction of the best score from which on a candidate is refitted; default 0.25.
    pub min_score_fraction: f64,
    /// The same where the score is a rough prediction (a finite trial, a nonlinear parameter held); default 0.05.
    pub min_rough_score_fraction: f64,
    /// Fraction of the best score from which on two trials of one structure are refitted; default 0.6.
    pub second_start_fraction: f64,
    /// Candidates that are refitted at the same time, the best first: the later ones stop where they cannot reach them; default 2.
    pub simultaneous_refits: usize,
    /// Trials that are fitted to short windows at most; default 6.
    pub max_window_trials: usize,
    /// Trials of one effect among them; default 2.
    pub max_window_trials_per_effect: usize,
    /// Fraction of what the best leaves in short windows by which another may leave more; default 1.
    pub max_window_excess: f64,
    /// Fraction of the best χ² decrease by which another may decrease χ² less and still be fitted to the end; default 0.5.
    pub max_decrease_deficit: f64,
    /// Fraction of the best χ² on an excerpt below which an expensive candidate is refitted on the whole log; default 0.7.
    pub max_expensive_chi2_fraction: f64,
    /// Standard errors below which a fitted backlash gap may be closed; default 10.
    pub closed_gap_sigmas: f64,
    /// Rivals of an added effect that are remembered; default 4.
    pub max_rivals: usize,
    /// Fractions of an absent effect's first step that are tried, largest first, until χ² falls.
    pub step_fractions: Vec<f64>,
    /// Fraction of the predicted decrease of χ² below which the descent is repeated with the model's own parameters held; default 0.3.
    pub min_kept_prediction: f64,
}

impl Default for ScreeningCriteria {
    fn default() -> Self {
        ScreeningCriteria {
            min_identifiable_fraction: 1e-6,
            max_expensive_remainder: 0.9,
            max_refitted: 8,
            min_refitted: 4,
            min_score_fraction: 0.25,
            min_rough_score_fraction: 0.05,
            second_start_fraction: 0.6,
            simultaneous_refits: 2,
            max_window_trials: 6,
            max_window_trials_per_effect: 2,
            max_window_excess: 1.0,
            max_decrease_deficit: 0.5,
            max_expensive_chi2_fraction: 0.7,
            closed_gap_sigmas: 10.0,
            max_rivals: 4,
            step_fractions: vec![1.0, 0.3, 0.1, 0.03],
            min_kept_prediction: 0.3,
        }
    }
}

/// How far a refit is followed.
#[derive(Debug, Clone, PartialEq)]
pub struct DescentCriteria {
    /// Predicted decrease of χ² below which a descent has converged; default 0.05, far below any decision.
    pub min_chi2_decrease: f64,
    /// The same in a comparison of candidates, fraction of the excess χ²; default 1e-3. The best are refitted.
    pub min_excess_decrease: f64,
    /// Predicted decrease, fraction of the distance to the best rival, below which a candidate cannot reach it; default 0.02.
    pub min_rival_approach: f64,
    /// Steps over which the rate of convergence is measured; default 4.
    pub trend_steps: usize,
    /// Decrease of χ² in these steps below which a descent has converged; default 0.5. Sticking makes steps in the cost that the linear
    /// model does not predict.
    pub min_trend_decrease: f64,
    /// Steps of a descent on the whole log at most; default 20.
    pub max_steps: usize,
    /// Steps of a descent on an excerpt at most; default 30.
    pub max_excerpt_steps: usize,
    /// Excess χ² relative to the best within which a candidate is fitted to the end; default 0.1.
    pub near_best_fraction: f64,
    /// Length of an excerpt, s; default 3.
    pub excerpt_s: f64,
    /// Rows of an excerpt at least; default 500.
    pub min_excerpt_rows: usize,
    /// Lengths of the windows between the shortest ones and the whole log, s.
    pub window_lengths_s: Vec<f64>,
}

impl Default for DescentCriteria {
    fn default() -> Self {
        DescentCriteria {
            min_chi2_decrease: 0.05,
            min_excess_decrease: 1e-3,
            min_rival_approach: 0.02,
            trend_steps: 4,
            min_trend_decrease: 0.5,
            max_steps: 20,
            max_excerpt_steps: 30,
            near_best_fraction: 0.1,
            excerpt_s: 3.0,
            min_excerpt_rows: 500,
            window_lengths_s: vec![1.0, 4.0],
        }
    }
}

/// When the search ends, and what is eliminated.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchCriteria {
    /// Effects that are added at most; default 10.
    pub max_added: usize,
    /// Insignificant effects in a row that end the search; default 2.
    pub max_insignificant_in_a_row: usize,
    /// Fraction of the excess χ²/n that an insignificant effect removes at most; default 0.03.
    pub max_insignificant_fraction: f64,
    /// (effects, fraction of the excess χ²/n): with so many effects that leave so much, far above the noise, the search ends.
    /// Default (4, 0.5), (6, 0.1).
    pub max_remainders: Vec<(usize, f64)>,
    /// Standard errors below which an added amplitude may be zero; default 5.
    pub zero_amplitude_sigmas: f64,
    /// Times that such an effect may lead to a better fit of the model without it; default 3.
    pub max_restarts: usize,
    /// Effort after which the search ends with its best answer so far: simulated rows × lanes (the value and its derivatives) over the rows
    /// of the logs; default 400 000, `None`: none.
    pub max_passes: Option<u64>,
}

impl Default for SearchCriteria {
    fn default() -> Self {
        let verdict = VerdictCriteria::default();
        SearchCriteria {
            max_added: 10,
            max_insignificant_in_a_row: 2,
            max_insignificant_fraction: 0.03,
            max_remainders: vec![(4, verdict.max_remainder), (6, verdict.max_remainder_far_from_noise)],
            zero_amplitude_sigmas: 5.0,
            max_restarts: 3,
            max_passes: Some(400_000),
        }
    }
}

/// The verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct VerdictCriteria {
    /// Fraction of the given model's excess χ²/n that the cause of the error may leave; default 0.5.
    pub max_remainder: f64,
    /// The same while the misfit is dominant; default 0.1. An effect that leaves more may stand in for another.
    pub max_remainder_far_from_noise: f64,
    /// Effects from which on a single unknown structure is a rival of all of them together; default 3.
    pub suspicious_effects: usize,
    /// Misfit that so many effects may leave and still be named; default small, rms 1.4 × the noise. Several periodic effects together
    /// imitate much that none of them is.
    pub max_misfit_of_many: MisfitClass,
    /// Smallest excess χ²/n by which is divided; default 1e-3.
    pub min_excess: f64,
    /// Part of the measured motion below which an effect is called small; default 1e-3. Errors of readings, times and models that no
    /// catalogue has are seldom smaller on a bench, and one of them may look like the effect.
    pub small_part: f64,
}

impl Default for VerdictCriteria {
    fn default() -> Self {
        VerdictCriteria {
            max_remainder: 0.5,
            max_remainder_far_from_noise: 0.1,
            suspicious_effects: 3,
            max_misfit_of_many: MisfitClass::Small,
            min_excess: 1e-3,
            small_part: 1e-3,
        }
    }
}

/// Whether a residual above the white noise is coloured noise.
#[derive(Debug, Clone, PartialEq)]
pub struct AdequacyCriteria {
    /// Probability of calling noise dependent on the input, over all channels; default 0.001, as for a misfit.
    pub max_familywise_p: f64,
    /// Fraction of the innovations' variance that the input must explain to matter; default 0.03, as in [`NoiseCriteria::noise`]: a smaller
    /// part of the white noise is within the accuracy of the simulation, however many rows show it.
    pub min_input_fraction: f64,
    /// Fraction of a residual's variance that may depend on rate, angle or temperature where it is otherwise put down to an input that is
    /// not known between its samples; default 0.1, because the part that the input may have left is itself an estimate.
    pub max_state_fraction: f64,
    /// Rows of the past input that are tested; default 30, at 1 kHz a usual mechanical time constant.
    pub lags: usize,
    /// The same in increments of the angle, 20 ms each; default 10.
    pub lags_of_increments: usize,
    /// Harmonics of the turn that the residual of a rate sensor against a known motion is tested for; default 4.
    pub harmonics: usize,
    /// Turns of that motion from which they are tested; default 1.5, as for the effects with a harmonic order.
    pub min_turns: f64,
    /// Correlation times of coloured noise that the log must contain at least; default 30, as for `min_coherence_blocks`.
    pub min_correlation_times: f64,
    /// Correlation of two channels' residuals from which a torque may move both; default 0.1.
    pub min_coherence: f64,
    /// Its standard errors; default 4, once in 16 000 independent pairs of series. Some ten are compared in a log.
    pub min_coherence_sigmas: f64,
    /// Blocks of the log from which the correlation is computed; default 30: longer blocks, of which there are fewer, tell slower motion.
    pub min_coherence_blocks: usize,
}

impl Default for AdequacyCriteria {
    fn default() -> Self {
        AdequacyCriteria {
            max_familywise_p: 1e-3,
            min_input_fraction: 0.03,
            max_state_fraction: 0.1,
            lags: 30,
            lags_of_increments: 10,
            harmonics: 4,
            min_turns: 1.5,
            min_correlation_times: 30.0,
            min_coherence: 0.1,
            min_coherence_sigmas: 4.0,
            min_coherence_blocks: 30,
        }
    }
}

/// Detection limits.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectionCriteria {
    /// Standard deviations between the expected root of the gain at the limit and the gain that the search asks for; default 1.96. The gain
    /// falls short of it in 2.5 %, and about as often the held-out rows do not confirm it: together 95 %.
    pub power_sigmas: f64,
    /// Highest order at which a limit is computed; default 40. Slots and poles of small motors are below it.
    pub max_order: u32,
    /// Ratio of two neighbouring orders; default 1.6.
    pub order_ratio: f64,
    /// Ratio of two neighbouring frequencies; default 4.
    pub frequency_ratio: f64,
    /// Times of a jump of the angle, fractions of the log; default a quarter, a half, three quarters.
    pub jump_fractions: Vec<f64>,
}

impl Default for DetectionCriteria {
    fn default() -> Self {
        DetectionCriteria {
            power_sigmas: 1.96,
            max_order: 40,
            order_ratio: 1.6,
            frequency_ratio: 4.0,
            jump_fractions: vec![0.25, 0.5, 0.75],
        }
    }
}

impl Criteria {
    /// Fraction of the excess at the χ²/n `given` that is left at `left`.
    pub fn remainder(&self, given: f64, left: f64) -> f64 {
        (left - 1.0).max(0.0) / (given - 1.0).max(self.verdict.min_excess)
    }

    /// A structure that leaves the χ²/n `structure` replaces effects that leave `effects`: it leaves noise, or explains most of what they
    /// leave. A free function contains the shape of each effect over its coordinate; where something else is left, a slightly better fit is
    /// no evidence for it.
    pub fn replaces(&self, structure: f64, effects: f64) -> bool {
        structure <= self.noise.invisible || self.remainder(effects, structure) < self.verdict.max_remainder
    }

    /// Effects that leave the fraction `remainder` of the excess, and the χ²/n `left`, may be the cause of the error.
    pub fn may_be_the_cause(&self, remainder: f64, left: f64) -> bool {
        let near_noise = self.noise.misfit(left) < MisfitClass::Dominant;
        remainder < self.verdict.max_remainder && (near_noise || remainder < self.verdict.max_remainder_far_from_noise)
    }
}

/// Structures that no effect of the catalogue has.
#[derive(Debug, Clone, PartialEq)]
pub struct UnknownCriteria {
    /// Knots of a piecewise linear function over angle or time at most; default 22.
    pub max_knots: usize,
    /// Knots over rate or current at most; default 14.
    pub max_knots_rate: usize,
    /// Knots over temperature at most; default 8.
    pub max_knots_temperature: usize,
    /// Knots below which no function is tried; default 6.
    pub min_knots: usize,
    /// Functions that are fitted in full; default 2.
    pub max_fitted: usize,
    /// Expressions with the shape of a function that are fitted in full; default 3.
    pub max_expressions: usize,
    /// Functions and frequencies among which chance may choose; default 4000.
    pub tests: f64,
    /// Confidence interval of a knot, multiple of the median one, from which on the knot is not drawn; default 8.
    pub max_confidence_ratio: f64,
    /// Steepness of the edges of a sector, per unit of cos θ; default 80.
    pub sector_steepness: f64,
    /// Turns from which on a function of the angle is tried; default 1.
    pub min_turns: f64,
}

impl Default for UnknownCriteria {
    fn default() -> Self {
        UnknownCriteria {
            max_knots: 22,
            max_knots_rate: 14,
            max_knots_temperature: 8,
            min_knots: 6,
            max_fitted: 2,
            max_expressions: 3,
            tests: 4000.0,
            max_confidence_ratio: 8.0,
            sector_steepness: 80.0,
            min_turns: 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misfit_classes_follow_their_limits() {
        let noise = NoiseCriteria::default();
        let classes: Vec<MisfitClass> = [0.9, 1.03, 1.08, 1.1, 1.5, 3.0, 25.0, 26.0, f64::INFINITY].map(|x| noise.misfit(x)).into();
        assert_eq!(
            classes,
            [
                MisfitClass::Noise,
                MisfitClass::Noise,
                MisfitClass::Invisible,
                MisfitClass::NoiseUncertainty,
                MisfitClass::Small,
                MisfitClass::Moderate,
                MisfitClass::Large,
                MisfitClass::Dominant,
                MisfitClass::Dominant
            ]
        );
    }

    #[test]
    fn structure_replaces_effects_whose_remainder_it_explains() {
        let c = Criteria::default();
        assert!(c.replaces(1.0, 1.0) && c.replaces(1.0, 300.0), "only noise is left");
        assert!(c.replaces(3.0, 9.0), "a quarter of the excess is left");
        assert!(!c.replaces(2.4, 2.6), "what both leave is something else");
        assert!(!c.replaces(9.0, 3.0));
    }

    #[test]
    fn effects_that_leave_much_far_above_the_noise_are_not_the_cause() {
        let c = Criteria::default();
        let judged = |given: f64, left: f64| c.may_be_the_cause(c.remainder(given * given, left * left), left * left);
        assert!(judged(154.0, 1.0) && judged(154.0, 20.0), "almost everything is explained");
        assert!(!judged(154.0, 57.0), "a seventh of the squares is left, at 57 × the noise");
        assert!(judged(3.0, 1.5), "near the noise");
        assert!(!judged(3.0, 2.5), "more than half is left");
        assert!(!judged(1.0, 1.1), "there was nothing to explain");
    }
}

//! The thresholds of an explanation: every number on which a decision or the extent of a search depends.
//!
//! The figures in `docs/figures.md` were made with the default of each, which stands beside it. Thresholds in χ²/n are mean squares of
//! a residual over the variance of its channel's noise: 1 where only noise is left. Thresholds in ΔBIC are differences of the Bayesian
//! information criterion on whitened residuals. Where no reference is given, the value was chosen on simulated logs with known effects.

use crate::statistics::Extremes;

/// Thresholds, each with its default beside it.
macro_rules! thresholds {
    ($(#[$about:meta])* pub struct $name:ident { $($(#[$doc:meta])* pub $field:ident: $kind:ty = $default:expr,)* }) => {
        $(#[$about])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $($(#[$doc])* pub $field: $kind,)*
        }

        impl Default for $name {
            fn default() -> Self {
                $name { $($field: $default,)* }
            }
        }
    };
}

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

thresholds! {
    /// Several logs as one.
    pub struct JoiningCriteria {
        /// Time inserted between two logs, sampling intervals. Far above any gap within a log.
        pub gap_intervals: f64 = 1000.0,
        /// Largest ratio of two logs' sampling intervals. One discretisation serves all rows.
        pub max_interval_ratio: f64 = 1.2,
    }
}

thresholds! {
    /// What a log covers.
    pub struct CoverageCriteria {
        /// Length over which a rate is computed from the angle, s, as the fit compares angles.
        pub angle_interval_s: f64 = 0.02,
        /// Fraction of the largest rate above which the stand turns at all.
        pub min_turning_fraction: f64 = 0.01,
        /// Fraction of the largest rate below which a rate is slow.
        pub max_slow_fraction: f64 = 0.1,
        /// Fraction of the largest rate that the other direction must reach.
        pub min_reverse_fraction: f64 = 0.05,
        /// Fraction of slow rows below which a ripple over the angle is not visible.
        pub min_slow_rows_fraction: f64 = 0.05,
        /// Number of turns below which a ripple over the angle is not visible.
        pub min_turns: f64 = 2.0,
        /// Warming of the winding below which effects of its temperature are not visible, K (1.2 % of a copper resistance).
        pub min_warming_K: f64 = 3.0,
    }
}

thresholds! {
    /// Upper limits of the classes of [`MisfitClass`], χ²/n of the worst channel.
    pub struct NoiseCriteria {
        /// Only noise is left, rms 1.5 % above the noise. The noise itself is estimated to about 1 %.
        pub noise: f64 = 1.03,
        /// No difference is visible to a person, rms 4 % above the noise.
        pub invisible: f64 = 1.08,
        /// May be the noise itself. The noise of a shaft encoder at an even rate is known to some percent only.
        pub noise_uncertainty: f64 = 1.15,
        /// Small effects still matter.
        pub small: f64 = 2.0,
        /// Whitened residuals still describe the noise more than the error.
        pub moderate: f64 = 4.0,
        /// The fitted parameters can still be trusted, rms 5 × the noise.
        pub large: f64 = 25.0,
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

thresholds! {
    /// Whitening of residuals by an autoregression.
    pub struct WhiteningCriteria {
        /// Largest order of the autoregression.
        pub max_order: usize = 20,
        /// Rows that each coefficient needs.
        pub rows_per_coefficient: usize = 50,
        /// Smallest ratio of two sums of squares. A perfect model keeps a finite likelihood.
        pub min_square_ratio: f64 = 1e-12,
    }
}

thresholds! {
    /// Significance, physical ranges, held-out rows. A *gain* is 2 ln of the likelihood ratio on whitened residuals.
    pub struct EvidenceCriteria {
        /// Probability of adding an effect to a complete model, per adding step over the whole catalogue.
        pub max_familywise_p: f64 = 0.002,
        /// ΔBIC by which an effect must improve the model, and by which two effects are distinguishable ("strong": Kass, Raftery,
        /// J. Am. Stat. Assoc. 90 (1995) 773).
        pub min_bic_difference: f64 = 6.0,
        /// Fall of the gain on held-out rows, or on another log, that refuses an effect.
        pub max_heldout_loss: f64 = 6.0,
        /// Gain below which held-out rows must confirm an effect.
        pub confirmed_below_gain: f64 = 200.0,
        /// Fraction of the gain that the held-out rows must then show. They are a third as many as the fitted rows.
        pub min_confirmed_fraction: f64 = 0.1,
        /// Gain from which on an effect is added although what is left is noise, or invisible. Below, it may be an error of the
        /// integration, or of the input within a row.
        pub min_gain_at_noise: f64 = 100.0,
        /// χ²/n of the worst channel below which nothing is added. The noise is at least the rounding of a reading that moves, which is even
        /// within a count and independent from row to row. A residual that is clearly smaller is that of readings that rest: within a count
        /// they say nothing, and their likelihood is none.
        pub min_chi2_per_n: f64 = 0.8,
        /// Part of a count of the encoder below which a jump of the angle is its rounding, above all that of a rotor at rest. A
        /// counter loses whole counts.
        pub min_lost_counts: f64 = 0.75,
        /// Relative change of χ²/n on held-out rows that is insignificant while much is unexplained.
        pub max_insignificant_change: f64 = 0.04,
        /// Standard errors by which a parameter may lie outside its physical range.
        pub range_tolerance_sigmas: f64 = 3.0,
        /// Excess χ²/n below which two models are not compared.
        pub min_compared_excess: f64 = 0.1,
        /// Ratio of the excess χ²/n on held-out rows below which one model leaves far less than another.
        pub far_less_ratio: f64 = 0.5,
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

thresholds! {
    /// Values from which effects are tried, as far as their cards do not state them.
    pub struct TrialCriteria {
        /// Amplitude of an absent periodic effect, in its unit. Its phase still has a derivative there.
        pub absent_amplitude: f64 = 1e-12,
        /// Longest sampling interval from which an inductance is derived, s.
        pub max_winding_interval_s: f64 = 2e-3,
        /// Largest product of a tried resonance and the sampling interval.
        pub max_resonance_per_row: f64 = 0.2,
        /// Slowest resonance of a fitted shaft, Hz.
        pub min_shaft_resonance_Hz: f64 = 1.0,
        /// Fastest resonance of a fitted shaft, periods per row. A faster one is a rigid shaft at many times the cost.
        pub max_shaft_resonance_per_row: f64 = 0.08,
        /// Fastest resonance of the rotor on a fitted bristle, periods per row. A stiffer bristle is Coulomb friction.
        pub max_bristle_resonance_per_row: f64 = 0.2,
        /// Periods that the log must cover of a periodic effect.
        pub min_periods: f64 = 1.5,
        /// Span of the winding temperature below which its effects are not visible, K.
        pub min_temperature_span_K: f64 = 0.5,
        /// Smallest rate that counts as the largest rate of a log, rad/s.
        pub min_largest_rate_rad_s: f64 = 1e-3,
    }
}

thresholds! {
    /// Search for harmonic orders over the angle, and for frequencies.
    pub struct HarmonicCriteria {
        /// Highest order of a torque, periods per turn, the limit of the cards.
        pub max_order: usize = 400,
        /// Highest order of the encoder's error, periods per turn.
        pub max_encoder_order: usize = 8,
        /// Orders of a torque that are screened exactly.
        pub torque_orders: usize = 5,
        /// Orders of a torque that are screened besides, by the torque computed from the rows.
        pub local_orders: usize = 1,
        /// Orders of the motor constant that are screened exactly.
        pub motor_constant_orders: usize = 4,
        /// Orders of the encoder that are screened exactly.
        pub encoder_orders: usize = 2,
        /// Highest order of the inertia, periods per turn, the limit of the card.
        pub max_inertia_order: usize = 20,
        /// Orders of the inertia that are screened exactly.
        pub inertia_orders: usize = 2,
        /// Numbers of periods per turn, not whole, that are screened exactly. As many frequencies.
        pub periods: usize = 2,
        /// Fewest periods in the log of a period that need not be a whole part of a turn. Less is a drift.
        pub min_periods_in_log: f64 = 2.0,
        /// Phase of the highest order that one row covers at the largest rate, rad, a period per row at half of that rate.
        pub max_phase_per_row_rad: f64 = 2.0 * std::f64::consts::TAU,
        /// Most multiples of half a period of the log that are searched as frequencies.
        pub max_half_periods: usize = 3000,
        /// Highest frequency, Hz.
        pub max_frequency_Hz: f64 = 50.0,
        /// Highest frequency, periods per row.
        pub max_frequency_per_row: f64 = 0.2,
        /// Lowest frequency, half periods of the log. Less than two periods are a drift.
        pub min_half_periods: u32 = 4,
        /// Rows before and after over which the torque of a row is computed.
        pub local_torque_rows: usize = 10,
        /// Rows to which friction is fitted there.
        pub local_friction_rows: usize = 5000,
        /// Angle passed within those rows above which a row has less weight, 1/rad.
        pub local_blur_per_rad: f64 = 3.0,
    }
}

thresholds! {
    /// Screening of all effects, and the choice of those that are refitted.
    pub struct ScreeningCriteria {
        /// Fraction of an effect's sensitivity that the model's own parameters cannot imitate, below which it is not identifiable.
        pub min_identifiable_fraction: f64 = 1e-6,
        /// Fraction of an excerpt's χ² that one step with an expensive effect may leave.
        pub max_expensive_remainder: f64 = 0.9,
        /// Effects that are refitted at most.
        pub max_refitted: usize = 8,
        /// Candidates that are refitted whatever their score relative to the best.
        pub min_refitted: usize = 4,
        /// Fraction of the best score from which on a candidate is refitted.
        pub min_score_fraction: f64 = 0.25,
        /// The same where the score is a rough prediction (a finite trial, a nonlinear parameter held).
        pub min_rough_score_fraction: f64 = 0.05,
        /// Fraction of the best score from which on two trials of one structure are refitted.
        pub second_start_fraction: f64 = 0.6,
        /// Candidates that are refitted at the same time, the best first: the later ones stop where they cannot reach them.
        pub simultaneous_refits: usize = 2,
        /// Trials that are fitted to short windows at most.
        pub max_window_trials: usize = 6,
        /// Trials of one effect among them.
        pub max_window_trials_per_effect: usize = 2,
        /// Fraction of what the best leaves in short windows by which another may leave more.
        pub max_window_excess: f64 = 1.0,
        /// Fraction of the best χ² decrease by which another may decrease χ² less and still be fitted to the end.
        pub max_decrease_deficit: f64 = 0.5,
        /// Fraction of the best χ² on an excerpt below which an expensive candidate is refitted on the whole log.
        pub max_expensive_chi2_fraction: f64 = 0.7,
        /// Standard errors below which a fitted backlash gap may be closed.
        pub closed_gap_sigmas: f64 = 10.0,
        /// Rivals of an added effect that are remembered.
        pub max_rivals: usize = 4,
        /// Fractions of an absent effect's first step that are tried, largest first, until χ² falls.
        pub step_fractions: Vec<f64> = vec![1.0, 0.3, 0.1, 0.03],
        /// Fraction of the predicted decrease of χ² below which the descent is repeated with the model's own parameters held.
        pub min_kept_prediction: f64 = 0.3,
    }
}

thresholds! {
    /// How far a refit is followed.
    pub struct DescentCriteria {
        /// Predicted decrease of χ² below which a descent has converged, far below any decision.
        pub min_chi2_decrease: f64 = 0.05,
        /// The same in a comparison of candidates, fraction of the excess χ². The best are refitted.
        pub min_excess_decrease: f64 = 1e-3,
        /// Predicted decrease, fraction of the distance to the best rival, below which a candidate cannot reach it.
        pub min_rival_approach: f64 = 0.02,
        /// Steps over which the rate of convergence is measured.
        pub trend_steps: usize = 4,
        /// Decrease of χ² in these steps below which a descent has converged. Sticking makes steps in the cost that the linear
        /// model does not predict.
        pub min_trend_decrease: f64 = 0.5,
        /// Steps of a descent on the whole log at most.
        pub max_steps: usize = 20,
        /// Steps of a descent on an excerpt at most.
        pub max_excerpt_steps: usize = 30,
        /// Excess χ² relative to the best within which a candidate is fitted to the end.
        pub near_best_fraction: f64 = 0.1,
        /// Length of an excerpt, s.
        pub excerpt_s: f64 = 3.0,
        /// Rows of an excerpt at least.
        pub min_excerpt_rows: usize = 500,
        /// Rows of short windows, in excerpts, up to which they are an excerpt themselves.
        pub max_excerpts_of_windows: usize = 4,
        /// Lengths of the windows between the shortest ones and the whole log, s.
        pub window_lengths_s: Vec<f64> = vec![1.0, 4.0],
    }
}

thresholds! {
    /// When the search ends, and what is eliminated.
    pub struct SearchCriteria {
        /// Effects that are added at most.
        pub max_added: usize = 10,
        /// Insignificant effects in a row that end the search.
        pub max_insignificant_in_a_row: usize = 2,
        /// Fraction of the excess χ²/n that an insignificant effect removes at most.
        pub max_insignificant_fraction: f64 = 0.03,
        /// (effects, fraction of the excess χ²/n): with so many effects that leave so much, far above the noise, the search ends.
        pub max_remainders: Vec<(usize, f64)> = remainders_of_many(),
        /// Standard errors below which an added amplitude may be zero.
        pub zero_amplitude_sigmas: f64 = 5.0,
        /// Times that such an effect may lead to a better fit of the model without it.
        pub max_restarts: usize = 3,
        /// Effort after which the search ends with its best answer so far: simulated rows × lanes (the value and its derivatives) over the
        /// rows of the logs; `None`: none.
        pub max_passes: Option<u64> = Some(400_000),
    }
}

/// What the verdict would not call the cause.
fn remainders_of_many() -> Vec<(usize, f64)> {
    let verdict = VerdictCriteria::default();
    vec![(4, verdict.max_remainder), (6, verdict.max_remainder_far_from_noise)]
}

thresholds! {
    /// The verdict.
    pub struct VerdictCriteria {
        /// Fraction of the given model's excess χ²/n that the cause of the error may leave.
        pub max_remainder: f64 = 0.5,
        /// The same while the misfit is dominant. An effect that leaves more may stand in for another.
        pub max_remainder_far_from_noise: f64 = 0.1,
        /// Effects from which on a single unknown structure is a rival of all of them together.
        pub suspicious_effects: usize = 3,
        /// Misfit that so many effects may leave and still be named, rms 1.4 × the noise. Several periodic effects together
        /// imitate much that none of them is.
        pub max_misfit_of_many: MisfitClass = MisfitClass::Small,
        /// Smallest excess χ²/n by which is divided.
        pub min_excess: f64 = 1e-3,
        /// Part of the measured motion below which an effect is called small. Errors of readings, times and models that no
        /// catalogue has are seldom smaller on a bench, and one of them may look like the effect.
        pub small_part: f64 = 1e-3,
    }
}

thresholds! {
    /// Whether a residual above the white noise is coloured noise.
    pub struct AdequacyCriteria {
        /// Probability of calling noise dependent on the input, over all channels, as for a misfit.
        pub max_familywise_p: f64 = 1e-3,
        /// Fraction of the innovations' variance that the input must explain to matter, as in [`NoiseCriteria::noise`]: a smaller
        /// part of the white noise is within the accuracy of the simulation, however many rows show it.
        pub min_input_fraction: f64 = 0.03,
        /// Fraction of a residual's variance that may depend on rate, angle or temperature where it is otherwise put down to an input that
        /// is not known between its samples, because the part that the input may have left is itself an estimate.
        pub max_state_fraction: f64 = 0.1,
        /// Rows of the past input that are tested, at 1 kHz a usual mechanical time constant.
        pub lags: usize = 30,
        /// The same in increments of the angle, 20 ms each.
        pub lags_of_increments: usize = 10,
        /// Harmonics of the turn that the residual of a rate sensor against a known motion is tested for.
        pub harmonics: usize = 4,
        /// Turns of that motion from which they are tested, as for the effects with a harmonic order.
        pub min_turns: f64 = 1.5,
        /// Correlation times of coloured noise that the log must contain at least, as for `min_coherence_blocks`.
        pub min_correlation_times: f64 = 30.0,
        /// Correlation of two channels' residuals from which a torque may move both.
        pub min_coherence: f64 = 0.1,
        /// Its standard errors, once in 16 000 independent pairs of series. Some ten are compared in a log.
        pub min_coherence_sigmas: f64 = 4.0,
        /// Blocks of the log from which the correlation is computed: longer blocks, of which there are fewer, tell slower motion.
        pub min_coherence_blocks: usize = 30,
    }
}

thresholds! {
    /// Detection limits.
    pub struct DetectionCriteria {
        /// Standard deviations between the expected root of the gain at the limit and the gain that the search asks for. The gain
        /// falls short of it in 2.5 %, and about as often the held-out rows do not confirm it: together 95 %.
        pub power_sigmas: f64 = 1.96,
        /// Highest order at which a limit is computed. Slots and poles of small motors are below it.
        pub max_order: u32 = 40,
        /// Ratio of two neighbouring orders.
        pub order_ratio: f64 = 1.6,
        /// Ratio of two neighbouring frequencies.
        pub frequency_ratio: f64 = 4.0,
        /// Times of a jump of the angle, fractions of the log.
        pub jump_fractions: Vec<f64> = vec![0.25, 0.5, 0.75],
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

thresholds! {
    /// Structures that no effect of the catalogue has.
    pub struct UnknownCriteria {
        /// Knots of a piecewise linear function over angle or time at most.
        pub max_knots: usize = 22,
        /// Knots over rate or current at most.
        pub max_knots_rate: usize = 14,
        /// Knots over temperature at most.
        pub max_knots_temperature: usize = 8,
        /// Knots below which no function is tried.
        pub min_knots: usize = 6,
        /// Functions that are fitted in full.
        pub max_fitted: usize = 2,
        /// Expressions with the shape of a function that are fitted in full.
        pub max_expressions: usize = 3,
        /// Functions and frequencies among which chance may choose.
        pub tests: f64 = 4000.0,
        /// Confidence interval of a knot, multiple of the median one, from which on the knot is not drawn.
        pub max_confidence_ratio: f64 = 8.0,
        /// Steepness of the edges of a sector, per unit of cos θ.
        pub sector_steepness: f64 = 80.0,
        /// Turns from which on a function of the angle is tried.
        pub min_turns: f64 = 1.0,
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

//! Likelihood of the increments of block means under noise of unknown strength, with and without a column of known shape.
//!
//! Input: increments between the means of adjacent blocks and the places of the blocks, in block lengths. Output: for each candidate, of one
//! or two columns, its coefficients and the probability of such an improvement by noise, from the ratio of the likelihoods.
//!
//! The increments are second differences of the angle: their covariances are those of white noise, flicker noise and random walk (as in
//! [`super::confidence`]). The strengths of flicker noise and random walk relative to white noise are fitted by maximum likelihood, once
//! without and once with the candidate. So a step is judged against the random walk that explains the rest of the record.

use nalgebra::{DMatrix, DVector};

use identification::statistics::CovarianceRoot;
use identification::statistics::covariance_root::remove_fitted;
use identification::statistics::distributions::student_tail;

/// Ratios of flicker noise and random walk to white noise in a block, where the search begins.
const RATIOS: [f64; 8] = [0.0, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4];
/// Factors by which the search is refined.
const REFINEMENTS: [f64; 3] = [3.2, 1.8, 1.3];
/// Most moves of a refinement.
const MAX_MOVES: usize = 20;
/// Strengths that are fitted: of white noise, flicker noise and random walk.
const STRENGTHS: usize = 3;
/// Remaining part of a column, squared, below which the others determine it.
const MIN_FREE_PART: f64 = 1e-9;

/// Increments of block means.
pub struct Increments {
    values: DVector<f64>,
    /// Covariances for strengths of 1: white noise, flicker noise, random walk.
    parts: [DMatrix<f64>; STRENGTHS],
}

/// A tested candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tested {
    /// Index of the candidate.
    pub candidate: usize,
    /// Coefficients of its columns; the second is 0 where there is one.
    pub coefficients: [f64; 2],
    /// Decrease of −2 ln L, not negative, less 2 for each column.
    pub evidence: f64,
    /// Probability of such a decrease by noise, of this candidate alone.
    pub probability: f64,
    /// Decrease of −2 ln L, not negative.
    pub decrease: f64,
    /// Degrees of freedom of the remaining increments, relative to their number.
    pub relative_dof: f64,
}

/// Probability that two columns without meaning decrease −2 ln L by so much: the F law with 2 and dof degrees of freedom.
pub fn probability_of_two(decrease: f64, relative_dof: f64) -> f64 {
    (-0.5 * relative_dof * decrease).exp()
}

/// A candidate: one column or two.
pub type Candidate = Vec<DVector<f64>>;

/// −2 ln L for fixed ratios: without a candidate and with each, and the coefficients.
struct Node {
    ratios: [f64; 2],
    without: f64,
    with: Vec<f64>,
    coefficients: Vec<[f64; 2]>,
}

impl Increments {
    /// Increments between the blocks that begin at `places` (in block lengths) and the next ones.
    pub fn new(places: &[f64], values: &[f64]) -> Self {
        let covariance = |generalised: fn(f64) -> f64| {
            DMatrix::from_fn(places.len(), places.len(), |i, j| {
                let lag = (places[j] - places[i]).abs();
                // Fourth difference of the generalised covariance of the angle.
                let [zero, one, two] = [0.0, 1.0, 2.0].map(|step: f64| generalised(lag + step) + generalised((lag - step).abs()));
                3.0 * zero - 4.0 * one + two
            })
        };
        let flicker = |t: f64| if t > 0.0 { t * t * t.ln() / std::f64::consts::TAU } else { 0.0 };
        let parts = [covariance(|t| -0.5 * t), covariance(flicker), covariance(|t| t * t * t / 12.0)];
        Self { values: DVector::from_column_slice(values), parts }
    }

    /// Tests candidates beside columns that are always fitted. `None` if the increments do not suffice.
    pub fn strongest(&self, fitted: &[DVector<f64>], candidates: &[Candidate]) -> Option<Tested> {
        let dof = self.values.len() as f64 - (fitted.len() + 1 + STRENGTHS - 1) as f64;
        if dof < 1.0 || candidates.is_empty() {
            return None;
        }
        let coarse: Vec<Node> = RATIOS
            .iter()
            .flat_map(|flicker| RATIOS.iter().map(|walk| [*flicker, *walk]))
            .filter_map(|ratios| self.node(ratios, fitted, candidates))
            .collect();
        let least = |of: &dyn Fn(&Node) -> f64| coarse.iter().min_by(|a, b| of(a).total_cmp(&of(b)));
        let without = self.refined(least(&|node| node.without)?.ratios, fitted, &[], &|node| node.without)?.without;
        let best = |k: usize| least(&|node: &Node| node.with[k]);
        let (candidate, start) = (0..candidates.len())
            .filter_map(|k| Some((k, best(k)?)))
            .min_by(|a, b| a.1.with[a.0].total_cmp(&b.1.with[b.0]))
            .map(|(k, node)| (k, node.ratios))?;
        let found = self.refined(start, fitted, &candidates[candidate..=candidate], &|node| node.with[0])?;
        let decrease = (without - found.with[0]).max(0.0);
        let columns = candidates[candidate].len();
        // For known ratios these are the exact laws of the regression: F with 1 or 2, and dof degrees of freedom.
        let relative = decrease / self.values.len() as f64;
        let dof = dof - (columns - 1) as f64;
        let probability = match columns {
            1 => 2.0 * student_tail((dof * relative.exp_m1()).sqrt(), dof),
            _ => probability_of_two(decrease, dof / self.values.len() as f64),
        };
        let relative_dof = dof / self.values.len() as f64;
        let evidence = decrease - 2.0 * columns as f64;
        Some(Tested { candidate, coefficients: found.coefficients[0], evidence, probability, decrease, relative_dof })
    }

    /// The ratios of the greatest likelihood near a start.
    fn refined(&self, start: [f64; 2], fitted: &[DVector<f64>], candidates: &[Candidate], of: &dyn Fn(&Node) -> f64) -> Option<Node> {
        let mut best = self.node(start, fitted, candidates)?;
        for factor in REFINEMENTS {
            for _ in 0..MAX_MOVES {
                let moves = [[factor, 1.0], [1.0 / factor, 1.0], [1.0, factor], [1.0, 1.0 / factor]];
                let tried = moves
                    .iter()
                    .filter_map(|[f, k]| self.node([best.ratios[0] * f, best.ratios[1] * k], fitted, candidates))
                    .min_by(|a, b| of(a).total_cmp(&of(b)));
                match tried {
                    Some(better) if of(&better) < of(&best) => best = better,
                    _ => break,
                }
            }
        }
        Some(best)
    }

    fn node(&self, ratios: [f64; 2], fitted: &[DVector<f64>], candidates: &[Candidate]) -> Option<Node> {
        let [white, flicker, walk] = &self.parts;
        let root = CovarianceRoot::of_sum(&[(white, 1.0), (flicker, ratios[0]), (walk, ratios[1])])?;
        let ln_determinant = root.ln_determinant();
        let columns = std::iter::once(&self.values).chain(fitted).chain(candidates.iter().flatten());
        let mut whitened = root.whiten(&DMatrix::from_columns(&columns.cloned().collect::<Vec<_>>()))?;
        let sizes: Vec<f64> = whitened.column_iter().map(|column| column.norm_squared()).collect();
        remove_fitted(&mut whitened, 1..1 + fitted.len());
        let count = self.values.len() as f64;
        let rest = whitened.column(0).into_owned();
        let squares = rest.norm_squared();
        if !(squares.is_finite() && squares > 0.0) {
            return None;
        }
        let (mut with, mut coefficients) = (Vec::with_capacity(candidates.len()), Vec::with_capacity(candidates.len()));
        let mut first = 1 + fitted.len();
        for candidate in candidates {
            let columns = first..first + candidate.len();
            first = columns.end;
            let own = whitened.columns(columns.start, columns.len());
            let free = |k: usize| own.column(k).norm_squared() > MIN_FREE_PART * sizes[columns.start + k];
            let normal = own.transpose() * own;
            let right = own.transpose() * &rest;
            let solution = (0..columns.len()).all(free).then(|| normal.cholesky()).flatten().map(|factor| factor.solve(&right));
            let solution = solution.unwrap_or_else(|| DVector::zeros(columns.len()));
            let remaining = (squares - solution.dot(&right)).max(f64::MIN_POSITIVE);
            with.push(ln_determinant + count * remaining.ln());
            coefficients.push([solution[0], solution.get(1).copied().unwrap_or(0.0)]);
        }
        Some(Node { ratios, without: ln_determinant + count * squares.ln(), with, coefficients })
    }
}

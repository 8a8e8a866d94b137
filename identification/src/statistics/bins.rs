//! Means of a series within bins of a coordinate, with confidence intervals.

use super::distributions::student_quantile;

/// Sums over one bin. Successive rows within a bin form a cluster: neighbours are correlated, clusters are taken as independent.
#[derive(Clone, Copy, Default)]
struct Cell {
    sum: f64,
    squares: f64,
    n: f64,
    /// Over the clusters, with sum S and n rows each: Σ S², Σ S n, Σ n², number of clusters.
    clusters: (f64, f64, f64, f64),
}

/// Mean of a quantity within one bin of a coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Middle of the bin, in the unit of the coordinate.
    pub at: f64,
    /// Mean within the bin.
    pub mean: f64,
    /// Half-width of its 95 % confidence interval.
    pub confidence: f64,
}

/// Longest cluster, rows.
const MAX_CLUSTER_ROWS: usize = 200;
/// Bins with fewer rows or clusters are left out.
const MIN_ROWS: f64 = 10.0;
const MIN_CLUSTERS: f64 = 4.0;

/// Means of `values` in `bins` equal bins of a coordinate over `range`; bins with too few rows are left out.
///
/// The 95 % interval rests on a cluster-robust standard error, with the successive rows within a bin as one cluster, so that an
/// autocorrelated residual does not get too narrow an interval.
pub fn binned(coordinate: impl Iterator<Item = f64>, values: impl Iterator<Item = f64>, range: (f64, f64), bins: usize) -> Vec<Bin> {
    let (low, high) = range;
    let width = (high - low) / bins.max(1) as f64;
    if width.is_nan() || width <= 0.0 {
        return Vec::new();
    }
    let mut cells = vec![Cell::default(); bins];
    let mut cluster = (usize::MAX, 0.0, 0usize);
    let close = |cells: &mut Vec<Cell>, (bin, sum, n): (usize, f64, usize)| {
        if let (Some(cell), true) = (cells.get_mut(bin), n > 0) {
            let n = n as f64;
            let (ss, sn, nn, k) = cell.clusters;
            cell.clusters = (ss + sum * sum, sn + sum * n, nn + n * n, k + 1.0);
        }
    };
    for (x, v) in coordinate.zip(values) {
        if !(x.is_finite() && v.is_finite() && x >= low && x <= high) {
            continue;
        }
        let bin = (((x - low) / width) as usize).min(bins - 1);
        if bin != cluster.0 || cluster.2 >= MAX_CLUSTER_ROWS {
            close(&mut cells, cluster);
            cluster = (bin, 0.0, 0);
        }
        cluster = (bin, cluster.1 + v, cluster.2 + 1);
        if let Some(cell) = cells.get_mut(bin) {
            cell.sum += v;
            cell.squares += v * v;
            cell.n += 1.0;
        }
    }
    close(&mut cells, cluster);
    let filled = cells.iter().enumerate().filter(|(_, c)| c.n >= MIN_ROWS && c.clusters.3 >= MIN_CLUSTERS);
    filled
        .map(|(k, c)| {
            let mean = c.sum / c.n;
            let (ss, sn, nn, clusters) = c.clusters;
            let between = ((ss - 2.0 * mean * sn + mean * mean * nn).max(0.0) * clusters / (clusters - 1.0)).sqrt() / c.n;
            let within = ((c.squares / c.n - mean * mean).max(0.0) / c.n).sqrt();
            Bin { at: low + (k as f64 + 0.5) * width, mean, confidence: student(clusters) * between.max(within) }
        })
        .collect()
}

/// 97.5 % point of Student's distribution with one degree of freedom less than the number of clusters.
fn student(clusters: f64) -> f64 {
    if clusters > 200.0 {
        return 1.96;
    }
    student_quantile(0.975, (clusters - 1.0).max(1.0))
}

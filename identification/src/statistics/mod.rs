//! Statistical methods shared by all analyses.
//!
//! [`distributions`] (normal, Student, χ², F), [`student_mixture`], [`uncertainty`] (budgets according to the GUM), [`least_squares`] with
//! covariance, [`covariance_root`] (values made independent), [`robust`] location and scale, [`extremes`] (smallest and largest values), [`fourier`] transforms, [`series`] (histogram,
//! autocorrelation) and [`bins`] (means along a coordinate).

pub mod bins;
pub mod covariance_root;
pub mod distributions;
pub mod extremes;
pub mod fourier;
pub mod least_squares;
pub mod robust;
pub mod series;
pub mod student_mixture;
pub mod uncertainty;

pub use covariance_root::CovarianceRoot;
pub use extremes::Extremes;
pub use least_squares::{LeastSquares, clustered_least_squares, least_squares};

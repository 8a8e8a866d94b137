//! Statistics shared by all analyses.

pub mod bins;
pub mod distribution;
pub mod uncertainty;

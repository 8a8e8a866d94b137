//! Statistics shared by all analyses.

pub mod uncertainty;

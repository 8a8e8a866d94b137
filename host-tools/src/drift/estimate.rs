//! A value with its standard uncertainty.

/// A value with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Standard uncertainty; `None` where the data do not determine it.
    pub sigma: Option<f64>,
}

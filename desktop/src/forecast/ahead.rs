//! A forecast: mean and standard deviation of each day to come.

/// Expected values and standard deviations of the days to come.
#[derive(Debug, Clone, PartialEq)]
pub struct ForecastPath {
    pub mean: Vec<f64>,
    /// Their standard deviations.
    pub sd: Vec<f64>,
}

//! A forecast: mean and standard deviation of each day to come.

/// Half of a 95 % interval, in standard deviations.
const HALF: f64 = 1.96;

/// Expected values and standard deviations of the days to come.
#[derive(Debug, Clone, PartialEq)]
pub struct ForecastPath {
    pub mean: Vec<f64>,
    /// Their standard deviations.
    pub sd: Vec<f64>,
}

/// Ends of the 95 % interval.
pub fn interval(mean: f64, sd: f64) -> [f64; 2] {
    [mean - HALF * sd, mean + HALF * sd]
}

//! 95 % intervals of normal estimates: the one meaning of `±` in every output.

/// Half-width of a 95 % interval, in standard deviations of a normal distribution.
pub const HALF_95: f64 = 1.96;

/// Ends of the 95 % interval.
pub fn interval_95(mean: f64, sd: f64) -> [f64; 2] {
    [mean - HALF_95 * sd, mean + HALF_95 * sd]
}

/// Interval of a vector's size, from zero on, and the half-width of its angle in degrees, 180 where any angle is possible, from
/// the half-width of the interval of each component.
pub fn size_and_angle_95(size: f64, half: f64) -> ([f64; 2], f64) {
    let half_deg = if half < size { (half / size).asin().to_degrees() } else { 180.0 };
    ([(size - half).max(0.0), size + half], half_deg)
}

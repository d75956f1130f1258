//! A cone as cylinders, which is what a shaft is made of everywhere else.

/// Largest change of a diameter from one cylinder to the next, relative: the frequencies of a cone are then within
/// 0.05 % of those of ever finer steps.
const STEP: f64 = 0.025;
const FEWEST: f64 = 4.0;
const MOST: f64 = 40.0;

/// Number of cylinders that stand for a piece whose diameters go from the first to the second, m; one where none
/// changes.
pub(crate) fn steps(diameters_m: &[[f64; 2]]) -> usize {
    let change = |[a, b]: &[f64; 2]| if a == b { 0.0 } else { (a - b).abs() / (0.5 * (a + b)) };
    let most = diameters_m.iter().map(change).fold(0.0, f64::max);
    if most == 0.0 { 1 } else { (most / STEP).ceil().clamp(FEWEST, MOST) as usize }
}

/// Diameter in the middle of cylinder `i` of `count`.
pub(crate) fn middle([left, right]: [f64; 2], i: usize, count: usize) -> f64 {
    left + (right - left) * (i as f64 + 0.5) / count as f64
}

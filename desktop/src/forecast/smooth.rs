//! Robust local regression (Cleveland 1979), as MATLAB's `rlowess` and statsmodels' `lowess` define it.

use lowess::prelude::*;

use crate::error::Error;

/// Values smoothed along their index: each by a straight line through its neighbours, the share `fraction`
/// of all values, with `iterations` rounds of weights against outliers.
///
/// # Errors
/// If there are too few values for the share.
pub fn rlowess(values: &[f64], fraction: f64, iterations: usize) -> Result<Vec<f64>, Error> {
    let x: Vec<f64> = (0..values.len()).map(|i| i as f64).collect();
    // the crate's defaults differ from the definition
    let smooth = |iterations: usize| {
        Lowess::new()
            .fraction(fraction)
            .iterations(iterations)
            .delta(0.0)
            .boundary_policy("noboundary")
            .scaling_method("mar")
            .build()?
            .fit(&x, values)
    };
    let failed = |e: LowessError| Error::Unsuitable(format!("smoothing: {e}"));
    let plain = smooth(0).map_err(failed)?.y;
    // where nothing is left but rounding, weights against outliers would be made of it
    let largest = |all: &mut dyn Iterator<Item = f64>| all.fold(0.0, |most: f64, v| most.max(v.abs()));
    let left = largest(&mut values.iter().zip(&plain).map(|(v, s)| v - s));
    if left <= 1e-10 * largest(&mut values.iter().copied()) {
        return Ok(plain);
    }
    Ok(smooth(iterations).map_err(failed)?.y)
}

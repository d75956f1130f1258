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
    let model = Lowess::new()
        .fraction(fraction)
        .iterations(iterations)
        .delta(0.0)
        .boundary_policy("noboundary")
        .scaling_method("mar")
        .build();
    let failed = |e: LowessError| Error::Unsuitable(format!("smoothing: {e}"));
    Ok(model.map_err(failed)?.fit(&x, values).map_err(failed)?.y)
}

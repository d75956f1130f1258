//! The drawing as fitted.

use rotor_edge_desktop::diagnose::FittedDimension;
use serde::Serialize;

/// How far a dimension is from the drawing: in m where ``unit`` says so, else as a share of the drawn value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DimensionAnswer {
    /// As ``[tolerance.found]`` of a rotor file calls it.
    pub name: String,
    pub unit: &'static str,
    /// Fitted minus drawn.
    pub difference: f64,
    /// Least and most; it holds where the model describes the data.
    pub interval_95: [f64; 2],
    /// Half-width of the range that the tolerance allows with 95 %.
    pub tolerance_95: f64,
    /// Whether the data know it at least twice as well as the tolerance does.
    pub identified: bool,
}

impl From<&FittedDimension> for DimensionAnswer {
    fn from(d: &FittedDimension) -> Self {
        Self {
            name: d.name.clone(),
            unit: d.unit,
            difference: d.difference,
            interval_95: d.interval_95,
            tolerance_95: d.tolerance_95,
            identified: d.from_data,
        }
    }
}

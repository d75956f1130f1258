//! Search coordinates of a real parameter.

/// How a parameter is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// In units of this size; may change sign.
    Linear(f64),
    /// By its logarithm; stays positive.
    Logarithmic,
}

impl Scale {
    /// The parameter in SI units at a search coordinate.
    pub fn to_si(self, x: f64) -> f64 {
        match self {
            Self::Linear(unit) => unit * x,
            Self::Logarithmic => x.exp(),
        }
    }

    /// The search coordinate of a parameter in SI units.
    pub fn from_si(self, value: f64) -> f64 {
        match self {
            Self::Linear(unit) => value / unit,
            Self::Logarithmic => value.ln(),
        }
    }

    /// Change of the parameter per unit of its search coordinate, at this value.
    pub fn slope(self, value: f64) -> f64 {
        match self {
            Self::Linear(unit) => unit.abs(),
            Self::Logarithmic => value,
        }
    }
}

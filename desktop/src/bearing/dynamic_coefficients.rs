//! Stiffness and damping together.

use nalgebra::Matrix2;

/// Stiffness and damping, 2×2 each, rows (force) and columns (motion) x, y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DynamicCoefficients {
    /// Stiffness, N/m.
    pub stiffness: Matrix2<f64>,
    /// Damping, N·s/m.
    pub damping: Matrix2<f64>,
}

impl DynamicCoefficients {
    pub fn zeros() -> Self {
        Self { stiffness: Matrix2::zeros(), damping: Matrix2::zeros() }
    }

    pub fn ones() -> Self {
        Self { stiffness: Matrix2::repeat(1.0), damping: Matrix2::repeat(1.0) }
    }

    /// Value by value with another.
    pub fn map(&self, other: &Self, f: impl Fn(f64, f64) -> f64 + Copy) -> Self {
        Self {
            stiffness: self.stiffness.zip_map(&other.stiffness, f),
            damping: self.damping.zip_map(&other.damping, f),
        }
    }

    /// Column `i` of a table of eight: k_xx k_xy k_yx k_yy, then damping.
    pub fn column(&self, i: usize) -> f64 {
        let matrix = if i < 4 { &self.stiffness } else { &self.damping };
        matrix[(i % 4 / 2, i % 2)]
    }

    pub fn set_column(&mut self, i: usize, value: f64) {
        let matrix = if i < 4 { &mut self.stiffness } else { &mut self.damping };
        matrix[(i % 4 / 2, i % 2)] = value;
    }

    /// Of eight columns, k_xx k_xy k_yx k_yy, then damping.
    pub fn from_columns(value: impl Fn(usize) -> f64) -> Self {
        Self {
            stiffness: Matrix2::from_fn(|r, c| value(2 * r + c)),
            damping: Matrix2::from_fn(|r, c| value(4 + 2 * r + c)),
        }
    }
}

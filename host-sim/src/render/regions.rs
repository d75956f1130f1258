//! Unbalances of one plane with their regions, beside what was stated of them.

use nalgebra::Complex;

use super::chart::{Chart, Look};
use super::ground::{Turn, polar_paper};
use super::weights::{unbalance_columns, unbalance_row};

/// Points of an ellipse.
const POINTS: usize = 60;

/// An estimate, and the ellipse that holds it with 95 %.
pub struct Region {
    /// Estimated, g·mm.
    pub found: Complex<f64>,
    /// Stated, g·mm.
    pub stated: Option<Complex<f64>>,
    /// Major and minor semi-axis, g·mm.
    pub semi_axes: [f64; 2],
    /// Direction of the major axis, degrees.
    pub major_deg: f64,
}

impl Region {
    fn edge(&self) -> Vec<Complex<f64>> {
        let turn = Complex::from_polar(1.0, self.major_deg.to_radians());
        let at = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / POINTS as f64).sin_cos();
            self.found + turn * Complex::new(self.semi_axes[0] * cos, self.semi_axes[1] * sin)
        };
        (0..=POINTS).map(at).collect()
    }
}

/// All estimates of a plane; angles count with the rotation from the keyphasor mark, which is to the right.
pub fn regions(all: &[Region]) -> Chart {
    let stated = || all.iter().filter_map(|r| r.stated);
    let sizes = all.iter().flat_map(Region::edge).chain(stated()).map(|u| u.norm());
    let (mut chart, _) = polar_paper(sizes, "g·mm", Turn::WithRotation);
    let columns = unbalance_columns();
    for region in all {
        chart.draw(0, "95 %", Look::Model(0), &columns, region.edge().into_iter().map(unbalance_row));
        let off = region.stated.map(|u| [region.found, u].map(|u| [u.re, u.im]));
        chart.ground(0, Look::Faint, off.into_iter().flatten());
    }
    chart.draw(0, "estimated", Look::Dots(0), &columns, all.iter().map(|r| unbalance_row(r.found)));
    chart.draw(0, "stated", Look::Measured, &columns, stated().map(unbalance_row));
    chart
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_edge_has_its_axes_in_their_direction_around_the_estimate() {
        let region =
            Region { found: Complex::new(3.0, 4.0), stated: None, semi_axes: [2.0, 1.0], major_deg: 90.0 };
        let edge = region.edge();
        assert!((edge[0].re - 3.0).abs() < 1e-12 && (edge[0].im - 6.0).abs() < 1e-12);
        assert!((edge[POINTS / 4].re - 2.0).abs() < 1e-12 && (edge[POINTS / 4].im - 4.0).abs() < 1e-12);
    }
}

//! Unbalances of one plane with their regions, beside what was stated of them.

use nalgebra::Complex;
use plotters::prelude::{Circle, PathElement};
use plotters::style::Color;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{
    Entry, FAINT, Legend, TEXT_PX, WIDTH_PX, anchored, line, measured as circles, model_colour, plain, px,
    svg, write,
};
use super::polar::{DISK_PX, ROOM, Turn, grid};
use super::scale::Scale;

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
    fn edge(&self) -> Vec<(f64, f64)> {
        let turn = Complex::from_polar(1.0, self.major_deg.to_radians());
        let at = |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / POINTS as f64).sin_cos();
            let point = self.found + turn * Complex::new(self.semi_axes[0] * cos, self.semi_axes[1] * sin);
            (point.re, point.im)
        };
        (0..=POINTS).map(at).collect()
    }
}

/// All estimates of a plane; angles count with the rotation from the keyphasor mark, which is to the right.
pub fn regions(title: &str, all: &[Region]) -> String {
    let legend = Legend::new([Entry::Measured("stated"), Entry::Model(0, "estimated, with 95 %")]);
    let sizes = |r: &Region| r.edge().into_iter().map(|(x, y)| x.hypot(y)).collect::<Vec<_>>();
    let stated = all.iter().filter_map(|r| r.stated);
    let radius = Scale::from_zero(all.iter().flat_map(sizes).chain(stated.clone().map(|u| u.norm())), 4);
    let reach = ROOM * radius.to;
    let across = Scale { from: -reach * WIDTH_PX / DISK_PX, to: reach * WIDTH_PX / DISK_PX, ticks: vec![] };
    let up = Scale { from: -reach, to: reach, ticks: vec![] };
    svg(title, legend.height_px + DISK_PX + TEXT_PX, |sheet| {
        legend.draw(sheet)?;
        let (_, below) = sheet.split_vertically(px(legend.height_px));
        let (disk, foot) = below.split_vertically(px(DISK_PX));
        let mut chart = plain(&disk, &across, &up)?;
        grid(&mut chart, &radius, 2.0 * reach / DISK_PX, Turn::WithRotation)?;
        let colour = model_colour(0);
        for region in all {
            chart.draw_series([PathElement::new(region.edge(), line(colour, 1.2))])?;
            let found = (region.found.re, region.found.im);
            chart.draw_series([Circle::new(found, px(1.8), colour.filled())])?;
            let off = region.stated.map(|u| PathElement::new(vec![found, (u.re, u.im)], line(FAINT, 0.8)));
            chart.draw_series(off)?;
        }
        circles(&mut chart, stated.map(|u| (u.re, u.im)))?;
        write(&foot, "g·mm", [8.0, TEXT_PX - 4.0], anchored(FAINT, HPos::Left, VPos::Bottom))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_edge_has_its_axes_in_their_direction_around_the_estimate() {
        let region =
            Region { found: Complex::new(3.0, 4.0), stated: None, semi_axes: [2.0, 1.0], major_deg: 90.0 };
        let edge = region.edge();
        assert!((edge[0].0 - 3.0).abs() < 1e-12 && (edge[0].1 - 6.0).abs() < 1e-12);
        assert!((edge[POINTS / 4].0 - 2.0).abs() < 1e-12 && (edge[POINTS / 4].1 - 4.0).abs() < 1e-12);
    }
}

//! Correction weights of every plane on one polar plot.

use nalgebra::Complex;
use plotters::prelude::{Circle, PathElement};
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{
    Entry, FAINT, Legend, TEXT_PX, WIDTH_PX, anchored, line, model_colour, plain, px, svg, write,
};
use super::polar::{DISK_PX, ROOM, Turn, grid};
use super::scale::Scale;

/// The weight of one plane, g·mm.
pub struct Weight {
    /// Name of the plane.
    pub plane: String,
    /// What is best.
    pub wanted: Complex<f64>,
    /// What is put in, piece by piece.
    pub placed: Vec<Complex<f64>>,
}

/// All weights; the keyphasor mark is to the right, the shaft turns counter-clockwise.
pub fn weights(title: &str, all: &[Weight], against_rotation: bool) -> String {
    let legend = Legend::new(all.iter().enumerate().map(|(i, w)| Entry::Model(i, &w.plane)));
    let sizes = all.iter().flat_map(|w| w.placed.iter().chain([&w.wanted])).map(|u| u.norm());
    let radius = Scale::from_zero(sizes, 4);
    let reach = ROOM * radius.to;
    let across = Scale { from: -reach * WIDTH_PX / DISK_PX, to: reach * WIDTH_PX / DISK_PX, ticks: vec![] };
    let up = Scale { from: -reach, to: reach, ticks: vec![] };
    let turn = if against_rotation { Turn::Lag } else { Turn::WithRotation };
    svg(title, legend.height_px + DISK_PX + TEXT_PX, |sheet| {
        legend.draw(sheet)?;
        let (_, below) = sheet.split_vertically(px(legend.height_px));
        let (disk, foot) = below.split_vertically(px(DISK_PX));
        let mut chart = plain(&disk, &across, &up)?;
        grid(&mut chart, &radius, 2.0 * reach / DISK_PX, turn)?;
        for (i, weight) in all.iter().enumerate() {
            let colour = model_colour(i);
            let vector = vec![(0.0, 0.0), (weight.wanted.re, weight.wanted.im)];
            chart.draw_series([PathElement::new(vector, line(colour, 2.0))])?;
            let circle = |u: &Complex<f64>| Circle::new((u.re, u.im), px(4.0), line(colour, 1.6));
            chart.draw_series(weight.placed.iter().map(circle))?;
        }
        write(&foot, "g·mm", [8.0, TEXT_PX - 4.0], anchored(FAINT, HPos::Left, VPos::Bottom))
    })
}

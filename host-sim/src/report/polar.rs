//! Polar plot: the path of one probe's phasor over speed.

use nalgebra::Complex;
use plotters::prelude::{Circle, PathElement, Polygon, Text};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};

use super::bode::peak_to_peak_um;
use super::canvas::{
    Chart, Drawn, Entry, FAINT, GRID, INK, Legend, TEXT_PX, WIDTH_PX, anchored, curve, line,
    measured as circles, plain, px, svg, text_width_px, write,
};
use super::curve::Curve;
use super::scale::{Scale, number};

pub(super) const DISK_PX: f64 = 360.0;
/// Room for the angles around the outer circle, relative to its radius.
pub(super) const ROOM: f64 = 1.17;
/// Speeds that are written beside the path.
const SPEEDS: usize = 4;

/// The phasors in µm peak-to-peak; the keyphasor mark is at 0°, to the right, the shaft turns
/// counter-clockwise and the lag grows clockwise.
pub fn polar(title: &str, measured: &[(f64, Complex<f64>)], models: &[Curve]) -> String {
    let model_entries = models.iter().enumerate().map(|(i, m)| Entry::Model(i, &m.label));
    let legend = Legend::new(std::iter::once(Entry::Measured("measured")).chain(model_entries));
    let everything = measured.iter().chain(models.iter().flat_map(|m| &m.points));
    let radius = Scale::from_zero(everything.map(|(_, y)| peak_to_peak_um(*y)), 4);
    let reach = ROOM * radius.to;
    let um_per_px = 2.0 * reach / DISK_PX;
    let across = Scale { from: -reach * WIDTH_PX / DISK_PX, to: reach * WIDTH_PX / DISK_PX, ticks: vec![] };
    let up = Scale { from: -reach, to: reach, ticks: vec![] };
    let place = |(_, y): &(f64, Complex<f64>)| (2e6 * y.re, 2e6 * y.im);
    svg(title, legend.height_px + DISK_PX + TEXT_PX, |sheet| {
        legend.draw(sheet)?;
        let (_, below) = sheet.split_vertically(px(legend.height_px));
        let (disk, foot) = below.split_vertically(px(DISK_PX));
        let mut chart = plain(&disk, &across, &up)?;
        let mut written = grid(&mut chart, &radius, um_per_px, Turn::Lag)?;
        for (i, model) in models.iter().enumerate() {
            curve(&mut chart, i, &model.points.iter().map(place).collect::<Vec<_>>())?;
        }
        circles(&mut chart, measured.iter().map(place))?;
        for i in labelled(measured, reach) {
            let (x, up) = place(&measured[i]);
            let (aside_x, aside_up) = beside_path(measured, i, 0.07 * reach);
            let speed = number(measured[i].0, 0);
            let sides = [1.0, -1.0].map(|side| {
                let h = if side * aside_x < 0.0 { HPos::Right } else { HPos::Left };
                (h, (x + side * aside_x, up + side * aside_up))
            });
            let free = sides.into_iter().find_map(|(h, at)| {
                let extent = Extent::new(&speed, at, h, um_per_px);
                written.iter().all(|w| w.clears(&extent)).then_some((h, at, extent))
            });
            if let Some((h, at, extent)) = free {
                written.push(extent);
                chart.draw_series([Circle::new((x, up), px(2.6), INK.filled())])?;
                chart.draw_series([Text::new(speed, at, anchored(INK, h, VPos::Center))])?;
            }
        }
        let style = anchored(FAINT, HPos::Left, VPos::Bottom);
        write(&foot, "µm pk-pk; speeds in rpm at full circles", [8.0, TEXT_PX - 4.0], style)
    })
}

/// Which way the angles around the outer circle grow.
#[derive(Clone, Copy)]
pub(super) enum Turn {
    /// Against the rotation, clockwise: the lag of a motion.
    Lag,
    /// With the rotation: a place on the shaft.
    WithRotation,
}

impl Turn {
    fn sign(self) -> f64 {
        match self {
            Self::Lag => -1.0,
            Self::WithRotation => 1.0,
        }
    }
}

/// Where a text is written, in the units of the plot.
pub(super) struct Extent {
    across: [f64; 2],
    up: [f64; 2],
}

impl Extent {
    /// Of a text anchored at the middle of its height, for so many µm a pixel.
    fn new(text: &str, at: (f64, f64), h: HPos, um_per_px: f64) -> Self {
        let width = text_width_px(text) * um_per_px;
        let left = match h {
            HPos::Left => at.0,
            HPos::Center => at.0 - 0.5 * width,
            HPos::Right => at.0 - width,
        };
        let half = 0.6 * TEXT_PX * um_per_px;
        Self { across: [left, left + width], up: [at.1 - half, at.1 + half] }
    }

    fn clears(&self, other: &Self) -> bool {
        let apart = |a: [f64; 2], b: [f64; 2]| a[1] <= b[0] || b[1] <= a[0];
        apart(self.across, other.across) || apart(self.up, other.up)
    }
}

/// Circles with their radii, spokes with their angles, and which way the shaft turns; what it wrote where.
pub(super) fn grid(chart: &mut Chart, radius: &Scale, units_per_px: f64, angles: Turn) -> Drawn<Vec<Extent>> {
    let mut written = Vec::new();
    let mut write = |chart: &mut Chart, text: String, at: (f64, f64), colour: RGBColor, h: HPos| -> Drawn {
        written.push(Extent::new(&text, at, h, units_per_px));
        chart.draw_series([Text::new(text, at, anchored(colour, h, VPos::Center))])?;
        Ok(())
    };
    let arc = |r: f64, from_deg: i32, to_deg: i32| {
        let at = |deg: i32| {
            let (sin, cos) = f64::from(deg).to_radians().sin_cos();
            (r * cos, r * sin)
        };
        (from_deg..=to_deg).step_by(3).map(at).collect::<Vec<_>>()
    };
    for r in &radius.ticks[1..] {
        chart.draw_series([PathElement::new(arc(*r, 0, 360), line(GRID, 0.9))])?;
        let (sin, cos) = 67.5_f64.to_radians().sin_cos();
        write(chart, radius.label(*r), (r * cos, r * sin), FAINT, HPos::Center)?;
    }
    let rim = radius.to;
    for angle in (0..360).step_by(45) {
        let (sin, cos) = (angles.sign() * f64::from(angle)).to_radians().sin_cos();
        let spoke = vec![(0.0, 0.0), (rim * cos, rim * sin)];
        chart.draw_series([PathElement::new(spoke, line(GRID, 0.9))])?;
        let out = 1.09 * rim;
        write(chart, format!("{angle}°"), (out * cos, out * sin), INK, HPos::Center)?;
    }
    let turn = 1.28 * rim;
    let tip = 148;
    chart.draw_series([PathElement::new(arc(turn, 130, tip), line(FAINT, 1.4))])?;
    let end = |r: f64, deg: f64| (r * deg.to_radians().cos(), r * deg.to_radians().sin());
    let tip = f64::from(tip);
    let head = vec![end(turn, tip + 4.0), end(0.97 * turn, tip - 0.5), end(1.03 * turn, tip - 0.5)];
    chart.draw_series([Polygon::new(head, FAINT.filled())])?;
    let beside = (-1.05 * rim * WIDTH_PX / DISK_PX, 1.1 * rim);
    write(chart, "rotation".into(), beside, FAINT, HPos::Left)?;
    Ok(written)
}

/// Indices of some measured points far enough from the centre and from each other to carry their speed.
fn labelled(measured: &[(f64, Complex<f64>)], reach_um: f64) -> Vec<usize> {
    let size = |i: &usize| measured[*i].1.norm();
    let largest = (0..measured.len()).max_by(|a, b| size(a).total_cmp(&size(b)));
    let evenly = (1..SPEEDS).rev().map(|i| i * measured.len() / SPEEDS);
    let mut chosen: Vec<usize> = Vec::new();
    for i in measured.len().checked_sub(1).into_iter().chain(largest).chain(evenly) {
        let Some((_, y)) = measured.get(i) else { continue };
        let apart_um = |from: Complex<f64>| 2e6 * (y - from).norm();
        let clear = chosen.iter().all(|c| apart_um(measured[*c].1) > 0.18 * reach_um);
        if clear && apart_um(Complex::from(0.0)) > 0.1 * reach_um {
            chosen.push(i);
        }
    }
    chosen
}

/// A step of this length across the path at a point, away from the other points.
fn beside_path(measured: &[(f64, Complex<f64>)], i: usize, step_um: f64) -> (f64, f64) {
    let y = |i: usize| measured[i].1;
    let along = y((i + 3).min(measured.len() - 1)) - y(i.saturating_sub(3));
    let across =
        if along.norm() > 0.0 { Complex::<f64>::i() * along / along.norm() } else { Complex::from(1.0) };
    let mean = measured.iter().map(|(_, y)| y).sum::<Complex<f64>>() / measured.len() as f64;
    let outward = (across.conj() * (y(i) - mean)).re;
    let aside = if outward < 0.0 { -across } else { across } * step_um;
    (aside.re, aside.im)
}

//! Orbits: the path of the shaft's centre at one bearing, once around.

use nalgebra::Complex;
use plotters::prelude::{Circle, Polygon};
use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{Color, RGBColor};

use super::canvas::{
    Chart, Drawn, Entry, INK, Legend, Sheet, TEXT_PX, WIDTH_PX, anchored, curve, line, model_colour, plane,
    px, svg, write,
};
use super::scale::rpm;

/// Points of a drawn orbit.
const POINTS: usize = 90;
/// Panels side by side.
const COLUMNS: usize = 2;
const PANEL_PX: f64 = 240.0;
/// Room above a panel's axes for speed and direction.
const HEAD_PX: f64 = 3.3 * TEXT_PX;
/// Where along the turn the arrow sits: away from the keyphasor dot.
const ARROW_AT: f64 = 0.3;

/// The orbits at one speed.
#[derive(Debug, Clone, PartialEq)]
pub struct OrbitPanel {
    /// The speed, rpm.
    pub speed_rpm: f64,
    /// Measured phasors in x and y, m.
    pub measured_m: [Complex<f64>; 2],
    /// The models' phasors in x and y, m, in the order of the labels.
    pub models_m: Vec<[Complex<f64>; 2]>,
}

/// Measured and model orbits at some speeds, looking along z: x to the right, y up, the shaft turns
/// counter-clockwise; dots where the keyphasor fires, arrows in the direction of precession.
pub fn orbit(title: &str, model_labels: &[&str], panels: &[OrbitPanel]) -> String {
    let model_entries = model_labels.iter().enumerate().map(|(i, label)| Entry::Model(i, label));
    let legend = Legend::new(std::iter::once(Entry::MeasuredLine("measured")).chain(model_entries));
    let rows = panels.len().div_ceil(COLUMNS).max(1);
    svg(title, legend.height_px + rows as f64 * PANEL_PX, |sheet| {
        legend.draw(sheet)?;
        let (_, below) = sheet.split_vertically(px(legend.height_px));
        let places = below.split_evenly((rows, COLUMNS));
        panels.iter().zip(&places).try_for_each(|(panel, place)| panel.draw(place))
    })
}

impl OrbitPanel {
    fn draw(&self, sheet: &Sheet) -> Drawn {
        let centre = WIDTH_PX / COLUMNS as f64 / 2.0;
        let head = |v| anchored(INK, HPos::Center, v);
        write(sheet, &rpm(self.speed_rpm), [centre + 18.0, 1.2 * TEXT_PX], head(VPos::Center))?;
        let whirl = direction(self.measured_m).name();
        write(sheet, whirl, [centre + 18.0, 2.4 * TEXT_PX], head(VPos::Center))?;
        let (_, below) = sheet.split_vertically(px(HEAD_PX));
        let all = std::iter::once(&self.measured_m).chain(&self.models_m).flatten();
        let reach = all.map(|p| 1e6 * p.norm()).fold(f64::MIN_POSITIVE, f64::max);
        let mut chart = plane(&below, reach, [WIDTH_PX / COLUMNS as f64, PANEL_PX - HEAD_PX])?;
        for (i, model) in self.models_m.iter().enumerate() {
            curve(&mut chart, i, &path(*model))?;
            marks(&mut chart, *model, reach, model_colour(i))?;
        }
        let ring = path(self.measured_m);
        chart.draw_series(plotters::prelude::LineSeries::new(ring, line(INK, 1.4)))?;
        marks(&mut chart, self.measured_m, reach, INK)
    }
}

/// Which way the shaft's centre goes around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Direction {
    Forward,
    Backward,
}

impl Direction {
    fn name(self) -> &'static str {
        match self {
            Self::Forward => "measured: forward",
            Self::Backward => "measured: backward",
        }
    }
}

/// Forward if the path encloses its area as the shaft turns, x into y.
fn direction([x, y]: [Complex<f64>; 2]) -> Direction {
    // twice the area's rate, x ẏ − y ẋ, is the same all the way around
    if (x * y.conj()).im >= 0.0 { Direction::Forward } else { Direction::Backward }
}

/// Where the centre is after this share of a turn, µm.
fn at([x, y]: [Complex<f64>; 2], turn: f64) -> (f64, f64) {
    let turned = Complex::from_polar(1e6, std::f64::consts::TAU * turn);
    ((x * turned).re, (y * turned).re)
}

fn path(xy: [Complex<f64>; 2]) -> Vec<(f64, f64)> {
    (0..=POINTS).map(|i| at(xy, i as f64 / POINTS as f64)).collect()
}

/// The dot at the keyphasor mark and an arrow head in the direction of travel.
fn marks(chart: &mut Chart, xy: [Complex<f64>; 2], reach_um: f64, colour: RGBColor) -> Drawn {
    chart.draw_series([Circle::new(at(xy, 0.0), px(3.4), colour.filled())])?;
    let ((x, y), (ahead_x, ahead_y)) = (at(xy, ARROW_AT), at(xy, ARROW_AT + 0.01));
    let (dx, dy) = (ahead_x - x, ahead_y - y);
    let size = 0.07 * reach_um / dx.hypot(dy).max(f64::MIN_POSITIVE);
    let (dx, dy) = (dx * size, dy * size);
    let head = vec![(x + dx, y + dy), (x - dx - dy, y - dy + dx), (x - dx + dy, y - dy - dx)];
    chart.draw_series([Polygon::new(head, colour.filled())])?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_from_x_to_y_is_forward_and_its_keyphasor_dot_lies_where_the_motion_is_at_time_zero() {
        let x = Complex::new(1e-6, 0.0);
        let forward = [x, -Complex::<f64>::i() * x];
        assert_eq!(direction(forward), Direction::Forward);
        assert_eq!(direction([x, Complex::<f64>::i() * x]), Direction::Backward);
        let (a, b) = at(forward, 0.0);
        assert!((a - 1.0).abs() < 1e-12 && b.abs() < 1e-12);
        let (a, b) = at(forward, 0.25);
        assert!(a.abs() < 1e-12 && (b - 1.0).abs() < 1e-12, "a quarter turn takes x into y");
    }
}

//! Orbits: the path of the shaft's centre at one bearing, once around.

use nalgebra::Complex;

use super::chart::{Arc, Chart, Column, Look, Panel, Turn};
use crate::scale::{round_to, rpm};

/// Between points of a drawn orbit.
const STEP_DEG: f64 = 4.0;
/// Panels side by side.
const COLUMNS: usize = 2;
const PANEL_PX: f64 = 265.0;
/// Room around the largest orbit, relative to it.
const ROOM: f64 = 1.15;
/// Where along the turn the arrow sits: away from the keyphasor dot.
const ARROW_AT: f64 = 0.3;

/// The orbits at one speed.
#[derive(Debug, Clone, PartialEq)]
pub struct OrbitPanel {
    pub speed_rpm: f64,
    /// Measured phasors in x and y, m.
    pub measured_m: [Complex<f64>; 2],
    /// The models' phasors in x and y, m, in the order of the labels.
    pub models_m: Vec<[Complex<f64>; 2]>,
}

impl OrbitPanel {
    /// Room to every side, µm.
    fn reach_um(&self) -> f64 {
        let all = std::iter::once(&self.measured_m).chain(&self.models_m).flatten();
        ROOM * all.map(|p| 1e6 * p.norm()).fold(f64::MIN_POSITIVE, f64::max)
    }

    fn head(&self) -> Vec<String> {
        vec![rpm(self.speed_rpm), direction(self.measured_m).name().into()]
    }

    /// As what the first panel shows for a reader who points at this place of another figure.
    fn turn(&self, key: f64) -> Turn {
        let paths = self.models_m.iter().chain([&self.measured_m]).map(path_um).collect();
        Turn { key, head: self.head(), reach: round_to(self.reach_um(), 5), paths }
    }
}

/// Orbits of which the first follows a pointer in the other figures of its run. `readings` are all that it may show with
/// their places along the run; the first panel is one of them, until somebody points.
pub fn following(model_labels: &[&str], panels: &[OrbitPanel], readings: &[(f64, OrbitPanel)]) -> Chart {
    let turns = readings.iter().map(|(key, panel)| panel.turn(*key)).collect();
    Chart { turns, ..orbit(model_labels, panels) }
}

/// Measured and model orbits at some speeds, looking along z: x to the right, y up, the shaft turns
/// counter-clockwise; dots where the keyphasor fires, arrows in the direction of precession.
pub fn orbit(model_labels: &[&str], panels: &[OrbitPanel]) -> Chart {
    let paper = panels.iter().map(|panel| {
        let plane = Panel::plane(["x, µm", "y, µm"], panel.reach_um(), PANEL_PX);
        Panel { head: panel.head(), ..plane }
    });
    let mut chart = Chart { panels: paper.collect(), columns: COLUMNS.min(panels.len()), ..Chart::default() };
    for (at, panel) in panels.iter().enumerate() {
        for (i, (model, label)) in panel.models_m.iter().zip(model_labels).enumerate() {
            path(&mut chart, at, label, *model, [Look::Model(i), Look::Dots(i), Look::Arrows(Some(i))]);
        }
        path(
            &mut chart,
            at,
            "measured",
            panel.measured_m,
            [Look::MeasuredLine, Look::Marks, Look::Arrows(None)],
        );
    }
    chart
}

/// An orbit with its dot and its arrow.
fn path(chart: &mut Chart, panel: usize, name: &str, xy: [Complex<f64>; 2], [line, dot, arrow]: [Look; 3]) {
    let columns =
        [Column::new("x", "µm"), Column::new("y", "µm"), Column::new("turned since the keyphasor mark", "°")];
    let arc = Arc { path: path_um(&xy), from_deg: 0.0, to_deg: 360.0, step_deg: STEP_DEG };
    chart.turn(panel, Some(name), line, &columns, arc);
    let (x, y) = at(xy, 0.0);
    chart.draw(panel, name, dot, &columns, [[x, y, 0.0]]);
    let ((x, y), (ahead_x, ahead_y)) = (at(xy, ARROW_AT), at(xy, ARROW_AT + 0.01));
    let heading_deg = (ahead_y - y).atan2(ahead_x - x).to_degrees();
    chart.draw(panel, name, arrow, &[], [[x, y, heading_deg]]);
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

/// Real and imaginary part of the phasors along x and y, µm.
fn path_um(xy: &[Complex<f64>; 2]) -> [f64; 4] {
    let [x, y] = *xy;
    [x.re, x.im, y.re, y.im].map(|part| round_to(1e6 * part, 5))
}

/// Where the centre is after this share of a turn, µm.
fn at([x, y]: [Complex<f64>; 2], turn: f64) -> (f64, f64) {
    let turned = Complex::from_polar(1e6, std::f64::consts::TAU * turn);
    ((x * turned).re, (y * turned).re)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orbit_is_drawn_from_its_phasors_once_around() {
        // 3 cos ωt along x, and −4 sin ωt along y, µm
        let measured_m = [Complex::new(3e-6, 0.0), Complex::new(0.0, 4e-6)];
        let chart = orbit(&[], &[OrbitPanel { speed_rpm: 3000.0, measured_m, models_m: Vec::new() }]);
        let arc = chart.series.iter().find_map(|s| s.arc).unwrap();
        assert_eq!((arc.path, arc.from_deg, arc.to_deg), ([3.0, 0.0, 0.0, 4.0], 0.0, 360.0));
    }

    #[test]
    fn circle_from_x_to_y_is_forward_with_keyphasor_dot() {
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

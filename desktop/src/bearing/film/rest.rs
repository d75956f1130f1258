//! Where a journal lies that does not turn.

use std::f64::consts::TAU;

use nalgebra::{Rotation2, Vector2};

use super::geometry::{Arc, Shape, Surface};
use super::{Film, FilmKind};

/// Points on a lobe at which contact is looked for; the gap between them is off by their spacing squared over eight,
/// 1e-6 of the clearance.
const POINTS: usize = 1000;

impl Film {
    /// Journal from the bearing's centre while it lies still, pressed by the load alone, by the pad clearance. `None`
    /// for a bearing whose halves do not face the load alike: there the journal slides aside.
    pub fn at_rest(&self) -> Option<Vector2<f64>> {
        if self.kind == FilmKind::Offset
            || self.offset.is_some_and(|o| o != 0.5 && self.kind == FilmKind::Elliptical)
        {
            return None;
        }
        let turn = Rotation2::new(self.load_angle_deg.to_radians());
        Some(turn * Vector2::new(Shape::of(self).drop_ratio(), 0.0))
    }
}

impl Shape {
    /// Fall of the journal along the load until it touches, by the pad clearance: the gap at θ is
    /// `1 − m cos(θ − pivot) + e sin θ` with the load along −y.
    fn drop_ratio(&self) -> f64 {
        let touches = |pad: &Arc, angle: f64| {
            let gap = 1.0 - self.preload * (angle - pad.pivot).cos();
            if angle.sin() < 0.0 { gap / -angle.sin() } else { f64::INFINITY }
        };
        let along = |pad: &Arc| {
            let angle = |k: usize| pad.start + pad.arc * k as f64 / POINTS as f64;
            (0..=POINTS).map(|k| touches(pad, angle(k))).fold(f64::INFINITY, f64::min)
        };
        match &self.surface {
            Surface::Plain => along(&Arc { start: 0.0, arc: TAU, pivot: 0.0 }),
            Surface::Fixed(pads) => pads.iter().map(along).fold(f64::INFINITY, f64::min),
            Surface::Tilting(pads) => {
                pads.iter().map(|pad| touches(pad, pad.pivot)).fold(f64::INFINITY, f64::min)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fall(film: &str) -> f64 {
        let size = "diameter_m = 0.1\nlength_m = 0.05\nradial_clearance_m = 1e-4\nviscosity_pa_s = 0.02\nload_n = 1e3";
        let film: Film = toml::from_str(&format!("{film}\n{size}")).unwrap();
        film.check().unwrap();
        let at = film.at_rest().unwrap();
        assert!(at.x.abs() < 1e-12, "along the load, which pulls down");
        -at.y
    }

    #[test]
    fn rest_drop_is_clearance_for_plain_and_less_for_preloaded() {
        assert!((fall("kind = 'plain'") - 1.0).abs() < 1e-6);
        assert!((fall("kind = 'elliptical'\npreload = 0.5") - 0.5).abs() < 1e-6);
    }

    #[test]
    fn rest_drop_between_pads_is_on_pad_over_half_pitch_cosine() {
        let pads = "kind = 'tilting_pad'\npads = 4\npreload = 0.2";
        assert!((fall(&format!("{pads}\nload = 'on_pad'")) - 0.8).abs() < 1e-9);
        let between = fall(&format!("{pads}\nload = 'between_pads'"));
        assert!((between - 0.8 / (TAU / 8.0).cos()).abs() < 1e-9);
    }

    #[test]
    fn in_a_groove_a_journal_lies_on_its_two_edges() {
        let at = fall("kind = 'axial_groove'\npads = 2\ngroove_arc_deg = 30\nload = 'between_pads'");
        assert!((at - 1.0 / 15.0_f64.to_radians().cos()).abs() < 1e-6);
    }
}

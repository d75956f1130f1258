//! The film against closed forms, published tables and its own nonlinear force.

mod limits;
mod published;
mod rules;
mod stability;

use nalgebra::Matrix2;

use super::*;

/// A bearing of the given kind, 100 mm in diameter, clearance 2 ‰ of the radius.
fn bearing(kind: FilmKind, length_ratio: f64) -> Film {
    Film {
        kind,
        diameter_m: 0.1,
        length_m: 0.1 * length_ratio,
        radial_clearance_m: 1e-4,
        viscosity_pa_s: Some(0.02),
        iso_vg: None,
        temperature_c: None,
        load_n: None,
        load_angle_deg: -90.0,
        pads: None,
        pad_arc_deg: None,
        preload: None,
        offset: None,
        load: None,
        groove_arc_deg: None,
    }
}

fn lemon(length_ratio: f64, preload: f64) -> Film {
    Film { preload: Some(preload), ..bearing(FilmKind::Elliptical, length_ratio) }
}

fn pads(count: usize, load: PadLoad, preload: f64) -> Film {
    Film { pads: Some(count), load: Some(load), preload: Some(preload), ..bearing(FilmKind::TiltingPad, 0.5) }
}

/// Largest difference of two matrices by the norm of the second.
fn apart(a: &Matrix2<f64>, b: &Matrix2<f64>) -> f64 {
    (a - b).amax() / b.norm()
}

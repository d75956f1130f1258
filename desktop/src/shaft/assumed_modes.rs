//! The free-free assumed modes of Bera et al., Machines 2023, 11, 976, equations (1) to (13).
//!
//! The displacement is a sum of translation, rotation and the bending modes of a *uniform* free-free
//! beam; energies are integrated over the real, stepped shaft. Shear deformation is outside this
//! theory, so a rotor on this basis is too stiff, the more so the thicker its shaft.

use nalgebra::{DMatrix, DVector};

use crate::machine::drawing::Rotor;
use crate::machine::span::stiffness_factor;
use crate::shaft::mesh::Mesh;
use crate::shaft::structure::{ELEMENTS_PER_SEGMENT, Station, Structure};

/// Nodes and weights of the five-point Gauss–Legendre rule on −1 to 1.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Displacement, slope and curvature of every shape function at one place.
struct Shapes {
    displacement: DVector<f64>,
    slope: DVector<f64>,
    curvature: DVector<f64>,
}

/// βL of the r-th bending mode (r = 1, 2, …): the root of cos βL cosh βL = 1 near (r + ½)π.
fn beta_l(r: usize) -> f64 {
    let mut x = (r as f64 + 0.5) * std::f64::consts::PI;
    for _ in 0..20 {
        // cos x − 1/cosh x has the same roots and does not overflow
        let (f, slope) = (x.cos() - 1.0 / x.cosh(), -x.sin() + x.tanh() / x.cosh());
        x -= f / slope;
    }
    x
}

fn shapes(position_m: f64, length_m: f64, size: usize) -> Shapes {
    let mut s = Shapes {
        displacement: DVector::zeros(size),
        slope: DVector::zeros(size),
        curvature: DVector::zeros(size),
    };
    for i in 0..size {
        let (d, t, c) = match i {
            0 => (1.0, 0.0, 0.0),
            1 => (2.0 * position_m / length_m - 1.0, 2.0 / length_m, 0.0),
            _ => {
                let bl = beta_l(i - 1);
                let (beta, x) = (bl / length_m, bl * position_m / length_m);
                // φ = cosh x + cos x − σ (sinh x + sin x), written with decaying exponentials
                let sigma = (bl.cosh() - bl.cos()) / (bl.sinh() - bl.sin());
                let rising = (bl.cos() - bl.sin() - (-bl).exp()) / (bl.sinh() - bl.sin());
                let (up, down) = (0.5 * rising * x.exp(), 0.5 * (1.0 + sigma) * (-x).exp());
                (
                    up + down + x.cos() - sigma * x.sin(),
                    beta * (up - down - x.sin() - sigma * x.cos()),
                    beta * beta * (up + down - x.cos() + sigma * x.sin()),
                )
            }
        };
        (s.displacement[i], s.slope[i], s.curvature[i]) = (d, t, c);
    }
    s
}

/// The free shaft with its disks on `size` assumed modes.
pub fn structure(rotor: &Rotor, size: usize) -> Structure {
    let length_m = rotor.length_m();
    let zero = || DMatrix::<f64>::zeros(size, size);
    let (mut stiffness, mut mass, mut tilt_inertia) = (zero(), zero(), zero());
    let Mesh { nodes_m, .. } = Mesh::new(rotor, 4 * ELEMENTS_PER_SEGMENT);
    for pair in nodes_m.windows(2) {
        let (mid, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        let s = rotor.segment_at(mid);
        let (outer, inner) = (s.outer_diameter_m, s.inner_diameter_m);
        let area = std::f64::consts::PI * (outer.powi(2) - inner.powi(2)) / 4.0;
        let second_moment = std::f64::consts::PI * (outer.powi(4) - inner.powi(4)) / 64.0;
        let factor = stiffness_factor(rotor, mid);
        for (x, weight) in GAUSS {
            let at = shapes(mid + half * x, length_m, size);
            let dz = half * weight;
            stiffness.ger(
                factor * s.youngs_modulus_pa * second_moment * dz,
                &at.curvature,
                &at.curvature,
                1.0,
            );
            mass.ger(s.density_kg_m3 * area * dz, &at.displacement, &at.displacement, 1.0);
            tilt_inertia.ger(s.density_kg_m3 * second_moment * dz, &at.slope, &at.slope, 1.0);
        }
    }
    let polar_inertia = if rotor.physics.gyroscopic { 2.0 * &tilt_inertia } else { zero() };
    if rotor.physics.rotary_inertia {
        mass += &tilt_inertia;
    }
    let stations = nodes_m
        .iter()
        .map(|&position_m| {
            let at = shapes(position_m, length_m, size);
            Station { position_m, displacement: at.displacement, slope: at.slope }
        })
        .collect();
    let mut structure = Structure { stiffness, mass, polar_inertia, tilt_inertia, stations, is_chain: false };
    structure.attach_lumps(rotor, &rotor.physics);
    structure
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::drawing::Physics;
    use crate::testing::uniform_shaft;

    #[test]
    fn modes_satisfy_the_free_ends_in_closed_form() {
        for position_m in [0.0, 1.3] {
            let s = shapes(position_m, 1.3, 6);
            for i in 2..6 {
                let scale = beta_l(i - 1).powi(2) / 1.3_f64.powi(2);
                assert!(s.curvature[i].abs() < 1e-9 * scale, "no bending moment at a free end, mode {i}");
                assert!((s.displacement[i].abs() - 2.0).abs() < 1e-9, "tip of the classical mode is 2");
            }
        }
    }

    #[test]
    fn uniform_beam_modes_have_closed_form_frequencies() {
        let mut rotor = uniform_shaft();
        rotor.physics = Physics { rotary_inertia: false, shear_deformation: false, ..Physics::default() };
        let s = structure(&rotor, 6);
        let d = rotor.shaft[0].outer_diameter_m;
        let bending = rotor.shaft[0].youngs_modulus_pa * std::f64::consts::PI * d.powi(4) / 64.0;
        let line_mass = rotor.shaft[0].density_kg_m3 * std::f64::consts::PI * d * d / 4.0;
        for i in 2..6 {
            let closed = (beta_l(i - 1) / rotor.length_m()).powi(4) * bending / line_mass;
            assert!((s.stiffness[(i, i)] / s.mass[(i, i)] / closed - 1.0).abs() < 1e-9);
            for j in 2..i {
                let scale = (s.mass[(i, i)] * s.mass[(j, j)]).sqrt();
                assert!(s.mass[(i, j)].abs() < 1e-9 * scale);
            }
        }
    }
}

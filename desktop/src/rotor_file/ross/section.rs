//! Concentric layers of one length, as ROSS adds them, drawn as one cylinder.

use crate::machine::drawing::{Physics, Segment};
use crate::shaft::elements::{section, shear_parameter};

/// The cylinder that bends, shears, weighs and tilts as the layers together do, which move as one but carry their own
/// shear each.
///
/// The sum of Timoshenko matrices `EI/(1+Φ) (A + Φ B)` is one of the same form, with `EI` the sum and `Φ` the mean
/// weighted by `EI/(1+Φ)`.
pub fn equivalent(layers: &[Segment], physics: &Physics) -> Segment {
    let [first, _, ..] = layers else { return layers[0] };
    let length_m = first.length_m;
    let sum = |of: &dyn Fn(&Segment, f64, f64) -> f64| -> f64 {
        layers.iter().map(|s| (s, section(s))).map(|(s, (area, second))| of(s, area, second)).sum()
    };
    let bending = sum(&|s, _, second| s.youngs_modulus_pa * second);
    let line_mass = sum(&|s, area, _| s.density_kg_m3 * area);
    let line_tilt = sum(&|s, _, second| s.density_kg_m3 * second);
    let poisson_ratio = sum(&|s, _, second| s.poisson_ratio * s.youngs_modulus_pa * second) / bending;
    // of a tube, I/A is a sixteenth of the sum of its squared diameters
    let squares = 16.0 * line_tilt / line_mass;
    let bore = layers.iter().map(|s| s.inner_diameter_m).fold(f64::INFINITY, f64::min);
    let area = std::f64::consts::PI / 4.0 * (squares - 2.0 * bore * bore);

    let (mut weights, mut sheared) = (0.0, 0.0);
    for s in layers {
        let phi = shear_parameter(s, length_m, physics);
        let weight = s.youngs_modulus_pa * section(s).1 / (1.0 + phi);
        weights += weight;
        sheared += weight * phi;
    }
    let coefficient = 1.5 * (1.0 + poisson_ratio) * squares / (sheared / weights * length_m * length_m);
    Segment {
        length_m,
        outer_diameter_m: (squares - bore * bore).sqrt(),
        inner_diameter_m: bore,
        youngs_modulus_pa: bending / (area * squares / 16.0),
        density_kg_m3: line_mass / area,
        poisson_ratio,
        shear_coefficient: physics.shear_deformation.then_some(coefficient),
        axial_force_n: layers.iter().map(|s| s.axial_force_n).sum(),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector4;

    use super::*;
    use crate::shaft::elements::element;

    fn tube(outer_diameter_m: f64, inner_diameter_m: f64, youngs_modulus_pa: f64) -> Segment {
        Segment {
            length_m: 0.2,
            outer_diameter_m,
            inner_diameter_m,
            youngs_modulus_pa,
            density_kg_m3: 7810.0,
            poisson_ratio: 0.3,
            shear_coefficient: None,
            axial_force_n: 0.0,
        }
    }

    /// Independent of the formula: the matrices of the layers, added.
    #[test]
    fn equivalent_of_layers_has_the_sum_of_their_matrices() {
        let physics = Physics::default();
        for layers in [
            vec![tube(0.05, 0.0, 2.11e11), tube(0.08, 0.05, 2.11e11)],
            vec![tube(0.05, 0.0, 2.11e11), tube(0.12, 0.05, 6894.75)],
            vec![tube(0.05, 0.02, 2.11e11), tube(0.07, 0.05, 1.1e11), tube(0.09, 0.07, 7e10)],
        ] {
            let one = element(&equivalent(&layers, &physics), 0.2, &physics);
            let all: Vec<_> = layers.iter().map(|s| element(s, 0.2, &physics)).collect();
            let stiffness = all.iter().map(|e| e.stiffness).sum::<nalgebra::Matrix4<f64>>();
            let mass = all.iter().map(|e| e.mass).sum::<nalgebra::Matrix4<f64>>();
            assert!((one.stiffness - stiffness).amax() < 1e-9 * stiffness.amax());
            // how a mass is spread between the nodes depends on each layer's own shear; moved as a whole it does not
            for rigid in [Vector4::new(1.0, 0.0, 1.0, 0.0), Vector4::new(-0.1, 1.0, 0.1, 1.0)] {
                let [ours, theirs] = [one.mass, mass].map(|mass| rigid.dot(&(mass * rigid)));
                assert!((ours / theirs - 1.0).abs() < 1e-9, "{ours} {theirs}");
            }
        }
    }
}

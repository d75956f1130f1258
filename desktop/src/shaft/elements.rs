//! Timoshenko beam elements of one lateral plane.
//!
//! Degrees of freedom of an element of length `l`: displacement and slope at its left end, then at
//! its right end. Slopes are derivatives of the displacement in both planes, so the same matrices
//! serve x and y. Shape functions and matrices: Friswell, Penny, Garvey, Lees, *Dynamics of Rotating
//! Machines* (2010), section 5.4; shear coefficient after Cowper (1966).

use nalgebra::Matrix4;

use crate::machine::drawing::{Coupling, Physics, Segment};

pub struct Element {
    /// Stiffness, N/m and consistent units for slopes.
    pub stiffness: Matrix4<f64>,
    /// Mass of translation, and of tilt if rotary inertia is in force.
    pub mass: Matrix4<f64>,
    /// Polar inertia: twice the inertia of tilt for a round section.
    pub polar_inertia: Matrix4<f64>,
    /// Inertia of tilt alone, `∫ ρI ψψᵀ dz` with ψ the rotation of the section.
    pub tilt_inertia: Matrix4<f64>,
}

/// Cowper's shear coefficient of a round, possibly hollow, section.
fn shear_coefficient(poisson: f64, bore_ratio: f64) -> f64 {
    let m2 = bore_ratio * bore_ratio;
    let open = (1.0 + m2).powi(2);
    6.0 * (1.0 + poisson) * open / ((7.0 + 6.0 * poisson) * open + (20.0 + 12.0 * poisson) * m2)
}

/// Area and second moment of area of a segment's section, m² and m⁴.
pub(crate) fn section(segment: &Segment) -> (f64, f64) {
    let (outer, inner) = (segment.outer_diameter_m, segment.inner_diameter_m);
    let area = std::f64::consts::PI * (outer.powi(2) - inner.powi(2)) / 4.0;
    (area, std::f64::consts::PI * (outer.powi(4) - inner.powi(4)) / 64.0)
}

/// Φ of a Timoshenko element, `12EI / κGAl²`: its flexibility in shear relative to bending.
pub(crate) fn shear_parameter(segment: &Segment, length_m: f64, physics: &Physics) -> f64 {
    if !physics.shear_deformation {
        return 0.0;
    }
    let (area, second_moment) = section(segment);
    // E/G = 2 (1 + ν): the modulus cancels
    let bore_ratio = segment.inner_diameter_m / segment.outer_diameter_m;
    let kappa =
        segment.shear_coefficient.unwrap_or_else(|| shear_coefficient(segment.poisson_ratio, bore_ratio));
    24.0 * (1.0 + segment.poisson_ratio) * second_moment / (kappa * area * length_m * length_m)
}

/// Symmetric matrix of a beam element from its upper corner pattern.
///
/// Left-right symmetry leaves six numbers: displacement–displacement (own, far), displacement–slope
/// (own, far), slope–slope (own, far). The far displacement–slope terms change sign with direction.
fn beam_pattern(dd: [f64; 2], ds: [f64; 2], ss: [f64; 2]) -> Matrix4<f64> {
    #[rustfmt::skip]
    let matrix = Matrix4::new(
        dd[0],  ds[0], dd[1],  ds[1],
        ds[0],  ss[0], -ds[1], ss[1],
        dd[1], -ds[1], dd[0], -ds[0],
        ds[1],  ss[1], -ds[0], ss[0],
    );
    matrix
}

/// Matrices of one element of `length_m`, cut from `segment`.
pub fn element(segment: &Segment, length_m: f64, physics: &Physics) -> Element {
    let l = length_m;
    let (area, second_moment) = section(segment);
    let bending = segment.youngs_modulus_pa * second_moment;
    let phi = shear_parameter(segment, l, physics);

    let bent = beam_pattern([12.0, -12.0], [6.0 * l, 6.0 * l], [(4.0 + phi) * l * l, (2.0 - phi) * l * l])
        * (bending / (l.powi(3) * (1.0 + phi)));
    // a tension straightens the shaft: ∫ N w'² dz of the same shapes
    let stretched = beam_pattern(
        [36.0 + 60.0 * phi + 30.0 * phi * phi, -(36.0 + 60.0 * phi + 30.0 * phi * phi)],
        [3.0 * l, 3.0 * l],
        [(4.0 + 5.0 * phi + 2.5 * phi * phi) * l * l, -(1.0 + 5.0 * phi + 2.5 * phi * phi) * l * l],
    ) * (segment.axial_force_n / (30.0 * l * (1.0 + phi).powi(2)));
    let stiffness = bent + stretched;

    let translation = beam_pattern(
        [13.0 / 35.0 + 7.0 * phi / 10.0 + phi * phi / 3.0, 9.0 / 70.0 + 3.0 * phi / 10.0 + phi * phi / 6.0],
        [
            (11.0 / 210.0 + 11.0 * phi / 120.0 + phi * phi / 24.0) * l,
            -(13.0 / 420.0 + 3.0 * phi / 40.0 + phi * phi / 24.0) * l,
        ],
        [
            (1.0 / 105.0 + phi / 60.0 + phi * phi / 120.0) * l * l,
            -(1.0 / 140.0 + phi / 60.0 + phi * phi / 120.0) * l * l,
        ],
    ) * (segment.density_kg_m3 * area * l / (1.0 + phi).powi(2));

    let tilt = beam_pattern(
        [6.0 / 5.0, -6.0 / 5.0],
        [(0.1 - phi / 2.0) * l, (0.1 - phi / 2.0) * l],
        [
            (2.0 / 15.0 + phi / 6.0 + phi * phi / 3.0) * l * l,
            (-1.0 / 30.0 - phi / 6.0 + phi * phi / 6.0) * l * l,
        ],
    ) * (segment.density_kg_m3 * second_moment / (l * (1.0 + phi).powi(2)));

    let mass = if physics.rotary_inertia { translation + tilt } else { translation };
    let polar_inertia = if physics.gyroscopic { 2.0 * tilt } else { Matrix4::zeros() };
    Element { stiffness, mass, polar_inertia, tilt_inertia: tilt }
}

/// Matrices of a flexible coupling between two nodes at one place: springs between their displacements and between
/// their slopes, half of its mass and inertias on either; no stiffness where it is rigid.
pub fn joint(coupling: &Coupling, physics: &Physics) -> Element {
    let between = |k: f64| [k, -k];
    let springs = coupling.flexibility.as_ref();
    let stiffness = beam_pattern(
        between(springs.map_or(0.0, |f| f.lateral_stiffness_n_m)),
        [0.0; 2],
        between(springs.map_or(0.0, |f| f.angular_stiffness_n_m_rad)),
    );
    let halves = |mass: f64, inertia: f64| beam_pattern([0.5 * mass, 0.0], [0.0; 2], [0.5 * inertia, 0.0]);
    // as those of a disk, its inertias count whether or not those of shaft sections do
    let polar_kg_m2 = if physics.gyroscopic { coupling.polar_inertia_kg_m2 } else { 0.0 };
    Element {
        stiffness,
        mass: halves(coupling.mass_kg, coupling.diametral_inertia_kg_m2),
        polar_inertia: halves(0.0, polar_kg_m2),
        tilt_inertia: halves(0.0, coupling.diametral_inertia_kg_m2),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector4;

    fn segment() -> Segment {
        Segment {
            length_m: 0.3,
            outer_diameter_m: 0.1,
            inner_diameter_m: 0.03,
            youngs_modulus_pa: 2.08e11,
            density_kg_m3: 7850.0,
            poisson_ratio: 0.3,
            shear_coefficient: None,
            axial_force_n: 0.0,
        }
    }

    #[test]
    fn rigid_motion_has_zero_energy_and_mass_and_inertia_of_a_rod() {
        let (s, l) = (segment(), 0.3);
        let e = element(&s, l, &Physics::default());
        let area = std::f64::consts::PI * (0.1_f64.powi(2) - 0.03_f64.powi(2)) / 4.0;
        let second_moment = std::f64::consts::PI * (0.1_f64.powi(4) - 0.03_f64.powi(4)) / 64.0;
        let translate = Vector4::new(1.0, 0.0, 1.0, 0.0);
        let rotate = Vector4::new(-l / 2.0, 1.0, l / 2.0, 1.0);
        let scale = e.stiffness.amax();
        assert!((e.stiffness * translate).amax() < 1e-12 * scale);
        assert!((e.stiffness * rotate).amax() < 1e-12 * scale);
        let mass = 7850.0 * area * l;
        let inertia = mass * l * l / 12.0 + 7850.0 * second_moment * l;
        assert!((translate.dot(&(e.mass * translate)) / mass - 1.0).abs() < 1e-12);
        assert!((rotate.dot(&(e.mass * rotate)) / inertia - 1.0).abs() < 1e-12);
        let polar = 2.0 * 7850.0 * second_moment * l;
        assert!((rotate.dot(&(e.polar_inertia * rotate)) / polar - 1.0).abs() < 1e-12);
    }

    #[test]
    fn cantilever_deflection_equals_closed_form_with_shear() {
        let (s, l) = (segment(), 0.3);
        let e = element(&s, l, &Physics::default());
        let tip = e.stiffness.fixed_view::<2, 2>(2, 2).try_inverse().unwrap()[(0, 0)];
        let area = std::f64::consts::PI * (0.1_f64.powi(2) - 0.03_f64.powi(2)) / 4.0;
        let second_moment = std::f64::consts::PI * (0.1_f64.powi(4) - 0.03_f64.powi(4)) / 64.0;
        let shear_modulus = 2.08e11 / 2.6;
        let kappa = shear_coefficient(0.3, 0.3);
        let expected = l.powi(3) / (3.0 * 2.08e11 * second_moment) + l / (kappa * shear_modulus * area);
        assert!((tip / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn cowper_coefficient_of_a_solid_section_is_6_1_nu_over_7_6_nu() {
        assert!((shear_coefficient(0.3, 0.0) - 6.0 * 1.3 / 8.8).abs() < 1e-15);
    }
}

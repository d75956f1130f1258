//! What the shaft weighs on each of its bearings, and how far it sags between them.
//!
//! The bearings are rigid and each has its own height: the displacement at a bearing is prescribed, the rest
//! of the shaft follows, and what it takes to hold the bearing there is the load it carries. Any number of
//! bearings from two on; from three on the load depends on their heights (the alignment) and on the bending
//! stiffness of the shaft. The weight is that of the shaft and its disks as drawn; it enters by the mass
//! matrix, which for beam elements is the exact nodal load of a uniform weight.

use nalgebra::{DMatrix, DVector};

use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::shaft::structure::{Structure, elements_per_segment};
use crate::units::same_place;

/// Standard acceleration of gravity, m/s² (3rd CGPM, 1901).
pub const GRAVITY_M_S2: f64 = 9.806_65;

/// A shaft at rest on its bearings.
#[derive(Debug, Clone, PartialEq)]
pub struct Statics {
    /// Load of each bearing in the order of the file, N; positive where the shaft presses down on it,
    /// negative where the bearing has to hold the shaft down.
    pub load_n: Vec<f64>,
    /// Places along the shaft, from the left end, m.
    pub position_m: Vec<f64>,
    /// How far the shaft lies below height zero at each of these places, m.
    pub sag_m: Vec<f64>,
    /// Mass of shaft and disks, kg.
    pub mass_kg: f64,
    /// Its centre, from the left end, m.
    pub centre_of_gravity_m: f64,
}

/// Loads and sag of a horizontal shaft under its weight.
///
/// `elevation_m` is the height of each bearing, upwards, in the order of the file; empty for bearings in one
/// line. Heights that lie on a straight line change no load.
///
/// # Errors
/// If there are fewer than two bearings, two of them at one place, or not as many heights as bearings.
pub fn statics(rotor: &Rotor, elevation_m: &[f64]) -> Result<Statics, Error> {
    let held = rotor.bearing.len();
    if held < 2 {
        return Err(Error::TooFewBearings { given: held });
    }
    if !elevation_m.is_empty() && elevation_m.len() != held {
        return Err(Error::Elevations { given: elevation_m.len(), bearings: held });
    }
    if let Some(elevation_m) = elevation_m.iter().copied().find(|e| !e.is_finite()) {
        return Err(Error::ElevationNotFinite { elevation_m });
    }
    for (i, a) in rotor.bearing.iter().enumerate() {
        for b in &rotor.bearing[..i] {
            if same_place(a.position_m, b.position_m) {
                return Err(Error::BearingsAtOnePlace { bearings: [b.name.clone(), a.name.clone()] });
            }
        }
    }

    let structure = Structure::finite_elements(rotor, &rotor.physics, elements_per_segment(rotor));
    let (line_mass, mass_kg, centre_of_gravity_m) = weighed(&structure);
    let weight = -GRAVITY_M_S2 * &line_mass;

    let shapes: Vec<DVector<f64>> =
        rotor.bearing.iter().map(|b| structure.station(b.position_m).displacement.clone()).collect();
    let shapes = DMatrix::from_columns(&shapes);
    let elevation = DVector::from_fn(held, |i, _| elevation_m.get(i).copied().unwrap_or(0.0));
    let (height, load) = hold(&structure.stiffness, &weight, &shapes, &elevation).ok_or_else(|| {
        Error::Unsuitable(
            "the bearings do not hold the shaft, expected two bearings with stiffness at different places"
                .into(),
        )
    })?;
    Ok(Statics {
        load_n: load.as_slice().to_vec(),
        position_m: structure.stations.iter().map(|s| s.position_m).collect(),
        sag_m: structure.stations.iter().map(|s| -s.displacement.dot(&height)).collect(),
        mass_kg,
        centre_of_gravity_m,
    })
}

/// Mass, kg, and its centre from the left end, m.
pub fn mass_and_centre(rotor: &Rotor) -> (f64, f64) {
    let structure = Structure::finite_elements(rotor, &rotor.physics, elements_per_segment(rotor));
    let (_, mass_kg, centre_m) = weighed(&structure);
    (mass_kg, centre_m)
}

/// Mass of each coordinate under a unit lift, mass and centre of mass.
fn weighed(structure: &Structure) -> (DVector<f64>, f64, f64) {
    let n = structure.size();
    let (mut lift, mut turn) = (DVector::zeros(n), DVector::zeros(n));
    for s in &structure.stations {
        lift += &s.displacement;
        turn += &s.displacement * s.position_m + &s.slope;
    }
    let line_mass = &structure.mass * &lift;
    let mass_kg = lift.dot(&line_mass);
    let centre_m = turn.dot(&line_mass) / mass_kg;
    (line_mass, mass_kg, centre_m)
}

/// Coordinates q and forces r of `K q = f + S r` under `Sᵀ q = e`.
///
/// K alone is singular, as the shaft is free. `K + κ S Sᵀ` has the same solution under the constraint with
/// `r` shifted by the known `κ e`, and is positive definite as soon as two places are held.
fn hold(
    stiffness: &DMatrix<f64>,
    force: &DVector<f64>,
    shapes: &DMatrix<f64>,
    elevation: &DVector<f64>,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let kappa = stiffness.diagonal().mean();
    let held = (stiffness + shapes * shapes.transpose() * kappa).cholesky()?;
    let (free, per_force) = (held.solve(force), held.solve(shapes));
    let flexibility = shapes.tr_mul(&per_force);
    let shifted = flexibility.cholesky()?.solve(&(elevation - shapes.tr_mul(&free)));
    let q = free + per_force * &shifted;
    Some((q, shifted - elevation * kappa))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{sample_rotor, uniform_shaft};

    /// The uniform shaft on bearings at these places.
    fn on_bearings(position_m: &[f64], shear_deformation: bool) -> Rotor {
        let mut rotor = uniform_shaft();
        rotor.physics.shear_deformation = shear_deformation;
        let one = rotor.bearing[0].clone();
        let bearing = |(i, z): (usize, &f64)| {
            let mut bearing = one.clone();
            (bearing.name, bearing.position_m) = (format!("{i}"), *z);
            bearing
        };
        rotor.bearing = position_m.iter().enumerate().map(bearing).collect();
        rotor
    }

    /// Weight per length, EI and κGA of the uniform shaft, by hand.
    fn beam() -> (f64, f64, f64) {
        let (d, e, nu) = (0.05_f64, 2.08e11, 0.3);
        let area = std::f64::consts::PI * d * d / 4.0;
        let kappa = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu);
        let shear = kappa * e / (2.0 * (1.0 + nu)) * area;
        (7850.0 * area * GRAVITY_M_S2, e * std::f64::consts::PI * d.powi(4) / 64.0, shear)
    }

    fn assert_loads(ours: &[f64], expected: &[f64], scale: f64) {
        assert_eq!(ours.len(), expected.len());
        for (a, b) in ours.iter().zip(expected) {
            assert!((a - b).abs() < 1e-8 * scale, "{ours:?} against {expected:?}");
        }
    }

    #[test]
    fn two_bearings_carry_what_the_law_of_the_lever_says() {
        let rotor = sample_rotor();
        let (mut mass, mut moment, mut left) = (0.0, 0.0, 0.0);
        for s in &rotor.shaft {
            let m = s.density_kg_m3 * std::f64::consts::PI * s.outer_diameter_m.powi(2) / 4.0 * s.length_m;
            mass += m;
            moment += m * (left + 0.5 * s.length_m);
            left += s.length_m;
        }
        for d in &rotor.disk {
            mass += d.mass_kg;
            moment += d.mass_kg * d.position_m;
        }
        let centre = moment / mass;
        let right = mass * GRAVITY_M_S2 * (centre - 0.1) / 0.8;
        let s = statics(&rotor, &[]).unwrap();
        assert!(
            (s.mass_kg / mass - 1.0).abs() < 1e-12 && (s.centre_of_gravity_m / centre - 1.0).abs() < 1e-12
        );
        assert_loads(&s.load_n, &[mass * GRAVITY_M_S2 - right, right], mass * GRAVITY_M_S2);
    }

    #[test]
    fn a_bearing_inside_of_a_heavy_overhang_is_lifted() {
        let s = statics(&on_bearings(&[0.0, 0.25], true), &[]).unwrap();
        let (w, _, _) = beam();
        // moments about each bearing: w·1·(0.5 − 0.25) = −R₀·0.25, w·1·0.5 = R₁·0.25
        assert_loads(&s.load_n, &[-w, 2.0 * w], w);
    }

    #[test]
    fn equal_spans_have_the_reactions_of_clapeyrons_three_moments() {
        let expected: [&[f64]; 3] = [
            &[3.0 / 8.0, 10.0 / 8.0, 3.0 / 8.0],
            &[0.4, 1.1, 1.1, 0.4],
            &[11.0 / 28.0, 32.0 / 28.0, 26.0 / 28.0, 32.0 / 28.0, 11.0 / 28.0],
        ];
        for reactions in expected {
            let spans = reactions.len() - 1;
            let places: Vec<f64> = (0..=spans).map(|i| i as f64 / spans as f64).collect();
            let span_n = beam().0 / spans as f64;
            let loads: Vec<f64> = reactions.iter().map(|r| r * span_n).collect();
            assert_loads(&statics(&on_bearings(&places, false), &[]).unwrap().load_n, &loads, span_n);
        }
    }

    #[test]
    fn middle_bearing_load_equals_closed_form_with_shear() {
        let (w, bending, shear) = beam();
        let sag = 5.0 * w / (384.0 * bending) + w / (8.0 * shear);
        let per_newton = 1.0 / (48.0 * bending) + 1.0 / (4.0 * shear);
        let raised = 2e-4;
        for height in [0.0, raised] {
            let middle = (sag + height) / per_newton;
            let s = statics(&on_bearings(&[0.0, 0.5, 1.0], true), &[0.0, height, 0.0]).unwrap();
            assert_loads(&s.load_n, &[0.5 * (w - middle), middle, 0.5 * (w - middle)], w + middle);
        }
    }

    #[test]
    fn sag_in_the_middle_is_bending_plus_shear_in_closed_form() {
        let (w, bending, shear) = beam();
        let mut rotor = on_bearings(&[0.0, 1.0], true);
        rotor.plane[0].position_m = 0.5;
        let s = statics(&rotor, &[]).unwrap();
        let middle = s.position_m.iter().position(|z| (z - 0.5).abs() < 1e-9).unwrap();
        let expected = 5.0 * w / (384.0 * bending) + w / (8.0 * shear);
        assert!((s.sag_m[middle] / expected - 1.0).abs() < 1e-8);
        assert!(s.sag_m[0].abs() < 1e-9 * expected && s.sag_m.iter().all(|v| *v > -1e-9 * expected));
    }

    #[test]
    fn heights_on_a_straight_line_tilt_the_shaft_and_change_no_load() {
        let rotor = on_bearings(&[0.1, 0.3, 0.7, 1.0], true);
        let level = statics(&rotor, &[]).unwrap();
        let heights: Vec<f64> = rotor.bearing.iter().map(|b| 1e-3 - 2e-3 * b.position_m).collect();
        let tilted = statics(&rotor, &heights).unwrap();
        assert_loads(&tilted.load_n, &level.load_n, beam().0);
        for ((z, a), b) in level.position_m.iter().zip(&level.sag_m).zip(&tilted.sag_m) {
            assert!((a - (1e-3 - 2e-3 * z) - b).abs() < 1e-12, "at {z} m");
        }
    }

    #[test]
    fn what_cannot_be_held_is_said_in_one_sentence() {
        let said = |rotor: &Rotor, heights: &[f64]| statics(rotor, heights).unwrap_err().to_string();
        assert!(said(&on_bearings(&[0.5], true), &[]).contains("1 bearing"));
        assert!(said(&on_bearings(&[0.5, 0.5], true), &[]).contains("same place"));
        assert!(said(&on_bearings(&[0.1, 0.5], true), &[0.0]).contains("1 elevations given for 2"));
        assert!(said(&on_bearings(&[0.1, 0.5], true), &[0.0, f64::NAN]).contains("NaN"));
    }
}

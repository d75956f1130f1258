//! The shaft with its disks in one lateral plane, on any set of shape functions.
//!
//! Finite elements, modes of the real shaft and the free-free modes of a uniform beam all end up as
//! the same thing: matrices K, M, G and, for each place on the shaft, how much every coordinate
//! displaces and tilts it.

use nalgebra::{DMatrix, DVector};

use crate::machine::drawing::{Coupling, Disk, Physics, Rotor};
use crate::shaft::mesh::Mesh;

/// Pieces that each segment of a shaft of few is cut into at least.
pub const ELEMENTS_PER_SEGMENT: usize = 2;
/// Segments from which on each is one piece: they are shorter then than any mode of interest has a use for.
const MANY_SEGMENTS: usize = 100;

/// Pieces that each segment of this shaft is cut into at least.
pub fn elements_per_segment(rotor: &Rotor) -> usize {
    if rotor.shaft.len() < MANY_SEGMENTS { ELEMENTS_PER_SEGMENT } else { 1 }
}

/// A place on the shaft and how the coordinates move it.
#[derive(Debug, Clone)]
pub struct Station {
    /// Distance from the left end, m.
    pub position_m: f64,
    /// Displacement per unit coordinate.
    pub displacement: DVector<f64>,
    /// Slope per unit coordinate, 1/m.
    pub slope: DVector<f64>,
}

/// K, M, G of the free shaft with its disks, n × n, and its stations from left to right.
#[derive(Debug, Clone)]
pub struct Structure {
    /// Stiffness of the free shaft (no bearings), N/m.
    pub stiffness: DMatrix<f64>,
    /// Mass, kg.
    pub mass: DMatrix<f64>,
    /// Polar inertia: the gyroscopic moments are `Ω² G` at running speed.
    pub polar_inertia: DMatrix<f64>,
    /// Diametral inertia of shaft sections and disks, whether or not it is part of the mass.
    pub tilt_inertia: DMatrix<f64>,
    /// Places on the shaft, ascending.
    pub stations: Vec<Station>,
    /// The coordinates are displacement and slope of each station in turn, and only neighbouring stations are joined.
    pub is_chain: bool,
}

impl Structure {
    /// Finite elements with a node at every mark, two at a flexible coupling, and at least `per_segment` elements a
    /// segment.
    pub fn finite_elements(rotor: &Rotor, physics: &Physics, per_segment: usize) -> Self {
        Self::on_mesh(&Mesh::new(rotor, per_segment), rotor, physics)
    }

    /// Finite elements of this mesh of the rotor.
    pub fn on_mesh(mesh: &Mesh, rotor: &Rotor, physics: &Physics) -> Self {
        let n = 2 * mesh.nodes_m.len();
        let mut s = Self {
            stiffness: DMatrix::zeros(n, n),
            mass: DMatrix::zeros(n, n),
            polar_inertia: DMatrix::zeros(n, n),
            tilt_inertia: DMatrix::zeros(n, n),
            stations: Vec::with_capacity(mesh.nodes_m.len()),
            is_chain: true,
        };
        for i in 0..mesh.pieces.len() {
            let e = mesh.element_with_effects(i, rotor, physics);
            for (whole, part) in [
                (&mut s.stiffness, e.stiffness),
                (&mut s.mass, e.mass),
                (&mut s.polar_inertia, e.polar_inertia),
                (&mut s.tilt_inertia, e.tilt_inertia),
            ] {
                let mut view = whole.view_mut((2 * i, 2 * i), (4, 4));
                view += part;
            }
        }
        let unit = |k: usize| DVector::from_fn(n, |row, _| f64::from(u8::from(row == k)));
        for (i, &position_m) in mesh.nodes_m.iter().enumerate() {
            s.stations.push(Station { position_m, displacement: unit(2 * i), slope: unit(2 * i + 1) });
        }
        s.attach_lumps(rotor, physics);
        s
    }

    /// Adds the masses and inertias of disks and rigid couplings at their stations.
    pub(crate) fn attach_lumps(&mut self, rotor: &Rotor, physics: &Physics) {
        for lump in lumps(rotor) {
            let Station { displacement, slope, .. } = self.station(lump.position_m).clone();
            self.mass.ger(lump.mass_kg, &displacement, &displacement, 1.0);
            self.mass.ger(lump.diametral_inertia_kg_m2, &slope, &slope, 1.0);
            self.tilt_inertia.ger(lump.diametral_inertia_kg_m2, &slope, &slope, 1.0);
            if physics.gyroscopic {
                self.polar_inertia.ger(lump.polar_inertia_kg_m2, &slope, &slope, 1.0);
            }
        }
    }

    /// Number of coordinates in one plane.
    pub fn size(&self) -> usize {
        self.stiffness.nrows()
    }

    /// The station nearest to a position; marks of the rotor are stations exactly. Of the two at a flexible coupling it
    /// is the left one.
    pub fn station(&self, position_m: f64) -> &Station {
        let right = self.stations.partition_point(|s| s.position_m < position_m);
        let candidates = &self.stations[right.saturating_sub(1)..(right + 1).min(self.stations.len())];
        let distance = |s: &Station| (s.position_m - position_m).abs();
        candidates
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .expect("a structure has at least two stations")
    }

    /// The same structure in the coordinates of the columns of `basis`.
    pub fn projected(&self, basis: &DMatrix<f64>) -> Self {
        let project = |m: &DMatrix<f64>| basis.tr_mul(&(m * basis));
        Self {
            stiffness: project(&self.stiffness),
            mass: project(&self.mass),
            polar_inertia: project(&self.polar_inertia),
            tilt_inertia: project(&self.tilt_inertia),
            is_chain: false,
            stations: self
                .stations
                .iter()
                .map(|s| Station {
                    position_m: s.position_m,
                    displacement: basis.tr_mul(&s.displacement),
                    slope: basis.tr_mul(&s.slope),
                })
                .collect(),
        }
    }
}

/// Mass and inertias at one place of the shaft.
pub(crate) struct Lump {
    pub(crate) position_m: f64,
    pub(crate) mass_kg: f64,
    pub(crate) diametral_inertia_kg_m2: f64,
    pub(crate) polar_inertia_kg_m2: f64,
}

/// Disks in the order of the file, then rigid couplings; a flexible one is a piece of the mesh.
pub(crate) fn lumps(rotor: &Rotor) -> impl Iterator<Item = Lump> {
    let disk = |d: &Disk| Lump {
        position_m: d.position_m,
        mass_kg: d.mass_kg,
        diametral_inertia_kg_m2: d.diametral_inertia_kg_m2,
        polar_inertia_kg_m2: d.polar_inertia_kg_m2,
    };
    let coupling = |c: &Coupling| Lump {
        position_m: c.position_m,
        mass_kg: c.mass_kg,
        diametral_inertia_kg_m2: c.diametral_inertia_kg_m2,
        polar_inertia_kg_m2: c.polar_inertia_kg_m2,
    };
    let rigid = rotor.coupling.iter().filter(|c| c.flexibility.is_none());
    rotor.disk.iter().map(disk).chain(rigid.map(coupling))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::uniform_shaft;
    use nalgebra::SymmetricEigen;

    /// Roots of cos βl cosh βl = 1.
    const FREE_FREE: [f64; 4] =
        [4.730_040_744_862_7, 7.853_204_624_095_8, 10.995_607_838_001_7, 14.137_165_491_257_5];

    #[test]
    fn uniform_beam_has_the_closed_form_free_free_frequencies() {
        let rotor = uniform_shaft();
        let physics = Physics {
            shear_deformation: false,
            rotary_inertia: false,
            gyroscopic: false,
            ..Physics::default()
        };
        let s = Structure::finite_elements(&rotor, &physics, 100);
        let chol = s.mass.clone().cholesky().unwrap();
        let l_inv = chol.l().try_inverse().unwrap();
        let mut w2 =
            SymmetricEigen::new(&l_inv * &s.stiffness * l_inv.transpose()).eigenvalues.data.as_vec().clone();
        w2.sort_by(f64::total_cmp);
        let d = rotor.shaft[0].outer_diameter_m;
        let (area, inertia) = (std::f64::consts::PI * d * d / 4.0, std::f64::consts::PI * d.powi(4) / 64.0);
        let speed =
            (rotor.shaft[0].youngs_modulus_pa * inertia / (rotor.shaft[0].density_kg_m3 * area)).sqrt();
        for (k, beta_l) in FREE_FREE.iter().enumerate() {
            let closed = (beta_l / rotor.length_m()).powi(2) * speed;
            assert!((w2[k + 2].sqrt() / closed - 1.0).abs() < 1e-6, "mode {k}");
        }
        assert!(w2[1].abs() < 1e-6 * w2[2], "two rigid modes at zero");
    }

    #[test]
    fn every_mark_is_a_node() {
        let rotor = uniform_shaft();
        let s = Structure::finite_elements(&rotor, &Physics::default(), ELEMENTS_PER_SEGMENT);
        for mark in rotor.marks_m() {
            assert!((s.station(mark).position_m - mark).abs() < 1e-9);
        }
    }
}

//! The shaft on finite elements, kept one by one: an error of the drawing changes a few of them, or moves
//! a place along them.
//!
//! Mesh and shape functions are those of the drawing, whatever its errors: places that are off are
//! interpolated to first order, so nothing has to be meshed or solved anew.

use nalgebra::{DMatrix, DVector};

use crate::machine::drawing::{Formulation, Physics, Rotor, Segment};
use crate::machine::place::{End, Pattern};
use crate::machine::span::Span;
use crate::machine::tolerance::Offsets;
use crate::model::Model;
use crate::model::force::half_sines;
use crate::reduction::strain::{self, SpanStrain};
use crate::reduction::{basis, sizes};
use crate::shaft::elements::{Element, shear_parameter};
use crate::shaft::mesh::{Mesh, Piece};
use crate::shaft::structure::{Structure, elements_per_segment, lumps};

/// A sum over nodal coordinates: number and factor.
pub type NodalSum = Vec<(usize, f64)>;

/// A place on the shaft, as sums over nodal coordinates.
#[derive(Debug, Clone)]
pub struct Section {
    pub displacement: NodalSum,
    /// Tilt of the section there.
    pub tilt: NodalSum,
    /// Change of the displacement per metre along the shaft.
    pub displacement_rate: NodalSum,
    /// Change of the tilt per metre along the shaft.
    pub tilt_rate: NodalSum,
}

impl Section {
    /// Displacement a small way beside.
    pub fn displacement_beside(&self, offset_m: f64) -> NodalSum {
        beside(&self.displacement, &self.displacement_rate, offset_m)
    }

    /// Tilt a small way beside.
    pub fn tilt_beside(&self, offset_m: f64) -> NodalSum {
        beside(&self.tilt, &self.tilt_rate, offset_m)
    }
}

fn beside(value: &NodalSum, rate: &NodalSum, offset_m: f64) -> NodalSum {
    let moved = rate.iter().map(|(k, v)| (*k, v * offset_m));
    value.iter().copied().chain(moved.filter(|_| offset_m != 0.0)).collect()
}

/// Stiffness, mass and polar inertia of one lateral plane on the shape functions.
pub struct ShaftMatrices {
    /// Stiffness of the free shaft.
    pub stiffness: DMatrix<f64>,
    pub mass: DMatrix<f64>,
    pub polar_inertia: DMatrix<f64>,
}

/// Mesh and shape functions of a drawing.
pub struct Shaft {
    mesh: Mesh,
    /// Nodal coordinates × shape functions.
    pub basis: DMatrix<f64>,
    physics: Physics,
    /// Nodal coordinates of every pattern that is a bent shaft, of unit height.
    bends: [(Pattern, DVector<f64>); 2],
    sections: Vec<Section>,
    /// How lengths of the shaft bend, where their stiffness may differ.
    pub strains: Vec<SpanStrain>,
}

impl Shaft {
    /// Mesh and shape functions of a rotor as drawn.
    pub fn new(rotor: &Rotor, physics: &Physics) -> Self {
        Self::with_strains(rotor, physics, &[])
    }

    /// The same where the stiffness of these lengths of the shaft may differ, with shape functions for that.
    pub fn with_strains(rotor: &Rotor, physics: &Physics, spans: &[Span]) -> Self {
        let rotor = &Rotor { physics: *physics, ..rotor.clone() };
        let mesh = Mesh::with_ends(rotor, elements_per_segment(rotor), spans);
        let model = Model::on(Structure::on_mesh(&mesh, rotor, physics), rotor);
        let strains = strain::of_spans(rotor, &mesh, spans);
        let basis = basis::supported(&model, sizes::FIT.min(model.structure.size()));
        let basis = strain::enriched(&model, basis, &strains);
        Self { strains, ..Self::on(rotor, mesh, &model, basis) }
    }

    /// The same with every nodal coordinate for a shape function.
    pub fn unreduced(rotor: &Rotor) -> Self {
        let model = Model::finite_elements(rotor);
        let size = model.structure.size();
        let mesh = Mesh::new(rotor, elements_per_segment(rotor));
        Self::on(rotor, mesh, &model, DMatrix::identity(size, size))
    }

    fn on(rotor: &Rotor, mesh: Mesh, model: &Model, basis: DMatrix<f64>) -> Self {
        let physics = &rotor.physics;
        let sections = (0..mesh.nodes_m.len()).map(|node| section(rotor, physics, &mesh, node)).collect();
        let bend = |pattern| (pattern, half_sines(pattern, &model.structure, rotor));
        let bends = [Pattern::Bow, Pattern::FullBow].map(bend);
        Self { basis, bends, physics: *physics, mesh, sections, strains: Vec::new() }
    }

    /// Switches of the beam theory.
    pub fn physics(&self) -> &Physics {
        &self.physics
    }

    /// What each element is made of.
    pub fn pieces(&self) -> &[Piece] {
        &self.mesh.pieces
    }

    /// Every pattern that is a bent shaft, with the nodal coordinates of its shape at unit height.
    pub fn bends(&self) -> &[(Pattern, DVector<f64>)] {
        &self.bends
    }

    /// Nodal coordinates of the shape of a pattern, if it is a bent shaft.
    pub fn bent(&self, pattern: Pattern) -> Option<&DVector<f64>> {
        self.bends.iter().find(|(p, _)| *p == pattern.shape()).map(|(_, shape)| shape)
    }

    /// The node nearest to a position; marks of the rotor are nodes.
    pub fn section(&self, position_m: f64) -> &Section {
        let nodes_m = &self.mesh.nodes_m;
        let distance = |node: &usize| (nodes_m[*node] - position_m).abs();
        let node = (0..nodes_m.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        &self.sections[node.unwrap_or(0)]
    }

    pub fn end(&self, end: End) -> &Section {
        match end {
            End::Left => &self.sections[0],
            End::Right => &self.sections[self.sections.len() - 1],
        }
    }

    /// Matrices of one element of a rotor whose segments may differ from the drawing.
    pub fn element(&self, number: usize, rotor: &Rotor) -> Element {
        let mut e = self.mesh.element(number, rotor, &self.physics);
        if self.physics.formulation == Formulation::Printed2023 {
            // every response here is synchronous, so −Ω²N joins −Ω²M
            e.mass += e.tilt_inertia;
        }
        e
    }

    /// Diametral inertia of a disk counts as often as this in the mass.
    pub fn tilt_share(&self) -> f64 {
        if self.physics.formulation == Formulation::Printed2023 { 2.0 } else { 1.0 }
    }

    /// A sum over nodal coordinates as one over the columns of nodal shapes.
    pub fn along(row: &NodalSum, shapes: &DMatrix<f64>) -> DVector<f64> {
        DVector::from_fn(shapes.ncols(), |j, _| row.iter().map(|(k, v)| v * shapes[(*k, j)]).sum())
    }

    /// The force on the nodal coordinates that holds a shaft bent to this shape straight; its segments may differ from the
    /// drawing.
    pub fn straightening_force(&self, rotor: &Rotor, bent: &DVector<f64>) -> DVector<f64> {
        let mut force = DVector::zeros(bent.len());
        for i in 0..self.mesh.pieces.len() {
            let part = self.element(i, rotor).stiffness * bent.fixed_rows::<4>(2 * i);
            let mut rows = force.fixed_rows_mut::<4>(2 * i);
            rows += part;
        }
        force
    }

    /// Matrices of a rotor whose segments, disks and positions may differ from the drawing.
    pub fn matrices(&self, rotor: &Rotor, offsets: &Offsets) -> ShaftMatrices {
        let (rows, columns) = self.basis.shape();
        let zero = || DMatrix::zeros(rows, columns);
        let (mut stiffness, mut mass, mut polar) = (zero(), zero(), zero());
        for i in 0..self.mesh.pieces.len() {
            let e = self.element(i, rotor);
            let shapes = self.basis.fixed_rows::<4>(2 * i);
            for (whole, part) in
                [(&mut stiffness, e.stiffness), (&mut mass, e.mass), (&mut polar, e.polar_inertia)]
            {
                let mut block = whole.fixed_rows_mut::<4>(2 * i);
                block += part * shapes;
            }
        }
        let project = |m: DMatrix<f64>| self.basis.tr_mul(&m);
        let (stiffness, mut mass, mut polar_inertia) = (project(stiffness), project(mass), project(polar));
        for (i, lump) in lumps(rotor).enumerate() {
            let section = self.section(lump.position_m);
            // disks come first, and couplings have no offsets
            let offset_m = offsets.disk_m.get(i).copied().unwrap_or(0.0);
            let displacement = Self::along(&section.displacement_beside(offset_m), &self.basis);
            let tilt = Self::along(&section.tilt_beside(offset_m), &self.basis);
            mass.ger(lump.mass_kg, &displacement, &displacement, 1.0);
            mass.ger(lump.diametral_inertia_kg_m2 * self.tilt_share(), &tilt, &tilt, 1.0);
            if self.physics.gyroscopic {
                polar_inertia.ger(lump.polar_inertia_kg_m2, &tilt, &tilt, 1.0);
            }
        }
        ShaftMatrices { stiffness, mass, polar_inertia }
    }
}

/// A node as a place: how displacement and tilt change along the shaft is the mean of the elements on
/// either side, as a force or moment at the node makes the two differ. A coupling is no element to move along.
fn section(rotor: &Rotor, physics: &Physics, mesh: &Mesh, node: usize) -> Section {
    let shaft = |element: usize| match mesh.pieces.get(element) {
        Some(Piece::Segment(segment)) => Some((element, &rotor.shaft[*segment])),
        _ => None,
    };
    let sides: Vec<(usize, &Segment)> =
        [node.checked_sub(1), Some(node)].into_iter().flatten().filter_map(shaft).collect();
    let share = 1.0 / sides.len() as f64;
    let (mut displacement_rate, mut tilt_rate) = (vec![(2 * node + 1, 1.0)], Vec::new());
    for (e, segment) in sides {
        let l = mesh.length_m(e);
        let phi = shear_parameter(segment, l, physics);
        // β = (w₂ − w₁)/l − (ψ₁ + ψ₂)/2 splits into shear strain Φβ/(1 + Φ) and the bow of ψ
        let beta = [(2 * e, -1.0 / l), (2 * e + 1, -0.5), (2 * e + 2, 1.0 / l), (2 * e + 3, -0.5)];
        let towards = if e == node { 6.0 } else { -6.0 } / l;
        displacement_rate.extend(beta.map(|(k, v)| (k, share * v * phi / (1.0 + phi))));
        tilt_rate.extend(beta.map(|(k, v)| (k, share * v * towards / (1.0 + phi))));
        tilt_rate.extend([(2 * e + 1, -share / l), (2 * e + 3, share / l)]);
    }
    Section {
        displacement: vec![(2 * node, 1.0)],
        tilt: vec![(2 * node + 1, 1.0)],
        displacement_rate,
        tilt_rate,
    }
}

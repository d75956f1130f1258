//! How lengths of the shaft bend, for changes of their stiffness.
//!
//! The stiffness of an element of length l is the sum of two squares, of even bending `√(EI/l) (ψ₂ − ψ₁)` and of bending that
//! grows along it, `√(12EI/(l³(1 + Φ))) (w₂ − w₁ − l (ψ₁ + ψ₂)/2)`. A length of several elements has many such strains. Between
//! two loaded places the bending moment is nearly linear, so those of moments of degree 0, 1, … hold nearly all of its strain
//! energy: a factor f on its stiffness adds `(f − 1) Σ sᵢ sᵢᵀ` to that of the shaft, with sᵢ orthonormal combinations of strains.

use nalgebra::{DMatrix, DVector};

use crate::machine::drawing::{Physics, Rotor};
use crate::machine::place::{Place, STRAINS};
use crate::machine::span::Span;
use crate::model::Model;
use crate::reduction::basis::held_stiffness;
use crate::shaft::elements::{section, shear_parameter};
use crate::shaft::mesh::{Mesh, Piece};

/// Part of a shape, relative, that is rounding.
const DEPENDENT: f64 = 1e-6;

/// Strains of one length of shaft.
pub struct SpanStrain {
    /// A shape of the length, [`Place::Strain`].
    pub place: Place,
    /// The strain, √J per m and rad at the nodes: nodal coordinates and factors.
    pub row: Vec<(usize, f64)>,
}

/// Strains of one element: nodal rows of even and of growing bending, and those that a bending moment causes.
struct ElementStrain {
    rows: [[f64; 4]; 2],
    /// Per N·m of mean moment, and per N·m of its growth along the element.
    per_moment: [f64; 2],
}

fn element_strain(rotor: &Rotor, physics: &Physics, segment: usize, length_m: f64) -> ElementStrain {
    let (segment, l) = (&rotor.shaft[segment], length_m);
    let bending = segment.youngs_modulus_pa * section(segment).1;
    let even = (bending / l).sqrt();
    let growing = (12.0 * bending / (l.powi(3) * (1.0 + shear_parameter(segment, l, physics)))).sqrt();
    ElementStrain {
        rows: [[0.0, -even, 0.0, even], [-growing, -0.5 * l * growing, growing, -0.5 * l * growing]],
        per_moment: [even.recip(), -(l * growing).recip()],
    }
}

/// Strains of lengths of a rotor's shaft, [`STRAINS`] each.
pub fn of_spans(rotor: &Rotor, mesh: &Mesh, spans: &[Span]) -> Vec<SpanStrain> {
    spans.iter().flat_map(|span| of_span(rotor, mesh, *span)).collect()
}

fn of_span(rotor: &Rotor, mesh: &Mesh, span: Span) -> Vec<SpanStrain> {
    let mut elements: Vec<(usize, ElementStrain)> = Vec::new();
    for (number, piece) in mesh.pieces.iter().enumerate() {
        if let Piece::Segment(segment) = *piece
            && span.holds(mesh.middle_m(number))
        {
            let strain = element_strain(rotor, &rotor.physics, segment, mesh.length_m(number));
            elements.push((number, strain));
        }
    }
    let moment = |degree: usize, node: usize| {
        let along = (mesh.nodes_m[node] - span.from_m()) / span.length_m();
        (2.0 * along - 1.0).powi(degree as i32)
    };
    let caused = |degree: usize| {
        let each = elements.iter().flat_map(|(number, strain)| {
            let [left, right] = [moment(degree, *number), moment(degree, number + 1)];
            [0.5 * (left + right) * strain.per_moment[0], (right - left) * strain.per_moment[1]]
        });
        DVector::from_iterator(2 * elements.len(), each)
    };
    let mut shapes: Vec<DVector<f64>> = Vec::with_capacity(STRAINS);
    for degree in 0..STRAINS {
        let mut shape = caused(degree);
        let whole = shape.norm();
        for _ in 0..2 {
            for other in &shapes {
                shape.axpy(-other.dot(&shape), other, 1.0);
            }
        }
        // one element alone bends in two shapes
        let left = shape.norm();
        shapes.push(if left > DEPENDENT * whole { shape / left } else { shape * 0.0 });
    }
    let row = |shape: &DVector<f64>| {
        let factors = elements.iter().enumerate().flat_map(|(i, (number, strain))| {
            let [even, growing] = strain.rows;
            let of = |k: usize| shape[2 * i] * even[k] + shape[2 * i + 1] * growing[k];
            (0..4).map(move |k| (2 * number + k, of(k))).collect::<Vec<_>>()
        });
        factors.collect::<Vec<_>>()
    };
    let place = |(number, shape)| SpanStrain { place: Place::Strain(span, number), row: row(shape) };
    shapes.iter().enumerate().map(place).collect()
}

/// Shape functions with those added that the shaft bends into under each of these strains: modes of the shaft as drawn hold hardly
/// any of the kink at the ends of a length that is softer.
pub fn enriched(model: &Model, basis: DMatrix<f64>, strains: &[SpanStrain]) -> DMatrix<f64> {
    if strains.is_empty() {
        return basis;
    }
    let mass = &model.structure.mass;
    let Some(held) = held_stiffness(model).cholesky() else { return basis };
    let mut columns: Vec<DVector<f64>> = basis.column_iter().map(|c| c.into_owned()).collect();
    for strain in strains {
        let mut load = DVector::zeros(model.structure.size());
        strain.row.iter().for_each(|(k, v)| load[*k] += v);
        let mut shape = held.solve(&load);
        let size = |shape: &DVector<f64>| shape.dot(&(mass * shape)).max(0.0).sqrt();
        let whole = size(&shape);
        for _ in 0..2 {
            for column in &columns {
                shape.axpy(-column.dot(&(mass * &shape)), column, 1.0);
            }
        }
        let left = size(&shape);
        if left > DEPENDENT * whole {
            columns.push(shape / left);
        }
    }
    DMatrix::from_columns(&columns)
}

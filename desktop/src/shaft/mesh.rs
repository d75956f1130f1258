//! Where the shaft is cut into finite elements, and what each of them is made of.

use crate::machine::drawing::{Coupling, Physics, Rotor, Segment};
use crate::machine::span::{self, Span};
use crate::shaft::elements::{Element, element, joint};
use crate::units::{SAME_NODE_M, same_place};

/// What joins a node to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Piece {
    /// A length of shaft, by the number of its segment.
    Segment(usize),
    /// A flexible coupling, by its number; its two nodes are at one place.
    Coupling(usize),
}

/// Nodes from left to right, and the pieces between them.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// Distance of each node from the left end, m; a flexible coupling has two nodes at its place.
    pub nodes_m: Vec<f64>,
    /// What joins each node to the next.
    pub pieces: Vec<Piece>,
}

impl Mesh {
    /// A node at every mark, at every end of a segment, on both sides of a flexible coupling and at both ends of a length
    /// whose stiffness an effect changes, and no element longer than its segment's length over `per_segment`.
    pub fn new(rotor: &Rotor, per_segment: usize) -> Self {
        Self::with_ends(rotor, per_segment, &[])
    }

    /// The same with nodes at both ends of further lengths.
    pub fn with_ends(rotor: &Rotor, per_segment: usize, spans: &[Span]) -> Self {
        let mut marks = rotor.marks_m();
        let stated = span::stated(rotor).map(|(span, _)| span);
        for end_m in stated.chain(spans.iter().copied()).flat_map(|span| [span.from_m(), span.to_m()]) {
            if !marks.iter().any(|mark| same_place(*mark, end_m)) {
                marks.push(end_m);
            }
        }
        marks.sort_by(f64::total_cmp);
        let mut mesh = Self { nodes_m: vec![0.0], pieces: Vec::new() };
        let mut left = 0.0;
        for (number, segment) in rotor.shaft.iter().enumerate() {
            let right = left + segment.length_m;
            let longest = segment.length_m / per_segment as f64;
            let mut from = left;
            let inside =
                marks.iter().copied().filter(|m| *m > left + SAME_NODE_M && *m < right - SAME_NODE_M);
            for to in inside.chain([right]) {
                let count = ((to - from) / longest - 1e-9).ceil().max(1.0) as usize;
                mesh.nodes_m.extend((1..=count).map(|k| from + (to - from) * k as f64 / count as f64));
                mesh.pieces.resize(mesh.nodes_m.len() - 1, Piece::Segment(number));
                from = to;
            }
            let here = |c: &Coupling| c.flexibility.is_some() && same_place(c.position_m, right);
            if number + 1 < rotor.shaft.len()
                && let Some(coupling) = rotor.coupling.iter().position(here)
            {
                mesh.nodes_m.push(right);
                mesh.pieces.push(Piece::Coupling(coupling));
            }
            left = right;
        }
        mesh
    }

    /// Matrices of one piece of a rotor that has this mesh; its segments may differ from those that it was made for.
    pub fn element(&self, number: usize, rotor: &Rotor, physics: &Physics) -> Element {
        match self.pieces[number] {
            Piece::Segment(segment) => element(&rotor.shaft[segment], self.length_m(number), physics),
            Piece::Coupling(coupling) => joint(&rotor.coupling[coupling], physics),
        }
    }

    /// Matrices of one piece as the rotor's effects leave it: its bending and shear stiffness changed, its mass as drawn.
    pub fn element_with_effects(&self, number: usize, rotor: &Rotor, physics: &Physics) -> Element {
        match self.pieces[number] {
            Piece::Segment(segment) => {
                let drawn = rotor.shaft[segment];
                let factor = span::stiffness_factor(rotor, self.middle_m(number));
                let changed = Segment { youngs_modulus_pa: factor * drawn.youngs_modulus_pa, ..drawn };
                element(&changed, self.length_m(number), physics)
            }
            Piece::Coupling(_) => self.element(number, rotor, physics),
        }
    }

    /// Middle of one piece, m from the left end.
    pub fn middle_m(&self, number: usize) -> f64 {
        0.5 * (self.nodes_m[number] + self.nodes_m[number + 1])
    }

    /// Length of one piece, m; zero for a coupling.
    pub fn length_m(&self, number: usize) -> f64 {
        self.nodes_m[number + 1] - self.nodes_m[number]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shaft::structure::ELEMENTS_PER_SEGMENT;
    use crate::testing::train;

    #[test]
    fn flexible_coupling_has_two_nodes_and_rigid_one_has_one() {
        let mut rotor = train();
        let place = rotor.coupling[0].position_m;
        let there = |mesh: &Mesh| mesh.nodes_m.iter().filter(|z| (**z - place).abs() < 1e-9).count();
        let flexible = Mesh::new(&rotor, ELEMENTS_PER_SEGMENT);
        assert_eq!(there(&flexible), 2);
        let at = flexible.pieces.iter().position(|p| *p == Piece::Coupling(0)).unwrap();
        assert_eq!(flexible.length_m(at), 0.0);
        rotor.coupling[0].flexibility = None;
        let rigid = Mesh::new(&rotor, ELEMENTS_PER_SEGMENT);
        assert_eq!(there(&rigid), 1);
        assert_eq!(rigid.nodes_m.len() + 1, flexible.nodes_m.len());
    }
}

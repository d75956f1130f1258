//! All finite elements of the shaft, as a chain of nodes.
//!
//! A node has four coordinates (displacement and slope in x and in y) and is joined to its neighbours only, so the
//! dynamic stiffness has a narrow band and one solution costs a few hundred operations a node, at any complex λ.
//! Forced responses come from it, and modes of the reduced system become exact on the mesh at hardly any cost.

use nalgebra::{Complex, DMatrix, DVector, Matrix2, Matrix4, Vector2, Vector4};

use super::Model;
use super::banded::{Banded, BandedLu};
use crate::bearing::support::{Dampers, SupportLaw};
use crate::decomposition::eigen::{MatrixFunction, NewtonLimits, newton};

type C = Complex<f64>;

/// Entries next to the diagonal of two nodes of four coordinates each.
const HALF_WIDTH: usize = 7;

/// Motion or force of each node: displacement and slope in x, displacement and slope in y.
pub type Nodes = Vec<Vector4<C>>;

/// The shaft and what holds it.
pub struct ElementChain {
    /// Stiffness, mass, polar inertia and the N of `−Ω²N`, of each node with itself and with the next one.
    own: Vec<[Matrix2<f64>; 4]>,
    next: Vec<[Matrix2<f64>; 4]>,
    supports: Vec<(usize, SupportLaw)>,
    internal_damping_s: f64,
}

/// A block tridiagonal matrix.
pub struct BlockTridiagonal {
    own: Vec<Matrix4<C>>,
    /// From each node to the next, and back.
    next: Vec<Matrix4<C>>,
    back: Vec<Matrix4<C>>,
}

impl ElementChain {
    /// The chain of a model on finite elements, if it is one: no support may sit elsewhere than at a node. With
    /// `printed`, `−Ω²N` is added to the stiffness.
    pub fn new(model: &Model, printed: bool) -> Option<Self> {
        let s = &model.structure;
        if !s.is_chain {
            return None;
        }
        let nodes = s.stations.len();
        let block = |i: usize, j: usize| {
            let view = |m: &DMatrix<f64>| m.fixed_view::<2, 2>(2 * i, 2 * j).into_owned();
            let tilt = if printed { view(&s.tilt_inertia) } else { Matrix2::zeros() };
            [view(&s.stiffness), view(&s.mass), view(&s.polar_inertia), tilt]
        };
        let mut supports = Vec::new();
        for support in &model.supports {
            let node = support.shape.iter().position(|v| *v == 1.0)?;
            if !node.is_multiple_of(2) || support.shape.norm_squared() != 1.0 {
                return None;
            }
            supports.push((node / 2, support.law.clone()));
        }
        Some(Self {
            own: (0..nodes).map(|i| block(i, i)).collect(),
            next: (1..nodes).map(|i| block(i - 1, i)).collect(),
            supports,
            internal_damping_s: model.internal_damping_s,
        })
    }

    /// Share of a motion that turns with the rotation, y = −ix, by kinetic energy.
    pub fn forward_share(&self, motion: &Nodes) -> f64 {
        let energy = |sense: f64| {
            let turning: Vec<Vector2<C>> = motion
                .iter()
                .map(|v| {
                    let turned = C::new(0.0, sense);
                    Vector2::new(v[0] + turned * v[2], v[1] + turned * v[3])
                })
                .collect();
            let mut sum = 0.0;
            for (i, here) in turning.iter().enumerate() {
                sum += here.dotc(&(self.own[i][1].map(C::from) * here)).re;
                if let (Some(join), Some(next)) = (self.next.get(i), turning.get(i + 1)) {
                    sum += 2.0 * here.dotc(&(join[1].map(C::from) * next)).re;
                }
            }
            let added = self.supports.iter().map(|(node, law)| law.mass_kg * turning[*node][0].norm_sqr());
            sum + added.sum::<f64>()
        };
        let (forward, backward) = (energy(1.0), energy(-1.0));
        forward / (forward + backward)
    }

    /// Dynamic stiffness for motion `e^{λt}` at a speed of rotation, with supports at rest.
    pub fn at(&self, lambda: C, speed_rad_s: f64, dampers: Dampers) -> BlockTridiagonal {
        let mut chain = self.shaft(lambda, speed_rad_s, dampers);
        for (node, law) in &self.supports {
            chain.hold(*node, &law.held(lambda, speed_rad_s, [0.0; 2], dampers));
        }
        chain
    }

    /// Node of each support of the model.
    pub fn nodes(&self) -> impl Iterator<Item = usize> {
        self.supports.iter().map(|(node, _)| *node)
    }

    /// The same of the free shaft.
    pub fn shaft(&self, lambda: C, speed_rad_s: f64, dampers: Dampers) -> BlockTridiagonal {
        let internal = if dampers == Dampers::In { self.internal_damping_s } else { 0.0 };
        let whole = |[k, m, g, n]: &[Matrix2<f64>; 4]| {
            let direct = k.map(C::from) * (C::from(1.0) + lambda * internal)
                + m.map(C::from) * (lambda * lambda)
                - n.map(|v| C::from(v * speed_rad_s * speed_rad_s));
            let cross =
                g.map(C::from) * (lambda * speed_rad_s) + k.map(|v| C::from(v * internal * speed_rad_s));
            let mut all = Matrix4::zeros();
            all.fixed_view_mut::<2, 2>(0, 0).copy_from(&direct);
            all.fixed_view_mut::<2, 2>(2, 2).copy_from(&direct);
            all.fixed_view_mut::<2, 2>(0, 2).copy_from(&cross);
            all.fixed_view_mut::<2, 2>(2, 0).copy_from(&-cross);
            all
        };
        let transposed = |part: &[Matrix2<f64>; 4]| whole(&part.map(|m| m.transpose()));
        BlockTridiagonal {
            own: self.own.iter().map(whole).collect(),
            next: self.next.iter().map(whole).collect(),
            back: self.next.iter().map(transposed).collect(),
        }
    }
}

impl BlockTridiagonal {
    /// The chain times a motion.
    pub fn times(&self, motion: &Nodes) -> Nodes {
        let one = |i: usize| {
            let mut force = self.own[i] * motion[i];
            if i > 0 {
                force += self.back[i - 1] * motion[i - 1];
            }
            if i < self.next.len() {
                force += self.next[i] * motion[i + 1];
            }
            force
        };
        (0..motion.len()).map(one).collect()
    }

    /// Adds what holds a node in x and y.
    pub fn hold(&mut self, node: usize, stiffness: &Matrix2<C>) {
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            self.own[node][(2 * i, 2 * j)] += stiffness[(i, j)];
        }
    }

    /// LU factors, four rows a node; `None` if the chain is singular.
    pub fn factor(&self) -> Option<BandedLu> {
        let mut banded = Banded::zeros(4 * self.own.len(), HALF_WIDTH);
        let mut add = |from: usize, to: usize, block: &Matrix4<C>| {
            for column in 0..4 {
                for row in 0..4 {
                    banded.add(4 * from + row, 4 * to + column, block[(row, column)]);
                }
            }
        };
        for (i, own) in self.own.iter().enumerate() {
            add(i, i, own);
        }
        for (i, (next, back)) in self.next.iter().zip(&self.back).enumerate() {
            add(i, i + 1, next);
            add(i + 1, i, back);
        }
        banded.factor()
    }

    /// The motion under a force; `None` if the chain is singular.
    pub fn solve(&self, force: &Nodes) -> Option<Nodes> {
        let mut motion = DMatrix::from_fn(4 * force.len(), 1, |row, _| force[row / 4][row % 4]);
        self.factor()?.solve(&mut motion);
        let motion: Nodes = motion.as_slice().chunks_exact(4).map(Vector4::from_column_slice).collect();
        motion.iter().all(|v| v.iter().all(|c| c.is_finite())).then_some(motion)
    }
}

/// A chain at each λ.
struct ChainFunction<F>(F);

impl<F: Fn(C) -> BlockTridiagonal> MatrixFunction for ChainFunction<F> {
    /// A central difference, which is exact for a quadratic.
    fn slope(&self, lambda: C, v: &DVector<C>) -> DVector<C> {
        const DIFFERENCE: f64 = 1e-3;
        let (h, motion) = (lambda * DIFFERENCE, nodes(v));
        let (up, down) = ((self.0)(lambda + h).times(&motion), (self.0)(lambda - h).times(&motion));
        flat(&up.iter().zip(&down).map(|(u, d)| (u - d) / (h * 2.0)).collect())
    }

    fn solve(&self, lambda: C, f: &DVector<C>) -> Option<DVector<C>> {
        (self.0)(lambda).solve(&nodes(f)).map(|motion| flat(&motion))
    }
}

fn flat(nodes: &Nodes) -> DVector<C> {
    DVector::from_iterator(4 * nodes.len(), nodes.iter().flat_map(|v| v.iter().copied()))
}

fn nodes(flat: &DVector<C>) -> Nodes {
    flat.as_slice().chunks_exact(4).map(Vector4::from_column_slice).collect()
}

/// An eigenpair of `T(λ)`, a chain at each λ, next to a guess of both.
pub fn eigenpair(at: impl Fn(C) -> BlockTridiagonal, guess: C, start: &Nodes) -> Option<(C, Nodes)> {
    const LIMITS: NewtonLimits = NewtonLimits { settled: 1e-8, farthest: 0.05, near: true };
    let found = newton(&ChainFunction(at), guess, &flat(start), &LIMITS)?;
    found.settled.then(|| (found.value, nodes(&found.vector)))
}

#[cfg(test)]
mod tests {
    use crate::bearing::foundation::{Compliance, Footing, FoundationMode};
    use crate::model::Model;
    use crate::rotor_file;

    /// Two bearings on two modes that join them.
    fn footing() -> Footing {
        let mode = |frequency_hz, x: [f64; 2], y: [f64; 2]| FoundationMode {
            frequency_hz,
            damping_ratio: 0.03,
            modal_mass_kg: 300.0,
            x: x.to_vec(),
            y: y.to_vec(),
        };
        let modes = vec![mode(40.0, [1.0, 0.6], [0.2, -0.1]), mode(70.0, [-0.3, 0.4], [1.0, 0.8])];
        Footing { bearings: vec![0, 1], compliance: Compliance::Modes(modes) }
    }

    #[test]
    fn motion_on_the_chain_equals_the_dense_equations() {
        let reference = format!("{}/../tests/reference", env!("CARGO_MANIFEST_DIR"));
        for name in [
            "rotors/kit",
            "rotors/turbine",
            "rotors/overhung",
            "check/four_bearing_train",
            "check/coupled_train",
        ] {
            let rotor = rotor_file::read(format!("{reference}/{name}.toml").as_ref()).unwrap();
            let mut model = Model::finite_elements(&rotor);
            model.internal_damping_s = 1e-5;
            assert!(model.structure.is_chain, "{name}");
            let at_rest = vec![[0.0; 2]; model.supports.len()];
            for (foundation, speed_rad_s) in [
                (None, 40.0),
                (None, 333.0),
                (None, 1200.0),
                (Some(footing()), 40.0),
                (Some(footing()), 333.0),
            ] {
                model.foundation = foundation;
                let mut dense = model.clone();
                dense.structure.is_chain = false;
                let expected = dense.motion(speed_rad_s, &at_rest).unwrap();
                let difference =
                    (model.motion(speed_rad_s, &at_rest).unwrap() - &expected).norm() / expected.norm();
                assert!(difference < 1e-9, "{name} at {speed_rad_s} rad/s: {difference:e}");
            }
        }
    }
}

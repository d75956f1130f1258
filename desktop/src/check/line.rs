//! All finite elements of the shaft, as a chain of nodes.
//!
//! A node has four coordinates (displacement and slope in x and in y) and is joined to its neighbours only, so the
//! dynamic stiffness is block tridiagonal and one solution costs a few hundred operations a node, at any complex λ.
//! That makes modes and responses of the reduced system exact on the mesh at hardly any cost.

use nalgebra::{Complex, Matrix2, Matrix4, Vector2, Vector4};

use crate::bearing::pair::Pair;
use crate::bearing::support::SupportLaw;
use crate::model::Model;

type C = Complex<f64>;

/// Motion or force of each node: displacement and slope in x, displacement and slope in y.
pub type Nodes = Vec<Vector4<C>>;

/// How the chain is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dampers {
    In,
    /// Without dampers and without what does work on a closed orbit.
    Out,
}

/// The shaft and what holds it.
pub struct Line {
    /// Stiffness, mass, polar inertia and the N of `−Ω²N`, of each node with itself and with the next one.
    own: Vec<[Matrix2<f64>; 4]>,
    next: Vec<[Matrix2<f64>; 4]>,
    supports: Vec<(usize, SupportLaw)>,
    internal_damping_s: f64,
}

/// A block tridiagonal matrix.
pub struct Chain {
    own: Vec<Matrix4<C>>,
    /// From each node to the next, and back.
    next: Vec<Matrix4<C>>,
    back: Vec<Matrix4<C>>,
}

impl Line {
    /// The chain of a model on finite elements, if it is one: no support may sit elsewhere than at a node. With
    /// `printed`, `−Ω²N` is added to the stiffness.
    pub fn new(model: &Model, printed: bool) -> Option<Self> {
        let s = &model.structure;
        let nodes = s.stations.len();
        if s.size() != 2 * nodes {
            return None;
        }
        let block = |i: usize, j: usize| {
            let view = |m: &nalgebra::DMatrix<f64>| m.fixed_view::<2, 2>(2 * i, 2 * j).into_owned();
            let tilt = if printed { view(&s.tilt_inertia) } else { Matrix2::zeros() };
            [view(&s.stiffness), view(&s.mass), view(&s.polar_inertia), tilt]
        };
        let far = (0..nodes).any(|i| {
            let from = 2 * (i + 2).min(nodes);
            s.stiffness.view((2 * i, from), (2, 2 * nodes - from)).amax() != 0.0
        });
        let mut supports = Vec::new();
        for support in &model.supports {
            let node = support.shape.iter().position(|v| *v == 1.0)?;
            if !node.is_multiple_of(2) || support.shape.norm_squared() != 1.0 {
                return None;
            }
            supports.push((node / 2, support.law.clone()));
        }
        (!far).then(|| Self {
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

    /// Dynamic stiffness for motion `e^{λt}` at a speed of rotation.
    pub fn at(&self, lambda: C, speed_rad_s: f64, dampers: Dampers) -> Chain {
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
        let mut own: Vec<Matrix4<C>> = self.own.iter().map(whole).collect();
        for (node, law) in &self.supports {
            let held = support(law, lambda, speed_rad_s, dampers);
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                own[*node][(2 * i, 2 * j)] += held[(i, j)];
            }
        }
        Chain {
            own,
            next: self.next.iter().map(whole).collect(),
            back: self.next.iter().map(transposed).collect(),
        }
    }
}

/// Force per motion `e^{λt}` of a support.
fn support(law: &SupportLaw, lambda: C, speed_rad_s: f64, dampers: Dampers) -> Matrix2<C> {
    let Pair { stiffness: mut k, damping: mut c } = law.coefficients(speed_rad_s);
    let mut grounded = law.pedestal;
    if dampers == Dampers::Out {
        (k, c) = ((k + k.transpose()) * 0.5, Matrix2::zeros());
        grounded.iter_mut().for_each(|p| p.damping_n_s_m = [0.0; 2]);
    }
    let bearing = k.map(C::from) + c.map(C::from) * lambda;
    let held = grounded.map_or(bearing, |p| {
        let along = |axis: usize| {
            C::from(p.stiffness_n_m[axis])
                + lambda * p.damping_n_s_m[axis]
                + lambda * lambda * p.mass_kg[axis]
        };
        let foot = Matrix2::new(along(0), C::from(0.0), C::from(0.0), along(1));
        let sum = bearing + foot;
        let determinant = sum[(0, 0)] * sum[(1, 1)] - sum[(0, 1)] * sum[(1, 0)];
        let adjugate = Matrix2::new(sum[(1, 1)], -sum[(0, 1)], -sum[(1, 0)], sum[(0, 0)]);
        foot * adjugate * bearing / determinant
    });
    held + Matrix2::identity() * (lambda * lambda * law.mass_kg)
}

impl Chain {
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

    /// The motion under a force; `None` if the chain is singular.
    pub fn solve(&self, force: &Nodes) -> Option<Nodes> {
        let mut inverses: Vec<Matrix4<C>> = Vec::with_capacity(self.own.len());
        let mut reduced: Nodes = Vec::with_capacity(force.len());
        for (i, f) in force.iter().enumerate() {
            let (mut own, mut f) = (self.own[i], *f);
            if i > 0 {
                let carried = self.back[i - 1] * inverses[i - 1];
                own -= carried * self.next[i - 1];
                f -= carried * reduced[i - 1];
            }
            inverses.push(own.try_inverse()?);
            reduced.push(f);
        }
        let mut motion = reduced;
        for i in (0..motion.len()).rev() {
            let mut f = motion[i];
            if i + 1 < motion.len() {
                f -= self.next[i] * motion[i + 1];
            }
            motion[i] = inverses[i] * f;
        }
        motion.iter().all(|v| v.iter().all(|c| c.is_finite())).then_some(motion)
    }
}

/// `aᴴ b` over all nodes.
pub fn inner(a: &Nodes, b: &Nodes) -> C {
    a.iter().zip(b).map(|(a, b)| a.dotc(b)).sum()
}

/// An eigenpair of `T(λ)`, a chain at each λ, next to a guess, by Newton's method; a central difference
/// stands for dT/dλ, which is exact for a quadratic.
pub fn eigenpair(at: impl Fn(C) -> Chain, guess: C, start: Nodes) -> Option<(C, Nodes)> {
    const ROUNDS: usize = 12;
    const SETTLED: f64 = 1e-8;
    const DIFFERENCE: f64 = 1e-3;
    const FARTHEST: f64 = 0.05;
    let norm = |v: &Nodes| inner(v, v).re.sqrt();
    let (mut value, mut shape) = (guess, start);
    for _ in 0..ROUNDS {
        let h = value * DIFFERENCE;
        let (up, down) = (at(value + h).times(&shape), at(value - h).times(&shape));
        let slope: Nodes = up.iter().zip(&down).map(|(u, d)| (u - d) / (h * 2.0)).collect();
        let next = at(value).solve(&slope)?;
        let step = inner(&shape, &shape) / inner(&shape, &next);
        let size = norm(&next);
        shape = next.iter().map(|v| v.unscale(size)).collect();
        value -= step;
        if !value.is_finite() || (value - guess).norm() > FARTHEST * guess.norm() {
            return None;
        }
        if step.norm() < SETTLED * value.norm() {
            return Some((value, shape));
        }
    }
    None
}

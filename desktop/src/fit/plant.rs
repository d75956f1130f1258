//! The shaft on nominal springs, solved once for all speeds.
//!
//! Shaft and disks are isotropic, so forward whirl (x + iy) and backward whirl (x − iy) decouple, and
//! for synchronous motion each is a symmetric pencil `K + k₀ − Ω² (M ∓ G)` whose eigenvectors do not
//! depend on speed. One eigendecomposition a sense, and every receptance at every speed is a sum over
//! modes. Damping inside the shaft changes only the backward sense, by the factor `1 + 2iΩη` on the
//! stiffness, and keeps the same modes.

use nalgebra::{Complex, DMatrix, DVector, SymmetricEigen};

use super::tolerance::Offsets;
use crate::effects::Pattern;
use crate::error::Error;
use crate::machine::force_shape;
use crate::rotor::Rotor;
use crate::structure::Structure;

type C = Complex<f64>;

/// Columns of forces that turn with the shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Force {
    /// Unbalance at this position, kg·m.
    UnbalanceAt(f64),
    /// One of the patterns of an effect.
    Pattern(Pattern),
}

/// Participation of each mode in the motion of places and under forces; rows places, columns modes.
struct Sense {
    /// 1/Ω² of each mode: the receptance has the factor `1/(1 − Ω² μ)`.
    mu: DVector<f64>,
    held: DMatrix<f64>,
    probes: DMatrix<f64>,
    forces: DMatrix<f64>,
}

/// A shaft with its disks on nominal springs at the bearings.
pub struct Plant {
    /// Nominal spring at each bearing, N/m.
    pub nominal_n_m: f64,
    forces: Vec<Force>,
    probe_angles_rad: Vec<f64>,
    bearings: usize,
    forward: Sense,
    backward: Sense,
}

/// Receptances at one speed. Held places are bearings, then disks.
#[derive(Debug, Clone)]
pub struct Tables {
    /// Speed of rotation, rad/s.
    pub speed_rad_s: f64,
    /// Nominal spring in forward and in backward coordinates, N/m.
    pub nominal: [C; 2],
    /// Whether a held place has a nominal spring: bearings only.
    pub bearings: usize,
    /// Held × held, forward.
    pub held_forward: DMatrix<C>,
    /// Held × held, backward.
    pub held_backward: DMatrix<C>,
    /// Held × forces, forward.
    pub held_force: DMatrix<C>,
    /// Probes × held, reading included, forward.
    pub probe_forward: DMatrix<C>,
    /// Probes × held, reading included, backward.
    pub probe_backward: DMatrix<C>,
    /// Probes × forces, reading included.
    pub probe_force: DMatrix<C>,
}

/// Every force column that some effect or run of this rotor can use.
pub fn all_forces(rotor: &Rotor) -> Vec<Force> {
    let mut forces: Vec<Force> = rotor.plane.iter().map(|p| Force::UnbalanceAt(p.position_m)).collect();
    for added in rotor.run.iter().flat_map(|r| &r.added_unbalance) {
        let force = Force::UnbalanceAt(added.position_m);
        if !forces.contains(&force) {
            forces.push(force);
        }
    }
    for i in 0..rotor.disk.len() {
        forces.push(Force::Pattern(Pattern::DiskUnbalance(i)));
        forces.push(Force::Pattern(Pattern::DiskTilt(i)));
    }
    forces.extend([Force::Pattern(Pattern::Bow), Force::Pattern(Pattern::RightEnd)]);
    forces
}

impl Plant {
    /// Solves the shaft on springs `nominal_n_m` at its bearings.
    ///
    /// # Errors
    /// If the shaft on its springs is not stable, which a checked rotor rules out.
    pub fn new(
        rotor: &Rotor,
        full: &Structure,
        basis: &DMatrix<f64>,
        offsets: &Offsets,
        nominal_n_m: f64,
    ) -> Result<Self, Error> {
        let structure = full.projected(basis);
        let near = |z: f64, offset_m: f64| structure.near(z, offset_m);
        let offset = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(0.0);
        let bearings: Vec<_> = (rotor.bearing.iter().enumerate())
            .map(|(i, b)| near(b.position_m, offset(&offsets.bearing_m, i)))
            .collect();
        let disks =
            (rotor.disk.iter().enumerate()).map(|(i, d)| near(d.position_m, offset(&offsets.disk_m, i)));
        let held: Vec<_> = bearings.iter().cloned().chain(disks).collect();
        let probes: Vec<_> = (rotor.probe.iter().enumerate())
            .map(|(i, p)| near(p.position_m, offset(&offsets.probe_m, i)))
            .collect();
        let forces = all_forces(rotor);
        let patterns: Vec<_> = forces
            .iter()
            .map(|f| match f {
                Force::UnbalanceAt(z) => {
                    let plane = rotor.plane.iter().position(|p| p.position_m == *z);
                    near(*z, plane.map_or(0.0, |i| offset(&offsets.plane_m, i)))
                }
                Force::Pattern(p) => force_shape(*p, full, rotor)
                    .map_or_else(|| DVector::zeros(structure.size()), |shape| basis.tr_mul(&shape)),
            })
            .collect();
        let mut stiffness = structure.stiffness.clone();
        for shape in &bearings {
            stiffness.ger(nominal_n_m, shape, shape, 1.0);
        }
        let factor = stiffness
            .cholesky()
            .ok_or_else(|| Error::Unsuitable("the shaft on its bearings has no positive stiffness".into()))?
            .l();
        let solve =
            |m: &DMatrix<f64>| factor.solve_lower_triangular(m).expect("a Cholesky factor is regular");
        let sense = |sign: f64| {
            let inertia = &structure.mass - &structure.polar_inertia * sign;
            let whole = solve(&solve(&inertia).transpose());
            let eigen = SymmetricEigen::new((&whole + whole.transpose()) * 0.5);
            let participation = |shapes: &[DVector<f64>]| match shapes {
                [] => DMatrix::zeros(0, eigen.eigenvalues.len()),
                _ => solve(&DMatrix::from_columns(shapes)).tr_mul(&eigen.eigenvectors),
            };
            Sense {
                held: participation(&held),
                probes: participation(&probes),
                forces: participation(&patterns),
                mu: eigen.eigenvalues.clone(),
            }
        };
        Ok(Self {
            nominal_n_m,
            probe_angles_rad: rotor.probe.iter().map(|p| p.angle_deg.to_radians()).collect(),
            bearings: bearings.len(),
            forward: sense(1.0),
            backward: sense(-1.0),
            forces,
        })
    }

    /// Number of the column of a force.
    pub fn column(&self, force: Force) -> usize {
        self.forces.iter().position(|f| *f == force).expect("all_forces lists every force of the rotor")
    }

    /// Receptances at one speed, with viscous damping `η K` inside the shaft.
    pub fn tables(&self, speed_rad_s: f64, internal_damping_s: f64) -> Tables {
        let w2 = speed_rad_s * speed_rad_s;
        let loss = C::new(1.0, 2.0 * speed_rad_s * internal_damping_s);
        // a speed that hits a critical of the shaft on its nominal springs to ten digits is moved off it
        let gain = |stiffness: C, mu: f64| {
            let denominator = stiffness - w2 * mu;
            if denominator.norm() < 1e-10 { C::from(1e10) } else { denominator.inv() }
        };
        let weigh = |m: &DMatrix<f64>, mu: &DVector<f64>, stiffness: C| {
            DMatrix::from_fn(m.nrows(), m.ncols(), |i, k| gain(stiffness, mu[k]) * m[(i, k)])
        };
        let one = C::from(1.0);
        let product = |a: &DMatrix<C>, b: &DMatrix<f64>| {
            DMatrix::from_fn(a.nrows(), b.nrows(), |i, j| {
                (0..a.ncols()).map(|k| a[(i, k)] * b[(j, k)]).sum::<C>()
            })
        };
        let held_weighed = weigh(&self.forward.held, &self.forward.mu, one);
        let probes_weighed = weigh(&self.forward.probes, &self.forward.mu, one);
        let held_backward = weigh(&self.backward.held, &self.backward.mu, loss);
        let probes_backward = weigh(&self.backward.probes, &self.backward.mu, loss);
        let mut tables = Tables {
            speed_rad_s,
            nominal: [C::from(self.nominal_n_m), loss * self.nominal_n_m],
            bearings: self.bearings,
            held_forward: product(&held_weighed, &self.forward.held),
            held_backward: product(&held_backward, &self.backward.held),
            held_force: product(&held_weighed, &self.forward.forces),
            probe_forward: product(&probes_weighed, &self.forward.held),
            probe_backward: product(&probes_backward, &self.backward.held),
            probe_force: product(&probes_weighed, &self.forward.forces),
        };
        for (p, angle) in self.probe_angles_rad.iter().enumerate() {
            // x cos + y sin with x = f + b, y = −i (f − b)
            let turn = C::from_polar(1.0, -angle);
            tables.probe_forward.row_mut(p).iter_mut().for_each(|v| *v *= turn);
            tables.probe_force.row_mut(p).iter_mut().for_each(|v| *v *= turn);
            tables.probe_backward.row_mut(p).iter_mut().for_each(|v| *v *= turn.conj());
        }
        tables
    }
}

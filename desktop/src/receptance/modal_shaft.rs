//! The shaft on nominal springs, solved once for all speeds.
//!
//! Shaft and disks are isotropic, so forward whirl (x + iy) and backward whirl (x − iy) decouple, and
//! for synchronous motion each is a symmetric pencil `K + k₀ − Ω² (M ∓ G)` whose eigenvectors do not
//! depend on speed. One eigendecomposition a sense, and every receptance at every speed is a sum over
//! modes. Damping inside the shaft changes only the backward sense, by the factor `1 + 2iΩη` on the
//! stiffness, and keeps the same modes.
//!
//! On its nominal springs the shaft has no damping. At a speed next to one of its critical speeds, with `1 − Ω² μ = d`, its
//! receptances are of the size 1/d, and what the actual supports leave of them has lost the digits of 1/d². So the springs are chosen such
//! that the speeds of interest keep clear of the critical speeds.

use nalgebra::{Complex, DMatrix, DVector};

use crate::decomposition::eigen::DefinitePencil;
use crate::effects::{End, Pattern, Place};
use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::machine::tolerance::Offsets;
use crate::model::force::{LoadedSection, LoadedShaft, generalised_force};
use crate::reduction::nodal::{NodalSum, Section, Shaft};

type C = Complex<f64>;

/// Nominal springs that are tried, as multiples of what the bearings have: on stiff bearings the modes hardly follow the springs
/// until those are soft.
const SPRINGS: [f64; 7] = [1.0, 0.5, 2.0, 0.2, 0.1, 0.03, 0.01];
/// Least `|1 − Ω² μ|` that is clear of a critical speed: six of sixteen digits are lost there.
const CLEAR: f64 = 1e-3;

/// Columns of forces that turn with the shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Force {
    /// Unbalance at this position, kg·m.
    UnbalanceAt(f64),
    /// One of the patterns of an effect.
    Pattern(Pattern),
}

/// Modes of one sense of whirl, normalised to unit stiffness, with their participation in the motion of places and in
/// forces: one row a mode.
pub struct WhirlModes {
    /// 1/Ω² of each mode: the receptance has the factor `1/(1 − Ω² μ)`.
    pub mu: Vec<f64>,
    /// Nodal coordinates × modes.
    pub shapes: DMatrix<f64>,
    /// Of bearings, then disks, then strains of lengths of the shaft.
    pub held: DMatrix<f64>,
    /// Of probes, their direction left out.
    pub probes: DMatrix<f64>,
    pub forces: DMatrix<f64>,
}

/// What places, probes and forces are to a shaft: nodal coordinates and factors.
struct Participants {
    held: Vec<NodalSum>,
    probes: Vec<NodalSum>,
    forces: Vec<NodalSum>,
}

impl WhirlModes {
    /// From the inertia in this sense of whirl and the Cholesky factor of the stiffness.
    fn new(
        shaft: &Shaft,
        inertia: &DMatrix<f64>,
        stiffness_factor: &DMatrix<f64>,
        all: &Participants,
    ) -> Self {
        let pencil = DefinitePencil::new(inertia, stiffness_factor);
        let shapes = &shaft.basis * pencil.vectors();
        let participation = |rows: &[NodalSum]| {
            let columns: Vec<DVector<f64>> = rows.iter().map(|row| Shaft::along(row, &shapes)).collect();
            if columns.is_empty() {
                DMatrix::zeros(shapes.ncols(), 0)
            } else {
                DMatrix::from_columns(&columns)
            }
        };
        Self {
            held: participation(&all.held),
            probes: participation(&all.probes),
            forces: participation(&all.forces),
            mu: pencil.values.iter().copied().collect(),
            shapes,
        }
    }

    /// Least `|1 − Ω² μ|` at these speeds.
    fn clearance(&self, speeds_rad_s: &[f64]) -> f64 {
        let of = |speed: &f64| {
            self.mu.iter().map(|mu| (1.0 - speed * speed * mu).abs()).fold(f64::INFINITY, f64::min)
        };
        speeds_rad_s.iter().map(of).fold(f64::INFINITY, f64::min)
    }
}

/// A shaft with its disks on nominal springs at the bearings.
pub struct ModalShaft {
    /// Nominal spring at each bearing, N/m.
    pub nominal_n_m: f64,
    pub probe_angles_rad: Vec<f64>,
    /// Number of bearings: the first of the held places.
    pub bearings: usize,
    /// The last held places, in this order: each is the strain of a length of the shaft, not a point.
    strains: Vec<Place>,
    pub forward: WhirlModes,
    pub backward: WhirlModes,
    forces: Vec<Force>,
}

/// Every force column that some effect or run of this rotor can use, the planes' first.
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
    let ends = [End::Left, End::Right].into_iter().flat_map(|end| [Pattern::End(end), Pattern::EndTilt(end)]);
    forces.extend([Pattern::Bow, Pattern::FullBow].into_iter().chain(ends).map(Force::Pattern));
    forces
}

/// The shaft of a rotor that differs from its drawing, sections being sums over nodal coordinates.
struct OffsetShaft<'a> {
    rotor: &'a Rotor,
    shaft: &'a Shaft,
    offsets: &'a Offsets,
}

impl OffsetShaft<'_> {
    /// What a force of unit size acts on: nodal coordinates and factors.
    fn row(&self, force: Force) -> NodalSum {
        match force {
            Force::UnbalanceAt(z) => match self.rotor.plane.iter().position(|p| p.position_m == z) {
                Some(plane) => self.displacing(LoadedSection::Plane(plane)),
                None => self.shaft.section(z).displacement_beside(0.0),
            },
            Force::Pattern(pattern) => generalised_force(pattern, self).unwrap_or_default(),
        }
    }

    /// The section as drawn, and how far it is from there, m.
    fn section(&self, section: LoadedSection) -> (&Section, f64) {
        let offset = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(0.0);
        match section {
            LoadedSection::Disk(i) => {
                (self.shaft.section(self.rotor.disk[i].position_m), offset(&self.offsets.disk_m, i))
            }
            LoadedSection::Plane(i) => {
                (self.shaft.section(self.rotor.plane[i].position_m), offset(&self.offsets.plane_m, i))
            }
            LoadedSection::End(end) => (self.shaft.end(end), 0.0),
        }
    }
}

impl LoadedShaft for OffsetShaft<'_> {
    type Coordinates = NodalSum;

    fn displacing(&self, section: LoadedSection) -> NodalSum {
        let (section, offset_m) = self.section(section);
        section.displacement_beside(offset_m)
    }

    fn tilting(&self, section: LoadedSection) -> NodalSum {
        let (section, offset_m) = self.section(section);
        section.tilt_beside(offset_m)
    }

    fn straightening(&self, pattern: Pattern) -> NodalSum {
        let bent = self.shaft.bent(pattern).expect("a shaft has every shape that it can be bent to");
        self.shaft.straightening_force(self.rotor, bent).iter().copied().enumerate().collect()
    }
}

impl ModalShaft {
    /// Solves the shaft of a rotor on springs at its bearings. Their stiffness is `nominal_n_m`, or the first softer or stiffer
    /// value at which no critical speed of the shaft is near one of these speeds. Among many speeds there may be no such
    /// value: then it is the one whose critical speeds are farthest from them. The rotor may differ from the drawing that
    /// `shaft` was made of in its segments and disks, and by `offsets` in its positions.
    ///
    /// # Errors
    /// If the shaft on its springs is not stable, which a checked rotor rules out.
    pub fn new(
        rotor: &Rotor,
        shaft: &Shaft,
        offsets: &Offsets,
        nominal_n_m: f64,
        speeds_rad_s: &[f64],
    ) -> Result<Self, Error> {
        let beside = |z: f64, list: &[f64], i: usize| {
            shaft.section(z).displacement_beside(list.get(i).copied().unwrap_or(0.0))
        };
        let bearings =
            rotor.bearing.iter().enumerate().map(|(i, b)| beside(b.position_m, &offsets.bearing_m, i));
        let disks = rotor.disk.iter().enumerate().map(|(i, d)| beside(d.position_m, &offsets.disk_m, i));
        let probes = rotor.probe.iter().enumerate().map(|(i, p)| beside(p.position_m, &offsets.probe_m, i));
        let forces = all_forces(rotor);
        let loaded = OffsetShaft { rotor, shaft, offsets };
        let all = Participants {
            held: bearings.chain(disks).chain(shaft.strains.iter().map(|s| s.row.clone())).collect(),
            probes: probes.collect(),
            forces: forces.iter().map(|f| loaded.row(*f)).collect(),
        };
        let matrices = shaft.matrices(rotor, offsets);
        let on_springs = |spring_n_m: f64| -> Result<Self, Error> {
            let mut stiffness = matrices.stiffness.clone();
            for row in &all.held[..rotor.bearing.len()] {
                let shape = Shaft::along(row, &shaft.basis);
                stiffness.ger(spring_n_m, &shape, &shape, 1.0);
            }
            let factor = stiffness
                .cholesky()
                .ok_or_else(|| {
                    Error::Unsuitable("the shaft on its bearings has no positive stiffness".into())
                })?
                .l();
            let sense = |sign: f64| {
                let inertia = &matrices.mass - &matrices.polar_inertia * sign;
                WhirlModes::new(shaft, &inertia, &factor, &all)
            };
            Ok(Self {
                nominal_n_m: spring_n_m,
                probe_angles_rad: rotor.probe.iter().map(|p| p.angle_deg.to_radians()).collect(),
                bearings: rotor.bearing.len(),
                strains: shaft.strains.iter().map(|s| s.place).collect(),
                forward: sense(1.0),
                backward: sense(-1.0),
                forces: forces.clone(),
            })
        };
        let mut best: Option<(f64, Self)> = None;
        for factor in SPRINGS {
            let tried = on_springs(factor * nominal_n_m)?;
            let clearance = tried.clearance(speeds_rad_s);
            if best.as_ref().is_none_or(|(most, _)| clearance > *most) {
                best = Some((clearance, tried));
            }
            if clearance > CLEAR {
                break;
            }
        }
        best.map(|(_, shaft)| shaft).ok_or(Error::SingularMachine { tried: "on any springs" })
    }

    /// Least `|1 − Ω² μ|` of any mode at these speeds.
    fn clearance(&self, speeds_rad_s: &[f64]) -> f64 {
        self.forward.clearance(speeds_rad_s).min(self.backward.clearance(speeds_rad_s))
    }

    /// Number of bearings and disks.
    pub fn points(&self) -> usize {
        self.forward.held.ncols() - self.strains.len()
    }

    /// Number of a strain among the held places.
    ///
    /// # Panics
    /// If the shaft is not one whose lengths may differ in stiffness, or knows no such length.
    pub fn strain(&self, place: Place) -> usize {
        let number = self.strains.iter().position(|p| *p == place);
        self.points() + number.expect("a shaft knows all lengths that its rotor has effects on")
    }

    /// Number of the column of a force.
    pub fn column(&self, force: Force) -> usize {
        let force = match force {
            Force::Pattern(Pattern::RunUnbalance { plane, .. }) => return plane,
            Force::Pattern(pattern) => Force::Pattern(pattern.shape()),
            unbalance => unbalance,
        };
        self.forces.iter().position(|f| *f == force).expect("all_forces lists every force of the rotor")
    }

    /// Motion of each mode per unit of its force at one speed, forward.
    pub fn forward_gains(&self, speed_rad_s: f64) -> Vec<C> {
        gains(&self.forward.mu, speed_rad_s, C::from(1.0))
    }

    /// Motion of each mode per unit of its force at one speed, backward, with viscous damping `η K` inside
    /// the shaft.
    pub fn backward_gains(&self, speed_rad_s: f64, internal_damping_s: f64) -> Vec<C> {
        gains(&self.backward.mu, speed_rad_s, loss(speed_rad_s, internal_damping_s))
    }
}

/// Factor of internal damping on the stiffness in backward whirl.
pub fn loss(speed_rad_s: f64, internal_damping_s: f64) -> C {
    C::new(1.0, 2.0 * speed_rad_s * internal_damping_s)
}

fn gains(mu: &[f64], speed_rad_s: f64, stiffness: C) -> Vec<C> {
    let gain = |mu: &f64| {
        let denominator = stiffness - speed_rad_s * speed_rad_s * mu;
        // a speed that hits a critical of the shaft on its nominal springs to ten digits is moved off it
        if denominator.norm_sqr() < 1e-20 { C::from(1e10) } else { denominator.inv() }
    };
    mu.iter().map(gain).collect()
}

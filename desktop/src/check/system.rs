//! The machine as a linear system that turns at a steady speed: `q̈ + D(Ω) q̇ + K(Ω) q = 0` in coordinates of
//! unit mass.
//!
//! The shaft is taken on `CHECK_MODES` modes of each plane on its bearings and on the static shape of each
//! support, which finds every mode; each is then made exact on all finite elements (see [`crate::model::chain`]). A
//! pedestal with a mass has coordinates of its own, and so has each mode of a foundation.

use nalgebra::{Complex, DMatrix, DVector, Matrix2, Vector4};

use crate::bearing::dynamic_coefficients::DynamicCoefficients;
use crate::bearing::foundation::Footing;
use crate::bearing::support::SLOWEST_RAD_S;
use crate::error::Error;
use crate::machine::drawing::{Formulation, Rotor};
use crate::model::Model;
use crate::model::chain::{ElementChain, Nodes};
use crate::reduction::basis;
use crate::reduction::sizes::CHECK_MODES;

/// A machine, reduced to what moves up to a multiple of its speeds.
pub struct System {
    /// The reduced model; the mass of the shaft with everything fixed to it is the identity.
    pub model: Model,
    /// Whether `−Ω²N` is in the stiffness.
    printed: bool,
    /// Supports that stand on a pedestal with a mass, and the place of its two coordinates.
    pedestals: Vec<(usize, usize)>,
    /// Place of the first coordinate of a common foundation's modes.
    foundation: usize,
    /// Model of all finite elements, not reduced, for motion at running speed.
    forced: Model,
    /// Nodal coordinates of each coordinate of a plane.
    shapes: DMatrix<f64>,
    chain: Option<ElementChain>,
}

/// Damping and stiffness at a speed; the mass is the identity.
pub struct SystemMatrices {
    /// `D`: dampers and gyroscopic moments.
    pub damping: DMatrix<f64>,
    /// `K`: springs and circulatory forces.
    pub stiffness: DMatrix<f64>,
}

impl SystemMatrices {
    /// `T(λ) = λ² + λD + K`.
    pub fn dynamic_stiffness(&self, lambda: Complex<f64>) -> DMatrix<Complex<f64>> {
        let mut t = self.stiffness.zip_map(&self.damping, |k, d| lambda * d + k);
        for i in 0..t.nrows() {
            t[(i, i)] += lambda * lambda;
        }
        t
    }
}

impl System {
    /// The rotor with its effects.
    ///
    /// # Errors
    /// If an effect takes more mass from a disk than the shaft has there.
    pub fn new(rotor: &Rotor) -> Result<Self, Error> {
        Self::of(Model::finite_elements(rotor), rotor.physics.formulation)
    }

    /// A model on finite elements, made with this formulation.
    ///
    /// # Errors
    /// As [`System::new`].
    pub fn of(mut full: Model, formulation: Formulation) -> Result<Self, Error> {
        let printed = formulation == Formulation::Printed2023;
        let forced = full.clone();
        if printed {
            full.structure.mass -= &full.structure.tilt_inertia;
        }
        let size = full.structure.size();
        let basis = if CHECK_MODES + full.supports.len() < size {
            basis::supported(&full, CHECK_MODES + full.supports.len())
        } else {
            DMatrix::identity(size, size)
        };
        let reduced = full.projected(&basis);
        let mut mass = reduced.structure.mass;
        for s in &reduced.supports {
            mass.ger(s.law.mass_kg, &s.shape, &s.shape, 1.0);
        }
        let unit = mass
            .cholesky()
            .and_then(|factor| factor.l().solve_lower_triangular(&basis.transpose()))
            .ok_or_else(|| {
            Error::Unsuitable(
                "the effects make the mass of the shaft negative; check disk_mass and its sign".into(),
            )
        })?;
        let shapes = unit.transpose();
        let model = full.projected(&shapes);
        let mut end = 2 * model.structure.size();
        let mut pedestals = Vec::new();
        for (i, s) in model.supports.iter().enumerate() {
            if s.law.moving_pedestal().is_some() {
                pedestals.push((i, end));
                end += 2;
            }
        }
        // a foundation joins places far from each other, which no chain does
        let chain = if full.foundation.is_some() { None } else { ElementChain::new(&full, printed) };
        Ok(Self { model, printed, pedestals, foundation: end, forced, shapes, chain })
    }

    /// All finite elements as a chain, where they are one.
    pub fn chain(&self) -> Option<&ElementChain> {
        self.chain.as_ref()
    }

    /// Model of all finite elements, not reduced, for motion at running speed.
    pub fn forced(&self) -> &Model {
        &self.forced
    }

    /// Nodal motion of a motion in the coordinates of the system.
    pub fn nodes(&self, coordinates: &DVector<Complex<f64>>) -> Nodes {
        let n = self.model.structure.size();
        let along = |from: usize| {
            let part = coordinates.rows(from, n);
            (self.shapes.clone() * part.map(|c| c.re), self.shapes.clone() * part.map(|c| c.im))
        };
        let ((x_re, x_im), (y_re, y_im)) = (along(0), along(n));
        let at = |re: &DVector<f64>, im: &DVector<f64>, k: usize| Complex::new(re[k], im[k]);
        (0..self.shapes.nrows() / 2)
            .map(|i| {
                let (w, slope) = (2 * i, 2 * i + 1);
                Vector4::new(
                    at(&x_re, &x_im, w),
                    at(&x_re, &x_im, slope),
                    at(&y_re, &y_im, w),
                    at(&y_re, &y_im, slope),
                )
            })
            .collect()
    }

    /// Number of coordinates: of the shaft in x, in y, of pedestals, and of a foundation.
    pub fn size(&self) -> usize {
        self.foundation + self.model.foundation.as_ref().map_or(0, |f| f.modes().len())
    }

    /// Motion of the foot of a support in x and y, where it stands on the foundation: of modes of unit mass.
    fn on_foundation(&self, support: usize) -> Option<[DVector<f64>; 2]> {
        let footing = self.model.foundation.as_ref().filter(|f| !f.modes().is_empty())?;
        let foot = footing.bearings.iter().position(|s| *s == support)?;
        Some([0, 1].map(|axis| {
            let mut whole = DVector::zeros(self.size());
            for (k, mode) in footing.modes().iter().enumerate() {
                whole[self.foundation + k] = mode.shape(foot)[axis] / mode.modal_mass_kg.sqrt();
            }
            whole
        }))
    }

    /// How bearings on a foundation of which the flexibility was measured hold the shaft for motion at running speed; it is
    /// taken for all motion, as what the foundation gives to other motion was not measured on a turning machine.
    fn on_measured_foundation(&self, speed_rad_s: f64) -> Option<(&Footing, DMatrix<Complex<f64>>)> {
        let footing = self.model.foundation.as_ref().filter(|f| f.modes().is_empty())?;
        let at = speed_rad_s.max(SLOWEST_RAD_S);
        let own = |s: &usize| self.model.supports[*s].law.dynamic_stiffness(at, [0.0; 2]);
        let held = footing.held(at, &footing.bearings.iter().map(own).collect::<Vec<_>>());
        Some((footing, held.stiffness))
    }

    /// The system turning at a speed.
    pub fn at(&self, speed_rad_s: f64) -> SystemMatrices {
        let n = self.model.structure.size();
        let structure = &self.model.structure;
        let mut stiffness = DMatrix::zeros(self.size(), self.size());
        let mut damping = DMatrix::zeros(self.size(), self.size());
        let shaft = self.shaft_stiffness(speed_rad_s);
        let viscous = &structure.stiffness * self.model.internal_damping_s;
        let (circulation, gyroscopic) = (&viscous * speed_rad_s, &structure.polar_inertia * speed_rad_s);
        for axis in 0..2 {
            stiffness.view_mut((axis * n, axis * n), (n, n)).copy_from(&shaft);
            damping.view_mut((axis * n, axis * n), (n, n)).copy_from(&viscous);
        }
        stiffness.view_mut((0, n), (n, n)).copy_from(&circulation);
        stiffness.view_mut((n, 0), (n, n)).copy_from(&-circulation);
        damping.view_mut((0, n), (n, n)).copy_from(&gyroscopic);
        damping.view_mut((n, 0), (n, n)).copy_from(&-gyroscopic);
        let measured = self.on_measured_foundation(speed_rad_s);
        if let Some((footing, held)) = &measured {
            let places =
                footing.bearings.iter().flat_map(|s| self.directions(&self.model.supports[*s].shape));
            let places: Vec<DVector<f64>> = places.collect();
            for (i, a) in places.iter().enumerate() {
                for (j, b) in places.iter().enumerate() {
                    stiffness.ger(held[(i, j)].re, a, b, 1.0);
                    damping.ger(held[(i, j)].im / speed_rad_s.max(SLOWEST_RAD_S), a, b, 1.0);
                }
            }
        }
        for (i, support) in self.model.supports.iter().enumerate() {
            let own = self.pedestals.iter().find(|(s, _)| *s == i);
            let place = self.directions(&support.shape);
            if measured.as_ref().is_some_and(|(footing, _)| footing.bearings.contains(&i)) {
                continue;
            }
            if let Some(foot) = self.on_foundation(i) {
                let DynamicCoefficients { stiffness: k, damping: c } = support.law.coefficients(speed_rad_s);
                let between = [0, 1].map(|axis| &place[axis] - &foot[axis]);
                add(&mut stiffness, &between, &k);
                add(&mut damping, &between, &c);
                continue;
            }
            let Some((&(_, at), pedestal)) = own.zip(support.law.moving_pedestal()) else {
                let DynamicCoefficients { stiffness: k, damping: c } =
                    support.law.coefficients_in_series(speed_rad_s);
                add(&mut stiffness, &place, &k);
                add(&mut damping, &place, &c);
                continue;
            };
            let DynamicCoefficients { stiffness: k, damping: c } = support.law.coefficients(speed_rad_s);
            let foot = [0, 1].map(|axis| self.unit(at + axis) / pedestal.mass_kg[axis].sqrt());
            let between = [0, 1].map(|axis| &place[axis] - &foot[axis]);
            add(&mut stiffness, &between, &k);
            add(&mut damping, &between, &c);
            let diagonal = |[x, y]: [f64; 2]| Matrix2::new(x, 0.0, 0.0, y);
            add(&mut stiffness, &foot, &diagonal(pedestal.stiffness_n_m));
            add(&mut damping, &foot, &diagonal(pedestal.damping_n_s_m));
        }
        for (k, mode) in self.model.foundation.iter().flat_map(Footing::modes).enumerate() {
            let at = self.foundation + k;
            stiffness[(at, at)] += mode.natural_rad_s().powi(2);
            damping[(at, at)] += 2.0 * mode.damping_ratio * mode.natural_rad_s();
        }
        SystemMatrices { damping, stiffness }
    }

    /// Stiffness of the free shaft in one plane, in the formulation of the file.
    pub fn shaft_stiffness(&self, speed_rad_s: f64) -> DMatrix<f64> {
        let structure = &self.model.structure;
        if !self.printed {
            return structure.stiffness.clone();
        }
        &structure.stiffness - &structure.tilt_inertia * (speed_rad_s * speed_rad_s)
    }

    /// What a place with this shape moves in x and in y per unit of each coordinate.
    fn directions(&self, shape: &DVector<f64>) -> [DVector<f64>; 2] {
        let n = shape.len();
        [0, 1].map(|axis| {
            let mut whole = DVector::zeros(self.size());
            whole.rows_mut(axis * n, n).copy_from(shape);
            whole
        })
    }

    fn unit(&self, at: usize) -> DVector<f64> {
        DVector::from_fn(self.size(), |i, _| f64::from(u8::from(i == at)))
    }
}

/// Adds a 2 × 2 matrix between the directions x and y of one place.
fn add(whole: &mut DMatrix<f64>, directions: &[DVector<f64>; 2], values: &Matrix2<f64>) {
    for i in 0..2 {
        for j in 0..2 {
            if values[(i, j)] != 0.0 {
                whole.ger(values[(i, j)], &directions[i], &directions[j], 1.0);
            }
        }
    }
}

//! A rotor model: a shaft plus supports, forcings and readings; and its response at running speed.

pub(crate) mod amplitude;
pub mod banded;
pub mod chain;
pub mod deflection;
mod eigenvalues;
pub mod force;
pub mod terms;

use nalgebra::{Complex, DMatrix, DVector, Matrix2, Vector2};

use crate::bearing::foundation::{Footing, FoundationStiffness};
use crate::bearing::support::Dampers;
use crate::effects::entry;
use crate::effects::terms::position_m;
use crate::error::Error;
use crate::machine::drawing::{Formulation, Rotor};
use crate::shaft::structure::{Structure, elements_per_segment};
use crate::units::rpm;
use amplitude::Relaxation;
use chain::ElementChain;
use force::{DrawnShaft, generalised_force};
use terms::{Forcing, ProbeTerm, Support};

/// Fixed-point rounds over the amplitude at supports that harden or soften.
const AMPLITUDE_ROUNDS: usize = 300;

/// A shaft with its terms, in whatever coordinates `structure` has.
#[derive(Debug, Clone)]
pub struct Model {
    /// The free shaft with its disks.
    pub structure: Structure,
    /// True speed over the one that responses are asked for.
    pub speed_factor: f64,
    /// Viscous damping inside the shaft, as a multiple of its stiffness, s.
    pub internal_damping_s: f64,
    /// Bearings first, in the order of the file.
    pub supports: Vec<Support>,
    /// What some of the supports stand on together.
    pub foundation: Option<Footing>,
    /// Known forces beside the unbalance that is sought.
    pub forcings: Vec<Forcing>,
    /// Shapes of the unbalance planes.
    pub planes: Vec<DVector<f64>>,
    /// Probes in the order of the file.
    pub probes: Vec<ProbeTerm>,
}

/// Influence coefficients and fixed part of the response at one speed.
#[derive(Debug, Clone)]
pub struct Response {
    /// Probes × planes, m per kg·m: motion per unbalance `U e^{iα}`.
    pub per_unbalance: DMatrix<Complex<f64>>,
    /// Probes: motion from known forcings, and runout, m.
    pub fixed: DVector<Complex<f64>>,
    support_per_unbalance: DMatrix<Complex<f64>>,
    support_fixed: DVector<Complex<f64>>,
}

impl Response {
    /// A response of which only the probes are known.
    pub(crate) fn of_probes(per_unbalance: DMatrix<Complex<f64>>, fixed: DVector<Complex<f64>>) -> Self {
        let support_per_unbalance = DMatrix::zeros(0, per_unbalance.ncols());
        Self { per_unbalance, fixed, support_per_unbalance, support_fixed: DVector::zeros(0) }
    }

    /// Phasor at each probe for these unbalances (kg·m), m.
    pub fn at(&self, unbalance_kg_m: &DVector<Complex<f64>>) -> DVector<Complex<f64>> {
        &self.per_unbalance * unbalance_kg_m + &self.fixed
    }
}

impl Model {
    /// The rotor on finite elements, bearings and all.
    pub fn finite_elements(rotor: &Rotor) -> Self {
        Self::on(Structure::finite_elements(rotor, &rotor.physics, elements_per_segment(rotor)), rotor)
    }

    /// Attaches the rotor's bearings, effects, planes and probes to a structure.
    pub fn on(mut structure: Structure, rotor: &Rotor) -> Self {
        if rotor.physics.formulation == Formulation::Printed2023 {
            // every response here is synchronous, so −Ω²N joins −Ω²M
            structure.mass += &structure.tilt_inertia;
        }
        let terms = entry::terms_of(rotor);
        let shape = |position_m| structure.station(position_m).displacement.clone();
        let supports = terms.supports.iter().filter_map(|(place, law)| {
            position_m(rotor, *place).map(|z| Support { shape: shape(z), law: law.clone() })
        });
        let forcings = terms.forcings.iter().filter_map(|(pattern, amplitude)| {
            let shape = generalised_force(*pattern, &DrawnShaft { structure: &structure, rotor })?;
            Some(Forcing { shape, amplitude: *amplitude, law: pattern.law() })
        });
        let probes = terms.shows.iter().enumerate().map(|(column, shown)| {
            let probe = &rotor.probe[*shown];
            ProbeTerm {
                shape: shape(probe.position_m),
                angle_rad: probe.angle_deg.to_radians(),
                gain: terms.gains[column],
                runout_m: terms.runout_m[column],
                mount: terms.mount(rotor, *shown),
            }
        });
        Self {
            speed_factor: terms.speed_factor,
            internal_damping_s: terms.internal_damping_s,
            supports: supports.collect(),
            foundation: terms.foundation.clone(),
            forcings: forcings.collect(),
            planes: rotor.plane.iter().map(|p| shape(p.position_m)).collect(),
            probes: probes.collect(),
            structure,
        }
    }

    /// The same model in the coordinates of the columns of `basis`.
    pub fn projected(&self, basis: &DMatrix<f64>) -> Self {
        let mut model = self.clone();
        model.structure = self.structure.projected(basis);
        let supports = model.supports.iter_mut().map(|s| &mut s.shape);
        let forcings = model.forcings.iter_mut().map(|f| &mut f.shape);
        let probes = model.probes.iter_mut().map(|p| &mut p.shape);
        for shape in supports.chain(forcings).chain(probes).chain(&mut model.planes) {
            *shape = basis.tr_mul(shape);
        }
        model
    }

    /// Z(Ω), 2n × 2n, for coordinates `[p; r]` of x and y, N/m.
    ///
    /// `amplitudes_m` holds the motion at each support in x and y.
    pub fn dynamic_stiffness(&self, speed_rad_s: f64, amplitudes_m: &[[f64; 2]]) -> DMatrix<Complex<f64>> {
        let n = self.structure.size();
        let (w, w2) = (speed_rad_s, speed_rad_s * speed_rad_s);
        let circulation = w * self.internal_damping_s;
        let mut z = DMatrix::zeros(2 * n, 2 * n);
        for row in 0..n {
            for column in 0..n {
                let at = (row, column);
                let k = self.structure.stiffness[at];
                let direct = Complex::new(k - w2 * self.structure.mass[at], circulation * k);
                let cross = Complex::new(circulation * k, w2 * self.structure.polar_inertia[at]);
                z[(row, column)] = direct;
                z[(n + row, n + column)] = direct;
                z[(row, n + column)] = cross;
                z[(n + row, column)] = -cross;
            }
        }
        let mut add = |from: &Support, to: &Support, held: &Matrix2<Complex<f64>>| {
            let outer = &from.shape * to.shape.transpose();
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let mut block = z.view_mut((i * n, j * n), (n, n));
                block += outer.map(|v| held[(i, j)] * v);
            }
        };
        let footing = self.footing();
        for (s, (support, amplitude_m)) in self.supports.iter().zip(amplitudes_m).enumerate() {
            if !footing.contains(&s) {
                add(support, support, &support.law.dynamic_stiffness(w, *amplitude_m));
            }
        }
        if let Some(held) = self.on_foundation(w, amplitudes_m) {
            for (i, a) in footing.iter().enumerate() {
                for (j, b) in footing.iter().enumerate() {
                    let block = held.stiffness.fixed_view::<2, 2>(2 * i, 2 * j).into_owned();
                    add(&self.supports[*a], &self.supports[*b], &block);
                }
            }
        }
        z
    }

    /// Numbers of the supports that stand on a common foundation.
    fn footing(&self) -> &[usize] {
        self.foundation.as_ref().map_or(&[], |f| &f.bearings)
    }

    /// How those hold the shaft.
    fn on_foundation(&self, speed_rad_s: f64, amplitudes_m: &[[f64; 2]]) -> Option<FoundationStiffness> {
        let footing = self.foundation.as_ref()?;
        let own = |s: &usize| self.supports[*s].law.dynamic_stiffness(speed_rad_s, amplitudes_m[*s]);
        Some(footing.held(speed_rad_s, &footing.bearings.iter().map(own).collect::<Vec<_>>()))
    }

    /// Motion of the housing of a support in x and y, per motion of the shaft: that of the supports it depends on.
    pub fn housing(
        &self,
        support: usize,
        speed_rad_s: f64,
        amplitudes_m: &[[f64; 2]],
    ) -> Vec<(usize, Matrix2<Complex<f64>>)> {
        let foot = self.footing().iter().position(|s| *s == support);
        match (foot, self.on_foundation(speed_rad_s, amplitudes_m)) {
            (Some(foot), Some(held)) => {
                let block = |j: usize| held.housing.fixed_view::<2, 2>(2 * foot, 2 * j).into_owned();
                self.footing().iter().enumerate().map(|(j, s)| (*s, block(j))).collect()
            }
            _ => {
                let law = &self.supports[support].law;
                vec![(support, law.housing(speed_rad_s, amplitudes_m[support]))]
            }
        }
    }

    /// Coordinates `[p; r]`, 2n a column: one column a plane per kg·m, the last for everything known.
    ///
    /// # Errors
    /// If the dynamic stiffness is singular: an undamped critical speed.
    pub fn motion(
        &self,
        speed_rad_s: f64,
        amplitudes_m: &[[f64; 2]],
    ) -> Result<DMatrix<Complex<f64>>, Error> {
        let n = self.structure.size();
        let mut columns = DMatrix::zeros(2 * n, self.planes.len() + 1);
        let mut add = |column: usize, shape: &DVector<f64>, force: Complex<f64>| {
            for (k, s) in shape.iter().enumerate() {
                columns[(k, column)] += force * *s;
                columns[(n + k, column)] += Complex::new(force.im, -force.re) * *s;
            }
        };
        for (j, shape) in self.planes.iter().enumerate() {
            add(j, shape, Complex::from(speed_rad_s * speed_rad_s));
        }
        for f in &self.forcings {
            add(self.planes.len(), &f.shape, f.amplitude * f.law.factor(speed_rad_s));
        }
        let solved = match ElementChain::new(self, false) {
            Some(line) => self.solve_on_chain(&line, speed_rad_s, amplitudes_m, &columns),
            None => self.dynamic_stiffness(speed_rad_s, amplitudes_m).lu().solve(&columns),
        };
        solved.ok_or(Error::SingularModel { speed_rad_s })
    }

    /// Coordinates `[p; r]` under forces on all finite elements; `None` if the model is singular.
    ///
    /// A foundation joins places that are far from each other: it is put on the shaft on rigid pedestals as an update of their
    /// dynamic stiffness (Sherman–Morrison–Woodbury).
    fn solve_on_chain(
        &self,
        line: &ElementChain,
        speed_rad_s: f64,
        amplitudes_m: &[[f64; 2]],
        forces: &DMatrix<Complex<f64>>,
    ) -> Option<DMatrix<Complex<f64>>> {
        let n = self.structure.size();
        // node by node: two coordinates in x, two in y
        let place =
            |row: usize| if row < n { row / 2 * 4 + row % 2 } else { (row - n) / 2 * 4 + 2 + row % 2 };
        let mut chain = line.shaft(Complex::new(0.0, speed_rad_s), speed_rad_s, Dampers::In);
        let own: Vec<Matrix2<Complex<f64>>> = self
            .supports
            .iter()
            .zip(amplitudes_m)
            .map(|(support, amplitude_m)| support.law.dynamic_stiffness(speed_rad_s, *amplitude_m))
            .collect();
        let nodes: Vec<usize> = line.nodes().collect();
        nodes.iter().zip(&own).for_each(|(node, own)| chain.hold(*node, own));
        let factors = chain.factor()?;
        let mut motion = DMatrix::zeros(2 * n, forces.ncols());
        for row in 0..2 * n {
            motion.row_mut(place(row)).copy_from(&forces.row(row));
        }
        factors.solve(&mut motion);
        if let Some(held) = self.on_foundation(speed_rad_s, amplitudes_m) {
            let mut change = held.stiffness;
            for (i, support) in self.footing().iter().enumerate() {
                let mut block = change.fixed_view_mut::<2, 2>(2 * i, 2 * i);
                block -= own[*support];
            }
            let feet: Vec<usize> =
                self.footing().iter().flat_map(|s| [4 * nodes[*s], 4 * nodes[*s] + 2]).collect();
            let mut per_force = DMatrix::zeros(2 * n, feet.len());
            feet.iter().enumerate().for_each(|(j, row)| per_force[(*row, j)] = Complex::from(1.0));
            factors.solve(&mut per_force);
            let update = DMatrix::identity(feet.len(), feet.len()) + &change * per_force.select_rows(&feet);
            let force = update.lu().solve(&(change * motion.select_rows(&feet)))?;
            motion -= per_force * force;
        }
        motion
            .iter()
            .all(|v| v.is_finite())
            .then(|| DMatrix::from_fn(2 * n, forces.ncols(), |row, column| motion[(place(row), column)]))
    }

    /// The speed at which the machine turns where the data state this one.
    pub fn true_rad_s(&self, stated_rad_s: f64) -> f64 {
        self.speed_factor * stated_rad_s
    }

    /// Response at a speed as data state it, with the supports at the given amplitudes.
    ///
    /// # Errors
    /// As [`Model::motion`].
    pub fn response_at(&self, speed_rad_s: f64, amplitudes_m: &[[f64; 2]]) -> Result<Response, Error> {
        self.turning_at(self.true_rad_s(speed_rad_s), amplitudes_m)
    }

    /// The same at the true speed.
    ///
    /// # Errors
    /// As [`Model::motion`].
    pub fn turning_at(&self, speed_rad_s: f64, amplitudes_m: &[[f64; 2]]) -> Result<Response, Error> {
        let n = self.structure.size();
        let motion = self.motion(speed_rad_s, amplitudes_m)?;
        let x = motion.rows(0, n);
        let y = motion.rows(n, n);
        let read = |shape: &DVector<f64>, cos: f64, sin: f64, j: usize| {
            (0..n).map(|k| (x[(k, j)] * cos + y[(k, j)] * sin) * shape[k]).sum::<Complex<f64>>()
        };
        let planes = self.planes.len();
        let support = |i: usize, j: usize| {
            let along_x = i.is_multiple_of(2);
            let shape = &self.supports[i / 2].shape;
            read(shape, f64::from(u8::from(along_x)), f64::from(u8::from(!along_x)), j)
        };
        let housings: Vec<_> = self
            .probes
            .iter()
            .map(|p| p.mount.map_or(vec![], |s| self.housing(s, speed_rad_s, amplitudes_m)))
            .collect();
        let probe = |i: usize, j: usize| {
            let p = &self.probes[i];
            let (sin, cos) = p.angle_rad.sin_cos();
            let shaft = read(&p.shape, cos, sin, j);
            let housing = housings[i].iter().map(|(s, per_motion)| {
                let moved = per_motion * Vector2::new(support(2 * s, j), support(2 * s + 1, j));
                moved.x * cos + moved.y * sin
            });
            p.gain * (shaft - housing.sum::<Complex<f64>>())
        };
        Ok(Response {
            per_unbalance: DMatrix::from_fn(self.probes.len(), planes, probe),
            fixed: DVector::from_fn(self.probes.len(), |i, _| probe(i, planes) + self.probes[i].runout_m),
            support_per_unbalance: DMatrix::from_fn(2 * self.supports.len(), planes, support),
            support_fixed: DVector::from_fn(2 * self.supports.len(), |i, _| support(i, planes)),
        })
    }

    /// Response of a model without amplitude-dependent supports.
    ///
    /// # Errors
    /// As [`Model::response_at`].
    pub fn response(&self, speed_rad_s: f64) -> Result<Response, Error> {
        self.response_at(speed_rad_s, &vec![[0.0; 2]; self.supports.len()])
    }

    /// Response for a known unbalance, with the supports at the amplitude that it causes.
    ///
    /// # Errors
    /// If the model is singular, or the amplitude does not settle.
    pub fn response_under(
        &self,
        speed_rad_s: f64,
        unbalance_kg_m: &DVector<Complex<f64>>,
    ) -> Result<Response, Error> {
        Ok(self.settled_under(speed_rad_s, unbalance_kg_m)?.0)
    }

    /// The response, and the motion at each support in x and y that it was found at, m.
    fn settled_under(
        &self,
        speed_rad_s: f64,
        unbalance_kg_m: &DVector<Complex<f64>>,
    ) -> Result<(Response, Vec<[f64; 2]>), Error> {
        let mut amplitudes_m = vec![[0.0; 2]; self.supports.len()];
        let mut relaxation = Relaxation::adaptive();
        let nonlinear = self.supports.iter().any(|s| s.law.depends_on_amplitude());
        for _ in 0..AMPLITUDE_ROUNDS {
            let response = self.response_at(speed_rad_s, &amplitudes_m)?;
            if !nonlinear {
                return Ok((response, amplitudes_m));
            }
            let motion = &response.support_per_unbalance * unbalance_kg_m + &response.support_fixed;
            if relaxation.step(amplitudes_m.as_flattened_mut(), motion.iter().map(|m| m.norm())) < 1e-12 {
                return Ok((response, amplitudes_m));
            }
        }
        Err(Error::AmplitudeNotSettled { speed_rpm: rpm(speed_rad_s) })
    }
}

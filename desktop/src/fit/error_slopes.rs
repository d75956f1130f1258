//! What each error of the drawing does to the response, exactly and at once.
//!
//! An error changes the dynamic stiffness by `dZ`, a force by `dF` or the place of a probe, and the
//! response by `dY = λᵀ (dF − dZ q) + dpᵀ q`, with `q` the motion of the whole shaft and `λ` its adjoint
//! motion for a unit of that probe. Both come from the modes of the plant and the forces of the supports;
//! what is left is a sum over the few finite elements or places that the error concerns.

use nalgebra::{Complex, DMatrix, DVectorView, Matrix4, Vector4};

use super::drawing_errors::{DrawingChange, DrawingErrors, ElementChange};
use super::problem::{Evaluation, Problem};
use crate::effects::Pattern;
use crate::receptance::modal_shaft::{Force, ModalShaft, WhirlModes, loss};
use crate::receptance::update::{Mounted, nominal};
use crate::reduction::nodal::NodalSum;

type C = Complex<f64>;
const I: C = C::new(0.0, 1.0);

impl Problem<'_> {
    /// Change of the model at every value per standard deviation of each error, the linear unknowns held,
    /// in noise units; the problem's plant must be that of the same drawing.
    pub(super) fn error_derivative(&self, errors: &DrawingErrors) -> Option<DMatrix<f64>> {
        let now = self.evaluated()?;
        let mut d = DMatrix::zeros(2 * self.count(), errors.changes.len());
        let mut at = 0;
        for (r, row) in self.rows.iter().enumerate() {
            let snapshot = Snapshot::new(self, now, r);
            for (j, change) in errors.changes.iter().enumerate() {
                let slopes = snapshot.slopes(change);
                for (k, v) in row.values.iter().enumerate() {
                    let slope = slopes[now.terms.shows[v.probe]] * now.terms.gains[v.probe] / v.sigma_m;
                    (d[(at + 2 * k, j)], d[(at + 2 * k + 1, j)]) = (slope.re, slope.im);
                }
            }
            at += 2 * row.values.len();
        }
        Some(self.observed(d))
    }

    /// Size of each force of the plant in a row.
    fn sizes_on_plant(&self, now: &Evaluation, row: usize) -> Vec<C> {
        let mut sizes = vec![C::from(0.0); self.plant.forward.forces.ncols()];
        for (force, size) in self.forces.iter().zip(&now.sizes[row]) {
            sizes[*force] = *size;
        }
        sizes
    }
}

/// Motion of the shaft in one sense of whirl, at every nodal coordinate: the machine's first, then the
/// adjoint of each probe.
struct Fields(DMatrix<f64>);

impl Fields {
    fn at(&self, coordinate: usize, field: usize) -> C {
        C::new(self.0[(coordinate, 2 * field)], self.0[(coordinate, 2 * field + 1)])
    }

    fn along(&self, row: &NodalSum, field: usize) -> C {
        row.iter().map(|(k, v)| self.at(*k, field) * *v).sum()
    }

    fn element(&self, number: usize, field: usize) -> Vector4<C> {
        Vector4::from_fn(|i, _| self.at(2 * number + i, field))
    }
}

/// Forces of one sense of whirl that the fields come from.
struct WhirlForces<'a> {
    /// Number of each held place among the plant's.
    places: &'a [usize],
    /// Forces at the held places, places × fields.
    held: DMatrix<C>,
    /// Of each force of the plant, in the motion's field.
    sizes: &'a [C],
    /// Of each probe in its adjoint's field: a unit force in its direction.
    probes: Vec<C>,
}

impl Fields {
    /// From the modes of a sense and their motion per unit of force.
    fn new(sense: &WhirlModes, gains: &[C], acting: &WhirlForces) -> Self {
        let mut modal = DMatrix::zeros(gains.len(), 2 * acting.held.ncols());
        let mut add = |field: usize, participation: DVectorView<f64>, factor: C| {
            if factor != C::from(0.0) {
                modal.column_mut(2 * field).axpy(factor.re, &participation, 1.0);
                modal.column_mut(2 * field + 1).axpy(factor.im, &participation, 1.0);
            }
        };
        for (force, size) in acting.sizes.iter().enumerate() {
            add(0, sense.forces.column(force), *size);
        }
        for (probe, unit) in acting.probes.iter().enumerate() {
            add(1 + probe, sense.probes.column(probe), *unit);
        }
        for (field, forces) in acting.held.column_iter().enumerate() {
            for (place, force) in acting.places.iter().zip(&forces) {
                add(field, sense.held.column(*place), *force);
            }
        }
        for (mode, gain) in gains.iter().enumerate() {
            for field in 0..acting.held.ncols() {
                let v = C::new(modal[(mode, 2 * field)], modal[(mode, 2 * field + 1)]) * gain;
                (modal[(mode, 2 * field)], modal[(mode, 2 * field + 1)]) = (v.re, v.im);
            }
        }
        Self(&sense.shapes * modal)
    }
}

/// Forward and backward parts of forces in x and y at each place in turn.
fn circular<'a>(forces: impl Iterator<Item = &'a C>) -> Vec<[C; 2]> {
    pairs(forces).map(|[x, y]| [(x + I * y) * 0.5, (x - I * y) * 0.5]).collect()
}

/// The same of adjoint forces, whose products with motions are the sum of both senses.
fn adjoint_circular<'a>(forces: impl Iterator<Item = &'a C>) -> Vec<[C; 2]> {
    pairs(forces).map(|[x, y]| [x - I * y, x + I * y]).collect()
}

fn pairs<'a>(mut values: impl Iterator<Item = &'a C>) -> impl Iterator<Item = [C; 2]> {
    std::iter::from_fn(move || Some([*values.next()?, *values.next()?]))
}

/// One row of the data, ready for every error.
pub(super) struct Snapshot<'a> {
    plant: &'a ModalShaft,
    speed_rad_s: f64,
    loss: C,
    forward: Fields,
    backward: Fields,
    /// Size of each force of the plant.
    sizes: Vec<C>,
    /// Force of each support and of its adjoint for each probe, forward and backward.
    held: Vec<[C; 2]>,
    adjoint_held: Vec<Vec<[C; 2]>>,
    /// Number of each held place among the plant's.
    places: Vec<usize>,
    /// Probes on housings: number, bearing, and what they read of it forward and backward.
    mounted: Vec<(usize, usize, [C; 2])>,
}

impl<'a> Snapshot<'a> {
    pub(super) fn new(problem: &'a Problem, now: &Evaluation, r: usize) -> Self {
        let plant = &*problem.plant;
        let (speed_rad_s, damping) = (problem.speed_rad_s(&now.terms, r), now.terms.internal_damping_s);
        let (supports, places) = (problem.supports(&now.terms, r), problem.places());
        let (motion, adjoint) = (&now.motion[r], &now.responses.of(r).adjoint);
        let reading = |on: &Mounted| (on.probe, adjoint_circular(on.reading.iter()));
        let readings: Vec<_> = problem.mounted(&now.terms, r).iter().map(reading).collect();
        let excess = supports.excess(&nominal(plant, speed_rad_s, damping));
        let beyond = circular(excess.forces(motion).iter());
        let of_columns =
            |m: &DMatrix<C>| -> Vec<_> { m.column_iter().map(|c| adjoint_circular(c.iter())).collect() };
        let adjoint_beyond = of_columns(&excess.adjoint_forces(adjoint));
        let held = |sense: usize| {
            let mut held = DMatrix::zeros(places.len(), 1 + adjoint.ncols());
            for i in 0..places.len() {
                held[(i, 0)] = -beyond[i][sense];
                for (probe, adjoint) in adjoint_beyond.iter().enumerate() {
                    held[(i, 1 + probe)] = -adjoint[i][sense];
                }
                for (probe, reading) in &readings {
                    held[(i, 1 + probe)] -= reading[i][sense];
                }
            }
            held
        };
        let sizes = problem.sizes_on_plant(now, r);
        let along = |sign: f64| plant.probe_angles_rad.iter().map(move |a| C::from_polar(1.0, sign * a));
        let forward =
            WhirlForces { places: &places, held: held(0), sizes: &sizes, probes: along(-1.0).collect() };
        // forces that turn with the shaft have no backward part
        let backward =
            WhirlForces { places: &places, held: held(1), sizes: &[], probes: along(1.0).collect() };
        let read_of = |(probe, reading): &(usize, Vec<[C; 2]>)| {
            places.iter().zip(reading).map(|(place, read)| (*probe, *place, *read)).collect::<Vec<_>>()
        };
        Self {
            plant,
            speed_rad_s,
            loss: loss(speed_rad_s, damping),
            forward: Fields::new(&plant.forward, &plant.forward_gains(speed_rad_s), &forward),
            backward: Fields::new(&plant.backward, &plant.backward_gains(speed_rad_s, damping), &backward),
            held: circular(supports.forces(motion).iter()),
            adjoint_held: of_columns(&supports.adjoint_forces(adjoint)),
            mounted: readings.iter().flat_map(read_of).collect(),
            sizes,
            places,
        }
    }

    fn probes(&self) -> usize {
        self.plant.probe_angles_rad.len()
    }

    /// What a probe shows, its gain left out, of a unit force that turns forward and of one that turns backward.
    pub(super) fn under_force(&self, at: &NodalSum, probe: usize) -> [C; 2] {
        [self.forward.along(at, 1 + probe), self.backward.along(at, 1 + probe)]
    }

    /// Motion of the shaft forward and backward, m.
    pub(super) fn motion(&self, at: &NodalSum) -> [C; 2] {
        [self.forward.along(at, 0), self.backward.along(at, 0)]
    }

    /// Change at every probe, its gain left out.
    fn slopes(&self, change: &DrawingChange) -> Vec<C> {
        let w2 = self.speed_rad_s * self.speed_rad_s;
        let each = |f: &dyn Fn(usize) -> C| (0..self.probes()).map(f).collect::<Vec<C>>();
        match change {
            DrawingChange::Elements(all) => self.element_slopes(all),
            DrawingChange::Inertia { displacement, tilt, inertia: [mass, diametral, polar] } => {
                // one of them alone is not zero
                let (place, [ahead, behind]) = if *mass == 0.0 {
                    (tilt, [diametral - polar, diametral + polar])
                } else {
                    (displacement, [*mass; 2])
                };
                let [forward, backward] = self.motion(place);
                let (forward, backward) = (forward * ahead * w2, backward * behind * w2);
                each(&|p| {
                    self.forward.along(place, 1 + p) * forward + self.backward.along(place, 1 + p) * backward
                })
            }
            DrawingChange::Disk { number, displacement, tilt, inertia } => {
                self.disk_slopes(*number, displacement, tilt, *inertia)
            }
            DrawingChange::Bearing { number, rate } => {
                let motion = self.motion(rate);
                each(&|p| {
                    let housing =
                        self.mounted.iter().filter(|(probe, place, _)| (probe, place) == (&p, number));
                    let moved = housing.map(|(_, _, [ahead, behind])| ahead * motion[0] + behind * motion[1]);
                    self.support_slope(*number, rate, motion, p) - moved.sum::<C>()
                })
            }
            DrawingChange::Probe { number, rate } => {
                let mut slopes = vec![C::from(0.0); self.probes()];
                let turn = C::from_polar(1.0, self.plant.probe_angles_rad[*number]);
                let [forward, backward] = self.motion(rate);
                slopes[*number] = turn.conj() * forward + turn * backward;
                slopes
            }
            DrawingChange::Plane { force, rate } => {
                let size = self.sizes[self.plant.column(*force)];
                each(&|p| self.forward.along(rate, 1 + p) * size)
            }
        }
    }

    /// A disk moves along the shaft, with all that acts at it.
    fn disk_slopes(
        &self,
        number: usize,
        [here, rate]: &[NodalSum; 2],
        [tilt, tilt_rate]: &[NodalSum; 2],
        [mass, diametral, polar]: [f64; 3],
    ) -> Vec<C> {
        let w2 = self.speed_rad_s * self.speed_rad_s;
        let force = |pattern| self.sizes[self.plant.column(Force::Pattern(pattern))];
        let forces = [Pattern::DiskUnbalance(number), Pattern::DiskTilt(number)].map(force);
        let [moving, moving_rate, tilting, tilting_rate] =
            [here, rate, tilt, tilt_rate].map(|a| self.motion(a));
        let slope = |p: usize| {
            let whirl = |fields: &Fields, s: usize, polar: f64| {
                let moved =
                    fields.along(here, 1 + p) * moving_rate[s] + fields.along(rate, 1 + p) * moving[s];
                let tilted =
                    fields.along(tilt, 1 + p) * tilting_rate[s] + fields.along(tilt_rate, 1 + p) * tilting[s];
                moved * mass + tilted * (diametral - polar)
            };
            (whirl(&self.forward, 0, polar) + whirl(&self.backward, 1, -polar)) * w2
                + self.forward.along(rate, 1 + p) * forces[0]
                + self.forward.along(tilt_rate, 1 + p) * forces[1]
                + self.support_slope(self.plant.bearings + number, rate, moving_rate, p)
        };
        (0..self.probes()).map(slope).collect()
    }

    /// A support moves along the shaft, which moves by so much per deviation there: what it feels changes, and where it pushes.
    fn support_slope(&self, place: usize, rate: &NodalSum, motion: [C; 2], probe: usize) -> C {
        let Some(i) = self.places.iter().position(|p| *p == place) else { return C::from(0.0) };
        let sense = |fields: &Fields, s: usize| {
            fields.along(rate, 1 + probe) * self.held[i][s] + self.adjoint_held[probe][i][s] * motion[s]
        };
        -(sense(&self.forward, 0) + sense(&self.backward, 1))
    }

    fn element_slopes(&self, changes: &[ElementChange]) -> Vec<C> {
        let w2 = self.speed_rad_s * self.speed_rad_s;
        let size = |pattern: Pattern| self.sizes[self.plant.column(Force::Pattern(pattern))];
        let mut slopes = vec![C::from(0.0); self.probes()];
        let times = |m: &Matrix4<f64>, v: &Vector4<C>| {
            Vector4::from_fn(|i, _| (0..4).map(|j| v[j] * m[(i, j)]).sum::<C>())
        };
        // all elements bend to the same patterns
        let bends = changes.first().map_or(&[][..], |e| &e.bends);
        let sizes: Vec<C> = bends.iter().map(|(pattern, _)| size(*pattern)).collect();
        for e in changes {
            let forward = e.stiffness - (e.mass - e.polar_inertia) * w2;
            let backward = e.stiffness - (e.mass + e.polar_inertia) * w2;
            let mut ahead = times(&forward, &self.forward.element(e.number, 0));
            for (size, (_, force)) in sizes.iter().zip(&e.bends).filter(|(size, _)| **size != C::from(0.0)) {
                ahead -= force.map(|v| size * v);
            }
            let motion = self.backward.element(e.number, 0);
            let mut behind = times(&backward, &motion);
            if self.loss.im != 0.0 {
                behind += times(&e.stiffness, &motion) * (self.loss - 1.0);
            }
            for (p, slope) in slopes.iter_mut().enumerate() {
                *slope -= self.forward.element(e.number, 1 + p).dot(&ahead);
                *slope -= self.backward.element(e.number, 1 + p).dot(&behind);
            }
        }
        slopes
    }
}

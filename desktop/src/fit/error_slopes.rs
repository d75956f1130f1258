//! What each error of the drawing does to the response, exactly and at once.
//!
//! An error changes the dynamic stiffness by `dZ`, a force by `dF` or the place of a probe, and the
//! response by `dY = λᵀ (dF − dZ q) + dpᵀ q`, with `q` the motion of the whole shaft and `λ` its adjoint
//! motion for a unit of that probe. Both come from the modes of the plant and the forces of the supports;
//! what is left is a sum over the few finite elements or places that the error concerns.

use std::sync::Arc;

use nalgebra::{Complex, DMatrix, DVectorView, Matrix4, Vector4};

use super::drawing_errors::{DrawingChange, DrawingErrors, ElementChange};
use super::problem::{Evaluation, Problem};
use crate::effects::Pattern;
use crate::receptance::modal_shaft::{Force, ModalShaft, WhirlModes, loss};
use crate::receptance::update::{Mounted, Supports, nominal};
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
        for (row, snapshot) in self.rows.iter().zip(self.snapshots(now)) {
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

    /// A snapshot of every row in turn; rows of one speed on equal supports share their adjoint motions.
    pub(super) fn snapshots<'s>(&'s self, now: &'s Evaluation) -> impl Iterator<Item = Snapshot<'s>> {
        let groups = &now.responses.groups;
        let mut left = vec![0; groups.first.len()];
        groups.of_row.iter().for_each(|group| left[*group] += 1);
        let mut shared: Vec<Option<Arc<ProbeFields>>> = vec![None; groups.first.len()];
        groups.of_row.iter().enumerate().map(move |(r, group)| {
            let known = shared[*group].take();
            let of_probes = known.unwrap_or_else(|| Arc::new(ProbeFields::new(self, now, r)));
            left[*group] -= 1;
            // kept while another row needs it
            shared[*group] = (left[*group] > 0).then(|| of_probes.clone());
            Snapshot::beside(of_probes, self, now, r)
        })
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

/// Motions of the shaft in one sense of whirl, at every nodal coordinate.
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
    /// Of each force of the plant, in the first field.
    sizes: &'a [C],
    /// Of each probe in its own field: a unit force in its direction.
    probes: &'a [C],
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
            add(probe, sense.probes.column(probe), *unit);
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

/// What the rows of one speed on equal supports share: the adjoint motion of the shaft for a unit of each probe.
struct ProbeFields<'a> {
    plant: &'a ModalShaft,
    speed_rad_s: f64,
    loss: C,
    gains: [Vec<C>; 2],
    forward: Fields,
    backward: Fields,
    supports: Supports,
    /// Beyond the nominal ones.
    excess: Supports,
    /// Force of each support for each probe, forward and backward.
    held: Vec<Vec<[C; 2]>>,
    /// Number of each held place among the plant's.
    places: Vec<usize>,
    /// Probes on housings: number, bearing, and what they read of it forward and backward.
    mounted: Vec<(usize, usize, [C; 2])>,
}

impl<'a> ProbeFields<'a> {
    fn new(problem: &'a Problem, now: &Evaluation, r: usize) -> Self {
        let plant = &*problem.plant;
        let (speed_rad_s, damping) = (problem.speed_rad_s(&now.terms, r), now.terms.internal_damping_s);
        let (supports, places) = (problem.supports(&now.terms, r), problem.places());
        let adjoint = &now.responses.of(r).adjoint;
        let reading = |on: &Mounted| (on.probe, adjoint_circular(on.reading.iter()));
        let readings: Vec<_> = problem.mounted(&now.terms, r).iter().map(reading).collect();
        let excess = supports.clone().excess(&nominal(plant, speed_rad_s, damping));
        let of_columns =
            |m: &DMatrix<C>| -> Vec<_> { m.column_iter().map(|c| adjoint_circular(c.iter())).collect() };
        let beyond = of_columns(&excess.adjoint_forces(adjoint));
        let gains = [plant.forward_gains(speed_rad_s), plant.backward_gains(speed_rad_s, damping)];
        let fields = |modes: &WhirlModes, sense: usize, sign: f64| {
            let mut held = DMatrix::from_fn(places.len(), adjoint.ncols(), |i, p| -beyond[p][i][sense]);
            for (probe, reading) in &readings {
                (0..places.len()).for_each(|i| held[(i, *probe)] -= reading[i][sense]);
            }
            let unit = |a: &f64| C::from_polar(1.0, sign * a);
            let probes: Vec<C> = plant.probe_angles_rad.iter().map(unit).collect();
            let acting = WhirlForces { places: &places, held, sizes: &[], probes: &probes };
            Fields::new(modes, &gains[sense], &acting)
        };
        let read_of = |(probe, reading): &(usize, Vec<[C; 2]>)| {
            places.iter().zip(reading).map(|(place, read)| (*probe, *place, *read)).collect::<Vec<_>>()
        };
        Self {
            plant,
            speed_rad_s,
            loss: loss(speed_rad_s, damping),
            forward: fields(&plant.forward, 0, -1.0),
            backward: fields(&plant.backward, 1, 1.0),
            held: of_columns(&supports.adjoint_forces(adjoint)),
            mounted: readings.iter().flat_map(read_of).collect(),
            gains,
            supports,
            excess,
            places,
        }
    }
}

/// One row of the data, ready for every error.
pub(super) struct Snapshot<'a> {
    of_probes: Arc<ProbeFields<'a>>,
    plant: &'a ModalShaft,
    speed_rad_s: f64,
    /// Motion of the shaft.
    forward: Fields,
    backward: Fields,
    /// Size of each force of the plant.
    sizes: Vec<C>,
    /// Force of each support, forward and backward.
    held: Vec<[C; 2]>,
}

impl<'a> Snapshot<'a> {
    /// A snapshot of one of the rows that share these adjoint motions.
    fn beside(of_probes: Arc<ProbeFields<'a>>, problem: &Problem, now: &Evaluation, r: usize) -> Self {
        let ProbeFields { plant, speed_rad_s, places, gains, .. } = &*of_probes;
        let (plant, speed_rad_s) = (*plant, *speed_rad_s);
        let motion = &now.motion[r];
        let beyond = circular(of_probes.excess.forces(motion).iter());
        let sizes = problem.sizes_on_plant(now, r);
        let fields = |modes: &WhirlModes, sense: usize, sizes: &[C]| {
            let held = DMatrix::from_fn(places.len(), 1, |i, _| -beyond[i][sense]);
            Fields::new(modes, &gains[sense], &WhirlForces { places, held, sizes, probes: &[] })
        };
        // forces that turn with the shaft have no backward part
        let (forward, backward) = (fields(&plant.forward, 0, &sizes), fields(&plant.backward, 1, &[]));
        let held = circular(of_probes.supports.forces(motion).iter());
        Self { of_probes, plant, speed_rad_s, forward, backward, sizes, held }
    }

    fn probes(&self) -> usize {
        self.plant.probe_angles_rad.len()
    }

    /// What a probe shows, its gain left out, of a unit force that turns forward and of one that turns backward.
    pub(super) fn under_force(&self, at: &NodalSum, probe: usize) -> [C; 2] {
        [self.of_probes.forward.along(at, probe), self.of_probes.backward.along(at, probe)]
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
                    self.of_probes.forward.along(place, p) * forward
                        + self.of_probes.backward.along(place, p) * backward
                })
            }
            DrawingChange::Disk { number, displacement, tilt, inertia } => {
                self.disk_slopes(*number, displacement, tilt, *inertia)
            }
            DrawingChange::Bearing { number, rate } => {
                let motion = self.motion(rate);
                each(&|p| {
                    let housing = self
                        .of_probes
                        .mounted
                        .iter()
                        .filter(|(probe, place, _)| (probe, place) == (&p, number));
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
                each(&|p| self.of_probes.forward.along(rate, p) * size)
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
        let (w2, of_probes) = (self.speed_rad_s * self.speed_rad_s, &self.of_probes);
        let force = |pattern| self.sizes[self.plant.column(Force::Pattern(pattern))];
        let forces = [Pattern::DiskUnbalance(number), Pattern::DiskTilt(number)].map(force);
        let [moving, moving_rate, tilting, tilting_rate] =
            [here, rate, tilt, tilt_rate].map(|a| self.motion(a));
        let slope = |p: usize| {
            let whirl = |fields: &Fields, s: usize, polar: f64| {
                let moved = fields.along(here, p) * moving_rate[s] + fields.along(rate, p) * moving[s];
                let tilted =
                    fields.along(tilt, p) * tilting_rate[s] + fields.along(tilt_rate, p) * tilting[s];
                moved * mass + tilted * (diametral - polar)
            };
            (whirl(&of_probes.forward, 0, polar) + whirl(&of_probes.backward, 1, -polar)) * w2
                + of_probes.forward.along(rate, p) * forces[0]
                + of_probes.forward.along(tilt_rate, p) * forces[1]
                + self.support_slope(self.plant.bearings + number, rate, moving_rate, p)
        };
        (0..self.probes()).map(slope).collect()
    }

    /// A support moves along the shaft, which moves by so much per deviation there: what it feels changes, and where it pushes.
    fn support_slope(&self, place: usize, rate: &NodalSum, motion: [C; 2], probe: usize) -> C {
        let of_probes = &self.of_probes;
        let Some(i) = of_probes.places.iter().position(|p| *p == place) else { return C::from(0.0) };
        let sense = |fields: &Fields, s: usize| {
            fields.along(rate, probe) * self.held[i][s] + of_probes.held[probe][i][s] * motion[s]
        };
        -(sense(&of_probes.forward, 0) + sense(&of_probes.backward, 1))
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
            if self.of_probes.loss.im != 0.0 {
                behind += times(&e.stiffness, &motion) * (self.of_probes.loss - 1.0);
            }
            for (p, slope) in slopes.iter_mut().enumerate() {
                *slope -= self.of_probes.forward.element(e.number, p).dot(&ahead);
                *slope -= self.of_probes.backward.element(e.number, p).dot(&behind);
            }
        }
        slopes
    }
}

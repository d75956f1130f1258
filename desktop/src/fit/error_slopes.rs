//! What each error of the drawing does to the response, exactly and at once.
//!
//! An error changes the dynamic stiffness by `dZ`, a force by `dF` or the place of a probe, and the
//! response by `dY = λᵀ (dF − dZ q) + dpᵀ q`, with `q` the motion of the whole shaft and `λ` its adjoint
//! motion for a unit of that probe. Both come from the modes of the plant and the forces of the supports;
//! what is left is a sum over the few finite elements or places that the error concerns.

use nalgebra::{Complex, DMatrix, Matrix4, Vector4};

use super::drawing_errors::{Change, DrawingErrors, ElementChange};
use super::problem::{Evaluated, Problem};
use crate::effects::Pattern;
use crate::receptance::plant::{Force, Plant, Sense, loss};
use crate::receptance::update::nominal;
use crate::shaft::nodal::Row;

type C = Complex<f64>;
const I: C = C::new(0.0, 1.0);

impl<const D: usize> Problem<'_, D> {
    /// Change of the model at every value per standard deviation of each error, the linear unknowns held,
    /// in noise units; the problem's plant must be that of the same drawing.
    pub(super) fn error_derivative(&self, errors: &DrawingErrors) -> Option<DMatrix<f64>> {
        let now = self.evaluated()?;
        let mut d = DMatrix::zeros(2 * self.data.count(), errors.changes.len());
        let mut at = 0;
        for (r, row) in self.data.rows.iter().enumerate() {
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
        Some(d)
    }
}

/// Motion of the shaft in one sense of whirl, at every nodal coordinate: the machine's first, then the
/// adjoint of each probe.
struct Fields(DMatrix<f64>);

impl Fields {
    fn at(&self, coordinate: usize, field: usize) -> C {
        C::new(self.0[(coordinate, 2 * field)], self.0[(coordinate, 2 * field + 1)])
    }

    fn along(&self, row: &Row, field: usize) -> C {
        row.iter().map(|(k, v)| self.at(*k, field) * *v).sum()
    }

    fn element(&self, number: usize, field: usize) -> Vector4<C> {
        Vector4::from_fn(|i, _| self.at(2 * number + i, field))
    }

    /// Product of adjoint and motion at two places, for each probe's adjoint.
    fn product(&self, adjoint: &Row, motion: &Row, probe: usize) -> C {
        self.along(adjoint, 1 + probe) * self.along(motion, 0)
    }
}

/// One row of the data, ready for every error.
pub(super) struct Snapshot<'a> {
    plant: &'a Plant,
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
    pub(super) fn new<const D: usize>(problem: &'a Problem<D>, now: &Evaluated<D>, r: usize) -> Self {
        let plant = &*problem.plant;
        let (speed_rad_s, damping) = (problem.speed_rad_s(&now.terms, r), now.terms.internal_damping_s);
        let mut sizes = vec![C::from(0.0); plant.forward.forces.ncols()];
        let known = C::from(1.0);
        for (column, size) in
            problem.columns_of(r, speed_rad_s).iter().zip(now.solved.unknowns.iter().chain([&known]))
        {
            column.iter().for_each(|(force, factor)| sizes[*force] += factor * size);
        }
        let (supports, places) = (problem.supports(&now.terms, r), problem.places());
        let (motion, adjoint) = (&now.motion[r], &now.responses[r].adjoint);
        let mounted = problem.mounted(&now.terms, r);
        // forces are ½ (Fx ± iFy) forward and backward, their adjoints Fx ∓ iFy
        let circular = |x: C, y: C| [(x + I * y) * 0.5, (x - I * y) * 0.5];
        let adjoint_circular = |x: C, y: C| [x - I * y, x + I * y];
        let held = supports.forces(motion);
        let adjoint_held: Vec<_> = adjoint.iter().map(|a| supports.adjoint_forces(a)).collect();
        let spring = nominal(plant, speed_rad_s, damping);
        let excess = |i: usize, total: [C; 2], motion: [C; 2], spring: nalgebra::Matrix2<C>| {
            if places[i] < plant.bearings {
                let n = spring * nalgebra::Vector2::from(motion);
                [total[0] - n[0], total[1] - n[1]]
            } else {
                total
            }
        };
        let count = places.len();
        let pair = |v: &nalgebra::SVector<C, D>, i: usize| [v[2 * i], v[2 * i + 1]];
        let beyond: Vec<[C; 2]> = (0..count)
            .map(|i| {
                let [x, y] = excess(i, pair(&held, i), pair(motion, i), spring);
                circular(x, y)
            })
            .collect();
        let beyond_adjoint: Vec<Vec<[C; 2]>> = (0..adjoint.len())
            .map(|p| {
                let at = |i| {
                    let [x, y] =
                        excess(i, pair(&adjoint_held[p], i), pair(&adjoint[p], i), spring.transpose());
                    adjoint_circular(x, y)
                };
                (0..count).map(at).collect()
            })
            .collect();
        let fields = |sense: &Sense, gains: &[C], which: usize| {
            let n = gains.len();
            let mut modal = DMatrix::zeros(n, 2 * (1 + adjoint.len()));
            let mut add = |field: usize, column: &[f64], factor: C| {
                for (k, v) in column.iter().enumerate() {
                    modal[(k, 2 * field)] += v * factor.re;
                    modal[(k, 2 * field + 1)] += v * factor.im;
                }
            };
            let column = |m: &'a DMatrix<f64>, j: usize| &m.as_slice()[j * n..(j + 1) * n];
            if which == 0 {
                for (f, size) in sizes.iter().enumerate().filter(|(_, s)| **s != C::from(0.0)) {
                    add(0, column(&plant.forward.forces, f), *size);
                }
            }
            let m: &'a Sense = if which == 0 { &plant.forward } else { &plant.backward };
            for (i, place) in places.iter().enumerate() {
                add(0, column(&m.held, *place), -beyond[i][which]);
            }
            for (p, angle) in plant.probe_angles_rad.iter().enumerate() {
                let sign = if which == 0 { -1.0 } else { 1.0 };
                add(1 + p, column(&m.probes, p), C::from_polar(1.0, sign * angle));
                for on in mounted.iter().filter(|on| on.probe == p) {
                    for (i, place) in places.iter().enumerate() {
                        let read = adjoint_circular(on.reading[2 * i], on.reading[2 * i + 1])[which];
                        add(1 + p, column(&m.held, *place), -read);
                    }
                }
                for (i, place) in places.iter().enumerate() {
                    add(1 + p, column(&m.held, *place), -beyond_adjoint[p][i][which]);
                }
            }
            for (k, gain) in gains.iter().enumerate() {
                for field in 0..=adjoint.len() {
                    let v = C::new(modal[(k, 2 * field)], modal[(k, 2 * field + 1)]) * gain;
                    (modal[(k, 2 * field)], modal[(k, 2 * field + 1)]) = (v.re, v.im);
                }
            }
            Fields(&sense.shapes * modal)
        };
        Self {
            plant,
            speed_rad_s,
            loss: loss(speed_rad_s, damping),
            forward: fields(&plant.forward, &plant.forward_gains(speed_rad_s), 0),
            backward: fields(&plant.backward, &plant.backward_gains(speed_rad_s, damping), 1),
            held: (0..count).map(|i| circular(held[2 * i], held[2 * i + 1])).collect(),
            adjoint_held: adjoint_held
                .iter()
                .map(|a| (0..count).map(|i| adjoint_circular(a[2 * i], a[2 * i + 1])).collect())
                .collect(),
            sizes,
            mounted: mounted
                .iter()
                .flat_map(|on| {
                    let read = |i: usize| adjoint_circular(on.reading[2 * i], on.reading[2 * i + 1]);
                    places.iter().enumerate().map(move |(i, place)| (on.probe, *place, read(i)))
                })
                .collect(),
            places,
        }
    }

    fn probes(&self) -> usize {
        self.plant.probe_angles_rad.len()
    }

    /// What a probe shows, its gain left out, of a unit force that turns forward and of one that turns backward.
    pub(super) fn under_force(&self, at: &Row, probe: usize) -> [C; 2] {
        [self.forward.along(at, 1 + probe), self.backward.along(at, 1 + probe)]
    }

    /// Motion of the shaft forward and backward, m.
    pub(super) fn motion(&self, at: &Row) -> [C; 2] {
        [self.forward.along(at, 0), self.backward.along(at, 0)]
    }

    /// Change at every probe, its gain left out.
    fn slopes(&self, change: &Change) -> Vec<C> {
        let w2 = self.speed_rad_s * self.speed_rad_s;
        let each = |f: &dyn Fn(usize) -> C| (0..self.probes()).map(f).collect::<Vec<C>>();
        match change {
            Change::Elements(all) => self.element_slopes(all),
            Change::Inertia { displacement, tilt, inertia: [mass, diametral, polar] } => each(&|p| {
                let whirl = |fields: &Fields, polar: f64| {
                    let moved = fields.product(displacement, displacement, p) * *mass;
                    moved + fields.product(tilt, tilt, p) * (diametral - polar)
                };
                (whirl(&self.forward, *polar) + whirl(&self.backward, -polar)) * w2
            }),
            Change::Disk { number, displacement: [here, rate], tilt: [tilt, tilt_rate], inertia } => {
                each(&|p| {
                    let [mass, diametral, polar] = *inertia;
                    let whirl = |fields: &Fields, polar: f64| {
                        let moved = fields.product(here, rate, p) + fields.product(rate, here, p);
                        let tilted = fields.product(tilt, tilt_rate, p) + fields.product(tilt_rate, tilt, p);
                        moved * mass + tilted * (diametral - polar)
                    };
                    let force = |pattern| self.sizes[self.plant.column(Force::Pattern(pattern))];
                    (whirl(&self.forward, polar) + whirl(&self.backward, -polar)) * w2
                        + self.forward.along(rate, 1 + p) * force(Pattern::DiskUnbalance(*number))
                        + self.forward.along(tilt_rate, 1 + p) * force(Pattern::DiskTilt(*number))
                        + self.support_slope(self.plant.bearings + number, rate, p)
                })
            }
            Change::Bearing { number, rate } => each(&|p| {
                let housing = self.mounted.iter().filter(|(probe, place, _)| (probe, place) == (&p, number));
                let moved = housing.map(|(_, _, [forward, backward])| {
                    forward * self.forward.along(rate, 0) + backward * self.backward.along(rate, 0)
                });
                self.support_slope(*number, rate, p) - moved.sum::<C>()
            }),
            Change::Probe { number, rate } => each(&|p| {
                if p != *number {
                    return C::from(0.0);
                }
                let turn = C::from_polar(1.0, self.plant.probe_angles_rad[p]);
                turn.conj() * self.forward.along(rate, 0) + turn * self.backward.along(rate, 0)
            }),
            Change::Plane { force, rate } => {
                let size = self.sizes[self.plant.column(*force)];
                each(&|p| self.forward.along(rate, 1 + p) * size)
            }
        }
    }

    /// A support moves along the shaft: what it feels changes, and where it pushes.
    fn support_slope(&self, place: usize, rate: &Row, probe: usize) -> C {
        let Some(i) = self.places.iter().position(|p| *p == place) else { return C::from(0.0) };
        let sense = |fields: &Fields, s: usize| {
            fields.along(rate, 1 + probe) * self.held[i][s]
                + self.adjoint_held[probe][i][s] * fields.along(rate, 0)
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
        for e in changes {
            let forward = e.stiffness - (e.mass - e.polar_inertia) * w2;
            let backward = e.stiffness - (e.mass + e.polar_inertia) * w2;
            let mut ahead = times(&forward, &self.forward.element(e.number, 0));
            for (size, force) in e.bends.iter().map(|(pattern, force)| (size(*pattern), force)) {
                if size != C::from(0.0) {
                    ahead -= force.map(|v| size * v);
                }
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

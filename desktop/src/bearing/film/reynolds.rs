//! The Reynolds equation of one pad: an arc of constant radius around a parallel journal.
//!
//! Lengths across the film in pad clearances c, along it θ and ζ = 2z/L, time τ = Ωt, pressure in
//! 6 μ Ω (R/c)²:
//!
//! `∂/∂θ (H³ ∂P/∂θ) + (D/L)² ∂/∂ζ (H³ ∂P/∂ζ) = ∂H/∂θ + 2 ∂H/∂τ`
//!
//! P = 0 at the pad's edges and at the ends of the bearing; where the film would pull it cavitates,
//! P ≥ 0 with a smooth edge (Swift 1932, Stieber 1933, the Reynolds condition). Finite volumes of second
//! order on half the length; the edge of the film by the primal-dual active set method (Hintermüller,
//! Ito & Kunisch, SIAM J. Optim. 13, 2002), which ends in a few steps because the matrix is an M-matrix.

use nalgebra::Matrix2;

use super::banded::Band;

/// Largest step of the mesh along the film, rad.
const STEP: f64 = 1.5 * std::f64::consts::PI / 180.0;
/// Intervals of the mesh over half the length; even, for Simpson's rule.
const HALF_LENGTH: usize = 12;
/// More changes of the cavitated region than any film needed.
const MOST_STEPS: usize = 100;

/// The mesh of one pad.
#[derive(Debug, Clone)]
pub(super) struct Pad {
    start: f64,
    step: f64,
    intervals: usize,
    /// (D/L)².
    slenderness: f64,
}

/// What the film of a pad does, in units of 6 μ Ω R L (R/c)² for forces.
#[derive(Debug, Clone, Copy)]
pub(super) struct PadFilm {
    /// Force on the journal in x and y.
    pub(super) force: [f64; 2],
    /// Loss of force in x (row 0) and y per motion of the journal in x and y.
    pub(super) stiffness: Matrix2<f64>,
    /// The same per velocity, time in 1/Ω.
    pub(super) damping: Matrix2<f64>,
}

/// Cavitated nodes of one pad; a solution begins with the last one's.
pub(super) type Cavity = Vec<bool>;

impl Pad {
    /// A pad from `start`, `arc` long, rad, of a bearing `length_ratio` = L/D long.
    pub(super) fn new(start: f64, arc: f64, length_ratio: f64) -> Self {
        Self::with_step(start, arc, length_ratio, STEP)
    }

    fn with_step(start: f64, arc: f64, length_ratio: f64, largest: f64) -> Self {
        let intervals = (arc / largest - 1e-9).ceil().max(8.0) as usize;
        Self { start, step: arc / intervals as f64, intervals, slenderness: length_ratio.powi(-2) }
    }

    fn angle(&self, index: f64) -> f64 {
        self.start + self.step * index
    }

    /// Film thickness at node `index` (halves are between nodes) around a journal at `[x, y]` from the
    /// centre of the pad's arc.
    fn gap(&self, index: f64, [x, y]: [f64; 2]) -> f64 {
        let (sin, cos) = self.angle(index).sin_cos();
        1.0 - x * cos - y * sin
    }

    /// The thinnest film of the pad.
    pub(super) fn thinnest(&self, journal: [f64; 2]) -> f64 {
        (0..=self.intervals).map(|i| self.gap(i as f64, journal)).fold(f64::INFINITY, f64::min)
    }

    /// Sine of the angle from 0 to the farther edge.
    pub(super) fn reach(&self) -> f64 {
        let end = self.angle(self.intervals as f64);
        end.abs().max(self.start.abs()).min(std::f64::consts::FRAC_PI_2).sin()
    }

    fn unknowns(&self) -> usize {
        (self.intervals - 1) * HALF_LENGTH
    }

    /// Conductance along the film at each middle of an interval, and across it at each inner node, per
    /// unit of the other direction's width.
    fn conductances(&self, cube: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let along = (0..self.intervals).map(|i| cube(i as f64 + 0.5) / self.step).collect();
        let across = (1..self.intervals)
            .map(|i| cube(i as f64) * self.slenderness * self.step * HALF_LENGTH as f64)
            .collect();
        (along, across)
    }

    /// Net flow out of each volume under pressure `p`.
    fn outflow(&self, (along, across): &(Vec<f64>, Vec<f64>), p: &[f64]) -> Vec<f64> {
        let at = |i: usize, j: usize| {
            if i == 0 || i == self.intervals || j == HALF_LENGTH { 0.0 } else { p[(i - 1) * HALF_LENGTH + j] }
        };
        let mut out = Vec::with_capacity(p.len());
        for i in 1..self.intervals {
            for j in 0..HALF_LENGTH {
                let here = at(i, j);
                let mut flow =
                    width(j) * (along[i - 1] * (here - at(i - 1, j)) + along[i] * (here - at(i + 1, j)));
                flow += across[i - 1] * (here - at(i, j + 1));
                if j > 0 {
                    flow += across[i - 1] * (here - at(i, j - 1));
                }
                out.push(flow);
            }
        }
        out
    }

    /// How much better a wet node is drained because the film's edge lies between it and its dry neighbour along
    /// the film, beside what the neighbour's P = 0 drains.
    ///
    /// At the edge the pressure is a parabola that touches zero; with the last wet node's pressure r times that of
    /// the one before, the finite volumes' parabola ends `√(2/(1 − 2r)) − 1` steps beyond the last. Without this
    /// the coefficients would jump with each node that falls dry.
    fn edges(&self, (along, _): &(Vec<f64>, Vec<f64>), p: &[f64], cavity: &[bool]) -> Vec<f64> {
        let beyond =
            |last: f64, before: f64| (2.0 / (1.0 - 2.0 * (last / before).clamp(0.0, 0.4))).sqrt() - 1.0;
        let mut more = vec![0.0; p.len()];
        for i in 2..self.intervals - 1 {
            for j in 0..HALF_LENGTH {
                let here = (i - 1) * HALF_LENGTH + j;
                let (upstream, downstream) = (here - HALF_LENGTH, here + HALF_LENGTH);
                if cavity[here] {
                    continue;
                }
                for (face, dry, wet) in
                    [(along[i], downstream, upstream), (along[i - 1], upstream, downstream)]
                {
                    if cavity[dry] && !cavity[wet] {
                        more[here] += width(j) * face * (1.0 / beyond(p[here], p[wet]) - 1.0);
                    }
                }
            }
        }
        more
    }

    /// The factors of the outflow, with P = 0 held in the cavity and `more` drained from each node.
    fn factors(&self, (along, across): &(Vec<f64>, Vec<f64>), cavity: &[bool], more: &[f64]) -> Band {
        let mut band = Band::zeros(self.unknowns(), HALF_LENGTH);
        for i in 1..self.intervals {
            for j in 0..HALF_LENGTH {
                let row = (i - 1) * HALF_LENGTH + j;
                if cavity[row] {
                    band.set(row, 0, 1.0);
                    continue;
                }
                let ends = if j > 0 { 2.0 } else { 1.0 };
                band.set(row, 0, width(j) * (along[i - 1] + along[i]) + ends * across[i - 1] + more[row]);
                if j > 0 && !cavity[row - 1] {
                    band.set(row, 1, -across[i - 1]);
                }
                if i > 1 && !cavity[row - HALF_LENGTH] {
                    band.set(row, HALF_LENGTH, -width(j) * along[i - 1]);
                }
            }
        }
        band.factor()
    }

    /// A source of the same size at every ζ: `per_node[i − 1]` per unit of width.
    fn spread(&self, per_node: impl Fn(usize) -> f64) -> Vec<f64> {
        (1..self.intervals)
            .flat_map(|i| {
                let source = per_node(i);
                (0..HALF_LENGTH).map(move |j| source * width(j))
            })
            .collect()
    }

    /// ∫∫ P (cos θ, sin θ) dθ dζ over half the length.
    fn lift(&self, p: &[f64]) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for (i, row) in p.chunks(HALF_LENGTH).enumerate() {
            let (sin, cos) = self.angle(i as f64 + 1.0).sin_cos();
            let line: f64 = row.iter().enumerate().map(|(j, p)| p * simpson(j)).sum();
            sum[0] += line * cos * self.step;
            sum[1] += line * sin * self.step;
        }
        sum
    }

    /// Pressure at the inner nodes, θ slowest.
    fn pressure(&self, journal: [f64; 2], velocity: [f64; 2], cavity: &mut Cavity) -> Vec<f64> {
        let gap = |i: f64| self.gap(i, journal);
        let conductances = self.conductances(|i| gap(i).powi(3));
        let source = self.spread(|i| {
            let i = i as f64;
            let squeeze = 1.0 - self.gap(i, velocity);
            gap(i - 0.5) - gap(i + 0.5) + 2.0 * squeeze * self.step
        });
        cavity.resize(self.unknowns(), false);
        let level = vec![0.0; self.unknowns()];
        for step in 0.. {
            let factors = self.factors(&conductances, cavity, &level);
            let mut p: Vec<f64> =
                source.iter().zip(&*cavity).map(|(s, &empty)| if empty { 0.0 } else { *s }).collect();
            factors.solve(&mut p);
            let surplus = self.outflow(&conductances, &p);
            let mut settled = true;
            for (k, empty) in cavity.iter_mut().enumerate() {
                let now = if *empty { surplus[k] >= source[k] } else { p[k] < 0.0 };
                settled &= now == *empty;
                *empty = now;
            }
            if settled || step == MOST_STEPS {
                return p;
            }
        }
        unreachable!("the loop only ends by returning")
    }

    /// Force on a journal at `journal` from the arc's centre that moves with `velocity`, per Ω c.
    pub(super) fn force(&self, journal: [f64; 2], velocity: [f64; 2], cavity: &mut Cavity) -> [f64; 2] {
        self.lift(&self.pressure(journal, velocity, cavity)).map(|f| -f)
    }

    /// Force and its derivatives for a journal at rest at `journal` from the arc's centre.
    ///
    /// The derivatives are those of the equation (Lund & Thomsen 1978): the perturbed pressure vanishes at
    /// the film's edge, since there both the pressure and its slope are zero.
    pub(super) fn film(&self, journal: [f64; 2], cavity: &mut Cavity) -> PadFilm {
        let p = self.pressure(journal, [0.0; 2], cavity);
        let conductances = self.conductances(|i| self.gap(i, journal).powi(3));
        let factors = self.factors(&conductances, cavity, &self.edges(&conductances, &p, cavity));
        let mut stiffness = Matrix2::zeros();
        let mut damping = Matrix2::zeros();
        for (axis, direction) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
            let opening = |i: f64| self.gap(i, direction) - 1.0;
            let change = self.conductances(|i| 3.0 * self.gap(i, journal).powi(2) * opening(i));
            let shear = self.spread(|i| opening(i as f64 - 0.5) - opening(i as f64 + 0.5));
            let drained = self.outflow(&change, &p);
            let displaced = shear.iter().zip(&drained).map(|(s, d)| s - d).collect();
            let squeezed = self.spread(|i| -2.0 * opening(i as f64) * self.step);
            for (source, matrix) in [(displaced, &mut stiffness), (squeezed, &mut damping)] {
                let mut source: Vec<f64> = source;
                for (s, _) in source.iter_mut().zip(&*cavity).filter(|(_, empty)| **empty) {
                    *s = 0.0;
                }
                factors.solve(&mut source);
                let lift = self.lift(&source);
                matrix[(0, axis)] = lift[0];
                matrix[(1, axis)] = lift[1];
            }
        }
        PadFilm { force: self.lift(&p).map(|f| -f), stiffness, damping }
    }
}

/// Width of the volumes at ζ node `j`: half a one lies on the plane of symmetry.
fn width(j: usize) -> f64 {
    (if j == 0 { 0.5 } else { 1.0 }) / HALF_LENGTH as f64
}

/// Weight of ζ node `j` in Simpson's rule; the last node's pressure is zero.
fn simpson(j: usize) -> f64 {
    let times = match j {
        0 => 1.0,
        _ if j % 2 == 1 => 4.0,
        _ => 2.0,
    };
    times / (3.0 * HALF_LENGTH as f64)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;

    /// Without flow across, `P' = (H − H*) / H³` from the widest gap to the edge, where H = H* and P = 0
    /// (Sommerfeld's long bearing with the Reynolds condition); by Simpson's rule and bisection.
    #[test]
    fn long_bearing_midplane_pressure_equals_sommerfeld_equation() {
        for e in [0.2, 0.5, 0.8] {
            let gap = |angle: f64| 1.0 + e * angle.cos();
            let pressure = |edge: f64, angle: f64| {
                let slope = |a: f64| (gap(a) - gap(edge)) / gap(a).powi(3);
                let n = 2000;
                let h = angle / n as f64;
                let weight = |i: usize| if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
                (0..=n).map(|i| weight(i) * slope(i as f64 * h)).sum::<f64>() * h / 3.0
            };
            let (mut low, mut high) = (PI, 1.6 * PI);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if pressure(middle, middle) > 0.0 { low = middle } else { high = middle }
            }
            let pad = Pad::new(PI, TAU, 100.0);
            let p = pad.pressure([e, 0.0], [0.0; 2], &mut Cavity::new());
            let highest = p.iter().copied().fold(0.0, f64::max);
            for (i, row) in p.chunks(HALF_LENGTH).enumerate() {
                let angle = pad.angle(i as f64 + 1.0) - PI;
                let expected = if angle < low { pressure(low, angle) } else { 0.0 };
                assert!(
                    (row[0] - expected).abs() < 3e-3 * highest,
                    "ε {e} at {angle}: {} {expected}",
                    row[0]
                );
            }
        }
    }

    #[test]
    fn film_force_and_coefficients_converge_when_step_is_halved() {
        for (journal, allowed) in [([0.2, -0.4], 0.005), ([0.2, -0.9], 0.01)] {
            let film = |step: f64| {
                Pad::with_step(-170f64.to_radians(), 160f64.to_radians(), 0.6, step)
                    .film(journal, &mut Cavity::new())
            };
            let (coarse, fine) = (film(STEP), film(STEP / 2.0));
            let off = |a: Matrix2<f64>, b: Matrix2<f64>| (a - b).amax() / b.norm();
            assert!(off(coarse.stiffness, fine.stiffness) < allowed);
            assert!(off(coarse.damping, fine.damping) < allowed);
            let size = fine.force[0].hypot(fine.force[1]);
            assert!((0..2).all(|i| (coarse.force[i] - fine.force[i]).abs() < 0.003 * size));
        }
    }
}

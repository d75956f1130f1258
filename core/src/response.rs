//! The dynamic stiffness at one speed, solved once: influence of the unbalance, and what is there without it.

#[cfg(test)]
mod tests;

use core::array;

use nalgebra::{Complex, SMatrix, SVector};

use crate::linear::{self, Row, Solution};
use crate::model::{ForcingLaw, MAX_PLANES, MAX_SUPPORTS, Model, Pair};
use crate::reading::{FEATURES, PROBES};
use crate::scalar;

type C = Complex<f32>;

/// One right-hand side per plane, and one for the sum of the forcings.
const SIDES: usize = MAX_PLANES + 1;

/// The 2N equations Z q = F, and their solution, q = [p; r].
type System<const N: usize> = [[Row<C, N, SIDES>; N]; 2];
type Motion<const N: usize> = Solution<C, N, SIDES>;

/// Amplitude of the shaft along x and y at each support, µm zero-to-peak: what hardening supports depend on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SupportAmplitudes(pub [Pair; MAX_SUPPORTS]);

/// Why there is no response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ResponseError {
    /// The dynamic stiffness is singular at this speed.
    Singular,
    /// A number overflowed or was not one.
    NotFinite,
}

/// A motion that is linear in the unbalance, as phasors: `fixed + Σ per_unbalance·u`, `u = U e^{iα}` of each plane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Linear {
    /// µm per g·mm of each plane.
    pub per_unbalance: [Complex<f32>; MAX_PLANES],
    /// µm, from forcings (and runout, for a probe).
    pub fixed: Complex<f32>,
}

impl Linear {
    /// Phasor for an unbalance `[U cos α, U sin α]` of each plane, µm.
    #[inline]
    pub fn phasor(&self, unbalance_g_mm: &[Pair; MAX_PLANES]) -> Complex<f32> {
        let [first, second] = self.per_unbalance;
        let [a, b] = unbalance_g_mm.map(|[x, y]| Complex::new(x, y));
        self.fixed + first * a + second * b
    }
}

/// Response of the model at one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// µm per g·mm: complex influence coefficients, probes × planes (zero for an absent plane).
    pub per_unbalance: [[Complex<f32>; MAX_PLANES]; PROBES],
    /// µm, from forcings and runout.
    pub fixed: [Complex<f32>; PROBES],
    /// Motion of the shaft along x and y at each support; left zero where the support does not harden.
    pub supports: [[Linear; 2]; MAX_SUPPORTS],
}

/// Solves the model at one speed.
///
/// Errors: [`ResponseError::Singular`], [`ResponseError::NotFinite`].
// Large, and called from several places: one copy in flash.
#[inline(never)]
pub fn response<const N: usize>(
    model: &Model<N>,
    speed_rad_s: f32,
    support_amplitudes_um: &SupportAmplitudes,
) -> Result<Response, ResponseError> {
    let mut system = [[Row::zero(); N]; 2];
    add_shaft(&mut system, model, speed_rad_s);
    add_supports(&mut system, model, speed_rad_s, support_amplitudes_um);
    add_forces(&mut system, model, speed_rad_s);
    let motion = linear::solve(&mut system).ok_or(ResponseError::Singular)?;
    let response = Response::read(model, &motion);
    if response.is_finite(model.supports.len()) { Ok(response) } else { Err(ResponseError::NotFinite) }
}

fn add_shaft<const N: usize>(system: &mut System<N>, model: &Model<N>, speed: f32) {
    let [top, bottom] = system;
    let square = speed * speed;
    let lag = speed * model.internal_damping_s;
    for i in 0..N {
        for j in 0..N {
            // nalgebra keeps columns: [j][i] is row i, column j.
            let k = model.stiffness.data.0[j][i];
            let m = model.mass.data.0[j][i];
            let g = model.polar_inertia.data.0[j][i];
            let direct = C::new(k - square * m, lag * k);
            let cross = C::new(lag * k, square * g);
            top[i].cells[0][j] = direct;
            top[i].cells[1][j] = cross;
            bottom[i].cells[0][j] = -cross;
            bottom[i].cells[1][j] = direct;
        }
    }
}

fn add_supports<const N: usize>(
    system: &mut System<N>,
    model: &Model<N>,
    speed: f32,
    SupportAmplitudes(amplitudes): &SupportAmplitudes,
) {
    for (support, &amplitude) in model.supports.iter().zip(amplitudes) {
        let stiffness = support.dynamic_stiffness(speed, amplitude);
        let [shape] = &support.shape.data.0;
        for (rows, stiffness) in system.iter_mut().zip(&stiffness) {
            for (row, &here) in rows.iter_mut().zip(shape) {
                for (cells, &stiffness) in row.cells.iter_mut().zip(stiffness) {
                    let force = stiffness * here;
                    for (cell, &there) in cells.iter_mut().zip(shape) {
                        *cell += force * there;
                    }
                }
            }
        }
    }
}

fn add_forces<const N: usize>(system: &mut System<N>, model: &Model<N>, speed: f32) {
    let square = speed * speed;
    for (side, plane) in model.planes.iter().enumerate() {
        add_forward(system, plane, side, C::new(square, 0.0));
    }
    for forcing in &model.forcings {
        let [re, im] = forcing.amplitude;
        let law = match forcing.law {
            ForcingLaw::Constant => 1.0,
            ForcingLaw::SpeedSquared => square,
        };
        add_forward(system, &forcing.shape, MAX_PLANES, C::new(re, im) * law);
    }
}

/// A force that turns with the shaft: Fx = F, Fy = −iF.
#[inline]
fn add_forward<const N: usize>(system: &mut System<N>, shape: &SVector<f32, N>, side: usize, force: C) {
    let [shape] = &shape.data.0;
    for (rows, force) in system.iter_mut().zip([force, C::new(force.im, -force.re)]) {
        for (row, &here) in rows.iter_mut().zip(shape) {
            if let Some(value) = row.rhs.get_mut(side) {
                *value += force * here;
            }
        }
    }
}

/// φ·(cos p + sin r) for every right-hand side.
#[inline]
fn motion_at<const N: usize>(motion: &Motion<N>, shape: &SVector<f32, N>, direction: Pair) -> [C; SIDES] {
    let [shape] = &shape.data.0;
    let mut sum = [C::default(); SIDES];
    for (half, along) in motion.iter().zip(direction) {
        for (coordinate, &here) in half.iter().zip(shape) {
            for (sum, &value) in sum.iter_mut().zip(coordinate) {
                *sum += value * (here * along);
            }
        }
    }
    sum
}

impl Response {
    fn read<const N: usize>(model: &Model<N>, motion: &Motion<N>) -> Self {
        let mut response = Self {
            per_unbalance: Default::default(),
            fixed: Default::default(),
            supports: Default::default(),
        };
        let out = response.per_unbalance.iter_mut().zip(&mut response.fixed);
        for (probe, (per_unbalance, fixed)) in model.probes.iter().zip(out) {
            let [gain_re, gain_im] = probe.gain;
            let [runout_re, runout_im] = probe.runout_um;
            let [first, second, forced] =
                motion_at(motion, &probe.shape, probe.direction).map(|y| y * C::new(gain_re, gain_im));
            *per_unbalance = [first, second];
            *fixed = forced + C::new(runout_re, runout_im);
        }
        for (support, linear) in model.supports.iter().zip(&mut response.supports) {
            if support.hardening_per_um2 == 0.0 {
                continue;
            }
            *linear = [[1.0, 0.0], [0.0, 1.0]].map(|direction| {
                let [first, second, fixed] = motion_at(motion, &support.shape, direction);
                Linear { per_unbalance: [first, second], fixed }
            });
        }
        response
    }

    /// `supports`: how many there are; the rest is zero.
    fn is_finite(&self, supports: usize) -> bool {
        let finite = |z: &C| z.re.is_finite() && z.im.is_finite();
        let mut probes = self.per_unbalance.as_flattened().iter().chain(&self.fixed);
        let mut supports = self.supports.iter().take(supports).flatten();
        probes.all(finite)
            && supports.all(|motion| finite(&motion.fixed) && motion.per_unbalance.iter().all(finite))
    }

    /// Real 8×4 matrix H, µm per g·mm: features = offset + H·`[U1 cos α1, U1 sin α1, U2 cos α2, U2 sin α2]`.
    pub fn influence_matrix(&self) -> SMatrix<f32, FEATURES, 4> {
        let mut columns = [[0.0; FEATURES]; 4];
        for plane in 0..MAX_PLANES {
            for probe in 0..PROBES {
                // Y = c·(x + iy); the features are Re Y and −Im Y.
                let c = self.per_unbalance[probe][plane];
                columns[2 * plane][2 * probe] = c.re;
                columns[2 * plane][2 * probe + 1] = -c.im;
                columns[2 * plane + 1][2 * probe] = -c.im;
                columns[2 * plane + 1][2 * probe + 1] = -c.re;
            }
        }
        SMatrix::from_data(nalgebra::ArrayStorage(columns))
    }

    /// Features without any tracked unbalance, µm.
    pub fn offset(&self) -> [f32; FEATURES] {
        let [a, b, c, d] = self.fixed;
        [a.re, -a.im, b.re, -b.im, c.re, -c.im, d.re, -d.im]
    }

    /// The eight features for an unbalance `[U1 cos α1, U1 sin α1, U2 cos α2, U2 sin α2]` in g·mm; µm.
    pub fn features(&self, unbalance_g_mm: &[f32; 4]) -> [f32; FEATURES] {
        let mut features = self.offset();
        for (column, &unbalance) in self.influence_matrix().data.0.iter().zip(unbalance_g_mm) {
            for (feature, &influence) in features.iter_mut().zip(column) {
                *feature += influence * unbalance;
            }
        }
        features
    }

    /// Amplitudes of the shaft at the hardening supports, µm zero-to-peak (zero at the others).
    pub fn support_amplitudes(&self, unbalance_g_mm: &[Pair; MAX_PLANES]) -> SupportAmplitudes {
        SupportAmplitudes(array::from_fn(|support| {
            let motion = self.supports.get(support).copied().unwrap_or_default();
            motion.map(|linear| {
                let y = linear.phasor(unbalance_g_mm);
                scalar::length([y.re, y.im])
            })
        }))
    }
}

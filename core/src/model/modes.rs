//! The shaft in its modes.
//!
//! In synchronous whirl a shaft on springs is diagonal in modes that no speed changes. With a nominal spring at each
//! support, `K' = K + Σ k φφᵀ`, they are those of two pencils, one for forward and one for backward whirl (`p` and `m` of
//! [`response`](crate::response)), each scaled to `ΨᵀK'Ψ = I`:
//!
//! ```text
//! Ψᵀ(K' − W²(M − G))Ψ          = I − W²Λ       forward
//! Ψᵀ(K' − W²(M + G) + 2iWηK')Ψ = I(1 + 2iWη) − W²Λ   backward
//! ```
//!
//! A mode's entry of Λ is `1/W_j²` with W_j the speed at which it resonates; forward it is negative where the gyroscopic
//! terms outweigh the mass, and nothing resonates. Whatever the springs, the response is the same: each support takes its
//! spring off again. They only decide how many digits are left for it, so that springs like the supports are best.

use core::error::Error;
use core::fmt;

use heapless::Vec;
use nalgebra::{SMatrix, SVector};

use super::MAX_SUPPORTS;
use crate::scalar;

/// Sweeps of rotations, at most; six are usual.
const SWEEPS: usize = 40;
/// A pivot of this part of its diagonal entry is what rounding left of zero.
const SINGULAR: f64 = 1e-13;
/// Asymmetry that rounding of matrices to f32 and their products may leave, relative to the largest entry.
const SYMMETRY: f64 = 1e-4;

type Square<const SHAPES: usize> = [[f64; SHAPES]; SHAPES];

/// The shaft on its nominal springs, in its modes: made by [`Modes`].
#[derive(Debug, Clone, PartialEq)]
pub struct Shaft<const SHAPES: usize> {
    /// `1/W_j²` of each mode of forward whirl, s²; may be negative.
    pub forward_s2: SVector<f32, SHAPES>,
    /// `1/W_j²` of each mode of backward whirl, s²; positive.
    pub backward_s2: SVector<f32, SHAPES>,
    /// Nominal spring at each support in their order, N/m; supports beyond have none.
    pub springs_n_m: Vec<f32, MAX_SUPPORTS>,
}

/// Values of the modes at one place of the shaft, √(m/N): made by [`Modes::shape`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape<const SHAPES: usize> {
    /// Of the modes of forward whirl.
    pub forward: SVector<f32, SHAPES>,
    /// Of the modes of backward whirl.
    pub backward: SVector<f32, SHAPES>,
}

/// A free shaft on its shape functions, as many a plane, the same for x and y; symmetric matrices.
///
/// Its dynamic stiffness, with η the internal damping and W the speed in rad/s:
///
/// ```text
/// |  K − W²M + iWηK      iW²G + WηK    |
/// | −iW²G − WηK          K − W²M + iWηK |
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matrices<const SHAPES: usize> {
    /// K without any support, N/m.
    pub stiffness: SMatrix<f64, SHAPES, SHAPES>,
    /// M, kg.
    pub mass: SMatrix<f64, SHAPES, SHAPES>,
    /// G, polar inertia as it enters the gyroscopic terms, kg.
    pub polar_inertia: SMatrix<f64, SHAPES, SHAPES>,
}

/// A nominal spring: the same along x and y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring<const SHAPES: usize> {
    /// The shape functions at the support: φ, so that the displacement there is φ·p along x and φ·r along y.
    pub shape: SVector<f64, SHAPES>,
    /// About the support's stiffness in the speed range; together the springs must hold the shaft.
    pub stiffness_n_m: f64,
}

/// Why a shaft has no modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ModesError {
    /// A number is infinite or not a number.
    NotFinite,
    /// A matrix is not symmetric within 1e-4 of its largest entry.
    Asymmetric,
    /// The springs leave the shaft free to move, or a stiffness is negative.
    NotHeld,
    /// More springs than a model has supports.
    Springs,
    /// The mass matrix, or its sum with the polar inertia, is not positive definite.
    Mass,
}

impl fmt::Display for ModesError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NotFinite => "a number of the shaft is infinite or not a number",
            Self::Asymmetric => {
                "stiffness, mass or polar inertia is not symmetric within 0.01 % of its largest entry"
            }
            Self::NotHeld => "the nominal springs leave the shaft free to move, or a stiffness is negative",
            Self::Springs => "there are more nominal springs than a model has supports",
            Self::Mass => "the mass matrix, or its sum with the polar inertia, is not positive definite",
        })
    }
}

impl Error for ModesError {}

/// Turns matrices and shapes on shape functions into those of a [`Model`](super::Model), in f64 throughout.
///
/// ```
/// # fn main() -> Result<(), Box<dyn core::error::Error>> {
/// use nalgebra::{Matrix1, SVector};
/// use rotor_edge_core::model::{Matrices, Modes, Spring};
/// // a mass of 10 kg on two springs of 5e6 N/m: one mode, at 1000 rad/s
/// let one = SVector::from([1.0]);
/// let shaft = Matrices {
///     stiffness: Matrix1::new(0.0), mass: Matrix1::new(10.0), polar_inertia: Matrix1::new(0.0),
/// };
/// let modes = Modes::new(&shaft, &[Spring { shape: one, stiffness_n_m: 5e6 }; 2])?;
/// assert_eq!(modes.shaft().forward_s2[0], 1e-6);
/// assert!((modes.forward(&one)[0].powi(2) - 1e-7).abs() < 1e-13);
/// # Ok(()) }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Modes<const SHAPES: usize> {
    forward: Pencil<SHAPES>,
    backward: Pencil<SHAPES>,
    springs_n_m: Vec<f32, MAX_SUPPORTS>,
}

impl<const SHAPES: usize> Modes<SHAPES> {
    /// The springs in the order of the model's supports.
    ///
    /// Errors: [`ModesError`].
    pub fn new(shaft: &Matrices<SHAPES>, springs: &[Spring<SHAPES>]) -> Result<Self, ModesError> {
        let mut springs_n_m = Vec::new();
        let mut held = shaft.stiffness.data.0;
        for Spring { shape, stiffness_n_m } in springs {
            springs_n_m.push(*stiffness_n_m as f32).map_err(|_| ModesError::Springs)?;
            let [shape] = &shape.data.0;
            for (row, &here) in held.iter_mut().zip(shape) {
                for (cell, &there) in row.iter_mut().zip(shape) {
                    // As they will be taken off again.
                    *cell += f64::from(*stiffness_n_m as f32) * here * there;
                }
            }
        }
        let matrices = [&held, &shaft.mass.data.0, &shaft.polar_inertia.data.0];
        if !matrices.iter().all(|matrix| matrix.as_flattened().iter().all(|cell| cell.is_finite())) {
            return Err(ModesError::NotFinite);
        }
        for matrix in matrices {
            if !is_symmetric(matrix) {
                return Err(ModesError::Asymmetric);
            }
        }
        let [_, mass, polar_inertia] = matrices;
        let to_unit = inverted_factor(&held).ok_or(ModesError::NotHeld)?;
        let inertia = |sign: f64| {
            let mut inertia = *mass;
            for (cell, polar) in inertia.as_flattened_mut().iter_mut().zip(polar_inertia.as_flattened()) {
                *cell += sign * polar;
            }
            Pencil::new(&to_unit, &inertia)
        };
        let (forward, backward) = (inertia(-1.0), inertia(1.0));
        if inverted_factor(mass).is_none() || backward.values.iter().any(|&value| value <= 0.0) {
            return Err(ModesError::Mass);
        }
        Ok(Self { forward, backward, springs_n_m })
    }

    /// The shaft of a model.
    pub fn shaft(&self) -> Shaft<SHAPES> {
        Shaft {
            forward_s2: narrowed(&self.forward.values),
            backward_s2: narrowed(&self.backward.values),
            springs_n_m: self.springs_n_m.clone(),
        }
    }

    /// What a support or a probe of a model needs of its place, from the shape functions there.
    pub fn shape(&self, place: &SVector<f64, SHAPES>) -> Shape<SHAPES> {
        Shape { forward: self.forward.at(place), backward: self.backward.at(place) }
    }

    /// What a plane or a forcing of a model needs of its place (slopes, for a moment): it forces forward whirl alone.
    pub fn forward(&self, place: &SVector<f64, SHAPES>) -> SVector<f32, SHAPES> {
        self.forward.at(place)
    }
}

/// One kind of whirl.
#[derive(Debug, Clone, PartialEq)]
struct Pencil<const SHAPES: usize> {
    /// Λ, s².
    values: [f64; SHAPES],
    /// Ψᵀ, row by row a mode.
    modes: Square<SHAPES>,
}

impl<const SHAPES: usize> Pencil<SHAPES> {
    /// From `L⁻¹` with `K' = LLᵀ`: `L⁻¹ B L⁻ᵀ` is rotated until it is diagonal, and `L⁻¹` along.
    fn new(to_unit: &Square<SHAPES>, inertia: &Square<SHAPES>) -> Self {
        let mut modes = *to_unit;
        let mut left = [[0.0; SHAPES]; SHAPES];
        for (row, unit) in left.iter_mut().zip(to_unit) {
            for (&factor, inertia) in unit.iter().zip(inertia) {
                add(row, factor, inertia);
            }
        }
        let mut matrix = [[0.0; SHAPES]; SHAPES];
        for (row, left) in matrix.iter_mut().zip(&left) {
            for (cell, unit) in row.iter_mut().zip(to_unit) {
                *cell = dot(left, unit);
            }
        }
        diagonalise(&mut matrix, &mut modes);
        let mut values = [0.0; SHAPES];
        for (i, value) in values.iter_mut().enumerate() {
            *value = matrix[i][i];
        }
        Self { values, modes }
    }

    fn at(&self, place: &SVector<f64, SHAPES>) -> SVector<f32, SHAPES> {
        let [place] = &place.data.0;
        narrowed(&self.modes.map(|mode| dot(&mode, place)))
    }
}

fn is_symmetric<const SHAPES: usize>(cells: &Square<SHAPES>) -> bool {
    let largest = cells.as_flattened().iter().fold(0.0_f64, |largest, cell| largest.max(cell.abs()));
    (0..SHAPES).all(|i| (0..SHAPES).all(|j| (cells[i][j] - cells[j][i]).abs() <= SYMMETRY * largest))
}

fn narrowed<const SHAPES: usize>(wide: &[f64; SHAPES]) -> SVector<f32, SHAPES> {
    SVector::from(wide.map(|x| x as f32))
}

fn dot<const SHAPES: usize>(left: &[f64; SHAPES], right: &[f64; SHAPES]) -> f64 {
    left.iter().zip(right).fold(0.0, |sum, (a, b)| sum + a * b)
}

/// `row += factor · other`.
fn add<const SHAPES: usize>(row: &mut [f64; SHAPES], factor: f64, other: &[f64; SHAPES]) {
    for (cell, other) in row.iter_mut().zip(other) {
        *cell += factor * other;
    }
}

/// `L⁻¹` of `LLᵀ` (Cholesky); `None` if the matrix is not positive definite.
fn inverted_factor<const SHAPES: usize>(matrix: &Square<SHAPES>) -> Option<Square<SHAPES>> {
    let mut factor = [[0.0; SHAPES]; SHAPES];
    let mut inverse = [[0.0; SHAPES]; SHAPES];
    for i in 0..SHAPES {
        let mut row = [0.0; SHAPES];
        for j in 0..i {
            row[j] = (matrix[i][j] - dot(&row, &factor[j])) / factor[j][j];
        }
        let square = matrix[i][i] - dot(&row, &row);
        if !(square > SINGULAR * matrix[i][i] && square.is_finite()) {
            return None;
        }
        let pivot = scalar::sqrt_f64(square);
        let mut unit = [0.0; SHAPES];
        unit[i] = 1.0;
        for j in 0..i {
            add(&mut unit, -row[j], &inverse[j]);
        }
        inverse[i] = unit.map(|x| x / pivot);
        row[i] = pivot;
        factor[i] = row;
    }
    Some(inverse)
}

/// Rotates a symmetric matrix until it is diagonal (Jacobi's cyclic process: Golub and Van Loan 2013, section 8.5), and the
/// rows of `modes` along.
fn diagonalise<const SHAPES: usize>(matrix: &mut Square<SHAPES>, modes: &mut Square<SHAPES>) {
    for _ in 0..SWEEPS {
        let mut is_diagonal = true;
        for p in 0..SHAPES {
            for q in 0..p {
                let (a, b, off) = (matrix[p][p], matrix[q][q], matrix[p][q]);
                if off * off <= f64::EPSILON * f64::EPSILON * (a * b).abs() || off.abs() < f64::MIN_POSITIVE {
                    continue;
                }
                is_diagonal = false;
                // tan 2θ = 2·off/(b − a), of the two angles the smaller.
                let half = 0.5 * (b - a) / off;
                let tangent = 1.0 / (half.abs() + scalar::sqrt_f64(half * half + 1.0));
                let tangent = if half < 0.0 { -tangent } else { tangent };
                let cosine = 1.0 / scalar::sqrt_f64(tangent * tangent + 1.0);
                let turn = [cosine, tangent * cosine];
                rotate(matrix, p, q, turn);
                for row in matrix.iter_mut() {
                    (row[p], row[q]) = turned(row[p], row[q], turn);
                }
                rotate(modes, p, q, turn);
                (matrix[p][q], matrix[q][p]) = (0.0, 0.0);
            }
        }
        if is_diagonal {
            return;
        }
    }
}

/// Turns two rows into one another.
fn rotate<const SHAPES: usize>(rows: &mut Square<SHAPES>, p: usize, q: usize, turn: [f64; 2]) {
    for k in 0..SHAPES {
        (rows[p][k], rows[q][k]) = turned(rows[p][k], rows[q][k], turn);
    }
}

fn turned(x: f64, y: f64, [cosine, sine]: [f64; 2]) -> (f64, f64) {
    (cosine * x - sine * y, sine * x + cosine * y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    const SHAPES: usize = 6;

    fn symmetric(random: &mut Random, diagonal: impl Fn(&mut Random) -> f64) -> SMatrix<f64, SHAPES, SHAPES> {
        let scales: [f64; SHAPES] = core::array::from_fn(|_| diagonal(random));
        let mut matrix = SMatrix::<f64, SHAPES, SHAPES>::from_diagonal(&scales.into());
        for i in 0..SHAPES {
            for j in 0..i {
                matrix[(i, j)] = 0.1 * f64::from(random.signed()) * (scales[i] * scales[j]).sqrt();
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        matrix
    }

    fn shaft(random: &mut Random, polar: f32) -> (Matrices<SHAPES>, [Spring<SHAPES>; 2]) {
        let shaft = Matrices {
            stiffness: symmetric(random, |random| f64::from(random.log_between(1e5, 1e10))),
            mass: symmetric(random, |random| f64::from(random.log_between(1.0, 100.0))),
            polar_inertia: symmetric(random, |random| f64::from(random.between(0.0, polar))),
        };
        let spring =
            |_| Spring { shape: SVector::from_fn(|_, _| f64::from(random.signed())), stiffness_n_m: 1e8 };
        (shaft, [0, 1].map(spring))
    }

    /// Against nalgebra's decomposition: the same values, and modes that make all three matrices diagonal.
    #[test]
    fn modes_are_those_of_an_independent_decomposition() {
        let mut random = Random::new(61);
        for number in 0..300 {
            // In the second half gyroscopic terms outweigh the mass of some modes.
            let (shaft, springs) = shaft(&mut random, if number < 150 { 1.0 } else { 80.0 });
            let modes = Modes::new(&shaft, &springs).unwrap();
            let held = springs.iter().fold(shaft.stiffness, |sum, spring| {
                sum + spring.shape * spring.shape.transpose() * spring.stiffness_n_m
            });
            for (pencil, sign) in [(&modes.forward, -1.0), (&modes.backward, 1.0)] {
                let inertia = shaft.mass + shaft.polar_inertia * sign;
                let unit = held.cholesky().unwrap().l().try_inverse().unwrap();
                let mut expected = (unit * inertia * unit.transpose()).symmetric_eigen().eigenvalues;
                expected.as_mut_slice().sort_by(f64::total_cmp);
                let mut values = pencil.values;
                values.sort_by(f64::total_cmp);
                let largest = expected.amax();
                for (value, expected) in values.iter().zip(&expected) {
                    assert!((value - expected).abs() < 1e-12 * largest, "{number}: {values:?} {expected}");
                }
                let psi = SMatrix::<f64, SHAPES, SHAPES>::from_fn(|i, j| pencil.modes[j][i]);
                let one = psi.transpose() * held * psi;
                assert!((one - SMatrix::identity()).amax() < 1e-9, "{number}: {one}");
                let diagonal = psi.transpose() * inertia * psi;
                let wanted = SMatrix::from_diagonal(&pencil.values.into());
                assert!((diagonal - wanted).amax() < 1e-9 * largest, "{number}: {diagonal}");
            }
        }
    }

    #[test]
    fn each_fault_of_a_shaft_is_named() {
        let (good, springs) = shaft(&mut Random::new(62), 1.0);
        assert!(Modes::new(&good, &springs).is_ok());
        let with = |spoil: fn(&mut Matrices<SHAPES>)| {
            let mut shaft = good;
            spoil(&mut shaft);
            Modes::new(&shaft, &springs).unwrap_err()
        };
        assert_eq!(with(|shaft| shaft.mass[(2, 1)] = f64::NAN), ModesError::NotFinite);
        assert_eq!(with(|shaft| shaft.polar_inertia[(2, 1)] += 1.0), ModesError::Asymmetric);
        assert_eq!(with(|shaft| shaft.stiffness *= -1.0), ModesError::NotHeld);
        assert_eq!(with(|shaft| shaft.stiffness *= 0.0), ModesError::NotHeld, "two springs for six shapes");
        assert_eq!(with(|shaft| shaft.mass[(2, 2)] *= -1.0), ModesError::Mass);
        assert_eq!(with(|shaft| shaft.polar_inertia[(2, 2)] = -1e4), ModesError::Mass);
        assert_eq!(Modes::new(&good, &[springs[0]; 9]).unwrap_err(), ModesError::Springs);
    }
}

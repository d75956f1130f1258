//! Elimination with partial pivoting over fixed arrays, real or complex, that cannot panic.
//!
//! Stable Rust has no `2 * N` in const generics, so the system is kept in two halves of N rows (x and y, or plane 1 and
//! plane 2), each row in two halves of N cells; flattened views give the 2N.

use core::mem;
use core::ops::{Mul, Sub};

use nalgebra::Complex;

use crate::scalar;

/// What elimination needs of a number.
pub(crate) trait Number: Copy + Default + Mul<Output = Self> + Sub<Output = Self> {
    fn size(self) -> f32;
    fn reciprocal(self) -> Self;
}

impl Number for f32 {
    #[inline]
    fn size(self) -> f32 {
        self.abs()
    }
    #[inline]
    fn reciprocal(self) -> Self {
        1.0 / self
    }
}

impl Number for Complex<f32> {
    #[inline]
    fn size(self) -> f32 {
        scalar::size(self)
    }
    #[inline]
    fn reciprocal(self) -> Self {
        scalar::reciprocal(self)
    }
}

/// One equation of 2N unknowns with R right-hand sides.
#[derive(Clone, Copy)]
pub(crate) struct Row<T, const N: usize, const R: usize> {
    pub cells: [[T; N]; 2],
    pub rhs: [T; R],
}

impl<T: Number, const N: usize, const R: usize> Row<T, N, R> {
    pub fn zero() -> Self {
        Self { cells: [[T::default(); N]; 2], rhs: [T::default(); R] }
    }

    #[inline]
    fn tail(&self, column: usize) -> &[T] {
        self.cells.as_flattened().get(column..).unwrap_or_default()
    }

    #[inline]
    fn tail_mut(&mut self, column: usize) -> &mut [T] {
        self.cells.as_flattened_mut().get_mut(column..).unwrap_or_default()
    }

    #[inline]
    fn size_at(&self, column: usize) -> f32 {
        self.cells.as_flattened().get(column).map_or(0.0, |cell| cell.size())
    }
}

/// Unknowns: two halves × N × right-hand sides.
pub(crate) type Solution<T, const N: usize, const R: usize> = [[[T; R]; N]; 2];

/// Solves the 2N equations in place; `None` if a pivot is zero or not a number.
///
/// Cost (complex, N = 6, R = 3): 572 multiply-subtracts in the matrix, 198 + 198 in the right-hand sides, 12 reciprocals.
pub(crate) fn solve<T: Number, const N: usize, const R: usize>(
    rows: &mut [[Row<T, N, R>; N]; 2],
) -> Option<Solution<T, N, R>> {
    eliminate(rows.as_flattened_mut())?;
    Some(substitute_back(rows))
}

/// Upper triangle in place; each diagonal cell is left as the reciprocal of its pivot.
#[inline]
fn eliminate<T: Number, const N: usize, const R: usize>(rows: &mut [Row<T, N, R>]) -> Option<()> {
    let mut rest = rows;
    let mut column = 0;
    while let Some((pivot, below)) = mem::take(&mut rest).split_first_mut() {
        raise_largest(pivot, below, column);
        let (lead, pivot_tail) = pivot.cells.as_flattened_mut().get_mut(column..)?.split_first_mut()?;
        let size = lead.size();
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        *lead = lead.reciprocal();
        for row in below.iter_mut() {
            let (head, tail) = row.tail_mut(column).split_first_mut()?;
            let factor = *head * *lead;
            subtract(tail, factor, pivot_tail);
            subtract(&mut row.rhs, factor, &pivot.rhs);
        }
        rest = below;
        column += 1;
    }
    Some(())
}

/// `row −= factor · above`, by fours: the loop around a complex multiplication costs a third of it.
#[inline]
fn subtract<T: Number>(row: &mut [T], factor: T, above: &[T]) {
    let (row_fours, row_rest) = row.as_chunks_mut::<4>();
    let (above_fours, above_rest) = above.as_chunks::<4>();
    for (row, above) in row_fours.iter_mut().zip(above_fours) {
        for (cell, &above) in row.iter_mut().zip(above) {
            *cell = *cell - factor * above;
        }
    }
    for (cell, &above) in row_rest.iter_mut().zip(above_rest) {
        *cell = *cell - factor * above;
    }
}

#[inline]
fn raise_largest<T: Number, const N: usize, const R: usize>(
    pivot: &mut Row<T, N, R>,
    below: &mut [Row<T, N, R>],
    column: usize,
) {
    let mut largest = pivot.size_at(column);
    let mut found = None;
    for (place, row) in below.iter().enumerate() {
        let size = row.size_at(column);
        if size > largest {
            largest = size;
            found = Some(place);
        }
    }
    if let Some(row) = found.and_then(|place| below.get_mut(place)) {
        mem::swap(pivot, row);
    }
}

#[inline]
fn substitute_back<T: Number, const N: usize, const R: usize>(
    rows: &[[Row<T, N, R>; N]; 2],
) -> Solution<T, N, R> {
    let mut solution = [[[T::default(); R]; N]; 2];
    let unknowns = solution.as_flattened_mut();
    for (place, row) in rows.as_flattened().iter().enumerate().rev() {
        let mut value = row.rhs;
        let Some((unknown, known)) = unknowns.get_mut(place..).and_then(|tail| tail.split_first_mut()) else {
            continue;
        };
        let Some((&reciprocal, cells)) = row.tail(place).split_first() else {
            continue;
        };
        for (&cell, solved) in cells.iter().zip(known.iter()) {
            for (value, &solved) in value.iter_mut().zip(solved) {
                *value = *value - cell * solved;
            }
        }
        for (unknown, value) in unknown.iter_mut().zip(value) {
            *unknown = value * reciprocal;
        }
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;
    use nalgebra::ComplexField;

    #[test]
    fn solution_put_back_into_the_equations_reproduces_the_right_hand_sides() {
        let mut random = Random::new(3);
        for _ in 0..200 {
            let mut rows = [[Row::<Complex<f32>, 6, 3>::zero(); 6]; 2];
            for row in rows.as_flattened_mut() {
                for cell in row.cells.as_flattened_mut().iter_mut().chain(&mut row.rhs) {
                    *cell = Complex::new(random.signed(), random.signed());
                }
            }
            let original = rows;
            let solution = solve(&mut rows).unwrap();
            for row in original.as_flattened() {
                for right in 0..3 {
                    let mut sum = Complex::<f64>::new(0.0, 0.0);
                    let mut scale = 0.0;
                    for (cell, x) in row.cells.as_flattened().iter().zip(solution.as_flattened()) {
                        let x = x[right];
                        let term = Complex::new(f64::from(cell.re), f64::from(cell.im))
                            * Complex::new(f64::from(x.re), f64::from(x.im));
                        sum += term;
                        scale += term.modulus();
                    }
                    let want = Complex::new(f64::from(row.rhs[right].re), f64::from(row.rhs[right].im));
                    assert!((sum - want).modulus() < 2e-5 * (scale + 1.0), "{sum} {want}");
                }
            }
        }
    }

    #[test]
    fn a_zero_on_the_diagonal_is_pivoted_around() {
        let mut rows = [
            [Row::<f32, 1, 1> { cells: [[0.0], [2.0]], rhs: [4.0] }],
            [Row { cells: [[3.0], [1.0]], rhs: [5.0] }],
        ];
        let solution = solve(&mut rows).unwrap();
        assert_eq!(solution, [[[1.0]], [[2.0]]]);
    }

    #[test]
    fn singular_or_not_finite_is_refused() {
        let row = Row::<f32, 1, 1> { cells: [[1.0], [2.0]], rhs: [4.0] };
        assert!(solve(&mut [[row], [row]]).is_none());
        let broken = Row { cells: [[f32::NAN], [2.0]], rhs: [4.0] };
        assert!(solve(&mut [[broken], [broken]]).is_none());
    }
}

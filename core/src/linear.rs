//! Complex linear equations over fixed arrays, by elimination with pivoting that cannot panic.

use core::mem;

use nalgebra::Complex;

use crate::scalar;

type C = Complex<f32>;

/// One equation of up to 2N unknowns, in two halves because stable Rust has no `2 * N` in const generics, with its
/// right-hand sides: one for each plane, and one for what is known.
#[derive(Clone, Copy)]
pub(crate) struct Equation<const N: usize, const PLANES: usize> {
    pub cells: [[C; N]; 2],
    pub planes: [C; PLANES],
    pub known: C,
}

impl<const N: usize, const PLANES: usize> Equation<N, PLANES> {
    pub fn zero() -> Self {
        Self { cells: [[C::default(); N]; 2], planes: [C::default(); PLANES], known: C::default() }
    }

    #[inline]
    fn tail(&self, column: usize, size: usize) -> &[C] {
        self.cells.as_flattened().get(column..size).unwrap_or_default()
    }

    #[inline]
    fn tail_mut(&mut self, column: usize, size: usize) -> &mut [C] {
        self.cells.as_flattened_mut().get_mut(column..size).unwrap_or_default()
    }

    #[inline]
    fn cell(&self, column: usize) -> C {
        self.cells.as_flattened().get(column).copied().unwrap_or_default()
    }

    #[inline]
    fn size_at(&self, column: usize) -> f32 {
        scalar::size(self.cell(column))
    }

    /// Takes `factor` times another row's right-hand sides off this one's.
    #[inline]
    fn subtract_sides(&mut self, factor: C, other: &Self) {
        subtract(&mut self.planes, factor, &other.planes);
        self.known = scalar::subtract_product(self.known, factor, other.known);
    }
}

/// Solves as many equations as unknowns in place, with partial pivoting: each row's right-hand sides become its unknown.
/// `None` if a pivot is zero or not a number.
///
/// Cost (12 equations, three sides): 572 multiply-subtracts in the matrix, 198 + 198 in the right-hand sides, 12
/// reciprocals.
#[inline(never)]
pub(crate) fn solve<const N: usize, const PLANES: usize>(rows: &mut [Equation<N, PLANES>]) -> Option<()> {
    eliminate(rows)?;
    substitute_back(rows);
    Some(())
}

/// Upper triangle in place; each diagonal cell is left as the reciprocal of its pivot.
fn eliminate<const N: usize, const PLANES: usize>(rows: &mut [Equation<N, PLANES>]) -> Option<()> {
    let size = rows.len();
    let mut rest = rows;
    let mut column = 0;
    while let Some((pivot, below)) = mem::take(&mut rest).split_first_mut() {
        raise_largest(pivot, below, column);
        let lead = pivot.tail_mut(column, size).first_mut()?;
        let strength = scalar::size(*lead);
        if !(strength > 0.0 && strength.is_finite()) {
            return None;
        }
        *lead = scalar::reciprocal(*lead);
        let (&lead, pivot_tail) = pivot.tail(column, size).split_first()?;
        for row in below.iter_mut() {
            let (head, tail) = row.tail_mut(column, size).split_first_mut()?;
            let factor = *head * lead;
            subtract(tail, factor, pivot_tail);
            row.subtract_sides(factor, pivot);
        }
        rest = below;
        column += 1;
    }
    Some(())
}

/// `row −= factor · above`.
#[inline]
fn subtract(row: &mut [C], factor: C, above: &[C]) {
    for (cell, &above) in row.iter_mut().zip(above) {
        *cell = scalar::subtract_product(*cell, factor, above);
    }
}

#[inline]
fn raise_largest<const N: usize, const PLANES: usize>(
    pivot: &mut Equation<N, PLANES>,
    below: &mut [Equation<N, PLANES>],
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

fn substitute_back<const N: usize, const PLANES: usize>(rows: &mut [Equation<N, PLANES>]) {
    let mut rest = rows;
    while let Some((last, above)) = mem::take(&mut rest).split_last_mut() {
        let column = above.len();
        let reciprocal = last.cell(column);
        last.planes = last.planes.map(|side| side * reciprocal);
        last.known *= reciprocal;
        for row in above.iter_mut() {
            let factor = row.cell(column);
            row.subtract_sides(factor, last);
        }
        rest = above;
    }
}

//! Complex linear equations over fixed arrays that cannot panic: a quick way for what is symmetric and well behaved, and
//! elimination with pivoting for everything else.

use core::array;
use core::mem;

use nalgebra::Complex;

use crate::scalar;

type C = Complex<f32>;

/// A complex symmetric matrix, of which only the lower triangle counts; factored in place to `L D Lᵀ`: below the diagonal L
/// (its diagonal is one), on it the reciprocals of D.
#[derive(Clone, Copy)]
pub(crate) struct Symmetric<const N: usize> {
    pub rows: [[C; N]; N],
}

impl<const N: usize> Symmetric<N> {
    /// From the cells of the lower triangle, by row and column; the others are zero.
    #[inline(always)]
    pub fn from_fn(cell: impl Fn(usize, usize) -> C) -> Self {
        let cell = &cell;
        Self { rows: array::from_fn(|i| array::from_fn(|j| if j <= i { cell(i, j) } else { C::default() })) }
    }

    /// Factors row by row: `w_j = a_ij − Σ w_k l_jk`, `l_ij = w_j/d_j`, `d_i = a_ii − Σ w_k l_ik` (k below j, and below i).
    ///
    /// There is no pivoting, and the error of a result is as many times larger than necessary as numbers grow on the way
    /// (Higham 2002, section 11.1). `None` if they grow beyond `growth` times the largest entry of the diagonal, or if a
    /// pivot is zero or not a number.
    #[inline(never)]
    pub fn factor(&mut self, growth: f32) -> Option<()> {
        let mut largest = 0.0_f32;
        for i in 0..N {
            let size = scalar::size(self.rows[i][i]);
            if size > largest {
                largest = size;
            }
        }
        let limit = growth * largest;
        for i in 0..N {
            let (above, rest) = self.rows.split_at_mut(i);
            let Some(row) = rest.first_mut() else {
                continue;
            };
            let mut pivot = row[i];
            for j in 0..i {
                let mut value = row[j];
                for k in 0..j {
                    value = scalar::subtract_product(value, row[k], above[j][k]);
                }
                row[j] = value;
            }
            for j in 0..i {
                let factor = row[j] * above[j][j];
                pivot = scalar::subtract_product(pivot, row[j], factor);
                row[j] = factor;
            }
            let size = scalar::size(pivot);
            if !(size > 0.0 && size <= limit) {
                return None;
            }
            row[i] = scalar::reciprocal(pivot);
        }
        Some(())
    }

    /// Turns a right-hand side into its solution; the matrix must be factored.
    #[inline(never)]
    pub fn solve(&self, x: &mut [C; N]) {
        for i in 1..N {
            let mut value = x[i];
            for k in 0..i {
                value = scalar::subtract_product(value, self.rows[i][k], x[k]);
            }
            x[i] = value;
        }
        for i in 0..N {
            x[i] *= self.rows[i][i];
        }
        // Row by row from below, each unknown taken off those above it.
        for i in 1..N {
            let i = N - i;
            for k in 0..i {
                x[k] = scalar::subtract_product(x[k], self.rows[i][k], x[i]);
            }
        }
    }
}

/// One equation of 2N unknowns, in two halves because stable Rust has no `2 * N` in const generics, with its right-hand
/// sides: one for each plane, and one for what is known.
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
    fn tail(&self, column: usize) -> &[C] {
        self.cells.as_flattened().get(column..).unwrap_or_default()
    }

    #[inline]
    fn tail_mut(&mut self, column: usize) -> &mut [C] {
        self.cells.as_flattened_mut().get_mut(column..).unwrap_or_default()
    }

    #[inline]
    fn size_at(&self, column: usize) -> f32 {
        self.cells.as_flattened().get(column).map_or(0.0, |&cell| scalar::size(cell))
    }

    /// Takes `factor` times another row's right-hand sides off this one's.
    #[inline]
    fn subtract_sides(&mut self, factor: C, other: &Self) {
        subtract(&mut self.planes, factor, &other.planes);
        self.known = scalar::subtract_product(self.known, factor, other.known);
    }
}

/// Solves the 2N equations in place, with partial pivoting: each row's right-hand sides become its unknown. `None` if a
/// pivot is zero or not a number.
///
/// Cost (N = 6, three sides): 572 multiply-subtracts in the matrix, 198 + 198 in the right-hand sides, 12 reciprocals.
#[inline(never)]
pub(crate) fn solve<const N: usize, const PLANES: usize>(
    rows: &mut [[Equation<N, PLANES>; N]; 2],
) -> Option<()> {
    eliminate(rows.as_flattened_mut())?;
    substitute_back(rows.as_flattened_mut());
    Some(())
}

/// Upper triangle in place; each diagonal cell is left as the reciprocal of its pivot.
fn eliminate<const N: usize, const PLANES: usize>(rows: &mut [Equation<N, PLANES>]) -> Option<()> {
    let mut rest = rows;
    let mut column = 0;
    while let Some((pivot, below)) = mem::take(&mut rest).split_first_mut() {
        raise_largest(pivot, below, column);
        let lead = pivot.tail_mut(column).first_mut()?;
        let size = scalar::size(*lead);
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        *lead = scalar::reciprocal(*lead);
        let (&lead, pivot_tail) = pivot.tail(column).split_first()?;
        for row in below.iter_mut() {
            let (head, tail) = row.tail_mut(column).split_first_mut()?;
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
        let reciprocal = last.tail(column).first().copied().unwrap_or_default();
        last.planes = last.planes.map(|side| side * reciprocal);
        last.known *= reciprocal;
        for row in above.iter_mut() {
            let factor = row.tail(column).first().copied().unwrap_or_default();
            row.subtract_sides(factor, last);
        }
        rest = above;
    }
}

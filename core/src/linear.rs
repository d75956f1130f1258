//! Complex linear equations that cannot panic: a quick way for a few that are well behaved, and elimination with pivoting
//! for everything else.

use core::mem;

use heapless::Vec;

use nalgebra::Complex;

use crate::scalar;

type C = Complex<f32>;

/// Two rows and two columns of a matrix.
type Block = [[C; 2]; 2];

/// A square matrix of up to MOST rows and columns of blocks, row by row; factored in place to `L U`, with ones on the diagonal
/// of L and the inverse blocks on that of U.
pub(crate) struct Blocks<const MOST: usize> {
    rows: Vec<Vec<Block, MOST>, MOST>,
}

impl<const MOST: usize> Blocks<MOST> {
    pub fn new() -> Self {
        Self { rows: Vec::new() }
    }

    /// Begins a row.
    pub fn begin_row(&mut self) -> Option<()> {
        self.rows.push(Vec::new()).ok()
    }

    /// Appends a block to the last row; `None` if there is no room.
    #[inline]
    pub fn push(&mut self, block: Block) -> Option<()> {
        self.rows.last_mut()?.push(block).ok()
    }

    /// There is no pivoting: `None` if an inverse block that divides others has an entry above `growth`, which is how much
    /// numbers may grow on the way where those of the matrix are near one, or if a block is singular.
    pub fn factor(&mut self, growth: f32) -> Option<()> {
        let mut rest = self.rows.as_mut_slice();
        let mut column = 0;
        while let Some((pivot_row, below)) = mem::take(&mut rest).split_first_mut() {
            let (pivot, after) = pivot_row.get_mut(column..)?.split_first_mut()?;
            *pivot = inverse(pivot)?;
            let largest = scalar::largest_size(pivot.as_flattened());
            if largest > growth && !below.is_empty() {
                return None;
            }
            for row in below.iter_mut() {
                let (factor, cells) = row.get_mut(column..)?.split_first_mut()?;
                let mut scaled = Block::default();
                subtract_block(&mut scaled, factor, pivot);
                *factor = scaled.map(|row| row.map(|z| -z));
                for (cell, above) in cells.iter_mut().zip(&*after) {
                    subtract_block(cell, factor, above);
                }
            }
            rest = below;
            column += 1;
        }
        Some(())
    }

    /// Turns a right-hand side into its solution; the matrix must be factored.
    pub fn solve(&self, sides: &mut [[C; 2]]) {
        for (i, row) in self.rows.iter().enumerate() {
            let (known, rest) = sides.split_at_mut_checked(i).unwrap_or_default();
            if let Some(side) = rest.first_mut() {
                for (block, known) in row.iter().zip(&*known) {
                    subtract_product(side, block, known);
                }
            }
        }
        for (i, row) in self.rows.iter().enumerate().rev() {
            let (rest, known) = sides.split_at_mut_checked(i + 1).unwrap_or_default();
            if let (Some(side), Some((inverse, after))) =
                (rest.last_mut(), row.get(i..).and_then(<[Block]>::split_first))
            {
                for (block, known) in after.iter().zip(&*known) {
                    subtract_product(side, block, known);
                }
                let [[a, b], [c, d]] = inverse;
                let [x, y] = *side;
                *side = [scalar::add_product(a * x, *b, y), scalar::add_product(c * x, *d, y)];
            }
        }
    }
}

/// `None` if a block is singular or not a number.
fn inverse([[a, b], [c, d]]: &Block) -> Option<Block> {
    let determinant = scalar::subtract_product(a * d, *b, *c);
    let size = scalar::size(determinant);
    if !(size > 0.0 && size.is_finite()) {
        return None;
    }
    let factor = scalar::reciprocal(determinant);
    Some([[d * factor, -(b * factor)], [-(c * factor), a * factor]])
}

/// `block −= left·right`.
#[inline(never)]
fn subtract_block(block: &mut Block, left: &Block, right: &Block) {
    for (row, [x, y]) in block.iter_mut().zip(left) {
        let [above, below] = right;
        for ((cell, above), below) in row.iter_mut().zip(above).zip(below) {
            *cell = scalar::subtract_product(scalar::subtract_product(*cell, *x, *above), *y, *below);
        }
    }
}

/// `side −= block·x`.
#[inline]
fn subtract_product(side: &mut [C; 2], block: &Block, [x, y]: &[C; 2]) {
    for (cell, [left, right]) in side.iter_mut().zip(block) {
        *cell = scalar::subtract_product(scalar::subtract_product(*cell, *left, *x), *right, *y);
    }
}

/// One equation of up to twice `SHAPES` unknowns, in two halves because stable Rust has no `2 * SHAPES` in const generics,
/// with its right-hand sides: one for each plane, and one for what is known.
#[derive(Clone, Copy)]
pub(crate) struct Equation<const SHAPES: usize, const PLANES: usize> {
    pub cells: [[C; SHAPES]; 2],
    pub planes: [C; PLANES],
    pub known: C,
}

impl<const SHAPES: usize, const PLANES: usize> Equation<SHAPES, PLANES> {
    pub fn zero() -> Self {
        Self { cells: [[C::default(); SHAPES]; 2], planes: [C::default(); PLANES], known: C::default() }
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
pub(crate) fn solve<const SHAPES: usize, const PLANES: usize>(
    rows: &mut [Equation<SHAPES, PLANES>],
) -> Option<()> {
    eliminate(rows)?;
    substitute_back(rows);
    Some(())
}

/// Upper triangle in place; each diagonal cell is left as the reciprocal of its pivot.
fn eliminate<const SHAPES: usize, const PLANES: usize>(rows: &mut [Equation<SHAPES, PLANES>]) -> Option<()> {
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
fn raise_largest<const SHAPES: usize, const PLANES: usize>(
    pivot: &mut Equation<SHAPES, PLANES>,
    below: &mut [Equation<SHAPES, PLANES>],
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

fn substitute_back<const SHAPES: usize, const PLANES: usize>(rows: &mut [Equation<SHAPES, PLANES>]) {
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

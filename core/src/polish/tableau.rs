//! Exchange of vanishing residuals, one at a time, downhill.

mod tangents;

use core::array;

use heapless::Vec;

use super::certificate;
use crate::fit::BoundedFit;
use crate::model::{MAX_PLANES, Pair};
use crate::reading::MAX_PROBES;
use crate::scalar;

/// Tangents kept for each disc: two may be in force at a corner, one is new, one is on the other side.
const TANGENTS: usize = 4;
const LINES: usize = 2 * MAX_PLANES + 2 * MAX_PROBES + TANGENTS * MAX_PLANES;
/// Exchanges of one descent, at most; fewer than ten are usual.
const EXCHANGES: usize = 48;
/// A descent less steep than this, per unit of a column of unit length, is rounding.
const SLACK: f32 = 2e-5;
/// What a tangent costs per unit of going beyond it: more than any sum of residuals can gain, whose columns are of unit
/// length (at most √(2·16 rows) = 5.7, and twice that at the corner of two tangents 120° apart).
const BEYOND: f32 = 64.0;
/// A row changes with a column if its rate is at least this.
const SMALLEST_RATE: f32 = 1e-5;

/// A quantity that depends on the columns' variables y: `value + ways·y`, and costs `slope` below and above zero.
#[derive(Clone, Copy)]
struct PiecewiseLinear<const PLANES: usize> {
    value: f32,
    ways: [Pair; PLANES],
    below: f32,
    above: f32,
    /// It is a column's variable itself, and zero.
    vanishes: bool,
}

/// Which line a column's variable is.
#[derive(Clone, Copy, PartialEq)]
enum Owner {
    /// None: the plane cannot move.
    Nobody,
    /// An unknown, by its way from the start; it does not stay.
    Unknown,
    /// A line that vanishes.
    Line(usize),
}

/// The problem with each plane's two columns (orthogonal and of one length by nature) scaled to unit length: discs stay
/// discs, and planes of unlike influence become alike.
pub(super) struct Tableau<const PLANES: usize> {
    /// The unknowns, then the rows, then the tangents.
    lines: Vec<PiecewiseLinear<PLANES>, LINES>,
    owners: [[Owner; 2]; PLANES],
    /// Where each tangent of each plane touches (a unit vector), and the line it is.
    tangents: [Vec<(Pair, usize), TANGENTS>; PLANES],
    bound: [f32; PLANES],
    /// Column length before scaling; zero for a plane that cannot move.
    length: [f32; PLANES],
    planes: usize,
    rows: usize,
}

impl<const PLANES: usize> PiecewiseLinear<PLANES> {
    /// What another unit of it costs here.
    #[inline]
    fn slope(&self) -> f32 {
        if self.value > 0.0 { self.above } else { self.below }
    }

    #[inline]
    fn way(&self, column: usize) -> f32 {
        self.ways.as_flattened().get(column).copied().unwrap_or(0.0)
    }

    #[inline]
    fn set_way(&mut self, column: usize, way: f32) {
        if let Some(own) = self.ways.as_flattened_mut().get_mut(column) {
            *own = way;
        }
    }
}

impl<const PLANES: usize> Tableau<PLANES> {
    /// To be filled where it stays: moved once, it would cost as much as an exchange.
    #[inline(always)]
    pub fn empty() -> Self {
        Self {
            lines: Vec::new(),
            owners: [[Owner::Nobody; 2]; PLANES],
            tangents: array::from_fn(|_| Vec::new()),
            bound: [0.0; PLANES],
            length: [0.0; PLANES],
            planes: 0,
            rows: 0,
        }
    }

    #[inline(never)]
    pub fn fill<const PROBES: usize>(&mut self, fit: &BoundedFit<PROBES, PLANES>, start: [Pair; PLANES]) {
        (self.planes, self.rows) = (fit.planes(), fit.rows().len());
        let mut squares = [0.0; PLANES];
        for row in fit.rows() {
            for (square, [a, _]) in squares.iter_mut().zip(row) {
                *square += a * a;
            }
        }
        let mut scale = [0.0; PLANES];
        for plane in 0..PLANES {
            let Some(&bound_g_mm) = fit.bound_g_mm().get(plane) else {
                continue;
            };
            let norm = scalar::sqrt(squares[plane]);
            if norm > f32::MIN_POSITIVE && bound_g_mm > f32::MIN_POSITIVE {
                (self.length[plane], scale[plane]) = (norm, 1.0 / norm);
                self.bound[plane] = bound_g_mm * norm;
                self.owners[plane] = [Owner::Unknown; 2];
            }
            for part in 0..2 {
                let mut ways = [[0.0; 2]; PLANES];
                ways[plane][part] = 1.0;
                let value = start[plane][part] * self.length[plane];
                let line = PiecewiseLinear { value, ways, below: 0.0, above: 0.0, vanishes: false };
                let _ = self.lines.push(line);
            }
        }
        for (row, value) in fit.rows().iter().zip(fit.residuals_um(&start)) {
            let mut ways = *row;
            for (way, scale) in ways.iter_mut().zip(&scale) {
                *way = way.map(|x| x * scale);
            }
            let line = PiecewiseLinear { value, ways, below: -1.0, above: 1.0, vanishes: false };
            let _ = self.lines.push(line);
        }
    }

    /// To the least cost with the tangents there are, or as near as the number of exchanges allows.
    pub fn descend(&mut self) {
        for _ in 0..EXCHANGES {
            let Some((column, direction, steepness)) = self.steepest() else {
                return;
            };
            let Some(entering) = self.search(column, direction, steepness) else {
                return;
            };
            self.exchange(column, entering);
        }
    }

    /// Cost of another unit of each column's variable, without that of the variable's own kink.
    #[inline(never)] // once in flash
    fn slopes(&self) -> [Pair; PLANES] {
        let mut slopes = [[0.0; 2]; PLANES];
        for line in self.kinks().filter(|line| !line.vanishes) {
            let slope = line.slope();
            for ([x, y], [a, b]) in slopes.iter_mut().zip(&line.ways) {
                *x += slope * a;
                *y += slope * b;
            }
        }
        slopes
    }

    fn kinks(&self) -> impl Iterator<Item = &PiecewiseLinear<PLANES>> {
        self.lines.iter().skip(2 * self.planes)
    }

    /// The column and the direction (±1) in which the cost falls fastest, and how fast; `None` at the minimum.
    #[inline]
    fn steepest(&self) -> Option<(usize, f32, f32)> {
        let slopes = self.slopes();
        let mut best = None;
        let mut steepest = SLACK;
        let mut is_unknown = false;
        let columns = slopes.as_flattened().iter().zip(self.owners.as_flattened());
        for (column, (&slope, &owner)) in columns.enumerate().take(2 * self.planes) {
            let (up, down, unknown) = match owner {
                Owner::Nobody => continue,
                Owner::Unknown => (slope, slope, true),
                Owner::Line(place) => {
                    let Some(line) = self.lines.get(place) else { continue };
                    (slope + line.above, slope + line.below, false)
                }
            };
            // All unknowns first: only then is it a vertex.
            if is_unknown && !unknown {
                continue;
            }
            let (direction, fall) = if -up > down { (1.0, -up) } else { (-1.0, down) };
            if fall > steepest || (unknown && !is_unknown) {
                (best, steepest, is_unknown) = (Some((column, direction, fall)), fall, unknown);
            }
        }
        best
    }

    /// The line whose zero ends the descent along a column: each zero on the way makes it less steep.
    #[inline]
    fn search(&self, column: usize, direction: f32, mut steepness: f32) -> Option<usize> {
        let first = 2 * self.planes;
        let mut distances: Vec<f32, LINES> = Vec::new();
        for line in self.kinks() {
            let rate = direction * line.way(column);
            let is_ahead = !line.vanishes && line.value * rate <= 0.0 && rate.abs() >= SMALLEST_RATE;
            let _ = distances.push(if is_ahead { line.value.abs() / rate.abs() } else { f32::INFINITY });
        }
        let mut last = None;
        loop {
            let (mut nearest, mut next) = (f32::INFINITY, 0);
            for (place, &distance) in distances.iter().enumerate() {
                if distance < nearest {
                    (nearest, next) = (distance, place);
                }
            }
            let (true, Some(distance), Some(line)) =
                (nearest < f32::INFINITY, distances.get_mut(next), self.lines.get(first + next))
            else {
                // Rounding hid the last rise.
                return last;
            };
            *distance = f32::INFINITY;
            last = Some(first + next);
            steepness -= line.way(column).abs() * (line.above - line.below);
            if steepness <= 0.0 {
                return last;
            }
        }
    }

    /// Makes a line the variable of a column, in which all others are then expressed.
    #[inline]
    fn exchange(&mut self, column: usize, entering: usize) {
        let Some(&line) = self.lines.get(entering) else {
            return;
        };
        let reciprocal = 1.0 / line.way(column);
        for other in &mut self.lines {
            let factor = other.way(column) * reciprocal;
            other.value -= factor * line.value;
            for (cell, pivot) in other.ways.as_flattened_mut().iter_mut().zip(line.ways.as_flattened()) {
                *cell -= factor * pivot;
            }
            other.set_way(column, factor);
        }
        if let Some(line) = self.lines.get_mut(entering) {
            line.value = 0.0;
            line.ways = [[0.0; 2]; PLANES];
            line.vanishes = true;
            line.set_way(column, 1.0);
        }
        if let Some(owner) = self.owners.as_flattened_mut().get_mut(column) {
            if let Owner::Line(leaving) = *owner
                && let Some(line) = self.lines.get_mut(leaving)
            {
                line.vanishes = false;
            }
            *owner = Owner::Line(entering);
        }
    }

    /// The unknowns, scaled.
    #[inline]
    fn unknowns(&self) -> [Pair; PLANES] {
        let mut unknowns = [[0.0; 2]; PLANES];
        for (value, line) in unknowns.as_flattened_mut().iter_mut().zip(&self.lines).take(2 * self.planes) {
            *value = line.value;
        }
        unknowns
    }

    /// Slope of the column whose variable a line is.
    fn slope_of(&self, place: usize, slopes: &[Pair; PLANES]) -> Option<f32> {
        let mut columns = self.owners.as_flattened().iter().zip(slopes.as_flattened());
        columns.find(|(owner, _)| **owner == Owner::Line(place)).map(|(_, &slope)| slope)
    }

    /// λ of each row: its sign, or what holds it at zero.
    pub fn multipliers<const PROBES: usize>(
        &self,
        fit: &BoundedFit<PROBES, PLANES>,
    ) -> Vec<f32, { 2 * MAX_PROBES }> {
        let first = 2 * self.planes;
        let slopes = self.slopes();
        let mut multipliers = Vec::new();
        for line in self.kinks().take(self.rows) {
            let _ = multipliers.push(line.slope());
        }
        let rows = self.owners.as_flattened().iter().enumerate().filter_map(|(column, owner)| match owner {
            Owner::Line(place) => Some((column, place.checked_sub(first)?)),
            _ => None,
        });
        for (column, row) in rows.clone() {
            if let (Some(multiplier), Some(slope)) =
                (multipliers.get_mut(row), slopes.as_flattened().get(column))
            {
                *multiplier = -slope;
            }
        }
        if self.has_tangents() {
            return multipliers;
        }
        // Without tangents Hᵀλ is zero but for what the exchanges left of rounding, which a wide bound would magnify.
        let mut left = certificate::pull(fit, &multipliers);
        for (left, length) in left.iter_mut().zip(&self.length) {
            *left = if *length > 0.0 { left.map(|part| part / length) } else { [0.0; 2] };
        }
        for (column, row) in rows {
            let Some(multiplier) = multipliers.get_mut(row) else {
                continue;
            };
            for (left, unknown) in left.as_flattened().iter().zip(&self.lines).take(first) {
                *multiplier -= unknown.way(column) * left;
            }
        }
        multipliers
    }

    fn column_of(&self, place: usize) -> Option<usize> {
        self.owners.as_flattened().iter().position(|owner| *owner == Owner::Line(place))
    }

    /// The unbalance, g·mm. What many exchanges have left of rounding in the rows that should vanish is taken off.
    pub fn unbalance_g_mm<const PROBES: usize>(&self, fit: &BoundedFit<PROBES, PLANES>) -> [Pair; PLANES] {
        let mut unknowns = self.unknowns();
        let mut unbalance_g_mm = self.unscaled(unknowns);
        let rows = self.lines.iter().enumerate().skip(2 * self.planes).take(self.rows);
        for ((place, line), residual) in rows.zip(fit.residuals_um(&unbalance_g_mm)) {
            if !line.vanishes {
                continue;
            }
            let column = self.column_of(place);
            for (value, unknown) in
                unknowns.as_flattened_mut().iter_mut().zip(&self.lines).take(2 * self.planes)
            {
                *value -= column.map_or(0.0, |column| unknown.way(column)) * residual;
            }
        }
        unbalance_g_mm = self.unscaled(unknowns);
        unbalance_g_mm
    }

    #[inline]
    fn unscaled(&self, mut unknowns: [Pair; PLANES]) -> [Pair; PLANES] {
        for (pair, &length) in unknowns.iter_mut().zip(&self.length) {
            *pair = if length > 0.0 { pair.map(|x| x / length) } else { [0.0; 2] };
        }
        unknowns
    }
}

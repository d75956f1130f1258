//! Discs, brought in by their tangents.

use super::{BEYOND, PiecewiseLinear, Tableau};
use crate::model::Pair;
use crate::scalar;

impl<const PLANES: usize> Tableau<PLANES> {
    /// Adds a tangent to each disc that was left by more than `outside`, relative; whether there was any.
    pub fn cut(&mut self, outside: f32) -> bool {
        let slopes = self.slopes();
        let mut any = false;
        for (plane, [x, y]) in self.unknowns().into_iter().enumerate().take(self.planes) {
            let bound = self.bound.get(plane).copied().unwrap_or(0.0);
            let outer = bound * (1.0 + outside);
            if bound > 0.0 && x * x + y * y > outer * outer {
                let length = scalar::length([x, y]);
                let beyond = |[a, b]: &Pair| a * x + b * y - bound;
                let pulled =
                    self.pulled(plane, &slopes).filter(|touch| beyond(touch) > 0.25 * (length - bound));
                let touch = pulled.unwrap_or([x / length, y / length]);
                any |= self.add_tangent(plane, touch, bound);
            }
        }
        any
    }

    /// Where the tangents of a plane that are in force hold it, put together: a unit vector; `None` without any.
    fn pulled(&self, plane: usize, slopes: &[Pair; PLANES]) -> Option<Pair> {
        let mut sum = [0.0; 2];
        for &([x, y], place) in self.tangents.get(plane)? {
            if let Some(slope) = self.slope_of(place, slopes) {
                sum = [sum[0] - slope * x, sum[1] - slope * y];
            }
        }
        let length = scalar::length(sum);
        (length > 0.0).then(|| sum.map(|x| x / length))
    }

    /// The unbalance with each plane that tangents hold put on its bound where they pull it, g·mm: along a tangent on which
    /// the cost does not change, the vertex may lie anywhere, and this is where the disc touches.
    pub fn pulled_g_mm(&self, mut unbalance_g_mm: [Pair; PLANES]) -> [Pair; PLANES] {
        let slopes = self.slopes();
        for (plane, unbalance) in unbalance_g_mm.iter_mut().enumerate() {
            if let Some(touch) = self.pulled(plane, &slopes)
                && let Some((bound, length)) = self.bound.get(plane).zip(self.length.get(plane))
            {
                *unbalance = touch.map(|x| x * (bound / length));
            }
        }
        unbalance_g_mm
    }

    /// Some disc has a tangent.
    pub fn has_tangents(&self) -> bool {
        self.tangents.iter().any(|tangents| !tangents.is_empty())
    }

    /// In place of one that is not in force, if the disc has all it may have.
    fn add_tangent(&mut self, plane: usize, touch: Pair, bound: f32) -> bool {
        let [a, b] = touch;
        let (Some([x, y]), Some(tangents)) = (
            self.lines.get(2 * plane..).and_then(|lines| lines.first_chunk::<2>()),
            self.tangents.get_mut(plane),
        ) else {
            return false;
        };
        let mut line = PiecewiseLinear {
            value: a * x.value + b * y.value - bound,
            ways: [[0.0; 2]; PLANES],
            below: 0.0,
            above: BEYOND,
            vanishes: false,
        };
        let both = x.ways.as_flattened().iter().zip(y.ways.as_flattened());
        for (way, (x, y)) in line.ways.as_flattened_mut().iter_mut().zip(both) {
            *way = a * x + b * y;
        }
        let place = self.lines.len();
        if tangents.push((touch, place)).is_ok() {
            return self.lines.push(line).is_ok();
        }
        for (old_touch, place) in tangents {
            if let Some(old) = self.lines.get_mut(*place)
                && !old.vanishes
            {
                (*old_touch, *old) = (touch, line);
                return true;
            }
        }
        false
    }
}

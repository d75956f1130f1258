//! Weights in fixed places, as holes or blades: a vector split over the few that come nearest.

use nalgebra::Complex;

use super::weights::Allowed;
use crate::unbalance::G_MM;

type C = Complex<f64>;

/// Ways to fill a plane that are weighed against those of the others.
const KEPT: usize = 200;
/// Places farther than this from the direction that is wanted, and than the next place, are not used, degrees.
const SIDE_DEG: f64 = 60.0;
/// Relative reduction of the residual vibration below which the lightest filling stays.
const WORTH: f64 = 1e-6;
/// Most places that one vector may be split over.
pub const MOST: usize = 3;

/// Places evenly around a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holes {
    pub count: usize,
    /// Angle of number 1, degrees with the rotation.
    pub first_deg: f64,
    /// Whether numbers grow against the rotation.
    pub against_rotation: bool,
    /// Most of them that one plane's weight may be split over, at most [`MOST`].
    pub most: usize,
}

/// One weight in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightPiece {
    /// Number of the hole; none where any angle is allowed.
    pub hole: Option<usize>,
    pub unbalance_g_mm: C,
    /// Mass in g and radius in mm; none where no radius is stated.
    pub mass_and_radius: Option<[f64; 2]>,
}

/// Weights that together make one plane's unbalance.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Filling {
    pub pieces: Vec<WeightPiece>,
}

impl Filling {
    /// Sum of the pieces, g·mm.
    pub fn sum_g_mm(&self) -> C {
        self.pieces.iter().map(|p| p.unbalance_g_mm).sum()
    }

    fn size_g_mm(&self) -> f64 {
        self.pieces.iter().map(|p| p.unbalance_g_mm.norm()).sum()
    }
}

/// Fillings near the wanted unbalance of one plane within its limit, g·mm, nearest first; there is always one. `taken` are the
/// numbers of holes that cannot be used.
pub fn fillings(
    wanted_g_mm: C,
    allowed: &Allowed,
    holes: Option<&Holes>,
    taken: &[usize],
    limit_g_mm: f64,
) -> Vec<Filling> {
    let Some(holes) = holes else { return vec![anywhere(wanted_g_mm, allowed, limit_g_mm)] };
    let sets = subsets(holes, taken, allowed, wanted_g_mm);
    let mut all: Vec<Filling> = sets.iter().flat_map(|set| split(wanted_g_mm, set)).collect();
    all.push(Filling::default());
    all.retain(|f| f.sum_g_mm().norm() <= limit_g_mm * (1.0 + 1e-9));
    // to the millionth of a g·mm all are equal, and the lightest is best
    let rank = |f: &Filling| ((f.sum_g_mm() - wanted_g_mm).norm() * 1e6).round();
    all.sort_by(|a, b| rank(a).total_cmp(&rank(b)).then(a.size_g_mm().total_cmp(&b.size_g_mm())));
    all.truncate(KEPT);
    all
}

/// One weight at the angle that is wanted.
fn anywhere(wanted_g_mm: C, allowed: &Allowed, limit_g_mm: f64) -> Filling {
    let weight = allowed.nearest(wanted_g_mm / G_MM);
    let (mut unbalance_g_mm, mut mass_and_radius) = (weight.unbalance_kg_m * G_MM, weight.mass_and_radius);
    if let Some(step_g) = allowed.step_g.filter(|_| unbalance_g_mm.norm() > limit_g_mm * (1.0 + 1e-9)) {
        // the nearest step is beyond the limit: the last one within
        let within = |radius_mm: &f64| [(limit_g_mm / (radius_mm * step_g)).floor() * step_g, *radius_mm];
        let size = |[mass_g, radius_mm]: &[f64; 2]| mass_g * radius_mm;
        mass_and_radius = allowed.radii_mm.iter().map(within).max_by(|a, b| size(a).total_cmp(&size(b)));
        unbalance_g_mm = C::from_polar(mass_and_radius.as_ref().map_or(0.0, size), wanted_g_mm.arg());
    }
    Filling { pieces: vec![WeightPiece { hole: None, unbalance_g_mm, mass_and_radius }] }
}

/// The best of every plane's ways together: each plane's in turn, until none helps.
pub fn together(ways: &[Vec<Filling>], cost: impl Fn(&[C]) -> f64) -> Vec<Filling> {
    let mut chosen = vec![0; ways.len()];
    let mut sums: Vec<C> = ways.iter().map(|w| w[0].sum_g_mm()).collect();
    let mut least = cost(&sums);
    let worth = WORTH * cost(&vec![C::from(0.0); ways.len()]);
    loop {
        let before = least;
        for (plane, here) in ways.iter().enumerate() {
            for (k, way) in here.iter().enumerate() {
                let held = std::mem::replace(&mut sums[plane], way.sum_g_mm());
                let now = cost(&sums);
                if now < least - worth {
                    (least, chosen[plane]) = (now, k);
                } else {
                    sums[plane] = held;
                }
            }
        }
        if least >= before {
            return chosen.iter().zip(ways).map(|(k, here)| here[*k].clone()).collect();
        }
    }
}

/// A place: its number, direction, and the unbalance of a step in it, g·mm, zero where any is allowed.
#[derive(Debug, Clone, Copy)]
struct WeightPosition {
    hole: usize,
    direction: C,
    radius_mm: Option<f64>,
    step_g: Option<f64>,
}

impl WeightPosition {
    fn piece(&self, size_g_mm: f64) -> WeightPiece {
        let mass_and_radius = self.radius_mm.map(|r| [size_g_mm / r, r]);
        WeightPiece { hole: Some(self.hole), unbalance_g_mm: self.direction * size_g_mm, mass_and_radius }
    }

    /// Sizes that can be had next to one, g·mm.
    fn near(&self, size_g_mm: f64) -> Vec<f64> {
        match self.step_g.zip(self.radius_mm) {
            Some((step_g, radius_mm)) => {
                let step = step_g * radius_mm;
                let below = (size_g_mm / step).floor();
                [below, below + 1.0].into_iter().map(|n| n * step).filter(|s| *s >= 0.0).collect()
            }
            None => vec![size_g_mm],
        }
    }
}

/// Every choice of one to `most` holes on the side of the weight that is wanted, each at each radius.
fn subsets(holes: &Holes, taken: &[usize], allowed: &Allowed, wanted: C) -> Vec<Vec<WeightPosition>> {
    let turn = if holes.against_rotation { -360.0 } else { 360.0 } / holes.count as f64;
    let radii: Vec<Option<f64>> = match allowed.radii_mm.as_slice() {
        [] => vec![None],
        some => some.iter().copied().map(Some).collect(),
    };
    let place = |k: usize, radius_mm: Option<f64>| WeightPosition {
        hole: k + 1,
        direction: C::from_polar(1.0, (holes.first_deg + turn * k as f64).to_radians()),
        radius_mm,
        step_g: allowed.step_g,
    };
    // farther away, weights mostly work against each other; and where holes are taken, so far that some are left
    let is_free = |k: &usize| !taken.contains(&(k + 1));
    let off = |k: usize| (place(k, None).direction * wanted.conj()).arg().to_degrees().abs();
    let mut off_deg: Vec<f64> = (0..holes.count).filter(is_free).map(off).collect();
    off_deg.sort_by(f64::total_cmp);
    let second_deg = off_deg.get(1).or(off_deg.first()).copied().unwrap_or(0.0);
    let aside_deg = SIDE_DEG.max(turn.abs()).max(second_deg + 1e-9);
    let beside = |p: &WeightPosition| (p.direction * wanted.conj()).arg().to_degrees().abs() <= aside_deg;
    let places: Vec<WeightPosition> = (0..holes.count)
        .filter(is_free)
        .flat_map(|k| radii.iter().map(move |r| (k, *r)))
        .map(|(k, r)| place(k, r))
        .filter(beside)
        .collect();
    let mut all: Vec<Vec<WeightPosition>> = places.iter().map(|p| vec![*p]).collect();
    let mut last = all.clone();
    for _ in 1..holes.most.min(MOST) {
        let longer = |set: &Vec<WeightPosition>| {
            let after = set[set.len() - 1].hole;
            places
                .iter()
                .filter(move |p| p.hole > after)
                .map(|p| [set.as_slice(), &[*p]].concat())
                .collect::<Vec<_>>()
        };
        last = last.iter().flat_map(longer).collect();
        all.extend(last.iter().cloned());
    }
    all
}

/// Sizes in these places that come near the wanted unbalance; none where one would have to be negative.
fn split(wanted: C, places: &[WeightPosition]) -> Vec<Filling> {
    let along = |p: &WeightPosition, of: C| (of * p.direction.conj()).re;
    let filling = |pieces: Vec<WeightPiece>| Filling { pieces };
    match places {
        [one] if along(one, wanted) < 0.0 => Vec::new(),
        [one] => one.near(along(one, wanted)).into_iter().map(|s| filling(vec![one.piece(s)])).collect(),
        [a, b] => {
            let across = (a.direction.conj() * b.direction).im;
            // opposite holes only take each other's weight away
            if across.abs() < 1e-9 {
                return Vec::new();
            }
            let size_a = (wanted.conj() * b.direction).im / across;
            let size_b = (a.direction.conj() * wanted).im / across;
            if size_a < 0.0 || size_b < 0.0 {
                return Vec::new();
            }
            let pair = |s: f64| b.near(size_b).into_iter().map(move |t| vec![a.piece(s), b.piece(t)]);
            a.near(size_a).into_iter().flat_map(pair).map(filling).collect()
        }
        [first, rest @ ..] => {
            // a third place is of use only where weights come in steps
            let Some(step) = first.step_g.zip(first.radius_mm).map(|(g, mm)| g * mm) else {
                return Vec::new();
            };
            let steps = (along(first, wanted) / step).floor().max(0.0) as usize;
            let with = |n: usize| {
                let piece = first.piece(n as f64 * step);
                split(wanted - piece.unbalance_g_mm, rest)
                    .into_iter()
                    .map(move |f| filling([vec![piece], f.pieces].concat()))
            };
            (1..=steps).flat_map(with).collect()
        }
        [] => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polar(size: f64, angle_deg: f64) -> C {
        C::from_polar(size, angle_deg.to_radians())
    }

    #[test]
    fn vector_between_two_holes_is_split_and_at_a_hole_is_not() {
        let holes = Holes { count: 8, first_deg: 10.0, against_rotation: false, most: 2 };
        let best = &fillings(polar(100.0, 77.5), &Allowed::default(), Some(&holes), &[], f64::INFINITY)[0];
        assert_eq!(best.pieces.iter().map(|p| p.hole.unwrap()).collect::<Vec<_>>(), [2, 3]);
        assert!((best.sum_g_mm() - polar(100.0, 77.5)).norm() < 1e-9);
        let at = &fillings(polar(100.0, 55.0), &Allowed::default(), Some(&holes), &[], f64::INFINITY)[0];
        assert_eq!(at.pieces.iter().filter(|p| p.unbalance_g_mm.norm() > 1e-6).count(), 1);
        let back = Holes { against_rotation: true, ..holes };
        let other = &fillings(polar(100.0, 55.0), &Allowed::default(), Some(&back), &[], f64::INFINITY)[0];
        assert_eq!(other.pieces[0].hole, Some(8), "10°, −35°, … 55°");
    }

    #[test]
    fn stepped_masses_equal_exhaustive_search_of_2_and_3_holes() {
        let allowed = Allowed { radii_mm: vec![50.0], step_g: Some(0.5) };
        let wanted = polar(183.0, 71.0);
        for most in [2, 3] {
            let holes = Holes { count: 12, first_deg: 0.0, against_rotation: false, most };
            let found = &fillings(wanted, &allowed, Some(&holes), &[], f64::INFINITY)[0];
            // those within 60° of the direction
            let at = |k: usize| polar(25.0, 30.0 * (k + 1) as f64);
            let (mut least, steps) = (f64::INFINITY, 10);
            for a in 0..4 {
                for b in a + 1..4 {
                    for c in b + 1..4 {
                        let third = if most == 3 { steps } else { 0 };
                        for n in 0..=steps {
                            for m in 0..=steps {
                                for l in 0..=third {
                                    let sum = at(a) * n as f64 + at(b) * m as f64 + at(c) * l as f64;
                                    least = (sum - wanted).norm().min(least);
                                }
                            }
                        }
                    }
                }
            }
            let off = (found.sum_g_mm() - wanted).norm();
            assert!(found.pieces.len() <= most && off < 1.5 * least + 1e-9, "{most}: {off} {least}");
        }
    }

    #[test]
    fn taken_holes_are_excluded_at_any_distance() {
        let holes = Holes { count: 6, first_deg: 0.0, against_rotation: false, most: 2 };
        let numbers = |taken: &[usize]| {
            let best =
                &fillings(polar(100.0, 70.0), &Allowed::default(), Some(&holes), taken, f64::INFINITY)[0];
            let off = (best.sum_g_mm() - polar(100.0, 70.0)).norm();
            (best.pieces.iter().map(|p| p.hole.unwrap()).collect::<Vec<_>>(), off)
        };
        assert_eq!(numbers(&[]).0, [2, 3]);
        // between 0° and 120°, and between 0° and 180° there is none but 0° itself
        assert_eq!(numbers(&[2]).0, [1, 3]);
        assert!(numbers(&[2]).1 < 1e-9);
        let (left, off) = numbers(&[2, 3]);
        assert_eq!(left, [1]);
        assert!((off - 100.0 * 70.0_f64.to_radians().sin()).abs() < 1e-9);
        assert!(numbers(&[1, 2, 3, 4, 5, 6]).0.is_empty());
    }

    #[test]
    fn filling_planes_jointly_compensates_rounding_of_one_plane() {
        let holes = Holes { count: 4, first_deg: 0.0, against_rotation: false, most: 1 };
        let allowed = Allowed { radii_mm: vec![1.0], step_g: Some(10.0) };
        let wanted = [C::from(14.0), C::from(14.0)];
        let ways = wanted.map(|w| fillings(w, &allowed, Some(&holes), &[], f64::INFINITY));
        // only the sum counts: 28 is 10 + 20 or 20 + 10, not 10 + 10
        let best = together(&ways, |w| (w[0] + w[1] - 28.0).norm_sqr());
        assert!((best.iter().map(Filling::sum_g_mm).sum::<C>() - 30.0).norm() < 1e-9);
        assert!(
            fillings(wanted[0], &allowed, Some(&holes), &[], 9.0)[0].pieces.is_empty(),
            "the limit is kept"
        );
        let steps = Allowed { radii_mm: vec![3.0, 4.0], step_g: Some(2.0) };
        let anywhere = &fillings(polar(15.9, 20.0), &steps, None, &[], 15.9)[0];
        assert!((anywhere.sum_g_mm() - polar(12.0, 20.0)).norm() < 1e-9, "2 g at 4 mm more would be 16");
    }
}

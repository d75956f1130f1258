//! Maxima of the forced response over speed: place, height, amplification factor and separation margin, each on the
//! response itself and not on the grid that the curve is drawn by.
//!
//! The amplification factor is by the half-power points of the curve, `N₁ / (N₂ − N₁)` with the amplitude at 0.707 of the
//! peak. A peak of factor A ≥ 2.5 needs a separation margin of `17 (1 − 1/(A − 1.5))` percent below the running range and 10
//! more above it (API 617, lateral analysis). Where the curve rises again before it falls to the half-power level, the step
//! to this place is a lower bound of the width, and so bounds the factor from above.
//!
//! Only a peak within three half-widths of a critical speed is a resonance; other maxima stand between resonances, often
//! beside an antiresonance, and have neither factor nor margin.

use nalgebra::Complex;

type C = Complex<f64>;

/// Below this amplification factor a peak is critically damped and needs no margin.
const CRITICALLY_DAMPED: f64 = 2.5;
/// Margin that a peak without any damping needs below the running range, percent; above it, 10 more.
const LARGEST_NEEDED: f64 = 17.0;
const MORE_ABOVE: f64 = 10.0;
/// A peak belongs to a critical speed that is at most so many half-widths of its resonance away.
const REACH: f64 = 3.0;
/// A vertex or crossing is found once it moves by less than this share of the speed.
const SETTLED: f64 = 1e-8;
const ROUNDS: usize = 40;

/// A critical speed that unbalance excites.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    pub speed_rpm: f64,
    /// Half of the width at half power: the rate of decay of the mode, rpm.
    pub half_width_rpm: f64,
}

/// What peaks are judged by.
#[derive(Clone, Copy)]
pub struct PeakContext<'a> {
    pub resonances: &'a [Resonance],
    pub running_rpm: Option<[f64; 2]>,
    /// The response at any speed, rpm.
    pub at: &'a dyn Fn(f64) -> Option<C>,
}

/// A maximum of the amplitude over speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Peak {
    /// Speed of the maximum, rpm.
    pub speed_rpm: f64,
    /// Phasor at the maximum, m.
    pub phasor_m: C,
    /// Critical speed of the mode that resonates, rpm; `None` for a maximum between resonances.
    pub critical_rpm: Option<f64>,
    /// Amplification factor; `None` where a half-power point is not reached, or without a resonance.
    pub amplification: Option<f64>,
    /// Distance from the running range and what is needed, percent; `None` without a running range, without a resonance or
    /// for a peak that is critically damped. Negative inside the range.
    pub margin_percent: Option<[f64; 2]>,
}

impl Peak {
    /// Amplitude, zero to peak, m.
    pub fn amplitude_m(&self) -> f64 {
        self.phasor_m.norm()
    }

    /// Whether the margin is as large as needed; `None` without a margin.
    pub fn has_margin(&self) -> Option<bool> {
        self.margin_percent.map(|[margin, needed]| margin >= needed)
    }
}

/// Peaks of a curve over speeds in rpm. A gap in the curve is a point that is not finite.
pub fn peaks(curve: &[(f64, C)], context: PeakContext) -> Vec<Peak> {
    let pieces = curve.split(|(_, y)| !y.is_finite());
    pieces.flat_map(|piece| peaks_of_piece(piece, context)).collect()
}

fn peaks_of_piece(curve: &[(f64, C)], context: PeakContext) -> Vec<Peak> {
    let size = |i: usize| curve[i].1.norm();
    let mut found = Vec::new();
    for i in 1..curve.len().saturating_sub(1) {
        if size(i) <= size(i - 1) || size(i) < size(i + 1) {
            continue;
        }
        let around = [curve[i - 1], curve[i], curve[i + 1]];
        let Some((speed_rpm, phasor_m)) = vertex(around, context.at) else { continue };
        let mut peak =
            Peak { speed_rpm, phasor_m, critical_rpm: None, amplification: None, margin_percent: None };
        peak.critical_rpm = resonance_of(speed_rpm, context.resonances);
        if peak.critical_rpm.is_some() {
            let below = half_power((speed_rpm, phasor_m), curve[..i].iter().rev(), context.at);
            let above = half_power((speed_rpm, phasor_m), curve[i + 1..].iter(), context.at);
            let width_rpm = above.speed_rpm - below.speed_rpm;
            let at_most = if width_rpm > 0.0 { speed_rpm / width_rpm } else { f64::INFINITY };
            peak.amplification = (below.is_reached && above.is_reached).then_some(at_most);
            let needs_margin = at_most >= CRITICALLY_DAMPED;
            let range = context.running_rpm.filter(|_| needs_margin);
            peak.margin_percent = range.map(|range| margin_percent(speed_rpm, at_most, range));
        }
        found.push(peak);
    }
    found
}

/// The critical speed whose resonance a peak at this speed is.
fn resonance_of(speed_rpm: f64, resonances: &[Resonance]) -> Option<f64> {
    let distance = |r: &Resonance| (speed_rpm - r.speed_rpm).abs() / r.half_width_rpm;
    let nearest = resonances.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    (distance(nearest) <= REACH).then_some(nearest.speed_rpm)
}

/// Margin and what is needed, percent, of a peak of this amplification factor.
pub fn margin_percent(speed_rpm: f64, amplification: f64, [from, to]: [f64; 2]) -> [f64; 2] {
    let needed = LARGEST_NEEDED * (1.0 - 1.0 / (amplification - 1.5));
    if speed_rpm < from {
        [100.0 * (from - speed_rpm) / from, needed]
    } else if speed_rpm > to {
        [100.0 * (speed_rpm - to) / to, MORE_ABOVE + needed]
    } else {
        let inside = (speed_rpm - from).min(to - speed_rpm);
        [-100.0 * inside / speed_rpm, needed]
    }
}

/// The maximum between the outer of three points of which the middle one is the largest. Near a resonance `1/|y|²` is a
/// parabola in the speed, so its vertex is tried first, and the golden section where it does not help.
fn vertex(mut points: [(f64, C); 3], at: &dyn Fn(f64) -> Option<C>) -> Option<(f64, C)> {
    const GOLDEN: f64 = 0.381_966;
    for round in 0..ROUNDS {
        let [a, b, c] = points.map(|(speed, y)| (speed, y.norm_sqr().recip()));
        if c.0 - a.0 < SETTLED * b.0 {
            break;
        }
        let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
        let bend = (right - left) / (c.0 - a.0);
        let parabola = 0.5 * (a.0 + b.0) - 0.5 * left / bend;
        let section = match b.0 - a.0 > c.0 - b.0 {
            true => b.0 - GOLDEN * (b.0 - a.0),
            false => b.0 + GOLDEN * (c.0 - b.0),
        };
        let inside = bend > 0.0 && parabola > a.0 && parabola < c.0;
        // every third step narrows the interval from its wider side
        let is_parabola = inside && round % 3 < 2;
        let next = if is_parabola { parabola } else { section };
        if (next - b.0).abs() < 0.5 * SETTLED * b.0 {
            if is_parabola {
                break;
            }
            continue;
        }
        let new = (next, at(next)?);
        let higher = new.1.norm() > points[1].1.norm();
        points = match (next < b.0, higher) {
            (true, true) => [points[0], new, points[1]],
            (true, false) => [new, points[1], points[2]],
            (false, true) => [points[1], new, points[2]],
            (false, false) => [points[0], points[1], new],
        };
    }
    Some(points[1])
}

/// Where a curve falls to the half-power level beside a peak, or as far as it falls.
struct HalfPower {
    speed_rpm: f64,
    is_reached: bool,
}

fn half_power<'a>(
    top: (f64, C),
    points: impl Iterator<Item = &'a (f64, C)>,
    at: &dyn Fn(f64) -> Option<C>,
) -> HalfPower {
    let level = 0.5 * top.1.norm_sqr();
    let (mut last, mut lowest) = (top, top);
    for point in points {
        let size = point.1.norm_sqr();
        if size <= level {
            let speed_rpm = crossing([last, *point], level, at);
            return HalfPower { speed_rpm, is_reached: true };
        }
        if size > top.1.norm_sqr() {
            break;
        }
        if size < lowest.1.norm_sqr() {
            lowest = *point;
        }
        last = *point;
    }
    HalfPower { speed_rpm: lowest.0, is_reached: false }
}

/// Speed between two points, the first above and the second below the level of `|y|²`.
fn crossing([mut high, mut low]: [(f64, C); 2], level: f64, at: &dyn Fn(f64) -> Option<C>) -> f64 {
    for _ in 0..ROUNDS {
        if (low.0 - high.0).abs() < 1e-6 * high.0 {
            break;
        }
        let middle = 0.5 * (high.0 + low.0);
        let Some(y) = at(middle) else { break };
        if y.norm_sqr() > level {
            high = (middle, y);
        } else {
            low = (middle, y);
        }
    }
    0.5 * (high.0 + low.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Response of one mass to its unbalance, for a natural frequency of 1000 rpm.
    fn single(damping_ratio: f64) -> impl Fn(f64) -> Option<C> {
        move |speed_rpm| {
            let r = speed_rpm / 1000.0;
            Some(C::from(r * r) / C::new(1.0 - r * r, 2.0 * damping_ratio * r))
        }
    }

    fn single_resonance(damping_ratio: f64) -> [Resonance; 1] {
        let damped = (1.0 - damping_ratio * damping_ratio).sqrt();
        [Resonance { speed_rpm: 1000.0 * damped, half_width_rpm: 1000.0 * damping_ratio }]
    }

    fn context<'a>(
        resonances: &'a [Resonance],
        running_rpm: Option<[f64; 2]>,
        at: &'a dyn Fn(f64) -> Option<C>,
    ) -> PeakContext<'a> {
        PeakContext { resonances, running_rpm, at }
    }

    fn coarse(at: &dyn Fn(f64) -> Option<C>, from: u32, to: u32) -> Vec<(f64, C)> {
        (from..=to).map(|k| f64::from(100 * k)).map(|s| (s, at(s).unwrap())).collect()
    }

    #[test]
    fn peak_on_a_coarse_grid_equals_the_closed_form() {
        let zeta = 0.03_f64;
        let at = single(zeta);
        let curve: Vec<_> =
            coarse(&at, 1, 30).iter().map(|(s, _)| (s + 37.0, at(s + 37.0).unwrap())).collect();
        let found = peaks(&curve, context(&single_resonance(zeta), Some([1500.0, 2000.0]), &at));
        let [peak] = &found[..] else { panic!("{found:?}") };
        let damped = (1.0 - 2.0 * zeta * zeta).sqrt();
        assert!((peak.speed_rpm * damped / 1000.0 - 1.0).abs() < 1e-6, "{peak:?}");
        let height = (2.0 * zeta * (1.0 - zeta * zeta).sqrt()).recip();
        assert!((peak.amplitude_m() / height - 1.0).abs() < 1e-9, "{peak:?}");
        // |y|² = h²/2 has r² = 1/(1 − 2ζ² ± 2ζ√(1 − ζ²))
        let edge = |sign: f64| {
            (1.0 - 2.0 * zeta * zeta + sign * 2.0 * zeta * (1.0 - zeta * zeta).sqrt()).sqrt().recip()
        };
        let factor = damped.recip() / (edge(-1.0) - edge(1.0));
        assert!((peak.amplification.unwrap() / factor - 1.0).abs() < 1e-4, "{peak:?} {factor}");
        assert_eq!(peak.has_margin(), Some(true));
    }

    #[test]
    fn broad_peak_without_half_power_points_needs_no_margin() {
        let at = single(0.5);
        let curve = coarse(&at, 8, 40);
        let found = peaks(&curve, context(&single_resonance(0.5), Some([1200.0, 1500.0]), &at));
        let [peak] = &found[..] else { panic!("{found:?}") };
        assert!(peak.amplification.is_none() && peak.margin_percent.is_none(), "{peak:?}");
    }

    #[test]
    fn point_beside_a_gap_is_no_peak() {
        let at = single(0.0);
        let mut curve = coarse(&at, 5, 15);
        curve[5].1 = C::from(f64::NAN);
        assert!(peaks(&curve, context(&single_resonance(0.0), None, &at)).is_empty());
    }

    #[test]
    fn maximum_far_from_a_critical_speed_is_no_resonance() {
        // a mode at 1000 rpm and the opposite motion of one at 2000 rpm: a null and a bump between them
        let one = single(0.01);
        let at = |s: f64| Some(one(s)? * 0.3 - one(0.5 * s)? + C::from(0.35));
        let curve: Vec<_> = (40..360).map(|k| 5.0 * f64::from(k)).map(|s| (s, at(s).unwrap())).collect();
        let found = peaks(&curve, context(&single_resonance(0.01), Some([3000.0, 4000.0]), &at));
        let (near, far): (Vec<&Peak>, Vec<&Peak>) =
            found.iter().partition(|p| (p.speed_rpm - 1000.0).abs() < 30.0);
        assert!(near.len() == 1 && near[0].critical_rpm.is_some(), "{found:?}");
        assert!(far.iter().all(|p| p.critical_rpm.is_none() && p.margin_percent.is_none()), "{found:?}");
    }
}

//! What is wrong with phasors over time that no single reading shows: values that froze, a phase reference that was moved.

use std::ops::Range;

use nalgebra::Complex;

type C = Complex<f64>;

/// Readings in a row with one and the same value, to the last digit, that are no measurement.
const FROZEN: usize = 4;
/// Least turn of a phase reference that is told, degrees: bearings that wander turn all probes by half of it within days.
const TURNED_DEG: f64 = 25.0;
/// A turn is one of the reference if it is so many times the usual turn from one reading to the next, and leaves no more
/// than so many times what a turn usually leaves.
const UNUSUAL: f64 = 10.0;
const USUAL: f64 = 2.0;
/// Readings on either side that all show at least half of the turn: a reference that was moved stays where it is, a disturbance passes.
const LASTING: usize = 3;
/// Fewest pairs of readings that show what is usual.
const FEWEST: usize = 8;

/// The first stretch in which a value is one and the same for at least four readings in a row; gaps count as nothing.
pub fn frozen(values: &[Option<C>]) -> Option<Range<usize>> {
    let mut first = 0;
    for run in values.chunk_by(|a, b| a.is_some() && a == b) {
        if run.len() >= FROZEN {
            return Some(first..first + run.len());
        }
        first += run.len();
    }
    None
}

/// A turn from one reading to the next, and what it leaves unexplained of the later one, relative.
struct Turn {
    to: usize,
    angle_deg: f64,
    left: f64,
}

fn turn(to: usize, before: &[C], after: &[C]) -> Turn {
    let along: C = before.iter().zip(after).map(|(a, b)| a.conj() * b).sum();
    let by = C::from_polar(1.0, along.arg());
    let norm = |all: &mut dyn Iterator<Item = C>| all.map(|y| y.norm_sqr()).sum::<f64>().sqrt();
    let left = norm(&mut before.iter().zip(after).map(|(a, b)| b - by * a));
    let size = norm(&mut after.iter().copied());
    Turn { to, angle_deg: along.arg().to_degrees(), left: left / size.max(f64::MIN_POSITIVE) }
}

/// The first reading from which on all phasors are turned by one angle, degrees, and stay so, while their amplitudes
/// are what they were. `readings` have the same phasors in one order each.
pub fn moved_reference(readings: &[&[C]]) -> Option<(usize, f64)> {
    let pairs = readings.windows(2).enumerate();
    let turns: Vec<Turn> = pairs.map(|(k, pair)| turn(k + 1, pair[0], pair[1])).collect();
    if turns.len() < FEWEST || readings.iter().any(|r| r.len() < 2) {
        return None;
    }
    let median = |of: fn(&Turn) -> f64| {
        let mut all: Vec<f64> = turns.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    let (usual_deg, usual_left) = (median(|t| t.angle_deg.abs()), median(|t| t.left));
    let least_deg = TURNED_DEG.max(UNUSUAL * usual_deg);
    let lasts = |t: &Turn| {
        let (Some(from), to) = (t.to.checked_sub(LASTING), t.to + LASTING) else { return false };
        let pairs = || (from..t.to).flat_map(|k| (t.to..to).map(move |l| (k, l)));
        let along =
            |(k, l): (usize, usize)| turn(l, readings[k], readings[l]).angle_deg * t.angle_deg.signum();
        to <= readings.len() && pairs().all(|pair| along(pair) >= 0.5 * least_deg)
    };
    let moved = |t: &&Turn| t.angle_deg.abs() >= least_deg && t.left <= USUAL * usual_left && lasts(t);
    turns.iter().find(moved).map(|t| (t.to, t.angle_deg))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};

    /// Readings of four probes that scatter by two percent.
    fn readings(turned: impl Fn(usize, usize) -> C) -> Vec<Vec<C>> {
        let mut random = StdRng::seed_from_u64(4);
        let mut scatter = || 1.0 + C::new(random.random_range(-0.02..0.02), random.random_range(-0.02..0.02));
        let still = [C::new(3.0, 1.0), C::new(-2.0, 2.0), C::new(0.5, -4.0), C::new(1.0, 1.0)];
        let one = |k: usize| still.iter().enumerate().map(|(p, y)| y * scatter() * turned(k, p)).collect();
        (0..40).map(one).collect()
    }

    fn found(readings: &[Vec<C>]) -> Option<(usize, f64)> {
        moved_reference(&readings.iter().map(Vec::as_slice).collect::<Vec<_>>())
    }

    #[test]
    fn a_turn_of_all_probes_is_told_with_its_reading_and_angle() {
        let by = |degrees: f64| C::from_polar(1.0, degrees.to_radians());
        let (at, angle_deg) = found(&readings(|k, _| if k < 25 { by(0.0) } else { by(-40.0) })).unwrap();
        assert!(at == 25 && (angle_deg + 40.0).abs() < 2.0, "{at} {angle_deg}");
    }

    #[test]
    fn single_turned_reading_is_no_moved_phase_reference() {
        let by = |degrees: f64| C::from_polar(1.0, degrees.to_radians());
        assert_eq!(found(&readings(|k, _| if k == 25 { by(60.0) } else { by(0.0) })), None);
    }

    #[test]
    fn step_of_one_probe_or_of_amplitudes_is_no_phase_turn() {
        let by = C::from_polar(1.0, 0.7);
        assert_eq!(found(&readings(|_, _| 1.0.into())), None);
        assert_eq!(found(&readings(|k, p| if k < 25 || p > 0 { 1.0.into() } else { by })), None);
        assert_eq!(found(&readings(|k, _| if k < 25 { 1.0.into() } else { 1.6 * by })), None);
    }

    #[test]
    fn four_equal_values_in_a_row_are_frozen_and_gaps_are_not() {
        let y = |x: f64| Some(C::new(x, 1.0));
        let values = [y(1.0), None, None, None, None, y(2.0), y(2.0), y(2.0), y(3.0)];
        assert_eq!(frozen(&values), None);
        assert_eq!(frozen(&[&values[..8], &[y(2.0), y(2.0)]].concat()), Some(5..10));
    }
}

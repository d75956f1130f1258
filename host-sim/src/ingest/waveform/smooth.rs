//! Marks whose moment is known to one sample only, put on the curve that those around them make.
//!
//! A channel that jumps between two samples says that the mark lies between them, and no more: at 41 samples a turn that is
//! 2 % of a turn, and as much of the speed. Where the shaft turns steadily, a parabola through the marks on either side
//! says it better; a mark never leaves the two samples between which it was seen.

use nalgebra::{Matrix3, Vector3};

use super::mark::Mark;

/// Marks on either side that share a parabola.
const REACH: usize = 8;
/// Fewer marks make no parabola.
const FEWEST: usize = 5;
/// A turn that is so much longer or shorter than the one before, relative, ends the stretch.
const BROKEN: f64 = 0.25;

/// Moves each mark to the parabola, where there is one, within its two samples.
pub fn smooth(marks: &mut [Mark]) {
    let measured: Vec<f64> = marks.iter().map(|mark| mark.at()).collect();
    let stretches = stretches(&measured);
    for (number, mark) in marks.iter_mut().enumerate() {
        let Some(stretch) = stretches.iter().find(|s| s.contains(&number)) else { continue };
        let from = number.saturating_sub(REACH).max(stretch.start);
        let to = (number + REACH + 1).min(stretch.end);
        if let Some(at) = on_parabola(&measured[from..to], number - from) {
            mark.age = (mark.sample as f64 - at).clamp(0.0, 1.0) as f32;
        }
    }
}

/// Runs of marks whose turns are about as long as the ones before them.
fn stretches(measured: &[f64]) -> Vec<std::ops::Range<usize>> {
    let turns: Vec<f64> = measured.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut all = Vec::new();
    let mut start = 0;
    for i in 1..turns.len() {
        if (turns[i] / turns[i - 1] - 1.0).abs() > BROKEN {
            all.push(start..i + 1);
            start = i + 1;
        }
    }
    all.push(start..measured.len());
    all
}

/// The value of a least-squares parabola through equally spaced values, at one of them.
fn on_parabola(values: &[f64], at: usize) -> Option<f64> {
    if values.len() < FEWEST {
        return None;
    }
    let origin = values[at];
    let (mut normal, mut right) = (Matrix3::<f64>::zeros(), Vector3::<f64>::zeros());
    for (i, value) in values.iter().enumerate() {
        let x = (i as f64 - at as f64) / REACH as f64;
        let row = Vector3::new(1.0, x, x * x);
        normal += row * row.transpose();
        right += row * (value - origin);
    }
    Some(origin + (normal.try_inverse()? * right)[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_known_to_a_sample_come_near_their_true_moments() {
        // where a turn comes near whole samples, as it does while the speed changes, neighbours err alike
        for (rise, bound) in [(0.0, 0.15), (2e-4, 0.25)] {
            let exact: Vec<f64> =
                (0..200).map(f64::from).map(|k| 3.3 + 40.87 * (k - 0.5 * rise * k * k)).collect();
            let mut marks: Vec<Mark> =
                exact.iter().map(|at| Mark { sample: at.ceil() as usize, age: 0.5 }).collect();
            let worst = |marks: &[Mark]| {
                marks.iter().zip(&exact).map(|(m, at)| (m.at() - at).abs()).fold(0.0, f64::max)
            };
            assert!(worst(&marks) > 0.45);
            smooth(&mut marks);
            let middle = &marks[REACH..200 - REACH];
            let off =
                middle.iter().zip(&exact[REACH..]).map(|(m, at)| (m.at() - at).abs()).fold(0.0, f64::max);
            assert!(off < bound, "{rise}: {off}");
        }
    }

    #[test]
    fn mark_stays_between_its_two_samples() {
        let mut marks: Vec<Mark> = (1..30).map(|k| Mark { sample: 100 * k, age: 0.5 }).collect();
        marks[10].sample += 7;
        smooth(&mut marks);
        assert!(marks.iter().all(|mark| (0.0..=1.0).contains(&mark.age)));
        assert_eq!((marks[10].sample, marks[10].age), (1107, 1.0));
    }
}

//! Where a search begins: starts in several strengths, of which the promising ones are followed.

use super::descent::Stop;
use super::hypothesis::{Hypothesis, PlacedEffect};
use super::optimum::Fit;
use super::problem::{Problem, Visit};

/// Short runs, one after another, and how many starts are followed through all of them.
const SCOUTS: [Stop; 3] = [Stop::after(2, 1e-4), Stop::after(4, 1e-4), Stop::after(8, 1e-4)];
const FOLLOWED: usize = 2;
/// Ends of runs are in one place if no search coordinate, a logarithm or in units of its own size, differs by more, and the cost by no
/// more than what would have ended a run.
const SAME_PLACE: f64 = 0.05;
/// Strengths of an effect at the starts of its search, relative to the usual strength.
const STRENGTHS: [f64; 2] = [1.0, 0.1];

/// Runs of a first look.
pub const GLANCE: usize = 1;
pub const ALL: usize = SCOUTS.len();

/// Moves a problem to the best end of the first so many short runs from these starts. The less promising half of them is given up after
/// each run, as most cost far more than the best one after a few steps. Of ends in one place, one is followed. A single start is where
/// the search goes on; a first look at it is one short run.
pub fn scout(problem: &mut Problem, starts: &[Vec<f64>], runs: usize) {
    if let [start] = starts {
        problem.go_to(start);
        if runs == GLANCE {
            problem.descend(SCOUTS[0]);
        }
        return;
    }
    let (last, earlier) = (SCOUTS[runs - 1], &SCOUTS[..runs - 1]);
    let visit = |start: &Vec<f64>| {
        problem.go_to(start);
        problem.leave()
    };
    let mut left: Vec<Visit> = starts.iter().map(visit).collect();
    for run in earlier {
        // a run after which none is given up tells nothing that the next does not
        if left.len() > FOLLOWED {
            left = ends(problem, left, *run);
            left.truncate(left.len().div_ceil(2).max(FOLLOWED));
            left = apart(left, run.tolerance);
        }
    }
    if let Some(best) = ends(problem, left, last).into_iter().next() {
        problem.return_to(best);
    }
}

/// Where runs from these places end, lowest first; those from which the machine is singular are left out.
fn ends(problem: &mut Problem, from: Vec<Visit>, stop: Stop) -> Vec<Visit> {
    let run = |visit| {
        problem.return_to(visit);
        problem.descend(stop);
        problem.leave()
    };
    let mut ends: Vec<Visit> = from.into_iter().map(run).filter(|end| end.cost.is_finite()).collect();
    ends.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    ends
}

/// Those of these ends, lowest first, that are not in the place of a lower one.
fn apart(ends: Vec<Visit>, tolerance: f64) -> Vec<Visit> {
    let mut kept: Vec<Visit> = Vec::with_capacity(ends.len());
    for end in ends {
        let is_there = |other: &Visit| {
            end.cost - other.cost <= tolerance * other.cost
                && end.x.iter().zip(&other.x).all(|(a, b)| (a - b).abs() <= SAME_PLACE)
        };
        if !kept.iter().any(is_there) {
            kept.push(end);
        }
    }
    kept
}

/// Starting points for an effect on top of a fit, in two strengths: from where that fit ended and from the file's bearings.
pub fn starts_for(hypothesis: &Hypothesis, base: &Fit, added: PlacedEffect) -> Vec<Vec<f64>> {
    let scales = &hypothesis.scales;
    let parameters = added.effect.parameters(scales);
    let count = hypothesis.bearings.count();
    let drawn = hypothesis.bearings.stated();
    // without parameters all strengths are one
    let strengths = if parameters.is_empty() { &STRENGTHS[..1] } else { &STRENGTHS };
    let mut starts = Vec::new();
    for usual in added.effect.starts(scales) {
        for strength in strengths {
            let si = added.effect.strengthened(scales, &usual, *strength);
            let own: Vec<f64> = parameters.iter().zip(&si).map(|(p, v)| p.scale.from_si(*v)).collect();
            let from = |bearings: &[f64]| {
                let earlier = &base.x[count..];
                bearings.iter().chain(earlier).chain(&own).copied().collect::<Vec<f64>>()
            };
            starts.push(from(&base.x[..count]));
            starts.push(from(&drawn));
        }
    }
    starts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_ends_in_one_place_the_lowest_is_kept() {
        let end = |cost, x: [f64; 2]| Visit { x: x.to_vec(), cost, evaluation: None };
        let ends = vec![
            end(100.0, [0.0, 1.0]),
            end(100.001, [0.01, 1.0]),
            // as low, elsewhere
            end(100.002, [0.0, 2.0]),
            // near, not as low: a run from there is not at its end
            end(101.0, [0.0, 1.0]),
        ];
        let costs: Vec<f64> = apart(ends, 1e-4).iter().map(|end| end.cost).collect();
        assert_eq!(costs, [100.0, 100.002, 101.0]);
    }
}

//! Where a search begins: starts in several strengths, of which the promising ones are followed.

use super::descent::Stop;
use super::hypothesis::{Hypothesis, PlacedEffect};
use super::optimum::Fit;
use super::problem::Problem;

/// Short runs, one after another, and how many starts are followed through all of them.
const SCOUTS: [Stop; 3] = [Stop::after(2, 1e-4), Stop::after(3, 1e-4), Stop::after(5, 1e-4)];
const FOLLOWED: usize = 2;
/// Strengths of an effect at the starts of its search, relative to the usual strength.
const STRENGTHS: [f64; 2] = [1.0, 0.1];

/// Runs of a first look.
pub const GLANCE: usize = 2;
pub const ALL: usize = SCOUTS.len();

/// Moves a problem to the best end of the first so many short runs from these starts. The less promising half of them is given up after
/// each run, as most cost far more than the best one after a few steps.
pub fn scout(problem: &mut Problem, starts: &[Vec<f64>], runs: usize) {
    if let [start] = starts {
        return problem.go_to(start);
    }
    let (last, earlier) = (SCOUTS[runs - 1], &SCOUTS[..runs - 1]);
    let mut left = starts.to_vec();
    for run in earlier {
        // a run after which none is given up tells nothing that the next does not
        if left.len() > FOLLOWED {
            left = ends(problem, &left, *run);
            left.truncate(left.len().div_ceil(2).max(FOLLOWED));
        }
    }
    if let Some(best) = ends(problem, &left, last).first() {
        problem.go_to(best);
    }
}

/// Where runs from these starts end, lowest first; those from which the machine is singular are left out.
fn ends(problem: &mut Problem, starts: &[Vec<f64>], stop: Stop) -> Vec<Vec<f64>> {
    let mut ends: Vec<(f64, Vec<f64>)> = Vec::new();
    for start in starts {
        problem.go_to(start);
        problem.descend(stop);
        if problem.cost().is_finite() {
            ends.push((problem.cost(), problem.x().to_vec()));
        }
    }
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    ends.into_iter().map(|(_, x)| x).collect()
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

//! From fits to probabilities, groups of rivals, and a verdict.

use nalgebra::DMatrix;

use super::answer::{RIVAL, SURE};
use super::base::{BaseModel, CandidateFit};
use super::mistaken::MistakeComparison;
use super::rivals::{SettledCost, gains_no_more_than_noise};
use crate::decomposition::singular_values;
use crate::effects::Place;
use crate::units::same_speed;

/// A singular value of the noise-weighted sensitivity below this is a direction that the data do not
/// see: moving along it by a whole standard deviation of the prior changes them by less than their noise.
const VISIBLE: f64 = 1.0;

/// Prior share of missing effects that are not in the list, which covers most known ones.
pub const OUTSIDE: f64 = 0.1;
/// Prior share of misfits that are a mistake in the files and no effect at all.
const MISTAKEN: f64 = 0.1;
/// Evidence, either way, from which on the data show an effect without parameters: twice the logarithm of the odds of [`SURE`].
pub const SHOWN: f64 = 5.991_464_547_107_98;
/// Label of a cause outside the list in a group that the data cannot tell apart.
pub const NONE_OF_THESE: &str = "none of these";

pub struct Ranking {
    /// Of each candidate, in the order they were tried.
    pub probabilities: Vec<f64>,
    /// Probability of the first candidate, those effects included that it is a special case of and that fit no better than noise allows.
    pub best: f64,
    /// Probability that nothing is missing.
    pub nothing_missing: f64,
    /// That something outside the list is missing.
    pub unknown: f64,
    /// That the files hold each mistake, in their order.
    pub mistakes: Vec<f64>,
    /// Labels that the data cannot tell apart, the best one's group first.
    pub groups: Vec<Vec<String>>,
    /// How many of the first candidates rival the best.
    pub rivals: usize,
}

/// Prior: even odds that nothing is missing, one share of nine tenths of the other half for each candidate, so that
/// looking in many places is paid for, and a tenth for something that is not in the list. An effect without
/// parameters, switched off in `[physics]`, is there on every real shaft, and the question is only whether it
/// shows: it starts from even odds too, where the data could show it at all. What the data say is the evidence of each, [`crate::statistics::evidence`];
/// `unknown` is that of an unknown cause. `places` is how many candidates there are, those that were passed over included.
/// Mistakes in the files share [`MISTAKEN`] of the half where the model is not all there is.
pub fn rank(
    base: &BaseModel,
    tried: &[CandidateFit],
    places: usize,
    unknown: Option<f64>,
    mistaken: Option<&MistakeComparison>,
) -> Ranking {
    let allowed = |t: &&CandidateFit| t.disqualified.is_none();
    let places = places.max(1) as f64;
    let known = tried.iter().filter(allowed).map(|t| t.evidence);
    let mistakes = mistaken.map_or(&[][..], |all| &all.fits);
    let top = known.chain(unknown).chain(mistakes.iter().map(|m| m.evidence)).fold(0.0, f64::max);
    let nothing = (-0.5 * top).exp();
    let weight = |t: &CandidateFit| {
        let switch = t.placed.place == Place::Machine && t.fit.effect_unknowns == base.fit.effect_unknowns;
        if t.disqualified.is_some() || switch && !shows(t) {
            return 0.0;
        }
        let prior = if switch { 1.0 } else { (1.0 - OUTSIDE) / places };
        prior * (0.5 * (t.evidence - top)).exp()
    };
    let weights: Vec<f64> = tried.iter().map(weight).collect();
    let outside = unknown.map_or(0.0, |delta| OUTSIDE * (0.5 * (delta - top)).exp());
    let share = MISTAKEN / mistaken.map_or(1, |all| all.possible.max(1)) as f64;
    let mistakes: Vec<f64> = mistakes.iter().map(|m| share * (0.5 * (m.evidence - top)).exp()).collect();
    let total = nothing + outside + weights.iter().chain(&mistakes).sum::<f64>();
    let mistakes: Vec<f64> = mistakes.iter().map(|w| w / total).collect();
    let probabilities: Vec<f64> = weights.iter().map(|w| w / total).collect();
    let unknown = outside / total;
    let most = probabilities.iter().take(1).chain(&mistakes).fold(unknown, |most, p| most.max(*p));
    let rivals = probabilities.iter().take_while(|p| **p >= RIVAL * most && **p > 0.0).count();
    let nothing_missing = nothing / total;
    let (alike, others): (Vec<usize>, Vec<usize>) =
        (0..rivals).partition(|k| *k > 0 && is_seen_as(&tried[*k], &tried[0]));
    let best = probabilities.first().unwrap_or(&0.0) + alike.iter().map(|k| probabilities[*k]).sum::<f64>();
    let mut labels: Vec<String> = others.iter().map(|k| tried[*k].placed.label(base.fitter.rotor)).collect();
    if unknown >= RIVAL * most {
        labels.push(NONE_OF_THESE.to_string());
    }
    let rotor = base.fitter.rotor;
    let fits = mistaken.iter().flat_map(|all| &all.fits).zip(&mistakes);
    labels.extend(fits.filter(|(_, p)| **p >= RIVAL * most).map(|(m, _)| m.mistake.label(rotor)));
    labels.dedup();
    let claimed = nothing_missing < SURE && labels.len() > 1;
    let groups = if claimed { vec![labels] } else { Vec::new() };
    Ranking { probabilities, best, nothing_missing, unknown, mistakes, groups, rivals }
}

/// Whether the χ² of an effect is below that of its special case by no more than the noise of the readings makes it.
fn is_seen_as(t: &CandidateFit, case: &CandidateFit) -> bool {
    t.is_settled
        && case.is_settled
        && case.placed.is_case_of(&t.placed)
        && gains_no_more_than_noise(&SettledCost::of(&t.fit), &SettledCost::of(&case.fit))
}

/// Whether data like these would show an effect without parameters. There is no size to it: what speaks for it when it is there is
/// about what speaks against it when it is not, so that little either way says that the data do not see it.
fn shows(t: &CandidateFit) -> bool {
    t.evidence.abs() > SHOWN
}

/// A sentence if the data cannot hold more than bearings and planes: at so few operating points, the
/// unknowns of the model fill every direction that the readings have.
pub fn saturation(base: &BaseModel) -> Option<String> {
    let data = &base.fitter.data;
    // one averaged reading an operating point: repeating it lowers the noise but adds no direction
    let mut points: Vec<(f64, Vec<u64>, Vec<usize>)> = Vec::new();
    for (r, row) in data.rows.iter().enumerate() {
        let weights: Vec<u64> =
            row.added.iter().flat_map(|(z, u)| [*z, u.re, u.im]).map(f64::to_bits).collect();
        let known =
            points.iter_mut().find(|(speed, w, _)| same_speed(*speed, row.speed_rad_s) && *w == weights);
        match known {
            Some((_, _, rows)) => rows.push(r),
            None => points.push((row.speed_rad_s, weights, vec![r])),
        }
    }
    let sensitivity = base.fitter.sensitivity(&base.hypothesis, &base.fit, &base.drawing).ok()?;
    let probes = base.fitter.rotor.probe.len();
    let directions = 2 * probes * points.len();
    if directions > 4 * sensitivity.ncols() {
        return None;
    }
    let mut seen = vec![0_usize; probes * points.len()];
    let mut averaged = DMatrix::zeros(directions, sensitivity.ncols());
    let point_of = |row: usize| points.iter().position(|(_, _, rows)| rows.contains(&row)).unwrap_or(0);
    let rows = data.rows.iter().enumerate().map(|(r, row)| (point_of(r), row));
    let places = rows.flat_map(|(point, row)| row.values.iter().map(move |v| point * probes + v.probe));
    for (value, at) in places.enumerate() {
        seen[at] += 1;
        for part in 0..2 {
            let mut sum = averaged.row_mut(2 * at + part);
            sum += sensitivity.row(2 * value + part);
        }
    }
    for (i, mut row) in averaged.row_iter_mut().enumerate() {
        row.unscale_mut((seen[i / 2].max(1) as f64).sqrt());
    }
    let rank = singular_values(averaged).iter().filter(|s| **s > VISIBLE).count();
    let unknown = sensitivity.ncols();
    (rank + 2 >= directions || points.len() < 3).then(|| {
        format!(
            "{} reading{} at {} operating point{} hold {directions} independent numbers, and bearings and planes \
             ({unknown} unknowns, {rank} of them visible) use them up: any effect could be a change of bearing",
            data.readings(),
            if data.readings() == 1 { "" } else { "s" },
            points.len(),
            if points.len() == 1 { "" } else { "s" },
        )
    })
}

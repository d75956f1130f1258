//! From fits to probabilities, groups of rivals, and a verdict.

use nalgebra::DMatrix;

use super::answer::{ENOUGH, HeldOut, RIVAL, SURE, Verdict};
use super::base::{Base, Tried};
use crate::effects::Place;

/// Speeds closer than this, relative, are one operating point.
const SAME_SPEED: f64 = 0.01;
/// A singular value of the noise-weighted sensitivity below this is a direction that the data do not
/// see: moving along it by a whole standard deviation of the prior changes them by less than their noise.
const VISIBLE: f64 = 1.0;

/// Probabilities and groups.
pub struct Ranking {
    /// Of each candidate, in the order they were tried.
    pub probabilities: Vec<f64>,
    /// That nothing is missing.
    pub nothing_missing: f64,
    /// Labels that the data cannot tell apart, the best one's group first.
    pub groups: Vec<Vec<String>>,
    /// How many of the first candidates rival the best.
    pub rivals: usize,
}

/// Prior: even odds that nothing is missing, one share of the other half for each candidate, so that looking
/// in many places is paid for. An effect without parameters, switched off in `[physics]`, is there on every
/// real shaft, and the question is only whether it shows: it starts from even odds too. Likelihood by BIC,
/// `exp(−BIC/2)`.
pub fn rank(base: &Base, tried: &[Tried]) -> Ranking {
    let allowed = |t: &&Tried| t.disqualified.is_none();
    let places = tried.iter().filter(allowed).count().max(1) as f64;
    let top = tried.iter().filter(allowed).map(|t| t.delta_bic).fold(0.0, f64::max);
    let nothing = (-0.5 * top).exp();
    let weight = |t: &Tried| {
        let switch = t.assumed.place == Place::Machine && t.fit.effect_unknowns == base.fit.effect_unknowns;
        let prior = if switch { 1.0 } else { 1.0 / places };
        if t.disqualified.is_some() { 0.0 } else { prior * (0.5 * (t.delta_bic - top)).exp() }
    };
    let weights: Vec<f64> = tried.iter().map(weight).collect();
    let total = nothing + weights.iter().sum::<f64>();
    let probabilities: Vec<f64> = weights.iter().map(|w| w / total).collect();
    let best = probabilities.first().copied().unwrap_or(0.0);
    let rivals = probabilities.iter().take_while(|p| **p >= RIVAL * best && **p > 0.0).count();
    let label = |t: &Tried| t.assumed.label(base.fitter.rotor);
    let nothing_missing = nothing / total;
    let claimed = nothing_missing < SURE;
    let groups =
        if claimed && rivals > 1 { vec![tried[..rivals].iter().map(label).collect()] } else { Vec::new() };
    Ranking { probabilities, nothing_missing, groups, rivals }
}

/// A sentence if the data cannot hold more than bearings and planes: at so few operating points, the
/// unknowns of the model fill every direction that the readings have.
pub fn saturation(base: &Base) -> Option<String> {
    let data = &base.fitter.data;
    // one averaged reading an operating point: repeating it lowers the noise but adds no direction
    let mut points: Vec<(f64, Vec<u64>, Vec<usize>)> = Vec::new();
    for (r, row) in data.rows.iter().enumerate() {
        let weights: Vec<u64> =
            row.added.iter().flat_map(|(z, u)| [*z, u.re, u.im]).map(f64::to_bits).collect();
        let known = points
            .iter_mut()
            .find(|(speed, w, _)| (row.speed_rad_s / speed - 1.0).abs() < SAME_SPEED && *w == weights);
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
    let first_of_row: Vec<usize> = data
        .rows
        .iter()
        .scan(0, |at, row| {
            let start = *at;
            *at += 2 * row.values.len();
            Some(start)
        })
        .collect();
    let averaged = DMatrix::from_fn(directions, sensitivity.ncols(), |i, j| {
        let (point, within) = (i / (2 * probes), i % (2 * probes));
        let rows = &points[point].2;
        let full = rows.iter().filter(|r| data.rows[**r].values.len() == probes);
        let sum: f64 = full.map(|r| sensitivity[(first_of_row[*r] + within, j)]).sum();
        sum / (rows.len() as f64).sqrt()
    });
    let rank = averaged.svd(false, false).singular_values.iter().filter(|s| **s > VISIBLE).count();
    let unknown = sensitivity.ncols();
    (rank + 2 >= directions || points.len() < 3).then(|| {
        format!(
            "{} reading{} at {} operating point{} hold {directions} independent numbers, and bearings and planes \
             ({unknown} unknowns, {rank} of them visible) use them up: any effect could be a change of bearing",
            data.rows.len(),
            if data.rows.len() == 1 { "" } else { "s" },
            points.len(),
            if points.len() == 1 { "" } else { "s" },
        )
    })
}

/// The verdict, and why in one sentence.
pub fn verdict(
    base: &Base,
    tried: &[Tried],
    ranking: &Ranking,
    held_out: Option<HeldOut>,
) -> (Verdict, String) {
    let misfit = base.fit.chi2_per_value();
    // χ² per value of pure noise spreads by √(2/n)
    let bearings = base.hypothesis.bearings.count();
    let spread = (2.0 / (base.fit.values - bearings.min(base.fit.values - 1)) as f64).sqrt();
    let (Some(best), true) =
        (tried.first().filter(|t| t.disqualified.is_none()), ranking.nothing_missing < SURE)
    else {
        return if misfit > 1.0 + ENOUGH * spread {
            let why = format!(
                "The model misses (χ² per value {misfit:.2}), but no effect of the list explains it; \
                 the noise may be larger than stated."
            );
            (Verdict::Undecided, why)
        } else {
            let sure = 100.0 * ranking.nothing_missing;
            (
                Verdict::Adequate,
                format!(
                    "The misfit is noise (χ² per value {misfit:.2}); nothing is missing, {sure:.0} % sure."
                ),
            )
        };
    };
    let label = best.assumed.label(base.fitter.rotor);
    let after = best.fit.chi2_per_value();
    if after > 1.0 + ENOUGH * spread {
        let why = format!(
            "No single effect is enough: {label} explains most (χ² per value {misfit:.2} → {after:.2}); \
             `improve` looks for several together."
        );
        return (Verdict::Undecided, why);
    }
    if let Some(h) = held_out
        && h.after >= h.before
    {
        let why = format!(
            "{label} fits best but does not predict speeds that were left out (χ² {:.2} before, {:.2} after).",
            h.before, h.after
        );
        return (Verdict::Undecided, why);
    }
    if ranking.rivals > 1 {
        let others = ranking.groups.first().map_or(0, Vec::len);
        let why = format!(
            "Something is missing; {label} fits best, but the data cannot tell it from {} other candidate{}.",
            others - 1,
            if others == 2 { "" } else { "s" }
        );
        return (Verdict::Undecided, why);
    }
    let sure = 100.0 * ranking.probabilities[0];
    (Verdict::Missing, format!("{label} is missing, {sure:.1} % sure."))
}

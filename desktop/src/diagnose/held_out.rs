//! Does the best candidate predict speeds that it was not fitted to?

use super::answer::HeldOut;
use super::base::{Base, Tried};
use crate::error::Error;
use crate::fit::data::Data;
use crate::fit::hypothesis::Hypothesis;
use crate::fit::{Effort, Fit, Fitter};
use crate::machine::drawing::Noise;
use crate::measurement::Reading;

/// Blocks of neighbouring speeds that are left out in turn.
const BLOCKS: usize = 4;

/// χ² on left-out readings per real number, without and with the candidate; the drawing as it was found
/// in the fit to all.
pub fn check(base: &Base, best: &Tried, readings: &[Reading], noise: &Noise) -> Result<HeldOut, Error> {
    let with = base.hypothesis.with(best.assumed);
    let (mut before, mut after, mut values) = (0.0, 0.0, 0);
    for block in 0..BLOCKS {
        let part = |inside: bool| -> Vec<usize> {
            let blocked = |i: &usize| (i * 2 * BLOCKS / readings.len() % BLOCKS == block) == inside;
            (0..readings.len()).filter(blocked).collect()
        };
        let fitter = |rows: &[usize]| {
            let chosen: Vec<Reading> = rows.iter().map(|i| readings[*i].clone()).collect();
            let data = Data::new(base.fitter.rotor, noise, &chosen).chosen_from(&base.fitter.data, rows);
            Fitter::new(base.fitter.rotor, data)
        };
        let (kept, left) = (part(false), part(true));
        let sides = [(fitter(&kept), kept), (fitter(&left), left)];
        before += misfit(&sides, &base.hypothesis, &base.fit, base)?;
        after += misfit(&sides, &with, &best.fit, base)?;
        values += 2 * sides[1].0.data.count();
    }
    let per_value = |chi2: f64| chi2 / values.max(1) as f64;
    Ok(HeldOut { before: per_value(before), after: per_value(after) })
}

/// χ² on the second side of a hypothesis fitted to the first.
fn misfit(
    [(kept, kept_rows), (left, left_rows)]: &[(Fitter, Vec<usize>); 2],
    hypothesis: &Hypothesis,
    fit: &Fit,
    base: &Base,
) -> Result<f64, Error> {
    let of = |rows: &[usize]| rows.iter().map(|r| fit.amplitudes[*r].clone()).collect::<Vec<_>>();
    let amplitudes = of(kept_rows);
    let start = [fit.x.clone()];
    let mut refit = kept.fit(hypothesis, &start, &base.drawing.fixed(), Effort::Search, Some(&amplitudes))?;
    // the supports' state at the left-out speeds, where they harden or soften
    refit.amplitudes = of(left_rows);
    left.chi2_of(hypothesis, &refit, &base.drawing.fixed())
}

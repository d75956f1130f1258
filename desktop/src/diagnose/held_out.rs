//! Does the best candidate predict speeds that it was not fitted to?

use super::answer::HeldOut;
use super::base::{BaseModel, CandidateFit};
use crate::error::Error;
use crate::fit::hypothesis::Hypothesis;
use crate::fit::{Drawing, Effort, Fit, Fitter};

/// Standard deviations by which left-out readings must be predicted worse before an effect is doubted: 2 % of all right
/// effects look that bad.
const WORSE: f64 = 2.0;
/// Blocks of neighbouring speeds that are left out in turn.
const BLOCKS: usize = 4;

/// χ² on left-out readings per real number, without and with the candidate, each on the drawing that was found with
/// it in the fit to all.
pub fn check(base: &BaseModel, best: &CandidateFit) -> Result<HeldOut, Error> {
    let with = base.hypothesis.with(best.placed);
    let rows = base.fitter.data.rows.len();
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for block in 0..BLOCKS {
        let part = |inside: bool| -> Vec<usize> {
            let blocked = |i: &usize| (i * 2 * BLOCKS / rows % BLOCKS == block) == inside;
            (0..rows).filter(blocked).collect()
        };
        let (kept, left) = (part(false), part(true));
        // of few states some blocks have none, or all
        if kept.is_empty() || left.is_empty() {
            continue;
        }
        let sides = [(base.fitter.part(&kept), kept), (base.fitter.part(&left), left)];
        before.extend(misfits(base.fitter, &sides, &base.hypothesis, &base.fit, &base.drawing)?);
        after.extend(misfits(base.fitter, &sides, &with, &best.fit, best.drawing(base))?);
    }
    let per_value = |all: &[f64]| all.iter().sum::<f64>() / all.len().max(1) as f64;
    // a difference for each real number, and how far their sum would scatter if it were nothing
    let differences = || after.iter().zip(&before).map(|(after, before)| after - before);
    let scatter = differences().map(|d| d * d).sum::<f64>().sqrt();
    let worse = differences().sum::<f64>() > WORSE * scatter;
    Ok(HeldOut { before: per_value(&before), after: per_value(&after), worse })
}

/// Squared misfits on the second side of a hypothesis fitted to the first.
fn misfits(
    fitter: &Fitter,
    [(kept, kept_rows), (left, left_rows)]: &[(Fitter, Vec<usize>); 2],
    hypothesis: &Hypothesis,
    fit: &Fit,
    drawing: &Drawing,
) -> Result<Vec<f64>, Error> {
    let of = |rows: &[usize]| fitter.part_of_amplitudes(&fit.amplitudes, rows);
    let amplitudes = of(kept_rows);
    let start = [fit.x.clone()];
    let mut refit = kept.fit(hypothesis, &start, &kept.known(drawing), Effort::Search, Some(&amplitudes))?;
    // the supports' state at the left-out speeds, where they harden or soften
    refit.amplitudes = of(left_rows);
    left.misfits_of(hypothesis, &refit, &left.known(drawing))
}

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
///
/// A prediction may be off by as much as the readings that were kept leave its parameters open: where the speeds at which an effect acts
/// are left out, nothing else determines it. So its χ² is by how much that of a fit to all is above that of a fit to the kept ones. For
/// linear parameters this is the χ² of the prediction in the noise of the readings and of the prediction together.
pub fn check(base: &BaseModel, best: &CandidateFit) -> Result<HeldOut, Error> {
    let with = base.hypothesis.with(best.placed);
    let rows = base.fitter.data.rows.len();
    let of_all = |hypothesis: &Hypothesis, fit: &Fit, drawing: &Drawing| {
        let known = base.fitter.known(drawing);
        let start = std::slice::from_ref(&fit.x);
        base.fitter.fit(hypothesis, start, &known, Effort::Search, Some(&fit.amplitudes))
    };
    let without = of_all(&base.hypothesis, &base.fit, &base.drawing)?;
    let within = of_all(&with, &best.fit, best.drawing(base))?;
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
        before.extend(misfits(base.fitter, &sides, &base.hypothesis, &without, &base.drawing)?);
        after.extend(misfits(base.fitter, &sides, &with, &within, best.drawing(base))?);
    }
    let per_value = |all: &[f64]| all.iter().sum::<f64>() / all.len().max(1) as f64;
    // a difference for each real number, and how far their sum would scatter if it were nothing
    let differences = || after.iter().zip(&before).map(|(after, before)| after - before);
    let scatter = differences().map(|d| d * d).sum::<f64>().sqrt();
    let worse = differences().sum::<f64>() > WORSE * scatter;
    Ok(HeldOut { before: per_value(&before), after: per_value(&after), worse })
}

/// Squared misfits on the second side of a hypothesis fitted to the first, by its fit to both.
fn misfits(
    fitter: &Fitter,
    [(kept, kept_rows), (left, left_rows)]: &[(Fitter, Vec<usize>); 2],
    hypothesis: &Hypothesis,
    all: &Fit,
    drawing: &Drawing,
) -> Result<Vec<f64>, Error> {
    let of = |rows: &[usize]| fitter.part_of_amplitudes(&all.amplitudes, rows);
    let (start, known) = (std::slice::from_ref(&all.x), kept.known(drawing));
    let refit = kept.fit(hypothesis, start, &known, Effort::Search, Some(&of(kept_rows)))?;
    // with the supports' state at the left-out speeds, where they harden or soften
    let mut there = all.clone();
    there.amplitudes = of(left_rows);
    let mut misfits = left.misfits_of(hypothesis, &there, &left.known(drawing))?;
    // what a fit to both pays beside that for following the left-out ones as well
    let beside = (all.cost - misfits.iter().sum::<f64>() - refit.cost).max(0.0);
    let each = beside / misfits.len().max(1) as f64;
    misfits.iter_mut().for_each(|misfit| *misfit += each);
    Ok(misfits)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::fit::data::Data;
    use crate::machine::drawing::Noise;
    use crate::simulate::{SimulationRequest, simulate};
    use crate::testing::sample_rotor;

    /// With J the change of the left-out readings per parameter and C the covariance of a fit to the kept ones, the misfit r has
    /// χ² rᵀ (1 + J C Jᵀ)⁻¹ r in the noise of both; such little noise leaves the bearings nearly linear.
    #[test]
    fn predicted_misfit_counts_what_kept_readings_leave_open() {
        let noise =
            Noise { relative: 0.002, floor_um: 0.01, scale: None, correlation: None, between_runs: None };
        let rotor = sample_rotor();
        let speeds_rpm = (0..40).map(|k| 600.0 + 200.0 * f64::from(k)).collect();
        let request = SimulationRequest { speeds_rpm, noise: Some(noise), seed: 3, ..Default::default() };
        let readings = simulate(&rotor, &request).unwrap().readings;
        let fitter = Fitter::new(&rotor, Data::new(&rotor, &noise, &readings));
        let model = Hypothesis::drawn(&rotor, fitter.scales(None));
        let exact = fitter.exact_drawing();
        let start = [model.bearings.stated()];
        let all = fitter.fit(&model, &start, &exact, Effort::Search, None).unwrap();
        // the faster half is told by the slower one alone
        let rows: Vec<usize> = (0..fitter.data.rows.len()).collect();
        let (slower, faster) = rows.split_at(rows.len() / 2);
        let sides = [slower, faster].map(|rows| (fitter.part(rows), rows.to_vec()));
        let found: f64 = misfits(&fitter, &sides, &model, &all, &exact).unwrap().iter().sum();
        let [(kept, _), (left, _)] = &sides;
        let drawing = kept.known(&exact);
        let refit = kept.fit(&model, &start, &drawing, Effort::Final, None).unwrap();
        let (drawing, still) = (left.known(&exact), left.still());
        let predicted =
            left.forward(&model, &drawing, &still).unwrap().at(&refit.x, &refit.unknowns).unwrap();
        let measured =
            left.data.values().flat_map(|v| [v.measured_m.re, v.measured_m.im].map(|y| y / v.sigma_m));
        let off = DVector::from_iterator(predicted.len(), measured) - predicted;
        let slopes = left.tangent(&model, &refit.x, &drawing, &still).unwrap();
        let both = DMatrix::identity(off.len(), off.len())
            + &slopes * refit.covariance.unwrap() * slopes.transpose();
        let expected = off.dot(&both.cholesky().unwrap().solve(&off));
        assert!(off.norm_squared() > 1.2 * expected, "the kept readings leave nothing open");
        assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
    }
}

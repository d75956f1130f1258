//! A model at its best: bearings, planes and its effects' parameters fitted to measurements.

use nalgebra::{Complex, DMatrix};

use super::base::{BaseModel, explains};
use super::checks;
use super::holding::HeldParameter;
use super::planes::PlaneUnbalances;
use super::sweep::beats::Beats;
use super::sweep::{self, Sweep};
use crate::error::Error;
use crate::fit::Fitter;
use crate::fit::data::Data;
use crate::machine::drawing::{Noise, Rotor, Tolerance};
use crate::measurement::{Reading, by_reading};
use crate::statistics::scatter::Scatter;

/// A fitted model and its prediction of every reading.
#[derive(Debug, Clone)]
pub struct BestFit {
    /// The file with fitted bearings, planes and effects.
    pub rotor: Rotor,
    /// Phasor of every probe of every reading, m; zero where the reading was lost.
    pub predicted_m: Vec<Vec<Complex<f64>>>,
    /// Unbalance of each plane, kg·m.
    pub unbalance_kg_m: Vec<Complex<f64>>,
    /// Covariance of its real and imaginary parts, plane by plane; no measure of their error where noise does not explain the misfit.
    pub unbalance_covariance: DMatrix<f64>,
    /// Unbalance of each plane in g·mm and degrees, with 95 % intervals.
    pub determined: PlaneUnbalances,
    /// Residual noise of the model relative to the stated noise.
    pub scatter: Scatter,
    /// χ² per measured real number.
    pub chi2_per_value: f64,
    /// Real numbers that were fitted.
    pub free_parameters: usize,
    /// The noise that was gone by.
    pub noise: Noise,
    /// What is odd in the data, one sentence each.
    pub remarks: Vec<String>,
}

/// Fits the model of a file to measurements.
///
/// # Errors
/// If a probe is dead or clipped, phases are reversed, or the data are another machine's.
pub fn best_fit(rotor: &Rotor, readings: &[Reading]) -> Result<BestFit, Error> {
    Ok(fit_and(rotor, readings, &[], |_| Ok(()))?.0)
}

/// The same with some parameters held where the file has them. Intervals are those of a fit in which nothing is held: no narrower than
/// they should be.
///
/// # Errors
/// As [`best_fit`], and if a held parameter is none of the file's.
pub fn fit_holding(rotor: &Rotor, readings: &[Reading], held: &[HeldParameter]) -> Result<BestFit, Error> {
    Ok(fit_and(rotor, readings, held, |_| Ok(()))?.0)
}

/// The same, and the probability that nothing is missing in the model: what [`super::diagnose`] goes by, without the words. Where bearings
/// and planes alone use up what the data hold it is the prior, even odds; where something is missing beyond doubt, it can be too large,
/// but is negligible.
///
/// # Errors
/// As [`best_fit`].
pub fn judged_fit(rotor: &Rotor, readings: &[Reading]) -> Result<(BestFit, f64), Error> {
    fit_and(rotor, readings, &[], |base| base.nothing_missing())
}

/// The fit, and something else that is asked of the fitted model.
fn fit_and<T>(
    rotor: &Rotor,
    readings: &[Reading],
    held: &[HeldParameter],
    asked: impl FnOnce(&BaseModel) -> Result<T, Error>,
) -> Result<(BestFit, T), Error> {
    let (file, rotor) = (rotor, &rotor.as_stated());
    let noise = Noise::of(rotor, readings);
    checks::not_too_many(readings)?;
    let mut remarks = checks::before(rotor, readings)?;
    let steady = Fitter::new(rotor, Data::new(rotor, &noise, readings)).beginning_at(file);
    checks::enough(&steady)?;
    remarks.extend(noise.assumption(rotor));
    remarks.extend(Tolerance::assumption(rotor));
    sweep::fitted(&steady, readings, &noise, |base| {
        let base = base.holding(file, held)?;
        let fitter = base.fitter;
        checks::not_reversed(&base, rotor, readings, &noise)?;
        checks::this_machine(rotor, base.relative_error(base.closest()))?;
        let (fit, drawing) = base.shown();
        remarks.extend(checks::beyond_grade(rotor, &fit.unknowns));
        let predicted_m = by_reading(readings, &fit.predicted_m);
        let fitted = base.written();
        let sweep = Sweep::of(&fitted, readings, &noise);
        remarks.extend(sweep::remark(&fitter.data, readings, sweep.as_ref()));
        if sweep.is_none() && !explains(&base.drawing.scatter(), &base) {
            remarks.extend(Beats::of(readings, &noise).map(|beats| beats.words()));
        }
        let planes = rotor.plane.len();
        let covariance = fitter.covariance(&base.hypothesis, fit, drawing)?;
        let first = fit.x.len();
        let unbalance_covariance = covariance.map_or_else(
            || DMatrix::from_element(2 * planes, 2 * planes, f64::NAN),
            |c| c.view((first, first), (2 * planes, 2 * planes)).into_owned(),
        );
        let names = rotor.plane.iter().map(|p| p.name.as_str());
        let unbalance_kg_m = fit.unknowns[..planes].to_vec();
        let answer = asked(&base)?;
        let best = BestFit {
            determined: PlaneUnbalances::new(names, &unbalance_kg_m, &unbalance_covariance),
            scatter: base.drawing.scatter(),
            rotor: fitted,
            predicted_m,
            unbalance_kg_m,
            unbalance_covariance,
            chi2_per_value: base.closest().chi2_per_value(),
            free_parameters: base.hypothesis.size() + 2 * fit.unknowns.len(),
            noise,
            remarks,
        };
        Ok((best, answer))
    })
}

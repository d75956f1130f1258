//! The diagnosis of a model: every effect tried, ranked, and put into words.

use std::borrow::Cow;

use nalgebra::DMatrix;

use super::answer::{Advice, Candidate, Diagnosis, DiagnosisVerdict, SURE, TooFast};
use super::base::{BaseModel, CandidateFit, explains};
use super::mistaken::{MistakeComparison, mistaken_unit};
use super::planes::PlaneUnbalances;
use super::rank::Ranking;
use super::runs::{RefutedRun, RunChange};
use super::sets::{SearchReach, SetComparison};
use super::sweep::beats::Beats;
use super::sweep::{self, Sweep, fitted};
use super::unknown::UnknownCauseFit;
use super::verdict::{Conclusion, DiagnosisEvidence, REACH_OF_DIAGNOSIS};
use super::{advice, checks, evidence, held_out, parameters, rank, runs};
use crate::error::Error;
use crate::fit::bearings::BearingParameter;
use crate::fit::data::Data;
use crate::fit::dimensions::FittedDimension;
use crate::fit::progress::ProgressListener;
use crate::fit::{Fit, Fitter};
use crate::machine::drawing::{Noise, Rotor, Tolerance};
use crate::measurement::Reading;
use crate::statistics::significance::NEGLIGIBLE;

/// Why nothing is claimed of a run that changed speed too fast: fitted as steady, or as a transient that no known effect explains. What
/// is left of a transient can be a speed that did not change evenly between readings.
const UNSTEADY: &str = "A run changed speed too fast for a steady response, which explains the misfit.";
const TRANSIENT_MISFIT: &str = "A run changed speed too fast for a steady response. No known effect explains what its fit as a \
                                transient leaves, which may be uneven speed between the readings or inexact times.";
/// That nothing is missing, before there are data.
pub const PRIOR: f64 = 0.5;

/// Diagnoses a model against measurements.
///
/// # Errors
/// If the data cannot be this machine's, a probe is dead, or there is too little to fit.
pub fn diagnose(rotor: &Rotor, readings: &[Reading]) -> Result<Diagnosis, Error> {
    diagnose_telling(rotor, readings, &|_, _| ())
}

/// The same for somebody who waits: `told` hears how many fits are done, of how many that are planned so far.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_telling(
    rotor: &Rotor,
    readings: &[Reading],
    told: ProgressListener,
) -> Result<Diagnosis, Error> {
    let (file, rotor) = (rotor, &rotor.as_stated());
    let noise = Noise::of(rotor, readings);
    let remarks = remarks_before(rotor, readings, noise)?;
    let steady = Fitter::new(rotor, Data::new(rotor, &noise, readings)).beginning_at(file).telling(told);
    fitted(&steady, readings, &noise, |base| {
        Ok(examine(base, readings, noise, remarks, REACH_OF_DIAGNOSIS)?.diagnosis)
    })
}

/// What is odd in the files before any fit.
///
/// # Errors
/// If the data cannot be this machine's, or are too many.
pub fn remarks_before(rotor: &Rotor, readings: &[Reading], noise: Noise) -> Result<Vec<String>, Error> {
    checks::not_too_many(readings)?;
    let mut remarks = checks::before(rotor, readings)?;
    remarks.extend(noise.assumption(rotor));
    remarks.extend(Tolerance::assumption(rotor));
    Ok(remarks)
}

/// A diagnosis with the fits behind it.
pub struct DiagnosisRun<'a> {
    pub diagnosis: Diagnosis,
    pub base: BaseModel<'a>,
    /// `None` where the data determine no more than bearings and planes.
    pub weighed: Option<ModelComparison>,
    /// The sets of several effects, where the verdict needed a search for them.
    pub sets: Option<SetComparison<'a>>,
}

/// A diagnosis by the fit of a machine's file, as it was stated before any fit, to these readings; `reach` says how far to look for several
/// effects where no single one is enough.
///
/// # Errors
/// As [`diagnose`].
pub fn examine<'a>(
    base: BaseModel<'a>,
    readings: &[Reading],
    noise: Noise,
    remarks: Vec<String>,
    reach: SearchReach,
) -> Result<DiagnosisRun<'a>, Error> {
    let rotor = base.fitter.rotor;
    checks::not_reversed(&base, rotor, readings, &noise)?;
    let values = FittedValues::of(&base)?;
    if let Some(why) = rank::saturation(&base) {
        let diagnosis = base.undecidable(why, noise, remarks, values);
        return Ok(DiagnosisRun { diagnosis, base, weighed: None, sets: None });
    }
    let weighed = base.weighed(readings, &noise)?;
    let (diagnosis, sets) = base.decided(&weighed, (readings, noise), remarks, values, reach)?;
    Ok(DiagnosisRun { diagnosis, base, weighed: Some(weighed), sets })
}

/// Planes, bearings and drawing of the model as fitted.
pub struct FittedValues {
    pub determined: PlaneUnbalances,
    pub bearings: Vec<BearingParameter>,
    pub dimensions: Vec<FittedDimension>,
}

impl FittedValues {
    fn of(base: &BaseModel) -> Result<Self, Error> {
        let (fit, drawing) = base.shown();
        let covariance = base.fitter.covariance(&base.hypothesis, fit, drawing)?;
        let determined = PlaneUnbalances::by(base, fit, covariance.as_ref());
        let bearings = base.bearings(fit, covariance.as_ref());
        let dimensions = match &covariance {
            Some(known) => base.fitter.dimensions(&base.hypothesis, fit, drawing, known)?,
            None => Vec::new(),
        };
        Ok(Self { determined, bearings, dimensions })
    }
}

/// The verdict on a run that changed speed too fast, for this reason, with its summary.
fn nothing_claimed(why: &str) -> (DiagnosisVerdict, String) {
    (DiagnosisVerdict::Undecided, format!("{why} No effect is claimed."))
}

/// The verdict on a run whose fit as a transient leaves what no known effect explains, with its summary.
pub fn unexplained_transient() -> (DiagnosisVerdict, String) {
    nothing_claimed(TRANSIENT_MISFIT)
}

/// A conclusion taken back for this reason.
fn withdrawn<'a>(said: Conclusion<'a>, why: &str) -> Conclusion<'a> {
    let (verdict, summary) = nothing_claimed(why);
    let together = Vec::new();
    Conclusion { verdict, summary, candidate_fits: false, bad_probe: None, mistake: None, together, ..said }
}

/// Whether a run that swept too fast leaves nothing to be missed: so fast that no steady response can be had from it, or
/// noise alone is left when its lag is taken off.
fn lag_explains(sweep: &Sweep, rotor: &Rotor, readings: &[Reading]) -> Result<bool, Error> {
    Ok(!sweep.small || nothing_missing(rotor, &sweep.taken_off(readings))? >= SURE)
}

/// Every explanation of the misfit of a model, with its probability.
pub struct ModelComparison {
    pub tried: Vec<CandidateFit>,
    pub unknown: UnknownCauseFit,
    pub mistaken: MistakeComparison,
    pub ranking: Ranking,
}

impl<'a> BaseModel<'a> {
    /// The answer where the data hold more than bearings and planes, with the sets of effects that were looked for; `remarks` are those
    /// made so far.
    fn decided(
        &self,
        weighed: &ModelComparison,
        (readings, noise): (&[Reading], Noise),
        mut remarks: Vec<String>,
        FittedValues { determined, bearings, dimensions }: FittedValues,
        reach: SearchReach,
    ) -> Result<(Diagnosis, Option<SetComparison<'a>>), Error> {
        let rotor = self.fitter.rotor;
        let ModelComparison { tried, unknown, mistaken, ranking } = weighed;
        let doubted = tried.first().filter(|_| ranking.nothing_missing < SURE);
        let held_out = doubted.map(|best| held_out::check(self, best)).transpose()?;
        let unit = mistaken_unit(rotor, readings, &self.fit.unknowns[..rotor.plane.len()]);
        let evidence = DiagnosisEvidence {
            base: self,
            tried,
            ranking,
            unknown,
            mistaken,
            unit: unit.as_ref(),
            held_out,
            determined: &determined,
            reach,
        };
        let least = tried.iter().map(|t| self.relative_error(&t.fit)).fold(f64::INFINITY, f64::min);
        if evidence.mistake().is_none() {
            checks::this_machine(rotor, least.min(self.relative_error(self.closest())))?;
        }
        let sweep = Sweep::of(&self.written(), readings, &noise);
        let (said, too_fast) = self.concluded(&evidence, sweep.as_ref(), readings, &noise)?;
        let (verdict, mut summary) = (said.verdict, said.summary);
        let alike = determined.alike().filter(|_| verdict != DiagnosisVerdict::NotDetermined);
        summary += &alike.map_or_else(String::new, |alike| format!(" {alike}"));
        remarks.extend(sweep::remark(&self.fitter.data, readings, sweep.as_ref()));
        remarks.extend(checks::far_below_noise(self));
        let is_of_machine = too_fast.is_none() && said.mistake.is_none();
        let asks = verdict == DiagnosisVerdict::Undecided && is_of_machine && said.together.is_empty();
        let advice = if asks { self.asked(weighed, &noise, &mut remarks) } else { Vec::new() };
        let stands_on = tried.first().filter(|_| verdict == DiagnosisVerdict::Missing).map(|t| &t.fit);
        remarks.extend(checks::beyond_grade(rotor, &stands_on.unwrap_or(&self.fit).unknowns));
        let (refuted, of_runs) = match tried.first() {
            Some(best) if is_of_machine => {
                self.of_runs(best, verdict, ranking.probabilities[0], said.candidate_fits)
            }
            _ => (Vec::new(), Vec::new()),
        };
        remarks.extend(of_runs);
        let cause = (too_fast.is_none() && (verdict == DiagnosisVerdict::Unknown || said.outside >= SURE))
            .then(|| unknown.cause(self.fitter, said.outside));
        // rivals explain the data about as well as the best
        let fitting = if said.candidate_fits { ranking.rivals.max(1) } else { 0 };
        let probable = tried.iter().zip(&ranking.probabilities).enumerate();
        let diagnosis = Diagnosis {
            verdict,
            summary,
            error_before: self.relative_error(self.shown().0),
            chi2_per_value: self.closest().chi2_per_value(),
            nothing_missing: ranking.nothing_missing,
            candidates: probable.map(|(i, (t, p))| self.candidate(t, *p, i < fitting)).collect(),
            indistinguishable: ranking.groups.clone(),
            saturated: false,
            too_fast,
            bad_probe: said.bad_probe,
            mistake: said.mistake,
            together: said.together,
            held_out,
            advice,
            remarks,
            noise,
            scatter: said.scatter,
            unknown: cause,
            determined,
            bearings,
            dimensions,
            refuted,
        };
        Ok((diagnosis, said.sets))
    }

    /// The conclusion from this evidence, and what shows that a run changed speed too fast, where it was taken back for that.
    fn concluded(
        &self,
        evidence: &DiagnosisEvidence<'a, '_>,
        sweep: Option<&Sweep>,
        readings: &[Reading],
        noise: &Noise,
    ) -> Result<(Conclusion<'a>, Option<TooFast>), Error> {
        let said = evidence.verdict()?;
        Ok(match self.too_fast(sweep, (readings, noise), &said, evidence.ranking)? {
            Some((shown_by, why)) => (withdrawn(said, &why), Some(shown_by)),
            None => (said, None),
        })
    }

    /// Why nothing is claimed of a run that changed speed too fast; `None` where the verdict stands.
    fn too_fast(
        &self,
        sweep: Option<&Sweep>,
        (readings, noise): (&[Reading], &Noise),
        said: &Conclusion,
        ranking: &Ranking,
    ) -> Result<Option<(TooFast, Cow<'static, str>)>, Error> {
        let by_times = |why: &'static str| (TooFast::Times, why.into());
        Ok(match sweep {
            _ if ranking.nothing_missing >= SURE => None,
            _ if self.fitter.data.is_swept() => {
                (said.verdict == DiagnosisVerdict::Unknown).then(|| by_times(TRANSIENT_MISFIT))
            }
            Some(sweep) => lag_explains(sweep, self.fitter.rotor, readings)?.then(|| by_times(UNSTEADY)),
            None if said.candidate_fits || said.mistake.is_some() || !said.together.is_empty() => None,
            None => Beats::of(readings, noise).map(|beats| (TooFast::Beats, beats.words().into())),
        })
    }

    /// Measurements that would tell the candidates apart; where no speed does, a remark on another kind of measurement.
    fn asked(&self, weighed: &ModelComparison, noise: &Noise, remarks: &mut Vec<String>) -> Vec<Advice> {
        let advice = advice::between_fits(self, &weighed.tried, &weighed.ranking, noise);
        remarks.extend(advice.is_empty().then(|| advice::another_kind(self)));
        advice
    }

    /// What the best candidate says of one run beside the others: stated weights that it refutes, and remarks.
    fn of_runs(
        &self,
        best: &CandidateFit,
        verdict: DiagnosisVerdict,
        probability: f64,
        candidate_fits: bool,
    ) -> (Vec<RefutedRun>, Vec<String>) {
        let changes = RunChange::beyond(self, &self.hypothesis.with(best.placed), &best.fit);
        match verdict {
            DiagnosisVerdict::Missing => runs::told(&changes, probability, candidate_fits),
            DiagnosisVerdict::Undecided => {
                let label = best.placed.label(self.fitter.rotor);
                let remark = |c: &RunChange| format!("With {label}: {}", c.words(candidate_fits));
                (Vec::new(), changes.iter().map(remark).collect())
            }
            _ => (Vec::new(), Vec::new()),
        }
    }

    /// Compares known effects, an unknown cause, mistakes in the files, and no missing effect by their evidence. Mistakes are not
    /// sought where probably nothing is missing.
    pub fn weighed(&self, readings: &[Reading], noise: &Noise) -> Result<ModelComparison, Error> {
        let (mut sought, is_noise) = (None, explains(&self.drawing.scatter(), self));
        let tried = self.try_all_or(&mut || {
            if is_noise {
                return Ok(None);
            }
            let mistaken = sought.insert(MistakeComparison::beside(self, None, readings, noise)?);
            Ok(mistaken.fits.iter().find_map(|m| m.explained))
        })?;
        let unknown = UnknownCauseFit::beside(self)?;
        let ranking = |mistaken| rank::rank(self, &tried, tried.len(), Some(unknown.evidence), mistaken);
        let (mut mistaken, mut weighed) = (MistakeComparison::none(), ranking(None));
        if weighed.nothing_missing < PRIOR {
            mistaken = match sought {
                Some(found) => found,
                None => MistakeComparison::beside(self, tried.first(), readings, noise)?,
            };
            weighed = ranking(Some(&mistaken));
        }
        Ok(ModelComparison { tried, unknown, mistaken, ranking: weighed })
    }

    /// The bearings of a fit with this covariance.
    pub fn bearings(&self, fit: &Fit, covariance: Option<&DMatrix<f64>>) -> Vec<BearingParameter> {
        let bearings = &self.hypothesis.bearings;
        BearingParameter::all(self.fitter.rotor, bearings, &fit.x, covariance, |_| false)
    }

    /// The answer for one candidate.
    pub fn candidate(&self, t: &CandidateFit, probability: f64, model_fits: bool) -> Candidate {
        let rotor = self.fitter.rotor;
        let with = self.hypothesis.with(t.placed);
        Candidate {
            effect: t.placed.effect.name(),
            at: t.placed.place.name(rotor).map(Cow::into_owned),
            probability,
            support: t.evidence,
            error_after: self.relative_error(t.shown()),
            chi2_per_value: t.shown().chi2_per_value(),
            parameters: parameters::of(&with, &t.fit),
            model_fits,
            disqualified: t.disqualified.clone(),
            evidence: evidence::describe(self, t),
            knowledge: t.placed.effect.knowledge(),
        }
    }
}

/// Probability that nothing is missing in a model, as [`super::judged_fit`] has it.
///
/// # Errors
/// As [`diagnose`].
fn nothing_missing(rotor: &Rotor, readings: &[Reading]) -> Result<f64, Error> {
    let rotor = &rotor.as_stated();
    let noise = Noise::of(rotor, readings);
    let fitter = Fitter::new(rotor, Data::new(rotor, &noise, readings));
    BaseModel::fit(&fitter)?.nothing_missing()
}

impl BaseModel<'_> {
    /// Probability that nothing is missing; even odds where bearings and planes alone use up what the data hold.
    pub fn nothing_missing(&self) -> Result<f64, Error> {
        if rank::saturation(self).is_some() {
            return Ok(PRIOR);
        }
        // an unknown cause alone often rules it out, before any candidate is fitted
        let unknown = UnknownCauseFit::beside(self)?;
        let at_most = rank::rank(self, &[], 0, Some(unknown.evidence), None).nothing_missing;
        if at_most < NEGLIGIBLE {
            return Ok(at_most);
        }
        let tried = self.try_all()?;
        Ok(rank::rank(self, &tried, tried.len(), Some(unknown.evidence), None).nothing_missing)
    }
}

//! How much better a model fits without a mistake in its files.

use argmin::core::{CostFunction, Executor, State};
use argmin::solver::brent::BrentOpt;
use nalgebra::Complex;
use rayon::prelude::*;

use super::answer::{RIVAL, SuspectedMistake};
use super::base::{BaseModel, CandidateFit, explains, of_file};
use super::explained::ExplainedData;
use super::mistakes::Mistake;
use super::screening::{ENOUGH_FOR_MISTAKES, chosen};
use crate::error::Error;
use crate::fit::data::Amplitudes;
use crate::fit::hypothesis::Hypothesis;
use crate::fit::{Drawing, Effort, Fitter};
use crate::grade::Rigid;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::{Reading, SortedRun};
use crate::statistics::significance::NEGLIGIBLE;
use crate::units::figure;

/// Trials of a size between two that were tried already.
const TRIALS: u64 = 6;
/// Sizes of a mistake that are fitted on after a glance at all.
const FOLLOWED: usize = 2;
/// Mistakes whose size is refined.
const REFINED: usize = 6;
/// Mistakes that are fitted to the end, with the drawing's errors.
const SETTLED: usize = 3;

/// The files without a mistake, fitted.
#[derive(Debug, Clone)]
pub struct MistakeFit {
    pub mistake: Mistake,
    /// Its size, m or degrees; zero for one without.
    pub by: f64,
    /// For it over the files as they are: twice the logarithm of the Bayes factor.
    pub evidence: f64,
    pub chi2_per_value: f64,
    /// What it makes of the data, if the noise that is left can be the noise that was stated.
    pub explained: Option<ExplainedData>,
}

/// Every mistake that was tried.
pub struct MistakeComparison {
    /// Those that improve the fit, the strongest evidence first.
    pub fits: Vec<MistakeFit>,
    /// How many could have been made.
    pub possible: usize,
}

/// A model and the measurements that mistakes are sought in.
struct Files<'a, 'b> {
    base: &'b BaseModel<'a>,
    readings: &'b [Reading],
    /// A part of many readings, for the search.
    part: Vec<Reading>,
    noise: &'b Noise,
    search: MistakeSearch,
    /// How much less the search costs without any added unbalance.
    without_weights: f64,
}

/// The model as it is, on a part of the readings.
struct MistakeSearch {
    /// What the drawing's errors amount to around it: for a search of mistakes, not for a choice between them.
    drawing: Drawing,
    amplitudes: Amplitudes,
    cost: f64,
    /// Where it is, search coordinates.
    x: Vec<f64>,
}

impl MistakeSearch {
    fn of(fitter: &Fitter) -> Result<Self, Error> {
        let (hypothesis, starts) = of_file(fitter)?;
        let exact = fitter.exact_drawing();
        let rough = fitter.fit(&hypothesis, &starts, &exact, Effort::Rough, Some(&fitter.still()))?;
        let drawing = fitter.around_the_stated(&hypothesis, &rough)?;
        let start = [rough.x];
        let fit = fitter.fit(&hypothesis, &start, &drawing, Effort::Rough, Some(&rough.amplitudes))?;
        let cost = fitter.cost_under_own_scatter(&fit, &drawing);
        Ok(Self { drawing, amplitudes: fit.amplitudes, cost, x: fit.x })
    }

    /// How much less the model of a file costs than the one as it is, and where, search coordinates: from there, or from the usual
    /// starts. A glance begins as the file states it and where the model as it is ended.
    fn gain(&self, fitter: &Fitter, from: Option<&[f64]>, effort: Effort) -> Option<(f64, Vec<f64>)> {
        let (hypothesis, usual) = of_file(fitter).ok()?;
        let starts = match from {
            Some(x) => vec![x.to_vec()],
            None if effort == Effort::Glance => vec![usual[0].clone(), self.x.clone()],
            None => usual.to_vec(),
        };
        let drawing = self.drawing.of_another();
        let fit = fitter.fit(&hypothesis, &starts, &drawing, effort, Some(&self.amplitudes)).ok()?;
        // a glance is only to see from where to go on: its own scatter could only lower the cost
        let cost =
            if effort == Effort::Glance { fit.cost } else { fitter.cost_under_own_scatter(&fit, &drawing) };
        Some((self.cost - cost, fit.x))
    }

    /// How much less a hypothesis costs from a place in search coordinates, with the drawing's errors as they act there: at another
    /// speed or on another shaft they act differently. Nothing where the machine is singular.
    fn gain_on_own_drawing(&self, fitter: &Fitter, hypothesis: &Hypothesis, x: &[f64]) -> Option<f64> {
        let (start, amplitudes) = ([x.to_vec()], Some(&self.amplitudes));
        let there =
            fitter.fit(hypothesis, &start, &self.drawing.of_another(), Effort::Linear, amplitudes).ok()?;
        let drawing = fitter.around_the_stated(hypothesis, &there).ok()?;
        let fit = fitter.fit(hypothesis, &start, &drawing, Effort::Rough, amplitudes).ok()?;
        Some(self.cost - fitter.cost_under_own_scatter(&fit, &drawing))
    }
}

impl MistakeComparison {
    pub fn none() -> Self {
        Self { fits: Vec::new(), possible: 0 }
    }

    /// Fits the files without each mistake that could have been made, but for those that are beyond doubt less probable than an effect.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn beside(
        base: &BaseModel,
        effect: Option<&CandidateFit>,
        readings: &[Reading],
        noise: &Noise,
    ) -> Result<Self, Error> {
        let rotor = base.fitter.rotor;
        let part = part_of(readings);
        let as_it_is = Fitter::new(rotor, base.fitter.data.of_same_runs(rotor, noise, &part));
        let search = MistakeSearch::of(&as_it_is)?;
        let explaining = effect.filter(|t| t.is_settled && explains(&t.drawing(base).scatter(), base));
        let gain_by = |t: &CandidateFit| {
            search.gain_on_own_drawing(&as_it_is, &base.hypothesis.with(t.placed), &t.fit.x)
        };
        let by_effect = explaining.and_then(gain_by).unwrap_or(f64::NEG_INFINITY);
        let least_gain = (by_effect + 2.0 * NEGLIGIBLE.ln()).max(0.0);
        let mut unloaded = rotor.clone();
        unloaded.run.iter_mut().for_each(|run| run.added_unbalance.clear());
        let without = Fitter::new(&unloaded, base.fitter.data.of_same_runs(&unloaded, noise, &part));
        let without_weights = match unloaded == *rotor {
            true => 0.0,
            false => search.gain(&without, None, Effort::Rough).map_or(0.0, |(gain, _)| gain),
        };
        let files = Files { base, readings, part, noise, search, without_weights };
        let all = Mistake::possible(rotor);
        let possible = all.len();
        let progress = &base.fitter.progress;
        progress.plan(possible);
        let look = |mistake: Mistake| {
            let sizes = files.at_sizes(&mistake);
            progress.step();
            SoughtMistake { mistake, sizes }
        };
        let mut sought: Vec<SoughtMistake> = all.into_par_iter().map(look).collect();
        sought.sort_by(|a, b| b.best_gain().total_cmp(&a.best_gain()));
        sought.truncate(REFINED);
        let refine = |sought| {
            let (mistake, size) = files.refined(sought)?;
            let gain = files.gain_on_own_drawing(&mistake, &size)?;
            Some((mistake, size.by, gain))
        };
        let mut refined: Vec<(Mistake, f64, f64)> = sought.into_par_iter().filter_map(refine).collect();
        refined.retain(|(.., gain)| *gain > least_gain);
        refined.sort_by(|a, b| b.2.total_cmp(&a.2));
        refined.truncate(SETTLED);
        let settled = |(mistake, by, _)| files.settled(mistake, by);
        let mut fits: Vec<MistakeFit> = refined.into_par_iter().filter_map(settled).collect();
        fits.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        Ok(Self { fits, possible })
    }
}

/// A part of many readings: enough to see which mistakes are worth a closer look.
fn part_of(readings: &[Reading]) -> Vec<Reading> {
    let mut runs = vec![0; readings.len()];
    for (number, run) in SortedRun::all(readings).iter().enumerate() {
        run.rows.iter().for_each(|row| runs[*row] = number);
    }
    chosen(&runs, &[], ENOUGH_FOR_MISTAKES).iter().map(|k| readings[*k].clone()).collect()
}

/// A mistake at the sizes that were tried, in order.
struct SoughtMistake {
    mistake: Mistake,
    sizes: Vec<TriedSize>,
}

/// A size of a mistake, what is gained without it, and where.
struct TriedSize {
    by: f64,
    gain: f64,
    x: Vec<f64>,
}

impl SoughtMistake {
    /// Number of the best size.
    fn number(&self) -> usize {
        let gain = |k: &usize| self.sizes[*k].gain;
        (0..self.sizes.len()).max_by(|a, b| gain(a).total_cmp(&gain(b))).unwrap_or(0)
    }

    fn best_gain(&self) -> f64 {
        self.sizes.get(self.number()).map_or(f64::NEG_INFINITY, |best| best.gain)
    }
}

impl Files<'_, '_> {
    /// How much less the search costs without a mistake of this size, and where; nothing where no machine can be like that.
    fn gain(&self, mistake: &Mistake, by: f64, from: Option<&[f64]>, effort: Effort) -> Option<TriedSize> {
        let (rotor, readings) = mistake.undone(self.base.fitter.rotor, &self.part, by)?;
        let fitter = Fitter::new(&rotor, self.base.fitter.data.of_same_runs(&rotor, self.noise, &readings));
        let (gain, x) = self.search.gain(&fitter, from, effort)?;
        Some(TriedSize { by, gain, x })
    }

    /// What is gained at each size to try, the best of them fitted on from a glance at all; a mistake of no size gains nothing.
    fn at_sizes(&self, mistake: &Mistake) -> Vec<TriedSize> {
        let sizes = mistake.sizes(self.base.fitter.rotor);
        if sizes.is_empty() {
            let tried = self.gain(mistake, 0.0, None, Effort::Rough);
            // weights that the data do not show at all say nothing of a unit
            let is_shown = |tried: &TriedSize| {
                !matches!(mistake, Mistake::AmplitudeUnit(_))
                    || tried.gain > self.without_weights - 2.0 * RIVAL.ln()
            };
            return tried.filter(is_shown).into_iter().collect();
        }
        let glance = |by: &f64| self.gain(mistake, *by, None, Effort::Glance);
        let mut tried: Vec<TriedSize> = sizes.iter().filter_map(glance).collect();
        tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        for best in tried.iter_mut().take(FOLLOWED) {
            if let Some(further) = self.gain(mistake, best.by, Some(&best.x), Effort::Rough) {
                *best = further;
            }
        }
        tried.push(TriedSize { by: 0.0, gain: 0.0, x: Vec::new() });
        tried.sort_by(|a, b| a.by.total_cmp(&b.by));
        tried
    }

    /// A mistake at the size that fits best; nothing if that is none.
    fn refined(&self, sought: SoughtMistake) -> Option<(Mistake, TriedSize)> {
        let k = sought.number();
        let SoughtMistake { mistake, mut sizes } = sought;
        let neighbour = |k: usize| sizes.get(k).map(|tried| tried.by);
        let (before, after) = (k.checked_sub(1).and_then(neighbour), neighbour(k + 1));
        let only = sizes.len() < 2;
        let best = (k < sizes.len()).then(|| sizes.swap_remove(k)).filter(|best| best.gain > 0.0)?;
        if only {
            return Some((mistake, best));
        }
        let between = BrentOpt::new(before.unwrap_or(best.by), after.unwrap_or(best.by));
        let found = Executor::new(Between { files: self, mistake: &mistake, x: &best.x }, between)
            .configure(|state| state.max_iters(TRIALS))
            .run()
            .ok()
            .and_then(|found| Some((*found.state.get_best_param()?, -found.state.get_best_cost())));
        let (by, gain) = found.filter(|(_, other)| *other > best.gain).unwrap_or((best.by, best.gain));
        Some((mistake, TriedSize { by, gain, ..best }))
    }

    /// What is gained without a mistake of this size, the drawing's errors as they act then.
    fn gain_on_own_drawing(&self, mistake: &Mistake, size: &TriedSize) -> Option<f64> {
        let (rotor, readings) = mistake.undone(self.base.fitter.rotor, &self.part, size.by)?;
        let fitter = Fitter::new(&rotor, self.base.fitter.data.of_same_runs(&rotor, self.noise, &readings));
        let (hypothesis, _) = of_file(&fitter).ok()?;
        self.search.gain_on_own_drawing(&fitter, &hypothesis, &size.x)
    }

    /// A mistake with noise and errors of the drawing settled, on all readings; nothing where the files without it are those of a
    /// singular machine.
    fn settled(&self, mistake: Mistake, by: f64) -> Option<MistakeFit> {
        let own = self.base.fitter;
        let (rotor, readings) = mistake.undone(own.rotor, self.readings, by)?;
        let fitter = Fitter::new(&rotor, own.data.of_same_runs(&rotor, self.noise, &readings));
        let without = BaseModel::fit(&fitter).ok()?;
        let unknowns = usize::from(!mistake.sizes(own.rotor).is_empty());
        let scatter = without.drawing.scatter();
        let evidence = own.sizes.evidence(self.base.fit.cost - without.fit.cost, unknowns);
        Some(MistakeFit {
            by,
            evidence,
            chi2_per_value: without.closest().chi2_per_value(),
            explained: explains(&scatter, &without).then(|| ExplainedData::by(&without.fit, evidence)),
            mistake,
        })
    }
}

/// The cost of a mistake by its size, sought from one fit.
struct Between<'f, 'a, 'b> {
    files: &'f Files<'a, 'b>,
    mistake: &'f Mistake,
    x: &'f [f64],
}

impl CostFunction for Between<'_, '_, '_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, by: &f64) -> Result<f64, argmin::core::Error> {
        let tried = self.files.gain(self.mistake, *by, Some(self.x), Effort::Rough);
        Ok(tried.map_or(f64::MAX, |tried| -tried.gain))
    }
}

/// Balance qualities of machines, mm/s: a tenth of the finest grade of ISO 21940-11, G 0.4, to three times the coarsest, G 4000.
const QUALITY_MM_S: [f64; 2] = [0.04, 12_000.0];
/// Largest amplitudes of shafts, µm 0-pk: the noise of a proximity probe, and its range.
const AMPLITUDE_UM: [f64; 2] = [1.0, 2_000.0];
/// Units that are taken for µm: µm of one, and its name.
const MISTAKEN_UNITS: [(f64, &str); 4] = [(25.4, "mils"), (1e3, "mm"), (1e6, "m"), (1e-3, "nm")];

/// The unit that amplitudes must be in, as in µm no shaft vibrates like that: too little for a probe to see or too much for its
/// range, and with an unbalance (kg·m) that is as far out.
pub fn mistaken_unit(
    rotor: &Rotor,
    readings: &[Reading],
    unbalances_kg_m: &[Complex<f64>],
) -> Option<SuspectedMistake> {
    let amplitudes = readings.iter().flat_map(|r| r.probes.iter().flatten());
    let largest_um = 1e6 * amplitudes.map(|y| y.norm()).fold(0.0, f64::max);
    let fastest_rpm = readings.iter().map(|r| r.speed_rpm.abs()).fold(0.0, f64::max);
    let unbalance_kg_m: f64 = unbalances_kg_m.iter().map(|u| u.norm()).sum();
    let quality_mm_s = unbalance_kg_m / Rigid::of(rotor).permissible_kg_m(1.0, fastest_rpm);
    let within = |value: f64, [least, most]: [f64; 2]| (least..=most).contains(&value);
    let possible = |factor: f64| {
        within(factor * largest_um, AMPLITUDE_UM) && within(factor * quality_mm_s, QUALITY_MM_S)
    };
    if within(largest_um, AMPLITUDE_UM) || within(quality_mm_s, QUALITY_MM_S) {
        return None;
    }
    let units: Vec<&str> =
        MISTAKEN_UNITS.iter().filter(|(factor, _)| possible(*factor)).map(|(_, unit)| *unit).collect();
    (!units.is_empty()).then(|| SuspectedMistake {
        words: format!(
            "The amplitudes look like {} in place of µm 0-pk: the largest is {} µm, and the unbalance that fits, {} g·mm, would be \
             a balance quality of G {}",
            units.join(" or "),
            figure(largest_um),
            figure(1e6 * unbalance_kg_m),
            figure(quality_mm_s)
        ),
        probability: None,
        chi2_per_value: None,
    })
}

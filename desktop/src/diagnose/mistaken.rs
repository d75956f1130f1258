//! How much better a model fits without a mistake in its files.

use argmin::core::{CostFunction, Executor, State};
use argmin::solver::brent::BrentOpt;
use nalgebra::Complex;
use rayon::prelude::*;

use super::answer::{RIVAL, SuspectedMistake};
use super::base::{BaseModel, explains};
use super::mistakes::Mistake;
use super::screening::{ENOUGH_FOR_MISTAKES, chosen};
use crate::error::Error;
use crate::fit::Fitter;
use crate::fit::data::Data;
use crate::grade::Rigid;
use crate::machine::drawing::{Noise, Rotor};
use crate::measurement::{Reading, SortedRun};
use crate::units::figure;

/// Trials of a size between two that were tried already.
const TRIALS: u64 = 6;
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
    /// Whether the noise that is left can be the noise that was stated.
    pub explains: bool,
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
    /// What the search of the model as it is costs on that part.
    cost: f64,
    /// How much less it costs without any added unbalance.
    without_weights: f64,
}

impl MistakeComparison {
    pub fn none() -> Self {
        Self { fits: Vec::new(), possible: 0 }
    }

    /// Fits the files without each mistake that could have been made.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn beside(base: &BaseModel, readings: &[Reading], noise: &Noise) -> Result<Self, Error> {
        let rotor = base.fitter.rotor;
        let part = part_of(readings);
        let as_it_is = Fitter::new(rotor, Data::new(rotor, noise, &part));
        let cost = BaseModel::search_cost(&as_it_is)?;
        let mut unloaded = rotor.clone();
        unloaded.run.iter_mut().for_each(|run| run.added_unbalance.clear());
        let without = Fitter::new(&unloaded, Data::new(&unloaded, noise, &part));
        let without_weights = match unloaded == *rotor {
            true => 0.0,
            false => cost - BaseModel::search_cost(&without)?,
        };
        let files = Files { base, readings, part, noise, cost, without_weights };
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
        sought.sort_by(|a, b| b.best().1.total_cmp(&a.best().1));
        sought.truncate(REFINED);
        let mut refined: Vec<(Mistake, f64, f64)> =
            sought.into_par_iter().map(|sought| files.refined(sought)).collect();
        refined.retain(|(.., gain)| *gain > 0.0);
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
    chosen(&runs, ENOUGH_FOR_MISTAKES).iter().map(|k| readings[*k].clone()).collect()
}

/// A mistake at the sizes that were tried, each with what is gained without it, in order.
struct SoughtMistake {
    mistake: Mistake,
    sizes: Vec<(f64, f64)>,
}

impl SoughtMistake {
    /// Number of the best size.
    fn number(&self) -> usize {
        let gain = |k: &usize| self.sizes[*k].1;
        (0..self.sizes.len()).max_by(|a, b| gain(a).total_cmp(&gain(b))).unwrap_or(0)
    }

    fn best(&self) -> (f64, f64) {
        self.sizes.get(self.number()).copied().unwrap_or((0.0, f64::NEG_INFINITY))
    }
}

impl Files<'_, '_> {
    /// How much less the search costs without a mistake of this size; nothing where no machine can be like that.
    fn gain(&self, mistake: &Mistake, by: f64) -> Option<f64> {
        let (rotor, readings) = mistake.undone(self.base.fitter.rotor, &self.part, by)?;
        let fitter = Fitter::new(&rotor, Data::new(&rotor, self.noise, &readings));
        Some(self.cost - BaseModel::search_cost(&fitter).ok()?)
    }

    /// What is gained at each size to try; a mistake of no size gains nothing.
    fn at_sizes(&self, mistake: &Mistake) -> Vec<(f64, f64)> {
        let sizes = mistake.sizes(self.base.fitter.rotor);
        if sizes.is_empty() {
            let gain = self.gain(mistake, 0.0).map(|gain| (0.0, gain));
            // weights that the data do not show at all say nothing of a unit
            let is_shown = |(_, gain): &(f64, f64)| {
                !matches!(mistake, Mistake::AmplitudeUnit(_))
                    || *gain > self.without_weights - 2.0 * RIVAL.ln()
            };
            return gain.filter(is_shown).into_iter().collect();
        }
        let gain = |by: &f64| Some((*by, self.gain(mistake, *by)?));
        let mut tried: Vec<(f64, f64)> = sizes.iter().filter_map(gain).chain([(0.0, 0.0)]).collect();
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        tried
    }

    /// A mistake at the size that fits best, and what is gained without it.
    fn refined(&self, sought: SoughtMistake) -> (Mistake, f64, f64) {
        let (k, (by, gain)) = (sought.number(), sought.best());
        let SoughtMistake { mistake, sizes } = sought;
        if sizes.len() < 2 || by == 0.0 {
            return (mistake, by, if sizes.len() < 2 { gain } else { f64::NEG_INFINITY });
        }
        let (least, most) = (sizes[k.saturating_sub(1)].0, sizes[(k + 1).min(sizes.len() - 1)].0);
        let found = Executor::new(Between { files: self, mistake: &mistake }, BrentOpt::new(least, most))
            .configure(|state| state.max_iters(TRIALS))
            .run()
            .ok()
            .and_then(|found| Some((*found.state.get_best_param()?, -found.state.get_best_cost())));
        let (by, gain) = found.filter(|(_, other)| *other > gain).unwrap_or((by, gain));
        (mistake, by, gain)
    }

    /// A mistake with noise and errors of the drawing settled, on all readings; nothing where the files without it are those of a
    /// singular machine.
    fn settled(&self, mistake: Mistake, by: f64) -> Option<MistakeFit> {
        let own = self.base.fitter;
        let (rotor, readings) = mistake.undone(own.rotor, self.readings, by)?;
        let fitter = Fitter::new(&rotor, Data::new(&rotor, self.noise, &readings));
        let without = BaseModel::fit(&fitter).ok()?;
        let unknowns = usize::from(!mistake.sizes(own.rotor).is_empty());
        let scatter = without.drawing.scatter();
        Some(MistakeFit {
            by,
            evidence: own.sizes.evidence(self.base.fit.cost - without.fit.cost, unknowns),
            chi2_per_value: without.closest().chi2_per_value(),
            explains: explains(&scatter, &without),
            mistake,
        })
    }
}

/// The cost of a mistake by its size.
struct Between<'f, 'a, 'b> {
    files: &'f Files<'a, 'b>,
    mistake: &'f Mistake,
}

impl CostFunction for Between<'_, '_, '_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, by: &f64) -> Result<f64, argmin::core::Error> {
        Ok(self.files.gain(self.mistake, *by).map_or(f64::MAX, |gain| -gain))
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

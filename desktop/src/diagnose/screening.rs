//! A first look at candidates, on a part of many readings.
//!
//! What a candidate is worth takes as many evaluations for ten readings as for a thousand, and neighbouring speeds of one run say
//! nearly the same of where its parameters are. So they are sought on a part of the readings; from there the fit to all takes a few
//! steps. The part holds every run, or of many runs some that are spread over all.

use std::collections::{BTreeMap, BTreeSet};

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::effects::Place;
use crate::error::Error;
use crate::fit::data::{Amplitudes, FitRow};
use crate::fit::hypothesis::Hypothesis;
use crate::fit::{Drawing, Effort, Fit, Fitter};
use crate::statistics::scatter::Scatter;
use crate::statistics::significance::NEGLIGIBLE;

/// Real numbers for each unknown that are enough for a first look at candidates. Data with fewer than twice as many are taken whole.
const ENOUGH_FOR_UNKNOWN: usize = 20;
/// Readings that are enough for a first look at mistakes in the files, which change all readings by more than an effect does: eight
/// speeds of four runs, each with several real numbers for one unknown size.
pub const ENOUGH_FOR_MISTAKES: usize = 32;
/// What the prior of a search coordinate costs at most where a fit is any good: at three standard deviations.
pub const PRIOR_COST: f64 = 9.0;
/// Readings of a run that are taken at least, where it has as many.
const LEAST_OF_RUN: usize = 2;
const GOLDEN_RATIO: f64 = 1.618_033_988_749_895;

/// A part of the readings, with the model that candidates start from.
pub struct Screening<'a> {
    fitter: Fitter<'a>,
    drawing: Drawing,
    /// The model on this part.
    base: Fit,
    amplitudes: Amplitudes,
}

impl<'a> Screening<'a> {
    /// Beside the fit of a model, for candidates at these places; `None` if there are so few readings that all are looked at.
    ///
    /// # Errors
    /// If the machine is singular.
    pub fn beside(
        all: &Fitter<'a>,
        model: &Hypothesis,
        fit: &Fit,
        places: impl Iterator<Item = Place>,
    ) -> Result<Option<Self>, Error> {
        let runs: Vec<usize> = all.data.rows.iter().map(|row| row.run).collect();
        let places: Vec<Place> = model.effects.iter().map(|e| e.place).chain(places).collect();
        let is_needed = |row: &&FitRow| row.listed.is_some_and(|k| places.contains(&Place::Run(k)));
        let needed: Vec<usize> = all.data.rows.iter().filter(is_needed).map(|row| row.run).collect();
        let chosen = chosen(&runs, &needed, enough_for_effects(all, model));
        if 2 * chosen.len() > all.data.rows.len() {
            return Ok(None);
        }
        let fitter = all.part(&chosen);
        let amplitudes: Amplitudes = all.part_of_amplitudes(&fit.amplitudes, &chosen);
        let at = |drawing: &Drawing| {
            fitter.fit(model, std::slice::from_ref(&fit.x), drawing, Effort::Linear, Some(&amplitudes))
        };
        let drawing = fitter.around_the_stated(model, &at(&fitter.exact_drawing())?)?;
        let base = at(&drawing)?;
        Ok(Some(Self { fitter, drawing, base, amplitudes }))
    }

    /// Where a model with a candidate fits best, search coordinates, from these starts, and the evidence for it on this part.
    ///
    /// # Errors
    /// If the machine is singular from every start.
    pub fn best(&self, with: &Hypothesis, starts: &[Vec<f64>]) -> Result<(Vec<f64>, f64), Error> {
        let amplitudes = Some(&self.amplitudes);
        let fit = self.fitter.fit(with, starts, &self.drawing, Effort::Rough, amplitudes)?;
        let evidence = self.fitter.evidence(&self.base, &fit);
        Ok((fit.x, evidence))
    }

    /// The noise that a fit on this part may leave.
    pub fn noise_limit(&self, noise: &Scatter) -> NoiseLimit {
        NoiseLimit::of(noise, &self.fitter, &self.base, &self.drawing)
    }

    /// Where a model with a candidate fits best, search coordinates, from these starts; `None` if it leaves more than such noise on this part.
    /// A fit to all readings leaves no less on it.
    pub fn where_only_noise_is_left(
        &self,
        with: &Hypothesis,
        starts: &[Vec<f64>],
        noise: &NoiseLimit,
    ) -> Option<Vec<f64>> {
        noise.place_of_fit(&self.fitter, with, starts, &self.amplitudes)
    }
}

/// A noise that a fit may leave and no more, by χ² with a chance of [`NEGLIGIBLE`] to be wrong. Noise below the stated one counts as the stated
/// one.
pub struct NoiseLimit {
    /// The drawing in that noise.
    drawing: Drawing,
    most_chi2: f64,
}

impl NoiseLimit {
    /// On a drawing, where this is a fit of the model.
    pub fn of(noise: &Scatter, fitter: &Fitter, fit: &Fit, drawing: &Drawing) -> Self {
        let most_chi2 = most_chi2(fit.values, noise);
        Self { drawing: fitter.drawing_in_noise(drawing, fit, at_least_stated(noise)), most_chi2 }
    }

    /// Where a hypothesis fits best from these starts, search coordinates; `None` if it leaves more, or the machine is singular there.
    pub fn place_of_fit(
        &self,
        fitter: &Fitter,
        with: &Hypothesis,
        starts: &[Vec<f64>],
        amplitudes: &Amplitudes,
    ) -> Option<Vec<f64>> {
        let most = self.most_chi2 + PRIOR_COST * with.size() as f64;
        let fit = fitter.fit_below(most, with, starts, &self.drawing, Effort::Rough, Some(amplitudes));
        fit.ok().filter(|fit| fit.chi2 <= self.most_chi2).map(|fit| fit.x)
    }
}

/// Whether a fit leaves no more than such noise, as [`NoiseLimit`] has it.
pub fn leaves_no_more(fitter: &Fitter, fit: &Fit, drawing: &Drawing, noise: &Scatter) -> bool {
    fitter.chi2_under(fit, drawing, at_least_stated(noise)) <= most_chi2(fit.values, noise)
}

/// White noise of this size, or of the stated one if that is larger.
fn at_least_stated(noise: &Scatter) -> Scatter {
    Scatter { scale: noise.scale.max(1.0), correlation: 0.0, ..*noise }
}

/// The largest χ² of so many real numbers of such noise in units of white noise. Values that go along with their neighbours scatter like fewer that
/// do not.
fn most_chi2(values: usize, noise: &Scatter) -> f64 {
    let square = noise.correlation.powi(2);
    let share = (1.0 - square) / (1.0 + square);
    let law = ChiSquared::new((share * values as f64).ceil());
    law.map_or(f64::INFINITY, |law| law.inverse_cdf(1.0 - NEGLIGIBLE) / share)
}

/// Readings that are enough for a first look at candidates beside a model.
fn enough_for_effects(all: &Fitter, model: &Hypothesis) -> usize {
    let unknowns = model.size() + 2 * (all.rotor.plane.len() + model.unknowns().len());
    let of_a_reading = (2 * all.data.count()).div_ceil(all.data.rows.len()).max(1);
    (ENOUGH_FOR_UNKNOWN * unknowns).div_ceil(of_a_reading)
}

/// About so many of many readings, whose runs these are: of every run, its ends and, evenly spread, what lies between those of other
/// runs, which are often measured at the same speeds. Of more runs than so many readings can hold, some, and those that are `needed`.
pub fn chosen(runs: &[usize], needed: &[usize], enough: usize) -> Vec<usize> {
    let mut of_run: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    runs.iter().enumerate().for_each(|(r, run)| of_run.entry(*run).or_default().push(r));
    let is_needed: Vec<bool> = of_run.keys().map(|run| needed.contains(run)).collect();
    let of_run: Vec<Vec<usize>> = of_run.into_values().collect();
    let mut chosen: Vec<usize> = Vec::new();
    let count = of_run.len();
    let taken = spread(&is_needed, enough.div_ceil(LEAST_OF_RUN));
    let all: usize = taken.iter().map(|run| of_run[*run].len()).sum();
    for run in taken {
        let own = &of_run[run];
        let share = (enough * own.len()).div_ceil(all);
        let many = share.max(LEAST_OF_RUN).min(own.len());
        let last = own.len().saturating_sub(1);
        let between = |k: usize| if k == 0 { 0 } else { k * last + run * last / count };
        chosen.extend((0..many).map(|k| own[(between(k) / (many - 1).max(1)).min(last)]));
    }
    chosen.sort_unstable();
    chosen
}

/// Numbers of at most so many runs, in order, and of those that are needed beside them. They are spread by multiples of the golden ratio,
/// which follow no order that weights are put on in.
fn spread(is_needed: &[bool], most: usize) -> BTreeSet<usize> {
    let count = is_needed.len();
    if count <= most {
        return (0..count).collect();
    }
    let multiple = |k: usize| (k as f64 * GOLDEN_RATIO).fract();
    let mut taken: BTreeSet<usize> = (0..most).map(|k| (multiple(k) * count as f64) as usize).collect();
    taken.extend((0..count).filter(|run| is_needed[*run]));
    taken
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::data::Data;
    use crate::machine::drawing::Noise;
    use crate::simulate::{SimulationRequest, simulate};
    use crate::testing::sample_rotor;

    const NOISE: Noise =
        Noise { relative: 0.01, floor_um: 0.05, scale: None, correlation: None, between_runs: None };

    #[test]
    fn residuals_of_twice_the_noise_are_larger_than_noise() {
        let rotor = sample_rotor();
        let twice = Noise { relative: 0.02, floor_um: 0.1, ..NOISE };
        let times = |scale: f64| Scatter { scale, ..Scatter::STATED };
        // noise of the readings, noise that is asked for, and whether the residuals are no larger
        for (noise, asked, expected) in [
            (NOISE, times(1.0), true),
            // less than stated is no reason to expect less
            (NOISE, times(0.5), true),
            (twice, times(1.0), false),
            (twice, times(2.0), true),
        ] {
            let speeds_rpm = (0..200).map(|k| 600.0 + 40.0 * f64::from(k)).collect();
            let request = SimulationRequest { speeds_rpm, noise: Some(noise), seed: 3, ..Default::default() };
            let readings = simulate(&rotor, &request).unwrap().readings;
            let fitter = Fitter::new(&rotor, Data::new(&rotor, &NOISE, &readings));
            let model = Hypothesis::drawn(&rotor, fitter.scales(None));
            let (start, drawing) = ([model.bearings.stated()], fitter.exact_drawing());
            let fit = fitter.fit(&model, &start, &drawing, Effort::Search, Some(&fitter.still())).unwrap();
            assert_eq!(leaves_no_more(&fitter, &fit, &drawing, &asked), expected, "{noise:?} {asked:?}");
            let part = Screening::beside(&fitter, &model, &fit, std::iter::empty())
                .unwrap()
                .expect("a part of two hundred readings");
            let found = part.where_only_noise_is_left(&model, &start, &part.noise_limit(&asked));
            assert_eq!(found.is_some(), expected, "{noise:?} {asked:?}");
        }
    }

    #[test]
    fn screened_readings_hold_both_ends_of_every_run() {
        let runs: Vec<usize> = [0; 900].into_iter().chain([1; 5]).chain([2]).collect();
        let enough = 120;
        let chosen = chosen(&runs, &[], enough);
        let of_first = chosen.iter().filter(|r| **r < 900).count();
        assert!((enough - 2..=enough).contains(&of_first), "{of_first}");
        assert_eq!((chosen[0], chosen[of_first - 1]), (0, 899));
        assert_eq!(chosen[of_first..], [900, 904, 905]);
    }

    #[test]
    fn screened_readings_of_equal_runs_lie_between_one_another() {
        let runs: Vec<usize> = [[0; 41], [1; 41]].concat();
        let chosen = chosen(&runs, &[], 18);
        let of_run = |run: usize| chosen.iter().filter(move |r| *r / 41 == run).map(|r| r % 41);
        let [first, second]: [Vec<usize>; 2] = [of_run(0).collect(), of_run(1).collect()];
        assert_eq!(first, [0, 5, 10, 15, 20, 25, 30, 35, 40]);
        assert_eq!(second, [0, 7, 12, 17, 22, 27, 32, 37, 40]);
    }

    #[test]
    fn of_many_runs_some_are_chosen_and_those_that_are_needed() {
        // two readings a run, weights in two planes in turn
        let runs: Vec<usize> = (0..170).map(|r| r / 2).collect();
        let chosen = chosen(&runs, &[1, 50], 30);
        let taken: BTreeSet<usize> = chosen.iter().map(|r| r / 2).collect();
        assert_eq!(chosen.len(), 2 * taken.len());
        assert!((15..=17).contains(&taken.len()) && taken.contains(&1) && taken.contains(&50), "{taken:?}");
        let of_first = taken.iter().filter(|run| *run % 2 == 0).count();
        assert!((5..=12).contains(&of_first), "{taken:?}");
        let farthest = taken.iter().zip(taken.iter().skip(1)).map(|(a, b)| b - a).max();
        assert!(farthest < Some(15), "{taken:?}");
    }

    #[test]
    fn runs_that_have_no_readings_left_are_not_chosen() {
        // every fourth of 80 runs, as where runs are compared with one another
        let runs: Vec<usize> = (0..40).map(|r| 4 * (r / 2)).collect();
        assert_eq!(chosen(&runs, &[], 80).len(), runs.len());
        let some = chosen(&runs, &[76], 20);
        assert!((20..=22).contains(&some.len()) && some.contains(&38), "{some:?}");
    }
}

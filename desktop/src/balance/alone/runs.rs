//! Trial runs as equations, and the noise from their repeats.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Complex;

use super::sets::WeightSets;
use super::stated::Weights;
use super::{Basis, CorrectionRequest, MachineInfluence, doubts};
use crate::balance::influence::contradiction::{AgreeingRuns, Contradiction};
use crate::balance::influence::trials::{MeasuredPhasor, TrialFit, TrialReading, Trials};
use crate::balance::interpolated::{Interpolated, interpolated};
use crate::balance::sense::CHANCE;
use crate::balance::speeds::Speeds;
use crate::error::Error;
use crate::measurement::{ProbeRecord, Reading, component_sd, read_series};
use crate::unbalance::region::component_95;

type C = Complex<f64>;

/// Reads runs under trial weights: each needs a name, and every weight a run.
///
/// # Errors
/// One sentence with the file, row and column, and what was expected.
pub fn read(path: &Path, weights: &Weights) -> Result<ProbeRecord, Error> {
    let named = |run: &str| match run.is_empty() {
        true => Err("the run has no name, expected one, as its weights belong to it".to_string()),
        false => Ok(()),
    };
    let series = read_series(path, named)?;
    check(&series, path, weights)?;
    Ok(series)
}

/// Checks that every reading of a file has a run, and every weight one that was measured.
///
/// # Errors
/// One sentence with the file and the run.
pub fn check(series: &ProbeRecord, path: &Path, weights: &Weights) -> Result<(), Error> {
    let file = path.display().to_string();
    if series.readings.iter().any(|r| r.run.is_none()) {
        let what = "the column run is missing, expected the names of the runs that the weights belong to";
        return Err(Error::measurement(&file, "header", what));
    }
    let measured = |run: &str| series.readings.iter().any(|r| r.run.as_deref() == Some(run));
    match weights.rows.iter().find(|(run, ..)| !measured(run)) {
        Some((run, ..)) => {
            let what =
                format!("the run \"{run}\" was not measured in {file}, expected the name of one of its runs");
            Err(Error::measurement(&weights.file, "column run", what))
        }
        None => Ok(()),
    }
}

/// Mean of the readings of one run at one speed, by probe.
pub(super) struct Mean {
    pub run: usize,
    pub speed: usize,
    /// Phasor, in the unit of the data, and how many readings are in it.
    pub probes: Vec<Option<(C, usize)>>,
}

/// Readings by run and common speed.
pub(super) struct Means {
    pub all: Vec<Mean>,
    pub speeds: Speeds,
    pub runs: Vec<String>,
    /// Root mean square of each probe at each speed over the runs.
    levels: Vec<Vec<f64>>,
    /// Variance of a component of one reading within a run, relative to its level, and the real values behind it.
    pub within: Option<(f64, usize)>,
}

impl Means {
    pub fn of(readings: &[Reading], probes: usize, request: &CorrectionRequest) -> Result<Self, Error> {
        let [from, to] = request.range_rpm.unwrap_or([0.0, f64::INFINITY]);
        let readings: Vec<&Reading> =
            readings.iter().filter(|r| (from..=to).contains(&r.speed_rpm)).collect();
        if readings.is_empty() {
            return Err(Error::NoReadingInRange { from_rpm: from, to_rpm: to });
        }
        let mut runs: Vec<String> = Vec::new();
        let at: Vec<(usize, f64)> = readings
            .iter()
            .map(|r| {
                let name = r.run.clone().unwrap_or_default();
                let run = runs.iter().position(|known| *known == name).unwrap_or_else(|| {
                    runs.push(name);
                    runs.len() - 1
                });
                (run, r.speed_rpm)
            })
            .collect();
        let speeds = Speeds::new(&at, request.same_speed);
        let mut together: BTreeMap<(usize, usize), Vec<&Reading>> = BTreeMap::new();
        for ((reading, (run, _)), speed) in readings.iter().zip(&at).zip(&speeds.of) {
            together.entry((*speed, *run)).or_default().push(reading);
        }
        // phasors of a series are in millionths of its unit
        let seen = |all: &[&Reading], p: usize| -> Vec<C> {
            all.iter().filter_map(|r| r.probes[p]).map(|y| y * 1e6).collect()
        };
        let mean = |all: &[C]| all.iter().sum::<C>() / all.len() as f64;
        let all: Vec<Mean> = together
            .iter()
            .map(|((speed, run), here)| Mean {
                run: *run,
                speed: *speed,
                probes: (0..probes)
                    .map(|p| Some(seen(here, p)).filter(|y| !y.is_empty()).map(|y| (mean(&y), y.len())))
                    .collect(),
            })
            .collect();
        let level = |speed: usize, p: usize| {
            let here = all.iter().filter(|m| m.speed == speed).filter_map(|m| m.probes[p]);
            let sizes: Vec<f64> = here.map(|(y, _)| y.norm_sqr()).collect();
            (sizes.iter().sum::<f64>() / sizes.len().max(1) as f64).sqrt().max(f64::MIN_POSITIVE)
        };
        let levels: Vec<Vec<f64>> =
            (0..speeds.mean_rpm.len()).map(|speed| (0..probes).map(|p| level(speed, p)).collect()).collect();
        let (mut squares, mut values) = (0.0, 0);
        for ((speed, _), here) in &together {
            for p in 0..probes {
                let y = seen(here, p);
                if y.len() > 1 {
                    let centre = mean(&y);
                    squares +=
                        y.iter().map(|y| (y - centre).norm_sqr()).sum::<f64>() / levels[*speed][p].powi(2);
                    values += 2 * (y.len() - 1);
                }
            }
        }
        let within = (values > 0).then(|| (squares / values as f64, values));
        Ok(Self { all, speeds, runs, levels, within })
    }

    /// Root mean square of a probe at a speed over the runs.
    pub fn level(&self, speed: usize, probe: usize) -> f64 {
        self.levels[speed][probe]
    }

    /// Standard deviation of a component of a mean, for a noise that is stated or relative to the level.
    fn sigma(&self, noise: NoiseBasis, mean: &Mean, probe: usize) -> Option<MeasuredPhasor> {
        let (phasor, count) = mean.probes[probe]?;
        let level = self.levels[mean.speed][probe];
        let sigma = match noise {
            NoiseBasis::Stated([relative, floor]) => {
                component_sd(relative, floor, phasor) / (count as f64).sqrt()
            }
            NoiseBasis::OfReading(relative) => relative * level / (count as f64).sqrt(),
            NoiseBasis::OfRun(relative) => relative * level,
        };
        // rounding is always there
        Some(MeasuredPhasor { phasor, sigma: sigma.max(1e-12 * level) })
    }
}

/// What the standard deviation of a component is.
#[derive(Clone, Copy)]
enum NoiseBasis {
    /// Of a reading: relative to it, and in its unit.
    Stated([f64; 2]),
    /// Of a reading, relative to its level.
    OfReading(f64),
    /// Of a run, relative to its level.
    OfRun(f64),
}

/// What is unknown of the machine: the effect of planes, or of sets of weights over them.
struct Unknowns {
    /// Correction planes.
    planes: Vec<String>,
    /// Names of the unknowns: the correction planes first, then other planes; or the sets.
    names: Vec<String>,
    /// How many of them are for correction.
    count: usize,
    /// Weights of each run, by unknown.
    of_run: Vec<Vec<C>>,
    sets: Option<WeightSets>,
}

impl Unknowns {
    fn of_planes(weights: &Weights, runs: &[String], request: &CorrectionRequest) -> Result<Self, Error> {
        let mut places = request.planes_of(&weights.planes)?;
        let count = places.len();
        // weights in planes that are not to be used act all the same
        let others: Vec<usize> = (0..weights.planes.len())
            .filter(|j| !places.contains(j) && runs.iter().any(|run| weights.of(run)[*j].norm() > 0.0))
            .collect();
        places.extend(others);
        let names: Vec<String> = places.iter().map(|j| weights.planes[*j].clone()).collect();
        let of_run = |run: &String| {
            let all = weights.of(run);
            places.iter().map(|j| all[*j]).collect()
        };
        Ok(Self {
            planes: names[..count].to_vec(),
            names,
            count,
            of_run: runs.iter().map(of_run).collect(),
            sets: None,
        })
    }

    /// The same by sets, relative to the run that weights are added to; none where planes are not for correction.
    fn by_sets(&self, runs: &[String], onto: Option<usize>) -> Option<Self> {
        if self.names.len() > self.count {
            return None;
        }
        let start = onto.map_or_else(|| vec![C::from(0.0); self.count], |run| self.of_run[run].clone());
        let added = |(run, all): (&String, &Vec<C>)| {
            (run.clone(), all.iter().zip(&start).map(|(w, start)| w - start).collect::<Vec<C>>())
        };
        let all: Vec<(String, Vec<C>)> = runs.iter().zip(&self.of_run).map(added).collect();
        let sets = WeightSets::of(&all)?;
        Some(Self {
            planes: self.planes.clone(),
            names: sets.names(),
            count: sets.runs.len(),
            of_run: all.iter().map(|(_, added)| sets.of_planes(added)).collect(),
            sets: Some(sets),
        })
    }
}

/// The readings of the runs.
struct Source<'a> {
    series: &'a ProbeRecord,
    means: &'a Means,
    /// The run that weights are added to.
    onto: Option<usize>,
}

impl Source<'_> {
    fn trials(&self, unknowns: &Unknowns, noise: NoiseBasis) -> Trials {
        let probes = 0..self.series.probes.len();
        let reading = |m: &Mean| TrialReading {
            run: m.run,
            speed: m.speed,
            weights: unknowns.of_run[m.run].clone(),
            probes: probes.clone().map(|p| self.means.sigma(noise, m, p)).collect(),
        };
        Trials {
            readings: self.means.all.iter().map(reading).collect(),
            places: unknowns.names.clone(),
            planes: unknowns.count,
            probes: self.series.probes.clone(),
            speeds: self.means.speeds.clone(),
            runs: self.means.runs.clone(),
            is_noise_known: matches!(noise, NoiseBasis::Stated(_)),
            untried_is_nothing: unknowns.sets.is_some(),
            onto: self.onto,
        }
    }

    /// The effect of planes, or that of sets where the runs do not hold it.
    fn examined(
        &self,
        weights: &Weights,
        request: &CorrectionRequest,
        noise: NoiseBasis,
    ) -> Result<(Unknowns, AgreeingRuns), Error> {
        let planes = Unknowns::of_planes(weights, &self.means.runs, request)?;
        let why = match self.trials(&planes, noise).fit() {
            Ok(fit) => return Ok((planes, fit)),
            Err(why @ (Error::DependentTrialWeights { .. } | Error::TooFewRuns { .. })) => why,
            Err(other) => return Err(other),
        };
        let Some(unknowns) = planes.by_sets(&self.means.runs, self.onto) else { return Err(why) };
        match self.trials(&unknowns, noise).fit() {
            Ok(found) if unknowns.sets.iter().all(|sets| sets.are_tried(&found.fit)) => Ok((unknowns, found)),
            Err(reversed @ Error::ReversedPhases(_)) => Err(reversed),
            _ => Err(why),
        }
    }
}

/// The machine that trial runs show.
///
/// # Errors
/// One sentence if the runs do not hold the coefficients of the planes, or contradict the sign of the phases.
pub fn machine(
    series: &ProbeRecord,
    weights: &Weights,
    request: &CorrectionRequest,
) -> Result<MachineInfluence, Error> {
    let common = request.interpolate.then(|| interpolated(&series.readings)).transpose()?;
    let readings = common.as_ref().map_or(&series.readings, |common| &common.readings);
    let means = Means::of(readings, series.probes.len(), request)?;
    let onto = match &request.onto {
        None => None,
        Some(name) => Some(
            means
                .runs
                .iter()
                .position(|run| run == name)
                .ok_or_else(|| Error::UnknownRun { run: name.clone(), known: means.runs.clone() })?,
        ),
    };
    let source = Source { series, means: &means, onto };
    // relative to the level, so that what the runs miss each other by is relative too
    let relative = NoiseBasis::OfRun(1.0);
    let stated = request.noise.map(NoiseBasis::Stated);
    let (unknowns, examined) = source.examined(weights, request, stated.unwrap_or(relative))?;
    let with_noise = |noise: NoiseBasis| source.trials(&unknowns, noise);
    let left_out = examined.contradiction.as_ref().and_then(|c| c.left_out);
    let trials = |noise: NoiseBasis| match left_out {
        Some(run) => with_noise(noise).without(run),
        None => with_noise(noise),
    };
    let plain = trials(relative).least_squares()?;
    let exceeds_stated = stated.is_some() && examined.fit.misfit.is_some_and(|m| m.chance() < CHANCE);
    let (noise, basis) = match (stated.filter(|_| !exceeds_stated), between_runs(&plain), means.within) {
        (Some(stated), ..) => (stated, Basis::Stated),
        (None, Some((runs, values)), within) => {
            // a few runs may agree by chance, which makes no reading better than it is
            let least = within.map_or(0.0, |(variance, _)| (variance / means.readings_in_a_mean()).sqrt());
            (NoiseBasis::OfRun(runs.max(least)), Basis::Runs(values))
        }
        (None, None, Some((variance, values))) => {
            (NoiseBasis::OfReading(variance.sqrt()), Basis::Readings(values))
        }
        (None, None, None) => (NoiseBasis::OfRun(1.0), Basis::Unknown),
    };
    let trials = trials(noise);
    let mut fitted = trials.least_squares()?;
    if basis == Basis::Unknown {
        for c in &mut fitted.coefficients {
            c.covariance.fill(C::from(0.0));
        }
    }
    let mut doubts: Vec<String> = common.iter().map(Interpolated::remark).collect();
    doubts.extend(examined.contradiction.iter().map(Contradiction::doubt));
    doubts.extend(unknowns.sets.iter().flat_map(|sets| sets.doubts(&fitted)));
    doubts.extend(exceeds_stated.then(doubts::beyond_stated));
    let scatter = plain.misfit.map_or(0.0, |m| m.chi2_per_value.sqrt());
    doubts.extend(doubts::of_runs(&trials, &fitted, basis, scatter));
    doubts.extend(doubts::unnamed(scatter).filter(|_| examined.contradiction.is_none()));
    Ok(MachineInfluence {
        coefficients: fitted.coefficients,
        probes: series.probes.clone(),
        planes: unknowns.planes,
        sets: unknowns.sets,
        unit: series.unit.clone(),
        weight_unit: weights.unit,
        scatter,
        basis,
        doubts,
    })
}

/// Scatter between the runs, relative to the level, and its degrees of freedom; `fit` is with noise relative to the level.
///
/// The scatter of all readings holds where they are independent, that of what weights could make where a run's readings share its
/// error. The wider interval is taken.
fn between_runs(fit: &TrialFit) -> Option<(f64, usize)> {
    let ways = [fit.misfit, fit.misfit_of_weights()].into_iter().flatten();
    let scales = ways.map(|m| (m.chi2_per_value.sqrt(), m.freedom));
    scales.max_by(|a, b| {
        let half = |(scale, freedom): &(f64, usize)| scale * component_95(*freedom as f64);
        half(a).total_cmp(&half(b))
    })
}

impl Means {
    /// Mean number of readings behind a mean.
    fn readings_in_a_mean(&self) -> f64 {
        let counts: Vec<usize> =
            self.all.iter().flat_map(|m| m.probes.iter().flatten()).map(|(_, n)| *n).collect();
        counts.iter().sum::<usize>() as f64 / counts.len().max(1) as f64
    }

    /// Mean of every probe at every speed over all runs, with the readings in it; `None` where there is none.
    pub fn over_runs(&self, speed: usize, probe: usize) -> Option<(C, usize)> {
        let here: Vec<(C, usize)> =
            self.all.iter().filter(|m| m.speed == speed).filter_map(|m| m.probes[probe]).collect();
        let count: usize = here.iter().map(|(_, n)| n).sum();
        (count > 0).then(|| (here.iter().map(|(y, n)| y * *n as f64).sum::<C>() / count as f64, count))
    }
}

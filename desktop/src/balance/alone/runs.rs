//! Trial runs as equations, and the noise from their repeats.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Complex, DMatrix};

use super::stated::Weights;
use super::{Basis, CorrectionRequest, MachineInfluence, doubts};
use crate::balance::influence::trials::{MeasuredPhasor, TrialReading, Trials};
use crate::balance::interpolated::{Interpolated, interpolated};
use crate::balance::speeds::Speeds;
use crate::error::Error;
use crate::measurement::{ProbeRecord, Reading, component_sd, read_series};

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
    let file = path.display().to_string();
    if series.readings.iter().any(|r| r.run.is_none()) {
        let what = "the column run is missing, expected the names of the runs that the weights belong to";
        return Err(Error::measurement(&file, "header", what));
    }
    let measured = |run: &str| series.readings.iter().any(|r| r.run.as_deref() == Some(run));
    if let Some((run, ..)) = weights.rows.iter().find(|(run, ..)| !measured(run)) {
        let what =
            format!("the run \"{run}\" was not measured in {file}, expected the name of one of its runs");
        return Err(Error::measurement(&weights.file, "column run", what));
    }
    Ok(series)
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
    let mut places = request.planes_of(&weights.planes)?;
    let planes = places.len();
    // weights in planes that are not to be used act all the same
    let others: Vec<usize> = (0..weights.planes.len())
        .filter(|j| !places.contains(j) && means.runs.iter().any(|run| weights.of(run)[*j].norm() > 0.0))
        .collect();
    places.extend(others);
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
    let trials = |noise: NoiseBasis| Trials {
        readings: means
            .all
            .iter()
            .map(|m| {
                let all = weights.of(&means.runs[m.run]);
                TrialReading {
                    run: m.run,
                    speed: m.speed,
                    weights: places.iter().map(|j| all[*j]).collect(),
                    probes: (0..series.probes.len()).map(|p| means.sigma(noise, m, p)).collect(),
                }
            })
            .collect(),
        places: places.iter().map(|j| weights.planes[*j].clone()).collect(),
        planes,
        probes: series.probes.clone(),
        speeds: means.speeds.clone(),
        onto,
    };
    // relative to the level, so that what the runs miss each other by is relative too
    let plain = trials(NoiseBasis::OfRun(1.0)).fit()?;
    let scatter = plain.misfit.map(|m| (m.chi2_per_value.sqrt(), m.freedom));
    let (noise, basis) = match (request.noise, scatter, means.within) {
        (Some(stated), ..) => (NoiseBasis::Stated(stated), Basis::Stated),
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
    let mut fitted = trials.fit()?;
    if basis == Basis::Unknown {
        for c in &mut fitted.coefficients {
            c.covariance = DMatrix::zeros(1 + planes, 1 + planes);
        }
    }
    let mut doubts: Vec<String> = common.iter().map(Interpolated::remark).collect();
    doubts.extend(doubts::of_runs(&trials, &fitted, basis, scatter.map_or(0.0, |(relative, _)| relative)));
    Ok(MachineInfluence {
        coefficients: fitted.coefficients,
        probes: series.probes.clone(),
        planes: trials.places[..planes].to_vec(),
        unit: series.unit.clone(),
        basis,
        doubts,
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

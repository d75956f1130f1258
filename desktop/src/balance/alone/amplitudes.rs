//! Runs without phase: amplitudes alone, under trial weights at several angles (the four-run method).
//!
//! `|Y₀ + Σ A U|` is measured in every run. The phase of the run without weights stays unknown and is set to zero, which moves
//! neither the weights nor the amplitudes: Y₀ is then one unknown, A two for each plane. Least squares of the amplitudes can have
//! several minima. The lowest is used, the next one is told.

use nalgebra::{Complex, DMatrix, DVector};

use super::runs::Means;
use super::stated::Weights;
use super::{Basis, CorrectionRequest, MachineInfluence, doubts};
use crate::balance::influence::InfluenceCoefficients;
use crate::error::Error;
use crate::fit::descent::{Objective, Stop, descend};
use crate::measurement::{ProbeRecord, component_sd};

type C = Complex<f64>;

/// Angles from which a minimum is sought.
const STARTS: usize = 24;
/// Effects of a trial weight from which a minimum is sought, relative to the vibration without it.
const EFFECTS: [f64; 4] = [0.1, 0.4, 1.0, 2.5];
const STOP: Stop = Stop::after(100, 1e-14);
/// Minima nearer than this, relative, are one.
const SAME: f64 = 1e-4;
/// Misfits below this, relative, are rounding.
const EXACT: f64 = 1e-6;

/// One run at one probe and speed, relative to the level and the largest trial weight.
#[derive(Debug, Clone)]
struct Amplitude {
    weights: Vec<C>,
    size: f64,
    sigma: f64,
}

/// Least squares of amplitudes, at a place.
struct Amplitudes<'a> {
    all: &'a [Amplitude],
    x: DVector<f64>,
}

impl Amplitudes<'_> {
    fn phasor(&self, run: &Amplitude) -> C {
        let effect = |(j, w): (usize, &C)| C::new(self.x[1 + 2 * j], self.x[2 + 2 * j]) * w;
        C::from(self.x[0]) + run.weights.iter().enumerate().map(effect).sum::<C>()
    }
}

impl Objective for Amplitudes<'_> {
    fn position(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn move_to(&mut self, x: &DVector<f64>) {
        self.x.copy_from(x);
    }

    fn value(&self) -> f64 {
        self.all.iter().map(|run| ((self.phasor(run).norm() - run.size) / run.sigma).powi(2)).sum()
    }

    fn normal_equations(&mut self) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let size = self.x.len();
        let (mut gram, mut slope) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for run in self.all {
            let y = self.phasor(run);
            let along = y / y.norm().max(f64::MIN_POSITIVE);
            let row = DVector::from_fn(size, |i, _| {
                let moved = match i {
                    0 => C::from(1.0),
                    i if i % 2 == 1 => run.weights[(i - 1) / 2],
                    i => C::i() * run.weights[(i - 1) / 2],
                };
                (along.conj() * moved).re / run.sigma
            });
            slope += &row * ((y.norm() - run.size) / run.sigma);
            gram += &row * row.transpose();
        }
        Some((gram, slope))
    }
}

/// A minimum: unknowns and the sum of squares.
type Minimum = (DVector<f64>, f64);

/// Minima of least squares, lowest first, from these starts.
fn minima(all: &[Amplitude], starts: impl Iterator<Item = DVector<f64>>) -> Vec<Minimum> {
    let mut found: Vec<Minimum> = Vec::new();
    for x in starts {
        let mut at = Amplitudes { all, x };
        descend(&mut at, STOP);
        // an amplitude has no sign
        let x = if at.x[0] < 0.0 { -&at.x } else { at.x.clone() };
        let value = at.value();
        if value.is_finite() && !found.iter().any(|(known, _)| (known - &x).norm() < SAME * x.norm()) {
            found.push((x, value));
        }
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    found
}

/// Minima of all planes: each plane's own runs give starts, and all runs the minima.
fn of_row(all: &[Amplitude], planes: usize) -> Option<Vec<Minimum>> {
    let without = all.iter().find(|run| run.weights.iter().all(|w| w.norm() == 0.0));
    let level = without.map_or(1.0, |run| run.size);
    let around = |at: usize| {
        let effect = C::from_polar(
            level * EFFECTS[at / STARTS],
            std::f64::consts::TAU * (at % STARTS) as f64 / STARTS as f64,
        );
        DVector::from_column_slice(&[level, effect.re, effect.im])
    };
    let starts: Vec<Vec<DVector<f64>>> = (0..planes)
        .map(|j| {
            let own = all
                .iter()
                .filter(|run| run.weights.iter().enumerate().all(|(k, w)| k == j || w.norm() == 0.0));
            let own: Vec<Amplitude> =
                own.map(|run| Amplitude { weights: vec![run.weights[j]], ..run.clone() }).collect();
            minima(&own, (0..STARTS * EFFECTS.len()).map(around)).into_iter().map(|(x, _)| x).collect()
        })
        .collect();
    // every choice of one minimum a plane
    let mut joined: Vec<Vec<f64>> = vec![Vec::new()];
    let mut means = vec![0.0];
    for of_plane in &starts {
        let with = |(so_far, mean): (&Vec<f64>, &f64)| {
            let longer =
                |x: &DVector<f64>| ([so_far.as_slice(), &[x[1], x[2]]].concat(), mean + x[0] / planes as f64);
            of_plane.iter().map(longer).collect::<Vec<_>>()
        };
        (joined, means) = joined.iter().zip(&means).flat_map(with).unzip();
    }
    let joined = joined
        .into_iter()
        .zip(means)
        .map(|(effects, mean)| DVector::from_iterator(1 + 2 * planes, std::iter::once(mean).chain(effects)));
    Some(minima(all, joined)).filter(|found| !found.is_empty())
}

/// The machine that amplitudes show; `series` has them as real phasors.
///
/// # Errors
/// One sentence if there are too few runs, or two weights fit the same amplitudes.
pub fn machine(
    series: &ProbeRecord,
    weights: &Weights,
    request: &CorrectionRequest,
) -> Result<MachineInfluence, Error> {
    let planes = request.planes_of(&weights.planes)?;
    if request.onto.is_some() || request.interpolate || planes.len() < weights.planes.len() {
        return Err(Error::Unsuitable(
            "runs without phase give the weights of all planes for the machine without weights, expected no --onto, \
             --interpolate or --planes"
                .into(),
        ));
    }
    let means = Means::of(&series.readings, series.probes.len(), request)?;
    let count = planes.len();
    let largest = weights.rows.iter().map(|(.., w)| w.norm()).fold(f64::MIN_POSITIVE, f64::max);
    let mut fits: Vec<RowFit> = Vec::new();
    for (speed, speed_rpm) in means.speeds.mean_rpm.iter().enumerate() {
        for probe in 0..series.probes.len() {
            let level = means.level(speed, probe);
            let here = means.all.iter().filter(|m| m.speed == speed);
            let all: Vec<Amplitude> = here
                .filter_map(|m| {
                    let (phasor, readings) = m.probes[probe]?;
                    let sigma = request.noise.map_or(1.0, |[relative, floor]| {
                        component_sd(relative, floor, phasor) / level / (readings as f64).sqrt()
                    });
                    let of_run = weights.of(&means.runs[m.run]);
                    let weights = of_run.iter().map(|w| w / largest).collect();
                    Some(Amplitude { weights, size: phasor.norm() / level, sigma })
                })
                .collect();
            if all.len() > 2 * count {
                let found = of_row(&all, count).ok_or_else(too_few)?;
                fits.push(RowFit { probe, speed_rpm: *speed_rpm, level, all, found });
            }
        }
    }
    if fits.is_empty() {
        return Err(too_few());
    }
    let freedom: usize = fits.iter().map(|f| f.all.len() - 1 - 2 * count).sum();
    let chi2: f64 = fits.iter().map(|f| f.found[0].1).sum();
    let (scale, basis) = match (request.noise, freedom) {
        (Some(_), _) => (1.0, Basis::Stated),
        (None, 0) => (0.0, Basis::Unknown),
        (None, freedom) => ((chi2 / freedom as f64).sqrt(), Basis::Runs(freedom)),
    };
    for fit in &fits {
        fit.check_alone(&series.probes[fit.probe], largest, weights)?;
    }
    let mut told: Vec<String> = doubts::of_basis(basis).into_iter().collect();
    told.push(
        "Phases were not measured: angles count from the mark and in the direction that those of the trial weights count in.".into(),
    );
    told.extend(fits.iter().filter_map(|f| f.second(&series.probes[f.probe], largest, weights)));
    told.extend(fits.iter().filter_map(|f| f.closed_form(largest, weights)));
    Ok(MachineInfluence {
        coefficients: fits.iter().map(|f| f.coefficients(scale, largest)).collect(),
        probes: series.probes.clone(),
        planes: weights.planes.clone(),
        sets: None,
        scatter: if request.noise.is_some() { 0.0 } else { scale },
        unit: series.unit.clone(),
        weight_unit: weights.unit,
        basis,
        doubts: told,
    })
}

fn too_few() -> Error {
    Error::Unsuitable(
        "amplitudes without phase need the run without weights and three runs with a trial weight in each plane, at angles such as \
         0, 120 and 240°"
            .into(),
    )
}

/// Minima of one probe at one speed.
struct RowFit {
    probe: usize,
    speed_rpm: f64,
    level: f64,
    all: Vec<Amplitude>,
    found: Vec<Minimum>,
}

impl RowFit {
    /// Root mean square of what the amplitudes miss a minimum by, relative to the level.
    fn misfit(&self, at: &Minimum) -> f64 {
        let mut there = Amplitudes { all: &self.all, x: at.0.clone() };
        there.move_to(&at.0);
        let squares: f64 = self.all.iter().map(|run| (there.phasor(run).norm() - run.size).powi(2)).sum();
        (squares / self.all.len() as f64).sqrt()
    }

    /// Weight of the only plane that leaves nothing at a minimum, in the unit of the file; none where there are several planes.
    fn weight(&self, at: &Minimum, largest: f64, weights: &Weights) -> Option<C> {
        let x = &at.0;
        (x.len() == 3).then(|| -C::from(x[0]) / C::new(x[1], x[2]) * largest / weights.unit.scale())
    }

    /// Refuses amplitudes that two weights fit alike.
    fn check_alone(&self, probe: &str, largest: f64, weights: &Weights) -> Result<(), Error> {
        let [first, second, ..] = &self.found[..] else { return Ok(()) };
        if self.misfit(second) > self.misfit(first).max(EXACT) {
            return Ok(());
        }
        let which = match self.weight(first, largest, weights).zip(self.weight(second, largest, weights)) {
            Some((one, other)) => format!(
                ", {:.4} {unit} {:.0}° apart from {:.4} {unit}",
                one.norm(),
                (one / other).arg().to_degrees().abs(),
                other.norm(),
                unit = weights.unit.symbol
            ),
            None => String::new(),
        };
        Err(Error::Unsuitable(format!(
            "two different weights fit the amplitudes of {probe} alike{which}; one more run with the trial weight at another angle would \
             tell"
        )))
    }

    /// The next minimum, that the amplitudes fit less well.
    fn second(&self, probe: &str, largest: f64, weights: &Weights) -> Option<String> {
        let [first, second, ..] = &self.found[..] else { return None };
        let [one, other] = [first, second].map(|m| 100.0 * self.misfit(m));
        let apart = self.weight(first, largest, weights).zip(self.weight(second, largest, weights));
        let which = apart.map_or(String::new(), |(one, other)| {
            format!(
                " ({:.4} {} {:.0}° away)",
                other.norm(),
                weights.unit.symbol,
                (one / other).arg().to_degrees().abs()
            )
        });
        Some(format!(
            "A second solution{which} misses the amplitudes of {probe} by {other:.2} % instead of {one:.2} %; a run with these weights shows \
             which is right."
        ))
    }

    /// Where three equal trial weights sit at thirds of a turn, what the closed form of the four-run method gives.
    fn closed_form(&self, largest: f64, weights: &Weights) -> Option<String> {
        let (without, with): (Vec<&Amplitude>, Vec<&Amplitude>) =
            self.all.iter().partition(|run| run.weights.iter().all(|w| w.norm() == 0.0));
        let ([without], [a, b, c], 3) = (&without[..], &with[..], self.found[0].0.len()) else { return None };
        let size = a.weights[0].norm();
        let is_even = [a, b, c].map(|run| run.weights[0]).iter().sum::<C>().norm() < 1e-6 * size
            && [b, c].iter().all(|run| (run.weights[0].norm() / size - 1.0).abs() < 1e-6);
        let squares = [a, b, c].map(|run| run.size.powi(2)).iter().sum::<f64>() / 3.0;
        let effect = (squares - without.size.powi(2)).max(0.0).sqrt();
        let ratio = without.size / effect;
        let found = self.weight(&self.found[0], largest, weights)?.norm();
        let closed = ratio * size * largest / weights.unit.scale();
        (is_even && ratio.is_finite() && (closed / found - 1.0).abs() > 0.01).then(|| {
            format!(
                "The closed form of the four-run method gives {ratio:.2} times the trial weight ({closed:.0} {}). The weight above is the \
                 least-squares one, {:.2} times: the four amplitudes contradict each other by {:.1} %, and the closed form trusts the \
                 small difference of their squares.",
                weights.unit.symbol,
                found * weights.unit.scale() / (size * largest),
                100.0 * self.misfit(&self.found[0])
            )
        })
    }

    /// Coefficients at the lowest minimum; `scale` is the noise over the stated one, 0 where it is not known.
    fn coefficients(&self, scale: f64, largest: f64) -> InfluenceCoefficients {
        let x = &self.found[0].0;
        let mut at = Amplitudes { all: &self.all, x: x.clone() };
        let size = x.len().div_ceil(2);
        let covariance = at
            .normal_equations()
            .and_then(|(gram, _)| gram.try_inverse())
            .unwrap_or_else(|| DMatrix::from_diagonal_element(x.len(), x.len(), f64::INFINITY));
        let unit = |i: usize| if i == 0 { self.level } else { self.level / largest };
        // components of each complex number among the unknowns
        let parts = |i: usize| match i {
            0 => vec![(0, C::from(1.0))],
            i => vec![(2 * i - 1, C::from(1.0)), (2 * i, C::i())],
        };
        let per_component = |i: usize, j: usize| {
            let row = |(a, of_a): (usize, C)| {
                parts(j).into_iter().map(|(b, of_b)| of_a * of_b.conj() * covariance[(a, b)]).sum::<C>()
            };
            parts(i).into_iter().map(row).sum::<C>() * 0.5
        };
        let covariance = match scale > 0.0 {
            true => {
                DMatrix::from_fn(size, size, |i, j| per_component(i, j) * (scale * scale * unit(i) * unit(j)))
            }
            false => DMatrix::zeros(size, size),
        };
        InfluenceCoefficients {
            probe: self.probe,
            speed_rpm: self.speed_rpm,
            before: C::from(x[0] * self.level),
            per_weight: (1..size).map(|j| C::new(x[2 * j - 1], x[2 * j]) * unit(j)).collect(),
            covariance,
        }
    }
}

#[cfg(test)]
mod tests;

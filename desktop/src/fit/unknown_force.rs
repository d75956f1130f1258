//! An unknown force on the shaft: at one place, turning forward and backward, free in size and phase over speed but
//! smooth.
//!
//! Whatever a model lacks acts on the shaft as a force: the equivalent load of Markert, Platz and Seidler (Shock and
//! Vibration 2001, 8, 379) and of Bachschmid, Pennacchi and Vania (J. Sound Vib. 2002, 254, 327), found by least squares
//! in the frequency domain. Here it has a Gaussian prior: a piecewise linear function of speed whose values at the
//! knots are independent, of one unknown size. So it is allowed for like errors of the drawing are, its size is
//! the one that explains the data best, and what it costs to be so free is part of its evidence.

use nalgebra::{Complex, DMatrix};
use rayon::prelude::*;

use super::error_slopes::Snapshot;
use super::hypothesis::Hypothesis;
use super::problem::Problem;
use super::search::UnitForces;
use super::{Drawing, Effort, Fit, Fitter, singular};
use crate::error::Error;
use crate::inference::scatter::Scatter;
use crate::machine::place::SpeedLaw;
use crate::shaft::nodal::Row;

type C = Complex<f64>;

/// Knots over the range of speeds at most: narrower than that is the resonance of a lightly damped rotor alone.
const MOST_KNOTS: usize = 12;
/// Operating points for each knot at least, or the force could follow every single one.
const POINTS_A_KNOT: usize = 3;
/// Rounds over size, noise and fit.
const ROUNDS: usize = 5;
/// Rounds over size and noise alone.
const SCREENING_ROUNDS: usize = 6;

/// What is assumed of an unknown force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assumption {
    /// Where it acts, m from the left end.
    pub position_m: f64,
    /// How its size would grow with speed if it were simple.
    pub law: SpeedLaw,
}

/// An unknown force found beside a hypothesis.
#[derive(Debug, Clone)]
pub struct UnknownForce {
    /// What was assumed.
    pub assumption: Assumption,
    /// The hypothesis fitted anew beside it; its cost includes the force's freedom.
    pub fit: Fit,
    /// The noise that is left.
    pub scatter: Scatter,
    /// Speed at each knot, rad/s.
    pub knots_rad_s: Vec<f64>,
    /// Force at each knot, N: forward, backward.
    pub force_n: Vec<[C; 2]>,
}

/// Piecewise linear functions of speed that are one at their knot.
struct Knots(Vec<f64>);

impl Knots {
    fn over(speeds_rad_s: &[f64]) -> Self {
        let mut points = speeds_rad_s.to_vec();
        points.sort_by(f64::total_cmp);
        points.dedup_by(|a, b| (*a / *b - 1.0).abs() < 0.01);
        let count = (points.len() / POINTS_A_KNOT).clamp(1, MOST_KNOTS);
        let (first, last) = (points[0], points[points.len() - 1]);
        let at = |k: usize| first + (last - first) * (k as f64 + 0.5) / count as f64;
        Self((0..count).map(at).collect())
    }

    /// Value of each function at a speed; flat beyond the first and last knot.
    fn at(&self, speed_rad_s: f64) -> Vec<f64> {
        let knots = &self.0;
        let mut values = vec![0.0; knots.len()];
        let after = knots.partition_point(|k| *k <= speed_rad_s);
        if after == 0 || after == knots.len() {
            values[after.saturating_sub(1).min(knots.len() - 1)] = 1.0;
        } else {
            let share = (speed_rad_s - knots[after - 1]) / (knots[after] - knots[after - 1]);
            (values[after - 1], values[after]) = (1.0 - share, share);
        }
        values
    }
}

impl<const D: usize> UnitForces for Problem<'_, D> {
    fn under_unit_forces(&self, places: &[&Row]) -> Option<Vec<Vec<[C; 2]>>> {
        let now = self.evaluated()?;
        let mut seen = Vec::with_capacity(self.data.count());
        for (r, row) in self.data.rows.iter().enumerate() {
            let snapshot = Snapshot::new(self, now, r);
            seen.extend(row.values.iter().map(|v| {
                let gain = now.terms.gains[v.probe] / v.sigma_m;
                places
                    .iter()
                    .map(|at| snapshot.under_force(at, now.terms.shows[v.probe]).map(|y| y * gain))
                    .collect()
            }));
        }
        Some(seen)
    }
}

impl Fitter<'_> {
    /// Every assumption that is made: at each bearing, disk and end of the shaft, constant or growing with the
    /// square of speed.
    pub fn unknown_forces(&self) -> Vec<Assumption> {
        let rotor = self.rotor;
        let mut places: Vec<f64> = rotor.bearing.iter().map(|b| b.position_m).collect();
        places.extend(rotor.disk.iter().map(|d| d.position_m));
        places.extend([0.0, rotor.length_m()]);
        places.sort_by(f64::total_cmp);
        places.dedup_by(|a, b| (*a - *b).abs() < 1e-3 * rotor.length_m());
        let with = |law: SpeedLaw| places.iter().map(move |z| Assumption { position_m: *z, law });
        with(SpeedLaw::Constant).chain(with(SpeedLaw::Squared)).collect()
    }

    /// What a hypothesis with each of these unknown forces beside it would cost, bearings and effects as a fit has
    /// them.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn screened(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        assumptions: &[Assumption],
    ) -> Result<Vec<f64>, Error> {
        let columns = self.columns(hypothesis, fit, drawing, assumptions)?;
        let plant = self.plant_of(drawing, &hypothesis.terms(&fit.x).physics)?;
        let cost = |columns: &DMatrix<f64>| {
            let mut size = first_size(fit, columns);
            let mut noise = drawing.whitening.scattered(Scatter::STATED);
            let mut least = f64::INFINITY;
            for round in 0..SCREENING_ROUNDS {
                let with = noise.with(&(columns * size));
                let mut problem = self.problem(hypothesis, plant.clone(), Some(&fit.amplitudes), &with)?;
                problem.go_to(&fit.x);
                let left = &problem.solved().ok_or_else(singular)?.left;
                least = least.min(problem.cost() + with.cost());
                size *= with.growth(left, columns.ncols());
                // the force first, or the noise takes all
                if round > SCREENING_ROUNDS / 2 {
                    noise = noise.scattered(with.most_probable_scatter(left, fit.unknown_count()).0);
                }
            }
            Ok(least)
        };
        columns.par_iter().map(cost).collect()
    }

    /// Fits a hypothesis with an unknown force beside it.
    ///
    /// # Errors
    /// If the machine is singular at the fit.
    pub fn with_unknown_force(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        assumption: Assumption,
    ) -> Result<UnknownForce, Error> {
        let knots = self.knots();
        let mut fit = fit.clone();
        let mut noise = drawing.whitening.scattered(Scatter::STATED);
        let mut size: Option<f64> = None;
        let mut best: Option<UnknownForce> = None;
        for round in 0..ROUNDS {
            let columns = self.columns(hypothesis, &fit, drawing, &[assumption])?.swap_remove(0);
            let (count, now) = (columns.ncols(), size.unwrap_or_else(|| first_size(&fit, &columns)));
            let with = drawing.under(noise.with(&(columns * now)));
            fit = self.fit(hypothesis, &[fit.x.clone()], &with, Effort::Search, Some(&fit.amplitudes))?;
            if best.as_ref().is_none_or(|b| fit.cost < b.fit.cost) {
                let deviations = with.whitening.estimate(&fit.weighted);
                let force = deviations.rows(deviations.len() - count, count) * now;
                let at = |(f, w): (&[f64], &f64)| {
                    let growth = self.growth(assumption.law, *w);
                    [C::new(f[0], f[1]) * growth, C::new(f[2], f[3]) * growth]
                };
                best = Some(UnknownForce {
                    assumption,
                    fit: fit.clone(),
                    scatter: with.scatter(),
                    knots_rad_s: knots.0.clone(),
                    force_n: force.as_slice().chunks(4).zip(&knots.0).map(at).collect(),
                });
            }
            size = Some(now * with.whitening.growth(&fit.weighted, count));
            if round > 0 {
                let found = with.whitening.most_probable_scatter(&fit.weighted, fit.unknown_count()).0;
                noise = noise.scattered(found);
            }
        }
        best.ok_or_else(singular)
    }

    fn knots(&self) -> Knots {
        Knots::over(&self.data.rows.iter().map(|r| r.speed_rad_s).collect::<Vec<_>>())
    }

    /// Factor on a force of its law at a speed; one at the fastest.
    fn growth(&self, law: SpeedLaw, speed_rad_s: f64) -> f64 {
        law.factor(speed_rad_s) / law.factor(self.data.fastest_rad_s())
    }

    /// Response at every value, in noise units, per newton at each knot: of each assumption, real and imaginary part of
    /// the forward and of the backward force for each knot in turn.
    fn columns(
        &self,
        hypothesis: &Hypothesis,
        fit: &Fit,
        drawing: &Drawing,
        assumptions: &[Assumption],
    ) -> Result<Vec<DMatrix<f64>>, Error> {
        let shaft = self.shaft(&hypothesis.terms(&fit.x).physics);
        let places: Vec<&Row> =
            assumptions.iter().map(|a| &shaft.section(a.position_m).displacement).collect();
        let seen = self.at(hypothesis, fit, drawing)?.under_unit_forces(&places).ok_or_else(singular)?;
        let speeds = self.data.rows.iter().flat_map(|r| r.values.iter().map(|_| r.speed_rad_s));
        let knots = self.knots();
        let mut all = vec![DMatrix::zeros(2 * seen.len(), 4 * knots.0.len()); assumptions.len()];
        for (i, (speed_rad_s, seen)) in speeds.zip(&seen).enumerate() {
            let shares = knots.at(speed_rad_s);
            for (a, columns) in all.iter_mut().enumerate() {
                let growth = self.growth(assumptions[a].law, speed_rad_s);
                for (k, share) in shares.iter().enumerate().filter(|(_, share)| **share != 0.0) {
                    for (sense, y) in seen[a].iter().enumerate() {
                        let (y, j) = (y * (share * growth), 4 * k + 2 * sense);
                        (columns[(2 * i, j)], columns[(2 * i + 1, j)]) = (y.re, y.im);
                        (columns[(2 * i, j + 1)], columns[(2 * i + 1, j + 1)]) = (-y.im, y.re);
                    }
                }
            }
        }
        Ok(all)
    }
}

/// A size at which the force explains about what the fit leaves beyond its noise.
fn first_size(fit: &Fit, columns: &DMatrix<f64>) -> f64 {
    let beyond = (fit.stated_chi2 - fit.values as f64).max(1.0);
    (beyond / columns.norm_squared().max(f64::MIN_POSITIVE)).sqrt()
}

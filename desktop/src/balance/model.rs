//! Weights from the identified model: bearings, effects and own unbalance fitted, then the weights that
//! make the vibration that the model predicts least.

use nalgebra::{Complex, DMatrix, DVector};

use super::optimum::best;
use super::scatter::{drawn, is_free};
use super::{BalancePlan, Balanced, NormalEquations, ReducedChiSquare, SpeedVibration, Squares};
use crate::decomposition::hermitian;
use crate::diagnose::best_fit;
use crate::error::Error;
use crate::grade::{Grade, Rigid};
use crate::machine::drawing::{Plane, Rotor};
use crate::measurement::Reading;
use crate::model::Model;
use crate::model::amplitude::Relaxation;
use crate::reduction::basis;
use crate::reduction::sizes::WEIGHTS;
use crate::unbalance::G_MM;
use crate::units::rpm;

type C = Complex<f64>;

/// Rounds over the amplitude, where supports harden or soften.
const ROUNDS: usize = 40;
/// Change of the weights, relative, that ends them.
const SETTLED: f64 = 1e-9;

/// A machine with its own unbalance, ready for weights.
struct FittedMachine {
    model: Model,
    own_kg_m: DVector<C>,
    /// Number of each correction plane among the model's.
    planes: Vec<usize>,
    speeds_rad_s: Vec<f64>,
}

/// Motion of the probes at one speed under some weights.
struct At {
    motion: DVector<C>,
    /// Per unbalance in each plane of the rotor.
    per_unbalance: DMatrix<C>,
}

impl FittedMachine {
    /// The response of every speed with these weights in the correction planes.
    fn with(&self, weights_kg_m: &[C]) -> Result<Vec<At>, Error> {
        let mut all = self.own_kg_m.clone();
        for (plane, w) in self.planes.iter().zip(weights_kg_m) {
            all[*plane] += w;
        }
        let at = |speed: &f64| {
            let response = self.model.response_under(*speed, &all)?;
            Ok(At { motion: response.at(&all), per_unbalance: response.per_unbalance })
        };
        self.speeds_rad_s.iter().map(at).collect()
    }
}

/// Weights from the model.
///
/// # Errors
/// If the model cannot be fitted, or the planes act alike.
pub fn from_model(rotor: &Rotor, readings: &[Reading], plan: &BalancePlan) -> Result<Balanced, Error> {
    let fit = best_fit(rotor, readings)?;
    let values = 2 * readings.iter().flat_map(|r| &r.probes).flatten().count();
    let [from, to] = plan.range_rpm;
    let mut speeds_rad_s: Vec<f64> =
        readings.iter().filter(|r| (from..=to).contains(&r.speed_rpm)).map(Reading::speed_rad_s).collect();
    speeds_rad_s.sort_by(f64::total_cmp);
    speeds_rad_s.dedup();
    if speeds_rad_s.is_empty() {
        return Err(Error::NoReadingInRange { from_rpm: from, to_rpm: to });
    }
    let machine = FittedMachine {
        model: basis::reduced(&fit.rotor, WEIGHTS),
        own_kg_m: DVector::from_column_slice(&fit.unbalance_kg_m),
        planes: plan.planes.clone(),
        speeds_rad_s,
    };
    let without = machine.with(&vec![C::from(0.0); plan.planes.len()])?;
    let names = plan.names(rotor);
    let (limits, criterion) = (plan.limits_kg_m(&names), plan.wanted.criterion);
    let Solved { wanted, inverse, per_weight, before } = solve(&machine, plan, &names)?;
    let choice = plan.chosen(&names, std::slice::from_ref(&wanted), &per_weight, &before);
    let placed: Vec<C> = choice.sums_g_mm().iter().map(|u| u / G_MM).collect();
    let remarks = choice.doubt().into_iter().collect();
    let left = machine.with(&placed)?;
    let probes = rotor.probe.len();
    let (mut vibration, mut all): (Vec<SpeedVibration>, Squares) = Default::default();
    for (speed, (before, after)) in machine.speeds_rad_s.iter().zip(without.iter().zip(&left)) {
        let mut here = Squares::default();
        let unknown = spread(&after.per_unbalance, &fit.unbalance_covariance);
        here.add([before.motion.norm_squared(), after.motion.norm_squared(), unknown], probes);
        vibration.push(here.at_speed(rpm(*speed)));
        all.add(here.m2, here.count);
    }
    // what is not known of the own unbalance, as the correction planes have to follow it
    let own = stacked(&left, |at| at.per_unbalance.clone());
    let sd_kg_m = match is_free(criterion, &wanted, &limits) {
        true => {
            let follow = &inverse * per_weight.adjoint() * own;
            let sd = |j| (0.5 * spread(&follow.rows(j, 1).into_owned(), &fit.unbalance_covariance)).sqrt();
            (0..plan.planes.len()).map(sd).collect()
        }
        false => {
            let root = root(&fit.unbalance_covariance);
            drawn(&wanted, |normal| {
                let unit: Vec<C> = (0..own.ncols()).map(|_| normal()).collect();
                let off =
                    &root * DVector::from_iterator(2 * unit.len(), unit.iter().flat_map(|u| [u.re, u.im]));
                let off = DVector::from_fn(unit.len(), |j, _| C::new(off[2 * j], off[2 * j + 1]));
                let moved = &before + &own * off;
                best(criterion, &NormalEquations::of(&per_weight, &moved), (&per_weight, &moved), &limits)
            })?
        }
    };
    Ok(Balanced {
        grade: grades(&fit.rotor, plan, &machine, &placed, &sd_kg_m),
        wanted_kg_m: wanted,
        sd_kg_m,
        placed: choice.fillings,
        vibration,
        overall: all.overall(),
        misfit: Some(ReducedChiSquare { chi2_per_value: fit.chi2_per_value, freedom: values }),
        remarks,
    })
}

/// Weights, and the linear equations that they solve.
struct Solved {
    wanted: Vec<C>,
    /// Inverse of the normal matrix.
    inverse: DMatrix<C>,
    /// Influence of the correction planes.
    per_weight: DMatrix<C>,
    /// The machine without weights, its supports as they are with them.
    before: DVector<C>,
}

fn solve(machine: &FittedMachine, plan: &BalancePlan, names: &[&str]) -> Result<Solved, Error> {
    let limits = plan.limits_kg_m(names);
    let mut weights = vec![C::from(0.0); machine.planes.len()];
    let mut relaxation = Relaxation::steady(1.0);
    let mut round = 0;
    loop {
        let there = machine.with(&weights)?;
        let per_weight = stacked(&there, |at| at.per_unbalance.select_columns(&machine.planes));
        let motion =
            stacked(&there, |at| DMatrix::from_column_slice(at.motion.len(), 1, at.motion.as_slice()));
        let before = motion.column(0) - &per_weight * DVector::from_column_slice(&weights);
        let equations = NormalEquations::of(&per_weight, &before);
        let inverse = equations.inverse(names)?;
        let next = best(plan.wanted.criterion, &equations, (&per_weight, &before), &limits)?;
        let held = weights.iter_mut().flat_map(|w| [&mut w.re, &mut w.im]);
        let change = relaxation.step(held, next.iter().flat_map(|w| [w.re, w.im]));
        round += 1;
        if change <= SETTLED || round == ROUNDS {
            return Ok(Solved { wanted: weights, inverse, per_weight, before });
        }
    }
}

/// One matrix a speed, one below the other.
fn stacked(all: &[At], of: impl Fn(&At) -> DMatrix<C>) -> DMatrix<C> {
    let parts: Vec<DMatrix<C>> = all.iter().map(of).collect();
    let rows = parts.iter().map(DMatrix::nrows).sum();
    let mut whole = DMatrix::zeros(rows, parts.first().map_or(0, DMatrix::ncols));
    let mut at = 0;
    for part in &parts {
        whole.rows_mut(at, part.nrows()).copy_from(part);
        at += part.nrows();
    }
    whole
}

/// A root of a covariance, which may lack a rank.
fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = hermitian(covariance.clone());
    eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt()))
}

/// Sum over rows of the variance of `map · U`, with the covariance of real and imaginary parts of U.
fn spread(map: &DMatrix<C>, covariance: &DMatrix<f64>) -> f64 {
    let real = DMatrix::from_fn(2 * map.nrows(), 2 * map.ncols(), |i, j| {
        let v = map[(i / 2, j / 2)];
        match (i % 2, j % 2) {
            (0, 0) | (1, 1) => v.re,
            (0, _) => -v.im,
            _ => v.im,
        }
    });
    (&real * covariance * real.transpose()).trace().max(0.0)
}

fn grades(
    rotor: &Rotor,
    plan: &BalancePlan,
    machine: &FittedMachine,
    placed: &[C],
    sd_kg_m: &[f64],
) -> Grade {
    let rigid = Rigid::of(rotor);
    let own: Vec<(f64, C)> =
        rotor.plane.iter().map(|p: &Plane| p.position_m).zip(machine.own_kg_m.iter().copied()).collect();
    let added = plan.positions_m(rotor).into_iter().zip(placed.iter().copied());
    let after: Vec<(f64, C)> = own.iter().copied().chain(added).collect();
    let after_mm_s = rigid.grade_mm_s(&after, plan.service_rpm);
    let deviations: Vec<(f64, f64)> =
        plan.positions_m(rotor).into_iter().zip(sd_kg_m.iter().copied()).collect();
    Grade {
        before_mm_s: rigid.grade_mm_s(&own, plan.service_rpm),
        after_mm_s,
        after_at_most_mm_s: after_mm_s + rigid.hidden_mm_s(&deviations, plan.service_rpm),
    }
}

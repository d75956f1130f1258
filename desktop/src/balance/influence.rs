//! Influence coefficients: what a unit of unbalance in a plane does at a probe and speed, from trial runs.
//!
//! At each speed the runs are `Y = Y₀ + Σ A U`, U the trial weights: least squares for Y₀, the machine
//! without any, and A. Nothing of the machine needs to be known but that it is linear; where there are more
//! runs than coefficients, χ² says whether it is.

use nalgebra::{Complex, DMatrix, DVector};

use super::grade::{Grade, Rigid};
use super::{AtSpeed, Balanced, LeastVibration, Misfit, NormalEquations, Plan, Squares};
use crate::error::Error;
use crate::identify::assumed_noise;
use crate::machine::drawing::Rotor;
use crate::measurement::{Reading, rpm};
use crate::unbalance::phasor_kg_m;

type C = Complex<f64>;

/// Speeds closer than this, relative, are one.
const SAME_SPEED: f64 = 0.005;
/// Positions closer than this are one plane, m.
const SAME_PLANE_M: f64 = 1e-6;
/// Trial weights, scaled to one, that span less than this do not tell planes apart.
const INDEPENDENT: f64 = 1e-3;

/// Coefficients of one probe at one speed.
struct Coefficients {
    speed_rpm: f64,
    /// The machine without weights, m.
    before: C,
    /// Per unbalance in each correction plane, m per kg·m.
    per_weight: Vec<C>,
    /// Covariance of both per component.
    covariance: DMatrix<C>,
}

/// Trial runs as equations.
struct Trials {
    /// Where trial weights sat, m: the correction planes first.
    positions_m: Vec<f64>,
    /// Weights of each reading by position, kg·m.
    weights: Vec<Vec<C>>,
}

impl Trials {
    fn of(rotor: &Rotor, readings: &[Reading], plan: &Plan) -> Result<Self, Error> {
        let added = |r: &Reading| {
            let run = rotor.run.iter().find(|run| Some(&run.name) == r.run.as_ref());
            run.map_or(&[][..], |run| &run.added_unbalance)
        };
        let mut positions_m = plan.positions_m(rotor);
        for a in readings.iter().flat_map(added) {
            if !positions_m.iter().any(|z| (z - a.position_m).abs() < SAME_PLANE_M) {
                positions_m.push(a.position_m);
            }
        }
        let at = |r: &Reading, z: f64| {
            let here = added(r).iter().filter(|a| (a.position_m - z).abs() < SAME_PLANE_M);
            here.map(|a| phasor_kg_m(a.magnitude_g_mm, a.angle_deg)).sum::<C>()
        };
        let weights: Vec<Vec<C>> =
            readings.iter().map(|r| positions_m.iter().map(|z| at(r, *z)).collect()).collect();
        for (k, plane) in plan.planes.iter().enumerate() {
            if weights.iter().all(|w| w[k] == C::from(0.0)) {
                return Err(Error::Unsuitable(format!(
                    "no run has a trial weight in plane \"{}\", so its influence is not known; add a [[run]] with one",
                    rotor.plane[*plane].name
                )));
            }
        }
        Ok(Self { positions_m, weights })
    }

    fn unknowns(&self) -> usize {
        1 + self.positions_m.len()
    }

    /// Largest trial weight, to scale the equations with.
    fn largest_kg_m(&self) -> f64 {
        self.weights.iter().flatten().map(|w| w.norm()).fold(f64::MIN_POSITIVE, f64::max)
    }
}

/// Weights from trial runs alone.
///
/// # Errors
/// One sentence if the trial runs do not hold the coefficients of the chosen planes.
pub fn from_trial_runs(rotor: &Rotor, readings: &[Reading], plan: &Plan) -> Result<Balanced, Error> {
    let trials = Trials::of(rotor, readings, plan)?;
    let (coefficients, misfit) = coefficients(rotor, readings, plan, &trials)?;
    let planes = plan.planes.len();
    let per_weight = DMatrix::from_fn(coefficients.len(), planes, |i, j| coefficients[i].per_weight[j]);
    let before = DVector::from_iterator(coefficients.len(), coefficients.iter().map(|c| c.before));
    let mut equations = NormalEquations::of(&per_weight, &before);
    // squares of measured coefficients are too large by their variance, which would make the weights too small
    for c in &coefficients {
        let excess = |j: usize, k: usize| 2.0 * c.covariance[(k, j + 1)];
        for j in 0..planes {
            equations.right[j] -= excess(j, 0);
            (0..planes).for_each(|k| equations.matrix[(j, k)] -= excess(j, k + 1));
        }
    }
    let LeastVibration { weights_kg_m: wanted, inverse } = equations.solve()?;
    let weights = plan.weights(wanted.as_slice());
    let variance = |c: &Coefficients, w: &dyn Fn(usize) -> C| {
        let v = DVector::from_fn(c.covariance.nrows(), |i, _| match i {
            0 => C::from(1.0),
            i if i <= planes => w(i - 1),
            _ => C::from(0.0),
        });
        (v.transpose() * &c.covariance * v.conjugate())[(0, 0)].re.max(0.0)
    };
    // how what is not known of the machine moves the weights that are best for it
    let spread = DMatrix::from_fn(coefficients.len(), planes, |i, j| {
        per_weight[(i, j)] * variance(&coefficients[i], &|k| wanted[k]).sqrt()
    });
    let moved = &inverse * (spread.adjoint() * &spread) * &inverse;
    let sd_kg_m: Vec<f64> = (0..planes).map(|j| moved[(j, j)].re.max(0.0).sqrt()).collect();
    let (mut vibration, mut all): (Vec<AtSpeed>, Squares) = Default::default();
    for at_speed in coefficients.chunk_by(|a, b| a.speed_rpm == b.speed_rpm) {
        let mut here = Squares::default();
        for c in at_speed {
            let placed = |k: usize| weights[k].unbalance_kg_m;
            let after = (0..planes).fold(c.before, |sum, k| sum + c.per_weight[k] * placed(k));
            let noise = [variance(c, &|_| C::from(0.0)), variance(c, &placed)].map(|v| 2.0 * v);
            here.add([c.before.norm_sqr() - noise[0], after.norm_sqr() - noise[1], noise[1]], 1);
        }
        vibration.push(here.at_speed(at_speed[0].speed_rpm));
        all.add(here.m2, here.count);
    }
    let rigid = Rigid::of(rotor);
    let positions = plan.positions_m(rotor);
    let with = |u: Vec<C>| positions.iter().copied().zip(u).collect::<Vec<_>>();
    let left = weights.iter().zip(wanted.iter()).map(|(w, u)| w.unbalance_kg_m - u).collect();
    let after_mm_s = rigid.grade_mm_s(&with(left), plan.service_rpm);
    let deviations: Vec<(f64, f64)> = positions.iter().copied().zip(sd_kg_m.iter().copied()).collect();
    let grade = Grade {
        before_mm_s: rigid.grade_mm_s(&with(wanted.iter().map(|u| -u).collect()), plan.service_rpm),
        after_mm_s,
        after_at_most_mm_s: after_mm_s + rigid.hidden_mm_s(&deviations, plan.service_rpm),
    };
    Ok(Balanced {
        wanted_kg_m: wanted.iter().copied().collect(),
        sd_kg_m,
        weights,
        vibration,
        overall: all.overall(),
        grade,
        misfit,
    })
}

/// Coefficients of every probe at every speed that enough runs share, by speed; and the misfit
/// of what the coefficients do not need.
fn coefficients(
    rotor: &Rotor,
    readings: &[Reading],
    plan: &Plan,
    trials: &Trials,
) -> Result<(Vec<Coefficients>, Option<Misfit>), Error> {
    let noise = rotor.noise.unwrap_or_else(|| assumed_noise(readings));
    let [from, to] = plan.range_rpm;
    let mut order: Vec<usize> =
        (0..readings.len()).filter(|r| (from..=to).contains(&readings[*r].speed_rpm)).collect();
    order.sort_by(|a, b| readings[*a].speed_rpm.total_cmp(&readings[*b].speed_rpm));
    let scale = trials.largest_kg_m();
    let unknowns = trials.unknowns();
    let (mut all, mut chi2, mut freedom) = (Vec::new(), 0.0, 0);
    let mut rest = order.as_slice();
    while let Some(first) = rest.first() {
        let speed_rad_s = readings[*first].speed_rad_s();
        let same = |r: &&usize| readings[**r].speed_rad_s() <= speed_rad_s * (1.0 + SAME_SPEED);
        let (group, others) = rest.split_at(rest.iter().take_while(same).count());
        rest = others;
        for probe in 0..rotor.probe.len() {
            let rows: Vec<(usize, C)> =
                group.iter().filter_map(|r| Some((*r, readings[*r].probes[probe]?))).collect();
            if rows.len() < unknowns {
                continue;
            }
            let sigma = |y: &C| noise.relative * y.norm() + noise.floor_um * 1e-6;
            let equations = DMatrix::from_fn(rows.len(), unknowns, |i, j| {
                let (row, y) = &rows[i];
                let column = if j == 0 { C::from(1.0) } else { trials.weights[*row][j - 1] / scale };
                column / sigma(y)
            });
            let measured = DVector::from_iterator(rows.len(), rows.iter().map(|(_, y)| y / sigma(y)));
            let plain = DMatrix::from_fn(rows.len(), unknowns, |i, j| equations[(i, j)] * sigma(&rows[i].1));
            if plain.svd(false, false).singular_values.min() < INDEPENDENT {
                continue;
            }
            let Some(covariance) = (equations.adjoint() * &equations).try_inverse() else { continue };
            let solution = &covariance * equations.adjoint() * &measured;
            chi2 += (&measured - &equations * &solution).norm_squared();
            freedom += 2 * (rows.len() - unknowns);
            let size = |j: usize| if j == 0 { 1.0 } else { scale };
            all.push(Coefficients {
                speed_rpm: rpm(speed_rad_s),
                before: solution[0],
                per_weight: (0..plan.planes.len()).map(|k| solution[k + 1] / scale).collect(),
                covariance: DMatrix::from_fn(unknowns, unknowns, |i, j| {
                    covariance[(i, j)] / (size(i) * size(j))
                }),
            });
        }
    }
    if all.is_empty() {
        return Err(Error::Unsuitable(format!(
            "no speed between {from:.0} and {to:.0} rpm was measured in {unknowns} runs with independent trial weights, \
             which {} plane{} need; run all of them over the same speeds",
            trials.positions_m.len(),
            if trials.positions_m.len() == 1 { "" } else { "s" }
        )));
    }
    let misfit = || Misfit { chi2_per_value: chi2 / freedom as f64, freedom };
    Ok((all, (freedom > 0).then(misfit)))
}

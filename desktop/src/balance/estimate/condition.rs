//! Condition of the influence of the planes, and measurements that would improve it.
//!
//! Planes that act alike have an influence matrix of large condition: scatter comes through that many times as large in
//! what tells them apart as in what they have in common.

use nalgebra::{Complex, DMatrix};

use super::learning::{LearnedInfluence, MountingComponents};
use super::mounting::Mountings;
use super::prior::MachinePrior;
use crate::balance::influence::regression::factor;
use crate::decomposition::hermitian;
use crate::error::Error;
use crate::machine::drawing::Rotor;
use crate::unbalance::separation::PlaneSeparation;
use crate::units::{rad_s, rpm};

type C = Complex<f64>;

/// Deviation in the worst direction, relative to the largest stated weight, from which on planes are poorly determined: 95 % reach
/// half of that weight, and no balancer would use the answer.
const POOR: f64 = 0.25;
/// A measurement that makes the condition this many times smaller is worth its while.
const WORTH: f64 = 1.3;
/// Range of speeds tried for advice, relative to the fastest measured speed, where the file has no rated speed.
const TRIED: [f64; 2] = [0.5, 1.25];
/// Number of speeds tried for advice.
const SPEEDS: usize = 16;

/// Condition number of the influence matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedCondition {
    /// At this speed, rpm; `None` for all together.
    pub speed_rpm: Option<f64>,
    /// Largest over smallest singular value.
    pub condition: f64,
    /// The same in units of the scatter between mountings.
    pub whitened: f64,
}

/// Whether the planes are determined.
#[derive(Debug, Clone, PartialEq)]
pub struct ConditionReport {
    /// By speed, then of all together.
    pub conditions: Vec<SpeedCondition>,
    /// Standard deviation in the direction that is known worst, for a run with the largest stated weight in each plane, g·mm.
    pub worst_sd_g_mm: f64,
    /// Whether the planes are poorly determined.
    pub poorly: bool,
    /// The reason and the remedies, one sentence each.
    pub words: Vec<String>,
}

impl ConditionReport {
    /// From the learned influence, for a run in this session.
    ///
    /// # Errors
    /// If a covariance is singular.
    pub fn of(
        rotor: &Rotor,
        machine: &MachinePrior,
        mountings: &Mountings,
        learned: &LearnedInfluence,
        largest_g_mm: f64,
        session: Option<usize>,
    ) -> Result<Self, Error> {
        let (rows, probes, planes) = (mountings.rows(), mountings.probes, rotor.plane.len());
        let mut conditions = Vec::new();
        for (s, speed) in mountings.speeds_rad_s.iter().enumerate() {
            conditions.push(condition(learned, s * probes..(s + 1) * probes, Some(rpm(*speed)))?);
        }
        conditions.push(condition(learned, 0..rows, None)?);
        let WorstDirection { sd_g_mm, by_influence } =
            worst(learned, &MountingComponents::complete(rows, session), planes, largest_g_mm)?;
        let separation = PlaneSeparation::of_influence(learned.influence());
        let (all, alike) = (separation.condition, separation.acts_alike());
        let poorly = alike || sd_g_mm > POOR * largest_g_mm;
        let mut words = Vec::new();
        if poorly {
            let why = if alike { "they act nearly alike on the probes" } else { "the runs say too little" };
            words.push(format!(
                "The planes are poorly determined: {why} (condition {all:.0}), and in the worst direction the unbalance is \
                 known to ±{:.1} g·mm (95 %) beside weights of {largest_g_mm:.0} g·mm.",
                2.0 * sd_g_mm
            ));
            words.extend(another_speed(rotor, machine, mountings, learned)?);
            words.push(if by_influence > 0.5 {
                "Most of it is that the influence is not known well: runs with heavier trial weights, one plane at a time and \
                 both planes in opposite directions, would help."
                    .into()
            } else {
                "Most of it is scatter between mountings: mounting and measuring the same condition again would help.".into()
            });
        }
        Ok(Self { conditions, worst_sd_g_mm: sd_g_mm, poorly, words })
    }
}

fn condition(
    learned: &LearnedInfluence,
    rows: std::ops::Range<usize>,
    speed_rpm: Option<f64>,
) -> Result<SpeedCondition, Error> {
    let influence = learned.influence().rows(rows.start, rows.len()).into_owned();
    let n = learned.rows();
    let here: Vec<usize> = rows.clone().chain(rows.map(|r| n + r)).collect();
    let scatter = factor(learned.scatter.select_rows(&here).select_columns(&here))?;
    let whitened = scatter.l().solve_lower_triangular(&super::scatter::real(&influence));
    let whitened = whitened.map_or(f64::NAN, |w| PlaneSeparation::of_influence(w).condition);
    Ok(SpeedCondition { speed_rpm, condition: PlaneSeparation::of_influence(influence).condition, whitened })
}

/// The direction that is known worst.
struct WorstDirection {
    sd_g_mm: f64,
    /// Share of its variance that comes from the covariance of the influence.
    by_influence: f64,
}

fn worst(
    learned: &LearnedInfluence,
    everything: &MountingComponents,
    planes: usize,
    largest_g_mm: f64,
) -> Result<WorstDirection, Error> {
    let known = learned.predict(everything, &vec![C::from(largest_g_mm); planes], false);
    let noise = factor(known.covariance)?;
    let weighted = noise.solve(&known.per_weight);
    let precision = known.per_weight.tr_mul(&weighted);
    let singular = WorstDirection { sd_g_mm: f64::INFINITY, by_influence: 1.0 };
    let Some(inverse) = precision.try_inverse() else { return Ok(singular) };
    let eigen = hermitian(inverse.clone());
    let at = eigen.eigenvalues.imax();
    let variance = eigen.eigenvalues[at];
    let gain = weighted * inverse * eigen.eigenvectors.column(at);
    let of_scatter = gain.dot(&(&learned.scatter * &gain));
    Ok(WorstDirection { sd_g_mm: variance.max(0.0).sqrt(), by_influence: 1.0 - of_scatter / variance })
}

/// The speed that would tell the planes best by the model, if one is worth its while.
fn another_speed(
    rotor: &Rotor,
    machine: &MachinePrior,
    mountings: &Mountings,
    learned: &LearnedInfluence,
) -> Result<Option<String>, Error> {
    let fastest = mountings.speeds_rad_s.iter().copied().fold(0.0, f64::max);
    let [low, high] = rotor.rated.map_or(TRIED.map(|t| t * fastest), |r| r.speed_rpm.map(rad_s));
    // scatter grows with the response, so that every speed counts by how differently the planes act there
    let relative = |h: DMatrix<C>| {
        let blocks: Vec<DMatrix<C>> = (0..h.nrows() / mountings.probes)
            .map(|s| h.rows(s * mountings.probes, mountings.probes).into_owned())
            .map(|block| &block / C::from(block.norm().max(f64::MIN_POSITIVE)))
            .collect();
        stacked(&blocks)
    };
    let now = relative(machine.influence_at(&learned.parameters, &mountings.speeds_rad_s)?);
    let before = PlaneSeparation::of_influence(now.clone()).condition;
    let mut best: Option<(f64, f64)> = None;
    for i in 0..SPEEDS {
        let speed = low + (high - low) * i as f64 / (SPEEDS - 1) as f64;
        let more = relative(machine.influence_at(&learned.parameters, &[speed])?);
        let after = PlaneSeparation::of_influence(stacked(&[now.clone(), more])).condition;
        if best.is_none_or(|(least, _)| after < least) {
            best = Some((after, speed));
        }
    }
    let worth = |(after, _): &(f64, f64)| before.is_nan() || before > WORTH * after;
    Ok(best.filter(worth).map(|(after, speed)| {
        format!(
            "By the model another speed helps, best {:.0} rpm: the condition falls to {after:.0}.",
            rpm(speed)
        )
    }))
}

fn stacked(blocks: &[DMatrix<C>]) -> DMatrix<C> {
    let rows: Vec<_> = blocks.iter().flat_map(|b| b.row_iter().map(|r| r.into_owned())).collect();
    DMatrix::from_rows(&rows)
}

//! Reasons not to rely on the weights, one sentence each.

use nalgebra::Complex;

use super::{Basis, PlaneWeight, ProbeVibration};
use crate::balance::NormalEquations;
use crate::balance::influence::InfluenceCoefficients;
use crate::balance::influence::trials::{TrialFit, Trials};
use crate::decomposition::hermitian;
use crate::unbalance::separation::PlaneSeparation;

type C = Complex<f64>;

/// Speeds that are taken as one and differ by more than this, relative, are remarked on.
const SAME: f64 = 1e-3;
/// Runs that miss each other by more than this, relative, contradict each other.
pub(super) const CONTRADICT: f64 = 0.1;
/// A trial weight that changes the vibration by less than this, relative, shows little.
const SMALL: f64 = 0.1;
/// Speeds that are named before the rest are counted.
const NAMED: usize = 3;

/// Doubts about the trial runs; `scatter` is their relative residual.
pub(super) fn of_runs(trials: &Trials, fitted: &TrialFit, basis: Basis, scatter: f64) -> Vec<String> {
    let mut doubts: Vec<String> = of_basis(basis).into_iter().collect();
    if !fitted.sense.tells() {
        doubts.push(
            "A phase entered with the wrong sign (lag as lead) cannot be told from these runs; one more run with a trial weight at \
             another angle would tell."
                .into(),
        );
    }
    if scatter > CONTRADICT {
        doubts.push(format!(
            "The runs contradict each other by {:.0} % of the vibration: the machine changed between them, is not linear, or a weight is \
             not what is stated.",
            100.0 * scatter
        ));
    }
    let [slowest, fastest] = fitted.widest_rpm;
    if fastest / slowest > 1.0 + SAME {
        doubts.push(format!(
            "Speeds from {slowest} to {fastest} rpm, {:.2} % apart, are treated as one; near a critical speed the phase differs.",
            100.0 * (fastest / slowest - 1.0)
        ));
    }
    if !fitted.left_out_rpm.is_empty() {
        let left = &fitted.left_out_rpm;
        let named: Vec<String> = left.iter().take(NAMED).map(|s| format!("{s:.0}")).collect();
        let more =
            if left.len() > NAMED { format!(" and {} more", left.len() - NAMED) } else { String::new() };
        doubts
            .push(format!("Left out, as too few runs were measured there: {}{more} rpm.", named.join(", ")));
    }
    let used = |run: usize| trials.readings.iter().filter(move |t| t.run == run);
    let runs = trials.readings.iter().map(|t| t.run).max().map_or(0, |last| last + 1);
    let without = |run: usize| {
        used(run).next().is_some() && used(run).all(|t| t.weights.iter().all(|w| w.norm() == 0.0))
    };
    if !(0..runs).any(without) {
        doubts
            .push("No run is without weights, so the machine without any is computed, not measured.".into());
    }
    doubts.extend(small(trials, fitted));
    doubts
}

/// Doubts that follow from the source of the noise.
pub(super) fn of_basis(basis: Basis) -> Option<String> {
    match basis {
        Basis::Unknown => Some(
            "No repeats and no stated noise: how far off the weights and the vibration left may be cannot be told."
                .into(),
        ),
        Basis::Readings(_) => Some(
            "The noise is known from readings within runs alone; what runs differ by from one to the next is not in the intervals."
                .into(),
        ),
        Basis::Stated | Basis::Runs(_) => None,
    }
}

/// That runs contradict each other, and which one is wrong cannot be told; `scatter` is their relative residual.
pub(super) fn unnamed(scatter: f64) -> Option<String> {
    (scatter > CONTRADICT).then(|| {
        "The runs do not tell which of them is wrong; more runs with trial weights at other angles would."
            .into()
    })
}

/// That the stated noise is too small for what the runs differ by.
pub(super) fn beyond_stated() -> String {
    "The runs differ by more than the stated noise explains, so intervals come from the scatter between the runs.".into()
}

/// Planes whose largest trial weight changes little anywhere.
fn small(trials: &Trials, fitted: &TrialFit) -> Vec<String> {
    let doubt = |plane: usize| {
        let largest = trials.readings.iter().map(|t| t.weights[plane].norm()).fold(0.0, f64::max);
        let change = |c: &InfluenceCoefficients| {
            c.per_weight[plane].norm() * largest / c.before.norm().max(f64::MIN_POSITIVE)
        };
        let most = fitted.coefficients.iter().map(change).fold(0.0, f64::max);
        (most < SMALL).then(|| {
            format!(
                "The trial weight in plane {} changes no probe by more than {:.1} %; a larger one would show more.",
                trials.places[plane],
                100.0 * most
            )
        })
    };
    (0..trials.planes).filter_map(doubt).collect()
}

/// Planes that act nearly alike.
pub(super) fn alike(equations: &NormalEquations, planes: &[String]) -> Option<String> {
    let size = equations.matrix.diagonal().map(|d| d.re.max(0.0).sqrt());
    let scaled = hermitian(equations.matrix.map_with_location(|i, j, n| n / (size[i] * size[j])));
    let separation = PlaneSeparation::of_eigenvalues(&scaled.eigenvalues, planes.len());
    let condition = separation.condition;
    let least = scaled.eigenvectors.column(scaled.eigenvalues.imin());
    let mixed: Vec<&str> =
        (0..planes.len()).filter(|j| least[*j].norm() > 0.3).map(|j| planes[j].as_str()).collect();
    separation.acts_alike().then(|| {
        format!(
            "The planes {} act nearly alike (condition {condition:.0}): an error of 1 % moves weights in them by up to {condition:.0} %; \
             leave one out with --planes.",
            mixed.join(" and ")
        )
    })
}

/// Weights that a limit holds back.
pub(super) fn at_limit(weights: &[PlaneWeight], limits: &[f64]) -> Option<String> {
    let held = weights.iter().zip(limits).filter(|(w, limit)| w.wanted_g_mm.norm() > *limit * (1.0 - 1e-6));
    let held: Vec<String> = held.map(|(w, limit)| format!("{} ({limit} g·mm)", w.plane)).collect();
    (!held.is_empty())
        .then(|| format!("At their largest weight: {}; more would leave less vibration.", held.join(", ")))
}

/// Weights that, by the scatter in the coefficients, may as well make the vibration larger.
pub(super) fn unproven(coefficients: &[InfluenceCoefficients], placed: &[C]) -> Option<String> {
    let none = vec![C::from(0.0); placed.len()];
    let expected = |weights: &[C]| -> f64 {
        coefficients.iter().map(|c| c.under(weights).norm_sqr() + 2.0 * c.variance(weights)).sum()
    };
    let is_placed = placed.iter().any(|w| w.norm() > 0.0);
    (is_placed && expected(placed) > expected(&none)).then(|| {
        "These weights may as well make the vibration larger: the runs scatter too much to tell. Repeat the runs before weights are added."
            .into()
    })
}

pub(super) fn worse(left: &[ProbeVibration], unit: &str) -> Option<String> {
    let grows = |l: &&ProbeVibration| l.after > l.before * (1.0 + 1e-9);
    let worst =
        left.iter().filter(grows).max_by(|a, b| (a.after - a.before).total_cmp(&(b.after - b.before)))?;
    let others = left.iter().filter(grows).count() - 1;
    let more = if others > 0 { format!(", and {others} more") } else { String::new() };
    Some(format!(
        "Some get worse: {} at {:.0} rpm, {:.3} to {:.3} {unit}{more}.",
        worst.probe, worst.speed_rpm, worst.before, worst.after
    ))
}

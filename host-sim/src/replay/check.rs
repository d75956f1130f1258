//! Every answer of the controller against the desktop crate.

use anyhow::{Result, bail};
use nalgebra::{Complex, DVector};
use rotor_edge_core::reading::probe_vectors;
use rotor_edge_core::response::{SupportAmplitudes, response};
use rotor_edge_desktop::identify::{Bounds, least_residual};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::model::Response;
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg};

use super::Answer;
use crate::edge::Deployment;

/// Design: core against desktop, relative to the reading's largest feature.
pub const FEATURE_LIMIT: f64 = 1e-5;
/// Design: residual above the exact optimum, relative to the feature sum.
pub const EXCESS_LIMIT: f64 = 1e-3;

/// Largest differences over all answers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Equivalence {
    /// The core's features against the desktop's, relative to the reading's largest.
    pub max_relative_feature_error: f64,
    /// The core's residual above the exact optimum under the same bounds, µm.
    pub max_residual_excess_um: f64,
    /// The same, relative to the reading's feature sum.
    pub max_relative_excess: f64,
    /// The core's unbalance against the exact optimum's, g·mm.
    pub max_unbalance_difference_g_mm: f64,
    /// The same in angle, degrees, where the plane holds more than the smallest bound.
    pub max_angle_difference_deg: f64,
    /// Answers that could be compared with the optimum: those whose predecessor arrived too.
    pub compared: usize,
}

impl Equivalence {
    /// Fails with one sentence if the core strayed from the desktop crate.
    ///
    /// # Errors
    /// Which figure exceeds its limit.
    pub fn verdict(&self) -> Result<()> {
        if self.max_relative_feature_error > FEATURE_LIMIT {
            bail!(
                "the core's features differ from the desktop's by {:.1e} of the largest, allowed are {FEATURE_LIMIT:.0e}",
                self.max_relative_feature_error
            );
        }
        if self.max_relative_excess > EXCESS_LIMIT {
            bail!(
                "the core's residual is {:.3} % of the feature sum above the optimum, allowed is {:.1} %",
                self.max_relative_excess * 100.0,
                EXCESS_LIMIT * 100.0
            );
        }
        Ok(())
    }
}

/// Compares all answers with the desktop crate on the same shape functions.
///
/// # Errors
/// If the desktop model cannot be evaluated at a speed of the record.
pub fn equivalence(
    deployment: &Deployment,
    growth: f64,
    record: &[Reading],
    answers: &[Answer],
) -> Result<Equivalence> {
    let floor_kg_m = f64::from(deployment.edge.unbalance_floor_g_mm) / G_MM;
    let bounds = Bounds { growth, floor_kg_m };
    let mut worst = Equivalence::default();
    let mut last: Option<(usize, DVector<Complex<f64>>)> = None;
    for answer in answers {
        let reading = &record[answer.row];
        let Some(all) = reading.complete() else { continue };
        let measured = DVector::from_iterator(all.len(), deployment.probes.iter().map(|p| all[*p]));
        let largest_m = measured.iter().map(|y| y.re.abs().max(y.im.abs())).fold(0.0, f64::max);
        let feature_sum_um: f64 = measured.iter().map(|y| (y.re.abs() + y.im.abs()) * 1e6).sum();
        let u = reported_unbalance(deployment, answer);

        let desktop =
            in_edge_order(deployment, deployment.desktop.response_under(reading.speed_rad_s(), &u)?);
        let ours = core_features(deployment, answer, reading)?;
        let difference =
            (desktop.at(&u) - ours).iter().map(|d| d.re.abs().max(d.im.abs())).fold(0.0, f64::max);
        raise(&mut worst.max_relative_feature_error, difference / largest_m);

        let before = match &last {
            None if answer.row == 0 => Some(&deployment.unbalance_kg_m),
            // an answer that was lost leaves the bound on the next one unknown
            Some((row, u)) if answers_between(record, *row, answer.row) == 0 => Some(u),
            _ => None,
        };
        if let Some(before) = before {
            let largest: Vec<f64> = before.iter().map(|u| bounds.largest(*u)).collect();
            let exact = least_residual(&desktop, &measured, &largest)?;
            let excess_um = f64::from(answer.result.e_um) - exact.residual_um;
            raise(&mut worst.max_residual_excess_um, excess_um);
            raise(&mut worst.max_relative_excess, excess_um / feature_sum_um);
            for (core, exact) in u.iter().zip(exact.unbalance_kg_m.iter()) {
                let ([a, at], [b, bt]) = (g_mm_deg(*core), g_mm_deg(*exact));
                raise(&mut worst.max_unbalance_difference_g_mm, (a - b).abs());
                if exact.norm() > floor_kg_m {
                    let turn = (at - bt + 180.0).rem_euclid(360.0) - 180.0;
                    raise(&mut worst.max_angle_difference_deg, turn.abs());
                }
            }
            worst.compared += 1;
        }
        last = Some((answer.row, u));
    }
    Ok(worst)
}

fn raise(worst: &mut f64, value: f64) {
    // a NaN must not pass for agreement
    *worst = worst.max(if value.is_nan() { f64::INFINITY } else { value });
}

/// Readings between two rows that the controller must have evaluated.
fn answers_between(record: &[Reading], after: usize, before: usize) -> usize {
    record[after + 1..before].iter().filter(|r| r.complete().is_some()).count()
}

fn reported_unbalance(deployment: &Deployment, answer: &Answer) -> DVector<Complex<f64>> {
    DVector::from_fn(deployment.unbalance_kg_m.len(), |j, _| {
        let [x, y] = answer.result.unbalance_g_mm[j];
        Complex::new(f64::from(x), f64::from(y)) / G_MM
    })
}

/// Rows of a desktop response in the order of the controller's probes.
fn in_edge_order(deployment: &Deployment, mut response: Response) -> Response {
    response.per_unbalance = response.per_unbalance.select_rows(&deployment.probes);
    response.fixed = response.fixed.select_rows(&deployment.probes);
    response
}

/// The core's own features at its own estimate, m.
fn core_features(
    deployment: &Deployment,
    answer: &Answer,
    reading: &Reading,
) -> Result<DVector<Complex<f64>>> {
    let speed = deployment.reading(reading).speed_rad_s();
    let u = answer.result.unbalance_g_mm;
    let flat = [u[0][0], u[0][1], u[1][0], u[1][1]];
    let at = response(&deployment.edge, speed, &SupportAmplitudes::default()).map_err(|e| {
        anyhow::anyhow!("the core cannot evaluate its model at {} rpm: {e:?}", reading.speed_rpm)
    })?;
    let vectors = probe_vectors(&at.features(&flat));
    Ok(DVector::from_iterator(
        vectors.len(),
        vectors.iter().map(|v| Complex::new(f64::from(v.cos_um), -f64::from(v.sin_um)) * 1e-6),
    ))
}

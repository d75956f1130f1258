//! Every answer of the controller against the desktop crate.

use anyhow::{Result, anyhow, bail};
use nalgebra::{Complex, DVector};
use rotor_edge_core::reading::ProbeVector;
use rotor_edge_core::response::{SupportAmplitudes, response};
use rotor_edge_desktop::identify::least_residual;
use rotor_edge_desktop::measurement::{Reading, phasor_m};
use rotor_edge_desktop::model::Response;
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg};
use serde::Serialize;

use super::reference::{Expected, ReferencePipeline};
use super::timing::{Timing, settings};
use super::{AnsweredReading, ReplayConfig};
use crate::bus::decoded::planes_of;
use crate::edge::Deployment;

/// Design: core against desktop, relative to the reading's largest feature.
pub const FEATURE_LIMIT: f64 = 1e-5;
/// Design: residual above the exact optimum, relative to the feature sum.
pub const EXCESS_LIMIT: f64 = 1e-3;

/// Largest differences over all answers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
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
    /// Answers that could be compared with the optimum: those for which the bound is known, since their predecessor arrived
    /// too.
    pub compared: usize,
    /// Distance to the optimum that the core's own certificate allows at most, relative to the reading's feature sum.
    pub max_relative_gap: f64,
    /// Answers for which the certificate is known: those that the core repeats to the bit from the readings as they were
    /// sent.
    pub certified: usize,
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
        if self.max_relative_gap > EXCESS_LIMIT {
            bail!(
                "the core's own certificate leaves {:.3} % of the feature sum open, allowed is {:.1} %",
                self.max_relative_gap * 100.0,
                EXCESS_LIMIT * 100.0
            );
        }
        Ok(())
    }
}

/// Compares all answers with the desktop crate on the same shape functions and the same probes.
///
/// # Errors
/// If the desktop model cannot be evaluated at a speed of the record.
pub fn equivalence(
    deployment: &Deployment,
    config: &ReplayConfig,
    record: &[Reading],
    answers: &[AnsweredReading],
) -> Result<Equivalence> {
    let timing = Timing::of(deployment, record, config);
    let node = settings(config, record);
    let mut reference = ReferencePipeline::new(&deployment.edge, node);
    let mut worst = Equivalence::default();
    // whether the reference is known to be in the controller's step
    let mut in_step = true;
    let mut cuts: Vec<u64> = config.power_cuts_d.iter().map(|day| timing.at(*day)).collect();
    let mut answers = answers.iter().peekable();
    for (row, measured) in record.iter().enumerate() {
        let judged_us = timing.judged_us(row);
        if cuts.iter().any(|cut_us| *cut_us <= judged_us) {
            cuts.retain(|cut_us| *cut_us > judged_us);
            reference.cut_power();
            in_step = false;
        }
        let expected = reference.expect(judged_us, &deployment.reading(measured));
        let Some(answer) = answers.next_if(|answer| answer.row == row) else {
            in_step &= expected.is_none();
            continue;
        };
        let case = Case::of(deployment, measured, expected.as_ref(), answer)?;
        raise(&mut worst.max_relative_feature_error, case.relative_feature_error()?);
        let is_repeated = case.repeated.is_some();
        if let Some(expected) = expected.filter(|_| in_step || is_repeated) {
            worst.compare_with_optimum(&case, &expected)?;
        }
        let is_trusted = answer.result.is_trusted();
        // what bounds the next one is the last trusted answer: one that is not trusted tells nothing of it
        in_step = is_repeated && (in_step || is_trusted);
        if !is_repeated {
            reference.resume(planes_of(&answer.result));
        } else if !is_trusted {
            reference.distrust();
        }
    }
    Ok(worst)
}

/// One answer and what it is held against.
struct Case<'a> {
    deployment: &'a Deployment,
    answer: &'a AnsweredReading,
    /// Places of the probes that gave a value.
    probes: Vec<usize>,
    /// Vectors that they measured, m.
    measured: DVector<Complex<f64>>,
    speed_rad_s: f64,
    /// As the controller found it, kg·m.
    unbalance_kg_m: DVector<Complex<f64>>,
    /// The desktop's, of these probes.
    response: Response,
    /// The core's own words for this answer, if it repeats it to the bit.
    repeated: Option<Expected>,
}

impl<'a> Case<'a> {
    fn of(
        deployment: &'a Deployment,
        measured: &Reading,
        expected: Option<&Expected>,
        answer: &'a AnsweredReading,
    ) -> Result<Self> {
        // where readings were averaged, the mean is what was judged
        let averaged = expected.filter(|r| r.averaged.variance < 1.0).map(|r| r.averaged.reading);
        let (speed_rpm, shown) = match &averaged {
            Some(mean) => (f64::from(mean.speed_rpm), mean.probes().iter().map(phasor).collect()),
            None => (measured.speed_rpm, measured.probes.clone()),
        };
        let valid = shown.iter().enumerate().filter_map(|(place, y)| y.map(|y| (place, y)));
        let (probes, values): (Vec<usize>, Vec<Complex<f64>>) = valid.unzip();
        let found = planes_of(&answer.result);
        let unbalance_kg_m = DVector::from_iterator(
            found.len(),
            found.iter().map(|[x, y]| Complex::new(f64::from(*x), f64::from(*y)) / G_MM),
        );
        let speed_rad_s = rotor_edge_desktop::units::rad_s(speed_rpm);
        let mut response = deployment.desktop.response_under(speed_rad_s, &unbalance_kg_m)?;
        response.per_unbalance = response.per_unbalance.select_rows(&probes);
        response.fixed = response.fixed.select_rows(&probes);
        let repeated =
            expected.copied().filter(|r| r.estimate.unbalance_g_mm == answer.result.unbalance_g_mm);
        Ok(Self {
            deployment,
            answer,
            probes,
            measured: DVector::from_vec(values),
            speed_rad_s,
            unbalance_kg_m,
            response,
            repeated,
        })
    }

    /// What residuals are held against, µm: the features' sum, or the noise's if that is greater. A reading of zeros has a
    /// residual too.
    fn scale_um(&self) -> f64 {
        let sum_um: f64 = self.measured.iter().map(|y| (y.re.abs() + y.im.abs()) * 1e6).sum();
        sum_um.max(f64::from(self.answer.result.floor_um))
    }

    /// Relative to the reading's largest feature, or to the largest calculated one if the reading says nothing.
    fn relative_feature_error(&self) -> Result<f64> {
        let calculated = self.response.at(&self.unbalance_kg_m);
        let difference = largest(&(&calculated - self.core_features()?));
        let scale_m = match largest(&self.measured) {
            measured_m if self.answer.judged() => measured_m,
            measured_m => measured_m.max(largest(&calculated)),
        };
        Ok(relative(difference, scale_m))
    }

    /// The core's own features at its own estimate, m.
    fn core_features(&self) -> Result<DVector<Complex<f64>>> {
        let all: Vec<ProbeVector> = match &self.repeated {
            Some(expected) => expected.estimate.calculated.to_vec(),
            None => {
                let speed = self.speed_rad_s as f32;
                let at = response(&self.deployment.edge, speed, &SupportAmplitudes::default())
                    .map_err(|e| anyhow!("the core cannot evaluate its model at {speed} rad/s: {e:?}"))?;
                let found = planes_of(&self.answer.result);
                at.probes().iter().map(|probe| ProbeVector::from_phasor(probe.phasor(found))).collect()
            }
        };
        let value = |place: &usize| phasor(&all[*place]).unwrap_or(Complex::new(f64::NAN, f64::NAN));
        Ok(DVector::from_iterator(self.probes.len(), self.probes.iter().map(value)))
    }
}

impl Equivalence {
    fn compare_with_optimum(&mut self, case: &Case, expected: &Expected) -> Result<()> {
        let floor_g_mm = case.deployment.edge.description().unbalance_floor_g_mm;
        let planes = case.unbalance_kg_m.len();
        let largest_kg_m: Vec<f64> =
            expected.bounds_g_mm[..planes].iter().map(|b| f64::from(b.max(floor_g_mm)) / G_MM).collect();
        let exact = least_residual(&case.response, &case.measured, &largest_kg_m)?;
        let scale_um = case.scale_um();
        let excess_um = f64::from(case.answer.result.e_um) - exact.residual_um;
        raise(&mut self.max_residual_excess_um, excess_um);
        raise(&mut self.max_relative_excess, relative(excess_um, scale_um));
        for (core, exact) in case.unbalance_kg_m.iter().zip(exact.unbalance_kg_m.iter()) {
            let ([a, at], [b, bt]) = (g_mm_deg(*core), g_mm_deg(*exact));
            raise(&mut self.max_unbalance_difference_g_mm, (a - b).abs());
            if exact.norm() * G_MM > f64::from(floor_g_mm) {
                let turn = (at - bt + 180.0).rem_euclid(360.0) - 180.0;
                raise(&mut self.max_angle_difference_deg, turn.abs());
            }
        }
        self.compared += 1;
        if let Some(repeated) = &case.repeated {
            raise(&mut self.max_relative_gap, relative(f64::from(repeated.estimate.gap_um), scale_um));
            self.certified += 1;
        }
        Ok(())
    }
}

fn phasor(vector: &ProbeVector) -> Option<Complex<f64>> {
    vector.is_finite().then(|| phasor_m(f64::from(vector.cos_um), f64::from(vector.sin_um)))
}

/// The largest part of a feature.
fn largest(vectors: &DVector<Complex<f64>>) -> f64 {
    vectors.iter().map(|y| y.re.abs().max(y.im.abs())).fold(0.0, f64::max)
}

/// A difference of a scale; without a scale it has no size. What is no number stays none.
fn relative(difference: f64, scale: f64) -> f64 {
    if scale == 0.0 && difference.is_finite() { 0.0 } else { difference / scale }
}

fn raise(worst: &mut f64, value: f64) {
    // a NaN must not pass for agreement
    *worst = worst.max(if value.is_nan() { f64::INFINITY } else { value });
}

//! Answer of `startup`.

use nalgebra::Complex;
use rotor_edge_desktop::diagnose::Candidate;
use rotor_edge_desktop::interval::{HALF_95, interval_95, size_and_angle_95};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::startup::estimate::{
    AmplitudeShift, AmplitudeTrend, CombinedEstimates, METHODS, OscillatorParameters, RunEstimates,
};
use rotor_edge_desktop::startup::refinement::{ModelRefinement, ModelStage};
use rotor_edge_desktop::startup::series::{ProbeDirection, RunUp};
use rotor_edge_desktop::startup::{Startup, UncertainValue as Measured};
use rotor_edge_desktop::unbalance::{G_MM, g_mm_deg};
use rotor_edge_desktop::units::rpm;
use serde::Serialize;

use super::diagnose::{FittedAnswer, Parameters, intervals, parameters, uncertainty};
use super::dimensions::DimensionAnswer;
use super::identify::IdentifiedCoefficient;
use super::shared::{ByName, STANDARD_DEVIATION, ZERO_TO_PEAK};

/// A figure by the direction that a pair of probes or a probe looks in.
pub type ByDirection = ByName<Option<f64>>;
/// Percent of the clearance by speed (rpm), bearing and run.
pub type Errors = ByName<ByName<ByName<f64>>>;

/// A single-disk rotor from its start-up: the two-degree model, where it fails, and what mends it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartupAnswer {
    pub damping_ratio: ByDirection,
    pub natural_rpm: ByDirection,
    pub stiffness_n_m: ByDirection,
    pub bearing_stiffness_n_m: ByDirection,
    pub damping_n_s_m: ByDirection,
    /// Of the simple model.
    pub error_percent_of_clearance: Errors,
    pub mass_kg: f64,
    pub effective_mass_kg: f64,
    pub shaft_stiffness_n_m: f64,
    pub clearance_um: f64,
    /// Whether nobody stated it.
    pub clearance_assumed: bool,
    /// What lengths in µm of the motion are: zero to peak.
    pub amplitude_convention: &'static str,
    /// Whether the two-degree model describes the data; if not, no interval of its numbers holds.
    pub two_degree_adequate: bool,
    pub estimates: ByName<DirectionEstimates>,
    pub runs: Vec<StartupRun>,
    pub own_unbalance_two_degree: Option<OwnUnbalance>,
    pub stages: Vec<StageAnswer>,
    pub improved: Option<ImprovedStartup>,
    pub remarks: Vec<String>,
}

/// A direction: half_power, circle and least_squares, as far as they can.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DirectionEstimates {
    pub methods: ByName<Option<MethodEstimate>>,
    pub shift: Option<ShiftAnswer>,
}

/// A number, its standard deviation, and the 95 % interval, which holds where ``two_degree_adequate``.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NumberAnswer {
    pub value: f64,
    pub sd: f64,
    pub interval_95: [f64; 2],
}

/// The two-degree model as one method has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MethodEstimate {
    pub natural_rpm: NumberAnswer,
    pub damping_ratio: NumberAnswer,
    pub damping_n_s_m: NumberAnswer,
    pub stiffness_n_m: NumberAnswer,
    pub bearing_stiffness_n_m: Option<NumberAnswer>,
}

/// How a figure changes with the size of the motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LineAnswer {
    pub small_motion: NumberAnswer,
    pub at_largest: f64,
    pub sigmas: f64,
}

/// What changes with the size of the motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShiftAnswer {
    pub natural_rpm: LineAnswer,
    pub damping_ratio: LineAnswer,
    pub largest_um: f64,
}

/// A run along a direction, as marked in its Bode plot; ``why_not`` says why it has no marks.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct HalfPowerAnswer {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub natural_rpm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub natural_rpm_sd: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping_ratio_sd: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping_ratio_taken_as_light: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_rpm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_power_rpm: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
    /// Peak over own and added unbalance together; none where one of them is not known.
    #[serde(skip)]
    pub peak_um_per_g_mm: Option<f64>,
}

/// A run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartupRun {
    pub run: String,
    pub added_g_mm: f64,
    pub half_power: ByName<HalfPowerAnswer>,
}

/// The disk's own unbalance, g·mm and degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OwnUnbalance {
    pub g_mm: f64,
    pub angle_deg: f64,
    pub sd_g_mm: f64,
    pub sd_deg: f64,
    /// Least and most, g·mm; it holds where ``model_adequate``.
    pub interval_95: [f64; 2],
    /// The angle is known to so much either way.
    pub angle_95_deg: f64,
    /// Whether the model that it comes from describes the data.
    pub model_adequate: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modal_mass_kg: Option<f64>,
}

/// The largest error at a speed, and the noise there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageAtSpeed {
    pub speed_rpm: f64,
    pub error_percent_of_clearance: f64,
    pub noise_percent_of_clearance: f64,
}

/// A model on the way from the simple one to the one that fits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StageAnswer {
    pub model: String,
    pub chi2_per_value: Option<f64>,
    pub error_percent_of_clearance: Errors,
    pub largest_error_percent_of_clearance: f64,
    pub by_speed: Vec<StageAtSpeed>,
}

/// An effect that was added; the uncertainty is standard deviations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AddedEffect {
    pub effect: &'static str,
    pub at: Option<String>,
    pub parameters: Parameters,
    pub uncertainty: Parameters,
    /// What ``uncertainty`` is: one standard deviation.
    pub uncertainty_kind: &'static str,
    /// Least and most of each number; they hold where ``model_adequate``.
    pub interval_95: Parameters,
    #[serde(skip)]
    pub fitted: FittedAnswer,
    /// A paragraph for the engineer.
    #[serde(skip)]
    pub explanation: String,
}

/// Where a pedestal resonates, and the standard deviation, rpm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PedestalResonance {
    pub at: String,
    pub rpm: f64,
    pub sd: f64,
    pub interval_95: [f64; 2],
}

/// A bow of the shaft that was looked at and not added.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BowNotAdded {
    /// The old name of ``twice_log_bayes_factor``.
    pub delta_bic: f64,
    /// Twice the logarithm of the Bayes factor over the model without it.
    pub twice_log_bayes_factor: f64,
    pub probability: f64,
}

/// What mends the model; the verdict is that of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImprovedStartup {
    pub verdict: &'static str,
    pub summary: String,
    pub effects: Vec<AddedEffect>,
    pub own_unbalance: Vec<OwnUnbalance>,
    /// As fitted, with all effects.
    pub bearings: Vec<IdentifiedCoefficient>,
    /// The drawing as fitted, with all effects; none of an exact one.
    pub dimensions: Vec<DimensionAnswer>,
    /// Whether the model describes the data; if not, no interval of its numbers holds.
    pub model_adequate: bool,
    pub pedestal_resonance_rpm: Vec<PedestalResonance>,
    pub shaft_bow_not_added: Option<BowNotAdded>,
}

/// A start-up, evaluated, and what the answer is measured in.
pub struct EvaluatedStartup {
    pub readings: Vec<Reading>,
    pub found: Startup,
    /// The models, from the simple one on.
    pub stages: Vec<ModelStage>,
    /// The rotor model, where one could be fitted.
    pub chain: Option<ModelRefinement>,
    /// Clearance that errors are given in percent of, µm.
    pub clearance_um: f64,
    /// Whether nobody stated the clearance.
    pub clearance_assumed: bool,
    pub bearings: [String; 2],
    pub speeds_rpm: Vec<f64>,
    /// Range that errors are summed up over, rpm.
    pub range_rpm: [f64; 2],
    /// Runs whose weights are not known.
    pub unknown_weights: Vec<String>,
    /// What could not be done or was assumed, one sentence each.
    pub remarks: Vec<String>,
}

impl EvaluatedStartup {
    /// An error in percent of the clearance.
    pub fn percent(&self, error_m: f64) -> f64 {
        error_m * 1e8 / self.clearance_um
    }

    /// The disk's own unbalance: of the last model in one plane, or of the two-degree model, kg·m.
    pub fn own_kg_m(&self) -> Option<Complex<f64>> {
        match self.chain.as_ref().map(|c| c.unbalance_kg_m.as_slice()) {
            Some([(one, _)]) => Some(*one),
            _ => self.found.own_kg_m.map(|own| own.unbalance_kg_m),
        }
    }

    /// Whether the weights of a run are known.
    pub fn is_known(&self, run: &RunUp) -> bool {
        !self.unknown_weights.iter().any(|u| u == run.label())
    }
}

impl From<&EvaluatedStartup> for StartupAnswer {
    fn from(evaluated: &EvaluatedStartup) -> Self {
        let found = &evaluated.found;
        let two_degree_adequate = found.two_degree_fits();
        let own = found.own_kg_m.map(|own| OwnUnbalance {
            modal_mass_kg: Some(own.modal_mass_kg),
            ..OwnUnbalance::of(own.unbalance_kg_m, own.sd_kg_m, two_degree_adequate)
        });
        Self {
            damping_ratio: by_direction(found, |e| Some(e.damping_ratio.value)),
            natural_rpm: by_direction(found, |e| Some(rpm(e.natural_rad_s.value))),
            stiffness_n_m: by_direction(found, |e| Some(e.stiffness_n_m.value)),
            bearing_stiffness_n_m: by_direction(found, |e| e.bearing_stiffness_n_m.map(|b| b.value)),
            damping_n_s_m: by_direction(found, |e| Some(e.damping_n_s_m.value)),
            error_percent_of_clearance: errors(evaluated, &evaluated.stages[0]),
            mass_kg: found.mass_kg,
            effective_mass_kg: found.spring.effective_mass_kg,
            shaft_stiffness_n_m: found.spring.stiffness_n_m,
            clearance_um: evaluated.clearance_um,
            clearance_assumed: evaluated.clearance_assumed,
            amplitude_convention: ZERO_TO_PEAK,
            two_degree_adequate,
            estimates: estimates(found),
            runs: found
                .runs
                .iter()
                .zip(&found.seen)
                .map(|(run, row)| startup_run(evaluated, run, row))
                .collect(),
            own_unbalance_two_degree: own,
            stages: evaluated.stages.iter().map(|s| stage(evaluated, s)).collect(),
            improved: evaluated.chain.as_ref().map(ImprovedStartup::from),
            remarks: evaluated.remarks.clone(),
        }
    }
}

/// One number a direction, of its best estimate.
fn by_direction(found: &Startup, of: impl Fn(&OscillatorParameters) -> Option<f64>) -> ByDirection {
    let value =
        |(d, c): (&ProbeDirection, &CombinedEstimates)| (d.label.clone(), c.best().and_then(|(_, e)| of(e)));
    found.directions.iter().zip(&found.combined).map(value).collect()
}

impl NumberAnswer {
    fn of(n: Measured, factor: f64) -> Self {
        let (value, sd) = (n.value * factor, n.sd * factor);
        Self { value, sd, interval_95: interval_95(value, sd) }
    }
}

impl From<&OscillatorParameters> for MethodEstimate {
    fn from(e: &OscillatorParameters) -> Self {
        Self {
            natural_rpm: NumberAnswer::of(e.natural_rad_s, rpm(1.0)),
            damping_ratio: NumberAnswer::of(e.damping_ratio, 1.0),
            damping_n_s_m: NumberAnswer::of(e.damping_n_s_m, 1.0),
            stiffness_n_m: NumberAnswer::of(e.stiffness_n_m, 1.0),
            bearing_stiffness_n_m: e.bearing_stiffness_n_m.map(|b| NumberAnswer::of(b, 1.0)),
        }
    }
}

/// Every method's answer over all runs, by direction.
fn estimates(found: &Startup) -> ByName<DirectionEstimates> {
    let direction = |d: usize| {
        let methods = METHODS.iter().zip(&found.combined[d].by_method);
        let methods = methods.map(|(name, e)| (name.to_string(), e.as_ref().map(MethodEstimate::from)));
        let shift = found.shifts[d].as_ref().map(ShiftAnswer::from);
        (found.directions[d].label.clone(), DirectionEstimates { methods: methods.collect(), shift })
    };
    (0..found.directions.len()).map(direction).collect()
}

impl LineAnswer {
    fn of(l: &AmplitudeTrend, factor: f64) -> Self {
        Self {
            small_motion: NumberAnswer::of(l.at_rest, factor),
            at_largest: l.at_largest * factor,
            sigmas: l.sigmas,
        }
    }
}

impl From<&AmplitudeShift> for ShiftAnswer {
    fn from(s: &AmplitudeShift) -> Self {
        Self {
            natural_rpm: LineAnswer::of(&s.natural_rad_s, rpm(1.0)),
            damping_ratio: LineAnswer::of(&s.damping_ratio, 1.0),
            largest_um: s.largest_m * 1e6,
        }
    }
}

/// A run along every direction, as marked in the Bode plot.
fn startup_run(evaluated: &EvaluatedStartup, run: &RunUp, row: &[RunEstimates]) -> StartupRun {
    let unbalance_g_mm = evaluated
        .own_kg_m()
        .filter(|_| evaluated.is_known(run))
        .map(|own| (own + run.added_kg_m).norm() * G_MM);
    let directions = evaluated.found.directions.iter().zip(row);
    let [added_g_mm, _] = g_mm_deg(run.added_kg_m);
    StartupRun {
        run: run.label().into(),
        added_g_mm,
        half_power: directions.map(|(d, seen)| (d.label.clone(), half_power(seen, unbalance_g_mm))).collect(),
    }
}

fn half_power(seen: &RunEstimates, unbalance_g_mm: Option<f64>) -> HalfPowerAnswer {
    match &seen.half_power {
        Ok((marks, own)) => HalfPowerAnswer {
            natural_rpm: Some(rpm(own.modal.natural_rad_s)),
            natural_rpm_sd: Some(rpm(own.covariance[(0, 0)].sqrt())),
            damping_ratio: Some(own.modal.damping_ratio),
            damping_ratio_sd: Some(own.covariance[(1, 1)].sqrt()),
            damping_ratio_taken_as_light: Some(marks.light_damping_ratio),
            peak_rpm: Some(rpm(marks.peak[0])),
            peak_um: Some(marks.peak[1] * 1e6),
            half_power_rpm: Some(marks.half_power_rad_s.map(rpm)),
            why_not: None,
            peak_um_per_g_mm: unbalance_g_mm.map(|u| marks.peak[1] * 1e6 / u),
        },
        Err(why) => HalfPowerAnswer { why_not: Some(why.clone()), ..HalfPowerAnswer::default() },
    }
}

/// By speed, then bearing, then run: percent of the clearance.
fn errors(evaluated: &EvaluatedStartup, stage: &ModelStage) -> Errors {
    let mut by_speed = Errors::default();
    for speed in &evaluated.speeds_rpm {
        let mut by_bearing = ByName::default();
        for e in evaluated.found.errors_at(&evaluated.readings, &stage.motion, *speed) {
            let runs: &mut ByName<f64> = by_bearing.entry(&evaluated.bearings[e.bearing]);
            *runs.entry(evaluated.found.runs[e.run].label()) = evaluated.percent(e.error_m);
        }
        *by_speed.entry(&speed.to_string()) = by_bearing;
    }
    by_speed
}

fn stage(evaluated: &EvaluatedStartup, stage: &ModelStage) -> StageAnswer {
    let worst = evaluated.found.worst_by_speed(&evaluated.readings, &stage.motion, evaluated.range_rpm);
    StageAnswer {
        model: stage.label.clone(),
        chi2_per_value: stage.chi2_per_value,
        error_percent_of_clearance: errors(evaluated, stage),
        largest_error_percent_of_clearance: worst.iter().map(|w| evaluated.percent(w[1])).fold(0.0, f64::max),
        by_speed: (worst.iter())
            .map(|[speed_rpm, error, noise]| StageAtSpeed {
                speed_rpm: *speed_rpm,
                error_percent_of_clearance: evaluated.percent(*error),
                noise_percent_of_clearance: evaluated.percent(*noise),
            })
            .collect(),
    }
}

impl OwnUnbalance {
    fn of(kg_m: Complex<f64>, sd_kg_m: f64, model_adequate: bool) -> Self {
        let [g_mm, angle_deg] = g_mm_deg(kg_m);
        let sd_g_mm = sd_kg_m * G_MM;
        let (interval_95, angle_95_deg) = size_and_angle_95(g_mm, HALF_95 * sd_g_mm);
        Self {
            g_mm,
            angle_deg,
            sd_g_mm,
            sd_deg: (sd_g_mm / g_mm).to_degrees(),
            interval_95,
            angle_95_deg,
            model_adequate,
            modal_mass_kg: None,
        }
    }
}

impl From<&Candidate> for AddedEffect {
    fn from(c: &Candidate) -> Self {
        Self {
            effect: c.effect,
            at: c.at.clone(),
            parameters: parameters(c),
            uncertainty: uncertainty(c),
            uncertainty_kind: STANDARD_DEVIATION,
            interval_95: intervals(c),
            fitted: c.into(),
            explanation: c.explanation(),
        }
    }
}

impl From<&ModelRefinement> for ImprovedStartup {
    fn from(chain: &ModelRefinement) -> Self {
        let model_adequate = chain.outcome.verdict.model_fits();
        Self {
            verdict: chain.outcome.verdict.name(),
            summary: chain.outcome.summary.clone(),
            effects: chain.outcome.steps.iter().map(|s| AddedEffect::from(&s.added)).collect(),
            own_unbalance: chain
                .unbalance_kg_m
                .iter()
                .map(|(u, sd)| OwnUnbalance::of(*u, *sd, model_adequate))
                .collect(),
            bearings: chain.outcome.bearings.iter().map(IdentifiedCoefficient::from).collect(),
            dimensions: chain.outcome.dimensions.iter().map(DimensionAnswer::from).collect(),
            model_adequate,
            pedestal_resonance_rpm: pedestals(chain).collect(),
            shaft_bow_not_added: chain.bow().map(|b| BowNotAdded {
                delta_bic: b.support,
                twice_log_bayes_factor: b.support,
                probability: b.probability,
            }),
        }
    }
}

/// The resonance of every pedestal that was found.
fn pedestals(chain: &ModelRefinement) -> impl Iterator<Item = PedestalResonance> {
    chain.outcome.steps.iter().filter(|s| s.added.effect == "pedestal").filter_map(|s| {
        let of = |name: &str| s.added.parameters.iter().find(|p| p.name == name);
        let (k, m) = (of("k")?, of("m")?);
        let resonance_rpm = rpm((k.value[0] / m.value[0]).sqrt());
        // k and m move together in a fit, so this is a bound
        let relative = 0.5 * (k.sd? / k.value[0]).hypot(m.sd? / m.value[0]);
        let sd = resonance_rpm * relative;
        let interval_95 = interval_95(resonance_rpm, sd);
        Some(PedestalResonance { at: s.added.at.clone()?, rpm: resonance_rpm, sd, interval_95 })
    })
}

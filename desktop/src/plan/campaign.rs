//! The measurements that are planned, and the readings that the machine as stated would give.

use nalgebra::{Complex, DVector};

use crate::diagnose::advice::Measurement;
use crate::error::Error;
use crate::grade::{Rigid, USUAL_GRADE_MM_S, permissible_g_mm};
use crate::machine::drawing::{AddedUnbalance, Noise, Plane, Rotor, Run};
use crate::measurement::Reading;
use crate::reduction::basis;
use crate::reduction::sizes::SIMULATED;
use crate::unbalance::{G_MM, g_mm_deg, phasor_kg_m};
use crate::units::rad_s;

type C = Complex<f64>;

/// Angle from one plane's unbalance to the next: neither a pure static unbalance nor a pure couple.
const BETWEEN_PLANES_DEG: f64 = 120.0;
/// Name of the run without weights that is added beside runs with weights.
const BASE_RUN: &str = "base";

/// What is to be planned.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanRequest {
    /// Speeds of every run, rpm.
    pub speeds_rpm: Vec<f64>,
    /// Runs instead of those of the file.
    pub runs: Option<Vec<Run>>,
    /// Unbalance of each plane, kg·m; of the file or of a balance grade where there is none.
    pub unbalance_kg_m: Option<Vec<C>>,
    /// Probability with which effects are to be found, 0 to 1.
    pub probability: f64,
    /// Effects that are to be told apart, `effect@place`; none if nothing is to be decided.
    pub between: Vec<String>,
}

impl PlanRequest {
    /// Probability with which an effect of the smallest size is found.
    pub const USUAL_PROBABILITY: f64 = 0.9;

    /// All runs of the file at these speeds, rpm, with nothing to be decided.
    pub fn at(speeds_rpm: Vec<f64>) -> Self {
        Self {
            speeds_rpm,
            runs: None,
            unbalance_kg_m: None,
            probability: Self::USUAL_PROBABILITY,
            between: Vec::new(),
        }
    }
}

/// Where the unbalance that a machine is taken with comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum UnbalanceSource {
    Stated,
    /// The planes of the rotor's file.
    File,
    /// The balance grade of the file, mm/s.
    Grade(f64),
    /// The usual grade, as the file has none, mm/s.
    UsualGrade(f64),
}

/// Measurements of one machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// With the runs that are measured.
    pub rotor: Rotor,
    /// Number of the run and speed, rpm, of every reading.
    readings: Vec<(Option<usize>, f64)>,
    pub unbalance_kg_m: Vec<C>,
    pub source: UnbalanceSource,
    pub noise: Noise,
}

impl Campaign {
    /// Every speed in every run of the rotor, slow rolls left out.
    ///
    /// # Errors
    /// If the speeds are none, the planes are none, or the machine is singular.
    pub fn new(rotor: &Rotor, request: &PlanRequest) -> Result<Self, Error> {
        let mut rotor = rotor.as_stated();
        if let Some(runs) = &request.runs {
            rotor.run = runs.clone();
        }
        if request.speeds_rpm.is_empty() || request.speeds_rpm.iter().any(|v| !(*v > 0.0 && v.is_finite())) {
            return Err(Error::Unsuitable("a plan needs speeds above 0 rpm".into()));
        }
        let fastest_rpm = request.speeds_rpm.iter().copied().fold(0.0, f64::max);
        let (unbalance_kg_m, source) = match &request.unbalance_kg_m {
            Some(stated) if stated.len() == rotor.plane.len() => (stated.clone(), UnbalanceSource::Stated),
            Some(stated) => {
                return Err(Error::Unsuitable(format!(
                    "{} unbalances are stated for {} planes",
                    stated.len(),
                    rotor.plane.len()
                )));
            }
            None => usual_unbalance(&rotor, fastest_rpm),
        };
        let mut runs: Vec<Option<usize>> =
            (0..rotor.run.len()).filter(|k| !rotor.run[*k].slow_roll).map(Some).collect();
        if runs.is_empty() {
            runs.push(None);
        }
        let of_run =
            |run: &Option<usize>| request.speeds_rpm.iter().map(|rpm| (*run, *rpm)).collect::<Vec<_>>();
        let readings = runs.iter().flat_map(of_run).collect();
        let mut campaign = Self { readings, unbalance_kg_m, source, noise: Noise::default(), rotor };
        campaign.noise = Noise::of(&campaign.rotor, &campaign.readings()?);
        Ok(campaign)
    }

    /// Name of the run and speed, rpm, of every reading.
    pub fn schedule(&self) -> impl Iterator<Item = (Option<&str>, f64)> {
        self.readings
            .iter()
            .map(|(run, speed_rpm)| (run.map(|k| self.rotor.run[k].name.as_str()), *speed_rpm))
    }

    /// What the machine as stated would show.
    ///
    /// # Errors
    /// If it is singular at a speed, or vibrates nowhere.
    pub fn readings(&self) -> Result<Vec<Reading>, Error> {
        let (mut machine, mut sizes) = (self.rotor.clone(), self.unbalance_kg_m.clone());
        let mut of_run = vec![Vec::new(); self.rotor.run.len()];
        for (k, weight) in
            self.rotor.run.iter().enumerate().flat_map(|(k, r)| r.added_unbalance.iter().map(move |a| (k, a)))
        {
            of_run[k].push((machine.plane.len(), phasor_kg_m(weight.magnitude_g_mm, weight.angle_deg)));
            machine.plane.push(Plane {
                name: format!("weight {}", machine.plane.len()),
                position_m: weight.position_m,
                unbalance_g_mm: None,
                angle_deg: None,
            });
            sizes.push(C::from(0.0));
        }
        let model = basis::reduced(&machine, SIMULATED);
        let readings: Result<Vec<Reading>, Error> = self
            .readings
            .iter()
            .map(|(run, speed_rpm)| {
                let mut u = DVector::from_column_slice(&sizes);
                run.iter().flat_map(|k| &of_run[*k]).for_each(|(plane, weight)| u[*plane] = *weight);
                let seen = model.response_under(rad_s(*speed_rpm), &u)?.at(&u);
                Ok(Reading {
                    run: run.map(|k| self.rotor.run[k].name.clone()),
                    speed_rpm: *speed_rpm,
                    probes: seen.iter().map(|y| Some(*y)).collect(),
                    ..Reading::default()
                })
            })
            .collect();
        let readings = readings?;
        if readings.iter().flat_map(|r| r.probes.iter().flatten()).all(|y| y.norm() < f64::MIN_POSITIVE) {
            return Err(Error::Unsuitable(
                "the machine does not vibrate at all with this unbalance, expected an unbalance above 0 g·mm"
                    .into(),
            ));
        }
        Ok(readings)
    }

    /// The same with a further measurement.
    pub fn with(&self, m: &Measurement) -> Self {
        let mut more = self.clone();
        if !m.extra.is_empty() {
            more.rotor.probe.extend(m.extra.iter().cloned());
            return more;
        }
        let base = self.readings.first().and_then(|(run, _)| *run);
        let run = match m.weight {
            None => base,
            Some((plane, weight)) => {
                if base.is_none() {
                    more.rotor.run.push(run_of(BASE_RUN, Vec::new()));
                    let own = more.rotor.run.len() - 1;
                    more.readings.iter_mut().for_each(|(run, _)| *run = Some(own));
                }
                let [magnitude_g_mm, angle_deg] = g_mm_deg(weight);
                let position_m = self.rotor.plane[plane].position_m;
                let added = AddedUnbalance { position_m, magnitude_g_mm, angle_deg };
                more.rotor
                    .run
                    .push(run_of(&format!("weight in {}", self.rotor.plane[plane].name), vec![added]));
                Some(more.rotor.run.len() - 1)
            }
        };
        more.readings.extend(m.speeds_rpm.iter().map(|rpm| (run, *rpm)));
        more
    }

    /// The same with so many readings averaged into each.
    pub fn averaged(&self, count: f64) -> Self {
        let Noise { relative, floor_um, .. } = self.noise;
        let share = count.sqrt().recip();
        let noise = Noise { relative: relative * share, floor_um: floor_um * share, ..self.noise };
        Self { noise, ..self.clone() }
    }

    /// Unbalance of each plane, g·mm and degrees.
    pub fn stated(&self) -> Vec<(String, [f64; 2])> {
        let planes = self.rotor.plane.iter().zip(&self.unbalance_kg_m);
        planes.map(|(plane, u)| (plane.name.clone(), g_mm_deg(*u))).collect()
    }

    /// A sentence on the unbalance, where it was assumed.
    pub fn remark(&self) -> Option<String> {
        let (grade, whose) = match self.source {
            UnbalanceSource::Stated => return None,
            UnbalanceSource::File => {
                return Some("The unbalance is that of the planes of the rotor's file.".into());
            }
            UnbalanceSource::Grade(grade) => (grade, "which the rotor's file states"),
            UnbalanceSource::UsualGrade(grade) => (grade, "which is usual where a file states none"),
        };
        let total: f64 = self.unbalance_kg_m.iter().map(|u| u.norm() * G_MM).sum();
        Some(format!(
            "The unbalance is assumed: {total:.0} g·mm in all, what balance grade G {grade} permits, {whose}; --unbalance states another."
        ))
    }
}

/// Of the file's planes, else what its balance grade permits, else what the usual one does, in equal parts.
fn usual_unbalance(rotor: &Rotor, fastest_rpm: f64) -> (Vec<C>, UnbalanceSource) {
    let own: Option<Vec<C>> = rotor
        .plane
        .iter()
        .map(|p| Some(phasor_kg_m(p.unbalance_g_mm?, p.angle_deg.unwrap_or(0.0))))
        .collect();
    if let Some(own) = own.filter(|own| own.iter().any(|u| u.norm() > 0.0)) {
        return (own, UnbalanceSource::File);
    }
    let stated = rotor.rated.and_then(|rated| rated.balance_grade_mm_s).zip(permissible_g_mm(rotor));
    let (total_kg_m, source) = match stated {
        Some((grade, g_mm)) => (g_mm / G_MM, UnbalanceSource::Grade(grade)),
        None => (
            Rigid::of(rotor).permissible_kg_m(USUAL_GRADE_MM_S, fastest_rpm),
            UnbalanceSource::UsualGrade(USUAL_GRADE_MM_S),
        ),
    };
    let each = total_kg_m / rotor.plane.len().max(1) as f64;
    let at = |k: usize| C::from_polar(each, (BETWEEN_PLANES_DEG * k as f64).to_radians());
    ((0..rotor.plane.len()).map(at).collect(), source)
}

fn run_of(name: &str, added_unbalance: Vec<AddedUnbalance>) -> Run {
    Run { name: name.into(), added_unbalance, slow_roll: false }
}

/// Runs of a table of weights, each known by run, position in m and unbalance in kg·m, and a run without weights if all have some.
pub fn runs_of(weights: &[(String, f64, C)]) -> Vec<Run> {
    let mut runs: Vec<Run> = vec![run_of(BASE_RUN, Vec::new())];
    for (name, position_m, weight) in weights {
        let [magnitude_g_mm, angle_deg] = g_mm_deg(*weight);
        let added = AddedUnbalance { position_m: *position_m, magnitude_g_mm, angle_deg };
        match runs.iter_mut().find(|run| run.name == *name) {
            Some(run) => run.added_unbalance.push(added),
            None => runs.push(run_of(name, vec![added])),
        }
    }
    runs
}

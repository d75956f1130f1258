//! Answer of `simulate`, and its truth.

use std::collections::BTreeMap;
use std::path::PathBuf;

use rotor_edge_desktop::effects::entry;
use rotor_edge_desktop::machine::drawing::{AddedUnbalance, EffectEntry, Rotor, Run};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::simulate::{DrawingChange, Simulation, SimulationRequest};
use serde::Serialize;
use serde_json::json;

use super::diagnose::Parameters;
use super::shared::PlaneUnbalance;

/// Readings that a machine would give.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulationAnswer {
    pub measured: PathBuf,
    pub readings: usize,
    /// Of every run but slow rolls, rpm.
    pub speeds_rpm: Vec<f64>,
    pub runs: Vec<SimulatedRun>,
    pub probes: Vec<SimulatedProbe>,
    /// Undamped, of the machine as drawn, up to its fastest reading, at least one.
    pub critical_speeds_rpm: Vec<f64>,
    pub noise: SimulatedNoise,
    pub remarks: Vec<String>,
    /// None where an effect is hidden.
    pub truth: Option<TruthAnswer>,
}

/// A run and its weights.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulatedRun {
    pub name: String,
    pub slow_roll: bool,
    pub weights: Vec<SimulatedWeight>,
}

/// A trial weight at its place on the shaft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SimulatedWeight {
    pub position_m: f64,
    pub unbalance_g_mm: f64,
    pub angle_deg: f64,
}

/// The largest amplitude of a probe, µm zero to peak, and where it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulatedProbe {
    pub name: String,
    pub largest_um: f64,
    pub speed_rpm: f64,
    pub run: Option<String>,
}

/// Standard deviation of each component: a part of the amplitude, and a floor, µm zero to peak.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SimulatedNoise {
    pub relative: f64,
    pub floor_um: f64,
}

/// What a simulated machine has in truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TruthAnswer {
    /// Name of the machine.
    pub rotor: String,
    pub seed: u64,
    pub drawing_seed: Option<u64>,
    pub hidden_seed: Option<u64>,
    /// Those that the rotor's file does not state.
    pub effects: Vec<SimulatedEffect>,
    pub unbalance: Vec<PlaneUnbalance>,
    /// The machine less its drawing.
    pub drawing: Vec<SimulatedDrawingChange>,
    pub noise: SimulatedNoise,
}

/// An effect of the machine with its parameters in SI units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulatedEffect {
    pub effect: String,
    pub at: Option<String>,
    pub parameters: Parameters,
    pub units: BTreeMap<String, &'static str>,
    /// Of a hidden effect: what a fit of bearings, unbalance and drawing leaves of it in all readings, in standard deviations
    /// of the noise.
    pub visible_sd: Option<f64>,
}

/// A number of the machine that differs from its drawing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulatedDrawingChange {
    /// As ``[tolerance.found]`` calls it.
    pub what: String,
    pub change: f64,
    /// m; empty of a relative change.
    pub unit: &'static str,
    /// The same in standard deviations of the tolerance.
    pub deviations: f64,
}

impl SimulationAnswer {
    pub fn of(
        rotor: &Rotor,
        found: &Simulation,
        measured: PathBuf,
        truth: &TruthAnswer,
        remarks: Vec<String>,
    ) -> Self {
        let probes = rotor.probe.iter().enumerate();
        Self {
            measured,
            readings: found.readings.len(),
            speeds_rpm: found.speeds_rpm.clone(),
            runs: rotor.run.iter().map(SimulatedRun::of).collect(),
            probes: probes
                .filter_map(|(p, probe)| SimulatedProbe::of(&probe.name, p, &found.readings))
                .collect(),
            critical_speeds_rpm: found.critical_speeds_rpm.clone(),
            noise: truth.noise,
            remarks,
            truth: found.hidden.is_none().then(|| truth.clone()),
        }
    }
}

impl SimulatedRun {
    fn of(run: &Run) -> Self {
        let weight = |a: &AddedUnbalance| SimulatedWeight {
            position_m: a.position_m,
            unbalance_g_mm: a.magnitude_g_mm,
            angle_deg: a.angle_deg,
        };
        let weights = run.added_unbalance.iter().map(weight).collect();
        Self { name: run.name.clone(), slow_roll: run.slow_roll, weights }
    }
}

impl SimulatedProbe {
    /// Of the probe of this number; `None` without readings.
    fn of(name: &str, number: usize, readings: &[Reading]) -> Option<Self> {
        let sizes = readings.iter().filter_map(|r| Some((r, r.probes[number]?.norm())));
        let (at, size_m) = sizes.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let (name, run) = (name.to_string(), at.run.clone());
        Some(Self { name, largest_um: 1e6 * size_m, speed_rpm: at.speed_rpm, run })
    }
}

impl TruthAnswer {
    pub fn of(rotor: &Rotor, found: &Simulation, request: &SimulationRequest) -> Self {
        let stated = found.effects.iter().map(|entry| (entry, None));
        let hidden = found.hidden.iter().map(|hidden| (&hidden.entry, Some(hidden.visible_sd)));
        let effects = stated.chain(hidden).map(|(entry, sd)| SimulatedEffect::of(&found.machine, entry, sd));
        let planes = rotor.plane.iter().zip(&found.unbalance_kg_m);
        Self {
            rotor: rotor.name.clone(),
            seed: request.seed,
            drawing_seed: request.drawing_seed,
            hidden_seed: request.hidden_seed,
            effects: effects.collect(),
            unbalance: planes.map(|(plane, u)| PlaneUnbalance::of(&plane.name, *u)).collect(),
            drawing: found.drawing.iter().map(SimulatedDrawingChange::of).collect(),
            noise: SimulatedNoise { relative: found.noise.relative, floor_um: found.noise.floor_um },
        }
    }
}

impl SimulatedEffect {
    fn of(machine: &Rotor, entry: &EffectEntry, visible_sd: Option<f64>) -> Self {
        let parameters = entry.parameters.iter().map(|(name, value)| (name.clone(), json!(value)));
        let units = entry::units(machine, entry).into_iter().map(|(name, unit)| (name.to_string(), unit));
        Self {
            effect: entry.kind.clone(),
            at: entry.at.clone(),
            parameters: parameters.collect(),
            units: units.collect(),
            visible_sd,
        }
    }

    /// `effect@place`, or the effect alone.
    pub fn label(&self) -> String {
        self.at.as_ref().map_or_else(|| self.effect.clone(), |at| format!("{}@{at}", self.effect))
    }
}

impl SimulatedDrawingChange {
    fn of(change: &DrawingChange) -> Self {
        let unit = if change.what.ends_with("position_m") { "m" } else { "" };
        Self { what: change.what.clone(), change: change.change, unit, deviations: change.deviations }
    }
}

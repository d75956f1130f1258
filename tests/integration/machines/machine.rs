//! The given machines as the tests read them.

use std::path::{Path, PathBuf};

use rotor_edge_desktop::diagnose::{Candidate, Diagnosis, DiagnosisVerdict, diagnose};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::rotor_file;
use rotor_edge_tests::repository;
use serde_json::Value;

/// An effect that was put into a machine.
pub struct Hidden {
    pub effect: String,
    pub at: Option<String>,
    pub parameters: Value,
}

impl Hidden {
    pub fn label(&self) -> String {
        self.at.as_ref().map_or_else(|| self.effect.clone(), |at| format!("{}@{at}", self.effect))
    }
}

/// A machine, what was measured on it, and what hides in it.
pub struct Machine {
    pub name: String,
    pub rotor: Rotor,
    pub readings: Vec<Reading>,
    pub truth: Vec<Hidden>,
}

impl Machine {
    fn read(set: &str, folder: &Path) -> Self {
        let rotor = rotor_file::read(&folder.join("rotor.toml")).unwrap();
        let readings = measurement::read(&folder.join("measured.csv"), &rotor).unwrap();
        let text = std::fs::read_to_string(folder.join("truth.json")).unwrap();
        let truth: Value = serde_json::from_str(&text).unwrap();
        let hidden = |e: &Value| Hidden {
            effect: e["effect"].as_str().unwrap().to_string(),
            at: e["at"].as_str().map(str::to_string),
            parameters: e["parameters"].clone(),
        };
        let truth = truth["effects"].as_array().unwrap().iter().map(hidden).collect();
        let name = format!("{set}/{}", folder.file_name().unwrap().display());
        Self { name, rotor, readings, truth }
    }

    /// Amplitude and standard deviation of each measured phasor, m.
    pub fn values(&self) -> Vec<(f64, f64)> {
        let noise = self.rotor.noise.unwrap();
        let all = self.readings.iter().flat_map(|r| &r.probes).flatten();
        all.map(|y| (y.norm(), noise.sigma_m(*y))).collect()
    }

    /// The error that the noise alone makes, and how much it scatters, relative.
    pub fn own_error(&self) -> (f64, f64) {
        let values = self.values();
        let variance: f64 = values.iter().map(|(_, sd)| sd.powi(2)).sum();
        let fourth: f64 = values.iter().map(|(_, sd)| sd.powi(4)).sum();
        let all: f64 = values.iter().map(|(y, _)| y.powi(2)).sum();
        ((2.0 * variance / all).sqrt(), 0.5 * fourth.sqrt() / variance)
    }

    /// Something is claimed, and first or in the group that the data cannot tell apart stands what hides.
    pub fn is_named_by(&self, answer: &Diagnosis) -> bool {
        let truth = self.truth_label();
        let first = answer.candidates.first().map(Candidate::label);
        let group = answer.indistinguishable.first();
        answer.verdict != DiagnosisVerdict::Adequate
            && (first.as_ref() == Some(&truth) || group.is_some_and(|g| g.contains(&truth)))
    }

    /// The truth as `improve` names a set of effects.
    pub fn truth_label(&self) -> String {
        let mut labels: Vec<String> = self.truth.iter().map(Hidden::label).collect();
        labels.sort();
        labels.join(" + ")
    }
}

/// All machines of a set.
pub fn machines(set: &str) -> Vec<Machine> {
    let folder = repository("tests/machines").join(set);
    let mut cases: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).filter(|p| p.is_dir()).collect();
    cases.sort();
    cases.iter().map(|case| Machine::read(set, case)).collect()
}

/// All machines of a set, each with its diagnosis.
pub fn diagnosed(set: &str) -> Vec<(Machine, Diagnosis)> {
    let look = |m: Machine| {
        let answer = diagnose(&m.rotor, &m.readings).unwrap_or_else(|e| panic!("{}: {e}", m.name));
        (m, answer)
    };
    machines(set).into_iter().map(look).collect()
}

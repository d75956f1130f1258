//! A machine with something hidden, and what it was.

use anyhow::Result;
use rotor_edge::answers::simulate::{SimulatedEffect, TruthAnswer};
use rotor_edge::command::simulated_file;
use rotor_edge::render::quantity::about;
use rotor_edge::scale::three_digits;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::simulate::{Simulation, SimulationRequest, simulate};
use rotor_edge_desktop::unbalance::g_mm_deg;
use serde::{Deserialize, Serialize};

use super::files::{InputFiles, NamedText};
use super::step::{Change, Step};

/// The seed by which something was hidden: what it is stands nowhere until it is asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Practice {
    pub seed: u64,
    /// Speeds of every run, rpm.
    speeds_rpm: Vec<f64>,
    #[serde(default)]
    pub is_revealed: bool,
}

/// What was hidden beside what was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reveal {
    pub sentence: String,
    /// Parameter, in truth, as found.
    pub rows: Vec<[String; 3]>,
}

impl Practice {
    /// Hides something in a machine, and simulates what its probes show at the speeds of these readings.
    ///
    /// # Errors
    /// If no effect would be visible, or the machine cannot be simulated.
    pub fn hide(
        rotor: &NamedText,
        machine: &Rotor,
        readings: &[Reading],
        seed: u64,
    ) -> Result<(InputFiles, Self)> {
        let mut speeds_rpm: Vec<f64> = readings.iter().map(|r| r.speed_rpm).collect();
        speeds_rpm.sort_by(f64::total_cmp);
        speeds_rpm.dedup();
        let practice = Self { seed, speeds_rpm, is_revealed: false };
        let found = practice.simulated(machine)?;
        let text = String::from_utf8(simulated_file(machine, &found)?)?;
        let data = NamedText { name: format!("hidden-{seed}.csv"), text };
        // simulated readings hold no other slow roll than those that the rotor's file states
        Ok((InputFiles { rotor: rotor.clone(), data, slow_roll: None, paths: None }, practice))
    }

    fn request(&self) -> SimulationRequest {
        SimulationRequest {
            speeds_rpm: self.speeds_rpm.clone(),
            seed: self.seed,
            hidden_seed: Some(self.seed),
            ..SimulationRequest::default()
        }
    }

    fn simulated(&self, machine: &Rotor) -> Result<Simulation> {
        Ok(simulate(machine, &self.request())?)
    }

    /// What was hidden in this machine, and what these steps found of it.
    ///
    /// # Errors
    /// As [`Self::hide`].
    pub fn reveal(&self, machine: &Rotor, steps: &[Step]) -> Result<Reveal> {
        let found = self.simulated(machine)?;
        let truth = TruthAnswer::of(machine, &found, &self.request());
        let added: Vec<String> =
            steps.iter().filter(|s| matches!(s.change, Change::Added { .. })).map(Step::label).collect();
        let hidden: Vec<String> = truth.effects.iter().map(SimulatedEffect::label).collect();
        let named = hidden.join(", ");
        let sentence = match added.as_slice() {
            [] => format!("Hidden: {named}. Nothing was added yet."),
            all if *all == hidden => format!("Hidden: {named}. That is what you found."),
            all if hidden.iter().all(|h| all.contains(h)) => {
                format!("Hidden: {named}. You found it, and added more: {}.", all.join(", "))
            }
            all => format!("Hidden: {named}. You added {} instead.", all.join(", ")),
        };
        let model = steps.last().map(|step| &step.rotor);
        let mut all: Vec<[String; 3]> = truth.effects.iter().flat_map(|effect| rows(effect, model)).collect();
        for (k, (plane, u)) in machine.plane.iter().zip(&found.unbalance_kg_m).enumerate() {
            let [size, angle] = g_mm_deg(*u);
            let own = model.and_then(|m| m.plane.get(k));
            let fitted = own.and_then(|p| Some(unbalance([p.unbalance_g_mm?, p.angle_deg?])));
            let name = format!("unbalance at {}", plane.name);
            all.push([name, unbalance([size, angle]), fitted.unwrap_or_else(|| "–".into())]);
        }
        Ok(Reveal { sentence, rows: all })
    }
}

/// Size and angle of an unbalance in words.
fn unbalance([size_g_mm, angle_deg]: [f64; 2]) -> String {
    format!("{} g·mm at {angle_deg:.0}°", three_digits(size_g_mm))
}

/// Parameters of a hidden effect, and of the same effect in the model.
fn rows(effect: &SimulatedEffect, model: Option<&Rotor>) -> Vec<[String; 3]> {
    let same = model.and_then(|m| m.effect.iter().find(|e| (&e.kind, &e.at) == (&effect.effect, &effect.at)));
    let row = |(name, value): (&String, &serde_json::Value)| {
        let unit = effect.units.get(name).copied().unwrap_or_default();
        let found = same.and_then(|e| e.parameters.get(name)).and_then(|v| serde_json::to_value(v).ok());
        let text = |value: &serde_json::Value| written(value, unit);
        [name.clone(), text(value), found.as_ref().map_or_else(|| "–".into(), text)]
    };
    effect.parameters.iter().map(row).collect()
}

/// A number, or size and angle of a phasor.
fn written(value: &serde_json::Value, unit: &str) -> String {
    let parts: Vec<f64> =
        value.as_array().into_iter().flatten().filter_map(serde_json::Value::as_f64).collect();
    match (value.as_f64(), parts.as_slice()) {
        (Some(number), _) => about(number, unit),
        (None, [re, im]) => {
            format!("{} at {:.0}°", about(re.hypot(*im), unit), im.atan2(*re).to_degrees())
        }
        _ => value.as_array().map_or_else(
            || value.to_string(),
            |all| all.iter().map(|one| written(one, unit)).collect::<Vec<_>>().join(", "),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_effect_is_compared_with_the_found_one() {
        let sample = InputFiles::sample();
        let (rotor, readings) = sample.parsed().unwrap();
        let (files, practice) = Practice::hide(&sample.rotor, &rotor, &readings, 7).unwrap();
        let (machine, _) = files.parsed().unwrap();
        let given = Step::given(machine.clone(), files.rotor.text.clone());
        let before = practice.reveal(&machine, std::slice::from_ref(&given)).unwrap();
        assert!(before.sentence.ends_with("Nothing was added yet."), "{}", before.sentence);
        let label = before.sentence.trim_start_matches("Hidden: ").split(". ").next().unwrap().to_string();
        let (effect, at) = label.split_once('@').map_or((label.as_str(), None), |(e, at)| (e, Some(at)));
        let (_, readings) = files.parsed().unwrap();
        let with = Step::adding(&machine, &readings, effect, at).unwrap();
        let after = practice.reveal(&machine, &[given, with]).unwrap();
        assert!(after.sentence.ends_with("That is what you found."), "{}", after.sentence);
        assert!(after.rows.iter().all(|row| row[2] != "–"), "{:?}", after.rows);
    }
}

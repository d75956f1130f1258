//! A given machine, and readings of one with an effect that its file does not state.

use nalgebra::Complex;
use rotor_edge_desktop::machine::drawing::{EffectEntry, Noise, ParameterValue, Rotor};
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::simulate::{SimulationRequest, simulate};
use rotor_edge_desktop::{measurement, rotor_file};
use rotor_edge_tests::repository;

/// What acts on a machine of `tests/machines`, and how it is measured.
pub struct HiddenEffect<'a> {
    pub machine: &'a str,
    pub kind: &'a str,
    pub at: &'a str,
    pub parameters: &'a [(&'a str, f64)],
    /// Unbalance of each plane, kg·m.
    pub unbalance_kg_m: f64,
    /// Relative, and of a reading of zero, µm.
    pub noise: [f64; 2],
    pub seed: u64,
}

impl HiddenEffect<'_> {
    /// The file without the effect, and readings of the machine with it, at the speeds at which it was measured.
    pub fn simulated(&self) -> (Rotor, Vec<Reading>) {
        let folder = repository("tests/machines").join(self.machine);
        let mut rotor = rotor_file::read(&folder.join("rotor.toml")).unwrap();
        let speeds = measurement::read(&folder.join("measured.csv"), &rotor).unwrap();
        let [relative, floor_um] = self.noise;
        let noise = Noise { relative, floor_um, ..Noise::of(&rotor, &speeds) };
        rotor.noise = Some(noise);
        let mut machine = rotor.clone();
        let value = |(name, value): &(&str, f64)| ((*name).to_string(), ParameterValue::Real(*value));
        let parameters = self.parameters.iter().map(value).collect();
        machine.effect.push(EffectEntry { kind: self.kind.into(), at: Some(self.at.into()), parameters });
        let mut speeds_rpm: Vec<f64> = speeds.iter().map(|r| r.speed_rpm).collect();
        speeds_rpm.sort_by(f64::total_cmp);
        speeds_rpm.dedup();
        let unbalances =
            (0..).map(|k| 2.0 * f64::from(k)).map(|a| Complex::from_polar(self.unbalance_kg_m, a));
        let request = SimulationRequest {
            speeds_rpm,
            unbalance_kg_m: machine.plane.iter().map(|p| p.name.clone()).zip(unbalances).collect(),
            noise: Some(noise),
            seed: self.seed,
            ..SimulationRequest::default()
        };
        let readings = simulate(&machine, &request).unwrap().readings;
        (rotor, readings)
    }
}

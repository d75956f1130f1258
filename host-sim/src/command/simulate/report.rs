//! What `simulate --report` writes.

use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::simulate::Simulation;

use crate::answers::simulate::SimulationAnswer;
use crate::render::bode::bode_of;
use crate::render::{Curve, Figure, PageTable, Section, Story, simulate};

/// The whole report: its first screen with the probe that moves most, and the sections below.
pub fn report(
    answer: &SimulationAnswer,
    rotor: &Rotor,
    found: &Simulation,
    next: (String, Option<String>),
) -> (Story, Vec<Section>) {
    let largest = (answer.probes.iter().enumerate()).max_by(|a, b| a.1.largest_um.total_cmp(&b.1.largest_um));
    let largest = largest.map(|(probe, _)| probe);
    let table = PageTable {
        caption: "Largest amplitude of each probe".into(),
        columns: simulate::columns(),
        rows: simulate::rows(answer),
    };
    let readings = Section { heading: "Readings".into(), tables: vec![table], ..Section::default() };
    let others = (0..rotor.probe.len()).filter(|probe| Some(*probe) != largest);
    let probes = Section {
        heading: "1x of the other probes".into(),
        figures: others.map(|probe| figure(rotor, found, probe)).collect(),
        ..Section::default()
    };
    let story = simulate::story(answer, largest.map(|probe| figure(rotor, found, probe)), next);
    let probes = Some(probes).filter(|probes| !probes.figures.is_empty());
    (story, std::iter::once(readings).chain(probes).collect())
}

fn figure(rotor: &Rotor, found: &Simulation, probe: usize) -> Figure {
    let is_slow =
        |r: &Reading| rotor.run.iter().any(|run| run.slow_roll && Some(&run.name) == r.run.as_ref());
    let point = |r: &Reading| Some((r.speed_rpm, r.probes[probe]?));
    let mut runs: Vec<Option<String>> = found.noise_free.iter().map(|r| r.run.clone()).collect();
    runs.dedup();
    let curve = |run: &Option<String>| {
        let of_run = found.noise_free.iter().filter(|r| r.run == *run && !is_slow(r));
        let label =
            run.as_ref().map_or_else(|| "without noise".into(), |run| format!("{run}, without noise"));
        Curve { label, points: of_run.filter_map(point).collect() }
    };
    let curves: Vec<Curve> = runs.iter().map(curve).filter(|curve| !curve.points.is_empty()).collect();
    let readings: Vec<_> = found.readings.iter().filter(|r| !is_slow(r)).filter_map(point).collect();
    Figure::new(
        format!("Probe {}", rotor.probe[probe].name),
        "Amplitude, and phase lag behind the keyphasor's mark, over speed.",
        bode_of("simulated", &readings, &curves),
    )
}

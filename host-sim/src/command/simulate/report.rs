//! What `simulate --report` writes.

use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_desktop::simulate::Simulation;

use crate::answers::simulate::SimulationAnswer;
use crate::render::bode::bode_of;
use crate::render::{Curve, Figure, PageTable, Section, simulate};

/// The whole report.
pub fn sections(answer: &SimulationAnswer, rotor: &Rotor, found: &Simulation) -> Vec<Section> {
    let table = PageTable {
        caption: "Largest amplitude of each probe".into(),
        columns: simulate::columns(),
        rows: simulate::rows(answer),
    };
    let mut paragraphs = vec![simulate::held(answer)];
    paragraphs.extend(simulate::sentences(answer));
    let readings =
        Section { heading: "Readings".into(), paragraphs, tables: vec![table], ..Section::default() };
    let probes = Section {
        heading: "1x of each probe".into(),
        figures: (0..rotor.probe.len()).map(|probe| figure(rotor, found, probe)).collect(),
        ..Section::default()
    };
    vec![readings, probes]
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

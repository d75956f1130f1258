//! How fast the main job is; run with `cargo bench -p rotor-edge-tests`.
//!
//! The yardstick is ROSS on the same machine: `tests/reference/make_ross_reference.py --time`.

use divan::{Bencher, black_box};
use rotor_edge::edge::{Deployment, EdgeNode};
use rotor_edge::replay::{self, ReplayConfig};
use rotor_edge::sample;
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::response::{SupportAmplitudes, response};
use rotor_edge_core::track::Tracker;
use rotor_edge_desktop::diagnose::diagnose;
use rotor_edge_desktop::identify::{PhaseOneConfig, identify};
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor::Rotor;

fn main() {
    divan::main();
}

fn first_days() -> (Rotor, Vec<Reading>, Vec<Reading>) {
    let (rotor, record, runup) = sample::load().unwrap();
    let readings = record[..3].iter().chain(&runup).cloned().collect();
    (rotor, record, readings)
}

fn deployed() -> (Deployment, Vec<Reading>) {
    let (rotor, record, readings) = first_days();
    let found = identify(&rotor, &readings, &PhaseOneConfig::default()).unwrap();
    (Deployment::new(&found.rotor, 12_000.0).unwrap(), record)
}

/// Phase I, deployment and 451 readings over the bus.
#[divan::bench]
fn whole_replay(bencher: Bencher) {
    let (rotor, record, readings) = first_days();
    bencher.bench(|| {
        let found = identify(&rotor, &readings, &PhaseOneConfig::default()).unwrap();
        let deployment = Deployment::new(&found.rotor, 12_000.0).unwrap();
        replay::run(&deployment, &record, &ReplayConfig::default(), |_| ()).unwrap()
    });
}

/// 451 readings over the bus into the core.
#[divan::bench]
fn readings_over_the_bus(bencher: Bencher) {
    let (deployment, record) = deployed();
    bencher.bench(|| replay::run(&deployment, &record, &ReplayConfig::default(), |_| ()).unwrap());
}

/// What ROSS is timed at: 51 speeds of the sample's run-up on full finite elements, model made too.
#[divan::bench]
fn response_at_51_speeds_on_finite_elements(bencher: Bencher) {
    let (rotor, _, runup) = sample::load().unwrap();
    bencher.bench(|| {
        let model = Model::finite_elements(black_box(&rotor));
        runup.iter().map(|r| model.response(r.speed_rad_s()).unwrap()).collect::<Vec<_>>()
    });
}

/// The same on the controller's six shape functions a plane, f64.
#[divan::bench]
fn response_at_51_speeds_on_six_shapes(bencher: Bencher) {
    let (rotor, _, runup) = sample::load().unwrap();
    let model = Model::reduced(&rotor, 6);
    bencher.bench(|| runup.iter().map(|r| model.response(r.speed_rad_s()).unwrap()).collect::<Vec<_>>());
}

/// One Z solve and H of the core.
#[divan::bench]
fn core_response(bencher: Bencher) {
    let (deployment, record) = deployed();
    let speed = deployment.reading(&record[0]).speed_rad_s();
    bencher.bench(|| response(black_box(&deployment.edge), black_box(speed), &SupportAmplitudes::default()));
}

/// One whole phase II update of the core.
#[divan::bench]
fn core_phase_two(bencher: Bencher) {
    let (deployment, record) = deployed();
    let reading = deployment.reading(&record[0]);
    let config = NodeConfig::new(1).track;
    let mut tracker = Tracker::new(&deployment.edge);
    bencher.bench_local(|| tracker.update(&config, black_box(&deployment.edge), black_box(&reading)));
}

/// A controller, made from its model.
#[divan::bench]
fn core_node_start(bencher: Bencher) {
    let (deployment, _) = deployed();
    bencher.bench(|| EdgeNode::new(NodeConfig::new(1), deployment.edge.clone()).unwrap());
}

/// One diagnosis: every candidate at every place, 51 speeds, four probes.
#[divan::bench(sample_count = 10)]
fn diagnosis_of_a_run_up(bencher: Bencher) {
    let (rotor, _, _) = first_days();
    let runup = measurement::parse("run-up", sample::RUNUP_DAY_126, &rotor).unwrap();
    bencher.bench(|| diagnose(black_box(&rotor), black_box(&runup)).unwrap());
}

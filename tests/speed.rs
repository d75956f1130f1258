//! How fast the main job is; run with `cargo bench -p rotor-edge-tests`.
//!
//! The yardsticks are ROSS and python-can on the same machine: `tests/reference/make_ross_reference.py --time`
//! and `tests/reference/time_python_can.py`.

use std::time::Duration;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use rotor_edge::bus::server::Server;
use rotor_edge::bus::{CanBus, local_bus, open};
use rotor_edge::edge::{Deployment, EdgeNode, encoded};
use rotor_edge::replay::{self, ReplayConfig};
use rotor_edge::sample;
use rotor_edge_core::can::Frame;
use rotor_edge_core::model::MAX_PLANES;
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::response::{SupportAmplitudes, response};
use rotor_edge_core::track::Tracker;
use rotor_edge_desktop::diagnose::diagnose;
use rotor_edge_desktop::identify::{PhaseOneConfig, identify};
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::reduction::basis;
use rotor_edge_desktop::rotor_file;
use rotor_edge_tests::repository;

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
    let model = basis::reduced(&rotor, 6);
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
    let bounds_g_mm = [1_000.0; MAX_PLANES];
    bencher.bench_local(|| {
        tracker.update(&config, black_box(&deployment.edge), black_box(&reading), &bounds_g_mm)
    });
}

/// A controller, made from its model.
#[divan::bench]
fn core_node_start(bencher: Bencher) {
    let (deployment, _) = deployed();
    let bytes = encoded(&deployment.edge).unwrap();
    bencher.bench(|| {
        let mut node = EdgeNode::new(NodeConfig::new(1)).unwrap();
        node.load(Ok(&bytes)).unwrap();
        node
    });
}

/// One diagnosis: every candidate at every place, 51 speeds, four probes.
#[divan::bench(sample_count = 10)]
fn diagnosis_of_a_run_up(bencher: Bencher) {
    let (rotor, _, _) = first_days();
    let runup = measurement::parse("run-up", sample::RUNUP_DAY_126, &rotor).unwrap();
    bencher.bench(|| diagnose(black_box(&rotor), black_box(&runup)).unwrap());
}

/// One diagnosis of a train on four bearings: eight probes, six disks, 51 speeds; to reach: 3 s.
#[divan::bench(sample_count = 5, args = ["nothing", "seal"])]
fn diagnosis_of_a_train(bencher: Bencher, hides: &str) {
    let folder = repository("tests/machines/train").join(hides);
    let rotor = rotor_file::read(&folder.join("rotor.toml")).unwrap();
    let runup = measurement::read(&folder.join("measured.csv"), &rotor).unwrap();
    bencher.bench(|| diagnose(black_box(&rotor), black_box(&runup)).unwrap());
}

/// Frames of one measurement: fewer than wait for one client at most, so that none is dropped.
const FRAMES: u64 = 10_000;

/// One participant sends, the other receives, as fast as they can.
fn exchange(bencher: Bencher, mut from: impl CanBus, mut to: impl CanBus) {
    bencher.counter(ItemsCount::new(FRAMES)).bench_local(|| {
        std::thread::scope(|scope| {
            let from = &mut from;
            scope.spawn(move || {
                for number in 0..FRAMES {
                    from.send(&Frame::standard(0x123, &number.to_le_bytes()).unwrap()).unwrap();
                }
            });
            for number in 0..FRAMES {
                let frame = to.receive(Duration::from_secs(20)).unwrap().unwrap();
                assert_eq!(frame.full_payload(), Some(&number.to_le_bytes()));
            }
        });
    });
}

fn exchange_over_server(bencher: Bencher, spec: impl Fn(&Server) -> String) {
    let server = Server::start(0, 0, None).unwrap();
    let join = || open(&spec(&server)).unwrap();
    exchange(bencher, join(), join());
}

/// 10,000 frames from one thread to another.
#[divan::bench(sample_count = 20)]
fn frames_in_process(bencher: Bencher) {
    let [from, to] = <[_; 2]>::try_from(local_bus(2)).ok().unwrap();
    exchange(bencher, from, to);
}

/// 10,000 frames through the server of `rotor-edge bus`.
#[divan::bench(sample_count = 20)]
fn frames_over_slcan(bencher: Bencher) {
    exchange_over_server(bencher, |server| format!("slcan:127.0.0.1:{}", server.slcan_port));
}

/// 10,000 frames through the server of `rotor-edge bus`.
#[divan::bench(sample_count = 20)]
fn frames_over_socketcand(bencher: Bencher) {
    exchange_over_server(bencher, |server| format!("socketcand:127.0.0.1:{}/vcan0", server.socketcand_port));
}

/// 10,000 frames through the Linux kernel's vcan0, if there is one (`tests/python/run --rates` makes one); needs room for
/// all of them: `sysctl -w net.core.rmem_default=33554432`.
#[divan::bench(sample_count = 20, ignore = !std::path::Path::new("/sys/class/net/vcan0").exists())]
fn frames_over_vcan(bencher: Bencher) {
    let join = || open("socketcan:vcan0").unwrap();
    exchange(bencher, join(), join());
}

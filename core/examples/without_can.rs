//! The core in a firmware of your own, without CAN and without a node: readings in, state and unbalance out.
//!
//! `cargo run -p rotor-edge-core --no-default-features --example without_can`. What is printed here, firmware would show or
//! send; the machine is a simulated one. Half-way, bearing 2 loses half of its stiffness upwards.

mod machine;

use machine::{MachineModel, model, reading, seen, with_softer_bearing};
use rotor_edge_core::memory::Memory;
use rotor_edge_core::monitor::Monitor;
use rotor_edge_core::reading::Keyphasor;
use rotor_edge_core::state::NodeState;
use rotor_edge_core::thresholds::Thresholds;
use rotor_edge_core::track::TrackConfig;

const SECOND_US: u64 = 1_000_000;

fn main() {
    // What was deployed comes as bytes from flash: a model that cannot be used is a reason that the status tells.
    let mut flash = [0; MachineModel::max_size_bytes()];
    let length = model().encode(&mut flash).expect("the largest fits");
    let stored_model = &flash[..length];

    let started = || Monitor::<2, 4, 2>::new(TrackConfig::default(), Thresholds::DEFAULT);
    let mut monitor = started().expect("these thresholds are within their bounds");
    let _ = monitor.load(Ok(stored_model));
    let worn = with_softer_bearing(&model());

    for second in 0..240 {
        // from a converter and `extraction`, or from whatever else measures the 1x vectors
        let machine = if second < 120 { &model() } else { &worn };
        let mut reading = reading(machine, 9000.0, &seen([[2900.0, 4100.0], [-1100.0, 1900.0]], second));
        let time_us = second * SECOND_US;
        if second == 90 {
            // Two probes of four leave nothing that could contradict the model.
            reading.lose(0b0101);
        }
        monitor.take(time_us, &reading, Keyphasor::Locked);
        let status = monitor.status(time_us);
        if second == 90 {
            assert_eq!(status.state, NodeState::Blind);
        }
        if second % 30 == 0 {
            let [x, y] = monitor.estimate().map_or([f32::NAN; 2], |estimate| estimate.static_g_mm);
            println!(
                "{second:4} s: {:?}, {:?}, static unbalance [{x:.0}, {y:.0}] g·mm",
                status.state, status.reason
            );
        }
    }
    // Without readings the status turns stale by itself, because `status` takes the time.
    let silent = monitor.status(255 * SECOND_US);
    assert!(silent.age_s > 10.0);

    // A power cut: what was learned comes back from bytes as well, the flag included.
    let stored = monitor.memory().encode();
    let memory = Memory::decode(&stored).expect("just written");
    let mut monitor = started().expect("these thresholds are within their bounds");
    let _ = monitor.load(Ok(stored_model));
    assert!(monitor.restore(&memory), "the memory of this model");
    let status = monitor.status(0);
    println!("after a power cut: {:?}, raised by {:?}", status.state, status.cause);
    assert_eq!((status.state, status.suspect), (NodeState::Flagged, Some(1)), "bearing 2, counted from zero");
}

#[test]
fn it_flags_the_worn_bearing() {
    main();
}

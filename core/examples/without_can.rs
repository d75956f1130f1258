//! The core in a firmware of your own, without CAN and without a node: readings in, unbalance and verdict out.
//!
//! `cargo run -p rotor-edge-core --no-default-features --example without_can`. What is printed here, firmware would show or
//! send; the machine is a simulated one. Half-way, bearing 2 loses half of its stiffness upwards.

mod machine;

use machine::{MachineModel, model, reading};
use rotor_edge_core::detector::{Detector, Evidence};
use rotor_edge_core::memory::Memory;
use rotor_edge_core::numerics::InPlace;
use rotor_edge_core::stages::Estimator;
use rotor_edge_core::thresholds::Thresholds;
use rotor_edge_core::track::{TrackConfig, Tracker};

const SECOND_US: u64 = 1_000_000;

fn main() {
    // What was deployed comes as bytes from flash: a model that cannot be used is refused here and not later.
    let mut flash = [0; MachineModel::max_size_bytes()];
    let length = model().encode(&mut flash).expect("the largest fits");
    let model = MachineModel::decode(&flash[..length]).expect("just written");

    let (track, thresholds) = (TrackConfig::default(), Thresholds::DEFAULT);
    let mut estimator = Estimator::new(Tracker::new(&model), &[]);
    let mut detector = Detector::default();
    let mut worn = model.clone();
    worn.supports[1].stiffness_n_m = [[5e7, 0.0], [0.0, 2.5e7]];

    for second in 0..240 {
        // from a converter and `extraction`, or from whatever else measures the 1x vectors
        let machine = if second < 120 { &model } else { &worn };
        let reading = reading(machine, 9000.0, &[[2900.0, 4100.0], [-1100.0, 1900.0]]);
        let time_us = second * SECOND_US;

        let averaged = estimator.average(&thresholds, time_us, &reading);
        let bounds_g_mm = estimator.bound(&thresholds, time_us);
        let estimate = match estimator.estimate::<InPlace, _, _>(&track, &model, &averaged, &bounds_g_mm) {
            Ok(estimate) => estimate,
            Err(error) => {
                // Nothing can be said of the machine, and firmware has to say just that.
                println!("{second:4} s: {error}");
                continue;
            }
        };
        let verdict = detector.update(&thresholds, time_us, &Evidence::new(&model, &estimate, &averaged));
        if second % 30 == 0 {
            let [x, y] = estimate.static_g_mm;
            let ratio = 100.0 * verdict.residual.ratio;
            println!(
                "{second:4} s: static unbalance [{x:.0}, {y:.0}] g·mm, residual {ratio:.1} %, {:?}",
                verdict.reason
            );
        }
    }

    // A power cut: what was learned comes back from bytes as well, the flag included.
    let most_g_mm = estimator.most_g_mm();
    let stored = Memory::new(model.checksum(), &detector, estimator.last_g_mm(), &most_g_mm).encode();
    let memory = Memory::decode(&stored).expect("just written");
    assert_eq!(memory.model_checksum, model.checksum());
    let (detector, tracker) = (memory.detector(), Tracker::<2>::resume(&model, &memory.unbalance_g_mm));
    println!("after a power cut: {:?}, unbalance {:?} g·mm", detector.latched(), tracker.last_g_mm());
    assert_eq!(
        detector.latched().and_then(|latched| latched.suspect),
        Some(1),
        "bearing 2, counted from zero"
    );
}

#[test]
fn it_flags_the_worn_bearing() {
    main();
}

//! `deploy --trial` by real programs in real time. Trials that fail are in `simulated/trial.rs`.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::bench::{Bench, Monitor};
use crate::program::{assert_says, json};
use crate::simulated::lab::moved;
use rotor_edge::bus::mac::Authenticator;
use rotor_edge::bus::open;
use rotor_edge::deploy::read_key;
use rotor_edge::edge::Deployment;
use rotor_edge::sample;
use rotor_edge_core::can::{Frame, NumberedReading, reading_frames};
use rotor_edge_desktop::rotor_file;

const NODE: u8 = 1;
const PERIOD: Duration = Duration::from_millis(20);

/// The identified model with a bearing that is softer than the machine's, in `worse.toml`.
fn write_worse(bench: &Bench) {
    let mut rotor = rotor_file::read(&bench.path("identified.toml")).unwrap();
    for bearing in &mut rotor.bearing {
        let constant = bearing.constants_mut().expect("the sample's bearings are constant");
        constant.stiffness_n_m.xx *= 0.4;
    }
    rotor_file::write(&bench.path("worse.toml"), &rotor).unwrap();
}

/// An authenticated monitor that starts with the worse model; what it says then. Its first heartbeat has a MAC, which
/// without MACs takes three.
fn monitor(bench: &Bench) -> (Monitor, String) {
    let [rotor, key, state] = ["worse.toml", "right.key", "monitor.state"].map(|name| bench.text(name));
    bench.node("slcan", &["--rotor", &rotor, "--sealed", "--key", &key, "--state", &state])
}

/// Does something while the sample's first readings are sent to the monitor again and again.
pub fn while_read_to<T>(bench: &Bench, what: impl FnOnce() -> T) -> T {
    let identified = rotor_file::read(&bench.path("identified.toml")).unwrap();
    let deployment = Deployment::new(&identified, 11_500.0).unwrap();
    let (_, record, _) = sample::load().unwrap();
    let readings: Vec<_> = record.iter().take(3).map(|measured| deployment.reading(measured)).collect();
    let mut authenticator = Authenticator::new(read_key(&bench.path("right.key")).unwrap(), NODE);
    let mut bus = open(bench.bus.spec("slcan")).unwrap();
    let is_done = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            for (number, reading) in (0..).zip(readings.iter().cycle()) {
                let end = Instant::now() + PERIOD;
                let mut frames: Vec<Frame> =
                    reading_frames(NODE, &NumberedReading::new(number, moved(reading, number)))
                        .into_iter()
                        .collect();
                frames.extend(authenticator.mac(&frames));
                frames.iter().for_each(|frame| bus.send(frame).unwrap());
                while Instant::now() < end {
                    bus.receive(end - Instant::now()).unwrap();
                }
                if is_done.load(Ordering::Relaxed) {
                    return;
                }
            }
        });
        let done = what();
        is_done.store(true, Ordering::Relaxed);
        done
    })
}

#[test]
fn trial_by_real_programs_is_confirmed_and_stored() {
    let bench = Bench::new();
    write_worse(&bench);
    let (running, line) = monitor(&bench);
    assert_says(&line, &["with the model it was started with", "commands and readings need its key"]);
    let better = bench.text("identified.toml");
    let told =
        json(&while_read_to(&bench, || bench.to_monitor("deploy", &[&better, "--trial", "1", "--json"])));
    assert_eq!((&told["outcome"], &told["compared"]), (&"confirmed".into(), &true.into()));
    let [before, during] = ["before", "during"].map(|time| told[time]["residual_ratio"].as_f64().unwrap());
    assert!(during < 0.5 * before, "{told}");
    assert!(told["counter"].is_u64() && told["bytes"].is_u64() && told["left_out"].is_array(), "{told}");
    let confirmed = format!("Model {:08x} was confirmed", told["model_checksum"].as_u64().unwrap());
    let said = running.said_until(" was confirmed");
    assert_says(&said, &[" is on trial; unless it is confirmed", &confirmed]);
    assert_says(&monitor(&bench).1, &["with the model deployed last"]);
    let stopped = bench.to_monitor("deploy", &[&better, "--trial", "0"]);
    assert_eq!(stopped.status.code(), Some(2), "no time at all");
}

//! A model on trial as a user meets it: `deploy --trial` at a monitor that is read to meanwhile, confirmed, taken back, or left
//! alone by a host that died.

use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, sleep};
use std::time::{Duration, Instant};

use crate::bench::{Bench, Monitor};
use crate::program::{assert_says, json, one_sentence};
use crate::shared::PATIENCE;
use rotor_edge::bus::open;
use rotor_edge::edge::Deployment;
use rotor_edge::sample;
use rotor_edge_core::can::{NumberedReading, reading_frames};
use rotor_edge_desktop::machine::rotor_file;
use serde_json::Value;

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

/// A monitor that starts with one of the two models.
fn monitor(bench: &Bench, rotor: &str) -> Monitor {
    let (rotor, key, state) = (bench.text(rotor), bench.text("right.key"), bench.text("monitor.state"));
    bench.node("slcan", &["--rotor", &rotor, "--key", &key, "--state", &state]).0
}

/// Does something while the sample's first readings are sent to the monitor again and again.
fn while_read_to<T>(bench: &Bench, what: impl FnOnce() -> T) -> T {
    let identified = rotor_file::read(&bench.path("identified.toml")).unwrap();
    let deployment = Deployment::new(&identified, 11_500.0).unwrap();
    let (_, record, _) = sample::load().unwrap();
    let readings: Vec<_> = record.iter().take(3).map(|measured| deployment.reading(measured)).collect();
    let mut bus = open(bench.bus.spec("slcan")).unwrap();
    let is_done = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            for (number, reading) in (0..).zip(readings.iter().cycle()) {
                for frame in reading_frames(NODE, &NumberedReading::new(number, *reading)) {
                    bus.send(&frame).unwrap();
                }
                while bus.receive(Duration::ZERO).unwrap().is_some() {}
                sleep(PERIOD);
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

fn checksum(bench: &Bench) -> Value {
    let seen = bench.seen();
    assert_eq!(seen["model_on_trial"], false);
    seen["model_checksum"].clone()
}

#[test]
fn a_better_model_is_confirmed_and_survives_power_and_a_worse_one_is_taken_back() {
    let bench = Bench::new();
    write_worse(&bench);
    let running = monitor(&bench, "worse.toml");
    let worse = checksum(&bench);
    let try_out = |rotor: &str, more: &[&str]| {
        let rotor = bench.text(rotor);
        let arguments = [&[&*rotor, "--trial", "2"], more].concat();
        while_read_to(&bench, || bench.to_monitor("deploy", &arguments))
    };
    let told = json(&try_out("identified.toml", &["--json"]));
    assert_eq!((&told["outcome"], &told["compared"]), (&"confirmed".into(), &true.into()));
    let [before, during] = ["before", "during"].map(|time| told[time]["residual_ratio"].as_f64().unwrap());
    assert!(during < 0.5 * before, "{told}");
    let better = checksum(&bench);
    assert_ne!(better, worse);
    assert_says(&running.said(), &[" is on trial; unless it is confirmed", " was confirmed and is stored."]);
    let running = monitor(&bench, "worse.toml");
    assert_eq!(checksum(&bench), better, "it is stored");

    let refused = try_out("worse.toml", &[]);
    let sentence = one_sentence(&refused);
    assert_says(&sentence, &["monitor 1 took the model before back", "% of the vibration", "readings"]);
    assert_eq!(checksum(&bench), better);
    let told = try_out("worse.toml", &["--json"]);
    assert_eq!(told.status.code(), Some(1));
    let told: Value = serde_json::from_slice(&told.stdout).unwrap();
    assert_eq!((&told["outcome"], &told["compared"]), (&"reverted".into(), &true.into()));
    // nobody who recorded the trial can begin it again
    let replayed = try_out("worse.toml", &["--counter", &told["counter"].to_string()]);
    assert_says(&one_sentence(&replayed), &["has accepted command"]);
    let said = running.said();
    assert_eq!(said.matches(" is on trial").count(), 2, "{said}");
    let back = format!("model {}, the one before, is in use again", better.as_str().unwrap());
    assert_eq!(said.matches(&back).count(), 2, "{said}");
}

#[test]
fn a_host_that_dies_leaves_a_monitor_that_takes_the_model_before_back_by_itself() {
    let bench = Bench::new();
    write_worse(&bench);
    let _running = monitor(&bench, "identified.toml");
    let before = checksum(&bench);
    while_read_to(&bench, || {
        let (bus, key, rotor) = (bench.bus.spec("slcan"), bench.text("right.key"), bench.text("worse.toml"));
        let mut host = Command::new(env!("CARGO_BIN_EXE_rotor-edge"))
            .args(["deploy", &rotor, "--bus", bus, "--key", &key, "--trial", "3"])
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let begun = Instant::now();
        let mut seen = bench.seen();
        while seen["model_on_trial"] != true {
            assert!(begun.elapsed() < PATIENCE, "{seen}");
            seen = bench.seen();
        }
        host.kill().unwrap();
        host.wait().unwrap();
        assert_ne!(seen["model_checksum"], before);
        assert_says(seen["says"].as_str().unwrap(), &["its model is on trial"]);
        // three seconds, and what a confirmation may take
        let begun = Instant::now();
        while seen["model_checksum"] != before || seen["model_on_trial"] != false {
            assert!(begun.elapsed() < 2 * PATIENCE, "{seen}");
            seen = bench.seen();
        }
    });
}

#[test]
fn where_too_little_is_judged_nothing_is_sent_or_the_model_before_comes_back() {
    let bench = Bench::new();
    write_worse(&bench);
    let _running = monitor(&bench, "worse.toml");
    let before = checksum(&bench);
    let identified = bench.text("identified.toml");
    let arguments = [identified.as_str(), "--trial", "1"];
    let silent = one_sentence(&bench.to_monitor("deploy", &arguments));
    assert_says(&silent, &["judged 0 readings", "at least 9", "nothing was sent", "--trial"]);
    assert_eq!(bench.seen()["counters"]["accepted"], 0);

    // the readings end while the model before is listened to
    let told = thread::scope(|scope| {
        let host = scope.spawn(|| bench.to_monitor("deploy", &[&*identified, "--trial", "6", "--json"]));
        while_read_to(&bench, || sleep(Duration::from_secs(4)));
        host.join().unwrap()
    });
    assert_eq!(told.status.code(), Some(1));
    let told: Value = serde_json::from_slice(&told.stdout).unwrap();
    assert_eq!((&told["outcome"], &told["compared"]), (&"reverted".into(), &false.into()));
    assert_eq!(checksum(&bench), before);
    let stopped = bench.to_monitor("deploy", &[&identified, "--trial", "0"]);
    assert_eq!(stopped.status.code(), Some(2), "no time at all");
}

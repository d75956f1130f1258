//! Everything at once: a bus with garbage on it, a monitor that loses its power while it is deployed to, and listeners and
//! players that are killed. `ROTOR_EDGE_CHAOS_SECONDS=600 cargo test --release -p rotor-edge --test integration slow::chaos` goes on for
//! ten minutes.

use std::io::Write;
use std::process::{Child, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::bench::Bench;
use crate::program::{json, rotor_edge};
use nix::sys::signal::Signal;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::Value;

/// At least so many deployments.
const ROUNDS: u64 = 8;

fn start(arguments: &[&str]) -> Child {
    let mut program = crate::program::program();
    program
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn kill(mut program: Child) {
    program.kill().unwrap();
    program.wait().unwrap();
}

/// What `watch` hears of the monitor.
fn seen(bench: &Bench) -> Value {
    let bus = bench.bus.spec("slcan");
    let all = json(&rotor_edge(&["watch", "--bus", bus, "--json", "--node", "1", "--seconds", "1.5"]));
    all["monitors"][0].clone()
}

#[test]
fn monitor_runs_acknowledged_model_after_kills_and_garbage() {
    let seconds = std::env::var("ROTOR_EDGE_CHAOS_SECONDS").map_or(0, |text| text.parse().unwrap());
    let (begun, bench) = (Instant::now(), Bench::new());
    bench.guess();
    let models = [bench.text("identified.toml"), bench.text("rotor-of-node.toml")];
    let (key, state, record) =
        (bench.text("right.key"), bench.text("monitor.state"), bench.text("record.csv"));
    let (slcan, socketcand) = (bench.bus.spec("slcan"), bench.bus.spec("socketcand"));
    let node = || bench.node("slcan", &["--key", &key, "--state", &state]).0;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut any = |below: u64| random.next_u64() % below;
    let mut running = node();
    let (mut rounds, mut cuts) = (0, 0);
    while rounds < ROUNDS || begun.elapsed() < Duration::from_secs(seconds) {
        let watch = start(&["watch", "--bus", socketcand, "--json", "--seconds", "60"]);
        let playing =
            ["--identified", "--rotor", &models[0], "--record", &record, "--external", "--key", &key];
        let replay = start(&[&["replay", "--bus", slcan], &playing[..]].concat());
        let mut vandal = bench.bus.raw("slcan_port");
        vandal.write_all(b"O\r").unwrap();
        sleep(Duration::from_millis(any(200)));
        // a player that commands as well must not have the later number
        kill(replay);
        let model = &models[(rounds % 2) as usize];
        let deploy = start(&["deploy", model, "--bus", socketcand, "--key", &key, "--json"]);
        let noise: Vec<u8> = (0..any(5_000)).map(|_| any(256) as u8).collect();
        // it may be cut off
        let _ = vandal.write_all(&noise);
        if any(2) == 0 {
            sleep(Duration::from_millis(any(400)));
            drop(running);
            sleep(Duration::from_millis(any(300)));
            running = node();
            cuts += 1;
        }
        let told: Value = json(&deploy.wait_with_output().unwrap());
        assert_eq!(told["outcome"], "accepted", "round {rounds}");
        if any(2) == 0 {
            drop(running);
            running = node();
        }
        let checksum = told["model_checksum"].as_u64().map(|checksum| format!("{checksum:08x}"));
        assert_eq!(seen(&bench)["model_checksum"].as_str(), checksum.as_deref(), "round {rounds}");
        kill(watch);
        rounds += 1;
    }
    println!("{rounds} deployments, during {cuts} of which the monitor lost its power: all carried out");
    drop(running);
    assert_eq!(bench.bus.end(Signal::SIGTERM).0, Some(0), "the bus lived through all of it");
}

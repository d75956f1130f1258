//! The main job over a bus in real time gives the same numbers to the bit as in simulated time; and deployment to a monitor
//! that is at work, on a simulated clock.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rotor_edge::bus::local::local_bus;
use rotor_edge::bus::simulated::SimulatedBus;
use rotor_edge::bus::{BusConfig, CanBus};
use rotor_edge::deploy::{Authority, await_heartbeat, command};
use rotor_edge::edge::{Deployment, EdgeModel, encoded};
use rotor_edge::node::{Controller, Served, Store, serve};
use rotor_edge::replay::live::{run_with_foreign_monitor, run_with_own_monitor};
use rotor_edge::replay::{self, ReplayConfig};
use rotor_edge::sample;
use rotor_edge_core::can::{Frame, TYPE_OFFER};
use rotor_edge_core::command::{Command, Key};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_desktop::measurement::Reading;
use rotor_edge_tests::with_supports;

const KEY: Key = Key([3; 32]);

fn machine() -> (Deployment, Vec<Reading>) {
    let (mut rotor, record, _) = sample::load().unwrap();
    for (plane, unbalance) in rotor.plane.iter_mut().zip([900.0, 700.0]) {
        (plane.unbalance_g_mm, plane.angle_deg) = (Some(unbalance), Some(40.0));
    }
    (Deployment::new(&rotor, 11_500.0).unwrap(), record)
}

/// Runs a monitor with a key beside the work of a host on the same simulated bus.
fn beside_a_monitor<T>(
    model: &EdgeModel,
    store: Store,
    work: impl FnOnce(&mut dyn CanBus) -> T,
) -> (T, Served) {
    let bus = SimulatedBus::new(BusConfig::default());
    let mut config = NodeConfig::new(1);
    config.key = Some(KEY);
    let store = store.with_initial_model(encoded(model).unwrap());
    let stop = Arc::new(AtomicBool::new(false));
    let stopped = stop.clone();
    let monitor = bus.start(move |mut port| {
        let mut controller = Controller::start(config, store, 0).unwrap();
        let clock = port.clock();
        serve(&mut port, &mut controller, &clock, &stopped, |_| ()).unwrap()
    });
    let result = work(&mut bus.join());
    stop.store(true, Ordering::Relaxed);
    (result, monitor.end())
}

#[test]
fn live_replay_over_bus_equals_simulation_to_the_bit() {
    let (deployment, record) = machine();
    let config = ReplayConfig::default();
    let simulated = replay::run(&deployment, &record, &config, |_| ()).unwrap();
    let [mut host, mut monitor] = <[_; 2]>::try_from(local_bus(2)).ok().unwrap();
    let live = run_with_own_monitor(&mut host, &mut monitor, &deployment, &record, &config, |_| ()).unwrap();
    assert_eq!(live.answers.len(), simulated.answers.len());
    for (a, b) in live.answers.iter().zip(&simulated.answers) {
        assert_eq!((a.row, a.result), (b.row, b.result));
    }
    assert_eq!(live.counters, simulated.counters);
    assert_eq!(live.states, simulated.states);
    assert_eq!(live.traffic.lost, 0);
}

#[test]
fn model_deployed_to_live_monitor_is_used_and_survives_restart() {
    let (deployment, record) = machine();
    let better = with_supports(&deployment.edge, |supports| supports[0].mass_kg += 1.0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("monitor.state");
    let fresh = Deployment { edge: better.clone(), ..machine().0 };
    let config = ReplayConfig::default();
    let expected = replay::run(&fresh, &record[..50], &config, |_| ()).unwrap();
    let play = |host: &mut dyn CanBus, counter| {
        let mut authority = Authority::new(KEY, 1, Some(counter)).unwrap();
        let before = authority.thresholds(host).unwrap();
        let played =
            run_with_foreign_monitor(host, &mut authority, &fresh, &record[..50], &config, |_| ()).unwrap();
        assert_eq!(authority.thresholds(host).unwrap(), before, "its own thresholds again");
        played
    };
    let (answers, served) = beside_a_monitor(&deployment.edge, Store::open(&path).unwrap(), |host| {
        await_heartbeat(host, 1).unwrap();
        let model = encoded(&better).unwrap();
        let answer = command(host, &KEY, 1, 10, Command::Deploy, &model, |_| ()).unwrap();
        assert_eq!(answer.model_checksum, better.checksum());
        play(host, 11).answers
    });
    // the model, thresholds there and back, a new record, and thresholds read three times
    assert_eq!(served.counters.accepted, 7);
    let (again, _) = beside_a_monitor(&deployment.edge, Store::open(&path).unwrap(), |host| {
        let replayed = command(host, &KEY, 1, 10, Command::Restart, &[], |_| ()).unwrap_err().to_string();
        assert!(replayed.contains("has accepted command"), "{replayed}");
        play(host, 100).answers
    });
    for answers in [answers, again] {
        assert_eq!(answers.len(), expected.answers.len());
        for (a, b) in answers.iter().zip(&expected.answers) {
            assert_eq!((a.row, a.result), (b.row, b.result));
        }
    }
}

#[test]
fn refusals_say_what_to_do() {
    let (deployment, _) = machine();
    let (messages, served) = beside_a_monitor(&deployment.edge, Store::in_memory(), |host| {
        await_heartbeat(host, 1).unwrap();
        let mut damaged = encoded(&deployment.edge).unwrap();
        damaged[40] ^= 1;
        let attempt = |host: &mut dyn CanBus, key: &Key, node, counter, body: &[u8]| {
            command(host, key, node, counter, Command::Deploy, body, |_| ()).unwrap_err().to_string()
        };
        [
            (attempt(host, &Key([4; 32]), 1, 1, &encoded(&deployment.edge).unwrap()), "another key"),
            (attempt(host, &KEY, 1, 1, &damaged), "refuses the model: the bytes are cut short, damaged"),
            (attempt(host, &KEY, 1, 1, &[0; 40]), "another version of models"),
            (attempt(host, &KEY, 2, 1, &encoded(&deployment.edge).unwrap()), "monitor 2 does not answer"),
            (await_heartbeat(host, 5).unwrap_err().to_string(), "no monitor 5"),
        ]
    });
    for (message, part) in messages {
        assert!(message.contains(part), "\"{part}\" is missing in: {message}");
    }
    let c = served.counters;
    assert_eq!((c.accepted, c.forged, c.refused), (0, 1, 2));
}

/// A participant whose frames are lost or come twice, both ways.
struct Faulty<'a> {
    bus: &'a mut dyn CanBus,
    random: Xoshiro256PlusPlus,
    loss: f64,
    repetition: f64,
    /// The monitor's firmware knows ISO-TP alone.
    is_old: bool,
    again: Option<Frame>,
}

impl Faulty<'_> {
    fn happens(&mut self, chance: f64) -> bool {
        ((self.random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64) < chance
    }
}

impl CanBus for Faulty<'_> {
    fn send(&mut self, frame: &Frame) -> anyhow::Result<()> {
        if self.is_old && frame.message_type() == TYPE_OFFER {
            return Ok(());
        }
        let copies = u8::from(!self.happens(self.loss)) + u8::from(self.happens(self.repetition));
        (0..copies).try_for_each(|_| self.bus.send(frame))
    }

    fn receive(&mut self, timeout: Duration) -> anyhow::Result<Option<Frame>> {
        if let Some(frame) = self.again.take() {
            return Ok(Some(frame));
        }
        let heard = self.bus.receive(timeout)?.filter(|_| !self.happens(self.loss));
        self.again = heard.filter(|_| self.happens(self.repetition));
        Ok(heard)
    }

    fn description(&self) -> String {
        self.bus.description()
    }

    fn now(&self) -> Duration {
        self.bus.now()
    }
}

#[test]
fn deployment_over_lossy_bus_is_executed_once() {
    for (seed, loss, repetition, is_old) in [
        (1, 0.0, 0.0, true),
        (2, 0.0, 1.0, true),
        (3, 0.005, 0.05, true),
        (4, 0.0, 1.0, false),
        (5, 0.05, 0.05, false),
        (6, 0.2, 0.2, false),
    ] {
        let (deployment, _) = machine();
        let better = with_supports(&deployment.edge, |supports| supports[0].mass_kg += 1.0);
        let (answer, served) = beside_a_monitor(&deployment.edge, Store::in_memory(), |host| {
            await_heartbeat(host, 1).unwrap();
            let random = Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut faulty = Faulty { bus: host, random, loss, repetition, is_old, again: None };
            command(&mut faulty, &KEY, 1, 10, Command::Deploy, &encoded(&better).unwrap(), |_| ()).unwrap()
        });
        assert_eq!(answer.model_checksum, better.checksum());
        assert_eq!((served.counters.accepted, served.counters.forged), (1, 0), "{loss} {repetition}");
    }
}

#[test]
fn transfers_to_old_firmware_back_off_after_a_loss() {
    const SEEDS: u64 = 40;
    let (deployment, _) = machine();
    let model = encoded(&deployment.edge).unwrap();
    let mut total = Duration::ZERO;
    for seed in 0..SEEDS {
        let (took, served) = beside_a_monitor(&deployment.edge, Store::in_memory(), |host| {
            await_heartbeat(host, 1).unwrap();
            let (random, begun) = (Xoshiro256PlusPlus::seed_from_u64(seed), host.now());
            let mut faulty =
                Faulty { bus: host, random, loss: 0.005, repetition: 0.0, is_old: true, again: None };
            command(&mut faulty, &KEY, 1, 10, Command::Deploy, &model, |_| ()).unwrap();
            faulty.now() - begun
        });
        assert_eq!(served.counters.accepted, 1, "seed {seed}");
        total += took;
    }
    let mean_s = total.as_secs_f64() / SEEDS as f64;
    println!("{SEEDS} transfers at 0.5 % loss: {mean_s:.1} s each");
    // 5.1 s; without a pause, what is left of one transfer breaks the next: 15.5 s
    assert!(mean_s < 8.0, "{mean_s}");
}

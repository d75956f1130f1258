//! Monitors on a simulated bus, and what their commands need.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

use rotor_edge::bus::simulated::{Running, SimulatedBus, SimulatedPort};
use rotor_edge::bus::{BusConfig, CanBus};
use rotor_edge::deploy::Authority;
use rotor_edge::edge::{Deployment, EdgeModel, encoded};
use rotor_edge::node::{Controller, Served, Store, serve};
use rotor_edge::sample;
use rotor_edge::watch::Watch;
use rotor_edge::watch::monitor::Monitor;
use rotor_edge::watch::terminal::listen;
use rotor_edge_core::can::{NumberedReading, reading_frames};
use rotor_edge_core::command::{Command, Key};
use rotor_edge_core::node::NodeConfig;
use rotor_edge_core::reading::{ProbeVector, Reading};
use rotor_edge_core::thresholds::Thresholds;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::rotor_file;
use tempfile::TempDir;

use crate::program::rotor_edge;

pub const NODE: u8 = 1;
pub const KEY: Key = Key([3; 32]);
pub const WRONG_KEY: Key = Key([4; 32]);
/// Between two readings.
const PERIOD: Duration = Duration::from_millis(20);
const FASTEST_RPM: f64 = 11_500.0;
/// As long as `watch` listens: one heartbeat at least.
const LISTENING: Duration = Duration::from_millis(1_500);

pub struct Lab {
    folder: TempDir,
    pub bus: SimulatedBus,
    counter: u64,
}

/// A monitor on the bus.
pub struct Node {
    running: Running<anyhow::Result<Served>>,
    stop: Arc<AtomicBool>,
    said: Arc<Mutex<Vec<String>>>,
}

impl Node {
    /// Loses its power; all that it has said.
    pub fn kill(self) -> Vec<String> {
        self.running.kill().expect_err("its bus fails");
        self.said.lock().unwrap().clone()
    }

    /// Ends as by a signal; what it did.
    pub fn end(self) -> Served {
        self.stop.store(true, Ordering::Relaxed);
        self.running.end().unwrap()
    }
}

/// The sample's rotor as `identify` finds it in the sample's data.
pub fn identified() -> Rotor {
    static TEXT: OnceLock<String> = OnceLock::new();
    let text = TEXT.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        for (name, text) in [
            ("rotor.toml", sample::ROTOR),
            ("record.csv", sample::RECORD),
            ("runup.csv", sample::RUNUP_DAY_0),
        ] {
            std::fs::write(path(name), text).unwrap();
        }
        let [rotor, record, runup, found] =
            ["rotor.toml", "record.csv", "runup.csv", "identified.toml"].map(path);
        let identify = ["identify", &rotor, &record, "--runup", &runup, "-o", &found];
        assert!(rotor_edge(&identify).status.success());
        std::fs::read_to_string(found).unwrap()
    });
    rotor_file::parse("identified.toml", text).unwrap()
}

/// The identified rotor with bearings that are softer than the machine's.
pub fn worse() -> Rotor {
    let mut rotor = identified();
    for bearing in &mut rotor.bearing {
        let constant = bearing.constants_mut().expect("the sample's bearings are constant");
        constant.stiffness_n_m.xx *= 0.4;
    }
    rotor
}

/// The identified rotor with a wrong unbalance.
pub fn guess() -> Rotor {
    let mut rotor = identified();
    rotor.plane.iter_mut().for_each(|plane| plane.unbalance_g_mm = Some(1.0));
    rotor
}

pub fn deployment(rotor: &Rotor) -> Deployment {
    Deployment::new(rotor, FASTEST_RPM).unwrap()
}

pub fn model(rotor: &Rotor) -> EdgeModel {
    deployment(rotor).edge
}

/// The sample's first whole readings.
pub fn readings(number: usize) -> Vec<Reading> {
    let deployment = deployment(&identified());
    let (_, record, _) = sample::load().unwrap();
    let all = record.iter().map(|measured| deployment.reading(measured)).filter(Reading::is_complete);
    all.take(number).collect()
}

impl Lab {
    pub fn new() -> Self {
        let bus = SimulatedBus::new(BusConfig::default());
        Self { folder: tempfile::tempdir().unwrap(), bus, counter: 1_000 }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The stored state of a monitor with the key.
    pub fn store(&self, name: &str) -> Store {
        Store::authenticated(&self.path(name), KEY, NODE).unwrap()
    }

    /// Settings of a monitor with the key.
    pub fn config() -> NodeConfig {
        let mut config = NodeConfig::new(NODE);
        config.key = Some(KEY);
        config
    }

    /// A monitor that starts with a rotor's model, if none was deployed.
    pub fn node(&self, rotor: Option<&Rotor>) -> Node {
        let store = self.store("monitor.state");
        self.node_with(Self::config(), initial(store, rotor), |port| Box::new(port))
    }

    /// A monitor with a way to its bus.
    pub fn node_with(
        &self,
        config: NodeConfig,
        store: Store,
        join: impl FnOnce(SimulatedPort) -> Box<dyn CanBus> + Send + 'static,
    ) -> Node {
        // a monitor that hears the last frames of the one before takes its number for used twice
        self.bus.pass(Duration::from_millis(10));
        let (stop, said) = (Arc::new(AtomicBool::new(false)), Arc::new(Mutex::new(Vec::new())));
        let (stopped, told) = (stop.clone(), said.clone());
        let running = self.bus.start(move |port| {
            let mut controller = Controller::start(config, store, 0)?;
            let (clock, mut bus) = (port.clock(), join(port));
            serve(&mut *bus, &mut controller, &clock, &stopped, |event| {
                told.lock().unwrap().push(event.words());
            })
        });
        Node { running, stop, said }
    }

    /// Who commands the monitor, with counters above all before.
    pub fn authority(&mut self) -> Authority {
        self.counter += 100;
        Authority::new(KEY, NODE, Some(self.counter)).unwrap()
    }

    /// Deploys a model with a key and a counter; the checksum that the monitor confirms, or its refusal.
    pub fn deploy(&self, key: Key, counter: u64, model: &EdgeModel) -> Result<u32, String> {
        self.command(key, counter, Command::Deploy, model)
    }

    /// A command with a model in it.
    pub fn command(&self, key: Key, counter: u64, what: Command, model: &EdgeModel) -> Result<u32, String> {
        let mut authority = Authority::new(key, NODE, Some(counter)).unwrap();
        let answer = authority.command(&mut self.bus.join(), what, &encoded(model).unwrap(), |_| ());
        answer.map(|answer| answer.model_checksum).map_err(|e| e.to_string())
    }

    /// What `watch` hears in a second and a half.
    pub fn watch(&self) -> Watch {
        let (mut bus, mut watch) = (self.bus.join(), Watch::new(Some(NODE)));
        let started = bus.now();
        listen(&mut bus, &mut watch, started, LISTENING).unwrap();
        watch
    }

    /// What `watch` hears of the monitor.
    #[track_caller]
    pub fn seen(&self) -> Monitor {
        self.watch().monitor(NODE).expect("the monitor is heard").clone()
    }

    /// Listens until the monitor is seen so.
    #[track_caller]
    pub fn await_seen(&self, within: Duration, is_so: impl Fn(&Monitor) -> bool) {
        let end = self.bus.now() + within;
        while !is_so(&self.seen()) {
            assert!(self.bus.now() < end, "{:?}", self.seen());
        }
    }

    /// Sends the sample's first readings to the monitor again and again until it is killed.
    pub fn traffic(&self) -> Running<()> {
        let readings = readings(3);
        self.bus.start(move |mut bus| {
            for (number, reading) in (0..).zip(readings.iter().cycle()) {
                let end = bus.now() + PERIOD;
                for frame in reading_frames(NODE, &NumberedReading::new(number, moved(reading, number))) {
                    if bus.send(&frame).is_err() {
                        return;
                    }
                }
                while bus.now() < end {
                    if bus.receive(end - bus.now()).is_err() {
                        return;
                    }
                }
            }
        })
    }
}

/// The reading times a factor of 1 to 1.0001 that differs from number to number: measured readings do not repeat to the bit.
pub fn moved(reading: &Reading, number: u16) -> Reading {
    let factor = 1.0 + 1e-4 * (f32::from(number.wrapping_mul(40_503)) / f32::from(u16::MAX));
    let vectors: Vec<ProbeVector> = reading
        .probes()
        .iter()
        .map(|probe| ProbeVector { cos_um: factor * probe.cos_um, sin_um: factor * probe.sin_um })
        .collect();
    Reading::new(reading.speed_rpm, &vectors).unwrap()
}

/// Settings of a monitor with the key that flags the model of [`worse`] within its first readings.
pub fn flagging_config() -> NodeConfig {
    let thresholds = Thresholds {
        average_s: 0.0,
        persistence_s: 0.0,
        ratio_limit: 0.01,
        ratio_floor: 0.0,
        ..Thresholds::DEFAULT
    };
    {
        let mut config = Lab::config();
        config.thresholds = thresholds;
        config
    }
}

/// A store with a rotor's model in place of one that was never deployed.
pub fn initial(store: Store, rotor: Option<&Rotor>) -> Store {
    match rotor {
        Some(rotor) => store.with_initial_model(encoded(&model(rotor)).unwrap()),
        None => store,
    }
}

/// Checksum of the model in use, which is not on trial.
#[track_caller]
pub fn checksum(monitor: &Monitor) -> u32 {
    let model = monitor.model().expect("its heartbeat tells its model");
    assert!(!model.on_trial);
    model.checksum
}

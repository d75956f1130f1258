//! Three gateways with ten monitors each, two leaf nodes, a hub, a file and a database; each of them is killed at random
//! moments and wires are cut: stored is what was sent, once, to the bit.
//!
//! `ROTOR_EDGE_READINGS=33334` sends so many of each monitor, a million in all.

mod common;

use std::path::Path;
use std::time::Duration;

use common::database::Postgres;
use common::nats::Nats;
use common::wire::Wire;
use common::{Bus, Program, free_port, reading, until};
use rand_core::{Rng as _, SeedableRng as _};
use rand_xoshiro::Xoshiro128PlusPlus;
use rotor_edge_plant::keeper::Keeper as _;
use rotor_edge_plant::stream::Stream;
use rusqlite::Connection;

const NODES: std::ops::RangeInclusive<u8> = 1..=10;
/// A bus keeps 16,384 frames for who reads late: after so many readings of each monitor one looks whether they are kept.
const TOGETHER: u16 = 40;

/// Everything between the buses and what is kept.
struct Plant {
    buses: Vec<Bus>,
    gateways: Vec<Option<Program>>,
    leaves: Vec<Nats>,
    wires: Vec<Wire>,
    hub: Nats,
    postgres: Postgres,
    folder: tempfile::TempDir,
    collections: [Option<Program>; 2],
}

impl Plant {
    fn start() -> Option<Self> {
        let leaf_port = free_port();
        let hub = Nats::hub(leaf_port)?;
        let wires = vec![Wire::to(leaf_port), Wire::to(leaf_port)];
        let leaves = vec![Nats::leaf("hall-a", wires[0].port)?, Nats::leaf("hall-b", wires[1].port)?];
        let postgres = Postgres::start()?;
        let folder = tempfile::tempdir().unwrap();
        let buses = vec![Bus::start(), Bus::start(), Bus::start()];
        let mut plant =
            Self { buses, gateways: vec![], leaves, wires, hub, postgres, folder, collections: [None, None] };
        plant.gateways = (0..3).map(|bus| Some(plant.gateway(bus))).collect();
        plant.collections = [Some(plant.collection(0)), Some(plant.collection(1))];
        Some(plant)
    }

    /// The third bus is at the second leaf node.
    fn leaf_of(&self, bus: usize) -> &Nats {
        &self.leaves[bus / 2]
    }

    fn gateway(&self, bus: usize) -> Program {
        let named = format!("bus{bus}={}", self.buses[bus].spec());
        let to = self.leaf_of(bus).address();
        Program::start(&["gateway", "--plant", "north", "--bus", &named, "--to", &to]).listening()
    }

    fn collection(&self, number: usize) -> Program {
        let stores = [self.file().display().to_string(), self.postgres.address()];
        let name = ["file", "database"][number];
        let (from, store) = (self.hub.address(), stores[number].as_str());
        let words = [
            "collect", "--from", &from, "--leaf", "hall-a", "--leaf", "hall-b", "--store", store, "--name",
            name,
        ];
        Program::start(&words)
    }

    fn file(&self) -> std::path::PathBuf {
        self.folder.path().join("plant.db")
    }

    /// Whether a leaf node holds the reading and the result with this number of all monitors of its bus.
    fn has(&self, bus: usize, sequence: u16) -> bool {
        let last = Stream::open(&self.leaf_of(bus).address(), None, &[])
            .and_then(|mut stream| stream.last("north", &format!("bus{bus}")));
        last.is_ok_and(|last| {
            last.len() == 2 * NODES.count() && last.iter().all(|(.., last)| last.sequence == sequence)
        })
    }

    fn kill(&mut self, what: u32) {
        match what {
            0 => self.hub.kill(),
            1 | 2 => self.leaves[what as usize - 1].kill(),
            3 | 4 => self.wires[what as usize - 3].cut(),
            5 => self.postgres.kill(),
            _ => drop(self.collections[what as usize - 6].take().map(Program::kill)),
        }
    }

    fn mend(&mut self, what: u32) {
        match what {
            0 => self.hub.restart(),
            1 | 2 => self.leaves[what as usize - 1].restart(),
            3 | 4 => self.wires[what as usize - 3].mend(),
            5 => self.postgres.restart(),
            _ => {}
        }
        self.restart_collections();
    }

    /// As a service manager would: one that began while its server was away has ended by itself.
    fn restart_collections(&mut self) {
        for number in 0..2 {
            let is_over = |program: &mut Program| program.child.try_wait().unwrap().is_some();
            if self.collections[number].as_mut().is_none_or(is_over) {
                self.collections[number] = Some(self.collection(number));
            }
        }
    }
}

fn rows(path: &Path, table: &str) -> usize {
    let there = Connection::open(path)
        .and_then(|c| c.query_row(&format!("SELECT count(*) FROM {table}"), [], |row| row.get::<_, i64>(0)));
    there.unwrap_or(0) as usize
}

#[test]
fn stored_is_what_was_sent_through_kills_of_everything_between() {
    let readings: u16 = std::env::var("ROTOR_EDGE_READINGS").map_or(600, |number| number.parse().unwrap());
    let Some(mut plant) = Plant::start() else { return };
    let mut random = Xoshiro128PlusPlus::seed_from_u64(2_026);
    let mut below = |bound: u32| random.next_u32() % bound;
    for begin in (0..readings).step_by(usize::from(TOGETHER)) {
        let end = readings.min(begin + TOGETHER);
        let (what, at) = (below(8), begin + below(20) as u16);
        let until_ = at + 1 + below(19) as u16;
        for sequence in begin..end {
            if sequence == at {
                plant.kill(what);
            }
            if sequence == until_ {
                plant.mend(what);
            }
            for bus in &mut plant.buses {
                NODES.for_each(|node| bus.say(node, sequence));
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        plant.mend(what);
        for bus in 0..3 {
            until("what was sent so far, at the leaf nodes", || plant.has(bus, end - 1));
        }
        // what a gateway has not sent on goes with it, for CAN has no memory; what it has does not
        let bus = below(12) as usize;
        if let Some(gateway) = plant.gateways.get_mut(bus).and_then(Option::take) {
            gateway.kill();
            plant.gateways[bus] = Some(plant.gateway(bus));
        }
    }
    let all = usize::from(readings) * NODES.count() * 3;
    for table in ["reading", "result"] {
        until("every row of the file", || {
            plant.restart_collections();
            rows(&plant.file(), table) == all
        });
        until("every row of the database", || {
            plant.restart_collections();
            plant.postgres.rows(table) == all
        });
    }
    is_what_was_sent(&plant, readings);
}

/// Each monitor's numbers without a gap, in one epoch, and every speed and vector to the bit; the database has the file's rows.
fn is_what_was_sent(plant: &Plant, readings: u16) {
    let file = Connection::open(plant.file()).unwrap();
    let sql = "SELECT node, epoch, sequence, speed_rpm, p4_cos_um, p4_sin_um, bus FROM reading JOIN source ON source = id \
               ORDER BY bus, node, epoch, sequence";
    let mut statement = file.prepare(sql).unwrap();
    let mut rows = statement.query([]).unwrap();
    let mut client = plant.postgres.client();
    let mut in_database = client.query(sql, &[]).unwrap().into_iter();
    for bus in 0..3 {
        for (node, sequence) in NODES.flat_map(|node| (0..readings).map(move |sequence| (node, sequence))) {
            let row = rows.next().unwrap().unwrap();
            let integer = |column| row.get::<_, i64>(column).unwrap();
            let real = |column| row.get::<_, f64>(column).unwrap();
            assert_eq!([0, 1, 2].map(integer), [i64::from(node), 0, i64::from(sequence)]);
            assert_eq!(row.get::<_, String>(6).unwrap(), format!("bus{bus}"));
            let sent = reading(node, sequence);
            let probe = sent.probes()[3];
            assert_eq!([3, 4, 5].map(real), [sent.speed_rpm, probe.cos_um, probe.sin_um].map(f64::from));
            let other = in_database.next().unwrap();
            assert_eq!([0, 1, 2].map(|c| other.get::<_, i64>(c)), [0, 1, 2].map(integer));
            assert_eq!([3, 4, 5].map(|c| other.get::<_, f64>(c)), [3, 4, 5].map(real));
        }
    }
}

//! Three gateways with ten monitors each, two leaf nodes, a hub, a file and a database, jobs with two workers and who shares
//! them, a page; each of them is killed at random moments and wires are cut: stored is what was sent, once, to the bit, and
//! each job has the answer that one process gives, once.
//!
//! `ROTOR_EDGE_READINGS=33334` sends so many of each monitor, a million in all, with more jobs meanwhile.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::time::Duration;

use crate::common::database::Postgres;
use crate::common::nats::Nats;
use crate::common::plant::Plant as Machines;
use crate::common::wire::Wire;
use crate::common::{Bus, Program, free_port, reading, until};
use rand_core::{Rng as _, SeedableRng as _};
use rand_xoshiro::Xoshiro128PlusPlus;
use rotor_edge::sample;
use rotor_edge_plant::sink::Sink as _;
use rotor_edge_plant::stream::Stream;
use rotor_edge_plant::stream::access::Access;
use rusqlite::Connection;

const NODES: std::ops::RangeInclusive<u8> = 1..=10;
/// A bus keeps 16,384 frames for who reads late: after so many readings of each monitor one looks whether they are kept.
const TOGETHER: u16 = 40;

/// Programs that somebody starts again when they are gone.
#[derive(Clone, Copy)]
enum Service {
    IntoFile,
    IntoDatabase,
    Worker,
    OtherWorker,
    Sharing,
    Page,
}

const SERVICES: [Service; 6] = [
    Service::IntoFile,
    Service::IntoDatabase,
    Service::Worker,
    Service::OtherWorker,
    Service::Sharing,
    Service::Page,
];
/// What is killed or cut, by its number: the hub, two leaf nodes, two wires, the database, and then the services.
const VICTIMS: u32 = 6 + SERVICES.len() as u32;

/// Everything between the buses and what is kept, and who works on it.
struct Plant {
    buses: Vec<Bus>,
    gateways: Vec<Option<Program>>,
    leaves: Vec<Nats>,
    wires: Vec<Wire>,
    hub: Nats,
    postgres: Postgres,
    machines: Machines,
    services: [Option<Program>; SERVICES.len()],
}

impl Plant {
    /// With so many machines that something is asked about.
    fn start(machines: u8) -> Option<Self> {
        let leaf_port = free_port();
        let hub = Nats::hub(leaf_port)?;
        let wires = vec![Wire::to(leaf_port), Wire::to(leaf_port)];
        let leaves = vec![Nats::leaf("hall-a", wires[0].port)?, Nats::leaf("hall-b", wires[1].port)?];
        let postgres = Postgres::start()?;
        let machines = runup_of(1..1 + machines);
        let buses = vec![Bus::start(), Bus::start(), Bus::start()];
        let services = [const { None }; SERVICES.len()];
        let mut plant = Self { buses, gateways: vec![], leaves, wires, hub, postgres, machines, services };
        plant.gateways = (0..3).map(|bus| Some(plant.gateway(bus))).collect();
        plant.restart_services();
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

    fn service(&self, service: Service) -> Program {
        let (hub, file, database) = (self.hub.address(), self.machines.path(), self.postgres.address());
        let collect = |name: &str, store: &str| {
            Program::start(&[
                "collect", "--from", &hub, "--leaf", "hall-a", "--leaf", "hall-b", "--store", store,
                "--name", name,
            ])
        };
        match service {
            Service::IntoFile => collect("file", file),
            Service::IntoDatabase => collect("database", &database),
            Service::Worker | Service::OtherWorker => Program::start(&["worker", &hub]),
            Service::Sharing => Program::start(&["fleet", "share", file, "--with", &hub]),
            Service::Page => Program::start(&["serve", file, "--listen", "127.0.0.1:0"]),
        }
    }

    fn file(&self) -> &Path {
        Path::new(self.machines.path())
    }

    /// Whether a leaf node holds the reading and the result with this number of all monitors of its bus.
    fn has(&self, bus: usize, sequence: u16) -> bool {
        let last = Stream::open(&self.leaf_of(bus).address(), &Access::default(), &[])
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
            _ => drop(self.services[what as usize - 6].take().map(Program::kill)),
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
        self.restart_services();
    }

    /// As a service manager would: one that began while its server was away has ended by itself.
    fn restart_services(&mut self) {
        for (number, service) in SERVICES.into_iter().enumerate() {
            let is_over = |program: &mut Program| program.child.try_wait().unwrap().is_some();
            if self.services[number].as_mut().is_none_or(is_over) {
                self.services[number] = Some(self.service(service));
            }
        }
    }

    /// Jobs that have an answer.
    fn answered(&self) -> usize {
        self.machines.jobs().iter().filter(|job| job["state"] == "done").count()
    }

    /// What the page says of every monitor, as JSON.
    fn page(&mut self) -> String {
        let page = self.services[Service::Page as usize].as_mut().unwrap();
        let mut line = String::new();
        BufReader::new(page.child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        let address = line.strip_prefix("http://").and_then(|rest| rest.split('/').next()).expect(&line);
        let mut stream = TcpStream::connect(address).unwrap();
        write!(stream, "GET /monitors HTTP/1.1\r\nhost: {address}\r\nconnection: close\r\n\r\n").unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        text
    }
}

/// Machines with a minute of readings, a second apart.
fn runup_of(nodes: std::ops::Range<u8>) -> Machines {
    Machines::of(nodes, sample::RUNUP_DAY_126, |row, _| row as i64 * 1_000_000)
}

/// Rows of buses whose name begins so.
fn rows(path: &Path, table: &str, bus: &str) -> usize {
    let sql = format!("SELECT count(*) FROM {table} JOIN source ON source = id WHERE bus LIKE ? || '%'");
    let there = Connection::open(path).and_then(|c| c.query_row(&sql, [bus], |row| row.get::<_, i64>(0)));
    there.unwrap_or(0) as usize
}

#[test]
fn stored_is_what_was_sent_through_kills_of_everything_between() {
    let readings: u16 = std::env::var("ROTOR_EDGE_READINGS").map_or(600, |number| number.parse().unwrap());
    let machines = (readings / 100).min(120) as u8;
    let Some(mut plant) = Plant::start(machines) else { return };
    plant.machines.says(&["fleet", "improve", plant.machines.path()], "new jobs");
    let mut random = Xoshiro128PlusPlus::seed_from_u64(2_026);
    let mut below = |bound: u32| random.next_u32() % bound;
    for begin in (0..readings).step_by(usize::from(TOGETHER)) {
        let end = readings.min(begin + TOGETHER);
        let (what, at) = (below(VICTIMS), begin + below(20) as u16);
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
            plant.restart_services();
            // those of the machines that something was asked about were there before
            rows(plant.file(), table, "bus") == all
        });
        until("every row of the database", || {
            plant.restart_services();
            plant.postgres.rows(table) == all
        });
    }
    is_what_was_sent(&plant, readings);
    until("every answer", || {
        plant.restart_services();
        // one that was begun three times without an end, as may be where everything is killed, waits for somebody to ask again
        if plant.machines.has_state("aside") {
            plant.machines.says(&["fleet", "improve", plant.machines.path()], "new jobs");
        }
        plant.answered() == usize::from(machines)
    });
    let alone = runup_of(1..2);
    alone.says(&["fleet", "improve", alone.path()], "1 new job.");
    alone.says(&["worker", alone.path(), "--once"], "1 job done.");
    let expected = &alone.jobs()[0];
    for job in plant.machines.jobs() {
        assert_eq!((&job["answer"], &job["model"]), (&expected["answer"], &expected["model"]), "to the bit");
    }
    let page = plant.page();
    let shown = (0..3).map(|bus| page.matches(&format!("\"bus\":\"bus{bus}\"")).count());
    assert_eq!(shown.collect::<Vec<_>>(), [NODES.count(); 3]);
}

/// Each monitor's numbers without a gap, in one epoch, and every speed and vector to the bit; the database has the file's rows.
fn is_what_was_sent(plant: &Plant, readings: u16) {
    let file = Connection::open(plant.file()).unwrap();
    let sql = "SELECT node, epoch, sequence, speed_rpm, p4_cos_um, p4_sin_um, bus FROM reading JOIN source ON source = id \
               WHERE bus LIKE 'bus%' ORDER BY bus, node, epoch, sequence";
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

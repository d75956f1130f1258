//! `gateway` into a file: what a bus says is there to the bit, once, whatever happens to the gateway.

use std::path::Path;
use std::process::Command;

use crate::common::{Bus, Program, reading, refusal, result, run, until};
use rotor_edge_core::can::{Message, PROTOCOL_VERSION};
use rotor_edge_core::state::{NodeState, Reason};
use rotor_edge_plant::item::Kind;
use rotor_edge_plant::store::schema::SQLITE;
use rotor_edge_plant::store::{Store, VERSION};
use rusqlite::Connection;

const NODE: u8 = 7;

fn count(path: &Path, kind: Kind) -> u64 {
    Store::open(path).and_then(|store| store.count(kind)).unwrap_or(0)
}

fn gateway(bus: &Bus, path: &Path) -> Program {
    let (bus_, to) = (format!("hall3={}", bus.spec()), path.display().to_string());
    Program::start(&["gateway", "--plant", "north", "--bus", &bus_, "--to", &to]).listening()
}

/// Epoch and sequence of every row, in their order.
fn numbers(path: &Path, table: &str) -> Vec<(i64, i64)> {
    let connection = Connection::open(path).unwrap();
    let mut statement =
        connection.prepare(&format!("SELECT epoch, sequence FROM {table} ORDER BY 1, 2")).unwrap();
    let all = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
    all.map(Result::unwrap).collect()
}

#[test]
fn file_keeps_items_to_the_bit_over_kill_and_wrap() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut bus = Bus::start();
    let first = gateway(&bus, &path);
    let sent: Vec<u16> = (65_500..=65_535).chain(0..40).collect();
    let (before, after) = sent.split_at(30);
    before.iter().for_each(|sequence| bus.say(NODE, *sequence));
    until("the first readings", || count(&path, Kind::Result) == 30);
    first.kill();
    let second = gateway(&bus, &path);
    after.iter().for_each(|sequence| bus.say(NODE, *sequence));
    until("the others", || count(&path, Kind::Result) == 76);
    let (code, out, err) = second.end();
    assert_eq!((code, out.as_str()), (Some(0), "92 items stored.\n"), "{err}");

    let expected: Vec<(i64, i64)> = sent.iter().map(|s| (i64::from(*s < 1_000), i64::from(*s))).collect();
    assert_eq!(numbers(&path, "reading"), expected);
    assert_eq!(numbers(&path, "result"), expected);
    let connection = Connection::open(&path).unwrap();
    let mut statement = connection
        .prepare("SELECT sequence, speed_rpm, p4_cos_um, p4_sin_um, p5_cos_um FROM reading")
        .unwrap();
    let mut rows = statement.query([]).unwrap();
    while let Some(row) = rows.next().unwrap() {
        let given = reading(NODE, row.get(0).unwrap());
        let real = |column| row.get::<_, Option<f64>>(column).unwrap().map(|value| value as f32);
        let probe = given.probes()[3];
        let expected = [Some(given.speed_rpm), Some(probe.cos_um), Some(probe.sin_um), None];
        assert_eq!([1, 2, 3, 4].map(real), expected);
    }
    let sql = "SELECT r.sequence, r.residual_um, r.u2_sin_g_mm FROM result r JOIN reading USING (source, epoch, sequence)";
    let mut statement = connection.prepare(sql).unwrap();
    let mut rows = statement.query([]).unwrap();
    let mut joined = 0;
    while let Some(row) = rows.next().unwrap() {
        let given = result(NODE, row.get(0).unwrap());
        let real = |column| row.get::<_, f64>(column).unwrap() as f32;
        assert_eq!([real(1), real(2)], [given.e_um, given.unbalance_g_mm[1][1]]);
        joined += 1;
    }
    assert_eq!(joined, 76, "every result has its reading");
    let sum: i64 = connection.query_row("SELECT sum(readings) FROM coverage", [], |row| row.get(0)).unwrap();
    assert_eq!(sum, 76);
    for view in ["trend", "flag", "newest"] {
        connection.prepare(&format!("SELECT * FROM {view}")).unwrap().query([]).unwrap().next().unwrap();
    }
    let status = String::from_utf8(run(&["status", path.to_str().unwrap()]).stdout).unwrap();
    assert!(status.contains("north") && status.contains("hall3") && status.contains("1.0 %"), "{status}");
}

#[test]
fn second_gateway_of_same_bus_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let to = path.display().to_string();
    let bus = Bus::start();
    let first = gateway(&bus, &path);
    let same = format!("hall3={}", bus.spec());
    let said = refusal(&["gateway", "--plant", "north", "--bus", &same, "--to", &to]);
    assert!(said.contains("another gateway keeps bus hall3 of north"), "{said}");
    let other = Program::start(&["gateway", "--plant", "south", "--bus", &same, "--to", &to]).listening();
    for program in [first, other] {
        assert_eq!(program.end().0, Some(0));
    }
}

#[test]
fn a_disk_that_is_full_is_told_and_what_is_kept_stays_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut bus = Bus::start();
    let command = format!(
        // a file may grow to 150 kB; without the trap the signal would end the program
        "trap '' XFSZ; ulimit -f 300; exec {} gateway --bus {} --to {}",
        env!("CARGO_BIN_EXE_rotor-edge-plant"),
        bus.spec(),
        path.display()
    );
    let mut shell = Command::new("sh");
    shell.args(["-c", &command]);
    let program = Program::of(shell).listening();
    // there is room for some of them; and a bus keeps 16,384 frames for who reads late
    (0..30).for_each(|sequence| bus.say(NODE, sequence));
    until("the first readings", || count(&path, Kind::Result) == 30);
    (30..900).for_each(|sequence| bus.say(NODE, sequence));
    std::thread::sleep(std::time::Duration::from_secs(2));
    let (code, _, err) = program.end();
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("takes nothing any more"), "{err}");
    assert!(err.lines().last().unwrap().contains("received items could not be stored"), "{err}");
    let kept = numbers(&path, "reading");
    assert!(kept.len() >= 30);
    assert!(kept.iter().zip(0..).all(|((_, sequence), expected)| *sequence == expected), "from the first on");
    let connection = Connection::open(&path).unwrap();
    let whole: String = connection.query_row("PRAGMA integrity_check", [], |row| row.get(0)).unwrap();
    assert_eq!(whole, "ok");
}

#[test]
fn what_is_no_store_or_a_newer_one_is_refused_and_left_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let bus = Bus::start();
    let spec = bus.spec();
    let to = |path: &Path| path.display().to_string();
    let newer = folder.path().join("newer.db");
    drop(Store::open(&newer).unwrap());
    Connection::open(&newer).unwrap().pragma_update(None, "user_version", 99).unwrap();
    let said = refusal(&["gateway", "--bus", &spec, "--to", &to(&newer)]);
    assert!(
        said.contains("newer.db")
            && said.contains(&format!("its version is 99 and this program knows {VERSION};")),
        "{said}"
    );
    let other = folder.path().join("other.db");
    Connection::open(&other)
        .unwrap()
        .execute_batch("CREATE TABLE mine (x); INSERT INTO mine VALUES (1)")
        .unwrap();
    let said = refusal(&["gateway", "--bus", &spec, "--to", &to(&other)]);
    assert!(said.contains("a database of another program"), "{said}");
    let tables: i64 = Connection::open(&other)
        .unwrap()
        .query_row("SELECT count(*) FROM sqlite_schema", [], |r| r.get(0))
        .unwrap();
    assert_eq!(tables, 1);
    let text = folder.path().join("text.db");
    std::fs::write(&text, "speed_rpm\n1000\n".repeat(100)).unwrap();
    assert!(refusal(&["gateway", "--bus", &spec, "--to", &to(&text)]).contains("text.db"));
    let said = refusal(&["gateway", "--bus", &spec, "--bus", &spec, "--to", &to(&newer)]);
    assert!(said.contains("two buses are named"), "{said}");
    let said = refusal(&["gateway", "--bus", &spec, "--to", "nats://127.0.0.1:1"]);
    assert!(said.contains("no NATS server with JetStream"), "{said}");
    assert!(refusal(&["status", &to(&folder.path().join("none.db"))]).contains("no such file"));
}

#[test]
fn first_version_store_is_migrated_with_all_content() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.db");
    let old = Connection::open(&path).unwrap();
    old.execute_batch(&SQLITE.migrations(0).next().unwrap()).unwrap();
    old.execute("INSERT INTO source (plant, bus, node) VALUES ('north', 'hall1', 3)", []).unwrap();
    old.pragma_update(None, "user_version", 1).unwrap();
    old.pragma_update(None, "application_id", 0x726f_746f).unwrap();
    drop(old);
    drop(Store::open(&path).unwrap());
    let now = Connection::open(&path).unwrap();
    let kept: u8 = now.query_row("SELECT node FROM source", [], |row| row.get(0)).unwrap();
    let jobs: u32 = now.query_row("SELECT count(*) FROM job", [], |row| row.get(0)).unwrap();
    let version: i32 = now.pragma_query_value(None, "user_version", |row| row.get(0)).unwrap();
    assert_eq!((kept, jobs, version), (3, 0, VERSION));
}

#[test]
fn foreign_protocol_monitor_is_reported_once_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut bus = Bus::start();
    let gateway = gateway(&bus, &path);
    let version = PROTOCOL_VERSION + 1;
    let state = NodeState::Tracking;
    let told = Message::Heartbeat { version, state, reason: Reason::None, missing_mask: 0, readings: 1 };
    (0..3).for_each(|_| bus.send(&told.encode(NODE)));
    until("its heartbeats", || count(&path, Kind::Heartbeat) == 3);
    let (code, _, err) = gateway.end();
    let said =
        format!("monitor {NODE} speaks version {version} of the protocol, this gateway {PROTOCOL_VERSION}");
    assert_eq!((code, err.matches(&said).count()), (Some(0), 1), "{err}");
}

#[test]
fn command_lines_in_pages_are_accepted_by_program() {
    use clap::Parser as _;
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let pages = ["README.md", "docs/plant.md", "docs/plant-at-scale.md"];
    let pages = pages.map(|page| std::fs::read_to_string(project.join(page)).unwrap());
    let lines = pages.iter().flat_map(|page| page.lines());
    let lines: Vec<&str> = lines.filter(|line| line.starts_with("rotor-edge-plant ")).collect();
    assert!(lines.len() > 15);
    for line in lines {
        rotor_edge_plant::command::Cli::try_parse_from(line.split(' '))
            .unwrap_or_else(|e| panic!("{line}: {e}"));
    }
}

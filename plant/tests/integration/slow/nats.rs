//! Buses over NATS JetStream into a file: stored is what was sent, once, through kills of the server and of who collects.

use std::collections::BTreeSet;
use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::Stdio;

use crate::common::database::Postgres;
use crate::common::nats::Nats;
use crate::common::{Bus, Program, free_port, installed, refusal, until};
use rotor_edge::answers::monitor_result::ResultAnswer;
use rotor_edge_plant::item::{Body, Item};
use rotor_edge_plant::stream::access::Access;
use rotor_edge_plant::stream::server::Server;
use rusqlite::Connection;

const NODES: [u8; 3] = [1, 2, 9];

fn gateway(bus: &Bus, name: &str, nats: &Nats) -> Program {
    let bus_ = format!("{name}={}", bus.spec());
    Program::start(&["gateway", "--plant", "north", "--bus", &bus_, "--to", &nats.address()]).listening()
}

fn collect(nats: &Nats, path: &Path) -> Program {
    Program::start(&["collect", "--from", &nats.address(), "--store", path.to_str().unwrap()])
}

fn rows(path: &Path, table: &str) -> usize {
    let there = Connection::open(path)
        .and_then(|c| c.query_row(&format!("SELECT count(*) FROM {table}"), [], |row| row.get::<_, i64>(0)));
    there.unwrap_or(0) as usize
}

#[test]
fn stored_items_equal_sent_ones_through_kills() {
    const SENT: u16 = 1_000;
    let Some(mut nats) = Nats::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut buses = [Bus::start(), Bus::start()];
    let names = ["hall1", "hall.2 >"];
    let mut gateways: Vec<Program> =
        buses.iter().zip(names).map(|(bus, name)| gateway(bus, name, &nats)).collect();
    let mut collector = Some(collect(&nats, &path));
    let all = usize::from(SENT) * NODES.len() * buses.len();
    for sequence in 0..SENT {
        for bus in &mut buses {
            NODES.iter().for_each(|node| bus.say(*node, sequence));
        }
        match sequence {
            200 | 700 => collector.take().unwrap().kill(),
            250 | 750 => collector = Some(collect(&nats, &path)),
            400 => nats.kill(),
            // what is heard meanwhile waits in the gateways
            450 => nats.restart(),
            _ => std::thread::sleep(std::time::Duration::from_millis(1)),
        }
        // a bus keeps 16,384 frames for who reads late, and a busy machine reads late: no more than that between two of these
        if [150, 350, 600, 850].contains(&sequence) {
            let so_far = (usize::from(sequence) + 1) * NODES.len() * buses.len();
            until("what was sent so far", || rows(&path, "result") == so_far);
        }
        if sequence == 600 {
            // what is acknowledged survives a gateway; what it was about to send would not
            gateways.remove(0).kill();
            gateways.insert(0, gateway(&buses[0], names[0], &nats));
        }
    }
    until("every reading", || rows(&path, "reading") == all);
    until("every result", || rows(&path, "result") == all);
    for gateway in gateways {
        let (code, _, err) = gateway.end();
        assert_eq!(code, Some(0), "{err}");
    }
    let (code, _, err) = collector.unwrap().end();
    assert_eq!(code, Some(0), "{err}");
    let connection = Connection::open(&path).unwrap();
    let sql = "SELECT plant, bus, node, epoch, sequence FROM reading JOIN source ON source = id";
    let mut statement = connection.prepare(sql).unwrap();
    let stored: BTreeSet<(String, String, u8, i64, u16)> = statement
        .query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?)))
        .unwrap()
        .map(Result::unwrap)
        .collect();
    let expected = names.iter().flat_map(|bus| {
        let of_node = move |node: &u8| {
            let node = *node;
            (0..SENT).map(move |s| ("north".to_string(), (*bus).to_string(), node, 0, s))
        };
        NODES.iter().flat_map(of_node)
    });
    assert!(stored == expected.collect(), "{} of {all} readings, or others", stored.len());
}

#[test]
fn full_server_disk_is_reported_and_items_stored_later() {
    const SENT: u16 = 4_000;
    let Some(mut nats) = Nats::on_a_disk_of(3) else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut bus = Bus::start();
    let gateway = gateway(&bus, "hall1", &nats);
    for sequence in 0..SENT {
        bus.say(1, sequence);
        // a bus keeps 16,384 frames for who reads late
        if sequence % 100 == 0 {
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
    }
    let gateway = gateway.saying("takes nothing any more");
    nats.extend_to(200);
    nats.kill();
    nats.restart();
    let gateway = gateway.saying("takes what is heard again");
    let collector = collect(&nats, &path);
    until("every result", || rows(&path, "result") == usize::from(SENT));
    until("every reading", || rows(&path, "reading") == usize::from(SENT));
    assert_eq!(collector.end().0, Some(0));
    assert_eq!(gateway.end().0, Some(0));
}

#[test]
fn lost_database_is_reopened_by_its_collection() {
    let (Some(nats), Some(mut postgres)) = (Nats::start(), Postgres::start()) else { return };
    let mut bus = Bus::start();
    let gateway = gateway(&bus, "hall1", &nats);
    let arguments = ["collect", "--from", &nats.address(), "--store", &postgres.address()];
    let collector = Program::start(&arguments).listening();
    for sequence in 0..3 {
        bus.say(1, sequence);
        until("the reading in the database", || postgres.rows("result") == usize::from(sequence) + 1);
        // a connection that was lost is noticed at the next item only
        postgres.kill();
        postgres.restart();
    }
    let (code, out, err) = collector.end();
    assert_eq!((code, out.as_str()), (Some(0), "6 items stored, 0 invalid messages set aside.\n"), "{err}");
    assert_eq!(err.matches("takes items again").count(), err.matches("takes nothing").count(), "{err}");
    assert_eq!(gateway.end().0, Some(0));
}

#[test]
fn what_is_no_item_is_set_aside_and_told_and_the_rest_is_stored() {
    let Some(nats) = Nats::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut bus = Bus::start();
    let gateway = gateway(&bus, "hall1", &nats);
    let mut raw = TcpStream::connect(("127.0.0.1", nats.port)).unwrap();
    raw.write_all(b"CONNECT {\"verbose\":true}\r\nPUB rotor_edge.north.hall1.x 5\r\nhello\r\nPUB rotor_edge.north.hall1.x 13\r\n{\"schema\": 7}\r\n").unwrap();
    let mut answer = Vec::new();
    while !answer.ends_with(b"+OK\r\n+OK\r\n+OK\r\n") {
        let mut some = [0; 256];
        let length = raw.read(&mut some).unwrap();
        answer.extend_from_slice(&some[..length]);
    }
    bus.say(3, 5);
    let collector = collect(&nats, &path);
    until("the reading", || rows(&path, "result") == 1);
    let (code, out, err) = collector.end();
    assert_eq!((code, out.as_str()), (Some(0), "2 items stored, 2 invalid messages set aside.\n"), "{err}");
    assert!(
        err.contains("set aside: a message that is no item") && err.contains("an item of version 7"),
        "{err}"
    );
    assert_eq!(gateway.end().0, Some(0));
    let (from, store) = (nats.address(), path.display().to_string());
    assert!(refusal(&["collect", "--from", &store, "--store", &store]).contains("expected nats://"));
    assert!(
        refusal(&["collect", "--from", &from, "--store", &from]).contains("expected a file or postgres://")
    );
}

#[test]
fn server_retention_is_applied_and_stays() {
    let Some(nats) = Nats::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    let (store, address) = (folder.path().join("plant.db").display().to_string(), nats.address());
    let bus = Bus::start();
    let spec = bus.spec();
    let server = Server::connect(&address, &Access::default()).unwrap();
    let days = || {
        let stream = server.wait(server.context.get_stream("ROTOR_EDGE")).unwrap();
        stream.cached_info().config.max_age.as_secs_f64() / 86_400.0
    };
    let runs = |words: &[&str], expected: f64| {
        let program = Program::start(words).listening();
        assert_eq!(days(), expected, "{words:?}");
        assert_eq!(program.end().0, Some(0));
    };
    runs(&["gateway", "--bus", &spec, "--to", &address], 0.0);
    runs(&["gateway", "--bus", &spec, "--to", &address, "--keep-days", "0.5"], 0.5);
    runs(&["collect", "--from", &address, "--store", &store, "--keep-days", "3"], 3.0);
    runs(&["gateway", "--bus", &spec, "--to", &address], 3.0);
    let said = refusal(&["gateway", "--bus", &spec, "--to", &store, "--keep-days", "3"]);
    assert!(said.contains("--keep-days applies to NATS servers only"), "{said}");
    let short = crate::common::run(&["gateway", "--bus", &spec, "--to", &address, "--keep-days", "0.01"]);
    assert!(String::from_utf8_lossy(&short.stderr).contains("expected days, at least 0.05"));
}

#[test]
fn a_program_that_speaks_mqtt_hears_results_on_their_topic() {
    let port = free_port();
    let more = format!("server_name: hall\nmqtt {{ listen: \"127.0.0.1:{port}\" }}\n");
    let (Some(nats), Some(client)) = (Nats::start_with(&more, ""), installed("mosquitto_sub", &["/usr/bin"]))
    else {
        return;
    };
    let mut bus = Bus::start();
    let gateway = gateway(&bus, "hall.1", &nats);
    let mut command = std::process::Command::new(client);
    // with its topic in front; ends by itself after one message
    let topics = "rotor_edge/north/+/3/result";
    command.args(["-h", "127.0.0.1", "-p", &port.to_string(), "-t", topics, "-v", "-C", "1"]);
    let mut client = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut sequence = 0;
    // it hears what is told after it has come
    until("a message", || {
        bus.say(9, sequence);
        bus.say(3, sequence);
        sequence += 1;
        client.try_wait().unwrap().is_some()
    });
    let said = std::io::read_to_string(client.stdout.take().unwrap()).unwrap();
    let (topic, message) = said.split_once(' ').unwrap();
    assert_eq!(topic, "rotor_edge/north/hall_2e_1/3/result");
    let item: Item = serde_json::from_str(message).unwrap();
    assert_eq!((item.source.bus.as_str(), item.source.node), ("hall.1", 3));
    assert_eq!(item.body, Body::Result(ResultAnswer::from(&crate::common::result(3, item.sequence))));
    assert_eq!(gateway.end().0, Some(0));
}

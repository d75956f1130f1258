//! Three hundred monitors at ten readings a second through gateways, a leaf node, a hub, a collection and a page: nothing is
//! lost, and what it costs is printed.
//!
//! `ROTOR_EDGE_SECONDS=1800` goes on for half an hour.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpStream;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::common::nats::Nats;
use crate::common::{Bus, PATIENCE, Program, free_port, reading, until};
use rotor_edge_plant::item::Kind;
use rotor_edge_plant::store::Store;

const BUSES: usize = 10;
const NODES: std::ops::RangeInclusive<u8> = 1..=30;
/// Between two readings of a monitor.
const PERIOD: Duration = Duration::from_millis(100);
/// Of the kernel's count of what a process has used, in most kernels.
const TICKS_A_SECOND: f64 = 100.0;

/// What a process has used of the processors, s.
fn used_s(process: u32) -> f64 {
    let text = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    // after the name, which may hold anything
    let fields: Vec<&str> = text.rsplit_once(')').unwrap().1.split_whitespace().collect();
    let ticks = |field: usize| fields[field].parse::<f64>().unwrap();
    (ticks(11) + ticks(12)) / TICKS_A_SECOND
}

/// What a process has had written to the disk, MB.
fn written_mb(process: u32) -> f64 {
    let text = std::fs::read_to_string(format!("/proc/{process}/io")).unwrap();
    let line = text.lines().find_map(|line| line.strip_prefix("write_bytes: ")).unwrap();
    line.parse::<f64>().unwrap() * 1e-6
}

/// The number of the reading whose speed a page shows.
fn shown(line: &str, node: u8, sent: usize) -> Option<usize> {
    (0..sent).rev().find(|sequence| {
        let speed_rpm = reading(node, *sequence as u16).speed_rpm;
        line.contains(&format!("{:.1} rpm", f64::from(speed_rpm)))
    })
}

#[test]
fn three_hundred_monitors_at_ten_readings_a_second_lose_nothing() {
    let seconds: u64 = std::env::var("ROTOR_EDGE_SECONDS").map_or(4, |number| number.parse().unwrap());
    let leaf_port = free_port();
    let (Some(hub), Some(leaf)) = (Nats::hub(leaf_port), Nats::leaf("hall", leaf_port)) else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let store = path.to_str().unwrap();
    let buses: Vec<Bus> = (0..BUSES).map(|_| Bus::start()).collect();
    let gateways = [0, BUSES / 2].map(|first| {
        let mut words =
            vec!["gateway".to_string(), "--plant".into(), "north".into(), "--to".into(), leaf.address()];
        for number in first..first + BUSES / 2 {
            words.extend(["--bus".into(), format!("bus{number}={}", buses[number].spec())]);
        }
        Program::start(&words.iter().map(String::as_str).collect::<Vec<_>>()).listening()
    });
    let from = hub.address();
    let collection =
        Program::start(&["collect", "--from", &from, "--leaf", "hall", "--store", store]).listening();
    let mut page = Program::start(&["serve", store, "--listen", "127.0.0.1:0"]);
    let mut line = String::new();
    BufReader::new(page.child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
    let address = line.strip_prefix("http://").and_then(|rest| rest.split('/').next()).expect(&line);

    let processes = [
        ("gateways", gateways.iter().map(|g| g.child.id()).collect::<Vec<_>>()),
        ("leaf node", vec![leaf.process()]),
        ("hub", vec![hub.process()]),
        ("collection", vec![collection.child.id()]),
        ("page", vec![page.child.id()]),
    ];
    let sum =
        |of: fn(u32) -> f64| processes.each_ref().map(|(_, all)| all.iter().map(|p| of(*p)).sum::<f64>());
    let (before_s, begun) = (sum(used_s), Instant::now());
    let readings = seconds * 1_000 / PERIOD.as_millis() as u64;
    // when each reading of the monitor that is looked at was sent
    let sent: Mutex<Vec<Instant>> = Mutex::new(Vec::new());
    let delays_s: Mutex<Vec<f64>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for (number, mut bus) in buses.into_iter().enumerate() {
            let sent = &sent;
            scope.spawn(move || {
                for sequence in 0..readings {
                    let at = begun + PERIOD * sequence as u32;
                    std::thread::sleep(at.saturating_duration_since(Instant::now()));
                    if number == 0 {
                        sent.lock().unwrap().push(Instant::now());
                    }
                    NODES.for_each(|node| bus.say(node, sequence as u16));
                }
                // whoever listens must have all of it before the bus is gone
                bus
            });
        }
        scope.spawn(|| {
            let mut lines = None;
            until("the page of a monitor", || {
                let mut stream = TcpStream::connect(address).unwrap();
                stream.set_read_timeout(Some(PATIENCE)).unwrap();
                write!(stream, "GET /machine/north/bus0/1/events HTTP/1.1\r\nhost: {address}\r\n\r\n")
                    .unwrap();
                let told = lines.insert(BufReader::new(stream).lines());
                told.next().unwrap().unwrap().contains("200")
            });
            let mut last = None;
            for line in lines.unwrap().map(Result::unwrap) {
                let now = Instant::now();
                let sent = sent.lock().unwrap();
                let Some(newest) = shown(&line, 1, sent.len()) else { continue };
                // the first one that this tells of has waited longest
                if let Some(oldest) = last.map(|last: usize| last + 1).filter(|oldest| *oldest <= newest) {
                    delays_s.lock().unwrap().push((now - sent[oldest]).as_secs_f64());
                }
                last = Some(newest);
                if newest as u64 + 1 == readings {
                    break;
                }
            }
        });
    });
    let (took_s, after_s) = (begun.elapsed().as_secs_f64(), sum(used_s));
    let written = sum(written_mb);
    let all = readings * NODES.count() as u64 * BUSES as u64;
    let store = Store::open(&path).unwrap();
    for kind in [Kind::Reading, Kind::Result] {
        until("every row", || store.count(kind).unwrap() == all);
    }
    for gateway in gateways {
        let (code, _, err) = gateway.end();
        assert_eq!((code, err.contains("lost")), (Some(0), false), "{err}");
    }
    println!("{} rows in {took_s:.0} s; of one processor, and to the disk", 2 * all);
    for (((name, _), mb), (before_s, after_s)) in
        processes.iter().zip(written).zip(before_s.iter().zip(after_s))
    {
        println!("  {name:<11} {:>5.1} % {:>7.1} MB/s", 100.0 * (after_s - before_s) / took_s, mb / took_s);
    }
    let mut delays_s = delays_s.into_inner().unwrap();
    delays_s.sort_by(f64::total_cmp);
    let at = |share: f64| delays_s[((delays_s.len() - 1) as f64 * share) as usize];
    println!(
        "from the bus to the page: median {:.2} s, 90 % {:.2} s, 99 % {:.2} s, longest {:.2} s",
        at(0.5),
        at(0.9),
        at(0.99),
        at(1.0)
    );
}

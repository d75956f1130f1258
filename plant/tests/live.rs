//! `serve`: the page of all monitors follows the store, for a reader, for a program, for Prometheus and for a browser.

mod common;

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::Command;

use common::{PATIENCE, Program, refusal};
use jiff::Timestamp;
use rotor_edge_plant::item::{Body, Heartbeat, Item, SCHEMA, Source};
use rotor_edge_plant::keeper::Keeper as _;
use rotor_edge_plant::store::Store;
use serde_json::Value;

/// A minute from now: on a busy machine nobody falls silent before somebody looks.
fn ahead_us() -> i64 {
    Timestamp::now().as_microsecond() + 60_000_000
}

/// A monitor's sign of life.
fn tell(store: &mut Store, node: u8, sequence: u16, state: &str, reason: &str) {
    let body = Heartbeat { protocol: 1, state: state.into(), reason: reason.into(), readings: 7 };
    let item = Item {
        schema: SCHEMA,
        source: Source { plant: "north".into(), bus: "<hall> \"1\"".into(), node },
        epoch: 0,
        sequence,
        time_us: ahead_us(),
        is_clock_doubtful: false,
        body: Body::Heartbeat(body),
    };
    store.put(&[item]).unwrap();
}

/// The page of a store, and where it is.
fn served(path: &Path) -> (Program, String) {
    let mut program = Program::start(&["serve", path.to_str().unwrap(), "--listen", "127.0.0.1:0"]);
    let mut line = String::new();
    // the rest of what it says is nothing
    BufReader::new(program.child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
    let address = line.strip_prefix("http://").and_then(|rest| rest.split('/').next()).expect(&line);
    (program, address.to_string())
}

fn connected(address: &str, request: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    write!(stream, "{request} HTTP/1.1\r\nhost: {address}\r\nconnection: close\r\n\r\n").unwrap();
    stream
}

/// Head and body of an answer.
fn asked(address: &str, request: &str) -> (String, String) {
    let mut text = String::new();
    connected(address, request).read_to_string(&mut text).unwrap();
    let (head, body) = text.split_once("\r\n\r\n").unwrap();
    (head.to_lowercase(), body.to_string())
}

#[test]
fn who_looks_sees_the_worst_first_and_is_told_of_a_change() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut store = Store::open(&path).unwrap();
    tell(&mut store, 1, 0, "tracking", "none");
    tell(&mut store, 2, 0, "blind", "keyphasor");
    let (program, address) = served(&path);

    let (head, page) = asked(&address, "GET /");
    assert!(
        head.starts_with("http/1.1 200") && head.contains("content-security-policy: default-src 'none'"),
        "{head}"
    );
    assert!(
        page.contains("the keyphasor is missing") && page.contains("&lt;hall&gt; &quot;1&quot;"),
        "{page}"
    );
    assert!(page.find("blind").unwrap() < page.find("tracking").unwrap());
    let monitors: Value = serde_json::from_str(&asked(&address, "GET /monitors").1).unwrap();
    assert_eq!((&monitors[0]["node"], &monitors[0]["state_now"]), (&2.into(), &"blind".into()));
    let (_, numbers) = asked(&address, "GET /metrics");
    let line = "rotor_edge_state{plant=\"north\",bus=\"<hall> \\\"1\\\"\",node=\"2\",state=\"blind\"} 1";
    assert!(numbers.lines().any(|l| l == line), "{numbers}");
    assert!(asked(&address, "POST /monitors").0.starts_with("http/1.1 405"), "it reads and never writes");
    assert!(asked(&address, "GET /plant.db").0.starts_with("http/1.1 404"));

    let events = BufReader::new(connected(&address, "GET /events"));
    tell(&mut store, 1, 1, "flagged", "rise");
    let mut lines = events.lines().map(Result::unwrap);
    let told = lines.find(|line| line.starts_with("data:") && line.contains("flagged")).unwrap();
    assert!(told.contains("the residual rose above its level"), "{told}");
    assert_eq!(program.end().0, Some(0), "whoever still listens is not waited for");
    assert!(refusal(&["serve", "none.db"]).contains("is not there"));
    assert!(
        refusal(&["serve", path.to_str().unwrap(), "--listen", "192.0.2.1:1"])
            .contains("cannot be listened at")
    );
}

#[test]
fn a_browser_shows_every_monitor_of_500_and_logs_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut store = Store::open(&path).unwrap();
    let items = |plant: usize| {
        (0..125).map(move |node| Item {
            schema: SCHEMA,
            source: Source { plant: format!("plant {plant}"), bus: "hall1".into(), node },
            epoch: 0,
            sequence: 0,
            time_us: ahead_us(),
            is_clock_doubtful: false,
            body: Body::Heartbeat(Heartbeat {
                protocol: 1,
                state: "tracking".into(),
                reason: "none".into(),
                readings: 7,
            }),
        })
    };
    store.put(&(0..4).flat_map(items).collect::<Vec<_>>()).unwrap();
    let found =
        Command::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/report/browser")).output().unwrap();
    if !found.status.success() {
        assert!(std::env::var_os("CI").is_none(), "no browser: {}", String::from_utf8_lossy(&found.stderr));
        eprintln!("The browser part of this test DID NOT RUN");
        return;
    }
    let browser = String::from_utf8(found.stdout).unwrap();
    let (_program, address) = served(&path);
    let output = Command::new(browser.trim())
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--enable-logging=stderr",
            "--v=0",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg(format!("http://{address}/"))
        .output()
        .unwrap();
    let shown = String::from_utf8_lossy(&output.stdout);
    assert_eq!(shown.matches("<tr class=").count(), 500);
    assert!(
        shown.contains("plant 3") && shown.contains("<b>500</b>"),
        "{}",
        &shown[..shown.len().min(2_000)]
    );
    let said = String::from_utf8_lossy(&output.stderr);
    let logged: Vec<&str> = said.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(logged.is_empty(), "{logged:?}");
}

//! `serve`: pages follow the store, for a reader, for a program, for Prometheus and for a browser.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::Command;

use crate::common::plant::Plant;
use crate::common::{Bus, PATIENCE, Program, not_run, refusal, until};
use jiff::Timestamp;
use rotor_edge_plant::item::{Body, Heartbeat, Item, Kind, SCHEMA, Source, StateItem};
use rotor_edge_plant::sink::Sink as _;
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
fn served(path: &Path, more: &[&str]) -> (Program, String) {
    let words = [&["serve", path.to_str().unwrap(), "--listen", "127.0.0.1:0"], more].concat();
    let mut program = Program::start(&words);
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
fn request_that_names_another_host_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    drop(Store::open(&path).unwrap());
    let (_program, address) = served(&path, &["--host", "plant-server"]);
    let status = |host: &str| {
        let mut stream = TcpStream::connect(&address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        write!(stream, "GET / HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n\r\n").unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        text.split(' ').nth(1).unwrap().to_string()
    };
    for host in [address.as_str(), "localhost:8370", "plant-server:8370"] {
        assert_eq!(status(host), "200", "{host}");
    }
    assert_eq!(status("evil.example"), "421");
}

#[test]
fn client_that_never_ends_its_request_is_closed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    drop(Store::open(&path).unwrap());
    let (_program, address) = served(&path, &[]);
    let mut half = TcpStream::connect(&address).unwrap();
    half.set_read_timeout(Some(PATIENCE)).unwrap();
    write!(half, "GET / HTTP/1.1\r\nhost: {address}").unwrap();
    let mut said = Vec::new();
    assert_eq!(half.read_to_end(&mut said).unwrap(), said.len(), "the server ends it");
}

#[test]
fn who_looks_sees_the_worst_first_and_is_told_of_a_change() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut store = Store::open(&path).unwrap();
    tell(&mut store, 1, 0, "tracking", "none");
    tell(&mut store, 2, 0, "blind", "keyphasor");
    let (program, address) = served(&path, &[]);

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
    assert!(refusal(&["serve", "none.db"]).contains("no such file"));
    assert!(
        refusal(&["serve", path.to_str().unwrap(), "--listen", "192.0.2.1:1"])
            .contains("cannot be opened for listening")
    );
}

/// Status and body of what a form answers.
fn posted(address: &str, path: &str, fields: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    let length = fields.len();
    write!(
        stream,
        "POST {path} HTTP/1.1\r\nhost: {address}\r\nconnection: close\r\ncontent-type: application/x-www-form-urlencoded\r\n\
         content-length: {length}\r\n\r\n{fields}"
    )
    .unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    let (head, body) = text.split_once("\r\n\r\n").unwrap();
    (head.split(' ').nth(1).unwrap().to_string(), body.to_string())
}

/// Two machines with 40 days of readings, of which the first was tracked and has raised its flag.
fn flagged() -> Plant {
    let plant = Plant::of_days(1..3, 40);
    plant.says(&["fleet", "track", plant.path(), "north/hall1/1"], "1 new job.");
    plant.says(&["worker", plant.path(), "--once"], "1 job done.");
    let mut store = Store::open(Path::new(plant.path())).unwrap();
    let state = StateItem {
        state: "flagged".into(),
        reason: "age".into(),
        missing_mask: 0,
        cause: "rise".into(),
        suspect: Some(2),
        age_s: None,
    };
    let heartbeat = |state: &str| {
        let (state, reason) = (state.into(), "age".into());
        Body::Heartbeat(Heartbeat { protocol: 1, state, reason, readings: 7 })
    };
    let item = |body| Item {
        schema: SCHEMA,
        source: Source { plant: "north".into(), bus: "hall1".into(), node: 1 },
        epoch: 0,
        sequence: 0,
        time_us: ahead_us(),
        is_clock_doubtful: false,
        body,
    };
    store.put(&[item(Body::State(state)), item(heartbeat("flagged"))]).unwrap();
    plant
}

#[test]
fn machine_page_shows_state_and_takes_acknowledgement() {
    let plant = flagged();
    let path = Path::new(plant.path());
    let secret = plant.at("token");
    std::fs::write(&secret, "correct horse battery\n").unwrap();
    let (_program, address) = served(path, &["--token", &secret]);
    let page = "/machine/north/hall1/1";

    let (_, shown) = asked(&address, &format!("GET {page}"));
    for expected in [
        "the residual rose above its level, suspect bearing 16; at present the last judged reading is too old",
        "<h1>turbine: north, hall1, node 1</h1>",
        "class=\"mark main\"",
        "40 days, 0 flags",
        "Last reading",
        "<b>year</b>",
        "15X",
    ] {
        assert!(shown.contains(expected), "{expected} is not in {shown}");
    }
    for wrong in ["age at bearing", "bearing 2", "probe 1", "monitor 1", "unbalance 1"] {
        assert!(!shown.contains(wrong), "{wrong} is no name of the machine's file: {shown}");
    }
    let (_, all) = asked(&address, "GET /");
    for expected in [page, "class=\"tiles\"", ">turbine</a>", "Unbalance:", "class=\"small\""] {
        assert!(all.contains(expected), "{expected} is not on the page of all: {all}");
    }
    assert!(asked(&address, "GET /jobs").1.contains("40 days, 0 flags"));
    let (head, figures) = asked(&address, &format!("GET {page}/figures?hours=87600"));
    assert!(head.contains("frame-ancestors 'self'"), "{head}");
    for expected in ["id=\"vibration\"", "id=\"speed\"", "id=\"at-"] {
        assert!(figures.contains(expected), "{expected} is not among the figures");
    }
    let (_, figures) = asked(&address, &format!("GET {page}/figures?hours=1"));
    assert!(figures.contains("Nothing was recorded in this period."));
    let (head, report) = asked(&address, &format!("GET {page}/report/track"));
    assert!(head.contains("sandbox allow-scripts") && report.contains("<h1>"), "{head}");
    for missing in
        ["/machine/north/hall1/9", "/machine/north/hall1/9/events", &format!("{page}/report/improve")]
    {
        assert!(asked(&address, &format!("GET {missing}")).0.starts_with("http/1.1 404"), "{missing}");
    }

    let (_, rest) = shown.split_once("data-state=\"flagged\" data-since=\"").unwrap();
    let since_us = rest.split('"').next().unwrap();
    let to = format!("{page}/acknowledge");
    let form = |since_us: &str, who: &str, token: &str| {
        posted(&address, &to, &format!("state=flagged&since_us={since_us}&who={who}&token={token}"))
    };
    assert_eq!(form(since_us, "Ada", "wrong+horse+battery").0, "403");
    assert_eq!(form("7", "Ada", "correct+horse+battery").0, "409", "another alarm than it has");
    assert_eq!(form(since_us, "+", "correct+horse+battery").0, "400");
    let monitor = || {
        let monitors: Value = serde_json::from_str(&asked(&address, "GET /monitors").1).unwrap();
        monitors.as_array().unwrap().iter().find(|m| m["node"] == 1).unwrap().clone()
    };
    assert_eq!(monitor()["acknowledged"], Value::Null, "nobody has seen it yet");
    assert_eq!(form(since_us, "Ada+%3CL%3E", "correct+horse+battery").0, "303");
    until("who has seen it", || monitor()["acknowledged"]["who"] == "Ada <L>");
    assert!(asked(&address, "GET /").1.contains("seen by Ada &lt;L&gt;"));
    assert!(!asked(&address, &format!("GET {page}")).1.contains("data-state"), "nothing is left to be seen");

    let (_program, address) = served(path, &[]);
    let (code, said) = posted(&address, &to, &format!("state=flagged&since_us={since_us}&who=Ben&token="));
    assert_eq!(
        (code.as_str(), said.as_str()),
        ("403", "This server only reads: it was started without --token.")
    );
    std::fs::write(&secret, "short\n").unwrap();
    assert!(refusal(&["serve", plant.path(), "--token", &secret]).contains("at least 16 characters"));
}

#[test]
fn what_is_told_on_a_bus_is_told_to_who_looks_at_its_machine() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plant.db");
    let mut bus = Bus::start();
    let named = format!("hall1={}", bus.spec());
    let _gateway =
        Program::start(&["gateway", "--plant", "north", "--bus", &named, "--to", path.to_str().unwrap()])
            .listening();
    bus.say(3, 0);
    let (_program, address) = {
        until("the store", || Store::open(&path).is_ok_and(|store| store.count(Kind::Result).unwrap() == 1));
        served(&path, &[])
    };
    let events = BufReader::new(connected(&address, "GET /machine/north/hall1/3/events"));
    let mut lines = events.lines().map(Result::unwrap);
    let mut delays_ms = Vec::new();
    for sequence in 1..6 {
        let said = std::time::Instant::now();
        bus.say(3, sequence * 90);
        let speed = format!("{:.1} rpm", 3_000.0 + f32::from(sequence) * 10.0);
        lines.find(|line| line.starts_with("data:") && line.contains(&speed)).expect("a live page");
        delays_ms.push(said.elapsed().as_millis());
    }
    println!("from the bus to the page: {delays_ms:?} ms");
}

#[test]
fn a_browser_draws_the_page_of_a_machine_and_logs_no_error() {
    let plant = flagged();
    let (_program, address) = served(Path::new(plant.path()), &[]);
    for path in ["machine/north/hall1/1?hours=87600", "machine/north/hall1/1/figures?hours=87600", "jobs"] {
        let Some((shown, logged)) = in_a_browser(&plant.folder, &format!("http://{address}/{path}")) else {
            return;
        };
        assert!(logged.is_empty(), "{path}: {logged:?}");
        let expected = if path.contains("figures") { "<svg" } else { "40 days, 0 flags" };
        assert!(shown.contains(expected), "{path}: {}", &shown[..shown.len().min(2_000)]);
    }
}

/// What a browser makes of an address, and what it logs; none where there is no browser.
fn in_a_browser(folder: &tempfile::TempDir, address: &str) -> Option<(String, Vec<String>)> {
    let found =
        Command::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/report/browser")).output().unwrap();
    if !found.status.success() {
        not_run(&format!("pages in a browser: {}", String::from_utf8_lossy(&found.stderr).trim()));
        return None;
    }
    let browser = String::from_utf8(found.stdout).unwrap();
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
        .arg(address)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    let logged = said.lines().filter(|line| line.contains("CONSOLE")).map(String::from).collect();
    Some((String::from_utf8_lossy(&output.stdout).into_owned(), logged))
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

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
        let (_program, address) = served(&path, &[]);
        let Some((shown, logged)) = in_a_browser(&folder, &format!("http://{address}/")) else { return };
        assert_eq!(shown.matches("class=\"place\"").count(), 500);
        assert!(
            shown.contains("plant 3") && shown.contains("<b>500</b>"),
            "{}",
            &shown[..shown.len().min(2_000)]
        );
        assert!(logged.is_empty(), "{logged:?}");
    }
}

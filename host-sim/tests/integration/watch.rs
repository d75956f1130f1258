//! `rotor-edge watch` as a user meets it: real programs, real sockets, a real terminal.

use std::io::{BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::program::{assert_says, refusal, rotor_edge};
use crate::shared::{PATIENCE, Shared, signal};
use nix::sys::signal::Signal;
use rotor_edge::bus::CanBus;
use rotor_edge::clock::RealTime;
use rotor_edge::edge::{Deployment, EdgeModel, encoded};
use rotor_edge::node::{Controller, Store, serve};
use rotor_edge::sample;
use rotor_edge_core::can::{
    Message, MonitorResult, NumberedReading, PROTOCOL_VERSION, ResultAssembler, reading_frames,
};
use rotor_edge_core::node::NodeConfig;
use serde_json::Value;

const NODE: u8 = 4;

/// Waits until somebody on the bus asks for versions, as `watch` does when it has joined.
fn await_question(bus: &mut dyn CanBus) {
    let begun = Instant::now();
    while begun.elapsed() < PATIENCE {
        let heard = bus.receive(Duration::from_millis(50)).unwrap();
        if heard.is_some_and(|frame| Message::decode(&frame).is_ok_and(|(_, m)| m == Message::VersionQuery)) {
            return;
        }
    }
    panic!("nobody asks for versions");
}

/// Waits for two heartbeats of the monitor that count so many readings.
fn await_heartbeats(bus: &mut dyn CanBus, number: usize) {
    let begun = Instant::now();
    let mut heard = 0;
    while heard < 2 {
        assert!(begun.elapsed() < PATIENCE, "no heartbeat with {number} readings");
        let Some(frame) = bus.receive(Duration::from_millis(50)).unwrap() else { continue };
        let message = Message::decode(&frame).map(|(_, message)| message);
        heard += usize::from(
            matches!(message, Ok(Message::Heartbeat { readings, .. }) if readings as usize == number),
        );
    }
}

fn model() -> (EdgeModel, Deployment) {
    let (mut rotor, ..) = sample::load().unwrap();
    for (plane, unbalance) in rotor.plane.iter_mut().zip([900.0, 700.0]) {
        (plane.unbalance_g_mm, plane.angle_deg) = (Some(unbalance), Some(40.0));
    }
    let deployment = Deployment::new(&rotor, 11_500.0).unwrap();
    (deployment.edge.clone(), deployment)
}

/// The sample's first days, told to the monitor; what it answered.
fn tell_readings(host: &mut dyn CanBus, deployment: &Deployment, number: usize) -> Vec<MonitorResult> {
    let (_, record, _) = sample::load().unwrap();
    let (mut answers, mut assembler) = (Vec::new(), ResultAssembler::new());
    let complete = record.iter().map(|measured| deployment.reading(measured)).filter(|r| r.is_complete());
    for (sequence, reading) in complete.take(number).enumerate() {
        for frame in reading_frames(NODE, &NumberedReading::new(sequence as u16, reading)) {
            host.send(&frame).unwrap();
        }
        let begun = Instant::now();
        while answers.len() <= sequence {
            assert!(begun.elapsed() < PATIENCE, "no answer to reading {sequence}");
            if let Some(frame) = host.receive(Duration::from_millis(5)).unwrap() {
                answers.extend(assembler.receive(&frame));
            }
        }
    }
    answers
}

/// Runs a monitor on the bus beside `work`.
fn beside_a_monitor<T>(bus: &Shared, model: EdgeModel, work: impl FnOnce() -> T) -> T {
    let mut port = bus.join("slcan");
    let stop = AtomicBool::new(false);
    let store = Store::in_memory().with_initial_model(encoded(&model).unwrap());
    let mut controller = Controller::start(NodeConfig::new(NODE), store, 0).unwrap();
    std::thread::scope(|scope| {
        let served =
            scope.spawn(|| serve(&mut *port, &mut controller, &RealTime::start(), &stop, |_| ()).unwrap());
        let result = work();
        stop.store(true, Ordering::Relaxed);
        served.join().unwrap();
        result
    })
}

#[test]
fn watch_json_and_log_hold_every_message_of_monitor() {
    let bus = Shared::start(&[]);
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("heard.log");
    let (edge, deployment) = model();
    let (said, answers) = beside_a_monitor(&bus, edge.clone(), || {
        let mut host = bus.join("slcan");
        let watch = crate::program::program()
            .args(["watch", "--bus", bus.spec("socketcand"), "--json", "--record"])
            .arg(&log)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        await_question(&mut *host);
        // ready once it has told its state twice; the same after the readings, so that `watch` has heard it as well
        await_heartbeats(&mut *host, 0);
        let answers = tell_readings(&mut *host, &deployment, 20);
        await_heartbeats(&mut *host, answers.len());
        signal(watch.id(), Signal::SIGTERM);
        (watch.wait_with_output().unwrap(), answers)
    });
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    let all: Value = serde_json::from_slice(&said.stdout).expect("one JSON object");
    assert_eq!(all["bus"]["name"], bus.spec("socketcand"));
    assert!(all["bus"]["load_percent"].as_f64().unwrap() > 0.0);
    let [monitor] = &all["monitors"].as_array().unwrap()[..] else { panic!("one monitor: {all}") };
    assert_eq!((&monitor["node"], &monitor["version"]["protocol"]), (&NODE.into(), &PROTOCOL_VERSION.into()));
    assert_eq!(monitor["model_checksum"], format!("{:08x}", edge.checksum()));
    assert_eq!((&monitor["silent"], &monitor["conflict"]), (&false.into(), &false.into()));
    assert_eq!(monitor["counters"]["readings"], answers.len());
    let history = monitor["history"].as_array().unwrap();
    assert_eq!(history.len(), answers.len());
    for (heard, answer) in history.iter().zip(&answers) {
        assert_eq!(heard["sequence"], answer.sequence);
        assert_eq!(heard["ratio"].as_f64().unwrap() as f32, answer.ratio);
        let [x, y] = answer.unbalance_g_mm[0].map(f64::from);
        let [size, angle_deg] =
            ["unbalance_g_mm", "angle_deg"].map(|key| heard["planes"][0][key].as_f64().unwrap());
        assert!((size - x.hypot(y)).abs() <= 1e-9 * size);
        assert!((angle_deg - y.atan2(x).to_degrees()).abs() < 1e-9);
    }
    // all that was heard, and its own questions, which it does not hear: to everybody, and to a monitor that was not ready
    let text = std::fs::read_to_string(&log).unwrap();
    let (questions, heard): (Vec<&str>, Vec<&str>) =
        text.lines().partition(|line| ["7FF#", "7E4#"].iter().any(|question| line.contains(question)));
    assert!((1..=2).contains(&questions.len()), "{questions:?}");
    assert_eq!(heard.len() as u64, all["bus"]["frames"].as_u64().unwrap());
}

#[test]
fn without_a_terminal_it_says_to_use_json_and_touches_no_file() {
    let bus = Shared::start(&[]);
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("none.log");
    let said = refusal(&["watch", "--bus", bus.spec("slcan"), "--record", log.to_str().unwrap()]);
    assert_says(&said, &["standard output is none", "use --json", "--seconds S"]);
    assert!(!Path::new(&log).exists());
}

#[test]
fn absent_monitor_and_invalid_watch_arguments_are_refused() {
    let bus = Shared::start(&[]);
    let json = ["watch", "--bus", bus.spec("slcan"), "--json", "--seconds", "0.3"];
    assert_says(&refusal(&[&json[..], &["--node", "7"]].concat()), &["monitor 7 sent no frame"]);
    let empty = rotor_edge(&json);
    assert!(empty.status.success());
    let all: Value = serde_json::from_slice(&empty.stdout).unwrap();
    assert_eq!(all["monitors"], Value::Array(vec![]));
    assert_says(&refusal(&[&json[..], &["--bit-rate", "5"]].concat()), &["--bit-rate 5", "1000000"]);
    for wrong in [["--node", "31"], ["--seconds", "0"], ["--seconds", "-1"], ["--seconds", "inf"]] {
        let [name, value] = wrong;
        let arguments = ["watch", "--json", "--bus", bus.spec("slcan"), &format!("{name}={value}")];
        assert_eq!(rotor_edge(&arguments).status.code(), Some(2), "{wrong:?}");
    }
}

/// `rotor-edge watch` on a terminal of its own, 80 by 24, made by `script`.
#[cfg(target_os = "linux")]
struct OnTerminal {
    program: Child,
    keys: ChildStdin,
    heard: std::sync::mpsc::Receiver<u8>,
    shown: Vec<u8>,
}

#[cfg(target_os = "linux")]
impl OnTerminal {
    fn start(bus: &Shared) -> Self {
        let program = env!("CARGO_BIN_EXE_rotor-edge");
        let line =
            format!("stty rows 24 cols 80; echo pid=$$.; exec '{program}' watch --bus {}", bus.spec("slcan"));
        let mut program = Command::new("script")
            .args(["-qefc", &line, "/dev/null"])
            .env("TERM", "xterm-256color")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("script, of util-linux");
        let (sender, heard) = std::sync::mpsc::channel();
        let stdout = program.stdout.take().unwrap();
        std::thread::spawn(move || {
            for byte in BufReader::new(stdout).bytes() {
                // the test may be over
                let _ = sender.send(byte.unwrap());
            }
        });
        let keys = program.stdin.take().unwrap();
        Self { program, keys, heard, shown: Vec::new() }
    }

    /// Waits until this was written where the terminal was empty before; blanks are skipped in writing.
    fn await_word(&mut self, word: &str) {
        let begun = Instant::now();
        while !self.all().contains(word) {
            assert!(begun.elapsed() < PATIENCE, "{word:?} is missing in {:?}", self.all());
            if let Ok(byte) = self.heard.recv_timeout(Duration::from_millis(50)) {
                self.shown.push(byte);
            }
        }
    }

    fn all(&self) -> String {
        String::from_utf8_lossy(&self.shown).into_owned()
    }

    fn pid(&self) -> u32 {
        let all = self.all();
        let (_, rest) = all.split_once("pid=").unwrap();
        rest.split_once('.').unwrap().0.parse().unwrap()
    }

    fn key(&mut self, key: &str) {
        self.keys.write_all(key.as_bytes()).unwrap();
        self.keys.flush().unwrap();
    }

    /// Waits for the end; exit code and all that was shown.
    fn end(mut self) -> (Option<i32>, String) {
        let code = self.program.wait().unwrap().code();
        self.shown.extend(self.heard.iter());
        (code, self.all())
    }
}

/// What stands after the terminal was given back: the usual screen and the cursor.
#[cfg(target_os = "linux")]
fn after_restoring(shown: &str) -> String {
    const LEAVE_SCREEN: &str = "\x1b[?1049l";
    const SHOW_CURSOR: &str = "\x1b[?25h";
    assert!(shown.contains("\x1b[?1049h"), "it had a screen of its own: {shown:?}");
    let (_, after) = shown.rsplit_once(LEAVE_SCREEN).expect("the usual screen comes back");
    assert!(after.contains(SHOW_CURSOR), "the cursor comes back: {after:?}");
    after.replace(SHOW_CURSOR, "").trim().to_string()
}

#[test]
#[cfg(target_os = "linux")]
fn terminal_shows_monitor_and_q_restores_it() {
    let bus = Shared::start(&[]);
    let (edge, deployment) = model();
    beside_a_monitor(&bus, edge, || {
        let mut terminal = OnTerminal::start(&bus);
        let mut host = bus.join("slcan");
        // the counters of a monitor, then the unbalance in its results
        terminal.await_word("readings");
        tell_readings(&mut *host, &deployment, 5);
        terminal.await_word("static");
        terminal.key("p");
        terminal.await_word("PAUSED");
        terminal.key("q");
        let (code, shown) = terminal.end();
        assert_eq!((code, after_restoring(&shown).as_str()), (Some(0), ""));
    });
}

#[test]
#[cfg(target_os = "linux")]
fn signals_restore_terminal_and_lost_bus_is_shown() {
    for (sent, key) in [(Some(Signal::SIGTERM), None), (Some(Signal::SIGINT), None), (None, Some("\x03"))] {
        let bus = Shared::start(&[]);
        let mut terminal = OnTerminal::start(&bus);
        terminal.await_word("Nothing");
        if let Some(sent) = sent {
            signal(terminal.pid(), sent);
        }
        key.iter().for_each(|key| terminal.key(key));
        let (code, shown) = terminal.end();
        assert_eq!((code, after_restoring(&shown).as_str()), (Some(0), ""), "{sent:?} {key:?}");
    }
    let bus = Shared::start(&[]);
    let mut terminal = OnTerminal::start(&bus);
    terminal.await_word("Nothing");
    bus.end(Signal::SIGKILL);
    terminal.await_word("gone");
    terminal.key("q");
    let (code, shown) = terminal.end();
    assert_eq!((code, after_restoring(&shown).as_str()), (Some(0), ""));
}

#[test]
#[cfg(target_os = "linux")]
fn a_terminal_that_is_closed_ends_it() {
    let bus = Shared::start(&[]);
    let mut terminal = OnTerminal::start(&bus);
    terminal.await_word("Nothing");
    // the keyboard is in use by now
    terminal.key("p");
    terminal.await_word("PAUSED");
    let of_process = format!("/proc/{}", terminal.pid());
    assert!(Path::new(&of_process).exists());
    terminal.program.kill().unwrap();
    terminal.program.wait().unwrap();
    let begun = Instant::now();
    while Path::new(&of_process).exists() {
        assert!(begun.elapsed() < PATIENCE, "it is still there without its terminal");
        std::thread::sleep(Duration::from_millis(20));
    }
}

//! A bus with monitors that nobody is, the program, and a NATS server.

#![allow(dead_code, reason = "each test uses a part")]

pub mod database;
pub mod nats;
pub mod plant;
pub mod wire;

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Output, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use rotor_edge::bus::server::Server;
use rotor_edge::bus::{CanBus, open};
use rotor_edge_core::can::{Frame, MonitorResult, NumberedReading, reading_frames, result_frames};
use rotor_edge_core::reading::{ProbeVector, Reading};
use rotor_edge_core::state::Reason;

/// Far longer than anything here takes, on a busy machine too.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Waits until something holds.
#[track_caller]
pub fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < PATIENCE, "{what} did not come");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A bus, and who sends on it what probes see and what monitors answer.
pub struct Bus {
    server: Server,
    sender: Box<dyn CanBus>,
}

impl Bus {
    pub fn start() -> Self {
        let server = Server::start(0, 0, None).unwrap();
        let sender = open(&format!("slcan:127.0.0.1:{}", server.slcan_port)).unwrap();
        Self { server, sender }
    }

    pub fn spec(&self) -> String {
        format!("socketcand:127.0.0.1:{}/vcan0", self.server.socketcand_port)
    }

    pub fn send(&mut self, frame: &Frame) {
        self.sender.send(frame).unwrap();
    }

    /// A reading of a monitor and its result.
    pub fn say(&mut self, node: u8, sequence: u16) {
        let numbered = NumberedReading::new(sequence, reading(node, sequence));
        for frame in &reading_frames(node, &numbered) {
            self.send(frame);
        }
        for frame in &result_frames(node, &result(node, sequence)) {
            self.send(frame);
        }
    }
}

/// Another one for every number, with numbers that no decimal of a few digits is.
pub fn reading(node: u8, sequence: u16) -> Reading {
    let vector = |probe: u8| ProbeVector {
        cos_um: f32::from(sequence) / 7.0 + f32::from(probe),
        sin_um: -f32::from(node) / 3.0,
    };
    Reading::new(3_000.0 + f32::from(sequence) / 9.0, &[0, 1, 2, 3].map(vector)).unwrap()
}

pub fn result(node: u8, sequence: u16) -> MonitorResult {
    let part = f32::from(sequence) / 11.0;
    MonitorResult {
        sequence,
        flags: 0,
        suspect: None,
        redundancy: 4,
        streak: 0,
        used_mask: 15,
        reason: Reason::None,
        planes: 2,
        unbalance_g_mm: [[part, 1.0], [2.0, f32::from(node)], [0.0; 2], [0.0; 2]],
        static_g_mm: [part, 3.0],
        dynamic_g_mm: [4.0, 5.0],
        e_um: part,
        ratio: 0.01,
        floor_um: 1.0,
        level_um: 2.0,
    }
}

/// The program while it runs.
pub struct Program {
    pub child: Child,
    errors: BufReader<ChildStderr>,
}

impl Program {
    pub fn start(arguments: &[&str]) -> Self {
        let mut program = Command::new(env!("CARGO_BIN_EXE_rotor-edge-plant"));
        program.args(arguments);
        Self::of(program)
    }

    pub fn of(mut command: Command) -> Self {
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let errors = BufReader::new(child.stderr.take().unwrap());
        Self { child, errors }
    }

    /// When it has said that it listens: what is sent from now on is heard.
    pub fn listening(self) -> Self {
        self.saying("Ctrl-C ends it")
    }

    /// When it has said this.
    pub fn saying(mut self, words: &str) -> Self {
        let mut said = String::new();
        while !said.contains(words) {
            assert!(self.errors.read_line(&mut said).unwrap() > 0, "it ended: {said}");
        }
        self
    }

    pub fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Ends it as a person would: exit code, standard output and what else it said on standard error.
    pub fn end(mut self) -> (Option<i32>, String, String) {
        kill(Pid::from_raw(self.child.id() as i32), Signal::SIGTERM).unwrap();
        let [mut out, mut err] = [String::new(), String::new()];
        self.child.stdout.take().unwrap().read_to_string(&mut out).unwrap();
        self.errors.read_to_string(&mut err).unwrap();
        (self.child.wait().unwrap().code(), out, err)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // a test that failed leaves nothing behind
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A program of Debian's; `None` where there is none and none can be installed, which CI does not allow.
pub fn installed(name: &str, folders: &[&str]) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let find = || {
        let all = std::env::split_paths(&path).chain(folders.iter().map(PathBuf::from));
        all.map(|folder| folder.join(name)).find(|file| file.is_file())
    };
    let found = find().or_else(|| {
        let install = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.ci/install");
        Command::new(install).arg("plant").status().ok().filter(std::process::ExitStatus::success)?;
        find()
    });
    if found.is_none() {
        not_run(&format!("for want of {name} (.ci/install plant)"));
    }
    found
}

/// Says that a test, or a part of it, did not run, which CI does not allow.
pub fn not_run(why: &str) {
    assert!(std::env::var_os("CI").is_none(), "NOT RUN, {why}");
    // what a test prints is not shown where it passes, unless it is written so
    std::io::stderr().write_all(format!("NOT RUN, {why}\n").as_bytes()).unwrap();
}

/// A port that nobody listens at.
pub fn free_port() -> u16 {
    std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

pub fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rotor-edge-plant"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

/// The one sentence that it fails with.
#[track_caller]
pub fn refusal(arguments: &[&str]) -> String {
    let output = run(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_eq!(said.trim_end().lines().count(), 1, "one sentence: {said}");
    said
}

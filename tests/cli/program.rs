//! The real program as tests of several commands run it: one run, one refusal, one shared bus.

use std::io::{BufRead, BufReader, Read};
use std::net::TcpStream;
use std::process::{Child, ChildStderr, Command, Output, Stdio};
use std::time::Duration;

use rotor_edge::bus::{CanBus, open};
use serde_json::Value;

/// Far longer than anything here takes, on a busy machine too.
pub const PATIENCE: Duration = Duration::from_secs(20);

pub fn rotor_edge(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rotor-edge")).args(arguments).output().unwrap()
}

/// The one sentence that it fails with.
pub fn refusal(arguments: &[&str]) -> String {
    let output = rotor_edge(arguments);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(output.stdout.is_empty(), "nothing half-done on standard output");
    assert_eq!(message.trim_end().lines().count(), 1, "one sentence: {message}");
    message
}

#[track_caller]
pub fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "\"{part}\" is missing in: {message}");
    }
}

pub fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("one JSON object on standard output")
}

/// A running `rotor-edge bus` on free ports.
pub struct Shared {
    pub program: Child,
    /// Unless a test reads it itself.
    pub stderr: Option<BufReader<ChildStderr>>,
    pub opened: Value,
}

impl Shared {
    pub fn start(more: &[&str]) -> Self {
        let mut program = Command::new(env!("CARGO_BIN_EXE_rotor-edge"))
            .args(["bus", "--json", "--slcan", "0", "--socketcand", "0"])
            .args(more)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut text = String::new();
        for line in BufReader::new(program.stdout.take().unwrap()).lines() {
            let line = line.unwrap();
            text += &line;
            if line == "}" {
                break;
            }
        }
        let stderr = program.stderr.take().map(BufReader::new);
        Self { program, stderr, opened: serde_json::from_str(&text).expect(&text) }
    }

    pub fn spec(&self, kind: &str) -> &str {
        self.opened[kind].as_str().unwrap()
    }

    pub fn join(&self, kind: &str) -> Box<dyn CanBus> {
        open(self.spec(kind)).unwrap()
    }

    pub fn raw(&self, port: &str) -> TcpStream {
        let port = self.opened[port].as_u64().unwrap() as u16;
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// Sends a signal; exit code and what was said.
    pub fn end(mut self, signal: &str) -> (Option<i32>, String) {
        let kill = Command::new("kill").args([signal, &self.program.id().to_string()]).status().unwrap();
        assert!(kill.success());
        let code = self.program.wait().unwrap().code();
        (code, self.rest_said())
    }

    /// What is said until the end.
    pub fn rest_said(&mut self) -> String {
        let mut said = String::new();
        if let Some(stderr) = &mut self.stderr {
            stderr.read_to_string(&mut said).unwrap();
        }
        said
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // gone already, unless the test failed
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

//! One shared bus, as tests of several commands join it.

#![allow(dead_code, reason = "each test uses a part")]

use std::io::{BufRead, BufReader, Read};
use std::net::TcpStream;
use std::process::{Child, ChildStderr, Stdio};
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use rotor_edge::bus::{CanBus, open};
use serde_json::Value;

/// Far longer than anything here takes, on a busy machine too.
pub const PATIENCE: Duration = Duration::from_secs(20);

pub fn signal(pid: u32, signal: Signal) {
    kill(Pid::from_raw(pid as i32), signal).unwrap();
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
        let mut program = crate::program::program();
        program.args(["bus", "--json", "--slcan", "0", "--socketcand", "0"]).args(more);
        Self::of(program.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap())
    }

    /// The bus again, on the ports that it had.
    pub fn restart(&mut self) {
        let port = |name: &str| self.opened[name].to_string();
        let (slcan, socketcand) = (port("slcan_port"), port("socketcand_port"));
        let mut program = crate::program::program();
        program.args(["bus", "--json", "--slcan", &slcan, "--socketcand", &socketcand]);
        *self = Self::of(program.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap());
    }

    /// Ends it without a word to anybody.
    pub fn kill(&mut self) {
        self.program.kill().unwrap();
        self.program.wait().unwrap();
    }

    /// A bus that prints where it is, as JSON.
    pub fn of(mut program: Child) -> Self {
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
    pub fn end(mut self, with: Signal) -> (Option<i32>, String) {
        signal(self.program.id(), with);
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

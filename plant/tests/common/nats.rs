//! NATS servers with JetStream: alone, or as a hub with leaf nodes.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use super::{free_port, installed, until};

pub struct Nats {
    program: Option<Child>,
    found: PathBuf,
    folder: tempfile::TempDir,
    pub port: u16,
}

impl Nats {
    pub fn start() -> Option<Self> {
        Self::start_with("", "")
    }

    /// With more settings, of the server and of its JetStream.
    pub fn start_with(more: &str, of_jetstream: &str) -> Option<Self> {
        let found = installed("nats-server", &["/usr/sbin", "/usr/bin"])?;
        let folder = tempfile::tempdir().unwrap();
        let port = free_port();
        let store = folder.path().join("store");
        let settings = format!(
            "listen: \"127.0.0.1:{port}\"\njetstream {{ store_dir: {:?}, {of_jetstream} }}\n{more}",
            store.display().to_string()
        );
        std::fs::write(folder.path().join("nats.conf"), settings).unwrap();
        let mut nats = Self { program: None, found, folder, port };
        nats.restart();
        Some(nats)
    }

    /// One that leaf nodes join at a port.
    pub fn hub(leaf_port: u16) -> Option<Self> {
        let more = format!("server_name: hub\nleafnodes {{ listen: \"127.0.0.1:{leaf_port}\" }}\n");
        Self::start_with(&more, "domain: hub")
    }

    /// One that joins a hub at a port and stores by itself, a domain of its own.
    pub fn leaf(domain: &str, hub_port: u16) -> Option<Self> {
        let more = format!(
            "server_name: {domain}\nleafnodes {{ reconnect: 1, remotes: [ {{ url: \"nats-leaf://127.0.0.1:{hub_port}\" }} ] }}\n"
        );
        Self::start_with(&more, &format!("domain: {domain}"))
    }

    pub fn address(&self) -> String {
        format!("nats://127.0.0.1:{}", self.port)
    }

    pub fn process(&self) -> u32 {
        self.program.as_ref().unwrap().id()
    }

    pub fn kill(&mut self) {
        if let Some(mut program) = self.program.take() {
            program.kill().unwrap();
            program.wait().unwrap();
        }
    }

    /// Starts it again if it was killed.
    pub fn restart(&mut self) {
        if self.program.is_some() {
            return;
        }
        let mut program = Command::new(&self.found);
        program
            .arg("-c")
            .arg(self.folder.path().join("nats.conf"))
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        self.program = Some(program.spawn().unwrap());
        until("the NATS server", || std::net::TcpStream::connect(("127.0.0.1", self.port)).is_ok());
    }
}

impl Drop for Nats {
    fn drop(&mut self) {
        self.kill();
    }
}

//! NATS servers with JetStream: alone, or as a hub with leaf nodes.

use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use super::{free_port, installed, not_run, until};

pub struct Nats {
    program: Option<Child>,
    found: PathBuf,
    disk: Option<Disk>,
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
        let mut nats = Self { program: None, found, disk: None, folder, port };
        nats.restart();
        Some(nats)
    }

    /// One whose files are on a disk of so many MB; none where nobody may make such a disk, which CI does not allow.
    pub fn on_a_disk_of(megabytes: u32) -> Option<Self> {
        let mut nats = Self::start()?;
        nats.kill();
        let store = nats.folder.path().join("store");
        std::fs::remove_dir_all(&store).unwrap();
        std::fs::create_dir(&store).unwrap();
        nats.disk = Disk::at(store, megabytes);
        if nats.disk.is_none() {
            not_run("a server whose disk is full: nobody may make a small disk here (unshare, mount)");
            return None;
        }
        nats.restart();
        Some(nats)
    }

    /// Its disk is larger from now on.
    pub fn extend_to(&self, megabytes: u32) {
        self.disk.as_ref().unwrap().extend_to(megabytes);
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
        let mut program = self.disk.as_ref().map_or_else(
            || Command::new(&self.found),
            |disk| {
                let mut inside = disk.inside();
                inside.arg(&self.found);
                inside
            },
        );
        program
            .arg("-c")
            .arg(self.folder.path().join("nats.conf"))
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        self.program = Some(program.spawn().unwrap());
        until("the NATS server", || std::net::TcpStream::connect(("127.0.0.1", self.port)).is_ok());
    }
}

/// A small disk in memory, in a view of the file system that only those have who enter it.
struct Disk {
    holder: Child,
    path: PathBuf,
}

impl Disk {
    fn at(path: PathBuf, megabytes: u32) -> Option<Self> {
        let script =
            format!("mount -t tmpfs -o size={megabytes}m none \"$0\" && echo mounted && exec sleep 3600");
        let mut holder = Command::new("unshare")
            .args(["--map-root-user", "--mount", "sh", "-c", &script])
            .arg(&path)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .ok()?;
        let mut said = String::new();
        BufReader::new(holder.stdout.take().unwrap()).read_line(&mut said).unwrap();
        let disk = Self { holder, path };
        (said == "mounted\n").then_some(disk)
    }

    /// What is run by somebody who sees the disk.
    fn inside(&self) -> Command {
        let mut command = Command::new("nsenter");
        let process = self.holder.id().to_string();
        command.args(["--target", &process, "--user", "--mount", "--preserve-credentials"]);
        command
    }

    fn extend_to(&self, megabytes: u32) {
        let size = format!("remount,size={megabytes}m");
        assert!(self.inside().args(["mount", "-o", &size]).arg(&self.path).status().unwrap().success());
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = self.holder.kill();
        let _ = self.holder.wait();
    }
}

impl Drop for Nats {
    fn drop(&mut self) {
        self.kill();
    }
}

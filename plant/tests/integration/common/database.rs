//! A PostgreSQL server of its own, of a user that is not root, as it wants it.

use std::os::unix::fs::chown;
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::{Pid, User, geteuid};
use postgres::{Client, NoTls};

use super::{free_port, installed, until};

const FOLDERS: [&str; 4] = [
    "/usr/lib/postgresql/15/bin",
    "/usr/lib/postgresql/16/bin",
    "/usr/lib/postgresql/17/bin",
    "/usr/lib/postgresql/18/bin",
];

pub struct Postgres {
    program: Option<Child>,
    folder: tempfile::TempDir,
    found: PathBuf,
    port: u16,
}

impl Postgres {
    pub fn start() -> Option<Self> {
        let initdb = installed("initdb", &FOLDERS)?;
        let found = initdb.with_file_name("postgres");
        let folder = tempfile::tempdir().unwrap();
        if let Some(nobody) = nobody() {
            chown(folder.path(), Some(nobody.0), Some(nobody.1)).unwrap();
        }
        let mut postgres = Self { program: None, folder, found, port: free_port() };
        let made = postgres
            .command(&initdb)
            .args(["-U", "plant", "-A", "trust", "-D"])
            .arg(postgres.data())
            .output()
            .unwrap();
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        postgres.restart();
        Some(postgres)
    }

    fn data(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    fn command(&self, program: &std::path::Path) -> Command {
        let mut command = Command::new(program);
        command
            .current_dir(self.folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        if let Some((user, group)) = nobody() {
            command.uid(user).gid(group);
        }
        command
    }

    pub fn address(&self) -> String {
        format!("postgres://plant@127.0.0.1:{}/postgres", self.port)
    }

    pub fn client(&self) -> Client {
        Client::connect(&self.address(), NoTls).unwrap()
    }

    /// Rows of a table; 0 where there is none yet, or no server.
    pub fn rows(&self, table: &str) -> usize {
        let count = |mut client: Client| client.query_one(&format!("SELECT count(*) FROM {table}"), &[]);
        let counted = Client::connect(&self.address(), NoTls).and_then(count);
        counted.map_or(0, |row| row.get::<_, i64>(0) as usize)
    }

    /// All of its processes at once, as a power cut would.
    pub fn kill(&mut self) {
        if let Some(mut program) = self.program.take() {
            kill(Pid::from_raw(-(program.id() as i32)), Signal::SIGKILL).unwrap();
            program.wait().unwrap();
        }
    }

    /// Starts it again if it was killed.
    pub fn restart(&mut self) {
        if self.program.is_some() {
            return;
        }
        let mut program = self.command(&self.found);
        program.arg("-D").arg(self.data()).args(["-h", "127.0.0.1", "-p", &self.port.to_string(), "-k", ""]);
        // a group of its own, and what a killed one left of its shared memory may take a moment to go
        self.program = Some(program.process_group(0).spawn().unwrap());
        until("PostgreSQL", || {
            if self.program.as_mut().is_some_and(|p| p.try_wait().unwrap().is_some()) {
                self.program = Some(program.spawn().unwrap());
            }
            Client::connect(&self.address(), NoTls).is_ok()
        });
    }
}

/// Whom root hands it to.
fn nobody() -> Option<(u32, u32)> {
    let user = User::from_name("nobody").unwrap().expect("nobody");
    geteuid().is_root().then(|| (user.uid.as_raw(), user.gid.as_raw()))
}

impl Drop for Postgres {
    fn drop(&mut self) {
        self.kill();
    }
}

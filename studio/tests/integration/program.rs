//! A studio as a process.

use std::ffi::OsStr;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

pub struct Studio {
    child: Child,
    pub address: String,
}

impl Studio {
    /// Starts it in a folder with these words.
    pub fn start<S: AsRef<OsStr>>(folder: &Path, words: &[S]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_rotor-edge-studio"))
            .current_dir(folder)
            .env("XDG_STATE_HOME", folder.join("state"))
            .args(words)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.split_whitespace().next().expect("it says its address").to_string();
        Self { child, address }
    }
}

impl Studio {
    /// Ends it as Ctrl-C does.
    pub fn interrupt(mut self) {
        let number = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &number]).status().unwrap().success());
        assert!(self.child.wait().unwrap().success());
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        // it may be gone already
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What it says on standard error where it does not start.
pub fn refused<S: AsRef<OsStr>>(folder: &Path, words: &[S]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_rotor-edge-studio"))
        .current_dir(folder)
        .env("XDG_STATE_HOME", folder.join("state"))
        .args(words)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stderr).unwrap()
}

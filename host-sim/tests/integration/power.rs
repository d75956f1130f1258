//! Power cuts on an ext4 of its own: `tests/power/run`.

#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::program::{assert_says, json, rotor_edge};
use crate::shared::Shared;
use rotor_edge::node::Store;
use rotor_edge::sample;
use tempfile::TempDir;

fn tool(name: &str, arguments: &[&str]) {
    assert!(Command::new(name).args(arguments).status().unwrap().success(), "{name} {arguments:?}");
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

/// A mounted file system; gone when dropped.
struct Mounted(PathBuf);

impl Mounted {
    fn new(image: &Path, place: PathBuf) -> Self {
        std::fs::create_dir_all(&place).unwrap();
        tool("mount", &["-o", "loop", &text(image), &text(&place)]);
        Self(place)
    }
}

impl Drop for Mounted {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

/// A disk whose power can be cut.
struct Disk {
    mounted: Mounted,
    folder: TempDir,
}

impl Disk {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let image = folder.path().join("image");
        std::fs::File::create(&image).unwrap().set_len(16 << 20).unwrap();
        tool("mkfs.ext4", &["-q", "-F", &text(&image)]);
        Self { mounted: Mounted::new(&image, folder.path().join("disk")), folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.mounted.0.join(name)
    }

    /// What the disk holds if the power goes now.
    fn cut(&self) -> Mounted {
        let copy = self.folder.path().join("copy");
        std::fs::copy(self.folder.path().join("image"), &copy).unwrap();
        Mounted::new(&copy, self.folder.path().join("after"))
    }
}

/// A running monitor; killed when dropped.
struct Monitor(Child);

impl Drop for Monitor {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
#[ignore = "needs root and a loop device: tests/power/run"]
fn acknowledged_commands_and_files_survive_power_cut() {
    let cuts: u64 = std::env::var("ROTOR_EDGE_CUTS").map_or(10, |text| text.parse().unwrap());
    let (disk, bus) = (Disk::new(), Shared::start(&[]));
    // what is only written is lost, or this test could not fail
    std::fs::write(disk.path("unflushed"), "lost").unwrap();
    let after = disk.cut();
    assert!(
        !after.0.join("unflushed").exists() || std::fs::read(after.0.join("unflushed")).unwrap().is_empty()
    );
    drop(after);

    for (name, content) in
        [("rotor.toml", sample::ROTOR), ("record.csv", sample::RECORD), ("runup.csv", sample::RUNUP_DAY_0)]
    {
        std::fs::write(disk.path(name), content).unwrap();
    }
    let at = |name: &str| text(&disk.path(name));
    let (model, key) = (at("identified.toml"), at("monitor.key"));
    let found = ["identify", &at("rotor.toml"), &at("record.csv"), "--runup", &at("runup.csv"), "-o", &model];
    assert!(rotor_edge(&found).status.success());
    let whole = std::fs::read(&model).unwrap();
    assert_eq!(std::fs::read(disk.cut().0.join("identified.toml")).unwrap(), whole, "the fitted file");
    assert!(rotor_edge(&["key", "-o", &key]).status.success());
    let whole = std::fs::read(&key).unwrap();
    assert_eq!(std::fs::read(disk.cut().0.join("monitor.key")).unwrap(), whole, "the key");

    let mut node = crate::program::program();
    node.args(["node", "--bus", bus.spec("slcan"), "--key", &key, "--state", &at("monitor.state")]);
    let mut running = Monitor(node.stdout(Stdio::piped()).spawn().unwrap());
    let mut line = String::new();
    BufReader::new(running.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
    assert_says(&line, &["listens on"]);
    let command = |more: &[&str], counter: u64| {
        let counter = counter.to_string();
        let common = ["--bus", bus.spec("slcan"), "--key", &key, "--counter", &counter, "--json"];
        json(&rotor_edge(&[more, &common].concat()))
    };
    let mut counter = 1;
    for cut in 0..cuts {
        let (rise, dbc) = (format!("rise=0.{}", 10 + cut % 80), at(&format!("{cut}.dbc")));
        if cut.is_multiple_of(2) {
            assert_eq!(command(&["deploy", &model], counter)["outcome"], "accepted");
        } else {
            // reads, sets and reads again: numbers of their own
            counter += 1;
            command(&["thresholds", "--set", &rise], counter - 1);
        }
        let after = disk.cut();
        let kept = Store::open(&after.0.join("monitor.state")).unwrap();
        assert_eq!(kept.counter(), counter, "cut {cut}");
        assert!(kept.model().is_ok(), "cut {cut}");
        drop(after);
        assert!(rotor_edge(&["dbc", "-o", &dbc]).status.success());
        let whole = std::fs::read(&dbc).unwrap();
        assert_eq!(std::fs::read(disk.cut().0.join(format!("{cut}.dbc"))).unwrap(), whole, "cut {cut}");
        std::fs::remove_file(&dbc).unwrap();
        counter += 2;
    }
    println!("{cuts} commands acknowledged and as many files written, each followed by a cut: none was lost");
}

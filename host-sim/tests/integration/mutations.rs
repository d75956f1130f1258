//! Damaged files given to the real program, one of a command's inputs at a time: each is taken, or refused in one sentence.
//! `ROTOR_EDGE_MUTATIONS=50000 cargo test --release -p rotor-edge --test integration mutations::` makes so many; one that fails is kept in
//! `target/fuzz-failures`.

#[path = "../../../tests/integration/mutation.rs"]
mod mutation;

use std::f64::consts::PI;
use std::fmt::Write;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::thread::{available_parallelism, scope, sleep};
use std::time::{Duration, Instant};

use mutation::mutated;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Nothing that a file can say may keep the program busy for longer, on a busy machine too.
const PATIENCE: Duration = Duration::from_secs(300);

/// Commands with their inputs, and how often in a round: those that take a second or more seldom.
const COMMANDS: [(&str, usize); 18] = [
    ("check kit.toml", 8),
    ("check turbine.toml", 8),
    ("compare kit.toml startup.csv", 2),
    ("compare turbine.toml runup.csv", 6),
    ("import mils.csv --lag --output out.csv", 8),
    ("import semicolons.csv --lag --output out.csv", 8),
    ("import exported.xlsx --lag --output out.csv", 8),
    ("extract turns.csv --mv-um=7.87 --output out.csv", 6),
    ("extract turns.wav --mv-um=7.87 --full-scale=10 --keyphasor=3 --revolutions=2 --output out.csv", 6),
    ("extract turns.npz --mv-um=7.87 --rate-hz=20000 --revolutions=2 --output out.csv", 6),
    ("decode heartbeats.log", 8),
    ("forecast track.csv --model naive", 6),
    ("balance kit.toml startup.csv", 4),
    ("estimate kit.toml startup.csv", 4),
    ("identify turbine.toml record.csv --days 0..2 --output out.toml", 2),
    ("track turbine.toml record.csv --method fixed", 2),
    ("track turbine.toml record.csv --method joint", 2),
    ("improve turbine.toml runup.csv --output out.toml", 1),
];

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// The undamaged input of a name.
fn seed(name: &str) -> Vec<u8> {
    let corpus = |path: &str| repository("host-sim/fuzz/corpus").join(path);
    let sample = |path: &str| repository("host-sim/sample").join(path);
    let path = match name {
        "kit.toml" => sample("kit/rotor.toml"),
        "startup.csv" => sample("kit/startup.csv"),
        "turbine.toml" => sample("turbine/rotor.toml"),
        "runup.csv" => sample("turbine/runup-day126.csv"),
        "record.csv" => sample("turbine/record.csv"),
        "mils.csv" => corpus("export/seed-mils"),
        "semicolons.csv" => corpus("export/seed-semicolons"),
        "exported.xlsx" => corpus("spreadsheet/seed-exported"),
        "turns.csv" => return turns(),
        "turns.wav" => corpus("waveform_wav/seed-turns"),
        "turns.npz" => corpus("waveform_npz/seed-turns"),
        "heartbeats.log" => corpus("log/seed-heartbeats"),
        "track.csv" => return track(),
        _ => panic!("{name}"),
    };
    let bytes = fs::read(path).unwrap();
    if name == "record.csv" {
        // the first days of the record, which is long
        let lines = bytes.split_inclusive(|byte| *byte == b'\n').take(40);
        return lines.flatten().copied().collect();
    }
    bytes
}

/// 45 turns of a shaft, 20 samples each.
fn turns() -> Vec<u8> {
    let mut text = String::from("time_s,15X,15Y,keyphasor\n");
    for n in 0..900 {
        let [cos, sin] = [f64::cos, f64::sin].map(|of| -9.0 + 0.1 * of(f64::from(n) * PI / 10.0));
        let mark = if n % 20 < 3 { -2 } else { -10 };
        writeln!(text, "{},{cos},{sin},{mark}", f64::from(n) / 2000.0).unwrap();
    }
    text.into_bytes()
}

/// 120 days of unbalances that grow and sway.
fn track() -> Vec<u8> {
    let mut text = String::from("time_d,static_g_mm,static_deg,dynamic_g_mm,dynamic_deg\n");
    for day in 0..120 {
        let [week, month] = [7, 30].map(|days| f64::from(day % days));
        writeln!(text, "{day},{},{},{},{}", 100.0 + 0.3 * month, 40.0 + week, 50.0 + week, 70.0 - month)
            .unwrap();
    }
    text.into_bytes()
}

/// The files that a command reads.
fn inputs(words: &str) -> impl Iterator<Item = &str> {
    words.split(' ').skip(1).take_while(|word| !word.starts_with("--"))
}

/// How the program ended; `None` if it did not.
fn run(words: &str, folder: &Path) -> Option<ExitStatus> {
    let mut program = crate::program::program()
        .args(words.split(' '))
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(File::create(folder.join("stderr")).unwrap())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while begun.elapsed() < PATIENCE {
        if let Some(status) = program.try_wait().unwrap() {
            return Some(status);
        }
        sleep(Duration::from_millis(2));
    }
    program.kill().unwrap();
    program.wait().unwrap();
    None
}

/// What is wrong with the way in which the program took it.
fn fault(status: Option<ExitStatus>, folder: &Path) -> Option<String> {
    let said = fs::read(folder.join("stderr")).unwrap();
    let said = String::from_utf8_lossy(&said);
    let is_written = ["out.csv", "out.toml"].iter().any(|name| folder.join(name).exists());
    match status.map(|status| status.code()) {
        None => Some(format!("still busy after {} s", PATIENCE.as_secs())),
        Some(Some(0)) => None,
        Some(Some(1 | 2)) if is_written => Some(format!("refused, and yet written: {said}")),
        Some(Some(1)) if said.trim_end().lines().count() == 1 => None,
        // the command line refuses with its usage
        Some(Some(2)) => None,
        Some(code) => Some(format!("exit code {code:?}: {said}")),
    }
}

/// Gives the program mutation number `number`, and says what was wrong.
fn try_one(number: u64) -> Option<String> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(number);
    let mut below = |limit: usize| (random.next_u64() % limit as u64) as usize;
    let bag: Vec<&str> = COMMANDS.iter().flat_map(|(words, often)| vec![*words; *often]).collect();
    let words = bag[below(bag.len())];
    let names: Vec<&str> = inputs(words).collect();
    let damaged = names[below(names.len())];
    let folder = tempfile::tempdir().unwrap();
    for name in &names {
        let whole = seed(name);
        let bytes = if *name == damaged { mutated(&whole, &mut random) } else { whole };
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let why = fault(run(words, folder.path()), folder.path())?;
    let kept = repository("target/fuzz-failures").join(format!("files-{number}"));
    fs::create_dir_all(&kept).unwrap();
    for name in names {
        fs::copy(folder.path().join(name), kept.join(name)).unwrap();
    }
    Some(format!("`rotor-edge {words}` in {}, {damaged} damaged: {why}", kept.display()))
}

#[test]
fn every_command_takes_its_inputs_as_they_are() {
    for (words, _) in COMMANDS {
        let folder = tempfile::tempdir().unwrap();
        for name in inputs(words) {
            fs::write(folder.path().join(name), seed(name)).unwrap();
        }
        let status = run(words, folder.path()).unwrap();
        assert!(status.success(), "{words}: {}", fs::read_to_string(folder.path().join("stderr")).unwrap());
    }
}

#[test]
fn damaged_files_are_read_or_refused_in_one_sentence() {
    let files: u64 = std::env::var("ROTOR_EDGE_MUTATIONS").map_or(100, |text| text.parse().unwrap());
    let (next, failed) = (AtomicU64::new(0), AtomicU64::new(0));
    scope(|threads| {
        for _ in 0..available_parallelism().unwrap().get() {
            threads.spawn(|| {
                while let number = next.fetch_add(1, Relaxed)
                    && number < files
                {
                    if let Some(why) = try_one(number) {
                        println!("{why}");
                        failed.fetch_add(1, Relaxed);
                    }
                }
            });
        }
    });
    assert_eq!(failed.into_inner(), 0, "of {files} damaged files");
}

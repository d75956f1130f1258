//! What arbitrary bytes are given to, one function a reader of files: nothing panics, every refusal is one sentence, and what
//! was refused left nothing behind. The fuzz targets and the replay of their corpus call these.

use std::ffi::OsString;
use std::fs;

use rotor_edge::bus::decoded::DecodedLog;
use rotor_edge::bus::log::LogReader;
use rotor_edge::command::{Listener, object, shown};
use rotor_edge::deploy::read_key;
use rotor_edge::node::Store;
use rotor_edge_desktop::forecast::series;
use rotor_edge_desktop::measurement;
use rotor_edge_desktop::rotor_file::{self, ross};

/// What arbitrary bytes are given to.
pub type Reader = fn(&[u8]);

/// Every reader by the name of its fuzz target.
pub const ALL: [(&str, Reader); 13] = [
    ("rotor", rotor),
    ("machine", machine),
    ("measured", measured),
    ("history", history),
    ("ross", of_ross),
    ("export", export),
    ("spreadsheet", spreadsheet),
    ("waveform_csv", waveform_csv),
    ("waveform_wav", waveform_wav),
    ("waveform_npy", waveform_npy),
    ("waveform_npz", waveform_npz),
    ("log", log),
    ("state", state),
];

/// The machine that measurements are read for.
const MACHINE: &str = include_str!("../../sample/kit/rotor.toml");

fn one_sentence<T, E: Into<anyhow::Error>>(read: Result<T, E>) -> Option<T> {
    let refused = |error: E| {
        let sentence = shown(&error.into());
        assert!(sentence.len() > 10 && !sentence.contains(char::is_control), "one sentence: {sentence:?}");
    };
    read.map_err(refused).ok()
}

/// A command on a file of this name with these bytes; `more` follows the file, and `OUT` stands for where it may write.
fn command(name: &str, file: &str, bytes: &[u8], more: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, out) = (folder.path().join(file), folder.path().join("out.csv"));
    fs::write(&path, bytes).expect("room");
    let mut words: Vec<OsString> = vec![name.into(), path.into(), "--json".into()];
    words.extend(more.iter().map(|word| if *word == "OUT" { out.clone().into() } else { (*word).into() }));
    let answer = one_sentence(object(words, Listener::Program(&|_, _| ())));
    assert!(answer.is_some() || !out.exists(), "nothing half-written");
}

/// `rotor.toml`.
pub fn rotor(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    one_sentence(rotor_file::parse("r.toml", &text));
}

/// `rotor.toml`, and all that `check` makes of it.
pub fn machine(bytes: &[u8]) {
    command("check", "rotor.toml", bytes, &[]);
}

/// `measured.csv`.
pub fn measured(bytes: &[u8]) {
    let rotor = rotor_file::parse("rotor.toml", MACHINE).expect("the sample");
    one_sentence(measurement::parse("m.csv", &String::from_utf8_lossy(bytes), &rotor));
}

/// What `forecast` reads.
pub fn history(bytes: &[u8]) {
    one_sentence(series::parse("track.csv", &String::from_utf8_lossy(bytes)));
}

/// A rotor that ROSS saved, in both of its forms.
pub fn of_ross(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    for is_json in [true, false] {
        one_sentence(ross::parse("rotor.json", &text, is_json));
    }
}

/// An export as text.
pub fn export(bytes: &[u8]) {
    command("import", "export.csv", bytes, &["-o", "OUT"]);
}

/// An export as a workbook.
pub fn spreadsheet(bytes: &[u8]) {
    command("import", "export.xlsx", bytes, &["-o", "OUT"]);
}

fn waveform(file: &str, bytes: &[u8]) {
    let stated = [
        "-o",
        "OUT",
        "--mv-um",
        "7.87",
        "--rate-hz",
        "2000",
        "--keyphasor",
        "keyphasor",
        "--full-scale",
        "10",
    ];
    command("extract", file, bytes, &stated);
}

/// Samples as text.
pub fn waveform_csv(bytes: &[u8]) {
    waveform("samples.csv", bytes);
}

/// Samples as WAV.
pub fn waveform_wav(bytes: &[u8]) {
    waveform("samples.wav", bytes);
}

/// Samples as an array of NumPy.
pub fn waveform_npy(bytes: &[u8]) {
    waveform("samples.npy", bytes);
}

/// Samples as an archive of NumPy.
pub fn waveform_npz(bytes: &[u8]) {
    waveform("samples.npz", bytes);
}

/// A candump log, and what `decode` puts together from it.
pub fn log(bytes: &[u8]) {
    one_sentence(DecodedLog::of(LogReader::new(bytes, "x.log".into()), "x.log"));
}

/// A monitor's state, or a key, whatever the file holds.
pub fn state(bytes: &[u8]) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("monitor.state");
    fs::write(&path, bytes).expect("room");
    one_sentence(read_key(&path));
    let mut store = Store::open(&path).expect("a damaged state starts a monitor that says so");
    let counter = store.counter();
    store.save_memory(&[1, 2]).expect("room");
    assert_eq!(Store::open(&path).expect("it was just written").counter(), counter);
}

//! Files that were given in place of others: the message says which file was expected and what makes one.

use rotor_edge::sample;

use crate::program::{assert_says, refusal};

/// Writes the text as a file and gives its path.
fn file(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn measurements_before_the_rotor_are_named_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let rotor = file(&folder, "r.toml", sample::ROTOR);
    let data = file(&folder, "d.csv", sample::RUNUP_DAY_126);
    let message = refusal(&["compare", &data, &rotor]);
    assert_says(
        &message,
        &["d.csv", "header of a table", "expected a rotor file (TOML)", "rotor file first"],
    );
    let message = refusal(&["compare", &rotor, &rotor]);
    assert_says(
        &message,
        &["r.toml", "rotor file (TOML)", "expected measurements (CSV)", "rotor file first"],
    );
}

#[test]
fn table_of_another_system_is_sent_to_import() {
    let folder = tempfile::tempdir().unwrap();
    let rotor = file(&folder, "r.toml", sample::ROTOR);
    let semicolons = file(&folder, "s.csv", &sample::RUNUP_DAY_126.replace(',', ";"));
    let message = refusal(&["compare", &rotor, &semicolons]);
    assert_says(&message, &["s.csv", "separated by `;`, expected commas", "`rotor-edge import`"]);
    let no_unit = file(&folder, "u.csv", &sample::RUNUP_DAY_126.replace("_um", ""));
    let message = refusal(&["compare", &rotor, &no_unit]);
    assert_says(&message, &["u.csv", "15X_cos_um", "is missing", "`rotor-edge import`"]);
    let one_missing = file(&folder, "o.csv", &sample::RUNUP_DAY_126.replacen("15X_cos_um", "15Z_cos_um", 1));
    let message = refusal(&["compare", &rotor, &one_missing]);
    assert!(message.contains("15X_cos_um") && !message.contains("import"), "{message}");
}

#[test]
fn short_record_and_rotor_without_unbalance_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let rotor = file(&folder, "r.toml", sample::ROTOR);
    let header = sample::RECORD.lines().position(|line| !line.starts_with('#')).unwrap();
    let lines: Vec<&str> = sample::RECORD.lines().skip(header).take(3).collect();
    let record = file(&folder, "d.csv", &lines.join("\n"));
    assert_says(&refusal(&["track", &rotor, &record]), &["d.csv", "2 complete readings", "at least 10"]);
    let output = folder.path().join("o.toml").display().to_string();
    let message = refusal(&["identify", &rotor, &record, "--days", "900..902", "-o", &output]);
    assert_says(&message, &["d.csv", "no complete reading on days 900 to 902"]);
    let message = refusal(&["replay", "--identified", "--rotor", &rotor, "--record", &record]);
    assert_says(&message, &["r.toml", "unbalance_g_mm", "`rotor-edge identify`"]);
}

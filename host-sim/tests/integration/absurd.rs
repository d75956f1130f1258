//! Input that cannot be true through the program itself: units of another scale, growth beyond numbers, bytes that command a
//! terminal.

use crate::program::{one_sentence, rotor_edge};
use rotor_edge::sample;
use tempfile::TempDir;

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, text: &str) -> String {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    }
}

/// The run-up with every amplitude times a factor, as in another unit.
fn scaled(factor: f64) -> String {
    let mut lines = sample::RUNUP_DAY_126.lines();
    let head = lines.next().unwrap();
    let is_amplitude: Vec<bool> = head.split(',').map(|name| name.ends_with("_um")).collect();
    let line = |line: &str| {
        let cell = |(cell, is_amplitude): (&str, &bool)| match cell.parse::<f64>() {
            Ok(number) if *is_amplitude => (number * factor).to_string(),
            _ => cell.to_string(),
        };
        line.split(',').zip(&is_amplitude).map(cell).collect::<Vec<_>>().join(",")
    };
    std::iter::once(head.to_string()).chain(lines.map(line)).collect::<Vec<_>>().join("\n")
}

#[test]
fn growth_beyond_numbers_is_refused() {
    let folder = Folder::new();
    let (rotor, record) = (folder.file("r.toml", sample::ROTOR), folder.file("d.csv", sample::RECORD));
    for growth in ["1e300", "inf", "NaN", "0.5"] {
        let output = rotor_edge(&["track", &rotor, &record, "--method", "fixed", "--growth", growth]);
        assert!(!output.status.success(), "{growth}");
        assert!(!String::from_utf8_lossy(&output.stdout).contains("NaN"), "{growth}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("growth"), "{growth}: {output:?}");
    }
}

#[test]
fn bytes_that_command_a_terminal_reach_it_from_no_file() {
    let folder = Folder::new();
    let escape = "\u{1b}[2J\u{7}";
    let rotor = folder.file("r.toml", &sample::ROTOR.replace("\"15\"", &format!("\"1{escape}5\"")));
    let plain = folder.file("p.toml", sample::ROTOR);
    let data = folder.file("d.csv", sample::RUNUP_DAY_126);
    let odd = folder.file("o.csv", &sample::RUNUP_DAY_126.replacen("day 126", &format!("day{escape}"), 1));
    for (rotor, data) in [(&rotor, &data), (&plain, &odd)] {
        let output = rotor_edge(&["compare", rotor, data]);
        let all = [output.stdout, output.stderr].concat();
        assert!(
            !all.contains(&0x1b) && !all.contains(&7),
            "{}",
            String::from_utf8_lossy(&all).escape_debug()
        );
    }
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn amplitudes_in_wrong_unit_are_refused_or_give_valid_rotor() {
        let folder = Folder::new();
        let rotor = folder.file("r.toml", sample::ROTOR);
        for factor in [1.0 / 25.4, 1e-3, 1e-6, 25.4, 1e3, 1e6] {
            let data = folder.file("d.csv", &scaled(factor));
            let new = folder.0.path().join("new.toml");
            let output =
                rotor_edge(&["improve", &rotor, &data, "-o", &new.display().to_string(), "--even-so"]);
            if output.status.success() {
                // what is written is a machine that the next command takes
                let again = rotor_edge(&["compare", &new.display().to_string(), &data]);
                assert!(again.status.success(), "{factor}: {}", String::from_utf8_lossy(&again.stderr));
                std::fs::remove_file(new).unwrap();
            } else {
                assert_eq!(output.status.code(), Some(1), "{factor}");
                one_sentence(&output);
                assert!(!new.exists(), "{factor}: refused, and yet written");
            }
            let balanced = rotor_edge(&["balance", &rotor, &data]);
            assert!(matches!(balanced.status.code(), Some(0 | 1)), "{factor}: {balanced:?}");
        }
    }
}

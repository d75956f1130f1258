//! Masks of what differs between two runs of the same program: folders, versions, commits, times.

use std::path::Path;

/// The text with masks in the place of folders, versions, commits, times of day and durations.
pub fn mask(text: &str, folder: &Path) -> String {
    let text = text.replace(&folder.display().to_string(), "<folder>");
    text.split_inclusive('\n').map(mask_line).collect()
}

fn mask_line(line: &str) -> String {
    let line = mask_duration(line);
    let version = env!("CARGO_PKG_VERSION");
    for before in ["rotor-edge ", "v"] {
        let Some((head, tail)) = line.split_once(&format!("{before}{version}")) else { continue };
        return format!("{head}{before}<version>{}", mask_time(mask_commit(tail)));
    }
    line
}

/// ` (0123456789ab), …` without the commit.
fn mask_commit(tail: &str) -> String {
    match tail.strip_prefix(" (").and_then(|rest| rest.split_once(')')) {
        Some((commit, rest)) if commit.chars().all(|c| c.is_ascii_hexdigit()) => rest.to_string(),
        _ => tail.to_string(),
    }
}

/// `, 2024-01-02 03:04 UTC.` as `, <time>.`
fn mask_time(tail: String) -> String {
    let digits = |part: &str| part.chars().all(|c| c.is_ascii_digit() || "-: ".contains(c));
    match tail.strip_prefix(", ").and_then(|rest| rest.split_once(" UTC")) {
        Some((time, rest)) if digits(time) => format!(", <time>{rest}"),
        _ => tail,
    }
}

/// `took 0.21 s` as `took <duration> s`.
fn mask_duration(line: &str) -> String {
    let Some((head, tail)) = line.split_once(" took ") else { return line.to_string() };
    let Some((number, rest)) = tail.split_once(' ') else { return line.to_string() };
    match number.parse::<f64>() {
        Ok(_) => format!("{head} took <duration> {rest}"),
        Err(_) => line.to_string(),
    }
}

/// Text of a page with masks in the place of size and digest of files that the run wrote: both change with the last digit of a
/// fitted number. The page lists a file as three lines: name, bytes, SHA-256.
pub fn mask_written(page: &str, is_input: impl Fn(&str) -> bool) -> String {
    let mut lines: Vec<&str> = page.lines().collect();
    for third in 2..lines.len() {
        if is_digest(lines[third]) && !is_input(lines[third - 2]) {
            (lines[third - 1], lines[third]) = ("<bytes>", "<digest>");
        }
    }
    lines.iter().map(|line| format!("{line}\n")).collect()
}

fn is_digest(line: &str) -> bool {
    line.len() == 64 && line.chars().all(|c| c.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn masked(text: &str) -> String {
        mask(text, Path::new("/somewhere/else"))
    }

    #[test]
    fn version_commit_and_time_are_masked() {
        let version = env!("CARGO_PKG_VERSION");
        let line = format!("rotor-edge {version} (0123456789ab), 2024-01-02 03:04 UTC.\n");
        assert_eq!(masked(&line), "rotor-edge <version>, <time>.\n");
        assert_eq!(
            masked(&format!("rotor-edge {version}, 2024-01-02 03:04 UTC.")),
            "rotor-edge <version>, <time>."
        );
        assert_eq!(masked("Day 0 was 2024-03-01 06:00 UTC."), "Day 0 was 2024-03-01 06:00 UTC.");
    }

    #[test]
    fn duration_and_folder_are_masked() {
        assert_eq!(masked("The whole replay took 0.21 s."), "The whole replay took <duration> s.");
        assert_eq!(masked("/somewhere/else/x.csv: row 2"), "<folder>/x.csv: row 2");
    }

    #[test]
    fn digest_is_masked_for_written_file_and_kept_for_input() {
        let digest = "0123456789abcdef".repeat(4);
        let page = format!("rotor.toml\n2726\n{digest}\nbetter.toml\n3407\n{digest}\n");
        let expected = format!("rotor.toml\n2726\n{digest}\nbetter.toml\n<bytes>\n<digest>\n");
        assert_eq!(mask_written(&page, |file| file == "rotor.toml"), expected);
    }
}

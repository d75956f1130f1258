//! Recognises a file that was given in place of another: a table for a rotor file, or the other way round.

/// First line that is neither blank nor a comment.
fn first_line(text: &str) -> Option<&str> {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    lines.into_iter().find(|line| !line.is_empty() && !line.starts_with('#'))
}

/// Whether a text begins with the header of a table: cells with separators, and no key of a rotor file.
pub(crate) fn is_table(text: &str) -> bool {
    first_line(text)
        .is_some_and(|line| !line.starts_with('{') && !is_toml_line(line) && line.contains([',', ';', '\t']))
}

/// Whether a text begins as a rotor file does: with a key or a section.
pub(crate) fn is_toml(text: &str) -> bool {
    first_line(text).is_some_and(is_toml_line)
}

fn is_toml_line(line: &str) -> bool {
    let is_bare = |key: &str| {
        !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.'))
    };
    let line = line.split('#').next().unwrap_or(line).trim();
    let section = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let key = line.split_once('=').map(|(key, _)| key.trim());
    section.is_some_and(|name| is_bare(name.trim_matches(['[', ']']))) || key.is_some_and(is_bare)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_of_a_table_is_told_from_keys_of_a_rotor() {
        for table in ["run,speed_rpm\n", "# of 2024\n\nDatum;Drehzahl [1/min];16X\n", "Time\tSpeed\n"] {
            assert!(is_table(table) && !is_toml(table), "{table}");
        }
        for toml in ["schema = 2\n", "# turbine, large\n[[shaft]]\n", "[rated] # at 3000, 3600 rpm\n"] {
            assert!(is_toml(toml) && !is_table(toml), "{toml}");
        }
        for neither in ["", "# nothing\n", "a sentence\n"] {
            assert!(!is_toml(neither) && !is_table(neither), "{neither}");
        }
    }
}

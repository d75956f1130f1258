//! Words of a command line as a shell takes them, so that what is suggested can be pasted.

use std::path::Path;

pub fn word(text: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=:,@%+".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text.into()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// A path, which is one word whatever is in it.
pub fn path(path: &Path) -> String {
    word(&path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggested_word_is_one_shell_word_and_runs_nothing() {
        for text in ["plain.toml", "my rotor.toml", "it's", "$(touch x)", "a;b", "`id`", ""] {
            let line = format!("printf %s {}", word(text));
            let output = std::process::Command::new("sh").args(["-c", &line]).output().unwrap();
            assert_eq!(String::from_utf8(output.stdout).unwrap(), text, "{line}");
        }
        assert_eq!(word("plain.toml"), "plain.toml");
        assert_eq!(path(Path::new("my rotor.toml")), "'my rotor.toml'");
    }
}

//! What is wrong with a command line or a file, in one sentence.

use std::fmt::Write as _;

use crate::terminal::excerpted;

/// The sentence of an error. What a file holds may stand in it: a terminal must not obey that, and lines that a library made
/// are joined.
pub fn shown(error: &anyhow::Error) -> String {
    let text = format!("{error:#}");
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let mut sentence = String::new();
    for c in lines.join(" ").chars() {
        // writing to memory cannot fail
        let _ =
            if c.is_control() { write!(sentence, "{}", c.escape_debug()) } else { write!(sentence, "{c}") };
    }
    excerpted(&sentence)
}

/// The first paragraph of a parser's message, on one line.
pub fn sentence(message: &str) -> String {
    let paragraph = message.split("\n\n").next().unwrap_or(message);
    let lines: Vec<&str> = paragraph.lines().map(str::trim).collect();
    excerpted(lines.join(" ").trim_start_matches("error: "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_shown_and_lines_are_joined() {
        let error = anyhow::anyhow!("name \u{1b}[31m\u{7f} is µ\n  | odd").context("r.toml");
        assert_eq!(shown(&error), "r.toml: name \\u{1b}[31m\\u{7f} is µ | odd");
    }
}

//! Wrapping of a line at words.

use unicode_width::UnicodeWidthStr as _;

/// Units and signs that stay on the line of the number before them.
const UNITS: [&str; 23] = [
    "%", "°", "µm", "mm", "m", "g", "kg", "g·mm", "rpm", "N", "N/m", "N·s/m", "Hz", "s", "ms", "d", "days",
    "MPa", "GPa", "MB", "µs", "°C", "σ",
];

/// A paragraph with its indentation; the lines after the first are indented by `hanging` columns more.
pub fn paragraph(line: &str, columns: usize, hanging: usize) -> Vec<String> {
    let text = line.trim_start_matches(' ');
    let indent = line.len() - text.len();
    let hanging = if indent + hanging + 2 * hanging < columns { indent + hanging } else { 0 };
    let mut lines = vec![" ".repeat(indent)];
    for word in words(text) {
        let last = lines.len() - 1;
        let is_first = lines[last].trim().is_empty();
        if !is_first && lines[last].width() + 1 + word.width() > columns {
            lines.push(format!("{}{word}", " ".repeat(hanging)));
        } else {
            if !is_first {
                lines[last].push(' ');
            }
            lines[last] += &word;
        }
    }
    lines
}

/// A command line, continued with a backslash so that it can be pasted. Options stay with their values.
pub fn command(line: &str, columns: usize) -> Vec<String> {
    let text = line.trim_start_matches(' ');
    let indent = line.len() - text.len();
    let mut lines = vec![" ".repeat(indent)];
    let arguments = arguments(text);
    for (k, argument) in arguments.iter().enumerate() {
        let last = lines.len() - 1;
        let is_first = lines[last].trim().is_empty();
        let backslash = if k + 1 < arguments.len() { 2 } else { 0 };
        if !is_first && lines[last].width() + 1 + argument.width() + backslash > columns {
            lines[last] += " \\";
            lines.push(format!("{}{argument}", " ".repeat(indent + 4)));
        } else {
            if !is_first {
                lines[last].push(' ');
            }
            lines[last] += argument;
        }
    }
    lines
}

/// Words between which a line may be broken: a number keeps its unit and its uncertainty.
pub fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match words.last_mut().filter(|last| is_glued(last, word)) {
            Some(last) => {
                last.push(' ');
                *last += word;
            }
            None => words.push(word.to_string()),
        }
    }
    words
}

fn is_glued(before: &str, word: &str) -> bool {
    let unit = word.trim_end_matches([',', '.', ';', ':', ')']);
    let is_number = before.ends_with(|c: char| c.is_ascii_digit());
    word.is_empty() || unit == "±" || before.ends_with('±') || is_number && UNITS.contains(&unit)
}

/// Arguments of a command line; an option of the form `--name` or `-n` with the value behind it.
fn arguments(text: &str) -> Vec<String> {
    let mut arguments: Vec<String> = Vec::new();
    for word in text.split(' ') {
        let belongs = arguments.last().is_some_and(|last| {
            let is_quoted = last.matches('\'').count() % 2 == 1;
            let is_option = last.starts_with('-') && !last.contains(' ') && !word.starts_with('-');
            is_quoted || is_option || word.is_empty()
        });
        match arguments.last_mut().filter(|_| belongs) {
            Some(last) => {
                last.push(' ');
                *last += word;
            }
            None => arguments.push(word.to_string()),
        }
    }
    arguments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_paragraph_breaks_at_words_with_hanging_indent() {
        let lines = paragraph("  one two three four", 11, 2);
        assert_eq!(lines, ["  one two", "    three", "    four"]);
    }

    #[test]
    fn number_keeps_unit_and_uncertainty() {
        let lines = paragraph("from 3.0 ± 0.1 µm, or 95 %", 12, 0);
        assert_eq!(lines, ["from", "3.0 ± 0.1 µm,", "or 95 %"]);
    }

    #[test]
    fn long_command_continues_with_backslash() {
        let lines = command("  rotor-edge add 'my rotor.toml' bow --data a.csv -o b.toml", 34);
        assert_eq!(lines, ["  rotor-edge add 'my rotor.toml' \\", "      bow --data a.csv -o b.toml"]);
    }
}

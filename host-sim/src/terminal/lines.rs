//! Text of several lines: tables, commands and paragraphs, each fitted in its own way.

use unicode_width::UnicodeWidthStr as _;

use super::columns::Table;
use super::wrap;

/// Columns by which the continuation of an indented line or a message is indented further.
const HANGING: usize = 2;
/// First words of a line that can be pasted into a shell.
const COMMANDS: [&str; 2] = ["rotor-edge", "cargo run"];

/// The text with no line wider than `columns`, except for single words that are wider.
pub fn fit(text: &str, columns: usize) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let mut fitted: Vec<String> = Vec::new();
    let mut rest = &lines[..];
    while let Some(line) = rest.first() {
        let table = Table::at_start(rest);
        let (rows, after) = rest.split_at(table.as_ref().map_or(1, Table::rows));
        match table {
            _ if rows.iter().all(|row| row.width() <= columns) => {
                fitted.extend(rows.iter().map(ToString::to_string));
            }
            Some(table) => fitted.extend(table.fit(columns)),
            None => fitted.extend(fit_line(line, columns)),
        }
        rest = after;
    }
    let end = if text.ends_with('\n') { "\n" } else { "" };
    fitted.join("\n") + end
}

fn fit_line(line: &str, columns: usize) -> Vec<String> {
    let text = line.trim_start().trim_start_matches("Next: ");
    let is_command = |name: &&str| text.strip_prefix(*name).is_some_and(|rest| rest.starts_with([' ', '-']));
    if COMMANDS.iter().any(is_command) {
        return wrap::command(line, columns);
    }
    let is_message = line.starts_with("rotor-edge") || line.starts_with("error:");
    let hanging = if line.starts_with(' ') || is_message { HANGING } else { 0 };
    wrap::paragraph(line, columns, hanging)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_fits(text: &str, columns: usize) {
        let fitted = fit(text, columns);
        assert!(fitted.lines().all(|line| line.width() <= columns), "{fitted}");
        for word in text.split_whitespace() {
            assert!(fitted.split_whitespace().any(|w| w == word), "{word} is lost or cut in\n{fitted}");
        }
    }

    #[test]
    fn text_that_fits_stays_as_it_is() {
        let text = "One line\n\n  a   b\n  c   d\n";
        assert_eq!(fit(text, 20), text);
    }

    #[test]
    fn wide_gaps_of_a_table_shrink_first() {
        let text = "  run       x, µm      y, µm\n  A001       12.0        7.5\n";
        assert_eq!(fit(text, 24), "  run   x, µm  y, µm\n  A001   12.0    7.5\n");
    }

    #[test]
    fn long_cells_of_a_table_wrap_in_their_column() {
        let text = "  method  weights\n  model   0.1 g in hole 9, 0.1 g in hole 14\n";
        let expected = "  method  weights\n  model   0.1 g in\n          hole 9,\n          0.1 g in\n          hole 14\n";
        assert_eq!(fit(text, 20), expected);
    }

    #[test]
    fn columns_that_do_not_fit_follow_below() {
        let text = "  name   kxx     kxy     cxx     cxy\n  A      1.00e7  2.00e7  3.00e4  4.00e4\n";
        let expected =
            "  name  kxx     kxy\n  A     1.00e7  2.00e7\n\n  name  cxx     cxy\n  A     3.00e4  4.00e4\n";
        assert_eq!(fit(text, 24), expected);
    }

    #[test]
    fn parts_of_a_table_repeat_all_columns_that_name_a_row() {
        let text = "  at  way   k, N/m   c, N·s/m\n  A   peak  1.0e7    2.0e3\n  A   loop  1.1e7    2.1e3\n";
        let expected = "  at  way   k, N/m\n  A   peak  1.0e7\n  A   loop  1.1e7\n\n  \
                        at  way   c, N·s/m\n  A   peak  2.0e3\n  A   loop  2.1e3\n";
        assert_eq!(fit(text, 22), expected);
    }

    #[test]
    fn tables_and_sentences_side_by_side_fit_every_width() {
        let text = "A sentence that is followed by a table with wide columns, and one after it.\n\
                    \x20 run         bearing      measured          predicted      largest distance\n\
                    \x20 0 g         IB             3.7 / 3.4          0.0 / 0.0             1.8 µm\n\
                    \x20 0.4 g       OB           16.7 / 17.6        17.2 / 17.5             1.4 µm\n\
                    Another sentence, of many words, that stands directly below the table.\n";
        (20..100).for_each(|columns| assert_fits(text, columns));
    }

    #[test]
    fn suggested_command_stays_one_command() {
        let text = "Next: do it\n  rotor-edge add rotor.toml shaft_bow --data measured.csv -o better.toml\n";
        let expected = "Next: do it\n  rotor-edge add rotor.toml shaft_bow \\\n      --data measured.csv -o better.toml\n";
        assert_eq!(fit(text, 40), expected);
    }
}

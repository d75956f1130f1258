//! Text for a terminal.

/// A table, each column as wide as its widest cell.
pub fn table(columns: &[impl AsRef<str>], rows: &[impl AsRef<[String]>]) -> String {
    let cells = |row: usize, column: usize| match row {
        0 => columns[column].as_ref(),
        row => rows[row - 1].as_ref()[column].as_str(),
    };
    let width = |c: usize| (0..=rows.len()).map(|row| cells(row, c).chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns.len()).map(width).collect();
    let line = |row: usize| {
        let cell = |(c, width): (usize, &usize)| format!("  {:<width$}", cells(row, c));
        let line: String = widths.iter().enumerate().map(cell).collect();
        format!("{}\n", line.trim_end())
    };
    (0..=rows.len()).map(line).collect()
}

/// A sentence's words with a capital letter.
pub fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

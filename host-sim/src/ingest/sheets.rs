//! A sheet of a workbook, or a text file, before it is known where its table is.

use anyhow::Result;

use super::format::text::Text;
use super::sheet::SheetRow;

/// Columns of the largest workbooks.
const MOST_COLUMNS: usize = 16_384;
/// What stands between the cells of a table of readings.
const SEPARATORS: [char; 4] = [';', '\t', ',', '|'];

/// A sheet of a workbook, or a text file.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    pub file: String,
    /// Its name, in a workbook.
    pub name: Option<String>,
    /// What stands between its cells, in a text.
    pub separator: Option<char>,
    /// All rows; of a text those in which the header may stand.
    pub rows: Vec<SheetRow<'static>>,
    /// The text with all rows.
    pub text: Option<Text>,
}

impl Sheet {
    /// As messages begin: the file, and the sheet if there are sheets.
    pub fn place(&self) -> String {
        self.name.as_ref().map_or(self.file.clone(), |name| format!("{}: sheet \"{name}\"", self.file))
    }

    /// The first rows of a text, cut at the separator with which they score most.
    ///
    /// # Errors
    /// If it has more columns than any workbook.
    pub fn of_text(text: Text, score: fn(&SheetRow) -> usize) -> Result<Self> {
        text.check_widths(&SEPARATORS, MOST_COLUMNS, "reading")?;
        let columns = |_, rows: &[SheetRow]| {
            rows.iter().map(|row| (score(row), row.cells.len())).max().unwrap_or_default()
        };
        let separator = text.separator(SEPARATORS, columns);
        let rows = text.first_rows(separator).into_iter().map(SheetRow::into_owned).collect();
        Ok(Self { file: text.file.clone(), name: None, separator: Some(separator), rows, text: Some(text) })
    }
}

#[cfg(test)]
mod tests {
    use super::super::sheet::Cell;
    use super::super::table;
    use super::*;

    #[test]
    fn rows_keep_numbers_over_blanks_and_header_sets_separator() {
        let csv = "Machine: K-101, train A, unit 3\r\n\r\n\r\nSpeed;16X 1X Amp;16X 1X Phase\r\n\r\n100,5;2,5;30\r\n";
        let text = Text::of("a.csv", csv.as_bytes().to_vec()).unwrap();
        let sheet = Sheet::of_text(text, table::score).unwrap();
        assert_eq!(sheet.separator, Some(';'));
        let numbers: Vec<usize> = sheet.rows.iter().map(|r| r.number).collect();
        assert_eq!(numbers, [1, 4, 6]);
        assert_eq!(sheet.rows[2].cells[1], Cell::Text("2,5".into()));
    }
}

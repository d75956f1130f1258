//! Tables of trial weights: any separator, decimal comma or point, workbooks.

use std::path::Path;

use anyhow::{Result, bail};
use rotor_edge_desktop::balance::alone::stated::Weights;

use super::format;
use super::number::{Decimal, DecimalEvidence, DecimalMarks, number};
use super::sheet::{Cell, SheetRow};
use super::sheets::Sheet;
use super::table::Rows;

/// Reads a file; angles are from the keyphasor mark, with the rotation unless `against_rotation`.
///
/// # Errors
/// One sentence with the file, row and column, and what was expected.
pub fn read(path: &Path, against_rotation: bool) -> Result<Weights> {
    let sheets = format::sheets(path, names)?;
    let mut filled = sheets.iter().filter(|sheet| sheet.rows.iter().any(|row| !row.is_blank()));
    let (Some(sheet), None) = (filled.next(), filled.next()) else {
        bail!("{}: expected one table of weights, {}", path.display(), "run,plane,magnitude_g_mm,angle_deg");
    };
    Ok(Weights::of_table(&path.display().to_string(), &rows(sheet)?, against_rotation)?)
}

/// How many cells of a row are names of columns.
fn names(row: &SheetRow) -> usize {
    let is_name = |text: &str| {
        let name = text.trim().to_lowercase();
        ["run", "plane"].contains(&name.as_str()) || is_number(&name)
    };
    row.cells.iter().filter(|cell| cell.as_text().is_some_and(is_name)).count()
}

/// Whether the column of this name, in small letters, holds numbers.
fn is_number(name: &str) -> bool {
    name.starts_with("magnitude") || name.starts_with("angle")
}

/// All rows, also those of a text.
fn all_rows(sheet: &Sheet) -> Vec<SheetRow<'static>> {
    let (Some(text), Some(separator)) = (&sheet.text, sheet.separator) else { return sheet.rows.clone() };
    let mut all = Vec::new();
    Rows::Text { text, separator, behind: 0 }.for_each(|row| all.push(row.clone().into_owned()));
    all
}

/// Rows with their numbers, the header first, numbers with a decimal point.
fn rows(sheet: &Sheet) -> Result<Vec<(usize, Vec<String>)>> {
    let mut rows = all_rows(sheet);
    rows.retain(|row| !row.is_blank());
    let Some((header, body)) = rows.split_first() else { return Ok(Vec::new()) };
    let of_header = |cell: &Cell| is_number(&cell.as_text().unwrap_or_default().to_lowercase());
    let is_number: Vec<bool> = header.cells.iter().map(of_header).collect();
    let is_number = |column: usize| is_number.get(column).copied().unwrap_or(false);
    let decimal = decimal(sheet, || {
        body.iter().flat_map(|row| {
            row.cells.iter().enumerate().filter(|(k, _)| is_number(*k)).filter_map(|(_, c)| c.as_text())
        })
    })?;
    let text = |(column, cell): (usize, &Cell)| match cell {
        Cell::Empty => String::new(),
        Cell::Number(value) => value.to_string(),
        Cell::Time(time) => time.to_string(),
        Cell::Text(text) if is_number(column) => number(text, decimal)
            .filter(|(_, unit)| unit.is_empty())
            .map_or_else(|| text.to_string(), |(value, _)| value.to_string()),
        Cell::Text(text) => text.to_string(),
    };
    let row = |row: &SheetRow| {
        let width = row.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
        (row.number, row.cells[..width].iter().enumerate().map(text).collect())
    };
    Ok(rows.iter().map(row).collect())
}

fn decimal<'a, I: Iterator<Item = &'a str>>(sheet: &Sheet, numbers: impl Fn() -> I) -> Result<Decimal> {
    let place = sheet.place();
    let mut marks = DecimalMarks::default();
    numbers().for_each(|cell| marks.add(cell));
    match marks.shows() {
        DecimalEvidence::Surely(decimal) => Ok(decimal),
        DecimalEvidence::Either if sheet.separator == Some(',') => Ok(Decimal::Point),
        DecimalEvidence::Either => {
            let example = numbers().find(|text| text.contains([',', '.'])).unwrap_or_default();
            bail!(
                "{place}: \"{example}\" may be a decimal or thousands, expected numbers without thousands separators"
            )
        }
        DecimalEvidence::Both => {
            bail!("{place}: some numbers have a decimal comma and some a point, expected one of them")
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::read;

    fn weights(text: &str) -> anyhow::Result<rotor_edge_desktop::balance::alone::stated::Weights> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("w.csv");
        std::fs::write(&path, text).unwrap();
        read(&path, false)
    }

    #[test]
    fn semicolons_and_decimal_commas_give_the_same_weights() {
        let usual = weights("run,plane,magnitude_g_mm,angle_deg\nT,A,15000.5,180.0\n").unwrap();
        assert!((usual.of("T")[0] - Complex::from(-15000.5)).norm() < 1e-9);
        for other in [
            "run;plane;magnitude_g_mm;angle_deg\nT;A;15000,5;180,0\n",
            "run\tplane\tmagnitude_g_mm\tangle_deg\nT\tA\t15000,5\t180\n",
            "\u{feff}run;plane;magnitude_g_mm;angle_deg\r\nT;A;15.000,5;180\r\n\r\n",
        ] {
            assert_eq!(weights(other).unwrap().rows, usual.rows, "{other}");
        }
    }

    #[test]
    fn ambiguous_or_ragged_numbers_are_refused_with_their_place() {
        let said = |text: &str| weights(text).unwrap_err().to_string();
        let why = said("run;plane;magnitude_g_mm;angle_deg\nT;A;15,000;180\n");
        assert!(why.ends_with(
            "\"15,000\" may be a decimal or thousands, expected numbers without thousands separators"
        ));
        let why = said("run,plane,magnitude_g_mm,angle_deg\nT,A,15000,5,180\n");
        assert!(why.ends_with("w.csv: row 2: 5 cells, expected 4"), "{why}");
        assert!(said("run;plane;magnitude_g_mm;angle_deg\nT;A;ten;0\n").contains("\"ten\" is not a number"));
    }
}

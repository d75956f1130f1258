//! `table_file`: the table of a bearing in a CSV beside the rotor's file.

use std::path::Path;

use serde::Serialize;
use toml::de::{DeTable, DeValue};

use crate::bearing::table::{CoefficientTable, TableRow};
use crate::error::Error;
use crate::whole_file;

/// Columns, and whether each must be there; one that is not is zero.
const COLUMNS: [(&str, bool); 9] = [
    ("speed_rpm", true),
    ("kxx", true),
    ("kxy", false),
    ("kyx", false),
    ("kyy", true),
    ("cxx", true),
    ("cxy", false),
    ("cyx", false),
    ("cyy", true),
];

/// The key that names the file, and the one that holds what is in it.
const KEYS: [&str; 2] = ["table_file", "table"];

/// Rows as a rotor's file would state them.
#[derive(Serialize)]
struct Inline {
    table: Vec<TableRow>,
}

/// The bearings of a file that name a table, by number, and each table as text.
pub(super) fn texts(root: &DeTable<'_>, folder: &Path) -> Result<Vec<(usize, String)>, Error> {
    let Some(DeValue::Array(bearings)) = root.get("bearing").map(toml::Spanned::get_ref) else {
        return Ok(vec![]);
    };
    let mut all = Vec::new();
    for (number, bearing) in bearings.iter().enumerate() {
        let table = bearing.get_ref().as_table().filter(|b| !b.contains_key(KEYS[1]));
        let name = table.and_then(|b| b.get(KEYS[0])).and_then(|name| name.get_ref().as_str());
        let Some(name) = name else { continue };
        let path = folder.join(name);
        let file = path.display().to_string();
        let text = whole_file::read_drawing(&path)?;
        let rows = Inline { table: rows(&file, &text)? };
        all.push((number, toml::to_string(&rows).map_err(|e| Error::file(&file, e))?));
    }
    Ok(all)
}

/// Puts the tables in the place of the names of their files.
pub(super) fn resolve<'t>(
    root: &mut DeTable<'t>,
    texts: &'t [(usize, String)],
) -> Result<(), toml::de::Error> {
    let Some(DeValue::Array(bearings)) = root.get_mut("bearing").map(toml::Spanned::get_mut) else {
        return Ok(());
    };
    for (number, text) in texts {
        if let Some(DeValue::Table(bearing)) = bearings.get_mut(*number).map(toml::Spanned::get_mut) {
            bearing.remove(KEYS[0]);
            bearing.extend(DeTable::parse(text)?.into_inner());
        }
    }
    Ok(())
}

/// The rows of a CSV, each checked.
fn rows(file: &str, text: &str) -> Result<Vec<TableRow>, Error> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let headers = reader.headers().map_err(|e| Error::measurement(file, "header", e.to_string()))?.clone();
    let known = COLUMNS.map(|(name, _)| name);
    if let Some(stranger) = headers.iter().find(|h| !known.contains(h)) {
        let expected = known.join(",");
        return Err(Error::measurement(
            file,
            "header",
            format!("\"{stranger}\" is no column, expected {expected}"),
        ));
    }
    for (name, needed) in COLUMNS {
        if needed && !headers.iter().any(|h| h == name) {
            return Err(Error::measurement(file, "header", format!("the column {name} is missing")));
        }
    }
    let mut rows: Vec<TableRow> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| {
            let line = e.position().map_or(0, csv::Position::line);
            Error::measurement(file, format!("row {line}"), format!("expected {} numbers", headers.len()))
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        let wrong = |what: String| Error::measurement(file, format!("row {line}"), what);
        if let Some((text, column)) =
            record.iter().zip(&headers).find(|(text, _)| text.parse::<f64>().is_err())
        {
            return Err(wrong(format!("{column} \"{text}\" is no number")));
        }
        // a column that is there twice
        let row: TableRow = record.deserialize(Some(&headers)).map_err(|e| wrong(e.to_string()))?;
        row.check().map_err(|(column, what)| wrong(format!("{column} {what}")))?;
        if let Some(last) = rows.last() {
            row.follows(last).map_err(wrong)?;
        }
        rows.push(row);
    }
    CoefficientTable::new(rows.clone()).map_err(|what| Error::measurement(file, "rows", what))?;
    Ok(rows)
}

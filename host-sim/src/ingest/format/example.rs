//! The worked example of a format in CONTRIBUTING.md: one JSON object a line, its keys the columns of a table.

use anyhow::{Context, Result, ensure};
use serde_json::{Map, Value};

use super::super::sheet::{Cell, SheetRow};
use super::super::sheets::Sheet;
use super::{Content, Format};

pub const JSON_LINES: Format = Format::of(&["jsonl"], is, read);

fn is(bytes: &[u8]) -> bool {
    bytes.starts_with(b"{\"")
}

fn read(file: &str, bytes: Vec<u8>) -> Result<Content> {
    let mut rows: Vec<SheetRow<'static>> = Vec::new();
    for (i, line) in String::from_utf8_lossy(&bytes).lines().enumerate() {
        let number = i + 1;
        let wrong = || format!("{file}: row {number}: expected a JSON object");
        let object: Map<String, Value> = serde_json::from_str(line).with_context(wrong)?;
        if rows.is_empty() {
            rows.push(SheetRow { number, cells: object.keys().map(|key| Cell::copied(key)).collect() });
        }
        let cells: Vec<Cell<'static>> = object.values().map(cell).collect();
        let columns = rows[0].cells.len();
        ensure!(cells.len() == columns, "{file}: row {number}: expected {columns} keys as in row 1");
        rows.push(SheetRow { number, cells });
    }
    Ok(Content::Sheets(vec![Sheet { file: file.into(), name: None, separator: None, rows, text: None }]))
}

fn cell(value: &Value) -> Cell<'static> {
    match value {
        Value::Null => Cell::Empty,
        Value::String(text) => Cell::copied(text),
        value => value.as_f64().map_or_else(|| Cell::copied(&value.to_string()), Cell::Number),
    }
}

#[test]
fn json_lines_are_found_by_content_and_read_as_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("export.txt");
    let formats = [super::FORMATS[0], JSON_LINES];
    std::fs::write(&path, "{\"16X amp\":12.5,\"speed\":1500}\n{\"16X amp\":null,\"speed\":1510}\n").unwrap();
    let sheets = super::sheets_of(&formats, &path, super::super::table::score).unwrap();
    let cells: Vec<&[Cell]> = sheets[0].rows.iter().map(|row| &row.cells[..]).collect();
    let header = [Cell::copied("16X amp"), Cell::copied("speed")];
    assert_eq!(
        cells,
        [&header[..], &[Cell::Number(12.5), Cell::Number(1500.0)], &[Cell::Empty, Cell::Number(1510.0)]]
    );
    std::fs::write(&path, "{\"speed\":1500}\n1510\n").unwrap();
    let error = super::sheets_of(&formats, &path, super::super::table::score).unwrap_err();
    assert_eq!(error.to_string(), format!("{}: row 2: expected a JSON object", path.display()));
}

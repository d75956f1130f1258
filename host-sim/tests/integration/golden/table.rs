//! CSV files as JSON, so that they are cut and compared as answers are.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::token::{Token, tokens};

/// How a column's numbers are printed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Printed {
    /// One unit of the last digit, in the column's unit.
    pub absolute: f64,
    /// The same relative to the number, where exponents are printed.
    pub relative: f64,
}

/// A table as `{comments, columns, rows}`, and how its columns are printed, by JSON path.
pub fn read(text: &str) -> (Value, BTreeMap<String, Printed>) {
    let comments: Vec<&str> = text.lines().filter(|line| line.starts_with('#')).collect();
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).flexible(true).from_reader(text.as_bytes());
    let names: Vec<String> =
        reader.headers().map(|header| header.iter().map(str::to_string).collect()).unwrap_or_default();
    let mut printed = BTreeMap::new();
    let mut rows = Vec::new();
    for record in reader.records().flatten() {
        let cells = names.iter().zip(record.iter()).map(|(name, cell)| {
            let how = printed.entry(format!(".rows[].{name}")).or_default();
            (name.clone(), value(cell, how))
        });
        rows.push(Value::Object(cells.collect::<Map<_, _>>()));
    }
    (json!({"columns": names.join(","), "comments": comments.join("\n"), "rows": rows}), printed)
}

fn value(cell: &str, how: &mut Printed) -> Value {
    match tokens(cell).as_slice() {
        [Token::Number { text, is_integer: true, .. }] => {
            text.parse::<i64>().map_or_else(|_| Value::from(cell), Value::from)
        }
        [Token::Number { text, value, unit, .. }] => {
            match text.contains('e') {
                // zero has no exponent of its own
                true if *value == 0.0 => {}
                true => how.relative = how.relative.max(unit / value.abs()),
                false => how.absolute = how.absolute.max(*unit),
            }
            Value::from(*value)
        }
        _ => Value::from(cell),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_becomes_rows_with_units_of_last_digits() {
        let (value, printed) = read("# note\nday,k,name\n1,1.5e8,a\n2,2.50,b\n");
        assert_eq!(value["rows"][1], json!({"day": 2, "k": 2.5, "name": "b"}));
        assert_eq!(value["comments"], "# note");
        let k = printed[".rows[].k"];
        assert!(k.absolute == 0.01 && (k.relative - 0.1 / 1.5).abs() < 1e-9, "{k:?}");
    }
}

//! Parquet, as historians and data frames write it.

use std::panic;

use anyhow::{Context, Result, bail};
use jiff::Timestamp;
use jiff::tz::TimeZone;
use parquet::basic::{LogicalType, TimeUnit};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

use super::super::sheet::{Cell, SheetRow};
use super::super::sheets::Sheet;
use super::Content;

const SECONDS_A_DAY: i64 = 86_400;
/// Cells of a file: more of them need more memory than a table of readings.
const MOST_CELLS: usize = 16_000_000;

/// The table; rows count from 2, as if its names were the first.
pub fn read(file: &str, bytes: &[u8]) -> Result<Content> {
    // the crate panics on some damaged files; what it had read until then is dropped with it
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| ()));
    let read = panic::catch_unwind(|| table(file, bytes));
    panic::set_hook(hook);
    match read {
        Ok(sheet) => Ok(Content::Sheets(vec![sheet?])),
        Err(_) => bail!("{file}: cannot be read as Parquet: it is damaged"),
    }
}

fn table(file: &str, bytes: &[u8]) -> Result<Sheet> {
    let wrong = || format!("{file}: cannot be read as Parquet");
    let reader = SerializedFileReader::new(bytes::Bytes::copy_from_slice(bytes)).with_context(wrong)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let columns = schema.root_schema().get_fields();
    if let Some(nested) = columns.iter().find(|column| !column.is_primitive()) {
        bail!("{file}: column `{}` holds lists or groups, expected a table of single values", nested.name());
    }
    let rows = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or(usize::MAX);
    if rows.saturating_mul(columns.len()) > MOST_CELLS {
        bail!(
            "{file}: has {rows} rows of {} columns, expected at most {MOST_CELLS} cells, or CSV",
            columns.len()
        );
    }
    let in_nanoseconds: Vec<bool> = (schema.columns().iter())
        .map(|column| matches!(column.logical_type_ref(), Some(LogicalType::Timestamp(t)) if t.unit == TimeUnit::NANOS))
        .collect();
    let names = columns.iter().map(|column| Cell::copied(column.name())).collect();
    let mut rows = vec![SheetRow { number: 1, cells: names }];
    for (i, row) in reader.get_row_iter(None).with_context(wrong)?.enumerate() {
        let row = row.with_context(wrong)?;
        let cells = row.get_column_iter().zip(&in_nanoseconds);
        rows.push(SheetRow {
            number: i + 2,
            cells: cells.map(|((_, field), nanos)| cell(field, *nanos)).collect(),
        });
    }
    Ok(Sheet { file: file.into(), name: None, separator: None, rows, text: None })
}

fn cell(field: &Field, in_nanoseconds: bool) -> Cell<'static> {
    let number = |x: f64| if x.is_nan() { Cell::Empty } else { Cell::Number(x) };
    match field {
        Field::Null => Cell::Empty,
        Field::Long(nanoseconds) if in_nanoseconds => time(Timestamp::from_nanosecond((*nanoseconds).into())),
        Field::TimestampMillis(ms) => time(Timestamp::from_millisecond(*ms)),
        Field::TimestampMicros(us) => time(Timestamp::from_microsecond(*us)),
        Field::Date(days) => time(Timestamp::from_second(i64::from(*days) * SECONDS_A_DAY)),
        Field::Double(x) => number(*x),
        Field::Float(x) => number(f64::from(*x)),
        Field::Float16(x) => number(x.to_f64()),
        Field::Byte(n) => Cell::Number(f64::from(*n)),
        Field::Short(n) => Cell::Number(f64::from(*n)),
        Field::Int(n) => Cell::Number(f64::from(*n)),
        Field::Long(n) => Cell::Number(*n as f64),
        Field::UByte(n) => Cell::Number(f64::from(*n)),
        Field::UShort(n) => Cell::Number(f64::from(*n)),
        Field::UInt(n) => Cell::Number(f64::from(*n)),
        Field::ULong(n) => Cell::Number(*n as f64),
        Field::Str(text) => Cell::copied(text),
        Field::Bytes(bytes) => Cell::copied(&String::from_utf8_lossy(bytes.data())),
        other => Cell::copied(&other.to_string()),
    }
}

/// As the file has it, in UTC.
fn time(at: Result<Timestamp, jiff::Error>) -> Cell<'static> {
    at.map_or(Cell::Empty, |at| Cell::Time(at.to_zoned(TimeZone::UTC).datetime()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Written by pandas and pyarrow, see tests/reference/make_parquet.py.
    const EXPORT: &[u8] = include_bytes!("../../../../tests/import/export.parquet");

    #[test]
    fn a_file_of_pandas_is_the_table_that_was_saved() {
        let Content::Sheets(sheets) = read("export.parquet", EXPORT).unwrap() else { panic!() };
        let rows = &sheets[0].rows;
        assert_eq!((rows.len(), rows[1].number), (41, 2));
        assert_eq!(rows[0].cells[4], Cell::Text("15X 1X Ampl [mil pp]".into()));
        let begins = jiff::civil::date(2026, 3, 1).at(6, 0, 0, 0);
        assert_eq!(
            rows[1].cells[..3],
            [Cell::Time(begins), Cell::Text("K-101".into()), Cell::Number(11_000.0)]
        );
        assert_eq!(rows[40].cells[0], Cell::Time(begins.checked_add(jiff::Span::new().hours(39)).unwrap()));
        let Cell::Number(amplitude) = rows[40].cells[4] else { panic!("{:?}", rows[40]) };
        assert!((amplitude - 2.39).abs() < 1e-12);
        assert_eq!(rows[8].cells[4..6], [Cell::Empty, Cell::Empty], "lost");
    }

    #[test]
    fn damaged_parquet_is_refused() {
        let (mut refused, mut random) = (0, 1_u64);
        for round in 0..30_000 {
            let mut bytes = EXPORT.to_vec();
            for _ in 0..1 + round % 4 {
                // xorshift
                random ^= random << 13;
                random ^= random >> 7;
                random ^= random << 17;
                let at = 4 + (random >> 8) as usize % (bytes.len() - 4);
                bytes[at] = random as u8;
            }
            if round % 10 == 0 {
                bytes.truncate(4 + random as usize % bytes.len().saturating_sub(4));
            }
            refused += usize::from(read("export.parquet", &bytes).is_err());
        }
        assert!(refused > 1_000, "{refused}");
    }
}

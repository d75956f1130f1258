//! A store as Parquet, a file a table and day (UTC): what notebooks and data lakes read.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use jiff::Timestamp;
use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Row};

use crate::item::Kind;
use crate::store::Store;

const US_A_DAY: i64 = 86_400_000_000;
/// Rows that are held in memory and written together.
const ROWS_A_GROUP: usize = 100_000;

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ExportTotals {
    /// Files that are new, or are new again because their day has got more rows.
    pub written: usize,
    pub rows: u64,
    /// Files that held all rows of their day.
    pub left: usize,
}

/// Writes every day that the folder has not, or not all of; `tell` hears of each file.
///
/// # Errors
/// If the store cannot be read or a file cannot be written; a file is there whole or not at all.
pub fn run(store: &Store, folder: &Path, tell: fn(&str)) -> Result<ExportTotals> {
    let mut totals = ExportTotals::default();
    for kind in Kind::ALL {
        let table = ItemTable::of(store.reading(), kind.name())?;
        let folder = folder.join(kind.name());
        std::fs::create_dir_all(&folder)
            .with_context(|| format!("{}: cannot be created", folder.display()))?;
        let mut day = i64::MIN;
        while let Some(first_us) = table.first_from(day.saturating_mul(US_A_DAY))? {
            day = first_us.div_euclid(US_A_DAY);
            let path = folder.join(format!("{}.parquet", name(day)?));
            let rows = table.count(day)?;
            if held(&path) == Some(rows) {
                totals.left += 1;
            } else {
                table.write(day, &path).with_context(|| path.display().to_string())?;
                tell(&format!("{}: {rows} rows", path.display()));
                totals.written += 1;
                totals.rows += rows;
            }
            day += 1;
        }
    }
    Ok(totals)
}

fn name(day: i64) -> Result<String> {
    Ok(Timestamp::from_microsecond(day * US_A_DAY)?.strftime("%F").to_string())
}

/// Rows of a file; none if there is none that can be read.
fn held(path: &Path) -> Option<u64> {
    let reader = SerializedFileReader::new(File::open(path).ok()?).ok()?;
    Some(reader.metadata().file_metadata().num_rows().unsigned_abs())
}

/// A table of items, with plant, bus and node in place of the number of the source.
struct ItemTable<'a> {
    connection: &'a Connection,
    name: &'static str,
    columns: Vec<(String, Type, bool)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Type {
    Integer,
    Time,
    Real,
    Text,
}

impl<'a> ItemTable<'a> {
    fn of(connection: &'a Connection, name: &'static str) -> Result<Self> {
        let mut columns: Vec<(String, Type, bool)> = vec![
            ("plant".into(), Type::Text, true),
            ("bus".into(), Type::Text, true),
            ("node".into(), Type::Integer, true),
        ];
        let mut statement = connection.prepare("SELECT name, type, \"notnull\" FROM pragma_table_info(?)")?;
        let mut rows = statement.query([name])?;
        while let Some(row) = rows.next()? {
            let (column, kind): (String, String) = (row.get(0)?, row.get(1)?);
            let kind = match (column.as_str(), kind.as_str()) {
                ("source", _) => continue,
                ("time_us", _) => Type::Time,
                (_, "INTEGER") => Type::Integer,
                (_, "REAL") => Type::Real,
                _ => Type::Text,
            };
            columns.push((column, kind, row.get(2)?));
        }
        Ok(Self { connection, name, columns })
    }

    /// The first moment of a row from a moment on.
    fn first_from(&self, from_us: i64) -> Result<Option<i64>> {
        let sql = format!(
            "SELECT min((SELECT min(time_us) FROM {} WHERE source = s.id AND time_us >= ?)) FROM source s",
            self.name
        );
        Ok(self.connection.query_row(&sql, [from_us], |row| row.get(0))?)
    }

    /// Of a day, in the order of their sources and numbers.
    fn rows(&self, what: &str) -> String {
        let table = self.name;
        format!(
            "SELECT {what} FROM source s JOIN {table} t ON t.source = s.id AND t.time_us >= ?1 * {US_A_DAY} \
             AND t.time_us < (?1 + 1) * {US_A_DAY}"
        )
    }

    fn count(&self, day: i64) -> Result<u64> {
        let rows: i64 = self.connection.query_row(&self.rows("count(*)"), [day], |row| row.get(0))?;
        Ok(rows.unsigned_abs())
    }

    fn schema(&self) -> String {
        let field = |(name, kind, is_required): &(String, Type, bool)| {
            let (physical, logical) = match kind {
                Type::Integer => ("INT64", ""),
                Type::Time => ("INT64", " (TIMESTAMP(MICROS,true))"),
                Type::Real => ("DOUBLE", ""),
                Type::Text => ("BYTE_ARRAY", " (STRING)"),
            };
            let repetition = if *is_required { "REQUIRED" } else { "OPTIONAL" };
            format!("{repetition} {physical} {name}{logical};")
        };
        format!("message {} {{ {} }}", self.name, self.columns.iter().map(field).collect::<String>())
    }

    fn write(&self, day: i64, path: &Path) -> Result<()> {
        let begun = Begun(path.with_extension("parquet.part"));
        let schema = Arc::new(parse_message_type(&self.schema())?);
        let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
        let mut file = SerializedFileWriter::new(File::create(&begun.0)?, schema, Arc::new(properties))?;
        let named: Vec<&str> = self.columns.iter().map(|(name, ..)| name.as_str()).collect();
        let sql =
            format!("{} ORDER BY s.plant, s.bus, s.node, t.epoch, t.sequence", self.rows(&named.join(", ")));
        let mut statement = self.connection.prepare(&sql)?;
        let mut rows = statement.query([day])?;
        loop {
            let mut values: Vec<Values> = self.columns.iter().map(|(_, kind, _)| Values::of(*kind)).collect();
            let mut count = 0;
            while count < ROWS_A_GROUP
                && let Some(row) = rows.next()?
            {
                for (column, values) in values.iter_mut().enumerate() {
                    values.push(row, column)?;
                }
                count += 1;
            }
            if count == 0 {
                break;
            }
            let mut group = file.next_row_group()?;
            for (values, (.., is_required)) in values.iter().zip(&self.columns) {
                // as many as the schema has
                let Some(column) = group.next_column()? else { break };
                values.write(column, *is_required)?;
            }
            group.close()?;
        }
        file.into_inner()?.sync_all()?;
        std::fs::rename(&begun.0, path)?;
        Ok(())
    }
}

/// A file that is not whole; gone unless it was renamed.
struct Begun(PathBuf);

impl Drop for Begun {
    fn drop(&mut self) {
        // renamed, as a rule
        let _ = std::fs::remove_file(&self.0);
    }
}

/// The values of a column that are there, and where there are some (1) and none (0).
struct Values {
    known: Known,
    levels: Vec<i16>,
}

enum Known {
    Integers(Vec<i64>),
    Reals(Vec<f64>),
    Texts(Vec<ByteArray>),
}

impl Values {
    fn of(kind: Type) -> Self {
        let known = match kind {
            Type::Integer | Type::Time => Known::Integers(Vec::new()),
            Type::Real => Known::Reals(Vec::new()),
            Type::Text => Known::Texts(Vec::new()),
        };
        Self { known, levels: Vec::new() }
    }

    fn push(&mut self, row: &Row, column: usize) -> Result<()> {
        self.levels.push(i16::from(row.get_ref(column)? != ValueRef::Null));
        if self.levels.last() == Some(&1) {
            match &mut self.known {
                Known::Integers(all) => all.push(row.get(column)?),
                Known::Reals(all) => all.push(row.get(column)?),
                Known::Texts(all) => all.push(row.get::<_, String>(column)?.as_str().into()),
            }
        }
        Ok(())
    }

    fn write(&self, mut column: SerializedColumnWriter, is_required: bool) -> Result<()> {
        let levels = (!is_required).then_some(self.levels.as_slice());
        match &self.known {
            Known::Integers(all) => column.typed::<Int64Type>().write_batch(all, levels, None)?,
            Known::Reals(all) => column.typed::<DoubleType>().write_batch(all, levels, None)?,
            Known::Texts(all) => column.typed::<ByteArrayType>().write_batch(all, levels, None)?,
        };
        Ok(column.close()?)
    }
}

//! A PostgreSQL database with the tables and views of a file. What is committed is on the database's disk.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::Write as _;

use anyhow::{Context, Result, bail};
use postgres::{Client, GenericClient, NoTls};
use rusqlite::types::Value;

use crate::item::{Item, Kind, Source};
use crate::numbering::Last;
use crate::sink::{Sink, is_kept};
use crate::store::schema::POSTGRESQL;
use crate::store::{VERSION, rows};

/// Of whoever brings the schema up to date.
const MIGRATING: i64 = 0x726f_746f;

pub struct Database {
    client: Client,
    address: String,
    name: String,
    sources: HashMap<Source, i64>,
    /// Buses that this gateway keeps; a connection that is made anew claims them anew.
    claims: Vec<String>,
}

impl Database {
    /// Connects, makes the tables if there are none, and brings older ones up to date.
    ///
    /// # Errors
    /// One sentence if there is no database, if it lets nobody in, or if its tables are of a newer version.
    pub fn open(address: &str) -> Result<Self> {
        let config: postgres::Config =
            address.parse().context("expected postgres://NAME:PASSWORD@HOST:PORT/DATABASE")?;
        let name = format!("database {}", config.get_dbname().unwrap_or("postgres"));
        let client = connected(address, &name)?;
        Ok(Self { client, address: address.into(), name, sources: HashMap::new(), claims: Vec::new() })
    }

    /// Rows go into a table of their own first, for it is filled many at a time, and then those that are new to theirs.
    fn write(&mut self, items: &[Item]) -> Result<()> {
        let mut step = self.client.transaction()?;
        let mut sources = HashMap::new();
        let mut rows: HashMap<Kind, String> = HashMap::new();
        for item in items {
            let source = match self.sources.get(&item.source).or_else(|| sources.get(&item.source)) {
                Some(id) => *id,
                None => {
                    let id = source_id(&mut step, &item.source)?;
                    sources.insert(item.source.clone(), id);
                    id
                }
            };
            copied(rows.entry(item.body.kind()).or_default(), &rows::values(source, item));
        }
        for (kind, text) in rows {
            let table = kind.name();
            step.batch_execute(&format!(
                "CREATE TEMPORARY TABLE IF NOT EXISTS new_{table} (LIKE {table}) ON COMMIT DELETE ROWS"
            ))?;
            let mut copy = step.copy_in(&format!("COPY new_{table} FROM STDIN"))?;
            copy.write_all(text.as_bytes())?;
            copy.finish()?;
            step.batch_execute(&format!(
                "INSERT INTO {table} SELECT * FROM new_{table} ON CONFLICT DO NOTHING"
            ))?;
        }
        step.commit()?;
        // only what is committed may be remembered
        self.sources.extend(sources);
        Ok(())
    }
}

fn connected(address: &str, name: &str) -> Result<Client> {
    let mut client = Client::connect(address, NoTls)
        .with_context(|| format!("{name}: no PostgreSQL server accepted the connection"))?;
    prepare(&mut client).with_context(|| format!("{name}: cannot be used"))?;
    Ok(client)
}

fn prepare(client: &mut Client) -> Result<()> {
    let mut step = client.transaction()?;
    step.execute("SELECT pg_advisory_xact_lock($1)", &[&MIGRATING])?;
    step.batch_execute("CREATE TABLE IF NOT EXISTS rotor_edge (version INTEGER NOT NULL)")?;
    let version =
        step.query_opt("SELECT version FROM rotor_edge", &[])?.map_or(0, |row| row.get::<_, i32>(0));
    if version > VERSION {
        bail!(
            "its version is {version} and this program knows {VERSION}; use the program that wrote it, or a newer one"
        );
    }
    for migration in POSTGRESQL.migrations(version) {
        step.batch_execute(&migration)?;
    }
    if version < VERSION {
        step.batch_execute(&format!("DELETE FROM rotor_edge; INSERT INTO rotor_edge VALUES ({VERSION})"))?;
    }
    Ok(step.commit()?)
}

/// Whether something is this connection's alone.
fn locked(client: &mut Client, key: &str) -> Result<bool> {
    Ok(client.query_one("SELECT pg_try_advisory_lock(hashtextextended($1, 0))", &[&key])?.get(0))
}

/// A row as COPY takes it.
fn copied(text: &mut String, row: &[Value]) {
    for (column, value) in row.iter().enumerate() {
        let end = if column + 1 < row.len() { '\t' } else { '\n' };
        // writing to a String cannot fail
        let _ = match value {
            Value::Integer(number) => write!(text, "{number}{end}"),
            Value::Real(number) => write!(text, "{number:?}{end}"),
            Value::Text(word) => {
                let escaped =
                    word.replace('\\', "\\\\").replace('\t', "\\t").replace('\n', "\\n").replace('\r', "\\r");
                write!(text, "{escaped}{end}")
            }
            Value::Null | Value::Blob(_) => write!(text, "\\N{end}"),
        };
    }
}

fn source_id(client: &mut impl GenericClient, source: &Source) -> Result<i64> {
    let (plant, bus, node) = (&source.plant, &source.bus, i64::from(source.node));
    client.execute(
        "INSERT INTO source (plant, bus, node) VALUES ($1, $2, $3) ON CONFLICT DO NOTHING",
        &[plant, bus, &node],
    )?;
    let sql = "SELECT id FROM source WHERE plant = $1 AND bus = $2 AND node = $3";
    Ok(client.query_one(sql, &[plant, bus, &node])?.get(0))
}

impl Sink for Database {
    fn claim(&mut self, plant: &str, bus: &str) -> Result<()> {
        let key = format!("{}:{plant}:{bus}", plant.len());
        if !locked(&mut self.client, &key)? {
            bail!(is_kept(&self.name, plant, bus));
        }
        self.claims.push(key);
        Ok(())
    }

    fn last(&mut self, plant: &str, bus: &str) -> Result<Vec<(u8, Kind, Last)>> {
        let mut all = Vec::new();
        for kind in Kind::ALL {
            let sql = format!(
                "SELECT DISTINCT ON (s.node) s.node, t.epoch, t.sequence, t.time_us FROM source s JOIN {} t ON t.source = s.id \
                 WHERE s.plant = $1 AND s.bus = $2 ORDER BY s.node, t.epoch DESC, t.sequence DESC",
                kind.name()
            );
            for row in self.client.query(&sql, &[&plant, &bus])? {
                let number = |column: usize| row.get::<_, i64>(column);
                let last =
                    Last { epoch: number(1).unsigned_abs(), sequence: number(2) as u16, time_us: number(3) };
                all.push((number(0) as u8, kind, last));
            }
        }
        Ok(all)
    }

    fn put(&mut self, items: &[Item]) -> Result<()> {
        if self.client.is_closed() {
            let mut anew = connected(&self.address, &self.name)?;
            for key in &self.claims {
                if !locked(&mut anew, key)? {
                    bail!("{}: another gateway has taken over this bus", self.name);
                }
            }
            self.client = anew;
        }
        self.write(items).with_context(|| self.name.clone())
    }

    fn description(&self) -> String {
        self.name.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copied_row_keeps_names_and_numbers_to_the_bit() {
        let mut text = String::new();
        let row = [
            Value::Text("a\\b\tc\n".into()),
            Value::Null,
            Value::Real(f64::from(0.1_f32)),
            Value::Integer(-3),
        ];
        copied(&mut text, &row);
        assert_eq!(text, "a\\\\b\\tc\\n\t\\N\t0.10000000149011612\t-3\n");
    }
}

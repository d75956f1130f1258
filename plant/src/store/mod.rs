//! An SQLite file. What is committed is on the disk: `synchronous` is full, and the journal is written ahead.

pub(crate) mod rows;
pub mod schema;

use std::collections::HashMap;
use std::fs::{File, TryLockError};
use std::path::Path;

use anyhow::{Context, Result, bail};
use rusqlite::{Connection, OptionalExtension as _, params_from_iter};

use crate::item::{Item, Kind, Source, plain_word};
use crate::numbering::Last;
use crate::sink::{Sink, is_kept};

pub use rows::Newest;
pub use schema::VERSION;

/// Says that a file is one of ours.
const APPLICATION_ID: i32 = 0x726f_746f;
/// Wait for another program that writes, ms.
const BUSY_MS: u32 = 10_000;

/// What is held of the file in memory, kB. Rows of hundreds of monitors go to as many places: what one commit changes must
/// fit, or it is written several times.
const CACHE_KB: i32 = 65_536;
/// Pages of 4 kB in the journal before they are brought into the file: the same places are written by every commit, and so once
/// in a while instead of each time.
const JOURNAL_PAGES: i32 = 16_384;

/// What is removed in one step: an hour of one monitor, µs.
const FORGOTTEN_TOGETHER_US: i64 = 3_600_000_000;

pub struct Store {
    connection: Connection,
    name: String,
    sources: HashMap<Source, i64>,
    /// One a bus that this gateway keeps.
    locks: Vec<File>,
}

impl Store {
    /// Opens a store, makes it if there is none, and brings an older one up to date.
    ///
    /// # Errors
    /// One sentence if the file is no store, or one of a newer version.
    pub fn open(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let mut connection = Connection::open(path).with_context(|| format!("{name}: cannot be opened"))?;
        prepare(&mut connection)
            .with_context(|| format!("{name}: not a usable store of rotor-edge-plant"))?;
        Ok(Self { connection, name, sources: HashMap::new(), locks: Vec::new() })
    }

    /// Opens a store that is there, and never writes into it.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open_to_read(path: &Path) -> Result<Self> {
        let store = Self::open(path)?;
        store.connection.pragma_update(None, "query_only", true)?;
        Ok(store)
    }

    /// To look at what there is.
    pub(crate) fn reading(&self) -> &Connection {
        &self.connection
    }

    /// Removes what is older than a moment; how many rows. The last of each monitor stays, for it says where its numbers go on. It
    /// is done in small steps, between which others write.
    ///
    /// # Errors
    /// If the file takes nothing; what is removed until then is.
    pub fn forget(&mut self, kind: Kind, before_us: i64) -> Result<usize> {
        let table = kind.name();
        let last = "(SELECT epoch, sequence FROM {table} WHERE source = ?1 ORDER BY epoch DESC, sequence DESC LIMIT 1)";
        let old =
            format!("source = ?1 AND time_us < ?2 AND (epoch, sequence) <> {last}").replace("{table}", table);
        let first = format!("SELECT time_us FROM {table} WHERE {old} ORDER BY time_us LIMIT 1");
        let remove = format!("DELETE FROM {table} WHERE {old}");
        let mut statement = self.connection.prepare("SELECT id FROM source")?;
        let sources: Vec<i64> =
            statement.query_map([], |row| row.get(0))?.collect::<rusqlite::Result<_>>()?;
        let mut rows = 0;
        for source in sources {
            let oldest = || {
                self.connection.query_row(&first, [source, before_us], |row| row.get::<_, i64>(0)).optional()
            };
            while let Some(first_us) = oldest()? {
                let until_us = before_us.min(first_us.saturating_add(FORGOTTEN_TOGETHER_US));
                rows += self.connection.execute(&remove, [source, until_us])?;
            }
        }
        Ok(rows)
    }

    /// For the jobs of the fleet.
    pub(crate) fn connection(&mut self) -> &mut Connection {
        &mut self.connection
    }

    /// Rows of each kind, for tests and `status`.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn count(&self, kind: Kind) -> Result<u64> {
        let sql = format!("SELECT count(*) FROM {}", kind.name());
        Ok(self.connection.query_row(&sql, [], |row| row.get::<_, i64>(0))?.unsigned_abs())
    }

    /// The last word of every monitor.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn newest(&self) -> Result<Vec<Newest>> {
        let mut statement = self.connection.prepare("SELECT * FROM newest ORDER BY plant, bus, node")?;
        let all = statement.query_map([], Newest::of)?;
        Ok(all.collect::<rusqlite::Result<_>>()?)
    }
}

fn prepare(connection: &mut Connection) -> Result<()> {
    connection.busy_timeout(std::time::Duration::from_millis(BUSY_MS.into()))?;
    let number = |c: &Connection, name: &str| c.pragma_query_value(None, name, |row| row.get::<_, i32>(0));
    let (version, application) = (number(connection, "user_version")?, number(connection, "application_id")?);
    let is_new = version == 0
        && application == 0
        && connection.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get::<_, i64>(0))? == 0;
    if !is_new && application != APPLICATION_ID {
        bail!("it is a database of another program");
    }
    if version > VERSION {
        bail!(
            "its version is {version} and this program knows {VERSION}; use the program that wrote it, or a newer one"
        );
    }
    connection.pragma_update(None, "journal_mode", "wal")?;
    connection.pragma_update(None, "synchronous", "full")?;
    connection.pragma_update(None, "foreign_keys", true)?;
    connection.pragma_update(None, "cache_size", -CACHE_KB)?;
    connection.pragma_update(None, "wal_autocheckpoint", JOURNAL_PAGES)?;
    if version == VERSION {
        return Ok(());
    }
    let step = connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate)?;
    // another program may have done it meanwhile
    let version = number(&step, "user_version")?;
    for migration in schema::SQLITE.migrations(version) {
        step.execute_batch(&migration)?;
    }
    step.pragma_update(None, "user_version", VERSION)?;
    step.pragma_update(None, "application_id", APPLICATION_ID)?;
    Ok(step.commit()?)
}

impl Sink for Store {
    fn claim(&mut self, plant: &str, bus: &str) -> Result<()> {
        let path = format!("{}-{}-{}.lock", self.name, plain_word(plant), plain_word(bus));
        let file = File::create(&path).with_context(|| format!("{path}: cannot be created"))?;
        match file.try_lock() {
            Ok(()) => self.locks.push(file),
            Err(TryLockError::WouldBlock) => bail!(is_kept(&self.name, plant, bus)),
            Err(TryLockError::Error(error)) => {
                return Err(error).with_context(|| format!("{path}: cannot be locked"));
            }
        }
        Ok(())
    }

    fn last(&mut self, plant: &str, bus: &str) -> Result<Vec<(u8, Kind, Last)>> {
        let mut all = Vec::new();
        for kind in Kind::ALL {
            let sql = format!(
                "SELECT s.node, t.epoch, t.sequence, t.time_us FROM source s JOIN {0} t ON t.source = s.id AND (t.epoch, t.sequence) = \
                 (SELECT epoch, sequence FROM {0} WHERE source = s.id ORDER BY epoch DESC, sequence DESC LIMIT 1) \
                 WHERE s.plant = ? AND s.bus = ?",
                kind.name()
            );
            let mut statement = self.connection.prepare(&sql)?;
            let row = |row: &rusqlite::Row| {
                let epoch = row.get::<_, i64>(1)?.unsigned_abs();
                Ok((row.get(0)?, kind, Last { epoch, sequence: row.get(2)?, time_us: row.get(3)? }))
            };
            for last in statement.query_map([plant, bus], row)? {
                all.push(last?);
            }
        }
        Ok(all)
    }

    fn put(&mut self, items: &[Item]) -> Result<()> {
        let transaction = self.connection.transaction().with_context(|| self.name.clone())?;
        let mut added: HashMap<&Source, i64> = HashMap::new();
        for item in items {
            let source = match self.sources.get(&item.source).or_else(|| added.get(&item.source)) {
                Some(id) => *id,
                None => {
                    let id = source_id(&transaction, &item.source).with_context(|| self.name.clone())?;
                    added.insert(&item.source, id);
                    id
                }
            };
            let values = rows::values(source, item);
            let places = vec!["?"; values.len()].join(", ");
            let table = item.body.kind().name();
            let sql = format!(
                "INSERT INTO {table} VALUES ({places}) ON CONFLICT (source, epoch, sequence) DO NOTHING"
            );
            let mut statement = transaction.prepare_cached(&sql)?;
            statement.execute(params_from_iter(values)).with_context(|| self.name.clone())?;
        }
        transaction.commit().with_context(|| self.name.clone())?;
        // only what is committed may be remembered
        self.sources.extend(added.into_iter().map(|(source, id)| (source.clone(), id)));
        Ok(())
    }

    fn description(&self) -> String {
        self.name.clone()
    }
}

fn source_id(connection: &Connection, source: &Source) -> rusqlite::Result<i64> {
    let Source { plant, bus, node } = source;
    let find = "SELECT id FROM source WHERE plant = ? AND bus = ? AND node = ?";
    let there = connection.query_row(find, (plant, bus, node), |row| row.get(0)).optional()?;
    there.map_or_else(
        || {
            connection
                .execute("INSERT INTO source (plant, bus, node) VALUES (?, ?, ?)", (plant, bus, node))?;
            Ok(connection.last_insert_rowid())
        },
        Ok,
    )
}

//! Names and the last day of every machine, looked up seldom: they change slowly, and there may be thousands.

use std::collections::HashMap;
use std::sync::Arc;

use anyhow::Result;
use rotor_edge_desktop::rotor_file;

use super::glance::Known;
use super::recent::Recent;
use crate::names::Names;
use crate::store::{Newest, Store};

/// Between two looks at the drawings, µs.
const DRAWINGS_US: i64 = 10_000_000;
/// Between two looks at the last day of one machine, µs.
const RECENT_US: i64 = 60_000_000;
/// Machines whose last day is looked up at once, so that a look stays short.
const AT_ONCE: usize = 50;

/// What is known of each monitor, by the number of its source.
#[derive(Default)]
pub struct KnownMachines {
    all: HashMap<i64, Known>,
    /// Text of each drawing, so that it is read again only where it changed.
    drawings: HashMap<i64, String>,
    /// When the drawings were looked at, and the last day of each machine, µs since 1970.
    drawings_us: Option<i64>,
    recent_us: HashMap<i64, i64>,
}

impl KnownMachines {
    pub fn all(&self) -> &HashMap<i64, Known> {
        &self.all
    }

    /// Looks up what is due.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn look(&mut self, store: &Store, newest: &[Newest], now_us: i64) -> Result<()> {
        if self.drawings_us.is_none_or(|then_us| now_us - then_us >= DRAWINGS_US) {
            self.look_at_drawings(store)?;
            self.drawings_us = Some(now_us);
        }
        let is_due =
            |source: &i64| self.recent_us.get(source).is_none_or(|then_us| now_us - then_us >= RECENT_US);
        let due: Vec<i64> = newest.iter().map(|one| one.source).filter(is_due).take(AT_ONCE).collect();
        for source in due {
            let recent = Recent::of(store.reading(), source, now_us)?;
            self.all.entry(source).or_default().recent = Arc::new(recent);
            self.recent_us.insert(source, now_us);
        }
        Ok(())
    }

    fn look_at_drawings(&mut self, store: &Store) -> Result<()> {
        let mut statement = store.reading().prepare_cached("SELECT source, rotor FROM machine")?;
        let rows = statement.query_map([], |row| Ok((row.get::<_, i64>(0)?, row.get::<_, String>(1)?)))?;
        for row in rows {
            let (source, text) = row?;
            if self.drawings.get(&source) == Some(&text) {
                continue;
            }
            // a drawing that cannot be read names nothing
            let names = rotor_file::parse("rotor.toml", &text).map(|rotor| Names::of(Some(&rotor)));
            self.all.entry(source).or_default().names = Arc::new(names.unwrap_or_default());
            self.drawings.insert(source, text);
        }
        Ok(())
    }
}

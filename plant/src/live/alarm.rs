//! Who has seen that a monitor needs somebody. An alarm is a monitor, its state and since when: a state that it comes into
//! again is another alarm.

use std::collections::HashMap;

use anyhow::Result;
use rusqlite::Connection;
use serde::Serialize;

/// Longest name of a person, characters.
const LONGEST_NAME: usize = 80;

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Acknowledged {
    pub who: String,
    /// When, µs since 1970.
    pub time_us: i64,
}

/// What an alarm is known by: number of the source, state, and since when.
pub type Key = (i64, String, i64);

/// All that were acknowledged, each monitor's newest of each state.
///
/// # Errors
/// If the store cannot be read.
pub fn acknowledged(connection: &Connection) -> Result<HashMap<Key, Acknowledged>> {
    let sql = "SELECT source, state, max(since_us), who, time_us FROM acknowledged GROUP BY source, state";
    let mut statement = connection.prepare_cached(sql)?;
    let row = |row: &rusqlite::Row| {
        let key = (row.get(0)?, row.get(1)?, row.get(2)?);
        Ok((key, Acknowledged { who: row.get(3)?, time_us: row.get(4)? }))
    };
    Ok(statement.query_map([], row)?.collect::<rusqlite::Result<_>>()?)
}

/// Keeps that somebody has seen it; who was first counts.
///
/// # Errors
/// If the store takes nothing.
pub fn acknowledge(connection: &Connection, key: &Key, who: &str, now_us: i64) -> Result<()> {
    let (source, state, since_us) = key;
    let sql =
        "INSERT OR IGNORE INTO acknowledged (source, state, since_us, who, time_us) VALUES (?, ?, ?, ?, ?)";
    connection.execute(sql, (source, state, since_us, who, now_us))?;
    Ok(())
}

/// The name of who acknowledges; none if it is no name that a list has room for.
pub fn name(who: &str) -> Option<&str> {
    let who = who.trim();
    let is_name =
        !who.is_empty() && who.chars().count() <= LONGEST_NAME && !who.chars().any(char::is_control);
    is_name.then_some(who)
}

#[cfg(test)]
mod tests {
    use crate::store::Store;

    use super::*;

    #[test]
    fn first_acknowledgement_counts_and_later_state_is_new_alarm() {
        let folder = tempfile::tempdir().unwrap();
        let mut store = Store::open(&folder.path().join("plant.db")).unwrap();
        let connection = store.connection();
        connection.execute("INSERT INTO source (plant, bus, node) VALUES ('a', 'b', 1)", []).unwrap();
        let key: Key = (1, "flagged".into(), 10);
        acknowledge(connection, &key, "Ada", 11).unwrap();
        acknowledge(connection, &key, "Ben", 12).unwrap();
        assert_eq!(acknowledged(connection).unwrap()[&key], Acknowledged { who: "Ada".into(), time_us: 11 });
        let later: Key = (1, "flagged".into(), 20);
        assert!(!acknowledged(connection).unwrap().contains_key(&later));
        acknowledge(connection, &later, "Ben", 21).unwrap();
        assert_eq!(acknowledged(connection).unwrap()[&later].who, "Ben");
    }

    #[test]
    fn a_name_is_a_short_line() {
        let long = "a".repeat(81);
        assert_eq!(
            [" Ada ", "", " ", "a\nb", long.as_str()].map(name),
            [Some("Ada"), None, None, None, None]
        );
    }
}

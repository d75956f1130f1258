//! Which machine a monitor watches.

use anyhow::{Context, Result, bail};
use rotor_edge_desktop::rotor_file;
use rusqlite::Connection;

use crate::item::Source;
use crate::store::Store;

/// A monitor whose machine is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatedMachine {
    /// Number of its source in the store.
    pub id: i64,
    pub source: Source,
    /// The drawing, a `rotor.toml`.
    pub rotor: String,
}

/// `PLANT/BUS/NODE`, as people name a monitor.
pub fn path_of(source: &Source) -> String {
    format!("{}/{}/{}", source.plant, source.bus, source.node)
}

/// States the machine of the monitor with this path, in place of an older statement.
///
/// # Errors
/// One sentence if no such monitor was heard, or if the drawing is none or needs other files.
pub fn state(store: &mut Store, path: &str, rotor: &str) -> Result<()> {
    rotor_file::parse("rotor.toml", rotor).context("the rotor file, which must not refer to other files")?;
    let all = sources(store.connection())?;
    let Some((id, _)) = all.iter().find(|(_, source)| path_of(source) == path) else {
        let known: Vec<String> = all.iter().map(|(_, source)| path_of(source)).collect();
        bail!("monitor {path} has sent no message, expected one of {}", known.join(", "));
    };
    let sql =
        "INSERT INTO machine (source, rotor) VALUES (?1, ?2) ON CONFLICT (source) DO UPDATE SET rotor = ?2";
    store.connection().execute(sql, (id, rotor))?;
    Ok(())
}

/// All machines whose path is `chosen` or begins with it and a slash; of several choices, of any; of none, all.
///
/// # Errors
/// One sentence if there is none.
pub fn chosen(store: &mut Store, choices: &[String]) -> Result<Vec<StatedMachine>> {
    let connection = store.connection();
    let mut statement = connection.prepare("SELECT rotor FROM machine WHERE source = ?")?;
    let mut all = Vec::new();
    for (id, source) in sources(connection)? {
        let path = path_of(&source);
        let is_chosen = |choice: &String| {
            path.strip_prefix(choice.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        };
        if choices.is_empty() || choices.iter().any(is_chosen) {
            for rotor in statement.query_map([id], |row| row.get(0))? {
                all.push(StatedMachine { id, source: source.clone(), rotor: rotor? });
            }
        }
    }
    if all.is_empty() {
        bail!(
            "no machine is chosen; state machines first: rotor-edge-plant machine STORE PLANT/BUS/NODE rotor.toml"
        );
    }
    Ok(all)
}

/// Every monitor that was heard, with its number in the store.
pub(super) fn sources(connection: &Connection) -> Result<Vec<(i64, Source)>> {
    let mut statement =
        connection.prepare("SELECT id, plant, bus, node FROM source ORDER BY plant, bus, node")?;
    let row = |row: &rusqlite::Row| {
        Ok((row.get(0)?, Source { plant: row.get(1)?, bus: row.get(2)?, node: row.get(3)? }))
    };
    Ok(statement.query_map([], row)?.collect::<rusqlite::Result<_>>()?)
}

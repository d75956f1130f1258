//! The schema of a store in the words of each database. The SQL files have a placeholder, as `{real}`, for each word that
//! differs.

/// Each takes a store from the version of its place to the next.
const MIGRATIONS: [&str; 4] = [
    include_str!("schema.sql"),
    include_str!("fleet.sql"),
    include_str!("plant.sql"),
    include_str!("cause.sql"),
];
/// The version of a store that this program writes.
pub const VERSION: i32 = MIGRATIONS.len() as i32;

/// The words of one database, by the placeholder that each stands for.
pub struct Dialect([(&'static str, &'static str); 6]);

pub const SQLITE: Dialect = Dialect([
    ("{id}", "INTEGER PRIMARY KEY"),
    ("{integer}", "INTEGER"),
    ("{real}", "REAL"),
    ("{blob}", "BLOB"),
    (" {strict}", " STRICT"),
    (" {by_key}", " STRICT, WITHOUT ROWID"),
]);

pub const POSTGRESQL: Dialect = Dialect([
    ("{id}", "BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY"),
    ("{integer}", "BIGINT"),
    ("{real}", "DOUBLE PRECISION"),
    ("{blob}", "BYTEA"),
    (" {strict}", ""),
    (" {by_key}", ""),
]);

impl Dialect {
    /// The statements that take a store of `version` to [`VERSION`], one text for each step.
    pub fn migrations(&self, version: i32) -> impl Iterator<Item = String> {
        let missing = MIGRATIONS.iter().skip(usize::try_from(version).unwrap_or(0));
        missing.map(|sql| self.0.iter().fold((*sql).into(), |sql: String, (from, to)| sql.replace(from, to)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schema_of_each_dialect_has_no_placeholder_left() {
        for dialect in [SQLITE, POSTGRESQL] {
            assert_eq!(dialect.migrations(0).count(), MIGRATIONS.len());
            for sql in dialect.migrations(0) {
                assert!(!sql.contains(['{', '}']), "{sql}");
            }
        }
    }

    #[test]
    fn schema_of_postgresql_has_no_word_of_sqlite() {
        for sql in POSTGRESQL.migrations(0) {
            for word in ["STRICT", "ROWID", " REAL", " INTEGER", "BLOB"] {
                assert!(!sql.contains(word), "{word} in {sql}");
            }
        }
    }
}

//! Columns that say whether the values of other columns are valid.

use std::collections::{HashMap, HashSet};

use anyhow::{Result, bail};

use super::assign::{AssignedColumn, UnusedColumn};
use crate::ingest::header::Header;
use crate::ingest::number::is_lost;
use crate::ingest::preamble::base;
use crate::ingest::table::ReadingTable;
use crate::ingest::target::Quantity;

/// What such columns are called behind the name of the other.
const NAMES: [&str; 4] = ["status", "validity", "quality", "qualität"];
const VALID: [&str; 12] =
    ["valid", "good", "ok", "normal", "true", "1", "192", "gültig", "gut", "alert", "danger", "alarm"];
const INVALID: [&str; 12] = [
    "not valid",
    "not ok",
    "nok",
    "failed",
    "fail",
    "error",
    "fehler",
    "false",
    "0",
    "uncertain",
    "questionable",
    "schlecht",
];

/// What a state says; nothing if it says neither.
pub fn is_valid(state: &str) -> Option<bool> {
    let state = state.trim().to_lowercase();
    let is_invalid = INVALID.contains(&state.as_str())
        || is_lost(&state)
        || ["invalid", "bad", "fault", "err", "ungültig"].iter().any(|word| state.starts_with(word));
    match () {
        () if VALID.contains(&state.as_str()) => Some(true),
        () if is_invalid => Some(false),
        () => None,
    }
}

/// The columns of states, by the letters of the name of the column that they are of; no letters are the whole row.
#[derive(Default)]
pub struct Statuses(HashMap<String, Vec<usize>>);

impl Statuses {
    /// Those of a table; states of which nothing is known are left.
    ///
    /// # Errors
    /// One sentence with the column and the state if some of its states mean invalid and another one is unknown.
    pub fn of(
        table: &ReadingTable,
        assigned: &[AssignedColumn],
        left: &mut Vec<UnusedColumn>,
    ) -> Result<Self> {
        let mut all = Self::default();
        let values = assigned.iter().filter(|c| is_value(c)).map(|c| base(&c.header.name));
        let values: HashSet<String> = values.chain([String::new()]).collect();
        let headers: Vec<&Header> = assigned
            .iter()
            .filter(|c| c.target.quantity == Quantity::Status)
            .map(|column| &column.header)
            .collect();
        let states = States::of(table, &headers);
        for (header, states) in headers.into_iter().zip(states) {
            let of = NAMES.iter().fold(base(&header.name), |name, word| name.replace(word, ""));
            let why = match () {
                () if !values.contains(&of) => Some("the status of no column here"),
                () if !states.say_validity(table, header)? => Some("its states do not say what is valid"),
                () => None,
            };
            match why {
                Some(why) => left.push(UnusedColumn {
                    number: header.index + 1,
                    header: header.name.clone(),
                    why: why.into(),
                }),
                None => all.0.entry(of).or_default().push(header.index),
            }
        }
        Ok(all)
    }

    /// Columns that say whether the values of a column are valid.
    pub fn of_column(&self, column: &AssignedColumn) -> Vec<usize> {
        if !is_value(column) || self.0.is_empty() {
            return Vec::new();
        }
        let own = self.0.get(&base(&column.header.name));
        let of_row = self.0.get("").filter(|_| column.target.quantity != Quantity::Speed);
        own.into_iter().chain(of_row).flatten().copied().collect()
    }
}

fn is_value(column: &AssignedColumn) -> bool {
    column.target.quantity.is_vibration() || column.target.quantity == Quantity::Speed
}

/// The states of a column.
#[derive(Clone, Default)]
struct States {
    /// Whether one means invalid.
    invalid: bool,
    /// The first that says nothing, and its row.
    unknown: Option<(usize, String)>,
}

impl States {
    /// Of columns, in one pass through the rows.
    fn of(table: &ReadingTable, headers: &[&Header]) -> Vec<Self> {
        let mut all = vec![Self::default(); headers.len()];
        if headers.is_empty() {
            return all;
        }
        table.rows.for_each(|row| {
            for (states, header) in all.iter_mut().zip(headers) {
                let Some(state) = row.cell(header.index).state() else { continue };
                match is_valid(&state) {
                    Some(valid) => states.invalid |= !valid,
                    None if states.unknown.is_none() => states.unknown = Some((row.number, state)),
                    None => (),
                }
            }
        });
        all
    }

    /// Whether every state is known to be valid or not.
    fn say_validity(&self, table: &ReadingTable, header: &Header) -> Result<bool> {
        match &self.unknown {
            Some((row, state)) if self.invalid => bail!(
                "{}: row {row}, column {} `{}`: \"{state}\" is neither valid nor invalid, expected one of these, or --column \"{}=left\"",
                table.sheet.place(),
                header.index + 1,
                header.name,
                header.name,
            ),
            unknown => Ok(unknown.is_none()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_valid_or_not_or_say_neither() {
        for (state, valid) in [
            ("Valid", Some(true)),
            ("GOOD", Some(true)),
            ("Alert", Some(true)),
            ("Invalid", Some(false)),
            ("Invalid: machine off", Some(false)),
            ("Not valid", Some(false)),
            ("Bad Input", Some(false)),
            ("running", None),
        ] {
            assert_eq!(is_valid(state), valid, "{state}");
        }
    }
}

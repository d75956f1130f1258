//! Columns that say whether the values of other columns are valid.

use anyhow::{Result, bail};

use super::assign::{AssignedColumn, UnusedColumn};
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

/// A column of states, and the column that they are of.
pub struct Validity {
    /// Place in the row, from 0.
    pub index: usize,
    /// Letters of the other column's name; nothing if the states are of the whole row.
    of: String,
}

impl Validity {
    pub fn is_of(&self, column: &AssignedColumn) -> bool {
        let quantity = column.target.quantity;
        let is_value = quantity.is_vibration() || quantity == Quantity::Speed;
        is_value
            && if self.of.is_empty() {
                quantity != Quantity::Speed
            } else {
                base(&column.header.name) == self.of
            }
    }
}

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

/// The columns of states that are of other columns, and those of which nothing is known.
///
/// # Errors
/// One sentence with the column and the state if some of its states mean invalid and another one is unknown.
pub fn validities(
    table: &ReadingTable,
    assigned: &[AssignedColumn],
) -> Result<(Vec<Validity>, Vec<UnusedColumn>)> {
    let (mut all, mut left) = (Vec::new(), Vec::new());
    for column in assigned.iter().filter(|c| c.target.quantity == Quantity::Status) {
        let header = &column.header;
        let of = NAMES.iter().fold(base(&header.name), |name, word| name.replace(word, ""));
        let validity = Validity { index: header.index, of };
        let mut leave = |why: &str| {
            left.push(UnusedColumn {
                number: header.index + 1,
                header: header.name.clone(),
                why: why.into(),
            });
        };
        if !assigned.iter().any(|c| validity.is_of(c)) {
            leave("the status of no column here");
            continue;
        }
        let (mut invalid, mut unknown) = (false, None);
        for row in table.rows {
            let Some(state) = row.cell(header.index).state() else { continue };
            match is_valid(&state) {
                Some(valid) => invalid |= !valid,
                None => unknown = unknown.or(Some((row.number, state))),
            }
        }
        match unknown {
            Some((row, state)) if invalid => bail!(
                "{}: row {row}, column {} `{}`: \"{state}\" is neither valid nor invalid, expected one of these, or --column \"{}=left\"",
                table.sheet.place(),
                header.index + 1,
                header.name,
                header.name,
            ),
            Some(_) => leave("its states do not say what is valid"),
            None => all.push(validity),
        }
    }
    Ok((all, left))
}

//! The cells of a row as numbers, names and moments, or one sentence with the place of the one that is not.

use anyhow::{Result, bail};

use super::plan::{Column, Plan};
use super::status::is_valid;
use crate::ingest::calendar::{self, Moment, ParsedMoment};
use crate::ingest::number::{is_lost, number, plain};
use crate::ingest::sheet::{Cell, SheetRow};
use crate::ingest::table::ReadingTable;
use crate::ingest::target::Quantity;
use crate::ingest::words::{Part, Word, parts};

/// Words of headers under which a number such as 45356.6 is a date of a spreadsheet.
const OF_DATES: [&str; 6] = ["date", "datum", "timestamp", "zeitstempel", "datetime", "fecha"];

/// Digits of a time in seconds since 1970.
const DIGITS_OF_SECONDS: usize = 10;

/// Reads rows of one table as its plan says.
pub struct Cells<'a> {
    pub table: &'a ReadingTable<'a>,
    pub plan: &'a Plan,
}

impl Cells<'_> {
    /// File, sheet, row and column of a cell.
    pub fn place(&self, row: &SheetRow, column: &Column) -> String {
        format!(
            "{}: row {}, column {} `{}`",
            self.table.sheet.place(),
            row.number,
            column.index + 1,
            column.header
        )
    }

    /// The number of a cell as written; nothing if it is lost.
    pub fn raw(&self, row: &SheetRow, column: &Column) -> Result<Option<f64>> {
        let invalid =
            |status: &usize| row.cell(*status).state().is_some_and(|state| is_valid(&state) == Some(false));
        if column.statuses.iter().any(invalid) {
            return Ok(None);
        }
        let text = match row.cell(column.index) {
            Cell::Empty => return Ok(None),
            Cell::Number(x) => return Ok(Some(*x)),
            Cell::Time(_) => bail!("{}: is a date, expected a number", self.place(row, column)),
            Cell::Text(text) => text,
        };
        // most cells are numbers
        if let Some(value) = plain(text, self.plan.decimal) {
            return Ok(Some(value));
        }
        if is_lost(text) {
            return Ok(None);
        }
        match number(text, self.plan.decimal) {
            Some((value, unit)) if unit == column.cell_unit || unit.is_empty() => Ok(Some(value)),
            Some((_, unit)) if is_words_of_units(unit) => bail!(
                "{}: \"{text}\" is in {unit}, other cells of the column are in {}, expected one unit",
                self.place(row, column),
                if column.cell_unit.is_empty() { "another unit" } else { &column.cell_unit },
            ),
            _ => {
                bail!(
                    "{}: \"{text}\" is not a number; a lost reading is an empty cell",
                    self.place(row, column)
                )
            }
        }
    }

    /// The text of a cell, a number as it is written shortest.
    pub fn name(&self, row: &SheetRow, column: &Column) -> Option<String> {
        row.cell(column.index).state()
    }

    /// The moment of a row, if there is a column for it.
    pub fn moment(&self, row: &SheetRow) -> Result<Option<Moment>> {
        let Some(column) = self.plan.column(Quantity::Time) else { return Ok(None) };
        let clock = self.plan.column(Quantity::Clock).map(|c| row.cell(c.index));
        let place = || self.place(row, column);
        let moment = match (row.cell(column.index), clock) {
            (Cell::Empty, _) => bail!("{}: is empty, expected a time", place()),
            (Cell::Time(date), Some(Cell::Time(clock))) => {
                Moment::local(date.date().to_datetime(clock.time()))
            }
            (Cell::Time(date), Some(Cell::Number(part))) => Moment::local(*date).map(|m| m.later(*part)),
            (Cell::Time(time), _) => Moment::local(*time),
            (Cell::Number(x), clock) => {
                let moment = self.of_number(*x, column);
                let Some(moment) = moment else { bail!("{}", self.which_time(&place(), *x, column)) };
                Some(if let Some(Cell::Number(part)) = clock { moment.later(*part) } else { moment })
            }
            (Cell::Text(text), clock) => {
                let both = clock.and_then(Cell::as_text).map(|clock| format!("{text} {clock}"));
                Some(self.of_text(both.as_deref().unwrap_or(text), column, &place)?)
            }
        };
        moment
            .map_or_else(|| bail!("{}: is no moment between the years 1 and 9999", place()), |m| Ok(Some(m)))
    }

    fn of_number(&self, x: f64, column: &Column) -> Option<Moment> {
        let is_date = || {
            let lower = column.header.to_lowercase();
            OF_DATES.iter().any(|word| lower.contains(word))
        };
        calendar::of_number(x, column.target.stated.time, is_date)
    }

    fn which_time(&self, place: &str, x: f64, column: &Column) -> String {
        let name = &column.header;
        if column.target.stated.time.is_some() {
            let unit = column.target.stated;
            return format!(
                "{place}: {x} {unit} is more than 10,000 years, expected --column \"{name}=time:UNIT\" with another unit"
            );
        }
        format!(
            "{place}: {x} is a number without a unit of time, expected --column \"{name}=time:s\", time:ms, time:us, time:d, time:excel or the like"
        )
    }

    fn of_text(&self, text: &str, column: &Column, place: &impl Fn() -> String) -> Result<Moment> {
        let is_number = !text.contains(':');
        if let Some((x, "")) = is_number
            .then(|| number(text, self.plan.decimal))
            .flatten()
            .filter(|(x, _)| text.len() != 8 || *x < 1e7)
        {
            let Some(moment) = self.of_number(x, column) else {
                bail!("{}", self.which_time(&place(), x, column))
            };
            if matches!(moment, Moment::Zoned(_)) && is_rounded(text) {
                bail!(
                    "{}: \"{text}\" is a time since 1970 without its seconds, expected all of its digits: format the column as a whole number before the export",
                    place()
                );
            }
            return Ok(moment);
        }
        match calendar::of_text(text, self.plan.dates) {
            ParsedMoment::Moment(moment) => Ok(moment),
            ParsedMoment::Ambiguous => bail!(
                "{}: \"{text}\" may have the day first or the month, expected --dates day-first or --dates month-first",
                place()
            ),
            ParsedMoment::Nothing => bail!("{}: \"{text}\" is not a time", place()),
        }
    }
}

/// Whether a time since 1970 was written with an exponent and fewer digits than its seconds have, as spreadsheets do.
fn is_rounded(text: &str) -> bool {
    let mantissa = text.split_once(['e', 'E']).map(|(mantissa, _)| mantissa);
    mantissa.is_some_and(|digits| digits.bytes().filter(u8::is_ascii_digit).count() < DIGITS_OF_SECONDS)
}

fn is_words_of_units(text: &str) -> bool {
    let words = parts(text, |_| false);
    let unit = |part: &Part| matches!(part, Part::Says(word) if !matches!(word, Word::Filler));
    !words.is_empty() && words.iter().all(unit)
}

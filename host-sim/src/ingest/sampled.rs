//! Tables whose rows are samples: a header that names the channels, then a row a sample.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Result, bail};
use rotor_edge_desktop::units::SECONDS_A_DAY;

use super::calendar::{DateOrder, Moment, ParsedMoment, of_text as moment_of_text};
use super::format::{self, Content, Text};
use super::header::{ChannelRole, Header, channel_role};
use super::number::{Decimal, sample};
use super::samples::{SampleColumn, Samples, Waveform};
use super::sampling_preamble::{SamplingPreamble, move_beside, move_increment};
use super::sheet::{Cell, SheetRow};
use super::table;
use super::unit::TimeUnit;

/// Reads a recording whose extension says its format.
///
/// # Errors
/// One sentence with the file, the place in it and what was expected.
pub fn read(path: &Path) -> Result<Waveform> {
    let waveform = match format::recording(path)? {
        Content::Waveform(waveform) => waveform,
        Content::Text(text) => of_text(&text.without_comments())?,
        Content::Sheets(sheets) => {
            let file = path.display().to_string();
            let mut tables =
                sheets.iter().filter_map(|sheet| Some((sheet, header_row(&sheet.rows, DECIMAL)?)));
            let Some((sheet, at)) = tables.next() else {
                bail!("{file}: no row names channels whose samples are in the rows below it");
            };
            if let Some((other, _)) = tables.next() {
                bail!("{}: holds samples and so does {}, expected one sheet", sheet.place(), other.place());
            }
            of_rows(&sheet.place(), &sheet.rows, at)?
        }
    };
    waveform.check()?;
    Ok(waveform)
}

/// What stands between the cells of samples.
const SEPARATORS: [char; 4] = [',', ';', '\t', '|'];
/// Columns of a text; each costs time, and no recorder has as many.
const MOST_CHANNELS: usize = 65_536;
/// Spaces between cells, as many as there are.
const SPACES: char = ' ';

/// What stands before the decimals of text in the cells of a workbook.
const DECIMAL: Decimal = Decimal::Point;

/// What stands before the decimals: never the comma that stands between the cells.
fn decimal(separator: char) -> Decimal {
    if separator == ',' { Decimal::Point } else { Decimal::Comma }
}

fn header_row(rows: &[SheetRow], decimal: Decimal) -> Option<usize> {
    table::above_samples(rows, |cell| is_value(cell, decimal))
}

/// Whether a cell may be a sample, or its time.
fn is_value(cell: &Cell, decimal: Decimal) -> bool {
    match cell {
        Cell::Empty => false,
        Cell::Number(_) | Cell::Time(_) => true,
        Cell::Text(text) => {
            sample(text, decimal).is_some() || moment_of_text(text, None) != ParsedMoment::Nothing
        }
    }
}

fn of_text(text: &Text) -> Result<Waveform> {
    let file = &text.file;
    let names = |separator: char, rows: &[SheetRow]| {
        let cells = |at: usize| rows.get(at).map_or(0, |row| row.cells.len());
        let mut moved = rows.to_vec();
        move_increment(&mut moved);
        move_beside(&mut moved, |cell| is_value(cell, decimal(separator)));
        let width = |at: usize| moved.get(at).map_or(0, |row| row.cells.len());
        (header_row(&moved, decimal(separator)).map_or(0, width), cells(0))
    };
    text.check_widths(&SEPARATORS, MOST_CHANNELS, "sample")?;
    let separator = text.separator(SEPARATORS, names);
    let (separator, decimal) = match spaced(text, separator) {
        Some(spaces) => (spaces, Decimal::Comma),
        None => (separator, decimal(separator)),
    };
    let mut first = text.first_rows(separator);
    move_increment(&mut first);
    move_beside(&mut first, |cell| is_value(cell, decimal));
    let found = header_row(&first, decimal);
    if found.is_none() {
        let texts = || first.iter().take(1).flat_map(|row| &row.cells).filter_map(Cell::as_text);
        if let Some(number) = texts().find(|name| sample(name, decimal).is_some()) {
            bail!(
                "{file}: the first row holds the number {number}, expected a header that names the channels"
            );
        }
    }
    // a table without a row of samples is read as far as the cell that is none
    let at = found.unwrap_or(0);
    let mut table = SampledTable::of(file, &first, at, decimal);
    table.preamble.add(SamplingPreamble::of(&text.comments()));
    if found.is_none() {
        table.columns.iter_mut().for_each(|column| column.is_read = true);
    }
    text.each(separator, &mut |row| {
        if row.number > table.above {
            table.push_text(row)?;
        }
        Ok(ControlFlow::Continue(()))
    })?;
    Ok(table.waveform())
}

/// Spaces, where no other separator gives a table and they give one with a name for each sample.
fn spaced(text: &Text, separator: char) -> Option<char> {
    if header_row(&text.first_rows(separator), decimal(separator)).is_some() {
        return None;
    }
    let rows = text.first_rows(SPACES);
    let at = header_row(&rows, Decimal::Comma)?;
    let widths = |row: &SheetRow| row.cells.len();
    (widths(&rows[at]) > 1 && Some(widths(&rows[at])) == rows.last().map(widths)).then_some(SPACES)
}

fn of_rows(place: &str, rows: &[SheetRow], at: usize) -> Result<Waveform> {
    let mut table = SampledTable::of(place, rows, at, DECIMAL);
    for row in rows.iter().filter(|row| row.number > table.above).collect::<Vec<_>>() {
        table.push_row(row)?;
    }
    Ok(table.waveform())
}

/// A table while its rows are read.
struct SampledTable<'a> {
    /// The file, and the sheet if there are sheets.
    place: &'a str,
    decimal: Decimal,
    /// Number of the last row above the samples.
    above: usize,
    columns: Vec<SampledColumn>,
    preamble: SamplingPreamble,
}

struct SampledColumn {
    header: Header,
    /// Its unit, if it holds times.
    time: Option<TimeUnit>,
    /// The first moment, where the times are moments, and the days that have passed since.
    start: Option<Moment>,
    days: f64,
    /// Whether it holds numbers; comments and the like do not.
    is_read: bool,
    values: Vec<f64>,
}

impl<'a> SampledTable<'a> {
    /// The columns of a table whose header is row `at` of its first rows.
    fn of(place: &'a str, first: &[SheetRow], at: usize, decimal: Decimal) -> Self {
        if first.is_empty() {
            return Self {
                place,
                decimal,
                above: 0,
                columns: Vec::new(),
                preamble: SamplingPreamble::default(),
            };
        }
        let (headers, below) = table::headers(first, at);
        let samples = &first[at + 1 + below..];
        let columns = headers.into_iter().map(|header| {
            let time = match channel_role(&header.name, &header.unit) {
                ChannelRole::Time(unit) => Some(unit.unwrap_or(TimeUnit::Seconds)),
                ChannelRole::Speed | ChannelRole::Signal { .. } => None,
            };
            let is_number = |cell: &Cell| match cell {
                Cell::Text(text) => sample(text, decimal).is_some(),
                cell => matches!(cell, Cell::Number(_)),
            };
            let mut cells = samples.iter().map(|row| row.cell(header.index));
            let is_read = samples.is_empty()
                || cells.any(|cell| is_number(cell) || (time.is_some() && is_value(cell, decimal)));
            SampledColumn { header, time, start: None, days: 0.0, is_read, values: Vec::new() }
        });
        let (above, columns) = (first[at + below].number, columns.collect());
        Self { place, decimal, above, columns, preamble: SamplingPreamble::of(&first[..at]) }
    }

    fn push_text(&mut self, row: &SheetRow) -> Result<()> {
        let width = self.columns.last().map_or(0, |column| column.header.index + 1);
        let beyond = row.cells.iter().skip(width).any(|cell| !cell.is_empty());
        let last_read = self.columns.iter().rfind(|c| c.is_read).map_or(0, |c| c.header.index + 1);
        if beyond || row.cells.len() < last_read {
            let SheetRow { number, cells } = row;
            bail!("{}: row {number} has {} cells, the header has {width}", self.place, cells.len());
        }
        self.push_row(row)
    }

    fn push_row(&mut self, row: &SheetRow) -> Result<()> {
        for column in 0..self.columns.len() {
            self.push(column, row.number, row.cell(self.columns[column].header.index))?;
        }
        Ok(())
    }

    fn push(&mut self, column: usize, row: usize, cell: &Cell) -> Result<()> {
        let SampledColumn { header, time, is_read, start, days, values } = &mut self.columns[column];
        if !*is_read {
            return Ok(());
        }
        let value = match cell {
            Cell::Number(x) => Some(*x).filter(|x| x.is_finite()),
            Cell::Text(text) => sample(text, self.decimal).or_else(|| {
                let unit = (*time)?;
                elapsed(moment(text)?, start, days, unit)
            }),
            Cell::Time(at) => time.and_then(|unit| elapsed(Moment::local(*at)?, start, days, unit)),
            Cell::Empty => None,
        };
        let Some(value) = value else {
            let shown = match cell {
                Cell::Text(text) => text,
                Cell::Time(_) => "a date",
                Cell::Empty | Cell::Number(_) => "",
            };
            bail!(
                "{}: row {row}, column {}: \"{shown}\" is not a number, expected a sample in every row",
                self.place,
                header.name
            );
        };
        values.push(value);
        Ok(())
    }

    fn waveform(self) -> Waveform {
        let along = self.preamble.along.clone().unwrap_or_default();
        let columns = self.columns.into_iter().filter(|column| column.is_read).map(|column| SampleColumn {
            number: column.header.index + 1,
            unit: match column.header.unit {
                none if none.is_empty() && is_along(&column.header.name) => along.clone(),
                unit => unit,
            },
            header: column.header.name,
            samples: Samples::Values(column.values),
        });
        let mut waveform = Waveform::of_columns(self.place, None, columns.collect());
        let SamplingPreamble { rate_hz, unit, point, .. } = &self.preamble;
        if waveform.rate_hz.is_none() && waveform.uneven.is_none() {
            waveform.rate_hz = *rate_hz;
        }
        let mut vibrating: Vec<_> = waveform.channels.iter_mut().filter(|c| c.may_vibrate()).collect();
        for channel in &mut vibrating {
            channel.unit = channel.unit.or(*unit);
        }
        if let ([only], Some(point)) = (&mut vibrating[..], point) {
            only.name.clone_from(point);
        }
        waveform.preamble = self.preamble;
        waveform
    }
}

/// Whether a column without a unit has that of the horizontal axis.
fn is_along(header: &str) -> bool {
    let lower = header.to_lowercase();
    ["x", "x-axis", "x axis", "x-axis value", "time", "x_value"].contains(&lower.as_str())
}

/// A moment as a text writes it; between samples, the order of day and month does not matter.
fn moment(text: &str) -> Option<Moment> {
    let read = match moment_of_text(text, None) {
        ParsedMoment::Ambiguous => moment_of_text(text, Some(DateOrder::MonthFirst)),
        read => read,
    };
    if let ParsedMoment::Moment(moment) = read { Some(moment) } else { None }
}

/// Time since the first moment, in the unit that the column's header states; a time of day that falls by half a day is one of
/// the next day.
fn elapsed(moment: Moment, start: &mut Option<Moment>, passed: &mut f64, unit: TimeUnit) -> Option<f64> {
    let mut days = moment.days_since(*start.get_or_insert(moment))?;
    if matches!(moment, Moment::OfDay(_)) {
        days += (*passed - days).round().max(0.0);
    }
    *passed = days;
    Some(days * SECONDS_A_DAY / unit.seconds())
}

#[cfg(test)]
mod tests;

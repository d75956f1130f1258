//! Tables whose rows are samples: a header that names the channels, then a row a sample.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Result, bail};
use csv::ByteRecord;
use rotor_edge_desktop::units::SECONDS_A_DAY;

use super::calendar::{DateOrder, Moment, ParsedMoment, of_text as moment_of_text};
use super::format::{self, Content, Text};
use super::header::{ChannelRole, Header, channel_role};
use super::number::{Decimal, sample};
use super::samples::{SampleColumn, Samples, Waveform};
use super::sampling_preamble::{SamplingPreamble, move_increment};
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
        let width = |at: usize| moved.get(at).map_or(0, |row| row.cells.len());
        (header_row(&moved, decimal(separator)).map_or(0, width), cells(0))
    };
    let separator = text.separator([',', ';', '\t', '|'], names);
    let mut first = text.first_rows(separator);
    move_increment(&mut first);
    let decimal = decimal(separator);
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
    if found.is_none() {
        table.columns.iter_mut().for_each(|column| column.is_read = true);
    }
    text.each(separator, |row, record| {
        if row > table.above {
            table.push_text(row, record)?;
        }
        Ok(ControlFlow::Continue(()))
    })?;
    Ok(table.waveform())
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
    /// The first moment, where the times are moments.
    start: Option<Moment>,
    preamble: SamplingPreamble,
}

struct SampledColumn {
    header: Header,
    /// Its unit, if it holds times.
    time: Option<TimeUnit>,
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
                start: None,
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
            SampledColumn { header, time, is_read, values: Vec::new() }
        });
        let (above, columns) = (first[at + below].number, columns.collect());
        Self { place, decimal, above, columns, start: None, preamble: SamplingPreamble::of(&first[..at]) }
    }

    fn push_text(&mut self, row: usize, record: &ByteRecord) -> Result<()> {
        let width = self.columns.last().map_or(0, |column| column.header.index + 1);
        let beyond = record.iter().skip(width).any(|cell| !cell.is_empty());
        let last_read = self.columns.iter().rfind(|c| c.is_read).map_or(0, |c| c.header.index + 1);
        if beyond || record.len() < last_read {
            bail!("{}: row {row} has {} cells, the header has {width}", self.place, record.len());
        }
        for column in 0..self.columns.len() {
            let cell = record.get(self.columns[column].header.index).unwrap_or_default();
            let text = std::str::from_utf8(cell).unwrap_or_default();
            match sample(text, self.decimal) {
                Some(value) => self.columns[column].values.push(value),
                None => self.push(column, row, &Cell::text(text))?,
            }
        }
        Ok(())
    }

    fn push_row(&mut self, row: &SheetRow) -> Result<()> {
        for column in 0..self.columns.len() {
            self.push(column, row.number, row.cell(self.columns[column].header.index))?;
        }
        Ok(())
    }

    fn push(&mut self, column: usize, row: usize, cell: &Cell) -> Result<()> {
        let SampledColumn { header, time, is_read, .. } = &self.columns[column];
        if !is_read {
            return Ok(());
        }
        let value = match cell {
            Cell::Number(x) => Some(*x).filter(|x| x.is_finite()),
            Cell::Text(text) => sample(text, self.decimal).or_else(|| {
                let unit = (*time)?;
                elapsed(moment(text)?, &mut self.start, unit)
            }),
            Cell::Time(at) => time.and_then(|unit| elapsed(Moment::local(*at)?, &mut self.start, unit)),
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
        self.columns[column].values.push(value);
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

/// Time since the first moment, in the unit that the column's header states.
fn elapsed(moment: Moment, start: &mut Option<Moment>, unit: TimeUnit) -> Option<f64> {
    let days = moment.days_since(*start.get_or_insert(moment))?;
    Some(days * SECONDS_A_DAY / unit.seconds())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ingest::unit::Unit;

    fn read_text(text: &str) -> Result<Waveform> {
        of_text(&Text::of("a.csv", text.as_bytes())?.without_comments())
    }

    fn values(waveform: &Waveform, channel: usize) -> &[f64] {
        let Samples::Values(values) = &waveform.channels[channel].samples else { panic!("counts") };
        values
    }

    fn headers(waveform: &Waveform) -> Vec<&str> {
        waveform.channels.iter().map(|c| c.header.as_str()).collect()
    }

    #[test]
    fn separators_decimals_and_the_rate_are_told_from_the_file() {
        let waveform =
            read_text("# made by a logger, v2\ntime_s;15X;kph\n0;-9,5;0\n0,5e-3;-9,25;1\n0,001;-9;0\n")
                .unwrap();
        assert!((waveform.rate_hz.unwrap() - 2000.0).abs() < 1e-9);
        assert_eq!((waveform.channels[0].number, values(&waveform, 0)), (2, &[-9.5, -9.25, -9.0][..]));
        let three_digits = read_text("a;kph\n-9,125;0,001\n-9,250;0.002\n").unwrap();
        assert_eq!(values(&three_digits, 0), [-9.125, -9.25]);
        assert_eq!(values(&three_digits, 1), [0.001, 0.002], "a point is never thousands");
    }

    #[test]
    fn a_lost_row_a_cell_of_text_and_a_missing_header_are_named() {
        let lost = read_text("time_s,a\n0,1\n1,1\n2,1\n4,1\n5,1\n").unwrap();
        assert_eq!(lost.rate_hz, None);
        let uneven = lost.uneven.unwrap();
        assert!(uneven.contains("sample 4, column time_s: goes from 2 to 4"), "{uneven}");
        for (text, says) in [
            ("a,b\n1,2\n1,x\n", "row 3, column b: \"x\" is not a number"),
            ("a,b\nx,y\n", "row 2, column a: \"x\" is not a number"),
            ("a,b\n1,2\n1\n", "row 3 has 1 cells, the header has 2"),
            ("a,b\n1,2\n1,2,3\n", "row 3 has 3 cells, the header has 2"),
            ("1,2\n1,2\n", "holds the number 1, expected a header"),
        ] {
            let error = read_text(text).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn time_columns_of_other_programs_give_the_rate_and_no_channel() {
        for (text, rate_hz) in [
            ("Time [ms],PX,kph\n0,1,0\n0.5,2,0\n1.0,3,0\n", 2000.0),
            ("Time (s);PX;kph\n0,000;1;0\n0,001;2;0\n", 1000.0),
            ("Zeit;PX;kph\nms;V;V\n0;1;0\n0,5;2;0\n", 2000.0),
            ("Timestamp,PX,kph\n2025-03-04 10:00:00.000,1,0\n2025-03-04 10:00:00.004,2,0\n", 250.0),
            ("Time,PX,kph\n0,1,0\n0.01,2,0\n", 100.0),
        ] {
            let waveform = read_text(text).unwrap();
            assert_eq!(headers(&waveform), ["PX", "kph"], "{text}");
            assert!((waveform.rate_hz.unwrap() / rate_hz - 1.0).abs() < 1e-9, "{text}: {waveform:?}");
        }
    }

    #[test]
    fn lines_above_the_header_and_comments_beside_it_are_left() {
        let text = "LabVIEW Measurement\nSeparator,Comma\nDate,2025/03/04\n***End_of_Header***\n\
                    X_Value,PX,kph,Comment\n0.000,1,0\n0.001,2,0,restart\n0.002,3,0\n";
        let waveform = read_text(text).unwrap();
        assert_eq!(headers(&waveform), ["PX", "kph"]);
        assert_eq!(values(&waveform, 0), [1.0, 2.0, 3.0]);
        assert!((waveform.rate_hz.unwrap() - 1000.0).abs() < 1e-9);
    }

    #[test]
    fn names_lose_their_unit_unless_two_would_be_one() {
        let waveform = read_text("15X [V],15Y [mV],Speed [rpm],kph [V]\n1,2,3,4\n1,2,3,4\n").unwrap();
        let names: Vec<&str> = waveform.channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["15X", "15Y", "Speed [rpm]", "kph"]);
        assert_eq!(waveform.channels[1].unit, Some(Unit::Millivolt));
        assert_eq!(waveform.channels.iter().filter(|c| c.is_speed).count(), 1);
        let alike = read_text("DE (V),DE (g),kph\n1,2,3\n1,2,3\n").unwrap();
        assert_eq!(alike.channels[0].name, "DE (V)");
        assert!(alike.channel("de (g)", "--channel").is_ok());
    }

    #[test]
    fn sheets_of_samples_are_read_as_text_is() {
        let texts = |number: usize, cells: &[&str]| SheetRow {
            number,
            cells: cells.iter().map(|cell| Cell::text(cell)).collect(),
        };
        let numbers = |number: usize, cells: &[f64]| SheetRow {
            number,
            cells: cells.iter().map(|x| Cell::Number(*x)).collect(),
        };
        let rows = [
            texts(1, &["Run-up"]),
            texts(3, &["Time", "15X", "kph"]),
            texts(4, &["ms", "V", "V"]),
            numbers(5, &[0.0, -9.5, 0.0]),
            numbers(6, &[0.5, -9.25, 1.0]),
        ];
        let at = header_row(&rows, DECIMAL).unwrap();
        let waveform = of_rows("a.xlsx", &rows, at).unwrap();
        assert_eq!((waveform.rate_hz, values(&waveform, 0)), (Some(2000.0), &[-9.5, -9.25][..]));
    }
}

//! The rows of tables as readings of all probes.

use std::collections::HashMap;

use anyhow::{Result, bail};
use nalgebra::Complex;
use rotor_edge_desktop::measurement::{LARGEST_UM, LOWEST_GAP_V};

use super::cells::Cells;
use super::mapping::Mapping;
use super::plan::{Column, Plan};
use crate::ingest::calendar::Moment;
use crate::ingest::sheet::{Cell, SheetRow};
use crate::ingest::table::ReadingTable;
use crate::ingest::target::Quantity;
use crate::ingest::unit::Vibration;

/// One reading, and where it is from.
#[derive(Debug, Clone)]
pub struct SourcedReading {
    /// Which of the tables it is from, and its row there.
    pub table: usize,
    pub row: usize,
    pub run: Option<String>,
    pub when: Option<Moment>,
    pub speed_rpm: f64,
    /// Phasors `cos − i sin`, µm zero-to-peak; nothing where the reading was lost.
    pub probes: Vec<Option<Complex<f64>>>,
    /// Whether a row held this probe, lost or not.
    pub held: Vec<bool>,
    pub gaps_v: Vec<Option<f64>>,
}

/// Rows that are no readings, and why.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SkippedRows {
    pub standstill: usize,
    pub without_speed: usize,
    pub other_machines: usize,
    pub other_points: usize,
    /// Headers that stand there again, and lines below the table.
    pub no_data: usize,
}

#[derive(Debug, Clone, Default)]
pub struct Record {
    pub probes: Vec<String>,
    pub samples: Vec<SourcedReading>,
    pub skipped: SkippedRows,
    /// Cells that hold a number for "no measurement", such as -9999.
    pub no_measurement: usize,
    tables: usize,
    /// Readings by run and moment, or speed where there are no moments.
    at: HashMap<(Option<String>, i128), Vec<usize>>,
}

impl Record {
    /// No readings yet, of these probes and others that may come.
    pub fn of(probes: &[String]) -> Self {
        Self { probes: probes.to_vec(), ..Self::default() }
    }

    fn probe(&mut self, name: &str) -> usize {
        if let Some(at) = self.probes.iter().position(|p| p == name) {
            return at;
        }
        self.probes.push(name.into());
        for sample in &mut self.samples {
            sample.probes.push(None);
            sample.held.push(false);
            sample.gaps_v.push(None);
        }
        self.probes.len() - 1
    }

    /// Adds the rows of a table; `run` where the file is one.
    ///
    /// # Errors
    /// One sentence with file, sheet, row and column.
    pub fn add(
        &mut self,
        table: &ReadingTable,
        plan: &Plan,
        mapping: &Mapping,
        run: Option<&str>,
    ) -> Result<()> {
        let cells = Cells { table, plan };
        one_machine(&cells, mapping)?;
        let stated: Vec<&str> = plan.columns.iter().filter_map(|c| c.target.probe.as_deref()).collect();
        // a file of other probes belongs to the readings that are there
        let others = !stated.iter().any(|name| self.probes.iter().any(|p| p == name));
        let joins = plan.column(Quantity::Point).is_some() || others;
        stated.into_iter().for_each(|name| {
            self.probe(name);
        });
        let end = table.rows.iter().rposition(|row| is_data(&cells, row)).map_or(0, |last| last + 1);
        self.skipped.no_data += table.rows[end..].iter().filter(|row| !row.is_blank()).count();
        for row in &table.rows[..end] {
            if row.is_blank() {
                continue;
            }
            if let Some(machine) = plan.column(Quantity::Machine)
                && mapping.machine.is_some()
                && cells.name(row, machine) != mapping.machine
            {
                self.skipped.other_machines += 1;
                continue;
            }
            if is_header(table, row) {
                self.skipped.no_data += 1;
                continue;
            }
            in_table(table, row)?;
            if let Some(sample) = self.sample(&cells, mapping, run, row)? {
                self.put(sample, joins);
            }
        }
        self.tables += 1;
        Ok(())
    }

    /// Puts a reading into one of the same moment that lacks its probes, or behind all.
    fn put(&mut self, sample: SourcedReading, joins: bool) {
        let moment = match sample.when {
            Some(Moment::Zoned(ns) | Moment::Local(ns)) => ns,
            Some(Moment::Elapsed(days)) => i128::from(days.to_bits()),
            None => i128::from(sample.speed_rpm.to_bits()),
        };
        let of_moment = self.at.entry((sample.run.clone(), moment)).or_default();
        let lacks = |at: &&usize| self.samples[**at].held.iter().zip(&sample.held).all(|(a, b)| !(*a && *b));
        match of_moment.iter().find(lacks).filter(|_| joins) {
            None => {
                of_moment.push(self.samples.len());
                self.samples.push(sample);
            }
            Some(&at) => {
                let place = &mut self.samples[at];
                for p in (0..sample.held.len()).filter(|p| sample.held[*p]) {
                    place.held[p] = true;
                    place.probes[p] = sample.probes[p];
                    place.gaps_v[p] = sample.gaps_v[p];
                }
            }
        }
    }

    fn sample(
        &mut self,
        cells: &Cells,
        mapping: &Mapping,
        run: Option<&str>,
        row: &SheetRow,
    ) -> Result<Option<SourcedReading>> {
        let plan = cells.plan;
        let point = match plan.column(Quantity::Point) {
            None => None,
            Some(column) => match cells.name(row, column).and_then(|name| plan.probes.named(&name)) {
                Some(name) => Some(self.probe(&name)),
                None => {
                    self.skipped.other_points += 1;
                    return Ok(None);
                }
            },
        };
        let Some(speed_rpm) = speed_rpm(cells, mapping, row)? else {
            self.skipped.without_speed += 1;
            return Ok(None);
        };
        if speed_rpm == 0.0 {
            self.skipped.standstill += 1;
            return Ok(None);
        }
        let probes = self.probes.len();
        let own_run = plan.column(Quantity::Run).and_then(|column| cells.name(row, column));
        let mut sample = SourcedReading {
            table: self.tables,
            row: row.number,
            run: own_run.or(run.map(str::to_string)),
            when: cells.moment(row)?,
            speed_rpm,
            probes: vec![None; probes],
            held: vec![false; probes],
            gaps_v: vec![None; probes],
        };
        for p in 0..probes {
            let of = |quantity: Quantity| {
                plan.columns.iter().find(|c| {
                    let of_point = c.target.probe.is_none() && point == Some(p);
                    c.target.quantity == quantity
                        && (c.target.probe.as_ref() == Some(&self.probes[p]) || of_point)
                })
            };
            let pairs = [
                (Quantity::Amplitude, Quantity::Phase),
                (Quantity::Cos, Quantity::Sin),
                (Quantity::Real, Quantity::Imaginary),
            ];
            if let Some((a, b)) = pairs.into_iter().find_map(|(a, b)| of(a).zip(of(b))) {
                let (phasor, no_measurement) = phasor_um(cells, row, speed_rpm, a, b)?;
                sample.held[p] = true;
                sample.probes[p] = phasor;
                self.no_measurement += usize::from(no_measurement);
            }
            if let Some(column) = of(Quantity::Gap) {
                sample.gaps_v[p] = gap_v(cells, row, column)?;
            }
        }
        Ok(Some(sample))
    }
}

/// Whether a number means that there is none: nines alone, the ends of a 16-bit register, a number beyond all reason.
fn is_no_measurement(raw: f64) -> bool {
    let digits = raw.abs().to_string();
    let fewest = if raw < 0.0 { 3 } else { 4 };
    let nines = digits.len() >= fewest && digits.chars().all(|c| c == '9');
    nines || [-999.25, -32_768.0, 32_767.0].contains(&raw) || raw.abs() > 1e6
}

/// The phasor `cos − i sin` of a row, µm zero-to-peak, and whether a number says that there is none.
fn phasor_um(
    cells: &Cells,
    row: &SheetRow,
    speed_rpm: f64,
    a: &Column,
    b: &Column,
) -> Result<(Option<Complex<f64>>, bool)> {
    let (Some(x), Some(y)) = (cells.raw(row, a)?, cells.raw(row, b)?) else { return Ok((None, false)) };
    if is_no_measurement(x) || is_no_measurement(y) {
        return Ok((None, true));
    }
    let phasor = if a.target.quantity == Quantity::Amplitude {
        if x < 0.0 {
            bail!("{}: {x} is no amplitude, expected zero or more", cells.place(row, a));
        }
        Complex::from_polar(x * a.factor, -y * b.factor)
    } else {
        Complex::new(x * a.factor, -y * b.factor)
    };
    let phasor = phasor * Vibration { size: 1.0, derivative: a.derivative }.displacement(speed_rpm);
    if phasor.norm() > LARGEST_UM {
        let um = phasor.norm();
        bail!("{}: {um:.0} µm is more than a probe can see, expected another unit", cells.place(row, a));
    }
    Ok((Some(phasor), false))
}

fn gap_v(cells: &Cells, row: &SheetRow, column: &Column) -> Result<Option<f64>> {
    let gap_v = cells.raw(row, column)?.filter(|raw| !is_no_measurement(*raw) || column.factor < 1.0);
    let gap_v = gap_v.map(|raw| raw * column.factor);
    match gap_v.filter(|v| !(LOWEST_GAP_V..=0.0).contains(v)) {
        Some(v) => bail!(
            "{}: {v} is no gap voltage, expected {LOWEST_GAP_V} to 0 V, or --column \"{}=left\"",
            cells.place(row, column),
            column.header
        ),
        None => Ok(gap_v),
    }
}

fn speed_rpm(cells: &Cells, mapping: &Mapping, row: &SheetRow) -> Result<Option<f64>> {
    let Some(column) = cells.plan.column(Quantity::Speed) else { return Ok(mapping.speed_rpm) };
    // 9999 rpm is a speed
    let raw = cells.raw(row, column)?.filter(|raw| (0.0..=1e6).contains(raw) || !is_no_measurement(*raw));
    let speed_rpm = raw.map(|raw| raw * column.factor);
    match speed_rpm {
        Some(speed_rpm) if speed_rpm < 0.0 => {
            bail!("{}: {speed_rpm} rpm, expected a positive speed", cells.place(row, column))
        }
        other => Ok(other),
    }
}

/// Whether a row holds a number where numbers are expected; what comes after the last such row is no data.
fn is_data(cells: &Cells, row: &SheetRow) -> bool {
    let needed = |q: Quantity| q == Quantity::Speed || q.is_vibration();
    let number = |c: &Column| cells.raw(row, c).is_ok_and(|value| value.is_some());
    cells.plan.columns.iter().any(|c| needed(c.target.quantity) && number(c))
}

fn is_header(table: &ReadingTable, row: &SheetRow) -> bool {
    let filled =
        |row: &SheetRow| row.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    let width = filled(row);
    table.head.iter().any(|head| filled(head) == width && head.cells[..width] == row.cells[..width])
}

/// A row of text with more cells than the header has been cut in the wrong places.
fn in_table(table: &ReadingTable, row: &SheetRow) -> Result<()> {
    let width = table.columns.last().map_or(0, |c| c.index + 1);
    let beyond = row.cells.iter().skip(width).any(|c| matches!(c, Cell::Text(_)));
    let Some(separator) = table.sheet.separator.filter(|_| beyond) else { return Ok(()) };
    let why =
        if separator == ',' { "; a decimal comma is cut where commas stand between the cells" } else { "" };
    bail!(
        "{}: row {} has {} cells, the header has {width}{why}",
        table.sheet.place(),
        row.number,
        row.cells.len()
    )
}

fn one_machine(cells: &Cells, mapping: &Mapping) -> Result<()> {
    let (Some(column), None) = (cells.plan.column(Quantity::Machine), &mapping.machine) else {
        return Ok(());
    };
    let mut names = cells
        .table
        .rows
        .iter()
        .filter(|row| is_data(cells, row))
        .filter_map(|row| Some((row, cells.name(row, column)?)));
    let Some((_, first)) = names.next() else { return Ok(()) };
    match names.find(|(_, name)| *name != first) {
        Some((row, other)) => bail!(
            "{}: is of \"{other}\", the rows before of \"{first}\", expected one machine, --machine \"{first}\" or --machine \"{other}\"",
            cells.place(row, column)
        ),
        None => Ok(()),
    }
}

//! The rows of tables as readings of all probes.

use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::ControlFlow;

use anyhow::Result;
use nalgebra::Complex;
use rotor_edge_desktop::measurement::Condition;

use super::cells::Cells;
use super::mapping::Mapping;
use super::plan::{Column, Plan};
use super::row::{condition, gap_v, in_table, is_data, is_header, one_machine, phasor_um, speed_rpm};
use super::skipped::{RowCount, SkippedRows, row_number};
use crate::ingest::calendar::Moment;
use crate::ingest::conditions;
use crate::ingest::sheet::SheetRow;
use crate::ingest::table::{ReadingTable, Rows};
use crate::ingest::target::Quantity;

/// A value that was lost.
pub(super) const LOST: Complex<f64> = Complex::new(f64::NAN, f64::NAN);

/// Blocks of rows that each thread reads before they are put together.
const BLOCKS_A_THREAD: usize = 4;

/// Where a reading is from, and what it holds of all probes together.
#[derive(Debug, Clone, Copy)]
pub struct SourcedReading {
    /// Which of the tables it is from, and its row there.
    pub table: u32,
    pub row: u32,
    /// Which of the runs.
    pub run: Option<u32>,
    pub when: Option<Moment>,
    /// Not a number where it was lost and the row has a time: then no probe has a value.
    pub speed_rpm: f64,
}

/// Readings of all tables. What is of each probe stands in one row of numbers a reading, so that a million readings fit.
#[derive(Debug, Clone, Default)]
pub struct Record {
    pub probes: Vec<String>,
    pub runs: Vec<String>,
    pub samples: Vec<SourcedReading>,
    pub skipped: SkippedRows,
    /// Readings of which only the time is known.
    pub timed_only: RowCount,
    /// Cells that hold a number for "no measurement", such as -9999.
    pub no_measurement: usize,
    pub(super) tables: u32,
    /// Phasors `cos − i sin`, µm zero-to-peak; not a number where the reading was lost.
    pub(super) phasors: Vec<Complex<f64>>,
    /// Whether a row held this probe, lost or not.
    pub(super) held: Vec<bool>,
    /// Not a number where there is none; empty if there is none at all.
    pub(super) gaps_v: Vec<f64>,
    pub conditions: Vec<Condition>,
    /// Of each reading the conditions; not a number where there is none.
    pub(super) condition_values: Vec<f64>,
}

impl Record {
    /// No readings yet, of these probes and others that may come.
    pub fn of(probes: &[String]) -> Self {
        Self { probes: probes.to_vec(), ..Self::default() }
    }

    /// The phasor of a probe in a reading; nothing if it is lost.
    #[inline]
    pub fn value(&self, reading: usize, probe: usize) -> Option<Complex<f64>> {
        Some(self.phasors[reading * self.probes.len() + probe]).filter(|y| !y.re.is_nan())
    }

    pub fn set(&mut self, reading: usize, probe: usize, value: Option<Complex<f64>>) {
        let at = reading * self.probes.len() + probe;
        self.phasors[at] = value.unwrap_or(LOST);
    }

    /// The phasors of a reading.
    pub fn values(&self, reading: usize) -> impl Iterator<Item = Option<Complex<f64>>> {
        (0..self.probes.len()).map(move |probe| self.value(reading, probe))
    }

    pub fn holds(&self, reading: usize) -> &[bool] {
        &self.held[reading * self.probes.len()..][..self.probes.len()]
    }

    /// Gaps of a reading, if any reading has one.
    pub fn gaps(&self, reading: usize) -> impl Iterator<Item = Option<f64>> {
        let probes = self.probes.len();
        let all = self.gaps_v.get(reading * probes..(reading + 1) * probes).unwrap_or_default();
        all.iter().map(|gap| Some(*gap).filter(|gap| !gap.is_nan()))
    }

    /// Conditions of operation of a reading.
    pub fn conditions(&self, reading: usize) -> impl Iterator<Item = Option<f64>> {
        let count = self.conditions.len();
        let all = &self.condition_values[reading * count..][..count];
        all.iter().map(|x| Some(*x).filter(|x| !x.is_nan()))
    }

    pub fn run(&self, reading: usize) -> Option<&str> {
        self.samples[reading].run.map(|run| self.runs[run as usize].as_str())
    }

    /// Values that are lost, for whatever reason.
    pub fn lost(&self) -> usize {
        self.phasors.iter().filter(|y| y.re.is_nan()).count()
    }

    /// Keeps these readings, in this order.
    pub fn keep(&mut self, order: &[usize]) {
        let probes = self.probes.len();
        fn picked<T: Copy>(all: &[T], order: &[usize], probes: usize) -> Vec<T> {
            order.iter().flat_map(|at| &all[at * probes..(at + 1) * probes]).copied().collect()
        }
        self.samples = order.iter().map(|at| self.samples[*at]).collect();
        self.phasors = picked(&self.phasors, order, probes);
        self.held = picked(&self.held, order, probes);
        if !self.gaps_v.is_empty() {
            self.gaps_v = picked(&self.gaps_v, order, probes);
        }
        self.condition_values = picked(&self.condition_values, order, self.conditions.len());
    }

    /// Takes the values off readings whose speed no row of their time states.
    pub fn lose_without_speed(&mut self) {
        for at in 0..self.samples.len() {
            let SourcedReading { table, row, speed_rpm, .. } = self.samples[at];
            if speed_rpm.is_nan() {
                (0..self.probes.len()).for_each(|p| self.set(at, p, None));
                self.timed_only.add(table, row as usize);
            }
        }
    }

    /// Puts what a reading holds of probes into another one.
    pub fn join(&mut self, into: usize, from: usize) {
        let speed_rpm = self.samples[from].speed_rpm;
        let known = &mut self.samples[into].speed_rpm;
        *known = if known.is_nan() { speed_rpm } else { *known };
        let count = self.conditions.len();
        for c in 0..count {
            let value = self.condition_values[from * count + c];
            let known = &mut self.condition_values[into * count + c];
            *known = if known.is_nan() { value } else { *known };
        }
        let probes = self.probes.len();
        let (into, from) = (into * probes, from * probes);
        for p in (0..probes).filter(|p| self.held[from + p]).collect::<Vec<_>>() {
            self.held[into + p] = true;
            self.phasors[into + p] = self.phasors[from + p];
            if !self.gaps_v.is_empty() {
                self.gaps_v[into + p] = self.gaps_v[from + p];
            }
        }
    }

    pub(super) fn probe(&mut self, name: &str) -> usize {
        if let Some(at) = self.probes.iter().position(|p| p == name) {
            return at;
        }
        let probes = self.probes.len();
        self.phasors = widened(&self.phasors, probes, LOST);
        self.held = widened(&self.held, probes, false);
        self.gaps_v = widened(&self.gaps_v, probes, f64::NAN);
        self.probes.push(name.into());
        probes
    }

    /// Place of a condition of operation among all.
    fn condition(&mut self, condition: Condition) -> usize {
        if let Some(at) = self.conditions.iter().position(|c| *c == condition) {
            return at;
        }
        let count = self.conditions.len();
        self.condition_values = match count {
            0 => vec![f64::NAN; self.samples.len()],
            _ => widened(&self.condition_values, count, f64::NAN),
        };
        self.conditions.push(condition);
        count
    }

    pub(super) fn run_named(&mut self, name: &str) -> u32 {
        // runs follow one another
        let known = self.runs.iter().rposition(|run| run == name);
        let at = known.unwrap_or_else(|| {
            self.runs.push(name.into());
            self.runs.len() - 1
        });
        at as u32
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
        let mut of_probes: Vec<(Option<&str>, Vec<&Column>)> = Vec::new();
        let mut places = HashMap::new();
        for column in plan.columns.iter().filter(|c| c.target.quantity.is_of_probe()) {
            let probe = column.target.probe.as_deref();
            let at = *places.entry(probe).or_insert_with(|| {
                of_probes.push((probe, Vec::new()));
                of_probes.len() - 1
            });
            of_probes[at].1.push(column);
        }
        let (mut stated, mut of_point) = (Vec::new(), ProbeColumns::default());
        for (probe, columns) in of_probes {
            let columns = ProbeColumns::of(&columns);
            match probe {
                Some(name) => stated.push((self.probe(name), columns)),
                None => of_point = columns,
            }
        }
        let conditions = plan.columns.iter().filter_map(|c| {
            let name = c.target.probe.as_deref().filter(|_| c.target.quantity == Quantity::Condition)?;
            Some((self.condition(conditions::named(name, c.target.stated.condition?)), c))
        });
        let conditions = conditions.collect();
        let of_rows = OfRows { cells, mapping, run, stated, of_point, conditions };
        // what comes behind the last row of data is no part of the table
        let blocks = table.rows.blocks();
        let last_data = blocks.iter().rev().find_map(|rows| of_rows.last_data(rows)).unwrap_or(0);
        self.reserve(table.rows.most());
        for some in blocks.chunks(BLOCKS_A_THREAD * rayon::current_num_threads()) {
            let of_some: Vec<Result<Self>> =
                some.par_iter().map(|rows| self.part(&of_rows, rows, last_data)).collect();
            for part in of_some {
                self.append(part?);
            }
        }
        self.tables += 1;
        Ok(())
    }

    /// The readings of some rows, as a record of their own.
    fn part(&self, of_rows: &OfRows, rows: &Rows, last_data: usize) -> Result<Self> {
        let mut part = self.empty();
        rows.each(|row| {
            match row.number > last_data {
                _ if row.is_blank() => (),
                true => part.skipped.no_data.add(part.tables, row.number),
                false => part.row(of_rows, row)?,
            }
            Ok(ControlFlow::Continue(()))
        })?;
        Ok(part)
    }

    fn row(&mut self, of_rows: &OfRows, row: &SheetRow) -> Result<()> {
        let Cells { table, plan } = of_rows.cells;
        let mapping = of_rows.mapping;
        if let Some(machine) = plan.column(Quantity::Machine)
            && mapping.machine.is_some()
            && of_rows.cells.name(row, machine) != mapping.machine
        {
            self.skipped.other_machines.add(self.tables, row.number);
            return Ok(());
        }
        if is_header(table, row) {
            self.skipped.no_data.add(self.tables, row.number);
            return Ok(());
        }
        in_table(table, row)?;
        self.sample(of_rows, row)
    }

    fn sample(&mut self, of_rows: &OfRows, row: &SheetRow) -> Result<()> {
        let OfRows { cells, mapping, run, stated, of_point, conditions } = of_rows;
        let plan = cells.plan;
        let point = match plan.column(Quantity::Point) {
            None => None,
            Some(column) => match cells.name(row, column).and_then(|name| plan.probes.named(&name)) {
                Some(name) => Some(self.probe(&name)),
                None => {
                    self.skipped.other_points.add(self.tables, row.number);
                    return Ok(());
                }
            },
        };
        let (speed_rpm, when) = match speed_rpm(cells, mapping, row)? {
            Some(0.0) => {
                self.skipped.standstill.add(self.tables, row.number);
                return Ok(());
            }
            Some(speed_rpm) => (speed_rpm, cells.moment(row)?),
            // another row of this time may state it
            None => match cells.moment(row) {
                Ok(Some(when)) => (f64::NAN, Some(when)),
                _ => {
                    self.skipped.without_speed.add(self.tables, row.number);
                    return Ok(());
                }
            },
        };
        let own_run = plan.column(Quantity::Run).and_then(|column| cells.name(row, column));
        let run = own_run.as_deref().or(*run).map(|run| self.run_named(run));
        let (table, number) = (self.tables, row_number(row.number));
        self.samples.push(SourcedReading { table, row: number, run, when, speed_rpm });
        let from = self.phasors.len();
        self.phasors.resize(from + self.probes.len(), LOST);
        self.held.resize(from + self.probes.len(), false);
        if !self.gaps_v.is_empty() {
            self.gaps_v.resize(from + self.probes.len(), f64::NAN);
        }
        let at = self.condition_values.len();
        self.condition_values.resize(at + self.conditions.len(), f64::NAN);
        for (c, column) in conditions {
            self.condition_values[at + c] = condition(cells, row, column)?.unwrap_or(f64::NAN);
        }
        let columns = stated.iter().map(|(p, columns)| (*p, columns));
        for (p, columns) in columns.chain(point.map(|p| (p, of_point))) {
            if let Some((a, b)) = columns.pair {
                let (phasor, no_measurement) = phasor_um(cells, row, speed_rpm, a, b)?;
                // empty cells may be those of a probe that another row of this time holds
                let is_elsewhere = when.is_some() && [a, b].iter().all(|c| row.cell(c.index).is_empty());
                self.held[from + p] = !is_elsewhere;
                self.phasors[from + p] = phasor.unwrap_or(LOST);
                self.no_measurement += usize::from(no_measurement);
            }
            let gap = columns.gap.map(|column| gap_v(cells, row, column)).transpose()?.flatten();
            if let Some(gap_v) = gap {
                if self.gaps_v.is_empty() {
                    self.gaps_v.resize(self.phasors.len(), f64::NAN);
                }
                self.gaps_v[from + p] = gap_v;
            }
        }
        if speed_rpm.is_nan() && !self.held[from..].contains(&true) {
            self.take_back(from, at);
            self.skipped.without_speed.add(table, row.number);
        }
        Ok(())
    }

    /// Takes back the last reading, whose values begin at these places.
    fn take_back(&mut self, values: usize, conditions: usize) {
        self.samples.pop();
        self.phasors.truncate(values);
        self.held.truncate(values);
        self.gaps_v.truncate(values);
        self.condition_values.truncate(conditions);
    }
}

/// Rows of numbers, each with one more.
fn widened<T: Copy>(all: &[T], width: usize, with: T) -> Vec<T> {
    if width == 0 {
        return all.to_vec();
    };
    all.chunks(width).flat_map(|row| row.iter().copied().chain([with])).collect()
}

/// What all rows of a table have in common.
struct OfRows<'a> {
    cells: Cells<'a>,
    mapping: &'a Mapping,
    run: Option<&'a str>,
    /// Probes that have columns of their own.
    stated: Vec<(usize, ProbeColumns<'a>)>,
    /// Columns of the probe that the row names.
    of_point: ProbeColumns<'a>,
    /// Conditions of operation, by their places among all.
    conditions: Vec<(usize, &'a Column)>,
}

impl OfRows<'_> {
    /// Number of the last row of data among some.
    fn last_data(&self, rows: &Rows) -> Option<usize> {
        let mut last = None;
        rows.for_each(|row| {
            if is_data(&self.cells, row) {
                last = Some(row.number);
            }
        });
        last
    }
}

/// The columns of a probe.
#[derive(Default)]
struct ProbeColumns<'a> {
    pair: Option<(&'a Column, &'a Column)>,
    gap: Option<&'a Column>,
}

impl<'a> ProbeColumns<'a> {
    fn of(columns: &[&'a Column]) -> Self {
        let of = |quantity: Quantity| columns.iter().find(|c| c.target.quantity == quantity).copied();
        let pairs = [
            (Quantity::Amplitude, Quantity::Phase),
            (Quantity::Cos, Quantity::Sin),
            (Quantity::Real, Quantity::Imaginary),
        ];
        let pair = pairs.into_iter().find_map(|(a, b)| of(a).zip(of(b)));
        Self { pair, gap: of(Quantity::Gap) }
    }
}

//! The readings as `measured.csv`, with everything that made them in its header comment.

use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::fmt::Write;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::Result;
use rotor_edge_desktop::measurement::{Reading, ReadingColumns, ReadingLines};
use rotor_edge_desktop::whole_file;

use super::ImportResult;
use super::mapping::{MARK, Mapping};
use super::record::Record;
use crate::ingest::calendar::Moment;
use crate::ingest::target::{Rule, Target};

/// Before the moment from which a record's days count, in its header comment.
pub const COUNTS_FROM: &str = "time_d counts from ";

/// Readings of a block, and blocks of each thread before they are written.
const BLOCK: usize = 1 << 12;
const BLOCKS_A_THREAD: usize = 4;

impl Record {
    /// A reading with days since `start`.
    pub fn reading(&self, at: usize, start: Option<Moment>) -> Reading {
        let mut reading = Reading::default();
        self.put_reading(&mut reading, at, start);
        reading
    }

    /// Puts it into one that is there, since a million of them would be millions of allocations.
    fn put_reading(&self, reading: &mut Reading, at: usize, start: Option<Moment>) {
        let sample = &self.samples[at];
        let run = self.run(at);
        if reading.run.as_deref() != run {
            reading.run = run.map(str::to_string);
        }
        reading.time_d = sample.when.zip(start).and_then(|(when, start)| when.days_since(start));
        reading.speed_rpm = sample.speed_rpm;
        reading.probes.clear();
        reading.probes.extend(self.values(at).map(|y| y.map(|y| y * 1e-6)));
        reading.gaps_v.clear();
        reading.gaps_v.extend(self.gaps(at));
        reading.conditions.clear();
        reading.conditions.extend(self.conditions(at));
    }

    /// Some readings as lines of `measured.csv`.
    fn block(&self, readings: Range<usize>, start: Option<Moment>) -> Result<Vec<u8>, csv::Error> {
        let mut lines = ReadingLines::exact(self.columns(start));
        let mut block = Vec::new();
        let mut reading = Reading::default();
        for at in readings {
            self.put_reading(&mut reading, at, start);
            lines.add(&mut block, &reading)?;
        }
        Ok(block)
    }

    fn columns(&self, start: Option<Moment>) -> ReadingColumns {
        ReadingColumns {
            run: !self.runs.is_empty(),
            session: false,
            // all readings have a time, or none has
            time: start.is_some(),
            gaps: !self.gaps_v.is_empty(),
            conditions: self.conditions.len(),
        }
    }

    /// All readings as lines of `measured.csv`.
    fn write(&self, out: &mut dyn io::Write, start: Option<Moment>) -> io::Result<()> {
        let readings = self.samples.len();
        let mut header = Vec::new();
        ReadingLines::exact(self.columns(start)).header(&mut header, &self.probes, &self.conditions)?;
        out.write_all(&header)?;
        let blocks: Vec<Range<usize>> =
            (0..readings).step_by(BLOCK).map(|from| from..(from + BLOCK).min(readings)).collect();
        // a few at once, since all of them together would stand in memory
        for some in blocks.chunks(BLOCKS_A_THREAD * rayon::current_num_threads()) {
            let written: Vec<_> = some.par_iter().map(|rows| self.block(rows.clone(), start)).collect();
            for block in written {
                out.write_all(&block?)?;
            }
        }
        Ok(())
    }
}

impl ImportResult {
    /// Readings of single probes that are lost, for whatever reason.
    pub fn lost(&self) -> usize {
        self.record.lost()
    }

    /// The mapping with everything that was recognised written out.
    pub fn whole(&self, mapping: &Mapping) -> Mapping {
        let mut column: Vec<Rule> = Vec::new();
        let mut ruled: HashSet<String> = HashSet::new();
        for (_, plan) in &self.plans {
            let stated = plan.columns.iter().map(|c| (c.index + 1, &c.header, c.target.clone()));
            let left = plan.left.iter().map(|l| {
                let to = Target {
                    probe: None,
                    quantity: crate::ingest::target::Quantity::Left,
                    stated: Default::default(),
                };
                (l.number, &l.header, to)
            });
            let all: Vec<(usize, &String, Target)> = stated.chain(left).collect();
            let mut times: HashMap<&str, usize> = HashMap::new();
            all.iter().for_each(|(_, header, _)| *times.entry(header.as_str()).or_default() += 1);
            for (number, header, to) in &all {
                let is_unique = times[header.as_str()] == 1;
                let from = if is_unique { header.to_string() } else { number.to_string() };
                if ruled.insert(from.clone()) {
                    column.push(Rule { from, to: to.clone() });
                }
            }
        }
        let plan = self.plans.first().map(|(_, plan)| plan);
        let decimal = mapping.decimal.or(plan.map(|plan| plan.decimal));
        let dates = mapping.dates.or(plan.and_then(|plan| plan.dates));
        Mapping { decimal, dates, column, ..mapping.clone() }
    }

    /// Writes the whole file; components to twelve digits.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path, files: &[PathBuf], mapping: &Mapping) -> Result<()> {
        let mut head = format!("{MARK}\n");
        let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        writeln!(head, "# # of {}", names.join(", "))?;
        writeln!(
            head,
            "# # {} readings, {} values of single probes lost",
            self.record.samples.len(),
            self.lost()
        )?;
        if let Some(start) = self.start.and_then(Moment::calendar) {
            writeln!(head, "# # {COUNTS_FROM}{start}")?;
        }
        for (name, y) in self.record.probes.iter().zip(self.runout_um.iter().flatten()) {
            writeln!(head, "# # taken off {name}: cos {} µm, sin {} µm", y.re, -y.im)?;
        }
        for line in self.whole(mapping).to_toml()?.lines() {
            writeln!(head, "{}", format!("# {line}").trim_end())?;
        }
        Ok(whole_file::write_with(path, |out| {
            out.write_all(head.as_bytes())?;
            self.record.write(out, self.start)
        })?)
    }
}

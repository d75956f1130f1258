//! The readings as `measured.csv`, with everything that made them in its header comment.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;
use std::ops::Range;
use std::path::PathBuf;

use anyhow::Result;
use rayon::prelude::*;
use rotor_edge_desktop::measurement::{self, Reading};

use super::ImportResult;
use super::mapping::{MARK, Mapping};
use super::record::Record;
use crate::ingest::calendar::Moment;
use crate::ingest::target::{Rule, Target};

/// Before the moment from which a record's days count, in its header comment.
pub const COUNTS_FROM: &str = "time_d counts from ";

/// Readings that are written at once.
const BLOCK: usize = 1 << 14;
/// Bytes of a line, and of a probe in it, roughly.
const LINE_BYTES: usize = 40;
const PROBE_BYTES: usize = 36;

impl Record {
    /// A reading with days since `start`.
    pub fn reading(&self, at: usize, start: Option<Moment>) -> Reading {
        let sample = &self.samples[at];
        Reading {
            row: None,
            run: self.run(at).map(str::to_string),
            session: None,
            time_d: sample.when.zip(start).and_then(|(when, start)| when.days_since(start)),
            speed_rpm: sample.speed_rpm,
            probes: self.values(at).into_iter().map(|y| y.map(|y| y * 1e-6)).collect(),
            gaps_v: self.gaps(at),
            conditions: self.conditions(at),
        }
    }

    /// Some readings as lines of `measured.csv`, and the header above them. Every block has the columns of the whole.
    fn block(&self, readings: Range<usize>, start: Option<Moment>) -> Result<Vec<u8>> {
        let reading = |at: usize| {
            let mut reading = self.reading(at, start);
            if !self.runs.is_empty() {
                reading.run.get_or_insert_default();
            }
            reading
        };
        let readings: Vec<Reading> = readings.map(reading).collect();
        let mut block = Vec::new();
        measurement::write_with_conditions(&mut block, &self.probes, &self.conditions, &readings)?;
        Ok(block)
    }

    /// All readings as lines of `measured.csv`, behind what is there.
    fn write(&self, file: &mut Vec<u8>, start: Option<Moment>) -> Result<()> {
        let readings = self.samples.len();
        // a file that grows stands in memory twice
        file.reserve(readings * (LINE_BYTES + PROBE_BYTES * self.probes.len()));
        let blocks: Vec<Range<usize>> =
            (0..readings).step_by(BLOCK).map(|from| from..(from + BLOCK).min(readings)).collect();
        // as many at once as there are processors, since all of them together would stand in memory twice
        for some in blocks.chunks(rayon::current_num_threads()) {
            let written: Vec<Result<Vec<u8>>> =
                some.par_iter().map(|block| self.block(block.clone(), start)).collect();
            for (block, range) in written.into_iter().zip(some) {
                let block = block?;
                let header = block.iter().position(|b| *b == b'\n').map_or(0, |end| end + 1);
                file.extend(&block[if range.start == 0 { 0 } else { header }..]);
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

    /// The whole file; components to twelve digits.
    ///
    /// # Errors
    /// If the mapping cannot be written.
    pub fn measured(&self, files: &[PathBuf], mapping: &Mapping) -> Result<Vec<u8>> {
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
        let mut file = head.into_bytes();
        self.record.write(&mut file, self.start)?;
        Ok(file)
    }
}

//! The readings as `measured.csv`, with everything that made them in its header comment.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::Result;
use rotor_edge_desktop::measurement::{self, Reading};

use super::ImportResult;
use super::mapping::{MARK, Mapping};
use super::record::SourcedReading;
use crate::ingest::calendar::Moment;
use crate::ingest::target::{Rule, Target};

/// Before the moment from which a record's days count, in its header comment.
pub const COUNTS_FROM: &str = "time_d counts from ";

impl SourcedReading {
    /// As a reading, with days since `start`.
    pub fn reading(&self, start: Option<Moment>) -> Reading {
        let gaps = self.gaps_v.iter().any(Option::is_some);
        Reading {
            row: None,
            run: self.run.clone(),
            time_d: self.when.zip(start).and_then(|(when, start)| when.days_since(start)),
            speed_rpm: self.speed_rpm,
            probes: self.probes.iter().map(|y| y.map(|y| y * 1e-6)).collect(),
            gaps_v: if gaps { self.gaps_v.clone() } else { Vec::new() },
        }
    }
}

impl ImportResult {
    /// Readings of single probes that are lost, for whatever reason.
    pub fn lost(&self) -> usize {
        self.record.samples.iter().flat_map(|s| &s.probes).filter(|y| y.is_none()).count()
    }

    /// The mapping with everything that was recognised written out.
    pub fn whole(&self, mapping: &Mapping) -> Mapping {
        let mut column: Vec<Rule> = Vec::new();
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
            for (number, header, to) in &all {
                let unique = all.iter().filter(|(_, other, _)| other == header).count() == 1;
                let from = if unique { header.to_string() } else { number.to_string() };
                if !column.iter().any(|rule| rule.from == from) {
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
        let readings: Vec<Reading> = self.record.samples.iter().map(|s| s.reading(self.start)).collect();
        measurement::write_exactly(&mut file, &self.record.probes, &readings)?;
        Ok(file)
    }
}

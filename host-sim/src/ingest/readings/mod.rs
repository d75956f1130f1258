//! Tables of 1x readings from other systems, made into the project's own: `rotor-edge import`.
//!
//! | module | holds |
//! |---|---|
//! | `assign`, `plan` | which column is what, in which units; what is not stated is asked for |
//! | `mapping` | what the owner states, as a file or as options |
//! | `status` | columns that say which values are valid |
//! | `record`, `cells` | rows as readings |
//! | `repair` | stale values, outliers, a phase reference that was moved |
//! | `written` | the readings as `measured.csv`, with the mapping as its header comment |

pub(crate) mod assign;
pub(crate) mod cells;
pub(crate) mod mapping;
pub(crate) mod plan;
pub(crate) mod record;
pub(crate) mod repair;
pub(crate) mod slow_roll;
mod status;
pub(crate) mod written;

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

use super::calendar::Moment;
use super::format;
use super::preamble;
use super::sheet::Sheet;
use super::table::{self, ReadingTable};
use super::words::Word;
use mapping::Mapping;
use plan::{Plan, plan};
use record::Record;
use repair::{MarkedValues, PhaseShift};

#[derive(Debug)]
pub struct ImportResult {
    /// What was done with each table, with its file and sheet.
    pub plans: Vec<(String, Plan)>,
    pub record: Record,
    /// Values that were marked as lost.
    pub marked: MarkedValues,
    /// Readings that a moved phase reference was taken off.
    pub turned: usize,
    /// Runout that was taken off, µm, a phasor `cos − i sin` of each probe.
    pub runout_um: Option<Vec<nalgebra::Complex<f64>>>,
    /// Whether the rows were not in the order of time.
    pub sorted: bool,
    /// What days count from.
    pub start: Option<Moment>,
}

/// Imports files; `of_rotor` are the probes that are wanted, of a rotor.
///
/// # Errors
/// One sentence with file, sheet, row and column, and the option that would help.
pub fn import(files: &[PathBuf], of_rotor: Option<&[String]>, mapping: &Mapping) -> Result<ImportResult> {
    let mut all = gathered(files, of_rotor, mapping)?;
    let dates = all.plans.iter().find_map(|(_, plan)| plan.dates);
    for shift in &mapping.phase_shift {
        all.turned += PhaseShift::parse(shift, dates)?.take_off(&mut all.record)?;
    }
    if let Some(slow_roll) = &mapping.slow_roll {
        all.runout_um = Some(slow_roll::take_off(&mut all.record, slow_roll, files, of_rotor, mapping)?);
    }
    Ok(all)
}

/// Everything but the slow roll and the phase reference.
fn gathered(files: &[PathBuf], of_rotor: Option<&[String]>, mapping: &Mapping) -> Result<ImportResult> {
    let mut record = Record::of(of_rotor.unwrap_or_default());
    let mut plans = Vec::new();
    let mut machine: Option<(String, String)> = None;
    let mut rules = vec![false; mapping.column.len()];
    for path in files {
        let sheets = format::sheets(path)?;
        let table = only_table(path, &sheets, mapping)?;
        if let Some(name) = preamble::stated(&table.above, Word::Machine) {
            let (first, of) = machine.get_or_insert((name.to_string(), table.sheet.place()));
            if *first != name {
                bail!("{}: is of \"{name}\", {of} of \"{first}\", expected one machine", table.sheet.place());
            }
        }
        for (rule, used) in mapping.column.iter().zip(&mut rules) {
            let is = |c: &table::Header| rule.from == c.name || rule.from == (c.index + 1).to_string();
            *used |= table.columns.iter().any(is);
        }
        let plan = plan(&table, of_rotor.map(<[String]>::to_vec), mapping)?;
        let run = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        record.add(&table, &plan, mapping, run.as_deref().filter(|_| mapping.runs_from_files))?;
        plans.push((table.sheet.place(), plan));
    }
    if let Some((rule, _)) = mapping.column.iter().zip(&rules).find(|(_, used)| !**used) {
        bail!("--column \"{}\": there is no column of that name or number", rule.from);
    }
    let Some(start) = record.samples.first().map(|sample| sample.when) else {
        bail!("{}: there is no reading below the header", plans[0].0);
    };
    let lacking = (0..record.probes.len()).find(|p| !record.samples.iter().any(|s| s.held[*p]));
    if let Some(p) = lacking {
        bail!("{}: there is no column of the rotor's probe {}", plans[0].0, record.probes[p]);
    }
    let (start, sorted) = in_order(&mut record, start, &plans)?;
    let mut marked = MarkedValues::default();
    if !mapping.keep_stale {
        marked.stale = repair::mark_stale(&mut record);
    }
    if !mapping.keep_outliers {
        marked.outliers = repair::mark_outliers(&mut record);
    }
    Ok(ImportResult { plans, record, marked, turned: 0, runout_um: None, sorted, start })
}

fn only_table<'a>(path: &Path, sheets: &'a [Sheet], mapping: &Mapping) -> Result<ReadingTable<'a>> {
    let file = path.display();
    let asked = |sheet: &&Sheet| match (&mapping.sheet, &sheet.name) {
        (Some(asked), Some(name)) => asked == name,
        _ => true,
    };
    let mut tables = sheets.iter().filter(asked).filter_map(table::find);
    let Some(first) = tables.next() else {
        let of_sheet = mapping.sheet.as_ref().map_or(String::new(), |name| format!(" of sheet \"{name}\""));
        bail!(
            "{file}: no row{of_sheet} is the header of a table with a speed and the 1x vibration of probes"
        );
    };
    match tables.next() {
        Some(second) => bail!(
            "{}: holds a table and so does {}, expected --sheet with one of them",
            first.sheet.place(),
            second.sheet.place()
        ),
        None => Ok(first),
    }
}

/// Sorts readings by time where they have one; the first moment, and whether they were out of order.
fn in_order(
    record: &mut Record,
    first: Option<Moment>,
    plans: &[(String, Plan)],
) -> Result<(Option<Moment>, bool)> {
    let Some(first) = first else { return Ok((None, false)) };
    let mut days = Vec::new();
    for sample in &record.samples {
        match sample.when.and_then(|when| when.days_since(first)) {
            Some(day) => days.push(day),
            None => bail!(
                "{}: row {}: some times have a zone or a calendar and others not, expected one kind",
                plans[sample.table].0,
                sample.row
            ),
        }
    }
    let sorted = !days.is_sorted();
    if sorted {
        let day = |when: Option<Moment>| when.and_then(|when| when.days_since(first)).unwrap_or(0.0);
        record.samples.sort_by(|a, b| day(a.when).total_cmp(&day(b.when)));
    }
    Ok((record.samples[0].when, sorted))
}

//! Tables of 1x readings from other systems, made into the project's own: `rotor-edge import`.
//!
//! | module | holds |
//! |---|---|
//! | `assign`, `plan`, `survey` | which column is what, in which units; what is not stated is asked for |
//! | `mapping` | what the owner states, as a file or as options |
//! | `times`, `date_order`, `join` | times that rows do not state in full, rows of one reading joined |
//! | `status` | columns that say which values are valid |
//! | `record`, `parts`, `row`, `cells`, `skipped` | rows as readings, read in parts by threads, and those that are none |
//! | `amplitudes` | tables without phase |
//! | `repair` | stale values, outliers, a phase reference that was moved |
//! | `written` | the readings as `measured.csv`, with the mapping as its header comment |

pub(crate) mod amplitudes;
pub(crate) mod assign;
pub(crate) mod cells;
mod date_order;
pub(crate) mod join;
pub(crate) mod mapping;
mod parts;
pub(crate) mod plan;
pub(crate) mod record;
pub(crate) mod repair;
mod row;
pub(crate) mod skipped;
pub(crate) mod slow_roll;
mod status;
mod survey;
pub(crate) mod times;
pub(crate) mod written;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::calendar::Moment;
use super::format;
use super::preamble;
use super::sheets::Sheet;
use super::table::{self, ReadingTable};
use super::target::Quantity;
use super::words::Word;
use crate::terminal::listed;
use join::JoinedRows;
use mapping::Mapping;
use plan::{Plan, plan};
use record::Record;
use repair::{MarkedValues, PhaseShift};
use times::CompletedTimes;

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
    /// What was completed of the times, and which rows were joined.
    pub times: CompletedTimes,
    pub joined: JoinedRows,
    /// What is stated and no file has.
    unused: Option<String>,
}

/// Imports files; `of_rotor` are the probes that are wanted, of a rotor.
///
/// # Errors
/// One sentence with file, sheet, row and column, and the option that would help.
pub fn import(files: &[PathBuf], of_rotor: Option<&[String]>, mapping: &Mapping) -> Result<ImportResult> {
    let mut all = gathered(files, of_rotor, mapping)?;
    // of a file that shows the slow roll alone they are not asked
    if let Some(unused) = &all.unused {
        bail!("{}: {unused}", names(files));
    }
    let dates = all.plans.iter().find_map(|(_, plan)| plan.dates);
    for shift in &mapping.phase_shift {
        all.turned +=
            PhaseShift::parse(shift, dates)?.take_off(&mut all.record).with_context(|| names(files))?;
    }
    if let Some(slow_roll) = &mapping.slow_roll {
        all.runout_um = Some(slow_roll::take_off(&mut all.record, slow_roll, files, of_rotor, mapping)?);
    }
    Ok(all)
}

/// Names of files for a sentence about all of them.
fn names(files: &[PathBuf]) -> String {
    listed(files.iter().map(|file| file.display().to_string()))
}

/// Everything but the slow roll and the phase reference.
fn gathered(files: &[PathBuf], of_rotor: Option<&[String]>, mapping: &Mapping) -> Result<ImportResult> {
    let mut record = Record::of(of_rotor.unwrap_or_default());
    let mut plans = Vec::new();
    let mut machine: Option<(String, String)> = None;
    let mut rules = vec![false; mapping.column.len()];
    let mut columns = String::new();
    let mut has_sheets = false;
    for path in files {
        let sheets = format::sheets(path, table::score)?;
        let table = only_table(path, &sheets, mapping)?;
        if let Some(name) = preamble::stated(&table.above, Word::Machine) {
            let (first, of) = machine.get_or_insert((name.to_string(), table.sheet.place()));
            if *first != name {
                bail!("{}: is of \"{name}\", {of} of \"{first}\", expected one machine", table.sheet.place());
            }
        }
        for (rule, used) in mapping.column.iter().zip(&mut rules) {
            *used |= table.columns.iter().any(|column| column.is(&rule.from));
        }
        has_sheets |= table.sheet.name.is_some();
        columns = listed(table.columns.iter().map(|c| format!("`{}`", c.name)));
        let plan = plan(&table, of_rotor.map(<[String]>::to_vec), mapping)?;
        let run = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        record.add(&table, &plan, mapping, run.as_deref().filter(|_| mapping.runs_from_files))?;
        plans.push((table.sheet.place(), plan));
    }
    if let Some((rule, _)) = mapping.column.iter().zip(&rules).find(|(_, used)| !**used) {
        bail!(
            "{}: --column \"{}\": there is no column of that name or number, expected one of {columns}",
            names(files),
            rule.from
        );
    }
    if mapping.speed_rpm.is_some() && plans.iter().all(|(_, plan)| plan.column(Quantity::Speed).is_some()) {
        bail!(
            "{}: column `{}` is the speed, expected no --speed-rpm beside it, or --column \"NAME=left\"",
            plans[0].0,
            plans[0].1.column(Quantity::Speed).map_or("", |column| &column.header)
        );
    }
    let has_machines = plans.iter().any(|(_, plan)| plan.column(Quantity::Machine).is_some());
    let unused = unused(mapping, has_sheets, has_machines, machine.map(|(name, _)| name));
    let places: Vec<String> = plans.iter().map(|(place, _)| place.clone()).collect();
    let times = times::complete(&mut record, &places)?;
    join::equal(&mut record);
    let joined = join::staggered(&mut record);
    record.lose_without_speed();
    let Some(start) = record.samples.first().map(|sample| sample.when) else {
        let other = mapping.machine.as_ref().filter(|_| record.skipped.other_machines.rows > 0);
        match other {
            Some(name) => bail!("{}: --machine \"{name}\": no row is of that machine", names(files)),
            None => bail!("{}: there is no reading below the header", plans[0].0),
        }
    };
    require_probes(&record, &plans)?;
    let (start, sorted) = in_order(&mut record, start, &plans)?;
    let mut marked = MarkedValues::default();
    if !mapping.keep_stale {
        marked.stale = repair::mark_stale(&mut record);
    }
    if !mapping.keep_outliers {
        marked.outliers = repair::mark_outliers(&mut record);
    }
    Ok(ImportResult {
        plans,
        record,
        marked,
        turned: 0,
        runout_um: None,
        sorted,
        start,
        times,
        joined,
        unused,
    })
}

/// Refuses a record in which neither a column nor a row has one of the rotor's probes.
fn require_probes(record: &Record, plans: &[(String, Plan)]) -> Result<()> {
    let has_column = |name: &String| {
        let columns = plans.iter().flat_map(|(_, plan)| &plan.columns);
        { columns }.any(|column| column.target.probe.as_ref() == Some(name))
    };
    let is_held = |p: usize| (0..record.samples.len()).any(|k| record.holds(k)[p]);
    let lacking = (0..record.probes.len()).find(|p| !has_column(&record.probes[*p]) && !is_held(*p));
    match lacking {
        Some(p) => bail!("{}: there is no column of the rotor's probe {}", plans[0].0, record.probes[p]),
        None => Ok(()),
    }
}

/// What is stated of the sheet or the machine and no file has; `machine` is the one that the lines above a table name.
fn unused(
    mapping: &Mapping,
    has_sheets: bool,
    has_machines: bool,
    machine: Option<String>,
) -> Option<String> {
    if let Some(sheet) = mapping.sheet.as_ref().filter(|_| !has_sheets) {
        return Some(format!("--sheet \"{sheet}\": there are no sheets, expected a workbook, or no --sheet"));
    }
    let stated = mapping.machine.as_ref().filter(|_| !has_machines)?;
    match machine {
        None => Some(format!("--machine \"{stated}\": no column names machines, expected no --machine")),
        Some(machine) if machine != *stated => Some(format!(
            "--machine \"{stated}\": the file is of \"{machine}\", expected that or no --machine"
        )),
        Some(_) => None,
    }
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
                plans[sample.table as usize].0,
                sample.row
            ),
        }
    }
    let sorted = !days.is_sorted();
    if sorted {
        let mut order: Vec<usize> = (0..days.len()).collect();
        order.sort_by(|a, b| days[*a].total_cmp(&days[*b]));
        record.keep(&order);
    }
    Ok((record.samples[0].when, sorted))
}

//! Answers of `import` and `import-rotor`.

use std::path::PathBuf;

use rotor_edge_desktop::rotor_file::ross::ImportedRotor;
use rotor_edge_desktop::units::SECONDS_A_DAY;
use serde::Serialize;

use crate::ingest::calendar::{DateOrder, Moment};
use crate::ingest::readings::ImportResult;
use crate::ingest::readings::assign::UnusedColumn;
use crate::ingest::readings::plan::Column;
use crate::ingest::readings::skipped::RowCount;
use crate::ingest::target::Quantity;

/// Cosine and sine component, µm zero to peak.
pub type CosineSine = [f64; 2];

/// A drawing from a rotor of ROSS, what was carried over and what was left, a sentence each.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImportedRotorAnswer {
    pub rotor: PathBuf,
    pub carried: Vec<String>,
    pub left: Vec<String>,
}

/// Readings from exports of another system, and what its columns were taken for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImportAnswer {
    pub measured: Option<PathBuf>,
    pub columns: Vec<ImportedColumn>,
    pub left: Vec<LeftColumn>,
    pub rows: usize,
    /// Values of single probes that are lost.
    pub lost: usize,
    pub marked: MarkedValuesAnswer,
    /// Readings that were turned back to the phase reference before.
    pub turned: usize,
    pub skipped: SkippedRowsAnswer,
    /// Whether the rows had to be sorted by time.
    pub sorted: bool,
    /// When day 0 was, local to the export.
    pub start: Option<String>,
    /// What was concluded of times and dates from the order of the rows, and which rows were joined: a sentence each.
    pub remarks: Vec<String>,
    /// Runout that was taken off each probe.
    pub runout_um: Option<Vec<CosineSine>>,
    /// File and sheet of each table.
    #[serde(skip)]
    pub tables: Vec<String>,
    #[serde(skip)]
    pub probes: Vec<String>,
}

/// A column, counted from 1, and what it was taken for: its unit, and what makes µm zero to peak, degrees of lag, rpm or V.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImportedColumn {
    pub file: String,
    pub column: usize,
    pub from: String,
    pub to: String,
    pub unit: String,
    pub factor: f64,
    /// What is added after the factor, of temperatures that count from another zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    #[serde(skip)]
    pub table_index: usize,
    #[serde(skip)]
    pub probe: Option<String>,
    #[serde(skip)]
    pub quantity: &'static str,
    /// Unit of what the column becomes; empty where that has none.
    #[serde(skip)]
    pub becomes: &'static str,
}

/// A column that is not needed, or not understood.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftColumn {
    pub column: usize,
    pub from: String,
    pub why: String,
    #[serde(skip)]
    pub table_index: usize,
}

/// Values that are lost, by what was wrong with them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MarkedValuesAnswer {
    pub no_measurement: usize,
    pub stale: usize,
    pub outliers: usize,
}

/// Rows that are no readings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SkippedRowsAnswer {
    pub standstill: usize,
    pub without_speed: usize,
    pub other_machines: usize,
    pub other_points: usize,
    pub no_data: usize,
    /// Of each kind the first row, and why it was left out.
    pub first: Vec<String>,
}

impl ImportedRotorAnswer {
    /// Of a rotor whose drawing is written to `path`.
    pub fn of(imported: &ImportedRotor, path: PathBuf) -> Self {
        Self { rotor: path, carried: imported.carried.clone(), left: imported.left.clone() }
    }
}

impl ImportAnswer {
    /// Of an import that is written to `measured`, if at all.
    pub fn of(imported: &ImportResult, measured: Option<PathBuf>) -> Self {
        let record = &imported.record;
        let tables = imported.plans.iter().enumerate();
        let columns = tables.clone().flat_map(|(table, (place, plan))| {
            plan.columns.iter().map(move |column| ImportedColumn::of(column, table, place))
        });
        let left = tables
            .flat_map(|(table, (_, plan))| plan.left.iter().map(move |left| LeftColumn::of(left, table)));
        let runout_um = imported.runout_um.as_ref();
        Self {
            measured,
            columns: columns.collect(),
            left: left.collect(),
            rows: record.samples.len(),
            lost: imported.lost(),
            marked: MarkedValuesAnswer {
                no_measurement: record.no_measurement,
                stale: imported.marked.stale,
                outliers: imported.marked.outliers,
            },
            turned: imported.turned,
            skipped: SkippedRowsAnswer::of(imported),
            sorted: imported.sorted,
            start: imported.start.and_then(Moment::calendar),
            remarks: remarks(imported),
            runout_um: runout_um.map(|all| all.iter().map(|y| [y.re, -y.im]).collect()),
            tables: imported.plans.iter().map(|(place, _)| place.clone()).collect(),
            probes: record.probes.clone(),
        }
    }
}

impl SkippedRowsAnswer {
    fn of(imported: &ImportResult) -> Self {
        let skipped = imported.record.skipped;
        let first = [
            (skipped.standstill, "standstill"),
            (skipped.without_speed, "no speed"),
            (skipped.other_machines, "of another machine"),
            (skipped.other_points, "of a point that is no probe of the rotor"),
            (skipped.no_data, "a header again, or below the table"),
        ];
        let sentence = |(count, why): (RowCount, &str)| Some(format!("{}: {why}", place(imported, count)?));
        Self {
            standstill: skipped.standstill.rows,
            without_speed: skipped.without_speed.rows,
            other_machines: skipped.other_machines.rows,
            other_points: skipped.other_points.rows,
            no_data: skipped.no_data.rows,
            first: first.into_iter().filter_map(sentence).collect(),
        }
    }
}

/// File, sheet and row of the first.
fn place(imported: &ImportResult, count: RowCount) -> Option<String> {
    let (table, row) = count.first?;
    Some(format!("{}: row {row}", imported.plans[table as usize].0))
}

fn remarks(imported: &ImportResult) -> Vec<String> {
    let mut all = Vec::new();
    for (place, plan) in &imported.plans {
        if let Some(order) = plan.dates_by_steps {
            let first = if order == DateOrder::DayFirst { "day" } else { "month" };
            all.push(format!(
                "{place}: dates have the {first} first, as only then the rows follow one another in even steps."
            ));
        }
    }
    if imported.times.of_day {
        all.push("Times have no date: days count from the midnight before the first row, one more whenever the clock passes midnight.".into());
    }
    if let Some((table, row)) = imported.times.set_back {
        let place = &imported.plans[table as usize].0;
        all.push(format!(
            "{place}: row {row}: the clock was set back; times from there on are taken an hour later."
        ));
    }
    let timed_only = imported.record.timed_only;
    if let Some(first) = place(imported, timed_only) {
        let rows = timed_only.rows;
        all.push(format!("{first}: there is no speed: the reading keeps its time, and its probes are empty ({rows} in all)."));
    }
    let joined = imported.joined;
    if joined.rows > 0 {
        let apart_s = joined.apart_d * SECONDS_A_DAY;
        all.push(format!(
            "{} rows were joined with rows of other probes up to {apart_s:.3} s before.",
            joined.rows
        ));
    }
    all
}

impl ImportedColumn {
    fn of(column: &Column, table: usize, place: &str) -> Self {
        let target = &column.target;
        let to: Vec<&str> = target.probe.iter().map(String::as_str).chain([target.quantity.name()]).collect();
        let is_phase = target.quantity == Quantity::Phase;
        Self {
            file: place.into(),
            column: column.index + 1,
            from: column.header.clone(),
            to: to.join(":"),
            unit: target.stated.to_string(),
            factor: if is_phase { column.factor.to_degrees() } else { column.factor },
            offset: target.stated.condition.map(|unit| unit.offset).filter(|offset| *offset != 0.0),
            table_index: table,
            probe: target.probe.clone(),
            quantity: target.quantity.name(),
            becomes: unit_of(column),
        }
    }
}

/// Unit of what a column becomes.
fn unit_of(column: &Column) -> &'static str {
    match column.target.quantity {
        Quantity::Amplitude | Quantity::Cos | Quantity::Sin | Quantity::Real | Quantity::Imaginary => {
            ["µm 0-pk", "µm/s 0-pk, integrated once", "µm/s² 0-pk, integrated twice"]
                [usize::from(column.derivative)]
        }
        Quantity::Phase => "degrees of lag",
        Quantity::Speed => "rpm",
        Quantity::Gap => "V",
        Quantity::Condition => column.target.stated.condition.map_or("", |unit| unit.becomes.symbol()),
        Quantity::Time | Quantity::Clock => "days",
        _ => "",
    }
}

impl LeftColumn {
    fn of(left: &UnusedColumn, table: usize) -> Self {
        Self { column: left.number, from: left.header.clone(), why: left.why.clone(), table_index: table }
    }
}

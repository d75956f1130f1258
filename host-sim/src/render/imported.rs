//! Text of the answers of `import` and `import-rotor`.

use std::fmt::Write as _;

use super::text;
use crate::answers::imported::{ImportAnswer, ImportedColumn, ImportedRotorAnswer};
use crate::ingest::target::Quantity;

const COLUMNS: [&str; 4] = ["column", "is", "in", "and becomes"];

/// What was carried over and what was not.
pub fn rotor_text(answer: &ImportedRotorAnswer) -> String {
    let lines = |sentences: &[String]| sentences.iter().map(|s| format!("  {s}\n")).collect::<String>();
    format!(
        "Written to {}. Carried over:\n{}Not carried over:\n{}",
        answer.rotor.display(),
        lines(&answer.carried),
        lines(&answer.left)
    )
}

/// What every column was taken for, and what became of the rows.
pub fn text(answer: &ImportAnswer) -> String {
    let mut text = String::new();
    for (i, place) in answer.tables.iter().enumerate() {
        let rows: Vec<[String; 4]> = answer.columns.iter().filter(|c| c.table_index == i).map(row).collect();
        let _ = write!(text, "{place}\n{}", text::table(&COLUMNS, &rows));
        for left in answer.left.iter().filter(|left| left.table_index == i) {
            let _ = writeln!(text, "  {} `{}` is left: {}", left.column, left.from, left.why);
        }
    }
    let _ = writeln!(text, "\n{} readings of {}.", answer.rows, answer.probes.join(", "));
    if let Some(start) = &answer.start {
        let _ = writeln!(text, "Days count from {start}.");
    }
    for remark in &answer.remarks {
        let _ = writeln!(text, "{remark}");
    }
    if answer.sorted {
        text += "The rows were not in the order of time, and are now.\n";
    }
    let _ = writeln!(text, "{} values of single probes are lost.", answer.lost);
    for (count, what) in counts(answer).into_iter().filter(|(count, _)| *count > 0) {
        let _ = writeln!(text, "  {count} {what}");
    }
    for first in &answer.skipped.first {
        let _ = writeln!(text, "  first row of its kind: {first}");
    }
    for (name, [cos, sin]) in answer.probes.iter().zip(answer.runout_um.iter().flatten()) {
        let _ = writeln!(text, "Runout of {name} taken off: cos {cos:.3} µm 0-pk, sin {sin:.3} µm 0-pk.");
    }
    text
}

fn row(column: &ImportedColumn) -> [String; 4] {
    let owner = if column.quantity == Quantity::Condition.name() { "" } else { "probe " };
    let probe = column.probe.as_ref().map_or(String::new(), |p| format!("{owner}{p}, "));
    [
        format!("{} `{}`", column.column, column.from),
        format!("{probe}{}", column.quantity),
        column.unit.clone(),
        done(column),
    ]
}

/// What was done with the numbers of a column.
fn done(column: &ImportedColumn) -> String {
    let becomes = column.becomes;
    if let Some(offset) = column.offset {
        return format!("times {:.6} less {:.6} to {becomes}", column.factor, -offset);
    }
    match column.factor {
        _ if becomes.is_empty() || becomes == "days" => becomes.into(),
        f if (f - 1.0).abs() < 1e-12 => format!("taken as {becomes}"),
        f if (f - 0.5).abs() < 1e-12 => format!("halved to {becomes}"),
        f if (f + 1.0).abs() < 1e-12 => format!("turned round to {becomes}"),
        f => format!("times {f:.6} to {becomes}"),
    }
}

/// What happened to how many values and rows.
fn counts(answer: &ImportAnswer) -> [(usize, &'static str); 9] {
    let (marked, skipped) = (&answer.marked, &answer.skipped);
    [
        (marked.no_measurement, "of them had a number that means no measurement"),
        (marked.stale, "of them were stale: the same to the last digit four times or more (--keep-stale)"),
        (marked.outliers, "of them were far from those before and after (--keep-outliers)"),
        (answer.turned, "readings were corrected for a keyphasor that was moved"),
        (skipped.standstill, "rows left out: standstill"),
        (skipped.without_speed, "rows left out: no speed"),
        (skipped.other_machines, "rows left out: of another machine"),
        (skipped.other_points, "rows left out: of points that are no probe of the rotor"),
        (skipped.no_data, "lines left out: a header again, or what stands below the table"),
    ]
}

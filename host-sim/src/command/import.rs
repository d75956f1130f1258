//! `import`: measurements from exports of other systems.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_desktop::rotor_file;
use serde_json::{Value, json};

use super::output::{self, Json};
use crate::ingest::calendar::{DateOrder, Moment};
use crate::ingest::number::Decimal;
use crate::ingest::readings::mapping::Mapping;
use crate::ingest::readings::plan::Column;
use crate::ingest::readings::{ImportResult, import};
use crate::ingest::target::{Quantity, Rule};
use crate::ingest::unit::{Angle, Detection, Sense, Unit};

/// What the command line asks of the command.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Exports: CSV, TSV, other text with separators, xlsx, xls, ods; several follow one another, or hold a probe each
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Where to write the measurements
    #[arg(short, long, default_value = "measured.csv")]
    output: PathBuf,
    /// Take the probes of this rotor, and their names
    #[arg(long)]
    rotor: Option<PathBuf>,
    /// Take what an import before took: a file of --write-mapping, or measurements that were imported
    #[arg(long)]
    mapping: Option<PathBuf>,
    /// Write what was recognised and stated, for later imports
    #[arg(long, value_name = "FILE")]
    write_mapping: Option<PathBuf>,
    #[command(flatten)]
    conventions: Conventions,
    /// What a column is, by name or number: probe:quantity:unit, such as "1x Ampl=16X:amplitude:um pp", "n=speed:rpm",
    /// "MW=left"
    #[arg(long, value_name = "NAME=TARGET")]
    column: Vec<Rule>,
    /// The sheet of a workbook
    #[arg(long)]
    sheet: Option<String>,
    /// The machine, where a file holds several
    #[arg(long)]
    machine: Option<String>,
    /// The speed, where no column has it
    #[arg(long)]
    speed_rpm: Option<f64>,
    /// Each file is a run, named as the file
    #[arg(long)]
    runs_from_files: bool,
    /// Take this off every reading: a run of the files, another file, or a row, of a shaft that turns too slowly to vibrate
    #[arg(long, value_name = "ROW|RUN|FILE")]
    slow_roll: Option<String>,
    /// The phase reference was moved on this date: phase lags grew by so many degrees, which are taken off
    #[arg(long, value_name = "DATE=DEGREES")]
    phase_shift: Vec<String>,
    /// Values that are one and the same four times or more are measurements
    #[arg(long)]
    keep_stale: bool,
    /// Values far from those before and after, at one speed, are measurements
    #[arg(long)]
    keep_outliers: bool,
    /// Show what would be done and write nothing
    #[arg(long)]
    dry_run: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Conventions that an export does not state itself.
#[derive(Debug, Args)]
struct Conventions {
    /// Phases lag: from the keyphasor's mark to the next peak
    #[arg(long, conflicts_with = "lead")]
    lag: bool,
    /// Phases lead
    #[arg(long)]
    lead: bool,
    /// Amplitudes are peak to peak
    #[arg(long, conflicts_with_all = ["zero_peak", "rms"])]
    pp: bool,
    /// Amplitudes are zero to peak
    #[arg(long, conflicts_with = "rms")]
    zero_peak: bool,
    /// Amplitudes are root mean squares
    #[arg(long)]
    rms: bool,
    /// Unit of amplitudes
    #[arg(long, value_parser = Unit::of_amplitudes())]
    unit: Option<Unit>,
    /// Unit of phases
    #[arg(long)]
    angle: Option<Angle>,
    /// Sensitivity of the probes, where amplitudes are voltages (7.874 is 200 mV/mil)
    #[arg(long)]
    sensitivity_mv_um: Option<f64>,
    /// What comes first in dates such as 03/04/2024
    #[arg(long)]
    dates: Option<DateOrder>,
    /// What stands before the decimals
    #[arg(long)]
    decimal: Option<Decimal>,
}

impl Arguments {
    /// What the owner states: here, else in the mapping file.
    fn mapping(&self) -> Result<Mapping> {
        let c = &self.conventions;
        for (option, value) in [("--sensitivity-mv-um", c.sensitivity_mv_um), ("--speed-rpm", self.speed_rpm)]
        {
            if value.is_some_and(|value| !(value > 0.0 && value.is_finite())) {
                bail!("{option}: expected a positive number");
            }
        }
        let chosen = |all: &[bool]| all.iter().position(|is| *is);
        let stated = Mapping {
            phase: chosen(&[c.lag, c.lead]).map(|i| [Sense::Lag, Sense::Lead][i]),
            amplitude: chosen(&[c.pp, c.zero_peak, c.rms])
                .map(|i| [Detection::PeakToPeak, Detection::ZeroToPeak, Detection::Rms][i]),
            unit: c.unit,
            angle: c.angle,
            sensitivity_mv_um: c.sensitivity_mv_um,
            dates: c.dates,
            decimal: c.decimal,
            sheet: self.sheet.clone(),
            machine: self.machine.clone(),
            speed_rpm: self.speed_rpm,
            runs_from_files: self.runs_from_files,
            keep_stale: self.keep_stale,
            keep_outliers: self.keep_outliers,
            slow_roll: self.slow_roll.clone(),
            phase_shift: self.phase_shift.clone(),
            column: self.column.clone(),
        };
        Ok(match &self.mapping {
            Some(path) => stated.or(Mapping::read(path)?),
            None => stated,
        })
    }
}

/// Runs the command; `forced` writes over files that exist.
pub fn run(arguments: &Arguments, forced: bool) -> Result<Json> {
    let targets = std::iter::once(&arguments.output).chain(&arguments.write_mapping);
    output::refuse_what_exists(targets, forced || arguments.dry_run)?;
    let mapping = arguments.mapping()?;
    let rotor = arguments.rotor.as_deref().map(rotor_file::read).transpose()?;
    let probes: Option<Vec<String>> = rotor.map(|r| r.probe.iter().map(|p| p.name.clone()).collect());
    let imported = import(&arguments.files, probes.as_deref(), &mapping)?;
    if !arguments.json {
        show(&imported);
    }
    let written = !arguments.dry_run;
    if written {
        output::file(&arguments.output, &imported.measured(&arguments.files, &mapping)?)?;
        if let Some(path) = &arguments.write_mapping {
            output::file(path, imported.whole(&mapping).to_toml()?.as_bytes())?;
        }
    }
    if arguments.json {
        return output::as_json(&answer(&imported, written.then_some(&arguments.output)));
    }
    if written {
        println!("\nWritten to {}, with this mapping in its first lines.", arguments.output.display());
    } else {
        println!("\nNothing was written.");
    }
    Ok(None)
}

/// Unit of what a column becomes.
fn unit_there(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Amplitude | Quantity::Cos | Quantity::Sin | Quantity::Real | Quantity::Imaginary => {
            "µm zero-to-peak"
        }
        Quantity::Phase => "degrees of lag",
        Quantity::Speed => "rpm",
        Quantity::Gap => "V",
        Quantity::Time | Quantity::Clock => "days",
        _ => "",
    }
}

/// What a column's numbers are multiplied by, phases to degrees of lag.
fn factor(column: &Column) -> f64 {
    if column.target.quantity == Quantity::Phase { column.factor.to_degrees() } else { column.factor }
}

fn done(column: &Column) -> String {
    let there = unit_there(column.target.quantity);
    match factor(column) {
        _ if there.is_empty() || there == "days" => there.into(),
        f if (f - 1.0).abs() < 1e-12 => format!("taken as {there}"),
        f if (f - 0.5).abs() < 1e-12 => format!("halved to {there}"),
        f if (f + 1.0).abs() < 1e-12 => format!("turned round to {there}"),
        f => format!("times {f:.6} to {there}"),
    }
}

fn show(imported: &ImportResult) {
    for (place, plan) in &imported.plans {
        println!("{place}");
        let row = |c: &Column| {
            let probe = c.target.probe.as_ref().map_or(String::new(), |p| format!("probe {p}, "));
            let is = format!("{probe}{}", c.target.quantity.name());
            [format!("{} `{}`", c.index + 1, c.header), is, c.target.stated.to_string(), done(c)]
        };
        let rows: Vec<[String; 4]> = plan.columns.iter().map(row).collect();
        output::table(&["column", "is", "in", "and becomes"], &rows);
        for left in &plan.left {
            println!("  {} `{}` is left: {}", left.number, left.header, left.why);
        }
    }
    let record = &imported.record;
    let probes = record.probes.join(", ");
    println!("\n{} readings of {probes}.", record.samples.len());
    if let Some(start) = imported.start.and_then(Moment::calendar) {
        println!("Days count from {start}.");
    }
    if imported.sorted {
        println!("The rows were not in the order of time, and are now.");
    }
    println!("{} values of single probes are lost.", imported.lost());
    for (count, what) in counts(imported).into_iter().filter(|(count, _)| *count > 0) {
        println!("  {count} {what}");
    }
    for (name, y) in record.probes.iter().zip(imported.runout_um.iter().flatten()) {
        println!("Runout of {name} taken off: cos {:.3} µm, sin {:.3} µm.", y.re, -y.im);
    }
}

/// What happened to how many values and rows.
fn counts(imported: &ImportResult) -> [(usize, &'static str); 9] {
    let record = &imported.record;
    let skipped = record.skipped;
    [
        (record.no_measurement, "of them had a number that means no measurement"),
        (
            imported.marked.stale,
            "of them were stale: the same to the last digit four times or more (--keep-stale)",
        ),
        (imported.marked.outliers, "of them were far from those before and after (--keep-outliers)"),
        (imported.turned, "readings were turned back to the phase reference before"),
        (skipped.standstill, "rows left out: standstill"),
        (skipped.without_speed, "rows left out: no speed"),
        (skipped.other_machines, "rows left out: of another machine"),
        (skipped.other_points, "rows left out: of points that are no probe of the rotor"),
        (skipped.no_data, "lines left out: a header again, or what stands below the table"),
    ]
}

fn answer(imported: &ImportResult, written: Option<&PathBuf>) -> Value {
    let columns: Vec<Value> = (imported.plans.iter())
        .flat_map(|(place, plan)| plan.columns.iter().map(move |c| (place, c)))
        .map(|(place, c)| {
            let to = c.target.probe.iter().map(String::as_str).chain([c.target.quantity.name()]);
            json!({
                "file": place,
                "column": c.index + 1,
                "from": c.header,
                "to": to.collect::<Vec<_>>().join(":"),
                "unit": c.target.stated.to_string(),
                "factor": factor(c),
            })
        })
        .collect();
    let left: Vec<Value> = (imported.plans.iter())
        .flat_map(|(_, plan)| &plan.left)
        .map(|l| json!({"column": l.number, "from": l.header, "why": l.why}))
        .collect();
    let [
        no_measurement,
        stale,
        outliers,
        turned,
        standstill,
        without_speed,
        other_machines,
        other_points,
        no_data,
    ] = counts(imported).map(|(count, _)| count);
    let output: Option<&Path> = written.map(PathBuf::as_path);
    json!({
        "measured": output,
        "columns": columns,
        "left": left,
        "rows": imported.record.samples.len(),
        "lost": imported.lost(),
        "marked": {"no_measurement": no_measurement, "stale": stale, "outliers": outliers},
        "turned": turned,
        "skipped": {
            "standstill": standstill,
            "without_speed": without_speed,
            "other_machines": other_machines,
            "other_points": other_points,
            "no_data": no_data,
        },
        "sorted": imported.sorted,
        "start": imported.start.and_then(Moment::calendar),
        "runout_um": imported.runout_um.as_ref().map(|all| all.iter().map(|y| [y.re, -y.im]).collect::<Vec<_>>()),
    })
}

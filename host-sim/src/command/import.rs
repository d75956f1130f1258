//! `import`: measurements from exports of other systems.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use rotor_edge_desktop::rotor_file;

use super::output::{self, Json};
use crate::answers::imported::ImportAnswer;
use crate::ingest::calendar::DateOrder;
use crate::ingest::number::Decimal;
use crate::ingest::readings::import;
use crate::ingest::readings::mapping::Mapping;
use crate::ingest::target::Rule;
use crate::ingest::unit::{Angle, Detection, Sense, Sensitivity, Unit};
use crate::render;
use crate::say;
use crate::terminal;

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
    /// Mapping of an earlier import: a file of --write-mapping, or imported measurements
    #[arg(long)]
    mapping: Option<PathBuf>,
    /// Write the mapping of columns, for later imports
    #[arg(long, value_name = "FILE")]
    write_mapping: Option<PathBuf>,
    #[command(flatten)]
    conventions: Conventions,
    /// Meaning of a column, by name or number: probe:quantity:unit, such as "1x Ampl=16X:amplitude:um pp",
    /// "n=speed:rpm", "MW=left"
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
    /// Slow roll to subtract from every reading: a run of the files, another file, or a row
    #[arg(long, value_name = "ROW|RUN|FILE")]
    slow_roll: Option<String>,
    /// Correct for a keyphasor that was moved on this date and increased phase lags by so many degrees
    #[arg(long, value_name = "DATE=DEGREES")]
    phase_shift: Vec<String>,
    /// Keep values that repeat four times or more
    #[arg(long)]
    keep_stale: bool,
    /// Keep values far from those before and after, at one speed
    #[arg(long)]
    keep_outliers: bool,
    /// Show the mapping and write nothing
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
    /// Amplitudes are pk-pk
    #[arg(long, conflicts_with_all = ["zero_peak", "rms"])]
    pp: bool,
    /// Amplitudes are 0-pk
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
    /// Sensitivity of other transducers, where amplitudes are voltages, such as "100 mV/g" or "4 mV/mm/s"
    #[arg(long, value_name = "SENSITIVITY", conflicts_with = "sensitivity_mv_um")]
    sensitivity: Option<Sensitivity>,
    /// Order of day and month in dates such as 03/04/2024
    #[arg(long)]
    dates: Option<DateOrder>,
    /// Decimal separator
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
            sensitivity: c.sensitivity,
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
            ..Mapping::default()
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
    let written = !arguments.dry_run;
    let answer = ImportAnswer::of(&imported, written.then(|| arguments.output.clone()));
    if !arguments.json {
        terminal::print(&render::imported::text(&answer));
    }
    if written {
        imported.write(&arguments.output, &arguments.files, &mapping)?;
        if let Some(path) = &arguments.write_mapping {
            output::file(path, imported.whole(&mapping).to_toml()?.as_bytes())?;
        }
    }
    if arguments.json {
        return output::answer(&answer);
    }
    if written {
        say!("\nWritten to {}, with this mapping in its first lines.", arguments.output.display());
    } else {
        say!("\nNothing was written.");
    }
    Ok(None)
}

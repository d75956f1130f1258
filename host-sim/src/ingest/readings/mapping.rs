//! What is stated about an export by its owner, by a mapping file, or by an import before.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use serde::{Deserialize, Serialize};

use crate::ingest::calendar::DateOrder;
use crate::ingest::number::Decimal;
use crate::ingest::target::Rule;
use crate::ingest::unit::{Angle, Detection, Sense, Sensitivity, Unit};

/// First line of a header comment that an import wrote.
pub const MARK: &str = "# # rotor-edge import";

/// Everything that decides what an export becomes; what is not there is taken from the export.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mapping {
    /// Which way phases count, where a column does not say.
    pub phase: Option<Sense>,
    /// Unit of phases, where a column does not say.
    pub angle: Option<Angle>,
    /// How amplitudes are measured, where a column does not say.
    pub amplitude: Option<Detection>,
    /// Unit of amplitudes, where a column does not say.
    pub unit: Option<Unit>,
    /// Sensitivity of the probes, where amplitudes are voltages, mV/µm.
    pub sensitivity_mv_um: Option<f64>,
    /// Sensitivity of other transducers, such as `100 mV/g`.
    pub sensitivity: Option<Sensitivity>,
    pub dates: Option<DateOrder>,
    pub decimal: Option<Decimal>,
    /// The sheet of a workbook.
    pub sheet: Option<String>,
    /// The machine, where a file holds several.
    pub machine: Option<String>,
    /// The speed, where no column has it, rpm.
    pub speed_rpm: Option<f64>,
    /// Whether each file is a run, named as the file.
    pub runs_from_files: bool,
    /// Whether values that repeat to the last digit are measurements.
    pub keep_stale: bool,
    /// Whether values far from those before and after are measurements.
    pub keep_outliers: bool,
    /// A row, a run or a file that shows the runout.
    pub slow_roll: Option<String>,
    /// `DATE=DEGREES`: by how much phase lags grew on a date, when the reference was moved.
    pub phase_shift: Vec<String>,
    /// Columns by name or number.
    pub column: Vec<Rule>,
    /// Whether amplitudes are used without phases.
    #[serde(skip)]
    pub amplitudes_alone: bool,
}

impl Mapping {
    /// Reads a mapping file, or the mapping of what an import wrote.
    ///
    /// # Errors
    /// One sentence with the file and the key.
    pub fn read(path: &Path) -> Result<Self> {
        let file = path.display();
        let text = std::fs::read_to_string(path).with_context(|| format!("{file}: cannot be read"))?;
        let comment = |line: &str| line.strip_prefix('#').map(|l| l.trim_start().to_string());
        let toml = if text.starts_with(MARK) {
            text.lines().map_while(comment).collect::<Vec<_>>().join("\n")
        } else {
            text
        };
        toml::from_str(&toml).map_err(|error| anyhow!("{file}: {}", one_line(error.message())))
    }

    /// As a file that [`Self::read`] reads.
    ///
    /// # Errors
    /// If it cannot be written as TOML.
    pub fn to_toml(&self) -> Result<String> {
        Ok(toml::to_string(self)?)
    }

    /// What is stated here, else there; columns of both, these first.
    pub fn or(self, other: Self) -> Self {
        Self {
            phase: self.phase.or(other.phase),
            angle: self.angle.or(other.angle),
            amplitude: self.amplitude.or(other.amplitude),
            unit: self.unit.or(other.unit),
            sensitivity_mv_um: self.sensitivity_mv_um.or(other.sensitivity_mv_um),
            sensitivity: self.sensitivity.or(other.sensitivity),
            dates: self.dates.or(other.dates),
            decimal: self.decimal.or(other.decimal),
            sheet: self.sheet.or(other.sheet),
            machine: self.machine.or(other.machine),
            speed_rpm: self.speed_rpm.or(other.speed_rpm),
            runs_from_files: self.runs_from_files || other.runs_from_files,
            keep_stale: self.keep_stale || other.keep_stale,
            keep_outliers: self.keep_outliers || other.keep_outliers,
            slow_roll: self.slow_roll.or(other.slow_roll),
            phase_shift: if self.phase_shift.is_empty() { other.phase_shift } else { self.phase_shift },
            column: self.column.into_iter().chain(other.column).collect(),
            amplitudes_alone: self.amplitudes_alone || other.amplitudes_alone,
        }
    }
}

fn one_line(text: &str) -> String {
    text.lines().collect::<Vec<_>>().join(", ")
}

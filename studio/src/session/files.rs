//! The files of a session, as they were given.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use rotor_edge::sample;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::measurement::{self, Reading, SlowRoll};
use rotor_edge_desktop::rotor_file;
use serde::{Deserialize, Serialize};

/// A file by its name, and what is in it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NamedText {
    pub name: String,
    pub text: String,
}

/// Slow roll that somebody stated.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SlowRollInput {
    /// A run of the measurements.
    Run(String),
    /// A file of its own.
    File(NamedText),
}

impl SlowRollInput {
    /// A file if there is one of that name, else a run of the measurements; `None` of an empty text.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn named(text: &str) -> Result<Option<Self>> {
        Ok(match SlowRoll::named(text) {
            _ if text.is_empty() => None,
            SlowRoll::File(path) => Some(Self::File(NamedText { text: text_of(&path)?, name: text.into() })),
            _ => Some(Self::Run(text.into())),
        })
    }

    /// As it stands on a command line.
    pub fn name(&self) -> &str {
        match self {
            Self::Run(name) | Self::File(NamedText { name, .. }) => name,
        }
    }
}

impl From<&SlowRollInput> for SlowRoll {
    fn from(input: &SlowRollInput) -> Self {
        match input {
            SlowRollInput::Run(name) => Self::Run(name.clone()),
            SlowRollInput::File(file) => Self::Text { name: file.name.clone(), text: file.text.clone() },
        }
    }
}

fn text_of(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).with_context(|| format!("{}: cannot be read", path.display()))
}

/// A rotor's file and measurements of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputFiles {
    pub rotor: NamedText,
    pub data: NamedText,
    /// Slow roll that is taken off the readings, in place of those that the rotor's file states.
    #[serde(default)]
    pub slow_roll: Option<SlowRollInput>,
    /// Where they were read from; `None` of a sample, of dropped files and of a hidden machine.
    pub paths: Option<[PathBuf; 2]>,
}

impl InputFiles {
    /// The turbine of the program, on the day after something changed.
    pub fn sample() -> Self {
        let named = |name: &str, text: &str| NamedText { name: name.into(), text: text.into() };
        Self {
            rotor: named("rotor.toml", sample::ROTOR),
            data: named("runup-day126.csv", sample::RUNUP_DAY_126),
            slow_roll: None,
            paths: None,
        }
    }

    /// Reads two files from the disk.
    ///
    /// # Errors
    /// If one cannot be read; both are checked by [`Self::parsed`].
    pub fn read(rotor: &Path, data: &Path) -> Result<Self> {
        let named = |path: &Path, text: String| NamedText { name: path.display().to_string(), text };
        let stated = text_of(rotor)?;
        // a file that names tables beside it is kept with the tables in it
        let whole = match rotor_file::parse("", &stated) {
            Ok(_) => stated,
            Err(_) => rotor_file::text(&rotor.display().to_string(), &rotor_file::read(rotor)?)?,
        };
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        Ok(Self {
            rotor: named(rotor, whole),
            data: named(data, text_of(data)?),
            slow_roll: None,
            paths: Some([absolute(rotor), absolute(data)]),
        })
    }

    /// Dropped files: one rotor's file and one of measurements, in any order; other files stand beside the rotor's.
    ///
    /// # Errors
    /// If there are not these two, or the rotor's file cannot be read.
    pub fn dropped(files: Vec<NamedText>) -> Result<Self> {
        let (mut rotors, mut tables): (Vec<NamedText>, Vec<NamedText>) =
            files.into_iter().partition(|file| is_toml(&file.name));
        let names = |all: &[NamedText]| all.iter().map(|f| f.name.clone()).collect::<Vec<_>>().join(", ");
        let (Some(rotor), true) = (rotors.pop(), rotors.is_empty()) else {
            bail!("expected one rotor's file (.toml) and one file of measurements (.csv), got {}", {
                rotors.append(&mut tables);
                if rotors.is_empty() { "none".into() } else { names(&rotors) }
            });
        };
        let beside: Vec<NamedText> =
            tables.extract_if(.., |file| rotor.text.contains(&format!("\"{}\"", file.name))).collect();
        let (Some(data), true) = (tables.pop(), tables.is_empty()) else {
            bail!("expected one file of measurements (.csv) beside {}, got {}", rotor.name, names(&tables));
        };
        let rotor = if beside.is_empty() { rotor } else { with_tables(&rotor, &beside)? };
        Ok(Self { rotor, data, slow_roll: None, paths: None })
    }

    /// The machine and its readings.
    ///
    /// # Errors
    /// One sentence with the file, the key or row and what was expected; also where the two do not belong together.
    pub fn parsed(&self) -> Result<(Rotor, Vec<Reading>)> {
        let rotor = rotor_file::parse(&self.rotor.name, &self.rotor.text)?;
        let slow_roll = self.slow_roll.as_ref().map(SlowRoll::from).unwrap_or_default();
        let (name, text) = (&self.data.name, &self.data.text);
        let readings = measurement::parse_with_slow_roll(name, text, &rotor, &slow_roll)?;
        Ok((rotor, readings))
    }
}

fn is_toml(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|end| end.eq_ignore_ascii_case("toml"))
}

/// The rotor's file with the tables that it names in it.
fn with_tables(rotor: &NamedText, tables: &[NamedText]) -> Result<NamedText> {
    let folder = tempfile::tempdir().context("no temporary folder")?;
    let plain = |name: &str| {
        let is_plain = Path::new(name).file_name().is_some_and(|own| own == name);
        if is_plain {
            Ok(folder.path().join(name))
        } else {
            bail!("{name}: expected a file name without folders")
        }
    };
    for file in tables.iter().chain([rotor]) {
        std::fs::write(plain(&file.name)?, &file.text)?;
    }
    let read = rotor_file::read(&plain(&rotor.name)?);
    let prefix = format!("{}/", folder.path().display());
    let read = read.map_err(|error| anyhow::anyhow!(error.to_string().replace(&prefix, "")))?;
    Ok(NamedText { name: rotor.name.clone(), text: rotor_file::text(&rotor.name, &read)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str, text: &str) -> NamedText {
        NamedText { name: name.into(), text: text.into() }
    }

    #[test]
    fn dropped_files_are_told_apart_in_any_order() {
        let InputFiles { rotor, data, .. } = InputFiles::sample();
        let files = InputFiles::dropped(vec![data.clone(), rotor.clone()]).unwrap();
        assert_eq!((&files.rotor, &files.data), (&rotor, &data));
        files.parsed().unwrap();
        for wrong in [vec![rotor.clone()], vec![data.clone()], vec![rotor.clone(), rotor.clone(), data]] {
            assert!(InputFiles::dropped(wrong).unwrap_err().to_string().starts_with("expected one"));
        }
    }

    #[test]
    fn measurements_of_another_machine_are_refused_by_name() {
        let sample = InputFiles::sample();
        let text = sample.data.text.replace("15X", "99X");
        let files = InputFiles { data: named("other.csv", &text), ..sample };
        assert!(files.parsed().unwrap_err().to_string().contains("other.csv"));
    }
}

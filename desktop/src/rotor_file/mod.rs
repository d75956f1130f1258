//! Reading, checking and writing `rotor.toml`.

mod loads;
mod materials;
pub mod ross;
mod stated;
mod table_file;
mod validation;

use std::ops::Range;
use std::path::Path;

use serde::Deserialize;
use toml::de::DeTable;

use crate::error::Error;
use crate::file_kind;
use crate::machine::drawing::Rotor;
use crate::whole_file;
pub(crate) use loads::assign_loads;
pub(crate) use validation::SCHEMA;
use validation::{check, check_materials};

/// Reads and checks a rotor.
///
/// # Errors
/// One sentence with the file, the key and what was expected.
pub fn read(path: &Path) -> Result<Rotor, Error> {
    let (file, text) = contents(path)?;
    let rotor = from_toml(&file, &text, path.parent())?;
    checked(&file, rotor)
}

/// Reads a rotor whose trial weights may lack their angles: what those weights do is not known, so they
/// are left out, and the names of their runs are returned.
///
/// # Errors
/// As [`read`] for everything else.
pub fn read_allowing_unstated_angles(path: &Path) -> Result<(Rotor, Vec<String>), Error> {
    let (file, text) = contents(path)?;
    let mut rotor = from_toml(&file, &text, path.parent())?;
    let mut without = Vec::new();
    for run in &mut rotor.run {
        if run.added_unbalance.iter().any(|a| a.angle_deg.is_nan()) {
            run.added_unbalance.clear();
            without.push(run.name.clone());
        }
    }
    Ok((checked(&file, rotor)?, without))
}

/// A file's name for messages, and its text.
fn contents(path: &Path) -> Result<(String, String), Error> {
    let file = path.display().to_string();
    let text = whole_file::read_drawing(path)?;
    Ok((file, text))
}

/// Parses and checks the text of a `rotor.toml`; `file` is only for messages, so nothing can lie beside it.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &str, text: &str) -> Result<Rotor, Error> {
    let rotor = from_toml(file, text, None)?;
    checked(file, rotor)
}

/// The machine as it is computed with: checked with all its probes, and with the used ones alone.
fn checked(file: &str, rotor: Rotor) -> Result<Rotor, Error> {
    check(file, &rotor)?;
    let rotor = rotor.set_aside();
    if !rotor.unused.is_empty() {
        check(file, &rotor)?;
    }
    Ok(rotor)
}

fn from_toml(file: &str, text: &str, folder: Option<&Path>) -> Result<Rotor, Error> {
    let at = |span: Option<Range<usize>>, what: &str| {
        let line = span.map(|span| text[..span.start].matches('\n').count() + 1);
        let place = line.map_or_else(|| "text".into(), |n| format!("line {n}"));
        Error::rotor(file, place, what.lines().next().unwrap_or("cannot be parsed"))
    };
    let refused = |e: toml::de::Error| at(e.span(), e.message());
    if file_kind::is_table(text) {
        let what = "this is the header of a table, expected a rotor file (TOML); give the rotor file first and the \
                    measurements after it";
        return Err(Error::rotor(file, "text", what));
    }
    let mut root = DeTable::parse(text).map_err(refused)?;
    let materials = materials::resolve(root.get_mut()).map_err(|(span, what)| at(Some(span), &what))?;
    check_materials(file, &materials)?;
    let tables = folder.map_or_else(|| Ok(Vec::new()), |folder| table_file::texts(root.get_ref(), folder))?;
    table_file::resolve(root.get_mut(), &tables).map_err(refused)?;
    let newer = if materials.is_empty() { dimensions(root.get_ref()) } else { Some("[[material]]".into()) };
    let mut rotor = Rotor::deserialize(toml::Deserializer::from(root)).map_err(refused)?;
    if rotor.schema < 2
        && let Some(newer) = newer
    {
        let what = format!("{} does not know {newer}, expected 2", rotor.schema);
        return Err(Error::rotor(file, "schema", what));
    }
    assign_loads(&mut rotor);
    Ok(rotor)
}

/// The first key by which a file states dimensions that become other numbers when it is read.
fn dimensions(root: &DeTable) -> Option<String> {
    const KEYS: [(&str, &[&str]); 2] = [
        ("shaft", &["outer_diameter_right_m", "inner_diameter_right_m"]),
        ("disk", &["width_m", "outer_diameter_m", "inner_diameter_m", "density_kg_m3", "material"]),
    ];
    let found = KEYS.iter().find_map(|(table, keys)| {
        let all = root.get(*table)?.get_ref().as_array()?;
        let has = |key: &&&str| {
            all.iter().any(|one| one.get_ref().as_table().is_some_and(|t| t.contains_key(**key)))
        };
        keys.iter().find(has).map(|key| (table, key))
    });
    found.map(|(table, key)| format!("{key} of a [[{table}]]"))
}

/// Writes a rotor, whole or not at all.
///
/// # Errors
/// If the rotor does not pass the same checks as a file that is read, or the file cannot be written.
pub fn write(path: &Path, rotor: &Rotor) -> Result<(), Error> {
    whole_file::write(path, text(&path.display().to_string(), rotor)?.as_bytes())
}

/// What [`write()`] writes; `file` is only for messages.
///
/// # Errors
/// If the rotor does not pass the same checks as a file that is read.
pub fn text(file: &str, rotor: &Rotor) -> Result<String, Error> {
    let whole = rotor.whole();
    check(file, &whole)?;
    toml::to_string(&whole).map_err(|e| Error::file(file, e))
}

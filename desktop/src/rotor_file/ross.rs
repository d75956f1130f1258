//! Rotors as ROSS writes them: the TOML or JSON of `Rotor.save`, version 2.3.0.
//!
//! A file of ROSS is a table of elements, each under the name of its class and its tag, joined by the numbers of
//! their nodes. Every shaft element becomes a segment, so that a mesh of one element a segment is ROSS's own, and every
//! coupling element a flexible coupling. What has no place in a drawing is not dropped in silence: [`ImportedRotor::left`]
//! lists every value that nothing here reads, by element and key.

mod bearing;
mod element;
mod import;
mod line;
mod section;

use std::path::Path;

use serde_json::{Map, Value};

use crate::error::Error;
use crate::machine::drawing::{Bearing, Coupling, Disk, Mount, Plane, Probe, Rotor};
use crate::rotor_file::validation::{SCHEMA, check};
use crate::units::same_place;
use crate::whole_file;
use element::RossElement;
use import::Import;
use line::ImportedShaft;

/// More planes than this a drawing does not have.
const MOST_PLANES: usize = 8;

/// A rotor that came from ROSS.
#[derive(Debug, Clone)]
pub struct ImportedRotor {
    /// The drawing; it has passed the checks of a file.
    pub rotor: Rotor,
    /// What was taken over, a sentence each.
    pub carried: Vec<String>,
    /// What was not, and what was put in its place.
    pub left: Vec<String>,
}

/// Reads a rotor that ROSS saved.
///
/// # Errors
/// One sentence with the file, the element and what was expected.
pub fn read(path: &Path) -> Result<ImportedRotor, Error> {
    let file = path.display().to_string();
    let text = whole_file::read_drawing(path)?;
    let is_json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    parse(&file, &text, is_json)
}

/// Parses the text of such a file; `file` is for messages and the rotor's name.
///
/// # Errors
/// As [`read`].
pub fn parse(file: &str, text: &str, is_json: bool) -> Result<ImportedRotor, Error> {
    let refused = |what: String| Error::rotor(file, "text", what);
    let all: Map<String, Value> = if is_json {
        serde_json::from_str(text).map_err(|e| refused(format!("cannot be parsed as JSON ({e})")))?
    } else {
        toml::from_str(text).map_err(|e| {
            let line = e.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
            let what = e.message().lines().next().unwrap_or("it has another form").to_string();
            Error::rotor(file, format!("line {line}"), what)
        })?
    };
    if !all.contains_key("ross_version") {
        return Err(Error::rotor(file, "ross_version", "is missing, expected a rotor that ROSS saved"));
    }
    let mut import = Import::new(file);
    let elements: Vec<RossElement> = all
        .iter()
        .filter(|(key, _)| !matches!(key.as_str(), "parameters" | "ross_version") && !key.starts_with('_'))
        .filter_map(|(key, value)| match value.as_object() {
            Some(values) => Some(RossElement { key, class: key.split('_').next().unwrap_or(key), values }),
            None => {
                import.leave(&format!("[{key}]"), "is no element of a rotor");
                None
            }
        })
        .collect();
    let version = all["ross_version"].as_str().unwrap_or("unknown");
    if version != "2.3.0" {
        let what = format!("the file is of {version}; this command reads 2.3.0 and took what it knows");
        import.leave("ross_version", &what);
    }
    for (name, value) in all.get("parameters").and_then(Value::as_object).into_iter().flatten() {
        if !element::is_nothing(value) {
            import.leave(&format!("[parameters] {name}"), "has no counterpart");
        }
    }
    let rotor = import.rotor(&elements)?;
    check(file, &rotor)?;
    Ok(ImportedRotor { rotor, left: import.left(), carried: import.carried })
}

impl Import<'_> {
    fn rotor(&mut self, elements: &[RossElement]) -> Result<Rotor, Error> {
        let ImportedShaft { shaft, coupling, nodes_m, physics } = self.line(elements)?;
        let mut disk = Vec::new();
        for e in elements.iter().filter(|e| e.is_disk()) {
            let found = self.disk(e, &nodes_m)?;
            disk.extend(self.added(e, found, &coupling, &disk));
        }
        if !disk.is_empty() {
            self.carried.push(format!("{} disks", disk.len()));
        }
        let plane = planes(&disk, nodes_m[nodes_m.len() - 1]);
        let masses: Vec<&RossElement> = elements.iter().filter(|e| e.class == "PointMass").collect();
        for e in &masses {
            if self.node(e, "n")? < nodes_m.len() {
                let found = self.point_mass(e, &nodes_m)?;
                disk.extend(self.added(e, found, &coupling, &disk));
            }
        }
        let bearing = self.bearings(elements, &masses, &nodes_m)?;
        for (e, mass_kg) in self.moving_masses(elements, &nodes_m)? {
            let found = self.lump(e, &nodes_m, mass_kg)?;
            disk.extend(self.added(e, found, &coupling, &disk));
        }
        for e in elements.iter().filter(|e| !e.is_known()) {
            self.leave(&e.label(), &format!("an element of class {} has no counterpart", e.class));
        }
        let probe = probes(&bearing);
        self.leave(
            "probes and planes",
            &format!(
                "ROSS has none; {} probes were put at the bearings and {} planes at the disks, set them to where yours are",
                probe.len(),
                plane.len()
            ),
        );
        let stem = Path::new(self.file).file_stem().map(|s| s.to_string_lossy().into_owned());
        Ok(Rotor {
            schema: SCHEMA,
            name: stem.unwrap_or_else(|| "rotor".into()),
            serial: None,
            fastest_rpm: None,
            physics,
            noise: None,
            tolerance: None,
            rated: None,
            foundation: None,
            unused: Vec::new(),
            identify: None,
            shaft,
            coupling,
            disk,
            bearing,
            probe,
            plane,
            run: Vec::new(),
            effect: Vec::new(),
        })
    }

    fn position_m(&self, e: &RossElement, nodes_m: &[f64]) -> Result<f64, Error> {
        let n = self.node(e, "n")?;
        match nodes_m.get(n) {
            Some(z) => Ok(*z),
            None => self.fail(e, "n", format!("is {n}, the shaft has nodes 0 to {}", nodes_m.len() - 1)),
        }
    }

    fn disk(&mut self, e: &RossElement, nodes_m: &[f64]) -> Result<Disk, Error> {
        self.leave_rest(e, &["n", "m", "Id", "Ip"]);
        Ok(Disk {
            name: e.tag().into(),
            position_m: self.position_m(e, nodes_m)?,
            mass_kg: self.number(e, "m")?,
            diametral_inertia_kg_m2: self.number(e, "Id")?,
            polar_inertia_kg_m2: self.number(e, "Ip")?,
        })
    }

    /// A mass without inertias at the node of an element.
    fn lump(&self, e: &RossElement, nodes_m: &[f64], mass_kg: f64) -> Result<Disk, Error> {
        let position_m = self.position_m(e, nodes_m)?;
        let name = e.tag().into();
        Ok(Disk { name, position_m, mass_kg, diametral_inertia_kg_m2: 0.0, polar_inertia_kg_m2: 0.0 })
    }

    fn point_mass(&mut self, e: &RossElement, nodes_m: &[f64]) -> Result<Disk, Error> {
        let [mx, my] = e.mass_along(["mx", "my"]);
        if mx != my {
            let what = format!("is {my}, but mx is {mx}; expected a mass that is the same along x and y");
            return self.fail(e, "my", what);
        }
        self.leave_rest(e, &["n", "m", "mx", "my", "mz"]);
        self.carried.push(format!("point mass \"{}\" as a disk without inertias", e.tag()));
        self.lump(e, nodes_m, mx)
    }

    /// The disk with a name that no other has; `None` at a coupling, whose keys have no place for a disk.
    fn added(
        &mut self,
        e: &RossElement,
        mut found: Disk,
        coupling: &[Coupling],
        disk: &[Disk],
    ) -> Option<Disk> {
        if let Some(c) = coupling.iter().find(|c| same_place(c.position_m, found.position_m)) {
            let what = format!("is at coupling \"{}\"; add it to the coupling's mass", c.name);
            self.leave(&e.label(), &what);
            return None;
        }
        found.name = unique(&found.name, disk.iter().map(|d: &Disk| d.name.as_str()));
        Some(found)
    }
}

/// A name that is not among those taken.
fn unique<'a>(name: &str, taken: impl Iterator<Item = &'a str> + Clone) -> String {
    let mut found = name.to_string();
    let mut number = 2;
    while taken.clone().any(|t| t == found) {
        found = format!("{name} {number}");
        number += 1;
    }
    found
}

fn probes(bearings: &[Bearing]) -> Vec<Probe> {
    let pair = |b: &Bearing| {
        [("X", 0.0), ("Y", 90.0)].map(|(axis, angle_deg)| Probe {
            name: format!("{} {axis}", b.name),
            bearing: b.name.clone(),
            position_m: b.position_m,
            angle_deg,
            used: true,
            mount: Mount::default(),
            gap: None,
        })
    };
    bearings.iter().flat_map(pair).collect()
}

/// At every disk, or at the two outermost where there are many; in the middle of a shaft without disks.
fn planes(disks: &[Disk], length_m: f64) -> Vec<Plane> {
    let plane = |name: &str, position_m| Plane {
        name: name.into(),
        position_m,
        unbalance_g_mm: None,
        angle_deg: None,
    };
    match disks {
        [] => vec![plane("middle", 0.5 * length_m)],
        [first, .., last] if disks.len() > MOST_PLANES => {
            vec![plane(&first.name, first.position_m), plane(&last.name, last.position_m)]
        }
        all => all.iter().map(|d| plane(&d.name, d.position_m)).collect(),
    }
}

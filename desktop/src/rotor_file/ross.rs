//! Rotors as ROSS writes them: the TOML or JSON of `Rotor.save`, version 2.3.0.
//!
//! A file of ROSS is a table of elements, each under the name of its class and its tag, joined by the numbers of
//! their nodes. Every shaft element becomes a segment, so that a mesh of one element a segment is ROSS's own, and every
//! coupling element a flexible coupling. What has no place in a drawing is not dropped in silence: [`ImportedRotor::left`]
//! says it.

mod element;
mod import;
mod line;

use std::path::Path;

use serde_json::{Map, Value};

use crate::bearing::Law;
use crate::bearing::constant::Coefficients;
use crate::bearing::support::Pedestal;
use crate::bearing::table::{CoefficientTable, TableRow};
use crate::error::Error;
use crate::machine::drawing::{Bearing, Disk, Mount, Plane, Probe, Rotor};
use crate::rotor_file::validation::{SCHEMA, check};
use crate::units::rpm;
use element::RossElement;
use import::Import;
use line::ImportedShaft;

/// The coefficients of a bearing element, in the order of a table's columns.
const COLUMNS: [&str; 8] = ["kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"];
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
    let text =
        std::fs::read_to_string(path).map_err(|e| Error::file(&file, format!("cannot be read ({e})")))?;
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
    let mut import = Import { file, carried: Vec::new(), left: Vec::new() };
    let elements: Vec<RossElement> = all
        .iter()
        .filter_map(|(key, value)| {
            let (class, _) = key.split_once('_')?;
            value.as_object().filter(|_| key != "parameters").map(|values| RossElement { key, class, values })
        })
        .collect();
    let version = all["ross_version"].as_str().unwrap_or("unknown");
    if version != "2.3.0" {
        import
            .left
            .push(format!("ross_version: the file is of {version}, this reads 2.3.0 and took what it knows"));
    }
    let rotor = import.rotor(&elements)?;
    check(file, &rotor)?;
    Ok(ImportedRotor { rotor, carried: import.carried, left: import.left })
}

impl Import<'_> {
    fn rotor(&mut self, elements: &[RossElement]) -> Result<Rotor, Error> {
        let of = |class: &str| elements.iter().filter(|e| e.class == class).collect::<Vec<_>>();
        let ImportedShaft { shaft, coupling, nodes_m, physics } = self.line(elements)?;
        let mut disk = Vec::new();
        for e in of("DiskElement") {
            let mut d = self.disk(e, &nodes_m)?;
            if let Some(c) = coupling.iter().find(|c| c.position_m == d.position_m) {
                self.left.push(format!(
                    "[{}]: a disk at coupling \"{}\"; add it to the coupling's mass",
                    e.key, c.name
                ));
                continue;
            }
            d.name = unique(&d.name, disk.iter().map(|d: &Disk| d.name.as_str()));
            disk.push(d);
        }
        if !disk.is_empty() {
            self.carried.push(format!("{} disks", disk.len()));
        }
        let masses = of("PointMass");
        for e in &masses {
            self.node(e, "n")?;
        }
        let holding: Vec<&RossElement> = elements.iter().filter(|e| e.is_bearing()).collect();
        let mut bearing: Vec<Bearing> = Vec::new();
        let on_shaft: Vec<&RossElement> = holding
            .iter()
            .copied()
            .filter(|e| e.values["n"].as_u64().is_none_or(|n| (n as usize) < nodes_m.len()))
            .collect();
        for e in &on_shaft {
            let mut b = self.bearing(e, &nodes_m)?;
            b.pedestal = self.pedestal(e, &holding, &masses)?;
            b.name = unique(&b.name, bearing.iter().map(|b: &Bearing| b.name.as_str()));
            bearing.push(b);
        }
        bearing.sort_by(|a, b| a.position_m.total_cmp(&b.position_m));
        for e in elements {
            if !matches!(e.class, "ShaftElement" | "CouplingElement" | "DiskElement" | "PointMass")
                && !e.is_bearing()
            {
                self.left.push(format!("[{}]: a {} has no counterpart", e.key, e.class));
            }
        }
        let on_shaft =
            |e: &&&RossElement| e.values["n"].as_u64().is_some_and(|n| (n as usize) < nodes_m.len());
        for e in masses.iter().filter(on_shaft) {
            self.left.push(format!("[{}]: a mass on the shaft itself; draw it as a disk", e.key));
        }
        let probe = probes(&bearing);
        let plane = planes(&disk, nodes_m[nodes_m.len() - 1]);
        self.left.push(format!(
            "ROSS has no probes and no planes: {} probes were put at the bearings and {} planes at the disks; set them \
             to where yours are",
            probe.len(),
            plane.len()
        ));
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

    fn disk(&self, e: &RossElement, nodes_m: &[f64]) -> Result<Disk, Error> {
        Ok(Disk {
            name: e.tag().into(),
            position_m: self.position_m(e, nodes_m)?,
            mass_kg: self.number(e, "m")?,
            diametral_inertia_kg_m2: self.number(e, "Id")?,
            polar_inertia_kg_m2: self.number(e, "Ip")?,
        })
    }

    fn bearing(&mut self, e: &RossElement, nodes_m: &[f64]) -> Result<Bearing, Error> {
        let position_m = self.position_m(e, nodes_m)?;
        let mut columns = Vec::with_capacity(COLUMNS.len());
        for name in COLUMNS {
            columns.push(match (e.list(name), e.values.get(name)) {
                (Some(list), _) if !list.is_empty() => list,
                (None, None) => vec![0.0],
                _ => return self.fail(e, name, "is not a number or a list of numbers"),
            });
        }
        for name in ["mxx", "mxy", "myx", "myy"] {
            if e.list(name).is_some_and(|l| l.iter().any(|v| *v != 0.0)) {
                self.left.push(format!("[{}] {name}: the added mass of a bearing has no counterpart", e.key));
            }
        }
        let speeds = e.list("frequency").filter(|s| s.len() > 1);
        let at = |i: usize| -> [f64; 8] {
            std::array::from_fn(|c| columns[c].get(i).or(columns[c].first()).copied().unwrap_or(0.0))
        };
        let what = if e.class.contains("Seal") { "seal" } else { "bearing" };
        let law = match &speeds {
            Some(speeds) => {
                if let Some(c) = columns.iter().position(|l| l.len() != 1 && l.len() != speeds.len()) {
                    let what = format!("has {} values for {} speeds", columns[c].len(), speeds.len());
                    return self.fail(e, COLUMNS[c], what);
                }
                let row = |(i, speed): (usize, &f64)| {
                    let [kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy] = at(i);
                    TableRow { speed_rpm: rpm(*speed), kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy }
                };
                let rows: Vec<TableRow> = speeds.iter().enumerate().map(row).collect();
                self.carried.push(format!("{what} \"{}\" with its table of {} speeds", e.tag(), rows.len()));
                match CoefficientTable::new(rows) {
                    Ok(table) => Law::Table(table),
                    Err(what) => return self.fail(e, "frequency", what),
                }
            }
            None => {
                self.carried.push(format!("{what} \"{}\" with its constant coefficients", e.tag()));
                let [kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy] = at(0);
                let four = |xx, xy, yx, yy| Coefficients { xx, yy, xy, yx };
                let (k, c) = (four(kxx, kxy, kyx, kyy), four(cxx, cxy, cyx, cyy));
                Bearing::constant("", 0.0, k, c).law
            }
        };
        if what == "seal" {
            self.left
                .push(format!("[{}]: a seal is drawn as a bearing, so the static loads count on it", e.key));
        }
        Ok(Bearing::by(e.tag(), position_m, law))
    }

    /// What a bearing that is linked to a node off the shaft stands on.
    fn pedestal(
        &mut self,
        e: &RossElement,
        holding: &[&RossElement],
        masses: &[&RossElement],
    ) -> Result<Option<Pedestal>, Error> {
        if e.values.get("n_link").is_none_or(Value::is_null) {
            return Ok(None);
        }
        let link = self.node(e, "n_link")?;
        let is_there =
            |other: &&&RossElement| other.values.get("n").and_then(Value::as_u64) == Some(link as u64);
        let Some(support) = holding.iter().find(is_there) else {
            return self.fail(e, "n_link", format!("is {link}, but nothing holds that node"));
        };
        let of = |name: &str| support.list(name).and_then(|l| l.first().copied()).unwrap_or(0.0);
        let cross = ["kxy", "kyx", "cxy", "cyx"].iter().any(|name| of(name) != 0.0);
        if cross || support.list("kxx").is_some_and(|l| l.len() > 1) {
            self.left.push(format!(
                "[{}]: a pedestal has constant direct coefficients only; the rest was left",
                support.key
            ));
        }
        let mass = masses.iter().find(is_there);
        let along = |name: &str| mass.and_then(|m| m.maybe(name).or(m.maybe("m"))).unwrap_or(0.0);
        self.carried.push(format!("pedestal \"{}\" under bearing \"{}\"", support.tag(), e.tag()));
        Ok(Some(Pedestal {
            stiffness_n_m: [of("kxx"), of("kyy")],
            damping_n_s_m: [of("cxx"), of("cyy")],
            mass_kg: [along("mx"), along("my")],
        }))
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

//! Bearings and seals, what they stand on, and the mass that moves with them.

use serde_json::Value;

use super::element::RossElement;
use super::import::Import;
use super::unique;
use crate::bearing::Law;
use crate::bearing::constant::Coefficients;
use crate::bearing::magnetic::Magnetic;
use crate::bearing::support::Pedestal;
use crate::bearing::table::{CoefficientTable, TableRow};
use crate::error::Error;
use crate::machine::drawing::Bearing;
use crate::units::rpm;

/// The coefficients of a bearing element, in the order of a table's columns.
const COLUMNS: [&str; 8] = ["kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"];
/// What versions and classes of ROSS call the speeds of a table, rad/s.
const AXES: [&str; 2] = ["frequency", "speed"];
/// Added masses of a bearing element.
const MASSES: [&str; 4] = ["mxx", "mxy", "myx", "myy"];
/// Softest direct spring that a bearing with constant coefficients has, N/m; see [`crate::bearing::constant`].
const SOFTEST_N_M: f64 = 1.0;
/// Speeds between which coefficients that hold at every speed stand in a table, rpm.
const EVERY_SPEED_RPM: [f64; 2] = [0.0, 1e6];

/// Coefficients over speed.
struct Coefs {
    /// In the order of [`COLUMNS`], each of one value or of one a speed.
    columns: Vec<Vec<f64>>,
    /// Name of the axis and its speeds, rad/s, where the file states any.
    axis: Option<(&'static str, Vec<f64>)>,
}

impl Coefs {
    fn at(&self, i: usize) -> [f64; 8] {
        std::array::from_fn(|c| self.columns[c].get(i).unwrap_or(&self.columns[c][0]).to_owned())
    }

    /// The table of several speeds, if there is one.
    fn table(&self) -> Option<(&'static str, &[f64])> {
        self.axis.as_ref().filter(|(_, speeds)| speeds.len() > 1).map(|(name, speeds)| (*name, &speeds[..]))
    }
}

impl Import<'_> {
    pub(super) fn bearings(
        &mut self,
        elements: &[RossElement],
        masses: &[&RossElement],
        nodes_m: &[f64],
    ) -> Result<Vec<Bearing>, Error> {
        let holding: Vec<&RossElement> = elements.iter().filter(|e| e.is_bearing()).collect();
        let mut bearing: Vec<Bearing> = Vec::new();
        let mut linked = Vec::new();
        for e in &holding {
            if self.node(e, "n")? >= nodes_m.len() {
                continue;
            }
            let mut b = self.bearing(e, nodes_m)?;
            if let Some(link) = self.link(e, nodes_m)? {
                if linked.contains(&link) {
                    let what = format!(
                        "is {link}, on which another bearing stands too; draw both on a [foundation]"
                    );
                    return self.fail(e, "n_link", what);
                }
                linked.push(link);
                b.pedestal = Some(self.pedestal(e, link, &holding, masses)?);
            }
            b.name = unique(&b.name, bearing.iter().map(|b: &Bearing| b.name.as_str()));
            bearing.push(b);
        }
        for e in holding.iter().chain(masses) {
            let n = self.node(e, "n")?;
            if n >= nodes_m.len() && !linked.contains(&n) {
                self.leave(&e.label(), "stands on a node that nothing joins to the shaft");
            }
        }
        bearing.sort_by(|a, b| a.position_m.total_cmp(&b.position_m));
        Ok(bearing)
    }

    /// The node off the shaft that a bearing stands on; none for the ground.
    fn link(&self, e: &RossElement, nodes_m: &[f64]) -> Result<Option<usize>, Error> {
        if e.values.get("n_link").is_none_or(Value::is_null) {
            return Ok(None);
        }
        let link = self.node(e, "n_link")?;
        if link < nodes_m.len() {
            let what = format!(
                "is {link}, a node of a shaft; a bearing between two shafts is not read, expected one shaft"
            );
            return self.fail(e, "n_link", what);
        }
        Ok(Some(link))
    }

    /// The coefficients that an element states, with the axis that belongs to them.
    fn coefs(&self, e: &RossElement) -> Result<Coefs, Error> {
        let mut columns = Vec::with_capacity(COLUMNS.len());
        for name in COLUMNS {
            // ROSS takes the direct coefficient along x where the one along y is not stated
            let alike = match name {
                "kyy" => "kxx",
                "cyy" => "cxx",
                other => other,
            };
            let stated = [name, alike].into_iter().find(|n| e.values.get(*n).is_some_and(|v| !v.is_null()));
            columns.push(match stated.map(|n| e.list(n)) {
                None if matches!(name, "kxx" | "cxx") => {
                    return self.fail(e, name, "is missing or not a number");
                }
                None => vec![0.0],
                Some(Some(list)) if !list.is_empty() && list.iter().all(|v| v.is_finite()) => list,
                _ => return self.fail(e, name, "is not a number or a list of numbers, one a speed"),
            });
        }
        let longest = columns.iter().map(Vec::len).max().unwrap_or(1);
        let mut axis: Option<(&'static str, Vec<f64>)> = None;
        for name in AXES {
            let Some(speeds) = e.values.get(name).filter(|v| !v.is_null()) else { continue };
            let Some(speeds) = e.list(name).filter(|s| !s.is_empty()) else {
                return self.fail(
                    e,
                    name,
                    format!("is {}, expected a list of speeds in rad/s", kind(speeds)),
                );
            };
            match &axis {
                Some((other, first)) if *first != speeds => {
                    let what = format!("and {other} differ; coefficients over both have no counterpart");
                    return self.fail(e, name, what);
                }
                _ => axis = Some((name, speeds)),
            }
        }
        let speeds = axis.as_ref().map_or(1, |(_, speeds)| speeds.len());
        if longest > 1 && axis.is_none() {
            let what = format!("is missing, expected the {longest} speeds of the table in rad/s");
            return self.fail(e, "frequency", what);
        }
        if let Some(c) = columns.iter().position(|l| l.len() != 1 && l.len() != speeds) {
            let what = format!("has {} values for {speeds} speeds", columns[c].len());
            return self.fail(e, COLUMNS[c], what);
        }
        Ok(Coefs { columns, axis })
    }

    fn bearing(&mut self, e: &RossElement, nodes_m: &[f64]) -> Result<Bearing, Error> {
        let position_m = self.position_m(e, nodes_m)?;
        let coefs = self.coefs(e)?;
        let what = if e.class.contains("Seal") { "seal" } else { "bearing" };
        let law = match coefs.table() {
            Some((axis, speeds)) => {
                let row = |(i, speed): (usize, &f64)| table_row(rpm(*speed), coefs.at(i));
                let rows: Vec<TableRow> = speeds.iter().enumerate().map(row).collect();
                self.carried.push(format!("{what} \"{}\" with its table of {} speeds", e.tag(), rows.len()));
                let ends = [rows[0].speed_rpm, rows[rows.len() - 1].speed_rpm];
                match CoefficientTable::new(rows) {
                    Ok(table) => {
                        let [low, high] = ends.map(|end| format!("{end:.0}"));
                        let what = format!(
                            "outside {low} to {high} rpm the nearest row of the table holds, where ROSS extrapolates"
                        );
                        self.leave(&e.label(), &what);
                        Law::Table(table)
                    }
                    Err(what) => return self.fail(e, axis, what),
                }
            }
            None => self.constant(e, what, &coefs),
        };
        if what == "seal" {
            self.leave(&e.label(), "a seal is drawn as a bearing, so the static loads count on it");
        }
        let taken = [&COLUMNS[..], &MASSES, &AXES, &["n", "n_link"]].concat();
        self.leave_rest(e, &taken);
        Ok(Bearing::by(e.tag(), position_m, law))
    }

    /// The law of coefficients that hold at every speed, as far as the file says.
    fn constant(&mut self, e: &RossElement, what: &str, coefs: &Coefs) -> Law {
        if let Some((axis, speeds)) = &coefs.axis {
            let what =
                format!("states {:.0} rpm alone; its coefficients are taken at every speed", rpm(speeds[0]));
            self.leave(&format!("{} {axis}", e.label()), &what);
        }
        let all = coefs.at(0);
        let [kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy] = all;
        if kxx.min(kyy) >= SOFTEST_N_M {
            self.carried.push(format!("{what} \"{}\" with its constant coefficients", e.tag()));
            let four = |xx, xy, yx, yy| Coefficients { xx, yy, xy, yx };
            return Bearing::constant("", 0.0, four(kxx, kxy, kyx, kyy), four(cxx, cxy, cyx, cyy)).law;
        }
        if kxx == kyy && cxx == cyy && [kxy, kyx, cxy, cyx] == [0.0; 4] {
            self.carried.push(format!("{what} \"{}\" as a magnetic support", e.tag()));
            return Law::Magnetic(Magnetic { stiffness_n_m: kxx, damping_n_s_m: cxx });
        }
        self.carried.push(format!("{what} \"{}\" with its constant coefficients, as a table", e.tag()));
        let rows = EVERY_SPEED_RPM.map(|speed| table_row(speed, all)).to_vec();
        Law::Table(CoefficientTable::new(rows).expect("two speeds that ascend"))
    }

    /// What a bearing that is linked to a node off the shaft stands on.
    fn pedestal(
        &mut self,
        e: &RossElement,
        link: usize,
        holding: &[&RossElement],
        masses: &[&RossElement],
    ) -> Result<Pedestal, Error> {
        let is_there =
            |other: &&&RossElement| other.values.get("n").and_then(Value::as_u64) == Some(link as u64);
        let mut supports = holding.iter().filter(is_there);
        let Some(support) = supports.next() else {
            return self.fail(e, "n_link", format!("is {link}, but nothing holds that node"));
        };
        if supports.next().is_some() {
            return self.fail(e, "n_link", format!("is {link}, which several elements hold; expected one"));
        }
        if support.values.get("n_link").is_some_and(|v| !v.is_null()) {
            return self.fail(support, "n_link", "is a second support in series, expected the ground");
        }
        let coefs = self.coefs(support)?;
        if let Some(c) = coefs.columns.iter().position(|l| l.iter().any(|v| *v != l[0])) {
            let what = "follows the speed, but a pedestal has constant coefficients; expected one value";
            return self.fail(support, COLUMNS[c], what);
        }
        let [kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy] = coefs.at(0);
        if [kxy, kyx, cxy, cyx] != [0.0; 4] {
            self.leave(
                &support.label(),
                "a pedestal has direct coefficients only; the cross-coupled ones were left",
            );
        }
        self.leave_rest(support, &[&COLUMNS[..], &AXES, &["n", "n_link"]].concat());
        let mut mass_kg = [0.0; 2];
        for mass in masses.iter().filter(is_there) {
            self.leave_rest(mass, &["n", "m", "mx", "my", "mz"]);
            let [mx, my] = mass.mass_along(["mx", "my"]);
            mass_kg = [mass_kg[0] + mx, mass_kg[1] + my];
        }
        self.carried.push(format!("pedestal \"{}\" under bearing \"{}\"", support.tag(), e.tag()));
        Ok(Pedestal { stiffness_n_m: [kxx, kyy], damping_n_s_m: [cxx, cyy], mass_kg })
    }

    /// Elements whose added mass moves with the shaft as a point mass does, and that mass, kg. Any other is listed.
    pub(super) fn moving_masses<'e>(
        &mut self,
        elements: &'e [RossElement<'e>],
        nodes_m: &[f64],
    ) -> Result<Vec<(&'e RossElement<'e>, f64)>, Error> {
        let mut all = Vec::new();
        for e in elements.iter().filter(|e| e.is_bearing()) {
            let of = |name: &str| e.list(name).unwrap_or_default();
            if self.node(e, "n")? >= nodes_m.len() || MASSES.iter().all(|m| of(m).iter().all(|v| *v == 0.0)) {
                continue;
            }
            let [mxx, mxy, myx, myy] = MASSES.map(of);
            let crosses = mxy.iter().chain(&myx).any(|v| *v != 0.0);
            let mass = mxx.first().copied().unwrap_or(0.0);
            let is_point = !crosses && mass > 0.0 && mxx.iter().chain(&myy).all(|v| *v == mass);
            if is_point && e.values.get("n_link").is_none_or(Value::is_null) {
                self.carried.push(format!("the added mass of \"{}\", as a disk without inertias", e.tag()));
                all.push((e, mass));
            } else {
                let place = format!("{} mxx, mxy, myx, myy", e.label());
                self.leave(
                    &place,
                    "an added mass that follows speed, direction or a pedestal has no counterpart",
                );
            }
        }
        Ok(all)
    }
}

fn table_row(speed_rpm: f64, [kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy]: [f64; 8]) -> TableRow {
    TableRow { speed_rpm, kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy }
}

/// What kind of value a file has where a list is expected.
fn kind(value: &Value) -> &'static str {
    match value {
        Value::Array(_) => "a list with values that are no numbers",
        Value::String(_) => "a text",
        _ => "no list",
    }
}

//! The line of shaft and coupling elements, one after the other.

use std::collections::BTreeMap;

use serde_json::Value;

use super::element::{RossElement, is_nothing};
use super::import::Import;
use super::section::equivalent;
use crate::error::Error;
use crate::machine::drawing::{Coupling, Flexibility, Physics, Segment};
use crate::machine::taper::{middle, steps};
use crate::units::SAME_NODE_M;

/// Keys of a shaft element that are read, or listed with a reason of their own.
const SEGMENT: [&str; 15] = [
    "L",
    "idl",
    "odl",
    "idr",
    "odr",
    "n",
    "material",
    "shear_effects",
    "rotary_inertia",
    "gyroscopic",
    "shear_method_calc",
    "axial_force",
    "alpha",
    "beta",
    "phi",
];
/// Keys of a material that are read, or name it.
const MATERIAL: [&str; 6] = ["name", "rho", "E", "G_s", "Poisson", "color"];
/// Keys of a coupling element that are read, or listed with a reason of their own; `o_d` is drawn.
const COUPLED: [&str; 15] = [
    "n", "m_l", "m_r", "Ip_l", "Ip_r", "Id_l", "Id_r", "kt_x", "kt_y", "kr_x", "kr_y", "kt_z", "kr_z", "L",
    "o_d",
];
const DAMPING: [&str; 6] = ["ct_x", "ct_y", "ct_z", "cr_x", "cr_y", "cr_z"];

/// The shaft of a drawing.
pub struct ImportedShaft {
    /// One segment a shaft element.
    pub shaft: Vec<Segment>,
    /// One a coupling element.
    pub coupling: Vec<Coupling>,
    /// Place of each of ROSS's nodes, m; the two of a coupling are at one place.
    pub nodes_m: Vec<f64>,
    /// Switches of the beam theory.
    pub physics: Physics,
}

impl Import<'_> {
    pub(super) fn line(&mut self, all: &[RossElement]) -> Result<ImportedShaft, Error> {
        let mut at_node: BTreeMap<usize, Vec<&RossElement>> = BTreeMap::new();
        for e in all.iter().filter(|e| e.is_line()) {
            at_node.entry(self.node(e, "n")?).or_default().push(e);
        }
        let of_shaft: Vec<&RossElement> =
            at_node.values().flatten().copied().filter(|e| e.class == "ShaftElement").collect();
        let Some(first) = of_shaft.first() else {
            return Err(Error::rotor(self.file, "[ShaftElement_…]", "there is none, expected a shaft"));
        };
        let flags = |name: &str| of_shaft.iter().all(|e| e.flag(name) == first.flag(name));
        for name in ["shear_effects", "rotary_inertia", "gyroscopic"] {
            if !flags(name) {
                let what = format!(
                    "differs between shaft elements; all were taken as the first, {}",
                    first.flag(name)
                );
                self.leave(name, &what);
            }
        }
        let physics = Physics {
            gyroscopic: first.flag("gyroscopic"),
            rotary_inertia: first.flag("rotary_inertia"),
            shear_deformation: first.flag("shear_effects"),
            ..Physics::default()
        };
        let mut line = ImportedShaft { shaft: Vec::new(), coupling: Vec::new(), nodes_m: vec![0.0], physics };
        let (mut end_m, mut layered) = (0.0, 0);
        for (i, (n, here)) in at_node.iter().enumerate() {
            let e = here[0];
            if *n == i + 1 && i > 0 {
                let what = format!(
                    "is {n}, where a second shaft begins; coaxial and geared rotors are not read, expected one shaft"
                );
                return self.fail(e, "n", what);
            }
            if *n != i {
                let what = format!(
                    "is {n}, expected {i}: one element after the other, each from its node to the next"
                );
                return self.fail(e, "n", what);
            }
            if let Some(joint) = here.iter().find(|e| e.class == "CouplingElement") {
                if here.len() > 1 {
                    return self.fail(
                        joint,
                        "n",
                        format!("is {n}, where another element is too; expected one"),
                    );
                }
                line.coupling.push(self.coupling(joint, end_m)?);
            } else {
                layered += usize::from(here.len() > 1);
                let pieces = self.piece(here, &line.physics)?;
                end_m += pieces.iter().map(|s| s.length_m).sum::<f64>();
                line.shaft.extend(pieces);
            }
            line.nodes_m.push(end_m);
        }
        self.carried.push(format!("{} shaft elements, as {} segments", of_shaft.len(), line.shaft.len()));
        if layered > 0 {
            self.carried.push(format!(
                "layers between {layered} pairs of nodes, each as one section with their bending, shear and mass"
            ));
        }
        Ok(line)
    }

    /// The segments from one node to the next: one of a cylinder, several of a cone; of layers the equivalent of all.
    fn piece(&mut self, layers: &[&RossElement], physics: &Physics) -> Result<Vec<Segment>, Error> {
        let length_m = self.number(layers[0], "L")?;
        let mut all = Vec::with_capacity(layers.len());
        let mut diameters_m = Vec::new();
        for e in layers {
            let own = self.number(e, "L")?;
            if (own - length_m).abs() > SAME_NODE_M {
                let what = format!(
                    "is {own} m, but another layer from this node is {length_m} m long; expected one length"
                );
                return self.fail(e, "L", what);
            }
            let [idl, odl] = [self.number(e, "idl")?, self.number(e, "odl")?];
            let ends = [[odl, e.maybe("odr").unwrap_or(odl)], [idl, e.maybe("idr").unwrap_or(idl)]];
            diameters_m.extend(ends);
            all.push((self.segment(e, length_m)?, ends));
        }
        let count = steps(&diameters_m);
        if count > 1 {
            self.carried.push(format!("the cone \"{}\", in {count} steps", layers[0].tag()));
        }
        let mut pieces = Vec::with_capacity(count);
        for i in 0..count {
            let cylinder = |(segment, [outer, inner]): &(Segment, [[f64; 2]; 2])| Segment {
                length_m: length_m / count as f64,
                outer_diameter_m: middle(*outer, i, count),
                inner_diameter_m: middle(*inner, i, count),
                ..*segment
            };
            let cylinders: Vec<Segment> = all.iter().map(cylinder).collect();
            pieces.push(equivalent(&cylinders, physics));
        }
        Ok(pieces)
    }

    fn coupling(&mut self, e: &RossElement, position_m: f64) -> Result<Coupling, Error> {
        let of = |name: &str| e.maybe(name).unwrap_or(0.0);
        let alike = |import: &mut Self, [a, b]: [&str; 2]| {
            if of(a) != of(b) {
                let place = format!("{} {a} and {b}", e.label());
                import.leave(&place, "a coupling is alike in x and y; their mean was taken");
            }
            0.5 * (of(a) + of(b))
        };
        let lateral_stiffness_n_m = alike(self, ["kt_x", "kt_y"]);
        let angular_stiffness_n_m_rad = alike(self, ["kr_x", "kr_y"]);
        if [["m_l", "m_r"], ["Ip_l", "Ip_r"], ["Id_l", "Id_r"]].iter().any(|[l, r]| of(l) != of(r)) {
            self.leave(&e.label(), "halves that differ; half of the sum was put on either side");
        }
        if of("L") != 0.0 {
            let what = format!(
                "a coupling has no length here, as in ROSS's matrices; what is right of it stands {} m further left",
                of("L")
            );
            self.leave(&format!("{} L", e.label()), &what);
        }
        if ["kt_z", "kr_z"].iter().any(|name| of(name) != 0.0) {
            let place = format!("{} kt_z, kr_z", e.label());
            self.leave(&place, "axial and torsional stiffness have no counterpart");
        }
        if DAMPING.iter().any(|name| of(name) != 0.0) {
            self.leave(&e.label(), "the damping of a coupling has no counterpart");
        }
        self.leave_rest(e, &[&COUPLED[..], &DAMPING].concat());
        for (name, value) in [("kt_x", lateral_stiffness_n_m), ("kr_x", angular_stiffness_n_m_rad)] {
            if value <= 0.0 {
                return self.fail(
                    e,
                    name,
                    format!("is {value}, expected a stiffness that joins the two shafts"),
                );
            }
        }
        self.carried.push(format!("coupling \"{}\"", e.tag()));
        Ok(Coupling {
            name: e.tag().into(),
            position_m,
            flexibility: Some(Flexibility { lateral_stiffness_n_m, angular_stiffness_n_m_rad }),
            mass_kg: of("m_l") + of("m_r"),
            diametral_inertia_kg_m2: of("Id_l") + of("Id_r"),
            polar_inertia_kg_m2: of("Ip_l") + of("Ip_r"),
        })
    }

    fn segment(&mut self, e: &RossElement, length_m: f64) -> Result<Segment, Error> {
        let Some(material) = e.values.get("material").and_then(Value::as_object) else {
            return self.fail(e, "material", "is missing, expected a table with rho, E and G_s");
        };
        let of = |name: &str| match material.get(name).and_then(Value::as_f64) {
            Some(value) => Ok(value),
            None => self.fail(e, &format!("material.{name}"), "is missing or not a number"),
        };
        let (density_kg_m3, youngs_modulus_pa, shear_pa) = (of("rho")?, of("E")?, of("G_s")?);
        if ["alpha", "beta"].iter().any(|name| e.maybe(name).is_some_and(|v| v != 0.0)) {
            self.leave(
                &format!("{} alpha, beta", e.label()),
                "the damping of shaft elements has no counterpart, so log decrements are lower",
            );
        }
        let poisson_ratio = youngs_modulus_pa / (2.0 * shear_pa) - 1.0;
        let mean = |left: &str, right: &str| {
            let at_left = e.maybe(left).unwrap_or(0.0);
            0.5 * (at_left + e.maybe(right).unwrap_or(at_left))
        };
        let shear_coefficient = match e.values.get("shear_method_calc").and_then(Value::as_str) {
            None | Some("cowper") => None,
            Some("hutchinson") => Some(hutchinson(poisson_ratio, mean("idl", "idr") / mean("odl", "odr"))),
            Some(other) => {
                let what = format!("is \"{other}\", expected cowper or hutchinson");
                return self.fail(e, "shear_method_calc", what);
            }
        };
        self.leave_rest(e, &SEGMENT);
        let rest =
            material.iter().filter(|(name, value)| !MATERIAL.contains(&name.as_str()) && !is_nothing(value));
        for (name, _) in rest {
            self.leave(&format!("{} material.{name}", e.label()), "has no counterpart");
        }
        Ok(Segment {
            length_m,
            outer_diameter_m: self.number(e, "odl")?,
            inner_diameter_m: self.number(e, "idl")?,
            youngs_modulus_pa,
            density_kg_m3,
            poisson_ratio,
            shear_coefficient,
            axial_force_n: e.maybe("axial_force").unwrap_or(0.0),
        })
    }
}

/// Shear coefficient of a round, possibly hollow, section after Hutchinson (2001), as ROSS writes it.
fn hutchinson(poisson: f64, bore_ratio: f64) -> f64 {
    let m2 = bore_ratio * bore_ratio;
    let open = (1.0 + m2).powi(2);
    let solid = 7.0 + 12.0 * poisson + 4.0 * poisson * poisson;
    let hollow = 4.0 * (5.0 + 6.0 * poisson + 2.0 * poisson * poisson);
    6.0 * (1.0 + poisson) * open / (solid * open + hollow * m2)
}

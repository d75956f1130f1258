//! The line of shaft and coupling elements, one after the other.

use serde_json::Value;

use super::element::RossElement;
use super::import::Import;
use crate::error::Error;
use crate::machine::drawing::{Coupling, Flexibility, Physics, Segment};

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
        let mut elements: Vec<&RossElement> =
            all.iter().filter(|e| matches!(e.class, "ShaftElement" | "CouplingElement")).collect();
        for e in &elements {
            self.node(e, "n")?;
        }
        elements.sort_by_key(|e| e.values["n"].as_u64());
        let of_shaft: Vec<&RossElement> =
            elements.iter().copied().filter(|e| e.class == "ShaftElement").collect();
        let Some(first) = of_shaft.first() else {
            return Err(Error::rotor(self.file, "[ShaftElement_…]", "there is none, expected a shaft"));
        };
        let flags = |name: &str| of_shaft.iter().all(|e| e.flag(name) == first.flag(name));
        for name in ["shear_effects", "rotary_inertia", "gyroscopic"] {
            if !flags(name) {
                self.left.push(format!(
                    "{name} differs between shaft elements; all were taken as the first, {}",
                    first.flag(name)
                ));
            }
        }
        let physics = Physics {
            gyroscopic: first.flag("gyroscopic"),
            rotary_inertia: first.flag("rotary_inertia"),
            shear_deformation: first.flag("shear_effects"),
            ..Physics::default()
        };
        let mut line = ImportedShaft { shaft: Vec::new(), coupling: Vec::new(), nodes_m: vec![0.0], physics };
        let mut end_m = 0.0;
        for (i, e) in elements.iter().enumerate() {
            let n = self.node(e, "n")?;
            if n != i {
                let what = format!(
                    "is {n}, expected {i}: one element after the other, each from its node to the next"
                );
                return self.fail(e, "n", what);
            }
            if e.class == "CouplingElement" {
                line.coupling.push(self.coupling(e, end_m)?);
            } else {
                let segment = self.segment(e)?;
                end_m += segment.length_m;
                line.shaft.push(segment);
            }
            line.nodes_m.push(end_m);
        }
        self.carried.push(format!("{} shaft elements, a segment each", line.shaft.len()));
        Ok(line)
    }

    fn coupling(&mut self, e: &RossElement, position_m: f64) -> Result<Coupling, Error> {
        let of = |name: &str| e.maybe(name).unwrap_or(0.0);
        let left = &mut self.left;
        let mut alike = |[a, b]: [&str; 2]| {
            if of(a) != of(b) {
                left.push(format!(
                    "[{}] {a} and {b}: a coupling is alike in x and y; their mean was taken",
                    e.key
                ));
            }
            0.5 * (of(a) + of(b))
        };
        let (lateral_stiffness_n_m, angular_stiffness_n_m_rad) =
            (alike(["kt_x", "kt_y"]), alike(["kr_x", "kr_y"]));
        if [["m_l", "m_r"], ["Ip_l", "Ip_r"], ["Id_l", "Id_r"]].iter().any(|[l, r]| of(l) != of(r)) {
            self.left
                .push(format!("[{}]: halves that differ; half of the sum was put on either side", e.key));
        }
        if of("L") != 0.0 {
            self.left.push(format!(
                "[{}] L: a coupling has no length here, as in ROSS's matrices; what is right of it stands {} m further left",
                e.key,
                of("L")
            ));
        }
        if ["kt_z", "kr_z"].iter().any(|name| of(name) != 0.0) {
            self.left
                .push(format!("[{}] kt_z, kr_z: axial and torsional stiffness have no counterpart", e.key));
        }
        if ["ct_x", "ct_y", "ct_z", "cr_x", "cr_y", "cr_z"].iter().any(|name| of(name) != 0.0) {
            self.left.push(format!("[{}]: the damping of a coupling has no counterpart", e.key));
        }
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

    fn segment(&mut self, e: &RossElement) -> Result<Segment, Error> {
        let Some(material) = e.values.get("material").and_then(Value::as_object) else {
            return self.fail(e, "material", "is missing, expected a table with rho, E and G_s");
        };
        let of = |name: &str| match material.get(name).and_then(Value::as_f64) {
            Some(value) => Ok(value),
            None => self.fail(e, &format!("material.{name}"), "is missing or not a number"),
        };
        let (density_kg_m3, youngs_modulus_pa, shear_pa) = (of("rho")?, of("E")?, of("G_s")?);
        let [idl, odl] = [self.number(e, "idl")?, self.number(e, "odl")?];
        let [idr, odr] = [e.maybe("idr").unwrap_or(idl), e.maybe("odr").unwrap_or(odl)];
        if idl != idr || odl != odr {
            self.left.push(format!("[{}]: a cone; its mean diameters were taken", e.key));
        }
        for name in ["axial_force", "torque", "alpha", "beta"] {
            if e.maybe(name).is_some_and(|v| v != 0.0) {
                self.left.push(format!("[{}] {name}: has no counterpart", e.key));
            }
        }
        if e.values.get("shear_method_calc").and_then(Value::as_str).is_some_and(|m| m != "cowper") {
            self.left.push(format!("[{}] shear_method_calc: Cowper's coefficient is used", e.key));
        }
        Ok(Segment {
            length_m: self.number(e, "L")?,
            outer_diameter_m: 0.5 * (odl + odr),
            inner_diameter_m: 0.5 * (idl + idr),
            youngs_modulus_pa,
            density_kg_m3,
            poisson_ratio: youngs_modulus_pa / (2.0 * shear_pa) - 1.0,
        })
    }
}

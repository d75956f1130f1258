//! What a machine must satisfy, whether it was read or built in code.

mod couplings;
mod foundation;

use crate::bearing::Law;
use crate::bearing::law::STIFFEST_N_M;
use crate::effects::{entry, physical};
use crate::error::Error;
use crate::machine::drawing::{BasisKind, EffectEntry, Rated, Rotor, Tolerance};
use crate::machine::tolerance::Deviation;
use crate::measurement::LOWEST_GAP_V;
use crate::rotor_file::materials::Material;
use crate::statistics::scatter::{MOST_BETWEEN_RUNS, MOST_CORRELATED};
use crate::units::same_place;

/// The newest layout of `rotor.toml`; older ones are read as well.
pub const SCHEMA: u32 = 2;

/// Most that a bearing's damping may be, stated or sought.
const MOST_DAMPING_N_S_M: f64 = 1e10;
/// Most bearings of one shaft, with the seals that are drawn as bearings.
const MOST_BEARINGS: usize = 16;
/// Most planes in which unbalance is sought.
const MOST_PLANES: usize = 8;

impl Rotor {
    /// Checks a machine that was made in code as a file is checked when it is read.
    ///
    /// # Errors
    /// One sentence with the key, the number and what was expected.
    pub fn validate(&self) -> Result<(), Error> {
        check(&self.name, self)
    }
}

struct Checker<'a> {
    file: &'a str,
}

impl Checker<'_> {
    fn fail<T>(&self, key: impl Into<String>, expected: impl Into<String>) -> Result<T, Error> {
        Err(Error::rotor(self.file, key, expected))
    }

    fn within(&self, key: &str, value: f64, low: f64, high: f64, unit: &str) -> Result<(), Error> {
        if value.is_finite() && (low..=high).contains(&value) {
            return Ok(());
        }
        let plain = |x: f64| {
            if x == 0.0 || (1e-4..1e6).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") }
        };
        self.fail(key, format!("{value} is outside {} to {} {unit}", plain(low), plain(high)).trim_end())
    }

    /// Young's modulus in Pa, density in kg/m³ and Poisson's ratio.
    fn material(&self, key: &str, [modulus, density, poisson]: [f64; 3]) -> Result<(), Error> {
        self.within(&format!("{key} youngs_modulus_pa"), modulus, 1e8, 1e13, "Pa")?;
        self.within(&format!("{key} density_kg_m3"), density, 100.0, 30_000.0, "kg/m³")?;
        self.within(&format!("{key} poisson_ratio"), poisson, -0.5, 0.499, "")
    }

    fn on_shaft(&self, key: &str, position_m: f64, length_m: f64) -> Result<(), Error> {
        if position_m.is_finite() && (-1e-9..=length_m + 1e-9).contains(&position_m) {
            return Ok(());
        }
        self.fail(key, format!("{position_m} m is not on the shaft, which is {length_m} m long"))
    }

    fn unique<'n>(&self, key: &str, names: impl Iterator<Item = &'n str>) -> Result<(), Error> {
        let mut seen = std::collections::BTreeSet::new();
        for name in names {
            if name.is_empty() {
                return self.fail(key, "a name must not be empty");
            }
            // a terminal would obey them
            if name.contains(char::is_control) {
                return self.fail(key, "a name must not hold control characters");
            }
            if !seen.insert(name) {
                return self.fail(key, format!("the name \"{name}\" is used twice"));
            }
        }
        Ok(())
    }
}

/// Checks ranges and references. The ranges catch wrong units: no shaft is 200 m long, no steel has
/// a modulus of 208.
pub fn check(file: &str, rotor: &Rotor) -> Result<(), Error> {
    let c = Checker { file };
    if !(1..=SCHEMA).contains(&rotor.schema) {
        return c.fail("schema", format!("{} is not supported, expected 1 to {SCHEMA}", rotor.schema));
    }
    if let Some(fastest_rpm) = rotor.fastest_rpm {
        c.within("fastest_rpm", fastest_rpm, 1.0, 1e6, "rpm")?;
    }
    c.unique("serial", rotor.serial.as_deref().into_iter())?;
    check_shaft(&c, rotor)?;
    couplings::check(&c, rotor)?;
    check_bearings(&c, rotor)?;
    foundation::check(&c, rotor)?;
    check_probes_and_planes(&c, rotor)?;
    check_statistics(&c, rotor)?;
    for e in &rotor.effect {
        entry::check(rotor, e).or_else(|what| c.fail(format!("[[effect]] \"{}\"", e.kind), what))?;
    }
    let of = |kind: Option<String>| {
        kind.map_or_else(|| "[[effect]]".into(), |kind| format!("[[effect]] \"{kind}\""))
    };
    physical::check(rotor).or_else(|(kind, what)| c.fail(of(kind), what))?;
    if rotor.is_fitted() {
        check(file, &rotor.as_stated())?;
    }
    let label = |e: &EffectEntry| format!("{}@{}", e.kind, e.at.as_deref().unwrap_or(""));
    let labels: Vec<String> = rotor.effect.iter().map(label).collect();
    c.unique("[[effect]] kind and at", labels.iter().map(String::as_str))
}

/// Checks materials as the segments that are made of them, whose numbers they become.
pub(super) fn check_materials(file: &str, materials: &[Material]) -> Result<(), Error> {
    let c = Checker { file };
    c.unique("[[material]] name", materials.iter().map(|m| m.name.as_str()))?;
    for m in materials {
        let numbers = [m.youngs_modulus_pa, m.density_kg_m3, m.poisson_ratio];
        c.material(&format!("[[material]] \"{}\"", m.name), numbers)?;
    }
    Ok(())
}

fn check_shaft(c: &Checker, rotor: &Rotor) -> Result<(), Error> {
    if rotor.shaft.is_empty() {
        return c.fail("[[shaft]]", "at least one segment is needed");
    }
    for (i, s) in rotor.shaft.iter().enumerate() {
        let key = |name: &str| format!("[[shaft]] {} {name}", i + 1);
        c.within(&key("length_m"), s.length_m, 1e-4, 50.0, "m")?;
        c.within(&key("outer_diameter_m"), s.outer_diameter_m, 1e-4, 10.0, "m")?;
        c.within(&key("inner_diameter_m"), s.inner_diameter_m, 0.0, s.outer_diameter_m * 0.999, "m")?;
        let numbers = [s.youngs_modulus_pa, s.density_kg_m3, s.poisson_ratio];
        c.material(&format!("[[shaft]] {}", i + 1), numbers)?;
        c.within(&key("shear_coefficient"), s.shear_coefficient.unwrap_or(1.0), 0.01, 100.0, "")?;
        c.within(&key("axial_force_n"), s.axial_force_n, -1e9, 1e9, "N")?;
        let newer =
            [("shear_coefficient", s.shear_coefficient.is_some()), ("axial_force_n", s.axial_force_n != 0.0)];
        if let Some((name, _)) = newer.into_iter().find(|(_, is_stated)| *is_stated && rotor.schema < 2) {
            return c.fail("schema", format!("{} does not know {}, expected 2", rotor.schema, key(name)));
        }
        if s.axial_force_n != 0.0 && rotor.physics.basis == BasisKind::FreeFree {
            let what = "does not act on the shapes of [physics] basis = \"free_free\", expected the basis \"supported\"";
            return c.fail(key("axial_force_n"), what);
        }
    }
    let length = rotor.length_m();
    c.unique("[[disk]] name", rotor.disk.iter().map(|d| d.name.as_str()))?;
    for d in &rotor.disk {
        let key = |name: &str| format!("[[disk]] \"{}\" {name}", d.name);
        c.on_shaft(&key("position_m"), d.position_m, length)?;
        c.within(&key("mass_kg"), d.mass_kg, 0.0, 1e6, "kg")?;
        c.within(&key("diametral_inertia_kg_m2"), d.diametral_inertia_kg_m2, 0.0, 1e6, "kg·m²")?;
        c.within(&key("polar_inertia_kg_m2"), d.polar_inertia_kg_m2, 0.0, 1e6, "kg·m²")?;
    }
    Ok(())
}

fn check_bearings(c: &Checker, rotor: &Rotor) -> Result<(), Error> {
    let count = rotor.bearing.len();
    if !(1..=MOST_BEARINGS).contains(&count) {
        return c
            .fail("[[bearing]]", format!("{count} given, one to {MOST_BEARINGS} bearings are supported"));
    }
    c.unique("[[bearing]] name", rotor.bearing.iter().map(|b| b.name.as_str()))?;
    let holds = |law: &Law| law.as_law().drawn().typical_stiffness_n_m().trace() > 0.0;
    if !rotor.bearing.iter().any(|b| holds(&b.law)) {
        let what = "none has a stiffness above zero, expected one at least that holds the shaft";
        return c.fail("[[bearing]]", what);
    }
    for (i, b) in rotor.bearing.iter().enumerate() {
        let key = |name: &str| format!("[[bearing]] \"{}\" {name}", b.name);
        c.on_shaft(&key("position_m"), b.position_m, rotor.length_m())?;
        if let Some(other) = rotor.bearing[..i].iter().find(|o| same_place(o.position_m, b.position_m)) {
            return c.fail(key("position_m"), format!("the bearing \"{}\" is at the same place", other.name));
        }
        c.within(&key("elevation_m"), b.elevation_m, -0.1, 0.1, "m")?;
        let symbols = |law: &Law| law.as_law().unknowns().into_iter().map(|u| u.symbol).collect::<Vec<_>>();
        if b.stated.as_ref().is_some_and(|stated| symbols(stated) != symbols(&b.law)) {
            let what = "is another kind of law than the fitted one, expected the same kind, or no `stated`";
            return c.fail(key("stated"), what);
        }
        b.law.as_law().check().or_else(|(name, what)| c.fail(key(&name), what))?;
        if let Some(p) = &b.pedestal {
            for axis in 0..2 {
                c.within(&key("pedestal.stiffness_n_m"), p.stiffness_n_m[axis], 1.0, STIFFEST_N_M, "N/m")?;
                c.within(
                    &key("pedestal.damping_n_s_m"),
                    p.damping_n_s_m[axis],
                    0.0,
                    MOST_DAMPING_N_S_M,
                    "N·s/m",
                )?;
                c.within(&key("pedestal.mass_kg"), p.mass_kg[axis], 0.0, 1e6, "kg")?;
            }
        }
        let stands = rotor.foundation.as_ref().is_some_and(|f| f.bearings.contains(&b.name));
        if stands && b.pedestal.is_some() {
            let what =
                "stands beside [foundation], whose modes have the pedestals in them; expected one of the two";
            return c.fail(key("pedestal"), what);
        }
        if let Some(relative) = b.coefficients_relative {
            c.within(&key("coefficients_relative"), relative, 1e-3, 2.0, "(a relative standard deviation)")?;
            if !matches!(&b.law, Law::Table(_)) && b.constants().is_none_or(|k| k.learned.is_some()) {
                let what = "is for coefficients that are stated, as constants or in a table";
                return c.fail(key("coefficients_relative"), what);
            }
        }
        let newer = b.coefficients_relative.is_some()
            || b.pedestal.is_some()
            || b.elevation_m != 0.0
            || b.constants().is_none_or(|k| k.learned.is_some());
        if rotor.schema < 2 && (newer || b.stated.is_some()) {
            return c
                .fail("schema", format!("{} does not know what {} has, expected 2", rotor.schema, key("")));
        }
    }
    Ok(())
}

fn check_probes_and_planes(c: &Checker, rotor: &Rotor) -> Result<(), Error> {
    let length = rotor.length_m();
    if rotor.probe.is_empty() {
        return c.fail("[[probe]]", "at least one probe is needed");
    }
    c.unique("[[probe]] name", rotor.probe.iter().map(|p| p.name.as_str()))?;
    for p in &rotor.probe {
        let key = |name: &str| format!("[[probe]] \"{}\" {name}", p.name);
        c.on_shaft(&key("position_m"), p.position_m, length)?;
        c.within(&key("angle_deg"), p.angle_deg, -360.0, 360.0, "degrees")?;
        if !p.used && rotor.schema < 2 {
            return c.fail("schema", format!("{} does not know {}, expected 2", rotor.schema, key("used")));
        }
        if let Some(gap) = p.gap {
            c.within(&key("gap.at_rest_v"), gap.at_rest_v, LOWEST_GAP_V, 0.0, "V")?;
            c.within(&key("gap.sensitivity_v_mm"), gap.sensitivity_v_mm, 0.1, 100.0, "V/mm")?;
            c.within(&key("gap.accuracy_um"), gap.accuracy_um, 0.1, 1000.0, "µm")?;
            let law = rotor.bearing_of(p).map(|b| &rotor.bearing[b].law);
            if !law.is_some_and(|law| matches!(law, Law::Film(film) if film.film().at_rest().is_some())) {
                let what = "needs a bearing with an oil film that is symmetric about its load, and there is none; leave it out";
                return c.fail(key("gap"), what);
            }
            if rotor.schema < 2 {
                return c
                    .fail("schema", format!("{} does not know {}, expected 2", rotor.schema, key("gap")));
            }
        }
        if rotor.bearing_of(p).is_none() {
            let known = rotor.bearing.iter().map(|b| format!("\"{}\"", b.name)).collect::<Vec<_>>();
            return c.fail(
                key("bearing"),
                format!("there is no bearing \"{}\", expected one of {}", p.bearing, known.join(", ")),
            );
        }
    }
    if !(1..=MOST_PLANES).contains(&rotor.plane.len()) {
        let what = format!("{} given, one to {MOST_PLANES} planes are supported", rotor.plane.len());
        return c.fail("[[plane]]", what);
    }
    c.unique("[[plane]] name", rotor.plane.iter().map(|p| p.name.as_str()))?;
    for p in &rotor.plane {
        let key = |name: &str| format!("[[plane]] \"{}\" {name}", p.name);
        c.on_shaft(&key("position_m"), p.position_m, length)?;
        c.within(&key("unbalance_g_mm"), p.unbalance_g_mm.unwrap_or(0.0), 0.0, 1e9, "g·mm")?;
        c.within(&key("angle_deg"), p.angle_deg.unwrap_or(0.0), -360.0, 360.0, "degrees")?;
    }
    c.unique("[[run]] name", rotor.run.iter().map(|r| r.name.as_str()))?;
    for run in &rotor.run {
        if run.slow_roll && !run.added_unbalance.is_empty() {
            let key = format!("[[run]] \"{}\" added_unbalance", run.name);
            return c.fail(key, "a slow roll shows runout alone, expected no weights");
        }
        for a in &run.added_unbalance {
            let key = |name: &str| format!("[[run]] \"{}\" added_unbalance {name}", run.name);
            c.on_shaft(&key("position_m"), a.position_m, length)?;
            c.within(&key("magnitude_g_mm"), a.magnitude_g_mm, 0.0, 1e9, "g·mm")?;
            if a.angle_deg.is_nan() {
                let what = "is missing; state where the weight sits, from the keyphasor mark in the direction of rotation";
                return c.fail(key("angle_deg"), what);
            }
            c.within(&key("angle_deg"), a.angle_deg, -360.0, 360.0, "degrees")?;
        }
    }
    Ok(())
}

fn check_statistics(c: &Checker, rotor: &Rotor) -> Result<(), Error> {
    if let Some(Rated { speed_rpm: [slowest, fastest], balance_grade_mm_s }) = rotor.rated {
        c.within("[rated] speed_rpm", slowest, 0.0, 1e6, "rpm")?;
        c.within("[rated] speed_rpm", fastest, 1.0, 1e6, "rpm")?;
        if slowest >= fastest {
            return c.fail("[rated] speed_rpm", format!("[{slowest}, {fastest}] is not slowest and fastest"));
        }
        if let Some(grade) = balance_grade_mm_s {
            c.within("[rated] balance_grade_mm_s", grade, 0.05, 5000.0, "mm/s")?;
            if rotor.schema < 2 {
                let what = format!("{} does not know [rated] balance_grade_mm_s, expected 2", rotor.schema);
                return c.fail("schema", what);
            }
        }
    }
    if let Some(n) = &rotor.noise {
        c.within("[noise] relative", n.relative, 0.0, 1.0, "")?;
        c.within("[noise] floor_um", n.floor_um, 0.0, 1000.0, "µm")?;
        c.within("[noise] scale", n.scale.unwrap_or(1.0), 1e-3, 1e3, "times the stated noise")?;
        c.within("[noise] correlation", n.correlation.unwrap_or(0.0), 0.0, MOST_CORRELATED, "")?;
        c.within("[noise] between_runs", n.between_runs.unwrap_or(0.0), 0.0, MOST_BETWEEN_RUNS, "")?;
        if rotor.schema < 2 && (n.scale.is_some() || n.correlation.is_some() || n.between_runs.is_some()) {
            let what = format!(
                "{} does not know [noise] scale, correlation and between_runs, expected 2",
                rotor.schema
            );
            return c.fail("schema", what);
        }
        if n.relative == 0.0 && n.floor_um == 0.0 {
            return c.fail("[noise]", "relative and floor_um are both zero, at least one must be positive");
        }
    }
    if let Some(t) = &rotor.tolerance {
        if t.exact && *t != Tolerance::exact() {
            return c.fail(
                "[tolerance] exact",
                "true stands beside errors of the drawing, expected one or the other",
            );
        }
        if rotor.schema < 2 && t.exact {
            let what = format!("{} does not know [tolerance] exact, expected 2", rotor.schema);
            return c.fail("schema", what);
        }
        for (key, value) in [
            ("[tolerance] modulus_relative", t.modulus_relative),
            ("[tolerance] diameter_relative", t.diameter_relative),
            ("[tolerance] mass_relative", t.mass_relative),
            ("[tolerance] inertia_relative", t.inertia_relative),
        ] {
            c.within(key, value, 0.0, 0.5, "(a relative standard deviation)")?;
        }
        c.within("[tolerance] position_m", t.position_m, 0.0, 0.1, "m")?;
        if rotor.schema < 2 && !t.found.is_empty() {
            let what = format!("{} does not know [tolerance.found], expected 2", rotor.schema);
            return c.fail("schema", what);
        }
        let known: Vec<String> = Deviation::all(rotor).into_iter().map(|d| d.name(rotor)).collect();
        for (name, by) in &t.found {
            let key = format!("[tolerance.found] \"{name}\"");
            if !known.contains(name) {
                return c.fail(key, format!("is of nothing here, expected one of {}", known.join(", ")));
            }
            c.within(&key, *by, -0.9, 9.0, "")?;
        }
    }
    if let Some(b) = &rotor.identify {
        for (key, [low, high], most, unit) in [
            ("[identify] stiffness_n_m", b.stiffness_n_m, STIFFEST_N_M, "N/m"),
            ("[identify] damping_n_s_m", b.damping_n_s_m, MOST_DAMPING_N_S_M, "N·s/m"),
        ] {
            c.within(key, high, 0.0, most, unit)?;
            if !(low > 0.0 && low < high) {
                return c.fail(key, format!("[{low}, {high}] is not a range of positive numbers"));
            }
        }
    }
    Ok(())
}

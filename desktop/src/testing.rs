//! Rotors for unit tests.

use crate::bearing::Law;
use crate::bearing::film_law::FilmLaw;
use crate::bearing::table::{CoefficientTable, TableRow};
use crate::machine::drawing::{
    Bearing, Coefficients, Coupling, Disk, Flexibility, Mount, Physics, Plane, Probe, Rotor, Segment,
    Tolerance,
};

fn bearing(name: &str, position_m: f64, k: [f64; 2], c: [f64; 2]) -> Bearing {
    let direct = |[xx, yy]: [f64; 2]| Coefficients { xx, yy, xy: 0.0, yx: 0.0 };
    Bearing::constant(name, position_m, direct(k), direct(c))
}

fn probe(name: &str, bearing: &str, position_m: f64, angle_deg: f64) -> Probe {
    Probe {
        name: name.into(),
        bearing: bearing.into(),
        position_m,
        angle_deg,
        used: true,
        mount: Mount::Ground,
        gap: None,
    }
}

fn plane(name: &str, position_m: f64) -> Plane {
    Plane { name: name.into(), position_m, unbalance_g_mm: None, angle_deg: None }
}

fn steel(length_m: f64, outer_diameter_m: f64) -> Segment {
    Segment {
        length_m,
        outer_diameter_m,
        inner_diameter_m: 0.0,
        youngs_modulus_pa: 2.08e11,
        density_kg_m3: 7850.0,
        poisson_ratio: 0.3,
        shear_coefficient: None,
        axial_force_n: 0.0,
    }
}

/// A uniform shaft of 1 m × 50 mm on soft bearings at its ends.
pub fn uniform_shaft() -> Rotor {
    Rotor {
        schema: 2,
        name: "uniform".into(),
        serial: None,
        fastest_rpm: None,
        physics: Physics::default(),
        noise: None,
        tolerance: Some(Tolerance::exact()),
        rated: None,
        foundation: None,
        unused: Vec::new(),
        identify: None,
        shaft: vec![steel(1.0, 0.05)],
        coupling: vec![],
        disk: vec![],
        bearing: vec![
            bearing("A", 0.0, [1e6, 1e6], [100.0, 100.0]),
            bearing("B", 1.0, [1e6, 1e6], [100.0, 100.0]),
        ],
        probe: vec![
            probe("AX", "A", 0.1, 0.0),
            probe("AY", "A", 0.1, 90.0),
            probe("BX", "B", 0.9, 0.0),
            probe("BY", "B", 0.9, 90.0),
        ],
        plane: vec![plane("1", 0.3), plane("2", 0.7)],
        run: vec![],
        effect: vec![],
    }
}

/// A stepped shaft with two disks on stiff, damped bearings.
pub fn sample_rotor() -> Rotor {
    let disk = |name: &str, position_m| Disk {
        name: name.into(),
        position_m,
        mass_kg: 18.0,
        diametral_inertia_kg_m2: 0.16,
        polar_inertia_kg_m2: 0.3,
    };
    Rotor {
        name: "sample".into(),
        fastest_rpm: None,
        shaft: vec![steel(0.2, 0.08), steel(0.6, 0.12), steel(0.2, 0.09)],
        disk: vec![disk("disk 1", 0.35), disk("disk 2", 0.6)],
        bearing: vec![
            bearing("A", 0.1, [1.8e8, 2.2e8], [1e5, 1.4e5]),
            bearing("B", 0.9, [3.2e8, 1.5e8], [1.1e5, 1.6e5]),
        ],
        ..uniform_shaft()
    }
}

/// Two spans on two bearings each, joined by a flexible coupling; a disk on each span.
pub fn train() -> Rotor {
    let disk = |name: &str, position_m, mass_kg| Disk {
        name: name.into(),
        position_m,
        mass_kg,
        diametral_inertia_kg_m2: 0.004 * mass_kg,
        polar_inertia_kg_m2: 0.007 * mass_kg,
    };
    Rotor {
        schema: 2,
        name: "train".into(),
        shaft: vec![steel(1.0, 0.06), steel(0.8, 0.05)],
        coupling: vec![Coupling {
            name: "C".into(),
            position_m: 1.0,
            flexibility: Some(Flexibility { lateral_stiffness_n_m: 4e6, angular_stiffness_n_m_rad: 2e4 }),
            mass_kg: 6.0,
            diametral_inertia_kg_m2: 0.02,
            polar_inertia_kg_m2: 0.03,
        }],
        disk: vec![disk("motor", 0.45, 20.0), disk("fan", 1.5, 12.0)],
        bearing: vec![
            bearing("A", 0.05, [4e7, 5e7], [2e3, 3e3]),
            bearing("B", 0.9, [5e7, 6e7], [2e3, 3e3]),
            bearing("C", 1.1, [3e7, 4e7], [2e3, 3e3]),
            bearing("D", 1.75, [4e7, 4e7], [2e3, 3e3]),
        ],
        probe: ["A", "B", "C", "D"]
            .iter()
            .zip([0.1, 0.85, 1.15, 1.7])
            .flat_map(|(name, z)| {
                [("X", 0.0), ("Y", 90.0)].map(|(axis, angle)| probe(&format!("{name}{axis}"), name, z, angle))
            })
            .collect(),
        plane: vec![plane("motor", 0.45), plane("fan", 1.5)],
        ..uniform_shaft()
    }
}

/// A plain oil film of a 100 mm journal that carries this load.
pub fn film(load_n: f64) -> Law {
    let film = format!(
        "kind = 'plain'\ndiameter_m = 0.1\nlength_m = 0.05\nradial_clearance_m = 1e-4\niso_vg = 46.0\n\
         temperature_c = 55.0\nload_n = {load_n}"
    );
    Law::Film(FilmLaw::new(toml::from_str(&film).unwrap()).unwrap())
}

/// A table of coefficients at 1,000 rpm and at this speed, stiffer at the second.
pub fn table(fastest_rpm: f64) -> Law {
    let row = |speed_rpm, k| TableRow {
        speed_rpm,
        kxx: k,
        kxy: 0.2 * k,
        kyx: -0.1 * k,
        kyy: 2.0 * k,
        cxx: 1e4,
        cxy: 0.0,
        cyx: 0.0,
        cyy: 2e4,
    };
    Law::Table(CoefficientTable::new(vec![row(1000.0, 1e7), row(fastest_rpm, 3e7)]).unwrap())
}

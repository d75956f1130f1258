//! Rotors that ROSS saved, read as drawings: the same machine, on ROSS's own mesh.

use nalgebra::Complex;
use rotor_edge_desktop::bearing::Law;
use rotor_edge_desktop::check::critical::critical_speeds;
use rotor_edge_desktop::check::modes::modes;
use rotor_edge_desktop::check::system::System;
use rotor_edge_desktop::machine::drawing::Rotor;
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file::ross::{self, ImportedRotor};
use rotor_edge_desktop::shaft::structure::Structure;
use rotor_edge_tests::repository;
use serde_json::Value;

const TOLERANCE: f64 = 1e-6;
/// Of the critical speeds of every rotor.
const CRITICAL: f64 = 1e-3;
/// Of the sixth mode of cones, which are steps here and single elements there.
const STEPS: f64 = 2e-3;
/// Of the sixth mode of a shaft with a heavy sleeve: layers bend and shear as one section, each spreads its mass by its own shear.
const SLEEVE: f64 = 1e-2;
/// The files, and how near the same machine comes to ROSS's.
const FILES: [(&str, f64); 8] = [
    ("constant.toml", TOLERANCE),
    ("table.json", TOLERANCE),
    ("supports.toml", TOLERANCE),
    ("coupling.json", TOLERANCE),
    ("speed.toml", TOLERANCE),
    ("magnet.toml", TOLERANCE),
    ("layers.toml", SLEEVE),
    ("cone.toml", STEPS),
];

fn import(name: &str) -> ImportedRotor {
    ross::read(&repository(&format!("tests/data/ross/{name}"))).unwrap()
}

/// A mesh of one element a segment is the one that ROSS has.
fn on_its_mesh(rotor: &Rotor) -> System {
    let structure = Structure::finite_elements(rotor, &rotor.physics, 1);
    System::of(Model::on(structure, rotor), rotor.physics.formulation).unwrap()
}

#[test]
fn imported_critical_speeds_and_damped_modes_equal_ross() {
    let text = std::fs::read_to_string(repository("tests/data/ross/expected.json")).unwrap();
    let expected: Value = serde_json::from_str(&text).unwrap();
    for (name, tolerance) in FILES {
        let system = on_its_mesh(&import(name).rotor);
        for set in expected[name]["modes"].as_array().unwrap() {
            let theirs = set["values"].as_array().unwrap();
            let ours = modes(&system, set["rad_s"].as_f64().unwrap(), 0.0, theirs.len()).unwrap();
            for (a, b) in ours.iter().zip(theirs) {
                let b = Complex::new(b[0].as_f64().unwrap(), b[1].as_f64().unwrap());
                assert!((a.eigenvalue - b).norm() < tolerance * b.norm(), "{name}: {} {b}", a.eigenvalue);
            }
        }
        let Some(theirs) = expected[name]["critical_speeds"].as_array() else { continue };
        let theirs: Vec<f64> = theirs.iter().map(|v| v.as_f64().unwrap()).collect();
        for ours in critical_speeds(&system, theirs[theirs.len() - 1], 0) {
            let off = theirs.iter().map(|b| (ours.speed_rad_s / b - 1.0).abs()).fold(f64::INFINITY, f64::min);
            assert!(off < tolerance.min(CRITICAL), "{name}: {ours:?} {theirs:?}");
        }
    }
}

#[test]
fn ross_tables_pedestals_and_seals_are_imported() {
    let constant = import("constant.toml");
    assert_eq!(constant.rotor.bearing.len(), 3, "two bearings and a seal");
    assert!(constant.rotor.shaft.iter().all(|s| s.inner_diameter_m == 0.01));
    assert!((constant.rotor.shaft[0].poisson_ratio - (2.11e11 / (2.0 * 8.12e10) - 1.0)).abs() < 1e-12);
    assert!(constant.left.iter().any(|l| l.contains("seal")), "{:?}", constant.left);
    let table = import("table.json");
    let Law::Table(t) = &table.rotor.bearing[0].law else { panic!("a table") };
    assert_eq!(t.rows().len(), 8);
    assert!((t.rows()[0].speed_rpm - 100.0 * 30.0 / std::f64::consts::PI).abs() < 1e-9, "rad/s to rpm");
    let supports = import("supports.toml");
    assert_eq!(supports.rotor.bearing.len(), 2);
    let pedestal = supports.rotor.bearing[0].pedestal.unwrap();
    assert_eq!((pedestal.stiffness_n_m, pedestal.mass_kg), ([5e7; 2], [4.0; 2]));
    // the file has 100 N·s/m both ways; with another number along y, each is carried over to its own direction
    assert_eq!(pedestal.damping_n_s_m, [100.0; 2]);
    let text = std::fs::read_to_string(repository("tests/data/ross/supports.toml")).unwrap();
    let uneven =
        ross::parse("uneven.toml", &text.replace("cyy = [ 100.0,]", "cyy = [ 700.0,]"), false).unwrap();
    assert_eq!(uneven.rotor.bearing[0].pedestal.unwrap().damping_n_s_m, [100.0, 700.0]);
    assert!(supports.carried.iter().any(|c| c.contains("pedestal \"support\" under bearing \"A\"")));
}

#[test]
fn ross_coupling_is_imported_and_lost_properties_are_listed() {
    let ImportedRotor { rotor, carried, left } = import("coupling.json");
    let c = &rotor.coupling[0];
    assert_eq!((c.name.as_str(), c.mass_kg, c.polar_inertia_kg_m2), ("discs", 5.0, 0.02));
    let springs = c.flexibility.unwrap();
    assert_eq!((springs.lateral_stiffness_n_m, springs.angular_stiffness_n_m_rad), (8e6, 9e3));
    assert!(
        (c.position_m - 0.9).abs() < 1e-12 && (rotor.length_m() - 1.9).abs() < 1e-12,
        "no length of its own"
    );
    assert!(carried.iter().any(|s| s.contains("coupling \"discs\"")), "{carried:?}");
    for part in ["0.12 m further left", "torsional stiffness"] {
        assert!(left.iter().any(|s| s.contains(part)), "{part}: {left:?}");
    }
    let text = std::fs::read_to_string(repository("tests/data/ross/coupling.json")).unwrap();
    for (from, to, expected) in [
        ("\"kr_x\": 9000.0", "\"kr_x\": 0.0", "their mean was taken"),
        ("\"m_r\": 2.5", "\"m_r\": 4.5", "halves that differ"),
        ("\"cr_y\": 0.0", "\"cr_y\": 5.0", "the damping of a coupling has no counterpart"),
    ] {
        assert!(text.contains(from), "{from}");
        let left = ross::parse("r.json", &text.replace(from, to), true).unwrap().left;
        assert!(left.iter().any(|s| s.contains(expected)), "{expected}: {left:?}");
    }
    let parted =
        text.replace("\"kt_x\": 8000000.0", "\"kt_x\": 0.0").replace("\"kt_y\": 8000000.0", "\"kt_y\": 0.0");
    let error = ross::parse("r.json", &parted, true).unwrap_err().to_string();
    assert!(error.contains("kt_x: is 0, expected a stiffness that joins"), "{error}");
    let (before, fan) = text.split_at(text.find("DiskElement_fan").unwrap());
    let hub = [before, &fan.replacen("\"n\": 6", "\"n\": 4", 1)].concat();
    let ImportedRotor { rotor, left, .. } = ross::parse("r.json", &hub, true).unwrap();
    assert!(
        rotor.disk.len() == 1 && left.iter().any(|s| s.contains("add it to the coupling's mass")),
        "{left:?}"
    );
}

#[test]
fn invalid_ross_file_is_refused_with_element_and_key() {
    let text = std::fs::read_to_string(repository("tests/data/ross/constant.toml")).unwrap();
    let said = |text: &str| ross::parse("r.toml", text, false).unwrap_err().to_string();
    for (from, to, parts) in [
        ("odl = 0.06", "odl = \"thick\"", ["ShaftElement", "odl"]),
        ("ross_version", "other_version", ["ross_version", "missing"]),
        ("n = 2", "n = 77", ["n: is 77", "0 to 6"]),
        ("kxx = [ 40000000.0,]", "kxx = [ \"a\",]", ["drive end", "kxx"]),
        ("L = 0.1", "L = ", ["line", "r.toml"]),
    ] {
        assert!(text.contains(from), "{from}");
        let place = if from == "n = 2" { text.rfind(from).unwrap() } else { text.find(from).unwrap() };
        let broken = format!("{}{to}{}", &text[..place], &text[place + from.len()..]);
        let message = said(&broken);
        assert!(message.lines().count() == 1 && message.starts_with("r.toml: "), "{message}");
        for part in parts {
            assert!(message.contains(part), "\"{part}\" is missing in: {message}");
        }
    }
    assert!(ross::parse("r.json", "{", true).unwrap_err().to_string().contains("JSON"));
}

fn text(name: &str) -> String {
    std::fs::read_to_string(repository(&format!("tests/data/ross/{name}"))).unwrap()
}

/// A table is one whatever its axis is called; without an axis that fits it is nothing.
#[test]
fn table_of_ross_is_never_taken_as_constants() {
    let table_of = |text: &str| match &ross::parse("r.toml", text, false).unwrap().rotor.bearing[0].law {
        Law::Table(table) => table.rows().len(),
        other => panic!("{other:?}"),
    };
    let by_speed = text("speed.toml");
    assert_eq!(table_of(&by_speed), 8);
    assert_eq!(table_of(&by_speed.replace("\nspeed = ", "\nfrequency = ")), 8);
    let both = by_speed.replace("\nspeed = [ 50.0,", "\nfrequency = [ 51.0, 2.0,]\nspeed = [ 50.0,");
    for (file, said) in [
        (by_speed.replace("\nspeed = ", "\nomega = "), "frequency: is missing, expected the 8 speeds"),
        (by_speed.replace("\nspeed = [ 50.0,", "\nspeed = [ "), "has 8 values for 7 speeds"),
        (by_speed.replace("\nspeed = [ 50.0,", "\nspeed = [ 900.0,"), "the speeds of a table must ascend"),
        (
            by_speed.replace("\nspeed = [ 50.0,", "\nspeed = [ \"x\","),
            "speed: is a list with values that are no numbers",
        ),
        (both, "speed: and frequency differ"),
    ] {
        let error = ross::parse("r.toml", &file, false).unwrap_err().to_string();
        assert!(error.contains(said), "{said}: {error}");
    }
}

#[test]
fn negative_stiffness_of_ross_becomes_a_magnetic_support() {
    let ImportedRotor { rotor, carried, .. } = import("magnet.toml");
    let law = |name: &str| &rotor.bearing.iter().find(|b| b.name == name).unwrap().law;
    let Law::Magnetic(motor) = law("motor") else { panic!("{:?}", law("motor")) };
    assert_eq!(motor.stiffness_n_m, -4e5);
    assert!(matches!(law("gap"), Law::Table(_)), "not alike in x and y");
    for part in
        ["\"motor\" as a magnetic support", "point mass \"rotor of the motor\"", "added mass of \"A\""]
    {
        assert!(carried.iter().any(|s| s.contains(part)), "{part}: {carried:?}");
    }
    let masses: Vec<f64> = rotor.disk.iter().map(|d| d.mass_kg).collect();
    assert_eq!(masses, [20.0, 4.0, 3.0]);
    assert_eq!(rotor.plane.len(), 1, "a plane at the disk, none at the masses");
    assert!(rotor.shaft.iter().all(|s| s.axial_force_n == 2e4));
    let pulls = text("magnet.toml").replace("10000000.0", "-10000000.0");
    let error = ross::parse("r.toml", &pulls, false).unwrap_err().to_string();
    assert!(error.contains("none has a stiffness above zero"), "{error}");
}

#[test]
fn every_value_of_ross_is_carried_over_or_listed() {
    let file = text("layers.toml");
    let listed = |from: &str, to: &str, said: &str| {
        assert!(file.contains(from), "{from}");
        let left = ross::parse("r.toml", &file.replacen(from, to, 1), false).unwrap().left;
        assert!(left.iter().any(|s| s.contains(said)), "{said}: {left:?}");
    };
    listed("torque = 0", "torque = 12.5", "torque has no counterpart");
    listed("alpha = 0.0", "alpha = 8.05", "the damping of shaft elements has no counterpart");
    listed("alpha = 0.0", "alpha = 0.0\nnovel = \"x\"", "novel has no counterpart");
    listed("kzz = [ 0,]", "kzz = [ 7e6,]", "kzz has no counterpart");
    listed("Ip = 0.33", "Ip = 0.33\nblades = 12", "blades has no counterpart");
    listed(
        "color = \"#525252\"",
        "color = \"#525252\"\nspecific_heat = 434.0",
        "material.specific_heat: has no counterpart",
    );
    listed("[parameters]", "[parameters]\nrated_w = 300.0", "[parameters] rated_w: has no counterpart");
    listed("[parameters]", "[parameters]\n\n[ThrustThing_a]\nn = 1", "an element of class ThrustThing");
    let all = file.replace("alpha = 0.0", "alpha = 8.05");
    let left = ross::parse("r.toml", &all, false).unwrap().left;
    assert_eq!(left.iter().filter(|s| s.contains("damping")).count(), 1, "one sentence for all: {left:?}");
    assert!(left.iter().any(|s| s.contains("and 6 more: the damping")), "{left:?}");
}

#[test]
fn rotors_that_no_drawing_holds_are_refused_by_name() {
    let file = text("layers.toml");
    let layer = file.find("idl = 0.05").unwrap();
    let place = file[..layer].rfind("L = 0.2").unwrap();
    let longer = format!("{}L = 0.3{}", &file[..place], &file[place + 7..]);
    let second = file.replace("n = 5\n", "n = 7\n").replace("n = 4\n", "n = 6\n");
    let coaxial = second.replacen("n = 6\naxial", "n = 5\naxial", 1);
    for (text, said) in [
        (longer, "another layer from this node is"),
        (coaxial, "where a second shaft begins; coaxial and geared rotors are not read"),
        (text("supports.toml").replace("n_link = 5", "n_link = 3"), "n_link: is 3, a node of a shaft"),
        (
            text("supports.toml").replace("n = 4\n", "n = 4\nn_link = 5\n"),
            "on which another bearing stands too",
        ),
        (
            text("supports.toml").replace("kxx = [ 50000000.0,]", "kxx = [ 5e7, 6e7,]\nspeed = [ 1.0, 2.0,]"),
            "follows the speed",
        ),
    ] {
        let error = ross::parse("r.toml", &text, false).unwrap_err().to_string();
        assert!(error.contains(said), "{said}: {error}");
    }
}

#[test]
fn missing_coefficients_along_y_are_those_along_x() {
    let file = text("layers.toml").replace("kyy = [ 13000000.0,]\n", "").replace("cyy = [ 100.0,]\n", "");
    let rotor = ross::parse("r.toml", &file, false).unwrap().rotor;
    let constants = rotor.bearing[0].constants().unwrap();
    assert_eq!((constants.stiffness_n_m.yy, constants.damping_n_s_m.yy), (1e7, 100.0));
    let without = text("layers.toml").replace("cxx = [ 100.0,]\n", "");
    let error = ross::parse("r.toml", &without, false).unwrap_err().to_string();
    assert!(error.contains("cxx: is missing"), "{error}");
}

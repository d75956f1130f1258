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
    for name in ["constant.toml", "table.json", "supports.toml", "coupling.json"] {
        let system = on_its_mesh(&import(name).rotor);
        for set in expected[name]["modes"].as_array().unwrap() {
            let theirs = set["values"].as_array().unwrap();
            let ours = modes(&system, set["rad_s"].as_f64().unwrap(), 0.0, theirs.len()).unwrap();
            for (a, b) in ours.iter().zip(theirs) {
                let b = Complex::new(b[0].as_f64().unwrap(), b[1].as_f64().unwrap());
                assert!((a.eigenvalue - b).norm() < TOLERANCE * b.norm(), "{name}: {} {b}", a.eigenvalue);
            }
        }
        let Some(theirs) = expected[name]["critical_speeds"].as_array() else { continue };
        let theirs: Vec<f64> = theirs.iter().map(|v| v.as_f64().unwrap()).collect();
        for ours in critical_speeds(&system, theirs[theirs.len() - 1], 0) {
            let off = theirs.iter().map(|b| (ours.speed_rad_s / b - 1.0).abs()).fold(f64::INFINITY, f64::min);
            assert!(off < TOLERANCE, "{name}: {ours:?} {theirs:?}");
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

//! `check` and `import-rotor` as a user meets them.

use crate::program::{assert_says, json, refusal, rotor_edge};
use rotor_edge::sample;
use tempfile::TempDir;

fn written(folder: &TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn data(name: &str) -> String {
    format!("{}/../tests/data/ross/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn check_json_has_the_keys_that_others_read() {
    let folder = tempfile::tempdir().unwrap();
    let rotor = written(&folder, "rotor.toml", sample::ROTOR);
    let all = json(&rotor_edge(&["check", &rotor, "--rpm", "3000..11000", "--json"]));
    assert!(all["mass_kg"].as_f64().unwrap() > 0.0);
    let speeds = all["critical_speeds_rpm"].as_array().unwrap();
    assert!(!speeds.is_empty() && speeds.windows(2).all(|p| p[0].as_f64() <= p[1].as_f64()));
    let modes = all["modes"].as_array().unwrap();
    for m in modes {
        for key in ["speed_rpm", "frequency_rpm", "log_decrement"] {
            assert!(m[key].is_f64(), "{key}: {m}");
        }
        assert!(["forward", "backward", "mixed"].contains(&m["whirl"].as_str().unwrap()));
        assert!((3000.0 - 1e-6..=11000.0 + 1e-6).contains(&m["speed_rpm"].as_f64().unwrap()));
    }
    let mut weight_n = 0.0;
    for b in all["bearings"].as_array().unwrap() {
        weight_n += b["load_n"].as_f64().unwrap();
        assert!(b["name"].is_string() && b["eccentricity_ratio"].is_null() && b["attitude_deg"].is_null());
        for c in b["coefficients"].as_array().unwrap() {
            for key in ["speed_rpm", "kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"] {
                assert!(c[key].is_f64(), "{key}");
            }
        }
    }
    assert!((weight_n / (9.80665 * all["mass_kg"].as_f64().unwrap()) - 1.0).abs() < 1e-6);
    assert!(all["warnings"].as_array().unwrap().is_empty(), "{}", all["warnings"]);
}

#[test]
fn check_prints_loads_and_stability_and_writes_report() {
    let folder = tempfile::tempdir().unwrap();
    let rotor = written(&folder, "rotor.toml", sample::ROTOR);
    let report = folder.path().join("report.html").display().to_string();
    let output = rotor_edge(&["check", &rotor, "--report", &report]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    assert_says(
        &text,
        &["centre of gravity", "load N", "Undamped critical speeds", "log decrement", "Stable from", "Next:"],
    );
    let page = std::fs::read_to_string(report).unwrap();
    assert_says(
        &page,
        &["Critical speed map", "Campbell diagram", "Mode shapes", "Unbalance response, static", "<figure"],
    );
}

#[test]
fn check_warns_of_numbers_that_can_hardly_be_meant() {
    let folder = tempfile::tempdir().unwrap();
    let first = |key: &str| {
        let at = sample::ROTOR.find(key).unwrap_or_else(|| panic!("the sample has {key}"));
        let end = sample::ROTOR[at..].find('\n').map_or(sample::ROTOR.len(), |n| at + n);
        (at, end)
    };
    let replaced = |key: &str, line: &str| {
        let (at, end) = first(key);
        format!("{}{line}{}", &sample::ROTOR[..at], &sample::ROTOR[end..])
    };
    for (key, line, parts) in [
        ("mass_kg", "mass_kg = 19800.0", ["mass_kg = 19800", "grams"]),
        ("polar_inertia_kg_m2", "polar_inertia_kg_m2 = 90.0", ["polar_inertia_kg_m2 = 90", "twice"]),
        ("youngs_modulus_pa", "youngs_modulus_pa = 2.1e9", ["youngs_modulus_pa = 2.100e9", "steel"]),
        ("stiffness_n_m = {", "stiffness_n_m = { xx = 60.0, yy = 1.0e8 }", ["stiffness_n_m.xx = 60", "sink"]),
    ] {
        let rotor = written(&folder, "rotor.toml", &replaced(key, line));
        let all = json(&rotor_edge(&["check", &rotor, "--json"]));
        let warnings = all["warnings"].as_array().unwrap();
        let found = warnings.iter().any(|w| parts.iter().all(|p| w.as_str().unwrap().contains(p)));
        assert!(found, "{line}: {warnings:?}");
        assert!(
            warnings.iter().all(|w| w.as_str().unwrap().ends_with(['.', '?'])),
            "sentences: {warnings:?}"
        );
    }
    let rotor = written(&folder, "rotor.toml", sample::ROTOR);
    let all = json(&rotor_edge(&["check", &rotor, "--rpm", "25..180", "--json"]));
    assert!(all["warnings"].to_string().contains("in Hz"), "{}", all["warnings"]);
}

#[test]
fn check_takes_one_speed_and_own_unbalance() {
    let folder = tempfile::tempdir().unwrap();
    let rotor = written(&folder, "rotor.toml", sample::ROTOR);
    for speed in ["0", "11000"] {
        let text = String::from_utf8(rotor_edge(&["check", &rotor, "--rpm", speed]).stdout).unwrap();
        assert!(text.starts_with("Stable at"), "{text}");
    }
    assert_says(&refusal(&["check", &rotor, "--own-unbalance"]), &["rotor.toml", "unbalance_g_mm"]);
}

#[test]
fn check_refuses_a_range_that_is_none() {
    let output = rotor_edge(&["check", "rotor.toml", "--rpm", "3000..1000"]);
    assert!(!output.status.success());
    assert_says(&String::from_utf8_lossy(&output.stderr), &["3000..1000", "range of speeds"]);
}

#[test]
fn an_imported_rotor_can_be_checked_and_says_what_was_left() {
    let folder = tempfile::tempdir().unwrap();
    let rotor = folder.path().join("imported.toml").display().to_string();
    let all = json(&rotor_edge(&["import-rotor", &data("table.json"), "-o", &rotor, "--json"]));
    assert!(all["carried"].to_string().contains("table of 8 speeds"), "{}", all["carried"]);
    assert!(all["left"].to_string().contains("probes"), "{}", all["left"]);
    let checked = json(&rotor_edge(&["check", &rotor, "--json"]));
    assert_eq!(checked["bearings"].as_array().unwrap().len(), 2);
}

#[test]
fn invalid_ross_rotor_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let other = written(&folder, "other.toml", "a = 1\n");
    let target = folder.path().join("rotor.toml");
    let message = refusal(&["import-rotor", &other, "-o", &target.display().to_string()]);
    assert_says(&message, &["other.toml", "ross_version"]);
    assert!(!target.exists());
    let message = refusal(&["import-rotor", "absent.json"]);
    assert_says(&message, &["absent.json", "cannot be read"]);
}

/// Two spans on two bearings each, joined where the first ends.
fn coupled(coupling: &str) -> String {
    let mut text = "schema = 2\nname = \"train\"\n".to_string();
    text.push_str(&"[[shaft]]\nlength_m = 1.0\nouter_diameter_m = 0.08\n".repeat(2));
    text.push_str(coupling);
    for (name, position_m) in [("A", 0.1), ("B", 0.9), ("C", 1.1), ("D", 1.9)] {
        text.push_str(&format!(
            "[[bearing]]\nname = \"{name}\"\nposition_m = {position_m}\nstiffness_n_m = {{ xx = 1e8, yy = 1.2e8 }}\n\
             damping_n_s_m = {{ xx = 1e4, yy = 1e4 }}\n\
             [[probe]]\nname = \"{name}X\"\nbearing = \"{name}\"\nposition_m = {position_m}\nangle_deg = 0\n"
        ));
    }
    text + "[[plane]]\nname = \"P\"\nposition_m = 0.5\n"
}

#[test]
fn train_is_checked_with_coupling_and_loose_coupling_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let flexible = "lateral_stiffness_n_m = 5e7\nangular_stiffness_n_m_rad = 1e3\nmass_kg = 10\n";
    let coupling = |z: f64| format!("[[coupling]]\nname = \"disc pack\"\nposition_m = {z}\n{flexible}");
    let [soft, stiff] = ["1e3", "1e7"].map(|angular| {
        let text = coupled(&coupling(1.0).replace("= 1e3", &format!("= {angular}")));
        let all = json(&rotor_edge(&["check", &written(&folder, "train.toml", &text), "--json"]));
        let bar_kg = 7850.0 * std::f64::consts::PI * 0.04_f64.powi(2) * 2.0;
        assert!((all["mass_kg"].as_f64().unwrap() / (bar_kg + 10.0) - 1.0).abs() < 1e-9);
        all["critical_speeds_rpm"][2].as_f64().unwrap()
    });
    assert!(soft < 0.9 * stiff, "{soft} {stiff}");
    let train = written(&folder, "train.toml", &coupled(&coupling(1.0)));
    let report = folder.path().join("report.html").display().to_string();
    assert!(rotor_edge(&["check", &train, "--report", &report]).status.success());
    assert!(std::fs::read_to_string(report).unwrap().contains("disc pack"));
    let loose = written(&folder, "loose.toml", &coupled(&coupling(1.2)));
    assert_says(
        &refusal(&["check", &loose]),
        &["loose.toml", "disc pack", "position_m", "1.2 m joins nothing"],
    );
}

#[test]
fn lemon_bearings_without_undamped_critical_speed_are_explained() {
    let lemon =
        format!("{}/../tests/machines/table/10-lemon-shaft_bow/rotor.toml", env!("CARGO_MANIFEST_DIR"));
    let output = rotor_edge(&["check", &lemon]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_says(&text, &["None: without damping", "The damped modes apply", "log decrement"]);
}

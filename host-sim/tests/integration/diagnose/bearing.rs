//! A bearing that is not as its file states it, as a user is told of it.

use serde_json::Value;

use super::{Case, json};
use crate::program::{assert_says, rotor_edge};

/// A pump on two oil films, with a run as found and one with a trial weight.
const PUMP: &str = r#"
schema = 2
name = "pump"
shaft = [
  { length_m = 0.5, outer_diameter_m = 0.07 },
  { length_m = 0.4, outer_diameter_m = 0.09 },
  { length_m = 0.5, outer_diameter_m = 0.07 },
]
disk = [
  { name = "1", position_m = 0.5, mass_kg = 30.0, diametral_inertia_kg_m2 = 0.3, polar_inertia_kg_m2 = 0.5 },
  { name = "2", position_m = 0.9, mass_kg = 40.0, diametral_inertia_kg_m2 = 0.4, polar_inertia_kg_m2 = 0.7 },
]
plane = [{ name = "1", position_m = 0.5 }, { name = "2", position_m = 0.9 }]
probe = [
  { name = "AX", bearing = "A", position_m = 0.15, angle_deg = 45.0 },
  { name = "AY", bearing = "A", position_m = 0.15, angle_deg = 135.0 },
  { name = "BX", bearing = "B", position_m = 1.25, angle_deg = 45.0 },
  { name = "BY", bearing = "B", position_m = 1.25, angle_deg = 135.0 },
]
noise = { relative = 0.01, floor_um = 0.2 }

[[bearing]]
name = "A"
position_m = 0.1
film = { kind = "plain", diameter_m = 0.07, length_m = 0.035, radial_clearance_m = 1e-4, viscosity_pa_s = 0.02 }

[[bearing]]
name = "B"
position_m = 1.3
film = { kind = "plain", diameter_m = 0.07, length_m = 0.035, radial_clearance_m = 1.0e-4, viscosity_pa_s = 0.02 }

[[run]]
name = "as found"

[[run]]
name = "trial"
added_unbalance = [{ position_m = 0.5, magnitude_g_mm = 400, angle_deg = 30 }]
"#;

/// The pump as stated, and what its probes show if bearing A has this clearance.
fn pump_with(clearance_m: &str, seed: &str) -> Case {
    let case = Case::new(PUMP, "");
    let real = PUMP.replacen("radial_clearance_m = 1e-4", &format!("radial_clearance_m = {clearance_m}"), 1);
    let path = case.folder.path().join("real.toml").display().to_string();
    std::fs::write(&path, real).unwrap();
    let unbalance = ["--unbalance", "1=600@40", "--unbalance", "2=500@200"];
    let rest = ["--speeds", "500..4500:40", "--noise", "0.01,0.2", "--seed", seed, "--force"];
    let done = rotor_edge(&[&["simulate", &path, "-o", &case.data], &unbalance[..], &rest].concat());
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    case
}

/// The one number that is not as stated, with the true clearance inside its interval.
fn assert_is_clearance_of_a(answer: &Value, clearance_m: f64) {
    let [found] = &answer["not_as_stated"].as_array().unwrap()[..] else { panic!("{answer}") };
    assert_eq!([&found["bearing"], &found["symbol"], &found["unit"]], ["A", "clearance", "m"]);
    let [low, high] = [0, 1].map(|end| found["interval_95"][end].as_f64().unwrap());
    assert!(low < clearance_m && clearance_m < high, "{found}");
    let [least, most] = [0, 1].map(|end| found["stated_interval_95"][end].as_f64().unwrap());
    assert!(least < 1e-4 && 1e-4 < most && (high < least || low > most), "{found}");
    assert!((found["stated"].as_f64().unwrap() / 1e-4 - 1.0).abs() < 1e-9, "{found}");
}

#[test]
fn worn_bearing_is_named_in_text_and_json() {
    let case = pump_with("1.4e-4", "1");
    let text = String::from_utf8(rotor_edge(&case.diagnose()).stdout).unwrap();
    let says = [
        "adequate: ",
        "Bearing A is not as stated: clearance 1",
        "by the data alone instead of 100 µm",
        "; a worn bearing has a larger clearance.",
    ];
    assert_says(&text, &says);
    assert_eq!(text.matches("not as stated").count(), 1, "{text}");
    assert_is_clearance_of_a(&json(&case.diagnose()), 1.4e-4);
}

#[test]
fn sound_bearing_is_not_named() {
    let case = pump_with("1e-4", "1");
    assert_eq!(json(&case.diagnose())["not_as_stated"], Value::Array(Vec::new()));
    let text = String::from_utf8(rotor_edge(&case.diagnose()).stdout).unwrap();
    assert!(!text.contains("not as stated"), "{text}");
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn worn_bearing_of_every_seed_is_named_and_no_sound_one() {
        for seed in ["2", "3", "4", "5"] {
            let sound = json(&pump_with("1.05e-4", seed).diagnose());
            assert_eq!(sound["not_as_stated"], Value::Array(Vec::new()), "{sound}");
            assert_is_clearance_of_a(&json(&pump_with("1.4e-4", seed).diagnose()), 1.4e-4);
        }
    }

    #[test]
    fn improve_names_worn_and_tight_bearings() {
        let worn = pump_with("1.4e-4", "6");
        assert_is_clearance_of_a(&json(&worn.improve()), 1.4e-4);
        // a better file keeps what was stated, so the bearing stays named
        assert_is_clearance_of_a(&json(&["diagnose", &worn.new, &worn.data]), 1.4e-4);
        let tight = pump_with("0.7e-4", "6");
        let text = String::from_utf8(rotor_edge(&tight.improve()).stdout).unwrap();
        assert_says(&text, &["Bearing A is not as stated: clearance "]);
        assert!(!text.contains("worn bearing"), "{text}");
    }
}

//! `balance --trial-only` as a user meets it: no rotor's file, a table of runs and one of weights.

use std::path::Path;

use nalgebra::Complex;
use serde_json::Value;
use tempfile::TempDir;

use crate::program::{assert_says, json, one_sentence, refusal, rotor_edge};

type C = Complex<f64>;

const WEIGHTS: &str = "run,plane,magnitude_g_mm,angle_deg\nT1,A,25,0\nT2,B,25,90\nT3,A,25,90\nT3,B,20,180\n";
const ADDED: [(&str, [[f64; 2]; 2]); 4] = [
    ("base", [[0.0, 0.0], [0.0, 0.0]]),
    ("T1", [[25.0, 0.0], [0.0, 0.0]]),
    ("T2", [[0.0, 0.0], [25.0, 90.0]]),
    ("T3", [[25.0, 90.0], [20.0, 180.0]]),
];
/// Unbalance of the machine in both planes, g·mm and degrees.
const OWN: [[f64; 2]; 2] = [[30.0, 40.0], [20.0, -100.0]];

/// A machine of two planes and two probes, its runs and weights as files.
struct Machine {
    folder: TempDir,
}

fn polar([size, angle_deg]: [f64; 2]) -> C {
    C::from_polar(size, angle_deg.to_radians())
}

impl Machine {
    /// Phasors are turned round before they are written if `turned`.
    fn new(unit: &str, turned: bool) -> Self {
        let influence = [[C::new(1.2, -0.4), C::new(0.3, 0.8)], [C::new(0.2, 0.3), C::new(1.1, -0.2)]];
        let names = ["1X", "2X"].map(|p| format!("{p}_cos_{unit},{p}_sin_{unit}"));
        let mut text = format!("run,speed_rpm,{}\n", names.join(","));
        for (k, (run, added)) in ADDED.iter().enumerate() {
            for repeat in [0.999, 1.001] {
                text += &format!("{run},{}", 1445.7 + 2.0 * k as f64);
                for at in &influence {
                    let y: C = (0..2).map(|j| at[j] * (polar(OWN[j]) + polar(added[j]))).sum::<C>() * repeat;
                    text += &format!(",{:.6},{:.6}", y.re, if turned { y.im } else { -y.im });
                }
                text += "\n";
            }
        }
        let machine = Self { folder: tempfile::tempdir().unwrap() };
        machine.write("measured.csv", &text);
        machine.write("weights.csv", WEIGHTS);
        machine
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    fn write(&self, name: &str, text: &str) -> String {
        std::fs::write(self.path(name), text).unwrap();
        self.path(name)
    }

    fn arguments(&self, more: &[&str]) -> Vec<String> {
        let fixed = [
            "balance".into(),
            "--trial-only".into(),
            self.path("measured.csv"),
            "--weights".into(),
            self.path("weights.csv"),
        ];
        fixed.into_iter().chain(more.iter().map(|m| (*m).to_string())).collect()
    }

    fn run(&self, more: &[&str]) -> std::process::Output {
        let all = self.arguments(more);
        rotor_edge(&all.iter().map(String::as_str).collect::<Vec<_>>())
    }
}

fn vector(weight: &Value) -> C {
    polar([weight["magnitude_g_mm"].as_f64().unwrap(), weight["angle_deg"].as_f64().unwrap()])
}

#[test]
fn weights_from_tables_have_intervals_and_residual_vibration() {
    let answer = json(&Machine::new("um", false).run(&["--json"]));
    for (weight, own) in answer["weights"].as_array().unwrap().iter().zip(OWN) {
        assert!((vector(weight) + polar(own)).norm() < 0.05, "{weight}");
        let interval: Vec<f64> =
            weight["interval_95"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        assert!(interval[0] < own[0] && own[0] < interval[1], "{weight}");
    }
    let left = answer["left"].as_array().unwrap();
    assert_eq!(left.len(), 2);
    for l in left {
        assert!(l["probe"].is_string() && l["speed_rpm"].is_number());
        assert!(l["after_um"].as_f64().unwrap() < 0.01 * l["before_um"].as_f64().unwrap(), "{l}");
    }
    assert_says(&answer["doubts"].to_string(), &["from 1445.7 to 1451.7 rpm", "treated as one"]);
}

#[test]
fn weights_in_holes_and_mass_steps_are_printed_and_drawn() {
    let machine = Machine::new("um", false);
    let page = machine.path("balance.html");
    let output = machine.run(&["--holes", "12", "--radii-mm", "2", "--report", &page]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    // 30 g·mm at 220° lies between holes 8 at 210° and 9 at 240°
    assert_says(
        &text,
        &["A: add ", " g at 2 mm in hole 8, at 210° with the rotation", "hole 9, at 240°", "Static:"],
    );
    let page = std::fs::read_to_string(page).unwrap();
    assert_says(&page, &["Weights around the shaft", "in hole 8", "<figure"]);
    let stepped = json(&machine.run(&["--holes", "12", "--radii-mm", "2", "--step-g", "0.5", "--json"]));
    for piece in stepped["weights"].as_array().unwrap().iter().flat_map(|w| w["placed"].as_array().unwrap()) {
        let steps = piece["mass_g"].as_f64().unwrap() / 0.5;
        assert!((steps - steps.round()).abs() < 1e-9 && steps > 0.5, "{piece}");
    }
    // against the rotation, angles of weights and of trial weights both count that way
    let mirrored: String = WEIGHTS.replace(",90\n", ",-90\n");
    machine.write("weights.csv", &mirrored);
    let against = json(&machine.run(&["--against-rotation", "--json"]));
    let angle_deg = against["weights"][0]["angle_deg"].as_f64().unwrap();
    assert!((angle_deg - 140.0).abs() < 0.1, "{angle_deg}");
    assert_eq!(against["angles"], "against the rotation");
}

#[test]
fn min_max_reduces_largest_vibration_and_weight_limits_hold() {
    let machine = Machine::new("um", false);
    let largest = |more: &[&str]| {
        let answer = json(&machine.run(&[&["--json", "--planes", "A"], more].concat()));
        let all = answer["left"].as_array().unwrap().iter().map(|l| l["after_um"].as_f64().unwrap());
        (all.fold(0.0, f64::max), answer["weights"][0]["magnitude_g_mm"].as_f64().unwrap())
    };
    let (squares, least) = (largest(&[]), largest(&["--min-max"]));
    assert!(least.0 < squares.0 - 1e-3, "{least:?} {squares:?}");
    for more in [&["--largest-g-mm", "10"][..], &["--largest-g-mm", "A=10", "--min-max"]] {
        assert!((largest(more).1 - 10.0).abs() < 1e-5);
    }
}

#[test]
fn one_run_is_enough_with_the_coefficients_that_were_kept() {
    let machine = Machine::new("mil", false);
    let kept = machine.path("kept.toml");
    assert!(machine.run(&["--write-coefficients", &kept]).status.success());
    let all = std::fs::read_to_string(machine.path("measured.csv")).unwrap();
    let base: String = all
        .lines()
        .filter(|l| l.starts_with("run") || l.starts_with("base"))
        .map(|l| format!("{l}\n"))
        .collect();
    let now = machine.write("now.csv", &base);
    let answer = json(&rotor_edge(&["balance", "--trial-only", &now, "--coefficients", &kept, "--json"]));
    for (weight, own) in answer["weights"].as_array().unwrap().iter().zip(OWN) {
        assert!((vector(weight) + polar(own)).norm() < 0.1, "{weight}");
    }
    // amplitudes in mil are told in µm as well
    let left = &answer["left"][0];
    let ratio = left["before_um"].as_f64().unwrap() / left["before"].as_f64().unwrap();
    assert!((ratio - 25.4).abs() < 1e-9);
    assert_says(&answer["doubts"].to_string(), &["from earlier runs"]);
}

#[test]
fn velocity_is_balanced_as_it_is_and_has_no_amplitude_in_um() {
    let answer = json(&Machine::new("mm_s", false).run(&["--json"]));
    assert_eq!(answer["unit"], "mm_s");
    assert!(answer["left"][0]["before_um"].is_null() && answer["left"][0]["before"].is_number());
    assert!((vector(&answer["weights"][0]) + polar(OWN[0])).norm() < 0.05);
}

#[test]
fn grade_is_proportional_to_the_service_speed() {
    let kit = |file: &str| {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("sample/kit").join(file).display().to_string()
    };
    let (rotor, data) = (kit("rotor.toml"), kit("startup.csv"));
    let [slow, fast] = ["1500", "3000"]
        .map(|rpm| json(&rotor_edge(&["balance", &rotor, &data, "--json", "--service-rpm", rpm])));
    // G = e Ω (ISO 21940-11)
    let grade = |answer: &Value| answer["ways"][0]["grade_mm_s"]["before"].as_f64().unwrap();
    assert!((grade(&fast) / grade(&slow) - 2.0).abs() < 1e-9, "{} {}", grade(&slow), grade(&fast));
}

#[test]
fn a_rotors_file_takes_holes_limits_and_min_max_too() {
    let kit = |file: &str| {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("sample/kit").join(file).display().to_string()
    };
    let (rotor, data) = (kit("rotor.toml"), kit("startup.csv"));
    let answer = |more: &[&str]| json(&rotor_edge(&[&["balance", &rotor, &data, "--json"], more].concat()));
    let placed = |answer: &Value| -> Vec<Value> {
        let ways = answer["ways"].as_array().unwrap();
        assert_eq!(ways.len(), 2, "{answer}");
        let weights = ways.iter().flat_map(|way| way["weights"].as_array().unwrap());
        weights.flat_map(|w| w["placed"].as_array().unwrap()).cloned().collect()
    };
    let in_holes = placed(&answer(&["--holes", "8", "--radii-mm", "30", "--split", "1"]));
    let used: Vec<u64> = in_holes.iter().map(|p| p["hole"].as_u64().unwrap()).collect();
    assert!(used.iter().all(|hole| (1..=8).contains(hole)) && !used.is_empty());
    let taken = used[0].to_string();
    let elsewhere = placed(&answer(&["--holes", "8", "--radii-mm", "30", "--split", "1", "--taken", &taken]));
    assert!(elsewhere.iter().all(|p| p["hole"].as_u64().unwrap() != used[0]), "{taken}: {elsewhere:?}");
    for more in [&["--largest-g-mm", "2"][..], &["--largest-g-mm", "2", "--min-max"]] {
        let sizes: Vec<f64> =
            placed(&answer(more)).iter().map(|p| p["magnitude_g_mm"].as_f64().unwrap()).collect();
        assert!(
            sizes.iter().all(|size| *size <= 2.0 + 1e-6) && sizes.iter().any(|size| *size > 1.99),
            "{sizes:?}"
        );
    }
    let said = refusal(&["balance", &rotor, &data, "--holes", "8", "--taken", "9"]);
    assert_says(&said, &["there is no hole 9, expected 1 to 8"]);
    let said = refusal(&["balance", &rotor, &data, "--largest-g-mm", "nowhere=3"]);
    assert_says(&said, &["there is no plane \"nowhere\""]);
}

#[test]
fn reversed_phases_are_refused_with_or_without_rotor_file() {
    assert_says(
        &one_sentence(&Machine::new("um", true).run(&[])),
        &["measured.csv", "phases of all probes are reversed"],
    );
    let kit = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample/kit");
    let text = std::fs::read_to_string(kit.join("startup.csv")).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let sine: Vec<bool> = header.split(',').map(|c| c.ends_with("_sin_um")).collect();
    let turned = |line: &str| {
        let cell = |(cell, sine): (&str, &bool)| match (sine, cell.strip_prefix('-')) {
            (false, _) => cell.to_string(),
            (true, Some(positive)) => positive.to_string(),
            (true, None) => format!("-{cell}"),
        };
        line.split(',').zip(&sine).map(cell).collect::<Vec<_>>().join(",")
    };
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("turned.csv");
    let rows: Vec<String> = std::iter::once(header.to_string()).chain(lines.map(turned)).collect();
    std::fs::write(&data, rows.join("\n")).unwrap();
    let rotor = kit.join("rotor.toml").display().to_string();
    let said = refusal(&["balance", &rotor, &data.display().to_string()]);
    assert_says(&said, &["turned.csv: no weights: the phases are reversed"]);
}

#[test]
fn invalid_balance_input_is_refused_with_row_and_column() {
    let machine = Machine::new("um", false);
    let good = std::fs::read_to_string(machine.path("measured.csv")).unwrap();
    let page = machine.path("never.html");
    let kept = machine.path("never.toml");
    let said = |data: &str, weights: &str| {
        machine.write("measured.csv", data);
        machine.write("weights.csv", weights);
        let message = one_sentence(&machine.run(&["--report", &page, "--write-coefficients", &kept]));
        assert!(!Path::new(&page).exists() && !Path::new(&kept).exists(), "{message}");
        message
    };
    assert_says(
        &said(&good, &WEIGHTS.replace("T2,B,25", "T2,B,much")),
        &["weights.csv: row 3, column magnitude_g_mm", "\"much\" is not a number"],
    );
    assert_says(
        &said(&good, &WEIGHTS.replace("T2", "T9")),
        &["weights.csv: column run", "\"T9\" was not measured"],
    );
    assert_says(
        &said(&good.replacen("1445.7,", "fast,", 1), WEIGHTS),
        &["measured.csv: row 2, column speed_rpm", "\"fast\" is not a number"],
    );
    assert_says(
        &said(&good.replacen("2X_cos_um,2X_sin_um", "2X_cos_mm_s,2X_sin_mm_s", 1), WEIGHTS),
        &["measured.csv: header", "2X_cos_mm_s", "expected one unit"],
    );
    assert_says(&said("speed_rpm,x\n1000,1\n", WEIGHTS), &["header", "<probe>_cos_<unit>"]);
    let without_run = good.lines().map(|l| l.split_once(',').unwrap().1).collect::<Vec<_>>().join("\n");
    assert_says(&said(&without_run, WEIGHTS), &["header", "the column run is missing"]);
    // twice the same weight does not tell planes apart
    assert_says(
        &said(&good, "run,plane,magnitude_g_mm,angle_deg\nT1,A,25,0\nT1,B,25,0\nT2,A,25,0\nT2,B,25,0\n"),
        &["fixed proportions over the planes", "--write-coefficients"],
    );
    machine.write("measured.csv", &good);
    machine.write("weights.csv", WEIGHTS);
    assert_says(
        &one_sentence(&machine.run(&["--planes", "C"])),
        &["no plane \"C\", expected one of \"A\", \"B\""],
    );
    assert_says(&one_sentence(&machine.run(&["--same-speed", "0.0001"])), &["--same-speed", "0.14 %"]);
    let data = machine.path("measured.csv");
    assert_says(&refusal(&["balance", "--trial-only", &data]), &["--weights", "--coefficients"]);
}

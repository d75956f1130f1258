//! `startup` and `balance` as a user meets them, on single-disk kits from ROSS whose truth is known.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use nalgebra::{Complex, DVector};
use rotor_edge_desktop::measurement::{self, Reading};
use rotor_edge_desktop::model::Model;
use rotor_edge_desktop::rotor_file;
use rotor_edge_desktop::unbalance::phasor_kg_m;
use serde_json::Value;
use tempfile::TempDir;

use crate::program::{assert_says, json, refusal, rotor_edge};

const KITS: [&str; 5] = ["sample", "nothing", "bow", "angles", "coarse"];
const CLEARANCE_UM: f64 = 127.0;

/// Every kit once through `startup`: its files, and the answer.
static IMPROVED: LazyLock<Vec<(Kit, Value)>> = LazyLock::new(|| {
    let improved = |name| {
        let kit = Kit::new(name);
        let answer = kit.startup(&["--report", &kit.path("startup.html")]);
        (kit, answer)
    };
    KITS.map(improved).into()
});

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/kits").join(name)
}

/// A kit, and what was made of it.
struct Kit {
    name: &'static str,
    rotor: String,
    data: String,
    better: String,
    truth: Value,
    made: PathBuf,
}

impl Kit {
    fn new(name: &'static str) -> Self {
        let record = match name {
            "sample" => Path::new(env!("CARGO_MANIFEST_DIR")).join("sample/kit"),
            _ => folder(name),
        };
        let made = TempDir::new_in(env!("CARGO_TARGET_TMPDIR")).unwrap().keep();
        let truth = std::fs::read_to_string(folder(name).join("truth.json")).unwrap();
        let path = |file: &str| record.join(file).display().to_string();
        Self {
            name,
            rotor: path("rotor.toml"),
            data: path("startup.csv"),
            better: made.join("better.toml").display().to_string(),
            truth: serde_json::from_str(&truth).unwrap(),
            made,
        }
    }

    /// The answer, with the improved model written.
    fn startup(&self, more: &[&str]) -> Value {
        let mut all = vec!["startup", &self.rotor, &self.data, "-o", &self.better, "--json"];
        all.extend(more);
        json(&rotor_edge(&all))
    }

    fn path(&self, file: &str) -> String {
        self.made.join(file).display().to_string()
    }

    fn own_kg_m(&self) -> Complex<f64> {
        let own = &self.truth["own_unbalance_g_mm_deg"];
        phasor_kg_m(number(&own[0]), number(&own[1]))
    }

    /// Effects that are hidden in it, with their places, in order of name.
    fn hidden(&self) -> Vec<String> {
        named(&self.truth["effects"])
    }

    /// A file of the kit, changed by `change`, in the folder of what was made.
    fn changed(&self, file: &str, change: impl Fn(&str) -> String) -> String {
        let from = if file.ends_with("toml") { &self.rotor } else { &self.data };
        let to = self.made.join(file);
        std::fs::write(&to, change(&std::fs::read_to_string(from).unwrap())).unwrap();
        to.display().to_string()
    }
}

fn named(effects: &Value) -> Vec<String> {
    let name = |e: &Value| format!("{}@{}", e["effect"].as_str().unwrap(), e["at"].as_str().unwrap_or("-"));
    let mut all: Vec<String> = effects.as_array().unwrap().iter().map(name).collect();
    all.sort();
    all
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn resonance_rpm(parameters: &Value) -> f64 {
    (number(&parameters["k"]) / number(&parameters["m"])).sqrt() * 30.0 / std::f64::consts::PI
}

/// Largest distance between model and truth at the same moment of a turn, over all readings, µm: half the sum of what
/// turns forward and backward.
fn largest_error_um(kit: &Kit) -> f64 {
    let rotor = rotor_file::read(Path::new(&kit.better)).unwrap();
    let clean = measurement::read(&folder(kit.name).join("clean.csv"), &rotor).unwrap();
    let model = Model::finite_elements(&rotor);
    let plane = &rotor.plane[0];
    let own = phasor_kg_m(plane.unbalance_g_mm.unwrap(), plane.angle_deg.unwrap());
    let error = |r: &Reading| {
        let run = rotor.run.iter().find(|run| Some(&run.name) == r.run.as_ref()).unwrap();
        let added = run.added_unbalance.iter().map(|a| phasor_kg_m(a.magnitude_g_mm, a.angle_deg));
        let all = DVector::from_element(1, own + added.sum::<Complex<f64>>());
        let shown = model.response_under(r.speed_rad_s(), &all).unwrap().at(&all);
        let off: Vec<Complex<f64>> =
            shown.iter().zip(&r.probes).map(|(y, true_)| y - true_.unwrap()).collect();
        // both probes of a bearing, at right angles
        let i = Complex::<f64>::i();
        off.chunks(2).map(|d| 0.5 * ((d[0] + i * d[1]).norm() + (d[0] - i * d[1]).norm())).fold(0.0, f64::max)
    };
    clean.iter().filter(|r| r.speed_rpm >= 600.0).map(error).fold(0.0, f64::max) * 1e6
}

#[test]
fn incomplete_run_ups_give_partial_results_with_remarks() {
    let kit = Kit::new("nothing");
    let cut = |to_rpm: f64| {
        move |text: &str| {
            let keep =
                |line: &&str| line.split(',').nth(1).unwrap().parse::<f64>().is_ok_and(|rpm| rpm <= to_rpm);
            let lines = text.lines().take(1).chain(text.lines().skip(1).filter(keep));
            lines.collect::<Vec<_>>().join("\n")
        }
    };
    let remarks = |rotor: &str, data: &str| {
        let answer = json(&rotor_edge(&["startup", rotor, data, "--json"]));
        (answer["remarks"].to_string(), answer)
    };
    // no resonance in range
    let below = refusal(&["startup", &kit.rotor, &kit.changed("below.csv", cut(1000.0))]);
    assert_says(&below, &["below.csv", "resonance"]);
    // the upper half-power point is outside: circle and least squares answer
    let (said, answer) = remarks(&kit.rotor, &kit.changed("upper.csv", cut(1850.0)));
    assert!(said.contains("half-power point"), "{said}");
    let methods = &answer["estimates"]["IB x"]["methods"];
    assert!(
        methods["half_power"].is_null() && number(&methods["least_squares"]["natural_rpm"]["value"]) > 1000.0
    );
    // masses without an angle
    let without_angle = |block: &str| match block.contains("[[run.added_unbalance]]") {
        true => block.lines().filter(|l| !l.starts_with("angle_deg")).collect::<Vec<_>>().join("\n"),
        false => block.to_string(),
    };
    let unstated =
        kit.changed("unstated.toml", |t| t.split("\n\n").map(without_angle).collect::<Vec<_>>().join("\n\n"));
    let unstated = remarks(&unstated, &kit.data);
    assert!(unstated.0.contains("has no angle_deg"), "{}", unstated.0);
    // clearance missing
    assert!(unstated.0.contains("--clearance-um"), "{}", unstated.0);
    let stated = kit.startup(&["--clearance-um", "100"]);
    assert_eq!((&stated["clearance_um"], &stated["clearance_assumed"]), (&100.0.into(), &false.into()));
    for (arguments, parts) in [
        (vec!["--clearance-um=-3"], ["--clearance-um", "positive"]),
        (vec!["--mass-kg", "nan"], ["--mass-kg", "positive"]),
    ] {
        assert_says(&refusal(&[vec!["startup", &kit.rotor, &kit.data], arguments].concat()), &parts);
    }
    let planes = refusal(&["balance", &kit.rotor, &kit.data, "--planes", "hub"]);
    assert_says(&planes, &["there is no plane \"hub\"", "\"disk\""]);
}

/// What only `tests/all` runs.
mod slow {
    use super::*;

    #[test]
    fn hidden_effects_of_all_kits_are_found_and_model_equals_ross() {
        println!(
            "kit        hidden                                   own unbalance off   pedestal off   largest error"
        );
        for (kit, answer) in IMPROVED.iter() {
            let name = kit.name;
            let improved = &answer["improved"];
            assert_eq!(improved["verdict"], "adequate", "{name}");
            assert_eq!(named(&improved["effects"]), kit.hidden(), "{name}");
            let own = &improved["own_unbalance"][0];
            let found = phasor_kg_m(number(&own["g_mm"]), number(&own["angle_deg"]));
            let ratio = found / kit.own_kg_m();
            assert!(
                (ratio.norm() - 1.0).abs() < 0.03 && ratio.arg().to_degrees().abs() < 3.0,
                "{name}: {ratio}"
            );
            let truth = kit.truth["effects"].as_array().unwrap().iter().find(|e| e["effect"] == "pedestal");
            let resonance = truth.map(|e| {
                number(&improved["pedestal_resonance_rpm"][0]["rpm"]) / resonance_rpm(&e["parameters"]) - 1.0
            });
            assert!(resonance.is_none_or(|off| off.abs() < 0.03), "{name}: {resonance:?}");
            let bow_is_hidden = kit.hidden().iter().any(|e| e.starts_with("shaft_bow"));
            assert_eq!(
                improved["shaft_bow_not_added"].is_null(),
                bow_is_hidden,
                "{name}: bow or own unbalance"
            );
            let percent = 100.0 * largest_error_um(kit) / CLEARANCE_UM;
            println!(
                "{name:<10} {:<40} {:>6.2} % {:>6.2}°   {:>8}   {percent:>8.2} %",
                kit.hidden().join(" "),
                100.0 * (ratio.norm() - 1.0),
                ratio.arg().to_degrees(),
                resonance.map_or("–".into(), |off| format!("{:.2} %", 100.0 * off)),
            );
            assert!(percent < 3.0, "{name}: {percent} % of the clearance");
        }
    }

    #[test]
    fn simple_model_fits_at_1000_rpm_and_fails_at_3600_as_in_paper() {
        let answer = &IMPROVED[0].1;
        let errors = &answer["error_percent_of_clearance"];
        for bearing in ["IB", "OB"] {
            for run in ["0 g", "0.4 g", "0.8 g", "1.2 g"] {
                assert!(number(&errors["1000"][bearing][run]) < 5.0, "{bearing} {run}: {errors}");
            }
        }
        // grows with the added mass, and is far outside at the largest
        let at = |run: &str| number(&errors["3600"]["IB"][run]);
        assert!(at("0.4 g") < at("0.8 g") && at("0.8 g") < at("1.2 g") && at("1.2 g") > 25.0, "{errors}");
        let stages = answer["stages"].as_array().unwrap();
        let largest = |s: &Value| number(&s["largest_error_percent_of_clearance"]);
        assert!(
            largest(&stages[0]) > 30.0 && largest(&stages[stages.len() - 1]) < 6.0,
            "with the noise of the readings"
        );
        // bearings that soften: more mass, more damping ratio
        for direction in answer["estimates"].as_object().unwrap().values() {
            assert!(number(&direction["shift"]["damping_ratio"]["sigmas"]) > 4.0);
        }
        for direction in IMPROVED[1].1["estimates"].as_object().unwrap().values() {
            assert!(number(&direction["shift"]["damping_ratio"]["sigmas"]).abs() < 4.0);
        }
    }

    #[test]
    fn identified_model_removes_95_percent_of_unbalance_in_one_shot() {
        println!("kit        true unbalance left: by the model   by trial runs alone");
        for (kit, _) in IMPROVED.iter() {
            let name = kit.name;
            let answer = json(&rotor_edge(&["balance", &kit.better, &kit.data, "--json"]));
            assert_eq!(answer["angles"], "with the rotation");
            let left = |way: usize| {
                let weight = &answer["ways"][way]["weights"][0];
                let added = phasor_kg_m(number(&weight["unbalance_g_mm"]), number(&weight["angle_deg"]));
                (kit.own_kg_m() + added).norm() / kit.own_kg_m().norm()
            };
            println!("{name:<10} {:>33.2} % {:>19.2} %", 100.0 * left(0), 100.0 * left(1));
            // a bow is balanced with the unbalance, as far as a weight can, and so its weight is another
            if name != "bow" {
                assert!(left(0) < 0.05, "{name}: {}", left(0));
            }
            let ways = answer["ways"].as_array().unwrap();
            assert!(
                number(&ways[0]["vibration_um"]["reduction"]) > if name == "bow" { 0.5 } else { 0.95 },
                "{name}"
            );
            let grade = &ways[0]["grade_mm_s"];
            assert!(number(&grade["after_at_most"]) >= number(&grade["after"]));
            // what the other way finds on a machine that is not linear is told apart from what it finds on one that is
            let doubted = answer["remarks"].to_string().contains("trial runs contradict");
            let softens = kit.hidden().iter().any(|e| e.starts_with("nonlinear"));
            assert_eq!(doubted, softens, "{name}: {}", answer["remarks"]);
        }
    }

    #[test]
    fn weights_keep_mass_steps_and_angles_against_rotation_mirror() {
        let kit = Kit::new("nothing");
        let with = json(&rotor_edge(&["balance", &kit.rotor, &kit.data, "--json"]));
        let stepped = ["--radii-mm", "30,25", "--step-g", "0.05", "--against-rotation"];
        let against =
            json(&rotor_edge(&[&["balance", &kit.rotor, &kit.data, "--json"], stepped.as_slice()].concat()));
        let weight = |answer: &Value| answer["ways"][0]["weights"][0].clone();
        let [plain, placed] = [&with, &against].map(weight);
        assert!((number(&plain["angle_deg"]) + number(&placed["angle_deg"]) - 360.0).abs() < 1e-9);
        let steps = number(&placed["mass_g"]) / 0.05;
        assert!((steps - steps.round()).abs() < 1e-9 && steps > 0.5);
        let made = number(&placed["mass_g"]) * number(&placed["radius_mm"]);
        assert!((made - number(&placed["placed_g_mm"])).abs() < 1e-9);
        assert_eq!(against["angles"], "against the rotation");
        let text = String::from_utf8(rotor_edge(&["balance", &kit.rotor, &kit.data]).stdout).unwrap();
        assert_says(&text, &["with the rotation", "trial runs alone", "balance grade G", "ISO 21940-11"]);
    }

    #[test]
    fn startup_and_balance_reports_show_every_figure() {
        let kit = &IMPROVED[0].0;
        let text = std::fs::read_to_string(kit.path("startup.html")).unwrap();
        for part in
            ["Bode IB x", "identified points", "Orbits at OB, run 1.2 g", "Error by speed", "improved model"]
        {
            assert!(text.contains(part), "{part}");
        }
        let page = kit.path("balance.html");
        let output = rotor_edge(&["balance", &kit.better, &kit.data, "--report", &page]);
        assert!(output.status.success());
        assert!(std::fs::read_to_string(&page).unwrap().contains("with weights by the identified model"));
    }

    #[test]
    fn simple_model_needs_one_run_and_one_probe_per_bearing() {
        let kit = Kit::new("nothing");
        let one_run = kit.changed("one.csv", |t| {
            let keep = |line: &&str| line.starts_with("run,") || line.starts_with("0.8 g,");
            t.lines().filter(keep).collect::<Vec<_>>().join("\n")
        });
        let answer = json(&rotor_edge(&["startup", &kit.rotor, &one_run, "--json"]));
        let of = |answer: &Value, direction: &str| {
            number(&answer["estimates"][direction]["methods"]["least_squares"]["natural_rpm"]["value"])
        };
        assert!((of(&answer, "IB x") / of(&IMPROVED[1].1, "IB x") - 1.0).abs() < 0.02);
        let blocks = |t: &str| {
            let keep = |block: &&str| !block.contains("IBY") && !block.contains("OBY");
            t.split("\n\n").filter(keep).collect::<Vec<_>>().join("\n\n")
        };
        let rotor = kit.changed("x_only.toml", blocks);
        let data = kit.changed("x_only.csv", |t| {
            let keep = |line: &str| {
                let cells: Vec<&str> = line.split(',').collect();
                [&cells[..4], &cells[6..8]].concat().join(",")
            };
            t.lines().map(keep).collect::<Vec<_>>().join("\n")
        });
        let answer = json(&rotor_edge(&["startup", &rotor, &data, "--json"]));
        let directions: Vec<&String> = answer["estimates"].as_object().unwrap().keys().collect();
        assert_eq!(directions.len(), 2, "{directions:?}");
    }
}

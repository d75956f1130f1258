//! `balance --trial-only` on runs that contradict each other, have no phase, or state weights in other units.

use std::f64::consts::PI;

use serde_json::Value;
use tempfile::TempDir;

use crate::program::{assert_says, json, one_sentence, rotor_edge};

/// A machine of one plane, its phases as lag.
const RUNS: &str = "run,speed_rpm,P_cos_um,P_sin_um\nR0,300,-246.202,43.412\nR1,300,-231.837,44.417\n\
    R2,300,-200.114,46.635\nR3,300,-137.268,51.029\nR4,300,-170.137,-35.356\nR5,300,-173.379,127.185\n";
const WEIGHTS: &str = "run,plane,magnitude_g_mm,angle_deg\nR1,A,4.8,-135\nR2,A,15.4,-135\nR3,A,36.4,-135\n\
    R4,A,36.5,-85\nR5,A,37,180\n";

fn balance(data: &str, weights: &str) -> (TempDir, std::process::Output) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str, text: &str| {
        let path = folder.path().join(name).display().to_string();
        std::fs::write(&path, text).unwrap();
        path
    };
    let (data, weights) = (at("runs.csv", data), at("weights.csv", weights));
    let output = rotor_edge(&["balance", "--trial-only", &data, "--weights", &weights, "--json"]);
    (folder, output)
}

fn only_weight(answer: &Value) -> [f64; 2] {
    let weight = &answer["weights"][0];
    ["magnitude", "angle_deg"].map(|key| weight[key].as_f64().unwrap())
}

#[test]
fn one_wrong_weight_is_named_and_does_not_move_the_answer() {
    let answer = json(&balance(RUNS, &WEIGHTS.replace("36.5,-85", "36.5,-135")).1);
    let [size, angle_deg] = only_weight(&answer);
    assert!((size - 83.33).abs() < 0.1 && (angle_deg - 239.0).abs() < 0.1, "{size} {angle_deg}");
    assert_says(
        &answer["doubts"].to_string(),
        &[
            "The run \\\"R4\\\" contradicts the other runs and is left out",
            "1.00 times its weight, 50° from the stated angle",
        ],
    );
}

#[test]
fn reversed_phases_and_a_wrong_weight_are_both_named() {
    let lead: String = RUNS
        .lines()
        .map(|line| match line.rsplit_once(',') {
            Some((rest, sin)) if line.starts_with('R') => match sin.strip_prefix('-') {
                Some(sin) => format!("{rest},{sin}\n"),
                None => format!("{rest},-{sin}\n"),
            },
            _ => format!("{line}\n"),
        })
        .collect();
    let (_folder, output) = balance(&lead, &WEIGHTS.replace("36.5,-85", "36.5,-135"));
    assert_says(
        &one_sentence(&output),
        &[
            "the phases of all probes are reversed",
            "without the run \"R4\"",
            "check its weight and its readings",
        ],
    );
}

#[test]
fn contradicting_runs_give_no_weight_that_is_worse_than_none() {
    let data = "run,speed_rpm,1X_cos_um,1X_sin_um,2X_cos_um,2X_sin_um\nbase,1450,50.3,-6.0,-8.0,10.5\n\
        T1,1450,80.3,4.0,-3.0,3.0\nT2,1450,30.3,-13.5,-3.0,-16.9\nT3,1450,54.3,-20.0,-37.5,1.6\n";
    let weights = "run,plane,magnitude_g_mm,angle_deg\nT1,A,25,0\nT2,A,25,90\nT3,A,25,90\nT3,A,20,180\n";
    let answer = json(&balance(data, weights).1);
    let left = answer["left"].as_array().unwrap();
    let squares = |key: &str| left.iter().map(|l| l[key].as_f64().unwrap().powi(2)).sum::<f64>();
    assert!(squares("after") <= squares("before"), "{answer}");
    assert_says(&answer["doubts"].to_string(), &["contradict each other by 3"]);
}

#[test]
fn answers_are_in_the_unit_of_the_trial_weights() {
    // the same numbers in another unit are the same answer in it
    for (unit, symbol, g_mm) in
        [("oz_in", "oz·in", Some(720.077_887)), ("kg_mm", "kg·mm", Some(1e3)), ("g", "g", None)]
    {
        let weights = WEIGHTS.replace("magnitude_g_mm", &format!("magnitude_{unit}"));
        let answer = json(&balance(RUNS, &weights).1);
        let [size, _] = only_weight(&answer);
        assert!((size - 83.33).abs() < 0.1, "{unit}: {size}");
        assert_eq!(answer["weight_unit"], symbol);
        let text = answer["weights"][0]["text"].as_str().unwrap();
        assert!(text.starts_with(&format!("A: add 83.33 {symbol}, at 239°")), "{text}");
        match g_mm {
            Some(g_mm) => {
                let in_g_mm = answer["weights"][0]["magnitude_g_mm"].as_f64().unwrap();
                assert!((in_g_mm / size / g_mm - 1.0).abs() < 1e-6, "{unit}: {in_g_mm}");
            }
            None => assert!(answer["weights"][0]["magnitude_g_mm"].is_null()),
        }
    }
    let semicolons = WEIGHTS.replace(',', ";").replace('.', ",");
    let [size, angle_deg] = only_weight(&json(&balance(RUNS, &semicolons).1));
    assert!((size - 83.33).abs() < 0.1 && (angle_deg - 239.0).abs() < 0.1, "{size} {angle_deg}");
}

#[test]
fn amplitudes_without_phase_give_a_weight_and_its_ambiguity() {
    let weights =
        "run,plane,magnitude_g_mm,angle_deg\nat0,fan,9000,0\nat120,fan,9000,120\nat240,fan,9000,240\n";
    let table = |rows: &[(&str, f64)]| {
        let rows: String = rows.iter().map(|(run, um)| format!("{run},1480,{um}\n")).collect();
        format!("Run,Speed [rpm],Fan DE 1X Amp [um pp]\n{rows}")
    };
    // |100 + 40 e^{i 30°} e^{iφ}| at φ of 0, 120 and 240°: 100 / 40 = 2.5 times the trial, at 180° − 30°
    let effect = |turn_deg: f64| {
        let phase = (30.0_f64 + turn_deg).to_radians();
        (100.0 + 40.0 * phase.cos()).hypot(40.0 * phase.sin())
    };
    let exact =
        [("asfound", 100.0), ("at0", effect(0.0)), ("at120", effect(120.0)), ("at240", effect(240.0))];
    let answer = json(&balance(&table(&exact), weights).1);
    let [size, angle_deg] = only_weight(&answer);
    assert!((size / 22_500.0 - 1.0).abs() < 1e-4 && (angle_deg - 150.0).abs() < 0.01, "{size} {angle_deg}");
    assert_says(&answer["doubts"].to_string(), &["Phases were not measured"]);
    let rounded = [("asfound", 152.0), ("at0", 198.0), ("at120", 172.0), ("at240", 105.0)];
    let answer = json(&balance(&table(&rounded), weights).1);
    assert!((only_weight(&answer)[1] - 220.4).abs() < 1.0, "{answer}");
    assert_says(&answer["doubts"].to_string(), &["gives 2.57 times the trial weight (2312"]);
    // 2 mm/s zero-to-peak at 1480 rpm are 2000 / 155.0 µm
    let velocity = table(&exact.map(|(run, size)| (run, size / 50.0))).replace("um pp", "mm/s pk");
    let answer = json(&balance(&velocity, weights).1);
    assert!((only_weight(&answer)[0] / 22_500.0 - 1.0).abs() < 1e-4, "{answer}");
    let before = answer["left"][0]["before"].as_f64().unwrap();
    assert!((before / (2000.0 / (1480.0 * PI / 30.0)) - 1.0).abs() < 1e-4, "{before}");
    // what cannot be of another quantity needs no name of a probe and no word for an amplitude
    for header in ["Fan DE um pp", "Vib (mm/s rms)", "[um pp]"] {
        let named = table(&rounded).replace("Fan DE 1X Amp [um pp]", header);
        let answer = json(&balance(&named, weights).1);
        assert!((only_weight(&answer)[1] - 220.4).abs() < 1.0, "{header}: {answer}");
    }
    let bare = table(&rounded).replace("1X Amp [um pp]", "um");
    let says = one_sentence(&balance(&bare, weights).1);
    assert_says(&says, &["does not state pk-pk, 0-pk or rms, expected that in its header"]);
    let few = one_sentence(
        &balance(&table(&rounded[..3]), &weights[..weights.len() - "at240,fan,9000,240\n".len()]).1,
    );
    assert_says(&few, &["alike", "one more run with the trial weight at another angle"]);
}

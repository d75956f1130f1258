//! Monitors on a shared bus as a user runs them: `node`, `deploy`, `key`, and `replay` over each interface. What takes time is
//! in `simulated/deployment.rs` and `simulated/flag.rs`.

use crate::bench::Bench;
use crate::program::{assert_says, json, one_sentence, refusal, rotor_edge};

#[test]
fn replay_over_slcan_and_socketcand_equals_in_process_replay() {
    let bench = Bench::new();
    let here = json(&rotor_edge(&["replay", "--json", "--answers"]));
    assert_eq!(here["answers"].as_array().unwrap().len(), 451);
    for kind in ["slcan", "socketcand"] {
        let there = bench.play(kind, &[]);
        for key in ["answers", "flags", "states", "equivalence", "counters"] {
            assert_eq!(there[key], here[key], "{key} over {kind}");
        }
        assert_eq!(there["frames"]["lost"], 0, "{kind}");
    }
}

#[test]
fn deployment_by_real_programs_survives_a_power_cut() {
    let bench = Bench::new();
    bench.guess();
    let [model, key, state, guess] =
        ["identified.toml", "right.key", "monitor.state", "rotor-of-node.toml"].map(|name| bench.text(name));
    let node = || bench.node("slcan", &["--rotor", &guess, "--key", &key, "--state", &state]);
    let deploy = |more: &[&str]| {
        let bus = bench.bus.spec("socketcand");
        rotor_edge(&[&["deploy", &model, "--bus", bus, "--key", &key, "--counter"], more].concat())
    };
    let (running, line) = node();
    assert_says(&line, &["with the model it was started with"]);
    let told = json(&deploy(&["5", "--json"]));
    assert_eq!((&told["outcome"], &told["counter"]), (&"accepted".into(), &5.into()));
    let ended = ["changed", "reference_dropped", "lowered"].map(|key| told[key].clone());
    assert_eq!(ended, [true.into(), true.into(), serde_json::Value::Null]);
    let again = json(&deploy(&["6", "--json"]));
    assert_eq!((&again["outcome"], &again["changed"]), (&"accepted".into(), &false.into()));
    let again = deploy(&["7"]);
    assert!(again.status.success());
    assert_says(
        &String::from_utf8(again.stdout).unwrap(),
        &["Monitor 1 runs this model already: nothing changed"],
    );
    let deployed = format!("Model {:08x} was deployed", told["model_checksum"].as_u64().unwrap());
    assert_says(&running.said_until(" was deployed"), &[&deployed]);
    let (_running, line) = node();
    assert_says(&line, &["with the model deployed last"]);
    assert_says(&one_sentence(&deploy(&["5"])), &["has accepted command", "--counter"]);
}

#[test]
fn model_of_another_machine_is_refused_unless_told() {
    let bench = Bench::new();
    let (key, state) = (bench.text("right.key"), bench.text("monitor.state"));
    let identified = bench.text("identified.toml");
    let (_running, _) = bench.node("slcan", &["--key", &key, "--state", &state]);
    let deploy = |more: &[&str]| bench.to_monitor("deploy", &[more, &["--json"]].concat());
    assert_eq!(json(&deploy(&[&identified]))["outcome"], "accepted", "nothing is held yet");

    let improved = bench.text("improved.toml");
    let bowed = ["add", &identified, "shaft_bow", "--data", &bench.text("runup.csv"), "-o", &improved];
    assert!(rotor_edge(&bowed).status.success());
    assert_eq!(json(&deploy(&[&improved]))["outcome"], "accepted", "the same machine, found better");

    let text = std::fs::read_to_string(&identified).unwrap();
    let other = bench.text("other.toml");
    std::fs::write(&other, text.replacen("name = \"turbine\"", "name = \"turbine\"\nserial = \"2\"", 1))
        .unwrap();
    assert_says(&one_sentence(&deploy(&[&other])), &["the model of another machine", "--another-machine"]);
    assert_eq!(json(&deploy(&[&other, "--another-machine"]))["outcome"], "accepted");
    assert_says(&one_sentence(&deploy(&[&identified])), &["--another-machine"]);
}

#[test]
fn wrong_keys_and_missing_keys_are_told_apart() {
    let bench = Bench::new();
    bench.guess();
    let (model, right, wrong) =
        (bench.text("identified.toml"), bench.text("right.key"), bench.text("wrong.key"));
    let bus = bench.bus.spec("slcan").to_string();
    let attempt = |key: &str, node: &str| {
        refusal(&["deploy", &model, "--bus", &bus, "--key", key, "--node", node, "--json"])
    };
    let _keyed = bench.monitor("slcan", &["--key", &right, "--state", &bench.text("monitor.state")]);
    let _keyless = bench.monitor("slcan", &["--node", "2"]);
    assert_says(&attempt(&wrong, "1"), &["another key"]);
    assert_says(&attempt(&right, "2"), &["was given no key"]);
    assert_says(&attempt(&right, "31"), &["0 to 30"]);
    assert_says(&attempt(&bench.text("no.key"), "1"), &["no.key", "rotor-edge key"]);
    assert_says(&attempt(&bench.text("record.csv"), "1"), &["record.csv", "64 hexadecimal digits"]);
    assert_says(&refusal(&["key", "-o", &right]), &["right.key", "cannot be written"]);
    let zeros = bench.text("zero.key");
    std::fs::write(&zeros, "0".repeat(64)).unwrap();
    assert_says(&attempt(&zeros, "1"), &["zero.key", "made at random"]);
    let open = bench.text("open.key");
    std::fs::copy(&right, &open).unwrap();
    std::fs::set_permissions(&open, std::os::unix::fs::PermissionsExt::from_mode(0o622)).unwrap();
    assert_says(&attempt(&open, "1"), &["open.key", "written by others"]);
    let forgetful = rotor_edge(&["node", "--bus", &bus, "--key", &right]);
    assert_eq!(forgetful.status.code(), Some(2), "a key needs a state");
    let unidentified = bench.text("rotor.toml");
    let refused = refusal(&["deploy", &unidentified, "--bus", &bus, "--key", &right]);
    assert_says(&refused, &["unbalance_g_mm is missing", "identify"]);
}

#[test]
fn damaged_state_file_lets_no_recorded_command_in() {
    let bench = Bench::new();
    let (key, state) = (bench.text("right.key"), bench.text("monitor.state"));
    let deploy = |more: &[&str]| {
        bench.to_monitor("deploy", &[&[&bench.text("identified.toml"), "--json"], more].concat())
    };
    // the last one is whole but for its code
    for text in [
        "not a state at all",
        "rotor-edge monitor 2\ncounter 41",
        "rotor-edge monitor 1\ncounter 41\nmodel 03\n",
    ] {
        std::fs::write(&state, text).unwrap();
        let (running, line) = bench.node("slcan", &["--key", &key, "--state", &state]);
        assert_says(&line, &["without a model"]);
        // no command that was ever recorded can be above the present time
        assert_says(&one_sentence(&deploy(&["--counter", "1000"])), &["has accepted command"]);
        assert_eq!(json(&deploy(&[]))["outcome"], "accepted");
        assert_eq!(std::fs::read_to_string(format!("{state}.damaged")).unwrap(), text);
        drop(running);
        let (_again, line) = bench.node("slcan", &["--key", &key, "--state", &state]);
        assert_says(&line, &["with the model deployed last"]);
    }
}

#[test]
fn state_file_of_other_monitor_or_key_or_modified_is_refused() {
    let bench = Bench::new();
    let (key, state) = (bench.text("right.key"), bench.text("monitor.state"));
    let (running, _) = bench.node("slcan", &["--key", &key, "--state", &state]);
    assert_eq!(
        json(&bench.to_monitor("deploy", &[&bench.text("identified.toml"), "--counter", "5000", "--json"]))["outcome"],
        "accepted"
    );
    drop(running);
    let bus = bench.bus.spec("slcan");
    let start = |key: &str, node: &str| {
        refusal(&["node", "--bus", bus, "--key", key, "--state", &state, "--node", node])
    };
    let told = ["monitor.state: is not the state of this monitor"];
    assert_says(&start(&key, "2"), &told);
    assert_says(&start(&bench.text("wrong.key"), "1"), &told);
    let whole = std::fs::read_to_string(&state).unwrap();
    std::fs::write(&state, whole.replacen("counter 5000", "counter 4000", 1)).unwrap();
    assert_says(&start(&key, "1"), &told);
}

#[test]
fn thresholds_set_over_bus_survive_restart_and_need_key() {
    let bench = Bench::new();
    bench.guess();
    let (key, state) = (bench.text("right.key"), bench.text("monitor.state"));
    let node = || bench.monitor("slcan", &["--key", &key, "--state", &state]);
    let running = node();
    let before = json(&bench.to_monitor("thresholds", &["--json"]));
    assert_eq!((&before["set"], &before["thresholds"]["rise"]), (&false.into(), &0.5.into()));
    let text = String::from_utf8(bench.to_monitor("thresholds", &["--set", "rise=0.8"]).stdout).unwrap();
    assert_says(&text, &["Monitor 1 judges by", "rise", "0.8", "(was 0.5)"]);
    let set = ["--set", "persistence_s=30", "--set", "gap_range_v=-16,-4.5", "--json"];
    let after = json(&bench.to_monitor("thresholds", &set));
    assert_eq!(after["thresholds"]["rise"], 0.8, "one at a time");
    drop(running);
    let _running = node();
    let kept = json(&bench.to_monitor("thresholds", &["--json"]))["thresholds"].clone();
    assert_eq!(kept, after["thresholds"]);
    assert_eq!(kept["gap_range_v"], serde_json::json!([-16.0, -4.5]));
    let restored = json(&bench.to_monitor("thresholds", &["--defaults", "--json"]));
    assert_eq!(restored["thresholds"], before["thresholds"]);

    let refused = |set: &str| one_sentence(&bench.to_monitor("thresholds", &["--set", set]));
    assert_says(&refused("rise=-1"), &["rise is to be from 0 to 100", "nothing was sent"]);
    assert_says(&refused("height=1"), &["no threshold height", "persistence_s"]);
    let (bus, wrong) = (bench.bus.spec("slcan"), bench.text("wrong.key"));
    let forged = refusal(&["thresholds", "--bus", bus, "--key", &wrong, "--set", "rise=0.1"]);
    assert_says(&forged, &["another key"]);
    assert_eq!(json(&bench.to_monitor("thresholds", &["--json"]))["thresholds"], before["thresholds"]);
}

#[test]
fn thresholds_set_at_the_start_of_a_node_are_told_over_the_bus() {
    let bench = Bench::new();
    bench.guess();
    let (key, state) = (bench.text("right.key"), bench.text("monitor.state"));
    let set = ["--set", "average_s=0", "--set", "growth_s=1.25e-6", "--set", "learning_s=0"];
    let _running = bench.monitor("slcan", &[&["--key", &key, "--state", &state], &set[..]].concat());
    let thresholds = json(&bench.to_monitor("thresholds", &["--json"]))["thresholds"].clone();
    let told = ["average_s", "growth_s", "learning_s"].map(|name| thresholds[name].as_f64().unwrap());
    assert_eq!(told, [0.0, 1.25e-6, 0.0]);
    assert_says(&one_sentence(&bench.to_monitor("acknowledge", &[])), &["monitor 1 holds no flag"]);
}

//! Forty machines with something hidden.

use rotor_edge::command::{Listener, object};
use rotor_edge::sample;
use serde_json::{Value, json};

use crate::program::Studio;

const MACHINES: u64 = 40;

#[test]
fn verdict_on_forty_hidden_machines_is_that_of_diagnose() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(file("rotor.toml"), sample::ROTOR).unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    for seed in 1..=MACHINES {
        studio.changed("open", &json!({ "what": "hidden", "seed": seed }));
        studio.changed("save", &json!({ "what": "readings", "path": "data.csv", "overwrite": true }));
        let words = ["diagnose", &file("rotor.toml"), &file("data.csv"), "--json"];
        let said = object(words.map(Into::into), Listener::Terminal).unwrap();
        let said: Value = serde_json::from_str(&said).unwrap();
        let session = studio.diagnosed();
        assert_eq!(session["verdict"]["word"], said["verdict"], "{seed}");
        assert_eq!(session["verdict"]["sentence"], said["summary"], "{seed}");
    }
}

//! From the sample to the better rotor's file, as a person does it.

use std::path::Path;

use rotor_edge::command::{Listener, object};
use rotor_edge::sample;
use serde_json::json;

use crate::browser::Browser;
use crate::client;
use crate::program::Studio;

const SCREEN: [u32; 2] = [1280, 800];

/// What `add` writes for these effects, one after another, on the sample.
fn added(folder: &Path, effects: &[&str]) -> String {
    let file = |name: &str| folder.join(name).display().to_string();
    std::fs::write(file("rotor.toml"), sample::ROTOR).unwrap();
    std::fs::write(file("data.csv"), sample::RUNUP_DAY_126).unwrap();
    let mut rotor = "rotor.toml".to_string();
    for (k, effect) in effects.iter().enumerate() {
        let output = format!("step-{k}.toml");
        let words =
            ["add", &file(&rotor), effect, "--data", &file("data.csv"), "-o", &file(&output), "--json"];
        object(words.map(Into::into), Listener::Terminal).unwrap();
        rotor = output;
    }
    std::fs::read_to_string(file(&rotor)).unwrap()
}

#[test]
fn sample_is_adequate_after_four_clicks_and_saved_as_add_writes() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    let Some(mut browser) = Browser::open(&studio.address, SCREEN) else { return };
    browser.keep("studio-start");
    browser.click("#open-sample");
    browser.wait_for_verdict("missing");
    assert!(browser.text("#sentence").starts_with("seal@disk 3 is missing"));
    browser.keep("studio-open");
    browser.click("#places [data-place='disk 3']");
    browser.click("#effects [data-effect='seal']");
    browser.wait("document.querySelector('#preview li')");
    browser.keep("studio-preview");
    browser.click("#add");
    browser.wait_for_verdict("adequate");
    assert!(browser.text("#sentence").starts_with("The misfit is noise"));
    assert_eq!(browser.value("document.querySelectorAll('#fall li').length"), 2);
    browser.keep("studio-adequate");

    browser.click("#save");
    browser.write("#saving input[name=path]", "better.toml");
    browser.click("#saving-save");
    browser.wait("!document.getElementById('saving').open");
    let saved = std::fs::read_to_string(folder.path().join("better.toml")).unwrap();
    assert_eq!(saved, added(folder.path(), &["seal@disk 3"]));
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

#[test]
fn two_effects_are_saved_as_two_add_commands_write_them() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    studio.changed("open", &client::sample());
    studio.changed("preview", &json!({ "effect": "seal", "at": "disk 3" }));
    studio.changed("add", &json!({ "effect": "seal", "at": "disk 3" }));
    // what is looked at and left does not matter
    studio.changed("preview", &json!({ "effect": "disk_skew", "at": "disk 1" }));
    let session = studio.changed("add", &json!({ "effect": "shaft_bow", "at": null }));
    studio.changed("save", &json!({ "what": "rotor", "path": "better.toml" }));
    let saved = std::fs::read_to_string(folder.path().join("better.toml")).unwrap();
    assert_eq!(saved, added(folder.path(), &["seal@disk 3", "shaft_bow"]));
    let commands: Vec<&str> =
        session["commands"].as_array().unwrap().iter().filter_map(|c| c.as_str()).collect();
    let expected = [
        "rotor-edge add rotor.toml 'seal@disk 3' --data runup-day126.csv -o better-1.toml",
        "rotor-edge add better-1.toml shaft_bow --data runup-day126.csv -o better.toml",
        "rotor-edge diagnose better.toml runup-day126.csv",
    ];
    assert_eq!(commands, expected);
}

#[test]
fn dropped_files_are_opened() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    let Some(mut browser) = Browser::open(&studio.address, SCREEN) else { return };
    let files = [("mine.csv", sample::RUNUP_DAY_0), ("mine.toml", sample::ROTOR)];
    let drop = |files: &[(&str, &str)]| {
        format!(
            "(() => {{ const data = new DataTransfer(); for (const [name, text] of {}) data.items.add(new File([text], name)); \
             document.body.dispatchEvent(new DragEvent('drop', {{ dataTransfer: data, bubbles: true }})); }})()",
            json!(files)
        )
    };
    browser.value(&drop(&files[..1]));
    browser.wait("!document.getElementById('message').hidden");
    assert!(browser.text("#message").starts_with("expected one rotor's file"));
    browser.value(&drop(&files));
    browser.wait_for_verdict("adequate");
    assert!(browser.text("#files").contains("mine.toml, mine.csv"));
}

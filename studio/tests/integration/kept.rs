//! A session outlives its browser, and, once it has a file, its program.

use std::path::Path;

use serde_json::json;

use crate::browser::Browser;
use crate::client;
use crate::program::Studio;

#[test]
fn browser_that_closes_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    studio.changed("open", &client::sample());
    studio.changed("add", &json!({ "effect": "seal", "at": "disk 3" }));
    let Some(mut browser) = Browser::open(&studio.address, [1280, 800]) else { return };
    browser.wait_for_verdict("adequate");
    browser.click("#undo");
    browser.wait_for_verdict("missing");
    drop(browser);
    let Some(mut browser) = Browser::open(&studio.address, [1280, 800]) else { return };
    browser.wait_for_verdict("missing");
    browser.click("#redo");
    browser.wait_for_verdict("adequate");
    assert!(browser.text("#commands pre").contains("rotor-edge add rotor.toml 'seal@disk 3'"));
}

#[test]
fn session_file_follows_every_change_and_is_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    studio.changed("open", &client::sample());
    studio.changed("save", &json!({ "what": "session", "path": "session.json" }));
    studio.changed("add", &json!({ "effect": "seal", "at": "disk 3" }));
    studio.changed("branch", &json!({ "branch": null }));
    studio.changed("undo", &json!({}));
    studio.changed("add", &json!({ "effect": "seal", "at": "disk 2" }));
    let mask = json!({ "runs": [], "probes": ["16Y"], "speeds_rpm": null });
    let before = studio.changed("leave_out", &mask);
    // killed, not ended
    drop(studio);
    let again = Studio::start(folder.path(), &["--session", "session.json"]);
    let after = again.diagnosed();
    for key in ["steps", "mask", "commands"] {
        assert_eq!(after[key], before[key], "{key}");
    }
    assert_eq!(after["branches"].as_array().unwrap().len(), 2);
    assert_eq!(after["session_file"], "session.json");
}

/// Names of the recovery files below a folder.
fn recovery_files(folder: &Path) -> Vec<String> {
    let kept = std::fs::read_dir(folder.join("state/rotor-edge/recovery"));
    let names = kept.into_iter().flatten().flatten().map(|file| file.file_name().display().to_string());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

#[test]
fn unsaved_session_of_ended_studio_is_offered_and_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    studio.changed("open", &client::sample());
    assert_eq!(recovery_files(folder.path()), [""; 0], "nothing was done yet");
    let before = studio.changed("add", &json!({ "effect": "seal", "at": "disk 3" }));
    assert_eq!(recovery_files(folder.path()).len(), 1);
    studio.interrupt();

    let studio = Studio::start::<&str>(folder.path(), &[]);
    let Some(mut browser) = Browser::open(&studio.address, [1280, 800]) else { return };
    let said = browser.text("#unsaved span");
    assert!(
        said.starts_with("An unsaved session of rotor.toml, runup-day126.csv (with seal at disk 3,"),
        "{said}"
    );
    browser.keep("studio-unsaved");
    browser.click("#unsaved button.main");
    browser.wait_for_verdict("adequate");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
    drop(browser);
    assert_eq!(studio.diagnosed()["steps"], before["steps"]);
    // killed before anything else was done
    drop(studio);
    assert_eq!(recovery_files(folder.path()).len(), 1);
    let studio = Studio::start::<&str>(folder.path(), &[]);
    let name = &recovery_files(folder.path())[0];
    studio.changed("open", &json!({ "what": "recovered", "name": name }));
    studio.changed("save", &json!({ "what": "session", "path": "session.json" }));
    assert_eq!(recovery_files(folder.path()), [""; 0], "it is saved");
    studio.changed("undo", &json!({}));
    assert_eq!(recovery_files(folder.path()), [""; 0], "its file follows");
}

#[test]
fn each_session_has_its_own_recovery_file_until_dismissed() {
    let folder = tempfile::tempdir().unwrap();
    let studios = [(); 2].map(|()| Studio::start::<&str>(folder.path(), &[]));
    for studio in &studios {
        studio.changed("open", &client::sample());
        studio.changed("branch", &json!({ "branch": null }));
    }
    assert_eq!(recovery_files(folder.path()).len(), 2);
    // another session in the first studio leaves the one before
    studios[0].changed("open", &client::sample());
    studios[0].changed("branch", &json!({ "branch": null }));
    assert_eq!(recovery_files(folder.path()).len(), 3);
    drop(studios);
    let bad = folder.path().join("state/rotor-edge/recovery/0-bad.json");
    std::fs::write(&bad, "{").unwrap();
    let studio = Studio::start::<&str>(folder.path(), &[]);
    let unsaved = studio.state()["unsaved"].clone();
    let usable: Vec<bool> =
        unsaved.as_array().unwrap().iter().map(|offer| offer["is_usable"].as_bool().unwrap()).collect();
    assert_eq!(usable, [true, true, true, false], "{unsaved}");
    let refused = studio.refusal("open", &json!({ "what": "recovered", "name": "0-bad.json" }));
    assert!(refused.contains("expected the file of a session") && bad.is_file(), "{refused}");
    for name in recovery_files(folder.path()) {
        assert_eq!(studio.ask("dismiss", &json!({ "name": name })).status, 200);
    }
    assert_eq!(studio.state()["unsaved"], json!([]));
    assert_eq!(recovery_files(folder.path()), [""; 0]);
}

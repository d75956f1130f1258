//! A session outlives its browser, and, once it has a file, its program.

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
